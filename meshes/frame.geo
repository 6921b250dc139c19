// Portal frame: two round columns along z, at x = 0 and x = L, in the bores of a cross beam; their
// tops are flush. Lengths in m.
// Volume "body"; surfaces "foot" (z = 0) and "seat" of a column, "bore_left" and "bore_right" of the
// beam, "foot_left" and "foot_right" of the whole frame.
// Seats and bores have regular meshes: parts with the same numbers of elements there have the same
// nodes, parts with different ones do not match.
SetFactory("OpenCASCADE");
DefineConstant[
  part = {0, Name "part"},              // 0 whole frame, 1 left column, 2 cross beam, 3 right column
  L = {0.40, Name "L"},                 // distance of the columns
  H = {0.30, Name "H"},                 // height
  R = {0.020, Name "R"},                // radius of the columns
  t = {0.050, Name "t"},                // height of the beam, length of the seats
  w = {0.070, Name "w"},                // width of the beam, along y
  a = {0.035, Name "a"},                // beam beyond the axes of the columns
  lc = {0.018, Name "lc"},              // element size
  n_left = {4, Name "n_left"},          // elements around half of the left seat
  n_right = {4, Name "n_right"},        // elements around half of the right seat
  n_along = {3, Name "n_along"}         // elements along a seat
];
If (2 * R >= w || R >= a)
  Error("a bore needs a wall: 2 R = %g < w = %g and R = %g < a = %g", 2 * R, w, R, a);
  Abort;
EndIf
If (t >= H || L <= 2 * a)
  Error("the columns must reach below the beam, t = %g < H = %g, and stand apart, L = %g > 2 a",
    t, H, L);
  Abort;
EndIf
// Half cylinders, so that a seat consists of two four-sided surfaces.
Cylinder(1) = {0, 0, 0, 0, 0, H - t, R, Pi};
Cylinder(2) = {0, 0, H - t, 0, 0, t, R, Pi};
Cylinder(3) = {L, 0, 0, 0, 0, H - t, R, Pi};
Cylinder(4) = {L, 0, H - t, 0, 0, t, R, Pi};
other() = Rotate {{0, 0, 1}, {0, 0, 0}, Pi} { Duplicata { Volume{1, 2}; } };
other() += Rotate {{0, 0, 1}, {L, 0, 0}, Pi} { Duplicata { Volume{3, 4}; } };
Box(20) = {-a, -w / 2, H - t, L + 2 * a, w, t};
BooleanFragments{ Volume{20}; Delete; }{ Volume{1 : 4, other()}; Delete; }
e = 1e-5 * L;
left() = Volume In BoundingBox{-R - e, -R - e, -e, R + e, R + e, H + e};
right() = Volume In BoundingBox{L - R - e, -R - e, -e, L + R + e, R + e, H + e};
beam() = Volume In BoundingBox{-a - e, -w, H - t - e, L + a + e, w, H + e};
beam() -= left();
beam() -= right();
// A seat: the faces between column and beam.
around() = Abs(Boundary{ Volume{beam()}; });
seat_left() = Surface In BoundingBox{-R - e, -R - e, H - t - e, R + e, R + e, H + e};
seat_right() = Surface In BoundingBox{L - R - e, -R - e, H - t - e, L + R + e, R + e, H + e};
off_left() = seat_left();
off_left() -= around();
seat_left() -= off_left();
off_right() = seat_right();
off_right() -= around();
seat_right() -= off_right();
foot_left() = Surface In BoundingBox{-R - e, -R - e, -e, R + e, R + e, e};
foot_right() = Surface In BoundingBox{L - R - e, -R - e, -e, L + R + e, R + e, e};
If (part == 0)
  Physical Volume("body", 1) = {left(), beam(), right()};
  Physical Surface("foot_left", 11) = {foot_left()};
  Physical Surface("foot_right", 12) = {foot_right()};
ElseIf (part == 1)
  Recursive Delete { Volume{beam(), right()}; }
  Physical Volume("body", 1) = {left()};
  Physical Surface("foot", 11) = {foot_left()};
  Physical Surface("seat", 12) = {seat_left()};
ElseIf (part == 2)
  Recursive Delete { Volume{left(), right()}; }
  Physical Volume("body", 1) = {beam()};
  Physical Surface("bore_left", 11) = {seat_left()};
  Physical Surface("bore_right", 12) = {seat_right()};
Else
  Recursive Delete { Volume{left(), beam()}; }
  Physical Volume("body", 1) = {right()};
  Physical Surface("foot", 11) = {foot_right()};
  Physical Surface("seat", 12) = {seat_right()};
EndIf
Mesh.MeshSizeMin = lc;
Mesh.MeshSizeMax = lc;
Macro Regular
  edges() = Unique(Abs(Boundary{ Surface{seat()}; }));
  For i In {0 : #edges() - 1}
    box() = BoundingBox Curve {edges(i)};
    If (box(4) - box(1) > R)
      Transfinite Curve {edges(i)} = n + 1;
    Else
      Transfinite Curve {edges(i)} = n_along + 1;
    EndIf
  EndFor
  Transfinite Surface {seat()};
Return
If (part != 3)
  seat() = seat_left();
  n = n_left;
  Call Regular;
EndIf
If (part != 1)
  seat() = seat_right();
  n = n_right;
  Call Regular;
EndIf
