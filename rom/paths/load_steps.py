"""Solutions under a load that grows in steps, halved where none is found."""

from collections.abc import Callable
from typing import TypeVar

State = TypeVar("State")


def load_steps(
    ahead: Callable[[State, float], State | None],
    at: State,
    *,
    least: float,
    first: float = 1.0,
    growth: float = 1.0,
) -> tuple[float, State]:
    """How much of a load was reached, one for all of it, and the solution there.

    Args:
        ahead: of a solution and a larger share of the load; the solution there, None if not found.
        at: the solution without load.
        least: step at which it is given up.
        first: step that is tried first.
        growth: factor of the step after one that was found.
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
