"""Energy of a discrete Cosserat rod, its exact gradient and tangent, assembled into a band.

Positions x_0 ... x_N sit at the vertices, unit quaternions on the N segments between them and on a
rigid plate at each end. A segment stretches and shears, a vertex bends and twists::

    a = R^T (x_n+1 - x_n) / h            U = 1/2 h (a - a0)^T C (a - a0)
    r = conj(p_a o s) o (p_b o conj(s))  U = 1/2 l k^T B k,   k = 2 Im(r) / l

where s o s is the rotation between the neighbours in the reference: k vanishes there whatever the
corner. Increments turn in the frame of the section, p <- p o exp(phi). The unknowns are ordered
along the rod, plate, x_0, segment, x_1, ..., x_N, plate, three numbers each, so that a row of the
tangent reaches `HALF_BANDWIDTH` columns to either side.

Source:
    After Lang, Linn, Arnold, Multi-body dynamics simulation of geometrically exact Cosserat rods,
    Multibody Syst. Dyn. 25 (2011) 285; the reference rotation at the vertices is ours.
"""

from typing import NamedTuple

import numpy as np

from rom.mbs.kernels.algebra import rotation
from rom.mbs.kernels.compiled import inner, kernel
from rom.model import Array

HALF_BANDWIDTH = 8  # columns on either side of the diagonal
BAND_WIDTH = 2 * HALF_BANDWIDTH + 1


class Rod(NamedTuple):
    """A rod of N segments; what does not change.

    Attributes:
        h: (N,) lengths of the segments [m].
        stretch: (N, 3) shear rigidities and axial rigidity GA1, GA2, EA [N].
        a0: (N, 3) reference of the vector of stretch and shear [1].
        l: (N + 1,) lengths that bend at the vertices, half a segment at an end [m].
        bend: (N + 1, 3) bending rigidities and torsional rigidity EI1, EI2, GJ [N m^2].
        s: (N + 1, 4) square root of the reference rotation between neighbours, quaternions [1].
        S: (N + 1, 3, 3) the same as matrices [1].
        mass: (N + 1,) at the vertices [kg].
        inertia: (N + 2, 3) of plate, segments, plate, about their own axes [kg m^2].
        viscous_stretch, viscous_bend: (N, 3), (N + 1, 3) like stretch, bend, per rate of strain [N
            s], [N m^2 s].
        x: (N + 1, 3) reference positions [m].
        p: (N + 2, 4) reference quaternions of plate, segments, plate [1].
    """

    h: Array
    stretch: Array
    a0: Array
    l: Array
    bend: Array
    s: Array
    S: Array
    mass: Array
    inertia: Array
    viscous_stretch: Array
    viscous_bend: Array
    x: Array
    p: Array


class Work(NamedTuple):
    """Memory of the assembly; all but the last two are of one element."""

    R: Array  # rotation
    D: Array  # gradient of the strain
    H: Array  # matrix
    a: Array  # strain
    f: Array  # force
    e: Array  # quaternion
    r: Array  # (n,) forces out of balance, n = 6 N + 9
    A: Array  # (n, BAND_WIDTH) band of the tangent, A[i, j - i + HALF_BANDWIDTH]


def work(rod: Rod) -> Work:
    """Memory for a rod."""
    n = 6 * rod.h.size + 9
    shapes = ((3, 3), (3, 9), (9, 9), (3,), (3,), (4,), (n,), (n, BAND_WIDTH))
    return Work(*(np.zeros(shape) for shape in shapes))


@inner
def product(p, q):
    """Components of the quaternion p o q."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + q[0] * p[1] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] + q[0] * p[2] + p[3] * q[1] - p[1] * q[3],
        p[0] * q[3] + q[0] * p[3] + p[1] * q[2] - p[2] * q[1],
    )


@inner
def add_cross(A, row, column, factor, a):
    """Add factor [a]x to a 3 x 3 block."""
    A[row, column + 1] -= factor * a[2]
    A[row, column + 2] += factor * a[1]
    A[row + 1, column] += factor * a[2]
    A[row + 1, column + 2] -= factor * a[0]
    A[row + 2, column] -= factor * a[1]
    A[row + 2, column + 1] += factor * a[0]


@inner
def add_turning(A, row, factor, a):
    """Add factor [a]x to the diagonal block of a band that starts at a row."""
    for k in range(3):
        c, d = (k + 1) % 3, (k + 2) % 3
        A[row + c, d - c + HALF_BANDWIDTH] -= factor * a[k]
        A[row + d, c - d + HALF_BANDWIDTH] += factor * a[k]


@inner
def stretched(h, C, a0, start, end, p, W):
    """Set a, the force C (a - a0) and the gradient D of a by start, rotation and end."""
    rotation(p, 0, W.R)
    W.D[:] = 0.0
    for i in range(3):
        W.a[i] = 0.0
        for j in range(3):
            W.a[i] += W.R[j, i] * (end[j] - start[j]) / h
            W.D[i, j], W.D[i, 6 + j] = -W.R[j, i] / h, W.R[j, i] / h
        W.f[i] = C[i] * (W.a[i] - a0[i])
    add_cross(W.D, 0, 3, 1.0, W.a)


@inner
def stretch_geometry(h, W):
    """Set H to the second derivatives of a, times the force, times h."""
    n, a = W.f, W.a
    W.H[:] = 0.0
    dot = n[0] * a[0] + n[1] * a[1] + n[2] * a[2]
    for i in range(3):
        for j in range(3):
            W.H[3 + i, 3 + j] = 0.5 * h * (n[i] * a[j] + a[i] * n[j])
        W.H[3 + i, 3 + i] -= h * dot
        R = W.R[i]
        for j, value in enumerate(
            (R[1] * n[2] - R[2] * n[1], R[2] * n[0] - R[0] * n[2], R[0] * n[1] - R[1] * n[0])
        ):  # - R [n]x
            W.H[6 + i, 3 + j] = W.H[3 + j, 6 + i] = -value
            W.H[i, 3 + j] = W.H[3 + j, i] = value


@inner
def curved(l, B, s, S, p, q, W):
    """Set a = k, the moment B k and the gradient D of k by the rotations p and q beside it."""
    conjugate = (s[0], -s[1], -s[2], -s[3])
    before, after = product(p, s), product(q, conjugate)
    r = product((before[0], -before[1], -before[2], -before[3]), after)
    sign = 1.0 if r[0] >= 0.0 else -1.0  # both quaternions mean the same rotation
    for k in range(4):
        W.e[k] = sign * r[k]
    for k in range(3):
        W.a[k] = 2 * W.e[1 + k] / l
        W.f[k] = B[k] * W.a[k]
    W.R[:] = 0.0
    add_cross(W.R, 0, 0, 1.0, W.e[1:])
    W.D[:] = 0.0
    for k in range(3):
        for j in range(3):
            for m in range(3):
                unit = W.e[0] if k == m else 0.0
                W.D[k, j] -= (unit - W.R[k, m]) * S[j, m] / l
                W.D[k, 6 + j] += (unit + W.R[k, m]) * S[m, j] / l


@inner
def curvature_geometry(S, W):
    """Set H to the second derivatives of k, times the moment, times l."""
    m, r = W.f, W.e
    dot = m[0] * r[1] + m[1] * r[2] + m[2] * r[3]
    W.R[:] = 0.0
    add_cross(W.R, 0, 0, 0.5 * r[0], m)
    for k in range(3):
        for j in range(3):
            W.R[k, j] += 0.5 * (r[1 + k] * m[j] + m[k] * r[1 + j])
        W.R[k, k] -= 0.5 * dot
    W.H[:] = 0.0
    for k in range(3):
        W.H[k, k] = W.H[6 + k, 6 + k] = -0.5 * dot
        for j in range(3):
            for c in range(3):
                for d in range(3):
                    W.H[k, 6 + j] += S[k, c] * W.R[c, d] * S[d, j]
            W.H[6 + j, k] = W.H[k, 6 + j]


@inner
def add_element(W, C, viscous, weight, at, v):
    """Add force and tangent of one element, whose nine dofs start at ``at``."""
    for k in range(3):
        for c in range(9):
            W.f[k] += viscous[k] * W.D[k, c] * v[at + c]
    for c in range(9):
        for k in range(3):
            W.r[at + c] += weight * W.D[k, c] * W.f[k]
    for c in range(9):
        for d in range(9):
            total = W.H[c, d]
            for k in range(3):
                total += weight * C[k] * W.D[k, c] * W.D[k, d]
            W.A[at + c, d - c + HALF_BANDWIDTH] += total


@kernel
def internal(rod, x, p, v, W):
    """Set the internal forces W.r, viscous ones by velocities v, and the band W.A of elastic ones.

    The tangent is the exact derivative of the elastic forces.
    """
    W.r[:] = 0.0
    W.A[:] = 0.0
    for n in range(rod.h.size):
        stretched(rod.h[n], rod.stretch[n], rod.a0[n], x[n], x[n + 1], p[n + 1], W)
        stretch_geometry(rod.h[n], W)
        at = 6 * n + 3
        add_element(W, rod.stretch[n], rod.viscous_stretch[n], rod.h[n], at, v)
    for i in range(rod.l.size):
        curved(rod.l[i], rod.bend[i], rod.s[i], rod.S[i], p[i], p[i + 1], W)
        curvature_geometry(rod.S[i], W)
        add_element(W, rod.bend[i], rod.viscous_bend[i], rod.l[i], 6 * i, v)
    for k in range(rod.h.size + 2):  # the gradient turns with the section
        add_turning(W.A, 6 * k, 0.5, W.r[6 * k : 6 * k + 3])


@kernel
def strains(rod, x, p, W, a, k):
    """Set stretch and shear a - a0 of all segments and bending k of all vertices."""
    for n in range(rod.h.size):
        stretched(rod.h[n], rod.stretch[n], rod.a0[n], x[n], x[n + 1], p[n + 1], W)
        for c in range(3):
            a[n, c] = W.a[c] - rod.a0[n, c]
    for i in range(rod.l.size):
        curved(rod.l[i], rod.bend[i], rod.s[i], rod.S[i], p[i], p[i + 1], W)
        for c in range(3):
            k[i, c] = W.a[c]
