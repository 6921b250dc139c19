"""Pictures and films of bodies in space.

`meshes`, `mode_shapes`, whole `wheels` and placed `mechanisms`; `film` of a motion, with `rods` as
boxes; `animation_files` for other programs, `window` to turn things around in.
"""
