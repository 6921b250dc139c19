"""Who solves with matrices that are whole in a process, and who shares parts of a task."""

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from rom.eigen.scipy import SciPyOperators, SymmetricLU
from rom.eigen.verbs import Matrix, Searched, Value, every_row, own_rows
from rom.model import Array, Index

Item = TypeVar("Item")


class Factored(Protocol):
    """A symmetric matrix that has been factored."""

    @property
    def definite(self) -> bool:
        """Whether all its eigenvalues are positive."""

    def solve(self, f: Array) -> Array:
        """A^-1 f, (n,), of f (n,), both on all ranks, in units of f over those of A."""


class Workers:
    """One process, by SciPy; ranks that all have the same matrices do the same together."""

    def operators(
        self, K: Matrix, M: Matrix, rigid: Array | None = None, *, together: bool = False
    ) -> Searched:
        """`rom.eigen.verbs.Operators` of matrices (n, n) of SciPy, by this process alone.

        ``rigid`` (n, r) are motions without stiffness; ``together`` ranks share the rows, and all
        of them must ask.
        """
        return SciPyOperators(K, M, rigid)

    def factor(self, A: Matrix, *, pivoting: bool = False) -> Factored | None:
        """A factor that all ranks make together and all must ask; None if A (n, n) is singular.

        With ``pivoting``, where its diagonal has zeros, ``definite`` is not known.
        """
        try:
            return SymmetricLU(A, pivoting=pivoting)
        except RuntimeError:
            return None

    def each(
        self, function: Callable[[Item], Value], items: Sequence[Item], costs: Sequence[float]
    ) -> list[Value]:
        """Values of a function of items (k,), in their order, on all ranks, which all must call.

        Each is found by one rank, so that the function must not wait for others; what it raises is
        raised on all of them. Costs (k,) are the work that each makes, in units of any kind.
        """
        return [function(item) for item in items]


def held_solution(workers: Workers, matrices: tuple[Matrix, ...], held: Index, f: Array) -> Array:
    """(n,) K^-1 f on all ranks, which all ask, with some dofs at rest.

    Of the matrices (n, n), stiffness and mass, the second tells a motion that nothing holds.
    """
    ops = workers.operators(*matrices, together=True)
    return every_row(ops, ops.hold(held)(own_rows(ops, f[:, None])))[:, 0]


ONE_PROCESS = Workers()
