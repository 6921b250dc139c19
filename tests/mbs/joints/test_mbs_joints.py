"""Every joint lets its bodies move as it should and in no other way, and says how they moved."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

import rom
from cases.mbs.mechanisms import random_body, simulate_quietly
from cases.mbs.parts import Z, on_axle
from cases.refusals import refuses
from rom import rotation
from rom.errors import ConfigError, ModelError, RomWarning
from rom.mbs.kernels.system import ALONG
from rom.mbs.parts.joints import NO_VECTOR, Row
from rom.mbs.results.recomputed import displacements

AXIS = np.array([1.0, 2.0, 2.0]) / 3
POLYNOMIAL = np.polynomial.Polynomial([0.3, -1.0, 2.0, 0.7, -0.4])


def two_bodies(join):
    """A flexible body thrown with a rigid one; ``join`` ties their markers in one place."""
    rng = np.random.default_rng(17)
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    one = mech.add_flexible("one", random_body(rng), omega=(2.0, -1.0, 3.0))
    place = mech.design_point(one.marker("b"))
    arm, A = np.array([0.4, -0.3, 0.2]), rotation.matrix(np.array([0.8, 0.6, 0, 0]))
    two = mech.add_rigid("two", mass=2.0, inertia=(1.0, 1.5, 2.0), at=place + arm, orientation=A,
                         velocity=(1.0, 0.5, -0.5), omega=(-1.0, 2.0, 1.0),
                         markers={"a": A.T @ -arm})  # fmt: skip
    join(mech, one.marker("b"), two.marker("a"))
    sol = rom.simulate(mech, t_end=0.4, dt=1e-3, assemble=True)
    assert np.abs(sol.energy.balance).max() < 1e-4 * np.ptp(sol.energy.potential)
    gap = sol.position("two", "a") - sol.position("one", "b")
    E1, E2 = sol.axes("one", "b"), sol.axes("two", "a")
    return sol, gap, np.einsum("tba,tbc->tac", E1, E2), E1


def turned(relative):
    """(n_t,) angle by which the relative orientation has changed since the start [rad]."""
    change = np.einsum("ba,tbc->tac", relative[0], relative)
    return np.arccos(np.clip((np.trace(change, axis1=1, axis2=2) - 1) / 2, -1, 1))


def axis_in_one(E1):
    """(n_t, 3) the axis of the joint, carried by the first marker."""
    return E1 @ (E1[0].T @ AXIS)


KINDS = {  # joint -> rows, name of its axis, where points go, whether it turns, keeps the axis
    "revolute": (5, "axis", "nowhere", True, True),
    "spherical": (3, None, "nowhere", True, False),
    "cylindrical": (4, "axis", "along", True, True),
    "prismatic": (5, "axis", "along", False, True),
    "fixed": (6, None, "nowhere", False, True),
    "planar": (3, "normal", "across", True, True),
    "point_on_line": (2, "axis", "along", True, False),
    "point_on_plane": (1, "normal", "across", True, False),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_joint_lets_its_bodies_move_as_it_should_and_in_no_other_way(kind):
    rows, direction, way, turns, keeps = KINDS[kind]
    about = {direction: AXIS} if direction else {}
    sol, gap, relative, E1 = two_bodies(lambda m, a, b: getattr(m, kind)("j", a, b, **about))
    axis = axis_in_one(E1)
    off = {"nowhere": gap, "along": np.cross(gap, axis), "across": (gap * axis).sum(axis=1)}
    assert np.abs(off[way]).max() < 1e-10
    assert (np.abs(gap).max() > 1e-2) == (way != "nowhere")
    assert turned(relative).max() > 0.1 if turns else turned(relative).max() < 1e-7
    apart = np.abs(sol.axes("two", "a") @ (sol.axes("two", "a")[0].T @ AXIS) - axis).max()
    assert apart < 1e-10 if keeps else apart > 0.1
    assert sol.lam.shape[1] == rows


def test_universal_keeps_its_axes_perpendicular():
    across = np.array([2.0, -2.0, 1.0]) / 3
    sol, gap, _, E1 = two_bodies(lambda m, a, b: m.universal("j", a, b, axis1=AXIS, axis2=across))
    assert np.abs(gap).max() < 1e-10
    E2 = sol.axes("two", "a")
    other = E2 @ (E2[0].T @ across)
    assert np.abs(np.einsum("ta,ta->t", axis_in_one(E1), other)).max() < 1e-10
    assert np.abs(other - other[0]).max() > 0.1
    assert sol.lam.shape[1] == 4


def test_cardan_shafts_turn_with_the_ratio_of_the_closed_form():
    """Shafts at the angle beta: omega2 / omega1 = cos(beta) / (1 - sin^2(beta) cos^2(phi))."""
    beta, speed = 0.5, 10.0
    out = np.array([np.cos(beta), np.sin(beta), 0.0])
    mech = rom.Mechanism(gravity=(0, 0, 0))
    turn = rotation.matrix(np.array([np.cos(beta / 2), 0, 0, np.sin(beta / 2)]))
    start = speed * np.cos(beta)  # the cross stands at phi = 90 degrees
    on_axle(mech, "one", inertia=(1e-3,) * 3, axle="in", axis=(1, 0, 0), omega=(speed, 0, 0))
    moving = {"orientation": turn, "omega": (start, 0, 0)}
    on_axle(mech, "two", inertia=(1e-3,) * 3, axle="out", axis=out, **moving)
    mech.universal("cross", "one", "two", axis1=Z, axis2=np.cross(Z, out))
    mech.drive("motor", "in", lambda t: speed * t)
    sol = simulate_quietly(mech, t_end=1.0, dt=0.01, method="dop853")
    phi = speed * sol.t + np.pi / 2  # the first pin starts across the plane of the shafts
    ratio = np.cos(beta) / (1 - np.sin(beta) ** 2 * np.cos(phi) ** 2)
    assert_allclose(sol.omega("two")[:, 0], speed * ratio, atol=1e-7)
    p, a = sol.orientation("two"), speed * sol.t  # and tan(b) = tan(a) cos(beta)
    b = 2 * np.arctan2(p[:, 1], p[:, 0])
    assert_allclose(np.sin(b) * np.cos(a), np.cos(b) * np.sin(a) * np.cos(beta), atol=1e-8)


def test_the_force_of_a_law_on_two_bodies_conserves_momentum():
    rng = np.random.default_rng(3)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    one = mech.add_flexible("one", random_body(rng, damped=False), omega=(1.0, 2.0, 0.5))
    two = mech.add_rigid("two", mass=2.0, inertia=(1, 1.5, 2.0), at=(2, 1, 0), velocity=(0, 1, 0),
                         markers={"a": (0.1, 0, 0)})  # fmt: skip

    def law(t, a, b):
        return 3.0 * (b.position - a.position) + [0, np.sin(t), 0.2], (0.1, -0.2, 0.3)

    mech.user_force("law", law, one.marker("a"), two.marker("a"))
    sol = rom.simulate(mech, t_end=0.5, dt=0.05, method="dop853")
    for momentum in sol.momentum:
        assert np.abs(momentum - momentum[0]).max() < 1e-9 * np.abs(momentum).max()
    assert np.abs(sol.velocity("two", "a")[-1] - sol.velocity("two", "a")[0]).max() > 0.1


def test_redundant_hinges_share_the_load_with_least_norm_and_a_warning():
    """Weight halves; the moment m g 0.4 m is carried by the pair and by the hinge moments."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    points = {"lower": (-0.4, 0, -0.8), "upper": (-0.4, 0, 0.8)}
    about = {"inertia": (3.0, 2.0, 1.2), "at": (0.4, 0, 0), "markers": points}
    leaf = mech.add_rigid("leaf", mass=20.0, **about)
    for name, point in points.items():
        hinge = mech.ground.marker((0.0, 0.0, point[2]))
        mech.revolute(f"{name} hinge", hinge, leaf.marker(name), axis=Z)
    with pytest.warns(RomWarning, match="5 of 10 constraints .* lower hinge, upper hinge"):
        sol = rom.simulate(mech, t_end=0.1, dt=0.01)
    low, high = sol.reaction("lower hinge")[-1], sol.reaction("upper hinge")[-1]
    assert_allclose([low[2], high[2]], [98.1, 98.1], rtol=1e-9)
    assert_allclose(low[0] + high[0], 0.0, atol=1e-9)
    assert_allclose(np.ptp(sol.position("leaf"), axis=0), 0.0, atol=1e-9)
    moment = 0.8 * (high[0] - low[0]) + low[4] + high[4]
    assert_allclose(abs(moment), 20 * 9.81 * 0.4, rtol=1e-9)
    # of all loads with that sum the least squares are those in proportion to their levers
    assert_allclose(low[4] / high[0], 1.0 / 0.8, rtol=1e-6)


def test_hinges_that_contradict_each_other_are_refused_by_name():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    leaf = mech.add_rigid("leaf", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))
    mech.revolute("here", mech.ground.marker((0, 0, 0)), leaf.marker((0, 0, 0)), axis=Z)
    mech.revolute("too far", mech.ground.marker((1.5, 0, 0)), leaf.marker((1, 0, 0)), axis=Z)
    words = r"cannot be assembled: '(here|too far)' stays open"
    refuses(ModelError, words, rom.simulate, mech, t_end=0.1, dt=0.01)


def spinning_ball(speed, join):
    """A ball that nothing but a joint acts on, turning about its axis and moving along it."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    velocity = 0.3 * AXIS if join == "cylindrical" else (0, 0, 0)
    ball = mech.add_rigid("ball", mass=2.0, inertia=(0.1, 0.1, 0.1), at=(1, 2, 3),
                          velocity=velocity, omega=speed * AXIS)  # fmt: skip
    getattr(mech, join)("pin", mech.ground.marker((1, 2, 3)), ball.marker((0, 0, 0)), axis=AXIS)
    return mech


@pytest.mark.parametrize("speed", [40.0, -40.0])
def test_turns_are_counted_where_few_instants_are_saved(speed):
    sol = rom.simulate(spinning_ball(speed, "revolute"), t_end=1.0, dt=1e-3, save_every=100)
    pin = sol.joint("pin")
    assert_allclose(pin.angle, speed * sol.t, atol=1e-6)
    assert_allclose(pin.angle_rate, speed, rtol=1e-9)
    assert pin.displacement is None and pin.displacement_rate is None
    some = np.array([0.93, 0.11, 0.57])
    assert_allclose(sol.at(some).joint("pin").angle_rate, speed, rtol=1e-3)


def test_a_cylindrical_joint_has_an_angle_and_a_displacement():
    sol = rom.simulate(spinning_ball(2.0, "cylindrical"), t_end=1.0, dt=1e-2)
    pin = sol.joint("pin")
    assert_allclose(pin.angle, 2.0 * sol.t, atol=1e-4)
    assert_allclose(pin.displacement, 0.3 * sol.t, atol=1e-12)
    assert_allclose(pin.displacement_rate, 0.3, rtol=1e-12)


@pytest.fixture(scope="module")
def flexible():
    """A screw between a flexible body and a rigid one, all tumbling, with a motor along it."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    one = mech.add_flexible("one", random_body(np.random.default_rng(17)), omega=(0.4, -0.2, 0.5))
    place = mech.design_point(one.marker("b"))
    two = mech.add_rigid("two", mass=2.0, inertia=(1.0, 1.5, 2.0), at=place, omega=(-0.2, 0.4, 0.3))
    mech.screw("thread", one.marker("b"), two.marker((0, 0, 0)), axis=AXIS, pitch=0.02)
    mech.motor("servo", "thread", lambda t, x, v: 5.0 - 0.1 * v, coordinate="angle")
    return rom.simulate(mech, t_end=2.0, dt=1e-3, assemble=True)


def test_a_screw_advances_by_its_pitch_with_rates_and_the_angle_that_forces_are_told(flexible):
    """Followed in the compiled equations, elastic rotations included."""
    thread = flexible.joint("thread")
    angle, way = thread.angle, thread.displacement
    assert np.ptp(angle) > 2 * np.pi
    assert_allclose(way, 0.02 * angle / (2 * np.pi), atol=1e-9)
    assert_allclose(flexible.base, np.column_stack([way, angle]), atol=1e-8)
    for value, rate in ((angle, thread.angle_rate), (way, thread.displacement_rate)):
        slope = np.gradient(value, 1e-3)[1:-1]
        assert_allclose(slope, rate[1:-1], atol=1e-3 * np.abs(rate).max())


def test_a_run_goes_on_from_a_time_between(flexible):
    """To the error of the interpolation."""
    part = flexible.at([0.2, 1.0005])
    assert part.final.t == 1.0005
    assert_allclose(part.final.q, part.q[-1], rtol=0)
    on = rom.simulate(flexible.mechanism, t_end=2.0, dt=1e-3, state=part.final)
    assert_allclose(on.position("two")[-1], flexible.position("two")[-1], atol=1e-5)
    ends = [sol.joint("thread").angle[-1] % (2 * np.pi) for sol in (on, flexible)]
    assert ends[0] == pytest.approx(ends[1], abs=1e-4)


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
    sol = rom.simulate(mech, t_end=0.01, dt=1e-3)
    refuses(ConfigError, "'ball joint' is spherical: it has no angle", sol.joint, "ball joint")
    refuses(ConfigError, r"no joint 'pine'; there are \['ball joint', 'pin'\]", sol.joint, "pine")


def test_derivatives_are_those_given_or_exact_for_a_quartic_from_the_first_time_to_the_last():
    """Five points: forward, central, backward weights all pass a polynomial of degree four."""
    t, span = np.linspace(-1.0, 2.0, 31), (-1.0, 2.0)
    table = rom.mbs.Signal("motor", POLYNOMIAL).sample(t, span, 0.1)
    wanted = [POLYNOMIAL(t), POLYNOMIAL.deriv(1)(t), POLYNOMIAL.deriv(2)(t)]
    assert_allclose(table, np.transpose(wanted), atol=1e-10)
    signal = rom.mbs.Signal("motor", np.sin, lambda t: 3.0, lambda t: 5.0)
    assert_allclose(signal.sample(np.array([0.2]), (0.0, 1.0), 0.1), [[np.sin(0.2), 3.0, 5.0]])


def wheel(function):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    centre = on_axle(mech)
    mech.drive("motor", "axle", function)
    return mech, centre


def test_round_off_asks_for_nothing_outside_the_span():
    rng = np.random.default_rng(0)
    for start, length, parts in rng.uniform((-1, 0.1, 5), (1, 2, 50), size=(200, 3)):
        asked = []
        span = (start, start + length)
        signal = rom.mbs.Signal("motor", lambda t, asked=asked: asked.append(float(t)) or float(t))
        signal.sample(np.array(span), span, length / parts)
        assert (min(asked), max(asked)) == span


@pytest.mark.parametrize("dt", [0.01, 0.1 / 3, 0.3])
@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_nobody_asks_a_function_for_times_outside_the_run(method, dt):
    asked = []

    def angle(t):
        asked.append(float(t))
        return np.sin(float(t))

    mech, centre = wheel(angle)
    mech.force("push", centre, lambda t: (angle(t), 0, 0))
    rom.simulate(mech, t_start=0.3, t_end=1.0, dt=dt, method=method, assemble=True)
    assert min(asked) == 0.3
    assert max(asked) == 1.0


@pytest.mark.parametrize(("method", "tolerance"), [("generalized-alpha", 3e-5), ("dop853", 2e-6)])
def test_a_table_that_ends_with_the_run_drives_it_to_the_end(method, tolerance):
    """Beyond its last entry the spline is not a number."""
    t = np.linspace(0, 1, 201)
    table = CubicSpline(t, np.sin(t), extrapolate=False)
    sol = rom.simulate(wheel(table)[0], t_end=1.0, dt=1e-2, method=method)
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

    sol = rom.simulate(wheel(angle)[0], t_end=t_end, dt=t_end)
    assert abs(sol.joint("axle").angle[-1] - angle(t_end)) < 1e-14
