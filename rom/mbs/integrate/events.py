"""Events: instants at which a function of the motion passes through zero."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from rom.errors import ConfigError
from rom.mbs.equations.equations import evaluate
from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.work import workspace
from rom.mbs.mechanism import Event, Mechanism
from rom.mbs.parts.bodies import GROUND, Marker
from rom.mbs.parts.foreign import ask, numbers
from rom.mbs.parts.joints import coordinate_of
from rom.mbs.results.solution import Occurrences
from rom.mbs.results.state import State
from rom.model import Array
from rom.names import offered
from rom.rotation import quaternion

START_ATOL = 1e-10  # time after the start [s] within which a zero is the start, not an event
ROOT_RTOL = 1e-14  # of the step

Motion = Callable[[float], tuple[Array, Array]]


class Instant:
    """What an event function sees of the mechanism at one time.

    Attributes:
        t: time [s].
        q, v: coordinates and velocities, see `rom.mbs.results.state.State`.
    """

    def __init__(self, mechanism: Mechanism, packed: Packed):
        self._mechanism, self._packed = mechanism, packed
        self.W: Any = workspace(packed.seen, len(packed.signals))
        self.t, self.q, self.v = 0.0, packed.q, packed.v
        self._fresh = False

    def set(self, t: float, q: Array, v: Array) -> "Instant":
        """Look at another time t [s], with q (n_q,) and v (n,) in units of `State`."""
        self.t, self.q, self.v, self._fresh = t, q, v, False
        return self

    def position(self, body: str, marker: Any = None) -> Array:
        """(3,) position of a marker, or of the body origin [m].

        Raises:
            ConfigError: if the body or the marker is unknown.
        """
        marker = self._frame(body) if marker is None else marker
        if marker is not None:
            return self._evaluated(body).P[self._row(body, marker)].copy()
        at = self._q_at(body)
        return self.q[at : at + 3].copy()

    def velocity(self, body: str, marker: Any = None) -> Array:
        """(3,) velocity of a marker, or of the body origin, world [m/s].

        Raises:
            ConfigError: if the body or the marker is unknown.
        """
        marker = self._frame(body) if marker is None else marker
        if marker is not None:
            return self._evaluated(body).V[self._row(body, marker), :3].copy()
        at = self._v_at(body)
        return self.v[at : at + 3].copy()

    def axes(self, body: str, marker: Any) -> Array:
        """(3, 3) orientation of a marker, to world [1].

        Raises:
            ConfigError: if the body or the marker is unknown.
        """
        return self._evaluated(body).E[self._row(body, marker)].copy()

    def orientation(self, body: str) -> Array:
        """(4,) quaternion of the body frame [1].

        Raises:
            ConfigError: if the body is unknown.
        """
        at = self._q_at(body) + 3
        if frame := self._frame(body):
            return quaternion(self.axes(body, frame))
        return self.q[at : at + 4].copy()

    def omega(self, body: str) -> Array:
        """(3,) angular velocity of the body frame, body frame [rad/s].

        Raises:
            ConfigError: if the body is unknown.
        """
        at = self._v_at(body) + 3
        if frame := self._frame(body):
            row = self._row(body, frame)
            return self._evaluated(body).E[row].T @ self.W.V[row, 3:]
        return self.v[at : at + 3].copy()

    def elastic(self, body: str) -> Array:
        """(r,) elastic coordinates, in units of the body's shapes.

        Raises:
            ConfigError: if the body is unknown.
        """
        at = self._q_at(body) + 7
        return self.q[at : at + self._mechanism.part(body).r].copy()

    def joint(self, name: str, coordinate: str | None = None) -> tuple[float, float]:
        """A joint coordinate, whole turns counted, and its rate [rad or m, per second].

        Args:
            name: of a joint that the event follows, see `rom.Mechanism.event`.
            coordinate: "angle" or "displacement"; None for the only or the first one.
        """
        row = coordinate_of(self._mechanism.joints, name, coordinate, "an event")
        for k, known in enumerate(self._packed.coordinate_rows):
            if known is row:
                self._evaluate()
                return float(self.W.x[k]), float(self.W.xd[k])
        raise ConfigError(
            f"the coordinate of joint {name!r} is not followed.",
            hint=f"Add the event with follow=[{name!r}].",
        )

    def _frame(self, body: str) -> Marker | None:
        """Marker that is the frame of the body, where its motion is that of another frame."""
        self._number(body)
        return self._mechanism.part(body).own_frame

    def _number(self, body: str) -> int:
        names = self._packed.names
        if body not in names:
            raise ConfigError(f"no body {body!r}; the mechanism has {offered(names, body)}.")
        return names.index(body)

    def _q_at(self, body: str) -> int:
        return int(self._packed.system.bodies.q_at[self._number(body)])

    def _v_at(self, body: str) -> int:
        return int(self._packed.system.bodies.v_at[self._number(body)])

    def _row(self, body: str, place: Any) -> int:
        marker = place if isinstance(place, Marker) else self._mechanism.part(body).marker(place)
        if marker not in self._packed.markers:
            raise ConfigError(
                f"the point {marker.place} of body {body!r} is not a marker of the mechanism.",
                hint="Name it when the body is added, or add the event with follow=[marker].",
            )
        return self._packed.row(marker)

    def _evaluated(self, body: str) -> Any:
        if body != GROUND:
            self._number(body)
        self._evaluate()
        return self.W

    def _evaluate(self) -> None:
        if not self._fresh:
            evaluate(self._packed.seen, self.W, self.q, self.v)
            self._fresh = True


class Noted(NamedTuple):
    """What a watch knows at one time: last signs, and how often each event happened.

    ``found`` holds what happened if the watch that noted it is gone.
    """

    signs: dict[str, float]
    counts: dict[str, int]
    found: dict[str, list[tuple[float, Array, Array]]]


@dataclass
class Watch:
    """The events of one run: the last signs of their functions, and what was found.

    Attributes:
        stop: name and time of the terminal event that ended the run, or None.
    """

    events: dict[str, Event]
    instant: Instant
    start: float
    packed: Packed

    def __post_init__(self) -> None:
        self.signs: dict[str, float] = {}
        self.found: dict[str, list[tuple[float, Array, Array]]] = {n: [] for n in self.events}
        self.stop: tuple[str, float] | None = None

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


def watch_of(mechanism: Mechanism, packed: Packed, start: float) -> Watch | None:
    """The watch over the events of a mechanism; None if it has none."""
    if not mechanism.events:
        return None
    return Watch(dict(mechanism.events), Instant(mechanism, packed), start, packed)
