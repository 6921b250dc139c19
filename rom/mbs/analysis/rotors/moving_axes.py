"""Axes in which small motions of moving bodies are counted."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvalsh
from scipy.sparse import csc_matrix, diags

from rom import rotation
from rom.arguments import one_of
from rom.errors import ModelError
from rom.mbs.analysis.rotors.blades import Blades
from rom.mbs.equations.packing import Packed
from rom.mbs.results.state import State
from rom.names import check_known

FRAMES = ("body", "world")
SPIN_RTOL = 1e-3  # of the first frequency of a body, from which on it counts as spinning


@dataclass(frozen=True)
class Axes:
    """Axes in which small motions are counted."""

    world: tuple[bool, ...] = ()  # whether those of the world, per body; empty: of each body
    blades: Blades | None = None  # counted together, in axes that do not turn with them


IN_BODIES = Axes()


def chosen(frame: object, names: tuple[str, ...]) -> Axes:
    """The axes that the caller of an analysis names."""
    table = frame if isinstance(frame, dict) else dict.fromkeys(names, frame)
    for name in table:
        check_known(name, names, f"frame: no body {name!r}; there are")
    words = (one_of("frame", table.get(name, "body"), FRAMES) for name in names)
    return Axes(tuple(word == "world" for word in words))


def small_motions(packed: Packed, state: State, axes: Axes) -> tuple[csc_matrix, ...]:
    """Matrices T, T1, T2, T3 (n, n) from small motions p, counted in moving axes, to variations.

    The coordinates vary by T p, the velocities by T dp/dt + T1 p, the accelerations by
    T d2p/dt2 + T2 dp/dt + T3 p. In body axes p turns with the body: what is at rest beside a
    rotating blade has constant p. In world axes p stays: what a spinning disc, which looks the
    same from all sides, does in its bearings has constant coefficients. All are sparse.
    Blades are counted together, see `rom.mbs.analysis.rotors.blades`. A body that deforms and
    spins in axes of the world is refused: its elastic coordinates turn with it.
    """
    bodies, n = packed.system.bodies, state.v.size
    at = bodies.v_at[:, None]
    seen = np.array(axes.world or [False] * len(at))
    if axes.blades is not None:
        seen[axes.blades.bodies] = False
    for b in np.flatnonzero(seen & (bodies.r > 0)):
        _refuse_spinning_shapes(packed, state, b)
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
    T = T + diags(elastic)
    if axes.blades is None:
        return T, T1, T2, T3
    B, B1, B2 = axes.blades.motions(state)
    return T @ B, T1 @ B + T @ B1, T2 @ B + 2 * T @ B1, T3 @ B + T2 @ B1 + T @ B2


def _refuse_spinning_shapes(packed: Packed, state: State, b: int) -> None:
    bodies, r = packed.system.bodies, packed.system.bodies.r[b]
    speed = np.linalg.norm(state.v[bodies.v_at[b] + np.arange(3, 6)])
    K, M = (A[bodies.flex[b], :r, :r] for A in (bodies.K, bodies.M))
    if speed > SPIN_RTOL * np.sqrt(eigvalsh(K, M)[0].clip(0.0)):
        raise ModelError(
            f"it spins at {speed:.4g} rad/s and its shapes turn with it: in axes of the world the "
            "linear equations of a body that deforms are not constant.",
            where=packed.names[b],
            hint='Take frame="body", whose frequencies are those seen from the body: where '
            "bearings are the same in all directions, from outside they differ by the speed. Or "
            "make the rotor of rods, or of rigid bodies on springs.",
        )
