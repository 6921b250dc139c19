"""Rotating solids of large deflection: what stiffens them is in their energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.beam import spin_up
from cases.long import MESHED
from cases.mbs.slender import reduced, slender
from rom.components import cosserat

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = MESHED
# exact flapwise frequencies of a rotating cantilever by speed, in sqrt(EI / m L^4); in its plane
# their squares are less by the square of the speed
FLAP = {5: (6.44954475, 25.4460804), 12: (13.1701505, 37.6031123)}
SLENDERNESS = 100
UNIT = SLENDERNESS * np.sqrt(12 * 7850.0 / 210e9)  # sqrt(m L^4 / EI) of a square section [s]


@pytest.fixture(scope="module")
def blade():
    """A cantilever made for forces across its tip and for rotation, and its finite elements."""
    model, EI = slender(SLENDERNESS, 40)
    body = reduced(model, (0, 0.4 * EI, 0.4 * EI, 0, 0, 0), n_modes=8, active=2,
                   spin=(0, 0, max(FLAP) / UNIT))  # fmt: skip
    return body, model


@pytest.fixture(scope="module")
def exact(blade):
    """The same at finite strain in its own steady states, with the load that follows it."""
    model = blade[1]
    held = rom.held_solid(model, fixed=("root",), at=model.interfaces["root"].origin)
    return rom.spin_up(held, model, speed=max(FLAP) / UNIT, n_states=5)


def turning(speed, held):
    """Modes of what ``held`` puts into a mechanism, on a shaft of that speed, times `UNIT`."""
    return 2 * np.pi * UNIT * rom.linearize(*steady(speed, held)).frequencies


def steady(speed, held):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    root, place = held(mech)
    mech.revolute("shaft", mech.ground.marker(place), root, axis=(0, 0, 1))
    mech.drive("motor", "shaft", lambda t: speed * t, rate=lambda t: speed,
               acceleration=lambda t: 0.0)  # fmt: skip
    return mech, rom.equilibrium(mech, spin=(0, 0, speed), about=place)


def solid(body):
    def held(mech):
        root = mech.add_flexible("blade", body).marker("root")
        return root, body.marker("root").point

    return held


def nearest(found, known):
    return found[np.abs(found[:, None] - known).argmin(axis=0)]


@pytest.mark.parametrize("eta", FLAP)
def test_a_rotating_cantilever_stiffens_as_its_finite_elements_do(blade, exact, eta):
    """And as Southwell's beam; a body of large deflection has no geometric stiffness beside.

    In its plane a beam as thick as this one, which stretches, is 6e-4 lower than Southwell's.
    """
    assert not blade[0].K_geo
    found = turning(eta / UNIT, solid(blade[0]))
    flap = np.array(FLAP[eta])
    known = np.r_[flap, np.sqrt(flap**2 - eta**2)]
    full = UNIT * np.abs(exact.waves(8, speed=eta / UNIT).omega)
    assert_allclose(nearest(found, known), nearest(full, known), rtol=5e-5)
    assert_allclose(nearest(found, flap), flap, rtol=1e-4)
    assert_allclose(nearest(found, known), known, rtol=7e-4)


def test_rotation_stretches_it_as_a_bar(blade):
    """By L (tan k / k - 1), k = speed L sqrt(rho / E); the mass pulls more the farther it is."""
    body, speed = blade[0], max(FLAP) / UNIT
    q = steady(speed, solid(body))[1].q[7:]
    k = speed * np.sqrt(7850 / 210e9)
    assert_allclose(body.marker("tip").translation[0] @ q, np.tan(k) / k - 1, rtol=1e-3)


def test_it_vibrates_in_rotation_as_a_rod_of_the_same_section(blade):
    """Timoshenko's rods of this package, whose stiffness follows from their own kinematics."""
    h, E, rho = 1 / SLENDERNESS, 210e9, 7850.0
    A, I = h**2, h**4 / 12
    section = {"stretch": [E * A / 2.4, E * A / 2.4, E * A], "bend": [E * I, E * I, 0.5 * E * I],
               "mass": rho * A, "inertia": [rho * I, rho * I, 2 * rho * I]}  # fmt: skip
    along = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    rod = cosserat.body(cosserat.straight(1.0, 60, frame=along, **section))

    def held(mech):
        return mech.add_nonlinear("rod", rod).marker("start"), np.zeros(3)

    speed = 8 / UNIT
    found, known = turning(speed, solid(blade[0]))[:4], turning(speed, held)[:4]
    assert_allclose(found, known, rtol=2e-3)


def test_a_spin_up_bends_it_as_the_exact_beam(blade):
    """Kane, Ryan and Banerjee's, 10 m and 0.93 s to the metre and second of this one."""
    unit = UNIT / np.sqrt(1.2 * 10.0**4 / 1.4e4)
    sol, u, v = spin_up(blade[0], 6.0 / unit, 9 * unit, duration=15 * unit, dt=1e-2 * unit)
    assert_allclose(10 * v.min(), -0.57379, rtol=3e-4)
    assert_allclose(sol.t[v.argmin()] / unit, 6.76, atol=0.02)
    assert_allclose(10 * u.min(), -0.01882, rtol=5e-3)
