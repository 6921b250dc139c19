"""Readers of meshes and geometries.

`abaqus` and `nastran` read a `deck`, `gmsh_session` geometries with `step`, `builder` and
`gmsh_groups`; `cad_faces` describes their faces and names those that are picked. `script` keeps a
foreign geometry from harm.
"""
