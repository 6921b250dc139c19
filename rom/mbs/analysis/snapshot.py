"""A state as a motion of one instant, which answers whatever motions answer."""

import numpy as np

from rom.arguments import typed
from rom.mbs.analysis.local_equations import Instant, consistent, instant
from rom.mbs.kernels.system import WORK
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State


@typed
def snapshot(mechanism: Mechanism, state: State) -> Solution:
    """Ask an equilibrium, or any other state, for positions, reactions, loads and energies.

    Accelerations and reactions are those that belong to the position and the velocities.

    Args:
        mechanism: the mechanism.
        state: a state of it, as of `equilibrium` or ``solution.final``.

    Returns:
        A motion of one instant: its arrays have one row.

    Raises:
        ConfigError: if the state belongs to another mechanism.
        ModelError: naming the joint that is open, or whose velocity contradicts it.
        SolverError: if a drive or load is not finite then.
    """
    now = instant(mechanism, state.t)
    return of_instant(mechanism, now, consistent(now, state))


def of_instant(mechanism: Mechanism, now: Instant, at: State) -> Solution:
    """A consistent state as a motion of one instant."""
    W, works, status = now.W, np.zeros((1, len(WORK))), f"One instant, t = {at.t:g} s."
    t, q, v, a, lam, base, signals = (
        np.array([row]) for row in (at.t, at.q, at.v, at.a, at.lam, W.base, W.signal)
    )
    rank = {"rank": at.rank}
    return Solution(mechanism, now.packed, t, q, v, a, lam, works, base, signals, rank, status, at)
