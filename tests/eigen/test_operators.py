"""The operator verbs, over both implementations; modes of whatever has them."""

import inspect
from functools import cache
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.sparse import block_diag, csr_matrix, identity, random

import rom
from benchmarks.models import bar
from cases.files import border_calls as made
from cases.operators import KINDS
from cases.refusals import refuses
from cases.solid import block
from rom.components import cosserat
from rom.eigen import lanczos, search
from rom.eigen.scipy import SciPyOperators
from rom.eigen.supports import refuse_loose
from rom.eigen.verbs import mac, orthonormal, rigid_motions
from rom.errors import ConfigError, InterfaceError, ModelError, ModesMissedError, SolverError


@pytest.fixture(scope="module")
def model():
    return block(cells=(12, 3, 2), origin=(0.4, 0.1, 0.0))


@pytest.fixture(scope="module")
def exact(model):
    return eigh(model.K.toarray(), model.M.toarray())


@pytest.fixture(params=KINDS)
def make(request):
    return request.param


def test_products_and_gram(make, model):
    ops, X = make(model), np.random.default_rng(0).normal(size=(model.n_dofs, 5))
    assert_allclose(ops.apply_K(X), model.K @ X, rtol=1e-12, atol=1e-3)
    assert_allclose(ops.apply_M(X), model.M @ X, rtol=1e-12)
    assert_allclose(ops.gram(X, X), X.T @ X, rtol=1e-12)
    assert_allclose(ops.rows(X, [7, 3]), X[[7, 3]])


def test_held_solve_is_the_inverse_of_the_submatrix(make, model):
    ops, held = make(model), model.interfaces["root"].dofs
    F = np.random.default_rng(1).normal(size=(model.n_dofs, 40))  # more than one block
    X = ops.hold(held)(F)
    free = np.setdiff1d(np.arange(model.n_dofs), held)
    expected = np.linalg.solve(model.K.toarray()[np.ix_(free, free)], F[free])
    assert_allclose(X[free], expected, rtol=1e-8, atol=1e-10 * np.abs(expected).max())
    assert not X[held].any()


def held_eigenvalues(model, held):
    free = np.setdiff1d(np.arange(model.n_dofs), held)
    K, M = (A.toarray()[np.ix_(free, free)] for A in (model.K, model.M))
    return eigh(K, M, eigvals_only=True)


def test_held_modes_are_those_of_the_submatrix(make, model):
    ops, held = make(model), model.interfaces["root"].dofs
    expected = np.sqrt(held_eigenvalues(model, held)[:9])
    omega, Phi = ops.modes(ops.hold(held), 9)
    assert_allclose(omega, expected, rtol=1e-9)
    assert_allclose(Phi.T @ (model.M @ Phi), np.eye(9), atol=1e-9)
    assert_allclose(ops.modes(held, 9)[0], omega, rtol=1e-11)
    assert np.all(Phi.max(axis=0) >= -Phi.min(axis=0) * (1 - 1e-6))


def test_free_modes_begin_with_six_exact_zeros_whatever_the_shift(make, model, exact):
    """Shift-invert without deflation loses rigid modes at large shifts and reports convergence."""
    for shift in (1e-2, 1.0, 30.0):
        omega, _ = make(model).modes((), 10, sigma=-shift * exact[0][6])
        assert_allclose(omega[6:], np.sqrt(exact[0][6:10]), rtol=1e-8)
    omega, Phi = make(model).modes((), 20)
    assert_allclose(omega[:6], 0.0, atol=0.0)
    assert_allclose(omega[6:] ** 2, exact[0][6:20], rtol=1e-9)
    assert_allclose(Phi.T @ (model.M @ Phi), np.eye(20), atol=1e-9)
    rest = model.K @ Phi - (model.M @ Phi) * omega**2
    assert np.linalg.norm(rest, axis=0)[6:].max() < 1e-7 * np.linalg.norm(model.K @ Phi[:, 6:])


def forgetful(function, searches):
    """The same search without the third of its modes."""

    def without_one(*arguments):
        lam, Phi, *proven = function(*arguments)
        searches.append(lam.size)
        return np.delete(lam, 2), np.delete(Phi, 2, axis=1), *(False for _ in proven)

    return without_one


def test_a_mode_that_was_skipped_is_sought_again(make, model, exact, monkeypatch):
    ops, root, searches = make(model), model.interfaces["root"].dofs, []
    for name in ("by_blocks",) if isinstance(ops, SciPyOperators) else ("by_blocks", "lowest"):
        whole = forgetful(getattr(type(ops), name), searches)
        monkeypatch.setattr(type(ops), name, whole)
    held = held_eigenvalues(model, root)
    for support, lam in ((root, held), (ops.hold(root), held), ((), exact[0])):
        searches.clear()
        omega, _ = ops.modes(support, 12)
        assert_allclose(omega[6:] ** 2, lam[6:12], rtol=1e-9)
        assert len(searches) == 2


def test_modes_that_never_agree_with_the_count_are_missed(make, model, monkeypatch):
    ops, root = make(model), model.interfaces["root"].dofs
    monkeypatch.setattr(search, "MAX_LAST_DOFS", 0)
    monkeypatch.setattr(lanczos.BlockLanczos, "prove", lambda *arguments: False)
    count = type(ops).count_below
    monkeypatch.setattr(type(ops), "count_below", lambda *arguments: 1 + count(*arguments))
    for held in (root, ops.hold(root), ()):
        refuses(ModesMissedError, r"modes were found below .* but the inertia", ops.modes, held, 12)


def springs(n, i, j):
    """(n, n) stiffness of unit springs between masses i and j, and as many unit masses."""
    ends = np.concatenate([i, j, i, j]), np.concatenate([j, i, i, j])
    values = np.repeat([-1.0, 1.0], 2 * len(i))
    return SimpleNamespace(K=csr_matrix((values, ends), (n, n)), M=identity(n), points=None)


def hypercube(d):
    """2^d masses; the eigenvalue 2 k is there d! / k! / (d - k)! times."""
    corner = np.arange(2**d)
    i = np.concatenate([corner[corner >> b & 1 == 0] for b in range(d)])
    return springs(2**d, i, i | np.repeat(2 ** np.arange(d), 2 ** (d - 1)))


def equal_chains(k, n):
    """Parts that nothing joins: k times as many equal frequencies, and motions at rest."""
    i = np.arange(k * n).reshape(k, n)
    return springs(k * n, i[:, :-1].ravel(), i[:, 1:].ravel())


@pytest.mark.parametrize("body", [
    hypercube(9), springs(400, np.zeros(399, dtype=int), np.arange(1, 400)), equal_chains(15, 40)
], ids=["hypercube", "star", "chains"])  # fmt: skip
def test_frequencies_are_found_as_often_as_they_are_there(make, body):
    """Nine, 398 and 15 times, which no block of columns holds at once."""
    ops, dense = make(body), body.K.toarray()
    for held, m in product(([], np.arange(0, len(dense), 40)), (3, 30)):
        exact = np.linalg.eigvalsh(np.delete(np.delete(dense, held, 0), held, 1))
        omega, Phi = ops.modes(held, m)
        assert_allclose(omega**2, exact[:m], rtol=1e-8, atol=1e-12)
        assert_allclose(Phi.T @ Phi, np.eye(m), atol=1e-8)


def test_new_coordinates_transform_both_matrices_and_more_mass_is_added(make, model):
    ops = make(model)
    T = csr_matrix(random(model.n_dofs, 50, density=0.1, random_state=3))
    small = ops.transform(T, np.zeros((50, 6)))
    A = np.random.default_rng(2).normal(size=(50, 4))
    assert_allclose(small.expand(A), T @ A, atol=1e-12)
    assert_allclose(small.apply_M(A), T.T @ (model.M @ (T @ A)), atol=1e-10)
    assert_allclose(small.apply_K(A), T.T @ (model.K @ (T @ A)), rtol=1e-9, atol=1e-2)
    dM = csr_matrix(([2.0], ([5], [5])), shape=(model.n_dofs,) * 2)
    X = np.eye(model.n_dofs, 8)
    change = ops.plus_mass(dM).apply_M(X) - model.M @ X
    assert_allclose(change[5, 5], 2.0)
    assert_allclose(np.abs(change).sum(), 2.0)


def test_all_dofs_held_leaves_nothing_to_solve(make, model):
    ops = make(model)
    held = ops.hold(np.arange(model.n_dofs))
    assert held.n_free == 0
    assert not held(np.ones((model.n_dofs, 2))).any()
    omega, Phi = ops.modes(held, 0)
    assert omega.size == 0 and Phi.shape == (model.n_dofs, 0)
    refuses(ConfigError, "n_modes = 1 must be a whole number from 0 to 0", ops.modes, held, 1)


def side_by_side(model):
    K, M = (block_diag([A, A], "csr") for A in (model.K, model.M))
    return rom.FEModel(K, M, np.vstack([model.points, model.points + np.array([0.0, 5.0, 0.0])]))


def test_a_hinge_is_not_a_support_and_the_part_that_is_loose_is_named_by_its_place(make, model):
    """Two held nodes leave the rotation about their line free."""
    nodes = model.interfaces["root"].nodes[:2]
    dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
    refuses(InterfaceError, "the 6 boundary dofs leave a rigid motion free", make(model).hold, dofs)
    n = len(model.points)
    with pytest.raises(InterfaceError, match=f"{n} of {2 * n} nodes move") as raised:
        make(side_by_side(model)).hold(model.interfaces["root"].dofs)
    place = raised.value.message.split("moves most at (")[1].split(")")[0]
    assert float(place.split(",")[1]) >= 5.0
    with pytest.raises(ModelError, match="more motions without stiffness than the six"):
        make(side_by_side(model)).modes((), 9)


def test_without_points_the_dof_is_named():
    """A chain of three masses, held in its middle, and a fourth mass that nothing holds."""
    K = np.diag([1.0, 2.0, 1.0, 0.0])
    K[0, 1] = K[1, 0] = K[1, 2] = K[2, 1] = -1.0
    with pytest.raises(InterfaceError, match=r"rigid motion free\. Dof 3 moves most\."):
        SciPyOperators(K, np.eye(4)).hold([1])


def test_messages_for_too_many_modes_and_broken_numbers(make, model):
    ops, root, M = make(model), model.interfaces["root"].dofs, model.M.copy()
    refuses(ConfigError, "must be a whole number from 0 to", ops.modes, root, 10**5)
    refuses(ConfigError, "boundary dof 9999999 must be", ops.hold, [9999999])
    M.data[4] = np.nan
    broken = rom.FEModel(model.K, M, model.points)
    refuses(SolverError, "M has an entry that is not finite", make, broken)


def test_rigid_motions_far_away_stay_orthonormal_and_mac_tells_modes_apart(make, model, exact):
    ops, Phi = make(model), exact[1][:, 6:9]
    assert_allclose(mac(ops, Phi, -3.0 * Phi), np.eye(3), atol=1e-9)
    far = block(cells=(2, 1, 1), origin=(1e4, -1e4, 1e4))
    ops = make(far)
    R = orthonormal(ops, ops.rigid)
    assert_allclose(R.T @ (far.M @ R), np.eye(6), atol=1e-9)


def test_a_bar_on_springs_and_in_guides_as_closed_forms_say():
    """b cot b = -k L / EA along a clamped bar; sqrt(k / m) of a bar that hangs softly."""
    E, rho, L = 210e9, 7850.0, 1.0
    model = bar((L, 0.02, 0.01), (16, 1, 1), rom.Material(E=E, nu=0.0, rho=rho))
    guides, kind = {"root": "xyz", "tip": "yz rx ry rz"}, {"tip": "rbe2"}
    for stiffness in (0.5, 20.0):
        k = stiffness * E * 0.02 * 0.01 / L
        root = brentq(lambda b, s=stiffness: b * np.cos(b) + s * np.sin(b), np.pi / 2, np.pi)
        exact = root * np.sqrt(E / rho) / L / (2 * np.pi)
        found = rom.modes(model, 30, fixed=guides, springs={"tip": (k, 0, 0)}, interfaces=kind)
        assert np.abs(found.frequencies / exact - 1).min() < 1e-5
    soft = {end: np.full(3, 50.0) for end in ("root", "tip")}
    found = rom.modes(model, 6, springs=soft).frequencies
    exact = np.sqrt(100.0 / (rho * L * 0.02 * 0.01)) / (2 * np.pi)
    assert np.sum(np.abs(found / exact - 1) < 2e-3) == 3


@pytest.mark.parametrize("away", [0.0, 1000.0])
def test_what_supports_leave_is_named_wherever_the_origin_is(away):
    model = bar((1.0, 0.02, 0.01), (4, 1, 1))
    R = rigid_motions(model.points + away * np.array([1.0, 1.0, 0.0]))
    ops = SciPyOperators(model.K, model.M, R)
    root = model.interfaces["root"].dofs
    refuse_loose(ops, root)
    refuse_loose(ops, root[: 3 * 4])  # four corners of it
    refuses(InterfaceError, r"leave 3 of six motions .* turns about", refuse_loose, ops, root[:3])
    plane = np.append(root[root % 3 == 2], root[1])
    refuses(InterfaceError, r"leave 3 of six .* along \(1, 0, 0\)", refuse_loose, ops, plane)


def test_frequencies_are_as_exact_as_the_stiffness_where_a_factor_is_not(make):
    """A thin plate: the last digits of K change less than a factor's round-off does."""
    model = block(size=(1.0, 1.0, 0.01), cells=(9, 9, 2))
    K, M = (A.toarray().astype(np.longdouble) for A in (model.K, model.M))
    for held in ((), model.interfaces["root"].dofs):
        omega, Phi = make(model).modes(held, 12)
        X = Phi[:, omega > 0.0].astype(np.longdouble)
        energy, inertia = ((X.T @ A @ X).astype(float) for A in (K, M))
        limit = np.finfo(float).eps * np.sqrt(np.einsum("ij,ij->j", X**2, K**2 @ X**2))
        error = omega[omega > 0.0] ** 2 - eigh(energy, inertia, eigvals_only=True)
        assert (np.abs(error) < limit).all()


ROD = cosserat.straight(1.0, 8, stretch=1e4, bend=1.0, mass=1.0, inertia=1e-3)
FENICSX = [pytest.mark.fenicsx, pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")]
ASSEMBLY = cache(lambda: rom.Assembly(made.bodies(), made.TOGETHER))
WAYS = {  # function, its arguments before the count
    "modes": lambda: (rom.modes, [made.model()], {}),
    "FlexibleBody": lambda: (made.body().modes, [], {}),
    "Assembly": lambda: (ASSEMBLY().modes, [], {}),
    "CondensedAssembly": lambda: (ASSEMBLY().reduced(6).modes, [], {}),
    "MistunedWheel": lambda: (made.mistuned().modes, [np.zeros(4)], {}),
    "cyclic_modes": lambda: (rom.cyclic_modes, [made.spinning(), 2], {}),
    "travelling_modes": lambda: (rom.travelling_modes, [made.spinning(), 2], {"speed": 0.1}),
    "cosserat": lambda: (cosserat.modes, [ROD, cosserat.reference(ROD)], {}),
    "BladedWheel": lambda: (made.bladed().modes, [[made.blade()] * 6], {}),
    "ReducedSpinUp": lambda: (made.reduced_run_up().modes, [], {"speed": 5.0}),
}
LATE = {"BladedWheel", "ReducedSpinUp"}
CASES = [pytest.param(way, marks=FENICSX if way in LATE else []) for way in WAYS]


@pytest.mark.parametrize("way", CASES)
def test_the_count_is_called_n_and_the_record_is_one(way):
    function, before, words = WAYS[way]()
    names = [*inspect.signature(function).parameters]
    assert "m" not in names and names.index("n") == len(before)
    found = function(*before, n=2, **words)
    assert isinstance(found, rom.Modes)
    assert found.omega.shape == found.frequencies.shape == (2,)
    omega, shapes = found
    assert omega is found.omega and shapes is found.shapes
    each = shapes.values() if isinstance(shapes, dict) else [shapes]
    assert all(columns.shape[-1] == 2 for columns in each)
    more = function(*before, 3, **words).omega
    np.testing.assert_allclose(more[:2], omega, rtol=1e-6, atol=1e-6 * more[-1])
    refuses(ConfigError, "n = -1 must be a whole number", function, *before, -1, **words)
