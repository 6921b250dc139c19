"""Several ranks: who speaks, and how all of them end together. MPI is loaded under mpirun only."""

from collections.abc import Callable

from rom.launcher import ranks

__all__ = ["ranks", "stop_all"]


def stop_all(code: int, complain: Callable[[], None]) -> None:
    """Complain once and end every rank with the same exit code; returns on one process."""
    if ranks()[1] == 1:
        complain()
        return
    from rom.fe.parallel import stop_all_ranks

    stop_all_ranks(code, complain)
