// Voussoir k of n, from the left, of a half circle about (0, h), with straight faces: the stone of
// buttressed_vault.geo, as deep as d along z. Lengths in m.
// Volume "body"; surfaces "left" and "right" (joints), "inner" and "outer".
DefineConstant[
  R = {5.0, Name "R"},              // radius of the centre line of the arch
  t = {0.8, Name "t"},              // its thickness
  n = {16, Name "n"},               // voussoirs
  k = {8, Name "k"},                // which of them, from 1
  h = {4.0, Name "h"},              // height of the springing
  d = {1.0, Name "d"},              // depth, half of it on either side of z = 0
  n_across = {6, Name "n_across"},  // hexahedra across the thickness
  n_along = {6, Name "n_along"},    // ... along the arch
  n_deep = {2, Name "n_deep"}       // ... along the depth
];
If (t <= 0 || t >= 2 * R || n < 2 || k < 1 || k > n || d <= 0)
  Error("no voussoir %g of %g has R = %g, t = %g, d = %g", k, n, R, t, d);
  Abort;
EndIf
For i In {0 : 1}
  angle = Pi - (k - 1 + i) * Pi / n;
  Point(1 + 2 * i) = {(R - t / 2) * Cos(angle), h + (R - t / 2) * Sin(angle), -d / 2};
  Point(2 + 2 * i) = {(R + t / 2) * Cos(angle), h + (R + t / 2) * Sin(angle), -d / 2};
EndFor
Line(1) = {1, 3};
Line(2) = {3, 4};
Line(3) = {4, 2};
Line(4) = {2, 1};
Transfinite Curve {1, 3} = n_along + 1;
Transfinite Curve {2, 4} = n_across + 1;
Curve Loop(1) = {1 : 4};
Plane Surface(1) = {1};
Transfinite Surface {1};
Recombine Surface {1};
out[] = Extrude {0, 0, d} { Surface{1}; Layers{n_deep}; Recombine; };
Physical Volume("body") = {out[1]};
Physical Surface("inner") = {out[2]};
Physical Surface("right") = {out[3]};
Physical Surface("outer") = {out[4]};
Physical Surface("left") = {out[5]};
