// Round shaft along z from the origin with two journals and one or two wheels. Lengths in m.
// Volume "body"; surfaces "journal_a", "wheel", "journal_b" (bands around the shaft, or the rim of a
// wheel that is thicker), "wheel_2" with a second wheel, and the end faces "end_a" and "end_b".
SetFactory("OpenCASCADE");
DefineConstant[
  L = {0.4, Name "L"},                   // length of the shaft
  d = {0.04, Name "d"},                  // its diameter
  z_a = {0.05, Name "z_a"},              // middle of the first journal
  z_w = {0.17, Name "z_w"},              // middle of the wheel
  z_b = {0.35, Name "z_b"},              // middle of the second journal
  l_j = {0.025, Name "l_j"},             // length of the journals
  b = {0.03, Name "b"},                  // face width of the wheel
  D = {0, Name "D"},                     // diameter of the wheel; 0: that of the shaft
  z_2 = {0.25, Name "z_2"},              // middle of the second wheel, if there is one
  b_2 = {0, Name "b_2"},                 // its face width; 0: none
  D_2 = {0, Name "D_2"},                 // its diameter; 0: that of the shaft
  lc = {0.012, Name "lc"}                // element size
];
two = b_2 > 0;
last = two ? z_2 + b_2 / 2 : z_w + b / 2;
If (z_a - l_j / 2 <= 0 || z_a + l_j / 2 >= z_w - b / 2 || last >= z_b - l_j / 2 || z_b + l_j / 2 >= L)
  Error("journals at z_a = %g and z_b = %g and the wheel at z_w = %g must lie apart, on a shaft of L = %g",
    z_a, z_b, z_w, L);
  Abort;
EndIf
If (two && z_w + b / 2 >= z_2 - b_2 / 2)
  Error("the wheels at z_w = %g and z_2 = %g overlap", z_w, z_2);
  Abort;
EndIf
If ((D > 0 && D < d) || (D_2 > 0 && D_2 < d))
  Error("wheels of D = %g and D_2 = %g are thinner than the shaft of d = %g", D, D_2, d);
  Abort;
EndIf
cuts() = {0, z_a - l_j / 2, z_a + l_j / 2, z_w - b / 2, z_w + b / 2};
wide() = {d, d, d, D > 0 ? D : d};
If (two)
  cuts() += {z_2 - b_2 / 2, z_2 + b_2 / 2};
  wide() += {d, D_2 > 0 ? D_2 : d};
EndIf
cuts() += {z_b - l_j / 2, z_b + l_j / 2, L};
wide() += {d, d, d};
n = #wide();
For k In {0:n-1}
  Cylinder(k + 1) = {0, 0, cuts(k), 0, 0, cuts(k + 1) - cuts(k), wide(k) / 2};
EndFor
parts() = BooleanFragments{ Volume{1}; Delete; }{ Volume{2:n}; Delete; };
Physical Volume("body", 1) = {parts()};
e = 1e-4 * d;
For k In {1:n-2:2}
  r = wide(k) / 2 + e;
  band() = Surface In BoundingBox{-r, -r, cuts(k) - e, r, r, cuts(k + 1) + e};
  band() -= Surface In BoundingBox{-r, -r, cuts(k) - e, r, r, cuts(k) + e};
  band() -= Surface In BoundingBox{-r, -r, cuts(k + 1) - e, r, r, cuts(k + 1) + e};
  If (k == 1)
    Physical Surface("journal_a", 11) = {band()};
  ElseIf (k == 3)
    Physical Surface("wheel", 12) = {band()};
  ElseIf (k == n - 2)
    Physical Surface("journal_b", 13) = {band()};
  Else
    Physical Surface("wheel_2", 14) = {band()};
  EndIf
EndFor
r = d / 2 + e;
Physical Surface("end_a", 15) = Surface In BoundingBox{-r, -r, -e, r, r, e};
Physical Surface("end_b", 16) = Surface In BoundingBox{-r, -r, L - e, r, r, L + e};
Mesh.MeshSizeMin = lc;
Mesh.MeshSizeMax = lc;
