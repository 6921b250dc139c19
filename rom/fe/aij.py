"""Sparse matrices of PETSc: from rows of SciPy, sums, and symmetry."""

from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

from scipy.sparse import csr_matrix


def symmetrized(A: PETSc.Mat) -> PETSc.Mat:
    """(A + A^T) / 2: sums over thousands of rows differ in their last digits.

    The pattern of T^T K T is symmetric; saying so saves most of the time of the sum.
    """
    B = PETSc.Mat()
    A.transpose(B)
    A.axpy(1.0, B, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
    A.scale(0.5)
    B.destroy()
    return A


def weighted(A: PETSc.Mat, weight: float, parts: list[tuple[float, PETSc.Mat]]) -> PETSc.Mat:
    """Weight A + sum of the weighted parts; entries that are zero may be missing from A."""
    B = A.copy()
    B.scale(weight)
    for c, part in parts:
        B.axpy(c, part, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    return B


def aij(A: csr_matrix, sizes: Any, comm: MPI.Comm) -> PETSc.Mat:
    """The rows of this rank of a distributed matrix.

    Args:
        A: (n_local, columns) these rows.
        sizes: ((local, all) rows, (local, all) columns).
        comm: the ranks.
    """
    index = PETSc.IntType
    csr = (A.indptr.astype(index), A.indices.astype(index), A.data)
    matrix = PETSc.Mat().createAIJ(size=sizes, csr=csr, comm=comm)
    matrix.assemble()
    return matrix
