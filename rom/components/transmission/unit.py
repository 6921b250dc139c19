"""A pair of geared shafts in journal bearings: the forces in one position, and where it rests.

Datum: journals centred, shafts parallel, working flanks just touching. The pinion turns about +Z
and is driven through a torsion spring that turns at constant speed; the gear turns about -Z, and a
load torque brakes its end.

Source:
    After Fargere and Velex, who put gears and journal bearings into one model, J. Vib. Acoust.
    135 (2013) 061014.
"""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product

import numpy as np

from rom.arguments import positive
from rom.components.gear_mesh import Mesh, MeshForce
from rom.components.journal_bearing import Film, JournalBearing, film
from rom.components.transmission.housing import Housing
from rom.components.transmission.shaft import Shaft
from rom.components.transmission.solid_shaft import SolidShaft
from rom.errors import ModelError, SolverError, reached
from rom.model import Array

MIRROR_SIGNS = np.array([1.0, -1.0, -1.0, 1.0])  # x, y, phi_x, phi_y of a journal seen from behind
LOADS = (0.01, 0.03, 0.1, 0.25, 0.5, 1.0)
# to the load from heavier ones, under which films find oil more easily
WAYS_DOWN = ((1.0,), (2.0, 1.4, 1.0), (4.0, 2.8, 2.0, 1.7, 1.4, 1.2, 1.0))
MAX_ITERATIONS = 80
RESIDUAL_RTOL = 1e-10
MAX_STEP = 0.1  # of the clearance
MIN_FILM_RATIO = 2e-3  # thinnest film, of the clearance


@dataclass(frozen=True)
class Rotor:
    """A shaft, its wheel and its bearings.

    Attributes:
        shaft: of beams, or a reduced solid whose seats are its nodes.
        wheel: node in the middle of the face width.
        bearings: {node: bearing}; each described so that its journal turns from X to Y. Those of
            the gear are seen from the other end: angles count from X towards -Y.
        end: node of the coupling.
        thrust: axial stiffness of the thrust bearing, at the first of the bearings [N/m].
    """

    shaft: Shaft | SolidShaft
    wheel: int
    bearings: Mapping[int, JournalBearing]
    end: int = 0
    thrust: float = 1e8


@dataclass(frozen=True)
class Forces:
    """Forces on all coordinates and their derivatives.

    Attributes:
        force: (n,) of films and teeth [N, N m].
        stiffness, damping: (n, n) minus its derivatives [N/m, N s/m].
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
        gravity: along X and Y [m/s^2]; a housing is measured from where it sags to.
        housing: that holds the bushes; rigid if None.

    Raises:
        ModelError: for a speed, a torque or a viscosity that no unit runs with.
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
    housing: Housing | None = None

    def __post_init__(self) -> None:
        for name in ("speed", "viscosity", "motor"):
            positive(name, getattr(self, name), error=ModelError)
        if not self.torque > 0:
            raise ModelError(
                f"contact is lost: a load of {self.torque} N m does not press the working flanks "
                "together.",
                hint="Give a positive torque; turn the unit around to drive with the gear.",
            )
        for name, rotor in (("pinion", self.pinion), ("gear", self.gear)):
            nodes = rotor.shaft.nodes
            if not rotor.bearings or not all(0 <= k < nodes for k in (*rotor.bearings, rotor.end)):
                raise ModelError(f"the {name} needs bearings, all at nodes from 0 to {nodes - 1}.")
        if self.housing is not None:
            self.housing.check(self.pinion.bearings, self.gear.bearings)

    @cached_property
    def parts(self) -> tuple[slice, slice, slice]:
        """Coordinates of pinion, gear and housing."""
        last = 0 if self.housing is None else self.housing.n
        ends = np.cumsum([0, self.pinion.shaft.n, self.gear.shaft.n, last])
        first, second, third = (slice(int(a), int(b)) for a, b in pairwise(ends))
        return first, second, third

    @cached_property
    def matrices(self) -> tuple[Array, Array, Array]:
        """(n, n) mass, stiffness with the drive, gyroscopic forces per velocity."""
        n = self.parts[2].stop
        M, K, G = (np.zeros((n, n)) for _ in range(3))
        for k, (rotor, at) in enumerate(zip((self.pinion, self.gear), self.parts, strict=False)):
            M[at, at], K[at, at], gyroscopic = rotor.shaft.matrices()
            G[at, at] = self.spins[k] * gyroscopic
            thrust = self.rows(k, min(rotor.bearings))[2]
            K += rotor.thrust * np.outer(thrust, thrust)
        if self.housing is not None:
            at = self.parts[2]
            M[at, at], K[at, at] = self.housing.M, self.housing.K
        return M, K + self.motor * np.outer(self.drive, self.drive), G

    def rows(self, k: int, node: int) -> Array:
        """(6, n) motion of a node of the pinion, 0, or of the gear, 1, per coordinate [1]."""
        found = np.zeros((6, self.parts[2].stop))
        found[:, self.parts[k]] = (self.pinion, self.gear)[k].shaft.rows(node)
        return found

    @cached_property
    def drive(self) -> Array:
        """(n,) turn of the driven end per coordinate."""
        return self.rows(0, self.pinion.end)[5]

    @cached_property
    def rigid(self) -> tuple[Array, Array]:
        """(n, 6) rigid motions of pinion and gear about the origin of each."""
        found = []
        for rotor, at in zip((self.pinion, self.gear), self.parts, strict=False):
            motion = np.zeros((self.parts[2].stop, 6))
            motion[at] = rotor.shaft.rigid()
            found.append(motion)
        return found[0], found[1]

    @cached_property
    def spinning(self) -> Array:
        """(n,) rates of the coordinates as the shafts turn."""
        return self.spins[0] * self.rigid[0][:, 5] + self.spins[1] * self.rigid[1][:, 5]

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
        """(12, n) motion of both wheels per coordinate."""
        return np.vstack([self.rows(0, self.pinion.wheel), self.rows(1, self.gear.wheel)])

    @cached_property
    def journals(self) -> list[tuple[Array, JournalBearing, float]]:
        """(5, n) motion x, y, phi_x, phi_y, phi_z in the bush; bearing; +1 or -1 as it turns.

        Motions of the gear, which turns from Y to X, are mirrored to those of a journal that turns
        from X to Y.
        """
        found = []
        for k, (rotor, turn) in enumerate(((self.pinion, 1.0), (self.gear, -1.0))):
            for node, bearing in rotor.bearings.items():
                inside = self.rows(k, node)
                if self.housing is not None:
                    inside[:, self.parts[2]] -= self.housing.bushes[k][node]
                mirror = np.append(MIRROR_SIGNS if turn < 0 else np.ones(4), turn)
                found.append((mirror[:, None] * inside[[0, 1, 3, 4, 5]], bearing, turn))
        return found

    @cached_property
    def load(self) -> Array:
        """(n,) weight and torque of the load."""
        M = self.matrices[0]
        f = self.torque * self.rows(1, self.gear.end)[5]
        for axis, g in enumerate(self.gravity):
            f = f + g * (M @ (self.rigid[0] + self.rigid[1])[:, axis])
        return f

    def forces(self, q: Array, v: Array, theta: float, warm: list[Film] | None = None) -> Forces:
        """Forces of films and teeth.

        Args:
            q: (n,) coordinates [m, rad].
            v: (n,) their rates [m/s, rad/s].
            theta: angle that the drive has turned [rad].
            warm: films of a position nearby.

        Raises:
            ModelError, SolverError: if a journal touches its bush, or a film is not found.
        """
        n = q.size
        F, K, C, films = np.zeros(n), np.zeros((n, n)), np.zeros((n, n)), []
        for k, (inside, bearing, turn) in enumerate(self.journals):
            B, speed = inside[:4], abs(self.spins[0 if turn > 0 else 1])
            start = None if warm is None else warm[k].active
            f = film(bearing, B @ q, B @ v, speed=speed, viscosity=self.viscosity, warm=start)
            F += f.force @ B - f.friction_torque * inside[4]
            K += B.T @ f.stiffness @ B
            C += B.T @ f.damping @ B
            films.append(f)
        W = self.wheels
        teeth = self.mesh.forces(W @ q, theta, W @ v)
        felt = W.T @ teeth.stiffness @ W
        K += felt
        C += self.mesh.damping * felt
        return Forces(F + teeth.force @ W, K, C, films, teeth)

    def allowed(self, q: Array, step: Array) -> float:
        """Share [1] of a step that keeps films: no journal moves far, or loses half of its film.

        Args:
            q: (n,) coordinates [m, rad].
            step: (n,) their change [m, rad].
        """
        share = 1.0
        for inside, bearing, _ in self.journals:
            at, d = inside[:4] @ q, inside[:4] @ step
            moved = float(np.hypot(*d[:2])) / bearing.clearance
            share = min(share, MAX_STEP / max(moved, 1e-30))
            here = bearing.thinnest(at)
            reach = share * (np.hypot(*d[:2]) + bearing.length / 2 * np.hypot(*d[2:]))
            if reach < 0.5 * here:
                continue
            while bearing.thinnest(at + share * d) < 0.5 * here:
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
        residual: largest force that is not balanced, over the largest force [1].
    """

    unit: Transmission
    q: Array
    theta: float
    forces: Forces
    residual: float

    @property
    def input_torque(self) -> float:
        """Of the drive [N m]."""
        return -self.unit.motor * float(self.unit.drive @ self.q)

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

    A film that conserves its oil may run dry on that way and yet carry the whole load: then the
    search goes on from where films rest that find oil everywhere, under the load or a heavier one.

    Args:
        unit: the transmission.
        theta: angle of the pinion [rad].
        start: (n,) coordinates of an equilibrium nearby [m, rad]; then the load is not raised.
        loads: shares of the load on the way [1].

    Raises:
        SolverError: if films or teeth cannot carry the load; ``error.solution`` is the equilibrium
            at the share of it before, if there was one.
    """
    if start is not None:
        return _rest(unit, theta, np.array(start, dtype=float), (1.0,))
    try:
        return _rest(unit, theta, _touching(unit, theta), loads)
    except SolverError:
        for way, other in product(WAYS_DOWN, _oiled(unit)):
            with suppress(SolverError):
                near = _rest(other, theta, _touching(other, theta), (*loads, way[0]))
                return _rest(unit, theta, near.q, way)
        raise


def _rest(unit: Transmission, theta: float, q: Array, loads: tuple[float, ...]) -> Rest:
    """Equilibrium under one share of the load after the other."""
    K, f, found = unit.matrices[1], unit.load, list[Rest]()
    with reached(lambda: found[-1] if found else None):
        for share in loads:
            q, forces, residual = _newton(unit, K, share * f, q, theta)
            found.append(Rest(unit, q, theta, forces, residual))
    return found[-1]


def _oiled(unit: Transmission) -> Iterator[Transmission]:
    """The unit with films that find oil everywhere, with their grooves and without."""
    for k in range(max(len(bearing.oiled) for _, bearing, _ in unit.journals)):
        rotors = []
        for rotor in (unit.pinion, unit.gear):
            oiled = {node: (one.oiled or (one, one))[k] for node, one in rotor.bearings.items()}
            rotors.append(replace(rotor, bearings=oiled))
        yield replace(unit, pinion=rotors[0], gear=rotors[1])


def _touching(unit: Transmission, theta: float) -> Array:
    """Teeth touch, and journals are where films begin to carry: ahead of the load, as they turn."""
    closed = 1e-7 + unit.mesh.least_gap(theta)
    q = closed / unit.mesh.pair.rb[1] * unit.rigid[1][:, 5]
    x, y = unit.mesh.forces(unit.wheels @ q, theta).force[:2]
    # the gear is loaded and turns the other way than the pinion: both move alike
    ahead = np.array([-y, x]) / max(np.hypot(x, y), 1e-300)
    least = min(bearing.clearance for _, bearing, _ in unit.journals)
    return q + MAX_STEP * least * (unit.rigid[0] + unit.rigid[1])[:, :2] @ ahead


def _newton(
    unit: Transmission, K: Array, f: Array, q: Array, theta: float
) -> tuple[Array, Forces, float]:
    still, warm = np.zeros(q.size), None
    scale = _scale(unit)
    for _ in range(MAX_ITERATIONS):
        forces = unit.forces(q, still, theta, warm)
        R, warm = f + forces.force - K @ q, forces.films
        residual = float(np.abs(R * scale).max() / np.abs(f * scale).max())
        if residual < RESIDUAL_RTOL:
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
        if thin < MIN_FILM_RATIO:
            break
        try:
            step = np.linalg.solve(K + forces.stiffness, R)
        except np.linalg.LinAlgError:  # dry films hold no tilt
            break
        q = q + unit.allowed(q, step) * step
    raise SolverError(
        f"the unit does not come to rest under {unit.torque} N m at {unit.speed:.1f} rad/s: "
        f"{residual:.1e} of the load is left; the thinnest film has "
        f"{thin:.3g} clearances.",
        hint="Raise speed or viscosity, lower the torque, or move the oil inlets.",
    )


def _scale(unit: Transmission) -> Array:
    """(n,) lengths that turn forces into moments."""
    metres = [rotor.shaft.in_metres for rotor in (unit.pinion, unit.gear)]
    if unit.housing is not None:
        metres.append(np.ones(unit.housing.n, dtype=bool))
    return np.where(np.concatenate(metres), unit.mesh.pair.rb[0], 1.0)
