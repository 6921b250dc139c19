"""The turbine in wind that changes: steady ends, the memory of the wake, the control in time."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.refusals import refused, refuses
from rom.components.histories import Table, recorded
from rom.components.wind import control
from rom.components.wind.blading import BETZ_LIMIT, blading, rotor_load
from rom.components.wind.control import DOUBLING_PITCH, Controller, generator_torque, steady
from rom.components.wind.operation import operate
from rom.components.wind.wake import late
from rom.components.wind.wind_turbine import GEAR_RATIO, RATED_SPEED
from rom.errors import ConfigError

RPM = np.pi / 30
LATE = getattr(late, "py_func", late)
SPEED, PITCH = 1.0, np.radians(3.7)  # rad/s, rad
# wind [m/s] and pitch [rad] before and after
STEPS = [((8.7, 0.0), (8.7, PITCH)), ((7.0, 0.0), (9.0, 0.0)), ((9.0, 0.0), (4.5, 0.0))]


def straight():
    return blading(0.0, 0.0)


@pytest.mark.parametrize("wind", [6.0, 8.0, 18.0])
def test_steady_wind_leaves_the_turbine_where_its_laws_balance(wind):
    run, rest = operate(lambda t: wind, 40.0, blades=straight()), steady(wind, straight())
    for name in ("speed", "pitch", "torque", "thrust"):
        assert_allclose(getattr(run, name), getattr(rest, name), rtol=1e-5, atol=1e-12)
    assert_allclose(run.power, 0.944 * rest.power, rtol=1e-5)


def test_filters_answer_a_step_as_their_equations_do():
    """W_int + t1 W_int' = 1 after a share k at once; W + t2 W' = W_int: closed form."""
    slow, fast, dt, state, found = 8.0, 2.5, 0.01, np.zeros(3), []
    for _ in range(4000):
        LATE(state, 1.0, dt, slow, fast)
        found.append(state[2])
    assert_allclose(found, answer(dt * np.arange(1, 4001), slow, fast), atol=3e-3)


def answer(t, slow, fast):
    first, second = np.exp(-t / slow), np.exp(-t / fast)
    return 1 - second - 0.4 * slow / (slow - fast) * (first - second)


def after_a_step(before, then, dt, cone=0.0):
    """Steady inductions [m/s] before and after a step at 1 s, and what `operate` finds."""
    blades = blading(0.0, cone)
    states = before, then
    rows = [rotor_load(blades, V, SPEED, pitch, n_azimuths=1).strip[0] for V, pitch in states]
    winds = np.cos(cone) * np.array([before[0], then[0]])
    axial = [wind - row[:, 2] for row, wind in zip(rows, winds, strict=True)]
    swirl = [row[:, 3] - SPEED * blades.radius for row in rows]
    start = round(1.0 / dt)
    wind, pitch = (lambda t, k=k: states[int(t >= 1.0 - 1e-9)][k] for k in (0, 1))
    run = operate(wind, 25.0, dt=dt, blades=blades, held=lambda t: (SPEED, pitch(t)))
    return blades, axial, swirl, run, start


def remembered(blades, axial, t, V, a):
    """Shares of a step that wakes of an induction have followed, axial inductions, their size."""
    slow = 1.1 / (1 - 1.3 * a) * 63.0 / V
    share = answer(t[:, None], slow, (0.39 - 0.26 * (blades.radius / 63.0) ** 2) * slow)
    change = axial[1] - axial[0]
    return share, axial[0] + change * share, np.abs(change).max()


@pytest.mark.parametrize(("before", "then"), STEPS)
def test_the_wake_of_each_strip_follows_a_step_as_the_closed_form_does(before, then):
    """Steady values and induction are constant after it; 1 / (1 - 1.3 a) is capped at a = 0.5."""
    dt, V = 0.01, then[0]
    blades, axial, swirl, run, start = after_a_step(before, then, dt)
    a = np.clip(axial[1] / V, 0.0, 0.5)
    share, exact, size = remembered(blades, axial, run.t[start:] - run.t[start] + dt / 2, V, a)
    assert_allclose(run.induced[start:], exact, atol=5e-4 * size)
    assert (a == 0.5).any() == (V == 4.5)  # the last case has strips beyond the cap
    # loads at one instant, from velocities of both filters and the profiles
    at = start + round(3.0 / dt)
    through = V - exact[at - start]
    across = SPEED * blades.radius + swirl[0] + (swirl[1] - swirl[0]) * share[at - start]
    phi = np.arctan2(through, across)
    attack = zip(phi - blades.twist - then[1], blades.profile, strict=True)
    coefficients = [[np.interp(a, one.angle, x) for x in (one.lift, one.drag)] for a, one in attack]
    lift, drag = np.array(coefficients).T
    q = 0.5 * 1.225 * np.array(blades.chord) * (through**2 + across**2)
    normal = q * (lift * np.cos(phi) + drag * np.sin(phi))
    driving = q * (lift * np.sin(phi) - drag * np.cos(phi))
    assert_allclose(run.thrust[at], 3 * normal @ blades.length, rtol=1.5e-4)
    assert_allclose(run.torque[at], 3 * driving @ (blades.radius * blades.length), rtol=3e-4)


@pytest.mark.parametrize("cone", [0.0, 0.3])
def test_the_wake_of_a_rotor_that_drives_the_air_is_as_quick_as_without_induction(cone):
    """1 / (1 - 1.3 a) is 1 for a below zero; cone makes disc and wind less by its cosine."""
    dt, V = 0.01, 5.0
    blades, axial, _, run, start = after_a_step((V, 0.0), (V, np.radians(12.0)), dt, cone)
    driving = axial[1] < -0.1 * V
    assert driving.sum() >= 4
    _, exact, size = remembered(blades, axial, run.t[start:] - run.t[start] + dt / 2, V, 0.0)
    assert_allclose(run.induced[start:][:, driving], exact[:, driving], atol=5e-4 * size)


@pytest.mark.parametrize("dynamic", [False, True])
def test_a_tilted_rotor_with_cone_has_the_loads_of_one_that_its_axial_wind_meets(dynamic):
    """Held, it meets the wind by the cosine of its tilt; cone by the sum over its strips."""
    tilt, cone, V, pitch = 0.3, 0.2, 8.0, 0.02
    how = {"blades": blading(tilt, cone), "dynamic": dynamic, "held": lambda t: (SPEED, pitch)}
    run = operate(lambda t: V, 2.0, dt=0.1, **how)
    load = rotor_load(blading(0.0, cone), V * np.cos(tilt), SPEED, pitch)
    assert_allclose(run.thrust, load.thrust, rtol=1e-10)
    assert_allclose(run.torque, load.torque, rtol=1e-10)
    assert_allclose(run.induced[-1], V * np.cos(tilt) * np.cos(cone) * load.strip[0, :, 5])


@pytest.mark.parametrize("back", [False, True])
def test_a_step_of_pitch_overshoots_if_the_wake_has_a_memory(back):
    pitches = (PITCH, 0.0) if back else (0.0, PITCH)
    ends = [rotor_load(straight(), 8.7, SPEED, p) for p in pitches]
    how = {"blades": straight(), "held": lambda t: (SPEED, pitches[int(t >= 10.0)])}
    quick, slow = (operate(lambda t: 8.7, 90.0, dynamic=x, **how) for x in (False, True))
    for run in (quick, slow):
        assert_allclose([run.thrust[190], run.thrust[-1]], [e.thrust for e in ends], rtol=4e-4)
        assert_allclose([run.torque[190], run.torque[-1]], [e.torque for e in ends], rtol=1e-3)
    change = ends[1].torque - ends[0].torque
    most = ((slow.torque - ends[0].torque) / change).max()
    assert 1.5 < most < 4.0  # of the final change, as in measured steps of pitch
    assert ((quick.torque - ends[0].torque) / change).max() < 1.0 + 1e-6
    # the wake is old: loads at once are those of the new pitch in the air of the old one
    assert_allclose(slow.induced[200], slow.induced[199], rtol=0.12)
    # and new after some times of the radius over the wind
    gone = np.abs(slow.thrust - ends[1].thrust) / abs(ends[1].thrust - ends[0].thrust)
    assert gone[slow.t > 10.0 + 8 * 63.0 / 8.7].max() < 0.02


def test_the_control_carries_the_turbine_from_part_load_to_full_load():
    run = operate(lambda t: 8.0 + 12.0 * min(max(t - 20.0, 0.0) / 200.0, 1.0), 400.0)
    end = steady(20.0)
    assert_allclose(run.speed.max(), end.speed, rtol=0.05)
    assert_allclose(run.pitch[-1], end.pitch, rtol=3e-3)
    assert_allclose(run.power[-1], 5e6, rtol=1e-5)
    assert run.power.max() < 5.1e6


def test_a_gust_speeds_the_rotor_up_by_what_its_inertia_takes():
    run = operate(lambda t: 8.0 + 2.0 * (t > 5.0), 15.0)
    dt, fast = run.t[1], 97.0 * run.speed
    generator = 97.0 * run.power / (0.944 * fast)
    impulse = (run.torque - generator)[1:-1].sum() * dt
    assert_allclose(43_784_725 * (run.speed[-1] - run.speed[1]), impulse, rtol=1e-9)
    assert run.speed[-1] > 1.02 * run.speed[0]


test_what_cannot_be_is_named = refused(
    (lambda: operate(lambda t: 8.0 + 20.0 * (t > 5.0), 10.0), "28 m/s, at 5.05 s"),
    (lambda: operate(lambda t: np.nan, 10.0), "parked in a wind of nan"),
    (lambda: operate(Table([0.0, 5.0], [8.0, 9.0]), 10.0), "from 0 s to 5 s; asked is t = 5.05"),
    (lambda: operate(recorded([0.0, 1.0, 2.0, 5.0], [8.0] * 4), 5.0), "a gap from 2 s to 5 s"),
    (lambda: operate(lambda t: 8.0, 1.0, held=lambda t: (np.nan, 0.0)), "held at 0 s = nan"),
    (lambda: operate(lambda t: 8.0, 1.0, held=lambda t: (1.0, 20.0)), "pitch .* = 20"),
    *((lambda wind=wind: steady(wind), "parked in a wind of") for wind in (2.9, 25.1, -8.0)),
    (lambda: control.power_curve([8.0, 25.1]), "parked in a wind of"),
    (lambda: steady(9.0, scaled(2.0), held=lambda wind: (np.nan, 0.0)), "nan"),
    error=ConfigError,
)


def scaled(k):
    lengths = ("radius", "length", "chord", "rotor_radius", "hub_radius")
    return replace(straight(), **{name: k * getattr(straight(), name) for name in lengths})


@pytest.mark.parametrize("call", [
    lambda blades: steady(9.0, blades),
    lambda blades: control.power_curve([9.0], blades),
    lambda blades: operate(lambda t: 9.0, 1.0, blades=blades),
])  # fmt: skip
def test_another_rotor_needs_a_controller_of_its_own(call):
    """The published one would turn blades of 126 m with tips of 160 m/s, without a word."""
    refuses(ConfigError, r"126 m would have tips of 159\.7 m/s", call, scaled(2.0))
    refuses(ConfigError, "2 blades", call, replace(blading(), n_blades=2))
    call(scaled(1.05))


def test_another_rotor_works_at_a_speed_that_is_held():
    """At the same ratio of tips to wind it has the coefficients of the small one."""
    run = operate(lambda t: 9.0, 0.5, blades=scaled(2.0), held=lambda t: (0.6, 0.0), dynamic=False)
    small = rotor_load(straight(), 9.0, 1.2, n_azimuths=1)
    assert run.torque[-1] == pytest.approx(8 * small.torque, rel=1e-3)
    assert_allclose(run.power, 0.944 * run.torque * 0.6, rtol=1e-12)


def test_the_power_curve_of_another_rotor_follows_a_controller_that_is_handed_over():
    """At the same ratio of tips to wind, twice the rotor has four times the power in any wind."""
    law = lambda wind: (min(0.11 * wind, 1.2), 0.01 * max(wind - 11.0, 0.0))  # noqa: E731
    winds = [2.0, 9.0, 15.0, 28.0]
    large = control.power_curve(winds, scaled(2.0), held=law)
    small = [rotor_load(straight(), w, 2 * law(w)[0], law(w)[1]) for w in winds]
    assert_allclose(large["speed"], [0.22, 0.99, 1.2, 1.2], rtol=1e-12)
    assert_allclose(large["power"], [4 * 0.944 * one.power for one in small], rtol=1e-3)
    assert steady(9.0, scaled(2.0), held=law).torque == pytest.approx(large["torque"][1])


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
    """Report, equations 7-9 to 7-12: gain = 2 I w z w0 / (N |dP/dpitch|), half at 6.302336 deg."""
    assert_allclose(np.degrees(DOUBLING_PITCH), 6.302336, rtol=1e-5)
    assert_allclose([control.gain_factor(0.0), control.gain_factor(DOUBLING_PITCH)], [1.0, 0.5])
    inertia, sensitivity, w, zeta = 43.784e6, 25.52e6, 0.6, 0.7
    P = 2 * inertia * RATED_SPEED * zeta * w / (GEAR_RATIO * sensitivity)
    I = inertia * RATED_SPEED * w**2 / (GEAR_RATIO * sensitivity)
    one = Controller.at(GEAR_RATIO * RATED_SPEED)
    one.step(1.001 * GEAR_RATIO * RATED_SPEED, 1e3)
    error = 1e-3 * GEAR_RATIO * RATED_SPEED
    assert_allclose(one.pitch, P * error + I * error * 1e3, rtol=2e-3)
    there = Controller.at(control.HELD_GENERATOR, DOUBLING_PITCH)
    there.step(control.HELD_GENERATOR, 0.1)
    assert_allclose(there.pitch, DOUBLING_PITCH)  # where the factor of `at` is that of the steps


def test_the_power_curve_is_that_of_the_report_of_openfast_and_of_a_specialist():
    """Pitch of table 7-1, within a tenth of a degree to 21 m/s and 0.4 at 25."""
    curve = control.power_curve(np.arange(3.0, 25.5))
    winds, pitch = np.array(control.PUBLISHED_PITCH).T
    found = np.degrees(np.interp(winds, curve["wind"], curve["pitch"]))
    assert_allclose(found[winds < 21.5], pitch[winds < 21.5], atol=0.11)
    assert_allclose(found, pitch, atol=0.4)
    wind, speed, pitch, power, thrust = OPENFAST.T
    at = np.isin(curve["wind"], wind)
    assert_allclose(curve["speed"][at], speed * RPM, rtol=0.011)
    assert_allclose(np.degrees(curve["pitch"][at]), pitch, atol=0.3)
    assert_allclose(curve["power"][at], 1e3 * power, rtol=0.036)
    assert_allclose(curve["thrust"][at], 1e3 * thrust, rtol=0.03)
    assert_allclose(0.944 * steady(11.4).power, 5e6, rtol=0.02)
    assert (curve["power"] < 5.0001e6).all()
    assert_allclose(curve["power"][curve["wind"] >= 12.0], 5e6, rtol=1e-4)
    assert (curve["power_coefficient"] < BETZ_LIMIT).all()
    assert_allclose(curve["power_coefficient"][5:8], 0.482, rtol=0.01)
    assert abs(curve["wind"][curve["thrust"].argmax()] - 11.4) < 1.0
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
