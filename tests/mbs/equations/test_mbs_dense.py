"""Dense systems of kernels against NumPy: all remainders of a panel, zeros, pivots, blocks."""

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

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
