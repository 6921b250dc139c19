"""The path without a factor: known spectra, planted misses, and the factor's own answers."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse

import rom
from cases.long import SHARED_BY, few
from cases.operators import petsc_operators
from cases.paths import RANKS
from cases.ranks.environment import written_on
from cases.refusals import refuses
from cases.solid import STEEL, reduced
from rom.errors import ModesMissedError

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = pytest.mark.fenicsx

from rom.eigen.completeness import gaussian_block  # noqa: E402
from rom.fe.operators.iterative import multigrid  # noqa: E402
from rom.fe.operators.iterative import search as module  # noqa: E402
from rom.fe.operators.iterative.gradients import ConjugateGradients  # noqa: E402
from rom.fe.operators.iterative.search import BlockSearch  # noqa: E402
from rom.reduction.full_model import operators  # noqa: E402

EDGE = 8  # points of a cube's edge
MASS = 2.0
SOLVERS = ("direct", "iterative")


def cube():
    """The Laplacian on a cube: most eigenvalues are three or six times there, in closed form."""
    chain = sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(EDGE, EDGE))
    K = sparse.kronsum(chain, sparse.kronsum(chain, chain))
    body = SimpleNamespace(K=K, M=MASS * sparse.identity(EDGE**3), points=None)
    return petsc_operators(body), K.toarray()


def eigenvalues():
    lam = 4.0 * np.sin(np.pi * np.arange(1, EDGE + 1) / (2 * EDGE + 2)) ** 2
    return np.sort((lam[:, None, None] + lam[:, None] + lam).ravel()) / MASS


@pytest.fixture(scope="module")
def problem():
    """The cube, with an approximate inverse that errs by half at the lowest eigenvalue."""
    ops, K = cube()
    P = np.linalg.inv(K + 0.4 * np.eye(K.shape[0]))
    return ops, ConjugateGradients(ops.K, lambda F: P @ F, lambda: None), K, P


def found(problem, m, spare=3):
    ops, inverse = problem[:2]
    search = BlockSearch(ops, inverse, np.zeros((ops.n, 0)), m, spare)
    search.solve()
    return search


@pytest.mark.parametrize("m", [1, 4, 7, 11, 40])
def test_repeated_eigenvalues_are_all_found(problem, m):
    search = found(problem, m)
    assert_allclose(search.theta[:m], eigenvalues()[:m], rtol=1e-12)
    assert search.prove() < 1e-9
    X = search.X[:, : search.k]
    assert_allclose(MASS * X.T @ X, np.eye(search.k), atol=1e-11)


def test_static_solutions_and_bounds_of_the_spectrum_are_those_of_dense_matrices(problem):
    ops, inverse, K, _ = problem
    F = np.random.default_rng(3).standard_normal((K.shape[0], 20))  # more than one block
    X = np.linalg.solve(K, F)
    assert_allclose(inverse.solve(F), X, atol=1e-10 * np.abs(X).max())
    lam = np.linalg.eigvalsh(K)
    loads = np.random.default_rng(2).standard_normal((ops.n, 2))
    least, largest = module.spectral_bounds(ops, inverse, loads)
    assert 0.4 * lam[0] / (lam[0] + 0.4) < least < lam[0] / (lam[0] + 0.4)
    assert lam[-1] / (lam[-1] + 0.4) < largest < 1.1


def verdict(problem, missing, m=11, gap=0.5):
    """What is said of the exact modes when some of them are withheld."""
    ops, inverse, K, _ = problem
    lam, Phi = np.linalg.eigh(K)
    kept = np.setdiff1d(np.arange(m), missing)
    lam, beyond = lam[:m] / MASS, lam[m] / MASS
    Phi = Phi[:, kept] / np.sqrt(MASS)
    loads = np.random.default_rng(5).standard_normal((ops.n, module.N_COLUMNS)) * np.sqrt(MASS)
    sigma = lam[-1] + gap * (beyond - lam[-1])
    bounds = module.spectral_bounds(ops, inverse, loads)
    modes = (Phi, MASS * Phi, lam[-1])
    return module.searched(ops, inverse, modes, sigma, loads, bounds), sigma, Phi


@pytest.mark.parametrize("missing", [[0], [1], [2, 3], [6], [10], [0, 5, 10]])
def test_a_mode_withheld_is_found_also_one_of_three_that_share_a_frequency(problem, missing):
    said, sigma, Phi = verdict(problem, missing)
    assert said.chance == 1.0
    V = said.direction
    assert np.abs(MASS * Phi.T @ V).max() < 1e-9 * np.abs(V).max()
    assert (V.T @ problem[2] @ V) / (MASS * V.T @ V) < sigma


def test_the_probability_follows_its_formula(problem, monkeypatch):
    """After ten steps, by numbers of its own: Chebyshev's polynomial by NumPy."""
    said, *_ = verdict(problem, [])  # nothing is missing
    assert said.direction is None and 0.0 < said.chance < 1e-9
    monkeypatch.setattr(module, "MAX_STEPS", 10)
    monkeypatch.setattr(module, "LEAST_SHARE", 1e7)  # so that the bound is below one
    ops, inverse, K, P = problem
    said, sigma, _ = verdict(problem, [], gap=0.9)
    theta = np.linalg.eigvalsh(K)[10] / MASS
    loads = np.random.default_rng(5).standard_normal((ops.n, 4)) * np.sqrt(MASS)
    delta, largest = module.spectral_bounds(ops, inverse, loads)
    mu = (sigma / theta - 1.0) * delta
    growth = np.polynomial.Chebyshev.basis(9)(1.0 + 2.0 * mu / largest)
    c = np.sqrt(largest * np.einsum("ij,ij->j", loads, P @ loads) / mu) / growth
    expected = np.prod(np.sqrt(2.0 / np.pi) * c / np.sqrt(1e7 * delta / sigma))
    assert said.chance == pytest.approx(min(expected, 1.0), rel=1e-9)
    assert said.chance < 0.9


def forgetful(monkeypatch, times):
    """The search loses its third mode, that often."""
    solve, left = BlockSearch.solve, [times]

    def forgetting(self):
        solve(self)
        if left[0]:
            left[0] -= 1
            highest = np.sin(np.pi * EDGE * np.arange(1, EDGE + 1) / (EDGE + 1))
            v = np.einsum("i,j,k->ijk", *[highest] * 3).ravel()[:, None]
            v /= np.sqrt(MASS * v.T @ v)
            theta = eigenvalues()[-1]  # in the place of the mode that is lost
            for name, added in (("X", v), ("AX", MASS * theta * v), ("MX", MASS * v)):
                setattr(self, name, np.hstack([np.delete(getattr(self, name), 2, axis=1), added]))
            self.theta = np.append(np.delete(self.theta, 2), theta)
            self.k = min(self.k, self.width - 1)

    monkeypatch.setattr(BlockSearch, "solve", forgetting)


def test_a_missed_mode_is_taken_in_and_a_search_that_goes_on_missing_has_failed(
    problem, monkeypatch
):
    forgetful(monkeypatch, 1)
    search, taken, take = found(problem, 11), [], BlockSearch._take
    monkeypatch.setattr(BlockSearch, "_take", lambda self, X: taken.append(X) or take(self, X))
    assert not np.allclose(search.theta[:11], eigenvalues()[:11])
    assert search.prove() < 1e-9
    assert_allclose(search.theta[:11], eigenvalues()[:11], rtol=1e-12)
    v = taken[0][:, -1]  # stands in the block
    assert (v @ problem[2] @ v) / (MASS * v @ v) < eigenvalues()[11]
    forgetful(monkeypatch, 100)
    refuses(ModesMissedError, "after 3 modes that were missed below", found(problem, 11).prove)


def bar(solver, size=(1.0, 0.2, 0.1), lc=0.06):
    sizes = dict(zip("Lbh", size, strict=True)) | {"lc": lc}
    return rom.fe.model("meshes/beam.geo", material=STEEL, parameters=sizes, solver=solver)


def test_the_cycle_is_symmetric_and_below_the_inverse():
    """x^T P y = y^T P x, and all eigenvalues of P K in (0, 1]."""
    model = bar("iterative")
    held = operators(model).hold(model.interfaces["root"].dofs)
    P, K = held.factor.approximate, held.inner.apply_K
    X = np.random.default_rng(1).standard_normal((held.n_free, 6))
    G = X.T @ P(X)
    assert_allclose(G, G.T, atol=1e-13 * np.abs(G).max())
    U = P(X)  # smooth and rough together
    for _ in range(3):
        lam = np.linalg.eigvals(np.linalg.solve(U.T @ K(U), K(U).T @ P(K(U))))
        assert lam.real.min() > 0.01 and lam.real.max() < 1.0 + 1e-12
        U = P(K(U)) - 0.5 * U


SHAPES = [((1.0, 0.2, 0.1), "rbe2"), ((1.0, 0.1, 0.1), "rbe3"), ((0.3,) * 3, rom.Polynomial(1))]


@pytest.mark.parametrize(("size", "kind"), few(1, SHAPES))
def test_frequencies_and_shapes_are_those_of_the_factor(size, kind):
    """A bar, one with pairs of equal frequencies, and a cube; by three kinds of interfaces."""
    models = (bar(solver, size, 0.06 if size[0] > 0.5 else 0.07) for solver in SOLVERS)
    one, other = (reduced(12, model, interfaces={"root": kind, "tip": kind}) for model in models)
    assert_allclose(other.frequencies()[6:], one.frequencies()[6:], rtol=1e-8)
    n = one.K.shape[0] - 12  # constraint modes stand first
    assert_allclose(other.K[:n, :n], one.K[:n, :n], atol=1e-9 * np.abs(one.K[:n, :n]).max())
    stage = other.provenance["stages"]["shapes"]
    assert stage["probability of a missed mode"] < 1e-9
    assert stage["largest residual of a mode"] < 1e-8


def test_the_smoother_is_the_polynomial_of_the_fourth_kind(problem):
    """What it leaves of an eigenvector: sin((k + 1/2) phi) / ((2k + 1) sin(phi / 2))."""
    ops, _, K, _ = problem
    level = multigrid.Level(ops.K, ops.M)
    lam, V = np.linalg.eigh(K / 6.0)  # the diagonal is six everywhere
    phi = np.arccos(1.0 - 2.0 * lam / level.rho)
    k = multigrid.SMOOTHING_DEGREE
    left = np.sin((k + 0.5) * phi) / ((2 * k + 1) * np.sin(0.5 * phi))
    X, R = level.smoothed(np.asfortranarray(V), residual=True)
    assert_allclose(R, V * left, atol=1e-12)
    assert_allclose(K @ X, V * (1.0 - left), atol=1e-12)


def test_loads_are_independent_of_the_search_and_as_heavy_as_the_mass(problem, monkeypatch):
    seen, said = [], module.searched
    monkeypatch.setattr(module, "searched", lambda *a: seen.append(a) or said(*a))
    search = found(problem, 11)
    search.prove()
    loads = seen[0][4]
    assert loads.std() == pytest.approx(np.sqrt(MASS), rel=0.1)
    start = gaussian_block(problem[0], search.width)
    both = np.hstack([start, loads])
    for columns in (both, both**2):  # lengths and angles of normal numbers
        alike = np.corrcoef(columns, rowvar=False) - np.eye(search.width + 4)
        assert np.abs(alike).max() < 6.0 / np.sqrt(EDGE**3)


def test_directions_that_depend_on_others_are_dropped(problem):
    search = found(problem, 4)
    Y = np.random.default_rng(4).standard_normal((EDGE**3, 3))
    Q, MQ = search._orthonormal(np.hstack([Y, Y @ [[1.0], [-2.0], [0.5]], Y[:, :1]]))
    assert Q.shape == Y.shape
    assert_allclose(MASS * Q.T @ Q, np.eye(3), atol=1e-12)
    assert_allclose(MQ, MASS * Q)


def test_modes_left_alone_are_looked_at_once_more(problem, monkeypatch):
    """One that has converged is spoilt behind the back of the search."""
    improve, spoilt = BlockSearch._improve, []

    def spoiling(self, Y, wanted):
        improve(self, Y, wanted)
        if not wanted[0] and not spoilt:
            spoilt.append(1)
            for A in (self.X, self.AX, self.MX):
                A[:, 0] += 1e-4 * A[:, -1]

    monkeypatch.setattr(BlockSearch, "_improve", spoiling)
    monkeypatch.setattr(module, "N_BETWEEN_REFRESHES", 40)
    search = found(problem, 11)
    assert spoilt
    rest = problem[2] @ search.X[:, :11] - MASS * search.X[:, :11] * search.theta[:11]
    assert np.abs(rest).max() < 1e-7


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """By both solvers on one rank, by the iterative one on several."""
    folder, script = tmp_path_factory.mktemp("iterative"), RANKS / "iterative_under_mpi.py"
    asked = {1: SOLVERS} | dict.fromkeys(SHARED_BY, SOLVERS[1:])
    words = {n: (script, *solvers, folder / f"{n}.npz") for n, solvers in asked.items()}
    return {n: written_on(n, given[-1], *given, timeout=300) for n, given in words.items()}


@pytest.mark.mpi
@pytest.mark.parametrize("n", (1, *SHARED_BY))
@pytest.mark.parametrize("against", SOLVERS)
def test_frequencies_and_stiffness_do_not_depend_on_how_many_solve(runs, n, against):
    one, many = ({k.removeprefix(f"{solver} "): x for k, x in runs[ranks].items() if solver in k}
                 for solver, ranks in ((against, 1), ("iterative", n)))  # fmt: skip
    for name in ("free", "modes", "held"):
        assert one[name].size >= 6
        assert_allclose(many[name], one[name], rtol=1e-9, err_msg=name)
    springs = one["springs"]
    assert_allclose(many["springs"], springs, atol=1e-9 * np.abs(springs).max())
    assert 0.0 < many["missed"] < 1e-9
