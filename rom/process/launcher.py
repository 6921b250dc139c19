"""What mpirun says to each process, and that each of them computes in one thread.

A BLAS that is not told otherwise takes all cores in every rank: ranks then wait for each other's
threads. It reads its variables when it is loaded, so that this runs before NumPy is; a NumPy that
came first is told by a call.
"""

# Of what Python has not loaded itself nothing is imported here, for the reason in `rom`.
import os
import sys

RANK_AND_SIZE = (("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"), ("PMI_RANK", "PMI_SIZE"))
THREADS_VARIABLE = "OMP_NUM_THREADS"
OTHER_VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")
OPENBLAS_FILE = r"/\S*openblas\S*\.so\S*$"
OPENBLAS_CALLS = (  # each build has one of them
    "openblas_set_num_threads",
    "openblas_set_num_threads64_",
    "scipy_openblas_set_num_threads",
    "scipy_openblas_set_num_threads64_",
)


def ranks() -> tuple[int, int]:
    """Number of this process and number of processes, as the launcher says."""
    for rank, size in RANK_AND_SIZE:
        if rank in os.environ and size in os.environ:
            return int(os.environ[rank]), int(os.environ[size])
    return 0, 1


def one_thread_each() -> None:
    """Under mpirun give this rank one thread, unless the user has chosen a number."""
    chosen = any(name in os.environ for name in (THREADS_VARIABLE, *OTHER_VARIABLES))
    if ranks()[1] == 1 or chosen:
        return
    os.environ[THREADS_VARIABLE] = "1"
    if "numpy" in sys.modules:
        _tell_openblas()


def _tell_openblas() -> None:
    import ctypes
    import re

    try:
        with open("/proc/self/maps") as file:
            lines = file.read().splitlines()
        for path in {found[0] for line in lines if (found := re.search(OPENBLAS_FILE, line))}:
            library = ctypes.CDLL(path)
            for name in OPENBLAS_CALLS:
                if hasattr(library, name):
                    getattr(library, name)(1)
    except OSError:  # there are other systems than Linux
        return
