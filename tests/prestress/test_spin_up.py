"""Steady rotation at large displacement: stretched bars, bent blades against rods, whole wheels."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp

import rom
from cases.long import MESHED
from cases.refusals import refuses
from cases.wheels import bladed_model
from rom.components import cosserat
from rom.components.wheels.prestress.steady_rotation import SteadyRotation
from rom.components.wheels.prestress.thermal import finite_solid
from rom.components.wheels.rotation import centrifugal_displacement
from rom.errors import ConfigError, InterfaceError, ModelError, RomWarning

pytestmark = MESHED
E, RHO = 70e9, 2700.0
R, ARC, BEND, B, H = 0.1, 0.5, 60.0, 0.03, 0.004  # of meshes/bent_blade.geo
UNIT = np.sqrt(E * H**2 / (12 * RHO * ARC**4))  # rad/s of a dimensionless frequency of one


def straight(L=1.0, b=0.03, h=0.02, nu=0.0, E=E, nx=10):
    sizes = {"L": L, "b": b, "h": h, "hex": 1, "nx": nx, "ny": 1, "nz": 1}
    return rom.fe.model("meshes/beam.geo", material=rom.Material(E, nu, RHO), parameters=sizes)


@pytest.fixture(scope="module")
def bent():
    sizes = {"r": R, "L": ARC, "bend": BEND, "b": B, "h": H, "nl": 24}
    solid = rom.Material(E, 0.0, RHO)
    return rom.fe.model("meshes/bent_blade.geo", material=solid, parameters=sizes)


@pytest.fixture(scope="module")
def blade(bent):
    return rom.held_solid(bent, fixed=("root",))


@pytest.fixture(scope="module")
def run_up(bent, blade):
    return rom.spin_up(blade, bent, speed=6 * UNIT, n_states=9)


def test_the_tangent_is_the_derivative_of_the_forces():
    """Of a hot solid of Poisson's ratio 0.3, far from its reference."""
    model = straight(nu=0.3, nx=3)
    blade = rom.held_solid(model, fixed=("root",), axis=(0.2, 0.1, 1.0))
    steady = SteadyRotation(blade, finite_solid(model, rom.Heat(2e-5, lambda x: 1e3 * x[:, 0])))
    steady.load(300.0**2)
    rng = np.random.default_rng(3)
    a, da = 2e-3 * rng.standard_normal((2, blade.free.size))
    K = steady.tangent(a)
    change = (steady.residual(a + 1e-4 * da) - steady.residual(a - 1e-4 * da)) / 2e-4
    assert_allclose(K @ da, change, atol=1e-6 * np.linalg.norm(change))
    assert abs(K - K.T).max() == 0.0
    assert abs(steady.K_cold - model.K).max() < 1e-12 * abs(model.K).max()


def test_a_spinning_bar_stretches_as_its_differential_equation_says():
    """(E A (lam^3 - lam) / 2)' + rho A Omega^2 (x + u) = 0, lam = 1 + u', up to 1.14."""
    L, soft = 1.0, 1e6
    model = straight(L=L, b=0.01, h=0.01, E=soft)
    speed = np.sqrt(0.3 * soft / (RHO * L**2))
    states = rom.spin_up(rom.held_solid(model, fixed=("root",)), model, speed=speed, n_states=3)
    u = states.displacement(speed).reshape(-1, 3)
    axis = np.flatnonzero((abs(model.points[:, 1:]) < 1e-9).all(axis=1))

    def slopes(x, y):  # y = u, lam
        return np.array([y[1] - 1, -2 * RHO * speed**2 * (x + y[0]) / (soft * (3 * y[1] ** 2 - 1))])

    x = np.linspace(0, L, 51)
    start = [0.2 * x, 1 + 0 * x]
    exact = solve_bvp(slopes, lambda a, b: np.array([a[0], b[1] - 1]), x, start, tol=1e-9)
    assert exact.sol(0.0)[1] > 1.13
    assert_allclose(u[axis, 0], exact.sol(model.points[axis, 0])[0], atol=1e-4 * exact.sol(L)[0])
    linear = speed**2 * centrifugal_displacement(states.sector).reshape(-1, 3)[axis, 0]
    assert abs(linear.max() / u[axis, 0].max() - 1) > 0.05


@pytest.mark.long
def test_at_small_speed_the_displacement_is_that_of_the_linear_solid(bent):
    """The difference falls with the fourth power of the speed; about an axis elsewhere."""
    blade = rom.held_solid(bent, fixed=("root",), axis=(0.1, 0, 1), at=(-0.2, 0, 0.1))
    unit = centrifugal_displacement(blade)
    speeds = UNIT * np.array([0.05, 0.1, 0.2])
    states = rom.spin_up(blade, bent, speed=speeds[-1], n_states=2)
    gaps = [np.linalg.norm(states.displacement(v) - v**2 * unit) for v in speeds]
    assert_allclose(np.diff(np.log2(gaps)), 4.0, atol=0.06)
    assert gaps[0] < 0.01 * speeds[0] ** 2 * np.linalg.norm(unit)


def test_a_straight_blade_hardly_needs_it():
    """Stress of the linear solid is right where nothing bends: frequencies to 1e-3."""
    model = straight(h=0.01)
    solid = rom.held_solid(model, fixed=("root",))
    speed = 10 * np.sqrt(E * 0.01**2 / (12 * RHO))
    linear = rom.cyclic_modes(rom.rotating_sector(solid, model), 0, 3, speed=speed)
    large = rom.spin_up(solid, model, speed=speed, n_states=2).modes(3, speed=speed)
    assert_allclose(large.omega, linear.omega, rtol=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("eta", [2.0, 4.5, 6.0])
def test_a_bent_blade_vibrates_like_a_geometrically_exact_rod(bent, run_up, eta):
    """Rotation straightens it; shapes 1, 3 and 4 bend across its thin side and in its plane."""
    radius, A, G = ARC / np.radians(BEND), B * H, E / 2

    def place(s):
        c, t = np.cos(s / radius), np.sin(s / radius)
        return (R + radius * t, 0, radius * (1 - c)), np.array([[t, 0, -c], [0, 1, 0], [c, 0, t]]).T

    thin, wide = B * H**3 / 12, H * B**3 / 12
    line = cosserat.along(
        place, np.linspace(0, ARC, 41), stretch=(5 / 6 * G * A, 5 / 6 * G * A, E * A),
        bend=(E * wide, E * thin, G * 4 * thin * (1 - 0.63 * H / B)), mass=RHO * A,
        inertia=(RHO * wide, RHO * thin, RHO * (thin + wide)),
    )  # fmt: skip
    speed = eta * UNIT
    spin = (0, 0, speed)
    shape = cosserat.equilibrium(line, cosserat.loads(line), spin=spin)
    exact = 2 * np.pi * cosserat.modes(line, shape, 4, spin=spin).frequencies
    tip = run_up.displacement(speed).reshape(-1, 3)[bent.interfaces["tip"].nodes].mean(axis=0)
    assert_allclose(tip, shape.x[-1] - line.x[-1], atol=0.003 * ARC)
    assert np.linalg.norm(tip) > 0.1 * ARC
    found = run_up.waves(4, speed=speed).omega
    assert_allclose(found[[0, 2]], exact[[0, 2]], rtol=0.01)
    assert_allclose(found[3], exact[3], rtol=0.012)  # the solid has kinks of 2.5 degrees


@pytest.mark.long
def test_the_stress_of_the_linear_solid_is_wrong_by_a_quarter_and_few_states_are_confessed(
    bent, blade, run_up
):
    linear = rom.travelling_modes(rom.rotating_sector(blade, bent), 0, 1, speed=run_up.top)
    ratio = linear.omega[0] / run_up.waves(1, speed=run_up.top).omega[0]
    assert 0.70 < ratio < 0.78
    states = rom.spin_up(blade, bent, speed=6 * UNIT, n_states=3)
    with pytest.warns(RomWarning, match="off by .* ask for more states"):
        states.reduced(6)


def test_a_reduced_blade_follows_the_speed(run_up):
    small = run_up.reduced(8)
    assert small.error < 3e-4
    assert small.certificate.ok and small.certificate.rows[-1].value == small.error
    assert not replace(small, error=0.1).certificate.ok
    for speed in np.array([0.5, 0.7, 0.96]) * run_up.top:
        assert np.abs(run_up.speeds - speed).min() > 0.01 * run_up.top
        for kind in ("waves", "modes"):
            full, found = (getattr(each, kind)(3, speed=speed).omega for each in (run_up, small))
            assert_allclose(found, full, rtol=5e-4)
    state = small.at(run_up.speeds[4])
    assert_allclose(state.Psi.T @ (run_up.sector.M @ state.Psi), state.M.toarray(), atol=1e-9)


@pytest.fixture(scope="module")
def wheel():
    soft = rom.Material(E=2e9, nu=0.33, rho=4430.0)
    sizes = {"degree": 1, "cells": (4, 2, 2, 2), "twist": 0.3, "material": soft}
    return bladed_model(6, **sizes), bladed_model(6, 6, **sizes)


def test_one_sector_is_the_whole_wheel_and_a_reduced_one_follows_the_speed(wheel):
    part, whole = wheel
    sector = rom.CyclicSector.from_model(part, fixed=("bore",))
    solid = rom.held_solid(whole, fixed=("bore",))
    speed = 1500.0
    few, many = (rom.spin_up(s, m, speed=speed, n_states=2)
                 for s, m in ((sector, part), (solid, whole)))  # fmt: skip
    exact = many.waves(10, speed=speed).omega
    found = [few.waves(6, speed=speed, diameter=n).omega for n in sector.diameters]
    assert_allclose(np.sort(np.concatenate(found))[:10], exact, rtol=1e-7)
    assert np.abs(few.displacement(speed)).max() > 0.015 * 0.16
    linear = rom.rotating_sector(sector, part)
    change = rom.travelling_modes(linear, 2, 2, speed=speed).omega / found[2][:2] - 1
    assert np.abs(change).max() > 0.002
    states = rom.spin_up(sector, part, speed=speed, n_states=5)
    small = states.reduced(30, functions=rom.Polynomial(3))
    assert small.error < 2e-3
    for n in (1, 3):
        full = states.waves(4, speed=1100.0, diameter=n).omega
        assert_allclose(small.waves(4, speed=1100.0, diameter=n).omega, full, rtol=3e-3)


def test_a_free_wheel_spins_up(wheel):
    part, _ = wheel
    sector = rom.CyclicSector.from_model(part)
    states = rom.spin_up(sector, part, speed=200.0, n_states=2)
    linear = rom.rotating_sector(sector, part)
    exact = rom.travelling_modes(linear, 2, 4, speed=200.0)
    found = states.waves(4, speed=200.0, diameter=2)
    assert_allclose(found.omega, exact.omega, rtol=2e-3)
    assert list(found.direction) == list(exact.direction)


def test_heat_joins_in():
    """A bar clamped at both ends, heated to a third of its buckling temperature."""
    model, ends = straight(h=0.01), ("root", "tip")
    heat = rom.Heat(23e-6, rom.thermal_buckling(model, rom.Heat(23e-6, 1.0), fixed=ends) / 3)
    hot = rom.modes(rom.heated(model, heat, fixed=ends), 2, fixed=ends).omega
    solid = rom.held_solid(model, fixed=ends, axis=(1.0, 0.0, 0.0))
    states = rom.spin_up(solid, model, speed=1.0, n_states=2, heat=heat)
    assert_allclose(states.modes(2, speed=1.0).omega, hot, rtol=2e-3)
    hotter = {"speed": 1.0, "n_states": 2, "heat": replace(heat, expansion=92e-6)}
    refuses(ModelError, "beyond a temperature change of", rom.spin_up, solid, model, **hotter)


def test_a_shaft_beyond_its_critical_speed_is_refused():
    """About its own axis a bar softens without stiffening: Omega = omega_1 is the end.

    It is hardly displaced there, by 3e-9 of its length, and rounding is amplified: nearer than one
    step of the search it is told all the same.
    """
    model = straight(nx=4)
    shaft = rom.held_solid(model, fixed=("root",), axis=(1.0, 0.0, 0.0))
    limit = rom.cyclic_modes(shaft, 0, 1).omega[0]
    with pytest.raises(ModelError, match=r"above .* rad/s") as caught:
        rom.spin_up(shaft, model, speed=1.1 * limit, n_states=3)
    reached = float(str(caught.value).split("above ")[1].split()[0])
    assert 0.998 * limit < reached < limit
    assert rom.spin_up(shaft, model, speed=0.98 * limit, n_states=2).modes(1, speed=0.0).omega > 0


def test_wrong_arguments_are_named(bent, blade, run_up):
    carrying = replace(bent, attachments=(rom.Attachment("tip", 1.0),))
    refuses(ConfigError, "carries 1 attachments", rom.spin_up, blade, carrying, speed=1.0)
    refuses(ConfigError, r"beyond the 141", run_up.at, 1.1 * run_up.top)
    refuses(ConfigError, "needs a support", rom.held_solid, bent, fixed=())
    refuses(InterfaceError, "no interface 'rim'", rom.held_solid, bent, fixed="rim")
    bare = replace(bent, stresses=None)
    refuses(ConfigError, "no finite elements", rom.spin_up, blade, bare, speed=1.0)
