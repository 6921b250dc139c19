"""The factor that ranks share as substructures: beside dense solutions, and when it is not made."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import coo_matrix, csr_matrix, random, triu

from cases.long import SHARED_BY
from cases.paths import RANKS
from cases.ranks.environment import written_on_each

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = [pytest.mark.fenicsx, pytest.mark.mpi]

from mpi4py import MPI  # noqa: E402

from rom.fe.operators.substructures import mumps  # noqa: E402

SCRIPT = RANKS / "substructured_under_mpi.py"
N_VERTICES, N_LAST = 60, 7


@pytest.fixture(scope="module")
def library():
    return mumps.library(MPI.COMM_SELF)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("substructured")
    return written_on_each(SHARED_BY, folder, SCRIPT, "main", ending="json", timeout=300)


LEFT_TO_MUMPS = ["on disk", "low rank", "full", "apart", "costly", "no room", "room runs out"]


@pytest.mark.parametrize("n", SHARED_BY)
def test_solutions_are_those_of_the_whole_matrix(found, n):
    """No entry joins two insides; one dof is joined to ten of the next rank at each joint.

    Each is solved with the border factored by every rank, and with the border shared.
    """
    assert len(found[n]["errors"]) == 10
    assert max(found[n]["errors"]) < 1e-12
    assert found[n]["joined"] == [0] * 5
    assert found[n]["border of stars"] == n - 1
    assert all(found[n][case] for case in LEFT_TO_MUMPS), found[n]
    assert found[n]["definite"] == [False] * 6


def fill(pattern, places):
    """Entries of the factor by elimination in a dense matrix of zeros and ones."""
    order = np.argsort(places)
    A = (pattern.toarray() != 0)[np.ix_(order, order)]
    for k in range(len(A)):
        below = k + 1 + np.flatnonzero(A[k + 1 :, k])
        A[np.ix_(below, below)] = True
    return np.tril(A, -1).sum()


@pytest.mark.parametrize("seed", range(8))
def test_given_unknowns_come_last_at_no_further_fill(library, seed):
    """Beside MUMPS' own order, on graphs of some 150 edges; the last vertices are joined."""
    A = random(N_VERTICES, N_VERTICES, 0.04, random_state=seed)
    end = np.arange(N_VERTICES - N_LAST, N_VERTICES)
    clique = (np.ones(N_LAST**2), (np.tile(end, N_LAST), np.repeat(end, N_LAST)))
    pattern = csr_matrix(A + A.T + coo_matrix(clique, shape=A.shape) + np.eye(N_VERTICES))
    places = mumps.elimination_order(library, pattern, N_LAST)
    assert sorted(places) == list(range(N_VERTICES))
    assert_allclose(places[-N_LAST:], end)
    upper = triu(pattern, format="coo")
    own = mumps._Instance(library, N_VERTICES)
    own.give_entries(upper.row, upper.col)
    assert fill(pattern, places) <= fill(pattern, own.order())
    own.release()


@pytest.mark.parametrize("m", [1, 5, 30])
def test_a_solution_in_two_halves_around_a_border(library, m):
    rng, n = np.random.default_rng(m), 40
    A = rng.standard_normal((n + m, n + m))
    K = A @ A.T + np.eye(n + m)
    K_ii, K_ib = K[:n, :n], K[:n, n:]
    upper = np.triu(K)
    upper[n:] = 0.0
    places = np.concatenate([rng.permutation(n), np.arange(n, n + m)])
    inside = mumps.Inside(library, coo_matrix(upper), m, places)
    complement = -K_ib.T @ np.linalg.solve(K_ii, K_ib)
    assert_allclose(np.tril(inside.factor()), np.tril(complement), atol=1e-9)
    F, U = rng.standard_normal((n, 35)), rng.standard_normal((m, 35))
    half, loads = inside.reduced(F)
    assert_allclose(loads, -K_ib.T @ np.linalg.solve(K_ii, F), atol=1e-9)
    assert_allclose(inside.expanded(half, U), np.linalg.solve(K_ii, F - K_ib @ U), atol=1e-9)
    inside.release()
    inside.release()


def test_without_the_library_mumps_shares_the_factor_as_petsc_calls_it(monkeypatch):
    for files in ([], ["/nowhere/libdmumps.so"]):
        monkeypatch.setattr(mumps, "mapped_files", lambda files=files: files)
        assert mumps.library(MPI.COMM_SELF) is None


def test_eight_ranks_that_share_the_border_reduce_as_one_does(tmp_path):
    """To 1e-9: frequencies, reduced K and M, mode shapes."""
    one, eight = written_on_each((1, 8), tmp_path, SCRIPT, "reduced").values()
    assert (one.pop("factors"), eight.pop("factors")) == (0, 2)
    for name, expected in one.items():
        assert_allclose(eight[name], expected, atol=1e-9 * np.abs(expected).max(), rtol=0)
