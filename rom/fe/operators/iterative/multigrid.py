"""Multigrid of smoothed aggregation, applied to a block of vectors at once.

PETSc makes the levels once; what it then applies to one vector at a time is here applied to all
columns together, so that each matrix is read once for all of them. The cycle is symmetric, and as
its smoother enlarges no error, the eigenvalues of its product with the matrix lie between 0 and 1.
"""

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from rom.fe.operators.factor import dense_rows
from rom.fe.operators.iterative.gradients import ConjugateGradients, Recurrence
from rom.fe.operators.spectrum import vector
from rom.model import Array

SMOOTHING_DEGREE = 3  # of the polynomial, before and after the coarse correction; measured best
N_BOUND_STEPS = 15  # of Lanczos for the largest eigenvalue of D^-1 A
BOUND_SAFETY = 1.1  # on that eigenvalue, which Lanczos finds from below
EMPTY_RTOL = 1e-13  # diagonal entry of a motion that no node makes, over the largest one
MULTIGRID_OPTIONS = {
    "pc_type": "gamg",
    "pc_gamg_agg_nsmooths": 1,
    "pc_gamg_threshold": 0.02,  # drops weak couplings of stretched cells
    "mg_levels_ksp_type": "chebyshev",
    "mg_levels_pc_type": "jacobi",
}


def multigrid(A: PETSc.Mat, near_null: Array) -> ConjugateGradients:
    """Conjugate gradients preconditioned by smoothed aggregation, of a positive definite matrix.

    Coarse levels must represent rigid motions (n_local, 6) on its rows, near_null.

    Source:
        Vanek, Mandel and Brezina, Computing 56 (1996) 179, levels as implemented in PETSc.
    """
    A.setOption(PETSc.Mat.Option.SPD, True)
    columns = [vector(A, values) for values in _orthonormal(A, near_null).T]
    A.setNearNullSpace(PETSc.NullSpace().create(vectors=columns, comm=A.comm))
    pc = PETSc.PC().create(A.comm)
    pc.setOperators(A)
    options, prefix = PETSc.Options(), "rom_multigrid_"
    for key, value in MULTIGRID_OPTIONS.items():
        options[prefix + key] = value
    pc.setOptionsPrefix(prefix)
    pc.setFromOptions()
    pc.setUp()
    cycle = Cycle(pc)
    return ConjugateGradients(A, cycle, cycle.release)


class Level:
    """One level above the coarsest: its matrix A, the way down R and up P, and its smoother."""

    def __init__(self, A: PETSc.Mat, P: PETSc.Mat):
        self.A, self.P = A, P
        self.R = PETSc.Mat()
        P.transpose(self.R)
        d = A.getDiagonal().array
        largest = A.comm.tompi4py().allreduce(d.max(initial=0.0), op=MPI.MAX)
        least = EMPTY_RTOL * largest
        # zero where an aggregate of few nodes has less than six motions
        self.scale = np.where(d > least, 1.0 / np.maximum(d, least), 0.0)[:, None]
        self.rho = BOUND_SAFETY * _largest(A, self.scale)

    def smoothed(self, R: Array, *, residual: bool) -> tuple[Array, Array]:
        """A polynomial of D^-1 A times D^-1 R, near A^-1 R for rough R, and what is left of R.

        R (n_local, k) is overwritten; what is left is not up to date without ``residual``.

        Source:
            Lottes, Optimal polynomial smoothers for multigrid V-cycles, Numer. Linear Algebra
            Appl. 30 (2023) e2518: the polynomials of the fourth kind.
        """
        Z = (4.0 / 3.0 / self.rho) * (self.scale * R)
        X = Z.copy(order="F")
        for k in range(2, SMOOTHING_DEGREE + 1):
            R -= dense_rows(self.A, Z)
            Z *= (2.0 * k - 3.0) / (2.0 * k + 1.0)
            Z += (8.0 * k - 4.0) / (2.0 * k + 1.0) / self.rho * (self.scale * R)
            X += Z
        if residual:
            R -= dense_rows(self.A, Z)
        return X, R


class Cycle:
    """One V-cycle with the matrices of PETSc's preconditioner: call it with (n_local, k) loads."""

    def __init__(self, pc: PETSc.PC):
        self.pc, self.comm = pc, pc.comm.tompi4py()
        self.levels = [
            Level(pc.getMGSmoother(level).getOperators()[0], pc.getMGInterpolation(level))
            for level in range(1, pc.getMGLevels())
        ]
        coarse = pc.getMGCoarseSolve().getOperators()[0]
        self.rows = slice(*coarse.getOwnershipRange())
        starts, columns, values = coarse.getValuesCSR()
        mine = np.zeros((starts.size - 1, coarse.getSize()[1]))
        mine[np.repeat(np.arange(starts.size - 1), np.diff(starts)), columns] = values
        A = np.vstack(self.comm.allgather(mine))
        lam, V = np.linalg.eigh(0.5 * (A + A.T))
        kept = lam > EMPTY_RTOL * lam[-1]  # motions that no node makes are left out
        self.coarse = (V[:, kept] / lam[kept] @ V[:, kept].T)[self.rows]

    def __call__(self, F: Array) -> Array:
        """Near A^-1 F."""
        return self._down(len(self.levels), np.array(F, order="F"))

    def release(self) -> None:
        """Give the memory of the levels back."""
        for level in self.levels:
            level.R.destroy()
        self.pc.destroy()

    def _down(self, height: int, R: Array) -> Array:
        """The cycle from that level on; R is overwritten."""
        if not height:
            return np.asfortranarray(self.coarse @ np.vstack(self.comm.allgather(R)))
        level = self.levels[height - 1]
        X, R = level.smoothed(R, residual=True)
        E = dense_rows(level.P, self._down(height - 1, dense_rows(level.R, R)))
        X += E
        R -= dense_rows(level.A, E)
        X += level.smoothed(R, residual=False)[0]
        return X


def _largest(A: PETSc.Mat, scale: Array) -> float:
    """The largest eigenvalue of D^-1 A, nearly, by Lanczos."""
    comm = A.comm.tompi4py()
    R = np.random.default_rng(comm.rank).standard_normal(scale.shape)
    run = Recurrence(comm, lambda Z: dense_rows(A, Z), lambda F: scale * F, R)
    for _ in range(min(N_BOUND_STEPS, A.getSize()[0] - 1)):
        run.step()
    return float(run.eigenvalues()[1][0])


def _orthonormal(A: PETSc.Mat, X: Array) -> Array:
    gram = A.comm.tompi4py().allreduce(X.T @ X, op=MPI.SUM)
    lam, V = np.linalg.eigh(gram)
    return X @ (V / np.sqrt(lam))
