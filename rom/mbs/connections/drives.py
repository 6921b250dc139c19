"""Joint coordinates that are prescribed in time."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rom.mbs.parts.joints import joint_with_axis
from rom.mbs.parts.whole import Whole

TimeFunction = Callable[[float], Any]


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
    joint_with_axis(self.joints, joint, "drive")
    self.drives[name] = Drive(joint, function, rate, acceleration)
