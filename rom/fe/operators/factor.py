"""One MUMPS factorisation, for many right-hand sides, also with a few dofs more, and for counting.

The inertia of K - sigma M counts eigenvalues, so that no mode is missed.
"""

from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

from petsc4py import PETSc

import numpy as np
from scipy.linalg import lu_factor, lu_solve, pinvh

from rom.errors import SolverError
from rom.fe.compat import same_layout
from rom.fe.operators.disk import DISK_ERRORS, disk_too_small, reserve_disk, watched
from rom.fe.operators.foreseen import analysed, by_mumps, entry_count, stored_entries, too_large
from rom.fe.operators.memory import allowed_bytes, factor_bytes, give_back
from rom.fe.operators.solver import DIRECT_SOLVER, Solver
from rom.model import Array
from rom.process.stopwatch import FACTORISATION_PIECE, FLOPS_NOTE, SOLUTION_PIECE, note, piece

DEPENDENT_RTOL = 1e-13  # energy of a shape, of the largest, that is round-off
BLOCK_SIZE = 32  # right-hand sides solved together: five to eight times cheaper than one by one
PIVOT_THRESHOLD = 0.01  # the default of MUMPS
WORKSPACE_RATIO = 3.0  # first offer over the prediction: a thin body takes less, pivoting more
LEAST_WORKSPACE = 100e6  # of the first offer [bytes]
MEMORY_ERRORS = (-8, -9, -11, -13, -19)  # INFOG(1) of MUMPS: work space or allocation too small


class Factor:
    """L D L^T of a symmetric PETSc matrix by MUMPS, without pivoting where it is ``definite``.

    ``counted`` are its flops and entries, as MUMPS has counted them; ``ok`` is False when MUMPS met
    a pivot it could not divide by. ResourceError if it runs out of memory or disk.
    """

    def __init__(self, A: PETSc.Mat, *, definite: bool, solver: Solver = DIRECT_SOLVER):
        self.A, self.solver = A, solver
        if solver.out_of_core:
            reserve_disk(analysed(A, solver).on_disk, A.getSize()[0], A.comm.tompi4py())
        self.allowed = allowed_bytes(A.comm.tompi4py())
        predicted = WORKSPACE_RATIO * factor_bytes(A.getSize()[0]) / A.comm.size
        self._offer(min(predicted + LEAST_WORKSPACE, self.allowed))
        self.compute(definite=definite)

    def _offer(self, workspace: float) -> None:
        """Start anew with that much work space on each rank [bytes].

        MUMPS reserves the whole of it, whatever it needs: a process with several factors that may
        each take all memory could no longer fork.
        """
        self.workspace = workspace
        self.ksp = PETSc.KSP().create(self.A.comm)
        self.ksp.setOperators(self.A)
        self.ksp.setType(PETSc.KSP.Type.PREONLY)
        self.factor = by_mumps(self.ksp.getPC(), self.A, self.solver)
        self.factor.setMumpsIcntl(24, 1)  # needed by PETSc for the inertia
        self.factor.setMumpsIcntl(13, 1)  # a root shared by ranks would not report its pivots
        if self.solver.out_of_core:
            self.factor.setMumpsIcntl(22, 1)
        self.factor.setMumpsIcntl(23, max(int(workspace / 1e6), 1))  # obeyed after the analysis

    def compute(self, *, definite: bool) -> None:
        """Factor A; again when its values have changed, without a new analysis."""
        self.factor.setMumpsCntl(1, 0.0 if definite else PIVOT_THRESHOLD)
        watch = watched() if self.solver.out_of_core else nullcontext()
        with watch, piece(FACTORISATION_PIECE):
            self.ksp.setUp()
            self.ksp.getPC().setUp()  # the first does not look at the matrix a second time
        code = self.factor.getMumpsInfog(1)
        if code in MEMORY_ERRORS and self.workspace < self.allowed:
            self.release()
            self._offer(self.allowed)
            self.compute(definite=definite)
        elif code in MEMORY_ERRORS:
            need = 1e6 * self.factor.getMumpsInfog(17)  # on all ranks, from the analysis
            raise too_large(self.A.getSize()[0], need, self.allowed * self.A.comm.size)
        elif code in DISK_ERRORS:
            raise disk_too_small(self.A.getSize()[0], 8.0 * entry_count(self.factor))
        else:
            self.ok = code >= 0
            self.counted = self.factor.getMumpsRinfog(3), entry_count(self.factor)
            note(FLOPS_NOTE, self.counted[0])

    def solve(self, F: Array) -> Array:
        """A^-1 F for (n_local, k) right-hand sides, in blocks."""
        return in_blocks(self._solve, F)

    def _solve(self, F: Array, X: Array) -> None:
        """Fill (n_local, k) solutions X."""
        B, Y = dense(F, self.A), dense(np.zeros_like(F), self.A)
        self.factor.matSolve(B, Y)
        X[:] = Y.getDenseArray()
        B.destroy(), Y.destroy()

    def apply(self, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """One solution x for b."""
        with piece(SOLUTION_PIECE):
            self.factor.solve(b, x)

    def release(self) -> None:
        """Give the memory back now; PETSc would wait until all ranks collect their garbage."""
        self.ksp.destroy()
        self.factor.destroy()
        give_back()

    def negative_pivots(self) -> int:
        """Number of negative eigenvalues of A."""
        if not self.ok:
            raise SolverError("the matrix K - sigma M could not be factored to count modes.")
        return int(self.factor.getInertia()[0])


class Corrected:
    """(A + V E + E^T V^T + E^T D E)^-1, d rows in E, with the factor of A.

    With W = (V / c, E^T) that matrix is A + W C W^T, C = ((0, c), (c, D)), and its inverse
    A^-1 - Y S^-1 Y^T, Y = A^-1 W, S = C^-1 + W^T Y; c makes both halves of S as large. V and E_T
    are (n_local, d), ``gram`` is X^T Y summed over the ranks. Rows of E that sum over a surface
    make much of a small error, which lies along Z = A^-1 E^T and is taken off there. Some may
    depend on others, as those of few nodes that turn.

    Source:
        Woodbury, Inverting modified matrices, Princeton University, Statistical Research Group,
        Memorandum 42 (1950).
    """

    ok = True

    def __init__(
        self, factor: Any, gram: Callable[[Array, Array], Array], V: Array, E_T: Array, D: Array
    ):
        self.factor, self.gram, self.A = factor, gram, factor.A
        self.counted = getattr(factor, "counted", None)
        c, eye = np.abs(np.diag(D)).mean(), np.eye(len(D))
        W = np.asfortranarray(np.hstack([V / c, E_T]))
        self.Y = factor.solve(W)
        S = np.block([[-D / c**2, eye / c], [eye / c, 0.0 * eye]]) + gram(W, self.Y)
        self.S = lu_factor(0.5 * (S + S.T))
        self.Z = Z = self.Y[:, len(D) :]
        EZ = gram(E_T, Z)
        self.KZ = dense_rows(self.A, Z) + V @ EZ + E_T @ (gram(V, Z) + D @ EZ)
        self.inside = pinvh(gram(Z, self.KZ), rtol=DEPENDENT_RTOL)  # of Z^T K Z

    def solve(self, F: Array) -> Array:
        """Solutions for (n_local, k) right-hand sides."""
        X = self.factor.solve(F)
        X -= self.Y @ lu_solve(self.S, self.gram(self.Y, F))
        X += self.Z @ (self.inside @ (self.gram(self.Z, F) - self.gram(self.KZ, X)))
        return X

    def apply(self, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """One solution x for b."""
        x.array[:] = self.solve(b.array[:, None])[:, 0]

    def release(self) -> None:
        """Give the memory of the factor back."""
        self.factor.release()


def count_below(ops: Any, sigma: float, spent: Any = None) -> int | None:
    """Number of eigenvalues below sigma, the inertia of K - sigma M (Sylvester).

    Without a factor there is nothing to count; `iterative.search` looks for missed modes instead. A
    factor of K that nobody needs any more, ``spent``, gives its place.
    """
    if ops.solver.iterative:
        return None
    A = ops.shifted(sigma)
    of_K = isinstance(spent, Factor) and spent.A == ops.K and same_layout(A, ops.K)
    if of_K and stored_entries(A) == stored_entries(ops.K):
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


def in_blocks(solve: Callable[[Array, Array], None], F: Array) -> Array:
    """(n_local, k) solutions that a function fills in, some right-hand sides F at a time."""
    X = np.empty(F.shape, order="F")
    for first in range(0, F.shape[1], BLOCK_SIZE):
        columns = slice(first, first + BLOCK_SIZE)
        with piece(SOLUTION_PIECE):
            solve(F[:, columns], X[:, columns])
    return X


def dense(X: Array, A: PETSc.Mat) -> PETSc.Mat:
    """(n_local, k) rows as a PETSc dense matrix with the row layout of the columns of A."""
    n_local, n = A.getLocalSize()[1], A.getSize()[1]
    sizes = ((n_local, n), (None, X.shape[1]))
    matrix = PETSc.Mat().createDense(sizes, array=np.asfortranarray(X).T.ravel(), comm=A.comm)
    matrix.assemble()
    return matrix


def dense_rows(A: PETSc.Mat, X: Array) -> Array:
    """A X for (n_local, k) rows."""
    if X.shape[1] == 0:
        return np.zeros((A.getLocalSize()[0], 0))
    if not np.diff(A.getOwnershipRangesColumn()).all():  # on which matMult of PETSc 3.25 crashes
        x, y = A.createVecs()
        return _column_by_column(A.mult, x, y, X)
    B = dense(X, A)
    Y = A.matMult(B)
    out = Y.getDenseArray().copy(order="F")
    B.destroy(), Y.destroy()
    return out


def transposed_rows(A: PETSc.Mat, F: Array) -> Array:
    """A^T F for (n_local, k) rows."""
    x, y = A.createVecs()
    return _column_by_column(A.multTranspose, y, x, F)


def _column_by_column(
    multiply: Callable[[PETSc.Vec, PETSc.Vec], None], x: PETSc.Vec, y: PETSc.Vec, X: Array
) -> Array:
    """(n_local, k) products with the columns of X, each given as x and found as y."""
    out = np.empty((y.getLocalSize(), X.shape[1]))
    for k, column in enumerate(X.T):
        x.array[:] = column
        multiply(x, y)
        out[:, k] = y.array
    return out
