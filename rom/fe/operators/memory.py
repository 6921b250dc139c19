"""How much memory a factorisation will take, asked before it is taken."""

import ctypes

from mpi4py import MPI
from petsc4py import PETSc

from rom.errors import ResourceError
from rom.process.memory import free_bytes

MAX_MEMORY_SHARE = 0.85  # of the memory that is free
THIN_FACTOR_RATIO = 0.2  # factor of a thin-walled body over that of a block with as many dofs


def factor_bytes(n: int) -> float:
    """Predicted memory of a sparse factor of quadratic tetrahedra [bytes].

    A power law through measured MUMPS factors of blocks with 16 731 to 224 547 dofs: 71 MB times
    (n / 16 700)^1.37.
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


def check_factor_memory(n: int, n_columns: int = 0, *, comm: MPI.Comm) -> None:
    """Refuse a factorisation that would not fit, whatever the shape of the body.

    How much it really takes is known after the analysis, and `Factor` asks again.

    Args:
        n: number of dofs to factor.
        n_columns: dense columns of that length that are kept beside the factor.
        comm: the ranks that share the factor.

    Raises:
        ResourceError: with the need and what there is.
    """
    need, there = (
        THIN_FACTOR_RATIO * factor_bytes(n) + 8.0 * n * n_columns,
        allowed_bytes(comm) * comm.size,
    )
    if need > there:
        raise too_large(n, need, there)


def too_large(n: int, need: float, there: float) -> ResourceError:
    """The error that says by how much a factor of n dofs does not fit."""
    return ResourceError(
        f"factoring {n} dofs is predicted to take {need / 2**30:.2f} GiB; "
        f"{there / 2**30:.2f} GiB may be used ({MAX_MEMORY_SHARE:.0%} of what is free).",
        hint='Use a coarser mesh, more machines, solver="out-of-core" (the factor on disk) or '
        'solver="iterative" (no factor).',
    )
