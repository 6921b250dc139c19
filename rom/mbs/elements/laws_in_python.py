"""Laws of force that are not compiled: asked between two calls of compiled code."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from rom import rotation
from rom.mbs.elements.law_calls import DIFFERENCE_STEP, Answer, Motion, answer_of
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
    def what(self) -> str:
        """What it is, by name."""
        return f"law {self.name!r}"

    def apply(self, W: Any, t: float, *, slopes: bool) -> None:
        """Let it answer for the motion at hand, and tell its derivatives."""
        laws, e, n = self.laws, self.e, len(self.law.markers)
        begin, at = self.followed + laws.memory_at[e], laws.marker[e, :n]
        memory = W.base[begin : begin + self.law.memory.size].copy()
        motion = Motion(W.P[at], W.E[at], W.V[at, :3], W.V[at, 3:])
        laws.answer[laws.answer_at[e] : laws.answer_at[e + 1]] = self.ask(t, motion, memory)
        if slopes:
            own = laws.derivatives[laws.derivatives_at[e] : laws.derivatives_at[e + 1]]
            own[:] = self.slopes(t, motion, memory).ravel()

    def ask(self, t: float, motion: Motion, memory: Array) -> Array:
        """All that it says."""
        begin, end = self.laws.answer_at[self.e : self.e + 2]
        n, m, _ = self.law.sizes
        flat = np.zeros(end - begin)
        out = answer_of(flat, n, m)
        out.memory[:] = memory
        self.fill(t, motion, memory, out)
        return numbers(self.what, t, flat, flat.shape, "finite numbers")

    def fill(self, t: float, motion: Motion, memory: Array, out: Answer) -> None:
        """Write its answer."""
        ask(self.what, t, self.law.function, t, self.law.parameters.copy(), motion, memory, out)

    def slopes(self, t: float, motion: Motion, memory: Array) -> Array:
        """(2, 6 n, 6 n) derivatives by motions and velocities: the user's, or differences."""
        if self.law.tangents is None:
            return differences(lambda moved: self.ask(t, moved, memory), motion)
        D = np.zeros((2, 6 * len(self.law.markers), 6 * len(self.law.markers)))
        what, given = f"tangents of {self.what}", (self.law.parameters.copy(), motion, memory)
        ask(what, t, self.law.tangents, t, *given, D[0], D[1])
        return D


def differences(answer: Callable[[Motion], Array], motion: Motion) -> Array:
    """(2, 6 n, 6 n) central differences of wrenches by motions and by velocities of n markers."""
    n = len(motion.position)
    D = np.zeros((2, 6 * n, 6 * n))
    for by_velocity, p in product((0, 1), range(6 * n)):
        field = _moved(motion, p, by_velocity)
        h = DIFFERENCE_STEP * (1.0 + np.abs(field[p // 6]).max())
        one, other = (
            answer(shifted(motion, p, side, by_velocity))[: 6 * n].reshape(2, n, 3)
            for side in (h, -h)
        )
        D[by_velocity, :, p] = np.concatenate(one - other, axis=1).ravel() / (2 * h)
    return D


def shifted(motion: Motion, p: int, h: float, by_velocity: int) -> Motion:
    """The motion with marker p // 6 displaced, turned or quickened by h."""
    out, (b, a) = Motion(*(x.copy() for x in motion)), divmod(p, 6)
    field = _moved(out, p, by_velocity)
    if field is out.axes:
        field[b] = rotation.matrix(rotation.exp(h * np.eye(3)[a - 3])) @ field[b]
    else:
        field[b, a % 3] += h
    return out


def _moved(motion: Motion, p: int, by_velocity: int) -> Array:
    """What a motion or velocity of a marker changes."""
    kinds = (motion.velocity, motion.omega) if by_velocity else (motion.position, motion.axes)
    return np.asarray(kinds[p % 6 // 3])


class AskedForce(AskedLaw):
    """A force and a moment on one marker, which push back on the second if there is one."""

    __slots__ = ()

    @property
    def what(self) -> str:
        """What it is, by name."""
        return f"user force {self.name!r}"

    def fill(self, t: float, motion: Motion, memory: Array, out: Answer) -> None:
        """Write its answer."""
        a, *others = (MarkerMotion(*(x[k].copy() for x in motion)) for k in range(len(motion.axes)))
        answer = ask(self.what, t, self.law.function, t, a, *others)
        out.force[0], out.moment[0] = numbers(self.what, t, answer, (2, 3), PAIR_TEXT)
        for b in others:
            out.force[1] = -out.force[0]
            out.moment[1] = -out.moment[0] - np.cross(a.position - b.position, out.force[0])
