// Strip bent to an arc of a circle, as a blade of a fan. Lengths in m. It starts at x = r along x and
// bends towards z; its width lies along y. Volume "blade"; surfaces "root" and "tip".
DefineConstant[
  r = {0.1, Name "r"},         // radius of the root
  L = {0.5, Name "L"},         // length of the arc
  bend = {60, Name "bend"},    // angle from root to tip in degrees
  b = {0.03, Name "b"},        // width
  h = {0.004, Name "h"},       // thickness
  nl = {24, Name "nl"},        // hexahedra along the arc
  nb = {1, Name "nb"},         // ... over the width
  nh = {1, Name "nh"}          // ... through the thickness
];
angle = bend * Pi / 180;
Point(1) = {r, -b/2, -h/2};
Point(2) = {r, b/2, -h/2};
Point(3) = {r, b/2, h/2};
Point(4) = {r, -b/2, h/2};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Transfinite Curve {1, 3} = nb + 1;
Transfinite Curve {2, 4} = nh + 1;
Transfinite Surface {1};
Recombine Surface {1};
strip() = Extrude {{0, -1, 0}, {r, 0, L / angle}, angle} { Surface{1}; Layers{nl}; Recombine; };
Physical Volume("blade", 1) = {strip(1)};
Physical Surface("root", 11) = {1};
Physical Surface("tip", 12) = {strip(0)};
