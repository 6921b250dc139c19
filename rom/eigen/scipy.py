"""The operator verbs on SciPy matrices, for people who bring matrices of their own."""

from copy import copy
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigvalsh
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import splu

from rom.arguments import matrix, symmetric
from rom.eigen.held import RIGID_RTOL, HeldBody
from rom.eigen.place import moves_most
from rom.eigen.search import (
    ESTIMATE_SHIFT,
    NO_INERTIA,
    ModeSearch,
    estimated_by_iteration,
    indefinite,
)
from rom.eigen.verbs import Weighted, canonical_signs
from rom.errors import (
    ConfigError,
    QualityGateError,
    SolverError,
)
from rom.model import Array, Index
from rom.names import named
from rom.process.stopwatch import FACTORISATION_PIECE, piece

ENTRY_HINT = "Look where it was assembled: a number was missing, or divided by zero."
NO_FACTOR = SimpleNamespace(ok=False, release=lambda: None)  # of a singular stiffness
SYMMETRIC_LU = {
    "permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}
}  # fmt: skip


class SymmetricLU:
    """L D L^T of a symmetric matrix by SuperLU, with pivots on its diagonal where that is possible.

    Args:
        A: (n, n) symmetric.
        pivoting: where its diagonal has zeros.

    Raises:
        RuntimeError: if the matrix is singular.
    """

    def __init__(self, A: Any, *, pivoting: bool = False):
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
        if self.n_free:
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

    Args:
        K: (n, n) stiffness [N/m], symmetric.
        M: (n, n) mass [kg], symmetric positive definite.
        rigid: (n, 6) rigid motions, or None when there is no geometry.
        T: (n_parent, n) map to the coordinates these came from.

    Raises:
        ConfigError: if the shapes do not fit.
        SolverError: if an entry is not finite.
        QualityGateError: if a matrix is not symmetric, or M has a diagonal that is not positive.
    """

    first = 0
    last = True
    affordable = True

    def __init__(self, K: Any, M: Any, rigid: Array | None = None, T: csr_matrix | None = None):
        self.K, self.M = _symmetric("K", K), _symmetric("M", M)
        if self.K.shape != self.M.shape:
            raise ConfigError(f"K is {self.K.shape} and M is {self.M.shape}; they must be equal.")
        _refuse_massless(self.M)
        self.n = self.n_local = self.K.shape[0]
        self.rigid, self.T, self.fixed = rigid, T, np.sin(1.0 + np.arange(self.n))

    def comparison_pays(self, n_supports: int, n_interface: int, n_modes: int) -> bool:
        """Always: matrices whose origin is unknown are compared in every support."""
        return True

    def apply_K(self, X: Array) -> Array:
        """K X."""
        return self.K @ X

    def apply_M(self, X: Array) -> Array:
        """M X."""
        return self.M @ X

    def gram(self, X: Array, Y: Array) -> Array:
        """X^T Y."""
        return X.T @ Y

    def rows(self, X: Array, dofs: npt.ArrayLike) -> Array:
        """X[dofs]."""
        return X[np.asarray(dofs, dtype=np.int64)]

    def hold(self, dofs: npt.ArrayLike, shift: float = 0.0) -> HeldSciPy:
        """Eliminate the held dofs and factor the rest of K - shift M."""
        return HeldSciPy(self, dof_set(dofs, self.n), shift)

    def transform(self, T: Any, rigid: Array) -> "SciPyOperators":
        """The same body in the coordinates a of u = T a."""
        T = csr_matrix(T)
        return SciPyOperators(T.T @ self.K @ T, T.T @ self.M @ T, rigid, T)

    def expand(self, A: Array) -> Array:
        """T A."""
        return A if self.T is None else self.T @ A

    def restrict(self, F: Array) -> Array:
        """T^T F."""
        return F if self.T is None else self.T.T @ F

    def plus_mass(self, dM: Any) -> "SciPyOperators":
        """The same body with the mass M + dM."""
        return SciPyOperators(self.K, self.M + csr_matrix(dM), self.rigid, self.T)

    def on_springs(self, dK: Any) -> "SciPyOperators":
        """The body held by springs to the ground: stiffness K + dK, no rigid motion of its own."""
        return SciPyOperators(self.K + csr_matrix(dK), self.M, None, self.T)

    def product(self, A: Any, X: Array) -> Array:
        """A X."""
        return A @ X

    def varied(
        self, stiffness: Weighted, mass: Weighted, rigid: Array | None = None
    ) -> "SciPyOperators":
        """The same dofs with k K + sum k_i K_i and m M + sum m_i M_i."""
        K, M = (
            weight * A + sum(c * csr_matrix(part) for c, part in parts)
            for A, (weight, parts) in ((self.K, stiffness), (self.M, mass))
        )
        return SciPyOperators(K, M, self.rigid if rigid is None else rigid, self.T)

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
        """(K - shift M)^-1 for a shift among the eigenvalues.

        Raises:
            SolverError: if the shift is an eigenvalue.
        """
        try:
            return SymmetricLU(self.K - shift * self.M, pivoting=True)
        except RuntimeError as error:
            message = f"K - {shift:.6g} M is singular: the shift is an eigenvalue."
            raise SolverError(message) from error

    def count_below(self, sigma: float, spent: Any = None) -> int:
        """Number of eigenvalues below sigma, by the inertia of K - sigma M (Sylvester)."""
        return negative_count(self.K - sigma * self.M)

    def refuse_wrong_mass(self) -> None:
        """Say so where a motion has no inertia.

        Raises:
            QualityGateError: with the number of such motions.
        """
        if n_negative := negative_count(self.M):
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

    def from_all(self, mine: Any) -> list[Any]:
        """What each process has: this one alone."""
        return [mine]

    def all_finite(self, X: Array) -> bool:
        """True when X is finite."""
        return bool(np.isfinite(X).all())

    def first_elastic(self, R: Array) -> float:
        """Estimate of the first elastic eigenvalue by inverse iteration on a small block."""
        lu = self.shift_inverse(-ESTIMATE_SHIFT * self.largest())
        return estimated_by_iteration(self, lu, R)

    @property
    def stiffness_diagonal(self) -> Array:
        """(n,) diagonal of K."""
        return np.asarray(self.K.diagonal())

    @property
    def mass_diagonal(self) -> Array:
        """(n,) diagonal of M."""
        return np.asarray(self.M.diagonal())

    def largest(self) -> float:
        """Estimate of the largest eigenvalue from the diagonals."""
        return float(np.max(self.K.diagonal() / self.M.diagonal()))


def dof_set(dofs: npt.ArrayLike, n: int) -> Index:
    """Dof numbers as given, checked: distinct, within 0..n-1.

    Raises:
        ConfigError: naming the first wrong number.
    """
    b = np.asarray(dofs, dtype=np.int64).ravel()
    if b.size and (b.min() < 0 or b.max() >= n):
        outside = named(b[(b < 0) | (b >= n)].tolist())
        raise ConfigError(f"boundary dof {outside} must be from 0 to {n - 1}.")
    if np.unique(b).size != b.size:
        twice = named(np.flatnonzero(np.bincount(b) > 1).tolist())
        raise ConfigError(f"boundary dof {twice} must be listed only once.")
    return b


def _symmetric(name: str, A: Any) -> csr_matrix:
    A = csr_matrix(matrix(name, A), dtype=float)
    if A.shape[0] != A.shape[1]:
        raise ConfigError(f"{name} has the shape {A.shape}; it must be square.")
    wrong = np.flatnonzero(~np.isfinite(A.data))
    if wrong.size:
        bad = int(np.searchsorted(A.indptr, wrong[0], side="right")) - 1
        raise SolverError(f"{name} has an entry that is not finite in row {bad}.", hint=ENTRY_HINT)
    symmetric(name, A, 1e-10)
    return A


def _refuse_massless(M: csr_matrix) -> None:
    diagonal = M.diagonal()
    wrong = np.flatnonzero(diagonal <= 0.0)
    if wrong.size:
        raise QualityGateError(
            f"M has {diagonal[wrong[0]]:.3g} on the diagonal of dof {wrong[0]}; every dof needs a "
            "positive mass.",
            hint="Condense dofs without mass statically before you reduce.",
        )


def negative_count(A: Any) -> int:
    """Number of negative eigenvalues of a symmetric matrix, from its pivots (Sylvester)."""
    return SymmetricLU(A).negative_pivots()
