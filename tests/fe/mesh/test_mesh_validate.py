"""Checks and repairs of a mesh: plain NumPy, no gmsh, no dolfinx."""

import time
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cases.files.cells import grid, second_order, solid
from cases.measures import volume
from cases.refusals import refuses
from rom.errors import MeshError, TagError
from rom.fe.mesh.cell_types import CELL_TYPES, jacobians
from rom.fe.mesh.curving import TET_HALVES, smallest_determinants, without_middles
from rom.fe.mesh.quality import aspect_ratio, layer_doubt, scaled_jacobian, straighten
from rom.fe.mesh.repair import repair
from rom.fe.mesh.solid import SolidMesh
from rom.fe.mesh.topology import faces_of, parts, row_ids
from rom.fe.mesh.validate import validate

pytestmark = pytest.mark.once
KINDS = sorted(CELL_TYPES)


@pytest.mark.parametrize("kind", KINDS)
def test_shape_functions_reproduce_linear_maps_and_the_volume_of_a_box(kind):
    cell = CELL_TYPES[kind]
    at = np.random.default_rng(0).uniform(0, 0.3, (7, 3))
    G = cell.gradients(at)
    assert_allclose(G.sum(axis=1), 0.0, atol=1e-12)
    identity = np.einsum("ka,qkb->qab", cell.nodes, G)
    assert_allclose(identity, np.tile(np.eye(3), (7, 1, 1)), atol=1e-12)
    assert volume(solid(kind, size=(3.0, 0.5, 0.7))) == pytest.approx(3.0 * 0.5 * 0.7, rel=1e-13)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
def test_a_good_box_passes_at_any_size(kind, scale):
    mesh = solid(kind)
    found = validate(repair(replace(mesh, points=mesh.points * scale)))
    assert [text for text in found if "the size of the mesh" not in text] == []
    assert len(found) == (scale != 1.0)


def test_equal_rows_get_equal_numbers_beyond_64_bits():
    rows = np.array([[1, 2, 3, 4], [4, 3, 2, 1], [1, 2, 3, 4], [10**9, 0, 0, 5]])
    number, count = row_ids(rows, 10**9 + 1)
    assert count == 3
    assert number[0] == number[2] and len({*number[[0, 1, 3]]}) == 3


def test_a_brick_has_six_faces_and_a_shared_face_two_opposite_signs():
    _, cells = grid((2, 1, 1))
    faces = faces_of(cells, CELL_TYPES["hex8"], 12)
    assert faces.count.size == 11 and (faces.count == 2).sum() == 1
    shared = faces.of_cell == np.flatnonzero(faces.count == 2)[0]
    assert sorted(faces.sign[shared]) == [-1, 1]
    assert parts(faces.of_cell)[0] == 1


def test_mirrored_cells_are_turned_round():
    for kind in KINDS:
        mesh = solid(kind)
        cells = mesh.cells.copy()
        cells[::3] = cells[::3][:, list(mesh.kind.mirrored)]
        fixed = repair(replace(mesh, cells=cells))
        assert_array_equal(fixed.cells, mesh.cells)
        assert validate(fixed) == []


@pytest.mark.parametrize(("size", "counts", "told"), [
    ((100.0, 60.0, 1.0), (10, 6, 1), (14, 14, 14)),  # cells of 14 mm, along the diagonal
    ((100.0, 60.0, 1.0), (40, 24, 1), (3.5, 0, 0)), ((100.0, 60.0, 1.0), (10, 6, 2), (0, 0, 0)),
    ((100.0, 60.0, 50.0), (4, 3, 3), (0, 0, 0)), ((100.0, 3.0, 3.0), (20, 1, 1), (3.1, 0, 0)),
])  # fmt: skip
def test_one_layer_of_cells_is_told_flat_or_rolled(size, counts, told):
    mesh = solid("tet4", counts, size)
    x, y, z = mesh.points.T
    rolled = np.column_stack([(80 + z) * np.sin(x / 80), y, (80 + z) * np.cos(x / 80)])
    for points, (degree, ratio) in product((mesh.points, rolled), enumerate(told, 1)):
        text = layer_doubt(replace(mesh, points=points), degree) or "surface, 0 times"
        assert float(text.partition("surface, ")[2].split()[0]) == pytest.approx(ratio, rel=0.1)


def test_unused_nodes_are_dropped():
    mesh = solid()
    extra = np.vstack([[[9.0, 9.0, 9.0]], mesh.points, [[np.nan, 0.0, 0.0]]])
    facets = {name: rows + 1 for name, rows in mesh.facets.items()}
    fixed = repair(replace(mesh, points=extra, cells=mesh.cells + 1, facets=facets))
    assert_array_equal(fixed.points, mesh.points)
    assert_array_equal(fixed.cells, mesh.cells)
    assert_array_equal(fixed.facets["tip"], mesh.facets["tip"])
    assert validate(fixed) == []


def test_facet_copies_are_dropped_and_shared_facets_kept_in_both_groups():
    mesh = solid()
    root = mesh.facets["root"]
    twice = {"root": np.vstack([root, root[:2, [1, 2, 0]]]), "half": root[:3]}
    fixed = repair(replace(mesh, facets=twice))
    assert len(fixed.facets["root"]) == len(root) and len(fixed.facets["half"]) == 3


def hex20(bend):
    """A brick of 20 nodes whose mid-edge nodes lie on a curved map."""
    mesh = solid("hex27", (2, 1, 1), (2.0, 1.0, 1.0))
    x, y, z = mesh.points.T
    points = np.column_stack([x, y + bend * x * x, z + bend * x * y])  # in the serendipity space
    facets = {name: rows[:, :8] for name, rows in mesh.facets.items()}
    partial = {"cells": mesh.cells[:, :20], "cell_type": "hex20", "facets": facets}
    return replace(mesh, points=points), replace(mesh, points=points, **partial)


def test_twenty_node_bricks_are_completed_without_changing_the_geometry():
    full, partial = hex20(0.2)
    fixed = repair(partial)
    assert fixed.cell_type == "hex27"
    assert_allclose(fixed.points[fixed.cells], full.points[full.cells], atol=1e-14)
    assert_allclose(fixed.points[fixed.facets["tip"]], full.points[full.facets["tip"]], atol=1e-14)
    assert len(fixed.points) == len(full.points)
    assert validate(fixed) == []


def test_quality_of_the_regular_cells():
    """1 for a cube; 1/sqrt(2) and edge over height sqrt(3/2) for a regular tetrahedron."""
    assert_allclose(scaled_jacobian(solid("hex8", (2, 2, 2), (2.0, 2.0, 2.0))), 1.0)
    points = np.array([[1.0, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]])
    regular = SolidMesh(points, np.array([[0, 1, 2, 3]]), "tet4", np.ones(1, int), {1: "body"}, {})
    assert_allclose(scaled_jacobian(repair(regular)), np.sqrt(0.5))
    assert_allclose(aspect_ratio(regular), np.sqrt(1.5))


def test_a_slender_mesh_and_a_slit_get_a_warning():
    """Two halves joined over part of their common plane, doubled nodes over the rest."""
    (text,) = validate(solid("hex8", size=(3000.0, 1.0, 1.0)))
    assert "aspect ratio up to 2e+03" in text and "12 cells" in text
    assert "aspect" in validate(solid("tet4", size=(3000.0, 1.0, 1.0)))[0]
    mesh = solid("hex8", (2, 2, 1), (2.0, 2.0, 1.0))
    right = mesh.points[mesh.cells[:, 0], 0] > 0.5
    split = np.flatnonzero((mesh.points[:, 0] == 1.0) & (mesh.points[:, 1] == 0.0))
    cells = mesh.cells.copy()
    for k, node in enumerate(split):
        cells[right] = np.where(cells[right] == node, len(mesh.points) + k, cells[right])
    points = np.vstack([mesh.points, mesh.points[split]])
    facets = {"root": mesh.facets["root"]}
    (text,) = validate(replace(mesh, points=points, cells=cells, facets=facets))
    assert "slit" in text and text.startswith("4 nodes")


@pytest.mark.long
def test_a_million_cells_are_checked_in_seconds():
    start = time.perf_counter()  # 2.9 s on one core of the machine it was written on
    mesh = solid("tet4", (55, 55, 55))
    assert validate(repair(mesh)) == []
    assert len(mesh.cells) == 998_250 and time.perf_counter() - start < 120


def moved(mesh, node, x):
    points = mesh.points.copy()
    points[node] = x
    return replace(mesh, points=points)


def recelled(mesh, cells):
    cells = np.asarray(cells)
    return replace(mesh, cells=cells, regions=np.ones(len(cells), dtype=int))


def flat_cell(mesh):
    cell = mesh.cells[5]
    return moved(mesh, cell[3], mesh.points[cell[:3]].mean(axis=0))


def renumbered(mesh, cell, corner, node):
    cells = mesh.cells.copy()
    cells[cell, corner] = node
    return recelled(mesh, cells)


def folded(mesh):
    """An inner node pulled out through the boundary: neighbours overlap."""
    inner = np.flatnonzero((mesh.points[:, 1:] == 0.5).all(axis=1) & (mesh.points[:, 0] == 1.0))[0]
    return moved(mesh, inner, [1.0, 0.5, 1.4])


def third_cell_at_a_face(mesh):
    points = np.vstack([mesh.points, [[0.1, 0.4, 7.0]]])
    new = [[*mesh.cells[0, list(face)], len(mesh.points)] for face in mesh.kind.faces]
    return replace(recelled(mesh, np.vstack([mesh.cells, new])), points=points)


def joined(mesh, shift, n_alike=None):
    """A second box, merged with the first where that many coordinates are those of the shift."""
    second, n = mesh.points + shift, len(mesh.points)
    number = np.arange(n) + n
    alike = (second[:, :n_alike] == shift[:n_alike]).all(axis=1)
    for k in np.flatnonzero(alike) if n_alike else ():
        number[k] = np.flatnonzero(np.abs(mesh.points - second[k]).max(axis=1) < 1e-12)[0]
    points, cells = np.vstack([mesh.points, second]), np.vstack([mesh.cells, number[mesh.cells]])
    return replace(recelled(mesh, cells), points=points, facets={})


def with_surface(mesh, name, facet):
    return replace(mesh, facets=mesh.facets | {name: np.array([facet])})


NO_FACETS = np.empty((0, 3), int)
FAULTS = {  # a function that spoils a box, the error, and what its message must name
    "not a number": (lambda m: moved(m, 9, [np.nan, 0, 0]), MeshError, "[nan, 0.0, 0.0]; they "),
    "infinite": (lambda m: moved(m, 9, [0, np.inf, 0]), MeshError, "inf"),
    "duplicate cell": (
        lambda m: recelled(m, np.vstack([m.cells, m.cells[7:8, [1, 2, 0, 3]]])),
        MeshError, "cells 7, 72",
    ),
    "flat cell": (flat_cell, MeshError, "(quality "),
    "node twice": (lambda m: renumbered(m, 4, 1, m.cells[4, 2]), MeshError, "node twice: cells 4"),
    "node beyond": (lambda m: renumbered(m, 3, 0, 36), MeshError, "outside 0 to 35: cells 3"),
    "negative node": (lambda m: renumbered(m, 3, 0, -1), MeshError, "outside 0 to 35: cells 3"),
    "folded": (folded, MeshError, "same side of a common face"),
    "three cells at a face": (third_cell_at_a_face, MeshError, "more than one other cell"),
    "joined at a point": (lambda m: joined(m, (3, 1, 1), 3), MeshError, "that meet only"),
    "joined along an edge": (lambda m: joined(m, (3, 1, 0), 2), MeshError, "that meet only"),
    "two bodies": (lambda m: joined(m, (9, 0, 0)), MeshError, "connected; they do not touch"),
    "doubled nodes": (lambda m: joined(m, (3, 0, 0)), MeshError, "18 nodes of them lie on nodes"),
    "facet alone": (lambda m: with_surface(m, "pin", [0, 1, 35]), TagError, "1 of 1 facets of"),
    "facet beyond": (lambda m: with_surface(m, "pin", [0, 1, 999]), TagError, "'pin' must name"),
    "no cells": (lambda m: recelled(m, np.empty((0, 4), int)), MeshError, "no volume cells"),
    "region without a name": (lambda m: replace(m, regions=m.regions + 4), TagError, "region 5"),
    "region without cells": (
        lambda m: replace(m, region_names={1: "body", 2: "liner"}), TagError, "'liner' needs cells",
    ),
    "name of two lines": (lambda m: replace(m, region_names={1: "a\nb"}), TagError, "U+000A"),
    "name turned": (lambda m: with_surface(m, "\u202enip", [0, 1, 2]), TagError, "U+202E"),
    "two regions of one name": (
        lambda m: replace(m, regions=1 + np.arange(72) % 2, region_names={1: "a", 2: "a"}),
        TagError, "'a' stands for several regions",
    ),
    "no facets": (lambda m: replace(m, facets={"pin": NO_FACETS}), TagError, "'pin' has 0 facets"),
    "unknown cells": (lambda m: replace(m, cell_type="prism6"), MeshError, "'prism6'"),
    "wrong width": (lambda m: replace(m, cell_type="tet10"), MeshError, "tet10 needs (10,)"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_refused(fault):
    spoil, error, culprit = FAULTS[fault]
    mesh = spoil(solid("tet4"))
    with pytest.raises(error) as caught:
        validate(mesh if fault in ("unknown cells", "wrong width") else repair(mesh))
    assert culprit in str(caught.value)


def test_inverted_cells_are_refused():
    """Silent in dolfinx: the element stiffness is finite and wrong."""
    for kind in ("tet4", "hex8"):
        mesh = second_order(solid(kind))
        assert validate(mesh) == []
        a, b, c, d = mesh.points[
            mesh.cells[0, :4]
        ]  # an edge and the face beyond which it is pushed
        pushed = moved(mesh, mesh.cells[0, 4], (a + b) / 2 + 1.5 * ((c + d) / 2 - (a + b) / 2))
        refuses(MeshError, "are inverted.*cells 0", validate, pushed)
    crossed = renumbered(solid("hex8"), 2, slice(8), solid("hex8").cells[2, [1, 0, *range(2, 8)]])
    refuses(MeshError, "cells 2", validate, crossed)


def test_cells_are_named_by_their_numbers_in_the_file():
    mesh = flat_cell(solid())
    cells = np.flatnonzero(scaled_jacobian(repair(mesh)) < 1e-10)
    numbered = repair(replace(mesh, cell_ids=1000 + np.arange(len(mesh.cells))))
    refuses(MeshError, f"cells {1000 + cells[0]}", validate, numbered)


def pulled(kind, share):
    """A second-order box, one node amid an edge pulled along it by a share of the edge."""
    mesh = second_order(solid(kind))
    row = mesh.cells[0]
    node = next(i for i, s in enumerate(mesh.kind.supports) if sorted(s) == [0, 1])
    a, b, middle = mesh.points[row[[0, 1, node]]]
    return moved(mesh, row[node], middle + share * (b - a))


@pytest.mark.parametrize("kind", ["tet4", "hex8"])
def test_cells_inverted_near_a_corner_alone_are_refused(kind):
    """A middle node nearer than a quarter turns the corner over, at no quadrature point yet."""
    bad = pulled(kind, 0.26)
    at_points = jacobians(bad.points[bad.cells], bad.kind.gradients(bad.kind.quadrature[0]))
    assert at_points.min() > 0.02 * at_points.max()
    refuses(MeshError, "inverted: the Jacobian changes sign inside", validate, bad)
    validate(pulled(kind, 0.24))
    validate(pulled(kind, 0.25))  # no determinant in the corner, as at the tip of a crack


def sampled_minimum(kind, x):
    """Smallest determinant of a cell on a grid, then on finer ones around the place found."""
    middle, width = np.full(3, 0.5), 1.0
    for _ in range(4):
        line = np.linspace(-0.5, 0.5, 19) * width
        grid = np.clip(middle + np.array(list(product(line, repeat=3))), 0, 1)
        if kind.shape == "tetrahedron":
            grid /= np.maximum(grid.sum(axis=1), 1)[:, None]
        values = jacobians(x[None], kind.gradients(grid))[0]
        middle, width = grid[values.argmin()], width / 6
    return values.min()


@pytest.mark.parametrize("kind", ["tet10", "hex27"])
def test_the_smallest_determinant_of_a_curved_cell_is_found(kind):
    """Within the gap of what a search by ever finer grids finds, in corners, on faces, inside."""
    kind, rng = CELL_TYPES[kind], np.random.default_rng(3)
    x = kind.nodes + 0.1 * rng.standard_normal((400, kind.n_nodes, 3))
    corners = jacobians(x, kind.gradients(np.array(kind.corners, dtype=float))).min(axis=1)
    inside = corners - jacobians(x, kind.gradients(kind.quadrature[0])).min(axis=1)
    x = x[np.argsort(-inside)[:8]]  # smallest far from the corners
    points, cells = x.reshape(-1, 3), np.arange(x.size // 3).reshape(len(x), -1)
    found = smallest_determinants(points, cells, kind, np.full(len(x), 1e-4))
    assert_allclose(found, [sampled_minimum(kind, one) for one in x], atol=2e-4)
    assert inside.max() > 0.2 and np.ptp(found) > 0.05


def test_the_halves_of_a_tetrahedron_fill_it_once():
    at = np.random.default_rng(5).dirichlet(np.ones(4), 500)[:, 1:]
    corners = np.array(CELL_TYPES["tet4"].corners, dtype=float)
    inside = np.zeros(len(at), dtype=int)
    for half in TET_HALVES:
        a, *edges = (corners[list(s)].mean(axis=0) for s in half)
        weights = np.linalg.solve(np.array(edges).T - a[:, None], (at - a).T)
        inside += (weights.min(axis=0) > 0) & (weights.sum(axis=0) < 1)
    assert_array_equal(inside, 1)


def test_cells_are_straightened_no_more_than_needed():
    """One that its curving turns inside out goes a tenth of the way back if that is enough."""
    start = pulled("tet4", 0.26)
    mesh, remarks = straighten(start)
    validate(mesh)
    n = len(second_order(solid("tet4")).cells)
    assert mesh.provenance["straightened cells"] <= mesh.provenance["curved cells"] < n
    assert "curved cells got straighter edges" in remarks[0] and "Smaller elements" in remarks[0]
    back, whole = (np.abs(start.points - x).max() for x in (mesh.points, pulled("tet4", 0).points))
    assert_allclose(back / whole, 0.1, rtol=1e-9)


def test_meshes_without_a_curved_cell_lose_the_nodes_amid_their_edges():
    for kind in ("tet4", "hex8"):
        mesh = solid(kind)
        flat = without_middles(second_order(mesh))
        assert flat.cell_type == kind
        for rows, known in ((flat.cells, mesh.cells), (flat.facets["tip"], mesh.facets["tip"])):
            assert_allclose(flat.points[rows], mesh.points[known], atol=1e-15)
        curved = pulled(kind, 0.1)
        assert without_middles(curved) is curved
