"""The operator verbs on SciPy matrices, for people who bring matrices of their own."""

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import LinAlgError, eigh, eigvalsh
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import LinearOperator, SuperLU, eigsh, splu

from rom.arguments import matrix
from rom.eigen.condensed import Supported
from rom.eigen.verbs import Weighted, canonical_signs, count_shift, orthonormal
from rom.errors import (
    ConfigError,
    InterfaceError,
    ModelError,
    ModesMissedError,
    QualityGateError,
    SolverError,
)
from rom.model import Array, Index
from rom.names import named
from rom.process.stopwatch import FACTORISATION_PIECE, SEARCH_PIECE, piece

PIVOT_RTOL = 1e-13  # smallest over largest pivot below which K_ii counts as singular
RIGID_RTOL = 1e-13  # eigenvalue of a motion without stiffness, of the largest one
SYMMETRIC_LU = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0}
MAX_DENSE_DOFS = 300  # all eigenvalues are computed at once up to here
N_SPARE_MODES = 3  # beyond the ones asked for, so that a gap for counting is found


class HeldSciPy:
    """K with the held dofs eliminated, factored once; call it to solve."""

    def __init__(self, K: csr_matrix, M: csr_matrix, held: Index, shift: float = 0.0):
        self.held = held
        self.free = np.setdiff1d(np.arange(K.shape[0]), held)
        self.n_free = self.free.size
        self.K, self.M = K[self.free][:, self.free], M[self.free][:, self.free]
        self.lu = None
        if self.n_free:
            held_still = shift == 0.0
            self.lu = _factor(self.K, held.size) if held_still else _shifted(self.K, self.M, shift)

    def __call__(self, F: Array) -> Array:
        """Solve K_ii X_i = F_i; rows of held dofs come back zero."""
        X = np.zeros(F.shape)
        if self.lu is not None:
            X[self.free] = self.lu.solve(np.ascontiguousarray(F[self.free]))
        return X


class SciPyOperators:
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
        self.rigid, self.T = rigid, T

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
        return HeldSciPy(self.K, self.M, dof_set(dofs, self.n), shift)

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

    def modes(
        self,
        held: npt.ArrayLike | HeldSciPy | Supported,
        m: int,
        sigma: float | None = None,
        *,
        finished: bool = False,
    ) -> tuple[Array, Array]:
        """Lowest m modes, mass-normalised: omega (m,) [rad/s] and Phi (n, m)."""
        if not isinstance(held, HeldSciPy):
            held_dofs = dof_set(held.dofs if isinstance(held, Supported) else held, self.n)
            if held_dofs.size == 0:
                return self._free_modes(m, sigma)
            held = HeldSciPy(self.K, self.M, held_dofs)
        if not 0 <= m <= held.n_free:
            raise ConfigError(
                f"n_modes={m}, but {self.n} dofs minus {held.held.size} boundary dofs leave "
                f"{held.n_free} interior dofs; ask for 0 to {held.n_free} modes."
            )
        lam, Phi_i = _lowest(held.K, held.M, held.lu, m)
        Phi = np.zeros((self.n, m))
        Phi[held.free] = Phi_i
        return np.sqrt(lam), canonical_signs(Phi)

    def _free_modes(self, m: int, sigma: float | None) -> tuple[Array, Array]:
        if not 0 <= m <= self.n:
            raise ConfigError(f"n_modes={m}, but the model has {self.n} dofs.")
        R = self._zero_modes()
        n_elastic = max(m - R.shape[1], 0)
        if self.n <= MAX_DENSE_DOFS:
            lam, Phi = _dense_modes(self.K, self.M, self.n)
            lam, Phi = lam[R.shape[1] :][:n_elastic], Phi[:, R.shape[1] :][:, :n_elastic]
        else:
            lam, Phi = self._elastic_modes(R, n_elastic, sigma)
        omega = np.concatenate([np.zeros(R.shape[1]), np.sqrt(np.maximum(lam, 0.0))])
        return omega[:m], np.hstack([R, canonical_signs(Phi)])[:, :m]

    def _zero_modes(self) -> Array:
        """M-orthonormal rigid motions, from the geometry or, without one, none."""
        if self.rigid is None:
            return np.zeros((self.n, 0))
        return orthonormal(self, self.rigid)

    def _elastic_modes(self, R: Array, m: int, sigma: float | None) -> tuple[Array, Array]:
        if m == 0:
            return np.zeros(0), np.zeros((self.n, 0))
        if sigma is None:
            sigma = -0.05 * self._first_elastic(R)
        lu = _symmetric_lu(self.K - sigma * self.M)
        MR = self.M @ R

        def inverse(x: Array) -> Array:
            y = lu.solve(x - MR @ (R.T @ x))
            return y - R @ (MR.T @ y)

        k = min(m + N_SPARE_MODES, self.n - R.shape[1] - 1)
        start = np.sin(1.0 + np.arange(self.n))
        operator = LinearOperator(self.K.shape, matvec=inverse)
        with piece(SEARCH_PIECE):
            lam, Phi = eigsh(
                self.K, k, self.M, sigma, OPinv=operator, v0=start - R @ (MR.T @ start), tol=0.0
            )
        order = np.argsort(lam)
        lam, Phi = lam[order], Phi[:, order]
        lam[np.abs(lam) < RIGID_RTOL * self.largest()] = 0.0
        if R.shape[1] and lam[0] == 0.0:
            raise ModelError(
                f"at least {np.count_nonzero(lam == 0.0)} more motions without stiffness than the "
                "six of a connected body.",
                hint="Parts of the mesh are not connected, or joined at a point or an edge only.",
            )
        _verify_count(self.K, self.M, np.concatenate([np.zeros(R.shape[1]), lam]), m + R.shape[1])
        return lam[:m], Phi[:, :m]

    def _first_elastic(self, R: Array) -> float:
        """Estimate of the first elastic eigenvalue by inverse iteration on a small block."""
        shift = 1e-6 * self.largest()
        lu = _symmetric_lu(self.K + shift * self.M)
        X = np.sin(np.outer(1.0 + np.arange(self.n), 1.0 + np.arange(8.0)))
        for _ in range(4):
            X = lu.solve(np.ascontiguousarray(self.M @ (X - R @ (R.T @ (self.M @ X)))))
            X = np.linalg.qr(X)[0]
        X -= R @ (R.T @ (self.M @ X))
        lam = eigh(X.T @ (self.K @ X), X.T @ (self.M @ X), eigvals_only=True)
        return float(
            max(lam[np.argmax(lam > RIGID_RTOL * self.largest())], RIGID_RTOL * self.largest())
        )

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
        raise ConfigError(f"boundary dof {outside} is outside 0..{n - 1}.")
    if np.unique(b).size != b.size:
        twice = named(np.flatnonzero(np.bincount(b) > 1).tolist())
        raise ConfigError(f"boundary dof {twice} is listed more than once; remove the repeats.")
    return b


def _symmetric(name: str, A: Any) -> csr_matrix:
    A = csr_matrix(matrix(name, A), dtype=float)
    if A.shape[0] != A.shape[1]:
        raise ConfigError(f"{name} has the shape {A.shape}; it must be square.")
    wrong = np.flatnonzero(~np.isfinite(A.data))
    if wrong.size:
        bad = int(np.searchsorted(A.indptr, wrong[0], side="right")) - 1
        raise SolverError(f"{name} has an entry that is not finite in row {bad}.")
    defect = abs(A - A.T).max() if A.nnz else 0.0
    if defect > 1e-10 * abs(A).max():
        raise QualityGateError(
            f"{name} is not symmetric: max|{name} - {name}^T| = {defect:.3g}.",
            hint="Symmetric reduction would give wrong frequencies; symmetrise it first.",
        )
    return A


def _symmetric_lu(A: Any) -> SuperLU:
    """Factors of a symmetric matrix with pivots on its diagonal where that is possible."""
    with piece(FACTORISATION_PIECE):
        return splu(csc_matrix(A), options={"SymmetricMode": True}, **SYMMETRIC_LU)


def _factor(K_ii: csr_matrix, n_held: int) -> SuperLU:
    advice = f"K_ii is singular: the {n_held} boundary dofs leave a rigid motion free."
    cure = "Fix at least three nodes that do not lie on one line, or use a free-interface basis."
    try:
        lu = _symmetric_lu(K_ii)
    except RuntimeError as error:
        raise InterfaceError(advice, hint=cure) from error
    pivots = np.abs(lu.U.diagonal())
    ratio = pivots.min() / pivots.max()
    if ratio < PIVOT_RTOL:
        raise InterfaceError(f"{advice[:-1]} (pivot ratio {ratio:.1e}).", hint=cure)
    n_negative = int(np.count_nonzero(lu.U.diagonal() < 0))
    if n_negative and np.array_equal(lu.perm_r, lu.perm_c):
        raise _indefinite("K", n_negative, "with the boundary held, deformation would give energy")
    return lu


def _shifted(K_ii: csr_matrix, M_ii: csr_matrix, shift: float) -> SuperLU:
    try:
        with piece(FACTORISATION_PIECE):
            return splu(csc_matrix(K_ii - shift * M_ii))  # indefinite: with pivoting
    except RuntimeError as error:
        raise SolverError(f"K - {shift:.6g} M is singular: the shift is an eigenvalue.") from error


def _refuse_massless(M: csr_matrix) -> None:
    diagonal = M.diagonal()
    wrong = np.flatnonzero(diagonal <= 0.0)
    if wrong.size:
        raise QualityGateError(
            f"M has {diagonal[wrong[0]]:.3g} on the diagonal of dof {wrong[0]}; every dof needs a "
            "positive mass.",
            hint="Condense dofs without mass statically before you reduce.",
        )


def _indefinite(name: str, n_negative: int, meaning: str) -> QualityGateError:
    return QualityGateError(
        f"{name} has {n_negative} negative eigenvalues: {meaning}.",
        hint="Check signs and supports where the matrix was made.",
    )


def _dense_modes(K: csr_matrix, M: csr_matrix, m: int) -> tuple[Array, Array]:
    try:
        return eigh(K.toarray(), M.toarray(), subset_by_index=(0, m - 1))
    except LinAlgError as error:
        n_negative = int(np.count_nonzero(eigvalsh(M.toarray()) < 0))
        raise _indefinite("M", n_negative, "some motion would have no inertia") from error


def _lowest(K: csr_matrix, M: csr_matrix, lu: SuperLU, m: int) -> tuple[Array, Array]:
    n = K.shape[0]
    if m == 0:
        return np.zeros(0), np.zeros((n, 0))
    if n <= MAX_DENSE_DOFS or m + N_SPARE_MODES >= n:  # Lanczos cannot return all modes
        return _dense_modes(K, M, m)
    inverse = LinearOperator(K.shape, matvec=lu.solve)
    start = np.sin(1.0 + np.arange(n))
    with piece(SEARCH_PIECE):
        lam, Phi = eigsh(K, m + N_SPARE_MODES, M, sigma=0.0, OPinv=inverse, v0=start, tol=0.0)
    order = np.argsort(lam)
    lam, Phi = lam[order], Phi[:, order]
    _verify_count(K, M, lam, m)
    return lam[:m], Phi[:, :m]


def _verify_count(K: csr_matrix, M: csr_matrix, lam: Array, m: int) -> None:
    """Compare the number of modes found with the inertia of K - sigma M (Sylvester)."""
    found, sigma = count_shift(lam, m)
    count = negative_count(K - sigma * M)
    if count != found and (n_negative := negative_count(M)):
        raise _indefinite("M", n_negative, "some motion would have no inertia")
    if count != found:
        raise ModesMissedError(
            f"{found} modes were found below {np.sqrt(sigma) / (2 * np.pi):.6g} Hz, "
            f"but the inertia of K - sigma M counts {count}.",
            hint="Ask for more modes, or give another shift sigma.",
        )


def negative_count(A: Any) -> int:
    """Number of negative eigenvalues of a symmetric matrix, from its pivots (Sylvester)."""
    lu = _symmetric_lu(A)
    if not np.array_equal(lu.perm_r, lu.perm_c):
        return int(np.count_nonzero(eigvalsh(A.toarray()) < 0))
    return int(np.count_nonzero(lu.U.diagonal() < 0))
