"""How many modes: the fewest whose estimated errors stay below a tolerance in a band."""

from collections.abc import Callable

import numpy as np
from scipy.linalg import eigh

from rom.eigen.verbs import Held, Operators
from rom.model import Array
from rom.reduction.bases.enhanced import projected, residual_shapes

# reduced frequencies up to so many times the band may approximate those inside it
BAND_FACTOR = 2.0
SAFETY_FACTOR = 1.1  # the estimate is asymptotic: among crowded modes it is a little too small
GROWTH_FACTOR = 1.6  # of the number of modes until the band is accurate


def enough_modes(
    ops: Operators, held: Held, Psi_b: Array, omega_max: float, tol: float, first: int
) -> tuple[Array, Array]:
    """The fewest fixed-interface modes with which all frequencies up to omega_max are accurate.

    Accuracy is the a-posteriori estimate of `estimated_errors` for the body without support; half
    the relative error of an eigenvalue is that of a frequency.

    Args:
        ops: operators in interface coordinates.
        held: their stiffness with the interfaces held.
        Psi_b: (n_local, n_b) constraint modes.
        omega_max: upper end of the band [rad/s].
        tol: relative error of a frequency that is accepted.
        first: number of modes computed first.

    Returns:
        omega (m,) [rad/s] and Phi (n_local, m).
    """
    m = min(max(first, 1), held.n_free)
    while True:
        omega, Phi = ops.modes(held, m)
        error = truncation_errors(ops, held, Psi_b, omega, Phi, omega_max)
        if error(m) <= tol or m == held.n_free:
            break
        m = min(int(np.ceil(GROWTH_FACTOR * m)), held.n_free)
    low, high = 0, m  # error(high) is accepted, or there are no more modes
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if error(middle) <= tol else (middle + 1, high)
    return omega[:high], Phi[:, :high]


def truncation_errors(
    ops: Operators, held: Held, Psi_b: Array, omega: Array, Phi: Array, omega_max: float
) -> Callable[[int], float]:
    """The largest estimated frequency error in the band as a function of the modes kept.

    All candidates are judged from one set of products: what leaves the basis joins the residual.
    """
    n_b, m = Psi_b.shape[1], omega.size
    Y = residual_shapes(ops, held, Psi_b, omega, Phi)
    K, M = projected(ops, np.hstack([Psi_b, Phi, Y]))
    moved = M[n_b : n_b + m, :n_b] / (omega**2)[:, None]  # Phi^T M Psi_b / omega^2

    def error(k: int) -> float:
        lam, V = reduced_modes(K[: n_b + k, : n_b + k], M[: n_b + k, : n_b + k])
        near = (lam > 1e-9 * lam[-1]) & (lam <= (BAND_FACTOR * omega_max) ** 2)
        lam, V = lam[near], V[:, near]
        t, d = np.zeros((2, K.shape[0], lam.size))
        t[: n_b + k] = V
        d[n_b + k : n_b + m] = moved[k:] @ V[:n_b]
        d[n_b + m :] = V[:n_b]
        eta = np.abs(_eigenvalue_errors(K, M, t, d * lam, lam))
        inside = lam <= (1 + 2 * eta) * omega_max**2  # the exact one may be, if eta is too small
        return 0.5 * SAFETY_FACTOR * float(eta[inside].max(initial=0.0))

    return error


def reduced_modes(K: Array, M: Array) -> tuple[Array, Array]:
    """All eigenvalues of a reduced body and its mass-normalised modes."""
    scale = 1 / np.sqrt(np.diag(M))
    lam, V = eigh(scale[:, None] * K * scale, scale[:, None] * M * scale)
    return lam, scale[:, None] * V


def _eigenvalue_errors(K: Array, M: Array, t: Array, d: Array, lam: Array) -> Array:
    """Eta = 2 t^T A d + d^T A d with A = M - K / lam, column by column."""
    Ad = M @ d - (K @ d) / lam
    return np.einsum("ij,ij->j", 2 * t + d, Ad)
