"""What mpirun says to each process; each computes in one thread, and leaves its core when it waits.

A BLAS that is not told otherwise takes all cores in every rank: ranks then wait for each other's
threads. It reads its variables when it is loaded, so that this runs before NumPy is; a NumPy that
came first is told by a call. Open MPI waits in a loop that keeps a core busy unless it is told to
let others run, by a variable before it starts and by a call after that: it does not see by itself
that a machine has other work, or that ranks of another mpirun are there.
"""

# Of what Python has not loaded itself nothing is imported here, for the reason in `rom`.
import os
import sys

RANK_AND_SIZE = (("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"), ("PMI_RANK", "PMI_SIZE"))
THREADS_VARIABLE = "OMP_NUM_THREADS"
OTHER_VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")
YIELD_VARIABLE = "OMPI_MCA_mpi_yield_when_idle"
OPEN_MPI_FILE = r"/\S*libopen-pal\S*\.so\S*$"
OPEN_MPI_CALLS = ("opal_progress_set_yield_when_idle",)
OPENBLAS_FILE = r"/\S*openblas\S*\.so\S*$"
OPENBLAS_CALLS = tuple(  # each build has one of them
    f"{p}openblas_set_num_threads{s}" for p in ("", "scipy_") for s in ("", "64_")
)


def ranks() -> tuple[int, int]:
    """Number of this process and number of processes, as the launcher says."""
    for rank, size in RANK_AND_SIZE:
        if rank in os.environ and size in os.environ:
            return int(os.environ[rank]), int(os.environ[size])
    return 0, 1


def share_the_machine() -> None:
    """Under mpirun take one thread, and let others run while waiting, unless variables say more."""
    if ranks()[1] == 1:
        return
    if not any(name in os.environ for name in (THREADS_VARIABLE, *OTHER_VARIABLES)):
        os.environ[THREADS_VARIABLE] = "1"
        if "numpy" in sys.modules:
            _tell(OPENBLAS_FILE, OPENBLAS_CALLS, 1)
    if YIELD_VARIABLE not in os.environ:
        os.environ[YIELD_VARIABLE] = "1"
        if "mpi4py.MPI" in sys.modules:
            _tell(OPEN_MPI_FILE, OPEN_MPI_CALLS, 1)


def keep_the_core() -> None:
    """Let a process that is alone stay on its core when it looks for messages.

    MUMPS looks in each solution, and Open MPI, which cannot know that nobody will send one, gives
    the core away each time: beside other work a solution would take as long as their time slices.
    """
    if ranks()[1] == 1 and YIELD_VARIABLE not in os.environ:
        _tell(OPEN_MPI_FILE, OPEN_MPI_CALLS, 0)


def _tell(file: str, calls: tuple[str, ...], value: int) -> None:
    """Call with a value what a library that is loaded has of these functions."""
    import ctypes
    import re

    try:
        with open("/proc/self/maps") as maps:
            lines = maps.read().splitlines()
        for path in {found[0] for line in lines if (found := re.search(file, line))}:
            library = ctypes.CDLL(path)
            for name in calls:
                if hasattr(library, name):
                    getattr(library, name)(value)
    except OSError:  # there are other systems than Linux
        return
