"""How much memory a factorisation will take, asked before it is taken."""

import ctypes
import os
import resource
from pathlib import Path

from mpi4py import MPI

from rom.errors import ResourceError

SHARE = 0.85  # of the memory that is free
THIN = 0.2  # of a block's factor: what a thin-walled body of as many dofs needs
UNLIMITED = 1 << 60


def factor_bytes(n: int) -> float:
    """Predicted memory of a sparse factor of quadratic tetrahedra [bytes].

    A power law through measured MUMPS factors of blocks with 16 731 to 224 547 dofs: 71 MB times
    (n / 16 700)^1.37.
    """
    return 71e6 * (n / 16_700) ** 1.37


def free_bytes() -> float:
    """Memory this process may still take [bytes].

    The least of what the machine has free, what its control group leaves, and what its own limit
    on address space leaves.
    """
    return min(_machine(), _control_group(Path("/sys/fs/cgroup")), _address_space())


def give_back() -> None:
    """Return freed memory to the machine.

    The C library keeps what a factor has freed, gigabytes of it, and the next factor asks anew.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:  # glibc has it
        trim(0)


def _machine() -> float:
    lines = Path("/proc/meminfo").read_text().splitlines()
    fields = dict(line.split(":", 1) for line in lines)
    return 1024.0 * float(fields["MemAvailable"].split()[0])


def _address_space() -> float:
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return float(UNLIMITED)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return float(limit - pages * os.sysconf("SC_PAGE_SIZE"))


def allowed_bytes(comm: MPI.Comm) -> float:
    """Memory each rank may take for a factor [bytes], the same on all ranks.

    Ranks of one machine share what it has.
    """
    node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    share = SHARE * free_bytes() / node.size
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
    need, there = THIN * factor_bytes(n) + 8.0 * n * n_columns, allowed_bytes(comm) * comm.size
    if need > there:
        raise too_large(n, need, there)


def too_large(n: int, need: float, there: float) -> ResourceError:
    """The error that says by how much a factor of n dofs does not fit."""
    return ResourceError(
        f"factoring {n} dofs is predicted to take {need / 2**30:.2f} GiB; "
        f"{there / 2**30:.2f} GiB may be used ({SHARE:.0%} of what is free).",
        hint='Use a coarser mesh, more machines, solver="out-of-core" (the factor on disk) or '
        'solver="iterative" (no factor).',
    )


def _control_group(folder: Path) -> float:
    """What the control group leaves; cached files count as free."""
    try:
        text = (folder / "memory.max").read_text().strip()
        if text == "max":
            return float(UNLIMITED)
        used = float((folder / "memory.current").read_text())
        pairs = (line.split() for line in (folder / "memory.stat").read_text().splitlines())
        cached = float(dict(pairs).get("file", 0))
    except OSError:
        return float(UNLIMITED)
    return max(float(text) - used + cached, 0.0)
