"""Axes in which small motions of moving bodies are counted."""

from typing import Any

import numpy as np

from rom import rotation
from rom.arguments import one_of
from rom.errors import ConfigError
from rom.mbs.results.state import State
from rom.model import Array

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


def small_motions(system: Any, state: State, world: tuple[bool, ...]) -> tuple[Array, ...]:
    """Matrices T, T1, T2, T3 (n, n) from small motions p, counted in moving axes, to variations.

    The coordinates vary by T p, the velocities by T dp/dt + T1 p, the accelerations by
    T d2p/dt2 + T2 dp/dt + T3 p. In body axes p turns with the body: what is at rest beside a
    rotating blade has constant p. In world axes p stays: what a spinning disc, which looks the
    same from all sides, does in its bearings has constant coefficients.
    """
    n, bodies = state.v.size, system.bodies
    T, T1, T2, T3 = np.eye(n), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    for b, at in enumerate(bodies.v_at):
        x, o = slice(at, at + 3), slice(at + 3, at + 6)
        p = state.q[bodies.q_at[b] + 3 : bodies.q_at[b] + 7]
        A, w, dw = rotation.matrix(p), rotation.skew(state.v[o]), rotation.skew(state.a[o])
        if world[b]:
            T[o, o], T2[o, o] = A.T, -w @ A.T
        else:
            T[x, x], T1[x, x], T2[x, x] = A, A @ w, 2 * A @ w
            T3[x, x] = A @ (dw + w @ w)
            T1[o, o], T2[o, o], T3[o, o] = w, w, dw
    return T, T1, T2, T3
