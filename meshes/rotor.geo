// Sector of a rotor that turns about z: a shaft with a small bore and two discs on it. N sectors
// make the rotor, each one cell wide. Lengths in m.
// Volumes "shaft" and "discs"; surfaces "left" and "right" (the ends of the shaft), "cyclic_low"
// and "cyclic_high", whose meshes are turned copies.
DefineConstant[
  N = {24, Name "N"},                 // number of sectors
  L = {1.5, Name "L"},                // length of the shaft
  d = {0.05, Name "d"},               // its diameter
  bore = {0.004, Name "bore"},        // diameter of the bore
  at_1 = {0.5, Name "at_1"},          // middle of the first disc, along z
  at_2 = {1.0, Name "at_2"},          // middle of the second disc
  d_1 = {0.28, Name "d_1"},           // diameter of the first disc
  d_2 = {0.35, Name "d_2"},           // diameter of the second disc
  w = {0.07, Name "w"},               // width of the discs
  lc = {0.05, Name "lc"}              // element size along the shaft
];
If (N < 3 || N != Floor(N))
  Error("N = %g: a rotor needs a whole number of sectors from 3", N);
  Abort;
EndIf
If (!(0 < bore && bore < d && d < d_1 && d < d_2))
  Error("diameters must be 0 < bore = %g < d = %g < d_1 = %g, d_2 = %g", bore, d, d_1, d_2);
  Abort;
EndIf
If (!(w < 2 * at_1 && at_1 + w < at_2 && at_2 + w / 2 < L))
  Error("discs of width w = %g at %g and %g do not stand apart on a shaft of %g", w, at_1, at_2, L);
  Abort;
EndIf
angle = 2 * Pi / N;
z() = {0, at_1 - w / 2, at_1 + w / 2, at_2 - w / 2, at_2 + w / 2, L};
// Section: points 10 k + j at z(j) on the bore, the shaft (k = 1) and the discs (k = 2)
For j In {0 : 5}
  r = (j < 3) ? d_1 / 2 : d_2 / 2;
  Point(j) = {bore / 2, 0, z(j)};
  Point(10 + j) = {d / 2, 0, z(j)};
  Line(100 + j) = {j, 10 + j};
  If (j > 0 && j < 5)
    Point(20 + j) = {r, 0, z(j)};
    Line(110 + j) = {10 + j, 20 + j};
  EndIf
EndFor
For j In {0 : 4}
  Line(200 + j) = {j, j + 1};
  Line(210 + j) = {10 + j, 11 + j};
  Curve Loop(j + 1) = {200 + j, 101 + j, -(210 + j), -(100 + j)};
  Plane Surface(j + 1) = {j + 1};
  n = Ceil((z(j + 1) - z(j)) / ((j == 1 || j == 3) ? w / 2 : lc) - 1e-6);
  Transfinite Curve{200 + j, 210 + j} = n + 1;
  If (j == 1 || j == 3)
    Line(220 + j) = {20 + j, 21 + j};
    Curve Loop(j + 6) = {210 + j, 111 + j, -(220 + j), -(110 + j)};
    Plane Surface(j + 6) = {j + 6};
    Transfinite Curve{220 + j} = n + 1;
  EndIf
EndFor
Transfinite Curve{100 : 105} = 3;
Transfinite Curve{111 : 114} = 4;
section() = {1 : 5, 7, 9};
Transfinite Surface{section()};
Recombine Surface{section()};
high() = {};
volumes() = {};
For i In {0 : 6}
  out() = Extrude{ {0, 0, 1}, {0, 0, 0}, angle }{
    Surface{section(i)}; Layers{1}; Recombine;
  };
  high() += out(0);
  volumes() += out(1);
EndFor
e = 1e-6 * L;
left() = Surface In BoundingBox{-d, -d, -e, d, d, e};
right() = Surface In BoundingBox{-d, -d, L - e, d, d, L + e};
Physical Volume("shaft", 1) = {volumes(0), volumes(1), volumes(2), volumes(3), volumes(4)};
Physical Volume("discs", 2) = {volumes(5), volumes(6)};
Physical Surface("cyclic_low", 11) = {section()};
Physical Surface("cyclic_high", 12) = {high()};
Physical Surface("left", 13) = {left()};
Physical Surface("right", 14) = {right()};
