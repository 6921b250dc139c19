"""Joints, written as scalar constraints between two markers."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.errors import ConfigError
from rom.mbs.arrays import ALONG, ANGLE, NORMAL, POINT
from rom.mbs.parts import Marker
from rom.model import Array

ZERO = np.zeros(3)


@dataclass(frozen=True, slots=True)
class Row:
    """One scalar constraint; see `rom.mbs.arrays.Rows` for kinds and axes."""

    kind: int
    a: Array
    b: Array
    c: Array
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint between two markers.

    Attributes:
        name: name of the joint.
        kind: "revolute", "spherical", ...
        markers: the two markers.
        rows: the constraints.
        coordinate: the row that measures the joint coordinate, or None.
        turn: the row that measures the angle, or None.
    """

    name: str
    kind: str
    markers: tuple[Marker, Marker]
    rows: tuple[Row, ...]
    coordinate: Row | None = None
    turn: Row | None = None


@dataclass(frozen=True, slots=True)
class Triad:
    """Three world axes, carried by both bodies: columns in the axes of marker 1 and of 2."""

    one: Array
    two: Array

    def normal(self, i: int, j: int) -> Row:
        """Axis i on the first body stays normal to axis j on the second."""
        return Row(NORMAL, self.one[:, i], self.two[:, j], ZERO)

    def along(self, i: int, gap: Array) -> Row:
        """The distance along axis i stays what it is."""
        return Row(ALONG, self.one[:, i], ZERO, ZERO, float(self.one[:, i] @ gap))

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


def coincidence() -> tuple[Row, ...]:
    """The two points are one."""
    return tuple(Row(POINT, e, ZERO, ZERO) for e in np.eye(3))


def revolute(name: str, markers: Any, frames: Any, _gap: Array, axis: Array) -> Joint:
    """One point and one axis in common."""
    t = triad(axis, frames)
    rows = (*coincidence(), t.normal(0, 2), t.normal(1, 2))
    return Joint(name, "revolute", markers, rows, t.angle(), t.angle())


def spherical(name: str, markers: Any, _frames: Any, _gap: Array) -> Joint:
    """One point in common."""
    return Joint(name, "spherical", markers, coincidence())


def cylindrical(name: str, markers: Any, frames: Any, _gap: Array, axis: Array) -> Joint:
    """One axis in common; the second point lies on the axis through the first."""
    t = triad(axis, frames)
    rows = (t.along(0, ZERO), t.along(1, ZERO), t.normal(0, 2), t.normal(1, 2))
    return Joint(name, "cylindrical", markers, rows, t.angle(), t.angle())


def prismatic(name: str, markers: Any, frames: Any, gap: Array, axis: Array) -> Joint:
    """One axis in common and no rotation."""
    t = triad(axis, frames)
    rows = (
        *(t.along(0, ZERO), t.along(1, ZERO)),
        *(t.normal(0, 2), t.normal(1, 2), t.normal(0, 1)),
    )
    return Joint(name, "prismatic", markers, rows, t.along(2, frames[0].T @ gap))


def universal(
    name: str, markers: Any, frames: Any, _gap: Array, axis1: Array, axis2: Array
) -> Joint:
    """One point in common, an axis on each body, normal to each other."""
    if abs(axis1 @ axis2) > 1e-6:
        raise ConfigError(
            f"the axes of joint {name!r} are not perpendicular: cosine {axis1 @ axis2:.3g}."
        )
    cross = Row(NORMAL, frames[0].T @ axis1, frames[1].T @ axis2, ZERO)
    return Joint(name, "universal", markers, (*coincidence(), cross))


def fixed(name: str, markers: Any, frames: Any, _gap: Array) -> Joint:
    """Everything in common."""
    t = triad(np.array([0.0, 0.0, 1.0]), frames)
    rows = (*coincidence(), t.normal(0, 1), t.normal(1, 2), t.normal(2, 0))
    return Joint(name, "fixed", markers, rows)
