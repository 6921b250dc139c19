// Housing of a gear unit of one or two stages, open at the top: a box with a bearing seat at both
// ends of two or three parallel shafts along y, ribs under the seats, and a foot at each corner.
// Lengths in m. Volume "body"; surfaces "input_front", "input_back", "output_front", "output_back"
// (bores of the seats), of two stages "middle_front", "middle_back", and "feet" (undersides of the
// four feet). The origin lies in the middle of the bottom.
SetFactory("OpenCASCADE");
DefineConstant[
  L = {0.36, Name "L"},              // outer length, along x
  W = {0.20, Name "W"},              // outer width, along y
  H = {0.20, Name "H"},              // outer height, along z
  t = {0.008, Name "t"},             // wall
  a = {0.15, Name "a"},              // distance of the shafts; of two stages from input to middle
  a_2 = {0, Name "a_2"},             // distance from middle to output; 0: one stage
  z_s = {0.11, Name "z_s"},          // height of the shafts above the bottom
  d_1 = {0.052, Name "d_1"},         // bore of the input seats
  d_2 = {0.072, Name "d_2"},         // bore of the output seats
  d_m = {0.062, Name "d_m"},         // bore of the middle seats, of two stages
  w_s = {0.012, Name "w_s"},         // wall of a seat
  l_s = {0.030, Name "l_s"},         // length of a seat, along y, inwards from the outer face
  t_r = {0.008, Name "t_r"},         // thickness of a rib
  b_f = {0.040, Name "b_f"},         // side of a foot
  h_f = {0.012, Name "h_f"},         // height of a foot
  lc = {0.010, Name "lc"}            // element size
];
x_s() = {-(a + a_2) / 2};
d_s() = {d_1};
If (a_2 > 0)
  x_s() += {(a - a_2) / 2};
  d_s() += {d_m};
EndIf
x_s() += {(a + a_2) / 2};
d_s() += {d_2};
last = #x_s() - 1;
For i In {0:last}
  D = d_s(i) + 2 * w_s;
  before = i > 0 ? i - 1 : last;
  If (i > 0 && x_s(i) - x_s(before) <= (D + d_s(before)) / 2 + w_s)
    Error("the seats overlap: shafts %g apart, bores of %g and %g", x_s(i) - x_s(before), d_s(before), d_s(i));
    Abort;
  EndIf
  If (z_s - D / 2 <= t || z_s + D / 2 >= H)
    Error("a seat of diameter %g at z_s = %g leaves the wall of height %g", D, z_s, H);
    Abort;
  EndIf
  If (Fabs(x_s(i)) + D / 2 >= L / 2 - t || 2 * l_s >= W || l_s <= t)
    Error("seats do not fit: L = %g, W = %g, l_s = %g, t = %g", L, W, l_s, t);
    Abort;
  EndIf
EndFor
// solid parts
Box(1) = {-L / 2, -W / 2, 0, L, W, H};
parts() = {};
For i In {0:3}
  x = (i < 2 ? -1 : 1) * (L / 2 - b_f / 2) - b_f / 2;
  y = (i % 2 == 0 ? -1 : 1) * (W / 2 + b_f / 4) - b_f / 2;
  foot = newv; Box(foot) = {x, y, -h_f, b_f, b_f, h_f + t};
  parts() += {foot};
EndFor
// hollow first, so that seats and ribs keep their material inside
Box(2) = {-L / 2 + t, -W / 2 + t, t, L - 2 * t, W - 2 * t, H};
shell() = BooleanDifference{ Volume{1}; Delete; }{ Volume{2}; Delete; };
For i In {0:last}
  x = x_s(i);
  For s In {-1:1:2}
    seat = newv; Cylinder(seat) = {x, s * W / 2, z_s, 0, -s * l_s, 0, d_s(i) / 2 + w_s};
    rib = newv; Box(rib) = {x - t_r / 2, s > 0 ? W / 2 - l_s : -W / 2, t / 2, t_r, l_s, z_s - t / 2};
    parts() += {seat, rib};
  EndFor
EndFor
body() = BooleanUnion{ Volume{shell()}; Delete; }{ Volume{parts()}; Delete; };
bores() = {};
For i In {0:last}
  bore = newv; Cylinder(bore) = {x_s(i), -W, z_s, 0, 2 * W, 0, d_s(i) / 2};
  bores() += {bore};
EndFor
solid() = BooleanDifference{ Volume{body()}; Delete; }{ Volume{bores()}; Delete; };
Physical Volume("body") = {solid()};
e = 1e-5;
For i In {0:last}
  x = x_s(i);
  d = d_s(i);
  For s In {-1:1:2}
    y = s > 0 ? W / 2 - l_s : -W / 2;
    seat() = Surface In BoundingBox{x - d / 2 - e, y - e, z_s - d / 2 - e, x + d / 2 + e, y + l_s + e, z_s + d / 2 + e};
    If (i == 0 && s < 0) Physical Surface("input_front") = {seat()}; EndIf
    If (i == 0 && s > 0) Physical Surface("input_back") = {seat()}; EndIf
    If (i == last && s < 0) Physical Surface("output_front") = {seat()}; EndIf
    If (i == last && s > 0) Physical Surface("output_back") = {seat()}; EndIf
    If (0 < i && i < last && s < 0) Physical Surface("middle_front") = {seat()}; EndIf
    If (0 < i && i < last && s > 0) Physical Surface("middle_back") = {seat()}; EndIf
  EndFor
EndFor
feet() = Surface In BoundingBox{-L, -W, -h_f - e, L, W, -h_f + e};
Physical Surface("feet") = {feet()};
// Inside and outside of the walls get different meshes: the same on both makes flat tetrahedra.
finer = 0.85;
MeshSize { PointsOf { Volume{solid()}; } } = lc;
inner() = Point In BoundingBox{-L / 2 + t - e, -W / 2 + t - e, t - e, L / 2 - t + e, W / 2 - t + e, H + e};
MeshSize { inner() } = finer * lc;
Mesh.MeshSizeMin = finer * lc;
Mesh.MeshSizeMax = lc;
