"""Nearest points of two straight pieces, for real or complex numbers."""

import math

from rom.mbs.kernels.algebra import add, dot, scale, sub, vec
from rom.mbs.kernels.compiled import inner, kernel

PARALLEL_SQUARE = 1e-12  # squared sine between axes, below which the nearest points are not unique


@inner
def within(x, half):
    """The number nearest to x between -half and half."""
    if x.real > half:
        return 0.0 * x + half
    if x.real < -half:
        return 0.0 * x - half
    return x


@inner
def middle_of_overlap(x, half_i, half_j):
    """Place on the first of two parallel pieces, the second one's middle x along it."""
    low = max(-half_i, x.real - half_j)
    high = min(half_i, x.real + half_j)
    return within(0.0 * x + 0.5 * (low + high), half_i)


@inner
def nearest(gap, e, s, half_i, half_j):
    """Places on both pieces, from their middles, between which they are nearest.

    The pieces are a e, |a| <= half_i, and gap + b s, |b| <= half_j. Where both places are inside,
    d = gap + b s - a e is normal to both axes; else one is held at its end, and the other is the
    foot of the perpendicular, or its own end.

    Source:
        Ericson, Real-Time Collision Detection (2005), section 5.1.9.
    """
    x, y, c = dot(gap, e), dot(gap, s), dot(e, s)
    sine = 1.0 - c * c
    if sine.real > PARALLEL_SQUARE:
        a = within((x - c * y) / sine, half_i)
    else:
        a = middle_of_overlap(x, half_i, half_j)
    b = within(c * a - y, half_j)
    return within(c * b + x, half_i), b


@inner
def across_of(gap, e, s, half_i, half_j):
    """Vector between the nearest points of two pieces, and that from the middle of the second."""
    a, b = nearest(gap, e, s, half_i, half_j)
    out = scale(b, s)
    return sub(add(gap, out), scale(a, e)), out


@kernel
def distance(gap, e, s, half_i, half_j):
    """Between two pieces, for arrays (3,)."""
    d = across_of(vec(gap, 0), vec(e, 0), vec(s, 0), half_i, half_j)[0]
    return math.sqrt(dot(d, d))
