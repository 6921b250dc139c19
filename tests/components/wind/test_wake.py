"""The wake with its memory and the controller inside a mechanism, beside the rigid rotor's."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.stiff_blades import on_driven_hub, same_strips, stiff_body
from cases.refusals import refuses
from rom import rotation
from rom.components.wind import whole_turbine
from rom.components.wind.blading import rotor_load
from rom.components.wind.control import Controller, generator_torque, steady
from rom.components.wind.operation import operate
from rom.components.wind.wake import in_late_wind
from rom.components.wind.whole_turbine import N_BLADES, PITCH_STIFFNESS, turbine
from rom.components.wind.wind_turbine import ramp
from rom.errors import ConfigError

SPEED = 1.0  # rad/s


def turning_blade(winds, yaw=0.0, n=8):
    mech, body = rom.Mechanism(gravity=(0, 0, 0)), stiff_body(n)
    A = rotation.matrix(rotation.exp([0.0, 0.0, -yaw]))
    part = mech.add_nonlinear("blade", body, orientation=A, omega=(SPEED, 0.0, 0.0))
    on_driven_hub(mech, part, SPEED, A[:, 0])
    in_late_wind(mech, part, winds, axis=A[:, 0], cone=0.0)
    return mech, same_strips(body)


def test_a_stiff_blade_in_a_gust_has_the_loads_and_the_memory_of_the_rotor_whose_wake_is_late():
    """By `operate`: 3 % of the change apart; 1.1 R / (1 - 1.3 a) / V by the law of each strip."""
    winds = [[0.0, 7.0], [3.0, 7.0], [3.0 + 1e-9, 9.0], [40.0, 9.0]]
    mech, rotor = turning_blade(winds)
    sol = rom.simulate(mech, t_end=12.0, dt=0.02, rho_inf=0.3)
    how = {"dt": 0.02, "blades": rotor, "held": lambda t: (SPEED, 0.0)}
    beside = operate(lambda t: 7.0 if t <= 3.0 else 9.0, 12.0, **how)
    torque, thrust = -N_BLADES * sol.drive_load("speed"), N_BLADES * -sol.reaction("shaft")[:, 0]
    for found, expected in ((torque, beside.torque), (thrust, beside.thrust)):
        size = np.abs(expected[-1] - expected[100])
        calm = (sol.t > 1.5) & ((sol.t < 2.9) | (sol.t > 4.0))  # the rod swings a little
        assert_allclose(np.abs(found[calm]), expected[calm], atol=0.03 * size)
    quick = rotor_load(rotor, 9.0, SPEED)
    at = np.searchsorted(sol.t, 3.6)
    assert torque[at] > quick.torque + 0.02 * (quick.torque - beside.torque[100])  # overshoots
    rows = [rotor_load(rotor, v, SPEED, n_azimuths=1).strip[0] for v in (7.0, 9.0)]
    before, after = (v - row[:, 2] for v, row in zip((7.0, 9.0), rows, strict=True))
    t = sol.t[sol.t > 3.0] - 3.0 + 0.01
    for k in (4, 6):
        memory = sol.law(f"blade strip {k}").memory[sol.t > 3.0]
        slow = 1.1 / (1 - 1.3 * after[k] / 9.0) * 63.0 / 9.0
        fast = (0.39 - 0.26 * (rotor.radius[k] / 63.0) ** 2) * slow
        first, second = np.exp(-t / slow), np.exp(-t / fast)
        share = 1 - second - 0.4 * slow / (slow - fast) * (first - second)
        exact, size = before[k] + (after[k] - before[k]) * share, abs(after[k] - before[k])
        assert_allclose(memory[:, 2], exact, atol=0.02 * size)
        assert_allclose(memory[:, 6], sol.t[sol.t > 3.0])


def test_a_late_wake_leans_in_wind_from_aside():
    """Forces of strips from what they remember, by tables; means are about those at once."""
    yaw, V = 0.6, 9.0
    mech, rotor = turning_blade(V, yaw)
    sol = rom.simulate(mech, t_end=14.0, dt=0.02, rho_inf=0.3)
    load, last = rotor_load(rotor, V, SPEED, yaw=yaw), sol.t > 14.0 - 2 * np.pi / SPEED
    psi, axial = SPEED * sol.t[last], V * np.cos(yaw)
    assert_allclose(-N_BLADES * sol.drive_load("speed")[last].mean(), load.torque, rtol=0.03)
    for k in (3, 5, 7):
        said, r, one = sol.law(f"blade strip {k}"), rotor.radius[k], rotor.profile[k]
        lost, swirl = said.memory[last][:, [2, 5]].T
        chi = (1 + 0.6 * lost / axial) * yaw
        through = axial - lost * (1 - np.tan(chi / 2) * r / 63.0 * np.sin(psi))
        across = SPEED * r + V * np.sin(yaw) * np.cos(psi) + swirl
        attack = np.arctan2(through, across) - rotor.twist[k]
        lift, drag = (np.interp(attack, one.angle, x) for x in (one.lift, one.drag))
        q = 0.6125 * rotor.chord[k] * rotor.length[k] * np.hypot(through, across)
        normal, driving = q * (lift * across + drag * through), q * (lift * through - drag * across)
        found, expected = np.linalg.norm(said.force[last][:, 0], axis=1), np.hypot(normal, driving)
        assert_allclose(found, expected, atol=0.01 * np.ptp(normal))


def test_the_first_instant_and_equilibria_have_the_steady_wake():
    mech, rotor = turning_blade(8.0)
    sol = rom.simulate(mech, t_end=3.0, dt=0.02, rho_inf=0.3)
    steady_wake = 8.0 - rotor_load(rotor, 8.0, SPEED, n_azimuths=1).strip[0, :, 2]
    memory = np.array([sol.law(f"blade strip {k}").memory[-1] for k in range(1, 8)])
    assert_allclose(memory[:, 2], steady_wake[1:8], rtol=1e-3)
    assert_allclose(memory[:, 0], memory[:, 2], rtol=1e-3)
    assert rom.check_law(mech, "blade strip 5").ok


@pytest.mark.long
def test_a_controlled_turbine_rides_through_a_gust_as_the_rigid_rotor_does():
    """A rigid tower, 15 m/s and then 17; beside `operate`, which knows no bending."""
    point = steady(15.0, tower=True)
    how = {"wind": [[0.0, 15.0], [10.0, 15.0], [12.0, 17.0]], "late_wake": True, "controlled": True}
    plant = turbine(6, tower_segments=0, pitch=point.pitch, speed=point.speed, **how)
    sol = rom.simulate(plant.mechanism, t_end=36.0, dt=0.02, rho_inf=0.5)
    beside = operate(lambda t: float(np.interp(t, [10.0, 12.0], [15.0, 17.0])), 36.0, dt=0.02)
    speed, said = sol.omega("wheel") @ plant.axis, sol.law("control").outputs
    late = sol.t > 11.0
    assert_allclose(speed[late].max() - 1.26711, beside.speed[late].max() - 1.26711, rtol=0.15)
    end = sol.t > 30.0
    assert_allclose(said["pitch"][end].mean(), beside.pitch[end].mean(), atol=np.radians(0.5))
    power = said["torque"] * whole_turbine.GEAR_RATIO * speed
    assert_allclose(power[late].mean(), 5.29661e6, rtol=0.01)
    assert rom.audit(sol).ok


def parked(**choices):
    return turbine(2, tower_segments=0, gravity=0.0, damped=True, controlled=True, **choices)


def test_the_control_in_a_mechanism_is_the_controller_at_its_speed():
    plant, dt = parked(speed=0.0), 0.02
    speed, angle = ramp(1.4, 10.0)
    plant.turn_by(angle, speed)
    sol = rom.simulate(plant.mechanism, t_end=12.0, dt=dt, rho_inf=0.5)
    fast = (sol.omega("generator") - sol.omega("nacelle")) @ plant.axis
    one, found = Controller.at(0.0), sol.law("control").outputs
    pitch, torque = [], []
    for k, x in enumerate(fast):
        if k > 1:
            one.step(x, dt)
        pitch.append(one.pitch)
        torque.append(one.torque)
    assert max(pitch) > np.radians(2.0)
    assert_allclose(found["pitch"][1:], pitch[1:], atol=1e-3 * max(pitch))
    assert_allclose(found["torque"][1:], torque[1:], atol=1e-3 * max(torque))
    # blades follow on their bearings, turned about their axes against the third one
    for k, each in enumerate(plant.blades):
        A, B = (np.array([rotation.matrix(p) for p in sol.orientation(x)])
                for x in ("hub", each.parts[0].name))  # fmt: skip
        seen = np.einsum("tji,tjk->tik", A, B)
        turned = np.einsum("ji,tjk->tik", seen[0], seen)
        angles = np.arctan2(-turned[:, 1, 0], turned[:, 0, 0])
        assert_allclose(angles, found["pitch"], atol=np.radians(0.02))
        # by spring and damper, about the axis of the bearing
        apart = sol.omega(each.parts[0].name) - np.einsum("tji,tj->ti", seen, sol.omega("hub"))
        spring = PITCH_STIFFNESS * (found["pitch"] - angles)
        damper = whole_turbine.PITCH_DAMPING * apart[:, 2]
        acts = np.einsum("ti,ti->t", sol.law("control").moment[:, 3 + 2 * k], B[:, :, 2])
        assert np.abs(damper).max() > 1e4
        assert_allclose(acts[1:], -(spring + damper)[1:], atol=10.0)


def test_the_generator_is_braked_against_the_nacelle():
    plant = parked(speed=1.0)
    sol = rom.simulate(plant.mechanism, t_end=0.2, dt=0.02, rho_inf=0.5)
    said = sol.law("control")
    assert_allclose(said.moment.sum(axis=1), 0.0, atol=1e-6 * np.abs(said.moment).max())
    braked = said.moment[:, 1] @ plant.axis
    assert_allclose(braked[1:], -said.outputs["torque"][1:], rtol=1e-7)
    assert_allclose(braked[1], -generator_torque(whole_turbine.GEAR_RATIO * 1.0), rtol=1e-3)
    assert_allclose(said.moment[:, 0] @ plant.axis, -braked, rtol=1e-9)


def test_the_actuator_is_that_of_the_report():
    """30 Hz and two percent of critical damping belong to one inertia, about that of a blade."""
    inertia = PITCH_STIFFNESS / (2 * np.pi * 30.0) ** 2
    damping = 2 * 0.02 * np.sqrt(PITCH_STIFFNESS * inertia)
    assert_allclose(whole_turbine.PITCH_DAMPING, damping, rtol=2e-3)


@pytest.mark.parametrize(
    ("said", "wind", "choices"),
    [
        ("instants of a wind must ascend", [[0.0, 8.0], [0.0, 9.0]], {}),
        ("finite", [[0.0, np.nan]], {}),
        ("wind", lambda t: 8.0, {}),
        ("neither a speed", [8.0, 9.0], {}),
        ("neither a speed", np.zeros((0, 2)), {}),
        ("must not be negative", -8.0, {}),
        ("no controller works in a wind of 26 m/s", 26.0, {"controlled": True}),
        ("in a wind of 26 m/s", [[0.0, 8.0], [9.0, 26.0]], {"controlled": True}),
        ("meets a late wake", [[0.0, 8.0], [1.0, 9.0]], {"late_wake": False}),
    ],
)
def test_a_wind_that_cannot_be_is_named(said, wind, choices):
    refuses(ConfigError, said, turbine, 2, wind=wind, **{"late_wake": True} | choices)
