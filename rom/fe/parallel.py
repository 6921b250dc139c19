"""What several ranks must agree on: one rank's error is raised on all of them."""

import sys
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, TypeVar

from mpi4py import MPI

from rom.errors import ParallelError, RomError
from rom.process.launcher import keep_the_core, ranks

keep_the_core()  # mpi4py has started Open MPI
T = TypeVar("T")
N_EAGER_TRIES = 100  # looks for a message that may come at once
FIRST_SLEEP, LONGEST_SLEEP = 1e-5, 5e-3  # [s] between two looks for one that does not
GRACE_PERIOD = 1.0  # [s] that other ranks leave rank 0 to print an error all of them have


def on_root(comm: MPI.Comm, function: Callable[..., T], *arguments: Any, **named: Any) -> T:
    """Call a function on rank 0 and give its value, which must survive pickling, to all ranks.

    All ranks must call, and raise what it raised: a RomError, or a ParallelError under mpirun.
    """
    check_launcher()
    value: Any = None
    error: Exception | None = None
    if comm.rank == 0:
        try:
            value = function(*arguments, **named)
        except Exception as raised:
            error = raised
    _raise_together(comm, error)
    return comm.bcast(value) if comm.size > 1 else value


def check_launcher() -> None:
    """Refuse processes of another mpirun: each would do all the work, and write the same files."""
    started, known = ranks()[1], MPI.COMM_WORLD.size
    if known == 1 < started:
        library = MPI.Get_library_version().split(",")[0].splitlines()[0]
        raise ParallelError(
            f"mpirun has started {started} processes, and each knows only itself: mpirun is not of "
            f"the MPI that Python loads, {library}.",
            hint="`rom doctor` names the mpirun that is.",
        )


def on_first_rank(function: Callable[[], T]) -> T:
    """As `on_root` with all ranks there are."""
    return on_root(MPI.COMM_WORLD, function)


@contextmanager
def collective(comm: MPI.Comm) -> Iterator[None]:
    """Raise on all ranks what any rank raised inside; the lowest rank's error is shown.

    Also usable as a decorator. The body must not wait for other ranks after the line that can
    fail, or the ranks that did not fail never get out of it. What is no RomError is raised as a
    ParallelError under mpirun.
    """
    error = None
    try:
        yield
    except Exception as raised:
        error = raised
    _raise_together(comm, error)


def meet(comm: MPI.Comm) -> None:
    """Wait for all ranks asleep: MPI itself would wait for them in a busy loop.

    Whoever comes first may wait for minutes, while one rank meshes or reads, on a machine whose
    cores others need. A wait is prolonged by about its own length at most, and by `LONGEST_SLEEP`.
    """
    if comm.size == 1:
        return
    met, tries, pause = comm.Ibarrier(), 0, FIRST_SLEEP
    while not met.Test():
        tries += 1
        if tries > N_EAGER_TRIES:
            time.sleep(pause)
            pause = min(2.0 * pause, LONGEST_SLEEP)


def _raise_together(comm: MPI.Comm, error: Exception | None) -> None:
    if comm.size == 1:
        if error is not None:
            raise error
        return
    meet(comm)
    told = error
    if error is not None and not isinstance(error, RomError):  # which travels between processes
        text = "".join(traceback.format_exception_only(type(error), error)).strip()
        told = ParallelError(f"rank {comm.rank} failed: {text}", hint="All ranks stop.")
    first_error = next((e for e in comm.allgather(told) if e is not None), None)
    if first_error is not None:
        first_error.agreed = True  # rank 0 prints for all, see `install_abort_hook`
        raise first_error from error


def install_abort_hook(comm: MPI.Comm = MPI.COMM_WORLD) -> None:
    """Let an uncaught exception end all ranks, with the exit code of the error.

    Without it the ranks that did not fail wait forever for the one that did. An error that all
    ranks raise is printed once. Does nothing on one rank.
    """
    if comm.size == 1:
        return

    def abort(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        agreed = getattr(error, "agreed", False)
        if agreed and comm.rank > 0:
            time.sleep(GRACE_PERIOD)
        elif isinstance(error, RomError):
            who = "" if agreed else f"rank {comm.rank}: "
            sys.stderr.write(f"{who}{kind.__name__}: {error}\n")
        else:
            traceback.print_exception(kind, error, trace)
        sys.stderr.flush()
        comm.Abort(getattr(error, "exit_code", 1))

    sys.excepthook = abort


def stop_all_ranks(code: int, print_error: Callable[[], None]) -> None:
    """End every rank with one exit code, whether one of them failed or all.

    Rank 0 complains at once; another rank does only when rank 0 has not ended it within
    `GRACE_PERIOD`, because then it is alone with its error.
    """
    if ranks()[0] > 0:
        time.sleep(GRACE_PERIOD)
    print_error()
    sys.stdout.flush()
    sys.stderr.flush()
    MPI.COMM_WORLD.Abort(code)
