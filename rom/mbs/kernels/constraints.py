"""Constraint rows: residual, gradient, convective term and stiffness; those of what rolls, too."""

import math

import numpy as np
from numba import types

from rom.mbs.kernels.algebra import add, cross, dot, place, row, scale, sub, turn, unit, unit_twist
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.stages import stage
from rom.mbs.kernels.system import (
    ALONG,
    ANGLE,
    COUPLING,
    DISTANCE,
    NORMAL,
    POINT,
    ROLL,
    TOUCH,
    System,
)
from rom.mbs.kernels.work import Work


@inner
def wrapped(angle):
    """The angle moved by whole turns into [-pi, pi]."""
    return angle - 2 * math.pi * math.floor(angle / (2 * math.pi) + 0.5)


@inner
def set_gradient(g, k, Pi, Oi, Pj, Oj):
    """Gradient of row k in the twists of both markers, from its four vectors."""
    for p in range(3):
        g[k, p], g[k, 3 + p], g[k, 6 + p], g[k, 9 + p] = Pi[p], Oi[p], Pj[p], Oj[p]


@inner
def normal_rates(a, b, Oi, Oj, ci, cj):
    """First and second time derivative of a . b, for axes a of i and b of j.

    O are angular velocities, c angular accelerations at zero accelerations of the coordinates.
    """
    da, db, axb = cross(Oi, a), cross(Oj, b), cross(a, b)
    first = dot(axb, sub(Oi, Oj))
    second = dot(axb, sub(ci, cj)) + 2 * dot(da, db)
    return first, second + dot(cross(Oi, da), b) + dot(a, cross(Oj, db))


@inner
def along_rates(a, gap, slide, pull, Oi, ci):
    """Rate of a . gap for an axis a of i, and the convective term of its second derivative."""
    da = cross(Oi, a)
    swing = add(cross(ci, a), cross(Oi, da))
    return dot(a, slide) + dot(da, gap), dot(a, pull) + 2 * dot(da, slide) + dot(swing, gap)


@inner
def angle_state(a, c, b, Oi, Oj, ci, cj):
    """Angle of b seen in the axes (a, c), its rate, convective term and the torque axis.

    The torque axis is the gradient of the angle in the rotation of marker j.
    """
    x, y = dot(a, b), dot(c, b)
    n = x * x + y * y
    w = sub(scale(x, c), scale(y, a))
    axis = scale(1 / n, cross(b, w))
    dx, ddx = normal_rates(a, b, Oi, Oj, ci, cj)
    dy, ddy = normal_rates(c, b, Oi, Oj, ci, cj)
    rate = (x * dy - y * dx) / n
    second = (x * ddy - y * ddx - 2 * rate * (x * dx + y * dy)) / n
    return math.atan2(y, x), rate, second, axis


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


@inner
def row_states(s, W):
    """Residual, gradient and convective term of all constraint rows."""
    rows, zero = s.rows, (0.0, 0.0, 0.0)
    for k in range(rows.kind.size):
        i, j, kind = rows.i[k], rows.j[k], rows.kind[k]
        if kind == COUPLING:
            coupling_row(s, W, k)
            continue
        if kind in (TOUCH, ROLL):
            rolling_row(s, W, k)
            continue
        Oi, Oj, qi, qj = row(W.V, i, 3), row(W.V, j, 3), row(W.conv, i, 3), row(W.conv, j, 3)
        gap = sub(row(W.P, j, 0), row(W.P, i, 0))
        pull = sub(row(W.conv, j, 0), row(W.conv, i, 0))
        target = rows.offset[k]
        if rows.signal[k] >= 0:
            target += W.signal[rows.signal[k], 0]
        a = row(rows.a, k, 0)
        if kind == POINT:
            W.value[k], W.gamma[k] = dot(a, gap) - target, dot(a, pull)
            set_gradient(W.g, k, scale(-1.0, a), zero, a, zero)
            continue
        if kind == DISTANCE:
            slide = sub(row(W.V, j, 0), row(W.V, i, 0))
            W.value[k], e, W.gamma[k] = distance_state(gap, slide, pull)
            W.value[k] -= target
            set_gradient(W.g, k, scale(-1.0, e), zero, e, zero)
            continue
        a = turn(W.E, i, a)
        if kind == ALONG:
            slide = sub(row(W.V, j, 0), row(W.V, i, 0))
            W.value[k] = dot(a, gap) - target
            W.gamma[k] = along_rates(a, gap, slide, pull, Oi, qi)[1]
            set_gradient(W.g, k, scale(-1.0, a), cross(a, gap), a, zero)
            continue
        b = turn(W.E, j, row(rows.b, k, 0))
        if kind == NORMAL:
            axb = cross(a, b)
            W.value[k] = dot(a, b) - target
            W.gamma[k] = normal_rates(a, b, Oi, Oj, qi, qj)[1]
            set_gradient(W.g, k, zero, axb, zero, scale(-1.0, axb))
        else:
            c = turn(W.E, i, row(rows.c, k, 0))
            angle, _, gamma, axis = angle_state(a, c, b, Oi, Oj, qi, qj)
            W.value[k], W.gamma[k] = wrapped(angle - target), gamma
            set_gradient(W.g, k, zero, scale(-1.0, axis), zero, axis)


@inner
def distance_state(gap, slide, pull):
    """Length of the gap, its direction and the convective term of its second derivative."""
    length = math.sqrt(dot(gap, gap))
    e = scale(1.0 / length, gap)
    rate = dot(e, slide)
    return length, e, dot(e, pull) + (dot(slide, slide) - rate * rate) / length


def has_couplings(system):
    """Whether a system has rows of that kind."""
    return (system.rows.kind == COUPLING).any()


@stage(types.void, System, Work, types.int64, needed=has_couplings)
def coupling_row(s, W, k):
    """Row k as the weighted sum of two joint coordinates, which are evaluated first."""
    rows = s.rows
    W.value[k], W.gamma[k] = -rows.offset[k], 0.0
    for side in range(2):
        at, factor = rows.at[k, side], rows.factor[k, side]
        W.value[k] += factor * W.x[at]
        W.gamma[k] += factor * W.xc[at]
        for p in range(12):
            W.g[k, 12 * side + p] = factor * W.xg[at, p]


@inner
def column_of(graph, k, b):
    """First column in G of body b in constraint row k, which moves it."""
    for p in range(3):
        if graph.body[k, p] == b:
            return graph.at[k, p]
    return graph.at[k, 3]


@inner
def block_of(graph, b, c):
    """Number of the block of bodies b and c; IndexError if the graph does not know it."""
    low, high = graph.first[b], graph.first[b + 1]
    while low < high:
        middle = (low + high) // 2
        if graph.other[middle] < c:
            low = middle + 1
        else:
            high = middle
    if low == graph.first[b + 1] or graph.other[low] != c:
        raise IndexError("a force couples two bodies that share no joint and no pair of markers")
    return low


@stage(types.void, System, Work)
def constraint_gradient(s, W):
    """Assemble G (m, n), the gradient of all rows in the velocities."""
    bodies, markers, rows, G, graph = s.bodies, s.markers, s.rows, W.G, s.graph
    for k in range(rows.kind.size):
        for t in range(G.shape[1]):
            G[k, t] = 0.0
        for side, m in enumerate((rows.i[k], rows.j[k], rows.k[k], rows.l[k])):
            b = markers.body[m] if m >= 0 else -1
            if b < 0:
                continue
            t, H = column_of(graph, k, b), W.H[m]
            for p in range(6):
                w = W.g[k, 6 * side + p]
                if w != 0.0:
                    for q in range(6 + bodies.r[b]):
                        G[k, t + q] += w * H[p, q]


@inner
def constraint_wrench(s, W, lam):
    """Add the constraint forces -lam g to the wrenches on the markers."""
    rows = s.rows
    for k in range(rows.kind.size):
        for p in range(6):
            W.wrench[rows.i[k], p] -= lam[k] * W.g[k, p]
            W.wrench[rows.j[k], p] -= lam[k] * W.g[k, 6 + p]
        if rows.k[k] >= 0:
            for p in range(6):
                W.wrench[rows.k[k], p] -= lam[k] * W.g[k, 12 + p]
                W.wrench[rows.l[k], p] -= lam[k] * W.g[k, 18 + p]


@inner
def add_cross_product(Q, i, j, c, a, b):
    """Add c skew(a) skew(b) to Q from (i, j)."""
    for k in range(3):
        place(Q, i, j + k, c, cross(a, cross(b, unit(k))))


@inner
def place_relative(Q, at, p, c, x):
    """Add the block column c x of a quantity that acts on j - i, with opposite signs on both."""
    place(Q, at, at + p, c, x)
    place(Q, at, 6 + at + p, -c, x)
    place(Q, 6 + at, at + p, -c, x)
    place(Q, 6 + at, 6 + at + p, c, x)


@inner
def row_stiffness(kind, a, b, gap, axis, c, Q):
    """Add c times the derivative of the gradient of one constraint row to Q (12, 12).

    The order is position and small rotation, in the world, of marker i, then of marker j. The
    term of an angle holds where the two axes that its joint keeps parallel are parallel.
    """
    if kind == ALONG:
        for p in range(3):
            x = cross(a, unit(p))
            place(Q, 0, 3 + p, c, x)
            place(Q, 6, 3 + p, -c, x)
            place(Q, 3, p, -c, x)
            place(Q, 3, 6 + p, c, x)
        add_cross_product(Q, 3, 3, c, gap, a)
    elif kind == NORMAL:
        add_cross_product(Q, 3, 3, c, b, a)
        add_cross_product(Q, 3, 9, -c, a, b)
        add_cross_product(Q, 9, 3, -c, b, a)
        add_cross_product(Q, 9, 9, c, a, b)
    elif kind == DISTANCE:
        length = math.sqrt(dot(gap, gap))
        e = scale(1.0 / length, gap)
        for p in range(3):
            place_relative(Q, 0, p, c / length, sub(unit(p), scale(e[p], e)))
    elif kind == ANGLE:
        for p in range(3):
            x = cross(axis, unit(p))
            place(Q, 3, 3 + p, c, x)
            place(Q, 9, 3 + p, -c, x)


@inner
def push_pair(W, i, j, force, at_i, at_j):
    """Push marker j and marker i back: wrenches of a force with its moments about both."""
    for p in range(3):
        W.wrench[j, p] += force[p]
        W.wrench[j, 3 + p] += at_j[p]
        W.wrench[i, p] -= force[p]
        W.wrench[i, 3 + p] -= at_i[p]


@inner
def pair_stiffness(s, W, i, j, S):
    """Add H^T Q H of a pair of markers to S."""
    bodies, markers, Q, QH = s.bodies, s.markers, W.Q, W.QH
    width = W.H.shape[2]
    for side in range(2):
        m = i if side == 0 else j
        b = markers.body[m]
        n = 6 + bodies.r[b] if b >= 0 else 0
        for p in range(12):
            for q in range(n):
                total = 0.0
                for x in range(6):
                    total += Q[p, 6 * side + x] * W.H[m, x, q]
                QH[p, width * side + q] = total
    spread_pair(s, W, i, j, S)


@inner
def spread_pair(s, W, i, j, S):
    """Add H^T QH of a pair of markers to S, whose columns are coordinates already."""
    bodies, markers, QH = s.bodies, s.markers, W.QH
    width = W.H.shape[2]
    for block in range(4):
        row, column = block // 2, block % 2
        mr, mc = (i if row == 0 else j), (i if column == 0 else j)
        br, bc = markers.body[mr], markers.body[mc]
        if br < 0 or bc < 0:
            continue
        e = block_of(s.graph, br, bc)
        first, left = s.graph.x[e], s.graph.y[e]
        for p in range(6 + bodies.r[br]):
            for q in range(6 + bodies.r[bc]):
                total = 0.0
                for x in range(6):
                    total += W.H[mr, x, p] * QH[6 * row + x, width * column + q]
                S[first + p, left + q] += total


@inner
def constraint_stiffness(s, W, lam, c, S):
    """Add c times the derivative of G^T lam, with the marker Jacobians constant, to S."""
    rows = s.rows
    for joint in range(rows.joint_i.size):
        W.Q[:] = 0.0
        found = False
        for at in range(s.graph.joint_first[joint], s.graph.joint_first[joint + 1]):
            k = s.graph.joint_rows[at]
            if rows.kind[k] != POINT and lam[k] != 0.0:
                i, j = rows.i[k], rows.j[k]
                a, b = turn(W.E, i, row(rows.a, k, 0)), turn(W.E, j, row(rows.b, k, 0))
                gap = sub(row(W.P, j, 0), row(W.P, i, 0))
                row_stiffness(rows.kind[k], a, b, gap, row(W.g, k, 9), c * lam[k], W.Q)
                if rows.kind[k] in (TOUCH, ROLL):
                    rolling_stiffness(s, W, k, c * lam[k])
                found = True
        if found:
            pair_stiffness(s, W, rows.joint_i[joint], rows.joint_j[joint], S)
