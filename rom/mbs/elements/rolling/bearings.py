"""Rolling bearings as elements: what users describe, and their arrays."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rom.arguments import not_negative, number, unit_vector
from rom.errors import ConfigError
from rom.mbs.elements.family import Family, Places, integers, rows_of
from rom.mbs.elements.rolling.contacts import (
    DAMPING,
    Bearings,
    bearing_energy,
    bearing_tangents,
    bearing_wrenches,
)
from rom.mbs.elements.rolling.races import BallBearing, RollerBearing
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.whole import Whole
from rom.model import Array
from rom.rotation import matrix

PLACE_RTOL = 1e-2  # of the pitch diameter: by which rings may be apart at first


@dataclass(frozen=True, slots=True)
class RollingBearing:
    """A bearing between two rings; axes (4, 3) and race (10,) as in `Bearings`."""

    i: Marker
    j: Marker
    bearing: BallBearing | RollerBearing
    axes: Array
    race: tuple[float, ...]


def rolling_bearing(  # noqa: PLR0913  one keyword per property
    self: Whole,
    name: str,
    inner: Marker,
    outer: Marker,
    *,
    axis: npt.ArrayLike,
    bearing: BallBearing | RollerBearing,
    damping: float = 0.0,
    phase: float = 0.0,
) -> None:
    """Balls or rollers between an inner and an outer ring, by Hertz, with play or preload.

    Where the bodies were added the rings are in the middle of the play. The cage turns with the
    rings without slip; as balls pass below the load the stiffness varies. Balls have no mass, no
    friction and no gyroscopic moment.

    Args:
        name: name of the bearing.
        inner: middle of the inner ring, on its axis.
        outer: of the outer ring, at the same place.
        axis: (3,) of the bearing, in the world at the start.
        bearing: `rom.mbs.BallBearing` or `rom.mbs.RollerBearing`.
        damping: factor of the closing speed by which the force on a ball grows [s/m].
        phase: angle of the first ball about the axis, from some direction across it [rad].

    Raises:
        ConfigError: for a name in use, unknown markers, rings that are not at one place, or numbers
            no bearing has.
    """
    self.check_apart(name, inner, outer)
    z = unit_vector(f"axis of {name}", axis)
    not_negative(f"damping of bearing {name!r}", damping)
    apart = float(np.linalg.norm(self.design_point(inner) - self.design_point(outer)))
    if apart > PLACE_RTOL * bearing.pitch_diameter:
        raise ConfigError(
            f"the rings of bearing {name!r} are {apart * 1e3:.4g} mm apart; they must be at one "
            "place where the bodies are added."
        )
    e = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    e /= np.linalg.norm(e)
    turned = [matrix(self.part(ring.body).p) for ring in (inner, outer)]
    axes = np.array([x @ A for A in turned for x in (z, e)])
    b, parts = bearing, (self.part(inner.body), self.part(outer.body))
    spins = [part.spin_about(name, axes[2 * k]) for k, part in enumerate(parts)]
    spin = spins[1] + b.cage * (spins[0] - spins[1])
    race = (b.stiffness, b.exponent, b.curvature_distance, *b.offset, b.radius, b.cage,
            float(damping), number("phase", phase), spin)  # fmt: skip
    self.add(name, RollingBearing(inner, outer, bearing, axes, race), ROLLING_BEARINGS_FAMILY)


def pack(bearings: Mapping[str, RollingBearing], places: Places) -> Bearings:
    """The bearings as arrays."""
    found = list(bearings.values())
    return Bearings(
        integers(places.marker[one.i] for one in found),
        integers(places.marker[one.j] for one in found),
        rows_of((one.axes.ravel() for one in found), 12),
        integers(one.bearing.count for one in found),
        rows_of((one.race for one in found), 10),
        integers([places.clock()]),
        integers(places.memory(name, np.zeros(1)) for name in bearings),
        np.zeros(len(found)),
        np.zeros((2, 12)),
        np.zeros((2, 12, 12)),
    )


ROLLING_BEARINGS_FAMILY = Family(
    "rolling_bearings", RollingBearing, pack, bearing_wrenches, bearing_tangents, bearing_energy,
    by_rate=lambda bearings: bearings.race[:, DAMPING].any(),
)  # fmt: skip
