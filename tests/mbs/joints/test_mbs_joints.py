"""Every joint lets its bodies move as it should and in no other way; redundancy; restarts."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.mbs.mechanisms import random_body, simulate_quietly, slider_crank
from rom import rotation
from rom.errors import ModelError, RomWarning
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism

Z = np.array([0.0, 0.0, 1.0])
AXIS = np.array([1.0, 2.0, 2.0]) / 3


def two_bodies(join):
    """A flexible body thrown with a rigid one; ``join`` ties their markers in one place."""
    rng = np.random.default_rng(17)
    mech = Mechanism(gravity=(0, 0, -9.81))
    one = mech.add_flexible("one", random_body(rng), omega=(2.0, -1.0, 3.0))
    place = mech.design_point(one.marker("b"))
    two = mech.add_rigid(
        "two", mass=2.0, inertia=(1.0, 1.5, 2.0), at=place + np.array([0.4, -0.3, 0.2]),
        orientation=rotation.matrix(np.array([0.8, 0.6, 0, 0])), velocity=(1.0, 0.5, -0.5),
        omega=(-1.0, 2.0, 1.0), markers={"a": _body_point([-0.4, 0.3, -0.2])},
    )  # fmt: skip
    join(mech, one.marker("b"), two.marker("a"))
    sol = simulate(mech, t_end=0.4, dt=1e-3, assemble=True)
    assert np.abs(sol.energy.balance).max() < 1e-4 * np.ptp(sol.energy.potential)
    gap = sol.position("two", "a") - sol.position("one", "b")
    E1, E2 = sol.axes("one", "b"), sol.axes("two", "a")
    return sol, gap, np.einsum("tba,tbc->tac", E1, E2), E1


def _body_point(world):
    return rotation.matrix(np.array([0.8, 0.6, 0, 0])).T @ np.array(world)


def turned(relative):
    """(n_t,) angle by which the relative orientation has changed since the start [rad]."""
    change = np.einsum("ba,tbc->tac", relative[0], relative)
    return np.arccos(np.clip((np.trace(change, axis1=1, axis2=2) - 1) / 2, -1, 1))


def axis_in_one(E1):
    """(n_t, 3) the axis of the joint, carried by the first marker."""
    return E1 @ (E1[0].T @ AXIS)


def test_revolute_shares_a_point_and_an_axis():
    sol, gap, relative, E1 = two_bodies(lambda m, a, b: m.revolute("j", a, b, axis=AXIS))
    assert np.abs(gap).max() < 1e-10
    other = sol.axes("two", "a") @ (sol.axes("two", "a")[0].T @ AXIS)
    assert_allclose(other, axis_in_one(E1), atol=1e-10)
    assert turned(relative).max() > 0.1
    assert sol.lam.shape[1] == 5


def test_spherical_shares_a_point_only():
    sol, gap, _, E1 = two_bodies(lambda m, a, b: m.spherical("j", a, b))
    assert np.abs(gap).max() < 1e-10
    other = sol.axes("two", "a") @ (sol.axes("two", "a")[0].T @ AXIS)
    assert np.abs(other - axis_in_one(E1)).max() > 0.1
    assert sol.lam.shape[1] == 3


def test_cylindrical_turns_and_slides_along_its_axis():
    sol, gap, relative, E1 = two_bodies(lambda m, a, b: m.cylindrical("j", a, b, axis=AXIS))
    axis = axis_in_one(E1)
    assert np.abs(np.cross(gap, axis)).max() < 1e-10
    assert np.abs(gap).max() > 1e-2
    assert turned(relative).max() > 0.1
    other = sol.axes("two", "a") @ (sol.axes("two", "a")[0].T @ AXIS)
    assert_allclose(other, axis, atol=1e-10)
    assert sol.lam.shape[1] == 4


def test_prismatic_slides_along_its_axis_without_turning():
    sol, gap, relative, E1 = two_bodies(lambda m, a, b: m.prismatic("j", a, b, axis=AXIS))
    assert np.abs(np.cross(gap, axis_in_one(E1))).max() < 1e-10
    assert np.abs(gap).max() > 1e-2
    assert turned(relative).max() < 1e-7
    assert sol.lam.shape[1] == 5


def test_fixed_lets_nothing_move():
    sol, gap, relative, _ = two_bodies(lambda m, a, b: m.fixed("j", a, b))
    assert np.abs(gap).max() < 1e-10
    assert turned(relative).max() < 1e-7
    assert sol.lam.shape[1] == 6


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
    mech = Mechanism(gravity=(0, 0, 0))
    turn = rotation.matrix(np.array([np.cos(beta / 2), 0, 0, np.sin(beta / 2)]))
    ground, origin = mech.ground, {"c": (0, 0, 0)}
    start = speed * np.cos(beta)  # the cross stands at phi = 90 degrees
    one = mech.add_rigid("one", mass=1, inertia=(1e-3,) * 3, at=(0, 0, 0), markers=origin,
                         omega=(speed, 0, 0))  # fmt: skip
    two = mech.add_rigid("two", mass=1, inertia=(1e-3,) * 3, at=(0, 0, 0), orientation=turn,
                         markers=origin, omega=(start, 0, 0))  # fmt: skip
    mech.revolute("in", ground.marker((0, 0, 0)), one.marker("c"), axis=(1, 0, 0))
    mech.revolute("out", ground.marker((0, 0, 0)), two.marker("c"), axis=out)
    mech.universal("cross", one.marker("c"), two.marker("c"), axis1=(0, 0, 1),
                   axis2=np.cross(Z, out))  # fmt: skip
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
    mech = Mechanism(gravity=(0, 0, 0))
    one = mech.add_flexible("one", random_body(rng, damped=False), omega=(1.0, 2.0, 0.5))
    two = mech.add_rigid("two", mass=2.0, inertia=(1, 1.5, 2.0), at=(2, 1, 0), velocity=(0, 1, 0),
                         markers={"a": (0.1, 0, 0)})  # fmt: skip

    def law(t, a, b):
        return 3.0 * (b.position - a.position) + [0, np.sin(t), 0.2], (0.1, -0.2, 0.3)

    mech.user_force("law", law, one.marker("a"), two.marker("a"))
    sol = simulate(mech, t_end=0.5, dt=0.05, method="dop853")
    for momentum in sol.momentum:
        assert np.abs(momentum - momentum[0]).max() < 1e-9 * np.abs(momentum).max()
    assert np.abs(sol.velocity("two", "a")[-1] - sol.velocity("two", "a")[0]).max() > 0.1


def door(second="upper"):
    """A door of 20 kg on two hinges, 0.4 m from its middle, hinge line vertical."""
    mech = Mechanism(gravity=(0, 0, -9.81))
    points = {"lower": (-0.4, 0, -0.8), "upper": (-0.4, 0, 0.8)}
    leaf = mech.add_rigid(
        "leaf", mass=20.0, inertia=(3.0, 2.0, 1.2), at=(0.4, 0, 0), markers=points
    )
    for name, point in points.items():
        hinge = mech.ground.marker((0.0, 0.0, point[2]))
        mech.revolute(f"{name} hinge", hinge, leaf.marker(name), axis=Z)
    return mech


def test_redundant_hinges_share_the_load_with_least_norm_and_a_warning():
    """Weight halves; the moment m g 0.4 m is carried by the pair and by the hinge moments."""
    with pytest.warns(RomWarning, match="5 of 10 constraints .* lower hinge, upper hinge"):
        sol = simulate(door(), t_end=0.1, dt=0.01)
    low, high = sol.reaction("lower hinge")[-1], sol.reaction("upper hinge")[-1]
    assert_allclose([low[2], high[2]], [98.1, 98.1], rtol=1e-9)
    assert_allclose(low[0] + high[0], 0.0, atol=1e-9)
    assert_allclose(
        sol.position("leaf"), sol.position("leaf")[[0]].repeat(len(sol.t), 0), atol=1e-9
    )
    moment = 0.8 * (high[0] - low[0]) + low[4] + high[4]
    assert_allclose(abs(moment), 20 * 9.81 * 0.4, rtol=1e-9)
    # of all loads with that sum the least squares are those in proportion to their levers
    assert_allclose(low[4] / high[0], 1.0 / 0.8, rtol=1e-6)


def test_hinges_that_contradict_each_other_are_refused_by_name():
    mech = Mechanism(gravity=(0, 0, 0))
    leaf = mech.add_rigid("leaf", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0),
                          markers={"a": (0, 0, 0), "b": (1, 0, 0)})  # fmt: skip
    mech.revolute("here", mech.ground.marker((0, 0, 0)), leaf.marker("a"), axis=Z)
    mech.revolute("too far", mech.ground.marker((1.5, 0, 0)), leaf.marker("b"), axis=Z)
    with pytest.raises(ModelError, match=r"cannot be assembled: '(here|too far)' stays open"):
        simulate(mech, t_end=0.1, dt=0.01)


def test_a_start_in_line_is_refused():
    """A parallelogram folded flat could go on as a parallelogram or as an antiparallelogram."""
    mech = Mechanism(gravity=(0, 0, 0))
    bar = {"inertia": (1e-3, 1e-3, 1e-3), "mass": 1.0}
    ends = {"a": (-0.5, 0, 0), "b": (0.5, 0, 0)}
    left = mech.add_rigid("left", at=(0.5, 0, 0), markers=ends, **bar)
    rod = mech.add_rigid("rod", at=(2.0, 0, 0), markers={"a": (-1, 0, 0), "b": (1, 0, 0)}, **bar)
    right = mech.add_rigid("right", at=(2.5, 0, 0), markers=ends, **bar)
    mech.revolute("A", mech.ground.marker((0, 0, 0)), left.marker("a"), axis=Z)
    mech.revolute("B", left.marker("b"), rod.marker("a"), axis=Z)
    mech.revolute("C", rod.marker("b"), right.marker("b"), axis=Z)
    mech.revolute("D", mech.ground.marker((2, 0, 0)), right.marker("a"), axis=Z)
    with pytest.warns(RomWarning), pytest.raises(ModelError, match="singular position"):
        simulate(mech, t_end=0.1, dt=0.01)


def test_two_runs_give_the_same_bits_and_a_restart_goes_on():
    whole = simulate_quietly(slider_crank(), t_end=0.1, dt=1e-3)
    again = simulate_quietly(slider_crank(), t_end=0.1, dt=1e-3)
    for name in ("q", "v", "a", "lam"):
        assert np.array_equal(getattr(whole, name), getattr(again, name))
    mech = slider_crank()
    half = simulate_quietly(mech, t_end=0.05, dt=1e-3)
    rest = simulate_quietly(mech, t_end=0.1, dt=1e-3, state=half.final)
    assert_allclose(rest.t[0], 0.05, atol=1e-12)
    assert_allclose(rest.q[-1], whole.q[-1], atol=1e-10)
    assert_allclose(rest.v[-1], whole.v[-1], atol=1e-7)


def test_saving_every_fifth_step_keeps_the_motion():
    every = simulate_quietly(slider_crank(), t_end=0.1, dt=1e-3)
    fifth = simulate_quietly(slider_crank(), t_end=0.1, dt=1e-3, save_every=5)
    assert_allclose(fifth.t, every.t[::5], atol=1e-15)
    assert_allclose(fifth.q, every.q[::5], atol=1e-12)
