"""A gear unit of rigid shafts, for the program of its own and as a mechanism."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rom.components.transmission import Rotor, Shaft, Transmission
from rom.mbs.mechanism import Mechanism
from rom.model import Array

Z_AXIS = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class RigidShaft:
    """A shaft that does not bend, with nodes at both ends and in the middle, where the wheel sits.

    Attributes:
        mass: with the wheel [kg].
        across, about: moments of inertia about the middle [kg m^2].
        span: length [m].
    """

    mass: float
    across: float
    about: float
    span: float = 0.2
    nodes: int = 3
    n: int = 6

    @classmethod
    def of(cls, shaft: Shaft) -> "RigidShaft":
        """A shaft of beams without its elasticity, its nodes evenly about the mass centre."""
        z, rigid = np.asarray(shaft.z, dtype=float), shaft.rigid()
        M = rigid.T @ shaft.matrices()[0] @ rigid
        across = M[3, 3] - M[0, 0] * z.mean() ** 2
        return cls(float(M[0, 0]), float(across), float(M[5, 5]), float(np.ptp(z)))

    def rows(self, node: int) -> Array:
        """(6, 6) motion of a node per coordinate [1]."""
        found, z = np.eye(6), self.span * (node - 1) / 2
        found[0, 4], found[1, 3] = z, -z
        return found

    def rigid(self) -> Array:
        """(6, 6) rigid motions about the first end."""
        found = np.eye(6)
        found[0, 4], found[1, 3] = self.span / 2, -self.span / 2
        return found

    def matrices(self) -> tuple[Array, Array, Array]:
        """(6, 6) mass, stiffness, and gyroscopic matrix per speed."""
        M, G = np.diag([*[self.mass] * 3, self.across, self.across, self.about]), np.zeros((6, 6))
        G[3, 4], G[4, 3] = self.about, -self.about
        return M, np.zeros((6, 6)), G


def with_shafts(unit: Transmission, shafts: tuple[Any, Any]) -> Transmission:
    """The unit with two shafts of three nodes, which have its bearings at their ends."""
    rotors = list[Rotor]()
    for rotor, shaft in zip((unit.pinion, unit.gear), shafts, strict=True):
        bearings = dict(zip((0, 2), rotor.bearings.values(), strict=True))
        rotors.append(replace(rotor, shaft=shaft, wheel=1, bearings=bearings))
    return replace(unit, pinion=rotors[0], gear=rotors[1])


def as_mechanism(
    unit: Transmission, oil: Any = None, seats: tuple[float, float] | None = None, **more: Any
) -> Mechanism:
    """The same unit as a mechanism: rigid shafts that spin in frames which do not turn.

    Args:
        unit: of rigid shafts.
        oil: in all films, viscosity [Pa s] or data; None for that of the unit.
        seats: of the bearings along the shafts from the wheels [m], as the program does not know
            them; None for the ends.
        more: options of the films.
    """
    mech, mesh = Mechanism(gravity=(*unit.gravity, 0.0)), unit.mesh
    half = unit.pinion.shaft.rows(2)[0, 4]
    seats = (-half, half) if seats is None else seats
    for k, (name, rotor) in enumerate((("pinion", unit.pinion), ("gear", unit.gear))):
        shaft: Any = rotor.shaft
        x, ends = k * mesh.pair.distance, {"low": seats[0], "middle": 0.0, "high": seats[1]}
        part = mech.add_rigid(name, mass=shaft.mass, at=(x, 0, half),
                              inertia=(shaft.across, shaft.across, shaft.about),
                              markers={end: (0, 0, z) for end, z in ends.items()},
                              spin=unit.spins[k] * Z_AXIS)  # fmt: skip
        for end, bearing in zip(("low", "high"), rotor.bearings.values(), strict=True):
            ground = mech.ground.marker((x, 0, half + ends[end]))
            mech.journal_bearing(f"{name} {end}", part.marker(end), ground,
                                 axis=(1 - 2 * k) * Z_AXIS, bearing=bearing,
                                 oil=unit.viscosity if oil is None else oil, **more)  # fmt: skip
            if end == "low":
                mech.bushing(f"thrust of {name}", ground, part.marker(end),
                             stiffness=(0, 0, rotor.thrust, 0, 0, 0),
                             damping=(0, 0, unit.loss * rotor.thrust, 0, 0, 0))  # fmt: skip
    pinion, gear = mech.part("pinion"), mech.part("gear")
    mech.gear_mesh("mesh", pinion.marker("middle"), gear.marker("middle"), axis=Z_AXIS,
                   pair=mesh.pair, stiffness=mesh.stiffness, correction=mesh.correction,
                   damping=mesh.damping, entry=0.0, conservative=False,
                   cells=mesh.cells)  # fmt: skip
    mech.bushing("coupling", mech.ground.marker((0, 0, half + seats[0])), pinion.marker("low"),
                 stiffness=(0, 0, 0, 0, 0, unit.motor),
                 damping=(0, 0, 0, 0, 0, unit.loss * unit.motor))  # fmt: skip
    mech.torque("load", gear.marker("low"), unit.torque * Z_AXIS)
    return mech
