"""Settings of a run, and the record it fills."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

import numpy as np

from rom.errors import ConfigError
from rom.mbs.equations.packing import Packed
from rom.mbs.integrate.events import Instant, Noted, Watch
from rom.mbs.integrate.keeping import Keeping, until
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.signals import Span, padded, sampled
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State
from rom.model import Array
from rom.process.memory import check_memory, free_bytes
from rom.process.progress import Progress

MAX_STEPS = 10**12  # a million a second, as the fastest mechanisms take, for eleven days
ROUND_OFF = 1e-12  # of a time that was written in decimals
FIRST_STEP_RATIO = 1e-4  # first step of chosen length, relative to the duration
RUN_KEY = "of"  # the array by which a memory knows its state


@dataclass(frozen=True, slots=True)
class Settings:
    """Arguments of `rom.mbs.integrate.simulation.simulate`, checked one by one by it."""

    t_start: float
    t_end: float
    dt: float | None
    save_every: int
    rho_inf: float
    tolerance: float
    rtol: float
    atol: float
    progress: bool
    method: str = "generalized-alpha"
    origin: float | None = None
    taken: int = 0
    order: int = 2
    stabilised: bool = False
    begun: int = 0  # steps of this very run that were taken before it was interrupted

    def __post_init__(self) -> None:
        for fault, cure in self._faults():
            raise ConfigError(fault, hint=cure)

    def _faults(self) -> Iterator[tuple[str, str]]:
        """What cannot be run, and what to do instead."""
        duration = self.t_end - self.t_start
        if duration <= 0.0:
            text = f"t_end = {self.t_end:g} s is not after {self.t_start:g} s."
            yield text, "It is the time at the end, not how long the motion lasts."
        if self.order != 2 and self.method != "bdf":
            yield f"order = {self.order} is for bdf only.", 'Leave it out, or take method="bdf".'
        if self.order != 2 and self.dt is None:
            text = f"order = {self.order} needs steps of one length dt; chosen ones have order two."
            yield text, ""
        if self.stabilised and self.method == "dop853":
            text = "stabilised is for implicit methods; dop853 keeps the constraints of velocities"
            yield f"{text} to the tolerance of its steps.", "Leave it out."
        if self.dt is not None and not duration / self.dt <= MAX_STEPS:
            many = f"{duration / self.dt:.3g} steps to t_end = {self.t_end:g} s"
            text = f"dt = {self.dt:g} s takes {many}; at most {MAX_STEPS:.0e} are taken."
            yield text, "Take longer steps. They need to resolve what moves, not more."
        end = max(abs(self.t_start), abs(self.t_end))
        step = FIRST_STEP_RATIO * duration if self.dt is None else self.dt
        if end + step == end or not np.isfinite(duration):
            what = "the first step" if self.dt is None else "dt"
            text = f"{what} = {step:g} s is lost beside t = {end:g} s: numbers have sixteen digits."
            yield text, "Take longer steps, or count the time from the start of the run."

    @property
    def arguments(self) -> dict[str, object]:
        """What makes a run the one it is, beside its end."""
        names = ("t_start", "dt", "rho_inf", "tolerance", "rtol", "atol", "save_every", "order")
        values = {name: getattr(self, name) for name in names}
        exact = {name: None if x is None else float(x).hex() for name, x in values.items()}
        return {"method": self.method, **exact, "stabilised": self.stabilised}

    def check_room(self, packed: Packed) -> None:
        """Refuse to keep more instants than memory holds, before any of them is computed."""
        rows = 2 + (0 if self.dt is None else self.steps // int(self.save_every))
        signals, followed = len(packed.signals), packed.followed
        wide = 4 + packed.q.size + 2 * packed.v.size + packed.system.rows.kind.size + followed
        # the blocks, joined, and the prescribed functions beside them
        need, there = 8.0 * rows * (2 * wide + 3 * signals), free_bytes()
        fewer = f"save_every = {int(need / there) + 1} times {int(self.save_every)}"
        hint = f"Keep fewer of them, e.g. {fewer}, or take longer steps."
        check_memory(f"keeping {rows:.4g} instants", need, there, hint)

    @property
    def kind(self) -> str:
        """What a memory must be of to go on with it."""
        return self.method if self.dt else f"{self.method}, steps of chosen length"

    @property
    def both(self) -> bool:
        """Whether constraints hold for positions and velocities both."""
        return self.stabilised or self.order != 2

    @property
    def span(self) -> Span:
        """Start and end time [s]."""
        return self.t_start, max(self.t_end, self.time(self.steps))

    @property
    def steps(self) -> int:
        """Number of steps of at most dt; 1 if their length is not fixed."""
        if self.dt is None:
            return 1
        return max(1, int(np.ceil((self.t_end - self.t_start) / self.dt - 1e-6)))

    @property
    def h(self) -> float:
        """Length of a step [s]: dt itself if the duration is a multiple of it."""
        duration = self.t_end - self.t_start
        if self.dt is None:
            return duration
        round_off = 1e-13 * duration + 1e-15 * (abs(self.t_start) + abs(self.t_end))
        whole = abs(self.steps * self.dt - duration) < round_off
        return self.dt if whole else duration / self.steps

    @property
    def spacing(self) -> float:
        """Spacing of the finite differences of prescribed functions [s]."""
        if self.dt is None:
            return 1e-4 * (self.t_end - self.t_start)
        return max(self.h, 1e-4 * (self.t_end - self.t_start)) if self.steps > 4 else 0.05 * self.h

    def time(self, step: Any) -> Any:
        """Time after so many steps [s]; the same number in a run and in its continuation."""
        origin = self.t_start if self.origin is None else self.origin
        return origin + self.h * (self.taken + step)

    def after(self, state: State | None) -> "Settings":
        """The settings of a run that goes on from a state.

        Steps of one length are counted from the first one. Steps of chosen length go on with the
        length they had, which belongs to the whole duration.
        """
        if state is None or state.memory is None or state.memory.method != self.kind:
            return self
        memory = state.memory
        if RUN_KEY in memory.arrays:
            same = self.t_start == state.t and np.array_equal(memory.arrays[RUN_KEY], of(state))
            whole = self.dt is None or memory.h == replace(self, t_start=memory.origin).h
            if same and whole:
                return replace(self, t_start=memory.origin, begun=memory.taken)
        elif memory.h == self.h and memory.origin + memory.h * memory.taken == self.t_start:
            return replace(self, origin=memory.origin, taken=memory.taken)
        return self


def of(state: State) -> Array:
    """What a state must still be for a memory that is more than a factorisation to fit."""
    return np.concatenate([[state.t], state.q, state.v])


@dataclass
class Record:
    """What a run has produced so far."""

    mechanism: Mechanism
    packed: Packed
    settings: Settings
    clock: float  # when the stepping began, assembly and compilation done
    blocks: list[tuple[Array, ...]] = field(default_factory=list)  # (t, q, v, a, lam, work, base)
    t: float = 0.0  # reached
    final: State = None  # type: ignore[assignment]  # until the start
    given: State | None = None  # the run began from
    compiled: float = 0.0  # time in compiled code [s]
    counts: dict[str, float] = field(default_factory=dict)
    shown_at: float = 0.0
    progress: Progress | None = None  # what reports it, once it has
    watch: Watch | None = None  # over the events of the mechanism, None if it has none
    noted: Noted | None = None  # what the watch knew at ``final``
    keeping: Keeping | None = None  # folder that is written while the run lasts
    assemble: bool = False  # see `rom.simulate`
    seen: Instant | None = None  # what FMUs are told of

    def keep(self, t: Array | float, *arrays: Array) -> None:
        """Add saved instants."""
        self.blocks.append((np.atleast_1d(t), *arrays))

    def keep_state(self, state: State, work: Array) -> None:
        """Add a state as a saved instant."""
        arrays: tuple[Any, ...] = (state.q, state.v, state.a, state.lam, work, state.base)
        self.keep(state.t, *(x[None].copy() for x in arrays))

    def start(self, state: State, work: Array) -> None:
        """Save the first instant, unless the run goes on behind what it kept already."""
        self.t = state.t
        if not self.blocks:
            self.keep_state(state, work)
        if self.watch and self.noted:
            self.watch.recall(self.noted)
        elif self.watch:
            self.watch.begin(state)
        self.reach(state)

    def stand_still(self, state: State) -> None:
        """Let the motion kept before be all of it, up to the end that is asked for."""
        end = self.settings.t_end
        end += ROUND_OFF * abs(end)
        self.blocks = [until(block, end) for block in self.blocks]
        self.final = state
        if self.watch and self.noted:
            found = {k: [x for x in items if x[0] <= end] for k, items in self.noted.found.items()}
            counts = {k: len(items) for k, items in found.items()}
            self.watch.recall(Noted(self.noted.signs, counts, found))

    def reach(self, state: State, noted: Noted | None = None) -> None:
        """Note the last state, from which a run could go on, and the events up to there."""
        self.final = state
        self.noted = noted or (self.watch.noted() if self.watch else None)

    def keep_last(self) -> None:
        """Save the last state of a run that ends early, if it lies behind what was saved."""
        f = self.final
        if f.memory is not None and f.t > self.blocks[-1][0][-1]:
            arrays = f.memory.arrays
            self.keep_state(f, arrays["y"][-3:] if "y" in arrays else arrays["work"])

    @property
    def stopped(self) -> float | None:
        """Time of the event that ended the run."""
        return self.watch.stop[1] if self.watch and self.watch.stop else None

    def pause(self) -> None:
        """Between two steps: report the time on stderr and write what is to be kept, at times."""
        now = perf_counter()
        if self.keeping is not None and self.keeping.due(now):
            self.keeping.write(self.blocks, self.final, self.noted)
        if self.settings.progress and now - self.shown_at > 0.2:
            self.shown_at = now
            span = self.settings.t_end - self.settings.t_start
            self.progress = self.progress or Progress(span)
            self.progress.reach(self.t - self.settings.t_start, f"t = {self.t:.6g} s")

    def solution(self, status: str, *, failed: bool = False) -> Solution:
        """The motion so far; of one that failed, prescribed functions are NaN where they do."""
        if self.progress is not None:
            self.progress.end()
        pieces = zip(*self.blocks, strict=True)
        t, q, v, a, lam, work, base = (np.concatenate(piece) for piece in pieces)
        signals = np.full((t.size, len(self.packed.signals), 3), np.nan)
        span, spacing = self.settings.span, self.settings.spacing
        table, failure = sampled(self.packed.signals, padded(t), span, spacing)
        if failure is not None and not failed:
            raise failure
        signals[: len(table)] = table[: t.size]
        return Solution(
            *(self.mechanism, self.packed, t, q, v, a, lam, work - work[0], base, signals),
            *(self._statistics(), status, self.final),
            {} if self.watch is None else self.watch.occurrences,
        )

    def _statistics(self) -> dict[str, float]:
        total = perf_counter() - self.clock
        return {
            **self.counts,
            "rank": self.final.rank,
            "redundant": self.final.lam.size - self.final.rank,
            "closed": 0.0 if self.given is None else self.given.closed,
            "seconds": total,
            "seconds_compiled": self.compiled,
            "share_outside": 1.0 - self.compiled / total,
            "steps_per_second": self.counts.get("steps", 0) / total,
        }


@contextmanager
def standing_at(record: Record, state: State) -> Iterator[None]:
    """Let a run that fails inside stand at a state with which it can be repeated from there."""
    noted = record.noted
    try:
        yield
    except BaseException:
        record.reach(state, noted)
        raise
