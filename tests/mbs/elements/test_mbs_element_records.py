"""Forces of single elements along a motion: by their own laws, and all of them by what moves."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.parts import RECORD, held_rod, on_guide, on_hinge, slipping
from cases.refusals import refuses
from rom.io.history import channels

STIFFNESS, DAMPING, LOAD, LEVEL, MU = 100.0, 3.0, 1.0, 0.5, 0.1
X_AXIS, Z_AXIS = (1, 0, 0), (0, 0, 1)


def slide():
    """A block on a guide along x between springs, under loads of all kinds."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    wall = mech.ground.marker((-1, 0, 0))
    hook = on_guide(mech, "block", mass=2.0, velocity=X_AXIS, base=wall)
    mech.spring_damper("spring", wall, hook, stiffness=STIFFNESS, damping=DAMPING)
    mech.spring_damper("other", mech.ground.marker((2, 0, 0)), hook, stiffness=50.0)
    mech.motor("motor", "guide", lambda t, x, rate: -5 * np.sin(3 * t) - rate)
    mech.motor("asked", "guide", lambda t, x, rate: -float(str(x)), compiled=False)
    mech.force("load", hook, lambda t: np.array([np.cos(5 * t), LOAD, 0]))
    mech.friction("friction", "guide", transition_speed=1e-2, coulomb=LEVEL, mu=MU)
    mech.stop("stop", "guide", rom.mbs.Impact(stiffness=1e4, exponent=1.0), upper=0.02)
    mech.law("slipping", slipping, wall, hook, parameters=(40.0, 3.0), memory=[1.0], **RECORD)
    mech.user_force("pushed", lambda t, a: (np.array([0, 0, 2.0]), np.zeros(3)), hook)
    return mech


@pytest.fixture(scope="module")
def slid():
    return rom.simulate(slide(), t_end=0.5, dt=5e-4)


@pytest.mark.once
def test_each_element_by_its_own_law(slid):
    x, v = slid.position("block")[:, 0], slid.velocity("block")[:, 0]
    spring = slid.element("spring")
    assert_allclose(spring.along, STIFFNESS * x + DAMPING * v, atol=1e-12)
    assert_allclose(spring.force[:, 1, 0], -spring.along, atol=1e-12)
    assert_allclose(spring.energy, STIFFNESS * x**2 / 2, atol=1e-12)
    assert_allclose(spring.lost, DAMPING * v**2, atol=1e-12)
    assert_allclose(slid.element("other").along, -50.0 * x, atol=1e-12)  # it grows shorter
    assert_allclose(slid.element("motor").along, -5 * np.sin(3 * slid.t) - v, atol=1e-12)
    assert_allclose(slid.element("asked").along, -x, atol=1e-12)
    assert_allclose(slid.element("load").force[:, 0, 0], np.cos(5 * slid.t), rtol=1e-14)
    assert slid.element("load").along is None
    pressed = np.hypot(LOAD, 2.0)  # across the guide
    fast = np.abs(v) > 1.0 / 10
    level = LEVEL + MU * pressed
    friction = slid.element("friction")
    assert fast.sum() > 100
    assert_allclose(friction.along[fast], -level * np.sign(v[fast]), rtol=1e-3)
    assert_allclose(friction.lost, -friction.along * v, atol=1e-12)
    beyond = np.maximum(x - 0.02, 0.0)
    stop = slid.element("stop")
    assert stop.along.min() < -10.0
    assert_allclose(stop.along, -1e4 * beyond, atol=1e-9)
    assert_allclose(stop.energy, 1e4 * beyond**2 / 2, atol=1e-9)
    assert (stop.on_joint, stop.along_unit) == (True, "N")
    found, own = slid.element("slipping"), slid.law("slipping")
    assert_allclose(found.along, own.force[:, 0, 0], atol=1e-12)
    assert np.abs(np.diff(own.memory[:, 0])).max() > 0


def test_together_they_are_what_acts_on_the_block_and_what_is_stored_and_lost(slid):
    """With what the guide transmits; and that is mass times acceleration."""
    total = slid.reaction("guide")[:, :3].copy()
    for name in slid.elements:
        found = slid.element(name)
        on_block = [marker.body == "block" for marker in found.markers]
        total += found.force[:, on_block].sum(axis=1)
    assert_allclose(total, slid.interface_loads("block")[(0.0, 0.0, 0.0)][:, :3], atol=1e-9)
    assert set(slid.elements) == set(slide().elements)
    every = [slid.element(name) for name in slid.elements]
    assert_allclose(sum(one.energy for one in every), slid.energy.strain, atol=1e-9)
    lost = sum(one.lost for one in every)
    spent = np.concatenate([[0], np.cumsum(0.5 * np.diff(slid.t) * (lost[1:] + lost[:-1]))])
    assert_allclose(spent, slid.energy.damping, atol=2e-3 * slid.energy.damping[-1])


def test_tables_of_a_motion_have_all_forces_and_asking_changes_nothing(slid):
    places = slid.packed.places
    before = [len(x) for x in (places.signals, places.coordinates, places.remembered)]
    found = {" ".join(c.path[1:]): c.values for c in channels(slid)}
    assert_allclose(found["load force"][:, 0], np.cos(5 * slid.t), rtol=1e-14)
    assert_allclose(found["spring force"], slid.element("spring").force[:, 1], atol=1e-12)
    assert [len(x) for x in (places.signals, places.coordinates, places.remembered)] == before


def test_torques_about_joints_and_between_bodies():
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    on_hinge(mech, (0.4, 0, 0), mass=1.0, inertia=(0.1, 0.1, 0.1), axis=Z_AXIS)
    mech.rotational_spring("turn", "hinge", stiffness=7.0, damping=0.2, free_angle=0.1)
    mech.bushing("bushing", "ground", "bob.pin", stiffness=(1e3,) * 3 + (2.0,) * 3)
    sol = rom.simulate(mech, t_end=0.3, dt=1e-3)
    joint, turn = sol.joint("hinge"), sol.element("turn")
    torque = -7.0 * (joint.angle - 0.1) - 0.2 * joint.angle_rate
    assert_allclose(turn.along, torque, atol=1e-10)
    assert_allclose(turn.moment[:, 1, 2], torque, atol=1e-10)
    assert_allclose(turn.moment[:, 0, 2], -torque, atol=1e-10)
    assert turn.along_unit == "N m"
    turned = sol.element("bushing").moment[:, 1, 2]
    assert_allclose(turned, -2.0 * joint.angle, rtol=1e-2, atol=0.02)
    found = {" ".join(c.path[1:]): c for c in channels(sol)}
    assert_allclose(found["turn along"].values, torque, atol=1e-10)
    assert found["turn along"].unit == "N m"
    assert_allclose(found["bushing moment"].values[:, 2], turned, atol=1e-12)


def test_what_has_no_markers_is_refused():
    section = {"stretch": 1e6, "bend": 50.0, "mass": 0.1, "inertia": (1e-4, 1e-4, 2e-4)}
    mech, rod = held_rod(4, **section)
    mech.force("push", rod.marker("end"), (0.05, 0, 0))
    sol = rom.simulate(mech, t_end=2e-3, dt=1e-3)
    assert sol.elements == ("push",)
    refuses(rom.ConfigError, r"'rod' .* acts on whole bodies, not on markers", sol.element, "rod")
    refuses(rom.ConfigError, r"no element 'pull'; there are \['push', 'rod'\]", sol.element, "pull")
