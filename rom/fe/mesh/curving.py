"""Cells with curved edges: where their Jacobian is smallest, and straight edges in their place.

The determinant of the geometry map is a polynomial, of degree 3 on a tetrahedron with 10 nodes and
5 in each direction on a hexahedron with 27. Its values lie between its smallest and its largest
Bezier coefficient, and the coefficients at the corners are values; halves of a cell give closer
bounds.

Source:
    Johnen, Remacle and Geuzaine, Geometrical validity of curvilinear finite elements, J. Comput.
    Phys. 233 (2013) 359.
"""

from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from math import comb, factorial

import numpy as np

from rom.fe.mesh.cell_types import CELL_TYPES, CellType, jacobians, over_blocks
from rom.fe.mesh.solid import SolidMesh, compact
from rom.model import Array, Index, Integers, Mask

STRAIGHT_EDGE_RTOL = 1e-9  # of the edge: distance of its mid-side node from the middle
BOUND_GAP = 1e-4  # of the cube of the cell: how well the smallest determinant is known
MOST_HALVINGS = 12
DEGREES = {"tetrahedron": 3, "hexahedron": 5}  # of the determinant
# Corners of the eight halves of a tetrahedron: a number, or two for the middle of an edge.
TET_HALVES = (
    *(((0,), (0, 1), (0, 2), (0, 3)), ((0, 1), (1,), (1, 2), (1, 3))),
    *(((0, 2), (1, 2), (2,), (2, 3)), ((0, 3), (1, 3), (2, 3), (3,))),
    *(((0, 1), (0, 2), (0, 3), (1, 3)), ((0, 1), (1, 2), (0, 2), (1, 3))),
    *(((0, 2), (0, 3), (1, 3), (2, 3)), ((0, 2), (1, 2), (2, 3), (1, 3))),
)


def bent(mesh: SolidMesh) -> Mask:
    """(m,) whether any node of a cell lies away from the mean of its corners."""
    points, cells, kind = mesh.points, mesh.cells, mesh.kind
    found = np.zeros(len(cells), dtype=np.bool_)
    for node, support in enumerate(kind.supports[kind.n_corners :], kind.n_corners):
        corners = points[cells[:, list(support)]]
        away = np.abs(points[cells[:, node]] - corners.mean(axis=1)).max(axis=1)
        found |= away > STRAIGHT_EDGE_RTOL * np.ptp(corners, axis=1).max(axis=1)
    return found


def without_middles(mesh: SolidMesh) -> SolidMesh:
    """The same body with cells of first order, where no cell is curved; else the mesh itself."""
    if mesh.kind.degree == 1 or bent(mesh).any():
        return mesh
    kind = mesh.kind.straight
    facets = {name: rows[:, : kind.corners_per_face] for name, rows in mesh.facets.items()}
    return compact(replace(mesh, cells=mesh.corners, cell_type=kind.name, facets=facets))


def straightened(mesh: SolidMesh, cells: Mask, share: float) -> SolidMesh:
    """Some cells (m,) with their nodes a share of the way nearer to the straight cell.

    Neighbours, which have the nodes in common, follow.
    """
    points, rows, kind = mesh.points.copy(), mesh.cells[cells], mesh.kind
    for node, support in enumerate(kind.supports[kind.n_corners :], kind.n_corners):
        middle = mesh.points[rows[:, list(support)]].mean(axis=1)
        points[rows[:, node]] = (1 - share) * mesh.points[rows[:, node]] + share * middle
    return replace(mesh, points=points)


def smallest_determinants(points: Array, cells: Index, kind: CellType, gap: Array) -> Array:
    """(m,) smallest determinant of the geometry map in curved cells (m, k) of one kind.

    Of points (n, 3) [m]; a value may be above the smallest by the gap (m,) [m^3].
    """
    every = np.arange(len(cells))
    return over_blocks(every, lambda rows: _smallest(points[cells[rows]], kind, gap[rows]), 5000)


def _smallest(x: Array, kind: CellType, gap: Array) -> Array:
    """Branch and bound: pieces that may hold a smaller value than the smallest found are halved."""
    bezier = _bezier(kind.shape)
    pieces = jacobians(x, kind.gradients(bezier.lattice)) @ bezier.coefficients.T
    owner = np.arange(len(x))
    smallest = pieces[:, bezier.corners].min(axis=1)
    for _ in range(MOST_HALVINGS):
        open_ = pieces.min(axis=1) < (smallest - gap)[owner]
        if not open_.any():
            return smallest
        pieces = (pieces[open_] @ bezier.halving).reshape(-1, pieces.shape[1])
        owner = np.repeat(owner[open_], len(bezier.halving.T) // pieces.shape[1])
        np.minimum.at(smallest, owner, pieces[:, bezier.corners].min(axis=1))
    np.minimum.at(smallest, owner, pieces.min(axis=1))  # not closer: a bound from below
    return smallest


@dataclass(frozen=True, slots=True)
class Bezier:
    """Polynomials on a reference cell by c coefficients."""

    lattice: Array  # (c, 3) points at which values are taken
    coefficients: Array  # (c, c) coefficients from values at the lattice
    corners: Index  # positions of the coefficients that are values at the corners
    halving: Array  # (c, 8 c) transposed: coefficients on eight halves from those on the cell


@cache
def _bezier(shape: str) -> Bezier:
    exponents, degree = _exponents(shape), DEGREES[shape]
    lattice = exponents[:, 1:] / degree if shape == "tetrahedron" else exponents / degree
    coefficients = np.linalg.inv(_bernstein(shape, lattice))
    halves = [coefficients @ _bernstein(shape, x) for x in _halves(shape, lattice)]
    at_corner = np.isin(exponents, (0, degree)).all(axis=1)
    return Bezier(lattice, coefficients, np.flatnonzero(at_corner), np.vstack(halves).T)


def _exponents(shape: str) -> Integers:
    """(c, 4) barycentric ones that add up to the degree, or (c, 3) along each direction."""
    degree = DEGREES[shape]
    if shape == "hexahedron":
        return np.array(list(product(range(degree + 1), repeat=3)))
    powers = np.array(list(product(range(degree + 1), repeat=4)))
    return powers[powers.sum(axis=1) == degree]


def _bernstein(shape: str, x: Array) -> Array:
    """(q, c) Bernstein polynomials at (q, 3) points."""
    exponents, degree = _exponents(shape), DEGREES[shape]
    if shape == "tetrahedron":
        divisors = [np.prod([factorial(i) for i in e]) for e in exponents]
        weights = factorial(degree) / np.array(divisors)
        barycentric = np.column_stack([1 - x.sum(axis=1), x])
        return weights * np.prod(barycentric[:, None] ** exponents, axis=2)
    weights = np.array([np.prod([comb(degree, i) for i in e]) for e in exponents])
    terms = x[:, None] ** exponents * (1 - x[:, None]) ** (degree - exponents)
    return weights * np.prod(terms, axis=2)


def _halves(shape: str, lattice: Array) -> list[Array]:
    """The lattice in each of eight halves."""
    if shape == "hexahedron":
        return [0.5 * (lattice + corner) for corner in product((0, 1), repeat=3)]
    corners = np.array(CELL_TYPES["tet4"].corners, dtype=float)
    barycentric = np.column_stack([1 - lattice.sum(axis=1), lattice])
    halves = ([corners[list(s)].mean(axis=0) for s in half] for half in TET_HALVES)
    return [barycentric @ np.array(half) for half in halves]
