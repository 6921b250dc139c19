"""Pictures and films of bodies in space.

`meshes`, `faces` with labels, `mode_shapes`, whole `wheels` and placed `mechanisms`; `film` of a
motion, with `rods` as boxes and `rigid` bodies as tubes; `connections` are joints and springs,
`ground` what they stand on, `places` where all of it is. `animation_files` for other programs,
`window` to turn things in.
"""
