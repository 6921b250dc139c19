// U of thick sheet: two legs along z, a web along x between them, and corners of their own, so that
// their stiffness may differ. Lengths in m; x from leg to leg, y across the sheets, z along the legs.
// Volumes "legs", "web" and "corners"; surface "tip", the end of the leg at x = 0.
SetFactory("OpenCASCADE");
DefineConstant[
  L = {0.300, Name "L"},          // legs above the web
  w = {0.150, Name "w"},          // width of the sheets, along y
  d = {0.120, Name "d"},          // from outside to outside of the legs
  t = {0.010, Name "t"},          // thickness
  n_leg = {12, Name "n_leg"},     // hexahedra along a leg
  n_web = {4, Name "n_web"},      // ... along the web
  n_wide = {6, Name "n_wide"},    // ... across the sheets
  n_thick = {1, Name "n_thick"}   // ... through a thickness
];
If (2 * t >= d)
  Error("the legs need a web between them: 2 t = %g < d = %g", 2 * t, d);
  Abort;
EndIf
Box(1) = {0, 0, 0, t, w, L};
Box(2) = {d - t, 0, 0, t, w, L};
Box(3) = {t, 0, -t, d - 2 * t, w, t};
Box(4) = {0, 0, -t, t, w, t};
Box(5) = {d - t, 0, -t, t, w, t};
Coherence;
e = 1e-6;
Physical Volume("legs", 1) = Volume In BoundingBox{-e, -e, -e, d + e, w + e, L + e};
Physical Volume("web", 2) = Volume In BoundingBox{t - e, -e, -t - e, d - t + e, w + e, e};
Physical Volume("corners", 3) = {
  Volume In BoundingBox{-e, -e, -t - e, t + e, w + e, e},
  Volume In BoundingBox{d - t - e, -e, -t - e, d + e, w + e, e}
};
Physical Surface("tip", 11) = Surface In BoundingBox{-e, -e, L - e, t + e, w + e, L + e};
all() = Curve{:};
For i In {0 : #all() - 1}
  box() = BoundingBox Curve {all(i)};
  If (box(5) - box(2) > t + e)
    Transfinite Curve {all(i)} = n_leg + 1;
  ElseIf (box(4) - box(1) > t + e)
    Transfinite Curve {all(i)} = n_wide + 1;
  ElseIf (box(3) - box(0) > t + e)
    Transfinite Curve {all(i)} = n_web + 1;
  Else
    Transfinite Curve {all(i)} = n_thick + 1;
  EndIf
EndFor
Transfinite Surface {:};
Recombine Surface {:};
Transfinite Volume {:};
