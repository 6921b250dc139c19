"""Waiting: what takes long and is done only once says so, and is not done by two at once."""

import fcntl
import logging
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from threading import Timer
from time import perf_counter

from rom.process.launcher import ranks

log = logging.getLogger("rom")
SHORT_WAIT = 2.0  # [s] that nobody needs to be told about
MAX_OVERRUN = 3.0  # times the time foretold, after which it is foretold anew
LOCK_FILE = "rom.lock"
N_PLACES = 2**31 - 1  # bytes that a lock can lie on, also where offsets have 32 bits


class Patience:
    """How long a user waits for one kind of work, by the clock.

    A line is logged as a warning, on the first rank, when some seconds have passed and more are to
    come; another one only when far more have passed than were foretold. At first a rate counts, the
    seconds per unit of size on some machine.
    """

    def __init__(self, rate: float):
        self._spent, self._done, self._foretold = 0.0, SHORT_WAIT / rate, SHORT_WAIT
        self._began: float | None = None
        self._blocked = False

    def begin(self) -> None:
        """Count the time from now on, unless that is so already."""
        if self._began is None:
            self._began = perf_counter()

    def end(self) -> None:
        """Count no longer."""
        self._spent, self._began = self._so_far(), None

    def advance(self, size: int, rest: Callable[[], int], say: Callable[[int], str]) -> None:
        """Note that a part of a size is done, and say how long the rest will take if long."""
        self._done += size
        spent = self._so_far()
        if spent < self._foretold or ranks()[0]:
            return
        coming = (spent + SHORT_WAIT) * rest() / self._done
        if coming > SHORT_WAIT:
            self._foretold = spent + MAX_OVERRUN * coming
            log.warning(say(5 * max(1, round(coming / 5))))

    @contextmanager
    def blocked(self, why: str) -> Iterator[None]:
        """Around waiting for another process, which is said once if it takes long."""
        timer = Timer(SHORT_WAIT, self._say_blocked, (why,))
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()

    def _so_far(self) -> float:
        return self._spent + (0.0 if self._began is None else perf_counter() - self._began)

    def _say_blocked(self, why: str) -> None:
        if not self._blocked and not ranks()[0]:
            self._blocked = True
            log.warning(why)


class Turns:
    """Processes that would make the same file take turns: the next one finds it made.

    Locks, each on one byte of a file in the folder of what is made. The system frees the turn of a
    process that dies; where it has no locks, or a folder cannot be written, nobody waits.
    """

    def __init__(self) -> None:
        # never closed, as that would free all locks of the process on the file
        self._files: dict[Path, int] = {}
        self._held: set[Path] = set()

    def take(self, path: Path, *, wait: bool = True) -> bool:
        """Whether the turn to make a file is ours, at once or after whoever has it."""
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
            if path.parent not in self._files:
                file = os.open(path.parent / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o666)
                self._files[path.parent] = file
            fcntl.lockf(self._files[path.parent], how, 1, place)
        except OSError:  # held by others, not possible here, or each would wait for the other
            return False
        return True
