"""Where the time of long work goes: seconds by stages, and by pieces of work within them."""

from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from time import perf_counter

from rom.process.launcher import ranks
from rom.process.memory import peak_bytes

# pieces that stages have in common; the rest of a stage belongs to none
FACTORISATION_PIECE, SOLUTION_PIECE = "factorisations", "solutions"
SEARCH_PIECE, REST_PIECE = "searches", "rest"
MEGABYTE_SIZE = 1e6  # [bytes]
# numbers that pieces of work leave with the stage under way
FLOPS_NOTE, MISS_NOTE = "flops of the largest factorisation", "probability of a missed mode"
RESIDUAL_NOTE = "largest residual of a mode"  # in the norm of K^-1, of the mode


class Stopwatch:
    """Seconds of stages that follow each other, and of pieces within each."""

    def __init__(self) -> None:
        # by stage and piece; what lies within another piece counts there alone
        self.stages: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))  # [s]
        self.counts: dict[str, Counter[str]] = defaultdict(Counter)  # how often
        self.peaks: dict[str, float] = {}  # largest memory so far, at the end of a stage [MB]
        self.notes: dict[str, dict[str, float]] = defaultdict(dict)
        self._stage, self._pieces, self._since = "", [REST_PIECE], perf_counter()

    def begin(self, stage: str) -> None:
        """End the stage before and begin another, or one of that name once more."""
        self.end()
        self._stage = stage

    def end(self) -> None:
        """End the stage under way, if there is one."""
        self._charge()
        if self._stage:
            self.peaks[self._stage] = peak_bytes() / MEGABYTE_SIZE
        self._stage = ""

    def enter(self, piece: str) -> None:
        """From here on time belongs to this piece of the stage."""
        self._charge()
        self._pieces.append(piece)
        if self._stage:
            self.counts[self._stage][piece] += 1

    def leave(self) -> None:
        """From here on time belongs to what was under way before."""
        self._charge()
        self._pieces.pop()

    def note(self, name: str, value: float) -> None:
        """Keep a number with the stage under way, the largest of that name."""
        if self._stage:
            notes = self.notes[self._stage]
            notes[name] = max(notes.get(name, value), value)

    @property
    def seconds(self) -> float:
        """Of all stages so far [s]."""
        return sum(sum(pieces.values()) for pieces in self.stages.values())

    def table(self) -> dict[str, dict[str, float]]:
        """{stage: {"seconds", "MB", "ranks", pieces, numbers, notes}} of one rank."""
        return {
            stage: {
                "seconds": round(sum(pieces.values()), 4),
                "MB": round(self.peaks[stage], 1),
                "ranks": ranks()[1],
                **{piece: round(seconds, 4) for piece, seconds in pieces.items()},
                **{f"number of {piece}": n for piece, n in self.counts[stage].items()},
                **self.notes[stage],
            }
            for stage, pieces in self.stages.items()
        }

    def _charge(self) -> None:
        now = perf_counter()
        if self._stage:
            self.stages[self._stage][self._pieces[-1]] += now - self._since
        self._since = now


_running: ContextVar[Stopwatch | None] = ContextVar("stopwatch", default=None)


@contextmanager
def stopwatch() -> Iterator[Stopwatch]:
    """Around work whose pieces are timed; one within another has its own."""
    watch = Stopwatch()
    before = _running.set(watch)
    try:
        yield watch
    finally:
        watch.end()
        _running.reset(before)


@contextmanager
def piece(name: str) -> Iterator[None]:
    """Around a piece of work, wherever it is called from; nothing happens where nobody times."""
    watch = _running.get()
    if watch is None:
        yield
        return
    watch.enter(name)
    try:
        yield
    finally:
        watch.leave()


def note(name: str, value: float) -> None:
    """Keep a number with the stage under way, where somebody times."""
    watch = _running.get()
    if watch is not None:
        watch.note(name, value)
