"""Generalised inertia of planar linkages with two motors, their links rigid or reduced bodies.

Every link moves in its own frame with a constant mass matrix; the inertia the motors feel is the
sum of J^T M J over the links, with the velocities J of a link per unit of all rates. Elastic
coordinates are held, or free to follow a sudden torque. `mechanism_inertia` finds the same from
the mass matrix and the constraints of any `rom.Mechanism`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy.linalg import null_space

from rom.arguments import one_of
from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError, ModelError
from rom.mbs.equations.equations import linearize_constraints
from rom.mbs.equations.packing import pack
from rom.mbs.integrate.consistent_start import assembled
from rom.mbs.kernels.work import workspace
from rom.mbs.mechanism import Mechanism
from rom.model import Array

Elastic = Literal["held", "free"]
MIN_HEIGHT = 1e-6  # of the tip over the way between the elbows: flatter, and it counts as one line
CHUNK_SIZE = 8192  # configurations at once: elastic links need (3 + r) (2 + sum r) numbers for each


@dataclass(frozen=True, slots=True)
class Link:
    """A planar link between two pins, its frame on the first pin, its axis through the second.

    Attributes:
        length: distance of the pins [m].
        M: (3 + r, 3 + r) mass for velocity of the first pin along and across the axis, angular
            velocity of that pin, rates of r elastic coordinates [kg, kg m, kg m^2].
        tip: (2, r) displacement of the second pin along and across per elastic coordinate [m].
    """

    length: float
    M: Array
    tip: Array

    @property
    def r(self) -> int:
        """Number of elastic coordinates."""
        return self.tip.shape[1]


def rigid_link(mass: float, length: float, centre: npt.ArrayLike, inertia: float) -> Link:
    """A rigid link.

    Args:
        mass: [kg].
        length: distance of the pins [m].
        centre: (2,) mass centre from the first pin, along and across [m].
        inertia: about the mass centre [kg m^2].

    Raises:
        ModelError: if a number is not that of a real link.
    """
    x, y = np.asarray(centre, dtype=float)
    if not (mass > 0 and length > 0 and inertia >= 0 and np.isfinite([x, y]).all()):
        raise ModelError(f"no link has mass {mass} kg, length {length} m, inertia {inertia} kg m2.")
    J = inertia + mass * (x * x + y * y)
    M = np.array([[mass, 0, -mass * y], [0, mass, mass * x], [-mass * y, mass * x, J]])
    return Link(float(length), M, np.zeros((2, 0)))


def rod(mass: float, length: float) -> Link:
    """A uniform slender rod of that mass [kg] and length [m].

    Raises:
        ModelError: for a mass or a length that is not positive.
    """
    return rigid_link(mass, length, (length / 2, 0.0), mass * length**2 / 12)


def reduced_link(body: FlexibleBody, first: str, second: str) -> Link:
    """A reduced flexible body as a link in the plane of its x and y axes.

    Its frame is moved to the first pin and turns with it. The body should be symmetric about the
    plane: motion out of it is not prevented.

    Args:
        body: the body, pins along z.
        first: name of the interface at the first pin, towards the motor.
        second: name of the interface at the second pin.

    Raises:
        InterfaceError: if an interface is unknown.
        ModelError: if the pins coincide in the plane.
    """
    body = body.with_reference(first)
    a, b = body.marker(first).point, body.marker(second)
    axis = (b.point - a)[:2]
    length = float(np.hypot(*axis))
    if length == 0.0:
        raise ModelError(f"pins {first!r} and {second!r} lie on one axis along z.")
    e = axis / length
    R = np.array([[e[0], e[1]], [-e[1], e[0]]])  # world axes to along and across
    x, y = R @ (body.first_moment - body.mass * a)[:2]
    d = body.first_moment
    J = body.inertia[2, 2] - 2 * (a[:2] @ d[:2]) + body.mass * (a[:2] @ a[:2])
    spin = body.Ibar_kl[0, 1] - body.Ibar_kl[1, 0] - (a[0] * body.S[1] - a[1] * body.S[0])
    rigid = np.array([[body.mass, 0, -y], [0, body.mass, x], [-y, x, J]])
    coupling = np.vstack([R @ body.S[:2], spin])
    return Link(length, np.block([[rigid, coupling], [coupling.T, body.M]]), R @ b.translation[:2])


@dataclass(frozen=True, slots=True)
class TwoLink:
    """A chain of two links on a fixed pivot, a point mass at its end.

    Attributes:
        first, second: the links.
        payload: mass at the tip [kg].
        relative: the second coordinate is the angle of the second link against the first one
            (motor on the elbow) and not against the ground.

    Raises:
        ModelError: for a payload that is negative.
    """

    first: Link
    second: Link
    payload: float = 0.0
    relative: bool = False

    def __post_init__(self) -> None:
        if not self.payload >= 0:
            raise ModelError(f"no payload has the mass {self.payload} kg.")

    def inertia(self, q1: npt.ArrayLike, q2: npt.ArrayLike, *, elastic: Elastic = "held") -> Array:
        """(..., 2, 2) generalised inertia [kg m^2] at angles (...) [rad].

        Args:
            q1: (...,) angle of the first link [rad].
            q2: (...,) angle of the second one, of the same shape [rad].
            elastic: "held", what slow motors feel; "free", what a sudden torque meets: the
                elastic coordinates take the rates that make the kinetic energy least.
        """
        links = _links((self.first, self.second), elastic)
        return _in_chunks(replace(self, first=links[0], second=links[1])._of_all_rates, q1, q2)

    def _of_all_rates(self, q1: Array, q2: Array) -> Array:
        n = 2 + self.first.r + self.second.r
        motion, angle = _Motion.at_rest(q1.size, n), q2 + q1 if self.relative else q2
        spin = _unit_rows(n, 0, 1) if self.relative else _unit_rows(n, 1)
        motion.add(self.first, q1, _unit_rows(n, 0), 2)
        motion.add(self.second, angle, spin, 2 + self.first.r)
        return motion.A + self.payload * _gram(motion.pin, motion.pin)


@dataclass(frozen=True, slots=True)
class FiveBar:
    """Two driven cranks on a common base, two couplers that meet in the tip.

    Attributes:
        base: distance of the driven pivots, along x [m].
        cranks, couplers: the links of the left and the right side, first pins towards the motors.
        payload: point mass at the tip [kg].
        side: 1 for the tip to the left of the line from the left to the right elbow, -1 for right.

    Raises:
        ModelError: for a payload or a base that is negative, or an unknown side.
    """

    base: float
    cranks: tuple[Link, Link]
    couplers: tuple[Link, Link]
    payload: float = 0.0
    side: int = 1

    def __post_init__(self) -> None:
        if not (self.payload >= 0 and self.base >= 0 and self.side in (1, -1)):
            raise ModelError(
                f"base = {self.base} m, payload = {self.payload} kg, side = {self.side}: needed "
                "are >= 0, >= 0, and 1 or -1."
            )

    def inertia(self, q1: npt.ArrayLike, q2: npt.ArrayLike, *, elastic: Elastic = "held") -> Array:
        """(..., 2, 2) generalised inertia [kg m^2] at angles (...) [rad] of the cranks.

        Args:
            q1: (...,) angle of the left crank against the base [rad].
            q2: (...,) angle of the right one, of the same shape [rad].
            elastic: "held" or "free", see `TwoLink.inertia`.

        Raises:
            ModelError: if the couplers cannot reach each other at some angles.
        """
        a, b, c, d = _links(self.cranks + self.couplers, elastic)
        moved = replace(self, cranks=(a, b), couplers=(c, d))
        return _in_chunks(moved._of_all_rates, q1, q2)

    def posture(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> Array:
        """Where the joints are at angles of the cranks.

        Args:
            q1: (...,) angle of the left crank against the base [rad].
            q2: (...,) angle of the right one, of the same shape [rad].

        Returns:
            (..., 5, 2) left pivot, left elbow, tip, right elbow, right pivot [m].

        Raises:
            ModelError: if the couplers cannot reach each other at some angles.
        """
        pivots, left, right = self._elbows(q1, q2)
        q1, q2 = np.broadcast_arrays(np.asarray(q1, dtype=float), np.asarray(q2, dtype=float))
        a, b = (coupler.length for coupler in self.couplers)
        gap, square, along, height = self._triangle(left, right)
        if not (height > 0).all():
            k = np.unravel_index(np.argmin(np.where(np.isnan(height), -np.inf, height)), q1.shape)
            raise ModelError(
                f"at q = ({q1[k]:.4g}, {q2[k]:.4g}) the elbows are {np.sqrt(square[k]):.4g} m "
                f"apart; couplers of {a:.4g} m and {b:.4g} m do not meet or lie in one line.",
                hint="Lengthen the couplers or shorten the cranks.",
            )
        across = self.side * np.sqrt(height)[..., None] * _left_of(gap)
        return np.stack(
            [pivots[0], left, left + along[..., None] * gap + across, right, pivots[1]], axis=-2
        )

    def assembles(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether the couplers meet at angles (...) of the cranks [rad], and not in one line."""
        _, left, right = self._elbows(q1, q2)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self._triangle(left, right)[3] > MIN_HEIGHT**2)

    def _elbows(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """Pivots (2, ..., 2) and both elbows (..., 2) [m]."""
        q1, q2 = np.broadcast_arrays(np.asarray(q1, dtype=float), np.asarray(q2, dtype=float))
        pivots = np.zeros((2, *q1.shape, 2))
        pivots[1, ..., 0] = self.base
        left, right = (
            pivot + crank.length * _directions(q)
            for pivot, crank, q in zip(pivots, self.cranks, (q1, q2), strict=True)
        )
        return pivots, left, right

    def _triangle(self, left: Array, right: Array) -> tuple[Array, Array, Array, Array]:
        """Way between the elbows, its square, and the tip along it and, squared, across it."""
        a, b = (coupler.length for coupler in self.couplers)
        gap = right - left
        square = (gap**2).sum(axis=-1)
        along = 0.5 * (square + a * a - b * b) / square
        return gap, square, along, a * a / square - along**2

    def _of_all_rates(self, q1: Array, q2: Array) -> Array:
        links = self.cranks + self.couplers
        at = 2 + np.cumsum([0, *(link.r for link in links)])
        n, N = int(at[-1]), q1.size
        sides = [_Motion.at_rest(N, n) for _ in range(2)]
        for k, q in enumerate((q1, q2)):
            sides[k].add(links[k], q, _unit_rows(n, k), at[k])
        P = self.posture(q1, q2)
        arms = P[:, 2] - P[:, 1], P[:, 2] - P[:, 3]
        angles = [np.arctan2(arm[:, 1], arm[:, 0]) for arm in arms]
        # both couplers bring the same velocity to the tip: two equations for their two spins
        slip = [
            sides[k].pin + _elastic_tip(links[2 + k], angles[k], n, at[2 + k]) for k in range(2)
        ]
        closing = np.stack([_left_of(arms[0]), -_left_of(arms[1])], axis=-1)
        spins = np.linalg.solve(closing, slip[1] - slip[0])
        for k in range(2):
            sides[k].add(links[2 + k], angles[k], spins[:, k], at[2 + k])
        return sides[0].A + sides[1].A + self.payload * _gram(sides[0].pin, sides[0].pin)


@dataclass
class _Motion:
    """Kinetic energy of a chain and velocity of its last pin, per unit of all n rates.

    Attributes:
        A: (N, n, n) inertia of the links added so far.
        pin: (N, 2, n) velocity of the last pin.
    """

    A: Array
    pin: Array

    @classmethod
    def at_rest(cls, N: int, n: int) -> "_Motion":
        return cls(np.zeros((N, n, n)), np.zeros((N, 2, n)))

    def add(self, link: Link, angle: Array, spin: Array, at: int) -> None:
        """Add a link at an angle (N,) that turns with ``spin`` (N or 1, n)."""
        N, _, n = self.pin.shape
        e = _directions(angle)
        R = np.stack([e, _left_of(e)], axis=1)  # rows along and across
        J = np.zeros((N, 3 + link.r, n))
        J[:, :2], J[:, 2] = R @ self.pin, spin
        J[:, 3:, at : at + link.r] = np.eye(link.r)
        self.A += _gram(J, link.M @ J)
        swing = link.length * _left_of(e)[:, :, None] * spin[:, None]
        self.pin = self.pin + swing + _elastic_tip(link, angle, n, at)


def _elastic_tip(link: Link, angle: Array, n: int, at: int) -> Array:
    """(N, 2, n) velocity of the second pin relative to the frame of the link."""
    e, out = _directions(angle), np.zeros((angle.size, 2, n))
    out[:, :, at : at + link.r] = np.stack([e, _left_of(e)], axis=2) @ link.tip
    return out


def _directions(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _left_of(x: Array) -> Array:
    return np.stack([-x[..., 1], x[..., 0]], axis=-1)


def _unit_rows(n: int, *ones: int) -> Array:
    row = np.zeros((1, n))
    row[0, list(ones)] = 1.0
    return row


def _gram(X: Array, Y: Array) -> Array:
    return np.swapaxes(X, -1, -2) @ Y


def _links(links: tuple[Link, ...], elastic: Elastic) -> tuple[Link, ...]:
    if one_of("elastic", elastic, ("held", "free")) == "free":
        return links
    return tuple(replace(link, M=link.M[:3, :3], tip=np.zeros((2, 0))) for link in links)


def _in_chunks(of_all_rates: Callable[[Array, Array], Array], q1: Any, q2: Any) -> Array:
    """Inertia of the two motors, for angles of any shape, from that of all rates."""
    q1, q2 = np.broadcast_arrays(np.asarray(q1, dtype=float), np.asarray(q2, dtype=float))
    x, y, out = q1.ravel(), q2.ravel(), np.empty((q1.size, 2, 2))
    for k in range(0, q1.size, CHUNK_SIZE):
        A = of_all_rates(x[k : k + CHUNK_SIZE], y[k : k + CHUNK_SIZE])
        freed = (
            A[:, :2, 2:] @ np.linalg.solve(A[:, 2:, 2:], A[:, 2:, :2]) if A.shape[1] > 2 else 0.0
        )
        out[k : k + CHUNK_SIZE] = A[:, :2, :2] - freed
    return out.reshape(*q1.shape, 2, 2)


def mechanism_inertia(
    mechanism: Mechanism,
    drives: tuple[str, str],
    *,
    angles: npt.ArrayLike = (0.0, 0.0),
    elastic: Elastic = "held",
) -> Array:
    """(2, 2) generalised inertia of a mechanism that two drives move [kg m^2], from constraints.

    With the mass matrix M of all bodies, motions N that the joints allow and their drive rates E,
    it is the inverse of E N (N^T M N)^-1 N^T E^T; elastic coordinates held are left out of N.

    Args:
        mechanism: bodies and joints; everything else that moves it is left out.
        drives: names of the two drives.
        angles: (2,) their joint coordinates [rad or m]; with a displacement the inertia is mixed
            too.
        elastic: "held" or "free", see `TwoLink.inertia`.

    Raises:
        ConfigError: if a drive is unknown.
        ModelError: if the drives do not determine the motion there, or it cannot be assembled.
    """
    packed = pack(mechanism, whole=True)
    rows = [int(k) for name in drives for k in packed.rows_of(name)]
    if len(rows) != 2 or not set(drives) <= set(mechanism.drives):
        raise ConfigError(f"{drives!r} are not two of the drives {sorted(mechanism.drives)}.")
    W, s = workspace(packed.system, len(packed.signals)), packed.system
    W.signal[s.rows.signal[rows], 0] = np.asarray(angles, dtype=float)
    q = assembled(packed, W, packed.q)
    linearize_constraints(s, W, q, np.zeros(packed.v.size))
    size = np.sqrt(np.diag(W.S))
    held = np.zeros((0, size.size))
    if elastic == "held":
        at = [t + 6 + k for t, r in zip(s.bodies.v_at, s.bodies.r, strict=True) for k in range(r)]
        held = np.eye(size.size)[at]
    G = np.vstack([np.delete(W.G, rows, axis=0) / size, held])
    G /= np.maximum(np.linalg.norm(G, axis=1, keepdims=True), 1e-300)
    N = null_space(G, rcond=1e-9) / size[:, None]
    E = W.G[rows] @ N
    mobility = E @ np.linalg.solve(N.T @ W.S @ N, E.T)
    if (elastic == "held" and N.shape[1] != 2) or np.linalg.cond(mobility) > 1e12:
        raise ModelError(
            f"with elastic coordinates held the joints leave {N.shape[1]} motions to the two "
            f"drives {drives!r}: a singular position, or not a mechanism of two dof."
        )
    return np.linalg.inv(mobility)
