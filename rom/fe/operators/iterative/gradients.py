"""Krylov spaces of P A from each column of a block by itself, P an approximate inverse of A.

Conjugate gradients solve in them, Lanczos' recurrence finds the ends of the spectrum.
"""

from collections.abc import Callable

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from scipy.linalg import eigh_tridiagonal, eigvalsh_tridiagonal

from rom.errors import SolverError
from rom.fe.operators.factor import Factor, dense_rows
from rom.fe.operators.substructures.shared import SubstructuredFactor
from rom.model import Array
from rom.process.stopwatch import SOLUTION_PIECE, piece

Apply = Callable[[Array], Array]
RESIDUAL_RTOL = 1e-12  # in the norm of the preconditioner
MAX_ITERATIONS = 400  # well posed elasticity takes 20 to 60, at any size
BLOCK_SIZE = 16  # right-hand sides solved together: more bring no speed, but take memory


class ConjugateGradients:
    """A^-1 of a positive definite matrix, for many right-hand sides, by an approximate inverse.

    That is symmetric and positive definite, (n_local, k) -> (n_local, k); ``release`` frees memory.
    """

    ok = True  # an approximate inverse always exists

    def __init__(self, A: PETSc.Mat, approximate: Apply, release: Callable[[], None]):
        self.A, self.approximate, self.release = A, approximate, release
        self.comm = A.comm.tompi4py()

    def solve(self, F: Array, rtol: float = RESIDUAL_RTOL) -> Array:
        """A^-1 F for (n_local, k) right-hand sides, in blocks.

        The residual over that of zero, rtol, is in the norm of the approximate inverse.
        """
        X = np.empty(F.shape, order="F")
        with piece(SOLUTION_PIECE):
            for first in range(0, F.shape[1], BLOCK_SIZE):
                columns = slice(first, first + BLOCK_SIZE)
                X[:, columns] = self._solve(np.array(F[:, columns], order="F"), rtol)
        return X

    def _solve(self, R: Array, rtol: float) -> Array:
        """A^-1 R, which is overwritten; columns leave as they converge."""
        X = np.zeros(R.shape, order="F")
        P = self.approximate(R)
        rz = column_dots(self.comm, R, P)
        goal, left = rtol**2 * rz, np.flatnonzero(rz > 0.0)
        for _ in range(MAX_ITERATIONS):
            if not left.size:
                return X
            AP = dense_rows(self.A, P[:, left])
            step = rz[left] / column_dots(self.comm, P[:, left], AP)
            X[:, left] += step * P[:, left]
            R[:, left] -= step * AP
            Z = self.approximate(R[:, left])
            new = column_dots(self.comm, R[:, left], Z)
            P[:, left] = Z + new / rz[left] * P[:, left]
            rz[left] = new
            left = left[new > goal[left]]
        raise SolverError(
            f"{left.size} of {R.shape[1]} static solutions did not converge in {MAX_ITERATIONS} "
            f"iterations (residual {np.sqrt((rz / goal).max()) * rtol:.1e}).",
            hint='Use solver="direct" if the factor fits, or improve cells of extreme shape.',
        )


Inverse = Factor | SubstructuredFactor | ConjugateGradients


def refined(factor: Factor) -> ConjugateGradients:
    """Conjugate gradients that make good what a compressed factor has dropped."""
    return ConjugateGradients(factor.A, factor.solve, factor.release)


class Recurrence:
    """Tridiagonal matrices of P A in the inner product of P^-1, one for each column.

    ``apply`` is A, ``inverse`` P, positive definite; the columns of P R are the vectors to start
    from. There are ``diagonals`` (k,) of each step so far, ``couplings`` (k,) of each with the
    next, and ``first``, the diagonal of R^T P R.

    Source:
        Golub and Van Loan, Matrix Computations, 4th edition, 2013, section 10.1.
    """

    def __init__(self, comm: MPI.Comm, apply: Apply, inverse: Apply, R: Array):
        self.comm, self.apply, self.inverse = comm, apply, inverse
        self.R, self.before = R, np.zeros_like(R)
        self.Z = inverse(R)
        self.first = column_dots(comm, R, self.Z)
        self.diagonals: list[Array] = []
        self.couplings = [np.sqrt(self.first)]

    def step(self) -> None:
        """One vector more in each column."""
        beta = np.maximum(self.couplings[-1], np.finfo(float).tiny)
        Q, S = self.Z / beta, self.R / beta
        self.R = self.apply(Q)
        self.diagonals.append(column_dots(self.comm, Q, self.R))
        self.R -= self.diagonals[-1] * S
        if len(self.diagonals) > 1:
            self.R -= beta * self.before
        self.before, self.Z = S, self.inverse(self.R)
        self.couplings.append(np.sqrt(np.maximum(column_dots(self.comm, self.R, self.Z), 0.0)))

    def eigenvalues(self) -> tuple[Array, Array]:
        """(k,) least and (k,) largest eigenvalues within the spaces so far."""
        diagonal, beside = np.array(self.diagonals), np.array(self.couplings[1:-1])
        beside = beside.reshape(-1, diagonal.shape[1])
        lam = [eigvalsh_tridiagonal(d, e) for d, e in zip(diagonal.T, beside.T, strict=True)]
        return np.array([x[0] for x in lam]), np.array([x[-1] for x in lam])

    def vector(self, column: int, again: "Recurrence") -> Array:
        """(n_local, 1) vector of the least eigenvalue of a column.

        The same recurrence runs ``again`` from that column alone: vectors on the way were not kept.
        """
        diagonal, beside = (
            np.array([x[column] for x in part]) for part in (self.diagonals, self.couplings[1:-1])
        )
        weights = eigh_tridiagonal(diagonal, beside, select="i", select_range=(0, 0))[1][:, 0]
        V = np.zeros_like(again.Z)
        for weight in weights:
            V += weight / again.couplings[-1] * again.Z
            again.step()
        return V


def column_dots(comm: MPI.Comm, X: Array, Y: Array) -> Array:
    """(k,) products of the columns of X with those of Y, over all ranks."""
    return comm.allreduce(np.einsum("ij,ij->j", X, Y), op=MPI.SUM)
