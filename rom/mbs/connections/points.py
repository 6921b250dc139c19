"""Joints that hold one point: on a line, in a plane, at a distance, in a cross, on what rolls."""

import numpy as np

from rom.arguments import Direction, Length
from rom.errors import ConfigError
from rom.mbs.connections.ends import ends_of, enter
from rom.mbs.connections.lower_pairs import coaxial
from rom.mbs.kernels.system import DISTANCE, NORMAL, ROLL, TOUCH
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import NO_VECTOR, Joint, Row, Whole, coincidence

NORMAL_ATOL = 1e-6  # cosine of the angle between the axes of the cross
FLAT_COSINE = 1 - 1e-6  # of the angle between the axis of a wheel that lies flat and the normal


def point_on_line(self: Whole, name: str, m1: Marker, m2: Marker, *, axis: Direction) -> None:
    """The point m2 slides on a line through m1, which its body carries; two constraints.

    Args:
        axis: (3,) direction of the line, world at the start [1].
    """
    ends = ends_of(self, name, m1, m2)
    _, rows, way = coaxial(ends, ends.direction("axis", axis))
    enter(self, Joint(name, "point on line", ends.markers, rows[:2], way, None, way))


def point_on_plane(self: Whole, name: str, m1: Marker, m2: Marker, *, normal: Direction) -> None:
    """The point m2 slides in a plane through m1, which its body carries; one constraint.

    Args:
        normal: (3,) of the plane, world at the start [1].
    """
    ends = ends_of(self, name, m1, m2)
    t = ends.triad(ends.direction("normal", normal))
    enter(self, Joint(name, "point on plane", ends.markers, (t.along(2, NO_VECTOR),)))


def distance(
    self: Whole, name: str, m1: Marker, m2: Marker, *, length: Length | None = None
) -> None:
    """Massless rod between two points; one constraint.

    Args:
        length: of the rod [m]; None for the distance at the start.

    Raises:
        ConfigError: if the points coincide.
    """
    ends = ends_of(self, name, m1, m2)
    apart = float(np.linalg.norm(ends.gap))
    if apart == 0.0:
        text = f"the points of joint {name!r} coincide: a rod of length zero has no direction"
        raise ConfigError(f"{text}; use a spherical joint.")
    row = Row(DISTANCE, NO_VECTOR, NO_VECTOR, NO_VECTOR, apart if length is None else length)
    enter(self, Joint(name, "distance", ends.markers, (row,)))


def universal(
    self: Whole, name: str, m1: Marker, m2: Marker, *, axis1: Direction, axis2: Direction
) -> None:
    """Cardan joint: one axis on m1 stays perpendicular to another on m2; four constraints.

    Args:
        axis1: (3,) direction fixed to the first body, world at the start [1].
        axis2: (3,) direction fixed to the second body, world at the start [1].

    Raises:
        ConfigError: if the axes are not perpendicular at the start.
    """
    ends = ends_of(self, name, m1, m2)
    one, two = ends.direction("axis1", axis1), ends.direction("axis2", axis2)
    if abs(one @ two) > NORMAL_ATOL:
        raise ConfigError(f"axes of joint {name!r} must be perpendicular: cosine {one @ two:.3g}.")
    cross = Row(NORMAL, ends.frames[0].T @ one, ends.frames[1].T @ two, NO_VECTOR)
    enter(self, Joint(name, "universal", ends.markers, (*coincidence(), cross)))


def rolling(
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    *,
    normal: Direction,
    radius: Length,
    axis: Direction | None = None,
) -> None:
    """A ball or thin wheel about m2 touches a plane through m1 and rolls on it without slip.

    One constraint of position and two of velocity (not holonomic). Spin about the normal is free.

    Args:
        normal: (3,) of the plane towards the centre, world at the start [1].
        radius: [m].
        axis: (3,) axis of a wheel, world at the start [1]; None for a ball.

    Raises:
        ConfigError: if the wheel lies flat on the plane.
    """
    ends = ends_of(self, name, m1, m2)
    for marker in ends.markers:
        self.part(marker.body).refuse_spin(f"rolling joint {name!r}", "it would not roll")
    up = ends.direction("normal", normal)
    spin = None if axis is None else ends.direction("axis", axis)
    if spin is not None and abs(up @ spin) > FLAT_COSINE:
        raise ConfigError(f"the wheel of {name!r} lies flat; give an axis along the plane.")
    t = ends.triad(up)
    n, s = t.one[:, 2], NO_VECTOR if spin is None else ends.frames[1].T @ spin
    touch = Row(TOUCH, n, s, n, radius=radius)
    rows = tuple(Row(ROLL, t.one[:, i], s, n, radius=radius) for i in (0, 1))
    enter(self, Joint(name, "rolling", ends.markers, (touch, *rows)))
