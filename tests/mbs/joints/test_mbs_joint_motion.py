"""Angles and displacements that a motion gives for its joints."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.mbs.mechanisms import random_body
from rom.errors import ConfigError
from rom.mbs.integrate.simulation import simulate
from rom.mbs.kernels.system import ALONG
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.joints import NO_VECTOR, Row
from rom.mbs.results.joint_motion import displacements

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
