"""Joints, written as scalar constraints between two markers."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rom.errors import ConfigError
from rom.mbs.kernels.system import ALONG, ANGLE, COUPLING, DISTANCE, NORMAL, POINT, ROLL, TOUCH
from rom.mbs.parts.bodies import Marker
from rom.model import Array

NO_VECTOR = np.zeros(3)
FULL_TURN = 2 * np.pi


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
    """A joint between two markers.

    Attributes:
        name: name of the joint.
        kind: "revolute", "spherical", ...
        markers: the two markers; of a coupling those of its second and its first joint.
        rows: the constraints.
        coordinate: the row that measures the joint coordinate, or None.
        turn: the row that measures the angle, or None.
        displacement: the row that measures the displacement along the axis, or None.
    """

    name: str
    kind: str
    markers: tuple[Marker, ...]
    rows: tuple[Row, ...]
    coordinate: Row | None = None
    turn: Row | None = None
    displacement: Row | None = None


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


def coincidence() -> tuple[Row, ...]:
    """The two points are one."""
    return tuple(Row(POINT, e, NO_VECTOR, NO_VECTOR) for e in np.eye(3))


def revolute(name: str, markers: Any, frames: Any, _gap: Array, axis: Array) -> Joint:
    """One point and one axis in common."""
    t = triad(axis, frames)
    rows = (*coincidence(), t.normal(0, 2), t.normal(1, 2))
    angle = t.angle()
    return Joint(name, "revolute", markers, rows, angle, angle)


def spherical(name: str, markers: Any, _frames: Any, _gap: Array) -> Joint:
    """One point in common."""
    return Joint(name, "spherical", markers, coincidence())


def cylindrical(name: str, markers: Any, frames: Any, gap: Array, axis: Array) -> Joint:
    """One axis in common; the second point lies on the axis through the first."""
    t = triad(axis, frames)
    rows = (t.along(0, NO_VECTOR), t.along(1, NO_VECTOR), t.normal(0, 2), t.normal(1, 2))
    angle = t.angle()
    return Joint(name, "cylindrical", markers, rows, angle, angle, t.along(2, frames[0].T @ gap))


def prismatic(name: str, markers: Any, frames: Any, gap: Array, axis: Array) -> Joint:
    """One axis in common and no rotation."""
    t = triad(axis, frames)
    rows = (
        *(t.along(0, NO_VECTOR), t.along(1, NO_VECTOR)),
        *(t.normal(0, 2), t.normal(1, 2), t.normal(0, 1)),
    )
    displacement = t.along(2, frames[0].T @ gap)
    return Joint(name, "prismatic", markers, rows, displacement, None, displacement)


def universal(
    name: str, markers: Any, frames: Any, _gap: Array, axis1: Array, axis2: Array
) -> Joint:
    """One point in common, an axis on each body, normal to each other."""
    if abs(axis1 @ axis2) > 1e-6:
        raise ConfigError(
            f"the axes of joint {name!r} are not perpendicular: cosine {axis1 @ axis2:.3g}."
        )
    cross = Row(NORMAL, frames[0].T @ axis1, frames[1].T @ axis2, NO_VECTOR)
    return Joint(name, "universal", markers, (*coincidence(), cross))


def fixed(name: str, markers: Any, frames: Any, _gap: Array) -> Joint:
    """Everything in common."""
    t = triad(np.array([0.0, 0.0, 1.0]), frames)
    rows = (*coincidence(), t.normal(0, 1), t.normal(1, 2), t.normal(2, 0))
    return Joint(name, "fixed", markers, rows)


def screw(name: str, markers: Any, frames: Any, gap: Array, axis: Array, *, pitch: float) -> Joint:
    """Cylindrical, the way a multiple of the angle."""
    joint = cylindrical(name, markers, frames, gap, axis)
    lead = Row(
        COUPLING,
        NO_VECTOR,
        NO_VECTOR,
        NO_VECTOR,
        terms=((joint.displacement, 1.0), (joint.turn, -pitch / FULL_TURN)),
    )
    return replace(joint, kind="screw", rows=(*joint.rows, lead))


def planar(name: str, markers: Any, frames: Any, _gap: Array, normal: Array) -> Joint:
    """One plane in common: the second point slides in it, the body turns about its normal."""
    t = triad(normal, frames)
    angle = t.angle()
    rows = (t.along(2, NO_VECTOR), t.normal(0, 2), t.normal(1, 2))
    return Joint(name, "planar", markers, rows, angle, angle)


def point_on_line(name: str, markers: Any, frames: Any, gap: Array, axis: Array) -> Joint:
    """The second point stays on a line of the first body."""
    t = triad(axis, frames)
    displacement = t.along(2, frames[0].T @ gap)
    return Joint(
        name,
        "point on line",
        markers,
        (t.along(0, NO_VECTOR), t.along(1, NO_VECTOR)),
        displacement,
        None,
        displacement,
    )


def point_on_plane(name: str, markers: Any, frames: Any, _gap: Array, normal: Array) -> Joint:
    """The second point stays in a plane of the first body."""
    return Joint(name, "point on plane", markers, (triad(normal, frames).along(2, NO_VECTOR),))


def distance(name: str, markers: Any, _frames: Any, gap: Array, *, length: float | None) -> Joint:
    """Two points stay as far apart as they are, or as said."""
    apart = float(np.linalg.norm(gap))
    if apart == 0.0:
        raise ConfigError(
            f"the points of joint {name!r} coincide: a rod of length zero has no direction.",
            hint="Use a spherical joint.",
        )
    row = Row(DISTANCE, NO_VECTOR, NO_VECTOR, NO_VECTOR, apart if length is None else length)
    return Joint(name, "distance", markers, (row,))


def rolling(
    name: str, markers: Any, frames: Any, _gap: Array, *axes: Array, radius: float
) -> Joint:
    """A ball, or with a second axis a wheel, that touches a plane and rolls on it."""
    normal, *spin = axes
    if spin and abs(normal @ spin[0]) > 1 - 1e-6:
        raise ConfigError(f"the wheel of joint {name!r} lies flat on its plane: it cannot roll.")
    t = triad(normal, frames)
    s = frames[1].T @ spin[0] if spin else NO_VECTOR
    n = t.one[:, 2]
    touch = Row(TOUCH, n, s, n, radius=radius)
    rows = tuple(Row(ROLL, t.one[:, i], s, n, radius=radius) for i in (0, 1))
    return Joint(name, "rolling", markers, (touch, *rows))


def coupling(name: str, first: Joint, second: Joint, rows: Any, ratio: float) -> Joint:
    """The second joint coordinate is a multiple of the first."""
    row = Row(COUPLING, NO_VECTOR, NO_VECTOR, NO_VECTOR, terms=((rows[1], 1.0), (rows[0], -ratio)))
    return Joint(name, "coupling", (*second.markers, *first.markers), (row,))


def joint_with_axis(joints: Mapping[str, Joint], joint: str, what: str) -> Joint:
    """The joint of a name, which must have a coordinate.

    Raises:
        ConfigError: if it is unknown, or has none.
    """
    if joint not in joints:
        raise ConfigError(f"{what}: no joint {joint!r}; there are {sorted(joints)}.")
    if joints[joint].coordinate is None:
        raise ConfigError(
            f"{what}: joint {joint!r} is {joints[joint].kind}; only revolute, "
            "cylindrical, screw, planar, prismatic and point on line joints have a coordinate."
        )
    return joints[joint]


def coordinate_of(joints: Mapping[str, Joint], joint: str, which: str | None, what: str) -> Row:
    """The row of the coordinate "angle" or "displacement" of a joint; None for the first.

    Raises:
        ConfigError: if the joint is unknown, or has no such coordinate.
    """
    found = joint_with_axis(joints, joint, what)
    rows = {None: found.coordinate, "angle": found.turn, "displacement": found.displacement}
    rows["way"] = found.displacement  # as it was called before
    if which not in rows:
        raise ConfigError(f"coordinate {which!r} of {joint!r}: it is 'angle' or 'displacement'.")
    row = rows[which]
    if row is None:
        raise ConfigError(f"joint {joint!r} is {found.kind}: it has no coordinate {which!r}.")
    return row
