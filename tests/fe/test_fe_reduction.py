"""The connecting rod, from its geometry to a reduced body that stands for it."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.paths import ROOT
from cases.solid import STEEL

pytestmark = pytest.mark.fenicsx
ROD = ROOT / "meshes" / "connecting_rod.geo"
KINDS = {"pin_a": "rbe2", "pin_b": "rbe2"}
SUPPORTS = [(), ("pin_a",), ("pin_b",), ("pin_a", "pin_b")]


@pytest.fixture(scope="module")
def model():
    return rom.fe.model(ROD, material=STEEL, parameters={"lc": 8e-3})


@pytest.fixture(scope="module")
def full(model):
    """First six elastic frequencies of the full model in every support, bores rigid [Hz]."""
    found = {}
    for fixed in SUPPORTS:
        n_rigid = 0 if fixed else 6
        modes = rom.modes(model, n_rigid + 6, fixed=fixed, interfaces=KINDS)
        found[fixed] = modes.frequencies[n_rigid:]
    return found


@pytest.fixture(scope="module")
def body(model):
    given = {"interfaces": KINDS, "reference": "pin_a", "certify": False}
    return cache(lambda n_modes: rom.reduce(model, method=rom.CraigBampton(n_modes), **given))


def frequencies(body, fixed):
    n_rigid = 0 if fixed else 6
    return body.frequencies(n_rigid + 6, fixed=fixed)[n_rigid:]


@pytest.mark.parametrize("fixed", SUPPORTS)
def test_twenty_modes_give_six_frequencies_within_a_tenth_of_a_per_cent(body, full, fixed):
    error = frequencies(body(20), fixed) / full[fixed] - 1
    assert error.max() < 1e-3 and error.min() > -1e-9


@pytest.mark.long
@pytest.mark.parametrize("fixed", [(), ("pin_b",)])
def test_every_mode_more_lowers_the_frequencies_towards_the_full_ones(body, full, fixed):
    steps = np.array([frequencies(body(n), fixed) for n in (6, 12, 24, 48)])
    assert (np.diff(steps, axis=0) < 1e-9 * steps[1:]).all()
    assert_allclose(steps[-1], full[fixed], rtol=3e-4)
