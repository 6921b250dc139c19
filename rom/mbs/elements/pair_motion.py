"""Kernels of elements between two markers: angles that are followed, tangents of both motions."""

from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness, wrapped


@inner
def followed_angle(s, W, at, angle):
    """An angle over whole turns, nearest to the one remembered in place ``at``, and kept there."""
    before = W.base[s.coordinates.kind.size + at]
    angle = before + wrapped(angle - before)
    W.fresh[at] = angle
    return angle


@inner
def clear_tangent(tangent):
    """Empty the tangents (2, 12, 12) by motions and velocities of a pair of markers."""
    for kind in range(2):
        for p in range(12):
            for q in range(12):
                tangent[kind, p, q] = 0.0


@inner
def scaled_tangent(W, tangent, kind, factor):
    """Write a factor times one of them to W.Q."""
    for p in range(12):
        for q in range(12):
            W.Q[p, q] = factor * tangent[kind, p, q]


@inner
def place_tangent(s, W, pair, tangent, ck, cc):
    """Add ck times the first of them to W.Kt and cc times the second to W.S."""
    i, j = pair
    scaled_tangent(W, tangent, 0, ck)
    pair_stiffness(s, W, i, j, W.Kt)
    scaled_tangent(W, tangent, 1, cc)
    pair_stiffness(s, W, i, j, W.S)
