"""Rotational springs, compliant stops and friction along the coordinates of joints."""

from dataclasses import dataclass
from typing import Annotated

from rom.arguments import Angle, AtLeast, Length, NotNegative, Number, Positive
from rom.errors import ConfigError
from rom.mbs.elements.contact.impact import Impact, checked_law
from rom.mbs.elements.family import Hooks
from rom.mbs.elements.joint_forces import (
    FRICTION,
    LINEAR,
    STOP,
    Frictions,
    joint_energy,
    joint_family,
    load_columns,
)
from rom.mbs.elements.springs import doubt
from rom.mbs.parts.joints import Coordinate, Row, Whole, coordinate_of


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
        joint: joint with an angle.
        stiffness: [N m/rad].
        damping: [N m s/rad].
        free_angle: angle without moment [rad].

    Raises:
        ConfigError: for a joint that does not turn.
    """
    coordinate_of(self.joints, joint, "angle", f"rotational spring {name!r}")
    doubt(name, stiffness, damping)
    self.add(name, Turn(joint, stiffness, damping, free_angle), TURNS_FAMILY)


TURNS_FAMILY = joint_family(
    "turns", Turn, LINEAR, energy=joint_energy, by_rate=lambda turns: turns.law[:, 1].any()
)


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
    if not limits or limits[0][1] > limits[-1][1]:
        text = f"stop {name!r} has no limit or no room: give lower = {lower} or upper = {upper}"
        raise ConfigError(f"{text}, and lower at most upper.")
    self.add(name, Stop(joint, row, tuple(limits), law), STOPS_FAMILY)


STOPS_FAMILY = joint_family("stops", Stop, STOP, energy=joint_energy)


@dataclass(frozen=True, slots=True)
class Friction:
    """Dry and viscous friction along a joint coordinate; numbers of `joint_forces.friction`."""

    joint: str
    row: Row
    laws: tuple[tuple[float, ...], ...]


def friction(  # noqa: PLR0913  one keyword per property
    self: Whole,
    name: str,
    joint: str,
    *,
    transition_speed: Annotated[float, Positive()],
    coulomb: Annotated[float, NotNegative()] = 0.0,
    mu: Annotated[float, NotNegative()] = 0.0,
    radius: Length | None = None,
    static: Annotated[float, AtLeast(1.0)] = 1.0,
    stribeck_speed: Annotated[float, Positive()] | None = None,
    viscous: Annotated[float, NotNegative()] = 0.0,
    coordinate: Coordinate | None = None,
) -> None:
    """Friction along a joint coordinate x: - level s(x') - viscous x'.

    s(v) = tanh(v / transition_speed) (1 + (static - 1) exp(-(v / stribeck_speed)^2)), and
    level = coulomb + mu radius |F| with the resultant force F that the joint transmits. What
    sticks creeps with less than the transition speed.

    Args:
        joint: joint with a coordinate.
        transition_speed: speed over which the sign changes [m/s or rad/s]; implicit steps
            that change the speed by much more take many corrections.
        coulomb: level that is always there [N or N m].
        mu: coefficient of friction [1].
        radius: at which friction acts on an angle, that of the pin [m]; none for a displacement.
        static: level at rest over that of fast motion, at least 1 [1].
        stribeck_speed: speed over which this fades [m/s or rad/s].
        viscous: force per speed [N s/m or N m s/rad].
        coordinate: "angle" or "displacement"; None for the only or the first one.

    Raises:
        ConfigError: for a joint without such a coordinate, or mu on an angle without radius, or
            static without its speed.
    """
    row = coordinate_of(self.joints, joint, coordinate, "friction")
    turns = row is self.joints[joint].turn
    faults = {
        "with mu on an angle needs the radius of the pin": mu and turns and radius is None,
        "acts along a displacement; leave radius out": radius is not None and not turns,
        f"has static = {static:g}: it needs stribeck_speed": static > 1.0 and not stribeck_speed,
    }
    for fault, found in faults.items():
        if found:
            raise ConfigError(f"friction {name!r} {fault}.")
    level, fade = mu * (1.0 if radius is None else radius), stribeck_speed or 1.0
    numbers = (coulomb, level, static - 1.0, fade, viscous, transition_speed)
    self.add(name, Friction(joint, row, (numbers,)), FRICTIONS_FAMILY)


BY_LOAD = {
    "multiplier_columns": load_columns,
    "hooks": Hooks(loaded_rows=lambda found: found.load_first[found.law[:, 1] != 0.0]),
}
FRICTIONS_FAMILY = joint_family("frictions", Friction, FRICTION, Frictions, **BY_LOAD)
