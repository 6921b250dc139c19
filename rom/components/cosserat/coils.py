"""Coils that touch: the stop of a rod that stands for a helical spring.

On the inner side of the bend the line through the vertices is shorter by the radius of the spring
times the angle between its plates. Where what is left falls below the length of the solid coils,

    gap = sum |x_k+1 - x_k| - radius angle - solid < 0,

a force grows in proportion, along the line and against the angle.
"""

import math
from dataclasses import replace

import numpy as np
from numba import carray

from rom.arguments import not_negative, positive
from rom.components.cosserat.bodies import POSE_SIZE, RodBody, law_of
from rom.components.cosserat.energy import product
from rom.mbs.elements.nonlinear import Elements
from rom.mbs.kernels.algebra import dot, scale, sub, vec
from rom.mbs.kernels.compiled import inner

STRAIGHT_ANGLE = 1e-9  # below which the plates of a spring have no axis of bending [rad]


@inner
def bend_of(pose, last):
    """Angle from the first plate to the last one, and its axis in the axes of both."""
    a, b = pose[3:7], pose[POSE_SIZE * last + 3 : POSE_SIZE * last + 7]
    r = product((a[0], -a[1], -a[2], -a[3]), b)
    sign = 1.0 if r[0] >= 0.0 else -1.0
    turned = (sign * r[1], sign * r[2], sign * r[3])
    sine = math.sqrt(dot(turned, turned))
    angle = 2.0 * math.atan2(sine, sign * r[0])
    if angle < STRAIGHT_ANGLE:
        return angle, (0.0, 0.0, 0.0)
    return angle, scale(1.0 / sine, turned)


@inner
def direction(pose, k):
    """Length of segment k and the direction along it."""
    d = sub(vec(pose, POSE_SIZE * (k + 1)), vec(pose, POSE_SIZE * k))
    length = math.sqrt(dot(d, d))
    return length, scale(1.0 / length, d)


@inner
def add_gradient(pose, frames, arm, axis, factor, out):
    """Add a factor times the gradient of the gap; ``out`` has six rows per frame."""
    for k in range(frames - 2):
        e = direction(pose, k)[1]
        for p in range(3):
            out[6 * k + p] -= factor * e[p]
            out[6 * k + 6 + p] += factor * e[p]
    for p in range(3):
        out[3 + p] += factor * arm * axis[p]
        out[6 * frames - 3 + p] -= factor * arm * axis[p]


@inner
def add_lengths(pose, frames, factor, K):
    """Add a factor times the second derivatives of the lengths of the segments."""
    for k in range(frames - 2):
        length, e = direction(pose, k)
        for p in range(3):
            for q in range(3):
                flat = factor / length * ((1.0 if p == q else 0.0) - e[p] * e[q])
                a, b = 6 * k, 6 * k + 6
                K[a + p, a + q] += flat
                K[b + p, b + q] += flat
                K[a + p, b + q] -= flat
                K[b + p, a + q] -= flat


@inner
def add_bending(frames, angle, axis, factor, K):
    """Add a factor times the derivatives of the axis, on both plates, as they turn.

    A turn phi of the last plate changes the axis n by (c (1 - n n^T) + [n]x / 2) phi, one of the
    first by (-c (1 - n n^T) + [n]x / 2) phi, c = cot(angle / 2) / 2.
    """
    c, last = 0.5 / math.tan(0.5 * angle), 6 * frames - 3
    for p in range(3):
        for q in range(3):
            across = c * ((1.0 if p == q else 0.0) - axis[p] * axis[q])
            spin = 0.0 if p == q else (0.5 if q == (p + 2) % 3 else -0.5) * axis[3 - p - q]
            K[3 + p, last + q] += factor * (across + spin)
            K[3 + p, 3 + q] += factor * (spin - across)
            K[last + p, last + q] -= factor * (across + spin)
            K[last + p, 3 + q] -= factor * (spin - across)


def coils(numbers, pose, wanted, answer, _space):
    """Coils that touch: numbers k frames, radius, solid length, stiffness."""
    given = carray(numbers, (4,))
    frames, arm, stiffness = int(given[0]), given[1], given[3]
    n = 6 * frames
    poses = carray(pose, (POSE_SIZE * frames,))
    result = carray(answer, (2 + n + 2 * n * n,))
    result[: 2 + n + (2 * n * n if wanted else 0)] = 0.0
    angle, axis = bend_of(poses, frames - 1)
    gap = -arm * angle - given[2]
    for k in range(frames - 2):
        gap += direction(poses, k)[0]
    if gap >= 0.0:
        return
    result[0] = 0.5 * stiffness * gap * gap
    gradient = result[2 : 2 + n]
    add_gradient(poses, frames, arm, axis, 1.0, gradient)
    if wanted:
        K = result[2 + n : 2 + n + n * n].reshape((n, n))
        for i in range(n):
            for j in range(n):
                K[i, j] = stiffness * gradient[i] * gradient[j]
        add_lengths(poses, frames, stiffness * gap, K)
        if angle > STRAIGHT_ANGLE:
            add_bending(frames, angle, axis, stiffness * gap * arm, K)
    for i in range(n):
        gradient[i] *= stiffness * gap


def with_coils(body: RodBody, *, radius: float, solid: float, stiffness: float) -> RodBody:
    """The body of the rod of a spring with coils that stop it where they touch.

    The radius [m] is that of the outside, ``solid`` [m] the length when all touch, zero where they
    pass each other, the stiffness [N/m] that of coils that touch.
    """
    n = len(body.frames.x)
    not_negative("solid", solid)
    numbers = np.array([[n, positive("radius", radius), solid, positive("stiffness", stiffness)]])
    stop = Elements.of(law_of(coils), np.arange(n)[None], numbers, by_rate=False)
    return replace(body, elements=(*body.elements, stop))
