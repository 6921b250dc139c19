"""Rigid bodies, springs, drives, loads and spinning bars against closed forms."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipj

import rom
from cases.mbs.motions import TOP, heavy_top
from cases.mbs.parts import X, Z, on_axle, on_guide, on_hinge
from cases.mbs.trusses import HUB_INERTIA, MASS, REST, SPRING, dumbbell
from rom import rotation

AXIS = np.array([2.0, -1.0, 2.0]) / 3


def test_heavy_top_follows_eulers_equations_about_its_fixed_point():
    sol = rom.simulate(heavy_top(), t_end=0.5, dt=0.1, method="dop853")
    for time, position in TOP["positions"].items():
        k = round(float(time) / 0.1)
        assert_allclose(sol.position("top")[k], position, atol=6e-8 if k == 5 else 1e-8)


def free_body(omega):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("body", mass=1.0, inertia=(1.0, 2.0, 2.9999999), at=(0, 0, 0), omega=omega)
    return mech


def test_torque_free_top_equals_jacobis_elliptic_functions():
    """Landau and Lifshitz, Mechanics, section 37; moments 1, 2, 2.9999999, omega2(0) = 0."""
    I1, I2, I3 = 1.0, 2.0, 2.9999999
    energy, momentum = I1 + I3, I1**2 + I3**2
    tau = np.sqrt((I3 - I2) * (momentum - energy * I1) / (I1 * I2 * I3))
    k2 = (I2 - I1) * (energy * I3 - momentum) / ((I3 - I2) * (momentum - energy * I1))
    sol = rom.simulate(free_body((1, 0, 1)), t_end=20.0, dt=0.1, method="dop853")
    sn, cn, dn, _ = ellipj(tau * sol.t, k2)
    a = np.sqrt((energy * I3 - momentum) / (I1 * (I3 - I1)))
    b = np.sqrt((energy * I3 - momentum) / (I2 * (I3 - I2)))
    c = np.sqrt((momentum - energy * I1) / (I3 * (I3 - I1)))
    assert_allclose(sol.omega("body"), np.column_stack([a * cn, b * sn, c * dn]), atol=1e-8)


def test_tumbling_about_the_middle_axis_has_the_period_of_the_elliptic_integral():
    """Moments 1, 2, 3 and omega = (0.01, 1, 0.01): period 39.1057 s, turning at 10.916 s."""
    sol = rom.simulate(free_body((0.01, 1, 0.01)), t_end=55.0, dt=0.002, rho_inf=1.0)
    middle = sol.omega("body")[:, 1]
    k = np.flatnonzero(np.diff(np.sign(middle)))
    turning = sol.t[k] - middle[k] * 0.002 / (middle[k + 1] - middle[k])
    assert_allclose(turning, [10.916, 30.469, 50.022], atol=2e-3)
    assert_allclose(turning[2] - turning[0], 39.1057342, atol=2e-3)


@pytest.mark.parametrize(
    ("method", "dt", "tolerance"), [("dop853", 0.01, 1e-11), ("generalized-alpha", 1e-4, 1e-6)]
)
def test_spring_and_damper_give_the_damped_oscillator(method, dt, tolerance):
    """m x'' + c x' + k (x - rest) = 0 below a ceiling, free length 0.5 m, started 0.7 m below."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    ceiling = mech.ground.marker((0, 0, 1))
    box = on_guide(mech, "box", mass=2.0, at=(0, 0, 0.3), axis=(0, 0, 1), base=ceiling)
    mech.spring_damper("spring", ceiling, box, stiffness=200.0, damping=4.0, free_length=0.5)
    sol = rom.simulate(mech, t_end=2.0, method=method, dt=dt)
    rest = 0.5 + 2.0 * 9.81 / 200.0
    delta, omega = 1.0, np.sqrt(100.0 - 1.0)
    swing = np.cos(omega * sol.t) + delta / omega * np.sin(omega * sol.t)
    x = rest + (0.7 - rest) * np.exp(-delta * sol.t) * swing
    assert_allclose(1.0 - sol.position("box")[:, 2], x, atol=tolerance)
    assert np.abs(sol.energy.balance).max() < 1e-5
    assert sol.energy.damping[-1] > 0.1


def wheel(**coil):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    centre = on_axle(mech)
    if coil:
        mech.rotational_spring("coil", "axle", **coil)
    return mech, centre


@pytest.mark.parametrize("method", ["dop853", "generalized-alpha"])
def test_a_coil_wound_by_several_turns_unwinds_as_a_harmonic_motion(method):
    """The angle of the spring is counted over whole turns: 0.5 phi'' + 2 (phi - 20) = 0."""
    mech, _ = wheel(stiffness=2.0, free_angle=20.0)
    sol = rom.simulate(mech, t_end=5.0, dt=1e-3, method=method, rho_inf=1.0)
    p = sol.orientation("wheel")
    phi = np.unwrap(2 * np.arctan2(p[:, 3], p[:, 0]), period=4 * np.pi)
    assert_allclose(phi, 20.0 * (1 - np.cos(2 * sol.t)), atol=1e-9 if method == "dop853" else 1e-3)
    assert np.abs(sol.energy.balance).max() < 1e-5 * sol.energy.strain.max()


@pytest.mark.parametrize(("dt", "lost"), [(0.01, False), (0.02, True)])
def test_turns_that_a_step_cannot_count_are_told(dt, lost):
    """Two hundred rad/s are two or four rad a step; half a turn is the limit."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    on_axle(mech, omega=(0, 0, 200))
    mech.motor("drag", "axle", lambda t, x, v: -1e-6 * x)
    with warnings.catch_warnings(record=True, action="always") as caught:
        rom.simulate(mech, t_end=0.2, dt=dt)
    told = [str(w.message) for w in caught if "rad a step" in str(w.message)]
    assert bool(told) == lost
    if lost:
        assert "body 'wheel' turned by 4 rad a step against 'ground'" in told[0]
        assert "below 0.0157 s" in told[0]


@pytest.mark.parametrize("kind", ["world", "body", "function"])
def test_torque_turns_a_wheel(kind):
    mech, centre = wheel()
    vector = (lambda t: (0, 0, 0.3 * t)) if kind == "function" else (0, 0, 0.3)
    frame = "body" if kind == "body" else "world"
    mech.torque("motor", centre, vector, frame=frame)
    sol = rom.simulate(mech, t_end=2.0, dt=1e-3)
    exact = 0.3 * sol.t**2 if kind == "function" else 0.6 * sol.t
    assert_allclose(sol.omega("wheel")[:, 2], exact, atol=1e-6)
    assert np.abs(sol.energy.balance).max() < 1e-5


def test_force_at_a_marker_acts_with_its_lever():
    """A follower force at distance one on a wheel: the torque is constant."""
    mech, _ = wheel()
    mech.force("jet", mech.parts["wheel"].marker((1, 0, 0)), (0, 0.3, 0), frame="body")
    sol = rom.simulate(mech, t_end=2.0, dt=1e-3)
    assert_allclose(sol.omega("wheel")[:, 2], 0.6 * sol.t, atol=1e-8)


@pytest.mark.parametrize("given", [True, False])
def test_drive_of_a_wheel_needs_the_torque_of_its_inertia(given):
    """Angle t - sin t: torque 0.5 sin t; derivatives given or by differences."""
    mech, _ = wheel()
    more = {"rate": lambda t: 1 - np.cos(t), "acceleration": np.sin} if given else {}
    mech.drive("motor", "axle", lambda t: t - np.sin(t), **more)
    for method, tolerance in (("dop853", 1e-7), ("generalized-alpha", 1e-5)):
        sol = rom.simulate(mech, t_end=2.0, dt=1e-3, method=method)
        assert_allclose(sol.reaction("motor")[:, 5], 0.5 * np.sin(sol.t), atol=tolerance)
        p = sol.orientation("wheel")
        assert_allclose(2 * np.arctan2(p[:, 3], p[:, 0]), sol.t - np.sin(sol.t), atol=1e-7)


def test_drive_of_a_slide_counts_from_the_start():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    on_guide(mech, "box", mass=2.0, at=(0.3, 0, 0), guide="slide")
    mech.drive("jack", "slide", lambda t: 0.1 * t**2)
    sol = rom.simulate(mech, t_end=1.0, dt=1e-3)
    assert_allclose(sol.position("box")[:, 0], 0.3 + 0.1 * sol.t**2, atol=1e-12)
    assert_allclose(sol.reaction("jack")[5:, 0], 0.4, atol=1e-4)


def test_physical_pendulum_reaction_at_the_lowest_point():
    """A bar released level: the hinge carries (1 + 3/2) m g when it passes below."""
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    on_hinge(mech, X / 2, "bar", inertia=(1e-3, 1 / 6, 1 / 6), axis=Z)
    sol = rom.simulate(mech, t_end=1.0, dt=1e-4)
    lowest = np.argmin(sol.position("bar")[:, 1])
    assert_allclose(sol.reaction("hinge")[lowest, 1], 2.5 * 2.0 * 9.81, rtol=1e-5)


def momentum(s, spin):
    return (2 * MASS * s**2 + HUB_INERTIA) * spin


def radial(t, spin, s0):
    """Half the distance of the masses: m s'' = m s w^2 - 2 k (s - rest), (2 m s^2 + J) w = h."""
    h = momentum(s0, spin)

    def rhs(_, y):
        s, rate, _ = y
        w = h / (2 * MASS * s**2 + HUB_INERTIA)
        return [rate, s * w**2 - 2 * SPRING / MASS * (s - REST), w]

    start = [s0, 0.0, 0.0]
    return solve_ivp(rhs, (0, t[-1]), start, "DOP853", t, rtol=1e-12, atol=1e-13).y


def thrown(spin, s0=REST):
    """The dumbbell spinning about its z axis, which points along AXIS, carried by a straight."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    x = np.cross(AXIS, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    turn = np.column_stack([x, np.cross(AXIS, x), AXIS])
    mech.add_flexible("bell", dumbbell(), at=(1, 2, 3), orientation=turn, velocity=(0.3, -0.2, 0.1),
                      omega=(0, 0, spin), q=[s0 - REST])  # fmt: skip
    return mech, turn


@pytest.mark.parametrize(
    ("options", "tolerance"),
    [({"dt": 1e-2, "method": "dop853"}, 1e-10), ({"dt": 1e-4, "rho_inf": 1.0}, 8e-5)],
)
def test_a_dumbbell_pulsates_by_its_radial_equation_however_large_the_stretch(options, tolerance):
    """Half a length longer and back, while the spin falls and rises: all couplings at once."""
    spin = 48.0
    mech, turn = thrown(spin)
    sol = rom.simulate(mech, t_end=0.3, **options)
    s, _, angle = radial(sol.t, spin, REST)
    assert np.ptp(s) > 0.5 * REST
    assert_allclose(sol.elastic("bell")[:, 0], s - REST, atol=tolerance * REST)
    centre = np.array([1, 2, 3]) + sol.t[:, None] * np.array([0.3, -0.2, 0.1])
    arm = np.stack([s * np.cos(angle), s * np.sin(angle), 0 * s], axis=1) @ turn.T
    assert_allclose(sol.position("bell", "right"), centre + arm, atol=20 * tolerance)
    assert_allclose(sol.position("bell", "left"), centre - arm, atol=20 * tolerance)


@pytest.mark.parametrize("spin", [0.0, 20.0, 60.0])
def test_stretch_and_frequency_of_the_spinning_dumbbell_have_closed_forms(spin):
    """At rest in the spinning frame 2 k (s - rest) = m s w^2; beside it, linearised at fixed h."""
    s = brentq(lambda s: 2 * SPRING * (s - REST) - MASS * s * spin**2, 0.5 * REST, 10 * REST)
    bulk = 4 * MASS * s**2 * spin**2 / (2 * MASS * s**2 + HUB_INERTIA)
    omega = np.sqrt(2 * SPRING / MASS - spin**2 + 2 * bulk)
    amplitude = 1e-5 * REST
    wanted = momentum(s, spin) / momentum(s + amplitude, 1.0)
    mech, _ = thrown(wanted, s + amplitude)
    sol = rom.simulate(mech, t_end=4 * np.pi / omega, dt=np.pi / omega / 20, method="dop853")
    swing = sol.elastic("bell")[:, 0] - (s - REST)
    assert_allclose(swing, amplitude * np.cos(omega * sol.t), atol=1e-3 * amplitude)


def test_a_damped_dumbbell_settles_where_the_spring_carries_the_masses():
    """What its damper has taken is what is missing in the energy; momentum is not touched."""
    spin, s0 = 40.0, REST
    body = dumbbell()
    body.D[0, 0] = 100.0
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("bell", body, omega=(0, 0, spin))
    sol = rom.simulate(mech, t_end=1.0, dt=1e-4, rho_inf=1.0)
    s, w = REST + sol.elastic("bell")[-1, 0], sol.omega("bell")[-1, 2]
    assert_allclose(2 * SPRING * (s - REST), MASS * s * w**2, rtol=1e-6)
    assert_allclose(momentum(s, w), momentum(s0, spin), rtol=1e-5)
    lost = sol.energy.damping[-1]
    assert lost > 0.1
    assert_allclose(sol.energy.total[0] - sol.energy.total[-1], lost, rtol=1e-4)
    assert rotation.matrix(sol.orientation("bell")[-1])[2, 2] == pytest.approx(1.0, abs=1e-12)


def test_the_work_of_laws_is_force_times_way_and_moment_times_angle():
    """Two newtons push the masses apart, three newton metres turn the body about its axis."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    bell = mech.add_flexible("bell", dumbbell(), omega=(0, 0, 5.0))
    right, left = bell.marker("right"), bell.marker("left")
    mech.user_force("push", lambda t, a, b: (2.0 * a.axes[:, 0], np.zeros(3)), right, left)
    mech.user_force("turn", lambda t, a: (np.zeros(3), (0, 0, 3.0)), right)
    sol = rom.simulate(mech, t_end=0.5, dt=0.01, method="dop853")
    p = sol.orientation("bell")
    angle = 2 * np.unwrap(np.arctan2(p[:, 3], p[:, 0]), period=np.pi)
    work = 2.0 * 2 * sol.elastic("bell")[:, 0] + 3.0 * angle
    assert work[-1] > 5.0
    assert_allclose(sol.energy.forces, work, atol=1e-8)
    assert_allclose(sol.energy.total - sol.energy.total[0], work, atol=1e-8)
