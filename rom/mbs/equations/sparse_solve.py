"""Sparse linear equations under constraints: A x + G^T l = f with G x = g."""

from typing import Any

import numpy as np
from scipy.sparse import bmat, csc_matrix, csr_matrix, diags, identity
from scipy.sparse.linalg import splu

from rom.errors import SolverError
from rom.model import Array

# what a constraint that repeats others may give way, of what the stiffest one does: the motion
# keeps all digits but those that differences of such constraints have lost before
COMPLIANCE_RTOL = 1e-12
N_REFINEMENTS = 2


class Constrained:
    """The factorised equations.

    Args:
        A: (n, n) in units in which the mass matrix has ones on its diagonal.
        G: (m, n) gradient of the constraints, rows of length one.
        redundant: whether constraints may repeat others; multipliers are then those of a
            mechanism whose joints are equally stiff.

    Raises:
        SolverError: if they are singular.
    """

    def __init__(self, A: csc_matrix, G: csr_matrix, *, redundant: bool):
        A = csc_matrix(A)
        self.n, self.size = G.shape[1], stiffest(A)
        self.A = bordered(A, G, redundant=redundant)
        try:
            self.lu = splu(self.A)
        except RuntimeError as error:
            raise SolverError("the linear equations are singular.") from error

    def solve(self, f: Array, g: Array | None = None) -> tuple[Any, Any]:
        """Motions x (n, k) and multipliers l (m, k) for forces f (n, k) and gaps g (m, k)."""
        m = self.A.shape[0] - self.n
        below = np.zeros((m, *f.shape[1:])) if g is None else self.size * g
        b = np.concatenate([f, below])
        x = self.lu.solve(b)
        for _ in range(N_REFINEMENTS):
            x = x + self.lu.solve(b - self.A @ x)
        return x[: self.n], x[self.n :] * self.size

    def error(self, f: Array, x: Array, l: Array) -> float:
        """Share of a solution that one more refinement changes: its error."""
        found = np.concatenate([x, l / self.size])
        b = np.concatenate([f, np.zeros(l.shape)])
        change = self.lu.solve(b - self.A @ found)
        return float(np.linalg.norm(change)) / max(float(np.linalg.norm(found)), 1e-300)


def stiffest(A: csc_matrix) -> float:
    """The largest entry of a matrix, one if it has none."""
    return float(abs(A).max()) or 1.0


def bordered(A: csc_matrix, G: csr_matrix, *, redundant: bool) -> csc_matrix:
    """(n + m, n + m) [A G^T; G 0], rows of G as large as A; with m negative eigenvalues more.

    Where constraints repeat others, each of these gives way a little instead of leaving a zero.
    """
    m, size = G.shape[0], stiffest(A)
    if not m:
        return csc_matrix(A)
    corner = -COMPLIANCE_RTOL * size * identity(m) if redundant else None
    return bmat([[A, size * G.T], [size * G, corner]], format="csc")


def unit_rows(G: csr_matrix) -> tuple[csr_matrix, Array]:
    """The same rows, each of length one, and their lengths (m,)."""
    length = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
    length[length == 0.0] = 1.0
    return diags(1 / length) @ G, length
