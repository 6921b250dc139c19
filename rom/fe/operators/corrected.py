"""A factor corrected for what a few more dofs add to the matrix."""

from collections.abc import Callable
from typing import Any

from petsc4py import PETSc

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from rom.model import Array


class Corrected:
    """(A + V E + E^T V^T + E^T D E)^-1, d rows in E, with the factor of A.

    With W = (V / c, E^T) that matrix is A + W C W^T, C = ((0, c), (c, D)), and its inverse
    A^-1 - Y S^-1 Y^T, Y = A^-1 W, S = C^-1 + W^T Y; c makes both halves of S as large.

    Args:
        factor: of A.
        gram: X^T Y summed over the ranks.
        V, E_T: (n_local, d).
        D: (d, d).

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

    def solve(self, F: Array) -> Array:
        """Solutions for (n_local, k) right-hand sides."""
        X = self.factor.solve(F)
        X -= self.Y @ lu_solve(self.S, self.gram(self.Y, F))
        return X

    def apply(self, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """One solution x for b."""
        x.array[:] = self.solve(b.array[:, None])[:, 0]

    def release(self) -> None:
        """Give the memory of the factor back."""
        self.factor.release()
