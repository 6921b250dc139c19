"""A single-stage unit of rigid shafts, for the program of its own and as a mechanism."""

from dataclasses import dataclass, replace

import numpy as np

import rom
from cases.gear_unit import unit

Z, SPAN = np.array([0.0, 0.0, 1.0]), 0.2
SIZES = ((9.0, 6e-2, 1.3e-2), (60.0, 1.6, 3.0))  # mass, inertia across and about, of both shafts


@dataclass(frozen=True)
class RigidShaft:
    """A shaft that does not bend, with nodes at 0, SPAN / 2 and SPAN; the second has the wheel."""

    mass: float
    across: float
    about: float
    nodes: int = 3
    n: int = 6

    @property
    def in_metres(self):
        return np.array([True, True, True, False, False, False])

    def rows(self, node):
        found, z = np.eye(6), SPAN * (node - 1) / 2
        found[0, 4], found[1, 3] = z, -z
        return found

    def rigid(self):
        found = np.eye(6)
        found[0, 4], found[1, 3] = SPAN / 2, -SPAN / 2  # about z = 0
        return found

    def matrices(self):
        M, G = np.diag([*[self.mass] * 3, self.across, self.across, self.about]), np.zeros((6, 6))
        G[3, 4], G[4, 3] = self.about, -self.about
        return M, np.zeros((6, 6)), G


def rigid_unit(**more):
    """`cases.gear_unit.unit` with rigid shafts."""
    soft = unit(**more)
    rotors = []
    for rotor, size in zip((soft.pinion, soft.gear), SIZES, strict=True):
        bearings = dict(zip((0, 2), rotor.bearings.values(), strict=True))
        rotors.append(replace(rotor, shaft=RigidShaft(*size), wheel=1, bearings=bearings))
    return replace(soft, pinion=rotors[0], gear=rotors[1])


def as_mechanism(unit, oil=None, seats=(-SPAN / 2, SPAN / 2), **more):
    """The same unit as a mechanism: shafts that spin in frames which do not turn.

    The program knows only wheels in the middle; here seats may be elsewhere along the shafts.
    """
    mech, mesh = rom.Mechanism(gravity=(*unit.gravity, 0.0)), unit.mesh
    for k, (name, rotor) in enumerate((("pinion", unit.pinion), ("gear", unit.gear))):
        shaft, x = rotor.shaft, k * mesh.pair.distance
        ends = {"low": (0, 0, seats[0]), "middle": (0, 0, 0), "high": (0, 0, seats[1])}
        part = mech.add_rigid(name, mass=shaft.mass, at=(x, 0, SPAN / 2), markers=ends,
                              inertia=(shaft.across, shaft.across, shaft.about),
                              spin=unit.spins[k] * Z)  # fmt: skip
        for end, bearing in zip(("low", "high"), rotor.bearings.values(), strict=True):
            ground = mech.ground.marker((x, 0, SPAN / 2 + ends[end][2]))
            mech.journal_bearing(f"{name} {end}", part.marker(end), ground, axis=(1 - 2 * k) * Z,
                                 bearing=bearing, oil=unit.viscosity if oil is None else oil,
                                 **more)  # fmt: skip
            if end == "low":
                mech.bushing(f"thrust of {name}", ground, part.marker(end),
                             stiffness=(0, 0, rotor.thrust, 0, 0, 0),
                             damping=(0, 0, unit.loss * rotor.thrust, 0, 0, 0))  # fmt: skip
    pinion, gear = mech.part("pinion"), mech.part("gear")
    mech.gear_mesh("mesh", pinion.marker("middle"), gear.marker("middle"), axis=Z, pair=mesh.pair,
                   stiffness=mesh.stiffness, correction=mesh.correction, damping=mesh.damping,
                   entry=0.0, conservative=False, cells=mesh.cells)  # fmt: skip
    mech.bushing("coupling", mech.ground.marker((0, 0, SPAN / 2 + seats[0])), pinion.marker("low"),
                 stiffness=(0, 0, 0, 0, 0, unit.motor),
                 damping=(0, 0, 0, 0, 0, unit.loss * unit.motor))  # fmt: skip
    mech.torque("load", gear.marker("low"), unit.torque * Z)
    return mech
