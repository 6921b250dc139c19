"""Matrices people bring: what is wrong with them is named, and repeated modes stay together."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import rom
from benchmarks.models import KINDS
from benchmarks.models import bar as bar_of
from rom.errors import QualityGateError, RomWarning


@pytest.fixture(scope="module")
def square():
    """A bar of square section: its bending modes come in pairs."""
    return bar_of((0.5, 0.05, 0.05), (12, 1, 1))


def reduced(model, n_modes=4):
    return rom.reduce(model, method=rom.CraigBampton(n_modes), interfaces=KINDS, certify=False)


def test_a_negative_stiffness_is_named(square):
    with pytest.raises(QualityGateError, match=r"K has \d+ negative eigenvalues"):
        reduced(replace(square, K=-square.K))


def test_a_mass_without_inertia_in_some_motion_is_named(square):
    M = square.M.copy()
    lam = 1.5 * M.diagonal().max()
    row, column = 60, 66  # two dofs along one axis: the difference of their motions gets -lam
    M = M + csr_matrix((np.full(2, lam), ([row, column], [column, row])), shape=M.shape)
    with pytest.raises(QualityGateError, match=r"M has \d+ negative eigenvalues"):
        reduced(replace(square, M=M))


def test_a_dof_without_mass_is_named(square):
    M = square.M.tolil()
    M[60] = 0.0
    M[:, 60] = 0.0
    with pytest.raises(QualityGateError, match="M has 0 on the diagonal of dof 60"):
        reduced(replace(square, M=M.tocsr()))


def test_a_repeated_frequency_is_kept_whole(square):
    pairs = reduced(square, 5).frequencies(4, fixed=tuple(KINDS))
    assert pairs[0] == pytest.approx(pairs[1], rel=1e-9)
    with pytest.warns(RomWarning, match="2 fixed-interface modes are kept instead of 1"):
        body = reduced(square, 1)
    assert body.n_modes == 6 + 2
    assert body.frequencies(fixed=tuple(KINDS)) == pytest.approx(pairs[:2], rel=1e-9)
