"""Joints that hold one point only: on a line, in a plane, at a distance."""

import numpy as np

from rom.arguments import Direction, Length
from rom.errors import ConfigError
from rom.mbs.connections.ends import ends_of, enter
from rom.mbs.kernels.system import DISTANCE
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import NO_VECTOR, Joint, Row
from rom.mbs.parts.whole import Whole


def point_on_line(self: Whole, name: str, m1: Marker, m2: Marker, *, axis: Direction) -> None:
    """The point m2 slides on a line through m1; two constraints.

    Args:
        name: name of the joint.
        m1: point of the line, which its body carries.
        m2: what slides.
        axis: (3,) direction of the line, world at the start [1].

    Raises:
        ConfigError: for a name in use, an unknown marker, one body twice, or no direction.
        ModelError: if a body has free-free modes only, which carry no moment to an interface.
    """
    ends = ends_of(self, name, m1, m2)
    t = ends.triad(ends.direction("axis", axis))
    rows, displacement = (
        (t.along(0, NO_VECTOR), t.along(1, NO_VECTOR)),
        t.along(2, ends.gap_of_first),
    )
    enter(self, Joint(name, "point on line", ends.markers, rows, displacement, None, displacement))


def point_on_plane(self: Whole, name: str, m1: Marker, m2: Marker, *, normal: Direction) -> None:
    """The point m2 slides in a plane through m1; one constraint.

    Args:
        name: name of the joint.
        m1: point of the plane, which its body carries.
        m2: what slides.
        normal: (3,) of the plane, world at the start [1].

    Raises:
        ConfigError: for a name in use, an unknown marker, one body twice, or no direction.
        ModelError: if a body has free-free modes only, which carry no moment to an interface.
    """
    ends = ends_of(self, name, m1, m2)
    t = ends.triad(ends.direction("normal", normal))
    enter(self, Joint(name, "point on plane", ends.markers, (t.along(2, NO_VECTOR),)))


def distance(
    self: Whole, name: str, m1: Marker, m2: Marker, *, length: Length | None = None
) -> None:
    """Massless rod between two points; one constraint.

    Args:
        name: name of the joint.
        m1: one end.
        m2: other end.
        length: of the rod [m]; None for the distance at the start.

    Raises:
        ConfigError: if the points coincide.
    """
    ends = ends_of(self, name, m1, m2)
    apart = float(np.linalg.norm(ends.gap))
    if apart == 0.0:
        raise ConfigError(
            f"the points of joint {name!r} coincide: a rod of length zero has no direction.",
            hint="Use a spherical joint.",
        )
    row = Row(DISTANCE, NO_VECTOR, NO_VECTOR, NO_VECTOR, apart if length is None else length)
    enter(self, Joint(name, "distance", ends.markers, (row,)))
