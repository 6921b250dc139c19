"""Laws of force that are not compiled: asked between two calls of compiled code."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.mbs.elements.law_calls import Motion, answer_of
from rom.mbs.parts.foreign import ask, numbers
from rom.model import Array

PAIR_TEXT = "two vectors of three numbers: force and moment"


@dataclass(frozen=True, slots=True)
class MarkerMotion:
    """How a marker moves.

    Attributes:
        position: (3,) world [m].
        axes: (3, 3) orientation of the marker, to world.
        velocity: (3,) world [m/s].
        omega: (3,) angular velocity, world [rad/s].
    """

    position: Array
    axes: Array
    velocity: Array
    omega: Array


@dataclass(frozen=True, slots=True)
class AskedLaw:
    """A law that stays in Python.

    Attributes:
        name: of the law.
        law: as the user described it.
        e: its number.
        laws: the table of all of them.
        followed: number of joint coordinates, behind which memories are kept.
    """

    name: str
    law: Any
    e: int
    laws: Any
    followed: int

    @property
    def answer(self) -> Array:
        """Where it answers."""
        begin, end = self.laws.answer_at[self.e : self.e + 2]
        return np.asarray(self.laws.answer[begin:end])

    @property
    def markers(self) -> Any:
        """Rows of its markers."""
        return self.laws.marker[self.e, : len(self.law.markers)]

    def apply(self, W: Any, t: float) -> None:
        """Let it answer for the motion at hand."""
        n, m, _ = self.law.sizes
        begin, at = self.followed + self.laws.memory_at[self.e], self.markers
        memory = W.base[begin : begin + m].copy()
        flat = self.answer
        flat[:] = 0.0
        out = answer_of(flat, n, m)
        out.memory[:] = memory
        motion = Motion(W.P[at], W.E[at], W.V[at, :3], W.V[at, 3:])
        what = f"law {self.name!r}"
        ask(what, t, self.law.function, t, self.law.parameters.copy(), motion, memory, out)
        numbers(what, t, flat, flat.shape, "finite numbers")


class AskedForce(AskedLaw):
    """A force and a moment on one marker, which push back on the second if there is one."""

    __slots__ = ()

    def apply(self, W: Any, t: float) -> None:
        """Let it answer for the motion at hand."""
        a, *others = (_motion_at(W, m) for m in self.markers)
        what = f"user force {self.name!r}"
        answer = ask(what, t, self.law.function, t, a, *others)
        out = answer_of(self.answer, len(self.law.markers), 0)
        out.force[0], out.moment[0] = numbers(what, t, answer, (2, 3), PAIR_TEXT)
        for b in others:
            out.force[1] = -out.force[0]
            out.moment[1] = -out.moment[0] - np.cross(a.position - b.position, out.force[0])


def _motion_at(W: Any, m: int) -> MarkerMotion:
    """Motion of marker m at the state of the last evaluation."""
    return MarkerMotion(W.P[m].copy(), W.E[m].copy(), W.V[m, :3].copy(), W.V[m, 3:].copy())
