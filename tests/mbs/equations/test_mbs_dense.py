"""Dense systems of kernels against NumPy: all remainders of a panel, zeros, pivots, blocks."""

from itertools import pairwise

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose
from scipy.sparse import csc_matrix

from rom.mbs.equations.sparse_solve import signature
from rom.mbs.kernels.algebra import PANEL_WIDTH, back_substitute, factorise


@njit
def solve(A, n, pivot, x):
    if not factorise(A, n, pivot):
        return False
    back_substitute(A, n, pivot, x)
    return True


def solved(A, b, n):
    """The solution with the leading (n, n) block, and what else the array holds afterwards."""
    work, x = A.copy(), b[:n].copy()
    assert solve(work, n, np.zeros(n, dtype=np.int64), x)
    return x, work


@pytest.mark.parametrize("n", [*range(1, 3 * PANEL_WIDTH + 2), 100])
@pytest.mark.parametrize("share", [1.0, 0.15])
def test_solutions_are_those_of_numpy(n, share):
    rng = np.random.default_rng(n)
    A = rng.standard_normal((n + 3, n + 3)) * (rng.random((n + 3, n + 3)) < share)
    A[:n, :n] += np.roll(np.diag(np.full(n, 3.0)), 1, axis=0)  # pivots off the diagonal
    b = rng.standard_normal(n + 3)
    x, work = solved(A, b, n)
    condition = np.linalg.cond(A[:n, :n])
    expected = np.linalg.solve(A[:n, :n], b[:n])
    assert_allclose(x, expected, atol=1e-13 * condition * np.abs(expected).max())
    assert np.array_equal(work[n:], A[n:])
    assert np.array_equal(work[:, n:], A[:, n:])


@pytest.mark.parametrize("column", [0, 7, 8, 18])
def test_a_pivot_that_vanishes_is_said(column):
    A = np.random.default_rng(1).standard_normal((19, 19))
    A[:, column] = 0.0
    assert not solve(A, 19, np.zeros(19, dtype=np.int64), np.ones(19))
    A[3, 3] = np.nan
    assert not solve(A, 19, np.zeros(19, dtype=np.int64), np.ones(19))


def random_symmetric(rng, n_groups, *, massless):
    """A sparse matrix of groups of three to five unknowns, between them ones without a diagonal."""
    sizes = rng.integers(3, 6, n_groups)
    sizes[1::3] = rng.integers(1, 3, sizes[1::3].size)
    first = np.concatenate([[0], np.cumsum(sizes)])
    groups = [np.arange(a, b) for a, b in pairwise(first)]
    A = np.zeros((first[-1],) * 2)
    for k, rows in enumerate(groups):
        light = massless and k % 3 == 1
        others = [j for j in (k - 1, (k + 1) % n_groups) if light or rng.random() < 0.7]
        for j in others if light else [*others, k]:
            block = rng.normal(size=(sizes[k], sizes[j])) * 10.0 ** rng.uniform(-2, 2)
            A[np.ix_(rows, groups[j])] += block
    A = A + A.T
    for rows in groups[1::3] if massless else ():  # almost without: pivots that nothing survives
        A[rows, rows] = 1e-13
    return A, groups


@pytest.mark.parametrize("massless", [False, True])
@pytest.mark.parametrize("seed", range(12))
def test_signs_of_eigenvalues_are_counted_in_any_order(seed, massless):
    rng = np.random.default_rng(seed)
    A, groups = random_symmetric(rng, 40, massless=massless)
    exact = np.linalg.eigvalsh(A)
    assert np.abs(exact).min() > 1e-8 * np.abs(exact).max()  # none of them is zero
    for order in (groups, groups[::-1], [groups[k] for k in rng.permutation(len(groups))]):
        found = signature(csc_matrix(A), order)
        assert found == (np.sum(exact < 0), 0, np.sum(exact > 0))


@pytest.mark.parametrize("copies", [0, 1, 5])
def test_constraints_that_repeat_others_are_counted_as_zero(copies):
    rng = np.random.default_rng(copies)
    G = rng.normal(size=(7, 30))
    G = np.vstack([G, rng.normal(size=(copies, 7)) @ G])
    A = np.block([[np.diag(rng.uniform(1, 9, 30)), G.T], [G, np.zeros((len(G),) * 2)]])
    groups = [np.arange(a, a + 5) for a in range(0, 30, 5)] + [np.arange(30, len(A))]
    assert signature(csc_matrix(A), groups, 1e-10) == (7, copies, 30)
