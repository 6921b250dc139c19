"""Balls and wheels that roll on a plane: the lowest point, its height, and its sliding."""

import math

import numpy as np
from numba import types

from rom.mbs.kernels.algebra import add, cross, dot, row, scale, sub, turn, unit_twist
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.stages import stage
from rom.mbs.kernels.system import ROLL, TOUCH, System
from rom.mbs.kernels.work import Work


def _has_rolling(system):
    return np.isin(system.rows.kind, (TOUCH, ROLL)).any()


@inner
def lowest(n, s, radius):
    """From the centre to the point nearest to the plane of normal n.

    For a ball (s = 0), or for a wheel that spins about s: in the plane of the wheel, downwards.
    """
    c = dot(n, s)
    if 1.0 - c * c <= 0.0:
        return scale(0.0, n)
    return scale(radius / math.sqrt(1.0 - c * c), sub(scale(c, s), n))


@inner
def lowest_rate(n, s, dn, ds, radius):
    """Rate of `lowest` while n and s change with the rates dn and ds."""
    c = dot(n, s)
    if 1.0 - c * c <= 0.0:
        return scale(0.0, n)
    dc, w = dot(dn, s) + dot(n, ds), 1.0 / math.sqrt(1.0 - c * c)
    change = sub(add(scale(dc, s), scale(c, ds)), dn)
    return add(scale(radius * w, change), scale(radius * c * dc * w * w * w, sub(scale(c, s), n)))


@inner
def rolling_vectors(rows, k, W):
    """Direction, normal, wheel axis, gap of the markers and vector to the lowest point of row k."""
    i, j = rows.i[k], rows.j[k]
    a, n = turn(W.E, i, row(rows.a, k, 0)), turn(W.E, i, row(rows.c, k, 0))
    s = turn(W.E, j, row(rows.b, k, 0))
    return a, n, s, sub(row(W.P, j, 0), row(W.P, i, 0)), lowest(n, s, rows.factor[k, 0])


@inner
def gradient_rate(vectors, radius, slide, Oi, Oj):
    """Rate of the gradient of a row while the markers move: of its four vectors."""
    a, n, s, gap, down = vectors
    da, sink = cross(Oi, a), lowest_rate(n, s, cross(Oi, n), cross(Oj, s), radius)
    arm = add(gap, down)
    turning = add(cross(add(slide, sink), a), cross(arm, da))
    return scale(-1.0, da), scale(-1.0, turning), da, add(cross(sink, a), cross(down, da))


@stage(types.void, System, Work, types.int64, needed=_has_rolling)
def rolling_row(s, W, k):
    """Residual, gradient and convective term of a row of kind TOUCH or ROLL.

    Both have the gradient of the velocity of the touching material point along the direction a:
    for the height this is so because the lowest point is lowest.
    """
    rows = s.rows
    i, j = rows.i[k], rows.j[k]
    vectors = rolling_vectors(rows, k, W)
    a, _, _, gap, down = vectors
    arm = add(gap, down)
    four = (scale(-1.0, a), scale(-1.0, cross(arm, a)), a, cross(down, a))
    slide = sub(row(W.V, j, 0), row(W.V, i, 0))
    rates = gradient_rate(vectors, rows.factor[k, 0], slide, row(W.V, i, 3), row(W.V, j, 3))
    W.gamma[k], sliding = 0.0, 0.0
    for side in range(4):
        m, at = (i if side < 2 else j), 3 * (side % 2)
        W.gamma[k] += dot(four[side], row(W.conv, m, at)) + dot(rates[side], row(W.V, m, at))
        sliding += dot(four[side], row(W.V, m, at))
        for p in range(3):
            W.g[k, 3 * side + p] = four[side][p]
    W.value[k] = sliding if rows.kind[k] == ROLL else dot(a, arm)


@stage(types.void, System, Work, types.int64, types.float64, needed=_has_rolling)
def rolling_stiffness(s, W, k, c):
    """Add c times the derivative of the gradient of row k to W.Q."""
    rows = s.rows
    vectors = rolling_vectors(rows, k, W)
    for p in range(12):
        vi, Oi, vj, Oj = unit_twist(p)
        rates = gradient_rate(vectors, rows.factor[k, 0], sub(vj, vi), Oi, Oj)
        for side in range(4):
            for q in range(3):
                W.Q[3 * side + q, p] += c * rates[side][q]
