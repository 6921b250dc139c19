// Connecting rod: big eye at the origin, small eye at (L, 0), bores along z, tapered I-section shank
// with filleted transitions. Lengths in m.
// Volume "body"; surfaces "pin_a" (bore of the big eye) and "pin_b" (bore of the small eye).
SetFactory("OpenCASCADE");
DefineConstant[
  L = {0.20, Name "L"},              // distance of the bores
  d_a = {0.030, Name "d_a"},         // bore of the big eye
  D_a = {0.046, Name "D_a"},         // outer diameter of the big eye
  t_a = {0.020, Name "t_a"},         // thickness of the big eye, along z
  d_b = {0.016, Name "d_b"},         // bore of the small eye
  D_b = {0.026, Name "D_b"},         // outer diameter of the small eye
  t_b = {0.016, Name "t_b"},         // thickness of the small eye
  h_a = {0.024, Name "h_a"},         // height of the shank at the big eye, along y
  h_b = {0.016, Name "h_b"},         // height of the shank at the small eye
  w = {0.012, Name "w"},             // width of the shank's flanges, along z
  t_web = {0.004, Name "t_web"},     // thickness of the web of the I
  t_flange = {0.003, Name "t_flange"}, // thickness of the flanges of the I
  R = {0.006, Name "R"},             // fillets between shank and eyes, and ends of the pockets
  lc = {0.0055, Name "lc"}           // element size
];
If (d_a >= D_a || d_b >= D_b)
  Error("an eye needs a wall: d_a = %g < D_a = %g and d_b = %g < D_b = %g", d_a, D_a, d_b, D_b);
  Abort;
EndIf
If (h_a >= D_a || h_b >= D_b)
  Error("the shank must be lower than the eyes: h_a = %g < D_a = %g, h_b = %g < D_b = %g",
    h_a, D_a, h_b, D_b);
  Abort;
EndIf
If (t_web >= w || w > t_a || w > t_b)
  Error("widths along z must be t_web = %g < w = %g <= t_a = %g, t_b = %g", t_web, w, t_a, t_b);
  Abort;
EndIf
If (2 * t_flange >= h_a || 2 * t_flange >= h_b)
  Error("flanges of %g leave no room for a web in h_a = %g, h_b = %g", t_flange, h_a, h_b);
  Abort;
EndIf
If (L < D_a / 2 + D_b / 2 + 4 * R)
  Error("L = %g leaves no shank between the eyes: it must exceed %g", L, D_a / 2 + D_b / 2 + 4 * R);
  Abort;
EndIf
// Fillet arcs touch the straight edge of the shank and the circle of the eye: the centre of the arc
// lies R beside the edge and D/2 + R from the eye. The edge falls from h_a/2 to h_b/2.
slope = (h_b - h_a) / 2 / L;
n = Sqrt(1 + slope * slope);
// centre (x, h_a/2 + slope x + R n) with x^2 + y^2 = (D_a/2 + R)^2
y0 = h_a / 2 + R * n;
q = D_a / 2 + R;
x_a = (-slope * y0 + Sqrt(slope^2 * y0^2 + n^2 * (q^2 - y0^2))) / n^2;
y_a = y0 + slope * x_a;
// the same about (L, 0), seen from the shank
y1 = h_b / 2 + R * n;
q1 = D_b / 2 + R;
s1 = (slope * y1 + Sqrt(slope^2 * y1^2 + n^2 * (q1^2 - y1^2))) / n^2;
x_b = L - s1;
y_b = y1 - slope * s1;
// feet of the centres on the circles (where the arc leaves the eye) and on the edge
xe_a = x_a * D_a / 2 / q;         ye_a = y_a * D_a / 2 / q;
xf_a = x_a + R * slope / n;       yf_a = y_a - R / n;
xe_b = L - s1 * D_b / 2 / q1;     ye_b = y_b * D_b / 2 / q1;
xf_b = x_b + R * slope / n;       yf_b = y_b - R / n;
z = -w / 2;
Point(101) = {xe_a, ye_a, z};  Point(102) = {x_a, y_a, z};  Point(103) = {xf_a, yf_a, z};
Point(104) = {xf_b, yf_b, z};  Point(105) = {x_b, y_b, z};  Point(106) = {xe_b, ye_b, z};
Point(111) = {xe_a, -ye_a, z}; Point(112) = {x_a, -y_a, z}; Point(113) = {xf_a, -yf_a, z};
Point(114) = {xf_b, -yf_b, z}; Point(115) = {x_b, -y_b, z}; Point(116) = {xe_b, -ye_b, z};
Circle(101) = {101, 102, 103};
Line(102) = {103, 104};
Circle(103) = {104, 105, 106};
Line(104) = {106, 116};
Circle(105) = {116, 115, 114};
Line(106) = {114, 113};
Circle(107) = {113, 112, 111};
Line(108) = {111, 101};
Curve Loop(101) = {101 : 108};
Plane Surface(101) = {101};
shank() = Extrude {0, 0, w} { Surface{101}; };
// Pockets on both sides leave the web; their ends are round.
Macro Pocket
  x1 = D_a / 2 + R;
  x2 = L - D_b / 2 - R;
  p1 = h_a / 2 + slope * x1 - t_flange * n;
  p2 = h_b / 2 - slope * (L - x2) - t_flange * n;
  Point(k + 1) = {x1, -p1, za}; Point(k + 2) = {x2, -p2, za};
  Point(k + 3) = {x2, p2, za};  Point(k + 4) = {x1, p1, za};
  Line(k + 1) = {k + 1, k + 2}; Line(k + 2) = {k + 2, k + 3};
  Line(k + 3) = {k + 3, k + 4}; Line(k + 4) = {k + 4, k + 1};
  Curve Loop(k + 1) = {k + 1 : k + 4};
  Plane Surface(k + 1) = {k + 1};
  made() = Extrude {0, 0, dz} { Surface{k + 1}; };
  faces() = Abs(Boundary{ Volume{made(1)}; });
  edges() = Unique(Abs(Boundary{ Surface{faces()}; }));
  upright() = {};
  For i In {0 : #edges() - 1}
    box() = BoundingBox Curve {edges(i)};
    If (box(5) - box(2) > 0.9 * dz)
      upright() += edges(i);
    EndIf
  EndFor
  pocket() = Fillet{made(1)}{upright()}{Min(R, 0.9 * p2)};
Return

dz = (w - t_web) / 2;
k = 200; za = t_web / 2; Call Pocket;
above() = pocket();
k = 300; za = -w / 2; Call Pocket;
below() = pocket();
ribbed() = BooleanDifference{ Volume{shank(1)}; Delete; }{ Volume{above(), below()}; Delete; };
// Eyes around the bores; the bores go through everything.
Cylinder(901) = {0, 0, -t_a / 2, 0, 0, t_a, D_a / 2};
Cylinder(902) = {L, 0, -t_b / 2, 0, 0, t_b, D_b / 2};
whole() = BooleanUnion{ Volume{ribbed()}; Delete; }{ Volume{901, 902}; Delete; };
Cylinder(911) = {0, 0, -t_a, 0, 0, 2 * t_a, d_a / 2};
Cylinder(912) = {L, 0, -t_b, 0, 0, 2 * t_b, d_b / 2};
body() = BooleanDifference{ Volume{whole()}; Delete; }{ Volume{911, 912}; Delete; };
e = 1e-4 * L;
Physical Volume("body", 1) = {body()};
Physical Surface("pin_a", 11) = Surface In BoundingBox{
  -d_a / 2 - e, -d_a / 2 - e, -t_a / 2 - e, d_a / 2 + e, d_a / 2 + e, t_a / 2 + e};
Physical Surface("pin_b", 12) = Surface In BoundingBox{
  L - d_b / 2 - e, -d_b / 2 - e, -t_b / 2 - e, L + d_b / 2 + e, d_b / 2 + e, t_b / 2 + e};
// The two faces of the thin web get different meshes: the same mesh on both makes flat tetrahedra.
lower = 0.8;
MeshSize { PointsOf { Volume{body()}; } } = lc;
MeshSize { Point In BoundingBox{-L, -D_a, -t_web / 2 - e, 2 * L, D_a, -t_web / 2 + e} } = lower * lc;
Mesh.MeshSizeMin = lower * lc;
Mesh.MeshSizeMax = lc;
