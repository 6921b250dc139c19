"""How every process of rom is started, limited and ended, and where it keeps its files.

A child finds modules where this process has found them and never in the folder it is started in,
belongs to a session of its own, ends with its parent whatever ends that one, and leaves no folder
behind: those of processes killed by SIGKILL are removed by the next one.
"""

import atexit
import errno
import fcntl
import os
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from rom.errors import ResourceError
from rom.places import FOLDER_ABOVE, PACKAGE
from rom.process.interruption import terminable, uninterrupted

ENTRY_FILE = Path(__file__).with_name("child_entry.py")
ROOT_FOLDER = str(FOLDER_ABOVE)
INSTALL_FOLDERS = ("site-packages", "dist-packages")  # on the path of every child anyway
FOLDER_PREFIX, FOLDER_SUFFIX = "rom-", ".scratch"  # of scratch folders; who else would use both?
FULL_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
LEAST_ROOM = 2**16  # [bytes] with less than that a temporary folder counts as full
GRACE_PERIOD = 1.0  # [s] between SIGTERM and SIGKILL
# The launcher of MPI recognises its processes by these; a child is none of them.
MPI_VARIABLES = ("OMPI_", "PMIX_", "PMI_", "MPI_", "PRTE_", "HYDRA_", "SLURM_")

Child = subprocess.Popen[bytes]


@dataclass(frozen=True, slots=True)
class Limits:
    """What a child may take; 0 for no limit."""

    seconds: float = 0.0  # by the clock [s]
    processor: int = 0  # time of the processor [s]
    memory: int = 0  # address space [bytes]


@dataclass(frozen=True, slots=True)
class Ended:
    """How a child ended and what it said."""

    code: int  # exit code; below zero the number of the signal that ended it
    out: str = ""
    err: str = ""
    overtime: bool = False  # whether its time by the clock was over

    @property
    def last(self) -> str:
        """The last line on standard error."""
        return (self.err.strip().splitlines() or ["it said nothing"])[-1]

    @property
    def signal(self) -> str:
        """Name of the signal that ended it, or nothing."""
        return signal.Signals(-self.code).name if self.code < 0 else ""


def python(module: str, *arguments: str) -> list[str]:
    """The command that runs a module of this Python."""
    return [sys.executable, "-P", "-m", module, *arguments]


def run(
    command: Sequence[str],
    *,
    folder: Path | None = None,
    limits: Limits | None = None,
    variables: Mapping[str, str] | None = None,
    given: bytes | None = None,
) -> Ended:
    """Run a command to its end; whatever interrupts this process ends it with all its own."""
    limits = limits or Limits()
    with terminable():
        fed = given is not None
        process = start(command, folder=folder, limits=limits, variables=variables, fed=fed)
        return finish(process, limits.seconds, given)


def start(
    command: Sequence[str],
    *,
    folder: Path | None = None,
    limits: Limits | None = None,
    variables: Mapping[str, str] | None = None,
    fed: bool = False,
) -> Child:
    """Start a command as `run` does; with ``fed`` it reads what `finish` is given."""
    limits = limits or Limits()
    entry = [sys.executable, "-P", str(ENTRY_FILE), str(os.getpid())]
    entry += [str(limits.processor), str(limits.memory)]
    own = sys.executable in command
    with uninterrupted():
        return subprocess.Popen(
            [*entry, *command],
            cwd=folder,
            env=environment(own=own) | dict(variables or {}),
            stdin=subprocess.PIPE if fed else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )


def finish(process: Child, seconds: float = 0.0, given: bytes | None = None) -> Ended:
    """Wait until a child has ended; end it after so many seconds, or when this is interrupted."""
    overtime = False
    try:
        try:
            out, err = process.communicate(given, timeout=seconds or None)
        except subprocess.TimeoutExpired:
            overtime = True
            end(process)
            out, err = process.communicate()
    except BaseException:
        with uninterrupted():
            end(process)
        raise
    message, complained = (text.decode(errors="replace") for text in (out, err))
    return Ended(process.returncode, message, complained, overtime)


def end(process: Child) -> None:
    """End a child and everything in its session."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, number)
        with suppress(subprocess.TimeoutExpired):
            process.wait(GRACE_PERIOD)


def environment(*, own: bool = True) -> dict[str, str]:
    """Variables of a child; programs that are not our own are not shown where rom lies."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(MPI_VARIABLES)}
    given = [p for p in kept.pop("PYTHONPATH", "").split(os.pathsep) if os.path.isabs(p)]
    if own and os.path.basename(ROOT_FOLDER) not in INSTALL_FOLDERS:
        given.insert(0, ROOT_FOLDER)
    path = {"PYTHONPATH": os.pathsep.join(dict.fromkeys(given))} if given else {}
    return kept | path | {"PYTHONSAFEPATH": "1"}


@contextmanager
def scratch(kind: str) -> Iterator[Path]:
    """A folder for the files of a child, its kind a word of its name, removed whatever happens."""
    made: tuple[Path, int] | None = None
    with terminable():
        try:
            with _room():
                with uninterrupted():
                    sweep()
                    made = _locked(kind)
                yield made[0]
        finally:
            with uninterrupted():
                if made is not None:
                    shutil.rmtree(made[0], ignore_errors=True)
                    os.close(made[1])


def lasting_scratch(kind: str) -> Path:
    """The same for as long as this process lives."""
    with _room():
        path, _ = _locked(kind)
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


@contextmanager
def _room() -> Iterator[None]:
    """What fails inside for want of room, here or in a child, is said to."""
    try:
        yield
    except Exception as error:
        folder = tempfile.tempdir  # None where Python has found no place that takes a file
        lost = isinstance(error, FileNotFoundError) and folder is None
        if not lost and getattr(error, "errno", None) not in FULL_ERRORS:
            if folder is None or shutil.disk_usage(folder).free >= LEAST_ROOM:
                raise
        raise ResourceError(
            f"the temporary folder {folder or os.environ.get('TMPDIR', '')} has no room for files.",
            hint="Let the variable TMPDIR name a folder on a disk that has.",
        ) from error


def _locked(kind: str) -> tuple[Path, int]:
    """A new folder, and the descriptor whose lock says that its maker lives.

    Until it is locked, the sweep of another process may take it for abandoned: it is gone then, or
    goes while the lock is waited for, and another one is made.
    """
    while True:
        path = Path(tempfile.mkdtemp(prefix=f"{FOLDER_PREFIX}{kind}-", suffix=FOLDER_SUFFIX))
        try:
            descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
        except FileNotFoundError:
            continue
        with suppress(OSError):  # no locks on this file system; then no sweep has one either
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        if path.is_dir():
            return path, descriptor
        os.close(descriptor)


def sweep() -> None:
    """Remove the scratch folders of this user whose makers no longer live."""
    for path in Path(tempfile.gettempdir()).glob(f"{FOLDER_PREFIX}*{FOLDER_SUFFIX}"):
        with suppress(OSError):
            _remove_abandoned(path)


def _remove_abandoned(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        about = os.fstat(descriptor)  # ours, and closed to all others, as mkdtemp makes it
        if about.st_uid == os.geteuid() and stat.S_IMODE(about.st_mode) == stat.S_IRWXU:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)  # held while the maker lives
            shutil.rmtree(path)
    finally:
        os.close(descriptor)


def trusted(path: Path) -> bool:
    """Whether none but this user, root and the owner of the package can have written there."""
    try:
        about = path.stat()
    except OSError:
        return True
    package = PACKAGE.stat()
    group = not about.st_mode & stat.S_IWGRP or about.st_gid in (os.getegid(), package.st_gid)
    owner = about.st_uid in (os.geteuid(), 0, package.st_uid)
    return owner and group and not about.st_mode & stat.S_IWOTH
