"""Laws of force that are not compiled: asked between two calls of compiled code."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.mbs.elements.law_calls import DIFFERENCE_STEP, Answer, Motion, answer_of
from rom.mbs.parts.foreign import ask, numbers
from rom.model import Array
from rom.rotation import skew

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
            K, C = laws.told[laws.told_at[e] : laws.told_at[e + 1]].reshape(2, 6 * n, 6 * n)
            self.differentiate(t, motion, memory, K, C)

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

    def differentiate(self, t: float, motion: Motion, memory: Array, K: Array, C: Array) -> None:
        """Derivatives (6 n, 6 n) by motions and velocities: the user's, or central differences."""
        if self.law.tangents is not None:
            K[:], C[:] = 0.0, 0.0
            given = self.law.parameters.copy(), motion, memory, K, C
            ask(f"tangents of {self.what}", t, self.law.tangents, t, *given)
            return
        for k in range(len(K)):
            for D, moved in ((K, _displaced), (C, _faster)):
                sides, h = moved(motion, *divmod(k, 6))
                one, other = (_wrenches(self.ask(t, side, memory), len(K)) for side in sides)
                D[:, k] = 0.5 * (one - other) / h


def _wrenches(answer: Array, size: int) -> Array:
    """Force and moment of each marker in turn."""
    return np.hstack(answer[:size].reshape(2, -1, 3)).ravel()


def _displaced(motion: Motion, b: int, p: int) -> tuple[tuple[Motion, Motion], float]:
    """The motion with marker b displaced or turned by a step, and back by one."""
    if p < 3:
        return _changed(motion, "position", b, p)
    turn = DIFFERENCE_STEP * skew(np.eye(3)[p - 3])
    sides = []
    for R in (turn, -turn):  # to second order, so that central differences are exact to that order
        axes = motion.axes.copy()
        axes[b] += (R + 0.5 * R @ R) @ axes[b]
        sides.append(motion._replace(axes=axes))
    return (sides[0], sides[1]), DIFFERENCE_STEP


def _faster(motion: Motion, b: int, p: int) -> tuple[tuple[Motion, Motion], float]:
    """The motion with marker b faster by a step, and slower by one."""
    return _changed(motion, "velocity" if p < 3 else "omega", b, p % 3)


def _changed(motion: Motion, field: str, b: int, p: int) -> tuple[tuple[Motion, Motion], float]:
    up, down = getattr(motion, field).copy(), getattr(motion, field).copy()
    h = DIFFERENCE_STEP * (1.0 + abs(up[b, p]))
    up[b, p] += h
    down[b, p] -= h
    return (motion._replace(**{field: up}), motion._replace(**{field: down})), h


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
