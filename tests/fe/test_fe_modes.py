"""Factorisation, shifts, counts and refusals of the PETSc operators; one factor for any support."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.sparse import block_diag, coo_matrix, csr_matrix, diags, identity

import rom
from cases.boxes import box, faces_held
from cases.measures import memory_taken
from cases.operators import petsc_operators
from cases.refusals import refuses
from cases.solid import STEEL
from rom.eigen import lanczos, search
from rom.errors import InterfaceError, ModelError, ResourceError

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = pytest.mark.fenicsx

from rom.eigen.completeness import LEAST_SHARE, gaussian_block  # noqa: E402
from rom.eigen.condensed import condensed  # noqa: E402
from rom.eigen.verbs import constraint_modes  # noqa: E402
from rom.fe.elasticity import assemble  # noqa: E402
from rom.fe.operators import factor, memory, petsc, spectrum  # noqa: E402
from rom.reduction.full_model import operators  # noqa: E402
from rom.reduction.interfaces.connection import connect  # noqa: E402


def beam(cells=(10, 2, 2), size=(1.0, 0.1, 0.08), degree=1):
    mesh, tags = box(size, cells)
    return assemble(mesh, None, tags, material=STEEL, degree=degree)


@pytest.fixture(scope="module")
def small():
    return beam()


@pytest.fixture(scope="module")
def exact(small):
    return eigh(small.K.toarray(), small.M.toarray(), eigvals_only=True)


@pytest.mark.parametrize("shift", [-1e4, -1e6, -2.6e7, -1e8])
def test_the_297_dof_beam_keeps_its_six_rigid_motions(small, exact, shift, monkeypatch):
    """Without deflation Krylov-Schur finds 5, 3 or 2 of the six at these shifts, and is content."""
    monkeypatch.setattr(search, "MAX_DENSE_DOFS", 0)
    assert small.n_dofs == 297
    omega, _ = small.operators.modes((), 8, sigma=shift)
    assert_allclose(omega[:6], 0.0, atol=0.0)
    assert_allclose(omega[6:] ** 2, exact[6:8], rtol=1e-8)


@pytest.mark.parametrize("sigma", [1e3, 3e7, 1e9])
def test_inertia_counts_the_modes_below_a_shift(small, exact, sigma):
    assert small.operators.indefinite(sigma).negative_pivots() == np.count_nonzero(exact < sigma)


def test_slepc_and_our_block_lanczos_find_the_same_modes(monkeypatch):
    """Dofs held go to SLEPc, a stiffness factored before to blocks; shapes and signs agree."""
    model, called = beam((14, 4, 3)), []
    for module, name in ((petsc, "krylov_schur"), (search, "BlockLanczos")):
        real = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *a, _n=name, _r=real: called.append(_n) or _r(*a))
    monkeypatch.setattr(search, "MAX_DENSE_DOFS", 0)
    dofs = model.interfaces["x0"].dofs
    omega, Phi = model.operators.modes(dofs, 25)
    block_omega, block_Phi = model.operators.modes(model.operators.hold(dofs), 25)
    assert called == ["krylov_schur", "BlockLanczos"]
    assert_allclose(block_omega, omega, rtol=1e-10)
    assert_allclose(block_Phi, Phi, atol=1e-7 * np.abs(Phi).max())


def test_counting_in_the_place_of_the_factor_leaves_the_stiffness_as_it_was(monkeypatch):
    model = beam((10, 3, 3))
    monkeypatch.setattr(search, "MAX_DENSE_DOFS", 0)
    held = model.operators.hold(model.interfaces["x0"].dofs)
    before = held.inner.K.norm()
    first, _ = model.operators.modes(held, 12, finished=True)
    assert held.inner.K.norm() == before
    again, _ = model.operators.modes(held, 12, finished=True)
    assert_allclose(again, first, rtol=1e-12)


@pytest.mark.parametrize("copies", [2 * lanczos.BLOCK_SIZE, 350])
def test_a_krylov_space_that_closes_early_is_left_for_another(copies):
    """Two eigenvalues: a block finds as many vectors of each as it has, and then nothing new."""
    m = 2 * lanczos.BLOCK_SIZE + 1
    lam = np.repeat([1.0, 4.0], [copies, 700 - copies])
    ops = petsc_operators(SimpleNamespace(K=diags(lam), M=identity(lam.size), points=None))
    omega, Phi = ops.modes(ops.hold([699]), m)
    assert_allclose(omega**2, lam[:m], rtol=1e-10)
    assert_allclose(Phi.T @ Phi, np.eye(m), atol=1e-9)


def test_the_shift_is_an_upper_bound_and_points_are_read_back_from_the_rigid_motions(small, exact):
    estimate = spectrum.first_elastic(small.operators)
    assert exact[6] <= estimate < 1.5 * exact[6]
    assert_allclose(spectrum.points_of(small.operators.rigid), small.points, atol=1e-15)


@pytest.mark.long
def test_modes_of_equal_frequency_do_not_depend_on_the_way_they_were_found():
    """A square beam: two planes of bending for each frequency, fixed by convention only."""
    model = beam((8, 2, 2), (1.0, 0.1, 0.1), degree=2)
    ops, held = model.operators, model.interfaces["x0"].dofs
    omega, Phi = ops.modes(held, 6)
    assert_allclose(omega[0], omega[1], rtol=1e-9)
    Q, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(2, 2)))
    turned = np.hstack([Phi[:, :2] @ Q, Phi[:, 2:]])
    again = spectrum.signed(ops, search.settled(ops, omega**2, turned))
    assert_allclose(again, Phi, atol=1e-9 * np.abs(Phi).max())


def test_a_part_that_hangs_on_nothing_is_a_mechanism():
    one = beam((8, 2, 2))
    points = np.vstack([one.points, one.points + np.array([0.0, 0.0, 1.0])])
    K, M = (block_diag([A, A], "csr") for A in (one.K, one.M))
    ops = petsc_operators(SimpleNamespace(K=K, M=M, points=points))
    with pytest.raises(ModelError, match="6 more motions without stiffness than the six") as raised:
        ops.modes((), 14)
    assert place_in(raised.value)[2] in (0.0, 0.08, 1.0, 1.08)  # a corner, of either beam
    with pytest.raises(InterfaceError, match="leave a rigid motion free") as raised:
        ops.hold(one.interfaces["x0"].dofs)
    assert place_in(raised.value)[2] >= 1.0
    n = len(points)
    said = f"and {n // 2} of {n} nodes move, between (0, 0, 1) m and (1, 0.1, 1.08) m."
    assert said in raised.value.message


def test_a_factor_that_breaks_down_is_named_by_the_part_that_moves(small, monkeypatch):
    """On a pivot of zero MUMPS gives up, and there is no solution to look at."""

    def breaks_down(made, *, definite):
        computed(made, definite=definite)
        made.ok = not definite

    computed = factor.Factor.compute
    monkeypatch.setattr(factor.Factor, "compute", breaks_down)
    ops = small.operators
    corner = small.points.argmin(axis=0)[0]
    with pytest.raises(InterfaceError, match="leave a rigid motion free") as raised:
        ops.hold(3 * corner + np.arange(3))
    assert np.linalg.norm(place_in(raised.value) - small.points[corner]) > 0.8
    assert "and 98 of 99 nodes move" in raised.value.message


def place_in(error):
    words = error.message.split("It moves most at (")[1].split(")")[0]
    return np.array([float(word) for word in words.split(",")])


def test_a_part_that_hangs_on_a_line_is_named_by_its_far_end():
    """A second beam shares one edge with the first, about which it turns."""
    one = beam((8, 2, 2))
    moved = one.points + np.array([1.0, 0.0, 0.08])
    k = len(moved)
    same = np.linalg.norm(moved[:, None] - one.points, axis=2) < 1e-9
    assert same.any(axis=1).sum() == 3  # the nodes of the hinge
    number = np.where(same.any(axis=1), same.argmax(axis=1), -1)
    number[number < 0] = k + np.arange(k - 3)
    nodes = np.concatenate([np.arange(k), number])
    dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
    T = csr_matrix(coo_matrix((np.ones(6 * k), (np.arange(6 * k), dofs))))
    points = np.zeros((2 * k - 3, 3))
    points[nodes] = np.vstack([one.points, moved])
    K, M = ((T.T @ block_diag([A, A]) @ T).tocsr() for A in (one.K, one.M))
    for A in (K, M):
        A.sort_indices()
    ops = petsc_operators(SimpleNamespace(K=K, M=M, points=points))
    with pytest.raises(InterfaceError, match="leave a rigid motion free") as raised:
        ops.hold(one.interfaces["x0"].dofs)
    assert_allclose(place_in(raised.value)[[0, 2]], [2.0, 0.16], atol=1e-6)
    assert "hangs on a point or on a line" in raised.value.hint


def test_a_plane_that_slides_is_no_support_nor_is_nothing(small):
    for held in ({"x0": (0,)}, {"x0": (1, 2)}, {"z0": (2,)}):
        dofs = faces_held(small, held)
        refuses(InterfaceError, "leave a rigid motion free", small.operators.hold, dofs)
    refuses(InterfaceError, "the 0 boundary dofs leave a rigid", small.operators.hold, [])


def test_a_factor_that_does_not_fit_is_refused_before_it_is_made_or_after_the_analysis(monkeypatch):
    # the law beside MUMPS estimates of blocks of quadratic tetrahedra (bytes, on one process)
    for n, measured in ((16_731, 71e6), (80_703, 619e6), (224_547, 2489e6)):
        assert_allclose(memory.factor_bytes(n), measured, rtol=0.1)
    model = beam((20, 6, 6))
    monkeypatch.setattr(memory, "free_bytes", lambda: 1e5)
    hold, face = model.operators.hold, model.interfaces["x0"].dofs
    refuses(ResourceError, r"predicted to take 0.0\d GiB; 0.00 GiB may be used", hold, face)
    monkeypatch.setattr(petsc, "check_factor_memory", lambda *args, **kwds: None)
    monkeypatch.setattr(memory, "free_bytes", lambda: 4e6)
    refuses(ResourceError, r"factoring 2940 dofs is predicted to take 0.0\d GiB", hold, face)


def test_factors_that_are_let_go_leave_no_memory_behind():
    """A process that has reserved more than the machine has cannot fork any more."""
    model = beam((20, 6, 6))
    boundary = model.interfaces["x0"].dofs
    model.operators.hold(boundary)
    before = memory_taken("VmRSS", "VmSize")
    for _ in range(15):  # a factor takes 10 MB
        model.operators.hold(boundary)
    resident, reserved = memory_taken("VmRSS", "VmSize") - before
    assert resident < 40e6 and reserved < 2e9


def test_a_factor_that_outgrows_its_first_offer_is_made_with_a_larger_one(monkeypatch):
    model = beam((20, 6, 6))
    fixed = model.interfaces["x0"].dofs
    F = np.eye(model.n_dofs, 2, -300)
    expected = model.operators.hold(fixed)(F)
    offer, offers = factor.Factor._offer, []
    monkeypatch.setattr(factor, "WORKSPACE_RATIO", 0.0)
    monkeypatch.setattr(factor, "LEAST_WORKSPACE", 1e6)
    monkeypatch.setattr(factor.Factor, "_offer", lambda f, w: offers.append(w) or offer(f, w))
    assert_allclose(model.operators.hold(fixed)(F), expected, rtol=1e-9, atol=1e-22)
    assert offers[0] < offers[1] and offers[0] == 1e6


KINDS = ["rbe2", "rbe3", rom.Polynomial(1), "full"]


def parts_of(model, kinds):
    connection = connect(operators(model), model, kinds)
    ops = connection.ops
    held = ops.hold(connection.boundary)
    Psi = constraint_modes(ops, held, connection.boundary)
    return connection, condensed(ops, held, connection.boundary, Psi)


def matrices(ops, free=slice(None)):
    E = np.eye(ops.n)
    return ops.apply_K(E)[free][:, free], ops.apply_M(E)[free][:, free]


@pytest.mark.parametrize("kind", KINDS, ids=str)
@pytest.mark.parametrize("fixed", [(), ("x0",), ("x0", "x1"), {"x0": "xyz", "x1": "xyz"}])
def test_modes_in_every_support_are_those_of_the_matrices(kind, fixed, monkeypatch):
    monkeypatch.setattr(search, "MAX_DENSE_DOFS", 0)
    monkeypatch.setattr(lanczos, "MAX_EXTRA_BLOCKS", 14)
    connection, parts = parts_of(beam((12, 3, 2)), {"x0": kind, "x1": kind})
    if isinstance(fixed, dict) and kind in ("rbe2", "rbe3"):
        fixed = {"x0": "xyz rx", "x1": "yz"}  # rigid faces turn
    ops, dofs = connection.ops, connection.held(fixed)
    count = []
    monkeypatch.setattr(factor.Factor, "compute", lambda *a, **k: count.append(1))
    omega, Phi = ops.modes(parts.support(dofs), 12)
    assert not count  # no other factor
    free = np.setdiff1d(np.arange(ops.n), dofs)
    K, M = matrices(ops, free)
    exact = eigh(K, M, eigvals_only=True, subset_by_index=(0, 11))
    rigid = 0 if fixed else 6
    assert not omega[:rigid].any()
    assert_allclose(omega[rigid:] ** 2, exact[rigid:], rtol=1e-9)
    assert not Phi[dofs].any()
    assert_allclose(Phi[free].T @ M @ Phi[free], np.eye(12), atol=1e-9)
    defect = K @ Phi[free] - M @ Phi[free] * omega**2
    assert np.abs(defect).max() < 1e-7 * np.abs(K @ Phi[free]).max()


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_deflections_in_a_support_are_those_of_the_matrices(kind):
    connection, parts = parts_of(beam((9, 3, 2)), {"x0": kind, "x1": kind})
    ops, dofs = connection.ops, connection.held(("x0",))
    F = np.random.default_rng(1).standard_normal((ops.n, 3))
    free = np.setdiff1d(np.arange(ops.n), dofs)
    u = parts.support(dofs)(F)
    assert not u[dofs].any()
    exact = np.linalg.solve(matrices(ops, free)[0], F[free])
    assert_allclose(u[free], exact, atol=1e-8 * np.abs(u).max())


def test_a_body_that_carries_a_few_dofs_is_solved_by_the_factor_without_them():
    """As with the matrix in which averages of a face make dense blocks."""
    model = beam((9, 3, 2), degree=2)
    connection = connect(operators(model), model, {"x0": "rbe3", "x1": "rbe3"})
    ops, inside = connection.ops, np.setdiff1d(np.arange(connection.ops.n), connection.boundary)
    part = ops.part(inside)
    assert isinstance(part, petsc.CarryingOperators) and part.carried.size == 12
    K, _ = matrices(ops, inside)
    assert_allclose(part.apply_K(np.eye(part.n)), K, atol=1e-12 * np.abs(K).max())
    F = np.random.default_rng(3).standard_normal((part.n, 3))
    u = part.stiffness_inverse(None).solve(F)
    assert_allclose(u, np.linalg.solve(K, F), atol=1e-9 * np.abs(u).max())
    n_entries = [A.getInfo()["nz_used"] for A in (part.bare.K, part.K)]
    assert n_entries[0] < 0.9 * n_entries[1]  # the factor is of the first


def test_loads_in_balance_bend_the_free_body_and_a_support_that_leaves_a_turn_is_named():
    connection, parts = parts_of(beam((9, 3, 2)), {"x0": "rbe2", "x1": "rbe3"})
    ops = connection.ops
    F = ops.apply_K(np.random.default_rng(2).standard_normal((ops.n, 2)))
    u = parts.support(np.zeros(0, dtype=np.int64))(F)
    assert_allclose(ops.apply_K(u), F, atol=1e-9 * np.abs(F).max())
    refuses(InterfaceError, "without stiffness", parts.support, connection.held({"x0": "xyz"}))


@pytest.mark.parametrize("kind", KINDS, ids=str)
@pytest.mark.parametrize("degree", [1, 2])
def test_random_columns_see_every_mode(kind, degree):
    """The variance of a component, phi^T M D^-1 M phi, in all modes of a body."""
    model = beam((6, 2, 2) if degree == 1 else (3, 1, 1), degree=degree)
    ops = connect(operators(model), model, {"x0": kind}).ops
    _, M = matrices(ops)
    scale = 1.0 / np.sqrt(ops.mass_diagonal)
    shares = np.linalg.eigvalsh(scale[:, None] * M * scale)
    assert shares[0] > LEAST_SHARE


def test_random_columns_are_normal_and_independent():
    ops = beam((24, 6, 5)).operators
    X = gaussian_block(ops, 6) * np.sqrt(ops.mass_diagonal)[:, None]
    n = X.size
    assert abs(X.mean()) < 4 / np.sqrt(n)
    assert abs(X.var() - 1) < 4 * np.sqrt(2 / n)
    assert abs((X**4).mean() - 3) < 4 * np.sqrt(96 / n)
    assert np.abs(np.corrcoef(X.T) - np.eye(6)).max() < 4.5 / np.sqrt(ops.n)
    for lag in (1, 2, 3):
        assert abs((X[lag:] * X[:-lag]).mean()) < 4.5 / np.sqrt(n)


def factored_once(body):
    stages = body.provenance["stages"]
    assert sum(table.get("number of factorisations", 0) for table in stages.values()) == 1
    return stages


def test_a_certified_reduction_takes_one_factorisation():
    model, kinds = beam((20, 4, 4)), {"x0": "rbe2", "x1": "rbe3"}
    body = rom.reduce(model, method=rom.CraigBampton(40), interfaces=kinds)
    stages = factored_once(body)
    chances = [stages[name]["probability of a missed mode"] for name in ("shapes", "comparison")]
    assert 0.0 < max(chances) < 1e-9
    assert body.certificate.ok
    exact = rom.modes(model, 12, interfaces=kinds)
    full = body.provenance["comparison"]["free"]["full"]
    assert_allclose(full, exact.frequencies[6 : 6 + len(full)], rtol=1e-9)
    # enhanced columns answer to inertia too; supports need constraint modes, and one factor
    body = rom.reduce(model, method=rom.EnhancedCraigBampton(40), interfaces=kinds)
    factored_once(body)
    exact = rom.modes(model, 6, interfaces=kinds, fixed=("x0",)).frequencies
    assert_allclose(body.provenance["comparison"]["x0 held"]["full"], exact, rtol=1e-9)


def test_a_search_that_was_restarted_is_counted(monkeypatch):
    model, counted = beam((14, 4, 3)), []
    monkeypatch.setattr(search, "MAX_DENSE_DOFS", 0)
    monkeypatch.setattr(petsc.PETScOperators, "count_below", lambda *a: counted.append(1))
    held = model.operators.hold(model.interfaces["x0"].dofs)
    expected, _ = model.operators.modes(held, 10)
    assert not counted
    monkeypatch.setattr(lanczos, "capacity", lambda k: k + 5 * lanczos.BLOCK_SIZE)
    omega, _ = model.operators.modes(held, 10)
    assert counted
    assert_allclose(omega, expected, rtol=1e-10)
