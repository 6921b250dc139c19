"""Geometrically exact rods: discrete Cosserat rods of positions and quaternions.

`rom.mbs.elements.rods` makes rods and puts them into mechanisms; here `statics` brings one alone to
rest under loads or in steady rotation along its `band`, `vibration` finds its modes, `motion` moves
it as a mechanism. `helical_spring` are springs as rods, `linear_pieces` cuts one into linear
bodies. Axes of a section: third along the rod. Loads are dead: they keep their direction.
"""

from rom.lazy import front

front(__name__)
