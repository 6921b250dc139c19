"""Where bodies and markers are and how they move: at all instants of a motion, or at one."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rom.errors import ConfigError
from rom.mbs.equations.packing import Packed
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import GROUND, Marker
from rom.mbs.results.recomputed import Seen
from rom.model import Array
from rom.names import check_known
from rom.rotation import continuous, matrix, quaternion


class Whereabouts:
    """What `Solution` and the `Instant` of an event answer alike; the latter has no rows n_t.

    Raises:
        ConfigError: of all methods, if the body is unknown, or the marker was not one of the run.
    """

    mechanism: Mechanism
    packed: Packed
    q: Array
    v: Array
    _at_marker: Callable[[int], Seen]

    def position(self, body: str, marker: Any = None) -> Array:
        """(n_t, 3) position of a marker, or of the body origin [m].

        Of a rod, or another body of frames, (n_t, k, 3) for all of its k frames.

        Example:
            >>> mech = rom.Mechanism(gravity=(0, 0, 0))
            >>> solid = {"mass": 1.0, "inertia": (1e-3,) * 3}
            >>> ball = mech.add_rigid("ball", **solid, at=(0, 0, 0), velocity=(3, 0, 0))
            >>> rom.simulate(mech, t_end=2.0, dt=0.1).position("ball")[-1].round(6)
            array([6., 0., 0.])
        """
        if self._has_frames(body):
            return self._of_frames(body, marker, self.position)
        marker = self._frame(body) if marker is None else marker
        return self._places(body, 0, 3) if marker is None else self._seen(body, marker).position

    def velocity(self, body: str, marker: Any = None) -> Array:
        """(n_t, 3) velocity of a marker, or of the body origin, world [m/s]; of frames likewise."""
        if self._has_frames(body):
            return self._of_frames(body, marker, self.velocity)
        marker = self._frame(body) if marker is None else marker
        if marker is None:
            return self._rates(body, 0, 3)
        return self._seen(body, marker).twist[..., :3]

    def axes(self, body: str, marker: Any) -> Array:
        """(n_t, 3, 3) orientation of a marker, to world, elastic rotation included [1]."""
        if self._has_frames(body):
            frame = self.mechanism.nonlinear[body].marker(marker).body
            return _of_each(matrix, self.orientation(frame), 1)
        return self._seen(body, marker).axes

    def orientation(self, body: str) -> Array:
        """(n_t, 4) quaternion of the body frame [1], (n_t, k, 4) of k frames."""
        if self._has_frames(body):
            return self._of_frames(body, None, self.orientation)
        if frame := self._frame(body):
            p = _of_each(quaternion, self._seen(body, frame).axes, 2)
            return p if p.ndim == 1 else continuous(p)
        return self._places(body, 3, 7)

    def omega(self, body: str) -> Array:
        """(n_t, 3) angular velocity of the body frame, body frame [rad/s]; of frames likewise."""
        if self._has_frames(body):
            return self._of_frames(body, None, self.omega)
        if frame := self._frame(body):
            seen = self._seen(body, frame)
            return np.einsum("...ij,...i->...j", seen.axes, seen.twist[..., 3:])
        return self._rates(body, 3, 6)

    def elastic(self, body: str) -> Array:
        """(n_t, r) elastic coordinates, in units of the body's shapes."""
        return self._places(body, 7, 7 + self.packed.system.bodies.r[self._number(body)])

    def _seen(self, body: str, place: object) -> Seen:
        if body != GROUND:
            self._number(body)
        given = place if isinstance(place, Marker) else self.mechanism.part(body).marker(place)
        marker = _of_body(given, body, [body])
        if marker not in self.packed.markers:
            text = f"the point {marker.place} of body {body!r} was not a marker of the run."
            hint = "Name it when the body is added; an event may follow it: follow=[marker]."
            raise ConfigError(text, hint=hint)
        return self._at_marker(self.packed.row(marker))

    def _has_frames(self, body: str) -> bool:
        return body not in self.packed.names and body in self.mechanism.nonlinear

    def _of_frames(self, body: str, marker: Any, ask: Callable[[str], Array]) -> Array:
        """An answer for one frame of a body of frames, or for all of them, (n_t, k, ...)."""
        whole = self.mechanism.nonlinear[body]
        if marker is not None:
            given = marker if isinstance(marker, Marker) else whole.marker(marker)
            return ask(_of_body(given, body, [part.name for part in whole.parts]).body)
        return np.stack([ask(part.name) for part in whole.parts], axis=-2)

    def _frame(self, body: str) -> Marker | None:
        """Marker that is the frame of the body, where its motion is that of another frame."""
        self._number(body)
        return self.mechanism.part(body).own_frame

    def _number(self, body: str) -> int:
        check_known(body, self.packed.names, f"no body {body!r}; the mechanism has")
        return self.packed.names.index(body)

    def _places(self, body: str, first: int, last: int) -> Array:
        at = self.packed.system.bodies.q_at[self._number(body)]
        return self.q[..., at + first : at + last].copy()

    def _rates(self, body: str, first: int, last: int) -> Array:
        at = self.packed.system.bodies.v_at[self._number(body)]
        return self.v[..., at + first : at + last].copy()


def _of_each(convert: Callable[[Array], Array], A: Array, ndim: int) -> Array:
    """One rotation in another form, or one of each instant."""
    return convert(A) if A.ndim == ndim else np.array([convert(x) for x in A])


def _of_body(marker: Marker, body: str, names: list[str]) -> Marker:
    """The marker, if it is one of a body, whose frames have these names."""
    if marker.body in names:
        return marker
    text = f"the marker {marker.place!r} is of body {marker.body!r}, not of {body!r}."
    raise ConfigError(text, hint=f"Write ({marker.body!r}, {marker.place!r}), or another marker.")
