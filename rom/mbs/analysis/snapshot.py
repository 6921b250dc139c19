"""A state as a motion of one instant, which answers whatever motions answer."""

from rom.arguments import typed
from rom.mbs.analysis.local_equations import consistent, instant, of_instant
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
