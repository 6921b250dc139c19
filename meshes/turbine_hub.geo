// Hub of a wind turbine: a hollow sphere, cut off flat where three blades and the shaft are bolted
// on. Lengths in m, angles in degrees. Volume "body"; surfaces "blade_1", "blade_2", "blade_3"
// (rings on which the blades stand, the first one up) and "shaft" (ring towards the nacelle, along
// x). The origin lies in the centre, where the axes meet; blades lean against x by the cone.
SetFactory("OpenCASCADE");
DefineConstant[
  r_b = {1.5, Name "r_b"},           // from the centre to the roots of the blades
  d_b = {3.542, Name "d_b"},         // diameter of a root
  x_s = {1.95, Name "x_s"},          // from the centre to the flange of the shaft
  t = {0.16, Name "t"},              // wall
  cone = {2.5, Name "cone"},         // of the blades
  lc = {0.45, Name "lc"}             // element size
];
R = Sqrt(r_b^2 + d_b^2 / 4);
If (R - t <= r_b || R - t <= x_s)
  Error("a wall of %g leaves no rings on a sphere of radius %g", t, R);
  Abort;
EndIf
Sphere(1) = {0, 0, 0, R};
Sphere(2) = {0, 0, 0, R - t};
cut() = {2};
For i In {0:2}
  b = newv; Box(b) = {-2 * R, -2 * R, r_b, 4 * R, 4 * R, 2 * R};
  Rotate {{0, 1, 0}, {0, 0, 0}, -cone * Pi / 180} { Volume{b}; }
  Rotate {{1, 0, 0}, {0, 0, 0}, i * 2 * Pi / 3} { Volume{b}; }
  cut() += {b};
EndFor
b = newv; Box(b) = {x_s, -2 * R, -2 * R, 2 * R, 4 * R, 4 * R};
cut() += {b};
hub() = BooleanDifference{ Volume{1}; Delete; }{ Volume{cut()}; Delete; };
e = 0.001;
all() = Boundary{ Volume{hub(0)}; };
found = 0;
For k In {0:#all() - 1}
  c() = CenterOfMass Surface{all(k)};
  box() = BoundingBox Surface{all(k)};
  If (Fabs(box(3) - box(0)) < e && Fabs(c(0) - x_s) < e)
    Physical Surface("shaft") = {all(k)};
    found += 1;
  EndIf
  For i In {0:2}
    s = Sin(i * 2 * Pi / 3); q = Cos(i * 2 * Pi / 3);
    u = -Sin(cone * Pi / 180); v = Cos(cone * Pi / 180);
    far = Sqrt((c(0) - r_b * u)^2 + (c(1) + r_b * v * s)^2 + (c(2) - r_b * v * q)^2);
    If (far < e)
      Physical Surface(Sprintf("blade_%g", i + 1)) = {all(k)};
      found += 1;
    EndIf
  EndFor
EndFor
If (found != 4)
  Error("%g of four rings are there", found);
  Abort;
EndIf
Physical Volume("body") = {hub(0)};
Mesh.CharacteristicLengthMax = lc;
Mesh.CharacteristicLengthMin = lc / 4;
Mesh.Algorithm3D = 1;
