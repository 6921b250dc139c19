"""Ranks that all have the same matrices: each solves alone, and they share parts of a task."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np
from scipy.sparse import csr_matrix

from rom.eigen.scipy import SciPyOperators
from rom.eigen.verbs import Value
from rom.eigen.workers import Item, Workers
from rom.fe.operators.aij import aij
from rom.fe.operators.factor import Factor
from rom.fe.operators.memory import collect
from rom.fe.parallel import collective
from rom.model import Array, Index


@dataclass(frozen=True)
class AllRanks(Workers):
    """The `rom.eigen.workers.Workers` of finite elements: MUMPS, each matrix by one rank."""

    n_ranks: int  # that have the matrices; tasks are shared where these are all there are
    kind: Callable[..., Any]  # `PETScOperators` of a matrix without geometry

    def operators(
        self, K: Any, M: Any, rigid: Array | None = None, *, together: bool = False
    ) -> Any:
        """The verbs by PETSc, on this rank alone or by rows."""
        comm = self.comm if together else MPI.COMM_SELF
        collect(comm)  # what the last ones have left
        checked = SciPyOperators(K, M)
        mine = share(checked.n, comm)
        A, B = (some_rows(part, comm) for part in (checked.K, checked.M))
        some = None if rigid is None else rigid[mine]
        return self.kind(A, B, some, fixed=checked.fixed[mine])

    @property
    def comm(self) -> MPI.Comm:
        """The ranks that have the matrices."""
        return MPI.COMM_SELF if self.n_ranks == 1 else MPI.COMM_WORLD

    def factor(self, A: Any, *, pivoting: bool = False) -> "SharedFactor | None":
        """By MUMPS over the ranks, which pivots where it must."""
        factor = SharedFactor(csr_matrix(A), self.comm)
        return factor if factor.factor.ok else None

    def each(
        self, function: Callable[[Item], Value], items: Sequence[Item], costs: Sequence[float]
    ) -> list[Value]:
        """Values that ranks find side by side, on all of them."""
        comm = MPI.COMM_WORLD
        if self.n_ranks == 1 or self.n_ranks != comm.size:
            return [function(item) for item in items]
        owners = shared_out(costs, comm.size)
        found: dict[int, Value] = {}
        with collective(comm):
            found = {int(k): function(items[k]) for k in np.flatnonzero(owners == comm.rank)}
        return [comm.bcast(found.get(k), root=int(owner)) for k, owner in enumerate(owners)]


class SharedFactor:
    """A symmetric matrix (n, n) that all ranks have, factored by MUMPS over them."""

    def __init__(self, A: csr_matrix, comm: MPI.Comm):
        self.comm, self.mine = comm, share(A.shape[0], comm)
        self.factor = Factor(some_rows(A, comm), definite=False)

    @property
    def definite(self) -> bool:
        """Whether no pivot is negative."""
        return self.factor.negative_pivots() == 0

    def solve(self, f: Array) -> Array:
        """A^-1 f on all ranks."""
        x = self.factor.solve(f[self.mine, None])[:, 0]
        return np.concatenate(self.comm.allgather(x))


def shared_out(costs: Sequence[float], n_ranks: int) -> Index:
    """(k,) the rank of each of some items: dearest first, to the rank that has least to do.

    Source:
        Graham, Bounds on multiprocessing timing anomalies, SIAM J. Appl. Math. 17 (1969) 416: no
        rank then works longer than 4/3 of what is possible.
    """
    owners, work = np.zeros(len(costs), dtype=np.int64), np.zeros(n_ranks)
    for k in np.argsort(-np.asarray(costs, dtype=float), kind="stable"):
        owners[k] = work.argmin()
        work[owners[k]] += costs[k]
    return owners


def share(n: int, comm: MPI.Comm) -> slice:
    """Rows of this rank, of n that ranks share equally."""
    return slice(*(n * (comm.rank + k) // comm.size for k in (0, 1)))


def some_rows(A: csr_matrix, comm: MPI.Comm) -> Any:
    """A PETSc matrix of ranks that all have the whole of it."""
    n, mine = A.shape[0], share(A.shape[0], comm)
    return aij(A[mine], ((mine.stop - mine.start, n),) * 2, comm)
