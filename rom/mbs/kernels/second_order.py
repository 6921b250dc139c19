"""Displacements of second order: how load, rotation and acceleration stiffen a body.

To second order a point lies at P = X + sum q_k phi_k + 1/2 sum q_k q_l psi_kl, see
`rom.body.stiffening`. With it the first moment of the body and its product with the undeformed
positions gain quadratic parts, kept to the order of the stiffness; everything else follows from
the kinetic energy, so that nothing is lost or gained: energy, momentum and the symmetry of the
mass matrix are exact.
"""

from rom.mbs.kernels.algebra import add, cross, dot, mtv, mv, place, row, scale, sub, vec
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.integrals import contract, dual, times, trace, transposed_times


@inner
def contract_moment(T, x, at, r, out):
    """Set the rows of out to the integrals of rho psi_kl x_l."""
    for k in range(r):
        for i in range(3):
            out[k, i] = 0.0
            for l in range(r):
                out[k, i] += T[l, 3 * k + i] * x[at + l]


@inner
def bent_integrals(bodies, W, b, q, v):
    """Add the second order to W.SP, W.Ct and W.J (before its trace), set W.Td and W.T1d."""
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


@inner
def bent_stiffness(bodies, W, b, v, a, c, S):
    """Add what the second order adds to the columns of the elastic coordinates."""
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
            s = bodies.T1[f, l, 9 * k : 9 * k + 9]
            inertia = dot(row(bodies.T[f], l, 3 * k), a_minus_g) + dot(dw, dual(s, 0))
            S[6 + k, e] += c * (inertia + dot(w, times(s, w)) - dot(w, w) * trace(s, 0))
