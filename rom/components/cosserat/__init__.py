"""Geometrically exact rods: discrete Cosserat rods of positions and quaternions.

`shape` makes rods, `statics` brings them to rest under loads, `elements` and `band` are the
compiled kernels. Axes of a section: third along the rod. Loads are dead: they keep their direction.
"""

from rom.components.cosserat.elements import Rod
from rom.components.cosserat.shape import (
    Shape,
    along,
    elastic_energy,
    reference,
    rod,
    straight,
    strain,
)
from rom.components.cosserat.statics import clamped, equilibrium, linearised, loads

__all__ = [
    "Rod",
    "Shape",
    "along",
    "clamped",
    "elastic_energy",
    "equilibrium",
    "linearised",
    "loads",
    "reference",
    "rod",
    "straight",
    "strain",
]
