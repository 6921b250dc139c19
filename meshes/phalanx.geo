// Bone of a finger along z from the origin: a cylinder with round edges, a bore for the cable towards
// the palm (x), parallel to the axis, and a pad for the touch. Lengths in m.
// Volume "body"; surfaces "proximal" and "distal" (flat ends), "pad" (palm side, near the distal end).
SetFactory("OpenCASCADE");
DefineConstant[
  L = {0.018, Name "L"},             // length
  D = {0.014, Name "D"},             // diameter
  R = {0.00125, Name "R"},           // radius of the round edges
  d = {0.0015, Name "d"},            // diameter of the bore
  e = {0.0045, Name "e"},            // distance of its axis from that of the bone
  l_pad = {0.005, Name "l_pad"},     // length of the pad, along z
  w_pad = {0.006, Name "w_pad"},     // width of the pad, along y
  m_pad = {0.001, Name "m_pad"},     // from the pad to the round edge of the distal end
  lc = {0.003, Name "lc"}            // element size
];
If (e + d / 2 >= D / 2 - R)
  Error("the bore e = %g, d = %g must stay within the flat ends of radius D / 2 - R = %g", e, d, D / 2 - R);
  Abort;
EndIf
If (R <= 0 || w_pad >= D)
  Error("round edges R = %g must be positive, a pad of w_pad = %g narrower than D = %g", R, w_pad, D);
  Abort;
EndIf
If (l_pad + m_pad + 2 * R >= L)
  Error("a pad of l_pad = %g does not fit L = %g", l_pad, L);
  Abort;
EndIf
Cylinder(1) = {0, 0, 0, 0, 0, L, D / 2};
Rotate { {0, 0, 1}, {0, 0, 0}, Pi } { Volume{1}; } // the seam of the cylinder away from the pad
t = 1e-4 * D;
rims() = Curve In BoundingBox{-D, -D, -t, D, D, t};
rims() += Curve In BoundingBox{-D, -D, L - t, D, D, L + t};
bone() = Fillet{1}{rims()}{R};
Cylinder(2) = {e, 0, -L, 0, 0, 3 * L, d / 2};
bored() = BooleanDifference{ Volume{bone()}; Delete; }{ Volume{2}; Delete; };
half = Asin(w_pad / D);
z_pad = L - R - m_pad - l_pad;
arc = newc;
Circle(arc) = {0, 0, z_pad, D / 2, -half, half};
print() = Extrude {0, 0, l_pad} { Curve{arc}; };
body() = BooleanFragments{ Volume{bored()}; Delete; }{ Surface{print(1)}; Delete; };
vol() = Volume In BoundingBox{-D, -D, -L, D, D, 2 * L};
Physical Volume("body", 1) = {vol()};
Physical Surface("proximal", 11) = Surface In BoundingBox{-D, -D, -t, D, D, t};
Physical Surface("distal", 12) = Surface In BoundingBox{-D, -D, L - t, D, D, L + t};
Physical Surface("pad", 13) = Surface In BoundingBox{
  D / 2 * Cos(half) - t, -w_pad / 2 - t, z_pad - t, D / 2 + t, w_pad / 2 + t, z_pad + l_pad + t};
// A coarse circle would cut deep into the thin wall beside the bore.
MeshSize { Point In BoundingBox{e - d, -d, -L, e + d, d, 2 * L} } = lc / 3;
Mesh.MeshSizeMax = lc;
