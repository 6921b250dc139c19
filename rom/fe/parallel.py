"""Several ranks, one voice: all raise the same error, none is left waiting."""

import os
import sys
from collections.abc import Callable
from types import TracebackType
from typing import Any, TypeVar

from mpi4py import MPI

from rom.errors import ParallelError, RomError

Value = TypeVar("Value")


def on_root(comm: MPI.Comm, function: Callable[[], Value]) -> Value:
    """Run on rank 0 and give everyone the value, or the error.

    Raises:
        RomError: the one raised on rank 0, on all ranks.
        ParallelError: on all ranks, if rank 0 met an error nobody foresaw.
    """
    outcome: Any = None
    if comm.rank == 0:
        outcome = _attempt(function)
    value, error = comm.bcast(outcome)
    if error is not None:
        raise error
    return value


def together(comm: MPI.Comm, function: Callable[[], Value]) -> Value:
    """Run on every rank, without communication inside; an error of one becomes an error of all.

    Raises:
        RomError: the error of the lowest rank that failed, on all ranks.
    """
    value, error = _attempt(function)
    errors = [e for e in comm.allgather(error) if e is not None]
    if errors:
        raise errors[0]
    return value


def _attempt(function: Callable[[], Value]) -> tuple[Value | None, RomError | None]:
    try:
        return function(), None
    except RomError as error:
        return None, error
    except MemoryError as error:
        return None, ParallelError(f"a rank ran out of memory: {error}.")


def install_abort_hook() -> None:
    """End all ranks when one of them dies of an error: the others would wait for ever."""
    comm = MPI.COMM_WORLD
    if comm.size == 1:
        return
    ordinary = sys.excepthook

    def abort(
        kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        ordinary(kind, error, trace)
        sys.stderr.flush()
        comm.Abort(error.exit_code if isinstance(error, RomError) else 1)

    sys.excepthook = abort


def launched_by_mpirun() -> bool:
    """True when this process was started by an MPI launcher with several ranks."""
    for name in ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE"):
        if int(os.environ.get(name, "1")) > 1:
            return True
    return False
