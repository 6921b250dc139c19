"""Heated solids: Euler's column, Timoshenko's disc, bodies free to expand, and the whole wheel."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import trapezoid
from scipy.linalg import eigvalsh
from scipy.sparse import identity
from scipy.sparse.linalg import eigsh

import rom
from cases.long import MESHED
from cases.refusals import refuses
from cases.solid import reduced
from cases.wheels import bladed_model, gathered
from rom.components.wheels.prestress.thermal import _stressed, _thermal, finite_solid
from rom.eigen.verbs import rigid_motions
from rom.eigen.workers import ONE_PROCESS
from rom.errors import ConfigError, InterfaceError, ModelError

pytestmark = MESHED
E, RHO, L, B, H, ALPHA = 70e9, 2700.0, 1.0, 0.02, 0.01, 23e-6
EULER = np.pi**2 * H**2 / (12 * L**2)  # strain at which a pinned column buckles
ENDS = ("root", "tip")


def heat(strain, **given):
    """Uniform heat with a free thermal strain."""
    return rom.Heat(ALPHA, strain / ALPHA, **given)


@pytest.fixture(scope="module")
def bar():
    sizes = {"L": L, "b": B, "h": H, "hex": 1, "nx": 30, "ny": 1, "nz": 1}
    return rom.fe.model("meshes/beam.geo", material=rom.Material(E, 0.0, RHO), parameters=sizes)


@pytest.mark.long
def test_a_clamped_bar_buckles_at_the_load_of_euler(bar):
    """P_cr = 4 pi^2 EI / L^2 with P = E A alpha dT; shear takes a few per mille off."""
    assert_allclose(rom.thermal_buckling(bar, heat(4 * EULER), fixed=ENDS), 1.0, rtol=2e-3)
    assert rom.thermal_buckling(bar, heat(-EULER), fixed=ENDS) == np.inf
    cold = rom.modes(bar, 1, fixed=ENDS).omega[0]
    near = rom.heated(bar, heat(3.9 * EULER), fixed=ENDS)
    assert rom.modes(near, 1, fixed=ENDS).omega[0] < 0.2 * cold
    cooled = rom.heated(bar, heat(-4 * EULER), fixed=ENDS)
    assert_allclose(rom.modes(cooled, 1, fixed=ENDS).omega[0] / cold, np.sqrt(2.0), rtol=0.02)


@pytest.mark.long
@pytest.mark.parametrize("share", [-2.0, 0.4, 0.9])
def test_a_pinned_bar_softens_as_the_beam_does(bar, share):
    """omega^2 = omega_0^2 (1 - P / P_cr), exact as the shape stays a sine.

    While it is heated its ends may grow across; what blocks that turns with them and pulls.
    """
    x = bar.points
    ends = np.flatnonzero((x[:, 0] < 1e-9) | (x[:, 0] > L - 1e-9))
    on_axis = ends[np.abs(x[ends, 2]) < 1e-9]
    guided = np.r_[3 * ends, 3 * on_axis[:3] + 2, 3 * on_axis[0] + 1]
    solid = finite_solid(bar, heat(share * EULER))
    one = identity(bar.n_dofs, format="csr")
    K, K_geo = _thermal(solid, one, np.unique(guided), bar.M, ONE_PROCESS)
    held = np.concatenate([3 * on_axis, 3 * ends + 1, 3 * ends + 2])  # ends turn about y
    loose = np.setdiff1d(np.arange(bar.n_dofs), held)
    cold, warm, M = (A[loose][:, loose].tocsc() for A in (K, K + K_geo, bar.M))
    lowest = [eigsh(A, 1, M, sigma=0.0)[0][0] for A in (cold, warm)]
    assert_allclose(lowest[1] / lowest[0], 1 - share, atol=1e-3 * abs(share))


def test_the_reduced_body_is_warm(bar):
    """Below a quarter of the critical temperature, where the free bar is stable too."""
    hot = rom.heated(bar, heat(0.8 * EULER), fixed=ENDS)
    body = reduced(12, hot)
    full = rom.modes(hot, 4, fixed=ENDS).frequencies
    assert_allclose(body.frequencies(fixed=ENDS)[:4], full, rtol=1e-4)
    assert full[0] < 0.95 * rom.modes(bar, 1, fixed=ENDS).frequencies[0]
    motion = rigid_motions(hot.points)
    assert abs(hot.K @ motion).max() < 1e-9 * abs(hot.K).max() * L
    hotter = rom.heated(bar, heat(2 * EULER), fixed=ENDS)  # only its supports keep it straight
    refuses(ModelError, "1 shapes .* without its supports it would buckle", reduced, 4, hotter)


def test_a_free_body_expands_without_stress_and_keeps_its_rigid_motions(bar):
    """At uniform temperature, and at one that grows linearly: plane sections stay plane."""
    for temperature in (300.0, lambda x: 500.0 * x[:, 0] - 2e4 * x[:, 2], 100.0 * bar.points[:, 1]):
        hot = rom.heated(bar, rom.Heat(ALPHA, temperature))
        # to round-off of the solve, 1e-9 of a stress that would change K by 3e-3
        assert abs(hot.K - bar.K).max() < 1e-11 * abs(bar.K).max()
    hot = rom.heated(bar, rom.Heat(ALPHA, lambda x: 2e6 * x[:, 2] ** 2))
    assert abs(hot.K - bar.K).max() > 1e-6 * abs(bar.K).max()
    assert abs(hot.K @ rigid_motions(hot.points)).max() < 1e-11 * abs(hot.K).max()
    assert (rom.modes(hot, 7).omega[:6] == 0.0).all()


def test_a_disc_hot_at_its_rim_has_the_stress_of_timoshenko():
    """sigma_r of plane stress for T = (r / b)^2, seen by a cone of slope 1: integral of sigma_r."""
    a, b, width, N = 0.05, 0.1, 0.002, 36
    model = bladed_model(N, bore=a, rim=b, tip=b, width=width, cells=(2, 5, 0, 1))
    sector = rom.CyclicSector.from_model(model)
    rim = rom.Heat(9e-6, lambda x: (x[:, 0] ** 2 + x[:, 1] ** 2) / b**2)
    dK = rom.heated_sector(sector, model, rim).K - sector.K
    w = np.zeros((len(model.points), 3))
    w[:, 2] = np.hypot(*model.points.T[:2])
    middle = model.points[:, 2] - model.points[:, 2].mean()
    w[:, :2] = -(middle / w[:, 2])[:, None] * model.points[:, :2]  # normals stay normal
    r = np.linspace(a, b, 4001)
    integral = (r**4 - a**4) / (4 * b**2)
    sigma = 9e-6 * 114e9 / r**2 * ((r**2 - a**2) / (b**2 - a**2) * integral[-1] - integral)
    exact = 2 * np.pi / N * width * trapezoid(sigma * r, r)
    assert_allclose(w.ravel() @ (dK @ w.ravel()), exact, rtol=5e-3)


@pytest.mark.long
def test_one_hot_sector_is_the_hot_wheel():
    N, sizes = 6, {"degree": 1, "cells": (4, 2, 2, 2)}
    rim = rom.Heat(9e-6, lambda x: 8e4 * (x[:, 0] ** 2 + x[:, 1] ** 2))
    whole = rom.heated(bladed_model(N, N, **sizes), rim, fixed=("bore",))
    exact = rom.modes(whole, 12, fixed=("bore",)).omega
    model = bladed_model(N, **sizes)
    sector = rom.CyclicSector.from_model(model, fixed=("bore",))
    hot = rom.heated_sector(sector, model, rim)
    assert_allclose(gathered(hot, 6)[:12], exact, rtol=1e-8)
    lowest = [np.array([rom.cyclic_modes(s, n, 6).omega[0] for n in s.diameters])
              for s in (hot, sector)]  # fmt: skip
    assert max(abs(lowest[0] / lowest[1] - 1)) > 1e-3


def test_a_thin_disc_buckles_and_says_when():
    """The temperature named is the one at which a wave of the free disc has no stiffness."""
    model = bladed_model(6, bore=0.02, rim=0.2, tip=0.2, width=0.001, cells=(3, 4, 0, 1))
    sector = rom.CyclicSector.from_model(model)
    rim = rom.Heat(9e-6, lambda x: 2e4 * (x[:, 0] ** 2 + x[:, 1] ** 2))
    with pytest.raises(ModelError, match=r"buckles at (0\.\d+) times") as caught:
        rom.heated_sector(sector, model, rim)
    share = float(str(caught.value).split(" at ")[1].split()[0])
    rom.heated_sector(sector, model, replace(rim, expansion=0.99 * share * 9e-6))


def test_blades_hotter_than_the_disc_by_region_and_by_node():
    model = bladed_model(6, degree=1, cells=(4, 2, 2, 2))
    by_region = rom.Heat({"blade": 9e-6}, {"blade": 200.0})
    everywhere = rom.Heat({"blade": 9e-6, "disk": 0.0}, np.full(len(model.points), 200.0))
    one, other = (rom.heated(model, h).K for h in (by_region, everywhere))
    assert abs(one - model.K).max() > 1e-5 * abs(model.K).max()
    assert_allclose(one.toarray(), other.toarray(), atol=1e-12 * abs(one).max())
    field = rom.Heat({"blade": 9e-6}, lambda x: 200.0 + 5e3 * x[:, 0])
    same = replace(field, temperature=200.0 + 5e3 * model.points[:, 0])
    assert (rom.heated(model, field).K != rom.heated(model, same).K).nnz == 0
    alone = rom.heated(model, rom.Heat(9e-6, 200.0)).K  # all of it hot: free to expand
    assert abs(alone - model.K).max() < 1e-12 * abs(model.K).max()


def test_too_much_and_wrong_heat_are_named(bar):
    hot = rom.Heat(ALPHA, 40.0)
    refuses(ModelError, r"temperature change of 14\.3\d* K", rom.heated, bar, hot, fixed=ENDS)
    refuses(ConfigError, "needs its temperature", rom.Heat, expansion=12e-6)
    refuses(ConfigError, "needs its expansion", rom.Heat, temperature=20.0)
    for wrong, match in (
        (rom.Heat({"blade": 1e-5}, 20.0), r"expansion names the region 'blade'; .*\['body'\]"),
        (rom.Heat(1e-5, {"rim": 20.0}), "temperature names the region 'rim'"),
        (rom.Heat(1e-5, np.ones(7)), r"shape \(7,\)"),
        (rom.Heat(1e-5, lambda x: x), "needed is"),
    ):
        refuses(ConfigError, match, rom.heated, bar, wrong)
    refuses(ConfigError, r"temperature = nan must be .* a finite number", rom.Heat, 1e-5, np.nan)
    heat, bare = rom.Heat(1e-5, 20.0), replace(bar, stresses=None)
    refuses(InterfaceError, "no interface 'rim'", rom.heated, bar, heat, fixed="rim")
    refuses(ConfigError, "no finite elements", rom.heated, bare, heat)


def test_more_of_one_heat_is_another_factor(bar):
    """The factor of buckling is inverse to the heat; and K + factor K_geo is singular."""
    once, twice = (rom.thermal_buckling(bar, heat(k * EULER), fixed=ENDS) for k in (1, 2))
    assert_allclose(once, 2 * twice, rtol=1e-9)
    _, K, K_geo, held = _stressed(bar, heat(EULER), ENDS)
    loose = np.setdiff1d(np.arange(bar.n_dofs), held)
    K, K_geo = (A[loose][:, loose].toarray() for A in (K, K_geo))
    lowest = eigvalsh(K + once * K_geo, K, subset_by_index=(0, 0))[0]
    assert abs(lowest) < 1e-7
