"""Joint coordinates that are prescribed in time, and couplings between two of them."""

from dataclasses import dataclass

from rom.errors import ConfigError
from rom.mbs.connections.ends import not_zero
from rom.mbs.parts.joints import Coordinate, Joint, Whole, coordinate_of, coupling
from rom.mbs.parts.signals import TimeFunction


@dataclass(frozen=True, slots=True)
class Drive:
    """A joint coordinate prescribed in time, with its rate and acceleration or None."""

    joint: str
    function: TimeFunction
    rate: TimeFunction | None
    acceleration: TimeFunction | None


def drive(
    self: Whole,
    name: str,
    joint: str,
    function: TimeFunction,
    *,
    rate: TimeFunction | None = None,
    acceleration: TimeFunction | None = None,
) -> None:
    """Prescribe the angle of a revolute or cylindrical joint, or the way of a prismatic one.

    The coordinate is that of the second marker relative to the first, from the position in
    which the bodies were added. Missing derivatives are taken by finite differences.

    Raises:
        ConfigError: if the joint is unknown or has no coordinate to drive.
    """
    self.check_new(name)
    coordinate_of(self.joints, joint, None, "drive")
    self.drives[name] = Drive(joint, function, rate, acceleration)


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

    Between two angles a pair of gears (negative ratio for outer teeth, seen along parallel axes), a
    chain or a belt; between an angle and a displacement a rack [m/rad]. A carrier that moves is the
    first body of both joints. Angles count over whole turns from the start.

    Args:
        name: ``sol.reaction(name)`` gives its load on the second body of ``joint2``.
        joint2: driven joint.
        ratio: of the changes of coordinate 2 and coordinate 1 [1, m/rad or rad/m].
        coordinate1: "angle" or "displacement"; None for the only or the first one.
        coordinate2: likewise of ``joint2``.

    Raises:
        ConfigError: if a joint has no such coordinate, or is named twice.
    """
    self.check_new(name)
    names, wanted = (joint1, joint2), (coordinate1, coordinate2)
    one, two = (
        coordinate_of(self.joints, j, c, "gear") for j, c in zip(names, wanted, strict=True)
    )
    if one is two:
        raise ConfigError(f"gear {name!r} couples {joint1!r} with itself; give two coordinates.")
    row = coupling((two, 1.0), (one, -not_zero("ratio", ratio)))
    markers = (*self.joints[joint2].markers, *self.joints[joint1].markers)
    self.joints[name] = Joint(name, "coupling", markers, (row,))
