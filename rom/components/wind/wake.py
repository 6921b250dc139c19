"""The wake of a strip with its memory: filters, and the law by which rods of a mechanism meet it.

The wake follows a change of the loads late. Two filters in series on the induced velocity of each
strip describe it, and a law remembers what they hold from one accepted step to the next. Within a
step the steady value is taken as straight.

Source:
    Oye, as in Hansen, Aerodynamics of Wind Turbines, 2008, chapter 9: filters and their times.
"""

import math
from functools import cache
from typing import cast

import numpy as np
import numpy.typing as npt
from numba import carray

from rom.arguments import finite, not_negative
from rom.components.cosserat.bodies import RodBody
from rom.components.wind.blade_element import (
    PROFILE_START,
    TWIST_PLACE,
    far_away,
    meet,
    on_section,
    strip_rows,
)
from rom.components.wind.blading import AIR_DENSITY, strip_load
from rom.components.wind.momentum import (
    RADIUS_COLUMN,
    ROTOR_COLUMN,
    STRIP_WIDTH,
    induced,
    interval,
    skewed,
)
from rom.components.wind.wind_turbine import CONE_ANGLE
from rom.errors import ConfigError
from rom.mbs.elements.law_calls import LAW_TYPES, compiled_entry
from rom.mbs.elements.nonlinear import Assembly
from rom.mbs.kernels.compiled import inner
from rom.mbs.mechanism import Mechanism
from rom.model import Array

WAKE_SHARE = 0.6  # of a change of the induced velocity that the first filter passes at once
NEVER_BEFORE = -1e9  # s: the instant that a wake remembers at the start
# what a strip remembers: steady value and both filters of each velocity, and the instant
WAKE_SIZE = 7
LARGEST_INDUCTION = 0.5  # beyond which a wake takes no more time
SMALLEST_WIND = 1e-3  # whose wake takes its time, more than days [m/s]
entry_of = cache(compiled_entry)


@inner
def late(state, steady_now, dt, slow, fast):
    """Take both filters a step further; state: the steady value, behind one filter, behind both."""
    target = steady_now + WAKE_SHARE * slow * (steady_now - state[0]) / dt
    state[0] = steady_now
    before = state[1]
    state[1] = target + (before - target) * math.exp(-dt / slow)
    middle = 0.5 * (before + state[1])
    state[2] = middle + (state[2] - middle) * math.exp(-dt / fast)


@inner
def follow(strip, axial, across, met, state, dt):
    """Take the wake of a strip a step further; a step of zero takes the steady one.

    ``met`` is the air that reaches the strip in steady flow; state (6,) holds three numbers of
    the velocity through the plane, and three of that in it.
    """
    lost, gained = axial - met[0], met[1] - across
    if dt <= 0.0:
        for i in range(3):
            state[i], state[3 + i] = lost, gained
        return
    wind = max(axial, SMALLEST_WIND)
    a = min(max(lost / wind, 0.0), LARGEST_INDUCTION)
    slow = 1.1 / (1.0 - 1.3 * a) * strip[ROTOR_COLUMN] / wind
    fast = (0.39 - 0.26 * (strip[RADIUS_COLUMN] / strip[ROTOR_COLUMN]) ** 2) * slow
    late(state[:3], lost, dt, slow, fast)
    late(state[3:], gained, dt, slow, fast)


@inner
def blown(winds, n, t):
    """The speed of the wind at a time: straight between n instants, constant beyond them."""
    if n == 1 or t <= winds[0]:
        return winds[n]
    if t >= winds[n - 1]:
        return winds[2 * n - 1]
    low = interval(winds, n, t)
    share = (t - winds[low]) / (winds[low + 1] - winds[low])
    return winds[n + low] + share * (winds[n + low + 1] - winds[n + low])


def late_strip(t, parameters, motion, memory, out):
    """Wind on one strip behind its own wake, a law of one marker."""
    sizes = carray(parameters, (2,))
    n, k = int(sizes[0]), int(sizes[1])
    size = 2 + 2 * n + PROFILE_START + 1 + 3 * k
    numbers, moved = carray(parameters, (size,)), carray(motion, (18,))
    known, answer = carray(memory, (WAKE_SIZE,)), carray(out, (8 + WAKE_SIZE,))
    winds, g = numbers[2 : 2 + 2 * n], numbers[2 + 2 * n :]
    R, room = moved[3:12].reshape((3, 3)), np.empty(12)
    u, m, lean = room[3:6], room[6:9], room[9:12]
    state, force = np.empty(6), np.empty(2)
    yaw = meet(g, blown(winds, n, t), moved[0:3], moved[12:15], R, room)
    speed = math.sqrt(u[0] * u[0] + u[1] * u[1])
    if speed == 0.0 or m[0] * m[0] + m[1] * m[1] == 0.0:
        return
    flow, turned = math.atan2(u[0], u[1]), math.atan2(m[1], m[0])
    axial, across = speed * math.sin(flow + turned), speed * math.cos(flow + turned)
    strip, profile = g[11 : 11 + STRIP_WIDTH], g[PROFILE_START + 1 :]
    theta = turned + g[TWIST_PLACE]
    met = induced(strip, profile, k, theta, axial, across)
    for i in range(6):
        state[i] = known[i]
    began = known[6] > NEVER_BEFORE
    if not began or t > known[6]:
        follow(strip, axial, across, met, state, t - known[6] if began else 0.0)
        answer[14] = t
    for i in range(6):
        answer[8 + i] = state[i]
    through = skewed(strip, axial, axial - state[2], yaw, lean[2])
    met = through, across + state[5], 0.0
    normal, driving, _ = strip_load(strip, profile, k, theta, met, g[0])
    on_section(g[1], turned, normal, driving, force)
    for i in range(3):
        answer[i] = R[i, 0] * force[0] + R[i, 1] * force[1]


def in_late_wind(
    mechanism: Mechanism,
    blade: Assembly,
    wind: npt.ArrayLike,
    *,
    axis: npt.ArrayLike = (1.0, 0.0, 0.0),
    cone: float = CONE_ANGLE,
    tower: bool = False,
    density: float = AIR_DENSITY,
) -> None:
    """Put a blade of a mechanism into a wind along the first axis, its wake with a memory.

    Each vertex gets a law "<blade> strip <number>", which remembers the wake. Equilibria take the
    steady one, as does the first instant of a motion.

    The wind is a speed [m/s], or (k, 2) instants [s] and speeds [m/s]: straight between them,
    constant beyond. The blade is a rod of `rom.Mechanism.add_nonlinear` from
    ``cosserat.body(blade(...))``. Other arguments are as of `in_wind`.

    Raises:
        ConfigError: for a wind that is no speed over time or comes from behind, or a wrong density.
    """
    winds = over_time(wind)
    far = far_away((1.0, 0.0, 0.0), axis, tower=tower, density=density)
    for k, numbers in enumerate(strip_rows(cast(RodBody, blade.body), far, cone)):
        sizes = len(winds), numbers[PROFILE_START]
        mechanism.law(
            f"{blade.name} strip {k}",
            entry_of(late_strip, LAW_TYPES),
            blade.marker(k),
            parameters=np.concatenate([sizes, winds.T.ravel(), numbers]),
            memory=[0.0] * (WAKE_SIZE - 1) + [NEVER_BEFORE],
        )


def over_time(wind: npt.ArrayLike) -> Array:
    """(k, 2) instants [s] and speeds [m/s] of a wind, see `in_late_wind`."""
    given = finite("wind", wind, None)
    winds = np.array([[0.0, given]]) if given.ndim == 0 else given
    if winds.ndim != 2 or winds.shape[1:] != (2,) or not len(winds):
        text = f"a wind of shape {given.shape} is neither a speed nor rows of instant and speed."
        raise ConfigError(text)
    if (np.diff(winds[:, 0]) <= 0.0).any():
        raise ConfigError("instants of a wind must ascend.")
    not_negative("wind [m/s]", winds[:, 1].min())
    return winds
