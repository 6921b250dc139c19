"""Craig-Bampton against closed forms, published tables and the full model."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from cases.beam import CANTILEVER, ENDS, FREE_FREE, PINNED, hermite_beam
from cases.refusals import refused
from cases.solid import chain
from rom.errors import ConfigError, InterfaceError, QualityGateError, SolverError
from rom.reduction.bases.fixed_interface import craig_bampton


def test_fixed_interface_frequencies_are_exact():
    K, M, exact = chain(60)
    basis = craig_bampton(K, M, [0, 59], n_modes=8)
    assert_allclose(basis.omega, exact[:8], rtol=1e-9)


@pytest.mark.parametrize("omega_fixed", [1.0, 10.0, 2 * np.pi])
@pytest.mark.parametrize("n", [60, 700])
def test_no_frequency_is_special(n, omega_fixed):
    """A penalty or shift that hides dofs at some frequency loses the mode there."""
    K, M, exact = chain(n)
    basis = craig_bampton(K * (omega_fixed / exact[2]) ** 2, M, [0, n - 1], n_modes=5)
    assert_allclose(basis.omega, exact[:5] * omega_fixed / exact[2], rtol=1e-9)


def test_constraint_modes_carry_rigid_motion():
    K, M, _ = chain(60)
    basis = craig_bampton(K, M, [0, 59], n_modes=3)
    assert_allclose(basis.Psi[:, :2].sum(axis=1), 1.0, rtol=1e-10)  # both ends moved by one
    assert_allclose(basis.project(K)[:2, 2:], 0.0, atol=1e-8)  # K-orthogonal to normal modes


@pytest.mark.parametrize("m", [2, 5, 10, 58])
def test_reduced_frequencies_bound_the_full_ones_from_above(m):
    K, M, _ = chain(60)
    basis = craig_bampton(K, M, [0, 59], n_modes=m)
    full = eigh(K.toarray(), M.toarray(), eigvals_only=True)
    reduced = eigh(basis.project(K), basis.project(M), eigvals_only=True)
    assert np.all(reduced >= full[: m + 2] - 1e-9 * full[-1])
    if m == 58:  # a square transformation changes nothing
        assert_allclose(reduced, full, atol=1e-9 * full[-1])


def test_published_four_mass_chain():
    """Reduced matrices of the example in the documentation of ModelReduction.jl."""
    K = np.array([[2.0, -1, 0, 0], [-1, 2, -1, 0], [0, -1, 2, -1], [0, 0, -1, 1]])
    M = np.diag([2.0, 2, 2, 1])
    basis = craig_bampton(K, M, [3], n_modes=1)
    M_r, K_r = basis.project(M), basis.project(K)
    assert_allclose(np.abs(M_r), [[2.75, 1.20711], [1.20711, 1.0]], rtol=1e-5)
    assert_allclose(K_r, np.diag([0.25, (2 - np.sqrt(2)) / 2]), atol=1e-12)


def reduced_frequencies(n_modes, held=()):
    """Frequencies of the beam on its Craig-Bampton basis, some boundary columns left out."""
    K, M = hermite_beam()
    basis = craig_bampton(K, M, ENDS, n_modes=n_modes)
    keep = np.setdiff1d(np.arange(4 + n_modes), held)
    K, M = (basis.project(A)[np.ix_(keep, keep)] for A in (K, M))
    return np.sqrt(np.abs(eigh(K, M, eigvals_only=True)))


def test_a_square_transformation_is_a_similarity():
    """Proposition 1 of the O'Shea study: with all modes kept nothing changes."""
    K, M = hermite_beam()
    full = np.sqrt(np.abs(eigh(K, M, eigvals_only=True)))[2:]
    assert_allclose(reduced_frequencies(78)[2:], full, rtol=1e-8)


@pytest.mark.parametrize(
    ("m", "omega"), [(0, np.sqrt(720)), (1, 22.45384), (2, 22.45384), (4, 22.38247), (8, 22.37387)]
)
def test_without_reference_conditions_the_modes_are_free_free(m, omega):
    """Proposition 2: exactly two zero frequencies, the others tend to the free-free beam."""
    found = reduced_frequencies(m)
    assert np.all(found[:2] < 1e-3 * found[2])
    assert_allclose(found[2], omega, rtol=1e-6)
    assert found[2] > FREE_FREE


@pytest.mark.parametrize(
    ("held", "m", "omega", "limit"),
    [
        ((0, 1), 0, 3.53273, CANTILEVER),
        ((0, 1), 1, 3.51724, CANTILEVER),
        ((0, 1), 2, 3.516221, CANTILEVER),
        ((0, 1), 8, 3.516016, CANTILEVER),
        ((0, 2), 0, np.sqrt(120), PINNED),
        ((0, 2), 1, 9.870341, PINNED),
        ((0, 2), 4, 9.869626, PINNED),
    ],
)
def test_conditions_on_reduced_coordinates_solve_that_boundary_problem(held, m, omega, limit):
    """Proposition 3: deleting boundary columns is the same as supporting the beam."""
    found = reduced_frequencies(m, held)[0]
    assert_allclose(found, omega, rtol=2e-6)  # the table has six digits
    assert found > limit - 1e-6


def ten(boundary=(0, 9), n_modes=2, coupling=None):
    """The chain of ten masses, two entries of its stiffness spoilt."""
    K, M, _ = chain(10)
    if coupling is not None:
        K = K.tolil()
        K[2, 3], K[3, 2] = coupling(K[2, 3])
    return lambda: craig_bampton(K, M, boundary, n_modes=n_modes)


test_what_does_not_fit_is_refused = refused(
    (ten([]), InterfaceError, "0 boundary dofs leave a rigid motion free"),
    (ten(n_modes=9), ConfigError, "n_modes = 9 must be a whole number from 0 to 8"),
    (ten([0, 0]), ConfigError, "boundary dof 0 must be listed only once"),
    (ten([0, 10]), ConfigError, "boundary dof 10 must be from 0 to 9"),
    (ten(coupling=lambda k: (1.01 * k, k)), QualityGateError, "K is not symmetric"),
    (ten(coupling=lambda k: (np.nan, np.nan)), SolverError, "not finite in row 2"),
)
