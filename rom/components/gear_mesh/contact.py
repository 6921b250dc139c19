"""Contact of gear teeth in one position of two wheels, by the element of mechanisms.

Motions q = (u1, phi1, u2, phi2) of both wheels count from the datum: wheels centred, shafts
parallel, working flanks just touching. How flanks touch says `gears.teeth`.

Source:
    Velex and Maatar, A mathematical model for analyzing the influence of shape deviations and
    mounting errors on gear dynamic behaviour, J. Sound Vib. 191 (1996) 629.
"""

from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
import numpy.typing as npt

from rom.arguments import one_each, positive, vector
from rom.components.gear_mesh.gears.corrections import Correction
from rom.components.gear_mesh.gears.geometry import GearPair, path_of_contact
from rom.components.gear_mesh.gears.meshes import GEAR_MESHES_FAMILY
from rom.components.gear_mesh.gears.table import HEIGHT, LENGTH, LOAD, PHASE, PLACE, SIDE
from rom.errors import ModelError
from rom.mbs.analysis.local_equations import Instant, instant
from rom.mbs.equations.equations import tangents
from rom.mbs.mechanism import Mechanism
from rom.model import Array, Index
from rom.rotation import matrix


@dataclass(frozen=True, slots=True)
class Slices:
    """Short pieces of contact lines.

    Attributes:
        s: (n,) place along the path of contact, from T1 [m].
        z: (n,) along the face [m].
        length: (n,) of the piece [m].
        line: (n,) number of the contact line.
        back: (n,) whether it is on the back flanks.
    """

    s: Array
    z: Array
    length: Array
    line: Index
    back: npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class MeshForce:
    """What the teeth do in one position.

    Attributes:
        force: (12,) on (u1, phi1, u2, phi2) [N, N m].
        stiffness, damping: (12, 12) minus its derivatives [N/m, N/rad; N s/m, N s/rad; N m/rad, N m
            s/rad].
        energy: stored [J].
        lost: power of the damping [W].
        slices: where the flanks touch.
        load: (n,) normal force on the slices [N].
    """

    force: Array
    stiffness: Array
    damping: Array
    energy: float
    lost: float
    slices: Slices
    load: Array


@dataclass(frozen=True)
class Mesh:
    """Two wheels in mesh.

    Attributes:
        stiffness: of one pair of teeth per length of contact line [N/m^2]: a number, or (n,) values
            from first to last contact.
        damping: force per rate over force per deflection of a slice [s].
        cells: slices across the face.

    Raises:
        ModelError: for a stiffness, a damping or a number of slices that no mesh has.
    """

    pair: GearPair
    stiffness: npt.ArrayLike
    correction: Correction = field(default_factory=Correction)
    damping: float = 0.0
    cells: int = 21

    def __post_init__(self) -> None:
        k = vector("stiffness of the teeth [N/m^2]", self.stiffness, error=ModelError)
        if not isinstance(self.pair, GearPair) or self.pair.internal:
            raise ModelError("internal gears and racks are for elements; use Mechanism.gear_mesh.")
        if self.correction.measured:
            raise ModelError("maps and run-out are for elements; use Mechanism.gear_mesh.")
        positive("stiffness of the teeth [N/m^2]", k.min(), error=ModelError)
        for errors, z in zip(self.correction.pitch, self.pair.teeth, strict=True):
            if len(errors):
                one_each("pitch errors", len(errors), "teeth", z, error=ModelError)

    def least_gap(self, theta: float) -> float:
        """How far the working flanks are apart at the datum, along the line of action [m]."""
        return _closed(self, 0.0, theta)

    def pair_stiffness(self, s: Array, path: tuple[float, float]) -> Array:
        """(n,) stiffness per length of contact line [N/m^2].

        Places s (n,) of the contact lie on its path, from first to last [m].
        """
        k = np.atleast_1d(np.asarray(self.stiffness, dtype=float))
        return np.interp((s - path[0]) / (path[1] - path[0]), np.linspace(0, 1, k.size), k)

    def forces(
        self, q: npt.ArrayLike, theta: float, rate: npt.ArrayLike | None = None
    ) -> MeshForce:
        """Forces of the teeth on both wheels.

        Motions q (12,) of the wheels count from the datum [m, rad], theta is the angle that the
        pinion has turned [rad]; without their rate (12,) [m/s, rad/s] nothing is damped.

        Raises:
            ModelError: if the wheels came so close that they have no common tangent.
        """
        now, q = self._wheels, np.asarray(q, dtype=float)
        apart = float(np.hypot(self.pair.distance + q[6] - q[0], q[7] - q[1]))
        if not apart > self.pair.rb.sum():
            text = f"the wheels are {apart * 1e3:.4f} mm apart: their base circles overlap"
            raise ModelError(f"{text}; motions are in metres and radians.")
        W, teeth, still = now.W, now.packed.elements[GEAR_MESHES_FAMILY], np.zeros(12)
        teeth.size[0, PHASE], none = theta, np.zeros(0)
        W.base[-2:] = q[[5, 11]]  # turns are followed from there
        at = now.shifted(now.packed.q, q)
        now.residual(at, still, still, none)
        slices, k = self._slices(q, theta)
        bent = teeth.slices[0, : k.size, LOAD] / k
        energy = 0.5 * float(k @ bent**2)
        if rate is not None:
            v = np.array(rate, dtype=float).reshape(2, 2, 3)
            for wheel, x in zip(v, at.reshape(2, 7), strict=True):
                wheel[1] = wheel[1] @ matrix(x[3:])
            now.residual(at, v.ravel(), still, none)
        force = W.wrench[[teeth.i[0], teeth.j[0]]].ravel()
        load, lost = teeth.slices[0, : k.size, LOAD].copy(), float(W.power[2])
        tangents(now.system, W, still, still, none, (0.0, 1.0, 1.0))
        K, C = teeth.tangent.copy()
        return MeshForce(force, K, C, energy, lost, slices, load)

    def __getstate__(self) -> dict[str, object]:
        """All but memory of kernels, which no copy shares."""
        return {name: value for name, value in vars(self).items() if name != "_wheels"}

    @cached_property
    def _wheels(self) -> Instant:
        """The element between two free wheels at the datum."""
        mech = Mechanism(gravity=(0.0, 0.0, 0.0))
        wheel, apart = partial(mech.add_rigid, mass=1.0, inertia=(1, 1, 1)), self.pair.distance
        both = wheel("pinion", at=(0, 0, 0)), wheel("gear", at=(apart, 0, 0))
        ends = [part.marker((0, 0, 0)) for part in both]
        mesh = partial(mech.gear_mesh, pair=self.pair, stiffness=self.stiffness, cells=self.cells)
        mesh = partial(mesh, correction=self.correction, damping=self.damping, conservative=False)
        mesh("teeth", *ends, axis=(0, 0, 1), entry=0.0, phase=0.0)
        now = instant(mech, 0.0)
        teeth = now.packed.elements[GEAR_MESHES_FAMILY]
        teeth.axes[0, 9:] *= -1.0  # turns of the gear count from zero, where numbers are finest
        teeth.start[:] = 0.0
        return now

    def _slices(self, q: Array, theta: float) -> tuple[Slices, Array]:
        """Slices that bear after the last residual, and (n,) their stiffness [N/m]."""
        teeth, pair = self._wheels.packed.elements[GEAR_MESHES_FAMILY], self.pair
        x, y = pair.distance + q[6] - q[0], q[7] - q[1]
        found = teeth.slices[0, : int(teeth.n_slices[0])]
        side, s, z, length = found[:, [SIDE, PLACE, HEIGHT, LENGTH]].T
        alpha, rb = float(np.arccos(pair.rb.sum() / np.hypot(x, y))), pair.rb[0]
        forward = rb * (theta + q[5] + alpha - pair.alpha - np.arctan2(y, x))
        start = np.where(side > 0, forward, pair.base_thickness[0] + 2 * rb * alpha - forward)
        line = np.rint((s - side * np.tan(pair.base_helix) * z - start) / pair.base_pitch)
        k = self.pair_stiffness(s, path_of_contact(pair, alpha)) * length
        return Slices(s, z, length, line.astype(np.int64), side < 0), k


def transmission_error(mesh: Mesh, torque: float, theta: npt.ArrayLike) -> Array:
    """(n,) loaded error along the line of action when nothing but the teeth gives way [m].

    The torque is on the pinion [N m], which stands at the angles theta (n,) [rad].

    Raises:
        ModelError: without a torque that closes the working flanks.
    """
    positive("torque", torque, error=ModelError)
    return np.array([_closed(mesh, torque, t) for t in np.atleast_1d(theta)])


def _closed(mesh: Mesh, torque: float, theta: float) -> float:
    """Way along the line of action by which the pinion turns ahead under a torque [m].

    A module ahead all slices of the working flanks bear, and say how far each is apart. Were those
    that close first, however many, held together, the least way is that of slices that only push.
    """
    rb, slant, q = mesh.pair.rb[0], np.cos(mesh.pair.base_helix), np.zeros(12)
    q[5] = mesh.pair.module / rb
    teeth = mesh.forces(q, theta - q[5])
    k = mesh.pair_stiffness(teeth.slices.s, mesh.pair.path) * teeth.slices.length
    gap = mesh.pair.module * slant - teeth.load / k
    k, gap = np.array([k, gap])[:, np.argsort(gap)]
    ways = (torque / (rb * slant) + np.cumsum(k * gap)) / np.cumsum(k)
    return float(ways.min() / slant)
