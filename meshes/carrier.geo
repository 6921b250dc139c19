// Carrier of a planetary gear that turns about z: a disc, the pins of the planets on its front, and a
// hollow shaft on two journals behind it. Lengths in m. Volume "body"; surfaces "pin_1", "pin_2", ...
// (the pins all around, the first one on x), "front" and "back" (journals). The origin lies on the
// axis, in the middle of the pins.
SetFactory("OpenCASCADE");
DefineConstant[
  n = {3, Name "n"},                 // number of planets
  a = {0.048, Name "a"},             // from the axis to the pins
  d_p = {0.02, Name "d_p"},          // diameter of a pin
  b = {0.024, Name "b"},             // its length
  t = {0.012, Name "t"},             // thickness of the disc
  D = {0.128, Name "D"},             // its diameter
  d_j = {0.056, Name "d_j"},         // diameter of the journals
  d_s = {0.050, Name "d_s"},         // of the shaft between and behind them
  bore = {0.034, Name "bore"},       // of the shaft
  l_j = {0.016, Name "l_j"},         // length of a journal
  z_f = {0.04, Name "z_f"},          // from the origin back to the middle of the front journal
  z_b = {0.10, Name "z_b"},          // and of the back one
  lc = {0.006, Name "lc"}            // element size
];
If (n < 2 || n != Floor(n))
  Error("n = %g: a carrier needs a whole number of planets from 2", n);
  Abort;
EndIf
If (a + d_p / 2 >= D / 2 || 2 * a * Sin(Pi / n) <= d_p)
  Error("%g pins of d_p = %g at a = %g do not fit on a disc of D = %g", n, d_p, a, D);
  Abort;
EndIf
If (!(bore < d_s && d_s < d_j && d_j < D && z_f - l_j / 2 > b / 2 + t && z_b - z_f > l_j))
  Error("journals of d_j = %g, l_j = %g at z_f = %g and z_b = %g do not fit on the shaft", d_j, l_j, z_f, z_b);
  Abort;
EndIf
end = z_b + l_j;
Cylinder(1) = {0, 0, -b / 2 - t, 0, 0, t, D / 2};
Cylinder(2) = {0, 0, -end, 0, 0, end - b / 2, d_s / 2};
Cylinder(3) = {0, 0, -z_f - l_j / 2, 0, 0, l_j, d_j / 2};
Cylinder(4) = {0, 0, -z_b - l_j / 2, 0, 0, l_j, d_j / 2};
For i In {0:n - 1}
  Cylinder(5 + i) = {a * Cos(2 * Pi * i / n), a * Sin(2 * Pi * i / n), -b / 2, 0, 0, b, d_p / 2};
EndFor
solid() = BooleanUnion{ Volume{1}; Delete; }{ Volume{2:4 + n}; Delete; };
hole = newv; Cylinder(hole) = {0, 0, -2 * end, 0, 0, 4 * end, bore / 2};
body() = BooleanDifference{ Volume{solid()}; Delete; }{ Volume{hole}; Delete; };
Physical Volume("body") = {body()};
e = 1e-5;
For i In {0:n - 1}
  x = a * Cos(2 * Pi * i / n); y = a * Sin(2 * Pi * i / n); r = d_p / 2 + e;
  side() = Surface In BoundingBox{x - r, y - r, -b / 2 - e, x + r, y + r, b / 2 + e};
  tip() = Surface In BoundingBox{x - r, y - r, b / 2 - e, x + r, y + r, b / 2 + e};
  side() -= tip();
  Physical Surface(Sprintf("pin_%g", i + 1)) = {side()};
EndFor
all() = Boundary{ Volume{body(0)}; };
For k In {0:#all() - 1}
  box() = BoundingBox Surface{all(k)};
  If (Fabs(box(3) - d_j / 2) < e && Fabs(box(5) - box(2) - l_j) < e)
    If (box(5) > -(z_f + z_b) / 2) Physical Surface("front") = {all(k)}; EndIf
    If (box(5) < -(z_f + z_b) / 2) Physical Surface("back") = {all(k)}; EndIf
  EndIf
EndFor
MeshSize { PointsOf { Volume{body()}; } } = lc;
Mesh.MeshSizeMax = lc;
