"""Blocks of bodies and joints as sparse matrices: solved under constraints, their signs counted.

To count how many eigenvalues are negative, zero, positive, groups of unknowns are eliminated one
after the other (Sylvester's law of inertia). In each group the matrix is turned to principal axes;
directions whose pivot is weak beside what couples them to later groups wait for the next one, so
that neither massless multipliers nor bodies without stiffness spoil the count.

Source:
    Duff, Reid, The multifrontal solution of indefinite sparse symmetric linear equations, ACM
    Trans. Math. Softw. 9 (1983) 302: fronts and delayed pivots; the principal axes are ours.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.sparse import bmat, csc_matrix, csr_matrix, diags, identity, tril
from scipy.sparse.linalg import splu

from rom.errors import SolverError
from rom.mbs.equations.graph import elimination_order
from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.system import Graph
from rom.model import Array, Index

Matrix: TypeAlias = Array | csc_matrix  # whole or sparse

# what a constraint that repeats others may give way, of what the stiffest one does: the motion
# keeps all digits but those that differences of such constraints have lost before
COMPLIANCE_RTOL = 1e-12
N_REFINEMENTS = 2
# of entries of A by what an elimination leaves behind: stiffness, which is definite, never waits
MAX_GROWTH = 10.0
# pivot that counts as zero where nothing is left to wait for, of the largest entry beside it
ZERO_RTOL = 1e-15


class Pattern:
    """Where the entries of the matrices of a mechanism stand, in `Work` and in sparse matrices.

    The groups are the n velocities and m multipliers of each body and each joint, in the order in
    which they are eliminated best.
    """

    def __init__(self, packed: Packed):
        system = packed.system
        graph, bodies, self.packed = packed.graph, system.bodies, packed
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


def _families(graph: Graph, n_bodies: int) -> list[Index]:
    """Sets of bodies of which no two have a neighbour in common, or are neighbours."""
    family = np.full(n_bodies, -1)
    for b in range(n_bodies):
        near = graph.other[graph.first[b] : graph.first[b + 1]]
        taken = {family[c] for a in near for c in graph.other[graph.first[a] : graph.first[a + 1]]}
        family[b] = next(k for k in range(n_bodies) if k not in taken)
    return [np.flatnonzero(family == k) for k in range(family.max() + 1)]


class Constrained:
    """The factorised equations.

    A is (n, n) in units in which the mass matrix has ones on its diagonal, G (m, n) has rows of
    length one. Where constraints may repeat others (``redundant``), multipliers are those of a
    mechanism whose joints are equally stiff.
    """

    def __init__(self, A: csc_matrix, G: csr_matrix, *, redundant: bool):
        A = csc_matrix(A)
        self.n, self.size = G.shape[1], stiffest(A)
        self.A = bordered(A, G, redundant=redundant)
        try:
            self.lu = splu(self.A)
        except RuntimeError as error:
            raise SolverError("the linear equations are singular.") from error

    def solve(self, f: Array, g: Array | None = None) -> tuple[Array, Array]:
        """Motions x (n, k) and multipliers l (m, k) for forces f (n, k) and gaps g (m, k)."""
        m = self.A.shape[0] - self.n
        below = np.zeros((m, *f.shape[1:])) if g is None else self.size * g
        b = np.concatenate([f, below])
        x = self.lu.solve(b)
        for _ in range(N_REFINEMENTS):
            x = x + self.lu.solve(b - self.A @ x)
        return x[: self.n], x[self.n :] * self.size

    def error(self, f: Array, x: Array, l: Array) -> float:
        """Share of a solution that one more refinement changes: its error."""
        found = np.concatenate([x, l / self.size])
        b = np.concatenate([f, np.zeros(l.shape)])
        change = self.lu.solve(b - self.A @ found)
        return float(np.linalg.norm(change)) / max(float(np.linalg.norm(found)), 1e-300)


def stiffest(A: csc_matrix) -> float:
    """The largest entry of a matrix, one if it has none."""
    return float(abs(A).max()) or 1.0


def bordered(A: csc_matrix, G: csr_matrix, *, redundant: bool) -> csc_matrix:
    """(n + m, n + m) [A G^T; G 0], rows of G as large as A; with m negative eigenvalues more.

    Where constraints repeat others, each of these gives way a little instead of leaving a zero.
    """
    m, size = G.shape[0], stiffest(A)
    if not m:
        return csc_matrix(A)
    corner = -COMPLIANCE_RTOL * size * identity(m) if redundant else None
    return bmat([[A, size * G.T], [size * G, corner]], format="csc")


def unit_rows(G: csr_matrix) -> tuple[csr_matrix, Array]:
    """The same rows, each of length one, and their lengths (m,)."""
    length = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
    length[length == 0.0] = 1.0
    return diags(1 / length) @ G, length


class Signature(NamedTuple):
    """Numbers of negative, zero and positive eigenvalues."""

    negative: int
    zero: int
    positive: int


class _Remainder(NamedTuple):
    """What a front leaves: the unknowns (k,) it couples, and matrix of d that wait and these."""

    coupled: Index
    waiting: int
    S: Array


def signature(A: csc_matrix, groups: Sequence[Index], zero_rtol: float = ZERO_RTOL) -> Signature:
    """Count the signs of the eigenvalues of A (n, n), symmetric, entries of both triangles stored.

    Groups of unknowns that go together are in the order of elimination; a last pivot of less than
    ``zero_rtol`` of the largest entry beside it counts as zero.
    """
    order = np.concatenate(groups)
    first = np.concatenate([[0], np.cumsum([group.size for group in groups])])
    A = A[order][:, order]
    size = abs(A).max(axis=0).toarray().ravel()
    size[size == 0.0] = 1.0
    fronts = _Fronts(tril(A, format="csc"))
    of_group = np.repeat(np.arange(len(groups)), np.diff(first))
    left: list[list[_Remainder]] = [[] for _ in groups]
    found = np.zeros(3, dtype=np.int64)
    for k, (a, b) in enumerate(pairwise(first)):
        F, p, coupled = fronts.front(a, b, left[k])
        left[k] = []
        d, V = np.linalg.eigh(F[:p, :p])
        C = F[p:, :p] @ V
        zero = zero_rtol * max(size[a:b].max(), np.abs(F).max(initial=0.0))
        faint = np.abs(d) <= zero
        none = faint & (np.abs(C).max(axis=0, initial=0.0) <= zero)  # nothing later will hold it
        growth = (C * C / size[coupled, None]).max(axis=0, initial=0.0)
        goes = ~faint & (np.abs(d) * MAX_GROWTH >= growth)
        gone, negative = goes.sum(), (d[goes] < 0).sum()
        found += [negative, none.sum(), gone - negative]
        if coupled.size:
            C, d, goes = C[:, ~none], d[~none], goes[~none]
            remainder = _eliminated(F[p:, p:], C, d, goes)
            left[of_group[coupled[0]]].append(_Remainder(coupled, d.size - gone, remainder))
    return Signature(*map(int, found))


class _Fronts:
    """Fronts of a matrix (n, n) whose lower triangle is given, unknowns in order."""

    def __init__(self, lower: csc_matrix):
        self.start, self.rows, self.values = lower.indptr, lower.indices, lower.data
        self.columns = np.repeat(np.arange(lower.shape[0]), np.diff(lower.indptr))
        self.here = np.empty(lower.shape[0], dtype=np.int64)

    def front(self, a: int, b: int, left: list[_Remainder]) -> tuple[Array, int, Index]:
        """Lower triangle for what waited, unknowns a to b, and what is coupled.

        It comes with the number p of the former, and unknowns (n - p,).
        """
        mine = slice(self.start[a], self.start[b])
        rows, here = self.rows[mine], self.here
        coupled = np.unique(np.concatenate([rows, *(x.coupled for x in left)]))
        coupled = coupled[np.searchsorted(coupled, b) :]
        waiting = sum(x.waiting for x in left)
        p = waiting + b - a
        here[a:b] = np.arange(waiting, p)
        here[coupled] = np.arange(p, p + coupled.size)
        F = np.zeros((p + coupled.size,) * 2)
        F[here[rows], self.columns[mine] + (waiting - a)] = self.values[mine]
        at = 0
        for one in left:
            now = np.concatenate([np.arange(at, at + one.waiting), here[one.coupled]])
            F[now[:, None], now] += one.S
            at += one.waiting
        return F, p, coupled


def _eliminated(S: Array, C: Array, d: Array, goes: Array) -> Array:
    """Lower triangle for the directions that wait, in principal axes, and for what is coupled."""
    through = C[:, goes]
    S = S - (through / d[goes]) @ through.T
    m = int(d.size - through.shape[1])
    if not m:
        return S
    remainder = np.zeros((m + len(S),) * 2)
    remainder[:m, :m], remainder[m:, :m], remainder[m:, m:] = np.diag(d[~goes]), C[:, ~goes], S
    return remainder
