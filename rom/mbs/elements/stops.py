"""Compliant stops of joint coordinates."""

from dataclasses import dataclass
from typing import Any

from rom.errors import ConfigError
from rom.mbs.elements.contact.impact import Impact, checked_law
from rom.mbs.elements.family import Family, Places, apart, integers, on_joint, rows_of
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.coordinates import coordinate_tangent, push_coordinate
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.tables import Array2, Index1, Table, table
from rom.mbs.parts.joints import Coordinate, Row, coordinate_of
from rom.mbs.parts.whole import Whole


@dataclass(frozen=True, slots=True)
class Stop:
    """Limits of a joint coordinate: (side +1 or -1, place), and their law."""

    joint: str
    row: Row
    limits: tuple[tuple[int, float], ...]
    law: Impact


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


@table
class Stops(Table):
    """All stops, each limit by itself.

    Attributes:
        at: (l,) joint coordinates.
        law: (l, 5) side +1 or -1, limit, stiffness, exponent, damping factor [s/m or s/rad].
    """

    at: Index1
    law: Array2


def pack(stops: Any, places: Places) -> Stops:
    """The stops as arrays."""
    limits = [(s, side, limit) for s in stops.values() for side, limit in s.limits]
    return Stops(
        integers(places.coordinate(s.joint, s.row) for s, _, _ in limits),
        rows_of(
            ((side, x, s.law.stiffness, s.law.exponent, s.law.damping) for s, side, x in limits), 5
        ),
    )


@inner
def stop_state(law, x, rate):
    """Force of a stop, its derivatives by coordinate and rate, elastic force and depth."""
    depth, speed = law[0] * (x - law[1]), law[0] * rate
    if depth <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    elastic = law[2] * depth ** law[3]
    grip = max(1.0 + law[4] * speed, 0.0)
    stiffness = law[3] * elastic / depth * grip
    damping = elastic * law[4] if grip > 0.0 else 0.0
    return -law[0] * elastic * grip, -stiffness, -damping, law[0] * elastic, depth


@residuals.of(Stops)
def stop_wrenches(s, W, stops, _q, _v, _lam):
    """Add the stops to the wrenches on the markers; add up the power lost."""
    for k in range(stops.at.size):
        at = stops.at[k]
        force, _, _, elastic, _ = stop_state(stops.law[k], W.x[at], W.xd[at])
        push_coordinate(s, W, at, force)
        W.power[2] -= (force + elastic) * W.xd[at]


@tangents.of(Stops)
def stop_tangents(s, W, stops, _lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S."""
    for k in range(stops.at.size):
        at = stops.at[k]
        force, by_x, by_rate, _, depth = stop_state(stops.law[k], W.x[at], W.xd[at])
        if depth > 0.0:
            coordinate_tangent(s, W, at, (ck * force, ck * by_x, cc * by_rate), W.Kt, W.S)


@energy.of(Stops)
def stop_energy(_s, W, stops, _q, _v):
    """Elastic energy in stops."""
    total = 0.0
    for k in range(stops.at.size):
        law = stops.law[k]
        depth = law[0] * (W.x[stops.at[k]] - law[1])
        if depth > 0.0:
            total += law[2] * depth ** (law[3] + 1.0) / (law[3] + 1.0)
    return total


STOPS_FAMILY = Family(
    "stops", Stop, pack, stop_wrenches, stop_tangents, stop_energy, ends=on_joint, couples=apart
)  # fmt: skip
