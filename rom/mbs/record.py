"""Settings of a run, and the record it fills."""

import sys
from dataclasses import dataclass, field, replace
from numbers import Real
from time import perf_counter
from typing import Any

import numpy as np

from rom.errors import ConfigError
from rom.mbs.events import Watch
from rom.mbs.mechanism import Mechanism
from rom.mbs.multistep import LARGEST_ORDER
from rom.mbs.packing import Packed
from rom.mbs.signals import Span, sample_all
from rom.mbs.solution import Solution
from rom.mbs.state import Memory, State
from rom.model import Array


@dataclass(frozen=True, slots=True)
class Settings:
    """Checked arguments of `rom.mbs.integrate.simulate`."""

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

    def __post_init__(self):
        numbers = ("t_start", "t_end", "dt", "rho_inf", "tolerance", "rtol", "atol", "save_every")
        for name in numbers:
            value = getattr(self, name)
            if name == "dt" and value is None and self.method != "dop853":
                continue
            if isinstance(value, bool) or not isinstance(value, Real) or not np.isfinite(value):
                raise ConfigError(f"{name} = {value!r} is not a finite number.")
        if self.t_end <= self.t_start:
            raise ConfigError(f"t_end = {self.t_end:g} s is not after {self.t_start:g} s.")
        for name in ("dt", "tolerance", "rtol", "atol"):
            if getattr(self, name) is not None and getattr(self, name) <= 0.0:
                raise ConfigError(f"{name} = {getattr(self, name):g} must be positive.")
        if not 0.0 <= self.rho_inf <= 1.0:
            raise ConfigError(f"rho_inf = {self.rho_inf:g} is outside [0, 1].")
        if int(self.save_every) != self.save_every or self.save_every < 1:
            raise ConfigError(f"save_every = {self.save_every!r} is not a positive whole number.")
        self._check_kind()

    def _check_kind(self) -> None:
        """Order and stabilisation must be offered by the method."""
        if isinstance(self.order, bool) or self.order not in range(1, LARGEST_ORDER + 1):
            raise ConfigError(f"order = {self.order!r} is not 1, 2, 3, 4 or 5.")
        if self.order != 2 and self.method != "bdf":
            raise ConfigError(
                f"{self.method} has one order; order = {self.order} is for bdf only.",
                hint='Leave it out, or take method="bdf".',
            )
        if self.order != 2 and self.dt is None:
            raise ConfigError(
                f"bdf of order {self.order} needs steps of one length dt; steps of chosen length "
                "have order two."
            )
        if not isinstance(self.stabilised, bool):
            raise ConfigError(f"stabilised = {self.stabilised!r} is neither True nor False.")
        if self.stabilised and self.method == "dop853":
            raise ConfigError(
                "stabilised is for implicit methods; dop853 keeps the constraints of velocities "
                "to the tolerance of its steps."
            )

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
        return (
            self.dt if abs(self.steps * self.dt - duration) < round_off else duration / self.steps
        )

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

    def after(self, memory: Memory | None) -> "Settings":
        """The settings of a run that goes on, with its steps counted from the first one."""
        if memory is None or memory.h != self.h or self.dt is None:
            return self
        if memory.origin + memory.h * memory.taken != self.t_start:
            return self
        return replace(self, origin=memory.origin, taken=memory.taken)


def line(text: str) -> None:
    """Write text over the line of progress on stderr; an empty one clears it."""
    sys.stderr.write(f"\r{text:<60}" if text else f"\r{'':<60}\r")
    sys.stderr.flush()


@dataclass
class Record:
    """What a run has produced so far.

    Attributes:
        mechanism, packed, settings: of the run.
        clock: when the stepping began, assembly and compilation done.
        blocks: saved pieces (t, q, v, a, lam, work, base).
        t: time reached.
        final: last state reached.
        statistics: counts, and seconds in compiled code.
        watch: over the events of the mechanism, None if it has none.
    """

    mechanism: Mechanism
    packed: Packed
    settings: Settings
    clock: float
    blocks: list[tuple[Array, ...]] = field(default_factory=list)
    t: float = 0.0
    final: State | None = None
    compiled: float = 0.0
    counts: dict[str, int] = field(default_factory=dict)
    shown: float = 0.0
    watch: Watch | None = None

    def keep(self, t: Array, *arrays: Array) -> None:
        """Add saved instants."""
        self.blocks.append((np.atleast_1d(t), *arrays))

    def start(self, state: State) -> None:
        """Save the first instant."""
        self.t, self.final = state.t, state
        arrays = (state.q, state.v, state.a, state.lam, np.zeros(3), state.base)
        self.keep(np.array([state.t]), *(x[None].copy() for x in arrays))

    @property
    def stopped(self) -> float | None:
        """Time of the event that ended the run."""
        return self.watch.stop[1] if self.watch and self.watch.stop else None

    def show(self) -> None:
        """Report the time reached on stderr, at most five times a second."""
        now = perf_counter()
        if self.settings.progress and now - self.shown > 0.2:
            self.shown = now
            span = self.settings.t_end - self.settings.t_start
            share = (self.t - self.settings.t_start) / span
            line(f"t = {self.t:.6g} s  {100 * share:3.0f} %  {now - self.clock:.0f} s")

    def solution(self, status: str) -> Solution:
        """The motion so far."""
        if self.settings.progress:
            line("")
        t, *arrays = (np.concatenate(pieces) for pieces in zip(*self.blocks, strict=True))
        signals = sample_all(self.packed.signals, t, self.settings.span, self.settings.spacing)
        return Solution(
            *(self.mechanism, self.packed, t, *arrays, signals, self._statistics(), status),
            *(self.final, {} if self.watch is None else self.watch.occurrences),
        )

    def _statistics(self) -> dict[str, Any]:
        total = perf_counter() - self.clock
        return {
            **self.counts,
            "rank": self.final.rank,
            "redundant": self.final.lam.size - self.final.rank,
            "seconds": total,
            "seconds_compiled": self.compiled,
            "share_outside": 1.0 - self.compiled / total,
            "steps_per_second": self.counts.get("steps", 0) / total,
        }
