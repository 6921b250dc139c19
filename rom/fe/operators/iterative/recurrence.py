"""Lanczos' recurrence for P A, two symmetric matrices, from each column of a block by itself."""

from collections.abc import Callable

from mpi4py import MPI

import numpy as np
from scipy.linalg import eigh_tridiagonal, eigvalsh_tridiagonal

from rom.model import Array

Apply = Callable[[Array], Array]


class Recurrence:
    """Tridiagonal matrices of P A in the inner product of P^-1, one for each column.

    Args:
        comm: the ranks.
        apply: A.
        inverse: P, positive definite.
        R: (n_local, k); the columns of P R are the vectors to start from.

    Attributes:
        first: (k,) diagonal of R^T P R.
        diagonals: (k,) of each step so far.
        couplings: (k,) of each step with the next.

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

        Args:
            column: its number.
            again: the same recurrence from that column alone; it runs once more, as the vectors on
                the way were not kept.
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
