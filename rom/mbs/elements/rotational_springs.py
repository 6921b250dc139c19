"""Rotational springs and dampers about the axes of joints."""

from dataclasses import dataclass
from typing import Annotated, Any

from rom.arguments import Angle, Number
from rom.mbs.elements.family import Family, Places, apart, integers, on_joint, rows_of
from rom.mbs.elements.springs import doubt
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.coordinates import coordinate_tangent, push_coordinate
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.tables import Array2, Index1, Table, table
from rom.mbs.parts.joints import coordinate_of
from rom.mbs.parts.whole import Whole


@dataclass(frozen=True, slots=True)
class Turn:
    """Rotational spring and damper about the axis of a joint."""

    joint: str
    stiffness: float
    damping: float
    free_angle: float


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


@table
class Turns(Table):
    """All rotational springs.

    Attributes:
        at: (t,) joint coordinates.
        law: (t, 3) stiffness [N m/rad], damping [N m s/rad], free angle [rad].
    """

    at: Index1
    law: Array2


def pack(turns: Any, places: Places) -> Turns:
    """The rotational springs as arrays."""
    found = turns.values()
    return Turns(
        integers(places.coordinate(t.joint, places.joints[t.joint].turn) for t in found),
        rows_of(((t.stiffness, t.damping, t.free_angle) for t in found), 3),
    )


@inner
def moment(turns, k, W):
    """Moment with which rotational spring k drives its joint coordinate."""
    at, law = turns.at[k], turns.law[k]
    return -law[0] * (W.x[at] - law[2]) - law[1] * W.xd[at]


@residuals.of(Turns)
def turn_wrenches(s, W, turns, _q, _v, _lam):
    """Add the moments to the wrenches on the markers; add up the power lost."""
    for k in range(turns.at.size):
        push_coordinate(s, W, turns.at[k], moment(turns, k, W))
        W.power[2] += turns.law[k, 1] * W.xd[turns.at[k]] ** 2


@tangents.of(Turns)
def turn_tangents(s, W, turns, _lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S."""
    for k in range(turns.at.size):
        law = ck * moment(turns, k, W), -ck * turns.law[k, 0], -cc * turns.law[k, 1]
        coordinate_tangent(s, W, turns.at[k], law, W.Kt, W.S)


@energy.of(Turns)
def turn_energy(_s, W, turns, _q, _v):
    """Energy stored in rotational springs."""
    total = 0.0
    for k in range(turns.at.size):
        total += 0.5 * turns.law[k, 0] * (W.x[turns.at[k]] - turns.law[k, 2]) ** 2
    return total


TURNS_FAMILY = Family(
    "turns", Turn, pack, turn_wrenches, turn_tangents, turn_energy, ends=on_joint, couples=apart,
    by_rate=lambda turns: turns.law[:, 1].any(),
)  # fmt: skip
