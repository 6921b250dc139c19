"""Assumed-strain triangle for plane and axisymmetric solids, after Flores.

Total Lagrangian. The metric is evaluated at the middles of the sides, each from the four nodes of
two neighbouring triangles; logarithmic strain, plasticity of von Mises with linear hardening.
"""

from rom.components.assumed_strain.motion import (
    Flight,
    Metal,
    equilibrium,
    fly,
    forces,
    mass,
    tangent,
)
from rom.components.assumed_strain.sides import stiffness_by_sides
from rom.components.assumed_strain.space import in_space
from rom.components.assumed_strain.triangles import Sheet, rectangle, sheet

__all__ = [
    "Flight",
    "Metal",
    "Sheet",
    "equilibrium",
    "fly",
    "forces",
    "in_space",
    "mass",
    "rectangle",
    "sheet",
    "stiffness_by_sides",
    "tangent",
]
