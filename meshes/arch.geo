// Half of a shallow arch along x, from its abutment to its crown, z = rise (1 - (1 - x/half)^2) in
// its middle. Lengths in m. Volume "body"; surfaces "root" (x = 0) and "crown" (x = half).
DefineConstant[
  half = {0.5, Name "half"},    // half the span
  rise = {0.03, Name "rise"},   // of the crown
  h = {0.01, Name "h"},         // height of the section, along z
  b = {0.01, Name "b"},         // width, along y
  nx = {10, Name "nx"}          // hexahedra along x; one across
];
n = 20;
For i In {0 : n}
  Point(i + 1) = {half*i/n, -b/2, rise*(1 - (1 - i/n)^2) - h/2};
EndFor
Spline(1) = {1 : n + 1};
Transfinite Curve {1} = nx + 1;
side() = Extrude {0, 0, h} { Curve{1}; Layers{1}; Recombine; };
solid() = Extrude {0, b, 0} { Surface{side(1)}; Layers{1}; Recombine; };
e = 1e-6 * half;
Physical Volume("body", 1) = {solid(1)};
Physical Surface("root", 11) = Surface In BoundingBox{-e, -b, -h, e, b, h};
Physical Surface("crown", 12) = Surface In BoundingBox{half - e, -b, rise - h, half + e, b, rise + h};
