"""Couplings between the coordinates of two joints."""

from rom.errors import ConfigError
from rom.mbs.connections.ends import not_zero
from rom.mbs.kernels.system import COUPLING
from rom.mbs.parts.joints import NO_VECTOR, Coordinate, Joint, Row, coordinate_of
from rom.mbs.parts.whole import Whole


def gear(
    self: Whole,
    name: str,
    joint1: str,
    joint2: str,
    *,
    ratio: float,
    coordinate1: Coordinate | None = None,
    coordinate2: Coordinate | None = None,
) -> None:
    """Couple two joints: coordinate of the second = ``ratio`` times that of the first.

    Between two angles a pair of gears (negative ratio for outer teeth, seen along parallel
    axes), a chain or a belt; between an angle and a displacement a rack [m/rad]. A
    carrier that moves is the first body of both joints. Angles count over whole turns from the
    start.

    Args:
        name: name of the coupling; ``sol.reaction`` gives its load on the second body of
            ``joint2``.
        joint1: driving joint.
        joint2: driven joint.
        ratio: of the changes of coordinate 2 and coordinate 1 [1, m/rad or rad/m].
        coordinate1: "angle" or "displacement"; None for the only or the first one.
        coordinate2: likewise of ``joint2``.

    Raises:
        ConfigError: if a joint is unknown, has no such coordinate, or is named twice.
    """
    self.check_new(name)
    names, wanted = (joint1, joint2), (coordinate1, coordinate2)
    rows = tuple(
        coordinate_of(self.joints, j, c, "gear") for j, c in zip(names, wanted, strict=True)
    )
    if rows[0] is rows[1]:
        raise ConfigError(f"gear {name!r} couples {joint1!r} with itself; give two coordinates.")
    terms = ((rows[1], 1.0), (rows[0], -not_zero("ratio", ratio)))
    row = Row(COUPLING, NO_VECTOR, NO_VECTOR, NO_VECTOR, terms=terms)
    markers = (*self.joints[joint2].markers, *self.joints[joint1].markers)
    self.joints[name] = Joint(name, "coupling", markers, (row,))
