"""Nested dissection: the dofs of sparse matrices cut into a tree of substructures."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import maximum_bipartite_matching

from rom.model import Index

Chosen = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Substructure:
    """A part of the body, or dofs that separate parts.

    Attributes:
        first: place of its first dof in the order of elimination.
        end: place after its last one.
        boundary: (k,) places of the later dofs that it is coupled to once earlier ones are gone.
        parent: number of the substructure with the first of these; -1 if there are none.
    """

    first: int
    end: int
    boundary: Index
    parent: int

    @property
    def size(self) -> int:
        """Number of its own dofs."""
        return self.end - self.first

    @property
    def places(self) -> Index:
        """(size + k,) places of its own dofs, then of its boundary."""
        return np.concatenate([np.arange(self.first, self.end), self.boundary])


def dissected(A: csr_matrix, largest: int) -> tuple[Index, list[Substructure]]:
    """An order of the dofs, parts before what separates them, and the substructures in it.

    Args:
        A: (n, n) symmetric matrix with all couplings.
        largest: number of dofs that are cut no further.
    """
    nodes = _alike(A)
    size = np.bincount(nodes)
    members = np.split(np.argsort(nodes, kind="stable"), np.cumsum(size)[:-1])
    P = csr_matrix((np.ones(nodes.size), nodes, np.arange(nodes.size + 1)))
    pieces: list[Index] = []
    _cut(csr_matrix(P.T @ A @ P), size, np.arange(size.size), largest, pieces)
    parts = [np.concatenate([members[node] for node in piece]) for piece in pieces]
    order = np.concatenate(parts)
    return order, _coupled(A[order][:, order], np.cumsum([0, *(part.size for part in parts)]))


def _alike(A: csr_matrix) -> Index:
    """(n,) numbers of nodes: dofs with the same neighbours belong to one."""
    pattern = csr_matrix((np.ones(A.nnz, dtype=np.int64), A.indices, A.indptr), shape=A.shape)
    marks = np.random.default_rng(1).integers(1 << 62, size=A.shape[0])
    return np.unique(pattern @ marks, return_inverse=True)[1]


def _cut(graph: csr_matrix, size: Index, nodes: Index, largest: int, pieces: list[Index]) -> None:
    """Append the pieces of some nodes, parts before their separators."""
    if nodes.size == 0:
        return
    if size[nodes].sum() > largest:
        inner = graph[nodes][:, nodes]
        half = _half(inner, size[nodes])
        separator = _separator(inner, half)
        sides = [nodes[side & ~separator] for side in (half, ~half)]
        if all(side.size for side in sides):
            for side in sides:
                _cut(graph, size, side, largest, pieces)
            nodes = nodes[separator]
    if nodes.size:
        pieces.append(nodes)


def _half(graph: csr_matrix, size: Index) -> Chosen:
    """(n,) whether a node lies nearer to one of two far ends; half the dofs do."""
    one_end = int(np.argmax(_distances(graph, 0)))
    from_one = _distances(graph, one_end)
    from_other = _distances(graph, int(np.argmax(from_one)))
    aside = _distances(graph, int(np.argmax(np.minimum(from_one, from_other))))
    order = np.lexsort((aside, from_one - from_other))
    half = np.zeros(size.size, dtype=bool)
    half[order[: np.searchsorted(np.cumsum(size[order]), 0.5 * size.sum()) + 1]] = True
    return half


def _distances(graph: csr_matrix, start: int) -> Index:
    """(n,) numbers of edges to a node, counted breadth first; those out of reach come last."""
    distance, front, level = np.full(graph.shape[0], -1), np.array([start]), 0
    while front.size:
        distance[front] = level
        near = graph[front].indices
        front, level = np.unique(near[distance[near] < 0]), level + 1
    distance[distance < 0] = level
    return distance


def _separator(graph: csr_matrix, half: Chosen) -> Chosen:
    """(n,) fewest nodes that touch all edges between the halves, by Koenig's theorem."""
    left, right = np.flatnonzero(half), np.flatnonzero(~half)
    edges = csr_matrix(graph[left][:, right])
    partner = maximum_bipartite_matching(edges, perm_type="column")
    mate = np.full(right.size, -1)
    mate[partner[partner >= 0]] = np.flatnonzero(partner >= 0)
    seen_left, seen_right = partner < 0, np.zeros(right.size, dtype=bool)
    front = np.flatnonzero(seen_left)
    while front.size:  # along edges to the right, back along the matching
        near = np.unique(edges[front].indices)
        near = near[~seen_right[near]]
        seen_right[near] = True
        front = mate[near]
        seen_left[front] = True
    separator = np.zeros(half.size, dtype=bool)
    separator[left[~seen_left]] = True
    separator[right[seen_right]] = True
    return separator


def _coupled(A: csr_matrix, ends: Index) -> list[Substructure]:
    """The substructures of a matrix in the order of elimination, with their boundaries."""
    owner = np.repeat(np.arange(ends.size - 1), np.diff(ends))
    handed: list[list[Index]] = [[] for _ in ends[1:]]
    found = []
    for k, (first, end) in enumerate(pairwise(ends)):
        near = np.unique(np.concatenate([A[first:end].indices, *handed[k]]))
        boundary = near[near >= end].astype(np.int64)
        parent = int(owner[boundary[0]]) if boundary.size else -1
        if boundary.size:
            handed[parent].append(boundary)
        found.append(Substructure(int(first), int(end), boundary, parent))
    return found
