"""One writer at a time in a folder of results."""

import fcntl
import os
import platform
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rom.errors import ConfigError, ResourceError
from rom.io.files import check_writable

LOCK_NAME = ".rom.lock"
MAX_OWNER_BYTES = 300


@contextmanager
def claimed(folder: str | Path) -> Iterator[None]:
    """Keep other runs out of a folder, which is made if it is missing.

    The lock is one of the system and ends with the process that holds it, however that ends; a
    folder that was made and stayed empty is removed. Where a file system has no locks, nothing is
    kept out.

    Raises:
        ConfigError: if it is no folder, or may not be made or written.
        ResourceError: naming the process that has claimed it.
    """
    folder = Path(folder)
    kind = _kind(folder)
    if kind is not None and not stat.S_ISDIR(kind):
        raise ConfigError(f"{folder} is a file; a folder is needed.")
    missing = kind is None
    try:
        handle = _locked(folder)
    except OSError as error:
        hint = "Choose another folder, or ask for the right to write there."
        raise ConfigError(
            f"the folder {folder} is not writable: {error.strerror}.", hint=hint
        ) from error
    try:
        yield
    finally:
        if handle is not None:
            (folder / LOCK_NAME).unlink(missing_ok=True)
            os.close(handle)
        if missing:
            with suppress(OSError):  # something is in it, or another run has taken it
                folder.rmdir()


def _kind(folder: Path) -> int | None:
    """Mode of what has this name, asked once as other runs make and remove it; None if none."""
    try:
        return folder.stat().st_mode
    except OSError:
        return None


def _locked(folder: Path) -> int | None:
    """Descriptor of the lock, in a folder that exists then; None where locks do not work."""
    path = folder / LOCK_NAME
    while True:
        try:
            handle = os.open(path, os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o666)
        except FileNotFoundError:  # not made yet, or removed by a run that has failed
            check_writable(folder.parent / LOCK_NAME)
            try:
                folder.mkdir()
            except FileExistsError:  # made by another run in between
                if folder.is_symlink():
                    raise
            continue
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise _taken(folder, handle) from None
        except OSError:
            os.close(handle)
            return None
        if _still_there(path, handle):
            break
        os.close(handle)  # its owner has removed it in between
    os.ftruncate(handle, 0)
    os.pwrite(handle, f"process {os.getpid()} on {platform.node()}".encode(), 0)
    return handle


def _taken(folder: Path, handle: int) -> ResourceError:
    owner = os.pread(handle, MAX_OWNER_BYTES, 0).decode(errors="replace")
    os.close(handle)
    return ResourceError(
        f"another run is writing into {folder}: {owner or 'it has just begun'}.",
        hint="Wait for it, or choose another folder.",
    )


def _still_there(path: Path, handle: int) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(handle))
    except FileNotFoundError:
        return False
