"""Contact of gear teeth in thin slices on the base plane, working and back flanks.

Motions q = (u1, phi1, u2, phi2) of both wheels count from the datum: wheels centred, shafts
parallel, working flanks just touching. In helical gears contact lines run as
s = r_b1 theta + k p_b + z tan(beta_b), whose normal is cos(beta_b) n_t - sin(beta_b) e_z.

Source:
    Velex and Maatar, A mathematical model for analyzing the influence of shape deviations and
    mounting errors on gear dynamic behaviour, J. Sound Vib. 191 (1996) 629.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.arguments import positive
from rom.errors import ModelError, SolverError
from rom.mbs.elements.gears.corrections import Correction
from rom.mbs.elements.gears.geometry import GearPair, involute, path_of_contact
from rom.model import Array, Index


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
        slices: where the flanks are near.
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
        pair: geometry.
        stiffness: of one pair of teeth per length of contact line [N/m^2]: a number, or (n,) values
            from first to last contact.
        correction: of the flanks.
        damping: force per rate over force per deflection of a slice [s].
        cells: slices across the face.

    Raises:
        ModelError: for a stiffness, a damping or a number of slices that no mesh has.
    """

    pair: GearPair
    stiffness: Any
    correction: Correction = field(default_factory=Correction)
    damping: float = 0.0
    cells: int = 21

    def __post_init__(self) -> None:
        k = np.atleast_1d(np.asarray(self.stiffness, dtype=float))
        if not isinstance(self.pair, GearPair) or self.pair.internal:
            raise ModelError("internal gears and racks are for elements; use Mechanism.gear_mesh.")
        if self.correction.measured:
            raise ModelError("maps and run-out are for elements; use Mechanism.gear_mesh.")
        if not (k.size and np.isfinite(k).all() and (k > 0).all()):
            raise ModelError(f"stiffness {self.stiffness} of the teeth must be positive [N/m^2].")
        for errors, z in zip(self.correction.pitch, self.pair.teeth, strict=True):
            if len(errors) not in (0, z):
                raise ModelError(f"{len(errors)} pitch errors for {z} teeth; give one per tooth.")

    def gap(self, slices: Slices, path: tuple[float, float]) -> Array:
        """(n,) normal gap of the unloaded flanks at the datum [m]."""
        c, b, e = self.correction, self.pair.width, np.zeros(slices.s.size)
        starts = (slices.s - path[1] + c.extent[0], path[0] + c.extent[1] - slices.s)
        for depth, extent, beyond in zip(c.relief, c.extent, starts, strict=True):
            if extent > 0:
                e += depth * np.clip(beyond / extent, 0.0, None) ** c.power
        e += c.crowning * (2 * slices.z / b) ** 2 + c.slope * slices.z / b
        e += abs(c.slope) / 2
        for errors in c.pitch:
            if len(errors):
                lowest = np.asarray(errors, dtype=float)
                e += (lowest - lowest.min())[(-slices.line) % len(errors)]
        back = self.pair.backlash * np.cos(self.pair.base_helix)
        return np.where(slices.back, back, e)

    def least_gap(self, theta: float) -> float:
        """How far the working flanks are apart at the datum, along the line of action [m]."""
        slices = contact_lines(
            self.pair, Line.of(self.pair, np.zeros(12)), theta, self.cells, self.pair.path
        )
        gap = self.gap(slices, self.pair.path)[~slices.back]
        return float(gap.min() / np.cos(self.pair.base_helix))

    def pair_stiffness(self, s: Array, path: tuple[float, float]) -> Array:
        """(n,) stiffness per length of contact line [N/m^2].

        Args:
            s: (n,) places of the contact on its path [m].
            path: first and last place of it [m].
        """
        k = np.atleast_1d(np.asarray(self.stiffness, dtype=float))
        if k.size == 1:
            return np.full(s.shape, k[0])
        return np.interp((s - path[0]) / (path[1] - path[0]), np.linspace(0, 1, k.size), k)

    def forces(
        self, q: npt.ArrayLike, theta: float, rate: npt.ArrayLike | None = None
    ) -> MeshForce:
        """Forces of the teeth on both wheels.

        Args:
            q: (12,) motions of the wheels from the datum [m, rad].
            theta: angle the pinion has turned [rad].
            rate: (12,) of the motions [m/s, rad/s]; without it nothing is damped.

        Raises:
            ModelError: if the wheels came so close that they have no common tangent.
        """
        q = np.asarray(q, dtype=float)
        line = Line.of(self.pair, q)
        path = path_of_contact(self.pair, line.alpha)
        slices = contact_lines(self.pair, line, theta + q[5], self.cells, path)
        V = structural_vectors(self.pair, line, slices)
        d = approach(self.pair, line, slices, V, q) - self.gap(slices, path)
        k = self.pair_stiffness(slices.s, path) * slices.length * (d > 0)
        v = np.zeros(d.size) if rate is None else V @ np.asarray(rate, dtype=float)
        load = k * (d + self.damping * v)
        K = (V * k[:, None]).T @ V
        return MeshForce(
            -V.T @ load, K, self.damping * K, 0.5 * float(k @ d**2),
            self.damping * float(k @ v**2), slices, load,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Line:
    """The line of action of wheels whose centres moved.

    Attributes:
        alpha: pressure angle [rad].
        turn: of the line of centres [rad].
        datum: pressure angle at the datum [rad].
    """

    alpha: float
    turn: float
    datum: float

    @classmethod
    def of(cls, pair: GearPair, q: Array) -> "Line":
        """Where the middles of the faces are.

        Raises:
            ModelError: if the wheels have no common tangent.
        """
        x, y = pair.distance + q[6] - q[0], q[7] - q[1]
        cosine = float(pair.rb.sum() / np.hypot(x, y))
        if not cosine < 1:
            raise ModelError(
                f"the wheels are {np.hypot(x, y) * 1e3:.4f} mm apart: their base circles overlap.",
                hint="Motions are in metres and radians.",
            )
        return cls(float(np.arccos(cosine)), float(np.arctan2(y, x)), pair.alpha)


def contact_lines(
    pair: GearPair, line: Line, theta: float, cells: int, path: tuple[float, float]
) -> Slices:
    """Contact lines of working and back flanks, cut where they leave the field of contact."""
    slant, rb = float(np.tan(pair.base_helix)), float(pair.rb[0])
    forward = rb * (theta + line.alpha - line.datum - line.turn)
    behind = float(pair.base_thickness[0]) + 2 * rb * line.alpha - forward
    both = [_cut(pair, start, t, cells, path) for start, t in ((forward, slant), (behind, -slant))]
    s, z, length, number = (np.concatenate(columns) for columns in zip(*both, strict=True))
    return Slices(s, z, length, number, np.repeat([False, True], [len(b[0]) for b in both]))


def structural_vectors(pair: GearPair, line: Line, slices: Slices) -> Array:
    """(n, 12) approach of the flanks per motion of the wheels."""
    side = np.where(slices.back, -1.0, 1.0)
    c, s = np.cos(line.turn), np.sin(line.turn)
    A = np.array([[c, -s], [s, c]])
    beta = pair.base_helix
    t = np.stack([np.full(side.size, np.sin(line.alpha)), side * np.cos(line.alpha)])
    start = pair.rb[0] * np.stack([np.full(side.size, np.cos(line.alpha)),
                                   -side * np.sin(line.alpha)])  # fmt: skip
    M = A @ (start + slices.s * t)
    centre = A @ np.array([pair.rb.sum() / np.cos(line.alpha), 0.0])
    n = np.vstack([np.cos(beta) * (A @ t), -side * np.sin(beta)]).T
    arms = [np.vstack([M - off[:, None], slices.z]).T for off in (np.zeros(2), centre)]
    return np.hstack([n, np.cross(arms[0], n), -n, -np.cross(arms[1], n)])


def approach(pair: GearPair, line: Line, slices: Slices, V: Array, q: Array) -> Array:
    """(n,) normal approach of the flanks; exact for wheels that move and turn in their plane."""
    rb, sum_rb, side = pair.rb, float(pair.rb.sum()), np.where(slices.back, -1.0, 1.0)
    opened = sum_rb * float(involute(line.alpha) - involute(line.datum))
    rolled = rb[0] * q[5] + rb[1] * q[11] - sum_rb * line.turn
    plane = np.cos(pair.base_helix) * (side * rolled - opened)
    out_of_plane = np.array([2, 3, 4, 8, 9, 10])
    return plane + V[:, out_of_plane] @ q[out_of_plane]


def transmission_error(mesh: Mesh, torque: float, theta: npt.ArrayLike) -> Array:
    """(n,) loaded error along the line of action when nothing but the teeth gives way [m].

    Args:
        mesh: of the wheels.
        torque: on the pinion [N m].
        theta: (n,) angles of the pinion [rad].

    Raises:
        ModelError: without a torque that closes the working flanks.
        SolverError: if the teeth do not come to rest.
    """
    positive("torque", torque, error=ModelError)
    return np.array([_closed(mesh, torque, t) for t in np.atleast_1d(theta)])


def _closed(mesh: Mesh, torque: float, theta: float) -> float:
    q, rb = np.zeros(12), float(mesh.pair.rb[0])
    line = Line.of(mesh.pair, q)
    slices = contact_lines(mesh.pair, line, theta, mesh.cells, mesh.pair.path)
    use = ~slices.back
    e = mesh.gap(slices, mesh.pair.path)[use] / np.cos(mesh.pair.base_helix)
    k = mesh.pair_stiffness(slices.s, mesh.pair.path) * slices.length
    k = k[use] * np.cos(mesh.pair.base_helix) ** 2
    x = float(e.max()) + torque / (rb * float(k.sum()))
    for _ in range(200):
        on = e < x
        new = (torque / rb + float(k[on] @ e[on])) / float(k[on].sum())
        if abs(new - x) <= 1e-14 * abs(x):
            return new
        x = new
    raise SolverError(f"the teeth do not come to rest at theta = {theta} rad.")


def _cut(
    pair: GearPair, start: float, slant: float, cells: int, path: tuple[float, float]
) -> tuple[Array, Array, Array, Index]:
    """Pieces of the lines s = start + k p_b + slant z within path and face."""
    A, B = path
    edges, p = np.linspace(-pair.width / 2, pair.width / 2, cells + 1), pair.base_pitch
    reach = abs(slant) * pair.width / 2
    k = np.arange(np.floor((A - start - reach) / p), np.ceil((B - start + reach) / p) + 1)
    s0 = start + k[:, None] * p
    if slant == 0.0:
        low, high = np.broadcast_arrays(edges[:-1], np.where((s0 >= A) & (s0 < B), edges[1:], -1))
    else:
        ends = np.sort(np.stack([(A - s0) / slant, (B - s0) / slant]), axis=0)
        low, high = np.maximum(edges[:-1], ends[0]), np.minimum(edges[1:], ends[1])
    row, column = np.nonzero(high - low > 1e-15)
    a, b = low[row, column], high[row, column]
    z = (a + b) / 2
    return s0[row, 0] + slant * z, z, (b - a) / np.cos(np.arctan(slant)), k[row].astype(np.int64)
