"""Displacements of second order: how load, rotation and acceleration stiffen a body.

To second order a point lies at P = X + sum q_k phi_k + 1/2 sum q_k q_l psi_kl, see
`rom.body.stiffening`. What shapes combine to of psi, sum phi_m H_mkl with M H the integral of
rho phi psi, is taken for what it is, other amplitudes of the shapes::

    P = X + sum y_m phi_m + rest,    y_m = q_m + 1/2 sum H_mkl q_k q_l

The body has the inertia of linear shapes in the coordinates y, and in q that of the chain rule: it
is complete to the first order of q, and definite however far the body bends. On mean axes the rest
has no momentum and no moment of momentum; its product with the undeformed positions is kept, by
which rotation stiffens. All follows from the kinetic energy: energy, momentum and the symmetry of
the mass matrix are exact.
"""

from numba import types

from rom.mbs.kernels.algebra import (
    contract,
    dot,
    place,
    scale,
    spatial_tangent,
    sub,
    times,
    trace,
    vec,
)
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.stages import REAL_BLOCK, REAL_VECTOR, stage
from rom.mbs.kernels.system import System
from rom.mbs.kernels.work import Work

REAL_3 = types.UniTuple(types.float64, 3)
OF_BODY = (types.void, System, Work, types.int64)  # what a stage for one body or marker takes first


def has_stiffened(system):
    """Whether a body of the system has displacements of second order."""
    return system.bodies.stiffened.any()


@inner
def bend(bodies, b, x, at, out):
    """Set out to the sum of H_mkl x_l, m its row and k its column."""
    r, row = bodies.r[b], bodies.H_at[bodies.flex[b]]
    out[:r, :r] = 0.0
    for l in range(r):
        for m in range(r):
            for k in range(r):
                out[m, k] += x[at + l] * bodies.H[row + k]
            row += r


@stage(*OF_BODY, REAL_VECTOR, REAL_VECTOR, needed=has_stiffened)
def bent_coordinates(s, W, b, q, v):
    """Set W.y, W.yd, and the derivatives of y and yd by q, W.Y and W.Yd."""
    r, at, vt = s.bodies.r[b], s.bodies.q_at[b] + 7, s.bodies.v_at[b] + 6
    y, yd, Y = W.y[b], W.yd[b], W.Y[b]
    bend(s.bodies, b, q, at, Y)
    bend(s.bodies, b, v, vt, W.Yd[b])
    for m in range(r):
        y[m], yd[m] = q[at + m], v[vt + m]
        for k in range(r):
            y[m] += 0.5 * Y[m, k] * q[at + k]
            yd[m] += Y[m, k] * v[vt + k]
        Y[m, m] += 1.0


@inner
def bent_rates(W, b, r, vt, v, a):
    """Set W.ydd to the second rates of y."""
    for m in range(r):
        total = 0.0
        for k in range(r):
            total += W.Y[b, m, k] * a[vt + k] + W.Yd[b, m, k] * v[vt + k]
        W.ydd[b, m] = total


@stage(*OF_BODY, needed=has_stiffened)
def bent_integrals(s, W, b):
    """Add what no combination of shapes contains to W.SP and W.J (before its trace), set W.T1d."""
    bodies = s.bodies
    f, r, y, J, spread = bodies.flex[b], bodies.r[b], W.y[b], W.J[b], W.T1a
    spread[:] = 0.0
    W.T1d[b] = 0.0
    contract(bodies.T1[f], y, r, W.line, spread)
    contract(bodies.T1[f], W.yd[b], r, W.line, W.T1d[b])
    for k in range(r):
        for i in range(3):
            for j in range(3):
                J[i, j] -= y[k] * spread[k, 3 * i + j]
                W.SP[b, k, 3 * i + j] += spread[k, 3 * i + j]


@inner
def spread_stiffness(s, W, b, v, S):
    """Add what `bent_integrals` adds to the derivatives by y."""
    bodies = s.bodies
    f, r, w = bodies.flex[b], bodies.r[b], vec(v, bodies.v_at[b] + 3)
    for l in range(r):
        e, rate = 6 + l, W.T1d[b, l]
        place(S, 3, e, 2.0, sub(scale(trace(rate, 0), w), times(rate, w)))
        for k in range(r):
            T1 = bodies.T1[f, l, 9 * k : 9 * k + 9]
            S[6 + k, e] += dot(w, times(T1, w)) - dot(w, w) * trace(T1, 0)


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


@stage(types.UniTuple(REAL_3, 2), *OF_BODY[1:], REAL_VECTOR, REAL_VECTOR, needed=has_stiffened)
def bent_motion(s, W, m, q, v):
    """Set W.move to what elastic rates do to a marker; its accelerations of second order."""
    bodies, bend, b = s.bodies, s.markers.bend[m], s.markers.body[m]
    bent_shapes(s.markers, m, q, bodies.q_at[b] + 7, bodies.r[b], W.move[m])
    t, r = bodies.v_at[b] + 6, bodies.r[b]
    return bent_sum(bend, 0, v, t, r), bent_sum(bend, 3, v, t, r)


@stage(*OF_BODY, REAL_3, REAL_3, types.float64, REAL_BLOCK, needed=has_stiffened)
def bent_wrench_stiffness(s, W, m, f, n, c, S):
    """Stiffness that the force and moment on a marker give to its body, in its block S."""
    bend, theta, r = s.markers.bend[m], vec(W.theta[m], 0), s.bodies.r[s.markers.body[m]]
    for k in range(r):
        for l in range(r):
            move = (bend[0, k, l], bend[1, k, l], bend[2, k, l])
            spin = spatial_tangent(theta, (bend[3, k, l], bend[4, k, l], bend[5, k, l]))
            S[6 + k, 6 + l] -= c * (dot(f, move) + dot(n, spin))
