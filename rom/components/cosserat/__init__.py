"""Geometrically exact rods: discrete Cosserat rods of positions and quaternions.

`shapes` makes rods and says where they are, `energy` holds the mechanics of their elements with
exact tangents, `bodies` the laws by which they take part in mechanisms, `coils` the stop of a
spring whose coils touch; `field` says what they have for files, by `keys`. `statics` brings one
alone to rest under loads or in steady rotation, `vibration` finds its modes, `motion` moves it as a
mechanism. `helical_spring` are springs as rods, `linear_pieces` cuts one into linear bodies. Axes
of a section: third along the rod. Loads keep their direction.
"""

from rom.lazy import front

front(__name__)
