"""Processes that would make the same file take turns: the next one finds it made.

The system frees the turn of a process that dies. Where it has no locks, or a folder cannot be
written, nobody waits.
"""

import fcntl
import os
from hashlib import sha256
from pathlib import Path

LOCK_FILE = "rom.lock"
N_PLACES = 2**31 - 1  # bytes that a lock can lie on, also where offsets have 32 bits


class Turns:
    """Those of this process: locks, each on one byte of a file in the folder of what is made."""

    def __init__(self) -> None:
        # never closed, as that would free all locks of the process on the file
        self._files: dict[Path, int] = {}
        self._held: set[Path] = set()

    def take(self, path: Path, *, wait: bool = True) -> bool:
        """Take the turn to make a file, or wait until whoever makes it has done so or died.

        Whether it is ours; False where there are no locks. Without waiting it is only asked for.
        """
        if not self._lock(path, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB)):
            return False
        self._held.add(path)
        return True

    def end(self, path: Path) -> None:
        """Let others make it, or find it made."""
        if path in self._held:
            self._held.remove(path)
            self._lock(path, fcntl.LOCK_UN)

    def end_all(self) -> None:
        """The same of all files: of those that could not be made, too."""
        for path in tuple(self._held):
            self.end(path)

    def _lock(self, path: Path, how: int) -> bool:
        place = int(sha256(path.name.encode()).hexdigest(), 16) % N_PLACES
        try:
            fcntl.lockf(self._file(path.parent), how, 1, place)
        except OSError:  # held by others, not possible here, or each would wait for the other
            return False
        return True

    def _file(self, folder: Path) -> int:
        if folder not in self._files:
            self._files[folder] = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o666)
        return self._files[folder]
