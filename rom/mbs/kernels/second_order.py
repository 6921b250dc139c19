"""Displacements of second order: how load, rotation and acceleration stiffen a body.

To second order a point lies at P = X + sum q_k phi_k + 1/2 sum q_k q_l psi_kl, see
`rom.body.stiffening`. With it the first moment of the body and its product with the undeformed
positions gain quadratic parts, kept to the order of the stiffness; everything else follows from
the kinetic energy, so that nothing is lost or gained: energy, momentum and the symmetry of the
mass matrix are exact.
"""

from numba import types

from rom.mbs.kernels.algebra import (
    add,
    cross,
    dot,
    mtv,
    mv,
    place,
    row,
    scale,
    spatial_tangent,
    sub,
    vec,
)
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.integrals import contract, dual, times, trace, transposed_times
from rom.mbs.kernels.stages import REAL_BLOCK, REAL_VECTOR, stage
from rom.mbs.kernels.system import System
from rom.mbs.kernels.work import Work

REAL_3 = types.UniTuple(types.float64, 3)


def _has_stiffened(system):
    return system.bodies.stiffened.any()


@inner
def contract_moment(T, x, at, r, out):
    """Set the rows of out to the integrals of rho psi_kl x_l."""
    for k in range(r):
        for i in range(3):
            out[k, i] = 0.0
            for l in range(r):
                out[k, i] += T[l, 3 * k + i] * x[at + l]


@stage(types.void, System, Work, types.int64, REAL_VECTOR, REAL_VECTOR, needed=_has_stiffened)
def bent_integrals(s, W, b, q, v):
    """Add the second order to W.SP, W.Ct and W.J (before its trace), set W.Td and W.T1d."""
    bodies = s.bodies
    f, r, at, vt = bodies.flex[b], bodies.r[b], bodies.q_at[b], bodies.v_at[b]
    J, moment, spread = W.J[b], W.Ta, W.T1a
    contract_moment(bodies.T[f], q, at + 7, r, moment)
    contract_moment(bodies.T[f], v, vt + 6, r, W.Td[b])
    spread[:] = 0.0
    W.T1d[b] = 0.0
    contract(bodies.T1[f], q, at + 7, r, W.line, spread)
    contract(bodies.T1[f], v, vt + 6, r, W.line, W.T1d[b])
    for k in range(r):
        for i in range(3):
            W.Ct[b, i, k] += moment[k, i]
            for j in range(3):
                half = 0.5 * q[at + 7 + k] * spread[k, 3 * i + j]
                J[i, j] -= half
                J[j, i] -= half
                W.SP[b, k, 3 * i + j] += spread[k, 3 * i + j]


@inner
def bent_push(W, b, r, v, vt):
    """Force of the elastic rates alone: integral of rho psi_kl v_k v_l."""
    force = (0.0, 0.0, 0.0)
    for k in range(r):
        force = add(force, scale(v[vt + 6 + k], row(W.Td[b], k, 0)))
    return force


@inner
def bent_twist(W, b, r, v, vt):
    """Moment of the elastic rates alone: integral of rho X x psi_kl v_k v_l."""
    moment = (0.0, 0.0, 0.0)
    for k in range(r):
        moment = add(moment, scale(v[vt + 6 + k], dual(W.T1d[b, k], 0)))
    return moment


@stage(
    *(types.void, System, Work, types.int64, REAL_VECTOR, REAL_VECTOR, types.float64, REAL_BLOCK),
    needed=_has_stiffened,
)
def bent_stiffness(s, W, b, v, a, c, S):
    """Add what the second order adds to the columns of the elastic coordinates."""
    bodies = s.bodies
    f, r, t = bodies.flex[b], bodies.r[b], bodies.v_at[b]
    w, dw, A = vec(v, t + 3), vec(a, t + 3), W.A[b]
    a_minus_g = mtv(A, sub(vec(a, t), vec(bodies.gravity, 0)))
    contract_moment(bodies.T[f], a, t + 6, r, W.Ta)
    W.T1a[:] = 0.0
    contract(bodies.T1[f], a, t + 6, r, W.line, W.T1a)
    for l in range(r):
        e, spread = 6 + l, W.T1d[b, l]
        force = add(row(W.Ta, l, 0), scale(2.0, cross(w, row(W.Td[b], l, 0))))
        place(S, 0, e, c, mv(A, force))
        spin = sub(scale(trace(spread, 0), w), transposed_times(spread, w))
        place(S, 3, e, c, add(dual(W.T1a[l], 0), scale(2.0, spin)))
        for k in range(r):
            T1 = bodies.T1[f, l, 9 * k : 9 * k + 9]
            inertia = dot(row(bodies.T[f], l, 3 * k), a_minus_g) + dot(dw, dual(T1, 0))
            S[6 + k, e] += c * (inertia + dot(w, times(T1, w)) - dot(w, w) * trace(T1, 0))


@inner
def bent_shapes(markers, m, q, at, r, move):
    """Displacement and rotation of a marker per elastic rate, second order included."""
    for p in range(3):
        for k in range(r):
            move[p, k], move[3 + p, k] = markers.shape[m, p, k], markers.twist[m, p, k]
            for l in range(r):
                move[p, k] += markers.bend[m, p, k, l] * q[at + l]
                move[3 + p, k] += markers.bend[m, 3 + p, k, l] * q[at + l]


@inner
def bent_sum(bend, p, x, at, r):
    """Sum of bend[p : p + 3, k, l] x_k x_l."""
    a0, a1, a2 = 0.0, 0.0, 0.0
    for k in range(r):
        for l in range(r):
            square = x[at + k] * x[at + l]
            a0 += bend[p, k, l] * square
            a1 += bend[p + 1, k, l] * square
            a2 += bend[p + 2, k, l] * square
    return a0, a1, a2


@stage(
    *(types.UniTuple(REAL_3, 2), System, Work, types.int64, REAL_VECTOR, REAL_VECTOR),
    needed=_has_stiffened,
)
def bent_motion(s, W, m, q, v):
    """Set W.move to what elastic rates do to a marker; its accelerations of second order."""
    bodies, bend, b = s.bodies, s.markers.bend[m], s.markers.body[m]
    bent_shapes(s.markers, m, q, bodies.q_at[b] + 7, bodies.r[b], W.move[m])
    t, r = bodies.v_at[b] + 6, bodies.r[b]
    return bent_sum(bend, 0, v, t, r), bent_sum(bend, 3, v, t, r)


@stage(
    *(types.void, System, Work, types.int64, REAL_3, REAL_3, types.float64, REAL_BLOCK),
    needed=_has_stiffened,
)
def bent_wrench_stiffness(s, W, m, f, n, c, S):
    """Stiffness that the force and moment on a marker give to its body, in its block S."""
    bend, theta, r = s.markers.bend[m], vec(W.theta[m], 0), s.bodies.r[s.markers.body[m]]
    for k in range(r):
        for l in range(r):
            move = (bend[0, k, l], bend[1, k, l], bend[2, k, l])
            spin = spatial_tangent(theta, (bend[3, k, l], bend[4, k, l], bend[5, k, l]))
            S[6 + k, 6 + l] -= c * (dot(f, move) + dot(n, spin))
