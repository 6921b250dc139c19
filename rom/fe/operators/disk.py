"""Where a factor on disk lives, whether that disk can hold it, and what if it fills meanwhile."""

import ctypes
import os
import shutil
import tempfile
from pathlib import Path
from threading import Thread
from time import process_time
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

from rom.errors import ResourceError
from rom.process.memory import mapped_files

FOLDER_VARIABLE = "MUMPS_OOC_TMPDIR"
DEFAULT_FOLDER = "/tmp"  # of MUMPS
MOST_FILE_BYTES = 1_879_048_192  # of one file of MUMPS, which then begins another
DISK_ERRORS = (-90,)  # INFOG(1) of MUMPS: a file could not be made, written or read
WATCH_PERIOD = 2.0  # [s] between two looks at a factor that is being written
MOST_IDLE_TIME = 0.02  # of the processor in a period [s], while MUMPS waits for nothing
N_IDLE_PERIODS = 3  # in which nothing goes on, until MUMPS is given up
PROBE_BYTES = 2**25  # more than MUMPS writes at once: a disk that refuses them is full
abandoned: list[Any] = []  # solvers that wait for ever, which nobody may destroy


def scratch_folder() -> Path:
    """The folder in which MUMPS keeps a factor that is on disk."""
    return Path(os.environ.get(FOLDER_VARIABLE) or DEFAULT_FOLDER)


def free_disk_bytes(comm: MPI.Comm) -> float:
    """What all ranks together may write there [bytes]; 0 where any of them may not.

    Ranks of one machine share its disk.
    """
    folder = scratch_folder()
    node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    writable = folder.is_dir() and os.access(folder, os.W_OK)
    share = shutil.disk_usage(folder).free / node.size if writable else 0.0
    node.Free()
    return comm.size * float(comm.allreduce(share, op=MPI.MIN))


def reserve_disk(need: float, n: int, comm: MPI.Comm) -> None:
    """Try whether the disk can hold a factor, by files as large as those MUMPS will write.

    MUMPS writes in a thread of its own, and when the disk is full it may wait for that thread for
    ever: nobody could then say what is wrong.

    Args:
        need: what the factor takes, on all ranks together [bytes].
        n: number of dofs factored.
        comm: the ranks; all of them must call.

    Raises:
        ResourceError: on all ranks, when the folder, the disk, a quota or a limit on the size of
            files refuses one of them.
    """
    reason = _refusal(need / comm.size)
    refused = [reason for reason in comm.allgather(reason) if reason]
    comm.Barrier()  # what one has tried is gone before another tries again
    if refused:
        raise disk_too_small(n, need, refused[0])


def set_up_watched(ksp: PETSc.KSP) -> bool:
    """Factor on disk; False, on all ranks, if that filled and MUMPS waits for ever on one of them.

    MUMPS writes in a thread of its own, which ends when the disk refuses. If much is still to be
    written then, MUMPS waits for that thread. So it factors in another thread, outside Python, and
    this one looks whether neither work nor files go on while the disk refuses more. The files are
    then emptied and removed, and what waits is left alone.
    """
    petsc = next(path for path in mapped_files() if "libpetsc" in Path(path).name)
    calls, comm = ctypes.CDLL(petsc), ksp.comm.tompi4py().Dup()
    codes: list[int] = []

    def factor() -> None:
        for call, solver in ((calls.KSPSetUp, ksp), (calls.PCSetUp, ksp.getPC())):
            codes.append(call(ctypes.c_void_p(solver.handle)))

    work = Thread(target=factor, daemon=True)
    work.start()
    _wait(work, comm)
    ended = not work.is_alive()
    if not comm.allreduce(ended, op=MPI.LAND):
        abandoned.append(ksp)
        _remove_files()
        comm.Barrier()  # a rank that raises ends the others, whose files are gone by then
        return False
    comm.Free()
    if any(codes):
        raise PETSc.Error(max(codes))
    return True


def _wait(work: Thread, comm: MPI.Comm) -> None:
    """Until a factor is written, or a rank has seen that it never will be, and tells the others."""
    idle, before = 0, _progress()
    work.join(WATCH_PERIOD)
    while work.is_alive() and not comm.Iprobe():
        now = _progress()
        rests = now[0] - before[0] < MOST_IDLE_TIME and now[1] == before[1]
        idle = idle + 1 if rests and _refusal(PROBE_BYTES) else 0
        if idle == N_IDLE_PERIODS:
            for other in range(comm.size):
                comm.isend(None, other)
        before = now
        work.join(WATCH_PERIOD)


def _remove_files() -> None:
    """Files that stay open keep their place on a disk unless they are empty."""
    for path in _files():
        os.truncate(path, 0)
        path.unlink()


def _progress() -> tuple[float, list[int]]:
    """Processor time of this process [s] and the sizes of its files on that disk [bytes]."""
    return process_time(), [path.stat().st_size for path in _files()]


def _files() -> list[Path]:
    """Those of MUMPS that this process has open."""
    opened = (path.resolve() for path in Path("/proc/self/fd").iterdir())
    folder = scratch_folder().resolve()
    return sorted(
        path
        for path in opened
        if path.parent == folder and path.name.startswith("mumps_") and path.is_file()
    )


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
        return f"{error.strerror}, {free_words()}"
    return ""


def disk_too_small(n: int, need: float, reason: str = "") -> ResourceError:
    """The error of a disk that does not suffice for a factor of n dofs and so many bytes."""
    return ResourceError(
        f"the factor of {n} dofs takes {need / 2**30:.3g} GiB on disk and cannot be kept in "
        f"{scratch_folder()}: {reason or free_words()}.",
        hint=f"Name a folder on a larger disk in {FOLDER_VARIABLE}, raise the limit on the size of "
        'files (ulimit -f), or use solver="iterative" (no factor).',
    )


def free_words() -> str:
    """How much is free in the folder of factors, in words."""
    folder = scratch_folder()
    if not folder.is_dir():
        return "there is no such folder"
    return f"{shutil.disk_usage(folder).free / 2**30:.3g} GiB are free there"
