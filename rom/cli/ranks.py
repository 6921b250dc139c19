"""Several ranks: who speaks, and how all of them end together. MPI is loaded under mpirun only."""

import os
from collections.abc import Callable

RANK_AND_SIZE = (("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"), ("PMI_RANK", "PMI_SIZE"))


def ranks() -> tuple[int, int]:
    """Number of this process and number of processes, as the launcher says."""
    for rank, size in RANK_AND_SIZE:
        if rank in os.environ and size in os.environ:
            return int(os.environ[rank]), int(os.environ[size])
    return 0, 1


def stop_all(code: int, complain: Callable[[], None]) -> None:
    """Complain once and end every rank with the same exit code; returns on one process."""
    if ranks()[1] == 1:
        complain()
        return
    from rom.fe.parallel import stop_all_ranks

    stop_all_ranks(code, complain)
