"""A pair of geared shafts in journal bearings: the forces in one position, and where it rests.

Datum: journals centred, shafts parallel, working flanks just touching. The pinion turns about +Z
and is driven through a torsion spring that turns at constant speed; the gear turns about -Z, and a
load torque brakes its end.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rom.components.gear_mesh import Mesh, MeshForce
from rom.components.journal_bearing import Film, JournalBearing, film
from rom.components.transmission.shaft import Shaft
from rom.errors import ModelError, SolverError
from rom.model import Array, Index

MIRROR = np.array([1.0, -1.0, -1.0, 1.0])  # x, y, phi_x, phi_y of a journal seen from behind
LOADS = (0.01, 0.03, 0.1, 0.25, 0.5, 1.0)
TIMES, ENOUGH, STEP, THINNEST = 80, 1e-10, 0.1, 2e-3  # the last two in clearances


@dataclass(frozen=True)
class Rotor:
    """A shaft, its wheel and its bearings.

    Attributes:
        shaft: its nodes and pieces.
        wheel: node in the middle of the face width.
        bearings: {node: bearing}; each described so that its journal turns from X to Y. Those of
            the gear are seen from the other end: angles count from X towards -Y.
        end: node of the coupling.
        thrust: axial stiffness of the thrust bearing, at the first of the bearings [N/m].
    """

    shaft: Shaft
    wheel: int
    bearings: Mapping[int, JournalBearing]
    end: int = 0
    thrust: float = 1e8


@dataclass(frozen=True)
class Forces:
    """Forces on all coordinates and their derivatives.

    Attributes:
        force: (n,) of films and teeth [N, N m].
        stiffness, damping: (n, n) minus its derivatives.
        films: of all bearings, pinion first.
        mesh: of the teeth.
    """

    force: Array
    stiffness: Array
    damping: Array
    films: list[Film]
    mesh: MeshForce


@dataclass(frozen=True)
class Transmission:
    """A single-stage unit.

    Attributes:
        pinion, gear: rotors.
        mesh: of their teeth.
        speed: of the pinion [rad/s].
        torque: of the load on the gear [N m].
        viscosity: of the oil in the bearings [Pa s].
        motor: torsional stiffness between drive and pinion [N m/rad].
        loss: damping over stiffness of the shafts [s].
        gravity: along X and Y [m/s^2].
    """

    pinion: Rotor
    gear: Rotor
    mesh: Mesh
    speed: float
    torque: float
    viscosity: float
    motor: float = 1e5
    loss: float = 4e-6
    gravity: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not (self.speed > 0 and self.viscosity > 0 and self.motor > 0):
            raise ModelError(
                f"speed {self.speed} rad/s, viscosity {self.viscosity} Pa s and stiffness "
                f"{self.motor} N m/rad of the drive must be positive."
            )
        if not self.torque > 0:
            raise ModelError(
                f"contact is lost: a load of {self.torque} N m does not press the working flanks "
                "together.",
                hint="Give a positive torque; turn the unit around to drive with the gear.",
            )
        for name, rotor in (("pinion", self.pinion), ("gear", self.gear)):
            nodes = rotor.shaft.n // 6
            if not rotor.bearings or not all(0 <= k < nodes for k in (*rotor.bearings, rotor.end)):
                raise ModelError(f"the {name} has no bearings, or one beyond {nodes} nodes.")

    @cached_property
    def matrices(self) -> tuple[Array, Array, Array]:
        """(n, n) mass, stiffness with the drive, gyroscopic forces per velocity."""
        parts = [rotor.shaft.matrices() for rotor in (self.pinion, self.gear)]
        sizes = [self.pinion.shaft.n, self.gear.shaft.n]
        M, K, G = (np.zeros((sum(sizes), sum(sizes))) for _ in range(3))
        for k, (rotor, part) in enumerate(zip((self.pinion, self.gear), parts, strict=True)):
            spin = self.spins[k]
            at = slice(k * sizes[0], k * sizes[0] + sizes[k])
            M[at, at], K[at, at], G[at, at] = part[0], part[1], spin * part[2]
            thrust = at.start + 6 * min(rotor.bearings) + 2
            K[thrust, thrust] += rotor.thrust
        drive = 6 * self.pinion.end + 5
        K[drive, drive] += self.motor
        return M, K, G

    @property
    def spins(self) -> tuple[float, float]:
        """Speeds of rotation about Z [rad/s]."""
        z = self.mesh.pair.teeth
        return self.speed, -self.speed * z[0] / z[1]

    @property
    def mesh_period(self) -> float:
        """Time from tooth to tooth [s]."""
        return 2 * np.pi / (self.speed * self.mesh.pair.teeth[0])

    @cached_property
    def wheels(self) -> Array:
        """(12,) coordinates of the wheels."""
        second = self.pinion.shaft.n + 6 * self.gear.wheel
        first = 6 * self.pinion.wheel
        return np.concatenate([np.arange(first, first + 6), np.arange(second, second + 6)])

    @cached_property
    def journals(self) -> list[tuple[Index, JournalBearing, float]]:
        """Coordinates x, y, phi_x, phi_y, phi_z; bearing; +1 or -1 as the journal turns."""
        found = []
        for rotor, first, turn in ((self.pinion, 0, 1.0), (self.gear, self.pinion.shaft.n, -1.0)):
            for node, bearing in rotor.bearings.items():
                found.append((first + 6 * node + np.array([0, 1, 3, 4, 5]), bearing, turn))
        return found

    @cached_property
    def load(self) -> Array:
        """(n,) weight and torque of the load."""
        f, M = np.zeros(len(self.matrices[0])), self.matrices[0]
        for axis, g in enumerate(self.gravity):
            fall = np.zeros(f.size)
            fall[axis::6] = g
            f += M @ fall
        f[self.pinion.shaft.n + 6 * self.gear.end + 5] += self.torque
        return f

    def forces(self, q: Array, v: Array, theta: float, warm: list[Film] | None = None) -> Forces:
        """Forces of films and teeth.

        Args:
            q: (n,) coordinates [m, rad].
            v: (n,) their rates.
            theta: angle that the drive has turned [rad].
            warm: films of a position nearby.

        Raises:
            ModelError, SolverError: if a journal touches its bush, or a film is not found.
        """
        n = q.size
        F, K, C, films = np.zeros(n), np.zeros((n, n)), np.zeros((n, n)), []
        for k, (at, bearing, turn) in enumerate(self.journals):
            S = MIRROR if turn < 0 else np.ones(4)
            speed, i = abs(self.spins[0 if turn > 0 else 1]), at[:4]
            start = None if warm is None else warm[k].active
            f = film(bearing, S * q[i], S * v[i], speed=speed, viscosity=self.viscosity, warm=start)
            F[i] += S * f.force
            F[at[4]] -= turn * f.friction_torque
            K[np.ix_(i, i)] += np.outer(S, S) * f.stiffness
            C[np.ix_(i, i)] += np.outer(S, S) * f.damping
            films.append(f)
        w = self.wheels
        teeth = self.mesh.forces(q[w], theta, v[w])
        F[w] += teeth.force
        K[np.ix_(w, w)] += teeth.stiffness
        C[np.ix_(w, w)] += teeth.damping
        return Forces(F, K, C, films, teeth)

    def allowed(self, q: Array, step: Array) -> float:
        """Share of a step that keeps films: no journal moves far, or loses half of its film."""
        share = 1.0
        for at, bearing, turn in self.journals:
            i, S = at[:4], MIRROR if turn < 0 else np.ones(4)
            moved = float(np.hypot(*step[i[:2]])) / bearing.clearance
            share = min(share, STEP / max(moved, 1e-30))
            here = bearing.thinnest(S * q[i])
            while bearing.thinnest(S * (q[i] + share * step[i])) < 0.5 * here and share > 1e-9:
                share /= 2
        return share


@dataclass(frozen=True)
class Rest:
    """Where a unit rests while it turns slowly through one position of its teeth.

    Attributes:
        unit: which.
        q: (n,) coordinates [m, rad].
        theta: angle of the pinion [rad].
        forces: of films and teeth.
        residual: largest force that is not balanced, over the largest force.
    """

    unit: Transmission
    q: Array
    theta: float
    forces: Forces
    residual: float

    @property
    def input_torque(self) -> float:
        """Of the drive [N m]."""
        return -self.unit.motor * float(self.q[6 * self.unit.pinion.end + 5])

    @property
    def powers(self) -> tuple[float, float, float]:
        """Input, output, and heat in the films [W]."""
        first, second = self.unit.spins
        heat = sum(f.dissipated for f in self.forces.films)
        return self.input_torque * first, -self.unit.torque * second, heat


def rest(
    unit: Transmission,
    theta: float = 0.0,
    *,
    start: Array | None = None,
    loads: tuple[float, ...] = LOADS,
) -> Rest:
    """Static equilibrium, found by raising the load from the unloaded datum.

    Args:
        unit: the transmission.
        theta: angle of the pinion [rad].
        start: (n,) coordinates of an equilibrium nearby; then the load is not raised.
        loads: shares of the load on the way.

    Raises:
        SolverError: if films or teeth cannot carry the load.
    """
    K, f = unit.matrices[1], unit.load
    q = np.zeros(f.size) if start is None else np.array(start, dtype=float)
    if start is None:
        closed = 1e-7 + unit.mesh.least_gap(theta)  # teeth touch
        q[unit.pinion.shaft.n + 5 :: 6] = closed / unit.mesh.pair.rb[1]
    for share in loads if start is None else (1.0,):
        q, forces, residual = _newton(unit, K, share * f, q, theta)
    return Rest(unit, q, theta, forces, residual)


def _newton(
    unit: Transmission, K: Array, f: Array, q: Array, theta: float
) -> tuple[Array, Forces, float]:
    still, warm = np.zeros(q.size), None
    scale = _scale(unit)
    for _ in range(TIMES):
        forces = unit.forces(q, still, theta, warm)
        R, warm = f + forces.force - K @ q, forces.films
        residual = float(np.abs(R * scale).max() / np.abs(f * scale).max())
        if residual < ENOUGH:
            if not forces.mesh.load.any():
                raise SolverError(
                    "contact is lost: no teeth touch at rest.", hint="Raise the load."
                )
            return q, forces, residual
        if not forces.mesh.stiffness.any():
            raise SolverError(
                f"contact is lost: no teeth touch on the way to rest; {residual:.1e} of the load "
                "is left.",
                hint="Raise the load or the viscosity.",
            )
        thin = min(f.bearing.thinnest(f.motion) / f.bearing.clearance for f in forces.films)
        if thin < THINNEST:
            break
        step = np.linalg.solve(K + forces.stiffness, R)
        q = q + unit.allowed(q, step) * step
    raise SolverError(
        f"the unit does not come to rest under {unit.torque} N m at {unit.speed:.1f} rad/s: "
        f"{residual:.1e} of the load is left; the thinnest film has "
        f"{thin:.3g} clearances.",
        hint="Raise speed or viscosity, lower the torque, or move the oil inlets.",
    )


def _scale(unit: Transmission) -> Array:
    """(n,) lengths that turn forces into moments."""
    scale = np.full(unit.load.size, 1.0)
    scale.reshape(-1, 6)[:, :3] = unit.mesh.pair.rb[0]
    return scale
