"""Sparse matrices of PETSc: from rows of SciPy, sums, and symmetry."""

from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from scipy.sparse import csr_matrix

from rom.errors import ResourceError
from rom.fe.operators.memory import THIN_FACTOR_RATIO, allowed_bytes, factor_bytes
from rom.model import Index, Numbers

N_COPIES = 20  # matrices as large as the one gathered that one rank then makes of it


def symmetric(A: PETSc.Mat) -> csr_matrix:
    """(A + A^T) / 2 without its zeros as a SciPy matrix, on one process; A is spent.

    Two matrices like A stand side by side, not the four that a sum of SciPy would take.
    """
    starts, columns, values = A.getValuesCSR()
    size = A.getSize()
    A.destroy()
    values *= 0.5
    half = csr_matrix((values, columns, starts), shape=size)
    turned = half.T.tocsr()
    if not np.array_equal(half.indices, turned.indices):
        return (half + turned).tocsr()
    half.data += turned.data
    del turned
    half.eliminate_zeros()
    return half


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


def wrapped(A: csr_matrix) -> PETSc.Mat:
    """The same numbers in the same memory, on one process; three dofs to a node."""
    csr = (A.indptr, A.indices, A.data)
    return PETSc.Mat().createAIJWithArrays(A.shape, csr, bsize=3, comm=MPI.COMM_SELF)


def aij(A: csr_matrix, sizes: Any, comm: MPI.Comm, block_size: int = 1) -> PETSc.Mat:
    """A distributed matrix of the rows A (n_local, columns) of each rank.

    The sizes are ((local, all) rows, (local, all) columns); a block has the dofs of a node.
    """
    index = PETSc.IntType
    csr = (A.indptr.astype(index), A.indices.astype(index), A.data)
    matrix = PETSc.Mat().createAIJ(size=sizes, bsize=block_size, csr=csr, comm=comm)
    matrix.assemble()
    return matrix


def without_zeros(A: PETSc.Mat) -> PETSc.Mat:
    """The same matrix, in which entries that are zero do not stand; A is spent.

    In a mass two thirds are, those that couple two directions.
    """
    starts, columns, values = A.getValuesCSR()
    rows = csr_matrix((values, columns, starts), shape=(starts.size - 1, A.getSize()[1]))
    rows.eliminate_zeros()
    B = aij(rows, A.getSizes(), A.comm.tompi4py(), A.getBlockSize())
    A.destroy()
    return B


def chosen(dofs: Index, n: int, comm: MPI.Comm) -> PETSc.IS:
    """Rows of this rank, by number, that a submatrix takes from one of n rows."""
    rows = PETSc.IS().createGeneral(dofs.astype(PETSc.IntType), comm=comm)
    whole = dofs.size % 3 == 0 and bool((dofs[::3] % 3 == 0).all())
    whole = whole and all(bool((dofs[a::3] == dofs[::3] + a).all()) for a in (1, 2))
    if n % 3 == 0 and comm.allreduce(whole, op=MPI.LAND):
        rows.setBlockSize(3)  # multigrid then aggregates nodes
    return rows


def gathered(A: PETSc.Mat) -> csr_matrix:
    """All rows of a distributed square matrix, on every rank; symmetric to the last digit.

    Refused where each rank having the whole and a factor of two such matrices would not fit.
    """
    comm, (n, _) = A.comm.tompi4py(), A.getSize()
    starts, columns, values = A.getValuesCSR()
    counts = np.array(comm.allgather(values.size))
    need = THIN_FACTOR_RATIO * factor_bytes(2 * n) + 12.0 * N_COPIES * counts.sum()
    there = allowed_bytes(comm)
    if need > there:
        raise ResourceError(
            f"each of {comm.size} ranks needs all {n} dofs for itself, predicted to take "
            f"{need / 2**30:.2f} GiB; {there / 2**30:.2f} GiB may be used by each.",
            hint="Use fewer ranks, which share the memory, or a coarser mesh.",
        )
    lengths = np.concatenate(comm.allgather(np.diff(starts).astype(np.int64)))
    halves = _from_all(comm, 0.5 * values, counts)
    columns = _from_all(comm, columns.astype(np.int64), counts)
    whole = csr_matrix((halves, columns, np.r_[0, np.cumsum(lengths)]), shape=(n, n))
    return (whole + whole.T).tocsr()


def _from_all(comm: MPI.Comm, mine: Numbers, counts: Index) -> Numbers:
    """The arrays of all ranks in their order, one after the other, of any size."""
    every = np.empty(counts.sum(), dtype=mine.dtype)
    comm.Allgatherv(np.ascontiguousarray(mine), (every, counts))
    return every
