// Crank of one throw: shaft journal along z at the origin, web, crank pin at (r, 0). Lengths in m.
// Volume "body"; surfaces "shaft" (end face of the journal) and "pin" (cylinder of the crank pin).
SetFactory("OpenCASCADE");
DefineConstant[
  r = {0.04, Name "r"},                  // throw: distance of the pin from the shaft
  d_shaft = {0.036, Name "d_shaft"},     // diameter of the shaft journal
  l_shaft = {0.05, Name "l_shaft"},      // length of the shaft journal
  d_pin = {0.03, Name "d_pin"},          // diameter of the crank pin
  l_pin = {0.026, Name "l_pin"},         // length of the crank pin
  t_web = {0.014, Name "t_web"},         // thickness of the web
  R_web = {0.028, Name "R_web"},         // radius of the web around the shaft
  r_web = {0.022, Name "r_web"},         // radius of the web around the pin
  lc = {0.007, Name "lc"}                // element size
];
If (d_shaft > 2 * R_web || d_pin > 2 * r_web)
  Error("journals must lie within the web: d_shaft = %g <= 2 R_web = %g, d_pin = %g <= 2 r_web = %g",
    d_shaft, 2 * R_web, d_pin, 2 * r_web);
  Abort;
EndIf
If (Abs(R_web - r_web) >= r)
  Error("the throw r = %g must exceed the difference of the web's radii %g and %g", r, R_web, r_web);
  Abort;
EndIf
// The web is the hull of two discs: discs and the trapezium between their common tangents.
Cylinder(1) = {0, 0, 0, 0, 0, -t_web, R_web};
Cylinder(2) = {r, 0, 0, 0, 0, -t_web, r_web};
s = (R_web - r_web) / r;                 // sine of the tangents' inclination
c = Sqrt(1 - s * s);
Point(1001) = {R_web * s, R_web * c, -t_web};
Point(1002) = {r + r_web * s, r_web * c, -t_web};
Point(1003) = {r + r_web * s, -r_web * c, -t_web};
Point(1004) = {R_web * s, -R_web * c, -t_web};
Line(1001) = {1001, 1002};
Line(1002) = {1002, 1003};
Line(1003) = {1003, 1004};
Line(1004) = {1004, 1001};
Curve Loop(1001) = {1001, 1002, 1003, 1004};
Plane Surface(1001) = {1001};
between() = Extrude {0, 0, t_web} { Surface{1001}; };
Cylinder(4) = {0, 0, -t_web, 0, 0, -l_shaft, d_shaft / 2};
Cylinder(5) = {r, 0, 0, 0, 0, l_pin, d_pin / 2};
body() = BooleanUnion{ Volume{1}; Delete; }{ Volume{2, between(1), 4, 5}; Delete; };
e = 1e-4 * r;
Physical Volume("body", 1) = {body()};
z = -t_web - l_shaft;
Physical Surface("shaft", 11) =
  Surface In BoundingBox{-d_shaft, -d_shaft, z - e, d_shaft, d_shaft, z + e};
around() = Surface In BoundingBox{
  r - d_pin / 2 - e, -d_pin / 2 - e, -e, r + d_pin / 2 + e, d_pin / 2 + e, l_pin + e};
flat() = Surface In BoundingBox{
  r - d_pin, -d_pin, l_pin - e, r + d_pin, d_pin, l_pin + e};
around() -= flat();
Physical Surface("pin", 12) = {around()};
Mesh.MeshSizeMin = lc;
Mesh.MeshSizeMax = lc;
