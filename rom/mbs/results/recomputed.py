"""Quantities and loads along a motion, evaluated again from coordinates and velocities."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rom.arguments import AnySolution
from rom.mbs.elements.family import apply_laws
from rom.mbs.equations.equations import element_energy, evaluate, residual
from rom.mbs.kernels.algebra import add, cross, dual, mtv, mv, put, scale, vec
from rom.mbs.kernels.compiled import copy, inner, kernel
from rom.mbs.kernels.inertia import body_energy
from rom.mbs.kernels.work import Work, workspace
from rom.mbs.parts.bodies import GROUND
from rom.mbs.parts.joints import Row
from rom.model import Array, Index
from rom.rotation import matrix


class Seen(NamedTuple):
    """Place (n_t, 3), axes (n_t, 3, 3), velocities (n_t, 6) of a marker; no n_t at one time."""

    position: Array
    axes: Array
    twist: Array


class Tracks(NamedTuple):
    """One row per instant."""

    position: Array  # of one marker, as axes and twist, see `Seen`
    axes: Array
    twist: Array
    reaction: Array  # (n_t, 6) force and moment of some constraint rows on their second marker
    energy: Array  # (n_t, 3) kinetic, strain, potential [J]
    momentum: Array  # (n_t, 6) linear, and angular about the world origin
    gap: Array  # (n_t, m) constraint residuals


def follow(solution: AnySolution, marker: int, rows: Index) -> Tracks:
    """Evaluate one marker, some constraint rows and the totals along a solution."""
    packed, system, n = solution.packed, solution.packed.seen, solution.t.size
    shapes = ((n, 3), (n, 3, 3), (n, 6), (n, 6), (n, 3), (n, 6), solution.lam.shape)
    tracks = Tracks(*(np.zeros(shape) for shape in shapes))
    W = workspace(system, len(packed.signals))
    motion = (solution.q, solution.v, solution.lam, solution.base, solution.signals)
    track(system, W, motion, marker, rows, tracks)
    return tracks


@kernel
def track(s, W, motion, marker, rows, out):
    """Fill the tracks."""
    Q, V, L, base, signals = motion
    for k in range(Q.shape[0]):
        evaluate_at(s, W, Q[k], V[k], base[k], signals[k])
        copy(W.P[marker], out.position[k])
        copy(W.E[marker], out.axes[k])
        copy(W.V[marker], out.twist[k])
        copy(W.value, out.gap[k])
        for row in rows:
            for p in range(6):
                out.reaction[k, p] -= L[k, row] * W.g[row, 6 + p]
        out.energy[k, 1] = element_energy(s, W, Q[k], V[k])
        for b in range(s.bodies.mass.size):
            kinetic, strain, height = body_energy(s.bodies, W, b, Q[k], V[k])
            out.energy[k, 0] += kinetic
            out.energy[k, 1] += strain
            out.energy[k, 2] += height
            body_momentum(s.bodies, W, b, Q[k], V[k], out.momentum[k])


@kernel
def evaluate_at(s, W, q, v, base, signals):
    """Evaluate places and velocities at an instant whose signals and bases are known."""
    copy(signals, W.signal)
    copy(base, W.base)
    evaluate(s, W, q, v)


@inner
def body_momentum(bodies, W, b, q, v, out):
    """Add linear momentum, and angular momentum about the world origin, of body b."""
    t, r, A = bodies.v_at[b], bodies.r[b], W.A[b]
    w, d, u = vec(v, t + 3), vec(W.d[b], 0), mtv(A, vec(v, t))
    linear = add(scale(bodies.mass[b], u), add(cross(w, d), vec(W.dd[b], 0)))
    angular = add(cross(d, u), mv(W.J[b], w))
    for k in range(r):
        angular = add(angular, scale(W.yd[b, k], dual(W.SP[b, k], 0)))
    p = mv(A, linear)
    put(out, 0, p)
    put(out, 3, add(mv(A, angular), cross(vec(q, bodies.q_at[b]), p)))


def at_instants(solution: AnySolution) -> Iterator[Work]:
    """The memory after the equations of motion were evaluated at each instant, one by one."""
    packed, system = solution.packed, solution.packed.seen
    W, forces = workspace(system, len(packed.signals)), packed.asked
    rows = zip(
        *(solution.t, solution.q, solution.v, solution.a, solution.lam),
        *(solution.signals, packed.places.before(solution.base)),
        strict=True,
    )
    for t, q, v, a, lam, signals, base in rows:
        evaluate_at(system, W, q, v, base, signals)
        apply_laws(forces, W, float(t))
        residual(system, W, q, v, a, lam)
        yield W


def residuals_along(solution: AnySolution) -> Array:
    """(n_t, n) what is left of the equations of motion at each instant."""
    packed, found = solution.packed, np.zeros_like(solution.v)
    if packed.asked:
        return np.array([W.residual.copy() for W in at_instants(solution)])
    motion = solution.q, solution.v, solution.a, solution.lam
    W, base = workspace(packed.seen, len(packed.signals)), packed.places.before(solution.base)
    track_residuals(packed.seen, W, motion, base, solution.signals, found)
    return found


@kernel
def track_residuals(s, W, motion, base, signals, out):
    """Fill the residuals."""
    Q, V, A, L = motion
    for k in range(Q.shape[0]):
        evaluate_at(s, W, Q[k], V[k], base[k], signals[k])
        residual(s, W, Q[k], V[k], A[k], L[k])
        copy(W.residual, out[k])


def stress_in_motion(
    recovery: Any, q: Array, A: Array, omega: Array, a: Array, gravity: Array
) -> Array:
    """(p, 6) stress [Pa] of a body with axes A (3, 3), and a (6 + r,) as of `rom.mbs.State`."""
    if recovery.inertial is None:
        return recovery.field(q)
    pull = A.T @ (a[:3] - gravity)
    return recovery.field(q, recovery.accelerations(pull, a[3:6], omega, a[6:]))


def axes_of(solution: AnySolution, body: str) -> Array:
    """(n_t, 3, 3) axes of a body, or of the ground, in the world."""
    if body == GROUND:
        return np.broadcast_to(np.eye(3), (solution.t.size, 3, 3))
    return np.moveaxis(matrix(solution.orientation(body).T), -1, 0)


@dataclass(frozen=True)
class JointMotion:
    """The coordinates of one joint over time, zero as it was described; None what it has not."""

    t: Array  # (n_t,) times [s]
    # (n_t,) by which the second body has turned against the first about the axis, whole turns
    # counted from the first instant [rad]
    angle: Array | None
    angle_rate: Array | None  # (n_t,) its rate [rad/s]
    displacement: Array | None  # (n_t,) of the second body along the axis [m]
    displacement_rate: Array | None  # (n_t,) its rate [m/s]


def angles(row: Row, t: Array, one: Seen, two: Seen) -> tuple[Array, Array]:
    """(n_t,) angle of b seen in the axes a and c, and its rate.

    Between two instants the angle changes by what the trapezoidal rule makes of the rates, to less
    than half a turn; that is how turns are counted.
    """
    a, c, b = one.axes @ row.a, one.axes @ row.c, two.axes @ row.b
    x, y = (a * b).sum(1), (c * b).sum(1)
    axis = np.cross(b, x[:, None] * c - y[:, None] * a) / (x * x + y * y)[:, None]
    rate = (axis * (two.twist[:, 3:] - one.twist[:, 3:])).sum(1)
    angle = np.arctan2(y, x) - row.offset
    order = np.argsort(t, kind="stable")
    expected = 0.5 * np.diff(t[order]) * (rate[order][1:] + rate[order][:-1])
    turns = np.cumsum(np.round((expected - np.diff(angle[order])) / (2 * np.pi)))
    angle[order[1:]] += 2 * np.pi * turns
    return angle, rate


def displacements(row: Row, one: Seen, two: Seen) -> tuple[Array, Array]:
    """(n_t,) distance along the axis a, which the first body carries, and its rate."""
    a, gap = one.axes @ row.a, two.position - one.position
    slide, turn = two.twist[:, :3] - one.twist[:, :3], np.cross(one.twist[:, 3:], a)
    return (a * gap).sum(1) - row.offset, (a * slide + turn * gap).sum(1)
