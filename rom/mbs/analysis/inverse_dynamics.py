"""Inverse dynamics: loads of a motion that drives prescribe entirely, without integration."""

from dataclasses import replace
from typing import Annotated

import numpy as np
import numpy.typing as npt
from scipy.integrate import cumulative_trapezoid

from rom.arguments import Ascending, typed
from rom.errors import ModelError, reached
from rom.mbs.elements.family import Laws, apply_laws
from rom.mbs.equations.equations import evaluate, retract
from rom.mbs.equations.packing import Packed, pack
from rom.mbs.integrate.consistent_start import (
    assembled,
    fitting_velocity,
    initial_state,
    prescribed,
    with_accelerations,
)
from rom.mbs.kernels.work import Work, workspace
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State
from rom.model import Array

DIFFERENCE_SPACING = 1e-4  # of drives without derivatives, relative to the duration


@typed
def inverse_dynamics(
    mechanism: Mechanism, t: Annotated[npt.ArrayLike, Ascending("s")], *, assemble: bool = False
) -> Solution:
    """Positions, velocities, accelerations and all loads of a mechanism that is driven entirely.

    At each time the joints and drives give the position, their derivatives velocities and
    accelerations, and M a + h - Q + G^T lam = 0 the reactions and what the drives must supply.

    Args:
        mechanism: rigid bodies with as many drives as the joints leave free motions.
        t: (n_t,) times [s], ascending and so close that each position is nearest to the one before.
        assemble: see `rom.simulate`.

    Returns:
        The motion, asked like a simulated one: ``reaction``, ``drive_load``, ``interface_loads``.

    Raises:
        ConfigError: for times that do not ascend.
        ModelError: if motions stay free, or joints and drives contradict each other.
        SolverError: if a drive or load is not finite.
    """
    times = np.array(t, dtype=float)
    packed = pack(mechanism)
    span, spacing = (times[0], times[-1]), DIFFERENCE_SPACING * (times[-1] - times[0])
    state = initial_state(packed, times[0], spacing, assemble=assemble, placing=True)
    packed = packed.of_rank(state.rank)
    _refuse_free(packed, state)
    signals = prescribed(packed.signals, times, span, spacing, spacing)
    W = workspace(packed.system, len(packed.signals))
    W.base[:] = state.base
    forces = packed.asked
    states: list[State] = []
    powers: list[Array] = []

    def solution() -> Solution:
        return _solution(mechanism, packed, states, np.array(powers), signals[: len(states)])

    with reached(lambda: solution() if states else None):
        for k, x in enumerate(times):
            W.signal[:] = signals[k]
            state = _next(packed, W, forces, state, float(x))
            states.append(state)
            powers.append(W.power.copy())
    return solution()


def _next(packed: Packed, W: Work, forces: Laws, last: State, t: float) -> State:
    """The state at a time, found from the one before."""
    h, q = t - last.t, np.empty_like(last.q)
    retract(packed.system, last.q, h * last.v + 0.5 * h * h * last.a, q)
    q = assembled(packed, W, q)
    v = fitting_velocity(packed, W, q, last.v)
    evaluate(packed.system, W, q, v)
    apply_laws(forces, W, t)
    return with_accelerations(packed, W, replace(last, t=t, q=q, v=v))


def _refuse_free(packed: Packed, state: State) -> None:
    free = packed.v.size - state.rank
    elastic = int(packed.system.bodies.r.sum())
    if free:
        what = f"{elastic} of them elastic; " if elastic else ""
        text = f"{free} motions are not prescribed by joints and drives ({what}it needs"
        raise ModelError(f"{text} none); add drives, or simulate the motion.")
    packed.refuse_rolling("rolling prescribes velocities, not positions; use rom.simulate instead.")


def _solution(
    mechanism: Mechanism, packed: Packed, states: list[State], powers: Array, signals: Array
) -> Solution:
    def rows(name: str) -> Array:
        return np.array([getattr(state, name) for state in states])

    t = rows("t")
    work = cumulative_trapezoid(powers, t, axis=0, initial=0.0)
    statistics = {"steps": t.size - 1, "rank": states[0].rank, "closed": states[0].closed}
    status = f"Prescribed from t = {t[0]:g} s to {t[-1]:g} s."
    q, v, a, lam = (rows(name) for name in ("q", "v", "a", "lam"))
    moved = mechanism, packed, t, q, v, a, lam
    return Solution(*moved, work, rows("base"), signals, statistics, status, states[-1])
