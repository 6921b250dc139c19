"""Readers of meshes and geometries.

`abaqus` and `nastran` read a `deck`, `gmsh_session` geometries with `step`, `builder` and
`gmsh_groups`, or `gmsh_triangles` of plane sections; `cad_faces` describes their faces, `picking`
names some. `readers` chooses one. `script` and `confinement` keep a foreign geometry from harm.
"""
