"""Spinning flexible bodies against scalar equations that hold for any deformation."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from cases.mbs.trusses import HUB_INERTIA, MASS, REST, SPRING, dumbbell
from rom import rotation
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism

AXIS = np.array([2.0, -1.0, 2.0]) / 3


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
    mech = Mechanism(gravity=(0, 0, 0))
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
    sol = simulate(mech, t_end=0.3, **options)
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
    sol = simulate(mech, t_end=4 * np.pi / omega, dt=np.pi / omega / 20, method="dop853")
    swing = sol.elastic("bell")[:, 0] - (s - REST)
    assert_allclose(swing, amplitude * np.cos(omega * sol.t), atol=1e-3 * amplitude)


def test_a_damped_dumbbell_settles_where_the_spring_carries_the_masses():
    """What its damper has taken is what is missing in the energy; momentum is not touched."""
    spin, s0 = 40.0, REST
    body = dumbbell()
    body.D[0, 0] = 100.0
    mech = Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("bell", body, omega=(0, 0, spin))
    sol = simulate(mech, t_end=1.0, dt=1e-4, rho_inf=1.0)
    s, w = REST + sol.elastic("bell")[-1, 0], sol.omega("bell")[-1, 2]
    assert_allclose(2 * SPRING * (s - REST), MASS * s * w**2, rtol=1e-6)
    assert_allclose(momentum(s, w), momentum(s0, spin), rtol=1e-5)
    lost = sol.energy.damping[-1]
    assert lost > 0.1
    assert_allclose(sol.energy.total[0] - sol.energy.total[-1], lost, rtol=1e-4)
    assert rotation.matrix(sol.orientation("bell")[-1])[2, 2] == pytest.approx(1.0, abs=1e-12)


def test_the_work_of_laws_is_force_times_way_and_moment_times_angle():
    """Two newtons push the masses apart, three newton metres turn the body about its axis."""
    mech = Mechanism(gravity=(0, 0, 0))
    bell = mech.add_flexible("bell", dumbbell(), omega=(0, 0, 5.0))
    right, left = bell.marker("right"), bell.marker("left")
    mech.user_force("push", lambda t, a, b: (2.0 * a.axes[:, 0], np.zeros(3)), right, left)
    mech.user_force("turn", lambda t, a: (np.zeros(3), (0, 0, 3.0)), right)
    sol = simulate(mech, t_end=0.5, dt=0.01, method="dop853")
    p = sol.orientation("bell")
    angle = 2 * np.unwrap(np.arctan2(p[:, 3], p[:, 0]), period=np.pi)
    work = 2.0 * 2 * sol.elastic("bell")[:, 0] + 3.0 * angle
    assert work[-1] > 5.0
    assert_allclose(sol.energy.forces, work, atol=1e-8)
    assert_allclose(sol.energy.total - sol.energy.total[0], work, atol=1e-8)
