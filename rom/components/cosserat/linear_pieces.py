"""A rod cut into linear bodies in series: how many does a large deflection need?

Each piece deforms linearly in a frame that moves with its root, as reduced bodies do; poses of the
frames are exact. With one piece this is linear theory; with many the rod itself comes back.

Source:
    See docs/theory/rods.md for the rod; its pieces are ours.
"""

from itertools import pairwise

import numpy as np

from rom import rotation
from rom.components.cosserat import Rod, Shape, clamped, linearised, reference, rod
from rom.errors import ConfigError, SolverError
from rom.model import Array

INCREMENT_RTOL, MAX_ITERATIONS = 1e-12, 500


def cut(whole: Rod, k: int) -> list[Rod]:
    """K pieces of nearly as many segments each, with plates where they meet."""
    n = whole.h.size
    if not 1 <= k <= n:
        raise ConfigError(f"{k} pieces of a rod of {n} segments.", hint="Take 1 to as many.")
    ends = np.linspace(0, n, k + 1).round().astype(int)
    middle = [rotation.multiply(p, s) for p, s in zip(whole.p, whole.s, strict=False)]
    plates = {0: whole.p[0], n: whole.p[-1]}
    pieces = []
    for a, b in pairwise(ends):
        p = [plates.get(a, middle[a]), *whole.p[a + 1 : b + 1], plates.get(b, middle[b])]
        stretch, bend = whole.stretch[a:b], whole.bend[a : b + 1]
        pieces.append(rod(whole.x[a : b + 1], p, stretch=stretch, bend=bend))
    return pieces


def bend_in_pieces(whole: Rod, k: int, force: Array) -> Array:
    """(N + 1, 3) positions [m] of a clamped rod of k linear pieces under dead forces.

    Forces (N + 1, 3) are on the vertices [N].

    Raises:
        ConfigError: if there are more pieces than segments.
        SolverError: if linear pieces find no equilibrium, because they turn too far.
    """
    pieces = cut(whole, k)
    bent = ((linearised(one, reference(one))[1], clamped(one)) for one in pieces)
    flexibility = [np.linalg.inv(K[np.ix_(free, free)]) for K, free in bent]
    ends = np.cumsum([0, *(one.h.size for one in pieces)])
    x, turns = whole.x.copy(), [np.eye(3)] * (k + 1)  # of the pieces, from where they started
    for _ in range(MAX_ITERATIONS):
        new, turn, at = [whole.x[:1]], [np.eye(3)], whole.x[0]
        for j, (one, C) in enumerate(zip(pieces, flexibility, strict=True)):
            a, b = ends[j], ends[j + 1]
            load = np.zeros((b - a + 2, 6))
            load[1 : b - a, 3:] = force[a + 1 : b]
            load[b - a, 3:] = force[b:].sum(axis=0)
            load[:, 3:] = load[:, 3:] @ turns[j]
            moment = turns[j].T @ np.cross(x[b:] - x[b], force[b:]).sum(axis=0)
            load[-1, :3] = rotation.matrix(one.p[-1]).T @ moment
            u = np.zeros((b - a + 2, 6))
            u.ravel()[6:-3] = C @ load.ravel()[6:-3]
            shape = Shape(one.x + u[:-1, 3:], one.p)
            new.append(at + (shape.x[1:] - one.x[0]) @ turn[-1].T)
            last = rotation.matrix(rotation.exp(rotation.matrix(one.p[-1]) @ u[-1, :3]))
            at, turn = new[-1][-1], [*turn, turn[-1] @ last]
        step = np.abs(np.concatenate(new) - x).max()
        x, turns = np.concatenate(new), turn
        if step < INCREMENT_RTOL * whole.h.sum():
            return x
        if not step < 10 * whole.h.sum():
            break
    raise SolverError(f"{k} linear pieces found no equilibrium.", hint="Take more pieces.")
