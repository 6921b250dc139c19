// Sandwich panel along x: a core between two faces, hexahedra. Lengths in m. Volumes "core" and
// "faces"; surfaces "root" (x = 0) and "tip" (x = L). The middle of the core is z = 0.
SetFactory("OpenCASCADE");
DefineConstant[
  L = {0.4, Name "L"},            // length
  b = {0.1, Name "b"},            // width, along y
  core = {0.02, Name "core"},     // thickness of the core, along z
  face = {0.002, Name "face"},    // thickness of each face
  nx = {16, Name "nx"},           // hexahedra along x
  ny = {4, Name "ny"},            // ... along y
  nc = {2, Name "nc"}             // ... through the core; one through each face
];
Box(1) = {0, -b/2, -core/2, L, b, core};
Box(2) = {0, -b/2, core/2, L, b, face};
Box(3) = {0, -b/2, -core/2 - face, L, b, face};
Coherence;
e = 1e-6 * L;
h = core/2 + face;
Physical Volume("core", 1) = Volume In BoundingBox{-e, -b, -core/2 - e, L + e, b, core/2 + e};
Physical Volume("faces", 2) = {
  Volume In BoundingBox{-e, -b, core/2 - e, L + e, b, h + e},
  Volume In BoundingBox{-e, -b, -h - e, L + e, b, -core/2 + e}
};
Physical Surface("root", 11) = Surface In BoundingBox{-e, -b, -h - e, e, b, h + e};
Physical Surface("tip", 12) = Surface In BoundingBox{L - e, -b, -h - e, L + e, b, h + e};
along_x() = {};
along_y() = {};
all() = Curve In BoundingBox{-e, -b, -h - e, L + e, b, h + e};
through_core() = {};
through_face() = {};
For i In {0 : #all() - 1}
  box() = BoundingBox Curve {all(i)};
  If (box(3) - box(0) > L/2)
    along_x() += all(i);
  ElseIf (box(4) - box(1) > b/2)
    along_y() += all(i);
  ElseIf (Fabs(box(2) + box(5)) < e)
    through_core() += all(i);
  Else
    through_face() += all(i);
  EndIf
EndFor
Transfinite Curve {along_x()} = nx + 1;
Transfinite Curve {along_y()} = ny + 1;
Transfinite Curve {through_core()} = nc + 1;
Transfinite Curve {through_face()} = 2;
Transfinite Surface {:};
Recombine Surface {:};
Transfinite Volume {:};
