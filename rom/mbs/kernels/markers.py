"""Markers: where a body touches the rest of the mechanism, with exact large rotations."""

from rom.mbs.kernels.algebra import (
    add,
    col,
    cross,
    dot,
    mtv,
    mv,
    place,
    row,
    scale,
    spatial_tangent,
    spatial_tangent_rate,
    unit,
    vec,
)
from rom.mbs.kernels.compiled import inner, spliced
from rom.mbs.kernels.second_order import bent_motion, bent_wrench_stiffness

ZERO = (0.0, 0.0, 0.0)


@inner
def elastic_sum(table, x, at, r):
    """Sum of the columns of table (3, R) times x[at:at+r]."""
    a0, a1, a2 = 0.0, 0.0, 0.0
    for k in range(r):
        a0 += table[0, k] * x[at + k]
        a1 += table[1, k] * x[at + k]
        a2 += table[2, k] * x[at + k]
    return a0, a1, a2


@inner
def axes_of(A, theta, E):
    """Write A exp(theta) into E; exp(theta) x = x + T (theta x x) with the spatial tangent T."""
    for j in range(3):
        e = mv(A, add(unit(j), spatial_tangent(theta, cross(theta, unit(j)))))
        E[0, j], E[1, j], E[2, j] = e


@inner
def marker_states(s, W, q, v):
    """Position, axes, twist, convective acceleration and Jacobian of all markers."""
    bodies, markers = s.bodies, s.markers
    for m in range(markers.body.size):
        b = markers.body[m]
        if b < 0:
            for i in range(3):
                W.P[m, i], W.E[m, i, i] = markers.point[m, i], 1.0
            continue
        r, at, vt, A = bodies.r[b], bodies.q_at[b], bodies.v_at[b], W.A[b]
        shape, twist, w = markers.shape[m], markers.twist[m], vec(v, vt + 3)
        u = add(row(markers.point, m, 0), elastic_sum(shape, q, at + 7, r))
        theta, second_order, second_order_angular = elastic_sum(twist, q, at + 7, r), ZERO, ZERO
        if bodies.stiffened[b] == 1:
            second_order, second_order_angular = bent_motion(s, W, m, q, v)
            shape, twist = W.move[m, :3], W.move[m, 3:]
            u = scale(0.5, add(add(u, row(markers.point, m, 0)), elastic_sum(shape, q, at + 7, r)))
            theta = scale(0.5, add(theta, elastic_sum(twist, q, at + 7, r)))
        slip, rate = elastic_sum(shape, v, vt + 6, r), elastic_sum(twist, v, vt + 6, r)
        spin = spatial_tangent(theta, rate)
        convective_angular = add(cross(w, spin), spatial_tangent_rate(theta, rate))
        convective_angular = add(convective_angular, spatial_tangent(theta, second_order_angular))
        convective = add(second_order, cross(w, add(cross(w, u), scale(2.0, slip))))
        write(W.P, m, 0, add(vec(q, at), mv(A, u)))
        write(W.u, m, 0, u)
        write(W.theta, m, 0, theta)
        write(W.V, m, 0, add(vec(v, vt), mv(A, add(cross(w, u), slip))))
        write(W.V, m, 3, mv(A, add(w, spin)))
        write(W.conv, m, 0, mv(A, convective))
        write(W.conv, m, 3, mv(A, convective_angular))
        axes_of(A, theta, W.E[m])
        marker_jacobian(shape, twist, A, u, theta, r, W.H[m])


@inner
def write(A, i, at, x):
    """Write three entries of row i of a matrix from column ``at``."""
    A[i, at], A[i, at + 1], A[i, at + 2] = x


@inner
def marker_jacobian(shape, twist, A, u, theta, r, H):
    """Twist of a marker per unit of each body velocity: H (6, 6 + r)."""
    for j in range(3):
        lever = mv(A, cross(unit(j), u))
        for i in range(3):
            H[i, j] = 1.0 if i == j else 0.0
            H[i, 3 + j] = lever[i]
            H[3 + i, 3 + j] = A[i, j]
    for k in range(r):
        move = mv(A, col(shape, k))
        spin = mv(A, spatial_tangent(theta, col(twist, k)))
        for i in range(3):
            H[i, 6 + k] = move[i]
            H[3 + i, 6 + k] = spin[i]


@inner
def spread_wrench(s, W, sign, out):
    """Add sign H^T wrench of all markers to the generalised forces ``out``."""
    bodies, markers = s.bodies, s.markers
    for m in range(markers.body.size):
        b = markers.body[m]
        if b < 0:
            continue
        H, t, w = W.H[m], bodies.v_at[b], W.wrench[m]
        for j in range(6 + bodies.r[b]):
            total = 0.0
            for i in range(6):
                total += H[i, j] * w[i]
            out[t + j] += sign * total


@spliced
def own_block(s, b, S):
    """The block of body b with itself in S, as a view."""
    e, w = s.graph.own[b], 6 + s.bodies.r[b]
    x, y = s.graph.x[e], s.graph.y[e]
    return S[x : x + w, y : y + w]


@inner
def own_corner(s, b):
    """Row and column at which this block begins, which compiles faster than the view."""
    e = s.graph.own[b]
    return s.graph.x[e], s.graph.y[e]


@inner
def wrench_stiffness(s, W, c, S):
    """Add c times the derivative of -H^T wrench to S, the wrench kept constant in the world.

    The change of the tangent operator of an elastically rotating marker is kept to first order.
    """
    bodies, markers = s.bodies, s.markers
    for m in range(markers.body.size):
        b = markers.body[m]
        if b < 0:
            continue
        r, A, block = bodies.r[b], W.A[b], own_block(s, b, S)
        f, n = mtv(A, vec(W.wrench[m], 0)), mtv(A, vec(W.wrench[m], 3))
        u, theta = vec(W.u[m], 0), vec(W.theta[m], 0)
        shape, twist = markers.shape[m], markers.twist[m]
        if bodies.stiffened[b] == 1:
            shape, twist = W.move[m, :3], W.move[m, 3:]
            bent_wrench_stiffness(s, W, m, f, n, c, block)
        for j in range(3):
            e = unit(j)
            df, dn = cross(f, e), cross(n, e)
            place(block, 3, 3 + j, -c, add(cross(u, df), dn))
            for k in range(r):
                spin = spatial_tangent(theta, col(twist, k))
                block[6 + k, 3 + j] -= c * (dot(col(shape, k), df) + dot(spin, dn))
        for l in range(r):
            place(block, 3, 6 + l, -c, cross(col(shape, l), f))
            half = scale(0.5, cross(n, col(twist, l)))
            for k in range(r):
                block[6 + k, 6 + l] -= c * dot(col(twist, k), half)
