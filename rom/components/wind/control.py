"""Generator torque and pitch of the NREL 5 MW turbine by its published laws, and its power curve.

Below the rated speed blades stay at zero pitch and the torque follows the square of the speed of
the generator, with ramps at both ends; above, the power is held by a torque in inverse proportion
to the speed, and the speed by the pitch, whose gains fall as pitch makes the blades more sensitive.

Source:
    Jonkman, Butterfield, Musial, Scott, NREL/TP-500-38060, 2009, section 7 and its program in
    appendix C.
"""

import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from rom.arguments import typed, vector
from rom.components.compiled import inner, kernel
from rom.components.wind.blading import ROTOR_RADIUS, Blading, RotorLoad, blading, rotor_load
from rom.components.wind.wind_turbine import GEAR_RATIO, N_BLADES, RATED_SPEED
from rom.errors import ConfigError
from rom.model import Array
from rom.process.spreading import spread

CUT_IN_WIND, CUT_OUT_WIND = 3.0, 25.0  # m/s
# of the generator [rad/s]: torque from the first on, square law from the second on; the third ends
# it by a slip of ten percent; pitch holds the fourth
CUT_IN_GENERATOR, SQUARE_GENERATOR = 70.16224, 91.21091
RATED_GENERATOR, HELD_GENERATOR = 121.6805, 122.9096
SQUARE_GAIN = 2.332287  # N m s^2/rad^2
RATED_POWER, GENERATOR_EFFICIENCY = 5_296_610.0, 0.944  # W of the shaft; of the generator
GENERATOR_SLIP = 0.10  # of the ramp below the rated speed
SYNCHRONOUS_GENERATOR = RATED_GENERATOR / (1.0 + GENERATOR_SLIP)  # where that ramp starts [rad/s]
RAMP_SLOPE = RATED_POWER / RATED_GENERATOR / (RATED_GENERATOR - SYNCHRONOUS_GENERATOR)  # N m s/rad
LARGEST_TORQUE, LARGEST_TORQUE_RATE = 47_402.91, 15_000.0  # N m, N m/s
RATED_PITCH_ANGLE = math.radians(1.0)  # beyond, the power is held at any speed [rad]
PROPORTIONAL_GAIN, INTEGRAL_GAIN = 0.01882681, 0.008068634  # s and 1, at zero pitch
DOUBLING_PITCH = 0.1099965  # where the power is twice as sensitive as at none [rad]
LARGEST_PITCH, LARGEST_PITCH_RATE = math.radians(90.0), math.radians(8.0)  # rad, rad/s
CORNER_FREQUENCY = 1.570796  # of the filter of the measured speed [rad/s]
MAX_RADIUS_CHANGE = 0.1  # of a rotor that the published speeds and gains still serve
Held = Callable[[float], tuple[float, float]]  # speed of the rotor and pitch [rad/s, rad]
SPEED_RTOL = 1e-12  # of steady speeds and pitches: digits that repeat
# steady pitch above the rated wind: table 7-1 (wind [m/s], pitch [deg])
_PITCHES = "3.83 6.60 8.70 10.45 12.06 13.54 14.92 16.23 17.47 18.70 19.94 21.18 22.35 23.47"
PUBLISHED_PITCH = tuple(zip(map(float, range(12, 26)), map(float, _PITCHES.split()), strict=True))


@inner
def asked_torque(speed, pitch):
    """Torque of the generator at its speed with a pitch of the blades."""
    if speed >= RATED_GENERATOR or (pitch >= RATED_PITCH_ANGLE and speed > 0.0):
        return min(RATED_POWER / speed, LARGEST_TORQUE)
    if speed <= CUT_IN_GENERATOR:
        return 0.0
    if speed < SQUARE_GENERATOR:
        slope = SQUARE_GAIN * SQUARE_GENERATOR**2 / (SQUARE_GENERATOR - CUT_IN_GENERATOR)
        return slope * (speed - CUT_IN_GENERATOR)
    return max(SQUARE_GAIN * speed**2, RAMP_SLOPE * (speed - SYNCHRONOUS_GENERATOR))


@inner
def gain_at(pitch):
    """Factor of both gains of the pitch, see `gain_factor`."""
    return 1.0 / (1.0 + max(pitch, 0.0) / DOUBLING_PITCH)


@inner
def advance(state, speed, dt):
    """Take a controller a step further, see `Controller`: its four numbers in their order."""
    share = math.exp(-CORNER_FREQUENCY * dt)
    state[0] = (1.0 - share) * speed + share * state[0]
    room = LARGEST_TORQUE_RATE * dt
    state[3] = min(max(asked_torque(state[0], state[2]), state[3] - room), state[3] + room)
    gain, error = gain_at(state[2]), state[0] - HELD_GENERATOR
    end = LARGEST_PITCH / (gain * INTEGRAL_GAIN)
    state[1] = min(max(state[1] + error * dt, 0.0), end)
    asked = gain * (PROPORTIONAL_GAIN * error + INTEGRAL_GAIN * state[1])
    room = LARGEST_PITCH_RATE * dt
    asked = min(max(asked, state[2] - room), state[2] + room)
    state[2] = min(max(asked, 0.0), LARGEST_PITCH)


@kernel
def controller_step(state, speed, dt):
    """`advance` for Python."""
    advance(state, speed, dt)


@typed
def generator_torque(speed: float, pitch: float = 0.0) -> float:
    """Torque of the generator at its speed [rad/s] and a pitch [rad], on the fast shaft [N m].

    From a pitch of one degree on the power is held at any speed.
    """
    return float(asked_torque.py_func(speed, pitch))


def gain_factor(pitch: float) -> float:
    """Factor of both gains of the pitch at a pitch [rad], 1 / (1 + pitch / 6.3 degrees)."""
    return float(gain_at.py_func(pitch))


@dataclass
class Controller:
    """The published controller as it runs: what it remembers between steps.

    Attributes:
        filtered: speed of the generator behind the filter [rad/s].
        integral: of the error of that speed [rad].
        pitch: that is asked for [rad].
        torque: of the generator that is asked for [N m].
    """

    filtered: float
    integral: float
    pitch: float
    torque: float

    @classmethod
    def at(cls, speed: float, pitch: float = 0.0) -> "Controller":
        """One that has long been at a speed of the generator [rad/s] and a pitch [rad]."""
        integral = pitch / (gain_factor(pitch) * INTEGRAL_GAIN)
        return cls(speed, integral, pitch, generator_torque(speed, pitch))

    def step(self, speed: float, dt: float) -> None:
        """Take the speed of the generator [rad/s] that was measured a time dt [s] after the last.

        Rates and ends of pitch and torque are those of the machine; the integral is kept where its
        share of the pitch is within these ends.
        """
        state = np.array([self.filtered, self.integral, self.pitch, self.torque])
        controller_step(state, float(speed), float(dt))
        self.filtered, self.integral, self.pitch, self.torque = map(float, state)


def check_rotor(blades: Blading) -> None:
    """Refuse a rotor that the controller is not made for, of other blades."""
    ratio = blades.rotor_radius / ROTOR_RADIUS
    if abs(ratio - 1.0) > MAX_RADIUS_CHANGE or blades.n_blades != N_BLADES:
        raise ConfigError(
            f"the controller is that of {N_BLADES} blades up to {ROTOR_RADIUS:g} m at "
            f"{RATED_SPEED:.4g} rad/s: {blades.n_blades} blades up to {blades.rotor_radius:g} m "
            f"would have tips of {RATED_SPEED * blades.rotor_radius:.4g} m/s.",
            hint="Give speed and pitch yourself, held=lambda wind: (speed, pitch), over the time "
            "in operate: a usual rule is 80 m/s over the radius.",
        )


def working(wind: float, when: str = "") -> float:
    """The wind, if the turbine works in it [m/s]."""
    if not CUT_IN_WIND <= wind <= CUT_OUT_WIND:
        text = f"the turbine is parked in a wind of {wind:g} m/s{when}."
        raise ConfigError(text, hint="It works from 3 to 25 m/s.")
    return wind


@typed
def steady(
    wind: float, blades: Blading | None = None, *, tower: bool = False, held: Held | None = None
) -> RotorLoad:
    """Speed, pitch and loads at which the controlled turbine stays in a steady wind.

    Args:
        wind: its speed, from cut-in at 3 to cut-out at 25 [m/s].
        blades: those of the turbine, changed at most; None: as published.
        tower: whether the tower dams the wind.
        held: speed of the rotor [rad/s] and pitch [rad] over the wind [m/s], in the place of the
            control: that of another turbine.

    Raises:
        ConfigError: for a wind in which the turbine is parked, or other blades that are not held.
    """
    if held is not None:
        return rotor_load(blading() if blades is None else blades, wind, *held(wind), tower=tower)
    working(wind)
    blades = blading() if blades is None else blades
    check_rotor(blades)
    load = partial(rotor_load, blades, float(wind), tower=tower)
    rated = partial(load, RATED_SPEED)

    def excess(speed: float) -> float:
        return load(speed).torque - GEAR_RATIO * generator_torque(GEAR_RATIO * speed)

    if rated().power <= RATED_POWER:
        slowest, top = CUT_IN_GENERATOR / GEAR_RATIO, RATED_GENERATOR / GEAR_RATIO
        top = RATED_SPEED if excess(top) > 0.0 else top
        return load(float(brentq(excess, slowest, top, rtol=SPEED_RTOL)))
    pitch = brentq(lambda p: rated(p).power - RATED_POWER, 0.0, np.pi / 4, rtol=SPEED_RTOL)
    return rated(float(pitch))


@typed
def power_curve(
    winds: npt.ArrayLike,
    blades: Blading | None = None,
    *,
    tower: bool = False,
    held: Held | None = None,
    executor: Executor | None = None,
) -> dict[str, Array]:
    """The turbine over steady winds.

    Winds (k,) are speeds [m/s], which the workers of an executor of `concurrent.futures` share if
    one is given; other arguments are as of `steady`.

    Returns:
        {name: (k,)} of ``wind`` [m/s], ``speed`` of the rotor [rad/s], ``pitch`` [rad], ``power``
        of the generator behind its losses [W], ``thrust`` [N], ``torque`` of the rotor [N m], and
        the coefficients ``power_coefficient`` and ``thrust_coefficient`` of the rotor [1].

    Raises:
        ConfigError: for winds that are no list, or as of `steady`.
    """
    winds = vector("winds", winds)
    point = partial(steady, blades=blades, tower=tower, held=held)
    points = spread(point, winds.tolist(), executor)
    names = "wind speed pitch thrust torque power_coefficient thrust_coefficient".split()
    found = {name: np.array([getattr(p, name) for p in points]) for name in names}
    return found | {"power": GENERATOR_EFFICIENCY * np.array([p.power for p in points])}
