"""The bound of the probability that a search has missed a mode, against searches that do."""

import numpy as np
import pytest
from numpy.polynomial import Chebyshev
from numpy.testing import assert_allclose
from scipy.stats import chi2

from rom.eigen import completeness
from rom.eigen.completeness import miss_probability, unseen_part

BLOCK = 8


def searched(theta, start, n_blocks):
    """(T, R, residual) of B = diag(theta) on the powers of a start block, all of it orthogonal."""
    V, first = np.linalg.qr(start)
    T = np.zeros((0, 0))
    for _ in range(n_blocks):
        W = theta[:, None] * V[:, -BLOCK:]
        H = V.T @ W
        for _ in range(2):
            W = W - V @ (V.T @ W)
        k = T.shape[0]
        T = np.block([[T, H[:k]], [H[:k].T, 0.5 * (H[k:] + H[k:].T)]])
        W, R = np.linalg.qr(W)
        V = np.hstack([V, W])
    lam, S = np.linalg.eigh(T)
    residual = np.linalg.norm(R @ S[-BLOCK:, ::-1], axis=0) / np.abs(lam[::-1])
    return T, first, residual


def body(n, growth, rng):
    """Eigenvalues of K^-1 M of a body: lambda grows with a power of its number, and at random."""
    return 1.0 / np.sort((1.0 + np.arange(n)) ** growth * rng.uniform(0.8, 1.25, n))


def found(theta, T, residual, m):
    """Whether the leading Ritz values, up to the m-th eigenvalue, are the eigenvalues."""
    ritz = np.linalg.eigvalsh(T)[::-1]
    return np.allclose(ritz[:m], theta[:m], rtol=1e-5)


@pytest.mark.parametrize("growth", [2.0 / 3.0, 1.0, 2.0])
def test_what_is_called_sure_is_complete(growth):
    rng, sure = np.random.default_rng(7), 0
    for _ in range(12):
        theta = body(600, growth, rng)
        start = rng.standard_normal((600, BLOCK))
        for n_blocks in range(6, 22, 2):
            T, R, residual = searched(theta, start, n_blocks)
            if miss_probability(T, R, residual, 12) <= 1e-9:
                assert found(theta, T, residual, 12)
                sure += 1
    assert sure > 12


def n_found(theta, residual, m):
    """How many Ritz values count as found: by residuals over distances from the m-th, or 1e-4."""
    apart = np.where(theta < theta[m - 1], theta[m - 1] / theta - 1.0, 0.0)
    return np.flatnonzero(residual > 1e-3 * np.maximum(apart, 1e-4))[0]


@pytest.mark.parametrize(("growth", "n_blocks"), [(2 / 3, 22), (1.0, 18), (2.0, 14), (2.0, 22)])
def test_what_a_search_has_missed_had_no_larger_part_in_the_start(growth, n_blocks):
    """Starts that see one mode ever less, until it is missed and all others are found.

    Without the angle to which modes are known the bound would say less.
    """
    rng, missed = np.random.default_rng(1), 0
    theta = body(500, growth, rng)
    start = rng.standard_normal((500, BLOCK))
    for share in 10.0 ** -np.arange(4.0, 60.0, 2.0):
        start[9] *= share / np.linalg.norm(start[9])
        T, R, residual = searched(theta, start, n_blocks)
        chance = miss_probability(T, R, residual, 10)
        if chance < 1.0 and not found(theta, T, residual, 10):
            k = n_found(np.linalg.eigvalsh(T)[::-1], residual, 10)
            assert chi2.ppf(chance / (3 * (k + 1)), 6) / 3 > share**2
            missed += 1
    assert missed > 5


@pytest.mark.parametrize("n_blocks", [9, 13])
def test_the_bound_is_that_of_the_page(n_blocks):
    rng = np.random.default_rng(9)
    theta, m = body(300, 1.0, rng), 4
    T, R, residual = searched(theta, rng.standard_normal((300, BLOCK)), n_blocks)
    ritz, S = (x[..., ::-1] for x in np.linalg.eigh(T))
    k = n_found(ritz, residual, m)
    found_part, c2 = S[:, :k], np.inf
    W = np.vstack([R, np.zeros((T.shape[0] - BLOCK, BLOCK))])
    for a in range(8):
        left = W - found_part @ (found_part.T @ W)
        p = ritz[m - 1] ** a * Chebyshev.basis(n_blocks - 1 - a)(2 * ritz[m - 1] / ritz[k] - 1)
        gap = ritz[m - 1] - ritz[k]
        c2 = min(c2, ritz[k] / gap * np.linalg.norm(left, 2) ** 2 / p**2)
        W = T @ W
    n, part = unseen_part(T, R, residual, m)
    assert n == k and 0.0 < c2 < 1e-6
    assert_allclose(part, c2, rtol=1e-6)


def test_a_part_is_as_improbable_as_normal_numbers_say(monkeypatch):
    """Three rows of eight: a hundred times the bound over a variance of 0.05, or the angle 1e-3."""
    for part, c2 in ((1e-3, 2.0), (1e-12, 2e-5), (0.0, 2e-5), (np.inf, np.inf)):
        monkeypatch.setattr(completeness, "unseen_part", lambda *_, part=part: (20, part))
        chance = miss_probability(np.eye(8), np.eye(8), np.zeros(8), 4)
        assert_allclose(chance, min(1.0, 21 * 3 * chi2.cdf(3 * c2, 6)), rtol=1e-9)


@pytest.mark.parametrize("share", [1e-2, 1e-4, 1e-6])
def test_misses_are_as_rare_as_is_said(share):
    """Starts that hardly see one mode miss it; a Gaussian block is as bad as rarely as that."""
    rng, said = np.random.default_rng(3), []
    theta = body(500, 1.0, rng)
    for n_blocks in range(5, 18):
        start = rng.standard_normal((500, BLOCK))
        start[4] *= share / np.linalg.norm(start[4])
        T, R, residual = searched(theta, start, n_blocks)
        if not found(theta, T, residual, 10):
            said.append(miss_probability(T, R, residual, 10))
    # P(chi^2_6 <= share^2), the chance of such a start
    assert not said or min(said) >= (0.5 * share**2) ** 3 / 6


@pytest.mark.parametrize("members", [3, 8, 40])
def test_many_members_of_one_frequency_are_left_to_a_count_and_a_pair_is_not(members):
    rng = np.random.default_rng(5)
    theta = body(400, 1.0, rng)
    theta[3 : 3 + members] = theta[3]
    theta = np.sort(theta)[::-1]
    start = rng.standard_normal((400, BLOCK))
    for n_blocks in range(4, 24, 4):
        T, R, residual = searched(theta, start, n_blocks)
        assert miss_probability(T, R, residual, 5) == 1.0
    rng = np.random.default_rng(6)
    theta = body(400, 1.0, rng)
    theta[4] = theta[3]
    T, R, residual = searched(theta, rng.standard_normal((400, BLOCK)), 16)
    assert miss_probability(T, R, residual, 10) < 1e-9
    assert found(theta, T, residual, 10)


def test_a_narrow_gap_proves_less():
    rng = np.random.default_rng(8)
    start = rng.standard_normal((400, BLOCK))
    chances = []
    for gap in (0.5, 0.2, 0.1):
        theta = 1.0 / np.concatenate([[1.0], np.linspace(1.0 + gap, 60.0, 399)])
        T, R, residual = searched(theta, start, 12)
        residual[1:] = 1.0  # only the first counts as found
        chances.append(miss_probability(T, R, residual, 1))
    assert chances == sorted(chances)
    assert chances[0] < 1e-3 * chances[1] < 1e-6 * chances[2]
