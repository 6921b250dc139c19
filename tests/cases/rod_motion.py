"""A second program for rods in motion: generalised-alpha along the band of one rod.

Unknowns, elimination and code are others than those of a mechanism; the scheme is the same.

Source:
    Bruels, Cardona, Arnold, Lie group generalized-alpha time integration of constrained flexible
    multibody systems, Mech. Mach. Theory 48 (2012) 121, without the constraints.
"""

import math
from typing import NamedTuple

import numpy as np

from rom.components.compiled import inner, kernel
from rom.components.cosserat.band import hold, solve
from rom.components.cosserat.statics import add_loads, clamped, largest
from rom.components.cosserat.vibration import lumped_mass
from rom.mbs.elements.rods.energy import HALF_BANDWIDTH, internal, turn, work
from rom.mbs.elements.rods.shapes import Shape
from rom.mbs.integrate.generalized_alpha import coefficients

MAX_ITERATIONS, INCREMENT_RTOL = 25, 1e-11


class Point(NamedTuple):
    """Positions, quaternions; velocities (n,), accelerations and filtered ones, as increments."""

    x: np.ndarray
    p: np.ndarray
    v: np.ndarray
    a: np.ndarray
    f: np.ndarray


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
def place(method, old, D, free, new):
    """Set the end of a step after its increments."""
    h, beta, gamma, alpha_m, alpha_f = method
    for i in range(old.x.shape[0]):
        for c in range(3):
            new.x[i, c] = old.x[i, c] + D[6 * i + 3 + c]
    for k in range(old.p.shape[0]):
        turn(old.p[k], D[6 * k], D[6 * k + 1], D[6 * k + 2], new.p[k])
    for k in range(D.size):
        if free[k]:
            f, v, a = old.f[k], old.v[k], old.a[k]
            new.f[k] = g = (D[k] - h * v) / (h * h * beta) - (0.5 / beta - 1) * f
            new.v[k] = v + h * ((1 - gamma) * f + gamma * g)
            new.a[k] = ((1 - alpha_m) * g + alpha_m * f - alpha_f * a) / (1 - alpha_f)


@kernel
def advance(rod, method, old, load, free, new, W):
    """One step; False if it has no solution."""
    h, beta, gamma, alpha_m, alpha_f = method
    D = h * old.v + 0.5 * h * h * old.f
    accelerating = (1 - alpha_m) / (beta * h * h * (1 - alpha_f))
    for _ in range(MAX_ITERATIONS):
        place(method, old, D, free, new)
        internal(rod, new.x, new.p, new.v, gamma / (beta * h), W)
        add_loads(new.p, load[0], load[1], W)
        add_inertia(rod, new.v, new.a, accelerating, gamma / (beta * h), W)
        for k in range(D.size):
            W.d[k, 0] = -W.r[k]
        hold(W.A, W.d, free)
        if solve(W.A, W.d) == 0:
            return False
        add_increment(D, W.d)
        if max(largest(W.d, rod.h.sum())) < INCREMENT_RTOL:
            place(method, old, D, free, new)
            return True
    return False


def swing(rod, steps, dt, load, *, free=None, rho_inf=0.9):
    """Shapes, with the velocities, of a rod with mass that a load sets in motion from rest."""
    free, W = clamped(rod) if free is None else free, work(rod)
    method = tuple(coefficients(dt, rho_inf).tolist())
    point = Point(rod.x.copy(), rod.p.copy(), *np.zeros((3, W.r.size)))
    add_loads(point.p, *load, W)
    moves = free & (lumped_mass(rod) > 0)
    point.a[moves] = point.f[moves] = -W.r[moves] / lumped_mass(rod)[moves]
    run = [(Shape(point.x, point.p), point.v)]
    for _ in range(steps):
        new = Point(*(part.copy() for part in point))
        assert advance(rod, method, point, load, free, new, W)
        point = new
        run.append((Shape(point.x, point.p), point.v))
    return run
