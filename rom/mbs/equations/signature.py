"""How many eigenvalues of a symmetric sparse matrix are negative, zero, positive.

Groups of unknowns are eliminated one after the other (Sylvester's law of inertia). In each group
the matrix is turned to principal axes; directions whose pivot is weak beside what couples them to
later groups wait for the next one, so that neither massless multipliers nor bodies without
stiffness spoil the count.

Source:
    Duff, Reid, The multifrontal solution of indefinite sparse symmetric linear equations, ACM
    Trans. Math. Softw. 9 (1983) 302: fronts and delayed pivots; the principal axes are ours.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_matrix, tril

from rom.model import Array, Index

# of entries of A by what an elimination leaves behind: stiffness, which is definite, never waits
MAX_GROWTH = 10.0
# pivot that counts as zero where nothing is left to wait for, of the largest entry beside it
ZERO_RTOL = 1e-15


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
