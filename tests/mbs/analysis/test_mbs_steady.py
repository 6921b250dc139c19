"""Stability of rolling against closed forms, and of other steady motions against `linearize`."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.parts import ORIGIN, X, Y, Z, on_axle, on_guide

G, R, MASS = 9.81, 0.3, 2.0
SHARES = {"disc": (0.25, 0.5), "hoop": (0.5, 1.0)}  # of m r^2: about a diameter, about the axle


def wheel(kind, speed):
    """A thin wheel that rolls upright along x."""
    across, along = (share * MASS * R**2 for share in SHARES[kind])
    mech = rom.Mechanism(gravity=(0, 0, -G))
    motion = {"at": (0, 0, R), "velocity": (speed, 0, 0), "omega": (0, speed / R, 0)}
    mech.add_rigid("wheel", mass=MASS, inertia=(across, along, across), **motion)
    mech.rolling("roll", "ground", "wheel", normal=Z, radius=R, axis=Y)
    return mech


def lean_squared(kind, speed):
    """s^2 of the lean: (A + 1) s^2 + C (C + 1) W^2 / A - g/r = 0, moments in units of m r^2."""
    A, C = SHARES[kind]
    return -(C * (C + 1) * (speed / R) ** 2 / A - G / R) / (A + 1)


@pytest.mark.parametrize("kind", SHARES)
@pytest.mark.parametrize("share", [0.7, 0.95, 1.05, 2.0])
def test_a_wheel_rolls_upright_above_its_critical_speed(kind, share):
    """v^2 > g r / 3 for a disc, g r / 4 for a hoop."""
    critical = np.sqrt(G * R / {"disc": 3, "hoop": 4}[kind])
    motion = rom.steady_motion(wheel(kind, share * critical))
    s = np.sqrt(complex(lean_squared(kind, share * critical)))
    near = [np.abs(motion.eigenvalues - sign * s).min() for sign in (1, -1)]
    assert max(near) < 1e-5 * abs(s)
    assert motion.stable == (share > 1)
    rest = np.sort(np.abs(motion.eigenvalues))[:-2]
    assert motion.eigenvalues.size == 5 + 3
    assert rest.max() < 1e-3 * motion.rate  # other places, headings and speeds


def test_the_lean_grows_in_a_simulation_as_the_eigenvalue_says():
    speed = 0.7 * np.sqrt(G * R / 3)
    mech = wheel("disc", speed)
    growth = np.sqrt(lean_squared("disc", speed))
    mech.torque("nudge", mech.part("wheel").marker((0, 0, 0)), (1e-7, 0, 0))
    sol = rom.simulate(mech, t_end=2.0, dt=0.05, method="dop853")
    lean = np.abs(sol.axes("wheel", (0, 0, 0))[:, 2, 1])
    late = sol.t > 1.2
    assert lean[-1] < 0.05
    assert_allclose(np.polyfit(sol.t[late], np.log(lean[late]), 1)[0], growth, rtol=0.02)


def rotor(speed):
    """An overhung disc on a shaft of springs: gyroscopic, but nothing rolls."""
    mech, solid = rom.Mechanism(gravity=ORIGIN), {"mass": 3.0, "inertia": (0.03, 0.03, 0.05)}
    mech.add_rigid("disc", **solid, at=ORIGIN, omega=speed * Z)
    mech.bushing("shaft", "ground", "disc", stiffness=(2e4, 2e4, 3e4, 90.0, 90.0, 0.0))
    return mech


def test_a_rotor_has_the_eigenvalues_of_its_linearization():
    speed = 80.0
    motion = rom.steady_motion(rotor(speed))
    known = rom.linearize(rotor(speed), frame="world").frequencies * 2 * np.pi
    found = np.sort(motion.eigenvalues.imag)[-5:]
    assert_allclose(found, np.sort(known)[-5:], rtol=1e-5)
    tilt = 0.05 * speed / 0.03 / 2  # I w'' = +- i C W w' - k w
    assert_allclose(found[-1], max(tilt + np.sqrt(tilt**2 + 90 / 0.03), 100.0), rtol=1e-5)


def test_a_mass_on_a_driven_arm_softens_with_the_speed():
    """Counted in the axes of the arm: s^2 = W^2 - k/m."""
    speed, stiffness, mass = 7.0, 300.0, 2.0
    mech = rom.Mechanism(gravity=ORIGIN)
    hub = on_axle(mech, "arm", inertia=(0.1, 0.1, 0.1))
    mech.drive("motor", "axle", lambda t: speed * t)
    end = on_guide(mech, "box", mass=mass, at=0.5 * X, base=hub)
    mech.spring_damper("coil", hub, end, stiffness=stiffness)
    state = rom.equilibrium(mech, spin=(0, 0, speed))
    motion = rom.steady_motion(mech, state, frame="body")
    exact = np.sqrt(stiffness / mass - speed**2)
    assert_allclose(np.sort(motion.eigenvalues.imag), [-exact, exact], rtol=1e-6)
    assert_allclose(motion.eigenvalues.real, 0, atol=1e-4)
    assert motion.stable


def test_a_motion_that_is_not_steady_is_named():
    mech = wheel("disc", 2.0)
    mech.force("push", mech.part("wheel").marker((0, 0, 0)), (50.0, 0, 0))
    mech.torque("turn", mech.part("wheel").marker((0, 0, 0)), (3.0, 0, 0))
    with pytest.warns(rom.RomWarning, match="is not steady"):
        rom.steady_motion(mech)
