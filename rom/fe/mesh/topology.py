"""Faces, neighbours and connected parts of a mesh, from the cell table alone."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from rom.fe.mesh.cell_types import CellType
from rom.model import Index, Integers


@dataclass(frozen=True, slots=True)
class Faces:
    """The distinct faces of a mesh."""

    of_cell: Index  # (m, f) face number of each face of each cell
    # (m, f) +1 or -1: direction in which the cell runs around the face; two neighbours that lie on
    # opposite sides have opposite signs
    sign: Integers
    count: Index  # (n_faces,) number of cells at each face
    corners: Index  # (n_faces, c) corner nodes of each face, as one of its cells lists them


def row_ids(rows: Index, n: int) -> tuple[Index, int]:
    """(k,) numbers 0, 1, ... of the distinct rows (k, c) of integers in [0, n), and how many."""
    key, size = rows[:, 0].astype(np.int64), max(n, 1)
    for column in rows.T[1:]:
        if size > 2**62 // max(n, 1):  # the combined key would leave 64 bits
            values, key = np.unique(key, return_inverse=True)
            size = values.size
        key = key * n + column
        size *= n
    values, key = np.unique(key, return_inverse=True)
    return key, values.size


def find_rows(wanted: Index, known: Index, n: int) -> Index:
    """(k,) which of the known rows has the nodes of each wanted one (k, c), in any order, or -1."""
    number, n_rows = row_ids(np.sort(np.vstack([known, wanted]), axis=1), n)
    place = np.full(n_rows, -1)
    place[number[: len(known)]] = np.arange(len(known))
    return place[number[len(known) :]]


def _direction(faces: Index) -> Integers:
    """(k,) +1 or -1: whether the list runs from its smallest node to the smaller neighbour."""
    k, c = faces.shape
    first = faces.argmin(axis=1)
    after = faces[np.arange(k), (first + 1) % c]
    before = faces[np.arange(k), (first - 1) % c]
    return np.where(after < before, 1, -1).astype(np.int8)


def faces_of(cells: Index, kind: CellType, n_points: int) -> Faces:
    """Number the faces of all cells."""
    listed = cells[:, np.array(kind.faces)].reshape(-1, kind.corners_per_face)
    number, n_faces = row_ids(np.sort(listed, axis=1), n_points)
    corners = np.empty((n_faces, kind.corners_per_face), dtype=np.int64)
    corners[number] = listed
    shape = (cells.shape[0], len(kind.faces))
    return Faces(
        of_cell=number.reshape(shape),
        sign=_direction(listed).reshape(shape),
        count=np.bincount(number, minlength=n_faces),
        corners=corners,
    )


def outer_facets(cells: Index, kind: CellType, n_points: int) -> Index:
    """(f, kf) all nodes of the faces that one cell alone has, in the order of gmsh."""
    faces, listed = faces_of(cells, kind, n_points), cells[:, np.array(kind.face_nodes)]
    return listed[faces.count[faces.of_cell] == 1]


def parts(touched: Index) -> tuple[int, Index]:
    """Number of parts that hang together, and the part of each cell.

    Through faces or nodes (m, k) that the cells touch.
    """
    return parts_of(np.repeat(np.arange(len(touched)), touched.shape[1]), touched.ravel())


def parts_of(cell: Index, item: Index) -> tuple[int, Index]:
    """The same of cells (e,), all of them among these, that touch items (e,)."""
    used, item = np.unique(item, return_inverse=True)
    m = int(cell.max(initial=-1)) + 1
    n = m + used.size
    graph = coo_matrix((np.ones(cell.size, dtype=np.int8), (cell, m + item)), shape=(n, n))
    count, label = connected_components(graph, directed=False)
    return count, label[:m]
