// A strip in its plane, along x; its ends of the length "end" are faces of their own.
length = DefineNumber[0.4, Name "length"];
width = DefineNumber[0.04, Name "width"];
end = DefineNumber[0.01, Name "end"];
lc = DefineNumber[0.01, Name "lc"];

x() = {0, end, length - end, length};
For k In {0 : 3}
  Point(2*k + 1) = {x(k), 0, 0, lc};
  Point(2*k + 2) = {x(k), width, 0, lc};
  Line(k + 1) = {2*k + 1, 2*k + 2};
EndFor
For k In {0 : 2}
  Line(10 + k) = {2*k + 1, 2*k + 3};
  Line(20 + k) = {2*k + 2, 2*k + 4};
  Curve Loop(k + 1) = {10 + k, k + 2, -(20 + k), -(k + 1)};
  Plane Surface(k + 1) = {k + 1};
EndFor
Physical Curve("root") = {2}; // where the strip leaves its clamp
Physical Curve("tip") = {3};
Physical Surface("body") = {1, 2, 3};
