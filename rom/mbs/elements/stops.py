"""Compliant stops of joint coordinates."""

from dataclasses import dataclass

from rom.errors import ConfigError
from rom.mbs.elements.contact.impact import Impact, checked_law
from rom.mbs.elements.joint_forces import STOP, joint_energy, joint_family
from rom.mbs.parts.joints import Coordinate, Row, coordinate_of
from rom.mbs.parts.whole import Whole


@dataclass(frozen=True, slots=True)
class Stop:
    """Limits of a joint coordinate: (side +1 or -1, place), and their law."""

    joint: str
    row: Row
    limits: tuple[tuple[int, float], ...]
    law: Impact

    @property
    def laws(self) -> tuple[tuple[float, ...], ...]:
        """Numbers of each limit."""
        numbers = self.law.stiffness, self.law.exponent, self.law.damping
        return tuple((side, limit, *numbers) for side, limit in self.limits)


def stop(
    self: Whole,
    name: str,
    joint: str,
    law: Impact,
    *,
    lower: float | None = None,
    upper: float | None = None,
    coordinate: Coordinate | None = None,
) -> None:
    """Limit a joint coordinate by compliant stops.

    Args:
        name: name of the stops.
        joint: joint with a coordinate.
        law: `rom.mbs.Impact`, its friction without effect.
        lower: smallest coordinate without force [rad or m]; None for no limit.
        upper: largest one [rad or m].
        coordinate: "angle" or "displacement"; None for the only or the first one.

    Raises:
        ConfigError: for a joint without such a coordinate, or limits that leave no room.
    """
    row = coordinate_of(self.joints, joint, coordinate, "stop")
    law = checked_law(name, law)
    places = [(-1, lower), (1, upper)]
    limits = [(side, float(x)) for side, x in places if x is not None]
    if not limits:
        raise ConfigError(f"stop {name!r} has no limit.", hint="Give lower or upper.")
    if len(limits) == 2 and limits[0][1] > limits[1][1]:
        raise ConfigError(f"stop {name!r}: lower = {lower:g} must be at most upper = {upper:g}.")
    self.add(name, Stop(joint, row, tuple(limits), law), STOPS_FAMILY)


STOPS_FAMILY = joint_family("stops", Stop, STOP, energy=joint_energy)
