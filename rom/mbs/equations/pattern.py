"""Blocks of bodies and joints as sparse matrices, and the order in which these are eliminated."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix

from rom.mbs.equations.graph import elimination_order
from rom.mbs.equations.packing import Packed
from rom.model import Array, Index


class Pattern:
    """Where the entries of the matrices of a mechanism stand, in `Work` and in sparse matrices.

    Attributes:
        n, m: numbers of velocities and of constraint rows.
        groups: unknowns of each body and each joint, (n + m,) in all, in the order in which they
            are eliminated best.
    """

    def __init__(self, packed: Packed):
        system = packed.system
        graph: Any = system.graph
        bodies, self.packed = system.bodies, packed
        self.n, self.m = packed.v.size, system.rows.kind.size
        width = 6 + bodies.r
        body = np.repeat(np.arange(width.size), np.diff(graph.first))
        tall, wide = width[body], width[graph.other]
        i, j = _within(tall, wide)
        e = np.repeat(np.arange(body.size), tall * wide)
        self.square = bodies.v_at[body][e] + i, bodies.v_at[graph.other][e] + j
        self.block = graph.x[e] + i, graph.y[e] + j
        k, side = np.nonzero(graph.body >= 0)
        moved = graph.body[k, side]
        _, j = _within(np.ones_like(moved), width[moved])
        e = np.repeat(np.arange(k.size), width[moved])
        self.row = k[e], bodies.v_at[moved][e] + j
        self.stored = k[e], graph.at[k, side][e] + j
        self.groups = elimination_order(system, packed.coupled())
        self.families = _families(graph, width.size)

    def matrix(self, stored: Array) -> csc_matrix:
        """(n, n) a square matrix of `Work`."""
        return csc_matrix((stored[self.block], self.square), (self.n, self.n))

    def gradient(self, stored: Array) -> csr_matrix:
        """(m, n) the constraint gradient of `Work`."""
        return csr_matrix((stored[self.stored], self.row), (self.m, self.n))

    def differences(self, f: Callable[[Array], Array], step: Array) -> csc_matrix:
        """(n, n) central differences of forces f of which each body feels its neighbours only."""
        bodies, (rows, columns) = self.packed.system.bodies, self.square
        values = np.zeros(rows.size)
        for family in self.families:
            for i in range(int(6 + bodies.r[family].max())):
                moved = bodies.v_at[family[6 + bodies.r[family] > i]] + i
                e = np.zeros(self.n)
                e[moved] = step[moved]
                change = f(e) - f(-e)
                here = np.flatnonzero(e[columns])
                values[here] = change[rows[here]] / (2 * step[columns[here]])
        return csc_matrix((values, self.square), (self.n, self.n))


def _within(tall: Index, wide: Index) -> tuple[Index, Index]:
    """Row and column in its block of each entry of blocks that follow each other."""
    count = tall * wide
    at = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return at // np.repeat(wide, count), at % np.repeat(wide, count)


def _families(graph: Any, n_bodies: int) -> list[Index]:
    """Sets of bodies of which no two have a neighbour in common, or are neighbours."""
    family = np.full(n_bodies, -1)
    for b in range(n_bodies):
        near = graph.other[graph.first[b] : graph.first[b + 1]]
        taken = {family[c] for a in near for c in graph.other[graph.first[a] : graph.first[a + 1]]}
        family[b] = next(k for k in range(n_bodies) if k not in taken)
    return [np.flatnonzero(family == k) for k in range(family.max() + 1)]
