// Portal frame of rectangular bars in the plane of x and z, bolted at its corners. Lengths in m.
// Volumes "columns" and "beam"; "joint_left" and "joint_right", thin layers between them whose
// stiffness stands for that of the bolts. Surfaces "foot_left" and "foot_right" (z = 0), and "seat",
// the middle third of the top of the beam.
SetFactory("OpenCASCADE");
DefineConstant[
  L = {0.40, Name "L"},           // distance of the axes of the columns
  H = {0.30, Name "H"},           // height up to the middle of the beam
  b = {0.020, Name "b"},          // thickness of the bars, in the plane of the frame
  w = {0.030, Name "w"},          // width of the bars, along y
  joint = {0.006, Name "joint"},  // height of the layers between columns and beam
  lc = {0.015, Name "lc"}         // element size
];
If (L <= 6 * b || H <= 2 * b + joint)
  Error("bars must be slender: L = %g > 6 b = %g, H = %g > 2 b + joint", L, 6 * b, H);
  Abort;
EndIf
top = H - b / 2;
third = (L + b) / 3;
Box(1) = {-b / 2, -w / 2, 0, b, w, top - joint};
Box(2) = {L - b / 2, -w / 2, 0, b, w, top - joint};
Box(3) = {-b / 2, -w / 2, top - joint, b, w, joint};
Box(4) = {L - b / 2, -w / 2, top - joint, b, w, joint};
Box(5) = {-b / 2, -w / 2, top, third, w, b};
Box(6) = {-b / 2 + third, -w / 2, top, third, w, b};
Box(7) = {-b / 2 + 2 * third, -w / 2, top, third, w, b};
Coherence;
e = 1e-5 * L;
Physical Volume("columns", 1) = Volume In BoundingBox{-L, -w, -e, 2 * L, w, top - joint + e};
Physical Volume("joint_left", 2) = Volume In BoundingBox{-b, -w, top - joint - e, b, w, top + e};
Physical Volume("joint_right", 3) = Volume In BoundingBox{L - b, -w, top - joint - e, L + b, w, top + e};
Physical Volume("beam", 4) = Volume In BoundingBox{-L, -w, top - e, 2 * L, w, top + b + e};
Physical Surface("foot_left", 11) = Surface In BoundingBox{-b, -w, -e, b, w, e};
Physical Surface("foot_right", 12) = Surface In BoundingBox{L - b, -w, -e, L + b, w, e};
Physical Surface("seat", 13) = Surface In BoundingBox{-b / 2 + third - e, -w, top + b - e, -b / 2 + 2 * third + e, w, top + b + e};
Mesh.MeshSizeMin = lc;
Mesh.MeshSizeMax = lc;
Mesh.Algorithm3D = 1;
