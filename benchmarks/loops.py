"""Compiled loops of discrete components, in time of the processor."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.timing import Row, timed
from rom.components.assumed_strain import Flight, Metal, fly, rectangle, sheet
from rom.components.histories import sine
from rom.components.linkages.dynamic_isotropy import angle_grid, isotropy_index
from rom.components.linkages.two_dof_linkages import FiveBar, rod
from rom.components.masonry.actions import BaseMotion
from rom.components.masonry.limits import arch
from rom.components.masonry.motion import Motion, simulate
from rom.components.rockfall import (
    Cushion,
    Gallery,
    History,
    Shear,
    Slab,
    calibrate,
    scaled,
    strike,
)
from rom.components.rockfall.calibration import CHANNELS, FIVE_PARAMETERS
from rom.components.wind import power_curve

COPPER = Metal(117e9, 0.35, 8930.0, yield_stress=400e6, hardening=100e6)
BAR_LENGTH, BAR_RADIUS, IMPACT_SPEED = 32.4e-3, 3.2e-3, 227.0  # of Taylor's bar [m, m, m/s]
SHAKING_ACCELERATION = 1.0  # of the ground; 0.46 already sets the arch moving [m/s^2]
FIRST_GALLERY = Gallery(
    4000.0, 15.0, 2500.0, Cushion.of_sand(4000.0, 1e6, recovery=0.1), Shear(2e9),
    Slab.of_mass(6000.0, 1.2e8),
)  # fmt: skip
TRUE_FACTORS = dict(zip(FIVE_PARAMETERS, (1.4, 0.6, 1.3, 0.8, 1.5), strict=True))
SENSOR_CHANNELS = ("acceleration of the boulder", "force in bending", "deflection")
SENSOR_TIMES = np.arange(0, 0.2, 2e-4)  # s
WIND_SPEEDS = np.linspace(4.0, 25.0, 20)  # m/s


def measured(
    blocks: int = 40, steps: int = 10_000, cells: int = 400, height: int = 50
) -> Iterator[Row]:
    """Case, quantity, value, unit and aim: an arch, isotropy, Taylor's bar, a gallery, wind.

    Args:
        blocks: voussoirs of the arch.
        steps: that it makes, of 1 ms.
        cells: of the map along each angle.
        height: rows of squares in the bar.
    """
    stones = arch(blocks, 5.0, 0.6)
    _still(stones, 10)  # compiles
    taken, motion = timed(_still, stones, steps)
    case = f"arch of {blocks} blocks, {steps} steps"
    yield case, "processor time", taken, "s", "below 30"
    yield case, "fastest stone", float(np.abs(motion.v[-1]).max()), "m/s", "below 1e-06"
    shaking = BaseMotion(sine(SHAKING_ACCELERATION, 0.5))
    taken, motion = timed(_still, stones, steps, 1.0, (shaking,))
    case = f"arch of {blocks} blocks on shaking ground, {steps} steps"
    yield case, "processor time", taken, "s", "below 5"
    crown = abs(motion.q[-1, blocks // 2, 0] - motion.q[0, blocks // 2, 0])
    yield case, "how far the crown has gone", 1e3 * float(crown), "mm", "below 30"
    five = FiveBar(0.7, (rod(2.0, 0.3),) * 2, (rod(1.0, 0.8),) * 2, payload=0.5)
    taken, index = timed(lambda: isotropy_index(five.inertia(*angle_grid(cells))))
    case = f"five-bar linkage, {cells} x {cells} postures"
    yield case, "processor time", taken, "s", "below 2"
    yield case, "best index of isotropy", float(index.max()), "", "above 0.999"
    _struck(2, 1e-8)
    taken, flight = timed(_struck, height, 80e-6)
    case = f"Taylor's bar, {flight.steps} steps"
    yield case, "processor time", taken, "s", "below 20"
    yield case, "radius of its foot", 1e3 * float(flight.x[-1, :, 0].max()), "mm", "below 7.1"
    case = f"gallery, {len(TRUE_FACTORS)} parameters from {len(SENSOR_CHANNELS)} histories"
    true = scaled(FIRST_GALLERY, TRUE_FACTORS)
    got = strike(true, t_end=0.2, keep=20_000)
    seen = {
        name: History(SENSOR_TIMES, np.interp(SENSOR_TIMES, got.t, CHANNELS[name](true, got)))
        for name in SENSOR_CHANNELS
    }
    taken, found = timed(calibrate, FIRST_GALLERY, seen)
    yield case, "processor time", taken, "s", "below 30"
    off = max(abs(found.factors[name] / x - 1) for name, x in TRUE_FACTORS.items())
    yield case, "largest error of them", off, "", "below 0.01"
    taken, curve = timed(power_curve, WIND_SPEEDS)
    case = f"power curve of the 5 MW turbine, {WIND_SPEEDS.size} winds"
    yield case, "processor time", taken, "s", "below 60"
    yield case, "largest power", float(curve["power"].max()) / 1e6, "MW", "below 5.001"


def _still(
    stones: Any, steps: int, damping: float = 30.0, actions: tuple[BaseMotion, ...] = ()
) -> Motion:
    return simulate(
        stones, t_end=1e-3 * steps, dt=1e-3, actions=actions, damping=damping, save_every=steps
    )


def _struck(height: int, t_end: float) -> Flight:
    corners = [(0, 0), (BAR_RADIUS, 0), (BAR_RADIUS, BAR_LENGTH), (0, BAR_LENGTH)]
    X, T = rectangle((5, height), corners)
    body = sheet(X, T, element="F1", state="axisymmetric")
    axis, wall = (2 * np.flatnonzero(X[:, k] < 1e-9) + k for k in (0, 1))
    v = np.zeros_like(X)
    v[:, 1] = -IMPACT_SPEED
    return fly(body, COPPER, v, np.concatenate([axis, wall]), t_end)
