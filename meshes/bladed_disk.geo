// Sector of a bladed disk that turns about z: a disk of constant width with one tapered, twisted
// blade, its span along x. N sectors make the wheel. Lengths in m, angles in degrees.
// Volumes "disk" and "blade"; surfaces "bore" (the hole of the hub), "cyclic_low" (y < 0) and
// "cyclic_high" (y > 0), whose meshes are turned copies, and "tip".
SetFactory("OpenCASCADE");
DefineConstant[
  N = {24, Name "N"},                      // number of sectors
  r_bore = {0.060, Name "r_bore"},         // radius of the bore
  r_rim = {0.150, Name "r_rim"},           // radius of the rim, where blades stand
  r_tip = {0.220, Name "r_tip"},           // radius of the blade tips
  width = {0.024, Name "width"},           // width of the disk, along z
  chord = {0.022, Name "chord"},           // chord of the blade at the rim
  chord_tip = {0.018, Name "chord_tip"},   // chord at the tip
  t = {0.004, Name "t"},                   // thickness of the blade at the rim
  t_tip = {0.002, Name "t_tip"},           // thickness at the tip
  stagger = {25, Name "stagger"},          // chord against the axis, at the rim
  twist = {20, Name "twist"},              // more stagger at the tip
  shift = {0, Name "shift"},               // 1: meshes of the cyclic faces differ
  lc = {0.008, Name "lc"},                 // element size of the disk
  lc_blade = {0.005, Name "lc_blade"}      // element size of the blade
];
deg = Pi / 180;
If (N < 3 || N != Floor(N))
  Error("N = %g: a wheel needs a whole number of sectors from 3", N);
  Abort;
EndIf
If (!(0 < r_bore && r_bore < r_rim && r_rim < r_tip))
  Error("radii must be 0 < r_bore = %g < r_rim = %g < r_tip = %g", r_bore, r_rim, r_tip);
  Abort;
EndIf
half = Pi / N;
reach_y = chord / 2 * Abs(Sin(stagger * deg)) + t / 2 * Cos(stagger * deg);
reach_z = chord / 2 * Cos(stagger * deg) + t / 2 * Abs(Sin(stagger * deg));
If (reach_y >= 0.9 * r_rim * Sin(half) || reach_z >= width / 2)
  Error("the foot of the blade, %g x %g, stands over the rim of %g x %g", 2 * reach_y, 2 * reach_z,
    2 * r_rim * Sin(half), width);
  Abort;
EndIf
Cylinder(1) = {0, 0, -width / 2, 0, 0, width, r_rim, 2 * half};
Cylinder(2) = {0, 0, -width / 2, 0, 0, width, r_bore, 2 * half};
Rotate{ {0, 0, 1}, {0, 0, 0}, -half }{ Volume{1, 2}; }
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
// Rectangular sections from inside the rim to the tip
foot = r_rim * Cos(half) - t;
n = 4;
For i In {0 : n}
  x = foot + (r_tip - foot) * i / n;
  share = (x - r_rim) / (r_tip - r_rim);
  a = (chord + (chord_tip - chord) * share) / 2;
  b = (t + (t_tip - t) * share) / 2;
  angle = (stagger + twist * share) * deg;
  k = 1000 + 10 * i;
  For j In {0 : 3}
    u = (j == 0 || j == 3) ? -a : a;
    v = (j < 2) ? -b : b;
    Point(k + j) = {x, u * Sin(angle) + v * Cos(angle), u * Cos(angle) - v * Sin(angle)};
  EndFor
  For j In {0 : 3}
    Line(k + j) = {k + j, k + (j + 1) % 4};
  EndFor
  Curve Loop(k) = {k : k + 3};
EndFor
ThruSections(10) = {1000 : 1000 + 10 * n : 10};
outside() = BooleanDifference{ Volume{10}; Delete; }{ Volume{3}; };
BooleanFragments{ Volume{3}; Delete; }{ Volume{outside()}; Delete; }
e = 1e-6 * r_tip;
c = Cos(half);
s = Sin(half);
disk() = Volume In BoundingBox{-e, -r_rim * s - e, -width / 2 - e, r_rim + e, r_rim * s + e,
  width / 2 + e};
blade() = Volume{:};
blade() -= disk();
Physical Volume("disk", 1) = {disk()};
Physical Volume("blade", 2) = {blade()};
low() = Surface In BoundingBox{r_bore * c - e, -r_rim * s - e, -width / 2 - e,
  r_rim * c + e, -r_bore * s + e, width / 2 + e};
high() = Surface In BoundingBox{r_bore * c - e, r_bore * s - e, -width / 2 - e,
  r_rim * c + e, r_rim * s + e, width / 2 + e};
bore() = Surface In BoundingBox{r_bore * c - e, -r_bore * s - e, -width / 2 - e,
  r_bore + e, r_bore * s + e, width / 2 + e};
tip() = Surface In BoundingBox{r_tip - e, -r_tip, -r_tip, r_tip + e, r_tip, r_tip};
Physical Surface("cyclic_low", 11) = {low()};
Physical Surface("cyclic_high", 12) = {high()};
Physical Surface("bore", 13) = {bore()};
Physical Surface("tip", 14) = {tip()};
MeshSize { PointsOf { Volume{disk()}; } } = lc;
MeshSize { PointsOf { Volume{blade()}; } } = lc_blade;
If (shift)
  MeshSize { PointsOf { Surface{high()}; } } = 0.8 * lc;
Else
  Periodic Surface {high()} = {low()} Rotate{ {0, 0, 1}, {0, 0, 0}, 2 * half };
EndIf
Mesh.MeshSizeMin = lc_blade < 0.8 * lc ? lc_blade : 0.8 * lc;
Mesh.MeshSizeMax = lc;
