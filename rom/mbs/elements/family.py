"""What a family of elements tells the rest: all there is to know about springs, say, in one file.

A family has a record of one element as the user described it, a table of all of them for compiled
code, and kernels that take this table. Everything else asks the family: names in use, arrays, which
bodies it couples, which of its forces depend on rates, whether it conserves momentum. The families
that `rom.fields` knows have methods of their own; any other enters a mechanism by
``mechanism.add``.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Protocol

import numpy as np
import numpy.typing as npt

from rom.arguments import Positive
from rom.mbs.kernels.element_calls import ElementKernel, row_of
from rom.mbs.kernels.system import Coordinates
from rom.mbs.kernels.tables import Table
from rom.mbs.kernels.work import Work
from rom.mbs.parts.bodies import GROUND, Marker
from rom.mbs.parts.joints import Joint, Row
from rom.mbs.parts.signals import CLOCK, Signal, TimeFunction
from rom.model import Array, Index

Element = Any  # a record, of the class that a family has
Filled = Any  # a table, likewise
Hold = Annotated[float, Positive("s")] | None  # for which a sampled law is held
NEVER = -1e300  # [s] when a law is due that was not asked yet: before all times


class Asked(Protocol):
    """A law that stays in Python, asked whenever the forces are."""

    @property
    def name(self) -> str:
        """Of its element."""

    @property
    def answer(self) -> Array:
        """View of the numbers that `apply` sets, but for derivatives."""

    def apply(self, W: Work, t: float, *, slopes: bool) -> None:
        """Put the answer at time t, and its derivatives, where the kernels of its family look."""


Laws = tuple[Asked, ...]


@dataclass(frozen=True, slots=True)
class Sampled:
    """A law that is asked once a sample; between samples it answers what it remembers."""

    law: Asked
    every: float  # [s]
    at: int  # where its memory begins: time of the next sample [s], then the answer

    @property
    def name(self) -> str:
        """Of its element."""
        return self.law.name

    @property
    def answer(self) -> Array:
        """Numbers that it holds."""
        return self.law.answer

    def apply(self, W: Work, t: float, *, slopes: bool) -> None:
        """Hold the answer; its derivatives are zero and stay so."""
        held = self.memory(W)
        self.answer[:], W.fresh[self.at : self.at + held.size] = held[1:], held

    def sample(self, W: Work, t: float) -> None:
        """Ask it for the motion in W at a time [s], and remember that."""
        self.law.apply(W, t, slopes=False)
        self.memory(W)[:] = t + self.every, *self.answer

    def memory(self, W: Work) -> Array:
        """View of what it remembers, see ``at``."""
        at = W.x.size + self.at
        return W.base[at : at + 1 + self.answer.size]


def apply_laws(forces: Laws, W: Work, t: float, *, slopes: bool = False) -> None:
    """Let all laws answer for the motion in W at a time [s], with slopes if tangents follow."""
    for law in forces:
        law.apply(W, t, slopes=slopes)


def on_joint(_: object) -> tuple[Marker, ...]:
    """None of its own: the joint has them."""
    return ()


def from_outside(_: object) -> bool:
    """It pushes bodies without pushing others back."""
    return True


def never(_: Table) -> bool:
    """The forces do not depend on velocities, or the tangents know how."""
    return False


def apart(_table: object, _body: Index) -> Iterable[Sequence[int]]:
    """No bodies that a joint or a marker does not couple already."""
    return ()


OUTSIDE = {"outside": from_outside, "couples": apart, "by_rate": never}  # of loads


def integers(values: Iterable[object]) -> Index:
    """Whole numbers as an array, empty ones too."""
    return np.array(list(values), dtype=np.int64)


def starts(lengths: npt.ArrayLike) -> Index:
    """Positions of pieces that follow each other, and the end."""
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)


def rows_of(values: Iterable[npt.ArrayLike], *shape: int) -> Array:
    """Numbers as an array of rows of this shape, empty ones too."""
    return np.array(list(values), dtype=float).reshape(-1, *shape)


@dataclass
class Places:
    """Where the arrays of a mechanism have what elements speak of.

    Attributes:
        body: {name: row} of the bodies.
        marker: {marker: row}.
        joints: {name: joint}.
        R: largest number of elastic coordinates of a body.
        owners: joint or drive of each constraint row.
        signals: functions of time so far.
        coordinates: markers and row of each joint coordinate that something acts on.
        time: number of the one that tells the time, -1 for none.
        watched: how many of the last coordinates are followed for outputs alone.
        remembered: {owner: (m,) numbers that it remembers, at the start, in their own units}.
        settling: {owner: (m,) numbers that an equilibrium starts from in their place}.
    """

    body: Mapping[str, int]
    marker: Mapping[Marker, int]
    joints: Mapping[str, Joint]
    R: int = 0
    owners: list[str] = field(default_factory=list)
    signals: list[Signal] = field(default_factory=list)
    coordinates: list[tuple[tuple[Marker, Marker], Row]] = field(default_factory=list)
    time: int = -1
    watched: int = 0
    remembered: dict[str, Array] = field(default_factory=dict)
    settling: dict[str, Array] = field(default_factory=dict)

    def copy(self) -> "Places":
        """The same places, to which more can be added without changing these."""
        own = ("owners", "signals", "coordinates", "remembered", "settling")
        return replace(self, **{name: getattr(self, name).copy() for name in own})

    def coordinate(self, joint: str, row: Row) -> int:
        """Number of a coordinate of a joint."""
        return self.between(self.joints[joint].markers, row)

    def between(self, markers: Sequence[Marker], row: Row) -> int:
        """Number of the coordinate that a row measures between two markers."""
        for k, (_, known) in enumerate(self.coordinates):
            if known is row:
                return k
        self.coordinates.append(((markers[0], markers[1]), row))
        return len(self.coordinates) - 1

    def signal(self, name: str, function: TimeFunction | None) -> int:
        """Number of a function of time with values (3,), -1 for none."""
        return -1 if function is None else self._follow(Signal(name, function, width=3))

    def motion(self, name: str, function: TimeFunction | None) -> int:
        """Number of a prescribed length and its rate, -1 for none; it must not jump."""
        return -1 if function is None else self._follow(Signal(name, function))

    def clock(self) -> int:
        """Number of the function that tells the time."""
        if self.time < 0:
            self.time = self._follow(CLOCK)
        return self.time

    def _follow(self, signal: Signal) -> int:
        self.signals.append(signal)
        return len(self.signals) - 1

    def memory(self, owner: str, start: Array, *, settling: Array | None = None) -> int:
        """First of (m,) numbers that an owner keeps from instant to instant, in their own units.

        They begin with ``start``, and in an equilibrium, whatever its state remembers, with
        ``settling``.
        """
        self.remembered.setdefault(owner, start)
        if settling is not None:
            self.settling[owner] = settling
        return self._own(owner).start

    def asked(
        self, family: "Family", elements: Mapping[str, Element], table: Table
    ) -> Iterator[Asked]:
        """The laws of a family that stay in Python; elements with ``every`` have sampled ones."""
        ask = family.hooks.asked
        for law in ask(elements, table, len(self.coordinates)) if ask else ():
            every = getattr(elements[law.name], "every", None)
            first = np.append(NEVER, np.zeros(law.answer.size))
            at = self.memory(f"samples of {law.name}", first) if every else -1
            yield Sampled(law, every, at) if every else law

    def before(self, base: Array) -> Array:
        """(n_t, c + p) coordinates [rad, m] and memory over time; what settles is one instant late.

        Evaluated again with that, it does what it did on the way from there.
        """
        base, c = base.copy(), len(self.coordinates)
        for owner in self.settling:
            memory = base[:, c:][:, self._own(owner)]
            memory[1:] = memory[:-1].copy()
        return base

    def _own(self, owner: str) -> slice:
        """Where the memory has that of an owner."""
        before = list(self.remembered).index(owner)
        first = sum(x.size for x in list(self.remembered.values())[:before])
        return slice(first, first + self.remembered[owner].size)

    def settled(self, base: Array) -> Array:
        """(c + p,) joint coordinates [rad, m] and memory, which begins as in an equilibrium."""
        base, c = base.copy(), len(self.coordinates)
        for owner, numbers in self.settling.items():
            base[c:][self._own(owner)] = numbers
        return base

    def packed_coordinates(self) -> Coordinates:
        """The joint coordinates as arrays."""
        rows = [row for _, row in self.coordinates]
        return Coordinates(
            integers(row.kind for row in rows),
            *(integers(self.marker[m[side]] for m, _ in self.coordinates) for side in (0, 1)),
            *(rows_of((getattr(row, axis) for row in rows), 3) for axis in "abc"),
            np.array([row.offset for row in rows], dtype=float),
        )


@dataclass(frozen=True, eq=False)
class Hooks:
    """What only few families have to say; None where one has nothing to say."""

    # ({name: record}, table, number of joint coordinates) -> laws that stay in Python
    asked: Callable[[Mapping[str, Element], Filled, int], Sequence[Asked]] | None = None
    # table -> (e, ...) what each law of a user answered last
    answers: Callable[[Filled], Sequence[npt.ArrayLike]] | None = None
    # what is wrong if an answer is not finite; in place of {}, the names
    lost: str = "the law of {} gives no finite number"
    # whether the forces, dampers aside, follow from a potential; those of films and of what spins
    # go around
    potential: bool = True
    # table -> constraint rows whose multipliers the forces depend on
    loaded_rows: Callable[[Filled], Index] | None = None
    # table -> (e,) gaps over those in the middle [1], which one correction towards an equilibrium
    # may halve or double at most
    room: Callable[[Filled], Array] | None = None
    # table -> context within which its elements find their equilibrium more easily, close to the
    # one that is wanted; it says whether that changes anything
    eased: Callable[[Filled], AbstractContextManager[bool]] | None = None
    # table -> (e,) whether forces depend on the past, other than by angles that go on
    remembers: Callable[[Filled], Array] | None = None
    # (table, (n_t, p) memory) -> (n_t,) energy in springs that slip, which is in the power lost
    # when they are stretched [J]
    kept: Callable[[Filled, Array], Array] | None = None
    # (name, record, (n_t,) times [s], body -> (n_t, 3, 3) its axes in the world) -> where and how a
    # motion left the range of its forces, in a sentence; empty if it did not
    beyond: Callable[[str, Element, Array, Callable[[str], Array]], str] | None = None
    # (table, work) -> (e,) numbers at the last residual which go on by whole ones in motions that
    # repeat [1]
    phases: Callable[[Filled, Work], Array] | None = None


NO_HOOKS = Hooks()


@dataclass(frozen=True, eq=False)
class Family:
    """A kind of elements.

    Attributes:
        name: of all of them, e.g. ``"springs"``.
        record: class of one of them.
        pack: ({name: record}, `Places`) -> table for compiled code.
        residuals, tangents, energy, multiplier_columns, pair_tangents: kernels, see
            `rom.mbs.kernels.element_calls`; None for forces that do not change, store no energy,
            do not depend on multipliers, or whose tangents stay about the same over a step.
        ends: record -> the markers it acts on; of most ``i`` and ``j``.
        outside: record -> whether it acts from outside even though no marker is on the ground.
        couples: (table, (k,) bodies of the markers) -> groups of bodies that it couples, -1 for
            the ground; of most those of the markers ``i`` and ``j``.
        by_rate: table -> whether the forces depend on velocities in a way that the tangents do not
            know whole: they lack the change of rates with the position.
        hooks: what only few families have to say.
    """

    name: str
    record: type
    pack: Callable[[Mapping[str, Element], Places], Table]
    residuals: ElementKernel
    tangents: ElementKernel | None = None
    energy: ElementKernel | None = None
    multiplier_columns: ElementKernel | None = None
    pair_tangents: ElementKernel | None = None
    ends: Callable[[Element], tuple[Marker, ...]] = lambda element: (element.i, element.j)
    outside: Callable[[Element], bool] = lambda _: False
    couples: Callable[[Filled, Index], Iterable[Sequence[int]]] = lambda table, body: (
        np.column_stack([body[table.i], body[table.j]])
    )
    by_rate: Callable[[Filled], bool] = lambda _: True
    hooks: Hooks = NO_HOOKS

    @property
    def kernels(self) -> list[ElementKernel]:
        """Those it has."""
        return [kernel for kernel in self._roles if kernel is not None]

    def row(self, table: Table) -> list[int]:
        """Addresses of the table and of the kernels, which are compiled."""
        return row_of(table, self._roles)

    @property
    def _roles(self) -> tuple[ElementKernel | None, ...]:
        """All kernels in the order of their columns."""
        forces = self.residuals, self.tangents, self.energy
        return *forces, self.multiplier_columns, self.pair_tangents

    def pushes(self, element: Element) -> bool:
        """Whether an element changes the momentum of all bodies together."""
        return self.outside(element) or any(m.body == GROUND for m in self.ends(element))
