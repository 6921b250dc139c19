"""Jumps of prescribed motions: no mass follows them, and no step is short enough to see them.

A jump is what halving an interval does not make smaller; fast but smooth motion does get smaller.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rom.errors import ModelError
from rom.model import Array
from rom.plausible import warn

INTERVALS = 4096  # at most, over a run
FEW_INTERVALS = 64  # at least
SUSPECTS = 4  # sharpest places of a run that are looked at closely
CLOSE = 1e-10  # of the run: both sides of a jump of the value
APART = 1e-8  # of the run: points of a difference quotient, so that round-off stays below 1e-6
SMALL_JUMP = 1e-6  # of the range of the values, that no reaction shows
SMALL_KINK = 1e-2  # of the largest rate
CONTRADICTION = 0.05  # of the largest rate, by which a given rate may miss that of the value
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
    inner = np.argsort(bend)[::-1][:SUSPECTS]
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


def examine(
    name: str, function: Function, rate: Function | None, span: tuple[float, float], spacing: float
) -> tuple[float, ModelError] | None:
    """Look for jumps of a drive over a run.

    Args:
        name: of the drive.
        function: its values (n,) at times (n,).
        rate: its derivative, if it is given.
        span: start and end of the run [s].
        spacing: of its steps [s].

    Returns:
        The time from which on the drive is no motion, and the error that says so.

    Warns:
        RomWarning: if its velocity jumps, or is not the one that is given.
    """
    T = span[1] - span[0]
    if not np.isfinite(T) or T <= 0.0:
        return None
    n = int(np.clip(np.ceil(T / spacing), FEW_INTERVALS, INTERVALS))
    t = np.linspace(*span, n + 1)
    values = function(t)
    if not np.isfinite(values).all():
        return None  # a message of its own waits at that time
    jump = largest_jump(function, t, CLOSE * T, SMALL_JUMP * float(np.ptp(values)))
    if jump is not None:
        return jump.t, _refusal(name, jump)
    quotient = _quotient(function, span, APART * T)
    speed = quotient if rate is None else rate
    top = float(np.abs(speed(t)).max())
    kink = largest_jump(speed, t, 4 * APART * T, SMALL_KINK * top)
    if kink is not None:
        warn(
            f"the velocity of drive {name!r} jumps by {kink.size:.4g} at t = {kink.t:.6g} s, from "
            f"{kink.before:.4g} to {kink.after:.4g}: the reactions there are those of an impact, "
            "and depend on the time step. Round the corner over several steps."
        )
    elif rate is not None:
        _warn_of_contradiction(name, t, rate(t), quotient(t))
    return None


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
        found: Array = (high - low) / (ends[1] - ends[0])
        return found

    return rate


def _warn_of_contradiction(name: str, t: Array, given: Array, found: Array) -> None:
    miss = np.abs(given - found)
    k = int(np.argmax(miss))
    if miss[k] > CONTRADICTION * np.abs(found).max():
        warn(
            f"the rate given for drive {name!r} is {given[k]:.4g} at t = {t[k]:.6g} s, where its "
            f"value changes by {found[k]:.4g} per second: joint and velocity contradict each "
            "other. Check signs and units of the rate."
        )
