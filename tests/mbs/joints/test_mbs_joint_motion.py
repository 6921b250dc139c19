"""Angles and displacements that a motion gives for its joints."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

import rom
from cases.mbs.mechanisms import random_body
from rom.errors import ConfigError
from rom.mbs.integrate.simulation import simulate
from rom.mbs.kernels.system import ALONG
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.joints import NO_VECTOR, Row
from rom.mbs.parts.signals import Signal
from rom.mbs.results.recomputed import displacements

AXIS = np.array([1.0, 2.0, 2.0]) / 3


def spinning_ball(speed, join):
    """A ball that nothing but a joint acts on, turning about its axis and moving along it."""
    mech = Mechanism(gravity=(0, 0, 0))
    velocity = 0.3 * AXIS if join == "cylindrical" else (0, 0, 0)
    ball = mech.add_rigid("ball", mass=2.0, inertia=(0.1, 0.1, 0.1), at=(1, 2, 3),
                          velocity=velocity, omega=speed * AXIS)  # fmt: skip
    getattr(mech, join)("pin", mech.ground.marker((1, 2, 3)), ball.marker((0, 0, 0)), axis=AXIS)
    return mech


@pytest.mark.parametrize("speed", [40.0, -40.0])
def test_turns_are_counted_where_few_instants_are_saved(speed):
    """Two thirds of a turn from one instant to the next."""
    sol = simulate(spinning_ball(speed, "revolute"), t_end=1.0, dt=1e-3, save_every=100)
    pin = sol.joint("pin")
    assert_allclose(pin.angle, speed * sol.t, atol=1e-6)
    assert_allclose(pin.angle_rate, speed, rtol=1e-9)
    assert pin.displacement is None and pin.displacement_rate is None
    some = np.array([0.93, 0.11, 0.57])
    assert_allclose(sol.at(some).joint("pin").angle_rate, speed, rtol=1e-3)


def test_a_cylindrical_joint_has_an_angle_and_a_displacement():
    sol = simulate(spinning_ball(2.0, "cylindrical"), t_end=1.0, dt=1e-2)
    pin = sol.joint("pin")
    assert_allclose(pin.angle, 2.0 * sol.t, atol=1e-4)
    assert_allclose(pin.displacement, 0.3 * sol.t, atol=1e-12)
    assert_allclose(pin.displacement_rate, 0.3, rtol=1e-12)


@pytest.fixture(scope="module")
def flexible():
    """A screw between a flexible body and a rigid one, all tumbling, with a motor along it."""
    mech = Mechanism(gravity=(0, 0, -9.81))
    one = mech.add_flexible("one", random_body(np.random.default_rng(17)), omega=(0.4, -0.2, 0.5))
    place = mech.design_point(one.marker("b"))
    two = mech.add_rigid("two", mass=2.0, inertia=(1.0, 1.5, 2.0), at=place,
                         omega=(-0.2, 0.4, 0.3))  # fmt: skip
    mech.screw("thread", one.marker("b"), two.marker((0, 0, 0)), axis=AXIS, pitch=0.02)
    mech.motor("servo", "thread", lambda t, x, v: 5.0 - 0.1 * v, coordinate="angle")
    return simulate(mech, t_end=2.0, dt=1e-3, assemble=True)


def test_a_screw_advances_by_its_pitch(flexible):
    thread = flexible.joint("thread")
    assert np.ptp(thread.angle) > 2 * np.pi
    assert_allclose(thread.displacement, 0.02 * thread.angle / (2 * np.pi), atol=1e-9)


def test_the_angle_is_the_one_that_forces_are_told(flexible):
    """Followed in the compiled equations, elastic rotations included."""
    thread = flexible.joint("thread")
    assert_allclose(flexible.base, np.column_stack([thread.displacement, thread.angle]), atol=1e-8)


def test_rates_are_derivatives(flexible):
    thread, h = flexible.joint("thread"), 1e-3
    for value, rate in ((thread.angle, thread.angle_rate),
                        (thread.displacement, thread.displacement_rate)):  # fmt: skip
        slope = np.gradient(value, h)[1:-1]
        assert_allclose(slope, rate[1:-1], atol=1e-3 * np.abs(rate).max())


def test_a_run_goes_on_from_a_time_between(flexible):
    """To the error of the interpolation."""
    part = flexible.at([0.2, 1.0005])
    assert part.final.t == 1.0005
    assert_allclose(part.final.q, part.q[-1], rtol=0)
    on = simulate(flexible.mechanism, t_end=2.0, dt=1e-3, state=part.final)
    assert_allclose(on.position("two")[-1], flexible.position("two")[-1], atol=1e-5)
    assert on.joint("thread").angle[-1] % (2 * np.pi) == pytest.approx(
        flexible.joint("thread").angle[-1] % (2 * np.pi), abs=1e-4
    )


def test_a_displacement_along_a_turning_axis_changes_with_the_axis():
    """Of points that are no longer on the axis: of a gap (t, 1, 0) seen along (cos t, sin t, 0)."""
    t = np.linspace(0.0, 2.0, 2001)
    nothing, ones = np.zeros_like(t), np.ones_like(t)
    c, s = np.cos(t), np.sin(t)
    turned = np.stack([np.stack([c, -s, nothing], 1), np.stack([s, c, nothing], 1),
                       np.tile([0.0, 0, 1], (t.size, 1))], axis=1)  # fmt: skip
    still = np.zeros((t.size, 3))
    one = SimpleNamespace(position=still, axes=turned,
                          twist=np.column_stack([still, nothing, nothing, ones]))  # fmt: skip
    two = SimpleNamespace(position=np.column_stack([t, ones, nothing]), axes=turned,
                          twist=np.column_stack([ones, nothing, nothing, still]))  # fmt: skip
    row = Row(ALONG, np.array([1.0, 0, 0]), NO_VECTOR, NO_VECTOR, offset=0.5)
    value, rate = displacements(row, one, two)
    assert_allclose(value, t * c + s - 0.5, atol=1e-12)
    assert_allclose(rate, c - t * s + c, atol=1e-12)


def test_joints_without_a_coordinate_are_named():
    mech = spinning_ball(1.0, "revolute")
    mech.spherical("ball joint", mech.ground.marker((1, 2, 3)), mech.part("ball").marker((0, 0, 0)))
    sol = simulate(mech, t_end=0.01, dt=1e-3)
    with pytest.raises(ConfigError, match="'ball joint' is spherical: it has no angle"):
        sol.joint("ball joint")
    with pytest.raises(ConfigError, match=r"no joint 'pine'; there are \['ball joint', 'pin'\]"):
        sol.joint("pine")


POLYNOMIAL = np.polynomial.Polynomial([0.3, -1.0, 2.0, 0.7, -0.4])


def test_derivatives_are_exact_for_a_quartic_from_the_first_time_to_the_last():
    """Five points: forward, central, backward weights all pass a polynomial of degree four."""
    t, span = np.linspace(-1.0, 2.0, 31), (-1.0, 2.0)
    table = Signal("motor", POLYNOMIAL).sample(t, span, 0.1)
    wanted = [POLYNOMIAL(t), POLYNOMIAL.deriv(1)(t), POLYNOMIAL.deriv(2)(t)]
    assert_allclose(table, np.transpose(wanted), atol=1e-10)


def test_given_derivatives_are_used():
    signal = Signal("motor", np.sin, lambda t: 3.0, lambda t: 5.0)
    assert_allclose(signal.sample(np.array([0.2]), (0.0, 1.0), 0.1), [[np.sin(0.2), 3.0, 5.0]])


def wheel(function):
    mech = Mechanism(gravity=(0, 0, 0))
    body = mech.add_rigid("wheel", mass=1.0, inertia=(1, 1, 0.5), at=(0, 0, 0))
    mech.revolute("axle", mech.ground.marker((0, 0, 0)), body.marker((0, 0, 0)), axis=(0, 0, 1))
    mech.drive("motor", "axle", function)
    return mech, body


def test_round_off_asks_for_nothing_outside_the_span():
    rng = np.random.default_rng(0)
    for start, length, parts in rng.uniform((-1, 0.1, 5), (1, 2, 50), size=(200, 3)):
        asked = []
        span = (start, start + length)
        signal = Signal("motor", lambda t, asked=asked: asked.append(float(t)) or float(t))
        signal.sample(np.array(span), span, length / parts)
        assert (min(asked), max(asked)) == span


@pytest.mark.parametrize("dt", [0.01, 0.1 / 3, 0.3])
@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_nobody_asks_a_function_for_times_outside_the_run(method, dt):
    asked = []

    def angle(t):
        asked.append(float(t))
        return np.sin(float(t))

    mech, body = wheel(angle)
    mech.force("push", body.marker((0, 0, 0)), lambda t: (angle(t), 0, 0))
    simulate(mech, t_start=0.3, t_end=1.0, dt=dt, method=method, assemble=True)
    assert min(asked) == 0.3
    assert max(asked) == 1.0


@pytest.mark.parametrize(("method", "tolerance"), [("generalized-alpha", 3e-5), ("dop853", 2e-6)])
def test_a_table_that_ends_with_the_run_drives_it_to_the_end(method, tolerance):
    """Beyond its last entry the spline is not a number."""
    t = np.linspace(0, 1, 201)
    table = CubicSpline(t, np.sin(t), extrapolate=False)
    sol = simulate(wheel(table)[0], t_end=1.0, dt=1e-2, method=method)
    assert sol.t[-1] == pytest.approx(1.0)
    assert_allclose(sol.omega("wheel")[:, 2], np.cos(sol.t), atol=tolerance)
    assert_allclose(sol.reaction("motor")[1:, 5], -0.5 * np.sin(sol.t[1:]), atol=tolerance)


@pytest.mark.parametrize("t_end", [1e-10, 1e-8, 6e-8, 1e-6, 1e-4])
@pytest.mark.parametrize("speed", [3.0, 300.0])
def test_round_off_of_a_soft_start_is_no_jump(t_end, speed):
    """Three terms of size one cancel to a motion of t^4: what is left at first is round-off."""
    T = 2 * np.pi / 300.0

    def angle(t):
        start = t**2 / (2 * T) + T / (2 * np.pi) ** 2 * (np.cos(2 * np.pi * t / T) - 1)
        return speed * start

    mech = rom.Mechanism(gravity=(0, 0, 0))
    crank = mech.add_rigid("crank", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))
    pin = crank.marker((0, 0, 0))
    mech.revolute("bearing", mech.ground.marker((0, 0, 0)), pin, axis=(0, 0, 1))
    mech.drive("motor", "bearing", angle)
    sol = rom.simulate(mech, t_end=t_end, dt=t_end)
    assert abs(sol.joint("bearing").angle[-1] - angle(t_end)) < 1e-14
