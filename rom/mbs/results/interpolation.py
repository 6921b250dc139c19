"""Motion between the instants of a run: cubic polynomials of Hermite.

Positions and elastic coordinates follow from values and velocities at both ends, rotations
likewise in rotation vectors from the left end, velocities from velocities and accelerations.
Between exact ends the error is of fourth order.
"""

from typing import NamedTuple

import numpy as np

from rom import rotation
from rom.mbs.kernels.system import System
from rom.model import Array


class Point(NamedTuple):
    """One end of an interval: time, coordinates, velocities, accelerations."""

    t: float
    q: Array
    v: Array
    a: Array


def cubic(s: float, h: float, left: tuple[Array, Array], right: tuple[Array, Array]) -> Array:
    """Value at the share s of an interval of length h, from (value, rate) at both ends.

    Written as the left value and what is added, so that a constant stays itself to the bit.
    """
    (x0, r0), (x1, r1) = left, right
    rise = s * s * (3 - 2 * s)
    return x0 + rise * (x1 - x0) + h * s * (1 - s) * ((1 - s) * r0 - s * r1)


def slope(s: float, h: float, left: tuple[Array, Array], right: tuple[Array, Array]) -> Array:
    """Derivative of `cubic` in time."""
    (x0, r0), (x1, r1) = left, right
    ends = (1 - s) * (1 - 3 * s) * r0 + s * (3 * s - 2) * r1
    return 6 * s * (1 - s) / h * (x1 - x0) + ends


def between(system: System, left: Point, right: Point, t: float) -> tuple[Array, Array, Array]:
    """Coordinates, velocities and accelerations at a time between two instants."""
    bodies = system.bodies
    h = right.t - left.t
    s = (t - left.t) / h
    q = left.q.copy()
    for at, vt, r in zip(bodies.q_at, bodies.v_at, bodies.r, strict=True):
        for x, y, n in ((at, vt, 3), (at + 7, vt + 6, r)):
            here, there = slice(x, x + n), slice(y, y + n)
            q[here] = cubic(s, h, (left.q[here], left.v[there]), (right.q[here], right.v[there]))
        turn, w = slice(at + 3, at + 7), slice(vt + 3, vt + 6)
        q[turn] = _turned(s, h, (left.q[turn], left.v[w]), (right.q[turn], right.v[w]))
    ends = (left.v, left.a), (right.v, right.a)
    return q, cubic(s, h, *ends), slope(s, h, *ends)


def _turned(s: float, h: float, left: tuple[Array, Array], right: tuple[Array, Array]) -> Array:
    (p0, w0), (p1, w1) = left, right
    psi = rotation.log(rotation.multiply(p0 * np.array([1, -1, -1, -1]), p1))
    ends = (np.zeros(3), w0), (psi, vector_rate(psi, w1))
    return rotation.multiply(p0, rotation.exp(cubic(s, h, *ends)))


def vector_rate(psi: Array, omega: Array) -> Array:
    """Rate of the rotation vector psi that belongs to the angular velocity in the body frame.

    The inverse of the body tangent of the exponential map, in closed form; its series where the
    form has no digits left.
    """
    half = 0.5 * np.linalg.norm(psi)
    share = 1 / 12 if half < 1e-3 else (1 - half / np.tan(half)) / (4 * half * half)
    turn = np.cross(psi, omega)
    return omega + 0.5 * turn + share * np.cross(psi, turn)
