"""The blades of a rotor as strips, and what the wind does to them at a steady speed.

The shaft may be tilted and the blades coned; a strip then meets other air at each azimuth, and the
balance of momentum is struck strip by strip and azimuth by azimuth. The tower dams the wind ahead,
as the potential flow round a circular cylinder in each horizontal plane.

Source:
    Jonkman, Butterfield, Musial, Scott, NREL/TP-500-38060, 2009, table 3-1: the blade.
    Hansen, Aerodynamics of Wind Turbines, 2008, chapters 6, 8 and 9: elements of a blade, tower.
"""

import csv
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np

from rom.arguments import Between, Count, NotNegative, Positive, one_each, typed
from rom.components.compiled import inner, kernel
from rom.components.wind.momentum import CHORD_COLUMN, coefficients, slowed
from rom.components.wind.profiles import Profile, profiles
from rom.components.wind.wind_turbine import (
    CONE_ANGLE,
    HUB_OVERHANG,
    HUB_RADIUS,
    N_BLADES,
    SHAFT_HEIGHT,
    SHAFT_TILT,
    TOWER_HEIGHT,
    TUBE_SIZES,
)
from rom.errors import ConfigError
from rom.model import Array

# radius of the tower at foot and top [m], its height [m]; zero: no dam
TOWER_TUBE = (TUBE_SIZES["diameter"][0] / 2, TUBE_SIZES["diameter"][1] / 2, TOWER_HEIGHT)
NO_TOWER = (0.0, 0.0, TOWER_HEIGHT)


@inner
def wind_at(tower, x, y, z, v):
    """Turn the wind v far away into that at a place; the axis of the tower is x = y = 0.

    With Z = x + i y, U = v_x + i v_y and the radius a, the flow is conj(U) - U a^2 / Z^2.
    """
    foot, top, height = tower
    square = x * x + y * y
    if foot <= 0.0 or z > height or z < 0.0 or square == 0.0:
        return
    a = foot + (top - foot) * z / height
    share = a * a / max(square, a * a) / square  # inside the tower as on its face
    c, s = share * (x * x - y * y), -share * 2 * x * y  # a^2 / Z^2
    u, w = v[0], v[1]
    v[0] = u - (u * c - w * s)
    v[1] = w + u * s + w * c


@inner
def slope_of_wind(tower, place, wind, out):
    """(3, 3) how the wind at a place grows with the place."""
    foot, top, height = tower
    x, y, z = place
    for i in range(3):
        for j in range(3):
            out[i, j] = 0.0
    square = x * x + y * y
    a = foot + (top - foot) * z / height
    if foot <= 0.0 or z > height or z < 0.0 or square <= a * a:
        return
    p = complex(wind[0], wind[1]) / complex(x, y) ** 2
    along = 2 * a * a * p / complex(x, y)
    up = -2 * a * (top - foot) / height * p
    out[0, 0], out[0, 1], out[0, 2] = along.real, -along.imag, up.real
    out[1, 0], out[1, 1], out[1, 2] = -along.imag, -along.real, -up.imag


# table 3-1: middle of an element from the axis [m], its length along the blade [m], its chord [m],
# its twist [deg]
with (Path(__file__).parent / "nrel5mw_elements.csv").open(encoding="utf-8") as lines:
    *_COLUMNS, ELEMENT_PROFILE = zip(*list(csv.reader(lines))[1:], strict=True)
RADIUS, ELEMENT_LENGTH, CHORD, ELEMENT_TWIST = (tuple(map(float, x)) for x in _COLUMNS)
ROTOR_RADIUS = 63.0  # m
AIR_DENSITY = 1.225  # [kg/m^3]
BETZ_LIMIT = 16 / 27  # of the power in the wind
LARGEST_ANGLE = 2 * math.pi  # of pitch, either way [rad]
Pitch = Annotated[float, Between(-LARGEST_ANGLE, LARGEST_ANGLE, unit="rad")]
Slant = Annotated[float, Between(-math.pi / 4, math.pi / 4, "()", "rad")]
N_AZIMUTHS = 24  # of a turn, a multiple of three blades


@typed
@dataclass(frozen=True)
class Blading:
    """Blades of a rotor for the wind.

    Attributes:
        radius: (n,) middle of a strip from the axis of the rotor, along the blade [m].
        length: (n,) of a strip along the blade [m].
        chord: (n,) of a strip [m].
        twist: (n,) leading edge into the wind [rad].
        profile: (n,) profile of a strip.
        rotor_radius: end of the blades [m].
        hub_radius: start of the blades [m].
        n_blades: number of blades.
        tilt: of the shaft, nose up [rad].
        cone: of the blades, upwind [rad].
        density: of the air [kg/m^3].
    """

    radius: Array
    length: Annotated[Array, Positive("m", (None,))]
    chord: Annotated[Array, Positive("m", (None,))]
    twist: Array
    profile: tuple[Profile, ...]
    rotor_radius: float = ROTOR_RADIUS
    hub_radius: float = HUB_RADIUS
    n_blades: Annotated[int, Count(1)] = N_BLADES
    tilt: Slant = SHAFT_TILT
    cone: Slant = CONE_ANGLE
    density: Annotated[float, Positive("kg/m^3")] = AIR_DENSITY

    def __post_init__(self) -> None:
        size = len(self.profile)
        for name in ("radius", "length", "chord", "twist"):
            one_each(f"of {name}", getattr(self, name).shape, "profiles", (size,))
        low, high = self.radius.min(initial=np.inf), self.radius.max(initial=0.0)
        if not 0.0 < self.hub_radius < low <= high < self.rotor_radius:
            span = f"blades from {self.hub_radius:g} to {self.rotor_radius:g} m"
            text = f"strips lie from {low:g} to {high:g} m, {span}."
            raise ConfigError(text, hint="Radii are those of the middles of strips.")

    @property
    def area(self) -> float:
        """Of the disc that the blades sweep without cone [m^2]."""
        return float(np.pi * self.rotor_radius**2)

    @cached_property
    def strips(self) -> Array:
        """(n, 5) what the balance of momentum knows of each strip."""
        c, size = math.cos(self.cone), len(self.profile)
        ends = np.tile([self.rotor_radius * c, self.hub_radius * c, self.n_blades], (size, 1))
        return np.column_stack([self.radius * c, self.chord, ends])

    @cached_property
    def tables(self) -> tuple[Array, Array]:
        """(n, 3 k) profiles, angles [rad], lift and drag [1] of each, and its number of angles."""
        count = np.array([p.angle.size for p in self.profile])
        rows = np.zeros((count.size, 3 * count.max()))
        for row, one in zip(rows, self.profile, strict=True):
            row[: 3 * one.angle.size] = one.table.ravel()
        return rows, count


class RotorLoad(NamedTuple):
    """What the wind does to a rotor that turns steadily.

    Attributes:
        wind: speed far away [m/s].
        speed: of the rotor [rad/s].
        pitch: of the blades [rad].
        thrust: along the shaft, mean over a turn [N].
        torque: about the shaft, mean over a turn [N m].
        power_coefficient: power over that in the wind through the disc [1].
        thrust_coefficient: thrust over dynamic pressure times area [1].
        azimuth: (k,) of a blade, 0 up [rad].
        strip: (k, n, 6) at an azimuth and strip: force per length across the plane of the rotor and
            in it [N/m], air through the plane and in it [m/s], angle of attack [rad], axial
            induction [1].
        blade_thrust: (k,) of one blade [N].
        blade_torque: (k,) of one blade [N m].
    """

    wind: float
    speed: float
    pitch: float
    thrust: float
    torque: float
    power_coefficient: float
    thrust_coefficient: float
    azimuth: Array
    strip: Array
    blade_thrust: Array
    blade_torque: Array

    @property
    def power(self) -> float:
        """On the shaft [W]."""
        return self.torque * self.speed


def blading(tilt: float = SHAFT_TILT, cone: float = CONE_ANGLE) -> Blading:
    """The blades of the NREL 5 MW turbine, in seventeen strips.

    The shaft is tilted nose up, the blades are coned upwind [rad].

    Raises:
        ConfigError: for angles beyond the model.
    """
    given = profiles()
    return Blading(
        radius=np.array(RADIUS),
        length=np.array(ELEMENT_LENGTH),
        chord=np.array(CHORD),
        twist=np.radians(ELEMENT_TWIST),
        profile=tuple(given[name] for name in ELEMENT_PROFILE),
        tilt=tilt,
        cone=cone,
    )


@inner
def strip_load(strip, table, k, theta, flow, half_density):
    """Force per length across the plane of the rotor and in it; air through and across; attack."""
    through, across, _ = flow
    phi = math.atan2(through, across)
    cl, cd, _, _ = coefficients(table, k, phi - theta)
    q = half_density * strip[CHORD_COLUMN] * math.sqrt(through * through + across * across)
    return q * (cl * across + cd * through), q * (cl * through - cd * across), phi - theta


@kernel
def turn(strips, tables, counts, shape, angles, wind, motion, tower, out):  # noqa: PLR0913  the state
    """Rows of out for each azimuth and strip: the loads of one blade."""
    axial, radius = shape
    tilt, cone, overhang, height = angles
    speed, pitch, half_density = motion
    front, side, skew = wind
    ct, st, cc, sc = math.cos(tilt), math.sin(tilt), math.cos(cone), math.sin(cone)
    v = np.zeros(3)
    along = math.hypot(front * st, side)  # the disc
    lean = skew * math.atan2(along, front * ct)
    for i in range(out.shape[0]):
        s, c = math.sin(2 * math.pi * i / out.shape[0]), math.cos(2 * math.pi * i / out.shape[0])
        toward = (c * front * st - s * side) / along if along > 0.0 else 0.0
        for j in range(out.shape[1]):
            r, lift = radius[j] * cc, -overhang - radius[j] * sc
            x = lift * ct + r * c * st
            v[0], v[1], v[2] = front, side, 0.0
            wind_at(tower, x, -r * s, height - lift * st + r * c * ct, v)
            n, e = v[0] * ct, c * v[0] * st - s * v[1]
            ahead = -c * v[1] - s * v[0] * st  # with the motion of the blade
            theta, far = axial[j] + pitch, cc * n + sc * e
            far_off = far, speed * r - ahead
            strip, table, k = strips[j], tables[j], counts[j]
            flow = slowed(strip, table, k, theta, far_off, (lean, toward))
            normal, tangential, attack = strip_load(strip, table, k, theta, flow, half_density)
            row = out[i, j]
            row[0], row[1], row[2], row[3], row[4] = normal, tangential, flow[0], flow[1], attack
            row[5] = 1.0 - flow[0] / far if far != 0.0 else 0.0


@typed
def rotor_load(  # noqa: PLR0913  one keyword per choice, all with defaults
    blades: Blading,
    wind: Annotated[float, NotNegative("m/s")],
    speed: Annotated[float, NotNegative("rad/s")],
    pitch: Pitch = 0.0,
    *,
    yaw: Slant = 0.0,
    skew: bool = True,
    tower: bool = False,
    n_azimuths: Annotated[int, Count(1)] = N_AZIMUTHS,
) -> RotorLoad:
    """Loads of a rotor in steady wind, by momentum balance on every strip and azimuth.

    Example:
        >>> from rom.components.wind import blading, rotor_load
        >>> ahead, aside = (rotor_load(blading(), 8.0, 1.0, yaw=x) for x in (0.0, 0.5))
        >>> bool(aside.power < 0.8 * ahead.power)
        True

    Args:
        blades: see `blading`.
        wind: its speed [m/s].
        speed: of the rotor [rad/s].
        pitch: of all blades, leading edge into the wind [rad].
        yaw: of the wind about the upright axis, from the first axis to the second [rad].
        skew: whether the wake leans as the wind does on a disc that is tilted or yawed.
        tower: whether the tower of the turbine dams the wind.
        n_azimuths: places of a blade in a turn.
    """
    out = np.zeros((n_azimuths, len(blades.profile), 6))
    shape, tube = (blades.twist, blades.radius), TOWER_TUBE if tower else NO_TOWER
    angles = blades.tilt, blades.cone, HUB_OVERHANG, TOWER_HEIGHT + SHAFT_HEIGHT
    far = wind * math.cos(yaw), wind * math.sin(yaw), float(skew)
    motion = float(speed), float(pitch), 0.5 * blades.density
    turn(blades.strips, *blades.tables, shape, angles, far, motion, tube, out)
    c = math.cos(blades.cone)
    thrust = c * out[:, :, 0] @ blades.length
    torque = c * out[:, :, 1] @ (blades.radius * blades.length)
    pushed, turned = blades.n_blades * thrust.mean(), blades.n_blades * torque.mean()
    pressure = 0.5 * blades.density * blades.area * wind**2
    C_P = turned * speed / (pressure * wind) if wind > 0.0 else 0.0
    C_T = pushed / pressure if wind > 0.0 else 0.0
    azimuth = 2 * np.pi / n_azimuths * np.arange(n_azimuths)
    return RotorLoad(wind, speed, pitch, pushed, turned, C_P, C_T, azimuth, out, thrust, torque)
