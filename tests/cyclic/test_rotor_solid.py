"""Rotors and thin discs of solid finite elements that spin, one sector of them in the computer."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq, fsolve
from scipy.special import iv, ivp, jv, jvp, kv, kvp, yv, yvp

import rom
from cases.long import MESHED
from cases.refusals import refuses
from cases.wheels import model_of, revolved_mesh
from rom.components.transmission import Disc
from rom.errors import ConfigError, InterfaceError

pytestmark = MESHED
STEEL = rom.Material(E=211e9, nu=211e9 / (2 * 81.2e9) - 1, rho=7810.0)


def spinning(mesh, material=STEEL, **springs):
    """Sector with matrices of rotation, on springs {face: stiffness across}."""
    model = model_of(mesh, material=material)
    sector = rom.rotating_sector(rom.CyclicSector.from_model(model), model)
    for face, across in springs.items():
        sector = rom.supported_sector(sector, model.interfaces[face], across=across)
    return sector


def whirl(sector, speed, n):
    """Frequencies seen at rest [rad/s], positive forward, also of waves slower than the wheel."""
    waves = rom.travelling_modes(sector, 1, n, speed=speed)
    omega = 2 * np.pi * waves.at_rest * waves.direction
    return omega[np.argsort(abs(omega))]


@pytest.mark.parametrize("width", [0.02, 0.2])
@pytest.mark.parametrize("speed", [30.0, 600.0])
def test_a_rigid_disc_on_springs_whirls_as_euler_says(width, speed):
    """w^2 Id -+ w Omega Ip = k b^2 / 2 about the centre, 2 k = m w^2 of it; Ip > Id and less."""
    k, R, bore = 1e4, 0.1, 0.02
    rotor = spinning(
        revolved_mesh(16, [bore, 0.06, R], [-width / 2, 0, width / 2], lambda r, z: "disc",
                      {"left": (-width / 2, R), "right": (width / 2, R)}),
        left=k, right=k,
    )  # fmt: skip
    disc = Disc.of_ring(0, outer=2 * R, inner=2 * bore, width=width, rho=STEEL.rho)
    assert (disc.polar > disc.diametral) == (width == 0.02)
    gyro, tilt = disc.polar * speed / (2 * disc.diametral), k * width**2 / 2 / disc.diametral
    shift = np.sqrt(2 * k / disc.mass)
    exact = np.array([shift, -shift, *(gyro + np.array([1, -1]) * np.sqrt(gyro**2 + tilt))])
    found = whirl(rotor, speed, 4)
    assert_allclose(found[np.argsort(found)], np.sort(exact), rtol=3e-4)


def test_springs_hold_a_disc_along_its_axis_and_about_it():
    """Rigid: 2 k = m w^2 along the axis; about it the springs have the radius of gyration of it."""
    model = model_of(
        revolved_mesh(16, [0.02, 0.06, 0.1], [-0.01, 0.01], lambda r, z: "disc",
                      {"left": (-0.01, 0.1), "right": (0.01, 0.1)}), material=STEEL
    )  # fmt: skip
    sector = rom.CyclicSector.from_model(model)
    assert not sector.supported
    for face in ("left", "right"):
        sector = rom.supported_sector(sector, model.interfaces[face], across=1e4, along=4e4)
    assert sector.supported
    exact = np.sqrt(np.array([2e4, 8e4]) / (16 * model.mass()))
    assert_allclose(rom.cyclic_modes(sector, 0, 2).omega, exact, rtol=1e-4)


LEFT, RIGHT, WIDE, NECK, GAP = 0.5, 1.0, 0.07, 0.003, 0.03
BORE, R = 0.002, 0.025


def ring(outer, inner, width, rho):
    disc = Disc.of_ring(0, outer=2 * outer, inner=2 * inner, width=width, rho=rho)
    return np.array([disc.mass, disc.diametral, disc.polar])


def narrow(outer):
    """Radius, width and density of a disc on a narrow neck with the inertias of a plain one."""
    plain = ring(outer, R, WIDE, STEEL.rho)

    def off(x):
        radius, width, rho = x * (outer, WIDE, STEEL.rho)
        return (ring(radius, GAP, width, rho) + ring(GAP, R, NECK, rho)) / plain - 1

    return fsolve(off, np.ones(3)) * (outer, WIDE, STEEL.rho)


@pytest.fixture(scope="module")
def published():
    """Example 5.9.1 of test_rotor.py: a shaft of bricks, discs on necks, as loads are there."""
    discs = {"left": (LEFT, *narrow(0.14)), "right": (RIGHT, *narrow(0.175))}
    edges = [at + side * w / 2 for at, _, wide, _ in discs.values()
             for side in (-1, 1) for w in (wide, NECK)]  # fmt: skip
    edges = np.sort([0.0, 1.5, *edges])
    between = [np.linspace(edges[k], edges[k + 1], 8) for k in (0, 4, 8)]
    z = np.unique(np.concatenate([edges, *between]))
    r = np.unique([BORE, 0.012, R, GAP, 0.08, *(disc[1] for disc in discs.values())])

    def section(radius, at):
        if radius < R:
            return "shaft"
        for name, (middle, outer, width, _) in discs.items():
            if abs(at - middle) < (NECK if radius < GAP else width) / 2 and radius < outer:
                return name
        return None

    stiff = {name: rom.Material(E=40 * STEEL.E, nu=STEEL.nu, rho=disc[3])
             for name, disc in discs.items()}  # fmt: skip
    mesh = revolved_mesh(24, r, z, section, {"a": (0.0, R), "b": (1.5, R)})
    return spinning(mesh, {"shaft": STEEL} | stiff, a=1e6, b=1e6)


def test_a_solid_rotor_whirls_as_printed_and_springs_that_hold_nothing_are_refused(published):
    """rad/s at rest and at 4000 1/min, above two critical speeds; forward positive."""
    still = rom.cyclic_modes(published, 1, 3).omega
    assert_allclose(still, [86.66, 274.31, 716.78], rtol=6e-3)
    speed = 4000 * np.pi / 30
    found = whirl(published, speed, 7)[:6]
    printed = np.array([-85.39, 87.80, -251.78, 294.71, -600.18, 827.08])
    assert_allclose(found, printed, rtol=6e-3)
    split = np.diff(abs(found))[::2] / still
    assert_allclose(split, [2.41 / 86.66, 42.93 / 274.31, 226.90 / 716.78], rtol=3e-2)
    refuses(ConfigError, "hold nothing", rom.supported_sector, published, published.face)
    small, held = rom.reduce_sector(published, n_modes=5), {"face": published.face, "across": 1.0}
    refuses(InterfaceError, "'cyclic_low' is no interface", rom.supported_sector, small, **held)


def edge(n, x, nu, free):
    """(2, 4) moment and shear, or deflection and slope, of J, Y, I and K at k r = x."""
    columns = []
    for f, slope, sign in ((jv, jvp, -1), (yv, yvp, -1), (iv, ivp, 1), (kv, kvp, 1)):
        w, d = f(n, x), slope(n, x)
        moment = sign * w - (1 - nu) * (d / x - n**2 * w / x**2)
        shear = sign * d - (1 - nu) * n**2 / x**2 * (d - w / x)
        columns.append((moment, shear) if free else (w, d))
    return np.array(columns).T


def plate_frequency(n, ratio, nu, inner):
    """Lowest (k a)^2 of a plate free outside with a hole, clamped or free, of that ratio."""

    def determinant(k):
        A = np.vstack([edge(n, k, nu, True), edge(n, k * ratio, nu, inner == "free")])
        return np.linalg.det(A / abs(A).max(axis=0))

    k = np.linspace(0.3, 12, 1500)
    values = np.array([determinant(x) for x in k])
    first = np.flatnonzero(values[:-1] * values[1:] < 0)[0]
    return brentq(determinant, k[first], k[first + 1]) ** 2


def thin_disc(ratio, h=0.002, radius=0.2):
    r = np.linspace(ratio, 1.0, 14) * radius
    return revolved_mesh(48, r, [-h / 2, h / 2], lambda r, z: "disc", {})


def test_a_thin_free_disc_bends_as_kirchhoff_says():
    """Leissa, Vibration of Plates (1969), free circular plate with nu = 0.33, without a hole."""
    for n, printed in ((2, 5.253), (0, 9.084), (3, 12.23)):
        assert_allclose(plate_frequency(n, 1e-3, 0.33, "free"), printed, rtol=3e-3)
    sector = rom.CyclicSector.from_model(model_of(thin_disc(0.1), material=STEEL))
    rate = np.sqrt(STEEL.E * 0.002**2 / (12 * (1 - STEEL.nu**2) * STEEL.rho)) / 0.2**2
    for n in (0, 2, 3):
        exact = plate_frequency(n, 0.1, STEEL.nu, "free") * rate  # sqrt(D / rho h) / a^2
        omega = rom.cyclic_modes(sector, n, 4).omega
        assert_allclose(omega[omega > 0][0], exact, rtol=2e-3)


def test_a_thin_spinning_disc_splits_by_its_turning_alone():
    """Seen at rest f +- n Omega; Southwell for n = 2: omega_0^2 + 2.35 Omega^2 at least."""
    disc = spinning(thin_disc(0.02))
    still = rom.cyclic_modes(replace(disc, coriolis=None, centrifugal=None), 2, 1).omega[0]
    for speed in (0.5 * still, 2 * still):
        waves = rom.travelling_modes(disc, 2, 2, speed=speed)
        assert_allclose(*waves.omega, rtol=2e-4)
        assert sorted(waves.direction) == [-1, 1]
        split = np.ptp(waves.at_rest) * 2 * np.pi
        assert_allclose(split, 4 * speed, rtol=1e-4)
        southwell = np.sqrt(still**2 + (5 - STEEL.nu) / 2 * speed**2)
        assert_allclose(waves.omega, southwell, rtol=3e-3)
        assert np.all(waves.omega > southwell)
