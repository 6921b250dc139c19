"""Joint coordinates: how they move, what couples them, and forces that act along them.

Elements between two markers follow angles as joints do, and have tangents of both motions.
"""

from numba import types

from rom.mbs.kernels.algebra import cross, dot, row, scale, sub, turn
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import (
    along_rates,
    angle_state,
    has_couplings,
    pair_stiffness,
    row_stiffness,
    set_gradient,
    wrapped,
)
from rom.mbs.kernels.stages import REAL_MATRIX, REAL_VECTOR, stage
from rom.mbs.kernels.system import ALONG, COUPLING, System
from rom.mbs.kernels.work import Work


@stage(types.void, System, Work, needed=lambda s: s.coordinates.kind.size)
def coordinate_states(s, W):
    """Joint coordinates, rates, convective terms and gradients; angles near the last accepted."""
    C, zero = s.coordinates, (0.0, 0.0, 0.0)
    for k in range(C.kind.size):
        i, j = C.i[k], C.j[k]
        a = turn(W.E, i, row(C.a, k, 0))
        Vi, Oi, Oj = row(W.V, i, 0), row(W.V, i, 3), row(W.V, j, 3)
        qi, qj = row(W.conv, i, 3), row(W.conv, j, 3)
        if C.kind[k] == ALONG:
            gap, slide = sub(row(W.P, j, 0), row(W.P, i, 0)), sub(row(W.V, j, 0), Vi)
            pull = sub(row(W.conv, j, 0), row(W.conv, i, 0))
            W.x[k] = dot(a, gap) - C.offset[k]
            W.xd[k], W.xc[k] = along_rates(a, gap, slide, pull, Oi, qi)
            set_gradient(W.xg, k, scale(-1.0, a), cross(a, gap), a, zero)
        else:
            b, c = turn(W.E, j, row(C.b, k, 0)), turn(W.E, i, row(C.c, k, 0))
            angle, W.xd[k], W.xc[k], axis = angle_state(a, c, b, Oi, Oj, qi, qj)
            W.x[k] = W.base[k] + wrapped(angle - C.offset[k] - W.base[k])
            set_gradient(W.xg, k, zero, scale(-1.0, axis), zero, axis)


@inner
def follow_coordinates(W):
    """Accept the present angles as those the next ones are followed from, and memories of laws."""
    for k in range(W.x.size):
        W.base[k] = W.x[k]
    for k in range(W.fresh.size):
        W.base[W.x.size + k] = W.fresh[k]


@inner
def coordinate_stiffness(s, W, at, c):
    """Add c times the derivative of the gradient of a joint coordinate to W.Q."""
    C = s.coordinates
    i, j = C.i[at], C.j[at]
    a, b = turn(W.E, i, row(C.a, at, 0)), turn(W.E, j, row(C.b, at, 0))
    gap = sub(row(W.P, j, 0), row(W.P, i, 0))
    row_stiffness(C.kind[at], a, b, gap, row(W.xg, at, 9), c, W.Q)


@stage(*(types.void, System, Work, REAL_VECTOR, types.float64, REAL_MATRIX), needed=has_couplings)
def coupling_stiffness(s, W, lam, c, S):
    """Add c times the derivative of G^T lam to S for the couplings."""
    rows, C = s.rows, s.coordinates
    for k in range(rows.kind.size):
        if rows.kind[k] == COUPLING:
            for side in range(2):
                at = rows.at[k, side]
                W.Q[:] = 0.0
                coordinate_stiffness(s, W, at, c * lam[k] * rows.factor[k, side])
                pair_stiffness(s, W, C.i[at], C.j[at], S)


@inner
def push_coordinate(s, W, at, force):
    """Add the wrenches of a force on joint coordinate ``at`` to its markers."""
    C = s.coordinates
    for p in range(6):
        W.wrench[C.i[at], p] += force * W.xg[at, p]
        W.wrench[C.j[at], p] += force * W.xg[at, 6 + p]


@inner
def coordinate_tangent(s, W, at, law, K, S):
    """Add the tangents of a force on joint coordinate ``at`` to K and S.

    ``law`` holds the force and its derivative by the coordinate, both times the factor of K, and
    the derivative by the rate, times the factor of S.
    """
    force, stiffness, damping = law
    C = s.coordinates
    W.Q[:] = 0.0
    coordinate_stiffness(s, W, at, -force)
    for p in range(12):
        for q in range(12):
            W.Q[p, q] -= stiffness * W.xg[at, p] * W.xg[at, q]
    pair_stiffness(s, W, C.i[at], C.j[at], K)
    if damping != 0.0:
        for p in range(12):
            for q in range(12):
                W.Q[p, q] = -damping * W.xg[at, p] * W.xg[at, q]
        pair_stiffness(s, W, C.i[at], C.j[at], S)


@inner
def followed_angle(s, W, at, angle):
    """An angle over whole turns, nearest to the one remembered in place ``at``, and kept there."""
    before = W.base[s.coordinates.kind.size + at]
    angle = before + wrapped(angle - before)
    W.fresh[at] = angle
    return angle


@inner
def place_tangent(s, W, pair, tangent, ck, cc):
    """Add tangents (2, 12, 12) of a pair of markers: by motions to W.Kt, by velocities to W.S."""
    for kind in range(2):
        for p in range(12):
            for q in range(12):
                W.Q[p, q] = (ck if kind == 0 else cc) * tangent[kind, p, q]
        pair_stiffness(s, W, pair[0], pair[1], W.Kt if kind == 0 else W.S)
