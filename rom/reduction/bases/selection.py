"""How many modes: the fewest whose estimated errors stay below a tolerance."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, eigh

from rom.eigen.verbs import Held, Operators, massless
from rom.model import Array, Index
from rom.reduction.bases.fixed_interface import projected, residual_shapes
from rom.rows import N_COMPARED

# reduced frequencies up to so many times the band may approximate those inside it
BAND_FACTOR = 2.0
SAFETY_FACTOR = 1.1  # the estimate is asymptotic: among crowded modes it is a little too small
GROWTH_FACTOR = 1.6  # of the number of modes until the frequencies are accurate
NOTHING_HELD = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Wanted:
    """The natural frequencies that are to be accurate."""

    tol: float  # relative error of a frequency that is accepted
    omega_max: float | None = None  # end of the band [rad/s]; None: the `N_COMPARED` lowest elastic
    supports: Sequence[Index] = ()  # interface columns held, for each support beside the free body


def enough_modes(
    ops: Operators, held: Held, Psi_b: Array, wanted: Wanted, first: int
) -> tuple[Array, Array]:
    """The fewest fixed-interface modes with which all frequencies wanted are accurate.

    Accuracy is estimated a posteriori, see `rom.eigen.residual_errors`; half the relative error of
    an eigenvalue is that of a frequency. Psi_b (n_local, n_b) are constraint modes; so many modes
    as ``first`` says are computed first. Returned are omega (m,) [rad/s] and Phi (n_local, m).
    """
    m = min(max(first, 1), held.n_free)
    while True:
        omega, Phi = ops.modes(held, m)
        error = truncation_errors(ops, held, Psi_b, (omega, Phi), wanted)
        if error(m) <= wanted.tol or m == held.n_free:
            break
        m = min(int(np.ceil(GROWTH_FACTOR * m)), held.n_free)
    low, high = 0, m  # error(high) is accepted, or there are no more modes
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if error(middle) <= wanted.tol else (middle + 1, high)
    return omega[:high], Phi[:, :high]


def truncation_errors(
    ops: Operators, held: Held, Psi_b: Array, modes: tuple[Array, Array], wanted: Wanted
) -> Callable[[int], float]:
    """The largest estimated error of a frequency wanted as a function of the modes kept.

    All candidates are judged from one set of products: what leaves the basis joins the residual.
    """
    omega, Phi = modes
    n_b, m = Psi_b.shape[1], omega.size
    Y = residual_shapes(ops, held, Psi_b, omega, Phi)
    K, M = projected(ops, np.hstack([Psi_b, Phi, Y]))
    moved = M[n_b : n_b + m, :n_b] / (omega**2)[:, None]  # Phi^T M Psi_b / omega^2

    def error(k: int) -> float:
        return max(in_support(k, drop) for drop in (NOTHING_HELD, *wanted.supports))

    def in_support(k: int, drop: Index) -> float:
        keep = np.setdiff1d(np.arange(n_b + k), drop)
        lam, V = reduced_modes(K[np.ix_(keep, keep)], M[np.ix_(keep, keep)])
        near = np.flatnonzero(lam > 1e-9 * lam[-1])  # elastic ones that may be those wanted
        if wanted.omega_max is None:
            near = near[:N_COMPARED]
        else:
            near = near[lam[near] <= (BAND_FACTOR * wanted.omega_max) ** 2]
        if wanted.omega_max is None and near.size < N_COMPARED and k < m:
            return np.inf
        lam, V = lam[near], V[:, near]
        t, d = np.zeros((2, K.shape[0], lam.size))
        t[keep] = V
        d[n_b + k : n_b + m] = moved[k:] @ t[:n_b]
        d[n_b + m :] = t[:n_b]
        d = d * lam  # eta = 2 t^T A d + d^T A d with A = M - K / lam, column by column
        eta = np.abs(np.einsum("ij,ij->j", 2 * t + d, M @ d - (K @ d) / lam))
        if wanted.omega_max is not None:  # the exact one may be inside, if eta is too small
            eta = eta[lam <= (1 + 2 * eta) * wanted.omega_max**2]
        return 0.5 * SAFETY_FACTOR * float(eta.max(initial=0.0))

    return error


def reduced_modes(K: Array, M: Array) -> tuple[Array, Array]:
    """All eigenvalues of a reduced body and its mass-normalised modes."""
    if not np.diag(M).min() > 0.0:
        raise massless("the interfaces")
    scale = 1 / np.sqrt(np.diag(M))
    try:
        lam, V = eigh(scale[:, None] * K * scale, scale[:, None] * M * scale)
    except LinAlgError as error:
        raise massless("the interfaces") from error
    return lam, scale[:, None] * V
