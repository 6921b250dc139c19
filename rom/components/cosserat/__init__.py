"""Geometrically exact rods: discrete Cosserat rods of positions and quaternions.

`shape` makes rods, `statics` brings them to rest under loads or in steady rotation, `vibration`
finds their modes, `motion` moves them, `multibody` puts them into mechanisms; `elements` and `band`
are the compiled kernels. Axes of a section: third along the rod. Loads are dead: they keep their
direction.
"""

from rom.components.cosserat.elements import Rod
from rom.components.cosserat.motion import Motion, simulate
from rom.components.cosserat.multibody import RodBody, body, shape_of
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
from rom.components.cosserat.vibration import Vibrations, modes

__all__ = [
    "Motion",
    "Rod",
    "RodBody",
    "Shape",
    "Vibrations",
    "along",
    "body",
    "clamped",
    "elastic_energy",
    "equilibrium",
    "linearised",
    "loads",
    "modes",
    "reference",
    "rod",
    "shape_of",
    "simulate",
    "straight",
    "strain",
]
