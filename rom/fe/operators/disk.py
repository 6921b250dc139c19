"""Where a factor on disk lives, and whether that disk can hold it."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mpi4py import MPI

from rom.errors import ResourceError
from rom.process.child import python, start

FOLDER_VARIABLE = "MUMPS_OOC_TMPDIR"
DEFAULT_FOLDER = "/tmp"  # of MUMPS
MOST_FILE_BYTES = 1_879_048_192  # of one file of MUMPS, which then begins another
LEAST_FREE_BYTES = 1_000_000  # below that MUMPS cannot go on
DISK_ERRORS = (-90,)  # INFOG(1) of MUMPS: a file could not be made, written or read


def scratch_folder() -> Path:
    """The folder in which MUMPS keeps a factor that is on disk."""
    return Path(os.environ.get(FOLDER_VARIABLE) or DEFAULT_FOLDER)


def free_disk_bytes(comm: MPI.Comm) -> float:
    """What all ranks together may write there [bytes], disks shared; 0 where any may not."""
    folder = scratch_folder()
    node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    writable = folder.is_dir() and os.access(folder, os.W_OK)
    share = shutil.disk_usage(folder).free / node.size if writable else 0.0
    node.Free()
    return comm.size * float(comm.allreduce(share, op=MPI.MIN))


def reserve_disk(need: float, n: int, comm: MPI.Comm) -> None:
    """Try whether the disk can hold a factor, by files as large as those MUMPS will write.

    MUMPS writes in a thread of its own, and when the disk is full it may wait for that thread for
    ever: nobody could then say what is wrong. All ranks, which together need so many bytes, must
    call, and all raise when folder, disk, a quota or a limit on the size of files refuses one.
    """
    reason = _refusal(need / comm.size)
    refused = [reason for reason in comm.allgather(reason) if reason]
    comm.Barrier()  # what one has tried is gone before another tries again
    if refused:
        raise disk_too_small(n, need, refused[0])


@contextmanager
def watched() -> Iterator[None]:
    """End this process, and say why, when the disk fills: by others, or beyond the foreseen."""
    numbers = (str(number) for number in (LEAST_FREE_BYTES, os.getpid()))
    watch = start(python("rom.process.disk_watch", str(scratch_folder()), *numbers))
    try:
        yield
    finally:
        watch.kill()
        watch.communicate()


def _refusal(size: float) -> str:
    """Why files of so many bytes in all cannot be made, or nothing."""
    left = int(size)
    try:
        with tempfile.TemporaryDirectory(dir=scratch_folder()) as folder:
            for number in range(left // MOST_FILE_BYTES + 1):
                with open(Path(folder) / str(number), "wb") as file:
                    os.posix_fallocate(file.fileno(), 0, max(min(left, MOST_FILE_BYTES), 1))
                left -= MOST_FILE_BYTES
    except OSError as error:
        return f"{error.strerror}, {_free()}"
    return ""


def disk_too_small(n: int, need: float, reason: str = "") -> ResourceError:
    """The error of a disk that does not suffice for a factor of n dofs and so many bytes."""
    return ResourceError(
        f"the factor of {n} dofs takes {need / 2**30:.3g} GiB on disk and cannot be kept in "
        f"{scratch_folder()}: {reason or _free()}.",
        hint=f"Name a folder on a larger disk in {FOLDER_VARIABLE}, raise the limit on the size of "
        'files (ulimit -f), or use solver="iterative" (no factor).',
    )


def _free() -> str:
    folder = scratch_folder()
    if not folder.is_dir():
        return "there is no such folder"
    return f"{shutil.disk_usage(folder).free / 2**30:.3g} GiB are free there"
