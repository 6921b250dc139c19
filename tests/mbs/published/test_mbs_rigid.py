"""Rigid bodies, springs, drives and loads against closed forms."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ellipj

from cases.mbs.motions import TOP, heavy_top
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism


def test_heavy_top_follows_eulers_equations_about_its_fixed_point():
    sol = simulate(heavy_top(), t_end=0.5, dt=0.1, method="dop853")
    for time, position in TOP["positions"].items():
        k = round(float(time) / 0.1)
        assert_allclose(sol.position("top")[k], position, atol=6e-8 if k == 5 else 1e-8)


def free_body(omega):
    mech = Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("body", mass=1.0, inertia=(1.0, 2.0, 2.9999999), at=(0, 0, 0), omega=omega)
    return mech


def test_torque_free_top_equals_jacobis_elliptic_functions():
    """Landau and Lifshitz, Mechanics, section 37; moments 1, 2, 2.9999999, omega2(0) = 0."""
    I1, I2, I3 = 1.0, 2.0, 2.9999999
    energy, momentum = I1 + I3, I1**2 + I3**2
    tau = np.sqrt((I3 - I2) * (momentum - energy * I1) / (I1 * I2 * I3))
    k2 = (I2 - I1) * (energy * I3 - momentum) / ((I3 - I2) * (momentum - energy * I1))
    sol = simulate(free_body((1, 0, 1)), t_end=20.0, dt=0.1, method="dop853")
    sn, cn, dn, _ = ellipj(tau * sol.t, k2)
    a = np.sqrt((energy * I3 - momentum) / (I1 * (I3 - I1)))
    b = np.sqrt((energy * I3 - momentum) / (I2 * (I3 - I2)))
    c = np.sqrt((momentum - energy * I1) / (I3 * (I3 - I1)))
    assert_allclose(sol.omega("body"), np.column_stack([a * cn, b * sn, c * dn]), atol=1e-8)


def test_tumbling_about_the_middle_axis_has_the_period_of_the_elliptic_integral():
    """Moments 1, 2, 3 and omega = (0.01, 1, 0.01): period 39.1057 s, turning at 10.916 s."""
    sol = simulate(free_body((0.01, 1, 0.01)), t_end=55.0, dt=0.002, rho_inf=1.0)
    middle = sol.omega("body")[:, 1]
    k = np.flatnonzero(np.diff(np.sign(middle)))
    turning = sol.t[k] - middle[k] * 0.002 / (middle[k + 1] - middle[k])
    assert_allclose(turning, [10.916, 30.469, 50.022], atol=2e-3)
    assert_allclose(turning[2] - turning[0], 39.1057342, atol=2e-3)


def oscillator(method, **options):
    mech = Mechanism(gravity=(0, 0, -9.81))
    box = mech.add_rigid("box", mass=2.0, inertia=(1, 1, 1), at=(0, 0, 0.3))
    ceiling = mech.ground.marker((0, 0, 1))
    mech.prismatic("guide", ceiling, box.marker((0, 0, 0)), axis=(0, 0, 1))
    mech.spring_damper(
        "spring", ceiling, box.marker((0, 0, 0)), stiffness=200.0, damping=4.0, free_length=0.5
    )
    return simulate(mech, t_end=2.0, method=method, **options)


@pytest.mark.parametrize(
    ("method", "dt", "tolerance"), [("dop853", 0.01, 1e-11), ("generalized-alpha", 1e-4, 1e-6)]
)
def test_spring_and_damper_give_the_damped_oscillator(method, dt, tolerance):
    """m x'' + c x' + k (x - rest) = 0 below a ceiling, free length 0.5 m, started 0.7 m below."""
    sol = oscillator(method, dt=dt)
    rest = 0.5 + 2.0 * 9.81 / 200.0
    delta, omega = 1.0, np.sqrt(100.0 - 1.0)
    x = rest + (0.7 - rest) * np.exp(-delta * sol.t) * (
        np.cos(omega * sol.t) + delta / omega * np.sin(omega * sol.t)
    )
    assert_allclose(1.0 - sol.position("box")[:, 2], x, atol=tolerance)
    assert np.abs(sol.energy.balance).max() < 1e-5
    assert sol.energy.damping[-1] > 0.1


def wheel(**coil):
    mech = Mechanism(gravity=(0, 0, 0))
    body = mech.add_rigid("wheel", mass=1.0, inertia=(1, 1, 0.5), at=(0, 0, 0))
    mech.revolute("axle", mech.ground.marker((0, 0, 0)), body.marker((0, 0, 0)), axis=(0, 0, 1))
    if coil:
        mech.rotational_spring("coil", "axle", **coil)
    return mech, body


@pytest.mark.parametrize("method", ["dop853", "generalized-alpha"])
def test_a_coil_wound_by_several_turns_unwinds_as_a_harmonic_motion(method):
    """The angle of the spring is counted over whole turns: 0.5 phi'' + 2 (phi - 20) = 0."""
    mech, _ = wheel(stiffness=2.0, free_angle=20.0)
    sol = simulate(mech, t_end=5.0, dt=1e-3, method=method, rho_inf=1.0)
    p = sol.orientation("wheel")
    phi = np.unwrap(2 * np.arctan2(p[:, 3], p[:, 0]), period=4 * np.pi)
    assert_allclose(phi, 20.0 * (1 - np.cos(2 * sol.t)), atol=1e-9 if method == "dop853" else 1e-3)
    assert np.abs(sol.energy.balance).max() < 1e-5 * sol.energy.strain.max()


@pytest.mark.parametrize(("dt", "lost"), [(0.01, False), (0.02, True)])
def test_turns_that_a_step_cannot_count_are_told(dt, lost):
    """Two hundred rad/s are two or four rad a step; half a turn is the limit."""
    mech = Mechanism(gravity=(0, 0, 0))
    body = mech.add_rigid("wheel", mass=1.0, inertia=(1, 1, 0.5), at=(0, 0, 0), omega=(0, 0, 200))
    mech.revolute("axle", mech.ground.marker((0, 0, 0)), body.marker((0, 0, 0)), axis=(0, 0, 1))
    mech.motor("drag", "axle", lambda t, x, v: -1e-6 * x)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        simulate(mech, t_end=0.2, dt=dt)
    told = [str(w.message) for w in caught if "rad a step" in str(w.message)]
    assert bool(told) == lost
    if lost:
        assert "body 'wheel' turned by 4 rad a step against 'ground'" in told[0]
        assert "below 0.0157 s" in told[0]


@pytest.mark.parametrize("kind", ["world", "body", "function"])
def test_torque_turns_a_wheel(kind):
    mech, body = wheel()
    vector = (lambda t: (0, 0, 0.3 * t)) if kind == "function" else (0, 0, 0.3)
    frame = "body" if kind == "body" else "world"
    mech.torque("motor", body.marker((0, 0, 0)), vector, frame=frame)
    sol = simulate(mech, t_end=2.0, dt=1e-3)
    exact = 0.3 * sol.t**2 if kind == "function" else 0.6 * sol.t
    assert_allclose(sol.omega("wheel")[:, 2], exact, atol=1e-6)
    assert np.abs(sol.energy.balance).max() < 1e-5


def test_force_at_a_marker_acts_with_its_lever():
    """A follower force at distance one on a wheel: the torque is constant."""
    mech, body = wheel()
    mech.force("jet", body.marker((1, 0, 0)), (0, 0.3, 0), frame="body")
    sol = simulate(mech, t_end=2.0, dt=1e-3)
    assert_allclose(sol.omega("wheel")[:, 2], 0.6 * sol.t, atol=1e-8)


@pytest.mark.parametrize("given", [True, False])
def test_drive_of_a_wheel_needs_the_torque_of_its_inertia(given):
    """Angle t - sin t: torque 0.5 sin t; derivatives given or by differences."""
    mech, _ = wheel()
    more = {"rate": lambda t: 1 - np.cos(t), "acceleration": np.sin} if given else {}
    mech.drive("motor", "axle", lambda t: t - np.sin(t), **more)
    for method, tolerance in (("dop853", 1e-7), ("generalized-alpha", 1e-5)):
        sol = simulate(mech, t_end=2.0, dt=1e-3, method=method)
        assert_allclose(sol.reaction("motor")[:, 5], 0.5 * np.sin(sol.t), atol=tolerance)
        p = sol.orientation("wheel")
        assert_allclose(2 * np.arctan2(p[:, 3], p[:, 0]), sol.t - np.sin(sol.t), atol=1e-7)


def test_drive_of_a_slide_counts_from_the_start():
    mech = Mechanism(gravity=(0, 0, 0))
    box = mech.add_rigid("box", mass=2.0, inertia=(1, 1, 1), at=(0.3, 0, 0))
    mech.prismatic("slide", mech.ground.marker((0, 0, 0)), box.marker((0, 0, 0)), axis=(1, 0, 0))
    mech.drive("jack", "slide", lambda t: 0.1 * t**2)
    sol = simulate(mech, t_end=1.0, dt=1e-3)
    assert_allclose(sol.position("box")[:, 0], 0.3 + 0.1 * sol.t**2, atol=1e-12)
    assert_allclose(sol.reaction("jack")[5:, 0], 0.4, atol=1e-4)


def test_physical_pendulum_reaction_at_the_lowest_point():
    """A bar released level: the hinge carries (1 + 3/2) m g when it passes below."""
    mech = Mechanism(gravity=(0, -9.81, 0))
    bar = mech.add_rigid("bar", mass=2.0, inertia=(1e-3, 1 / 6, 1 / 6), at=(0.5, 0, 0))
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), bar.marker((-0.5, 0, 0)), axis=(0, 0, 1))
    sol = simulate(mech, t_end=1.0, dt=1e-4)
    lowest = np.argmin(sol.position("bar")[:, 1])
    assert_allclose(sol.reaction("hinge")[lowest, 1], 2.5 * 2.0 * 9.81, rtol=1e-5)
