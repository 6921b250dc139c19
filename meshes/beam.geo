// Rectangular beam along x. Lengths in m. Volume "body"; surfaces "root" (x = 0) and "tip" (x = L).
SetFactory("OpenCASCADE");
DefineConstant[
  L = {1.0, Name "L"},        // length
  b = {0.05, Name "b"},       // width, along y
  h = {0.03, Name "h"},       // height, along z
  lc = {0.05, Name "lc"},     // element size of tetrahedra
  hex = {0, Name "hex"},      // 1: a regular grid of hexahedra instead
  nx = {20, Name "nx"},       // hexahedra along x
  ny = {2, Name "ny"},        // ... along y
  nz = {2, Name "nz"}         // ... along z
];
Box(1) = {0, -b/2, -h/2, L, b, h};
e = 1e-6 * L;
Physical Volume("body", 1) = {1};
Physical Surface("root", 11) = Surface In BoundingBox{-e, -b, -h, e, b, h};
Physical Surface("tip", 12) = Surface In BoundingBox{L - e, -b, -h, L + e, b, h};
If (hex)
  along_x() = Curve In BoundingBox{-e, -b, -h, L + e, b, h};
  along_y() = {};
  along_z() = {};
  For i In {0 : #along_x() - 1}
    box() = BoundingBox Curve {along_x(i)};
    If (box(4) - box(1) > b/2)
      along_y() += along_x(i);
    ElseIf (box(5) - box(2) > h/2)
      along_z() += along_x(i);
    EndIf
  EndFor
  along_x() -= along_y();
  along_x() -= along_z();
  Transfinite Curve {along_x()} = nx + 1;
  Transfinite Curve {along_y()} = ny + 1;
  Transfinite Curve {along_z()} = nz + 1;
  Transfinite Surface {:};
  Recombine Surface {:};
  Transfinite Volume {:};
Else
  Mesh.MeshSizeMin = lc;
  Mesh.MeshSizeMax = lc;
EndIf
