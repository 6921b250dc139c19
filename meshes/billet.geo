// Quarter of the section of a block with rounded edge, for upsetting; x is half the width.
width = DefineNumber[10.0, Name "width"];
height = DefineNumber[10.0, Name "height"];
radius = DefineNumber[1.0, Name "radius"];
lc = DefineNumber[1.0, Name "lc"];

Point(1) = {0, 0, 0, lc};
Point(2) = {width, 0, 0, lc};
Point(3) = {width, height - radius, 0, lc};
Point(4) = {width - radius, height - radius, 0, lc};
Point(5) = {width - radius, height, 0, lc};
Point(6) = {0, height, 0, lc};
Line(1) = {1, 2};
Line(2) = {2, 3};
Circle(3) = {3, 4, 5};
Line(4) = {5, 6};
Line(5) = {6, 1};
Curve Loop(1) = {1, 2, 3, 4, 5};
Plane Surface(1) = {1};
Physical Curve("middle") = {1};
Physical Curve("side") = {2, 3};
Physical Curve("top") = {4};
Physical Curve("axis") = {5};
Physical Surface("body") = {1};
