"""How far work of known length is: one line on stderr, by tqdm where that is installed."""

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from shutil import get_terminal_size
from threading import Event, Thread
from typing import Any

from rom.process.launcher import ranks

log = logging.getLogger("rom")
LOOK_INTERVAL = 0.2  # [s] between looks at work that somebody else does
MANY_DOFS = 20_000  # of a finite element model whose work takes long enough to say how far it is
TIME_FORMAT = "{percentage:3.0f}%|{bar}| {desc} [{elapsed}<{remaining}]"


class Progress:
    """A line of progress, written over itself."""

    def __init__(self, total: float):
        self.total = total
        self._bar: Any = None
        if _tqdm_in_notebook() or (sys.stderr.isatty() and find_spec("tqdm") is not None):
            from tqdm.auto import tqdm

            size = get_terminal_size()  # of a terminal without size tqdm would ask in vain
            at = {} if _tqdm_in_notebook() else {"ncols": size.columns - 1, "nrows": size.lines}
            how = {"bar_format": TIME_FORMAT, "leave": False, "file": sys.stderr}
            self._bar = tqdm(total=total, **how, **at)

    def reach(self, done: float, label: str) -> None:
        """Show that so much is done, with a few words."""
        if self._bar is None:
            line(f"{label}  {100 * done / self.total:3.0f} %")
            return
        self._bar.n = done
        self._bar.set_description_str(label)

    def end(self) -> None:
        """Clear the line."""
        if self._bar is None:
            line("")
        else:
            self._bar.close()


def line(text: str) -> None:
    """Write text over the line of progress on stderr; an empty one clears it."""
    sys.stderr.write(f"\r{text:<60}" if text else f"\r{'':<60}\r")
    sys.stderr.flush()


def looked_for() -> bool:
    """Whether progress is seen and wanted: on the first rank, and without ``-q``.

    On a terminal, or in a notebook where tqdm is installed.
    """
    seen = sys.stderr.isatty() or _tqdm_in_notebook()
    return not ranks()[0] and seen and log.isEnabledFor(logging.WARNING)


def _tqdm_in_notebook() -> bool:
    return "ipykernel" in sys.modules and find_spec("tqdm") is not None


@contextmanager
def stages(total: int, begun: int = 0, *, long: bool = True) -> Iterator[Callable[[str], None]]:
    """Around work in stages, begun of which had a line before; gives what takes their names."""
    if not (long and looked_for()):
        yield lambda label: None
        return
    progress = Progress(total)

    def begin(label: str) -> None:
        nonlocal begun
        progress.reach(min(begun, total), label)
        begun += 1

    try:
        yield begin
    finally:
        progress.end()


@contextmanager
def followed(total: int, label: str, done: Callable[[], int]) -> Iterator[None]:
    """Around waiting for another process, whose progress is asked for now and then."""
    if total < 2 or not looked_for():
        yield
        return
    progress, ended = Progress(total), Event()

    def follow() -> None:
        while not ended.wait(LOOK_INTERVAL):
            progress.reach(min(done(), total), label)

    thread = Thread(target=follow, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        progress.end()
