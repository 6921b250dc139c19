"""Stability of steady motions of first order: what rolls while it moves."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import null_space

from rom.arguments import typed
from rom.errors import SolverError, warn
from rom.mbs.analysis.local_equations import Instant, consistent, difference, instant
from rom.mbs.analysis.rotors.moving_axes import chosen, small_motions
from rom.mbs.integrate.consistent_start import with_accelerations
from rom.mbs.kernels.system import ROLL
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.state import State
from rom.model import Array

# share by which the equations lead out of constraints that change in time
CONSTRAINT_RATE_RTOL = 1e-3
GROWTH_RATE_RTOL = 3e-4  # of the speed: multiple zeros are computed to the root of round-off
RANK_RTOL = 1e-9  # singular value of constraints that repeat others, of the largest one


@typed
@dataclass(frozen=True)
class SteadyMotion:
    """Small deviations from a steady motion: they grow or decay as exp(s t).

    Attributes:
        state: the motion.
        eigenvalues: (k,) s [rad/s] of the equations of first order, ascending in size; k counts the
            free positions and the free velocities. Zeros belong to neighbouring steady motions.
        rate: speed of the mechanism in radians, or in its sizes, per second [1/s].
    """

    state: State
    eigenvalues: npt.NDArray[np.complex128]
    rate: float

    @property
    def stable(self) -> bool:
        """Whether no deviation grows exponentially."""
        size = max(self.rate, float(np.abs(self.eigenvalues).max(initial=0.0)))
        return bool(self.eigenvalues.real.max(initial=0.0) <= GROWTH_RATE_RTOL * size)


@typed
def steady_motion(
    mechanism: Mechanism,
    state: State | None = None,
    *,
    t: float | None = None,
    frame: object = "world",
    assemble: bool = False,
) -> SteadyMotion:
    """Linearise a steady motion in which wheels or balls may roll.

    Rolling binds velocities but not positions, so that there are more free positions than free
    velocities and no equations of second order in one set of coordinates, as `rom.linearize` has
    them. Here the accelerations a(q, v) that constraints and forces give are differentiated by
    positions and velocities, and restricted to deviations that satisfy the constraints::

        d/dt [p ]   [0    I  ] [p ]
             [p'] = [A_p  A_v] [p'],    G T p = 0 (positions),  d(G v) = 0 (velocities)

    Args:
        mechanism: bodies, joints, forces.
        state: the steady motion; None for the start.
        t: time at which drives and loads are taken [s]; None for that of the state.
        frame: axes in which the deviations of a body are counted so that their equations have
            constant coefficients: "world" for what spins and looks the same from all sides, as
            wheels do, "body" for what turns as a whole; or {body: frame}.
        assemble: see `rom.simulate`.

    Raises:
        ConfigError: for a state of another mechanism or a wrong frame.
        ModelError: naming the joint that the state does not satisfy.
        SolverError: if the equations are singular there.

    Warns:
        RomWarning: if the motion is not steady: the eigenvalues are then those of an instant.

    Source:
        Neimark and Fufaev, Dynamics of Nonholonomic Systems (1972), chapter VI.
    """
    now = instant(mechanism, (0.0 if state is None else state.t) if t is None else t)
    axes = chosen(frame, now.packed.names)
    state = consistent(now, state, assemble)
    rate = now.rate(state) or 1.0
    both = np.concatenate([now.packed.unit, now.packed.unit * rate])
    motions = tuple(T.toarray() for T in small_motions(now.packed, state, axes))
    A = _first_order(now, state, motions, rate) * both / both[:, None]
    B = _bound(now, state, motions) * both
    rows = np.linalg.norm(B, axis=1, keepdims=True)
    N = null_space(B / np.where(rows > 0, rows, 1.0), RANK_RTOL) if B.size else np.eye(B.shape[1])
    reduced = N.T @ A @ N
    away = np.abs(A @ N - N @ reduced).max(initial=0.0)
    if away > CONSTRAINT_RATE_RTOL * max(rate, np.abs(reduced).max(initial=0.0)):
        warn(
            f"the motion is not steady: its linear equations leave the constraints by {away:.2g} "
            "1/s; these eigenvalues are those of one instant."
        )
    roots = np.linalg.eigvals(reduced).astype(complex)
    return SteadyMotion(state, roots[np.lexsort((roots.imag, np.round(np.abs(roots), 9)))], rate)


def _first_order(now: Instant, state: State, motions: tuple[Array, ...], rate: float) -> Array:
    """(2n, 2n) matrix of the equations of first order of p and dp/dt."""
    T, T1, T2, T3 = motions
    n, probe = state.v.size, now.probe()

    def accelerations(dq: Array, dv: Array) -> Array:
        q, v = now.shifted(state.q, dq), state.v + dv
        now.evaluate(q, v)
        at = with_accelerations(now.packed, now.W, replace(state, q=q, v=v))
        if not np.isfinite(at.a).all():
            raise SolverError("the accelerations beside the motion are not finite.")
        return at.a

    zero = np.zeros(n)
    by_q = difference(lambda x: accelerations(x, zero), probe)
    by_v = difference(lambda x: accelerations(zero, x), probe * rate)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n] = np.linalg.solve(T, by_q @ T + by_v @ T1 - T3)
    A[n:, n:] = np.linalg.solve(T, by_v @ T - T2)
    return A


def _bound(now: Instant, state: State, motions: tuple[Array, ...]) -> Array:
    """(m_h + m, 2n) what the constraints bind of p and dp/dt."""
    T, T1 = motions[:2]
    _, G, _ = now.gradient(state.q, state.v)

    def sliding(dq: Array) -> Array:
        _, moved, _ = now.gradient(now.shifted(state.q, dq), state.v)
        return moved @ state.v

    if not G.size:
        return np.zeros((0, 2 * state.v.size))
    held = now.packed.system.rows.kind != ROLL
    change = difference(sliding, now.probe())
    positions = np.hstack([G @ T, 0 * G])[held]
    return np.vstack([positions, np.hstack([change @ T + G @ T1, G @ T])])
