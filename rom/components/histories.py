"""What changes in time: pulses, harmonic motion, records, ramps.

A history is a number, a function of an array of times [s] that gives as many values, such as a
`Table`, or a pair of times and values, which holds its first and its last value.

Source:
    Pulses: Housner, The behavior of inverted pendulum structures during earthquakes, Bull. Seism.
    Soc. Am. 53 (1963) 403; Zhang and Makris, Rocking response of free-standing blocks under
    cycloidal pulses, J. Eng. Mech. 127 (2001) 473.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from rom.arguments import Number, Positive, is_number, positive, typed
from rom.errors import ConfigError, FileFormatError
from rom.model import Array

MAX_GAP_RATIO = 1.5  # longest interval of a record over its usual one; more is a gap
MAX_HALVINGS = 20  # of 256 intervals: jumps of functions become as steep as 4e-9 of the span
STRAIGHT_RTOL = 1e-5  # of the largest value: how far lines stray from a function
Pair = tuple[npt.ArrayLike, npt.ArrayLike]
History = float | Callable[[Array], Array] | Pair


@dataclass(frozen=True)
class Table:
    """Straight lines between points of a history.

    Attributes:
        t: (n,) times, increasing [s].
        values: (n,) values [unit of the history].

    Raises:
        ConfigError: if the points are no history.
    """

    t: npt.ArrayLike
    values: npt.ArrayLike

    def __post_init__(self) -> None:
        t, _ = corners_of("the history", (self.t, self.values))
        if len(t) < 2 or np.ndim(self.values) > 1:
            shapes = f"{t.shape} times and {np.shape(self.values)} values"
            raise ConfigError(f"the history has {shapes}; two or more of each are needed.")

    def __call__(self, t: Array) -> Array:
        """Values at times (m,) [s] within the history."""
        known, values = np.asarray(self.t, dtype=float), np.asarray(self.values, dtype=float)
        for at in (np.min(t), np.max(t)):
            if not known[0] <= at <= known[-1]:
                text = f"the history runs from {known[0]:g} s to {known[-1]:g} s; asked is"
                hint = "Add points up to the end of the run, zeros after an earthquake."
                raise ConfigError(f"{text} t = {at:g} s.", hint=hint)
        return np.interp(t, known, values)


def recorded(t: npt.ArrayLike, values: npt.ArrayLike) -> Table:
    """A record at equal intervals.

    At times t (n,) [s] it has values (n,) [unit of the history].

    Raises:
        ConfigError: if it is no history, or samples are missing.
    """
    table = Table(t, values)
    times = np.asarray(t, dtype=float)
    usual, longest = float(np.median(np.diff(times))), int(np.argmax(np.diff(times)))
    if times[longest + 1] - times[longest] > MAX_GAP_RATIO * usual:
        text = f"the record has a gap from {times[longest]:g} s to {times[longest + 1]:g} s"
        hint = "Fill the gap, or use Table if straight lines over it are meant."
        raise ConfigError(f"{text}; samples are {usual:g} s apart elsewhere.", hint=hint)
    return table


@typed
def read_record(path: str | Path, *, scale: float = 1.0) -> Table:
    """A record from a text file of two columns, time [s] and value; # begins a comment.

    Columns are parted by commas or blanks; values are scaled [1], as by 9.81 for those in g.

    Raises:
        FileFormatError: if the file has no two columns of numbers.
        ConfigError: as `recorded`.
    """
    try:
        text = Path(path).read_text(encoding="utf-8").replace(",", " ")
        columns = np.loadtxt(text.splitlines(), ndmin=2)
    except (OSError, ValueError) as error:
        raise FileFormatError(f"{path} is no record: {error}") from error
    if columns.shape[1] != 2:
        text = f"{path} has {columns.shape[1]} columns."
        raise FileFormatError(text, hint="Write time and value.")
    return recorded(columns[:, 0], scale * columns[:, 1])


@typed
def sine(
    amplitude: float,
    period: Annotated[float, Positive("s")],
    *,
    cycles: float = np.inf,
    phase: Annotated[float, Number("rad")] = 0.0,
) -> History:
    """Harmonic motion, or a pulse of some cycles of it: half a one, one, ten.

    Args:
        amplitude: of the value [unit of the history].
        period: [s].
        cycles: after which it ends [1].
        phase: at the start [rad].

    Raises:
        ConfigError: if there is no such motion.
    """
    positive("cycles", cycles, infinite=True)

    def values(t: Array) -> Array:
        turns = np.asarray(t) / period
        return np.where(turns <= cycles, amplitude * np.sin(2 * np.pi * turns + phase), 0.0)

    return values


@typed
def rectangle(amplitude: float, duration: Annotated[float, Positive("s")]) -> History:
    """A value that stays for a time [s] and ends."""
    return lambda t: np.where(np.asarray(t) < duration, amplitude, 0.0)


@typed
def ramp(duration: Annotated[float, Positive("s")]) -> History:
    """From 0 to 1 along half a cosine in a time [s], and 1 from there on."""
    return lambda t: (1 - np.cos(np.pi * np.clip(np.asarray(t) / duration, 0.0, 1.0))) / 2


def corners_of(name: str, pair: Pair, n: int = 1, *, rows: bool = False) -> tuple[Array, Array]:
    """Times (m,) [s] and values (m, n) [unit of the history] of a pair.

    Values may be (m,) or (m, n) [unit of the history]; with ``rows`` values (m,) do not stand for
    all columns.
    """
    try:
        t, y = (np.asarray(x, dtype=float) for x in pair)
    except (TypeError, ValueError) as error:
        text = f"{name}: its history must be a number, a function, or a pair of times and values"
        raise ConfigError(f"{text}, made of numbers.") from error
    if t.ndim != 1 or not t.size or y.shape[:1] != t.shape:
        hint = "One value, or row of values, for each; functions are written for arrays."
        raise ConfigError(f"{name}: times of the shape {t.shape} with values {y.shape}.", hint=hint)
    y = np.repeat(y[:, None], n, axis=1) if y.ndim == 1 and not rows else y
    if y.shape != (len(t), n):
        raise ConfigError(f"{name}: values {y.shape}, needed are {(len(t), n)}.")
    finite_rows = np.isfinite(t) & np.isfinite(y).all(axis=1)
    if not finite_rows.all():
        k = int(finite_rows.argmin())
        text = f"{name}: value {k} is {y[k].tolist()} at t = {t[k]:g} s, needed are finite numbers"
        raise ConfigError(f"{text}; fill gaps of the record, or cut it there.")
    if not (np.diff(t) > 0).all():
        k = int(np.argmin(np.diff(t) > 0))
        raise ConfigError(f"{name}: times must grow: {t[k]} s comes before {t[k + 1]} s.")
    return t, y


def straightened(
    name: str, history: History, span: tuple[float, float], n: int = 1, *, rows: bool = False
) -> tuple[Array, Array]:
    """Times (m,) [s] and values (m, n) [unit of the history] between which lines follow it.

    Lines stray from functions by 1e-5 of the largest value at most, where those have no jumps.

    A function may return (k,) or (k, n) for (k,) times; with ``rows`` values (k,) do not stand for
    all columns. The span is the first and the last time that are needed [s].
    """
    if not callable(history):
        pair: Any = ((0.0,), (history,)) if is_number(history) else history
        return corners_of(name, pair, n, rows=rows)
    if isinstance(history, Table):
        history(np.array(span))
        return corners_of(name, (history.t, history.values), n, rows=rows)
    t = np.linspace(*span, 257)
    y = corners_of(name, (t, history(t)), n, rows=rows)[1]
    bent = np.ones(len(t) - 1, dtype=bool)
    for _ in range(MAX_HALVINGS):
        k = np.flatnonzero(bent)
        if not k.size:
            break
        middle = (t[k] + t[k + 1]) / 2
        there = corners_of(name, (middle, history(middle)), n, rows=rows)[1]
        off = np.abs(there - (y[k] + y[k + 1]) / 2).max(axis=1) > STRAIGHT_RTOL * np.abs(y).max()
        t, y = np.insert(t, k + 1, middle), np.insert(y, k + 1, there, axis=0)
        left = (k + np.arange(len(k)))[off]
        bent = np.zeros(len(t) - 1, dtype=bool)
        bent[left] = bent[left + 1] = True
    return t, y


def values_at(name: str, history: History, t: Array) -> Array:
    """(n,) values of a history at times t (n,) [s]."""
    if callable(history):
        return corners_of(name, (t, history(t)))[1][:, 0]
    times, values = straightened(name, history, (t[0], t[-1]))
    return np.interp(t, times, values[:, 0])
