// Box with a removable component (BARC): a square tube, cut along one wall, carries two channels, and
// these a beam. Lengths in m; x along the beam, z along the tube. Volumes "box", "left", "right" and
// "beam", of those that are asked for. Where parts meet, in parts alone: surfaces "left_foot",
// "right_foot", "left_top" and "right_top", whole faces; or with half-widths of squares around the
// bolts "left_foot_1" to "left_foot_4", "right_foot_1" to "right_foot_4", "left_top" and "right_top".
SetFactory("OpenCASCADE");
DefineConstant[
  part = {0, Name "part"},            // 0: all in one piece; 1: box; 2: left channel; 3: right one; 4: beam
  r_foot = {0, Name "r_foot"},        // half-width of the squares around the bolts of the feet; 0: whole faces
  r_top = {0, Name "r_top"},          // around those of the beam
  t_box = {6.35e-3, Name "t_box"},    // wall of the box
  t = {3.175e-3, Name "t"},           // thickness of channels and beam
  lc = {0.008, Name "lc"}             // element size
];
a = 0.0762; y_2 = a + 0.0508; z_1 = 0.0254; w = 0.0254; x_m = 0.0508; z_m = 0.0381; d = 4.76e-3;
If ((r_foot > 0) != (r_top > 0) || (part == 0 && r_foot > 0) || r_foot >= d || r_top > w / 2)
  Error("patches need a part, r_foot = %g below %g and r_top = %g up to %g", r_foot, d, r_top, w / 2);
  Abort;
EndIf
If (part == 0 || part == 1)
  Box(1) = {-a, -a, 0, 2 * a, 2 * a, a};
  Box(11) = {-a + t_box, -a + t_box, -a, 2 * (a - t_box), 2 * (a - t_box), 3 * a};
  Box(12) = {-6.35e-3, a - 2 * t_box, -a, 12.7e-3, 4 * t_box, 3 * a};
  BooleanDifference(101) = { Volume{1}; Delete; }{ Volume{11, 12}; Delete; };
EndIf
If (part == 0 || part == 2) // its web lies across z
  Box(2) = {-x_m - w / 2, a, z_1, w, y_2 - a, w};
  Box(21) = {-x_m - w, a + t, z_1 + t, 2 * w, y_2 - a - 2 * t, w};
  BooleanDifference(102) = { Volume{2}; Delete; }{ Volume{21}; Delete; };
EndIf
If (part == 0 || part == 3) // its web lies across x
  Box(3) = {x_m - w / 2, a, z_1, w, y_2 - a, w};
  Box(31) = {x_m - w / 2 - t, a + t, z_1 - w, w, y_2 - a - 2 * t, 3 * w};
  BooleanDifference(103) = { Volume{3}; Delete; }{ Volume{31}; Delete; };
EndIf
If (part == 0 || part == 4)
  Box(104) = {-x_m - w / 2, y_2, z_1, 2 * x_m + w, t, w};
EndIf
// what is printed on the faces where parts meet: four places of each foot, one of each end of the beam
marks() = {};
For i In {0:9}
  side = i % 2 ? 1 : -1;
  foot = i < 8;
  r = r_foot == 0 ? w / 2 : foot ? r_foot : r_top;
  x = side * x_m + (foot && r_foot > 0 ? (Floor(i / 2) % 2 ? d : -d) : 0);
  z = z_m + (foot && r_foot > 0 ? (i < 4 ? -d : d) : 0);
  If ((part == (side < 0 ? 2 : 3) || part == (foot ? 1 : 4)) && (r_foot > 0 || !foot || i < 2))
    s = 1000 + i; Rectangle(s) = {x - r, -r, 0, 2 * r, 2 * r};
    Rotate{ {1, 0, 0}, {0, 0, 0}, Pi / 2 }{ Surface{s}; }
    Translate{0, foot ? a : y_2, z}{ Surface{s}; }
    marks() += {s};
  EndIf
EndFor
solids() = Volume{:};
If (#marks() > 0)
  BooleanFragments{ Volume{solids()}; Delete; }{ Surface{marks()}; Delete; }
ElseIf (#solids() > 1)
  Coherence;
EndIf
e = 1e-6;
If (part == 0 || part == 1)
  Physical Volume("box", 1) = Volume In BoundingBox{-a - e, -a - e, -e, a + e, a + e, a + e};
EndIf
If (part == 0 || part == 2)
  Physical Volume("left", 2) = Volume In BoundingBox{-a, a - e, z_1 - e, 0, y_2 + e, z_1 + w + e};
EndIf
If (part == 0 || part == 3)
  Physical Volume("right", 3) = Volume In BoundingBox{0, a - e, z_1 - e, a, y_2 + e, z_1 + w + e};
EndIf
If (part == 0 || part == 4)
  Physical Volume("beam", 4) = Volume In BoundingBox{-a, y_2 - e, z_1 - e, a, y_2 + t + e, z_1 + w + e};
EndIf
For i In {0:9}
  side = i % 2 ? 1 : -1;
  foot = i < 8;
  If (part == (side < 0 ? 2 : 3) || part == (foot ? 1 : 4))
    r = foot ? r_foot : r_top;
    x = side * x_m + (foot && r > 0 ? (Floor(i / 2) % 2 ? d : -d) : 0);
    z = z_m + (foot && r > 0 ? (i < 4 ? -d : d) : 0);
    y = foot ? a : y_2;
    r = r > 0 ? r : w / 2;
    name = "left";
    If (side > 0)
      name = "right";
    EndIf
    If (foot && r_foot > 0)
      Physical Surface(StrCat(name, Sprintf("_foot_%g", Floor(i / 2) + 1)), 10 + i) = Surface In BoundingBox{x - r - e, y - e, z - r - e, x + r + e, y + e, z + r + e};
    ElseIf (foot && i < 2)
      Physical Surface(StrCat(name, "_foot"), 10 + i) = Surface In BoundingBox{x - r - e, y - e, z - r - e, x + r + e, y + e, z + r + e};
    ElseIf (!foot)
      Physical Surface(StrCat(name, "_top"), 10 + i) = Surface In BoundingBox{x - r - e, y - e, z - r - e, x + r + e, y + e, z + r + e};
    EndIf
  EndIf
EndFor
Mesh.MeshSizeMin = lc;
Mesh.MeshSizeMax = lc;
Mesh.Algorithm3D = 1;
