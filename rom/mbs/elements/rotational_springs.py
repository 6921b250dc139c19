"""Rotational springs and dampers about the axes of joints."""

from dataclasses import dataclass
from typing import Annotated

from rom.arguments import Angle, Number
from rom.mbs.elements.joint_forces import LINEAR, joint_energy, joint_family
from rom.mbs.elements.springs import doubt
from rom.mbs.parts.joints import coordinate_of
from rom.mbs.parts.whole import Whole


@dataclass(frozen=True, slots=True)
class Turn:
    """Rotational spring and damper about the axis of a joint."""

    joint: str
    stiffness: float
    damping: float
    free_angle: float

    @property
    def laws(self) -> tuple[tuple[float, ...], ...]:
        """Its numbers."""
        return ((self.stiffness, self.damping, self.free_angle),)


def rotational_spring(
    self: Whole,
    name: str,
    joint: str,
    *,
    stiffness: Annotated[float, Number("N m/rad")],
    damping: Annotated[float, Number("N m s/rad")] = 0.0,
    free_angle: Angle = 0.0,
) -> None:
    """Spring and damper about the axis of a joint that turns.

    Args:
        name: name of the spring.
        joint: joint with an angle.
        stiffness: [N m/rad].
        damping: [N m s/rad].
        free_angle: angle without moment [rad].

    Raises:
        ConfigError: for a name in use, or a joint that is unknown or does not turn.
    """
    coordinate_of(self.joints, joint, "angle", f"rotational spring {name!r}")
    doubt(name, stiffness, damping)
    self.add(name, Turn(joint, stiffness, damping, free_angle), TURNS_FAMILY)


TURNS_FAMILY = joint_family(
    "turns", Turn, LINEAR, energy=joint_energy, by_rate=lambda turns: turns.law[:, 1].any()
)
