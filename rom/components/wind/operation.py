"""The controlled turbine in wind that changes: a rigid rotor, its wake with or without memory.

The wake follows a change of the loads late, see `rom.components.wind.wake`, so that after a step
of pitch the loads first overshoot.

Source:
    Jonkman, Butterfield, Musial, Scott, NREL/TP-500-38060, 2009, section 7: inertia, control.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rom.arguments import Between, Positive, between, not_negative, typed
from rom.components.compiled import kernel
from rom.components.wind.blading import LARGEST_ANGLE, Blading, blading, strip_load
from rom.components.wind.control import GENERATOR_EFFICIENCY, Controller, Held, steady, working
from rom.components.wind.momentum import RADIUS_COLUMN, induced
from rom.components.wind.wake import follow
from rom.components.wind.wind_turbine import GEAR_RATIO
from rom.model import Array

DRIVE_INERTIA = 43_784_725.0  # of rotor and generator about the slow shaft [kg m^2], section 7
MAX_STEP = 0.5  # s: the filter of the controller knows a speed four times a second


@typed
@dataclass(frozen=True)
class Operation:
    """The turbine over time.

    Attributes:
        t: (k,) instants [s].
        wind: (k,) its speed [m/s].
        speed: (k,) of the rotor [rad/s].
        pitch: (k,) of the blades [rad].
        power: (k,) of the generator behind its losses [W].
        torque: (k,) of the wind about the shaft [N m].
        thrust: (k,) along the shaft [N].
        induced: (k, n) velocity by which the air at the strips is slower [m/s].
    """

    t: Array
    wind: Array
    speed: Array
    pitch: Array
    power: Array
    torque: Array
    thrust: Array
    induced: Array


@kernel
def wake_step(blades, flow, state, dt, out):
    """Loads per length (n, 2) of the strips in air that the wake has slowed down by now.

    ``state`` (n, 6) is that of `follow`; a step dt of zero takes the steady wake.
    """
    strips, tables, counts, twist = blades
    axial, speed, pitch, half_density = flow
    for j in range(out.shape[0]):
        strip, table, k = strips[j], tables[j], counts[j]
        theta, across = twist[j] + pitch, speed * strip[RADIUS_COLUMN]
        met = induced(strip, table, k, theta, axial, across)
        follow(strip, axial, across, met, state[j], dt)
        met = axial - state[j, 2], across + state[j, 5], 0.0
        out[j, 0], out[j, 1], _ = strip_load(strip, table, k, theta, met, half_density)


@typed
def operate(
    wind: Callable[[float], float],
    t_end: Annotated[float, Positive("s")],
    *,
    dt: Annotated[float, Between(0.0, MAX_STEP, "(]", "s")] = 0.05,
    blades: Blading | None = None,
    dynamic: bool = True,
    held: Held | None = None,
) -> Operation:
    """Let the controlled turbine work in a wind over time, from its steady state in the first.

    The rotor is rigid; a tilted one meets the wind by the cosine of its tilt at all azimuths.

    Args:
        wind: its speed [m/s] over time [s]; `rom.components.histories.read_record` reads a
            measured one and refuses times beyond it.
        t_end: end of the run [s].
        dt: step [s].
        blades: None: those of the turbine.
        dynamic: whether the wake has a memory; False: as in steady flow at each instant.
        held: speed of the rotor [rad/s] and pitch [rad] over time, in the place of the control;
            then the generator takes what the wind gives.

    Raises:
        ConfigError: for a wind in which the turbine is parked, with its time, a speed or a pitch to
            hold that is none, or blades of another turbine that are not held.
    """
    blades = blading() if blades is None else blades
    t = dt * np.arange(round(t_end / dt) + 1)
    blows = np.array([working(float(wind(s)), f", at {s:g} s") for s in t])
    run = _Run(blades, blows[0], dynamic, held)
    steps = zip(t, blows, [0.0, *[dt] * (len(t) - 1)], strict=True)
    rows = np.array([run.step(*step) for step in steps])
    speed, pitch, power, torque, thrust = rows[:, :5].T
    return Operation(t, blows, speed, pitch, power, torque, thrust, rows[:, 5:])


class _Run:
    """Rotor, wake and controller between steps."""

    def __init__(self, blades: Blading, wind: float, dynamic: bool, held: Held | None) -> None:
        self.blades, self.dynamic, self.held = blades, dynamic, held
        self.cosines = math.cos(blades.cone), math.cos(blades.tilt)
        self.given = (blades.strips, *blades.tables, blades.twist)
        self.wake, self.loads = (np.zeros((blades.radius.size, n)) for n in (6, 2))
        if held is not None:  # no controller acts, whose rotor it would have to be
            self.speed, self.control = 0.0, Controller.at(0.0)
            return
        start = steady(wind, blades)
        self.speed = start.speed
        self.control = Controller.at(GEAR_RATIO * start.speed, start.pitch)

    def step(self, t: float, wind: float, dt: float) -> list[float]:
        """Speed, pitch, power, torque and thrust at a time, and what the wake takes away."""
        if self.held is not None:
            self.speed, self.control.pitch = self.held(t)
            between(f"pitch held at {t:g} s", self.control.pitch, -LARGEST_ANGLE, LARGEST_ANGLE)
            not_negative(f"speed held at {t:g} s", self.speed)
        cone, tilt = self.cosines
        flow = (wind * cone * tilt, self.speed, self.control.pitch, 0.5 * self.blades.density)
        wake_step(self.given, flow, self.wake, dt if self.dynamic else 0.0, self.loads)
        b = self.blades
        thrust = b.n_blades * cone * float(self.loads[:, 0] @ b.length)
        torque = b.n_blades * cone * float(self.loads[:, 1] @ (b.radius * b.length))
        fast = GEAR_RATIO * self.speed
        taken = self.control.torque * fast if self.held is None else torque * self.speed
        power = GENERATOR_EFFICIENCY * taken
        row = [self.speed, self.control.pitch, power, torque, thrust, *self.wake[:, 2]]
        if dt > 0.0 and self.held is None:
            self.speed += dt * (torque - GEAR_RATIO * self.control.torque) / DRIVE_INERTIA
            self.control.step(fast, dt)
        return row
