"""Balls and wheels that roll on planes."""

from rom.arguments import Direction, Length
from rom.errors import ConfigError
from rom.mbs.connections.ends import ends_of, enter
from rom.mbs.kernels.system import ROLL, TOUCH
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import NO_VECTOR, Joint, Row
from rom.mbs.parts.whole import Whole

FLAT_COSINE = 1 - 1e-6  # of the angle between the axis of a wheel that lies flat and the normal


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
    """A ball or thin wheel touches a plane and rolls on it without slip.

    One constraint of position and two of velocity (not holonomic). Spin about the normal is
    free.

    Args:
        name: name of the joint.
        m1: point of the plane.
        m2: centre of the ball or wheel.
        normal: (3,) of the plane towards the centre, world at the start [1].
        radius: [m].
        axis: (3,) axis of a wheel, world at the start [1]; None for a ball.

    Raises:
        ConfigError: if the wheel lies flat on the plane.
        ModelError: if a body has free-free modes only, which carry no moment to an interface.
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
