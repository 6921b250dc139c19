"""How much memory a factorisation will take, asked before it is taken."""

import ctypes

from mpi4py import MPI
from petsc4py import PETSc

from rom.process.memory import free_bytes

MAX_MEMORY_SHARE = 0.85  # of the memory that is free
THIN_FACTOR_RATIO = 0.2  # factor of a thin-walled body over that of a block with as many dofs


def factor_bytes(n: int) -> float:
    """Predicted memory of a sparse factor of quadratic tetrahedra [bytes].

    Power law of measured MUMPS factors, 16 731 to 224 547 dofs: 71 MB times (n / 16 700)^1.37.
    """
    return 71e6 * (n / 16_700) ** 1.37


def give_back() -> None:
    """Return freed memory to the machine.

    The C library keeps what a factor has freed, gigabytes of it, and the next factor asks anew.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:  # glibc has it
        trim(0)


def collect(comm: MPI.Comm) -> None:
    """Free the matrices and factors that Python has let go, on all ranks together.

    PETSc cannot free what one rank lets go while others still hold it: it keeps such objects, of
    one rank, too, until it is asked.
    """
    PETSc.garbage_cleanup(comm)
    give_back()


def allowed_bytes(comm: MPI.Comm) -> float:
    """Memory each rank may take for a factor [bytes], the same on all ranks.

    Ranks of one machine share what it has.
    """
    collect(comm)
    node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    share = MAX_MEMORY_SHARE * free_bytes() / node.size
    node.Free()
    return comm.allreduce(share, op=MPI.MIN)
