"""Kinetic energy of chains of planar links, and of two chains that meet in a tip."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.errors import ModelError
from rom.model import Array

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
        K: (r, r) stiffness [N/m].
    """

    length: float
    M: Array
    tip: Array
    K: Array

    @property
    def r(self) -> int:
        """Number of elastic coordinates."""
        return self.tip.shape[1]


@dataclass
class Motion:
    """Kinetic energy of a chain and velocity of its last pin, per unit of all n rates.

    Attributes:
        A: (N, n, n) inertia of the links added so far.
        pin: (N, 2, n) velocity of the last pin.
    """

    A: Array
    pin: Array

    @classmethod
    def at_rest(cls, N: int, n: int) -> "Motion":
        """No link yet, its pin on the ground."""
        return cls(np.zeros((N, n, n)), np.zeros((N, 2, n)))

    def add(self, link: Link, angle: Array, spin: Array, at: int) -> None:
        """Add a link at an angle (N,) that turns with ``spin`` (N or 1, n)."""
        N, _, n = self.pin.shape
        e = directions(angle)
        R = np.stack([e, left_of(e)], axis=1)  # rows along and across
        J = np.zeros((N, 3 + link.r, n))
        J[:, :2], J[:, 2] = R @ self.pin, spin
        J[:, 3:, at : at + link.r] = np.eye(link.r)
        self.A += gram(J, link.M @ J)
        swing = link.length * left_of(e)[:, :, None] * spin[:, None]
        self.pin = self.pin + swing + elastic_tip(link, angle, n, at)


def elastic_tip(link: Link, angle: Array, n: int, at: int) -> Array:
    """(N, 2, n) velocity of the second pin relative to the frame of the link."""
    e, out = directions(angle), np.zeros((angle.size, 2, n))
    out[:, :, at : at + link.r] = np.stack([e, left_of(e)], axis=2) @ link.tip
    return out


def meeting(
    left: Array, right: Array, couplers: tuple[Link, Link], side: int, q: tuple[Array, Array]
) -> Array:
    """(..., 2) tip of two couplers that hang on elbows (..., 2) and (..., 2) [m].

    Args:
        left: elbow of the left side [m].
        right: that of the right side [m].
        couplers: links to the tip.
        side: 1 for the tip to the left of the line from the left to the right elbow, -1 for right.
        q: two coordinates (...) of the drives, for the message [rad or m].

    Raises:
        ModelError: if the couplers cannot reach each other.
    """
    gap, square, along, height = _triangle(left, right, couplers)
    if not (height > 0).all():
        k = np.unravel_index(np.argmin(np.where(np.isnan(height), -np.inf, height)), height.shape)
        a, b = (coupler.length for coupler in couplers)
        raise ModelError(
            f"at q = ({q[0][k]:.4g}, {q[1][k]:.4g}) the elbows are {np.sqrt(square[k]):.4g} m "
            f"apart; couplers of {a:.4g} m and {b:.4g} m do not meet or lie in one line.",
            hint="Lengthen the couplers or shorten the cranks.",
        )
    return left + along[..., None] * gap + side * np.sqrt(height)[..., None] * left_of(gap)


def reach(left: Array, right: Array, couplers: tuple[Link, Link]) -> npt.NDArray[np.bool_]:
    """(...) whether couplers on elbows (..., 2) [m] meet, and not in one line."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(_triangle(left, right, couplers)[3] > MIN_HEIGHT**2)


def _triangle(
    left: Array, right: Array, couplers: tuple[Link, Link]
) -> tuple[Array, Array, Array, Array]:
    """Way between the elbows, its square, and the tip along it and, squared, across it."""
    a, b = (coupler.length for coupler in couplers)
    gap = right - left
    square = (gap**2).sum(axis=-1)
    along = 0.5 * (square + a * a - b * b) / square
    return gap, square, along, a * a / square - along**2


def closed(sides: list[Motion], couplers: tuple[Link, Link], P: Array, at: Any) -> None:
    """Add the couplers from elbows P[:, 0] and P[:, 2] to a tip P[:, 1] (N, 3, 2) [m].

    Both bring the same velocity to the tip: two equations for their two spins.
    """
    arms, n = (P[:, 1] - P[:, 0], P[:, 1] - P[:, 2]), sides[0].A.shape[-1]
    angles = [np.arctan2(arm[:, 1], arm[:, 0]) for arm in arms]
    slip = [sides[k].pin + elastic_tip(couplers[k], angles[k], n, at[k]) for k in range(2)]
    closing = np.stack([left_of(arms[0]), -left_of(arms[1])], axis=-1)
    spins = np.linalg.solve(closing, slip[1] - slip[0])
    for k in range(2):
        sides[k].add(couplers[k], angles[k], spins[:, k], at[k])


def directions(angle: Array) -> Array:
    """(..., 2) unit vectors at angles (...) [rad]."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def left_of(x: Array) -> Array:
    """Vectors (..., 2) turned by a quarter to the left."""
    return np.stack([-x[..., 1], x[..., 0]], axis=-1)


def unit_rows(n: int, *ones: int) -> Array:
    """(1, n) zeros, and ones where said."""
    row = np.zeros((1, n))
    row[0, list(ones)] = 1.0
    return row


def gram(X: Array, Y: Array) -> Array:
    """X^T Y of stacks of matrices."""
    return np.swapaxes(X, -1, -2) @ Y


def in_chunks(of_all_rates: Callable[[Array, Array], Array], q1: Any, q2: Any) -> Array:
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
