"""Compiled algebra of 3-vectors (tuples of three numbers), rotations and dense systems.

Integrals S(U, V) of rho U V^T are nine numbers in a row.
"""

import math

from rom.mbs.kernels.compiled import inner

PANEL_WIDTH = 8  # columns of a matrix eliminated together


@inner
def vec(x, at):
    """Three entries of a vector from position ``at``."""
    return x[at], x[at + 1], x[at + 2]


@inner
def col(A, j):
    """Column j of a (3, m) array."""
    return A[0, j], A[1, j], A[2, j]


@inner
def row(A, i, at):
    """Three entries of row i of a matrix from column ``at``."""
    return A[i, at], A[i, at + 1], A[i, at + 2]


@inner
def add(a, b):
    """Sum a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inner
def sub(a, b):
    """Difference a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inner
def scale(s, a):
    """Multiple s a."""
    return s * a[0], s * a[1], s * a[2]


@inner
def dot(a, b):
    """Scalar product a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def cross(a, b):
    """Vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inner
def mv(A, x):
    """Product A x of a (3, 3) array."""
    return (
        A[0, 0] * x[0] + A[0, 1] * x[1] + A[0, 2] * x[2],
        A[1, 0] * x[0] + A[1, 1] * x[1] + A[1, 2] * x[2],
        A[2, 0] * x[0] + A[2, 1] * x[1] + A[2, 2] * x[2],
    )


@inner
def turn(E, i, x):
    """Product E[i] x of a (k, 3, 3) array."""
    return (
        E[i, 0, 0] * x[0] + E[i, 0, 1] * x[1] + E[i, 0, 2] * x[2],
        E[i, 1, 0] * x[0] + E[i, 1, 1] * x[1] + E[i, 1, 2] * x[2],
        E[i, 2, 0] * x[0] + E[i, 2, 1] * x[1] + E[i, 2, 2] * x[2],
    )


@inner
def mtv(A, x):
    """Product A^T x of a (3, 3) array."""
    return (
        A[0, 0] * x[0] + A[1, 0] * x[1] + A[2, 0] * x[2],
        A[0, 1] * x[0] + A[1, 1] * x[1] + A[2, 1] * x[2],
        A[0, 2] * x[0] + A[1, 2] * x[1] + A[2, 2] * x[2],
    )


@inner
def put(x, at, a):
    """Add a to three entries of a vector."""
    x[at] += a[0]
    x[at + 1] += a[1]
    x[at + 2] += a[2]


@inner
def place(A, i, j, s, a):
    """Add s a to a column of a matrix: rows i to i + 2 of column j."""
    A[i, j] += s * a[0]
    A[i + 1, j] += s * a[1]
    A[i + 2, j] += s * a[2]


@inner
def place_row(A, i, j, s, a):
    """Add s a to a row of a matrix: columns j to j + 2 of row i."""
    A[i, j] += s * a[0]
    A[i, j + 1] += s * a[1]
    A[i, j + 2] += s * a[2]


@inner
def unit(j):
    """Unit vector j."""
    return 1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0


@inner
def unit_twist(p):
    """Velocities and angular velocities of two markers in unit motion p of twelve."""
    zero, x = (0.0, 0.0, 0.0), unit(p % 3)
    if p < 3:
        return x, zero, zero, zero
    if p < 6:
        return zero, x, zero, zero
    return (zero, zero, x, zero) if p < 9 else (zero, zero, zero, x)


@inner
def rotation(q, at, A):
    """Write the matrix of the quaternion q[at:at+4], scaled to unit length, into A."""
    e0, e1, e2, e3 = q[at], q[at + 1], q[at + 2], q[at + 3]
    s = 2.0 / (e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3)
    A[0, 0], A[1, 1], A[2, 2] = (
        1 - s * (e2 * e2 + e3 * e3),
        1 - s * (e1 * e1 + e3 * e3),
        1 - s * (e1 * e1 + e2 * e2),
    )
    A[0, 1], A[1, 0] = s * (e1 * e2 - e0 * e3), s * (e1 * e2 + e0 * e3)
    A[0, 2], A[2, 0] = s * (e1 * e3 + e0 * e2), s * (e1 * e3 - e0 * e2)
    A[1, 2], A[2, 1] = s * (e2 * e3 - e0 * e1), s * (e2 * e3 + e0 * e1)


@inner
def half_turn(theta):
    """Quaternion of exp(theta): its scalar and its vector."""
    angle = math.sqrt(dot(theta, theta))
    half = 0.5 * angle
    s = math.sin(half) / angle if angle > 1e-4 else 0.5 - angle * angle / 48
    return math.cos(half), scale(s, theta)


@inner
def turned(q, at, theta, out):
    """Write q[at:at+4] o exp(theta), of unit length, into out[at:at+4]."""
    f0, (f1, f2, f3) = half_turn(theta)
    e0, e1, e2, e3 = q[at], q[at + 1], q[at + 2], q[at + 3]
    p0 = e0 * f0 - e1 * f1 - e2 * f2 - e3 * f3
    p1 = e0 * f1 + e1 * f0 + e2 * f3 - e3 * f2
    p2 = e0 * f2 - e1 * f3 + e2 * f0 + e3 * f1
    p3 = e0 * f3 + e1 * f2 - e2 * f1 + e3 * f0
    n = 1.0 / math.sqrt(p0 * p0 + p1 * p1 + p2 * p2 + p3 * p3)
    out[at], out[at + 1], out[at + 2], out[at + 3] = p0 * n, p1 * n, p2 * n, p3 * n


@inner
def tangent_coefficients(x):
    """Coefficients c1, c2 of the tangent operator of SO(3) for x = angle^2, and c1'/a, c2'/a.

    c1 = (1 - cos a) / a^2, c2 = (a - sin a) / a^3; power series where the quotients cancel.
    """
    if x < 0.05:
        c1 = 1 / 2 - x * (1 / 24 - x * (1 / 720 - x * (1 / 40320 - x / 3628800)))
        c2 = 1 / 6 - x * (1 / 120 - x * (1 / 5040 - x * (1 / 362880 - x / 39916800)))
        d1 = -2 * (1 / 24 - x * (2 / 720 - x * (3 / 40320 - x * 4 / 3628800)))
        d2 = -2 * (1 / 120 - x * (2 / 5040 - x * (3 / 362880 - x * 4 / 39916800)))
        return c1, c2, d1, d2
    a = math.sqrt(x)
    c1, c2 = (1 - math.cos(a)) / x, (a - math.sin(a)) / (a * x)
    return c1, c2, (math.sin(a) / a - 2 * c1) / x, (c1 - 3 * c2) / x


@inner
def spatial_tangent(theta, x):
    """Angular velocity of exp(theta) seen from its base, for the rate x of theta."""
    c1, c2, _, _ = tangent_coefficients(dot(theta, theta))
    once = cross(theta, x)
    return add(x, add(scale(c1, once), scale(c2, cross(theta, once))))


@inner
def spatial_tangent_rate(theta, x):
    """Rate of `spatial_tangent` applied to the constant x while theta moves with rate x."""
    _, c2, d1, d2 = tangent_coefficients(dot(theta, theta))
    once, along = cross(theta, x), dot(theta, x)
    curved = add(scale(d1 * along, once), scale(d2 * along, cross(theta, once)))
    return add(curved, scale(c2, cross(x, once)))


@inner
def factorise(A, n, pivot):
    """LU factors in place of the leading (n, n) block; False when a pivot vanishes.

    Column by column inside a panel; what a panel does to the rows below is subtracted at once, so
    that an entry is fetched once for eight of its terms. Rows without an entry in the pivot columns
    are left alone: joints couple few bodies.

    Source:
        Golub and Van Loan, Matrix Computations, 4th ed. 2013, sec. 3.4 (partial pivoting) and
        3.2.11 (blocks).
    """
    for first in range(0, n, PANEL_WIDTH):
        last = min(first + PANEL_WIDTH, n)
        for k in range(first, last):
            p = largest_below(A, k, n)
            pivot[k] = p
            if not abs(A[p, k]) > 1e-300:
                return False
            if p != k:
                for j in range(n):
                    A[k, j], A[p, j] = A[p, j], A[k, j]
            eliminate_column(A, k, n, last)
        for k in range(first, last):
            for i in range(k + 1, last):
                if A[i, k] != 0.0:
                    subtract_row(A[i, k], A, i, k, last, n)
        for i in range(last, n, 2):
            eliminate_pair(A, i, min(i + 1, n - 1), first, n)
    return True


@inner
def largest_below(A, k, n):
    """Row of the largest entry of column k from the diagonal on."""
    best, p = abs(A[k, k]), k
    for i in range(k + 1, n):
        if abs(A[i, k]) > best:
            best, p = abs(A[i, k]), i
    return p


@inner
def eliminate_column(A, k, n, last):
    """Eliminate column k from the rows below, in the columns before ``last``."""
    inverse = 1.0 / A[k, k]
    for i in range(k + 1, n):
        if A[i, k] != 0.0:
            A[i, k] *= inverse
            subtract_row(A[i, k], A, i, k, k + 1, last)


@inner
def subtract_row(f, A, i, k, first, last):
    """Subtract f times row k from row i, in columns first to last."""
    for j in range(first, last):
        A[i, j] -= f * A[k, j]


@inner
def eliminate_pair(A, i, p, k, n):
    """Subtract from rows i and p the eight rows from k on, behind their columns.

    Two rows share what is fetched of the eight; p may be i.
    """
    a0, a1, a2, a3 = A[i, k], A[i, k + 1], A[i, k + 2], A[i, k + 3]
    a4, a5, a6, a7 = A[i, k + 4], A[i, k + 5], A[i, k + 6], A[i, k + 7]
    b0, b1, b2, b3 = A[p, k], A[p, k + 1], A[p, k + 2], A[p, k + 3]
    b4, b5, b6, b7 = A[p, k + 4], A[p, k + 5], A[p, k + 6], A[p, k + 7]
    none = True
    for j in range(k, k + PANEL_WIDTH):
        none = none and A[i, j] == 0.0 and A[p, j] == 0.0
    if none:
        return
    for j in range(k + PANEL_WIDTH, n):
        u0, u1, u2, u3 = A[k, j], A[k + 1, j], A[k + 2, j], A[k + 3, j]
        u4, u5, u6, u7 = A[k + 4, j], A[k + 5, j], A[k + 6, j], A[k + 7, j]
        x, y = A[i, j], A[p, j]
        A[i, j] = x - (
            a0 * u0 + a1 * u1 + a2 * u2 + a3 * u3 + (a4 * u4 + a5 * u5 + a6 * u6 + a7 * u7)
        )
        A[p, j] = y - (
            b0 * u0 + b1 * u1 + b2 * u2 + b3 * u3 + (b4 * u4 + b5 * u5 + b6 * u6 + b7 * u7)
        )


@inner
def back_substitute(A, n, pivot, x):
    """Solve in place with the factors of `factorise`."""
    for k in range(n):
        p = pivot[k]
        if p != k:
            x[k], x[p] = x[p], x[k]
    for i in range(n):
        s = x[i]
        for j in range(i):
            s -= A[i, j] * x[j]
        x[i] = s
    for i in range(n - 1, -1, -1):
        s = x[i]
        for j in range(i + 1, n):
            s -= A[i, j] * x[j]
        x[i] = s / A[i, i]


@inner
def range_basis(G, rank, remainder, U):
    """Orthonormal basis of the range of G (m, n), written to the rows of U (rank, m).

    Columns of G are taken in the order of what is left of them, and cleaned twice. ``remainder``
    (n, m) is working memory.
    """
    m, n = G.shape
    best, p = -1.0, 0
    for j in range(n):
        size = 0.0
        for i in range(m):
            remainder[j, i] = G[i, j]
            size += G[i, j] * G[i, j]
        if size > best:
            best, p = size, j
    for k in range(rank):
        for i in range(m):
            U[k, i] = remainder[p, i]
        clean(U, k)
        best, p = -1.0, 0
        for j in range(n):
            s, size = 0.0, 0.0
            for i in range(m):
                s += U[k, i] * remainder[j, i]
            for i in range(m):
                x = remainder[j, i] - s * U[k, i]
                remainder[j, i] = x
                size += x * x
            if size > best:
                best, p = size, j


@inner
def clean(U, k):
    """Make row k of U orthogonal to the rows before it and of unit length."""
    m = U.shape[1]
    for j in range(k):
        s = 0.0
        for i in range(m):
            s += U[j, i] * U[k, i]
        for i in range(m):
            U[k, i] -= s * U[j, i]
    s = 0.0
    for i in range(m):
        s += U[k, i] * U[k, i]
    s = 1.0 / math.sqrt(s)
    for i in range(m):
        U[k, i] *= s


@inner
def inverse_coefficient(x):
    """Coefficient c of the inverse tangent operator 1 - skew / 2 + c skew^2, and its derivative.

    x = angle^2, c = (1 - (a / 2) cot(a / 2)) / a^2; power series where the quotients cancel.
    """
    if x < 0.05:
        c = 1 / 12 + x * (1 / 720 + x * (1 / 30240 + x * (1 / 1209600 + x / 47900160)))
        return c, 1 / 720 + x * (2 / 30240 + x * (3 / 1209600 + x * 4 / 47900160))
    a = math.sqrt(x)
    s, t = math.sin(0.5 * a), math.cos(0.5 * a)
    c = (1.0 - 0.5 * a * t / s) / x
    return c, (0.125 * (1.0 / (s * s) - 2.0 * t / (a * s)) - c) / x


@inner
def inverse_tangent(theta, sign, x):
    """Inverse of the spatial tangent operator of exp(theta) times x; transposed for sign = -1."""
    c, _ = inverse_coefficient(dot(theta, theta))
    once = cross(theta, x)
    return add(x, add(scale(-0.5 * sign, once), scale(c, cross(theta, once))))


@inner
def transposed_rate(theta, d, x):
    """Change of the transposed inverse times x while theta changes by d."""
    c, dc = inverse_coefficient(dot(theta, theta))
    once = cross(theta, x)
    both = add(cross(d, once), cross(theta, cross(d, x)))
    along = scale(2.0 * dc * dot(theta, d), cross(theta, once))
    return add(add(scale(0.5, cross(d, x)), scale(c, both)), along)


@inner
def dual(s, at):
    """Integral of rho U x V from the nine entries of S(U, V)."""
    return s[at + 5] - s[at + 7], s[at + 6] - s[at + 2], s[at + 1] - s[at + 3]


@inner
def trace(s, at):
    """Trace of nine entries."""
    return s[at] + s[at + 4] + s[at + 8]


@inner
def times(s, x):
    """Nine entries, as a matrix, times x."""
    return (
        s[0] * x[0] + s[1] * x[1] + s[2] * x[2],
        s[3] * x[0] + s[4] * x[1] + s[5] * x[2],
        s[6] * x[0] + s[7] * x[1] + s[8] * x[2],
    )


@inner
def transposed_times(s, x):
    """Nine entries, as a matrix, transposed, times x."""
    return (
        s[0] * x[0] + s[3] * x[1] + s[6] * x[2],
        s[1] * x[0] + s[4] * x[1] + s[7] * x[2],
        s[2] * x[0] + s[5] * x[1] + s[8] * x[2],
    )


@inner
def add_multiple(factor, x, n, out):
    """Add a multiple of the first n numbers of x to those of out: one loop, for vector units."""
    for j in range(n):
        out[j] += factor * x[j]


@inner
def contract(S2, x, r, line, out):
    """Add S(x, phi_k) for x = sum x_l phi_l to the rows of out; ``line`` is working memory."""
    n = 9 * r
    for j in range(n):
        line[j] = 0.0
    for l in range(r):
        add_multiple(x[l], S2[l], n, line)
    for k in range(r):
        for p in range(9):
            out[k, p] += line[9 * k + p]
