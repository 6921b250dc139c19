"""A single-stage unit of rigid shafts, for the program of its own and as a mechanism."""

from benchmarks.units import RigidShaft, with_shafts
from cases.gear_unit import unit

SPAN = 0.2
SIZES = ((9.0, 6e-2, 1.3e-2), (60.0, 1.6, 3.0))  # mass, inertia across and about, of both shafts


def rigid_unit(**more):
    """`cases.gear_unit.unit` with rigid shafts."""
    return with_shafts(unit(**more), tuple(RigidShaft(*size, SPAN) for size in SIZES))
