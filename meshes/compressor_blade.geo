// Compressor rotor blade: twisted, tapered airfoil on a platform with a dovetail root. The engine's
// axis is along x, the radius along z; z = 0 is the top of the platform. Lengths in m, angles in
// degrees.
// Volume "blade"; surfaces "flank_left" (y < 0) and "flank_right" (y > 0), the faces of the dovetail
// that press against the disk.
SetFactory("OpenCASCADE");
DefineConstant[
  span = {0.120, Name "span"},               // airfoil above the platform, along z
  chord_root = {0.045, Name "chord_root"},   // chord at the platform
  chord_tip = {0.040, Name "chord_tip"},     // chord at the tip
  t_root = {0.0045, Name "t_root"},          // largest thickness at the platform
  t_tip = {0.0024, Name "t_tip"},            // largest thickness at the tip
  t_edge = {0.0010, Name "t_edge"},          // thickness of leading and trailing edge
  stagger = {20, Name "stagger"},            // chord against the engine's axis, at the platform
  twist = {30, Name "twist"},                // more stagger at the tip
  camber = {30, Name "camber"},              // turning of the camber line at the platform
  sections = {5, Name "sections"},           // airfoil sections that are skinned
  l_platform = {0.052, Name "l_platform"},   // platform along x
  w_platform = {0.032, Name "w_platform"},   // platform along y
  t_platform = {0.005, Name "t_platform"},   // thickness of the platform
  l_root = {0.044, Name "l_root"},           // dovetail along x
  w_neck = {0.012, Name "w_neck"},           // width of the neck, along y
  w_dovetail = {0.024, Name "w_dovetail"},   // largest width of the dovetail
  h_neck = {0.004, Name "h_neck"},           // height of the neck above the flanks
  h_foot = {0.004, Name "h_foot"},           // height of the foot below the flanks
  beta = {50, Name "beta"},                  // flanks against the radius
  R = {0.0015, Name "R"},                    // fillets above and below the flanks
  crown = {0, Name "crown"},                 // radius of crowned flanks; 0 for plane ones
  lc = {0.0045, Name "lc"},                  // element size
  lc_flank = {0.0025, Name "lc_flank"}       // element size on the flanks and fillets
];
deg = Pi / 180;
If (sections < 2 || sections != Floor(sections))
  Error("sections = %g: skinning needs a whole number from 2", sections);
  Abort;
EndIf
If (t_edge >= t_tip || t_tip > t_root)
  Error("thicknesses must be t_edge = %g < t_tip = %g <= t_root = %g", t_edge, t_tip, t_root);
  Abort;
EndIf
If (camber < 0 || camber > 60)
  Error("camber = %g degrees: thin airfoils turn the flow by 0 to 60", camber);
  Abort;
EndIf
If (beta < 30 || beta > 70)
  Error("beta = %g degrees: flanks wedge between 30 and 70", beta);
  Abort;
EndIf
// Camber line: a parabola of height f over the chord whose end slopes differ by the camber angle.
f_root = chord_root / 4 * Tan(camber / 2 * deg);
x_half = chord_root / 2 * Cos(stagger * deg) + (f_root + t_root) * Abs(Sin(stagger * deg));
y_half = chord_root / 2 * Abs(Sin(stagger * deg)) + (f_root + t_root) * Cos(stagger * deg);
If (2 * x_half >= l_platform || 2 * y_half >= w_platform)
  Error("the airfoil of %g x %g stands over the platform of l_platform = %g x w_platform = %g",
    2 * x_half, 2 * y_half, l_platform, w_platform);
  Abort;
EndIf
If (l_root > l_platform || w_neck >= w_dovetail || w_dovetail > w_platform)
  Error("the root must fit: l_root = %g <= l_platform = %g, w_neck = %g < w_dovetail = %g <= w_platform = %g",
    l_root, l_platform, w_neck, w_dovetail, w_platform);
  Abort;
EndIf
// Half a dovetail: neck down to (y1, z1), flank down to (y2, z2), foot down to z3. Fillets cut
// the length `cut` from both sides of the corners.
s = Sin(beta * deg);
c = Cos(beta * deg);
cut = R * Tan(beta / 2 * deg);
y1 = w_neck / 2;
y2 = w_dovetail / 2;
z1 = -t_platform - h_neck;
z2 = z1 - (y2 - y1) * c / s;
z3 = z2 - h_foot;
seat = (y2 - y1) / s - 2 * cut; // length of a flank across x
If (seat < R || cut >= h_neck || cut >= h_foot)
  Error("fillets R = %g leave %g of the flanks, %g of the neck, %g of the foot", R, seat,
    h_neck - cut, h_foot - cut);
  Abort;
EndIf
If (crown != 0 && crown < 2 * seat)
  Error("crown = %g: a crowned flank needs a radius above twice its length, %g, or 0", crown,
    2 * seat);
  Abort;
EndIf
x = -l_root / 2;
// side = 1 draws the right half from the platform down, side = -1 the left one
Macro Half
  Point(k + 1) = {x, side * y1, -t_platform};
  Point(k + 2) = {x, side * y1, z1 + cut};
  Point(k + 3) = {x, side * (y1 + R), z1 + cut};              // centre of the upper fillet
  Point(k + 4) = {x, side * (y1 + cut * s), z1 - cut * c};    // flank begins
  Point(k + 5) = {x, side * (y2 - cut * s), z2 + cut * c};    // flank ends
  Point(k + 6) = {x, side * (y2 - R), z2 - cut};              // centre of the lower fillet
  Point(k + 7) = {x, side * y2, z2 - cut};
  Point(k + 8) = {x, side * y2, z3};
  Line(k + 1) = {k + 1, k + 2};
  Circle(k + 2) = {k + 2, k + 3, k + 4};
  If (crown > 0)
    depth = Sqrt(crown^2 - seat^2 / 4);
    Point(k + 9) = {x, side * ((y1 + y2) / 2 - depth * c), (z1 + z2) / 2 - depth * s};
    Circle(k + 3) = {k + 4, k + 9, k + 5};
  Else
    Line(k + 3) = {k + 4, k + 5};
  EndIf
  Circle(k + 4) = {k + 5, k + 6, k + 7};
  Line(k + 5) = {k + 7, k + 8};
Return

k = 100; side = 1; Call Half;
k = 200; side = -1; Call Half;
Line(301) = {108, 208};
Line(302) = {201, 101};
Curve Loop(301) = {101 : 105, 301, -205, -204, -203, -202, -201, 302};
Plane Surface(301) = {301};
root() = Extrude {l_root, 0, 0} { Surface{301}; };
Box(2000) = {-l_platform / 2, -w_platform / 2, -t_platform, l_platform, w_platform, t_platform};
// Airfoil sections, from inside the platform to the tip; the camber fades with the chord's share.
// Thickness follows a parabola from edge to edge.
n = 8; // intervals of a spline
For i In {0 : sections - 1}
  z = -t_platform / 2 + (span + t_platform / 2) * i / (sections - 1);
  r = z / span;
  chord = chord_root + (chord_tip - chord_root) * r;
  t = t_root + (t_tip - t_root) * r;
  f = chord / 4 * Tan(camber / 2 * (1 - r / 2) * deg);
  angle = (stagger + twist * r) * deg;
  k = 10000 + 100 * i;
  For j In {0 : n}
    u = 2 * j / n - 1;
    half = t_edge / 2 + (t - t_edge) / 2 * (1 - u^2);
    mean = f * (2 / 3 - u^2); // its centroid is on the stacking axis
    For side In {-1 : 1 : 2}
      a = u * chord / 2;
      b = mean + side * half;
      Point(k + 25 * (side + 1) + j) =
        {a * Cos(angle) - b * Sin(angle), a * Sin(angle) + b * Cos(angle), z};
    EndFor
  EndFor
  Spline(k) = {k : k + n};
  Line(k + 1) = {k + n, k + 50 + n};
  Spline(k + 2) = {k + 50 : k + 50 + n};
  Line(k + 3) = {k + 50, k};
  Curve Loop(k) = {k, k + 1, -(k + 2), k + 3};
EndFor
ThruSections(3000) = {10000 : 10000 + 100 * (sections - 1) : 100};
blade() = BooleanUnion{ Volume{3000}; Delete; }{ Volume{2000, root(1)}; Delete; };
Physical Volume("blade", 1) = {blade()};
e = 0.3 * cut;
left() = Surface In BoundingBox{-l_root / 2 - e, -y2 + cut * s - e, z2 + cut * c - e,
  l_root / 2 + e, -y1 - cut * s + e, z1 - cut * c + e};
right() = Surface In BoundingBox{-l_root / 2 - e, y1 + cut * s - e, z2 + cut * c - e,
  l_root / 2 + e, y2 - cut * s + e, z1 - cut * c + e};
Physical Surface("flank_left", 11) = {left()};
Physical Surface("flank_right", 12) = {right()};
MeshSize { PointsOf { Volume{blade()}; } } = lc;
MeshSize { Point In BoundingBox{-l_root / 2 - e, -y2 - e, z2 - cut - e,
  l_root / 2 + e, y2 + e, z1 + cut + e} } = lc_flank; // flanks and their fillets
// Where the thin edges of the airfoil meet the platform, elements must not be much longer than thick.
foot() = Point In BoundingBox{-x_half - e, -y_half - e, -e, x_half + e, y_half + e, e};
fine = 3 * t_edge < lc ? 3 * t_edge : lc;
MeshSize { foot() } = fine;
Mesh.MeshSizeMin = lc_flank < fine ? lc_flank : fine;
Mesh.MeshSizeMax = lc;
Mesh.OptimizeThreshold = 0.5;
