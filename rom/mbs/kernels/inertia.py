"""Inertia of one body in its floating frame: residual, mass matrix and analytic tangents.

With P = X + sum y_k phi_k, and S(U, V) the integral of rho U V^T, the inertia is exact to second
order in y, the elastic coordinates q; with geometric stiffness y has more to it, see
`rom.mbs.kernels.second_order`. The rows are force in the world, moment about the origin of the
body in the body frame, and generalised force of each elastic coordinate.
"""

from numba import types

from rom.mbs.kernels.algebra import (
    add,
    col,
    contract,
    cross,
    dot,
    dual,
    mtv,
    mv,
    place,
    place_row,
    put,
    rotation,
    scale,
    sub,
    times,
    trace,
    transposed_times,
    unit,
    vec,
)
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.second_order import (
    OF_BODY,
    bend,
    bent_coordinates,
    bent_integrals,
    bent_rates,
    has_stiffened,
    spread_stiffness,
)
from rom.mbs.kernels.stages import REAL_BLOCK, REAL_VECTOR, stage


def _has_elastic(system):
    return system.bodies.r.any()


@inner
def body_states(s, W, q, v):
    """Orientation and inertia integrals of the deformed bodies at the coordinates q."""
    bodies = s.bodies
    for b in range(bodies.mass.size):
        f, r, at, vt = bodies.flex[b], bodies.r[b], bodies.q_at[b], bodies.v_at[b]
        y, yd = W.y[b], W.yd[b]
        rotation(q, at + 3, W.A[b])
        for k in range(r):
            y[k], yd[k] = q[at + 7 + k], v[vt + 6 + k]
        if bodies.stiffened[b] == 1:
            bent_coordinates(s, W, b, q, v)
        shape_integrals(bodies, W, b)
        SP, SPd, J = W.SP[b], W.SPd[b], W.J[b]
        if bodies.stiffened[b] == 1:
            bent_integrals(s, W, b)
        for i in range(3):
            moment, rate = bodies.first[b, i], 0.0
            for k in range(r):
                moment += bodies.S[f, i, k] * y[k]
                rate += bodies.S[f, i, k] * yd[k]
            W.d[b, i], W.dd[b, i] = moment, rate
            for j in range(3):
                total = 0.0
                for k in range(r):
                    total += yd[k] * SP[k, 3 * i + j]
                SPd[i, j] = total
        minus_trace = -(J[0, 0] + J[1, 1] + J[2, 2])
        for i in range(3):
            J[i, i] += minus_trace


@inner
def shape_integrals(bodies, W, b):
    """Integrals with the shapes alone; W.J becomes minus the integral of rho P P^T."""
    f, r = bodies.flex[b], bodies.r[b]
    y, SP, Sd, J = W.y[b], W.SP[b], W.Sd[b], W.J[b]
    for k in range(r):
        for p in range(9):
            SP[k, p] = bodies.S1[f, k, p]
            Sd[k, p] = 0.0
    contract(bodies.S2[f], y, r, W.line, SP)
    contract(bodies.S2[f], W.yd[b], r, W.line, Sd)
    for i in range(3):
        for j in range(3):
            total = bodies.second[b, i, j]
            for k in range(r):
                total += y[k] * (bodies.S1[f, k, 3 * j + i] + SP[k, 3 * i + j])
            J[i, j] = -total


@inner
def body_residuals(bodies, W, q, v, a):
    """Add inertia, gravity, elastic and damping forces of all bodies to W.residual.

    The power lost in damping is added to W.power[2].

    Source:
        Shabana, Dynamics of Multibody Systems, chapter 5; in the inertia integrals of Zwoelfer
        and Gerstmayr, Acta Mechanica 232 (2021).
    """
    for b in range(bodies.mass.size):
        f, r, at, vt = bodies.flex[b], bodies.r[b], bodies.q_at[b], bodies.v_at[b]
        accelerations(bodies, W, b, v, a)
        force, moment = shape_forces(bodies, W, b, v, a)
        put(W.residual, vt, mv(W.A[b], force))
        put(W.residual, vt + 3, moment)
        pull = W.pull[b]
        for k in range(r):
            total, damping = pull[k], 0.0
            if bodies.stiffened[b] == 1:
                total = 0.0
                for m in range(r):
                    total += W.Y[b, m, k] * pull[m]
            for l in range(r):
                total += bodies.K[f, k, l] * q[at + 7 + l]
                damping += bodies.C[f, k, l] * v[vt + 6 + l]
            W.residual[vt + 6 + k] += total + damping
            W.power[2] += damping * v[vt + 6 + k]


@inner
def accelerations(bodies, W, b, v, a):
    """Set W.ydd to the second rates of y."""
    vt = bodies.v_at[b] + 6
    for k in range(bodies.r[b]):
        W.ydd[b, k] = a[vt + k]
    if bodies.stiffened[b] == 1:
        bent_rates(W, b, bodies.r[b], vt, v, a)


@inner
def shape_forces(bodies, W, b, v, a):
    """Inertia and gravity of a body: force and moment in its frame; W.pull for each shape."""
    f, r, vt = bodies.flex[b], bodies.r[b], bodies.v_at[b]
    w, dw, d, dd = vec(v, vt + 3), vec(a, vt + 3), vec(W.d[b], 0), vec(W.dd[b], 0)
    a_minus_g = mtv(W.A[b], sub(vec(a, vt), vec(bodies.gravity, 0)))
    force = add(scale(bodies.mass[b], a_minus_g), add(cross(dw, d), cross(w, cross(w, d))))
    force = add(force, scale(2.0, cross(w, dd)))
    SPd, ydd = W.SPd[b], W.ydd[b]
    spread = SPd[0, 0] + SPd[1, 1] + SPd[2, 2]
    moment = add(cross(d, a_minus_g), mv(W.J[b], dw))
    moment = add(moment, cross(w, mv(W.J[b], w)))
    moment = add(moment, scale(2.0, sub(scale(spread, w), mtv(SPd, w))))
    for k in range(r):
        s, S_k = W.SP[b, k], col(bodies.S[f], k)
        Cr_k = dual(s, 0)
        force, moment = add(force, scale(ydd[k], S_k)), add(moment, scale(ydd[k], Cr_k))
        total = dot(S_k, a_minus_g) + dot(Cr_k, dw) + 2.0 * dot(w, dual(W.Sd[b, k], 0))
        total += dot(w, times(s, w)) - dot(w, w) * trace(s, 0)
        for l in range(r):
            total += bodies.M[f, k, l] * ydd[l]
        W.pull[b, k] = total
    return force, moment


@inner
def body_mass(s, W, b, c, S):
    """Add c times the mass matrix of body b to its block S."""
    if s.bodies.stiffened[b] == 1:
        bent_mass(s, W, b, c, S)
    else:
        shape_mass(s.bodies, W, b, c, S)


@inner
def shape_mass(bodies, W, b, c, S):
    """Add c times the mass matrix of body b in the coordinates y to S."""
    f, r = bodies.flex[b], bodies.r[b]
    d, A, J = vec(W.d[b], 0), W.A[b], W.J[b]
    for j in range(3):
        S[j, j] += c * bodies.mass[b]
        lever = mv(A, cross(unit(j), d))
        place(S, 0, 3 + j, c, lever)
        place_row(S, 3 + j, 0, c, lever)
        for i in range(3):
            S[3 + i, 3 + j] += c * J[i, j]
    for k in range(r):
        e = 6 + k
        S_world, Cr_k = mv(A, col(bodies.S[f], k)), dual(W.SP[b, k], 0)
        place(S, 0, e, c, S_world)
        place_row(S, e, 0, c, S_world)
        place(S, 3, e, c, Cr_k)
        place_row(S, e, 3, c, Cr_k)
        for l in range(r):
            S[e, 6 + l] += c * bodies.M[f, k, l]


@stage(*OF_BODY, types.float64, REAL_BLOCK, needed=has_stiffened)
def bent_mass(s, W, b, c, S):
    """Add c times the mass matrix of a stiffened body to S: that of y by the chain rule."""
    n, of_y, G = 6 + s.bodies.r[b], W.of_y[0], W.of_y[3]
    of_y[:n, :n] = 0.0
    shape_mass(s.bodies, W, b, 1.0, of_y)
    set_columns(of_y, W.Y[b], n, G)
    pull_back(c, G, W.Y[b], n, S)


@inner
def set_columns(A, Y, n, G):
    """Set G to A diag(1, Y)."""
    for i in range(n):
        for j in range(n):
            G[i, j] = A[i, j] if j < 6 else 0.0
    add_columns(1.0, A, Y, n, G)


@inner
def add_columns(c, A, Y, n, G):
    """Add c A diag(0, Y) to G."""
    for i in range(n):
        for m in range(6, n):
            for k in range(6, n):
                G[i, k] += c * A[i, m] * Y[m - 6, k - 6]


@inner
def pull_back(c, G, Y, n, S):
    """Add c diag(1, Y)^T G to S."""
    for i in range(6):
        for j in range(n):
            S[i, j] += c * G[i, j]
    for m in range(6, n):
        for k in range(6, n):
            for j in range(n):
                S[k, j] += c * Y[m - 6, k - 6] * G[m, j]


@inner
def body_damping(s, W, b, v, c, S):
    """Add c times the derivative of the residual of body b by its velocities to its block S."""
    bodies = s.bodies
    f, r = bodies.flex[b], bodies.r[b]
    if bodies.stiffened[b] == 1:
        bent_damping(s, W, b, v, c, S)
    else:
        shape_damping(s, W, b, v, c, S)
    for k in range(r):
        for l in range(r):
            S[6 + k, 6 + l] += c * bodies.C[f, k, l]


@stage(*OF_BODY, REAL_VECTOR, types.float64, REAL_BLOCK, needed=has_stiffened)
def bent_damping(s, W, b, v, c, S):
    """Add c times the derivative of the inertia of a stiffened body by its velocities to S."""
    n, Y, G = 6 + s.bodies.r[b], W.Y[b], W.of_y[3]
    W.of_y[:2, :n, :n] = 0.0
    shape_mass(s.bodies, W, b, 1.0, W.of_y[0])
    shape_damping(s, W, b, v, 1.0, W.of_y[1])
    set_columns(W.of_y[1], Y, n, G)
    add_columns(2.0, W.of_y[0], W.Yd[b], n, G)
    pull_back(c, G, Y, n, S)


@inner
def shape_damping(s, W, b, v, c, S):
    """Add c times the derivative of what `shape_forces` gives, by w and the rates of y, to S."""
    t = s.bodies.v_at[b]
    w, d, dd, A, J = vec(v, t + 3), vec(W.d[b], 0), vec(W.dd[b], 0), W.A[b], W.J[b]
    SPd = W.SPd[b]
    spread = SPd[0, 0] + SPd[1, 1] + SPd[2, 2]
    for j in range(3):
        e = unit(j)
        force = sub(add(scale(dot(w, d), e), scale(d[j], w)), scale(2.0 * w[j], d))
        place(S, 0, 3 + j, c, mv(A, add(force, scale(2.0, cross(e, dd)))))
        moment = add(cross(w, mv(J, e)), cross(e, mv(J, w)))
        moment = add(moment, scale(2.0, sub(scale(spread, e), mtv(SPd, e))))
        place(S, 3, 3 + j, c, moment)
    if s.bodies.r[b] > 0:
        elastic_damping(s, W, b, v, c, S)


@stage(*OF_BODY, REAL_VECTOR, types.float64, REAL_BLOCK, needed=_has_elastic)
def elastic_damping(s, W, b, v, c, S):
    """The rows and columns of `shape_damping` that belong to the elastic coordinates."""
    bodies, A = s.bodies, W.A[b]
    f, r, w = bodies.flex[b], bodies.r[b], vec(v, bodies.v_at[b] + 3)
    for k in range(r):
        SP, e = W.SP[b, k], 6 + k
        place(S, 0, e, c, mv(A, scale(2.0, cross(w, col(bodies.S[f], k)))))
        spin = sub(scale(trace(SP, 0), w), transposed_times(SP, w))
        place(S, 3, e, c, scale(2.0, spin))
        row = add(times(SP, w), transposed_times(SP, w))
        row = add(row, scale(2.0, dual(W.Sd[b, k], 0)))
        place_row(S, e, 3, c, sub(row, scale(2.0 * trace(SP, 0), w)))
        for l in range(r):
            S[e, 6 + l] += c * 2.0 * dot(w, dual(bodies.S2[f, l], 9 * k))


@inner
def body_stiffness(s, W, b, v, a, c, S):
    """Add c times the derivative of the residual of body b by its coordinates to its block S.

    Rotations are perturbed in the body frame: dA = A skew(dtheta).
    """
    bodies = s.bodies
    f, r = bodies.flex[b], bodies.r[b]
    if bodies.stiffened[b] == 1:
        bent_stiffness(s, W, b, v, a, c, S)
    else:
        shape_stiffness(s, W, b, v, a, c, S)
    for k in range(r):
        for l in range(r):
            S[6 + k, 6 + l] += c * bodies.K[f, k, l]


@stage(*OF_BODY, REAL_VECTOR, REAL_VECTOR, types.float64, REAL_BLOCK, needed=has_stiffened)
def bent_stiffness(s, W, b, v, a, c, S):
    """Add c times the derivative of the inertia of a stiffened body by its coordinates to S."""
    bodies = s.bodies
    r, Y, G = bodies.r[b], W.Y[b], W.of_y[3]
    n, row = 6 + r, bodies.H_at[bodies.flex[b]]
    W.of_y[:3, :n, :n] = 0.0
    shape_mass(bodies, W, b, 1.0, W.of_y[0])
    shape_damping(s, W, b, v, 1.0, W.of_y[1])
    shape_stiffness(s, W, b, v, a, 1.0, W.of_y[2])
    spread_stiffness(s, W, b, v, W.of_y[2])
    set_columns(W.of_y[2], Y, n, G)
    add_columns(1.0, W.of_y[1], W.Yd[b], n, G)
    bend(bodies, b, a, bodies.v_at[b] + 6, W.Ya)
    add_columns(1.0, W.of_y[0], W.Ya, n, G)
    pull_back(c, G, Y, n, S)
    for l in range(r):
        for m in range(r):
            for k in range(r):
                S[6 + k, 6 + l] += c * W.pull[b, m] * bodies.H[row + k]
            row += r


@inner
def shape_stiffness(s, W, b, v, a, c, S):
    """Add c times the derivative of what `shape_forces` gives, by rotation and y, to S."""
    bodies = s.bodies
    f, r, t = bodies.flex[b], bodies.r[b], bodies.v_at[b]
    w, dw, d, A = vec(v, t + 3), vec(a, t + 3), vec(W.d[b], 0), W.A[b]
    a_minus_g = mtv(A, sub(vec(a, t), vec(bodies.gravity, 0)))
    pull = add(cross(dw, d), add(cross(w, cross(w, d)), scale(2.0, cross(w, vec(W.dd[b], 0)))))
    for k in range(r):
        pull = add(pull, scale(W.ydd[b, k], col(bodies.S[f], k)))
    for j in range(3):
        e = unit(j)
        turned_a_minus_g = cross(a_minus_g, e)
        place(S, 0, 3 + j, c, mv(A, cross(e, pull)))
        place(S, 3, 3 + j, c, cross(d, turned_a_minus_g))
        for k in range(r):
            S[6 + k, 3 + j] += c * dot(col(bodies.S[f], k), turned_a_minus_g)
    if r > 0:
        elastic_stiffness(s, W, b, v, a, c, S)


@stage(*OF_BODY, REAL_VECTOR, REAL_VECTOR, types.float64, REAL_BLOCK, needed=_has_elastic)
def elastic_stiffness(s, W, b, v, a, c, S):
    """The columns of `shape_stiffness` that belong to the elastic coordinates."""
    bodies = s.bodies
    f, r, t = bodies.flex[b], bodies.r[b], bodies.v_at[b]
    w, dw, A = vec(v, t + 3), vec(a, t + 3), W.A[b]
    a_minus_g = mtv(A, sub(vec(a, t), vec(bodies.gravity, 0)))
    W.Sa[:r] = 0.0
    contract(bodies.S2[f], W.ydd[b], r, W.line, W.Sa)
    for l in range(r):
        SP, e, S_l = W.SP[b, l], 6 + l, col(bodies.S[f], l)
        place(S, 0, e, c, mv(A, add(cross(dw, S_l), cross(w, cross(w, S_l)))))
        tr = 2.0 * trace(SP, 0)
        Jdw = sub(scale(tr, dw), add(times(SP, dw), transposed_times(SP, dw)))
        Jw = sub(scale(tr, w), add(times(SP, w), transposed_times(SP, w)))
        moment = add(add(cross(S_l, a_minus_g), Jdw), cross(w, Jw))
        moment = sub(moment, dual(W.Sa[l], 0))
        Sd = W.Sd[b, l]
        spin = sub(scale(trace(Sd, 0), w), times(Sd, w))
        place(S, 3, e, c, add(moment, scale(2.0, spin)))
        for k in range(r):
            s2 = bodies.S2[f, l, 9 * k : 9 * k + 9]
            softening = dot(w, times(s2, w)) - dot(w, w) * trace(s2, 0)
            S[6 + k, e] += c * (softening + dot(dw, dual(s2, 0)))


@inner
def body_energy(bodies, W, b, q, v):
    """Kinetic, strain and gravity energy of body b."""
    f, r, at, vt = bodies.flex[b], bodies.r[b], bodies.q_at[b], bodies.v_at[b]
    w, d, A = vec(v, vt + 3), vec(W.d[b], 0), W.A[b]
    u = mtv(A, vec(v, vt))
    momentum = add(scale(0.5 * bodies.mass[b], u), add(cross(w, d), vec(W.dd[b], 0)))
    kinetic = dot(u, momentum) + 0.5 * dot(w, mv(W.J[b], w))
    strain, yd = 0.0, W.yd[b]
    for k in range(r):
        kinetic += yd[k] * dot(w, dual(W.SP[b, k], 0))
        for l in range(r):
            kinetic += 0.5 * yd[k] * yd[l] * bodies.M[f, k, l]
            strain += 0.5 * q[at + 7 + k] * q[at + 7 + l] * bodies.K[f, k, l]
    centre = add(scale(bodies.mass[b], vec(q, at)), mv(A, d))
    return kinetic, strain, -dot(vec(bodies.gravity, 0), centre)
