"""One factor of K_ii for every support, and random columns that see every mode."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import rom
from cases.boxes import box
from cases.solid import STEEL
from rom.eigen import lanczos, search
from rom.errors import InterfaceError

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = pytest.mark.fenicsx

from rom.eigen.completeness import LEAST_SHARE, gaussian_block  # noqa: E402
from rom.eigen.condensed import condensed  # noqa: E402
from rom.eigen.verbs import constraint_modes  # noqa: E402
from rom.fe.elasticity import assemble  # noqa: E402
from rom.fe.operators import factor, petsc  # noqa: E402
from rom.reduction.full_model import operators  # noqa: E402
from rom.reduction.interfaces.connection import connect  # noqa: E402

KINDS = ["rbe2", "rbe3", rom.Polynomial(1), "full"]


def beam(cells=(9, 3, 2), degree=1):
    mesh, tags = box((1.0, 0.1, 0.08), cells)
    return assemble(mesh, None, tags, material=STEEL, degree=degree)


def parts_of(model, kinds):
    """The model in interface coordinates, and condensed to them."""
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
    connection, parts = parts_of(beam(), {"x0": kind, "x1": kind})
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


def test_loads_in_balance_bend_the_free_body():
    connection, parts = parts_of(beam(), {"x0": "rbe2", "x1": "rbe3"})
    ops = connection.ops
    F = ops.apply_K(np.random.default_rng(2).standard_normal((ops.n, 2)))
    u = parts.support(np.zeros(0, dtype=np.int64))(F)
    assert_allclose(ops.apply_K(u), F, atol=1e-9 * np.abs(F).max())


def test_a_support_that_leaves_a_turn_is_named():
    connection, parts = parts_of(beam(), {"x0": "rbe2", "x1": "rbe2"})
    with pytest.raises(InterfaceError, match="without stiffness"):
        parts.support(connection.held({"x0": "xyz"}))


@pytest.mark.parametrize("kind", KINDS, ids=str)
@pytest.mark.parametrize("degree", [1, 2])
def test_random_columns_see_every_mode(kind, degree):
    """The variance of a component, phi^T M D^-1 M phi, in all modes of a body."""
    cells = (6, 2, 2) if degree == 1 else (3, 1, 1)
    ops = connect(operators(beam(cells, degree)), beam(cells, degree), {"x0": kind}).ops
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
    """The stages of its reduction, one of which has a factorisation."""
    stages = body.provenance["stages"]
    assert sum(table.get("number of factorisations", 0) for table in stages.values()) == 1
    return stages


def test_a_certified_reduction_takes_one_factorisation():
    body = rom.reduce(beam((20, 4, 4)), method=rom.CraigBampton(40),
                      interfaces={"x0": "rbe2", "x1": "rbe3"})  # fmt: skip
    stages = factored_once(body)
    chances = [stages[name]["probability of a missed mode"] for name in ("shapes", "comparison")]
    assert 0.0 < max(chances) < 1e-9
    assert body.certificate.ok
    exact = rom.modes(beam((20, 4, 4)), 12, interfaces={"x0": "rbe2", "x1": "rbe3"})
    full = body.provenance["comparison"]["free"]["full"]
    assert_allclose(full, exact.frequencies[6 : 6 + len(full)], rtol=1e-9)


def test_shapes_that_are_not_static_are_replaced():
    """Enhanced columns answer to inertia too; supports need constraint modes, and one factor."""
    kinds = {"x0": "rbe2", "x1": "rbe3"}
    body = rom.reduce(beam((20, 4, 4)), method=rom.EnhancedCraigBampton(40), interfaces=kinds)
    factored_once(body)
    exact = rom.modes(beam((20, 4, 4)), 6, interfaces=kinds, fixed=("x0",)).frequencies
    assert_allclose(body.provenance["comparison"]["x0 held"]["full"], exact, rtol=1e-9)


def test_a_search_that_was_restarted_is_counted(monkeypatch):
    """What is left of the start after a restart proves nothing."""
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
