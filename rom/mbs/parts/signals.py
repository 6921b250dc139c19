"""Functions of time that a user prescribes, sampled for compiled code."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rom.errors import RomError, SolverError
from rom.mbs.parts.foreign import KEPT_HINT, ask, real
from rom.mbs.parts.jumps import Examined
from rom.model import Array

# a function of time (numbers and arrays) with its rate and acceleration
Motion = tuple[Callable[[Any], Any], Callable[[Any], Any], Callable[[Any], Any]]
# first and last time a function may be asked for
Span = tuple[float, float]
# weights of f(t), f(t + s), ... f(t + 4 s) in 12 s f' and 12 s^2 f'', fourth and third order
FORWARD_WEIGHTS = np.array([[-25.0, 48.0, -36.0, 16.0, -3.0], [35.0, -104.0, 114.0, -56.0, 11.0]])
# weights of f(t - 4 s), ... f(t)
BACKWARD_WEIGHTS = np.array([[3.0, -16.0, 36.0, -48.0, 25.0], [11.0, -56.0, 114.0, -104.0, 35.0]])
# weights of f(t - 2 s), ... f(t + 2 s), fourth order
CENTRAL_WEIGHTS = np.array([[1.0, -8.0, 0.0, 8.0, -1.0], [-1.0, 16.0, -30.0, 16.0, -1.0]])
NO_SAMPLES = np.zeros((0, 0, 3))


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
    function: Callable[[float], Any]
    rate: Callable[[float], Any] | None = None
    acceleration: Callable[[float], Any] | None = None
    width: int = 1
    looked: dict[Span, Examined] = field(default_factory=dict, compare=False, repr=False)

    def end(self, span: Span, time: float, spacing: float) -> tuple[float, RomError] | None:
        """When a drive stops to be a motion [s], and the error; None if it does not.

        Args:
            span: no time before the first or after the second one is asked for.
            time: up to which to look [s].
            spacing: of the times that are looked at [s].
        """
        if self.width == 3:
            return None
        if span not in self.looked:
            rate = None if self.rate is None else self._of_many(self.rate)
            self.looked[span] = Examined(self.name, self._of_many(self.function), rate, span[0])
        return self.looked[span].up_to(min(time, span[1]), spacing)

    def _of_many(self, function: Callable[[float], Any]) -> Callable[[Array], Array]:
        return lambda t: self._values(function, t)[:, 0]

    def sample(self, t: Array, span: Span, spacing: float) -> Array:
        """Value, rate and acceleration of a drive, or the vectors of a load.

        Args:
            t: (n,) times [s].
            span: no time before the first or after the second one is asked for.
            spacing: of the finite differences for missing derivatives [s].

        Returns:
            (n, 3): value [m or rad] and its rates per second, or force [N] or moment [N m].
        """
        t = np.clip(t, *span)
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

    def _values(self, function: Callable[[float], Any], t: Array, which: str = "function") -> Array:
        """(n, width) values; one that is not finite is left for `first_failure` to tell."""
        many = _at_once(function, t, self.width)
        if many is not None:
            return many
        what, width = f"the {which} of {self.name!r}", self.width
        needed = "a number" if width == 1 else f"a vector of {width} numbers"
        times = map(float, t)
        values = [real(what, x, ask(what, x, function, x), (width,), needed) for x in times]
        return np.array(values).reshape(-1, width)


def _at_once(function: Callable[[Any], Any], t: Array, width: int) -> Array | None:
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


def drive_signal(name: str, drive: Any) -> Signal:
    """Signal of a prescribed joint coordinate."""
    return Signal(name, drive.function, drive.rate, drive.acceleration)


def clock_signal() -> Signal:
    """The time itself, for laws that ask for it."""
    return Signal("clock", lambda t: t, lambda t: 1.0 + 0.0 * t, lambda t: 0.0 * t)


def transition(low: float, high: float, duration: float, start: float = 0.0) -> Motion:
    """From one value to another on a cycloid, in a time [s] from a start [s] on.

    It is low + (high - low) (s - sin(2 pi s) / 2 pi) with s = (t - start) / duration.
    """
    w, rise = 2 * np.pi, high - low

    def s(t: Any) -> Any:
        return np.clip((t - start) / duration, 0.0, 1.0)

    return (
        lambda t: low + rise * (s(t) - np.sin(w * s(t)) / w),
        lambda t: rise / duration * (1 - np.cos(w * s(t))),
        lambda t: rise / duration**2 * w * np.sin(w * s(t)),
    )


def run_up(rate: float, duration: float) -> Motion:
    """From rest to a steady rate, which rises without a jolt as in `transition`."""
    k, (speed, acceleration, _) = 2 * np.pi / duration, transition(0.0, rate, duration)

    def value(t: Any) -> Any:
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

    Args:
        signals: drives and loads.
        t: (n,) ascending times.
        span: first and last time of the run.
        spacing: of finite differences [s].
        step: of the run [s], to look through drives for jumps; None where that has been done.

    Returns:
        Their values, and the error of the failure; None if k is the number of times.
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

    Args:
        signals: drives and loads.
        t: (n,) ascending times.
        table: (n, s, 3) their samples.
        span: first and last time of the run; drives are looked through for jumps if it is finite.
        spacing: of the steps of the run [s].
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
