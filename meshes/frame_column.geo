// Flat column along z, screwed on the edges of two plates: it touches them at x = 0, over a part of
// its length at either end. Lengths in m. Volume "column"; surfaces "foot" and "head", what touches.
SetFactory("OpenCASCADE");
DefineConstant[
  clear = {0.1524, Name "clear"}, // between the plates
  over = {0.0127, Name "over"},   // along each plate
  give = {0, Name "give"},        // of that, next to the clear part, what does not touch
  t = {0.00635, Name "t"},        // thickness, along x
  w = {0.0254, Name "w"},         // width, along y
  n = {8, Name "n"}               // hexahedra along the clear part
];
If (give >= over || t >= clear)
  Error("needed: give = %g < over = %g, t = %g < clear = %g", give, over, t, clear);
  Abort;
EndIf
a = over - give;
Box(1) = {0, -w / 2, -over, t, w, a};
Box(2) = {0, -w / 2, -give, t, w, clear + 2 * give};
Box(3) = {0, -w / 2, clear + give, t, w, a};
Coherence;
e = 1e-6;
Physical Volume("column", 1) = Volume{:};
Physical Surface("foot", 11) = Surface In BoundingBox{-e, -w, -over - e, e, w, -give + e};
Physical Surface("head", 12) = Surface In BoundingBox{-e, -w, clear + give - e, e, w, clear + over + e};
all() = Curve{:};
For i In {0 : #all() - 1}
  box() = BoundingBox Curve {all(i)};
  If (box(5) - box(2) > clear / 2)
    Transfinite Curve {all(i)} = n + 1;
  ElseIf (box(5) - box(2) > e)
    Transfinite Curve {all(i)} = Ceil(n / 8) + 1;
  Else
    Transfinite Curve {all(i)} = Ceil(n / 8) + 1;
  EndIf
EndFor
Transfinite Surface {:};
Recombine Surface {:};
Transfinite Volume {:};
