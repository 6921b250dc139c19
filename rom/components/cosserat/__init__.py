"""Geometrically exact rods: discrete Cosserat rods of positions and quaternions.

`shape` makes rods, `statics` brings them to rest under loads or in steady rotation, `vibration`
finds their modes, `motion` moves them, `multibody` puts them into mechanisms; `helical_spring` are
springs as rods, `linear_pieces` cuts one into linear bodies; `elements` and `band` are the
compiled kernels. Axes of a section: third along the rod. Loads are dead: they keep their direction.
"""

from rom.lazy import front

front(__name__)
