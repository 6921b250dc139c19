// Rectangular slab of a rockfall gallery, spanning along x. Lengths in m.
// Volume "body"; surfaces "impact" (a square in the middle of the top, z = h), "support_left" and
// "support_right" (strips along the ends of the underside, z = 0).
SetFactory("OpenCASCADE");
DefineConstant[
  L = {4.5, Name "L"},              // length, along x
  B = {3.5, Name "B"},              // width, along y
  h = {0.25, Name "h"},             // thickness
  patch = {0.7, Name "patch"},      // edge of the square under the cushion
  seat = {0.15, Name "seat"},       // width of the strips on the supports
  lc = {0.28, Name "lc"}            // element size
];
If (patch >= B || patch >= L - 2 * seat)
  Error("the impact needs room between the supports: patch = %g < B = %g and < L - 2 seat = %g",
    patch, B, L - 2 * seat);
  Abort;
EndIf
Box(1) = {-L / 2, -B / 2, 0, L, B, h};
Rectangle(11) = {-patch / 2, -patch / 2, h, patch, patch};
Rectangle(12) = {-L / 2, -B / 2, 0, seat, B};
Rectangle(13) = {L / 2 - seat, -B / 2, 0, seat, B};
BooleanFragments{ Volume{1}; Delete; }{ Surface{11 : 13}; Delete; }
e = 1e-5 * L;
p = patch / 2 + e;
Physical Volume("body", 1) = {1};
Physical Surface("impact", 11) = Surface In BoundingBox{-p, -p, h - e, p, p, h + e};
Physical Surface("support_left", 12) =
  Surface In BoundingBox{-L / 2 - e, -B, -e, -L / 2 + seat + e, B, e};
Physical Surface("support_right", 13) =
  Surface In BoundingBox{L / 2 - seat - e, -B, -e, L / 2 + e, B, e};
Mesh.MeshSizeMin = lc;
Mesh.MeshSizeMax = lc;
