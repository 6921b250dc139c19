"""Universal joints: a cross between two shafts."""

from rom.arguments import Direction
from rom.errors import ConfigError
from rom.mbs.connections.ends import ends_of, enter
from rom.mbs.kernels.system import NORMAL
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import NO_VECTOR, Joint, Row, coincidence
from rom.mbs.parts.whole import Whole

NORMAL_ATOL = 1e-6  # cosine of the angle between the axes of the cross


def universal(
    self: Whole,
    name: str,
    m1: Marker,
    m2: Marker,
    *,
    axis1: Direction,
    axis2: Direction,
) -> None:
    """Cardan joint: one axis on m1 stays perpendicular to another on m2; four constraints.

    Args:
        name: name of the joint.
        m1: one side.
        m2: other side.
        axis1: (3,) direction fixed to the first body, world at the start [1].
        axis2: (3,) direction fixed to the second body, world at the start [1].

    Raises:
        ConfigError: if the axes are not perpendicular at the start; for a name in use, an unknown
            marker, one body twice, or no direction.
        ModelError: if a body has free-free modes only, which carry no moment to an interface.
    """
    ends = ends_of(self, name, m1, m2)
    one, two = ends.direction("axis1", axis1), ends.direction("axis2", axis2)
    if abs(one @ two) > NORMAL_ATOL:
        raise ConfigError(f"axes of joint {name!r} must be perpendicular: cosine {one @ two:.3g}.")
    cross = Row(NORMAL, ends.frames[0].T @ one, ends.frames[1].T @ two, NO_VECTOR)
    enter(self, Joint(name, "universal", ends.markers, (*coincidence(), cross)))
