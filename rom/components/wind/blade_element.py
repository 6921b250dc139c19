"""Wind on the blades of a turbine: quasi-steady lift and drag on each vertex of a rod.

Each vertex stands for a strip of blade. Air comes with a wind that the rotor has slowed down by one
factor for all of it, less the velocity of the strip; what flows across the section makes lift and
drag, all of the past is forgotten. The force follows the motion of the strip, so that it also damps
flapping: it is a law of one frame, with exact derivatives.

Source:
    Strip theory as in Hansen, Aerodynamics of Wind Turbines, 2008, chapter 6, with a given
    induction instead of its iteration; chords from Jonkman, Butterfield, Musial, Scott,
    NREL/TP-500-38060, 2009, table 3-1.
"""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import carray

from rom.components.wind.wind_turbine import BLADE_LENGTH, HUB_RADIUS
from rom.errors import ConfigError
from rom.mbs.elements.nonlinear import Elements, compiled_law
from rom.mbs.elements.rods.bodies import RodBody
from rom.mbs.elements.rods.energy import rotation_of
from rom.model import Array, Mask

RADIUS = (2.8667, 5.6, 8.3333, 11.75, 15.85, 19.95, 24.05, 28.15, 32.25, 36.35, 40.45, 44.55, 48.65,
          52.75, 56.1667, 58.9, 61.6333)  # m from the axis of the rotor  # fmt: skip
CHORD = (3.542, 3.854, 4.167, 4.557, 4.652, 4.458, 4.249, 4.007, 3.748, 3.502, 3.256, 3.010, 2.764,
         2.518, 2.313, 2.086, 1.419)  # m  # fmt: skip
CIRCULAR_RADIUS = 9.7  # distance from the axis [m]: sections inside are circles, without lift
AIR_DENSITY = 1.225  # [kg/m^3]
BETZ_INDUCTION = 1 / 3  # of the best rotor
# one profile for the whole blade, ours: thin plate with the camber of the outer sections
LIFT_SLOPE, ZERO_LIFT = 2 * math.pi, np.radians(-4.0)
DRAG_COEFFICIENT, CIRCLE_DRAG_COEFFICIENT = 0.01, 0.5


def strip(numbers, pose, wanted, answer, space):
    """Wind on one strip: half density times area, wind (3), lift (2), drag."""
    given, s = carray(numbers, (7,)), carray(pose, (13,))
    out, room = carray(answer, (2 + 6 + 72,)), carray(space, (64,))
    out[:] = 0.0
    R, J, L = room[0:9].reshape((3, 3)), room[9:18].reshape((3, 3)), room[18:27].reshape((3, 3))
    rotation_of(s[3:7], R)
    wx, wy, wz = given[1] - s[7], given[2] - s[8], given[3] - s[9]
    # across the section: from the pressure side, and from the leading edge
    a = R[0, 0] * wx + R[1, 0] * wy + R[2, 0] * wz
    b = R[0, 1] * wx + R[1, 1] * wy + R[2, 1] * wz
    c = R[0, 2] * wx + R[1, 2] * wy + R[2, 2] * wz
    k, la, lb, drag = given[0], given[4], given[5], given[6]
    lift, speed = k * (la * a + lb * b), math.sqrt(a * a + b * b)
    f, g = lift * b + k * drag * speed * a, -lift * a + k * drag * speed * b
    for i in range(3):
        out[2 + i] = -(R[i, 0] * f + R[i, 1] * g)
        out[1] += out[2 + i] * s[7 + i]
    if wanted == 0 or speed == 0.0:
        return
    J[:] = 0.0
    J[0, 0] = k * (la * b + drag * (speed + a * a / speed))
    J[0, 1] = k * (la * a + 2 * lb * b + drag * a * b / speed)
    J[1, 0] = k * (-2 * la * a - lb * b + drag * a * b / speed)
    J[1, 1] = k * (-lb * a + drag * (speed + b * b / speed))
    # by rotations of the frame: the force turns, and the air turns against it
    L[:] = 0.0
    for i in range(2):
        L[i, 0] = J[i, 1] * c
        L[i, 1] = -J[i, 0] * c
        L[i, 2] = J[i, 0] * b - J[i, 1] * a
    L[0, 2] -= g
    L[1, 2] += f
    L[2, 0], L[2, 1] = g, -f
    for i in range(3):
        for j in range(3):
            for m in range(3):
                out[8 + 6 * i + 3 + j] -= R[i, m] * L[m, j]
                for n in range(2):
                    if m < 2:
                        out[44 + 6 * i + j] += R[i, m] * J[m, n] * R[j, n]


@cache
def compiled_strip() -> Any:
    """The compiled law of a strip."""
    return compiled_law(strip)


def in_wind(
    blade: RodBody,
    wind: npt.ArrayLike,
    *,
    induction: float = BETZ_INDUCTION,
    density: float = AIR_DENSITY,
) -> RodBody:
    """A blade of the NREL 5 MW turbine in the wind, for `rom.Mechanism.add_nonlinear`.

    Section axes are those of `rom.components.wind.wind_turbine.blade`: the first one downwind where
    the blade has no twist, the second towards the trailing edge.

    Args:
        blade: from ``cosserat.body(blade(...))``.
        wind: (3,) velocity of the wind far away, world [m/s].
        induction: share by which the rotor slows the wind down, 0 to below 1 [1].
        density: of the air [kg/m^3].

    Raises:
        ConfigError: for a wind that is no vector, an induction or a density that cannot be.
    """
    wind = np.asarray(wind, dtype=float)
    if wind.shape != (3,) or not np.isfinite(wind).all():
        raise ConfigError(f"the wind {wind.tolist()} is no velocity of three numbers.")
    if not 0.0 <= induction < 1.0 or not density > 0.0:
        raise ConfigError(f"no rotor has the induction {induction:g} in air of {density:g} kg/m^3.",
                          hint="The induction lies between 0 and 1.")  # fmt: skip
    area, lifting = strips(blade)
    n = area.size
    lift = LIFT_SLOPE * np.array([np.cos(ZERO_LIFT), -np.sin(ZERO_LIFT)]) * lifting[:, None]
    drag = np.where(lifting, DRAG_COEFFICIENT, CIRCLE_DRAG_COEFFICIENT)
    slowed = np.tile((1.0 - induction) * wind, (n, 1))
    numbers = np.column_stack([0.5 * density * area, slowed, lift, drag])
    blown = Elements.of(compiled_strip(), np.arange(n)[:, None], numbers)
    return replace(blade, elements=(*blade.elements, blown))


def strips(blade: RodBody) -> tuple[Array, Mask]:
    """(N + 1,) areas of the strips of the vertices [m^2], and whether they make lift."""
    radius = HUB_RADIUS + BLADE_LENGTH * np.linspace(0.0, 1.0, blade.rod.h.size + 1)
    wide = np.zeros_like(radius)
    wide[:-1] += blade.rod.h / 2
    wide[1:] += blade.rod.h / 2
    return wide * np.interp(radius, RADIUS, CHORD), radius > CIRCULAR_RADIUS
