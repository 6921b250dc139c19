"""Craig-Bampton modes corrected by the residual modes left out, and what that says of the error."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from rom.arguments import typed, whole
from rom.eigen.verbs import Held, Operators, constraint_modes, quadratic
from rom.errors import ConfigError
from rom.model import Array, Basis, Index
from rom.reduction.bases.free_interface import numbered


@typed
@dataclass(frozen=True, slots=True)
class EnhancedCraigBampton:
    """Craig-Bampton of the same size, its columns corrected to first order in the eigenvalue.

    With F_rs the flexibility of the fixed-interface modes left out and T_r = F_rs M Psi_b, the
    substitution of the eigenvalue by H = M_0^-1 K_0 gives T_1 = T_0 + T_r H. Low frequencies of
    the body as it is coupled gain orders of magnitude; supports added later and statics under
    interface loads lose, and the certificate says so: for modes of assemblies, not for joints.

    Attributes:
        n_modes: number of fixed-interface modes.

    Raises:
        ConfigError: if n_modes is no number of modes.

    Source:
        Kim and Lee, An enhanced Craig-Bampton method, Int. J. Numer. Meth. Eng. 103 (2015) 79.
    """

    n_modes: int

    def __post_init__(self) -> None:
        whole("n_modes", self.n_modes)

    def basis(self, ops: Operators, boundary: Index, labels: tuple[str, ...]) -> Basis:
        """The basis for the interface dofs (n_b,); their columns first.

        Raises:
            ConfigError: without an interface, or for too many modes.
            InterfaceError: if the interfaces leave a rigid motion free.
        """
        if boundary.size == 0:
            raise ConfigError("the method holds interfaces of the body, and needs one.")
        held = ops.hold(boundary)
        Psi_b = constraint_modes(ops, held, boundary)
        omega, Phi = ops.modes(held, self.n_modes)
        T0 = np.hstack([Psi_b, Phi])
        K0, M0 = projected(ops, T0)
        H = np.linalg.solve(M0, K0)
        T0 += residual_shapes(ops, held, Psi_b, omega, Phi) @ H[: boundary.size]
        return Basis(T0, omega, (*labels, *numbered("enhanced", omega.size)), held)


def residual_shapes(ops: Operators, held: Held, Psi_b: Array, omega: Array, Phi: Array) -> Array:
    """(n_local, n_b) T_r = F_rs M Psi_b: answer of the modes left out to moving interfaces."""
    MPsi = ops.apply_M(Psi_b)
    return held(MPsi) - Phi @ (ops.gram(Phi, MPsi) / (omega**2)[:, None])


def projected(ops: Operators, T: Array) -> tuple[Array, Array]:
    """(r, r) stiffness and mass T^T K T and T^T M T, symmetric."""
    K, M = quadratic(ops, ops.apply_K, T), quadratic(ops, ops.apply_M, T)
    return 0.5 * (K + K.T), 0.5 * (M + M.T)


def estimated_errors(
    ops: Operators, basis: Basis, residual: Array, drop: Index, n: int
) -> tuple[Array, Array]:
    """Eigenvalues of a Craig-Bampton basis and how far they are above the exact ones.

    eta = 2 t^T A d + d^T A d with A = M - K / lam, t the reduced mode and d = lam T_r v_b its
    correction: an estimate of lam / lam_exact - 1, asymptotically exact, not a bound.

    Args:
        ops: operators in interface coordinates.
        basis: of Craig and Bampton, interface columns first.
        residual: (n_local, n_b) `residual_shapes` of the same basis.
        drop: interface columns held.
        n: number of modes.

    Returns:
        (k,) eigenvalues [rad^2/s^2] and (k,) relative errors; zero for rigid motions.

    Source:
        Kim, Lee and Lee, Comput. Struct. 139 (2014) 54; Boo, Kim and Lee (2016).
    """
    keep = np.setdiff1d(np.arange(basis.Psi.shape[1]), drop)
    T = basis.Psi[:, keep]
    K, M = projected(ops, T)
    scale = 1 / np.sqrt(np.diag(M))
    K, M = (scale[:, None] * A * scale for A in (K, M))
    n = min(n, keep.size)
    lam, V = eigh(K, M, subset_by_index=(0, n - 1))
    V = scale[:, None] * V
    t = T @ V
    on_boundary = keep < residual.shape[1]
    d = residual[:, keep[on_boundary]] @ V[on_boundary] * lam
    At, Ad = (ops.apply_M(X) - ops.apply_K(X) / np.where(lam > 0, lam, np.inf) for X in (t, d))
    eta = 2 * np.diag(ops.gram(d, At)) + np.diag(ops.gram(d, Ad))
    rigid = lam < 1e-9 * lam[-1]
    return lam, np.where(rigid, 0.0, eta)
