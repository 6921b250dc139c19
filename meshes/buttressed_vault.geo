// Section of a barrel vault, a half circle of voussoirs, on two buttresses of courses. Lengths in m.
// Physical surfaces, whose parts are stones: "ground", "voussoir", "left course", "right course".
DefineConstant[
  R = {5.0, Name "R"},              // radius of the centre line of the vault
  t = {0.8, Name "t"},              // its thickness
  n = {16, Name "n"},               // voussoirs
  chords = {1, Name "chords"},      // of each curved side of a voussoir
  b = {2.4, Name "b"},              // width of a buttress
  h = {4.0, Name "h"},              // height of the springing
  courses = {5, Name "courses"}     // of a buttress
];
If (t <= 0 || t >= 2 * R || b < t || h <= 0 || n < 2 || courses < 1)
  Error("no vault has R = %g, t = %g, n = %g on buttresses b = %g, h = %g", R, t, n, b, h);
  Abort;
EndIf
Ri = R - t / 2;
Ro = R + t / 2;
Mesh.MeshSizeMax = 10 * (R + h);    // only corners and chords count
Macro Slab
  p = newp;
  Point(p) = {x0, y0, 0};
  Point(p + 1) = {x1, y0, 0};
  Point(p + 2) = {x1, y1, 0};
  Point(p + 3) = {x0, y1, 0};
  l = newl;
  Line(l) = {p, p + 1};
  Line(l + 1) = {p + 1, p + 2};
  Line(l + 2) = {p + 2, p + 3};
  Line(l + 3) = {p + 3, p};
  Transfinite Curve {l : l + 3} = 2;
  Curve Loop(l + 4) = {l : l + 3};
  s = news;
  Plane Surface(s) = {l + 4};
Return
x0 = -2 * (Ri + b); x1 = 2 * (Ri + b); y0 = -1; y1 = 0;
Call Slab;
Physical Surface("ground") = {s};
centre = newp;
Point(centre) = {0, h, 0};
For k In {0 : n}
  angle = Pi - k * Pi / n;
  inner[k] = newp; Point(inner[k]) = {Ri * Cos(angle), h + Ri * Sin(angle), 0};
  outer[k] = newp; Point(outer[k]) = {Ro * Cos(angle), h + Ro * Sin(angle), 0};
  radial[k] = newl; Line(radial[k]) = {inner[k], outer[k]};
  Transfinite Curve {radial[k]} = 2;
EndFor
voussoirs[] = {};
For k In {0 : n - 1}
  above = newl; Circle(above) = {outer[k], centre, outer[k + 1]};
  below = newl; Circle(below) = {inner[k], centre, inner[k + 1]};
  Transfinite Curve {above, below} = chords + 1;
  round = newl; Curve Loop(round) = {-below, radial[k], above, -radial[k + 1]};
  s = news; Plane Surface(s) = {round};
  voussoirs[] += {s};
EndFor
Physical Surface("voussoir") = {voussoirs[]};
lefts[] = {};
rights[] = {};
For k In {0 : courses - 1}
  y0 = k * h / courses;
  y1 = (k + 1) * h / courses;
  x0 = -Ri - b; x1 = -Ri;
  Call Slab;
  lefts[] += {s};
  x0 = Ri; x1 = Ri + b;
  Call Slab;
  rights[] += {s};
EndFor
Physical Surface("left course") = {lefts[]};
Physical Surface("right course") = {rights[]};
