"""How laws of force are called: what they are given and answer, their entry in C, or in Python.

Those that are not compiled are asked between two calls of compiled code.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numba
import numpy as np

from rom import rotation
from rom.mbs.compiler.calls import c_function
from rom.mbs.compiler.intermediate import INTERMEDIATE_OPTIONS
from rom.mbs.kernels.compiled import OPTIONS
from rom.mbs.kernels.work import Work
from rom.mbs.parts.foreign import Entry, Function, ask, compiled_function, numbers
from rom.model import Array

Pointer = int  # of C, as a law in C gets it
Sizes = tuple[int, int, int, int]  # numbers of parameters, markers, remembered numbers, outputs

MOTION_SIZE = 18  # numbers of the motion of a marker
ENERGY_SIZE = 2  # stored energy, lost power
# steps of the differences of laws [m and rad], [m/s and rad/s], both relative to one plus the value
DIFFERENCE_STEP = 1e-6
# as numba.cfunc takes it
LAW_TYPES = "void(f8, CPointer(f8), CPointer(f8), CPointer(f8), CPointer(f8))"
PAIR_TEXT = "two vectors of three numbers: force and moment"


class Motion(NamedTuple):
    """How K markers move, in the world.

    Attributes:
        position: (K, 3) [m].
        axes: (K, 3, 3) axes of each marker as columns [1].
        velocity: (K, 3) [m/s].
        omega: (K, 3) angular velocity [rad/s].
    """

    position: Array
    axes: Array
    velocity: Array
    omega: Array


class Answer(NamedTuple):
    """What a law says; zeros where it leaves a field alone, and the old memory.

    Attributes:
        force: (K, 3) on each marker, world [N].
        moment: (K, 3) about each marker, world [N m].
        energy: (1,) stored [J].
        lost: (1,) power turned into heat [W].
        memory: (m,) to be remembered when the step is accepted, in its own units.
        outputs: (o,) values for the record, in their own units.
    """

    force: Array
    moment: Array
    energy: Array
    lost: Array
    memory: Array
    outputs: Array


def motion_of(flat: Array, n: int) -> Motion:
    """The fields of the motion of n markers in a vector (18 n,)."""
    return Motion(
        flat[: 3 * n].reshape(n, 3),
        flat[3 * n : 12 * n].reshape(n, 3, 3),
        flat[12 * n : 15 * n].reshape(n, 3),
        flat[15 * n : 18 * n].reshape(n, 3),
    )


def answer_of(flat: Array, n: int, n_memory: int) -> Answer:
    """The fields of the answer of a law of n markers in a vector."""
    at = 6 * n + ENERGY_SIZE
    return Answer(
        flat[: 3 * n].reshape(n, 3),
        flat[3 * n : 6 * n].reshape(n, 3),
        flat[6 * n : 6 * n + 1],
        flat[6 * n + 1 : at],
        flat[at : at + n_memory],
        flat[at + n_memory :],
    )


# functions that an entry takes in may make arrays, and are calculated as Python says
_taken_in = numba.njit(**INTERMEDIATE_OPTIONS)
# for all entries, so that they are compiled once
_motion_of, _answer_of = map(_taken_in, (motion_of, answer_of))


def entries(
    name: str, laws: tuple[Function, Function | None], sizes: Sizes, wanted: bool | None
) -> tuple[Entry | None, Entry | None]:
    """Law and tangents as functions of C; None for what is missing or left to Python."""

    def compiled(function: Function, insists: bool | None, *, tangents: bool) -> Entry | None:
        def make(python: Function) -> Entry:
            return entry_of(_taken_in(python), sizes, tangents=tangents)

        if hasattr(function, "address"):
            return function
        hint = "Use numbers and arrays of NumPy only, or compiled=False."
        return compiled_function(f"law {name!r}", function, make, insists, hint)

    entry = compiled(laws[0], wanted, tangents=False)
    if laws[1] is None or entry is None:
        return entry, None
    return entry, compiled(laws[1], True, tangents=True)


def entry_of(function: Function, sizes: Sizes, *, tangents: bool) -> Entry:
    """A function of C: it calls a compiled law, or its tangents, with arguments in their shapes."""
    p, n, m, o = sizes
    taken, answered = _motion_of, _answer_of
    n_motion, n_answer, n_rows = MOTION_SIZE * n, 6 * n + ENERGY_SIZE + m + o, 6 * n
    carray = numba.carray

    def law(t: float, parameters: Pointer, motion: Pointer, memory: Pointer, out: Pointer) -> None:
        given, kept = carray(parameters, p), carray(memory, m)
        moved = taken(carray(motion, n_motion), n)
        function(t, given, moved, kept, answered(carray(out, n_answer), n, m))

    def slopes(
        t: float, parameters: Pointer, motion: Pointer, memory: Pointer, out: Pointer
    ) -> None:
        given, kept = carray(parameters, p), carray(memory, m)
        moved, D = taken(carray(motion, n_motion), n), carray(out, (2, n_rows, n_rows))
        function(t, given, moved, kept, D[0], D[1])

    return numba.cfunc(LAW_TYPES)(slopes if tangents else law)


def compiled_entry(function: Callable[..., None], types: str) -> Entry:
    """A function of C, compiled of one of a module and kept; it makes arrays of pointers."""
    options = {name: value for name, value in OPTIONS.items() if name != "cache"} | {"_nrt": True}
    return c_function(function, types, options)


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
    """A law that stays in Python, number e of a table, its memories behind coordinates followed."""

    name: str
    law: Any
    e: int
    laws: Any
    followed: int

    @property
    def what(self) -> str:
        """What it is, by name."""
        return f"law {self.name!r}"

    @property
    def answer(self) -> Array:
        """All that it says."""
        begin, end = self.laws.answer_at[self.e : self.e + 2]
        return np.asarray(self.laws.answer[begin:end])

    def apply(self, W: Work, t: float, *, slopes: bool) -> None:
        """Let it answer for the motion at hand, and tell its derivatives."""
        laws, e, n = self.laws, self.e, len(self.law.markers)
        begin, at = self.followed + laws.memory_at[e], laws.marker[e, :n]
        memory = W.base[begin : begin + self.law.memory.size].copy()
        motion = Motion(W.P[at], W.E[at], W.V[at, :3], W.V[at, 3:])
        self.answer[:] = self.ask(t, motion, memory)
        if slopes:
            own = laws.derivatives[laws.derivatives_at[e] : laws.derivatives_at[e + 1]]
            own[:] = self.slopes(t, motion, memory).ravel()

    def ask(self, t: float, motion: Motion, memory: Array) -> Array:
        """The answer."""
        n, m, _ = self.law.sizes
        flat = np.zeros(self.answer.size)
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
        moved = (shifted(motion, p, side, by_velocity) for side in (h, -h))
        one, other = (answer(x)[: 6 * n].reshape(2, n, 3) for x in moved)
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
