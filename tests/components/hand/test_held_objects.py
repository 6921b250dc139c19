"""Bars and balls in a hand: balance at rest, Coulomb's limit, momenta, the table, bad input."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.refusals import refuses
from rom.components.hand import budgets, held_objects
from rom.components.hand.compliant_hand import HAND_SPRING, Finger, hand
from rom.components.hand.held_objects import SKIN_CONTACT, contact_forces, hold, table
from rom.components.hand.moving_hand import Build, Drive, Seat, moving_hand, one_finger, tip_marker
from rom.components.hand.winches import Motor, winches
from rom.errors import ConfigError

MM, g = 1e-3, 9.81
THREE = ("thumb", "index", "middle")
BAR = held_objects.Held((26 * MM, 20 * MM, 28 * MM), 20 * MM, 0.05, axis=(0, 1, 0), length=0.06)
BALL = held_objects.Held((26 * MM, 20 * MM, 28 * MM), 20 * MM, 0.05)
TIMES = {"t_end": 1.2, "dt": 1e-3, "rho_inf": 0.5}


def at_rest(mech):
    return rom.snapshot(mech, rom.equilibrium(mech))


def gripping(held, mu, gravity, leaves=None):
    law = replace(SKIN_CONTACT, mu=mu)
    drive = Drive(pull=lambda t: 12 * MM * np.sin(np.pi / 2 * min(t / 0.25, 1.0)) ** 2)
    fingers = {name: one for name, one in hand(n=2).items() if name in THREE}
    drives, build = dict.fromkeys(THREE, drive), Build(loss=0.02)
    mech = moving_hand(fingers, drives=drives, gravity=gravity, build=build)
    hold(mech, "thing", held, law=law)
    if leaves is not None:
        table(mech, "thing", held, leaves=leaves, speed=0.3, law=law)
    return rom.simulate(mech, **TIMES)


@cache
def upright(mu):
    """A bar that only friction keeps from falling along its axis, once the table is gone."""
    return gripping(BAR, mu, (0, -g, 0), leaves=0.3)


@cache
def lying():
    return gripping(BALL, 0.5, (0, 0, -g))


@pytest.mark.parametrize(("held", "up"), [(BAR, 1), (BALL, 2)], ids=["bar", "ball"])
def test_what_is_held_rests_by_the_balance_of_forces_and_moments(held, up):
    """No part of it by the change of momentum: it does not move any more."""
    sol = upright(0.8) if held is BAR else lying()
    forces = contact_forces(sol, "thing")
    assert set(forces) == set(held_objects.contacts_of(sol.mechanism, "thing"))
    grips, weight = sum(np.linalg.norm(f[-1]) for f in forces.values()), held.mass * g
    assert grips > 1.5 * weight
    assert_allclose(sum(forces.values())[-1], weight * np.eye(3)[up], atol=1e-8 * grips)
    moment = np.zeros(3)
    for key in forces:
        said = sol.element(key)
        arm = sol.position("thing", said.markers[1])[-1] - sol.position("thing")[-1]
        moment += said.moment[-1, 1] + np.cross(arm, said.force[-1, 1])
    assert_allclose(moment, 0.0, atol=1e-8 * grips * held.radius)
    assert_allclose(sol.velocity("thing")[-1], 0.0, atol=1e-8)


def test_a_grasp_is_an_equilibrium_whose_springs_hold_the_ball():
    sol = lying()
    found = rom.equilibrium(sol.mechanism, state=sol.final)
    assert_allclose(found.q, sol.q[-1], atol=1e-7)


def test_a_bar_slips_where_friction_is_below_its_weight_over_the_pressure():
    """All pressure is across the bar: it stays where mu times its sum exceeds the weight."""
    weight = BAR.mass * g
    across = [np.linalg.norm(f[-1][[0, 2]]) for f in contact_forces(upright(0.8), "thing").values()]
    limit = weight / sum(across)
    held, slips = upright(1.6 * limit), upright(0.7 * limit)
    lifted = sum(f[-1, 1] for f in contact_forces(held, "thing").values())
    assert_allclose(lifted, weight, rtol=0.01)
    fallen = [sol.position("thing")[-1, 1] - BAR.centre[1] for sol in (held, slips)]
    assert fallen[0] > -5 * MM and fallen[1] < -20 * MM


def test_a_hand_that_floats_keeps_its_momenta_while_it_grips():
    """Cables, springs and contacts act inside; the drives' work goes where it is booked."""
    fingers = {name: one for name, one in hand(friction=0.1, n=2).items() if name != "little"}
    drive = Drive(pull=lambda t: 11 * MM * np.sin(np.pi / 2 * min(t / 0.3, 1.0)) ** 2)
    mech = moving_hand(fingers, drives=dict.fromkeys(fingers, drive), held=False)
    hold(mech, "thing", BALL)
    sol = rom.simulate(mech, t_end=0.4, dt=2.5e-4, rho_inf=0.8)
    linear, angular = sol.momentum
    moved = BALL.mass * np.abs(sol.velocity("thing")).max()
    assert sum(f[-1] for f in held_objects.grip(sol, "thing", fingers).values()) > 0.3
    assert_allclose(linear, 0, atol=1e-6 * moved)
    assert_allclose(angular, 0, atol=1e-5 * moved * 0.05)
    assert_allclose(sol.energy.balance, 0, atol=1e-4 * sol.energy.drives[-1])


def test_a_table_goes_down_smoothly_and_things_stand_on_it():
    mech = moving_hand({"index": Finger(n=2)}, seats={"index": Seat()}, gravity=(0, 0, -g))
    held = replace(BALL, centre=(40 * MM, 0.0, 40 * MM))
    hold(mech, "thing", held)
    table(mech, "thing", held, leaves=0.1, speed=0.05)
    sol = rom.simulate(mech, t_end=0.4, dt=5e-4)
    z, v = sol.position("table")[:, 2], sol.velocity("table")[:, 2]
    assert_allclose(z[0], held.centre[2] - held.radius)
    assert_allclose(z[1:] - z[0], np.cumsum(0.5 * (v[1:] + v[:-1])) * 5e-4, atol=1e-8)
    assert_allclose(v[sol.t > 0.2], -0.05, rtol=1e-4)
    force = contact_forces(sol, "thing")["table on thing 1"][:, 2]
    assert_allclose(force[sol.t > 0.35].mean(), held.mass * g, rtol=0.02)


def test_springs_bear_the_cable_and_the_weight_that_hangs():
    """Straight finger, hanging: force along a spring = tension of the cable less what hangs."""
    slack = {"index": Drive(tension=0.0)}
    mech = moving_hand({"index": Finger(n=4)}, gravity=(0, 0, g), drives=slack)
    found = at_rest(mech)
    below = [part.mass for name, part in mech.parts.items() if name != "palm"]
    assert_allclose(budgets.spring_loads(found, "index", 1)[0][-1], sum(below) * g, rtol=1e-6)
    C = 10.0
    shear, bending = budgets.wire_stress(HAND_SPRING, 1.0, 0.01)
    assert_allclose(shear, (39 / 36 + 0.0615) * 8 * 7e-3 / (np.pi * 0.7e-3**3))
    assert_allclose(bending, (4 * C**2 - C - 1) / (4 * C * (C - 1)) * 0.32 / (np.pi * 0.7e-3**3))


def test_loads_across_the_tip_bend_the_last_spring_and_phalanx():
    """Lever arms of 18 mm to the far end of the spring, 10 mm to its plate; a twist bends not."""
    finger, F = Finger(n=4), 5e-3
    found = at_rest(one_finger(finger, 0.0, (0.0, F, 0.0)))
    assert_allclose(budgets.spring_loads(found, "finger", 3)[1][-1], F * 18 * MM, rtol=3e-3)
    stress = 4 * F * 10 * MM / (np.pi * (5 * MM) ** 3)
    assert_allclose(budgets.phalanx_stress(found, "finger", 3), stress, rtol=3e-3)
    mech = one_finger(finger)
    mech.torque("twist", tip_marker(mech, finger), (0.0, 0.0, 1e-4))
    assert budgets.spring_loads(at_rest(mech), "finger", 3)[1][-1] < 1e-7


def test_wire_is_judged_by_shares_of_its_strength():
    """Music wire of 0.7 mm: 2211 / 0.7^0.145 MPa; 45 % of it in shear, 75 % in bending."""
    strength = 2211e6 / 0.7**0.145
    found, fingers = at_rest(one_finger(Finger(n=2), 2.0)), {"finger": Finger(n=2)}
    rows = budgets.stress_budget(found, fingers, motor=3.0, bone=5e7).rows
    said = {row.quantity: row.limit for row in rows}
    for what, share in (("shear", 0.45), ("bending", 0.75)):
        limit = said[f"finger spring 1, {what} of the wire [Pa]"]
        assert_allclose(float(limit.removeprefix("<= ")), share * strength, rtol=1e-3)


def test_what_is_held_palm_and_phalanges_have_the_inertia_of_balls_cylinders_and_blocks():
    assert_allclose(BALL.inertia, 0.4 * 0.05 * 0.02**2 * np.eye(3))
    along, across = 0.5 * 0.05 * 0.02**2, 0.05 * (0.02**2 / 4 + 0.1**2 / 12)
    assert_allclose(BAR.inertia, np.diag([across, along, across]))
    mech = moving_hand({"index": Finger(n=2)}, build=Build(palm=0.12, palm_size=(0.06, 0.08, 0.02)))
    second = 0.01 * np.diag([0.06**2, 0.08**2, 0.02**2])  # integrals of rho x x^T
    assert_allclose(mech.parts["palm"].second, second, atol=1e-12)
    bone = mech.parts["index phalanx 1"]
    m, r, h = 1200 * np.pi * 25e-6 * 0.018, 5e-3, 0.018
    assert_allclose(bone.mass, m)
    assert_allclose(bone.second, m * np.diag([r * r / 4, r * r / 4, h * h / 12]), atol=1e-15)
    drives = {"index": Drive(pull=22 * MM)}
    refuses(ConfigError, r"0 to 0\.0216 m", moving_hand, {"index": Finger(n=2)}, drives=drives)


@pytest.mark.parametrize("axis", [(0, 1, 0), (0, -1, 0)])
def test_a_bar_stands_on_its_lower_end_whichever_way_it_is_named(axis):
    held, mech = replace(BAR, axis=axis), moving_hand({"index": Finger(n=2)}, gravity=(0, -g, 0))
    hold(mech, "thing", held)
    table(mech, "thing", held, leaves=1.0)
    assert_allclose(mech.parts["table"].at, np.array(held.centre) - (0, 50 * MM, 0), atol=1e-12)
    feet = [mech.design_point(mech.contacts[f"table on thing {k}"].j) for k in (1, 2, 3)]
    assert_allclose(np.array(feet)[:, 1], held.centre[1] - 49 * MM)
    assert_allclose(np.mean(feet, axis=0)[[0, 2]], np.array(held.centre)[[0, 2]])


def test_budgets_add_up_and_say_what_is_too_much():
    finger, drives = Finger(n=4), {"index": Drive(tension=2.0)}
    mech = moving_hand({"index": finger}, drives=drives, build=Build(palm=0.1))
    mass = budgets.mass_budget(mech, most=0.1)
    bones = 1200 * np.pi * 5e-3**2 * 0.04
    wire = 3 * 7850 * np.pi / 4 * 0.7e-3**2 * np.hypot(np.pi * 7e-3 * 5, 8e-3)
    assert_allclose(mass.rows[-1].value, 0.1 + bones + wire + 1.6e-3 * 0.054, rtol=2e-3)
    assert not mass.ok and budgets.mass_budget(mech, most=0.11).ok
    stress = budgets.stress_budget(at_rest(mech), {"index": finger}, motor=1.9, bone=50e6)
    assert [row.quantity for row in stress.rows if not row.ok] == ["index motor [N]"]
    assert_allclose(stress.rows[-1].value, 2.0, rtol=1e-9)


def test_motors_follow_at_their_speed_and_with_their_lag():
    dt, motor = 1e-3, Motor(rate=0.04, lag=0.02)
    reached = motor.follow(np.repeat([[0.0], [1e-4], [0.02]], [1, 99, 900], axis=0), dt)[:, 0]
    assert_allclose(reached[20], 1e-4 * (1 - (1 - dt / 0.02) ** 20))  # a lag, step by step
    assert_allclose(np.diff(reached[100:500]).max(), 0.04 * dt)
    assert_allclose(reached[-1], 0.02, rtol=1e-6)
    drives = winches(np.column_stack([reached] * 5), dt)
    assert_allclose([one.pull(5.0) for one in drives.values()], 0.02, rtol=1e-6)


def test_what_cannot_be_held_is_named():
    mech = moving_hand({"index": Finger(n=2)}, seats={"index": Seat()})
    for centre, words in (
        ((20 * MM, 0.0, 42 * MM), r"'ball' reaches 5 mm into 'index phalanx 2'"),
        ((26 * MM, 0.0, 15 * MM), r"'ball' reaches 5 mm into 'palm'"),
        ((0.2, 0.0, 0.03), r"'ball' is 118 mm beyond the reach"),
    ):
        refuses(ConfigError, words, hold, mech, "ball", replace(BALL, centre=centre))
    refuses(ConfigError, "nothing holds 'ball'", lambda: hold(rom.Mechanism(), "ball", BALL))
    refuses(ConfigError, "'ball' on a table needs gravity", table, mech, "ball", BALL, leaves=1.0)
    refuses(ConfigError, r"shape \(10, 4\), needed is \(n, 5\)", winches, np.zeros((10, 4)), 1e-3)
