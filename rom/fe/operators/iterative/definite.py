"""How surely no eigenvalue was missed, without a factor.

Of k M-orthonormal vectors Phi with Rayleigh quotients below sigma, at least k eigenvalues lie below
sigma. Exactly k do when

    A' = K - sigma (M - M Phi Phi^T M)

is positive definite, for K - sigma M then is so on all vectors M-orthogonal to Phi. That is what an
inertia counts; here Lanczos looks for a negative eigenvalue of P A', P the approximate inverse
of K. If one more eigenvalue lay at or below theta, the last Rayleigh quotient, the least eigenvalue
mu of P A' would have

    mu <= -(sigma / theta - 1) delta,    delta the least eigenvalue of P K,

and Lanczos from a Gaussian load r (covariance diag(M)) that sees only positive Ritz values after j
steps has, with Chebyshev's polynomial T_(j-1) on [0, Delta], Delta the largest eigenvalue,

    |mu| T_(j-1)(1 + 2 |mu| / Delta)^2 c^2  <=  Delta r^T P r,

c the component of r in the eigenvector of mu. Its variance is at least a share of delta / sigma, as
v^T K v < sigma v^T M v and v^T P^-1 v = 1. The load was made without the modes found: so small a
c is improbable, and for several independent columns the probabilities multiply. Repeated and close
eigenvalues only help. No gap of the spectrum and no convergence of Phi is assumed. Estimated, not
proven, are delta and Delta, from the same kind of recurrence, with a margin; round-off is left out.

Source:
    Kuczynski and Wozniakowski, SIAM J. Matrix Anal. Appl. 13 (1992) 1094, for the probability.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.eigen.completeness import MAX_MISS_PROBABILITY, log_chebyshev
from rom.fe.operators.factor import dense_rows
from rom.fe.operators.iterative.gradients import ConjugateGradients
from rom.fe.operators.iterative.recurrence import Recurrence
from rom.model import Array

N_COLUMNS = 4  # independent loads: fewer take more steps, more take more columns
MAX_STEPS = 400  # after which the probability reached is what there is
N_STEPS_BETWEEN = 10  # looks at the Ritz values
N_BOUND_STEPS = 40  # for the least eigenvalue of P K
LEAST_MARGIN = 0.5  # on that eigenvalue, which is found from above
LARGEST_MARGIN = 1.05  # on the largest one, which is found from below
LEAST_SHARE = 0.03  # of v^T M v in v^T diag(M) v: 27 nodes of a cell can add up, no more
GAP_SHARE = 0.8  # of the gap above the last mode, where the shift lies


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the search for a missed eigenvalue has found.

    Attributes:
        chance: bound of the probability that one at or below the last mode was missed.
        direction: (n_local, 1) vector on which A' is negative, M-orthogonal to the modes; or None.
    """

    chance: float
    direction: Array | None


def spectral_bounds(ops: Any, inverse: ConjugateGradients, loads: Array) -> tuple[float, float]:
    """The least and the largest eigenvalue of P K, with a margin."""
    found = Recurrence(ops.comm, lambda X: dense_rows(inverse.A, X), inverse.approximate, loads)
    for _ in range(min(N_BOUND_STEPS, ops.n - 1)):
        found.step()
    least, largest = found.eigenvalues()
    return LEAST_MARGIN * float(least.min()), max(1.0, LARGEST_MARGIN * float(largest.max()))


def searched(
    ops: Any, inverse: ConjugateGradients, modes: tuple[Array, Array, float], sigma: float,
    loads: Array, bounds: tuple[float, float],
) -> Verdict:  # fmt: skip
    """Look for an eigenvalue below sigma beside the modes found.

    Args:
        ops: operators of the body.
        inverse: P, approximate inverse of its matrix K.
        modes: Phi (n_local, k), M Phi, and the largest Rayleigh quotient theta, below sigma.
        sigma: the shift.
        loads: (n_local, N_COLUMNS) independent Gaussian loads.
        bounds: of the eigenvalues of P K.
    """
    Phi, MPhi, theta = modes

    def apply(X: Array) -> Array:
        MX = ops.apply_M(X)
        return dense_rows(inverse.A, X) - sigma * (MX - MPhi @ ops.gram(Phi, MX))

    run = Recurrence(ops.comm, apply, inverse.approximate, loads)
    mu, variance = (sigma / theta - 1.0) * bounds[0], LEAST_SHARE * bounds[0] / sigma
    chance = 1.0
    for _ in range(min(MAX_STEPS, ops.n - Phi.shape[1] - 1) // N_STEPS_BETWEEN):
        for _ in range(N_STEPS_BETWEEN):
            run.step()
        least = run.eigenvalues()[0]
        if least.min() < 0.0:
            column = int(least.argmin())
            V = run.vector(column, Recurrence(ops.comm, apply, inverse.approximate,
                                              loads[:, column : column + 1]))  # fmt: skip
            return Verdict(1.0, V - Phi @ ops.gram(MPhi, V))
        degree = np.array([len(run.diagonals) - 1.0])
        growth = log_chebyshev(degree, 1.0 + 2.0 * mu / bounds[1])
        c2 = np.exp(np.log(bounds[1] * run.first / (mu * variance)) - 2.0 * growth)
        chance = float(np.minimum(1.0, np.sqrt(2.0 / np.pi * c2)).prod())
        if chance <= MAX_MISS_PROBABILITY:
            break
    return Verdict(chance, None)
