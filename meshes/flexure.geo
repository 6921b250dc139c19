// Parallel-guiding stage cut from one plate: a base, two leaves along x that start from it at x = 0,
// and a stage at x = L whose tongue reaches back between the leaves to their middle, where it is
// driven across. Lengths in m; the plate lies in x-y, its middle at z = 0.
// Volume "body"; surfaces "base" (the back of the base) and "drive" (the end of the tongue).
DefineConstant[
  L = {0.05, Name "L"},         // length of a leaf
  t = {0.001, Name "t"},       // thickness of a leaf, along y
  b = {0.005, Name "b"},        // thickness of the plate, along z
  s = {0.024, Name "s"},        // distance of the middles of the leaves
  w = {0.008, Name "w"},        // base and stage, along x
  a = {0.008, Name "a"},        // width of the tongue, along y
  nl = {8, Name "nl"},          // hexahedra along half a leaf, the finer the nearer to its root
  ratio = {1.3, Name "ratio"}   // of the lengths of neighbours among them
];
If (a + t >= s)
  Error("the tongue must fit between the leaves: a + t = %g < s = %g", a + t, s);
  Abort;
EndIf
x() = {-w, 0, L / 2, L, L + w};
y() = {-(s + t) / 2, -(s - t) / 2, -a / 2, a / 2, (s - t) / 2, (s + t) / 2};
nx() = {1, nl, nl, 1};          // hexahedra between these lines
ny() = {1, 2, 2, 2, 1};
growth() = {1, ratio, 1 / ratio, 1};
// leaves below and above, the tongue, and all of base and stage
there() = {1, 1, 1, 1, 1,  1, 0, 0, 0, 1,  1, 0, 1, 0, 1,  1, 1, 1, 1, 1};
For i In {0 : 4}
  For j In {0 : 5}
    Point(1 + 6 * i + j) = {x(i), y(j), -b / 2};
  EndFor
EndFor
For i In {0 : 3}
  For j In {0 : 4}
    If (there(5 * i + j))
      p = 1 + 6 * i + j;
      k = 100 + 6 * i + j;      // along x from each point, and 200 along y
      For side In {0 : 1}
        If (!Exists(done~{k + side}))
          done~{k + side} = 1;
          Line(k + side) = {p + side, p + side + 6};
          Transfinite Curve {k + side} = nx(i) + 1 Using Progression growth(i);
        EndIf
        n = 200 + 6 * (i + side) + j;
        If (!Exists(done~{n}))
          done~{n} = 1;
          Line(n) = {p + 6 * side, p + 6 * side + 1};
          Transfinite Curve {n} = ny(j) + 1;
        EndIf
      EndFor
      Curve Loop(p) = {k, 206 + 6 * i + j, -(k + 1), -(200 + 6 * i + j)};
      Plane Surface(p) = {p};
      Transfinite Surface {p};
      Recombine Surface {p};
    EndIf
  EndFor
EndFor
solid() = Extrude {0, 0, b} { Surface{:}; Layers{1}; Recombine; };
e = 1e-3 * t;
Physical Volume("body", 1) = {Volume{:}};
Physical Surface("base", 11) = Surface In BoundingBox{-w - e, -s, -b, -w + e, s, b};
Physical Surface("drive", 12) = Surface In BoundingBox{L/2 - e, -a/2 - e, -b, L/2 + e, a/2 + e, b};
