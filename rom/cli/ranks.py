"""Several ranks: who speaks, and how all of them end together. MPI is loaded under mpirun only."""

from collections.abc import Callable
from typing import TypeVar

from rom.process.launcher import ranks

__all__ = ["on_first_rank", "ranks", "stop_all"]
T = TypeVar("T")


def on_first_rank(look: Callable[[], T]) -> T:
    """What one rank finds out for all of them, or its error on all of them."""
    if ranks()[1] == 1:
        return look()
    from rom.fe.parallel import on_first_rank as on_first

    return on_first(look)


def stop_all(code: int, print_error: Callable[[], None]) -> None:
    """Complain once and end every rank with the same exit code; returns on one process."""
    if ranks()[1] == 1:
        print_error()
        return
    from rom.fe.parallel import stop_all_ranks

    stop_all_ranks(code, print_error)
