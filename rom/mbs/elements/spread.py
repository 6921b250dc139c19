"""Loads spread over a body, which keep their direction in the body or in the world."""

from numba import types

from rom.mbs.kernels.algebra import add, cross, dot, mtv, mv, place, put, scale, unit, vec
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.integrals import dual, trace
from rom.mbs.kernels.markers import own_block
from rom.mbs.kernels.stages import REAL_MATRIX, REAL_VECTOR, stage
from rom.mbs.kernels.system import System
from rom.mbs.kernels.work import Work


@inner
def amplitude(L, k, signal):
    """Factor of load k, its signal included."""
    a = L.amplitude[k]
    return a + signal[L.signal[k], 0] if L.signal[k] >= 0 else a


@inner
def seen(x, A, world):
    """A sum [a, b] of lengths and forces, nine entries, with the forces in the axes of the body."""
    if world == 0:
        return x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8]
    a = mtv(A, (x[0], x[1], x[2]))
    b = mtv(A, (x[3], x[4], x[5]))
    c = mtv(A, (x[6], x[7], x[8]))
    return a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]


@inner
def spread_arm(s, W, k, q):
    """Sum [a, b] of positions and forces of load k, of the deformed body, axes of the body."""
    L = s.spread
    b, world = L.body[k], L.world[k]
    N = seen(L.first[k], W.A[b], world)
    for j in range(s.bodies.r[b]):
        x = seen(L.shapes[k, j], W.A[b], world)
        f = q[s.bodies.q_at[b] + 7 + j]
        N = (
            N[0] + f * x[0], N[1] + f * x[1], N[2] + f * x[2],
            N[3] + f * x[3], N[4] + f * x[4], N[5] + f * x[5],
            N[6] + f * x[6], N[7] + f * x[7], N[8] + f * x[8],
        )  # fmt: skip
    return N


@stage(types.void, System, Work, REAL_VECTOR, REAL_VECTOR, needed=lambda s: s.spread.body.size)
def spread_residuals(s, W, q, v):
    """Subtract all spread loads from W.residual, and add their power to W.power[1]."""
    L = s.spread
    for k in range(L.body.size):
        b, world, a = L.body[k], L.world[k], amplitude(L, k, W.signal)
        t, A = s.bodies.v_at[b], W.A[b]
        given = vec(L.force[k], 0)
        force = scale(a, given if world == 1 else mv(A, given))
        N = spread_arm(s, W, k, q)
        for p in range(9):
            W.arm[k, p] = N[p]
        moment = scale(a, dual(N, 0))
        put(W.residual, t, scale(-1.0, force))
        put(W.residual, t + 3, scale(-1.0, moment))
        W.power[1] += dot(force, vec(v, t)) + dot(moment, vec(v, t + 3))
        for j in range(s.bodies.r[b]):
            modal_force = a * trace(seen(L.shapes[k, j], A, world), 0)
            W.residual[t + 6 + j] -= modal_force
            W.power[1] += modal_force * v[t + 6 + j]


@stage(types.void, System, Work, types.float64, REAL_MATRIX, needed=lambda s: s.spread.body.size)
def spread_tangents(s, W, c, S):
    """Add c times the derivative by the coordinates to S; `spread_residuals` first."""
    L = s.spread
    for k in range(L.body.size):
        b, world = L.body[k], L.world[k]
        A, r, block = W.A[b], s.bodies.r[b], own_block(s, b, S)
        ca = -c * amplitude(L, k, W.signal)
        for p in range(3):
            e = unit(p)
            if world == 0:
                place(block, 0, 3 + p, ca, mv(A, cross(e, vec(L.force[k], 0))))
            else:
                turned = add(vec(W.arm[k], 3 * p), scale(-trace(W.arm[k], 0), e))
                place(block, 3, 3 + p, ca, turned)
        for j in range(r):
            x = seen(L.shapes[k, j], A, world)
            place(block, 3, 6 + j, ca, dual(x, 0))
            if world == 1:
                twist = dual(x, 0)
                for p in range(3):
                    block[6 + j, 3 + p] += ca * twist[p]
