"""Second-order balanced truncation: what is both moved by the input and felt at the output."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.linalg import qr, solve_continuous_lyapunov, svd

from rom.arguments import Between, Modes, matrix, typed, whole
from rom.eigen.verbs import Held, Operators
from rom.errors import ConfigError, ModelError, ResourceError
from rom.model import Array, Index
from rom.reduction.bases.fixed_interface import Columns, Constrained, numbered

MAX_COORDINATES = 600  # a Lyapunov equation of twice the size is solved in seconds up to here


@typed
@dataclass(frozen=True, slots=True)
class BalancedTruncation(Constrained):
    """Constraint modes, and those combinations of fixed-interface modes that the interfaces know.

    Of a pool of fixed-interface modes with modal damping, moved by accelerations of the interfaces
    and felt by their reactions, the combinations with the largest singular values stay. The
    projection is one-sided, so that stiffness and mass stay symmetric and frequencies upper bounds.

    Attributes:
        n_modes: number of combinations kept.
        pool: number of fixed-interface modes to choose from; None for three times as many.
        damping_ratio: modal damping of the pool [1], for the choice only.

    Raises:
        ConfigError: for a pool of fewer than n_modes.

    Source:
        Chahlaoui, Lemonnier, Vandendorpe and Van Dooren, Second-order balanced truncation, Linear
        Algebra Appl. 415 (2006) 373.
    """

    n_modes: Modes
    pool: int | None = None
    damping_ratio: Annotated[float, Between(0, 1, "()")] = 0.01

    def __post_init__(self) -> None:
        if self.pool is not None:
            whole("pool", self.pool, self.n_modes, reason="n_modes are chosen from it")

    def _completed(self, ops: Operators, held: Held, Psi_b: Array, boundary: Index) -> Columns:
        pool = min(3 * self.n_modes if self.pool is None else self.pool, held.n_free)
        whole("n_modes", self.n_modes, 0, held.n_free, reason="the dofs that are free")
        omega, Phi = ops.modes(held, pool)
        if not omega.size:
            return Psi_b, omega, ()
        L = ops.gram(Phi, ops.apply_M(Psi_b))  # participation: how interfaces drive the modes
        K, D = np.diag(omega**2), np.diag(2 * self.damping_ratio * omega)
        S, R = _gramian_factors(K, np.eye(pool), D, L, L.T * omega**2)
        X = R @ svd(S.T @ R)[2].T
        V = qr(X[:, : self.n_modes], mode="economic")[0]
        lam, Y = np.linalg.eigh(V.T @ K @ V)
        return np.hstack([Psi_b, Phi @ V @ Y]), np.sqrt(lam), numbered("balanced", lam.size)


@dataclass(frozen=True, slots=True)
class SecondOrderSystem:
    """M x'' + D x' + K x = B u, y = C x.

    Attributes:
        K, M, D: (n, n) stiffness, mass, damping.
        B: (n, p) input.
        C: (q, n) output.
        singular_values: of the system it was reduced from, descending; roots of the eigenvalues
            of position controllability times velocity observability.
    """

    K: Array
    M: Array
    D: Array
    B: Array
    C: Array
    singular_values: Array


@typed
def second_order_balanced_truncation(
    K: Array, M: Array, D: Array, B: Array, C: Array, r: int
) -> SecondOrderSystem:
    """Reduce a small second-order system to its r most controllable and observable positions.

    Args:
        K: (n, n) stiffness of a stable system [N/m].
        M: (n, n) mass [kg].
        D: (n, n) damping [N s/m].
        B: (n, p) force per unit of each input [N].
        C: (q, n) output per position [1/m].
        r: number of coordinates kept.

    Raises:
        ConfigError: if the shapes or r do not fit.
        ResourceError: for more than 600 coordinates.
        ModelError: if the system is not stable.

    Source:
        Chahlaoui, Lemonnier, Vandendorpe and Van Dooren, Linear Algebra Appl. 415 (2006) 373.
    """
    K, M, D, B, C = (np.atleast_2d(np.asarray(A, dtype=float)) for A in (K, M, D, B, C))
    n = K.shape[0]
    shapes = (n, n), (n, n), (n, n), (n, None), (None, n)
    for name, A, shape in zip("KMDBC", (K, M, D, B, C), shapes, strict=True):
        matrix(name, A, shape)
    whole("r", r, 1, n, reason="the coordinates of the system")
    S, R = _gramian_factors(K, M, D, B, C)
    U, sigma, Vt = svd(S.T @ R)
    if sigma[r - 1] <= np.finfo(float).eps * sigma[0]:
        most = np.count_nonzero(sigma > np.finfo(float).eps * sigma[0])
        raise ConfigError(f"r = {r}, but only {most} coordinates are controllable and observable.")
    right = R @ Vt[:r].T / np.sqrt(sigma[:r])
    left = S @ U[:, :r] / np.sqrt(sigma[:r])  # left^T right = 1
    M_inverse = np.linalg.inv(M)
    K_r, D_r = (left.T @ M_inverse @ A @ right for A in (K, D))
    return SecondOrderSystem(K_r, np.eye(r), D_r, left.T @ M_inverse @ B, C @ right, sigma)


def _gramian_factors(K: Array, M: Array, D: Array, B: Array, C: Array) -> tuple[Array, Array]:
    """Factors of Gramians: velocity observability S S^T, position controllability R R^T."""
    n = K.shape[0]
    if n > MAX_COORDINATES:
        text = f"{n} coordinates make a Lyapunov equation that is refused above {MAX_COORDINATES}."
        raise ResourceError(text, hint="Reduce with CraigBampton first, or choose a smaller pool.")
    scale = np.sqrt(np.linalg.norm(np.linalg.solve(M, K), 2))  # of time, for the conditioning
    back = [-np.linalg.solve(M, K) / scale**2, -np.linalg.solve(M, D) / scale]
    A = np.block([[np.zeros((n, n)), np.eye(n)], back])
    if np.linalg.eigvals(A).real.max() >= 0.0:
        text = "the system is not stable: hold its rigid motions, and give each mode damping."
        raise ModelError(text)
    b = np.vstack([np.zeros_like(B), np.linalg.solve(M, B) / scale**2])
    c = np.hstack([C, np.zeros_like(C)])
    P = solve_continuous_lyapunov(A, -b @ b.T)[:n, :n]
    Q = solve_continuous_lyapunov(A.T, -c.T @ c)
    return _factor(Q[n:, n:] / scale**3), _factor(P * scale)


def _factor(P: Array) -> Array:
    """F with P = F F^T of a semi-definite P."""
    lam, V = np.linalg.eigh(0.5 * (P + P.T))
    return V * np.sqrt(np.maximum(lam, 0.0))
