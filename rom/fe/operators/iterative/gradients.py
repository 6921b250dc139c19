"""Conjugate gradients for many right-hand sides, with an approximate inverse."""

from collections.abc import Callable

from petsc4py import PETSc

import numpy as np

from rom.errors import SolverError
from rom.fe.operators.factor import Factor, dense_rows
from rom.fe.operators.iterative.recurrence import column_dots
from rom.fe.operators.substructures.shared import SubstructuredFactor
from rom.model import Array
from rom.process.stopwatch import SOLUTION_PIECE, piece

RESIDUAL_RTOL = 1e-12  # in the norm of the preconditioner
MAX_ITERATIONS = 400  # well posed elasticity takes 20 to 60, at any size
BLOCK_SIZE = 16  # right-hand sides solved together: more bring no speed, but take memory


class ConjugateGradients:
    """A^-1 of a positive definite matrix, for many right-hand sides, by an approximate inverse.

    Args:
        A: the matrix.
        approximate: (n_local, k) -> (n_local, k), symmetric and positive definite.
        release: gives the memory of the approximate inverse back.

    Attributes:
        ok: True; an approximate inverse always exists.
    """

    ok = True

    def __init__(
        self, A: PETSc.Mat, approximate: Callable[[Array], Array], release: Callable[[], None]
    ):
        self.A, self.approximate, self.release = A, approximate, release
        self.comm = A.comm.tompi4py()

    def solve(self, F: Array, rtol: float = RESIDUAL_RTOL) -> Array:
        """A^-1 F for (n_local, k) right-hand sides, in blocks.

        Args:
            F: the right-hand sides.
            rtol: residual over that of zero, in the norm of the approximate inverse.

        Raises:
            SolverError: if a column does not converge.
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
