"""The operator verbs on SciPy matrices, for people who bring matrices of their own."""

from copy import copy
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigvalsh
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import splu

from rom.arguments import matrix, symmetric
from rom.eigen.held import RIGID_RTOL, HeldBody, moves_most
from rom.eigen.search import (
    ESTIMATE_SHIFT,
    NO_INERTIA,
    ModeSearch,
    estimated_by_iteration,
    indefinite,
    shift_is_eigenvalue,
)
from rom.eigen.verbs import Matrix, Value, canonical_signs
from rom.errors import ConfigError, QualityGateError, SolverError
from rom.model import Array, Index
from rom.process.stopwatch import FACTORISATION_PIECE, piece

ENTRY_HINT = "Look where it was assembled: a number was missing, or divided by zero."
NO_FACTOR = SimpleNamespace(ok=False, release=lambda: None)  # of a singular stiffness
ON_DIAGONAL = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0}
SYMMETRIC_LU = {**ON_DIAGONAL, "options": {"SymmetricMode": True}}


class SymmetricLU:
    """L D L^T of a symmetric matrix by SuperLU, with pivots on its diagonal where that is possible.

    With ``pivoting`` elsewhere, where the diagonal has zeros; RuntimeError if A is singular.
    """

    def __init__(self, A: Matrix, *, pivoting: bool = False):
        self.A, kind = csc_matrix(A), {} if pivoting else SYMMETRIC_LU
        with piece(FACTORISATION_PIECE):
            self.lu = splu(self.A, **kind)
        self.pivots = self.lu.U.diagonal()
        self.ok = True

    @property
    def on_diagonal(self) -> bool:
        """Whether all pivots are of the diagonal, so that their signs are those of eigenvalues."""
        return np.array_equal(self.lu.perm_r, self.lu.perm_c)

    @property
    def definite(self) -> bool:
        """Whether no pivot is negative."""
        return bool((self.pivots > 0).all())

    def negative_pivots(self) -> int:
        """Number of negative eigenvalues (Sylvester)."""
        if not self.on_diagonal:
            return int(np.count_nonzero(eigvalsh(self.A.toarray()) < 0))
        return int(np.count_nonzero(self.pivots < 0))

    def solve(self, F: Array) -> Array:
        """A^-1 F of (n,) or (n, k)."""
        return np.asarray(self.lu.solve(np.ascontiguousarray(F)))

    def release(self) -> None:
        """Give the memory back."""
        del self.lu


class HeldSciPy(HeldBody):
    """K with the held dofs eliminated, factored once; call it to solve."""

    def __init__(self, ops: "SciPyOperators", held: Index, shift: float = 0.0):
        super().__init__(ops, held, shift)
        if self.inner is not None:
            self.make()
            if not shift:
                self._refuse_negative(RIGID_RTOL)
                self.refuse_free_motion()
                self._refuse_negative(0.0)  # whatever their size, as no motion is free

    def make(self) -> None:
        """Factor the stiffness, or K - shift M."""
        if self.shift:
            self.factor = self.inner.indefinite(self.shift)
            return
        try:
            self.factor = SymmetricLU(self.inner.K)
        except RuntimeError:
            self.factor = NO_FACTOR

    def _refuse_negative(self, least: float) -> None:
        """Refuse pivots below zero, where none is as small as round-off of the largest."""
        if not (self.factor.ok and self.factor.on_diagonal):
            return
        pivots = self.factor.pivots
        if pivots.min() < 0.0 and np.abs(pivots).min() >= least * np.abs(pivots).max():
            meaning = "with the boundary held, deformation would give energy"
            raise indefinite("K", self.factor.negative_pivots(), meaning)


class SciPyOperators(ModeSearch):
    """Stiffness and mass of one body, all rows in this process.

    Stiffness K (n, n) [N/m] is symmetric, mass M (n, n) [kg] positive definite; ``rigid`` (n, 6) is
    None when there is no geometry, T (n_parent, n) the map to the coordinates these came from.
    Entries that are not finite, and a diagonal of M that is not positive, are refused.
    """

    first = 0
    last = True
    affordable = True
    held_kind = HeldSciPy

    def __init__(self, K: Matrix, M: Matrix, rigid: Array | None = None, T: Matrix | None = None):
        self.K, self.M = _symmetric("K", K), _symmetric("M", M)
        if self.K.shape != self.M.shape:
            raise ConfigError(f"K is {self.K.shape} and M is {self.M.shape}; they must be equal.")
        self.n = self.n_local = self.K.shape[0]
        self._check_mass()
        self.rigid, self.T, self.fixed = rigid, T, np.sin(1.0 + np.arange(self.n))

    def _check_mass(self) -> None:
        """Dofs may have no mass, as rotations of lumped models, where they have stiffness."""
        diagonal, whole = self.M.diagonal(), abs(self.M).sum(axis=1).A1
        bad = (diagonal <= 0.0) & ((whole > 0.0) | (self.K.diagonal() <= 0.0))
        if bad.any() or not (diagonal > 0.0).any():
            at = int(np.flatnonzero(bad | (diagonal <= 0.0))[0])
            text = f"M has {diagonal[at]:.3g} on the diagonal of dof {at}"
            cure = "without mass it needs stiffness, and no coupling in M"
            raise QualityGateError(f"{text}; {cure}.")

    def comparison_pays(self, n_supports: int, n_interface: int, n_modes: int) -> bool:
        """Always: matrices whose origin is unknown are compared in every support."""
        return True

    def gram(self, X: Array, Y: Array) -> Array:
        """X^T Y."""
        return X.T @ Y

    def rows(self, X: Array, dofs: npt.ArrayLike) -> Array:
        """X[dofs]."""
        return X[np.asarray(dofs, dtype=np.int64)]

    def transform(self, T: Matrix, rigid: Array) -> "SciPyOperators":
        """The same body in the coordinates a of u = T a."""
        T = csr_matrix(T)
        return SciPyOperators(T.T @ self.K @ T, T.T @ self.M @ T, rigid, T)

    def restrict(self, F: Array) -> Array:
        """T^T F."""
        return F if self.T is None else self.T.T @ F

    def like(self, K: Matrix, M: Matrix, rigid: Array | None) -> "SciPyOperators":
        """Other matrices in the same coordinates."""
        return SciPyOperators(K, M, rigid, self.T)

    def plus(self, A: csr_matrix, dA: Matrix) -> csr_matrix:
        """A + dA."""
        return A + csr_matrix(dA)

    def weighted(self, A: Matrix, weight: float, parts: list[tuple[float, Matrix]]) -> csr_matrix:
        """Weight A + sum of the weighted parts."""
        return weight * A + sum(c * csr_matrix(part) for c, part in parts)

    def product(self, A: Matrix, X: Array) -> Array:
        """A X."""
        return A @ X

    def part(self, rows: Index) -> "SciPyOperators":
        """The body with all dofs held but these."""
        some = copy(self)
        some.K, some.M = (A[rows][:, rows] for A in (self.K, self.M))
        some.n = some.n_local = rows.size
        some.fixed, some.rigid, some.T = self.fixed[rows], None, None
        return some

    def shift_inverse(self, sigma: float) -> SymmetricLU:
        """(K - sigma M)^-1."""
        return SymmetricLU(self.K - sigma * self.M)

    def indefinite(self, shift: float) -> SymmetricLU:
        """(K - shift M)^-1 for a shift among the eigenvalues."""
        try:
            return SymmetricLU(self.K - shift * self.M, pivoting=True)
        except RuntimeError as error:
            raise shift_is_eigenvalue(shift) from error

    def count_below(self, sigma: float, spent: object = None) -> int:
        """Number of eigenvalues below sigma, by the inertia of K - sigma M (Sylvester)."""
        return negative_count(self.K - sigma * self.M)

    def refuse_wrong_mass(self) -> None:
        """Say so where a motion has no inertia."""
        massive = np.flatnonzero(self.mass_diagonal > 0.0)
        if n_negative := negative_count(self.M[massive][:, massive]):
            raise indefinite("M", n_negative, NO_INERTIA)

    def signed(self, Phi: Array) -> Array:
        """Columns with their largest entry positive."""
        return canonical_signs(Phi)

    def where(self, Phi: Array, rows: Index | None = None) -> str:
        """Words for the place that moves most; without geometry, for its dof."""
        place = "" if self.rigid is None else moves_most(self, Phi, rows)
        if place or not Phi.any():
            return place
        at = int(np.abs(Phi).max(axis=1, initial=0.0).argmax())
        return f" Dof {at if rows is None else rows[at]} moves most."

    def from_all(self, mine: Value) -> list[Value]:
        """What each process has: this one alone."""
        return [mine]

    def first_elastic(self, R: Array) -> float:
        """Estimate of the first elastic eigenvalue by inverse iteration on a small block."""
        return estimated_by_iteration(self, self.shift_inverse(-ESTIMATE_SHIFT * self.largest()), R)

    @property
    def stiffness_diagonal(self) -> Array:
        """(n,) diagonal of K."""
        return np.asarray(self.K.diagonal())

    @property
    def mass_diagonal(self) -> Array:
        """(n,) diagonal of M."""
        return np.asarray(self.M.diagonal())


def _symmetric(name: str, A: Matrix) -> csr_matrix:
    A = csr_matrix(matrix(name, A), dtype=float)
    matrix(name, A, (A.shape[0], A.shape[0]))
    wrong = np.flatnonzero(~np.isfinite(A.data))
    if wrong.size:
        bad = int(np.searchsorted(A.indptr, wrong[0], side="right")) - 1
        raise SolverError(f"{name} has an entry that is not finite in row {bad}.", hint=ENTRY_HINT)
    symmetric(name, A, 1e-10)
    return A


def negative_count(A: Matrix) -> int:
    """Number of negative eigenvalues of a symmetric matrix, from its pivots (Sylvester)."""
    return SymmetricLU(A).negative_pivots()
