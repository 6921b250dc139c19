"""The operators of a body in new coordinates, formed only as far as they are needed."""

from functools import cached_property

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from scipy.sparse import csr_matrix

from rom.fe.operators.aij import aij, symmetrized
from rom.fe.operators.memory import give_back
from rom.fe.operators.petsc import PETScOperators
from rom.model import Array, Index


class TiedOperators(PETScOperators):
    """A body in the coordinates a of u = T a.

    T^T K T is formed when it is needed. A reduction whose interface coordinates are all held needs
    the rows of dofs that T leaves alone, and those stand in K already.

    Args:
        parent: operators in the coordinates u.
        T: (n_local of u, n of a) rows of the map.
        rigid: (n_local, 6) rigid motions in the coordinates a.
    """

    parent: PETScOperators

    def __init__(self, parent: PETScOperators, T: csr_matrix, rigid: Array):
        self.parent, self.rigid, self.comm, self.solver = parent, rigid, parent.comm, parent.solver
        self.affordable = parent.affordable
        sizes = ((parent.n_local, parent.n), (rigid.shape[0], T.shape[1]))
        self.T = aij(T, sizes, self.comm)
        self.n = T.shape[1]
        self.first, end = self.T.getOwnershipRangeColumn()
        self.n_local, self.last = end - self.first, parent.last
        x, y = self.T.createVecs()
        y.array[:] = parent.fixed
        self.T.multTranspose(y, x)
        self.fixed = x.array.copy()
        self.plain = self._plain(T)

    def _plain(self, T: csr_matrix) -> Index:
        """(n_local,) row of the parent that is this coordinate and no other's; -1 if there is none.

        Kept dofs stay on their rank, so that their rows are here.
        """
        alone = np.flatnonzero(np.diff(T.indptr) == 1)
        alone = alone[T.data[T.indptr[alone]] == 1.0]
        others = np.setdiff1d(np.arange(T.shape[0]), alone)
        shared = np.concatenate(self.comm.allgather(np.unique(T[others].indices)))
        column = T.indices[T.indptr[alone]]
        here = (column >= self.first) & (column < self.first + self.n_local)
        plain = np.full(self.n_local, -1)
        plain[column[here] - self.first] = alone[here]
        shared = shared[(shared >= self.first) & (shared < self.first + self.n_local)]
        plain[shared.astype(np.int64) - self.first] = -1
        return plain

    def part(self, rows: Index) -> PETScOperators:
        """The body with all coordinates held but these."""
        same = self.plain[rows]
        if self.comm.allreduce(bool((same >= 0).all()), op=MPI.LAND):
            return self.parent.part(same)
        return super().part(rows)

    def apply_K(self, X: Array) -> Array:
        """T^T K T X."""
        return self.restrict(self.parent.apply_K(self.expand(X)))

    def apply_M(self, X: Array) -> Array:
        """T^T M T X."""
        return self.restrict(self.parent.apply_M(self.expand(X)))

    @cached_property
    def K(self) -> PETSc.Mat:
        """T^T K T."""
        return self._projected(self.parent.K)

    @cached_property
    def M(self) -> PETSc.Mat:
        """T^T M T."""
        return self._projected(self.parent.M)

    def _projected(self, A: PETSc.Mat) -> PETSc.Mat:
        projected = symmetrized(A.ptap(self.T))
        give_back()
        return projected
