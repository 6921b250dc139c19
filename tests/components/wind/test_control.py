"""The published controller and the power curve that it gives."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rom.components.wind.blading import BETZ_LIMIT, blading
from rom.components.wind.control import (
    DOUBLING_PITCH,
    HELD_GENERATOR,
    PUBLISHED_PITCH,
    Controller,
    gain_factor,
    generator_torque,
    power_curve,
    steady,
)
from rom.components.wind.wind_turbine import GEAR_RATIO, RATED_SPEED
from rom.errors import ConfigError

RPM = np.pi / 30
# of a run of OpenFAST, averages over steady wind, data/NREL5MW/NREL5MW_Oper.csv
# of github.com/ebranlard/welib: wind [m/s], speed [1/min], pitch [deg], power [kW], thrust [kN]
OPENFAST = np.array([
    [5.0, 7.4952, 0.0, 395.7, 171.7], [6.0, 7.9277, 0.0, 726.4, 232.2],
    [7.0, 8.4562, 0.0, 1176.0, 301.0], [8.0, 9.1311, 0.0, 1756.8, 379.5],
    [9.0, 10.2583, 0.0, 2491.0, 477.9], [10.0, 11.3764, 0.0, 3397.6, 586.3],
    [11.0, 11.8731, 0.0, 4473.9, 682.6], [13.0, 12.1, 6.31, 5000.0, 508.6],
    [15.0, 12.1, 10.2564, 5000.0, 414.9], [20.0, 12.1, 17.3164, 5000.0, 313.5],
    [25.0, 12.1, 22.96, 5000.0, 273.5],
])  # fmt: skip


def test_torque_has_the_published_corners():
    """Report, figure 7-2: none below 670, square from 871, rated 43 093.55 N m at 1173.7 1/min."""
    at = [generator_torque(n * RPM) for n in (600.0, 670.0, 871.0, 1000.0)]
    assert_allclose(at, [0.0, 0.0, 0.0255764 * 871**2, 0.0255764 * 1000**2], rtol=2e-4)
    assert_allclose(generator_torque(1173.7 * RPM), 43_093.55, rtol=1e-4)
    assert_allclose(generator_torque(1161.963 * RPM), 5.29661e6 / (1161.963 * RPM), rtol=1e-4)
    n = np.linspace(600.0, 1161.9, 3000) * RPM
    assert np.abs(np.diff([generator_torque(x) for x in n])).max() < 200.0  # no jumps
    # with pitch the power is held below the rated speed as well, up to the largest torque
    assert_allclose(generator_torque(1150 * RPM, np.radians(2)) * 1150 * RPM, 5.29661e6)
    assert_allclose(generator_torque(900 * RPM, np.radians(2)), 47_402.91)


def test_gains_fall_with_the_pitch_as_published():
    """6.302336 degrees halve them; damping 0.7 at 0.6 rad/s of a rotor of 43.784e6 kg m^2.

    Report, equations 7-9 to 7-12: gain = 2 I w z w0 / (N |dP/dpitch|) of -25.52e6 W/rad.
    """
    assert_allclose(np.degrees(DOUBLING_PITCH), 6.302336, rtol=1e-5)
    assert_allclose([gain_factor(0.0), gain_factor(DOUBLING_PITCH)], [1.0, 0.5])
    inertia, sensitivity, w, zeta = 43.784e6, 25.52e6, 0.6, 0.7
    P = 2 * inertia * RATED_SPEED * zeta * w / (GEAR_RATIO * sensitivity)
    I = inertia * RATED_SPEED * w**2 / (GEAR_RATIO * sensitivity)
    one = Controller.at(GEAR_RATIO * RATED_SPEED)
    one.step(1.001 * GEAR_RATIO * RATED_SPEED, 1e3)
    error = 1e-3 * GEAR_RATIO * RATED_SPEED
    assert_allclose(one.pitch, P * error + I * error * 1e3, rtol=2e-3)
    there = Controller.at(HELD_GENERATOR, DOUBLING_PITCH)
    there.step(HELD_GENERATOR, 0.1)
    assert_allclose(there.pitch, DOUBLING_PITCH)  # where the factor of `at` is that of the steps


@pytest.fixture(scope="module")
def curve():
    return power_curve(np.arange(3.0, 25.5))


def test_pitch_above_the_rated_wind_is_that_of_the_report(curve):
    """Table 7-1, within a tenth of a degree to 21 m/s and 0.4 at 25."""
    winds, pitch = np.array(PUBLISHED_PITCH).T
    found = np.degrees(np.interp(winds, curve["wind"], curve["pitch"]))
    assert_allclose(found[winds < 21.5], pitch[winds < 21.5], atol=0.11)
    assert_allclose(found, pitch, atol=0.4)


def test_power_thrust_and_speed_are_those_of_openfast(curve):
    wind, speed, pitch, power, thrust = OPENFAST.T
    at = np.isin(curve["wind"], wind)
    assert_allclose(curve["speed"][at], speed * RPM, rtol=0.011)
    assert_allclose(np.degrees(curve["pitch"][at]), pitch, atol=0.3)
    assert_allclose(curve["power"][at], 1e3 * power, rtol=0.036)
    assert_allclose(curve["thrust"][at], 1e3 * thrust, rtol=0.03)


def test_the_curve_has_a_specialists_numbers(curve):
    """5 MW from 11.4 m/s on; power below Betz; largest thrust at the rated wind."""
    rated = steady(11.4)
    assert_allclose(0.944 * rated.power, 5e6, rtol=0.02)
    assert (curve["power"] < 5.0001e6).all()
    assert_allclose(curve["power"][curve["wind"] >= 12.0], 5e6, rtol=1e-4)
    assert (curve["power_coefficient"] < BETZ_LIMIT).all()
    assert_allclose(curve["power_coefficient"][5:8], 0.482, rtol=0.01)
    assert abs(curve["wind"][curve["thrust"].argmax()] - 11.4) < 1.0


def test_balance_of_torque_and_power(curve):
    """The rotor drives the generator of 97 times its speed; behind it 94.4 % are left."""
    below = curve["wind"] < 11.0
    asked = [GEAR_RATIO * generator_torque(GEAR_RATIO * w) for w in curve["speed"][below]]
    assert_allclose(curve["torque"][below], asked, rtol=1e-6)
    assert_allclose(curve["power"], 0.944 * curve["torque"] * curve["speed"])


def test_the_controller_keeps_its_rates_and_ends():
    one = Controller.at(GEAR_RATIO * RATED_SPEED, 0.2)
    assert_allclose(one.pitch, 0.2)
    for _ in range(10):
        one.step(200.0, 0.01)
    assert_allclose(one.pitch, 0.2 + np.radians(8.0) * 0.1, rtol=1e-6)
    one = Controller.at(80.0)
    torque = one.torque
    one.step(500.0, 0.05)
    assert one.torque - torque <= 15_000 * 0.05 * (1 + 1e-9)
    for _ in range(3000):
        one.step(500.0, 0.1)
    assert_allclose(one.pitch, np.pi / 2)
    for _ in range(3000):
        one.step(50.0, 0.1)
    assert_allclose([one.pitch, one.integral], 0.0, atol=1e-12)


def test_the_filter_loses_three_decibels_at_a_quarter_hertz():
    one, dt = Controller.at(100.0), 1e-3
    t = np.arange(0.0, 40.0, dt)
    seen = []
    for x in 100.0 + np.sin(2 * np.pi * 0.25 * t):
        one.step(x, dt)
        seen.append(one.filtered)
    assert_allclose(np.ptp(seen[20_000:]) / 2, np.sqrt(0.5), rtol=2e-3)


@pytest.mark.parametrize("wind", [2.9, 25.1, -8.0])
def test_wind_beyond_the_curve_is_named(wind):
    with pytest.raises(ConfigError, match="parked in a wind of"):
        steady(wind)
    with pytest.raises(ConfigError):
        power_curve([8.0, wind])


def test_other_blades_and_the_tower_change_the_curve_a_little():
    free, dammed, straight = steady(8.0), steady(8.0, tower=True), steady(8.0, blading(0.0, 0.0))
    assert 0.97 * free.power < dammed.power < free.power < straight.power < 1.03 * free.power
