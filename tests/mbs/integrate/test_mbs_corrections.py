"""Steps in which whole corrections of Newton go round in a circle, against closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from benchmarks.units import as_mechanism
from cases.gear_unit import rigid_unit
from cases.long import few
from cases.mbs.parts import ORIGIN, on_axle, on_guide

METHODS = ("generalized-alpha", "bdf")
MU, SPEED, g = 0.3, 0.35, 9.81


def block(mass=1.0, speed=SPEED):
    mech, moving = rom.Mechanism(gravity=(0, 0, -g)), (speed, 0, 0)
    on_guide(mech, "block", mass=mass, velocity=moving)
    return mech


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("mass", [1.0, 1e-3])
@pytest.mark.parametrize("transition", [1e-3, 1e-7])
def test_friction_stops_a_block_in_steps_longer_than_its_speed_turns_in(method, mass, transition):
    """At v^2 / (2 mu g), after v / (mu g); and does not go back."""
    mech, h = block(mass), 1e-2
    mech.friction("shoes", "guide", mu=MU, transition_speed=transition)
    sol = rom.simulate(mech, t_end=0.3, dt=h, method=method, rho_inf=0.6)
    x, v = sol.position("block")[:, 0], sol.velocity("block")[:, 0]
    assert_allclose(x[-1], SPEED**2 / (2 * MU * g), atol=MU * g * h**2)
    slides = sol.t < SPEED / (MU * g)
    assert_allclose(v[slides], SPEED - MU * g * sol.t[slides], atol=transition + 1e-9)
    assert np.abs(v[-5:]).max() < max(10 * transition, 1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_steep_motor_is_found_at_the_speed_at_which_it_balances_a_load(method):
    mech, steep, load = block(), 1e6, 2.0
    mech.motor("motor", "guide", lambda t, x, v: -5.0 * np.tanh(steep * v), compiled=True)
    mech.force("load", "block", (load, 0, 0))
    sol = rom.simulate(mech, t_end=0.5, dt=2e-2, method=method, rho_inf=0.0)
    wanted = np.arctanh(load / 5.0) / steep
    assert sol.velocity("block")[-1, 0] == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_a_light_rotor_is_led_against_a_torque_that_grows_with_speed_faster_than_inertia(method):
    """Torque of the drive is I alpha - c omega."""
    mech, inertia, c = rom.Mechanism(gravity=ORIGIN), 1e-4, 1.0
    on_axle(mech, "rotor", inertia=(inertia,) * 3, axle="shaft")
    mech.motor("machine", "shaft", lambda t, x, v: c * v, compiled=True)
    mech.drive("brake", "shaft", np.sin, rate=np.cos, acceleration=lambda t: -np.sin(t))
    sol = rom.simulate(mech, t_end=1.0, dt=1e-2, method=method)
    torque = -inertia * np.sin(sol.t) - c * np.cos(sol.t)
    assert_allclose(sol.drive_load("brake")[1:], torque[1:], rtol=1e-3)


def test_laws_in_python_are_asked_again_for_every_part_of_a_correction():
    """A brake that is asked for a constant force stops the block together with friction."""
    mech, h, brake = block(), 1e-2, 1.5
    mech.friction("shoes", "guide", mu=MU, transition_speed=1e-5)
    mech.motor("brake", "guide", lambda t, x, v: -brake, compiled=False)
    sol = rom.simulate(mech, t_end=0.3, dt=h, rho_inf=0.6)
    a = MU * g + brake
    assert sol.position("block")[-1, 0] == pytest.approx(SPEED**2 / (2 * a), abs=a * h**2)


@pytest.mark.parametrize(("k", "restitution", "h"), [
    (1e6, 0.2, 1e-2), (1e8, 0.2, 1e-2), (1e8, 0.7, 1e-2), (1e8, 0.4, 1e-3)])  # fmt: skip
def test_a_block_that_strikes_a_stop_in_long_steps_comes_to_rest_on_it(k, restitution, h):
    """Where a constant load and the stop balance: F = k d."""
    mech, load = block(0.01, 0.3), 0.2
    law = rom.mbs.Impact(k, 1.0, restitution=restitution, impact_speed=0.3)
    mech.stop("stop", "guide", law, lower=-1e-3, upper=1e-3)
    mech.force("load", "block", (load, 0, 0))
    sol = rom.simulate(mech, t_end=1.0, dt=h, rho_inf=0.0)
    depth = sol.position("block")[-1, 0] - 1e-3
    assert depth == pytest.approx(load / k, rel=1e-6)


@pytest.mark.parametrize(("rpm", "steps"), few(1, [(300, 110), (500, 80), (725, 50)]))
def test_teeth_and_films_are_stepped_through_at_speeds_where_teeth_leave(rpm, steps):
    unit = rigid_unit(speed=rpm * np.pi / 30)
    mech, T = as_mechanism(unit), unit.mesh_period
    sol = rom.simulate(mech, state=rom.equilibrium(mech), t_end=12 * T, dt=T / steps, rho_inf=0.6)
    teeth = np.array([x.force.sum() for x in rom.mbs.tooth_loads(sol, "mesh")])
    assert teeth[4 * steps :].mean() == pytest.approx(unit.torque / unit.mesh.pair.rb[1], rel=0.02)


def test_a_force_that_jumps_has_no_balance_and_is_refused_before_the_last_correction():
    mech = block()
    mech.motor("motor", "guide", lambda t, x, v: -5.0 * np.sign(v), compiled=True)
    with pytest.raises(rom.SolverError, match=r"did not converge in [34]\d corrections") as caught:
        rom.simulate(mech, t_end=1.0, dt=1e-2)
    assert caught.value.solution.t[-1] == pytest.approx(SPEED / 5.0, abs=1.1e-2)
