// Housing of a single-stage gear unit, open at the top: a box with a bearing seat at both ends of
// two parallel shafts along y, ribs under the seats, and a foot at each corner. Lengths in m.
// Volume "body"; surfaces "input_front", "input_back", "output_front", "output_back" (bores of the
// seats) and "feet" (undersides of the four feet). The origin lies in the middle of the bottom.
SetFactory("OpenCASCADE");
DefineConstant[
  L = {0.36, Name "L"},              // outer length, along x
  W = {0.20, Name "W"},              // outer width, along y
  H = {0.20, Name "H"},              // outer height, along z
  t = {0.008, Name "t"},             // wall
  a = {0.15, Name "a"},              // distance of the shafts
  z_s = {0.11, Name "z_s"},          // height of the shafts above the bottom
  d_1 = {0.052, Name "d_1"},         // bore of the input seats
  d_2 = {0.072, Name "d_2"},         // bore of the output seats
  w_s = {0.012, Name "w_s"},         // wall of a seat
  l_s = {0.030, Name "l_s"},         // length of a seat, along y, inwards from the outer face
  t_r = {0.008, Name "t_r"},         // thickness of a rib
  b_f = {0.040, Name "b_f"},         // side of a foot
  h_f = {0.012, Name "h_f"},         // height of a foot
  lc = {0.010, Name "lc"}            // element size
];
D_1 = d_1 + 2 * w_s; D_2 = d_2 + 2 * w_s;
If (a <= (D_1 + D_2) / 2)
  Error("the seats overlap: shafts %g apart, seats of diameter %g and %g", a, D_1, D_2);
  Abort;
EndIf
If (z_s - D_2 / 2 <= t || z_s + D_2 / 2 >= H || z_s - D_1 / 2 <= t || z_s + D_1 / 2 >= H)
  Error("seats of diameter %g and %g at z_s = %g leave the wall of height %g", D_1, D_2, z_s, H);
  Abort;
EndIf
If (a / 2 + D_2 / 2 >= L / 2 - t || a / 2 + D_1 / 2 >= L / 2 - t || 2 * l_s >= W || l_s <= t)
  Error("seats do not fit: L = %g, W = %g, l_s = %g, t = %g", L, W, l_s, t);
  Abort;
EndIf
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
For i In {0:3}
  x = (i < 2 ? -1 : 1) * a / 2;
  D = i < 2 ? D_1 : D_2;
  s = i % 2 == 0 ? -1 : 1;
  seat = newv; Cylinder(seat) = {x, s * W / 2, z_s, 0, -s * l_s, 0, D / 2};
  rib = newv; Box(rib) = {x - t_r / 2, s > 0 ? W / 2 - l_s : -W / 2, t / 2, t_r, l_s, z_s - t / 2};
  parts() += {seat, rib};
EndFor
body() = BooleanUnion{ Volume{shell()}; Delete; }{ Volume{parts()}; Delete; };
bores() = {};
For i In {0:1}
  x = (i == 0 ? -1 : 1) * a / 2;
  d = i == 0 ? d_1 : d_2;
  bore = newv; Cylinder(bore) = {x, -W, z_s, 0, 2 * W, 0, d / 2};
  bores() += {bore};
EndFor
solid() = BooleanDifference{ Volume{body()}; Delete; }{ Volume{bores()}; Delete; };
Physical Volume("body") = {solid()};
e = 1e-5;
For i In {0:3}
  x = (i < 2 ? -1 : 1) * a / 2;
  d = i < 2 ? d_1 : d_2;
  s = i % 2 == 0 ? -1 : 1;
  y = s > 0 ? W / 2 - l_s : -W / 2;
  seat() = Surface In BoundingBox{x - d / 2 - e, y - e, z_s - d / 2 - e, x + d / 2 + e, y + l_s + e, z_s + d / 2 + e};
  If (i == 0) Physical Surface("input_front") = {seat()}; EndIf
  If (i == 1) Physical Surface("input_back") = {seat()}; EndIf
  If (i == 2) Physical Surface("output_front") = {seat()}; EndIf
  If (i == 3) Physical Surface("output_back") = {seat()}; EndIf
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
