"""Counting eigenvalues by the inertia of K - sigma M, so that no mode is missed."""

from typing import Any

from petsc4py import PETSc

from rom.fe.compat import same_layout
from rom.fe.operators.factor import Factor


def count_below(ops: Any, sigma: float, spent: Any = None) -> int | None:
    """Number of eigenvalues below sigma, the inertia of K - sigma M (Sylvester).

    Without a factor there is nothing to count; `definite` looks for missed modes instead.

    Args:
        ops: `PETScOperators` of the body.
        sigma: the shift [rad^2/s^2].
        spent: a factor of K that nobody needs any more and that gives its place.
    """
    if ops.solver.iterative:
        return None
    A = ops.shifted(sigma)
    of_K = isinstance(spent, Factor) and spent.A == ops.K and same_layout(A, ops.K)
    if of_K and _n_entries(A) == _n_entries(ops.K):
        return _counted_in_place(ops.K, A, spent)
    if spent is not None:
        spent.release()
    factor = Factor(A, definite=False, solver=ops.solver)
    count = factor.negative_pivots()
    factor.release()
    A.destroy()
    return count


def _counted_in_place(K: PETSc.Mat, A: PETSc.Mat, factor: Factor) -> int:
    """The values of A, whose pattern is that of K, go through the analysis of the factor of K."""
    same, values = PETSc.Mat.Structure.SAME_NONZERO_PATTERN, K.copy()
    A.copy(K, structure=same)
    A.destroy()
    factor.compute(definite=False)
    count = factor.negative_pivots()
    values.copy(K, structure=same)
    values.destroy()
    return count


def _n_entries(A: PETSc.Mat) -> float:
    """Number of entries on all ranks."""
    return float(A.getInfo(PETSc.Mat.InfoType.GLOBAL_SUM)["nz_used"])
