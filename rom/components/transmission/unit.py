"""A pair of geared shafts in journal bearings, and the forces in one position.

Datum: journals centred, shafts parallel, working flanks just touching. The pinion turns about +Z
and is driven through a torsion spring that turns at constant speed; the gear turns about -Z, and a
load torque brakes its end.

Source:
    After Fargere and Velex, who put gears and journal bearings into one model, J. Vib. Acoust.
    135 (2013) 061014.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from rom.arguments import positive
from rom.components.gear_mesh import Mesh, MeshForce
from rom.components.journal_bearing import Film, JournalBearing, film
from rom.components.transmission.housing import Housing
from rom.components.transmission.shaft import Shaft
from rom.components.transmission.solid_shaft import SolidShaft
from rom.errors import ModelError
from rom.model import Array

MIRROR_SIGNS = np.array([1.0, -1.0, -1.0, 1.0])  # x, y, phi_x, phi_y of a journal seen from behind


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
            text = f"contact is lost: a load of {self.torque} N m opens the working flanks"
            raise ModelError(f"{text}; turn the unit around to drive with the gear.")
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
        M, K, G = np.zeros((3, n, n))
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
        return self._of_part(k, (self.pinion, self.gear)[k].shaft.rows(node).T).T

    def _of_part(self, k: int, columns: Array) -> Array:
        """(n, m) numbers of one part among those of all."""
        found = np.zeros((self.parts[2].stop, columns.shape[1]))
        found[self.parts[k]] = columns
        return found

    @cached_property
    def drive(self) -> Array:
        """(n,) turn of the driven end per coordinate."""
        return self.rows(0, self.pinion.end)[5]

    @cached_property
    def rigid(self) -> tuple[Array, Array]:
        """(n, 6) rigid motions of pinion and gear about the origin of each."""
        pinion, gear = self.pinion.shaft.rigid(), self.gear.shaft.rigid()
        return self._of_part(0, pinion), self._of_part(1, gear)

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

    def forces(
        self,
        q: Array,
        v: Array,
        theta: float,
        warm: list[Film] | None = None,
        *,
        seen: Array | None = None,
    ) -> Forces:
        """Forces of films and teeth at q (n,) [m, rad] with rates v (n,) [m/s, rad/s].

        The drive is turned by ``theta`` [rad]. Films of a position nearby, ``warm``, save
        iterations; ``seen`` (bearings, 4) are motions of the journals in their bushes [m, rad],
        None to the first order of turns.

        Raises:
            ModelError, SolverError: if a journal touches its bush, or a film is not found.
        """
        n, films = q.size, []
        F, (K, C) = np.zeros(n), np.zeros((2, n, n))
        for k, (inside, bearing, turn) in enumerate(self.journals):
            B, speed = inside[:4], abs(self.spins[0 if turn > 0 else 1])
            start, at = None if warm is None else warm[k].active, B @ q if seen is None else seen[k]
            f = film(bearing, at, B @ v, speed=speed, viscosity=self.viscosity, warm=start)
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


@dataclass(frozen=True)
class Rest:
    """Where a unit rests while it turns slowly through one position of its teeth.

    Attributes:
        unit: which.
        q: (n,) coordinates [m, rad].
        theta: angle of the pinion [rad].
        forces: of films and teeth.
        residual: what is not balanced over the load, both by how they would move the shafts [1].
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
