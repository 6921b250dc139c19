"""Modes up to a frequency: none missed, and every one within the bound stated with it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.sparse import block_diag, csr_matrix, diags

import rom
from benchmarks.models import bar
from cases.long import few
from cases.refusals import refuses
from rom.eigen import band
from rom.eigen.band import lehmann_bounds, substructured_modes
from rom.eigen.scipy import SciPyOperators
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, InterfaceError, ModelError, ModesMissedError, SolverError

ROUND_OFF = 1e-10  # of frequencies of dense solutions, 1e-16 times the ratio of the extremes


def body(size, cells, held=False):
    model = bar(size, cells)
    if not held:
        return model.K, model.M, rigid_motions(model.points)
    root = 3 * model.interfaces["root"].nodes[:, None] + np.arange(3)
    free = np.setdiff1d(np.arange(model.n_dofs), root)
    return model.K[free][:, free], model.M[free][:, free], None


def exact(K, M, rigid):
    lam = eigh(K.toarray(), M.toarray(), eigvals_only=True)
    lam[: 0 if rigid is None else 6] = 0.0
    return np.sqrt(lam)


def certain(K, M, rigid, f_max, **more):
    """The modes up to a frequency, with all that is said of them compared with LAPACK."""
    found = substructured_modes(K, M, f_max, rigid=rigid, **more)
    omega = exact(K, M, rigid)
    asked = np.count_nonzero(omega <= 2 * np.pi * f_max)
    assert found.omega.size >= asked
    assert np.all((1 - found.error[asked:]) * found.omega[asked:] <= 2 * np.pi * f_max)
    omega = omega[: found.omega.size]
    assert np.all(found.omega >= (1 - ROUND_OFF) * omega)
    assert np.all((1 - found.error) * found.omega <= (1 + ROUND_OFF) * omega)
    assert found.error.max(initial=0.0) <= more.get("tol", 1e-3)
    assert_allclose(found.shapes.T @ (M @ found.shapes), np.eye(omega.size), atol=1e-9)
    energy = np.einsum("ij,ij->j", found.shapes, K @ found.shapes)
    round_off = 1e-15 * (K.diagonal() / M.diagonal()).max()
    assert_allclose(energy, found.omega**2, rtol=1e-8, atol=round_off)
    return found


@pytest.mark.parametrize("seed", few(6, range(12)))
def test_bodies_of_any_size_keep_their_bounds(seed):
    rng = np.random.default_rng(seed)
    cells = tuple(rng.integers(1, [7, 3, 3], endpoint=True))
    K, M, rigid = body(tuple(rng.uniform(0.05, 0.3, 3)), cells, held=seed % 2 == 0)
    omega = exact(K, M, rigid)
    last = rng.integers(8, max(9, omega.size // 8))
    f_max = 0.5 * (omega[last] + omega[last + 1]) / (2 * np.pi)
    certain(K, M, rigid, f_max, tol=10.0 ** rng.uniform(-5, -1))


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize(("size", "cells"), [((0.3, 0.05, 0.05), (6, 2, 2)), ((1,) * 3, (3,) * 3)])
def test_symmetric_bodies_keep_all_their_equal_modes(size, cells, held):
    K, M, rigid = body(size, cells, held)
    omega = exact(K, M, rigid)
    found = certain(K, M, rigid, omega[36] * 1.002 / (2 * np.pi))
    apart = np.diff(found.omega[6:]) / found.omega[7:]
    assert np.count_nonzero(apart < 2e-3) >= 5


def test_equal_bodies_have_every_mode_twice_and_a_stiff_spring_moves_none_out_of_its_bound():
    K, M, _ = body((0.2, 0.05, 0.04), (4, 2, 1), held=True)
    stiff = np.zeros(K.shape[0])
    stiff[[100, 200]] = 1e14
    certain(csr_matrix(K + diags(stiff)), M, None, 3e4)
    K, M = block_diag([K] * 2, "csr"), block_diag([M] * 2, "csr")
    found = certain(K, M, None, exact(K, M, None)[25] * 1.001 / (2 * np.pi))
    assert_allclose(found.omega[::2], found.omega[1::2], rtol=2e-3)


def test_rigid_motions_stay_exact():
    K, M, rigid = body((0.2, 0.05, 0.04), (4, 2, 1))
    found = substructured_modes(K, M, 2e4, rigid=rigid)
    assert np.all(found.omega[:6] == 0.0) and np.all(found.error[:6] == 0.0)
    assert found.omega[6] > 0.0
    R, Phi = rigid, found.shapes[:, :6]
    assert_allclose(Phi @ (Phi.T @ (M @ R)), R, atol=1e-10)


def test_a_band_without_modes_is_empty_and_a_wide_one_has_all_of_a_small_body():
    assert certain(*body((0.2, 0.05, 0.04), (4, 2, 1)), 1e-3).omega.size == 6
    assert certain(*body((0.2, 0.05, 0.04), (4, 2, 1), held=True), 10.0).omega.size == 0
    K, M, rigid = body((0.2, 0.05, 0.04), (2, 1, 1), held=True)
    assert certain(K, M, rigid, 1e7).omega.size == K.shape[0]


@pytest.mark.parametrize("seed", range(5))
def test_lower_bounds_are_bounds_and_sharp(seed):
    rng = np.random.default_rng(seed)
    lam = np.sort(rng.uniform(1, 30, 40))
    lam[13:] += 1.0
    rho = 0.5 * (lam[12] + lam[13])
    X = np.linalg.qr(np.eye(40)[:, :16] + 0.001 * rng.normal(size=(40, 16)))[0]
    theta, C = np.linalg.eigh(X.T @ (lam[:, None] * X))
    X = X @ C
    rest = lam[:, None] * X - X * theta
    lower = lehmann_bounds(theta, rest.T @ rest, rho)
    assert np.all(lower <= lam[:13] + 1e-12)
    assert np.all(lower >= lam[:13] - 0.5)
    assert_allclose(lehmann_bounds(lam[:16], np.zeros((16, 16)), rho), lam[:13])


def test_the_tool_takes_a_band_in_place_of_a_number():
    model = bar((0.3, 0.07, 0.05), (6, 2, 1))
    for fixed in ((), ("root",), {"root": "xyz", "tip": "yz"}):
        by_number = rom.modes(model, 40, fixed=fixed)
        f_max = float(by_number.frequencies[30])
        by_band = rom.modes(model, f_max=f_max, fixed=fixed)
        n = np.count_nonzero(by_number.frequencies <= f_max)
        assert by_band.omega.size in (n, n + 1)
        n = by_band.omega.size
        gap = by_band.omega - by_number.omega[:n]
        assert np.all(gap <= by_band.error * by_band.omega + 1e-6)
        assert np.all(gap >= -1e-6 * by_number.omega[:n])
        assert by_band.residual.shape == (n,) and "error below" in by_band._repr_html_()
    assert by_number.error is None and by_number.residual.max() < 1e-6


def test_what_does_not_suit_is_refused():
    for wrong in ({"n": 3, "f_max": 100.0}, {}):
        refuses(ConfigError, r"n\b|f_max", rom.modes, bar((0.2, 0.05, 0.04), (2, 1, 1)), **wrong)
    K, M, rigid = body((0.2, 0.05, 0.04), (3, 2, 1))
    refuses((InterfaceError, ModelError), "rigid motion", substructured_modes, K, M, 1e4)
    refuses(ConfigError, "tol = 2", substructured_modes, K, M, 1e4, rigid=rigid, tol=2)
    refuses(SolverError, "are known within", substructured_modes, K, M, 2e4, rigid=rigid, tol=1e-15)
    two = block_diag([K] * 2, "csr"), block_diag([M] * 2, "csr")
    with pytest.raises(ModelError, match=r"6 more motions without stiffness .* moves most"):
        substructured_modes(*two, 1e4, rigid=np.vstack([rigid] * 2))


def test_a_mode_that_is_missed_is_said_and_before_too_little_memory(monkeypatch):
    K, M, rigid = body((0.2, 0.05, 0.04), (3, 2, 1))
    count = SciPyOperators.count_below
    monkeypatch.setattr(SciPyOperators, "count_below", lambda ops, s, *a: count(ops, s, *a) + 1)
    refuses(ModesMissedError, "counts", substructured_modes, K, M, 1e4, rigid=rigid)
    monkeypatch.setattr(band, "free_bytes", lambda: 1e3)
    too_little = r"takes .* GiB; 9.31e-07 GiB are free"
    refuses(rom.ResourceError, too_little, substructured_modes, K, M, 2e4, rigid=rigid)
