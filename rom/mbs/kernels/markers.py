"""Markers: where a body touches the rest of the mechanism, with exact large rotations."""

import math

from numba import types

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
    sub,
    unit,
    vec,
)
from rom.mbs.kernels.compiled import inner, spliced
from rom.mbs.kernels.second_order import OF_BODY, REAL_3, bent_motion, bent_wrench_stiffness
from rom.mbs.kernels.stages import REAL_BLOCK, REAL_VECTOR, stage
from rom.mbs.kernels.system import System
from rom.mbs.kernels.work import Work

ZERO = (0.0, 0.0, 0.0)
MAX_POLAR_STEPS = 12  # they converge by squares: six are usual
POLAR_ATOL = 1e-14  # of the squares of the singular values from one


def has_fitted(system):
    """Whether the axes of a marker are fitted to a surface."""
    return system.markers.covariance.shape[0] > 0


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
        if markers.fit[m] >= 0:
            theta, second_order_angular = ZERO, fitted_motion(s, W, m, q, v)
            twist = W.move[m, 3:]
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
        if markers.fit[m] < 0:
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
        if markers.fit[m] >= 0:
            twist = W.move[m, 3:]
            fitted_wrench_stiffness(s, W, m, n, c, block)
        for j in range(3):
            e = unit(j)
            df, dn = cross(f, e), cross(n, e)
            place(block, 3, 3 + j, -c, add(cross(u, df), dn))
            for k in range(r):
                spin = spatial_tangent(theta, col(twist, k))
                block[6 + k, 3 + j] -= c * (dot(col(shape, k), df) + dot(spin, dn))
        for l in range(r):
            place(block, 3, 6 + l, -c, cross(col(shape, l), f))
            if markers.fit[m] >= 0:
                continue
            half = scale(0.5, cross(n, col(twist, l)))
            for k in range(r):
                block[6 + k, 6 + l] -= c * dot(col(twist, k), half)


@inner
def matrix_sum(table, x, at, r):
    """Rows of the sum of the matrices in the columns of table (9, R), times x[at:at+r]."""
    return (
        elastic_sum(table[0:3], x, at, r),
        elastic_sum(table[3:6], x, at, r),
        elastic_sum(table[6:9], x, at, r),
    )


@inner
def times_transposed(rows, R):
    """Rows of the product of a matrix with the transpose of R, which is given by rows as well."""
    return (
        (dot(rows[0], R[0]), dot(rows[0], R[1]), dot(rows[0], R[2])),
        (dot(rows[1], R[0]), dot(rows[1], R[1]), dot(rows[1], R[2])),
        (dot(rows[2], R[0]), dot(rows[2], R[1]), dot(rows[2], R[2])),
    )


@inner
def double_axial(X):
    """Twice the axial vector of the skew part of a matrix of rows X."""
    return X[2][1] - X[1][2], X[0][2] - X[2][0], X[1][0] - X[0][1]


@inner
def spun(w, X):
    """Rows of -X skew(w)."""
    return cross(w, X[0]), cross(w, X[1]), cross(w, X[2])


@inner
def rows_dot(X, y):
    """Product of a matrix of rows X with y."""
    return dot(X[0], y), dot(X[1], y), dot(X[2], y)


@inner
def sum_of_traces(P):
    """Rows of the inverse of tr(P) 1 - P for a symmetric P: of rotation in a stretched surface."""
    t = P[0][0] + P[1][1] + P[2][2]
    a, b, c = sub((t, 0.0, 0.0), P[0]), sub((0.0, t, 0.0), P[1]), sub((0.0, 0.0, t), P[2])
    x, y, z = cross(b, c), cross(c, a), cross(a, b)
    f = 1.0 / dot(a, x)
    return scale(f, x), scale(f, y), scale(f, z)


@inner
def nearest_rotation(x0, x1, x2):
    """Rows of the rotation R nearest to a matrix of rows x, its polar factor: R^T x is symmetric.

    What lies in a plane has no extent across it, and a mirror image is as near as a rotation; the
    normal of the plane decides. The iterates have no singular value below one.

    Source:
        Higham, Computing the polar decomposition with applications, SIAM J. Sci. Stat. Comput. 7
        (1986) 1160.
    """
    s = 1.0 / math.sqrt(dot(x0, x0) + dot(x1, x1) + dot(x2, x2))
    n0, n1, n2 = cross(x1, x2), cross(x2, x0), cross(x0, x1)
    x0, x1, x2 = add(x0, scale(s, n0)), add(x1, scale(s, n1)), add(x2, scale(s, n2))
    for _ in range(MAX_POLAR_STEPS):
        n0, n1, n2 = cross(x1, x2), cross(x2, x0), cross(x0, x1)
        f = 1.0 / dot(x0, n0)
        size, other = dot(x0, x0) + dot(x1, x1) + dot(x2, x2), dot(n0, n0) + dot(n1, n1)
        g = math.sqrt(math.sqrt((other + dot(n2, n2)) / size) * abs(f))
        c, f = 0.5 * g, 0.5 * f / g
        x0 = add(scale(c, x0), scale(f, n0))
        x1 = add(scale(c, x1), scale(f, n1))
        x2 = add(scale(c, x2), scale(f, n2))
        if dot(x0, x0) + dot(x1, x1) + dot(x2, x2) < 3.0 + POLAR_ATOL:
            break
    return x0, x1, x2


@inner
def surface_stretch(table, y, at, r):
    """Rotation nearest to the covariance, the stretch beside it and `sum_of_traces` of that."""
    B = matrix_sum(table[:, 1:], y, at, r)
    B = (
        add((table[0, 0], table[1, 0], table[2, 0]), B[0]),
        add((table[3, 0], table[4, 0], table[5, 0]), B[1]),
        add((table[6, 0], table[7, 0], table[8, 0]), B[2]),
    )
    R = nearest_rotation(B[0], B[1], B[2])
    P = times_transposed(B, R)
    return R, P, sum_of_traces(P)


@stage(REAL_3, System, Work, types.int64, REAL_VECTOR, REAL_VECTOR, needed=has_fitted)
def fitted_motion(s, W, m, q, v):
    """Set the axes of a fitted marker, and W.move to what elastic rates turn it by.

    The covariance B = P R, P = P^T, gives (tr(P) - P) w = axial(B' R^T - R B'^T) for the angular
    velocity w in the body frame. Its rate at constant elastic rates is the answer.
    """
    b, table = s.markers.body[m], s.markers.covariance[s.markers.fit[m]]
    at, t, r, A, E = s.bodies.q_at[b] + 7, s.bodies.v_at[b] + 6, s.bodies.r[b], W.A[b], W.E[m]
    R, P, inverse = surface_stretch(table, q, at, r)
    for j in range(3):
        e = mv(A, (R[0][j], R[1][j], R[2][j]))
        E[0, j], E[1, j], E[2, j] = e
    for k in range(r):
        w = rows_dot(inverse, double_axial(times_transposed(column_matrix(table, 1 + k), R)))
        W.move[m, 3, k], W.move[m, 4, k], W.move[m, 5, k] = w
    C = times_transposed(matrix_sum(table[:, 1:], v, t, r), R)
    w = rows_dot(inverse, double_axial(C))
    return rows_dot(inverse, add(double_axial(spun(w, C)), spread_rate(C, P, w, w)))


@inner
def spread_rate(C, P, w, x):
    """Rate of P - tr(P) 1, times x, while the surface turns by w."""
    still = spun(w, P)
    rate = (add(C[0], still[0]), add(C[1], still[1]), add(C[2], still[2]))
    return sub(rows_dot(rate, x), scale(rate[0][0] + rate[1][1] + rate[2][2], x))


@inner
def column_matrix(table, k):
    """Rows of the matrix in column k of table (9, R)."""
    return col(table[0:3], k), col(table[3:6], k), col(table[6:9], k)


@stage(*OF_BODY, REAL_3, types.float64, REAL_BLOCK, needed=has_fitted)
def fitted_wrench_stiffness(s, W, m, n, c, S):
    """Stiffness that the moment n on a fitted marker gives to its body, in its block S."""
    b, table, spins = s.markers.body[m], s.markers.covariance[s.markers.fit[m]], W.move[m, 3:]
    r = s.bodies.r[b]
    R, P, inverse = surface_stretch(table, W.y[b], 0, r)
    x = rows_dot(inverse, n)
    for k in range(r):
        C, w = times_transposed(column_matrix(table, 1 + k), R), col(spins, k)
        X, Y = sub(scale(x[2], C[1]), scale(x[1], C[2])), sub(scale(x[0], C[2]), scale(x[2], C[0]))
        first = double_axial((X, Y, sub(scale(x[1], C[0]), scale(x[0], C[1]))))
        second = spread_rate(C, P, w, x)
        for l in range(r):
            u = col(spins, l)
            S[6 + k, 6 + l] -= c * dot(first, u)
            S[6 + l, 6 + k] -= c * dot(second, u)
