"""Solutions under a load that grows in steps, halved where none is found."""

from collections.abc import Callable
from typing import TypeVar

State = TypeVar("State")
Ahead = Callable[[State, float], State | None]


def load_steps(
    ahead: Ahead[State], at: State, *, least: float, first: float = 1.0, growth: float = 1.0
) -> tuple[float, State]:
    """How much of a load was reached, one for all of it, and the solution there.

    From a solution without load ``ahead`` goes to a larger share; None where it finds none. A step
    grows where it was found; at the least one it is given up.
    """
    share, step = 0.0, first
    while share < 1.0 and step > least:
        end = share + step if share + step < 1.0 - 1e-9 else 1.0
        found = ahead(at, end)
        if found is None:
            step = (end - share) / 2
        else:
            at, share, step = found, end, growth * step
    return share, at
