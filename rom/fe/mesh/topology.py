"""Faces, neighbours and connected parts of a mesh, from the cell table alone."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from rom.fe.mesh.cell_types import CellType
from rom.model import Index, Integers


@dataclass(frozen=True, slots=True)
class Faces:
    """The distinct faces of a mesh.

    Attributes:
        of_cell: (m, f) face number of each face of each cell.
        sign: (m, f) +1 or -1: direction in which the cell runs around the face; two neighbours
            that lie on opposite sides have opposite signs.
        count: (n_faces,) number of cells at each face.
        corners: (n_faces, c) corner nodes of each face, as one of its cells lists them.
    """

    of_cell: Index
    sign: Integers
    count: Index
    corners: Index


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


def parts_by_face(faces: Faces) -> tuple[int, Index]:
    """Number of parts whose cells hang together through faces, and the part of each cell."""
    m, f = faces.of_cell.shape
    return _parts(np.repeat(np.arange(m), f), faces.of_cell.ravel(), m)


def parts_by_node(corners: Index) -> tuple[int, Index]:
    """Number of parts that share no node at all, and the part of each cell."""
    m, c = corners.shape
    return _parts(np.repeat(np.arange(m), c), corners.ravel(), m)


def _parts(cell: Index, item: Index, m: int) -> tuple[int, Index]:
    """Components of the graph whose edges join cells to the faces or nodes they touch."""
    used, item = np.unique(item, return_inverse=True)
    n = m + used.size
    graph = coo_matrix((np.ones(cell.size, dtype=np.int8), (cell, m + item)), shape=(n, n))
    count, label = connected_components(graph, directed=False)
    return count, label[:m]
