"""Go on with the same bodies under other joints, drives or forces."""

from dataclasses import replace
from typing import Any

from rom.arguments import typed
from rom.errors import ConfigError
from rom.mbs.equations.packing import pack
from rom.mbs.integrate.consistent_start import initial_state
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.state import State


@typed
def release(mechanism: Mechanism, state: State) -> State:
    """State of a mechanism in the position and motion of another one with the same bodies.

    What follows when a brake is let go, a latch closes or a drive gives way to a motor: positions
    and velocities stay, as near as the joints of this mechanism allow; accelerations and reactions
    are its own. Joint angles count from where its bodies were added, turns beyond one from here.

    Args:
        mechanism: what moves on; the same bodies added in the same order.
        state: of the other mechanism, e.g. from `rom.equilibrium` or ``solution.final``.

    Returns:
        State to go on from: ``rom.simulate(mechanism, state=..., ...)``.

    Raises:
        ConfigError: if the bodies are not the same.
        ModelError: naming a joint that is open there.
    """
    packed = pack(mechanism)
    if not isinstance(state, State):
        raise ConfigError(f"{state!r} is no State.", hint="Take rom.equilibrium(...) or sol.final.")
    sizes: Any = (state.q.size, state.v.size)
    if sizes != (packed.q.size, packed.v.size):
        raise ConfigError(
            f"the state has {sizes[0]} coordinates and {sizes[1]} velocities, this mechanism "
            f"{packed.q.size} and {packed.v.size}: their bodies differ."
        )
    return initial_state(replace(packed, q=state.q.copy(), v=state.v.copy()), state.t)
