"""Sectors of finite elements against the mesh of the whole wheel."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.long import MESHED
from cases.refusals import refuses
from cases.wheels import bladed_model, gathered, ring_frequency
from rom.errors import InterfaceError

pytestmark = MESHED
N = 6
SIZES = {"degree": 1, "cells": (4, 2, 2, 2)}


@pytest.fixture(scope="module")
def model():
    return bladed_model(N, **SIZES)


@pytest.mark.parametrize("fixed", [(), ("bore",)])
def test_sectors_of_bricks_are_the_meshed_wheel(model, fixed):
    sector = rom.CyclicSector.from_model(model, fixed=fixed)
    assert (sector.n_sectors, sector.matching) == (N, True)
    exact = rom.modes(bladed_model(N, N, **SIZES), 24, fixed=fixed).omega
    n_rigid = 0 if fixed else 6
    found = gathered(sector, 6)[:24]
    assert np.all(found[:n_rigid] == 0.0)
    assert_allclose(found[n_rigid:], exact[n_rigid:], rtol=1e-8)


def test_faces_may_be_curved():
    """Where a wheel is cut does not matter, if all sectors are cut alike."""
    cut = {"cells": (12, 2, 2, 2), "degree": 1}
    models = (bladed_model(N, twist=twist, **cut) for twist in (0.0, 0.02))
    sectors = (rom.CyclicSector.from_model(each, fixed=("bore",)) for each in models)
    straight, skew = (gathered(sector, 4)[:12] for sector in sectors)
    assert_allclose(skew, straight, rtol=0.02)


def test_sectors_whose_faces_have_different_nodes():
    sizes = {"cells": (3, 2, 2, 2), "blade": (1, 2), "degree": 2}
    models = (bladed_model(N, offset=offset, **sizes) for offset in (0.0, 0.12))
    plain, shifted = (rom.CyclicSector.from_model(model, fixed=("bore",)) for model in models)
    assert (plain.matching, shifted.matching) == (True, False)
    assert_allclose(gathered(shifted, 5)[:20], gathered(plain, 5)[:20], rtol=1e-3)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_a_thin_solid_ring(n):
    """In its plane, Love's ring of rectangular section; bricks between 72 corners."""
    h, R, E, rho = 0.002, 0.1, 200e9, 7800.0
    inner, outer, steel = R - h / 2, R + h / 2, rom.Material(E=E, nu=0.0, rho=rho)
    sizes = {"bore": inner, "rim": outer, "tip": outer, "width": 0.01, "cells": (6, 1, 0, 1)}
    sector = rom.CyclicSector.from_model(bladed_model(12, material=steel, **sizes))
    exact = ring_frequency(n, E * h**2 / 12, rho, R)
    found = rom.cyclic_modes(sector, n, 6).omega
    assert_allclose(found[np.argmin(abs(found - exact))], exact, rtol=5e-3)


def test_the_cyclic_model_carries_masses(model):
    carried = replace(model, attachments=(rom.Attachment("bore", 0.1),))
    sector = rom.CyclicSector.from_model(carried)
    R = sector.rigid(0)[:, 0].real
    assert_allclose(R @ sector.M @ R, model.mass() + 0.1, rtol=1e-9)


def bladed_disk(**sizes):
    """The geometry of the demo, coarse."""
    titanium = rom.Material(E=114e9, nu=0.33, rho=4430.0)
    return rom.fe.model("meshes/bladed_disk.geo", material=titanium, parameters=sizes)


def test_the_geometry_is_a_sector_with_a_blade():
    """Volume by hand: a disk with a bore and blades, each a skinned twisted bar."""
    model = bladed_disk(lc=0.011, lc_blade=0.008)
    sector = rom.CyclicSector.from_model(model)
    assert (sector.n_sectors, sector.matching) == (24, True)
    assert set(model.regions) == {"disk", "blade"}
    disk = np.pi * (0.15**2 - 0.06**2) * 0.024 / 24
    share = np.linspace(0, 1, 2001)[1::2]
    blade = 0.07 * ((0.022 - 0.004 * share) * (0.004 - 0.002 * share)).mean()
    assert_allclose(model.mass(), 4430.0 * (disk + blade), rtol=3e-3)
    # half a turn about the line in its middle maps this sector onto itself: two would fit
    said, wrong = r"axis \[1\.0, 0\.0, 0\.0\] .* axis=… and at=…", {"axis": (1, 0, 0)}
    refuses(InterfaceError, said, rom.CyclicSector.from_model, model, fixed=("bore",), **wrong)


@pytest.mark.long
@pytest.mark.parametrize("fixed", [pytest.param((), marks=pytest.mark.long), ("bore",)])
def test_a_reduced_sector_of_few_dofs_has_ten_families(fixed):
    model = bladed_disk(N=12, lc=0.013, lc_blade=0.011)
    sector = rom.CyclicSector.from_model(model, fixed=fixed)
    small = rom.reduce_sector(sector, n_modes=60, functions=rom.Polynomial(7))
    assert small.free.size < 0.05 * sector.free.size
    for n in sector.diameters:
        full, found = (rom.cyclic_modes(s, n, 10).omega for s in (sector, small))
        elastic = full > 0
        assert np.all(found[~elastic] == 0.0)
        assert_allclose(found[elastic], full[elastic], rtol=1e-3, err_msg=f"n = {n}")
        assert np.all(found[elastic] > full[elastic] * (1 - 1e-9))
