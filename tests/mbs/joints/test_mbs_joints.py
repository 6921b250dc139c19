"""Every joint lets its bodies move as it should and in no other way; redundancy; restarts."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.mbs.mechanisms import random_body, simulate_quietly
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
