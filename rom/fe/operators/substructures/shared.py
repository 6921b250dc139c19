"""A factor that ranks share as substructures: each has its inside, all have the border between.

MUMPS over two ranks gains little in the factorisation and nothing in solving few columns, for which
it waits at every front of its tree. Insides need no other rank; what is left to agree on is one sum
over the border for each solution.

Source: Przemieniecki, Matrix structural analysis of substructures, AIAA J. 1 (1963) 138.
"""

from dataclasses import dataclass
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.sparse import coo_matrix, csr_matrix

from rom.fe.costs import border_seconds
from rom.fe.operators.factor import MEMORY_ERRORS, in_blocks
from rom.fe.operators.memory import allowed_bytes, give_back
from rom.fe.operators.solver import Solver
from rom.fe.operators.substructures.mumps import (
    Border,
    Inside,
    elimination_order,
    end_together,
    library,
)
from rom.model import Array, Index
from rom.process.stopwatch import FACTORISATION_PIECE, FLOPS_NOTE, note, piece

MAX_BORDER_RATIO = 1.0  # flops of a rank for the border over those for the largest inside
# pairs of nodes on a border over entries of the matrix, beyond which, as in a block, MUMPS finds
# better cuts than the division of the mesh and takes two thirds of the memory
MAX_CLIQUE_RATIO = 10.0
MOST_IN_MESSAGE = 2**31 - 1  # numbers that MPI sends at once
N_BORDER_MATRICES = 4  # (m, m) on a rank at once: of MUMPS, its own, the sum, and that on its way


class SubstructuredFactor:
    """K^-1 of a positive definite matrix whose rows lie on several ranks.

    With i for the insides, which no entry joins, and b for the border,

        S = K_bb - sum K_bi K_ii^-1 K_ib,  u_b = S^-1 (f_b - sum K_bi K_ii^-1 f_i),
        u_i = K_ii^-1 (f_i - K_ib u_b).

    ``code`` is that of MUMPS, the worst of all ranks; ``ok`` is False when a part had no positive
    definite factor.
    """

    def __init__(
        self, A: PETSc.Mat, split: "Split", inside: Inside, border: "Border | WholeBorder"
    ):
        self.A, self.split, self.inside, self.border = A, split, inside, border
        comm = A.comm.tompi4py()
        with piece(FACTORISATION_PIECE):
            complement = inside.factor()
            self.code = comm.allreduce(inside.code, op=MPI.MIN)
            self.ok = self.code >= 0 and border.factor(complement)
            self.code = min(self.code, border.code)
        note(FLOPS_NOTE, inside.flops)

    def solve(self, F: Array) -> Array:
        """A^-1 F for (n_local, k) right-hand sides, in blocks."""
        return in_blocks(self._solve, F)

    def _solve(self, F: Array, X: Array) -> None:
        """Fill (n_local, k) solutions X."""
        split = self.split
        loads = np.zeros((split.K_border.shape[0], F.shape[1]))
        half, loads[split.touched] = self.inside.reduced(F[split.inside])
        loads[split.place] += F[split.mine]
        U = self.border.solve(loads)
        X[split.inside] = self.inside.expanded(half, U[split.touched])
        X[split.mine] = U[split.place]

    def apply(self, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """One solution x for b."""
        x.array[:] = self.solve(b.array_r[:, None])[:, 0]

    def release(self) -> None:
        """Give the memory back now."""
        self.inside.release()
        self.border.release()
        give_back()


class WholeBorder:
    """The Schur complement S (m, m), dense and factored by every rank."""

    code = 0  # no error of MUMPS

    def __init__(self, split: "Split", comm: MPI.Comm):
        self.split, self.comm, m = split, comm, split.K_border.shape[0]
        self.flops, self.entries, self.bytes = m**3 / 3, m**2 / 2, 8.0 * N_BORDER_MATRICES * m**2

    def factor(self, complement: Array) -> bool:
        """Factor, with what the inside of this rank adds; whether S is positive definite."""
        split = self.split
        S = split.K_border.toarray()
        S[np.ix_(split.touched, split.touched)] += complement
        self.comm.Allreduce(MPI.IN_PLACE, S)
        try:
            self.S = cho_factor(S, lower=True, overwrite_a=True)
        except (LinAlgError, ValueError):  # the second where numbers are not finite
            return False
        return True

    def solve(self, loads: Array) -> Array:
        """(m, k) S^-1 times the sum of the loads of all ranks, which are spent."""
        self.comm.Allreduce(MPI.IN_PLACE, loads)
        return np.asarray(cho_solve(self.S, loads, check_finite=False))

    def release(self) -> None:
        """Give the memory back."""
        self.S = None


@dataclass(frozen=True, slots=True)
class Split:
    """Rows of a distributed matrix: insides that no entry joins, one on each rank, and a border."""

    inside: Index  # (n_inside,) rows of this rank's inside, local numbers
    mine: Index  # (m_local,) the other rows of this rank, local numbers
    # (m_local,) where these stand among the m of the border, which are in order of ranks
    place: Index
    touched: Index  # (t,) places in the border that this inside is joined to
    K_border: csr_matrix  # (m, m) the rows of K_bb that are this rank's, the others zero
    # (n_inside + t,) * 2 matrix [K_ii, K_ib; ., 0], of K_ii the upper triangle
    K_inside: coo_matrix


def substructured(A: PETSc.Mat, solver: Solver) -> SubstructuredFactor | None:
    """The factor of a positive definite matrix; None where that of MUMPS over ranks is better.

    It is where the factor is to be compressed or on disk, where a rank's share of the border is
    larger than its inside, where a rank has no inside, and where MUMPS cannot be called directly.
    """
    comm = A.comm.tompi4py()
    if comm.size == 1 or solver.out_of_core or solver.low_rank:
        return None
    module = library(comm)
    if module is None:
        return None
    end_together(comm)
    with piece(FACTORISATION_PIECE):
        split = divided(A)
        inside = None if split is None else _analysed(module, split, A.getBlockSize())
        if split is None or not comm.allreduce(inside is not None, op=MPI.LAND):
            return None
        border = _border(module, split, comm, A.getBlockSize())
        if inside is None or not _pays(inside, border, comm):
            border.release()
            return None
    factor = SubstructuredFactor(A, split, inside, border)
    if factor.code in MEMORY_ERRORS:
        factor.release()
        return None
    return factor


def _analysed(module: Any, split: Split, block_size: int) -> Inside | None:
    """The inside of this rank with its order of elimination, found for whole nodes."""
    K, m = split.K_inside, split.touched.size
    n_blocks = K.shape[0] // block_size
    if (m // block_size) ** 2 > MAX_CLIQUE_RATIO * K.nnz / block_size**2:
        return None
    pattern = coo_matrix(
        (np.ones(K.nnz), (K.row // block_size, K.col // block_size)), shape=(n_blocks, n_blocks)
    ).tocsr()
    places = elimination_order(module, pattern + pattern.T, m // block_size)
    if places is None:
        return None
    return Inside(module, K, m, _whole(places, block_size))


def _border(module: Any, split: Split, comm: MPI.Comm, block_size: int) -> Border | WholeBorder:
    """The way to factor the border that takes less time, by the law of cost.

    Analysed is a border only if it could be the better one to share: what its largest inside
    touches becomes a dense block in any case.
    """
    whole = WholeBorder(split, comm)
    t = float(comm.allreduce(split.touched.size, op=MPI.MAX))
    alone = border_seconds(whole.flops, whole.entries)
    if split.K_border.shape[0] ** 2 > MOST_IN_MESSAGE:
        alone = np.inf
    if border_seconds(t**3 / 3, t**2 / 2, comm.size) >= alone:
        return whole
    shared = Border(module, split.K_border, split.touched, comm, block_size)
    if shared.code < 0 or border_seconds(shared.flops, shared.entries, comm.size) >= alone:
        shared.release()
        return whole
    return shared


def _pays(inside: Inside, border: Border | WholeBorder, comm: MPI.Comm) -> bool:
    """Whether the border is cheap and all of it fits, by the analysis."""
    share = border.flops / (comm.size if isinstance(border, Border) else 1)
    cheap = share <= MAX_BORDER_RATIO * comm.allreduce(inside.flops, op=MPI.MAX)
    fits = inside.code >= 0 and inside.bytes + border.bytes <= allowed_bytes(comm)
    return bool(comm.allreduce(cheap and fits, op=MPI.LAND))


def divided(A: PETSc.Mat) -> Split | None:
    """The parts of a symmetric matrix; None if a rank has no inside, or one that stands alone."""
    comm, (first, end) = A.comm.tompi4py(), A.getOwnershipRange()
    starts, columns, values = A.getValuesCSR()
    K = csr_matrix((values, columns, starts), shape=(end - first, A.getSize()[1]))
    block_size = A.getBlockSize()
    cover = np.repeat(covering(K, first, comm).reshape(-1, block_size).any(axis=1), block_size)
    mine, inside = np.flatnonzero(cover), np.flatnonzero(~cover)
    border = np.concatenate(comm.allgather(first + mine))
    K_ib, K_ii = K[inside][:, border], K[inside][:, first + inside]
    touched = _whole(np.unique(K_ib.indices // block_size), block_size)
    if not comm.allreduce(bool(inside.size and touched.size), op=MPI.LAND):
        return None
    place = np.searchsorted(border, first + mine)
    rows = csr_matrix((np.ones(mine.size), (place, mine)), shape=(border.size, K.shape[0]))
    K_border = (rows @ K)[:, border]
    return Split(inside, mine, place, touched, K_border, _beside(K_ii, K_ib[:, touched]))


def _whole(nodes: Index, block_size: int) -> Index:
    """The dofs of nodes."""
    return (block_size * nodes[:, None] + np.arange(block_size)).ravel()


def covering(K: csr_matrix, first: int, comm: MPI.Comm) -> Index:
    """(n_local,) whether a row of K (n_local, n), with this first number, belongs to the border.

    Of two rows of different ranks that an entry joins, it is the one joined to more of other ranks:
    a node on the faces between two ranks sees half of its neighbours there, the next ones few.
    """
    n_local = K.shape[0]
    elsewhere = (K.indices < first) | (K.indices >= first + n_local)
    row = np.repeat(np.arange(n_local), np.diff(K.indptr))[elsewhere]
    column = K.indices[elsewhere]
    degree = np.bincount(row, minlength=n_local)
    ends = np.flatnonzero(degree)
    degrees = np.zeros(K.shape[1], dtype=np.int64)
    degrees[np.concatenate(comm.allgather(first + ends))] = np.concatenate(
        comm.allgather(degree[ends])
    )
    there = degrees[column]
    wins = (degree[row] > there) | ((degree[row] == there) & (column < first))
    cover = np.zeros(n_local, dtype=bool)
    cover[row[wins]] = True
    return cover


def _beside(K_ii: csr_matrix, K_ib: csr_matrix) -> coo_matrix:
    """The upper triangle of [K_ii, K_ib; ., 0]."""
    A, B = K_ii.tocoo(), K_ib.tocoo()
    upper, n, m = A.row <= A.col, A.shape[0], B.shape[1]
    row, column = np.concatenate([A.row[upper], B.row]), np.concatenate([A.col[upper], n + B.col])
    return coo_matrix(
        (np.concatenate([A.data[upper], B.data]), (row, column)), shape=(n + m, n + m)
    )
