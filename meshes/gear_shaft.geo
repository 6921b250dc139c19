// Round shaft along z from the origin with two journals and the seat of a wheel. Lengths in m.
// Volume "body"; surfaces "journal_a", "wheel", "journal_b" (bands around the shaft).
SetFactory("OpenCASCADE");
DefineConstant[
  L = {0.4, Name "L"},                   // length of the shaft
  d = {0.04, Name "d"},                  // its diameter
  z_a = {0.05, Name "z_a"},              // middle of the first journal
  z_w = {0.17, Name "z_w"},              // middle of the wheel
  z_b = {0.35, Name "z_b"},              // middle of the second journal
  l_j = {0.025, Name "l_j"},             // length of the journals
  b = {0.03, Name "b"},                  // face width of the wheel
  lc = {0.012, Name "lc"}                // element size
];
If (z_a - l_j / 2 <= 0 || z_a + l_j / 2 >= z_w - b / 2 || z_w + b / 2 >= z_b - l_j / 2 || z_b + l_j / 2 >= L)
  Error("journals at z_a = %g and z_b = %g and the wheel at z_w = %g must lie apart, on a shaft of L = %g",
    z_a, z_b, z_w, L);
  Abort;
EndIf
cuts() = {0, z_a - l_j / 2, z_a + l_j / 2, z_w - b / 2, z_w + b / 2, z_b - l_j / 2, z_b + l_j / 2, L};
For k In {0:6}
  Cylinder(k + 1) = {0, 0, cuts(k), 0, 0, cuts(k + 1) - cuts(k), d / 2};
EndFor
parts() = BooleanFragments{ Volume{1}; Delete; }{ Volume{2:7}; Delete; };
Physical Volume("body", 1) = {parts()};
e = 1e-4 * d;
r = d / 2 + e;
For k In {1:5:2}
  band() = Surface In BoundingBox{-r, -r, cuts(k) - e, r, r, cuts(k + 1) + e};
  band() -= Surface In BoundingBox{-r, -r, cuts(k) - e, r, r, cuts(k) + e};
  band() -= Surface In BoundingBox{-r, -r, cuts(k + 1) - e, r, r, cuts(k + 1) + e};
  If (k == 1)
    Physical Surface("journal_a", 11) = {band()};
  ElseIf (k == 3)
    Physical Surface("wheel", 12) = {band()};
  Else
    Physical Surface("journal_b", 13) = {band()};
  EndIf
EndFor
Mesh.MeshSizeMin = lc;
Mesh.MeshSizeMax = lc;
