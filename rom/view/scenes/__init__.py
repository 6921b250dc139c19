"""Pictures and films of bodies in space.

`meshes`, `faces` with labels, `mode_shapes`, of whole wheels too; `film` of a mechanism at its
start and in motion, with `rigid` bodies as tubes; `connections` are joints and springs,
`ground` what they stand on, `places` where all of it is. `animation_files` for other programs,
`window` to turn things in.
"""
