"""Axes in which small motions of moving bodies are counted."""

from typing import Any

import numpy as np
from scipy.sparse import csc_matrix, diags

from rom import rotation
from rom.arguments import one_of
from rom.errors import ConfigError
from rom.mbs.results.state import State

FRAMES = ("body", "world")


def chosen(frame: Any, names: tuple[str, ...]) -> tuple[bool, ...]:
    """Whether each body is seen from the world.

    Raises:
        ConfigError: for another word, or a body that does not exist.
    """
    table = frame if isinstance(frame, dict) else dict.fromkeys(names, frame)
    unknown = set(table) - set(names)
    if unknown:
        raise ConfigError(f"frame: no body {sorted(unknown)}; there are {sorted(names)}.")
    words = (one_of("frame", table.get(name, "body"), FRAMES) for name in names)
    return tuple(word == "world" for word in words)


def small_motions(system: Any, state: State, world: tuple[bool, ...]) -> tuple[Any, ...]:
    """Matrices T, T1, T2, T3 (n, n) from small motions p, counted in moving axes, to variations.

    The coordinates vary by T p, the velocities by T dp/dt + T1 p, the accelerations by
    T d2p/dt2 + T2 dp/dt + T3 p. In body axes p turns with the body: what is at rest beside a
    rotating blade has constant p. In world axes p stays: what a spinning disc, which looks the
    same from all sides, does in its bearings has constant coefficients. All are sparse.
    """
    bodies, n = system.bodies, state.v.size
    at, seen = bodies.v_at[:, None], np.array(world)
    p = state.q[bodies.q_at[:, None] + np.arange(3, 7)]
    A = np.moveaxis(rotation.matrix(p.T), -1, 0)
    w, dw = (np.cross(np.eye(3), x[at + np.arange(3, 6)][:, None]) for x in (state.v, state.a))
    T, T1, T2, T3 = blocks = np.zeros((4, len(A), 6, 6))
    x, o = slice(0, 3), slice(3, 6)
    T[:, x, x], T[:, o, o], T2[:, o, o] = np.eye(3), A.transpose(0, 2, 1), -w @ A.transpose(0, 2, 1)
    b = ~seen
    A, w, dw = A[b], w[b], dw[b]
    T[b, x, x], T1[b, x, x], T2[b, x, x], T3[b, x, x] = A, A @ w, 2 * A @ w, A @ (dw + w @ w)
    T[b, o, o], T1[b, o, o], T2[b, o, o], T3[b, o, o] = np.eye(3), w, w, dw
    rigid = at + np.arange(6)
    elastic = np.ones(n)
    elastic[rigid] = 0.0
    where = np.repeat(rigid, 6), np.tile(rigid, 6).ravel()
    T, T1, T2, T3 = (csc_matrix((B.ravel(), where), (n, n)) for B in blocks)
    return T + diags(elastic), T1, T2, T3
