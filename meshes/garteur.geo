// Test bed like an aircraft, GARTEUR SM-AG19, in parts; hexahedra. Lengths in m; x to the nose, y to
// the left wing, z up, the origin in the fuselage below the middle of the wing. Volumes "fuselage" and
// "plate", of steel between fuselage and wing; "wing", "tape" and "strip" on it; "drum"; "fin" and
// "angles" of steel at both of its ends; "tailplane"; and "contact", a thin layer below wing and drums
// and at both ends of the fin. Surfaces where parts meet: "root", "left", "right", "foot" and "top";
// where something hangs: "rear" of the fuselage, "tip" of a drum, "middle", "end_left" and "end_right"
// of the tailplane.
SetFactory("OpenCASCADE");
DefineConstant[
  part = {1, Name "part"},          // 1 fuselage, 2 wing, 3 left drum, 4 right drum, 5 fin, 6 tailplane
  strip = {0, Name "strip"},        // 1: the wing has a strip on a layer of tape
  t = {0.010, Name "t"},            // thickness of wing, drums, fin and tailplane
  b = {0.035, Name "b"},            // half-width of the steel plate along y
  x = {-0.85, Name "x"},            // where the fin stands
  gap = {2e-4, Name "gap"},         // thickness of the contacts
  lc = {0.05, Name "lc"}            // element size
];
a = 0.05;                           // half the chord
z_w = 0.091 + gap;                  // lower face of the wing
z_d = z_w + t + gap;                // of a drum
z_f = 0.075 + gap;                  // of the fin
z_t = z_f + 0.300 + gap;            // of the tailplane
Macro Blocks                        // of the grid xs, ys, zs
  For i In {1 : #xs() - 1}
    For j In {1 : #ys() - 1}
      For k In {1 : #zs() - 1}
        Box(newv) = {xs(i - 1), ys(j - 1), zs(k - 1), xs(i) - xs(i - 1), ys(j) - ys(j - 1), zs(k) - zs(k - 1)};
      EndFor
    EndFor
  EndFor
Return
If (part == 1)
  xs() = {-0.9, x - a, x + a, -0.31, -0.27, -0.065, -a, a, 0.065, 0.6};
  If (x - a < -0.9 + 1e-6)
    xs() = {x - a, x + a, -0.31, -0.27, -0.065, -a, a, 0.065, 0.6};
  EndIf
  ys() = {-0.025, -0.020, 0.020, 0.025};
  zs() = {-0.075, 0.075};
  Call Blocks;
  xs() = {-0.065, -a, a, 0.065};
  zs() = {0.075, 0.091};
  If (b > 0.025 + 1e-6)
    ys() = {-b, -0.025, -0.020, 0.020, 0.025, b};
  EndIf
  Call Blocks;
ElseIf (part == 2)
  xs() = {-a, 0.0762 - a, a};
  ys() = {-1, -0.9, -0.85, -b, b, 0.85, 0.9, 1};
  zs() = {z_w, z_w + t};
  Call Blocks;
  ys() = {-b, b};
  zs() = {z_w - gap, z_w};
  Call Blocks;
  If (strip)
    xs() = {-a, 0.0762 - a};
    ys() = {-0.85, -b, b, 0.85};
    zs() = {z_w + t, z_w + t + 5e-5, z_w + t + 5e-5 + 1.1e-3};
    Call Blocks;
  EndIf
ElseIf (part == 3 || part == 4)
  side = part == 3 ? 1 : -1;
  xs() = {-0.2, -a, a, 0.16, 0.2};
  ys() = {side * 0.95 - a, side * 0.95 + a};
  zs() = {z_d, z_d + t};
  Call Blocks;
  xs() = {-a, a};
  zs() = {z_d - gap, z_d};
  Call Blocks;
ElseIf (part == 5)
  xs() = {x - a, x + a};
  h = t / 2;
  ys() = {-h, h};
  zs() = {z_f + 0.015, z_f + 0.285};
  Call Blocks;
  For end In {0 : 1}
    ys() = {-0.020, -h - 0.002, -h, h, h + 0.002, 0.020};
    zs() = {z_f + 0.298 * end, z_f + 0.298 * end + 0.002};
    Call Blocks;
    zs() = {z_f + (0.300 + gap) * end - gap, z_f + (0.300 + gap) * end};
    Call Blocks;
    ys() = {-h - 0.002, -h, h, h + 0.002};
    zs() = {z_f + 0.002 + 0.283 * end, z_f + 0.015 + 0.283 * end};
    Call Blocks;
  EndFor
ElseIf (part == 6)
  xs() = {x - a, x + a};
  ys() = {-0.2, -0.16, -0.02, 0.02, 0.16, 0.2};
  zs() = {z_t, z_t + t};
  Call Blocks;
EndIf
all() = Volume{:};
If (#all() > 1)
  Coherence;
  all() = Volume{:};
EndIf
e = 1e-6;
If (part == 1)
  Physical Volume("fuselage", 1) = Volume In BoundingBox{-1, -0.025 - e, -0.1, 1, 0.025 + e, 0.075 + e};
  Physical Volume("plate", 2) = Volume In BoundingBox{-1, -b - e, 0.075 - e, 1, b + e, 0.1};
  Physical Surface("root", 11) = Surface In BoundingBox{-a - e, -b - e, 0.091 - e, a + e, b + e, 0.091 + e};
  Physical Surface("foot", 12) = Surface In BoundingBox{x - a - e, -0.02 - e, 0.075 - e, x + a + e, 0.02 + e, 0.075 + e};
  Physical Surface("rear", 13) = Surface In BoundingBox{-0.31 - e, -0.025 - e, 0.075 - e, -0.27 + e, 0.025 + e, 0.075 + e};
ElseIf (part == 2)
  Physical Volume("wing", 1) = Volume In BoundingBox{-a - e, -1 - e, z_w - e, a + e, 1 + e, z_w + t + e};
  If (strip)
    Physical Volume("tape", 2) = Volume In BoundingBox{-a - e, -1, z_w + t - e, a, 1, z_w + t + 5e-5 + e};
    Physical Volume("strip", 3) = Volume In BoundingBox{-a - e, -1, z_w + t + 5e-5 - e, a, 1, z_w + t + 2e-3};
  EndIf
  Physical Volume("contact", 4) = Volume In BoundingBox{-a - e, -1, z_w - gap - e, a + e, 1, z_w + e};
  Physical Surface("root", 11) = Surface In BoundingBox{-a - e, -b - e, z_w - gap - e, a + e, b + e, z_w - gap + e};
  Physical Surface("left", 12) = Surface In BoundingBox{-a - e, 0.9 - e, z_w + t - e, a + e, 1 + e, z_w + t + e};
  Physical Surface("right", 13) = Surface In BoundingBox{-a - e, -1 - e, z_w + t - e, a + e, -0.9 + e, z_w + t + e};
ElseIf (part == 3 || part == 4)
  Physical Volume("drum", 1) = Volume In BoundingBox{-1, -2, z_d - e, 1, 2, z_d + t + e};
  Physical Volume("contact", 4) = Volume In BoundingBox{-1, -2, z_d - gap - e, 1, 2, z_d + e};
  Physical Surface("root", 11) = Surface In BoundingBox{-a - e, -2, z_d - gap - e, a + e, 2, z_d - gap + e};
  Physical Surface("tip", 12) = Surface In BoundingBox{0.16 - e, -2, z_d + t - e, 0.2 + e, 2, z_d + t + e};
ElseIf (part == 5)
  middle() = Volume In BoundingBox{x - a - e, -t / 2 - e, z_f - e, x + a + e, t / 2 + e, z_f + 0.3 + e};
  all() -= middle();
  layers() = Volume In BoundingBox{x - 1, -1, z_f - gap - e, x + 1, 1, z_f + e};
  layers() += Volume In BoundingBox{x - 1, -1, z_f + 0.3 - e, x + 1, 1, z_f + 0.3 + gap + e};
  all() -= layers();
  Physical Volume("fin", 1) = {middle()};
  Physical Volume("angles", 2) = {all()};
  Physical Volume("contact", 4) = {layers()};
  Physical Surface("foot", 11) = Surface In BoundingBox{x - a - e, -0.02 - e, z_f - gap - e, x + a + e, 0.02 + e, z_f - gap + e};
  Physical Surface("top", 12) = Surface In BoundingBox{x - a - e, -0.02 - e, z_f + 0.3 + gap - e, x + a + e, 0.02 + e, z_f + 0.3 + gap + e};
ElseIf (part == 6)
  Physical Volume("tailplane", 1) = {all()};
  Physical Surface("top", 11) = Surface In BoundingBox{x - a - e, -0.02 - e, z_t - e, x + a + e, 0.02 + e, z_t + e};
  Physical Surface("middle", 12) = Surface In BoundingBox{x - a - e, -0.02 - e, z_t + t - e, x + a + e, 0.02 + e, z_t + t + e};
  Physical Surface("end_left", 13) = Surface In BoundingBox{x - a - e, 0.16 - e, z_t + t - e, x + a + e, 0.2 + e, z_t + t + e};
  Physical Surface("end_right", 14) = Surface In BoundingBox{x - a - e, -0.2 - e, z_t + t - e, x + a + e, -0.16 + e, z_t + t + e};
EndIf
edges() = Curve{:};
For i In {0 : #edges() - 1}
  box() = BoundingBox Curve{edges(i)};
  Transfinite Curve{edges(i)} = Ceil((box(3) + box(4) + box(5) - box(0) - box(1) - box(2)) / lc - 0.01) + 1;
EndFor
Transfinite Surface{:};
Recombine Surface{:};
Transfinite Volume{:};
