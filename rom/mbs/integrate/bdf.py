"""Backward differentiation of any order up to five, with rotations in a chart of the last instant.

Over a step, the instants before it are vectors as seen from the last one: differences of positions
and elastic coordinates, rotation vectors. There the formula is that of vector spaces, so that it
keeps its order whatever the rotation.

Source:
    Hairer and Wanner, Solving Ordinary Differential Equations II, chapters V.1 and VII.2; charts
    on groups as in Munthe-Kaas, Appl. Numer. Math. 29 (1999) 115.
"""

import math
from math import comb

import numpy as np
from numba import types

from rom.mbs.kernels.algebra import add, cross, dot, half_turn, scale, spatial_tangent, sub, vec
from rom.mbs.kernels.compiled import copy, inner
from rom.mbs.kernels.stages import stage
from rom.mbs.kernels.system import System
from rom.mbs.kernels.work import Step
from rom.model import Array

LARGEST_ORDER = 5


def multistep_coefficients(h: float, order: int) -> tuple[Array, Array]:
    """(5,) and (order + 1,) method and weights of BDF with steps of one length.

    The weights are those of the sum of backward differences nabla^m / m, over h; the five numbers
    make an increment move velocities and accelerations as the weights do.
    """
    weights = np.zeros(order + 1)
    for m in range(1, order + 1):
        for j in range(m + 1):
            weights[j] += (-1) ** j * comb(m, j) / m
    return np.array([h, 1 / weights[0] ** 2, 1 / weights[0], 0.0, 0.0]), weights / h


def _is_multistep(step):
    """Whether a step is one of this module: BDF of an order other than two."""
    return step.bdf.size != 3


is_multistep = inner(_is_multistep)


@inner
def earlier(step, which, i):
    """Entry i of the past positions (0) or velocities (1), times their weights."""
    total = 0.0
    for j in range(step.past.shape[1]):
        total += step.bdf[j + 2] * step.past[which, j, i]
    return total


@stage(types.void, System, Step, asked=Step, needed=_is_multistep)
def predict_multistep(s, step):
    """Trial increment for the accelerations of the last step."""
    c0, c1 = step.bdf[0], step.bdf[1]
    for i in range(step.v.size):
        v = (step.vd[i] - c1 * step.v[i] - earlier(step, 1, i)) / c0
        step.psi[i] = (v - earlier(step, 0, i)) / c0
    follow_increment(s, step)


@stage(types.void, System, Step, asked=Step, needed=_is_multistep)
def follow_increment(s, step):
    """Set velocities and accelerations to those of the increment, less what closes gaps."""
    c0, c1 = step.bdf[0], step.bdf[1]
    for i in range(step.v.size):
        step.v1[i] = c0 * (step.psi[i] - step.drift[i]) + earlier(step, 0, i)
    for t in s.bodies.v_at:
        w = spatial_tangent(scale(-1.0, vec(step.psi, t + 3)), vec(step.v1, t + 3))
        step.v1[t + 3], step.v1[t + 4], step.v1[t + 5] = w
    for i in range(step.v.size):
        step.vd1[i] = c0 * step.v1[i] + c1 * step.v[i] + earlier(step, 1, i)


@stage(types.void, System, Step, asked=Step, needed=_is_multistep)
def keep_past(s, step):
    """Let the present instant become a past one, and see all of them from the new instant."""
    count = step.past.shape[1]
    if count == 0:
        return
    for j in range(count - 1, 0, -1):
        copy(step.past[:, j - 1], step.past[:, j])
    step.past[0, 0] = 0.0
    copy(step.v, step.past[1, 0])
    for j in range(count):
        past = step.past[0, j]
        for t in s.bodies.v_at:
            w = joined(scale(-1.0, vec(step.psi, t + 3)), vec(past, t + 3))
            for p in range(3):
                past[t + 3 + p] = w[p] + step.psi[t + 3 + p]
        for i in range(step.psi.size):
            past[i] -= step.psi[i]


@inner
def joined(a, b):
    """Rotation vector of exp(a) exp(b), of at most half a turn."""
    (s, u), (t, w) = half_turn(a), half_turn(b)
    scalar = s * t - dot(u, w)
    vector = add(add(scale(s, w), scale(t, u)), cross(u, w))
    if scalar < 0.0:
        scalar, vector = -scalar, sub((0.0, 0.0, 0.0), vector)
    n = math.sqrt(dot(vector, vector))
    return scale(2.0 * math.atan2(n, scalar) / n if n > 0.0 else 2.0, vector)
