"""Sectors of finite elements against the mesh of the whole wheel."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.wheels import MARKS, bladed_model, gathered, ring_frequency
from rom.errors import InterfaceError

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = MARKS
N = 6
SIZES = {"degree": 1, "cells": (4, 2, 2, 2)}


@pytest.fixture(scope="module")
def model():
    return bladed_model(N, **SIZES)


@pytest.fixture(scope="module")
def wheel():
    """The same wheel, all sectors meshed and assembled by dolfinx."""
    return bladed_model(N, N, **SIZES)


@pytest.mark.parametrize("fixed", [(), ("bore",)])
def test_sectors_of_bricks_are_the_meshed_wheel(model, wheel, fixed):
    sector = rom.CyclicSector.from_model(model, fixed=fixed)
    assert (sector.n_sectors, sector.matching) == (N, True)
    exact = rom.modes(wheel, 24, fixed=fixed).omega
    n_rigid = 0 if fixed else 6
    found = gathered(sector, 6)[:24]
    assert np.all(found[:n_rigid] == 0.0)
    assert_allclose(found[n_rigid:], exact[n_rigid:], rtol=1e-8)


def test_faces_may_be_curved(wheel):
    """Where a wheel is cut does not matter, if all sectors are cut alike."""
    cut = {"cells": (12, 2, 2, 2), "degree": 1}
    straight, skew = (
        gathered(rom.CyclicSector.from_model(bladed_model(N, twist=t, **cut), fixed=("bore",)), 4)
        for t in (0.0, 0.02)
    )
    assert_allclose(skew[:12], straight[:12], rtol=0.02)


def test_sectors_whose_faces_have_different_nodes():
    """Tied by interpolation: 1e-3 from the wheel whose nodes meet."""
    sizes = {"cells": (3, 2, 2, 2), "blade": (1, 2), "degree": 2}
    plain, shifted = (
        rom.CyclicSector.from_model(bladed_model(N, offset=offset, **sizes), fixed=("bore",))
        for offset in (0.0, 0.12)
    )
    assert (plain.matching, shifted.matching) == (True, False)
    assert_allclose(gathered(shifted, 5)[:20], gathered(plain, 5)[:20], rtol=1e-3)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_a_thin_solid_ring(n):
    """In its plane, Love's ring of rectangular section; bricks between 72 corners."""
    h, R, E, rho = 0.002, 0.1, 200e9, 7800.0
    model = bladed_model(
        12, bore=R - h / 2, rim=R + h / 2, tip=R + h / 2, width=0.01, cells=(6, 1, 0, 1),
        material=rom.Material(E=E, nu=0.0, rho=rho),
    )  # fmt: skip
    sector = rom.CyclicSector.from_model(model)
    exact = ring_frequency(n, E * h**2 / 12, rho, R)
    found = rom.cyclic_modes(sector, n, 6).omega
    assert_allclose(found[np.argmin(abs(found - exact))], exact, rtol=5e-3)


def test_the_cyclic_model_carries_masses(model):
    """A point mass on the bore of each sector joins the wheel."""
    from dataclasses import replace

    carried = replace(model, attachments=(rom.Attachment("bore", 0.1),))
    sector = rom.CyclicSector.from_model(carried)
    R = sector.rigid(0)[:, 0].real
    assert_allclose(R @ sector.M @ R, model.mass() + 0.1, rtol=1e-9)


@pytest.fixture(scope="module")
def bladed_disk():
    """The geometry of the demo, coarse."""
    return rom.fe.model(
        "meshes/bladed_disk.geo", material=rom.Material(E=114e9, nu=0.33, rho=4430.0),
        parameters={"lc": 0.011, "lc_blade": 0.008},
    )  # fmt: skip


def test_the_geometry_is_a_sector_with_a_blade(bladed_disk):
    """Volume by hand: a disk with a bore and blades, each a skinned twisted bar."""
    sector = rom.CyclicSector.from_model(bladed_disk)
    assert (sector.n_sectors, sector.matching) == (24, True)
    assert set(bladed_disk.regions) == {"disk", "blade"}
    disk = np.pi * (0.15**2 - 0.06**2) * 0.024 / 24
    share = np.linspace(0, 1, 2001)[1::2]
    blade = 0.07 * ((0.022 - 0.004 * share) * (0.004 - 0.002 * share)).mean()
    assert_allclose(bladed_disk.mass(), 4430.0 * (disk + blade), rtol=3e-3)


def test_an_axis_through_the_sector_is_no_axis_of_its_wheel(bladed_disk):
    """Half a turn about the line in its middle maps this sector onto itself: two would fit."""
    with pytest.raises(InterfaceError, match=r"axis \[1\.0, 0\.0, 0\.0\] .* axis=… and at=…"):
        rom.CyclicSector.from_model(bladed_disk, axis=(1, 0, 0), fixed=("bore",))


@pytest.mark.long
@pytest.mark.parametrize("fixed", [pytest.param((), marks=pytest.mark.long), ("bore",)])
def test_a_reduced_sector_of_few_dofs_has_ten_families(fixed):
    """Polynomials on the cyclic face, under 5 % of the dofs: 0.1 % for all nodal diameters."""
    model = rom.fe.model(
        "meshes/bladed_disk.geo", material=rom.Material(E=114e9, nu=0.33, rho=4430.0),
        parameters={"N": 12, "lc": 0.013, "lc_blade": 0.011},
    )  # fmt: skip
    sector = rom.CyclicSector.from_model(model, fixed=fixed)
    small = rom.reduce_sector(sector, n_modes=60, functions=rom.Polynomial(7))
    assert small.free.size < 0.05 * sector.free.size
    for n in sector.diameters:
        full, found = (rom.cyclic_modes(s, n, 10).omega for s in (sector, small))
        elastic = full > 0
        assert np.all(found[~elastic] == 0.0)
        assert_allclose(found[elastic], full[elastic], rtol=1e-3, err_msg=f"n = {n}")
        assert np.all(found[elastic] > full[elastic] * (1 - 1e-9))
