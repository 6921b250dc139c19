"""Readers of meshes and geometries.

`abaqus` and `nastran` read a `deck`, `gmsh_session` geometries with `step`, `builder` and
`gmsh_groups`; `readers` picks one. `script` and `confinement` keep a foreign geometry from harm.
"""
