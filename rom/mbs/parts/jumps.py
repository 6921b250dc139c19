"""Jumps of prescribed motions: no mass follows them, and no step is short enough to see them.

A jump is what halving an interval does not make smaller; fast but smooth motion does get smaller.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from rom.errors import ModelError, warn
from rom.model import Array

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
    """Where a function of time jumps.

    Attributes:
        t: time just behind it [s].
        before, after: values.
    """

    t: float
    before: float
    after: float

    @property
    def size(self) -> float:
        """Difference of the values."""
        return self.after - self.before


def largest_jump(f: Function, t: Array, width: float, small: float) -> Jump | None:
    """The largest jump of a function, None if it is continuous.

    Args:
        f: values (n,) at times (n,).
        t: (n,) equally spaced times.
        width: intervals are halved down to it [s].
        small: size below which a jump does not count.
    """
    values = f(t)
    if not np.isfinite(values).all() or np.ptp(values) <= small:
        return None
    bend = np.abs(np.diff(values, 2))  # what a straight line does not explain
    inner = np.argsort(bend)[::-1][:N_SUSPECTS]
    places = {int(k) for j in inner if bend[j] > 0.1 * small for k in (j, j + 1)}
    found = [_wider(f, _halved(f, t[k], t[k + 1], width), width, t) for k in sorted(places)]
    jumps = [jump for jump in found if abs(jump.size) > max(small, 0.1 * bend.max(initial=0.0))]
    return max(jumps, key=lambda jump: abs(jump.size), default=None)


def _wider(f: Function, place: tuple[float, float], width: float, t: Array) -> Jump:
    """What an interval and its surroundings hold of a jump."""
    ends = np.clip([place[0] - width, place[1] + width], t[0], t[-1])
    before, after = f(ends)
    return Jump(float(place[1]), float(before), float(after))


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
    """A drive and what was found in it so far; never asked for times that the run has not reached.

    Attributes:
        name: of the drive.
        function: its values (n,) at times (n,).
        rate: its derivative, if it is given.
        start: first time of the run [s].
        until: time up to which it was looked at [s].
        low, high: least and largest value.
        top: largest rate.
        doubted: whether a doubt was said; one is enough.
        end: time from which on the drive is no motion, and the error that says so.
    """

    name: str
    function: Function
    rate: Function | None
    start: float
    until: float = field(init=False)
    low: float = np.inf
    high: float = -np.inf
    top: float = 0.0
    doubted: bool = False
    end: tuple[float, ModelError] | None = None

    def __post_init__(self) -> None:
        self.until = self.start

    def up_to(self, time: float, spacing: float) -> tuple[float, ModelError] | None:
        """Look on to a time by intervals of a spacing [s]; returns ``end``.

        Warns:
            RomWarning: if the velocity jumps, or is not the one that is given.
        """
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
            self.end = jump.t, _refusal(self.name, jump)
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
        doubt = "" if kink is None else _kink(self.name, kink)
        if self.rate is not None and not doubt:
            doubt = _contradiction(self.name, t, values, quotient(t))
        warn(doubt)
        self.doubted = bool(doubt)


def _kink(name: str, kink: Jump) -> str:
    return (
        f"the velocity of drive {name!r} jumps by {kink.size:.4g} at t = {kink.t:.6g} s, from "
        f"{kink.before:.4g} to {kink.after:.4g}: the reactions there are those of an impact, "
        "and depend on the time step. Round the corner over several steps."
    )


def _refusal(name: str, jump: Jump) -> ModelError:
    return ModelError(
        f"drive {name!r} jumps by {jump.size:.4g} at t = {jump.t:.9g} s, from {jump.before:.6g} to "
        f"{jump.after:.6g}: the bodies would need infinite velocity.",
        hint="Let it move there over several steps, or release a spring instead. The motion up to "
        "there is kept in error.solution.",
    )


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
