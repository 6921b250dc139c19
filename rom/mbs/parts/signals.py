"""Functions of time that a user prescribes, sampled for compiled code, and where they jump.

No mass follows a jump, and no step is short enough to see it: it is what halving an interval does
not make smaller; fast but smooth motion does get smaller.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rom.errors import ModelError, RomError, SolverError, warn
from rom.mbs.parts.foreign import KEPT_HINT, ask, real
from rom.model import Array

TimeFunction = Callable[[float], Any]  # of a user: number or vector
OfMany = Callable[[Any], Any]  # the same of arrays of times, too
Motion = tuple[OfMany, OfMany, OfMany]  # such a one, its rate and its acceleration
# first and last time a function may be asked for
Span = tuple[float, float]
# weights of f(t), f(t + s), ... f(t + 4 s) in 12 s f' and 12 s^2 f'', fourth and third order
FORWARD_WEIGHTS = np.array([[-25.0, 48.0, -36.0, 16.0, -3.0], [35.0, -104.0, 114.0, -56.0, 11.0]])
# weights of f(t - 4 s), ... f(t)
BACKWARD_WEIGHTS = np.array([[3.0, -16.0, 36.0, -48.0, 25.0], [11.0, -56.0, 114.0, -104.0, 35.0]])
# weights of f(t - 2 s), ... f(t + 2 s), fourth order
CENTRAL_WEIGHTS = np.array([[1.0, -8.0, 0.0, 8.0, -1.0], [-1.0, 16.0, -30.0, 16.0, -1.0]])
NO_SAMPLES = np.zeros((0, 0, 3))
MAX_INTERVALS = 4096  # in one pass
FEW_INTERVALS = 8  # at least
N_SUSPECTS = 4  # sharpest places that are looked at closely
JUMP_WIDTH_RTOL = 1e-9  # of the time looked at: both sides of a jump of the value
TIME_RTOL = 1e-15  # of a time, below which two times are one
DIFFERENCE_SPACING = 1e-4  # of an interval: points of a difference quotient
ROUND_OFF = 2e-12  # of value over rate: they lie further apart than that, or say nothing
NO_MOTION = 1e-15  # a jump [rad or m] smaller than any body: differences of numbers about one
SMALL_JUMP = 1e-6  # of the range of the values so far, that no reaction shows
VALUE_RTOL = 1e-12  # of the largest value
SMALL_KINK = 1e-2  # of the largest rate so far
RATE_RTOL = 0.05  # of the largest rate: difference of a given rate from that of the value
Function = Callable[[Array], Array]


@dataclass(frozen=True, slots=True)
class Jump:
    """Where a function of time jumps: just behind it [s], and the values on both sides."""

    t: float
    before: float
    after: float

    @property
    def size(self) -> float:
        """Difference of the values."""
        return self.after - self.before

    def said(self, digits: int) -> str:
        """Size, time by as many digits as it is known, and both values."""
        ends = f"from {self.before:.6g} to {self.after:.6g}"
        return f"jumps by {self.size:.4g} at t = {self.t:.{digits}g} s, {ends}"


def largest_jump(f: Function, t: Array, width: float, small: float) -> Jump | None:
    """The largest jump of a function of times (n,), equally spaced; None if it is continuous.

    Intervals are halved down to a width [s]; jumps below a small size do not count.
    """
    values = f(t)
    if not np.isfinite(values).all() or np.ptp(values) <= small:
        return None
    bend = np.abs(np.diff(values, 2))  # what a straight line does not explain
    inner = np.argsort(bend)[::-1][:N_SUSPECTS]
    places = {int(k) for j in inner if bend[j] > 0.1 * small for k in (j, j + 1)}
    halves = (_halved(f, t[k], t[k + 1], width) for k in sorted(places))
    found = [
        Jump(float(b), *map(float, f(np.clip([a - width, b + width], t[0], t[-1]))))
        for a, b in halves  # with what surrounds them
    ]
    jumps = [jump for jump in found if abs(jump.size) > max(small, 0.1 * bend.max(initial=0.0))]
    return max(jumps, key=lambda jump: abs(jump.size), default=None)


def _halved(f: Function, a: float, b: float, width: float) -> tuple[float, float]:
    """The steeper half of the steeper half ... of an interval."""
    before, after = f(np.array([a, b]))
    while b - a > width and a < (middle := 0.5 * (a + b)) < b:
        value = f(np.array([middle]))[0]
        if abs(after - value) > abs(value - before):
            a, before = middle, value
        else:
            b, after = middle, value
    return float(a), float(b)


@dataclass
class Examined:
    """A drive and what was found in it so far; never asked for times the run has not reached."""

    name: str
    function: Function
    rate: Function | None
    start: float  # of the times at which it was looked at [s]
    until: float = field(init=False)  # their end [s]
    low: float = np.inf  # range of its values
    high: float = -np.inf
    top: float = 0.0
    doubted: bool = False  # whether a doubt was said
    end: tuple[float, ModelError] | None = None  # when it stops to be a motion [s], and why

    def __post_init__(self) -> None:
        self.until = self.start

    def up_to(self, time: float, spacing: float) -> tuple[float, ModelError] | None:
        """Look on to a time by intervals of a spacing [s], warn of kinks; returns ``end``."""
        if self.end is None and time > self.until:
            first = max(self.start, self.until - spacing)
            n = int(np.clip(np.ceil((time - first) / spacing), FEW_INTERVALS, MAX_INTERVALS))
            t = np.linspace(first, time, n + 1)
            values = self.function(t)
            if np.isfinite(values).all():
                self.until = time
                self._look_at(t, values)
        return self.end

    def _look_at(self, t: Array, values: Array) -> None:
        self.low, self.high = min(self.low, values.min()), max(self.high, values.max())
        largest = max(abs(self.low), abs(self.high))
        small = max(SMALL_JUMP * (self.high - self.low), VALUE_RTOL * largest, NO_MOTION)
        width = max(JUMP_WIDTH_RTOL * (t[-1] - t[0]), TIME_RTOL * float(np.abs(t).max()))
        jump = largest_jump(self.function, t, width, small)
        if jump is not None:
            refusal = ModelError(
                f"drive {self.name!r} {jump.said(9)}: the bodies would need infinite velocity.",
                hint="Let it move there over several steps, or release a spring instead. The "
                "motion up to there is kept in error.solution.",
            )
            self.end = jump.t, refusal
        elif not self.doubted:
            self._look_at_rate(t, largest)

    def _look_at_rate(self, t: Array, largest: float) -> None:
        interval = t[1] - t[0]
        quotient = _quotient(self.function, (self.start, t[-1]), DIFFERENCE_SPACING * interval)
        speed = quotient if self.rate is None else self.rate
        values = speed(t)
        self.top = max(self.top, float(np.abs(values).max()))
        if not np.isfinite(values).all() or DIFFERENCE_SPACING * interval * self.top < max(
            ROUND_OFF * largest, NO_MOTION
        ):
            return
        kink = largest_jump(speed, t, 4 * DIFFERENCE_SPACING * interval, SMALL_KINK * self.top)
        doubt = kink and (
            f"the velocity of drive {self.name!r} {kink.said(6)}: the reactions there are those of "
            "an impact, and depend on the time step. Round the corner over several steps."
        )
        if self.rate is not None and not doubt:
            doubt = _contradiction(self.name, t, values, quotient(t))
        warn(doubt or "")
        self.doubted = bool(doubt)


def _quotient(function: Function, span: tuple[float, float], apart: float) -> Function:
    """Difference quotient of a function that is asked within its span only."""

    def rate(t: Array) -> Array:
        ends = np.clip(t - apart, *span), np.clip(t + apart, *span)
        low, high = (function(end) for end in ends)
        return (high - low) / (ends[1] - ends[0])

    return rate


def _contradiction(name: str, t: Array, given: Array, found: Array) -> str:
    miss = np.abs(given - found)
    k = int(np.argmax(miss))
    if miss[k] <= RATE_RTOL * max(np.abs(found).max(), np.abs(given).max()):
        return ""
    return (
        f"the rate given for drive {name!r} is {given[k]:.4g} at t = {t[k]:.6g} s, where its "
        f"value changes by {found[k]:.4g} per second: joint and velocity contradict each "
        "other. Check signs and units of the rate."
    )


@dataclass(frozen=True)
class Signal:
    """A function of time.

    Attributes:
        name: drive or load it belongs to.
        function: t -> number (drive) or (3,) vector (load).
        rate, acceleration: its derivatives, or None.
        width: 1 for a drive, 3 for a load, which may jump.
        looked: {span of a run: what was found in it so far}.
    """

    name: str
    function: TimeFunction
    rate: TimeFunction | None = None
    acceleration: TimeFunction | None = None
    width: int = 1
    looked: dict[Span, Examined] = field(default_factory=dict, compare=False, repr=False)

    def end(self, span: Span, time: float, spacing: float) -> tuple[float, RomError] | None:
        """When a drive stops to be a motion [s], and the error; None if it does not.

        Up to a time, at times a spacing [s] apart; within the span alone it is asked.
        """
        if self.width == 3 or self is CLOCK:
            return None
        if span not in self.looked:
            rate = None if self.rate is None else self._of_many(self.rate)
            self.looked[span] = Examined(self.name, self._of_many(self.function), rate, span[0])
        return self.looked[span].up_to(min(time, span[1]), spacing)

    def _of_many(self, function: TimeFunction) -> Function:
        return lambda t: self._values(function, t)[:, 0]

    def sample(self, t: Array, span: Span, spacing: float) -> Array:
        """(n, 3) value [m or rad] of a drive and its rates, or force [N] or moment [N m].

        At times (n,) within a span, with differences of a spacing [s] for missing derivatives.
        """
        t = np.clip(t, *span)
        if self is CLOCK:
            return np.column_stack([t, 1.0 + 0.0 * t, 0.0 * t])
        if self.width == 3:
            return self._values(self.function, t)
        value = self._values(self.function, t)[:, 0]
        steps = (("rate", 0, spacing), ("acceleration", 1, spacing**2))
        given = [
            self._values(f, t, name)[:, 0]
            if (f := getattr(self, name))
            else self._difference(t, span, order, spacing) / scale
            for name, order, scale in steps
        ]
        return np.column_stack([value, *given])

    def _difference(self, t: Array, span: Span, order: int, spacing: float) -> Array:
        early, late = t - 2 * spacing < span[0], t + 2 * spacing > span[1]
        first = np.where(early, t, np.where(late, t - 4 * spacing, t - 2 * spacing))
        grid = np.clip(first[:, None] + spacing * np.arange(5), *span)  # round-off leads beyond
        values = self._values(self.function, grid.ravel())[:, 0].reshape(-1, 5)
        weights = np.where(late[:, None], BACKWARD_WEIGHTS[order], CENTRAL_WEIGHTS[order])
        weights = np.where(early[:, None], FORWARD_WEIGHTS[order], weights)
        # differences to one value first, so that a constant has the derivative zero exactly
        return ((values - values[:, :1]) * weights).sum(axis=1) / 12

    def _values(self, function: TimeFunction, t: Array, which: str = "function") -> Array:
        """(n, width) values; one that is not finite is left for `first_failure` to tell."""
        many = _at_once(function, t, self.width)
        if many is not None:
            return many
        what, width = f"the {which} of {self.name!r}", self.width
        needed = "a number" if width == 1 else f"a vector of {width} numbers"
        times = map(float, t)
        values = [real(what, x, ask(what, x, function, x), (width,), needed) for x in times]
        return np.array(values).reshape(-1, width)


def _at_once(function: OfMany, t: Array, width: int) -> Array | None:
    """Values at all times by one call, if the function can do that and agrees with itself."""
    if t.size < 4 or width != 1:
        return None
    try:
        many = np.asarray(function(t), dtype=float)
        probe = [float(function(float(t[k]))) for k in (0, t.size // 2, -1)]
    except KeyboardInterrupt:
        raise
    except BaseException:  # whatever a function of one number does with an array
        return None
    # to round-off, not to the bit: powers of arrays and of numbers differ in the last one
    if many.shape != t.shape or not np.allclose(many[[0, t.size // 2, -1]], probe, 1e-13, 1e-300):
        return None
    return many[:, None]


CLOCK = Signal("clock", lambda t: t)  # which tells the time


def drive_signal(name: str, drive: Any) -> Signal:
    """Signal of a prescribed joint coordinate."""
    return Signal(name, drive.function, drive.rate, drive.acceleration)


def transition(low: float, high: float, duration: float, start: float = 0.0) -> Motion:
    """From one value to another on a cycloid, in a time [s] from a start [s] on.

    It is low + (high - low) (s - sin(2 pi s) / 2 pi) with s = (t - start) / duration.
    """
    w, rise = 2 * np.pi, high - low

    def s(t: Array) -> Array:
        return np.clip((t - start) / duration, 0.0, 1.0)

    return (
        lambda t: low + rise * (s(t) - np.sin(w * s(t)) / w),
        lambda t: rise / duration * (1 - np.cos(w * s(t))),
        lambda t: rise / duration**2 * w * np.sin(w * s(t)),
    )


def run_up(rate: float, duration: float) -> Motion:
    """From rest to a steady rate, which rises without a jolt as in `transition`."""
    k, (speed, acceleration, _) = 2 * np.pi / duration, transition(0.0, rate, duration)

    def value(t: Array) -> Array:
        s = np.clip(t, 0.0, duration)
        rising = s * s / (2 * duration) - np.sin(k * s / 2) ** 2 / (np.pi * k)
        return rate * (rising + np.maximum(t - duration, 0.0))

    return value, speed, acceleration


def sample_all(signals: tuple[Signal, ...], t: Array, span: Span, spacing: float) -> Array:
    """(n, s, 3) all signals at all times."""
    out = np.zeros((t.size, len(signals), 3))
    for k, signal in enumerate(signals):
        out[:, k] = signal.sample(t, span, spacing)
    return out


def sampled(
    signals: tuple[Signal, ...], t: Array, span: Span, spacing: float, step: float | None = None
) -> tuple[Array, RomError | None]:
    """(k, s, 3) all signals at the times before the first one at which one of them fails.

    With the error of the failure; None if k is the number of times. They are asked within the
    span of the run, by differences of a spacing [s], and looked through for jumps by its step [s],
    None where that has been done.
    """
    try:
        table = sample_all(signals, t, span, spacing)
    except RomError as failure:
        return _before(signals, t, (span, spacing, step), failure)
    looked = () if step is None else (span, step)
    good, lack = first_failure(signals, t, table, *looked)
    return table[:good], None if good == t.size else lack


def _before(
    signals: tuple[Signal, ...], t: Array, how: tuple[Span, float, float | None], failure: RomError
) -> tuple[Array, RomError]:
    """What can be sampled before a failure, and the first failure."""
    for k in range(t.size):
        try:
            sample_all(signals, t[k : k + 1], *how[:2])
        except RomError as first:
            table, earlier = sampled(signals, padded(t[:k]), *how) if k else (NO_SAMPLES, None)
            return table[:k].reshape(-1, len(signals), 3), earlier or first
    return NO_SAMPLES.reshape(0, len(signals), 3), failure  # of a function that changes its mind


def padded(t: Array) -> Array:
    """At least four times, for which functions are called at once: the same bits in any chunk."""
    return np.append(t, np.repeat(t[-1:], max(0, 4 - t.size)))


def first_failure(
    signals: tuple[Signal, ...],
    t: Array,
    table: Array,
    span: Span = (-np.inf, np.inf),
    spacing: float = 1.0,
) -> tuple[int, RomError]:
    """Number of good instants before the first one that is no motion, and its error.

    Of samples (n, s, 3) at ascending times (n,). Drives are looked through for jumps by steps of a
    spacing [s] if the span of the run is finite.
    """
    bad = ~np.isfinite(table).all(axis=2)
    asked = signals if np.isfinite(span).all() else ()
    ends = [signal.end(span, float(t[-1]), spacing) for signal in asked]
    good, failure = t.size, RomError("")
    for time, error in filter(None, ends):
        if np.searchsorted(t, time) < good:
            good, failure = int(np.searchsorted(t, time)), error
    k = int(np.argmax(bad.any(axis=1)))
    if not bad.any() or good <= k:
        return good, failure
    name = signals[int(np.argmax(bad[k]))].name
    return k, SolverError(
        f"the function of {name!r} gives {table[k, int(np.argmax(bad[k]))].tolist()} at "
        f"t = {t[k]:.9g} s.",
        hint=KEPT_HINT,
    )
