"""Rods in motion: generalised-alpha on positions and rotations, one elimination per iteration.

Each step finds increments D with q_1 = q_0 o exp(D), so that at its end M a + g(q, v) = f; the
acceleration that moves the rod follows a by the filter of the scheme. Masses are lumped, so the
matrix of a step has the band of the stiffness, and its cost grows with the number of segments.

Source:
    Bruels, Cardona, Arnold, Lie group generalized-alpha time integration of constrained flexible
    multibody systems, Mech. Mach. Theory 48 (2012) 121, without the constraints.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.arguments import between, positive
from rom.components.compiled import inner, kernel
from rom.components.cosserat.band import hold, solve
from rom.components.cosserat.statics import add_loads, clamped, largest
from rom.components.cosserat.vibration import lumped_mass
from rom.errors import SolverError
from rom.mbs.elements.rods.energy import (
    HALF_BANDWIDTH,
    Rod,
    energy,
    internal,
    turn,
    work,
)
from rom.mbs.elements.rods.shapes import Shape, reference
from rom.mbs.integrate.generalized_alpha import coefficients
from rom.model import Array, Mask

HELD, HEAVY, LIGHT = 0, 1, 2  # dofs; light ones have no mass and follow the rest
INCREMENT_RTOL = 1e-9  # last increment, in rad and lengths of the rod
MAX_ITERATIONS = 25

Loads = tuple[Array, Array]
Placement = tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike, npt.ArrayLike]


class Scheme(NamedTuple):
    """Step and coefficients of generalised-alpha."""

    h: float
    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float


def scheme(h: float, rho: float) -> Scheme:
    """The scheme that damps the highest frequencies by rho a step."""
    _, beta, gamma, alpha_m, alpha_f = coefficients(h, rho).tolist()
    return Scheme(h, alpha_m, alpha_f, beta, gamma)


class Point(NamedTuple):
    """State at an instant: positions, quaternions, velocities, accelerations, filtered ones.

    Velocities (n,) are ordered like increments: angular ones in section axes, others in the world.
    """

    x: Array
    p: Array
    v: Array
    a: Array
    f: Array


@inner
def add_inertia(rod, v, a, accelerating, rate, W):
    """Add M a and gyroscopic moments to W.r, and their tangent to W.A."""
    for i in range(rod.mass.size):
        for c in range(6 * i + 3, 6 * i + 6):
            W.r[c] += rod.mass[i] * a[c]
            W.A[c, HALF_BANDWIDTH] += rod.mass[i] * accelerating
    for k in range(rod.inertia.shape[0]):
        J, w, at = rod.inertia[k], v[6 * k : 6 * k + 3], 6 * k
        for c in range(3):
            d, e = (c + 1) % 3, (c + 2) % 3
            W.a[c] = J[c] * w[c]
            W.r[at + c] += J[c] * a[at + c] + (J[e] - J[d]) * w[d] * w[e]
            W.A[at + c, HALF_BANDWIDTH] += accelerating * J[c]
            W.A[at + c, d - c + HALF_BANDWIDTH] += rate * (J[e] - J[d]) * w[e]
            W.A[at + c, e - c + HALF_BANDWIDTH] += rate * (J[e] - J[d]) * w[d]


@inner
def add_increment(D, d):
    """Add increments d at the end of a step to its increments D since the start."""
    for k in range(D.size // 3):
        at = 3 * k
        if k % 2 == 1:
            for c in range(3):
                D[at + c] += d[at + c, 0]
            continue
        x, y, z = D[at], D[at + 1], D[at + 2]
        half = 0.5 * math.sqrt(x * x + y * y + z * z)
        share = 1 / 12 if half < 1e-3 else (1 - half / math.tan(half)) / (4 * half * half)
        u, v, w = d[at, 0], d[at + 1, 0], d[at + 2, 0]
        a, b, c = y * w - z * v, z * u - x * w, x * v - y * u
        D[at] += u + 0.5 * a + share * (y * c - z * b)
        D[at + 1] += v + 0.5 * b + share * (z * a - x * c)
        D[at + 2] += w + 0.5 * c + share * (x * b - y * a)


@inner
def place(old, D, free, new):
    """Set positions and rotations of free dofs after the increments of a step."""
    for i in range(old.x.shape[0]):
        for c in range(3):
            if free[6 * i + 3 + c] != HELD:
                new.x[i, c] = old.x[i, c] + D[6 * i + 3 + c]
    for k in range(old.p.shape[0]):
        if free[6 * k] != HELD or free[6 * k + 1] != HELD or free[6 * k + 2] != HELD:
            turn(old.p[k], D[6 * k], D[6 * k + 1], D[6 * k + 2], new.p[k])


@inner
def update(S, old, D, free, new):
    """Set velocities and accelerations that belong to the increments of a step."""
    h = S.h
    for k in range(D.size):
        if free[k] == LIGHT:
            new.f[k], new.v[k], new.a[k] = 0.0, D[k] / h, 0.0
        elif free[k] == HEAVY:
            f, v, a = old.f[k], old.v[k], old.a[k]
            g = (D[k] - h * v) / (h * h * S.beta) - (0.5 / S.beta - 1) * f
            new.f[k] = g
            new.v[k] = v + h * ((1 - S.gamma) * f + S.gamma * g)
            new.a[k] = ((1 - S.alpha_m) * g + S.alpha_m * f - S.alpha_f * a) / (1 - S.alpha_f)


@kernel
def advance(rod, S, old, load, free, new, W):
    """One step; held dofs of ``new`` are set before. Iterations (-1: none found) and products."""
    D = S.h * old.v + 0.5 * S.h * S.h * old.f
    rate = S.gamma / (S.beta * S.h)
    accelerating = (1 - S.alpha_m) / (S.beta * S.h * S.h * (1 - S.alpha_f))
    length, count = rod.h.sum(), 0
    for iteration in range(MAX_ITERATIONS):
        place(old, D, free, new)
        update(S, old, D, free, new)
        internal(rod, new.x, new.p, new.v, rate, W)
        add_loads(new.p, load[0], load[1], W)
        add_inertia(rod, new.v, new.a, accelerating, rate, W)
        for k in range(D.size):
            W.d[k, 0] = -W.r[k]
        hold(W.A, W.d, free)
        products = solve(W.A, W.d)
        count += products
        turned, moved = largest(W.d, length)
        if products == 0 or not turned + moved < 1e3:
            return -1, count
        add_increment(D, W.d)
        if max(turned, moved) < INCREMENT_RTOL:
            place(old, D, free, new)
            update(S, old, D, free, new)
            return iteration + 1, count
    return -1, count


@dataclass(frozen=True)
class Motion:
    """How a rod moved.

    Attributes:
        rod: the rod.
        t: (k,) instants [s].
        x: (k, N + 1, 3) positions [m].
        p: (k, N + 2, 4) quaternions of plate, segments, plate [1].
        v: (k, 6 N + 9) velocities: plate, x_0, segment, x_1, ... [m/s, rad/s]; angular ones in
            section axes.
        root: (k, 6) what holds the start: force in world axes [N], moment in section axes [N m],
            without the inertia of the held vertex itself.
        iterations, products: of all steps together.
    """

    rod: Rod
    t: Array
    x: Array
    p: Array
    v: Array
    root: Array
    iterations: int
    products: int

    def shape(self, k: int) -> Shape:
        """The shape at an instant."""
        return Shape(self.x[k], self.p[k])

    def energies(self) -> Array:
        """(k, 2) kinetic and elastic energy [J]."""
        v = np.concatenate([self.v, np.zeros((len(self.t), 3))], axis=1).reshape(len(self.t), -1, 6)
        kinetic = 0.5 * np.einsum("tkc,kc,tkc->t", v[:, :, :3], self.rod.inertia, v[:, :, :3])
        kinetic += 0.5 * np.einsum("tkc,k,tkc->t", v[:, :-1, 3:], self.rod.mass, v[:, :-1, 3:])
        W = work(self.rod)
        elastic = [sum(energy(self.rod, x, p, W)) for x, p in zip(self.x, self.p, strict=True)]
        return np.column_stack([kinetic, elastic])


def simulate(  # noqa: PLR0913  keywords of one run, all with defaults
    rod: Rod,
    t_end: float,
    dt: float,
    *,
    load: Loads | Callable[[float], Loads] | None = None,
    root: Callable[[float], Placement] | None = None,
    start: Shape | None = None,
    free: npt.ArrayLike | None = None,
    rho_inf: float = 0.9,
    save_every: int = 1,
) -> Motion:
    """Motion of a rod from rest, or from the velocity of its root as a rigid body.

    Args:
        rod: the rod.
        t_end: end of the run [s].
        dt: step [s].
        load: dead forces and moments as of `statics.loads`, or a function of time that gives them.
        root: function of time that gives position (3,), quaternion (4,), velocity (3,) in world
            axes and angular velocity (3,) in section axes of the plate at the start; without it
            that plate stays where it is. The rod starts with the angular velocity of its root.
        start: shape at time zero; without it the one without stress.
        free: (6 N + 9,) which dofs may move [1], rotations in section axes; without it the plate at
            the start is held.
        rho_inf: damping of the highest frequencies in a step, 1 for none [1].
        save_every: steps between instants that are kept.

    Raises:
        ConfigError: for a step or an end that is not positive, or damping outside 0 to 1.
        SolverError: if a step has no solution; its ``solution`` is what came before.
    """
    positive("dt", dt)
    positive("t_end", t_end)
    between("rho_inf", rho_inf, 0, 1)
    moving = clamped(rod) if free is None else np.asarray(free, dtype=np.bool_)
    kinds = np.where(moving, np.where(lumped_mass(rod) > 0, HEAVY, LIGHT), HELD)
    shape, W = reference(rod) if start is None else start, work(rod)
    loads = load if callable(load) else _always(rod, load)
    S = scheme(dt, rho_inf)
    point = _begin(rod, shape, loads(0.0), root, moving)
    kept = [(0.0, point, np.zeros(6))]
    total = np.zeros(2, dtype=int)
    steps = round(t_end / dt)
    for step in range(1, steps + 1):
        new = Point(*(part.copy() for part in point))
        if root is not None:
            _put(new, root(step * dt))
        done = advance(rod, S, point, loads(step * dt), kinds, new, W)
        if done[0] < 0:
            raise SolverError(f"step {step} at {step * dt:g} s did not converge.",
                              hint="Halve dt, or the load leaves the rod no way.",
                              solution=_motion(rod, kept, total))  # fmt: skip
        total += done
        point = new
        if step % save_every == 0 or step == steps:
            kept.append((step * dt, point, np.append(W.r[3:6], W.r[:3])))
    return _motion(rod, kept, total)


def _always(rod: Rod, load: Loads | None) -> Callable[[float], Loads]:
    constant = (np.zeros_like(rod.x), np.zeros((len(rod.p), 3))) if load is None else load
    return lambda _: constant


def _put(point: Point, placement: Placement) -> None:
    x, p, v, w = placement
    point.x[0], point.p[0], point.v[3:6], point.v[:3] = x, p, v, w


def _begin(
    rod: Rod, shape: Shape, load: Loads, root: Callable[[float], Placement] | None, free: Mask
) -> Point:
    """Rest, or the rigid motion of the root, with the accelerations of what has mass."""
    W = work(rod)
    v, a = np.zeros(W.r.size), np.zeros(W.r.size)
    point = Point(shape.x.copy(), shape.p.copy(), v, a, np.zeros(W.r.size))
    if root is not None:
        _put(point, root(0.0))
        spin = rotation.matrix(point.p[0]) @ v[:3]
        for k, p in enumerate(point.p):
            v[6 * k : 6 * k + 3] = rotation.matrix(p).T @ spin
        for i, x in enumerate(point.x):
            v[6 * i + 3 : 6 * i + 6] = v[3:6] + np.cross(spin, x - point.x[0])
    internal(rod, point.x, point.p, v, 0.0, W)
    add_loads(point.p, load[0], load[1], W)
    mass = lumped_mass(rod)
    w = np.append(v, np.zeros(3)).reshape(-1, 6)[:, :3]
    gyro = np.zeros((len(w), 6))
    gyro[:, :3] = np.cross(w, rod.inertia * w)
    force = -W.r - gyro.ravel()[:-3]
    moves = free & (mass > 0)
    a[moves] = force[moves] / mass[moves]
    point.f[:] = a
    return point


def _motion(rod: Rod, kept: list[Any], total: Any) -> Motion:
    t, points, root = zip(*kept, strict=True)
    x, p, v = (np.array([getattr(point, part) for point in points]) for part in ("x", "p", "v"))
    return Motion(rod, np.array(t), x, p, v, np.array(root), int(total[0]), int(total[1]))
