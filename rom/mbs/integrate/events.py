"""Events: instants at which a function of the motion passes through zero."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from scipy.optimize import brentq

from rom.errors import ConfigError
from rom.mbs.equations.equations import evaluate
from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.work import workspace
from rom.mbs.mechanism import Event, Mechanism
from rom.mbs.parts.foreign import ask, numbers
from rom.mbs.parts.joints import coordinate_of
from rom.mbs.results.recomputed import Seen
from rom.mbs.results.solution import Occurrences
from rom.mbs.results.state import State
from rom.mbs.results.whereabouts import Whereabouts
from rom.model import Array

START_ATOL = 1e-10  # time after the start [s] within which a zero is the start, not an event
ROOT_RTOL = 1e-14  # of the step

Motion = Callable[[float], tuple[Array, Array]]


class Instant(Whereabouts):
    """What an event function sees of the mechanism at one time.

    Attributes:
        mechanism, packed: what moves.
        t: time [s].
        q, v: (n_q,), (n,) coordinates and velocities, see `rom.mbs.results.state.State`.
    """

    def __init__(self, mechanism: Mechanism, packed: Packed):
        self.mechanism, self.packed = mechanism, packed
        self.W = workspace(packed.seen, len(packed.signals))
        self.t, self.q, self.v = 0.0, packed.q, packed.v
        self.lam: Array | None = None  # (m,) multipliers, where they are known
        self._fresh = False

    def set(self, t: float, q: Array, v: Array) -> Self:
        """Look at another time t [s], with q (n_q,) and v (n,) in units of `State`."""
        self.t, self.q, self.v, self._fresh = t, q, v, False
        return self

    def reaction(self, name: str) -> Array:
        """(6,) load of a joint or drive, as of a solution; an event does not know it."""
        if self.lam is None:
            raise ConfigError(f"the reaction in {name!r} is not known between two steps.")
        self._evaluate()
        rows = self.packed.rows_of(name)
        return np.asarray(-self.lam[rows] @ self.W.g[rows, 6:12])

    def joint(self, name: str, coordinate: str | None = None) -> tuple[float, float]:
        """A joint coordinate, whole turns counted, and its rate [rad or m, per second].

        Args:
            name: of a joint that the event follows, see `rom.Mechanism.event`.
            coordinate: "angle" or "displacement"; None for the only or the first one.
        """
        row = coordinate_of(self.mechanism.joints, name, coordinate, "an event")
        for k, (_, known) in enumerate(self.packed.places.coordinates):
            if known is row:
                self._evaluate()
                return float(self.W.x[k]), float(self.W.xd[k])
        text = f"the coordinate of joint {name!r} is not followed"
        raise ConfigError(f"{text}; add the event with follow=[{name!r}].")

    def _at_marker(self, row: int) -> Seen:
        self._evaluate()
        return Seen(*(A[row].copy() for A in (self.W.P, self.W.E, self.W.V)))

    def _evaluate(self) -> None:
        if not self._fresh:
            evaluate(self.packed.seen, self.W, self.q, self.v)
            self._fresh = True


class Noted(NamedTuple):
    """What a watch knows at one time: last signs, and how often each event happened."""

    signs: dict[str, float]
    counts: dict[str, int]
    found: dict[str, list[tuple[float, Array, Array]]]  # if the watch that noted it is gone


@dataclass
class Watch:
    """The events of one run: the last signs of their functions, and what was found."""

    events: dict[str, Event]
    instant: Instant
    start: float
    packed: Packed

    def __post_init__(self) -> None:
        self.signs: dict[str, float] = {}
        self.found: dict[str, list[tuple[float, Array, Array]]] = {n: [] for n in self.events}
        self.stop: tuple[str, float] | None = None  # terminal event that ended the run, its time

    def begin(self, state: State) -> None:
        """Note the signs at the start."""
        self.instant.W.base[:] = state.base
        q, v = state.q, state.v
        self.signs = {n: np.sign(self.value(n, self.start, q, v)) for n in self.events}

    def value(self, name: str, t: float, q: Array, v: Array) -> float:
        """The function of an event, refused where it fails or is no number."""
        what = f"the function of event {name!r}"
        answer = ask(what, t, self.events[name].function, t, self.instant.set(t, q, v))
        return float(numbers(what, t, answer, (), "a number"))

    def step(self, t0: float, t1: float, motion: Motion, exact: Motion | None = None) -> bool:
        """Look for zeros in one step, wholly or not at all; True when one of them ends the run.

        Between the times t0 and t1 [s]; ``exact`` is the motion corrected to satisfy the
        constraints, None if motion does.
        """
        before = self.noted()
        try:
            return self._look(t0, t1, motion, exact or motion)
        except BaseException:
            self.recall(before)
            raise

    def noted(self) -> Noted:
        """What it knows now."""
        counts = {name: len(items) for name, items in self.found.items()}
        return Noted(dict(self.signs), counts, self.found)

    def recall(self, noted: Noted) -> None:
        """Go back to what it knew."""
        self.signs, self.stop = dict(noted.signs), None
        self.found = {name: items[: noted.counts[name]] for name, items in noted.found.items()}

    def _look(self, t0: float, t1: float, motion: Motion, exact: Motion) -> bool:
        crossed = []
        for name, event in self.events.items():
            before, after = self.signs[name], np.sign(self.value(name, t1, *motion(t1)))
            self.signs[name] = after
            if before == 0.0 or before == after or before * event.direction > 0:
                continue
            crossed.append((self._root(name, t0, t1, exact) if after else t1, name))
        for t, name in sorted(crossed):
            if t - self.start > START_ATOL:
                self.found[name].append((t, *exact(t)))
                if self.events[name].terminal:
                    self.stop = name, t
                    return True
        return False

    def _root(self, name: str, t0: float, t1: float, motion: Motion) -> float:
        """Time of the zero, to round-off of the motion between the ends of the step."""

        def value(s: float) -> float:
            t = t0 + s * (t1 - t0)
            return self.value(name, t, *motion(t))

        first, last = value(0.0), value(1.0)
        if np.sign(first) == np.sign(last):  # one of them is zero but for round-off
            return t0 if abs(first) < abs(last) else t1
        return t0 + (t1 - t0) * float(brentq(value, 0.0, 1.0, xtol=ROOT_RTOL))

    @property
    def occurrences(self) -> dict[str, Occurrences]:
        """All events by name, those that never happened with no times."""
        shapes, found = ((-1,), (-1, self.packed.q.size), (-1, self.packed.v.size)), {}
        for name, items in self.found.items():
            columns = (np.array([item[k] for item in items]) for k in range(3))
            found[name] = Occurrences(*map(np.reshape, columns, shapes))
        return found
