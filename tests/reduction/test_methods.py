"""Every reduction method against closed forms, published tables and the full model."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh, subspace_angles

import rom
from cases.beam import CANTILEVER, ENDS, FREE_FREE, PINNED, hermite_beam
from cases.operators import KINDS
from cases.refusals import refused, refuses
from cases.solid import block, chain
from rom.eigen.scipy import SciPyOperators
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, InterfaceError, QualityGateError, SolverError
from rom.reduction.bases.fixed_interface import craig_bampton, projected

METHODS = [rom.CraigBampton, rom.EnhancedCraigBampton, rom.Rubin, rom.Herting]
MODEL = block(cells=(9, 3, 2), origin=(0.4, 0.1, 0.0))


@pytest.fixture(params=KINDS)
def ops(request):
    return request.param(MODEL)


def boundary(model):
    ends = [model.interfaces[name].nodes[[0, 2, -1]] for name in ("root", "tip")]
    return (3 * np.concatenate(ends)[:, None] + np.arange(3)).ravel()


def reduced(ops, method, b):
    basis = method.basis(ops, b, tuple(f"dof {d}" for d in b))
    K, M = projected(ops, basis.Psi)
    return eigh(K, M, eigvals_only=True), basis


@pytest.mark.parametrize("method", METHODS)
def test_frequencies_fall_towards_the_full_ones_with_every_mode(ops, method):
    exact = eigh(MODEL.K.toarray(), MODEL.M.toarray(), eigvals_only=True)
    b = boundary(MODEL)
    steps = []
    for n in (2, 8, 20):
        lam, basis = reduced(ops, method(n), b)
        assert_allclose(ops.rows(basis.Psi, b)[:, : b.size], np.eye(b.size), atol=1e-7)
        assert len(basis.labels) == basis.Psi.shape[1]
        steps.append(lam[6:14])
    steps = np.array(steps)
    assert (steps >= exact[6:14] * (1 - 1e-8)).all()
    # the space of the enhanced columns is not nested: its errors fall on the whole
    if method is not rom.EnhancedCraigBampton:
        assert (np.diff(steps, axis=0) < 1e-8 * steps[1:]).all()
    assert_allclose(np.sqrt(steps[-1]), np.sqrt(exact[6:14]), rtol=1e-2)


@pytest.mark.parametrize("method", [rom.Guyan, rom.CraigBampton, rom.Rubin, rom.Herting])
def test_rigid_motions_and_statics_of_the_boundary_are_exact(ops, method):
    b = boundary(MODEL)
    method = method() if method is rom.Guyan else method(6)
    basis = method.basis(ops, b, tuple(map(str, b)))
    K, M = projected(ops, basis.Psi)
    R = ops.rigid
    gap = R - basis.Psi @ np.linalg.solve(M, ops.gram(basis.Psi, ops.apply_M(R)))
    assert np.abs(gap).max() < 1e-8 * np.abs(R).max()
    held = ops.hold(b[:9])
    F = np.zeros((ops.n_local, 9))
    F[b[9:], np.arange(9)] = 1.0
    full = held(F)[b[9:]]
    keep = np.arange(9, K.shape[0])
    static = np.linalg.solve(K[np.ix_(keep, keep)], np.eye(keep.size)[:, :9])[:9]
    assert_allclose(static, full, rtol=1e-6, atol=1e-9 * np.abs(full).max())


@pytest.mark.parametrize(
    "method",
    [rom.CraigBampton(10), rom.EnhancedCraigBampton(10), rom.Rubin(8), rom.Herting(8),
     rom.MomentMatching((0.0, 5.0), 2), rom.BalancedTruncation(10, pool=10),
     rom.WithLoads(rom.CraigBampton(9), np.eye(14)[:, [5]])],
    ids=lambda method: type(method).__name__,
)  # fmt: skip
def test_all_modes_make_every_basis_the_full_model(method):
    """A beam of six elements on its ends: four dofs of 14, rigid motions among the free modes."""
    K, M = hermite_beam(6)
    lam, basis = reduced(SciPyOperators(K, M), method, np.array([0, 1, 12, 13]))
    assert basis.Psi.shape == (14, 14)
    assert_allclose(lam[2:], eigh(K, M, eigvals_only=True)[2:], rtol=1e-8)


def test_rubin_and_herting_span_one_space():
    """Inertia relief from the interfaces and residual flexibility describe the same shapes."""
    model = block(cells=(6, 2, 2))
    ops = SciPyOperators(model.K, model.M, rigid_motions(model.points))
    b = boundary(model)
    spans = [method(5).basis(ops, b, ("",) * b.size).Psi for method in (rom.Rubin, rom.Herting)]
    scaled = [Psi / np.sqrt(np.einsum("ni,ni->i", Psi, model.M @ Psi)) for Psi in spans]
    assert subspace_angles(*scaled).max() < 1e-6


def test_free_modes_kept_are_exact_and_supports_converge():
    """Beam on its two end nodes, without geometry: rigid motions are found by their stiffness."""
    ops = SciPyOperators(*hermite_beam())
    exact = np.sqrt(eigh(*hermite_beam(), eigvals_only=True)[2:6])
    for method in (rom.Rubin(4), rom.Herting(4)):
        lam, basis = reduced(ops, method, np.array(ENDS))
        assert basis.labels.count("free 1") == 1
        assert_allclose(np.sqrt(lam[2:6]), exact, rtol=1e-8)
        K, M = (A[2:, 2:] for A in projected(ops, basis.Psi))
        assert_allclose(np.sqrt(eigh(K, M, eigvals_only=True)[0]), CANTILEVER, rtol=1e-6)


def test_enhanced_columns_are_orders_better_at_the_same_size():
    K, M = (A[2:, 2:] for A in hermite_beam())  # a cantilever
    ops, b, exact = SciPyOperators(K, M), np.array([38, 39, 78, 79]), eigh(K, M)[0][:5]
    for n, bounds in ((2, [1e-8, 5e-8, 1e-6, 5e-4, 2e-2]), (4, [1e-8] * 3 + [5.5e-6, 1.8e-5])):
        lam, basis = reduced(ops, rom.EnhancedCraigBampton(n), b)
        assert basis.Psi.shape[1] == 4 + n
        assert (np.abs(lam[:5] / exact - 1) < bounds).all()


@pytest.mark.parametrize("method", METHODS)
def test_every_method_makes_a_body_with_a_certificate_but_enhanced_columns_give_up_statics(method):
    model, kinds = block(cells=(9, 2, 2)), {"root": "rbe2", "tip": "rbe3"}
    found = rom.reduce(model, method=method(25), interfaces=kinds, reference="root").certificate
    if method is not rom.EnhancedCraigBampton:
        assert found.ok, found
        return
    failed = [row.quantity for row in found.failures]
    assert "root held: static flexibility of the interfaces" in failed
    assert not any(name.startswith("free") for name in failed)


def test_wrong_boundaries_and_modes_that_spend_their_flexibility_are_refused():
    model = block(cells=(3, 1, 1))
    ops = SciPyOperators(model.K, model.M, rigid_motions(model.points))
    ends = np.concatenate([model.interfaces[name].dofs for name in ("root", "tip")])
    spent, free = model.n_dofs - 6, "leave a rigid motion free"
    for method, b, error, words in (
        (rom.Rubin(3), [], ConfigError, "none is given"),
        (rom.Herting(3), [], ConfigError, "none is given"),
        (rom.EnhancedCraigBampton(3), [], ConfigError, "none is given"),
        (rom.Rubin(3), [0, 1, 2], InterfaceError, free),
        (rom.Rubin(3), [0, 1, 2, 3, 4, 5], InterfaceError, free),
        (rom.Rubin(10_000), list(range(12)), ConfigError, "n_modes = 10000"),
        (rom.Rubin(spent), ends, InterfaceError, "residual flexibility of the 24 boundary dofs"),
    ):
        refuses(error, words, method.basis, ops, np.array(b, dtype=int), ("",) * len(b))


def test_modes_by_substructures_are_those_by_lanczos(ops):
    b = boundary(MODEL)
    known = rom.CraigBampton(n_modes=40).basis(ops, b, ("",) * b.size)
    f_max = float(known.omega[30] + known.omega[31]) / (4 * np.pi)
    found = rom.CraigBampton(f_max=f_max, search="substructures").basis(ops, b, ("",) * b.size)
    assert found.omega.size == 31
    assert_allclose(found.omega, known.omega[:31], rtol=1e-3)
    Phi, Psi = (basis.Psi[:, b.size : b.size + 31] for basis in (known, found))
    S = ops.gram(Phi, ops.apply_M(Psi))
    assert_allclose(np.linalg.svd(S, compute_uv=False), 1.0, atol=1e-4)
    assert_allclose(found.Psi[:, : b.size], known.Psi[:, : b.size], atol=1e-12)


@pytest.mark.parametrize("omega_fixed", [1.0, 10.0, 2 * np.pi])
@pytest.mark.parametrize("n", [60, 700])
def test_no_frequency_is_special(n, omega_fixed):
    """A penalty or shift that hides dofs at some frequency loses the mode there."""
    K, M, exact = chain(n)
    basis = craig_bampton(K * (omega_fixed / exact[2]) ** 2, M, [0, n - 1], n_modes=5)
    assert_allclose(basis.omega, exact[:5] * omega_fixed / exact[2], rtol=1e-9)


def test_fixed_interface_frequencies_are_exact_and_constraint_modes_carry_rigid_motion():
    K, M, exact = chain(60)
    basis = craig_bampton(K, M, [0, 59], n_modes=8)
    assert_allclose(basis.omega, exact[:8], rtol=1e-9)
    assert_allclose(basis.Psi[:, :2].sum(axis=1), 1.0, rtol=1e-10)  # both ends moved by one
    assert_allclose(basis.project(K)[:2, 2:], 0.0, atol=1e-8)  # K-orthogonal to normal modes


def test_published_four_mass_chain():
    """Reduced matrices of the example in the documentation of ModelReduction.jl."""
    K = np.array([[2.0, -1, 0, 0], [-1, 2, -1, 0], [0, -1, 2, -1], [0, 0, -1, 1]])
    M = np.diag([2.0, 2, 2, 1])
    basis = craig_bampton(K, M, [3], n_modes=1)
    M_r, K_r = basis.project(M), basis.project(K)
    assert_allclose(np.abs(M_r), [[2.75, 1.20711], [1.20711, 1.0]], rtol=1e-5)
    assert_allclose(K_r, np.diag([0.25, (2 - np.sqrt(2)) / 2]), atol=1e-12)


def reduced_frequencies(n_modes, held=()):
    K, M = hermite_beam()
    basis = craig_bampton(K, M, ENDS, n_modes=n_modes)
    keep = np.setdiff1d(np.arange(4 + n_modes), held)
    K, M = (basis.project(A)[np.ix_(keep, keep)] for A in (K, M))
    return np.sqrt(np.abs(eigh(K, M, eigvals_only=True)))


def test_all_modes_are_a_similarity_and_few_without_reference_conditions_are_free_free():
    """Propositions 1 and 2 of the O'Shea study: exactly two zero frequencies."""
    full = np.sqrt(np.abs(eigh(*hermite_beam(), eigvals_only=True)))[2:]
    assert_allclose(reduced_frequencies(78)[2:], full, rtol=1e-8)
    table = {0: np.sqrt(720), 1: 22.45384, 2: 22.45384, 4: 22.38247, 8: 22.37387}
    for m, omega in table.items():
        found = reduced_frequencies(m)
        assert np.all(found[:2] < 1e-3 * found[2])
        assert_allclose(found[2], omega, rtol=1e-6)
        assert found[2] > FREE_FREE


CLAMPED_BY_MODES = {0: 3.53273, 1: 3.51724, 2: 3.516221, 8: 3.516016}
PINNED_BY_MODES = {0: np.sqrt(120), 1: 9.870341, 4: 9.869626}


@pytest.mark.parametrize(
    ("held", "table", "limit"),
    [((0, 1), CLAMPED_BY_MODES, CANTILEVER), ((0, 2), PINNED_BY_MODES, PINNED)],
)
def test_conditions_on_reduced_coordinates_solve_that_boundary_problem(held, table, limit):
    """Proposition 3: deleting boundary columns is the same as supporting the beam."""
    for m, omega in table.items():
        found = reduced_frequencies(m, held)[0]
        assert_allclose(found, omega, rtol=2e-6)  # the table has six digits
        assert found > limit - 1e-6


def ten(boundary=(0, 9), n_modes=2, coupling=None):
    K, M, _ = chain(10)
    if coupling is not None:
        K = K.tolil()
        K[2, 3], K[3, 2] = coupling(K[2, 3])
    return lambda: craig_bampton(K, M, boundary, n_modes=n_modes)


test_what_does_not_fit_is_refused = refused(
    (ten([]), InterfaceError, "0 boundary dofs leave a rigid motion free"),
    (ten(n_modes=9), ConfigError, "n_modes = 9 must be a whole number from 0 to 8"),
    (ten([0, 0]), ConfigError, "boundary dof 0 is given twice"),
    (ten([0, 10]), ConfigError, "boundary dof 10 must be from 0 to 9"),
    (ten(coupling=lambda k: (1.01 * k, k)), QualityGateError, "K is not symmetric"),
    (ten(coupling=lambda k: (np.nan, np.nan)), SolverError, "not finite in row 2"),
)
