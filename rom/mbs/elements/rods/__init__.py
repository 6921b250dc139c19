"""Geometrically exact rods in mechanisms: frames, and elements of stretch and bending between them.

`shapes` makes rods and says where they are, `energy` holds the mechanics of their elements with
exact tangents, `bodies` the laws by which they take part, as `rom.Mechanism.add_nonlinear` asks,
`coils` the stop of a spring whose coils touch.
"""
