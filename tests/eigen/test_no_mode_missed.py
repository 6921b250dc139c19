"""No mode is missed: generated bodies, free and held in three ways, against dense solutions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

import rom
from cases.boxes import FACES, box
from cases.long import few
from cases.solid import STEEL

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = pytest.mark.fenicsx

import dolfinx.mesh as dm  # noqa: E402

from rom.eigen import search  # noqa: E402
from rom.eigen.condensed import condensed  # noqa: E402
from rom.eigen.verbs import constraint_modes  # noqa: E402
from rom.fe.elasticity import assemble  # noqa: E402
from rom.reduction.full_model import operators  # noqa: E402
from rom.reduction.interfaces.connection import connect  # noqa: E402

KINDS = ("rbe2", "rbe3", rom.Polynomial(1), "full")


@pytest.fixture(autouse=True)
def searched(monkeypatch):
    """Small models, too, are searched by Lanczos."""
    monkeypatch.setattr(search, "MAX_DENSE_DOFS", 0)


def cut(size, cells, kept, material=STEEL, kind="hexahedron"):
    """The model of some cells of a box: ``kept`` of their middles, with the faces x0 and x1."""
    mesh, _ = box(size, cells, kind)
    mesh.topology.create_connectivity(3, 0)
    n = mesh.topology.index_map(3).size_local
    vertices = mesh.topology.connectivity(3, 0)
    X = mesh.geometry.x[mesh.geometry.dofmap.array.reshape(n, -1)].mean(axis=1)
    chosen = np.flatnonzero(kept(X))
    chosen = chosen[_largest_part([vertices.links(c) for c in chosen])]
    part = dm.create_submesh(mesh, 3, chosen.astype(np.int32))[0]
    tags = {}
    for name in ("x0", "x1"):
        axis, side = FACES[name]
        place = part.geometry.x[:, axis].min() if side == 0 else part.geometry.x[:, axis].max()
        facets = dm.locate_entities_boundary(part, 2, lambda x, p=place: abs(x[0] - p) < 1e-9)
        tags[name] = dm.meshtags(part, 2, np.sort(facets), np.ones(facets.size, dtype=np.int32))
    return assemble(part, None, tags, material=material, degree=1)


def _largest_part(cells):
    """Which cells hang together by faces, three corners or more in common."""
    n, corners = len(cells), np.concatenate(cells)
    rows = np.repeat(np.arange(n), [len(c) for c in cells])
    A = csr_matrix((np.ones(rows.size), (rows, corners)), shape=(n, corners.max() + 1))
    shared = (A @ A.T).tocoo()
    near = shared.data >= 3
    joined = csr_matrix((shared.data[near], (shared.row[near], shared.col[near])), shape=(n, n))
    label = connected_components(joined)[1]
    return np.flatnonzero(label == np.bincount(label).argmax())


def random_body(rng):
    size = rng.uniform(0.02, 1.0, 3)
    cells = tuple(int(c) for c in rng.integers([7, 4, 3], [12, 6, 5]))
    step = np.array(size) / cells
    holes = rng.random(cells) < rng.uniform(0.0, 0.25)

    def kept(X):
        i, j, k = np.minimum((X / step).astype(int), np.array(cells) - 1).T
        return ~holes[i, j, k] | (i == 0) | (i == cells[0] - 1)

    material = rom.Material(E=10 ** rng.uniform(6, 12), nu=rng.uniform(0, 0.45), rho=7850.0)
    return cut(tuple(size), cells, kept, material, str(rng.choice(["tetrahedron", "hexahedron"])))


def dense(ops, held):
    free, E = np.setdiff1d(np.arange(ops.n), held), np.eye(ops.n)
    K, M = (A[np.ix_(free, free)] for A in (ops.apply_K(E), ops.apply_M(E)))
    return eigh(K, M, eigvals_only=True)


def agree(omega, exact, rigid=0):
    """Frequencies are the lowest ones, none left out; rigid motions are exact zeros.

    A dense solution is as good as the round-off of its largest eigenvalue.
    """
    assert not omega[:rigid].any()
    found = omega[rigid:] ** 2
    assert_allclose(found, exact[rigid : omega.size], rtol=1e-7, atol=1e-15 * exact[-1])


def agree_in_all_supports(model, kind, m):
    connection = connect(operators(model), model, {"x0": kind, "x1": kind})
    ops = connection.ops
    held = ops.hold(connection.boundary)
    agree(ops.modes(held, m)[0], dense(ops, connection.boundary))
    Psi = constraint_modes(ops, held, connection.boundary)
    parts = condensed(ops, held, connection.boundary, Psi)
    for fixed in ((), ("x0",)):
        dofs = connection.held(fixed)
        exact = dense(ops, dofs)
        agree(ops.modes(parts.support(dofs), m)[0], exact, rigid=0 if fixed else 6)


@pytest.mark.parametrize("seed", few(16, range(30)))
def test_random_bodies_show_all_their_modes(seed):
    rng = np.random.default_rng(seed)
    model, m = random_body(rng), int(rng.integers(3, 25))
    agree_in_all_supports(model, KINDS[seed % 4], m)
    agree(model.operators.modes((), m + 6)[0], dense(model.operators, []), rigid=6)


@pytest.mark.parametrize("n_teeth", [2, 5, 9])
@pytest.mark.parametrize("kind", ["rbe2", "full"])
def test_clusters_are_complete_also_where_the_search_ends_inside(n_teeth, kind):

    def comb(X):  # equal cantilevers on one bed
        return (X[:, 0] < 0.1) | (np.floor(X[:, 1] / 0.02).astype(int) % 2 == 0)

    n = 2 * n_teeth - 1
    model = cut((1.0, 0.02 * n, 0.03), (10, n, 1), comb)
    for m in (n_teeth - 1, 2 * n_teeth + 1):
        agree_in_all_supports(model, kind, m)


@pytest.mark.parametrize(
    ("size", "cells"),
    [((1.0, 0.1, 0.1), (10, 3, 3)), ((1.0, 1.0, 1.0), (5, 5, 5)), ((1.0, 1.0, 0.005), (8, 8, 2))],
    ids=["square rod", "cube", "thin plate"],
)
def test_bodies_that_are_symmetric_show_their_pairs_and_triples(size, cells):
    model = cut(size, cells, every)
    agree_in_all_supports(model, "rbe2", 16)
    agree(model.operators.modes((), 20)[0], dense(model.operators, []), rigid=6)


def every(X):
    return X[:, 0] > -1.0


def test_two_hundred_modes():
    agree_in_all_supports(cut((1.0, 0.5, 0.3), (10, 7, 5), every), "rbe2", 200)


@pytest.mark.parametrize("stiffness", [1.0, 1e6, 1e12])
def test_springs_to_the_ground_hide_nothing(stiffness):
    model = cut((1.0, 0.1, 0.08), (10, 3, 2), every)
    ops = operators(model)
    nodes = np.flatnonzero(model.points[:, 0] < 1e-9)[:4]
    dofs = np.sort((3 * nodes[:, None] + np.arange(3)).ravel())
    dK = csr_matrix((np.full(dofs.size, stiffness), (dofs, dofs)), shape=(ops.n, ops.n))
    held = ops.on_springs(dK)
    agree(held.modes((), 14)[0], dense(held, []))


def test_a_stiff_part_hides_nothing():
    """A region a million times as stiff as the rest: round-off of its stiffness is no mode."""
    mesh, tags = box((1.0, 0.1, 0.08), (10, 3, 2))
    X = mesh.geometry.x[mesh.geometry.dofmap.array.reshape(-1, 8)].mean(axis=1)
    number = (X[:, 0] > 0.5).astype(np.int32)
    cells = dm.meshtags(mesh, 3, np.arange(number.size, dtype=np.int32), number)
    materials = {"soft": rom.Material(E=2e6, nu=0.3, rho=1000.0), "stiff": STEEL}
    regions = {"soft": 0, "stiff": 1}
    model = assemble(mesh, cells, tags, material=materials, regions=regions, degree=1)
    agree_in_all_supports(model, "rbe2", 16)
