"""What a joint is: scalar constraints between two markers, and the coordinates it leaves."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np

from rom.errors import ConfigError
from rom.mbs.kernels.system import ALONG, ANGLE, COUPLING, NORMAL, POINT
from rom.mbs.parts.bodies import Marker, Part
from rom.model import Array
from rom.names import check_known, offered

Coordinate = Literal["angle", "displacement", "way"]  # the last is the earlier name of the second
NO_VECTOR = np.zeros(3)


@dataclass(frozen=True, slots=True)
class Row:
    """One scalar constraint; see `rom.mbs.kernels.system.Rows` for kinds and axes.

    A coupling has two terms: the rows that measure joint coordinates, and their factors.
    """

    kind: int
    a: Array
    b: Array
    c: Array
    offset: float = 0.0
    radius: float = 0.0
    terms: tuple[tuple["Row", float], ...] = ()


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint between two markers."""

    name: str
    kind: str  # "revolute", "spherical", ..
    # the two markers; of a coupling those of its second and its first joint
    markers: tuple[Marker, ...]
    rows: tuple[Row, ...]  # the constraints
    coordinate: Row | None = None  # which measures the joint coordinate
    turn: Row | None = None  # which measures the angle
    displacement: Row | None = None  # which measures the displacement along the axis

    def __repr__(self) -> str:
        ends = " to ".join(f"{m.body}.{m.place}" for m in self.markers)
        return f"Joint({self.name!r}: {self.kind}, {ends})"

    @property
    def one_point(self) -> bool:
        """Whether both markers are at one point."""
        return sum(row.kind == POINT for row in self.rows) == 3


@dataclass(frozen=True, slots=True)
class Triad:
    """Three world axes, carried by both bodies: columns in the axes of marker 1 and of 2."""

    one: Array
    two: Array

    def normal(self, i: int, j: int) -> Row:
        """Axis i on the first body stays normal to axis j on the second."""
        return Row(NORMAL, self.one[:, i], self.two[:, j], NO_VECTOR)

    def along(self, i: int, gap: Array) -> Row:
        """The distance along axis i stays what it is."""
        return Row(ALONG, self.one[:, i], NO_VECTOR, NO_VECTOR, float(self.one[:, i] @ gap))

    def angle(self) -> Row:
        """Rotation about axis 2."""
        return Row(ANGLE, self.one[:, 0], self.two[:, 0], self.one[:, 1])


def triad(axis: Array, frames: tuple[Array, Array]) -> Triad:
    """Axes with ``axis`` last; the first one is the world axis farthest from it, made normal."""
    x = np.eye(3)[np.argmin(np.abs(axis))]
    x = x - (x @ axis) * axis
    x = x / np.linalg.norm(x)
    axes = np.column_stack([x, np.cross(axis, x), axis])
    return Triad(frames[0].T @ axes, frames[1].T @ axes)


def coupling(*terms: tuple[Row, float]) -> Row:
    """A sum of two coordinates with factors stays zero."""
    return Row(COUPLING, NO_VECTOR, NO_VECTOR, NO_VECTOR, terms=terms)


def coincidence() -> tuple[Row, ...]:
    """The two points are one."""
    return tuple(Row(POINT, e, NO_VECTOR, NO_VECTOR) for e in np.eye(3))


def coordinate_of(joints: Mapping[str, Joint], joint: str, which: str | None, what: str) -> Row:
    """The row of the coordinate "angle" or "displacement" of a joint; None for the first."""
    check_known(joint, joints, f"{what}: no joint {joint!r}; there are")
    names = {None: "coordinate", "angle": "turn", "displacement": "displacement"}
    names["way"] = "displacement"
    if which not in names:
        raise ConfigError(f"coordinate {which!r} of {joint!r} must be 'angle' or 'displacement'.")
    row: Row | None = getattr(joints[joint], names[which])
    if row is None:
        able = [name for name, one in joints.items() if getattr(one, names[which])]
        lack = f"coordinate {which!r}" if which else "angle about an axis and no way along one"
        text = f"{what}: joint {joint!r} is {joints[joint].kind}: it has no {lack}."
        raise ConfigError(text, hint=f"Joints that have one: {offered(able, joint)}.")
    return row


class Whole(Protocol):
    """A `rom.mbs.mechanism.Mechanism`, whose methods the functions on it become."""

    parts: dict[str, Part]
    joints: dict[str, Joint]
    drives: dict[str, Any]
    elements: dict[str, tuple[Any, Any]]  # {name: (family, element)}
    fmus: dict[str, object]

    @property
    def spherical(self) -> Callable[[str, Marker, Marker], None]:
        """Make a ball joint."""

    @property
    def law(self) -> Callable[..., None]:
        """Add a law of force, see `rom.mbs.elements.laws.law`."""

    @property
    def user_force(self) -> Callable[..., None]:
        """Add a force, see `rom.mbs.elements.laws.user_force`."""

    def add(self, name: str, element: object, family: Any) -> None:
        """Enter an element."""

    def part(self, name: str) -> Part:
        """The body of a name."""

    def design_point(self, marker: Marker) -> Array:
        """(3,) position of a marker where its body was added."""

    def check_new(self, name: str) -> None:
        """Refuse a name in use."""

    def check_markers(self, name: str, *markers: Marker) -> None:
        """Refuse markers that do not exist."""

    def check_apart(self, name: str, m1: Marker, m2: Marker) -> None:
        """Refuse such markers, or both of one body."""
