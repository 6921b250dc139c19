"""Lowest modes without a factor: preconditioned conjugate gradients on a block.

How surely no eigenvalue was missed is asked of random loads. Of k M-orthonormal vectors Phi with
Rayleigh quotients below sigma, at least k eigenvalues lie below sigma. Exactly k do when

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
import numpy.typing as npt

from rom.eigen.completeness import MAX_MISS_PROBABILITY, gaussian_block, log_chebyshev
from rom.errors import ModesMissedError, SolverError
from rom.fe.operators.factor import dense_rows
from rom.fe.operators.iterative.gradients import ConjugateGradients, Recurrence
from rom.model import Array
from rom.process.stopwatch import MISS_NOTE, RESIDUAL_NOTE, SEARCH_PIECE, note, piece

MODE_RTOL = 2e-9  # residual in the norm of K^-1: frequencies of the reduced body follow it
SPARE_RTOL = 1e-2  # the same for spare modes, which only show where the next ones lie
STILL_RTOL = 1e-11  # change of an eigenvalue whose vector is left alone once it has converged
MAX_ITERATIONS = 300  # well posed elasticity takes 15 to 40
MIN_GUARDS = 4  # columns beside the modes sought, which speed up the last ones
GUARD_RATIO = 0.2  # the same over the modes sought
DEPENDENT_RTOL = 1e-12  # eigenvalue of a scaled Gram matrix whose vector is dropped
N_BETWEEN_REFRESHES = 10  # iterations after which round-off of recurrences is removed
MAX_MISSES = 3  # times that a missed mode is taken in before the search has failed
N_COLUMNS = 4  # independent loads: fewer take more steps, more take more columns
MAX_STEPS = 400  # after which the probability reached is what there is
N_STEPS_BETWEEN = 10  # looks at the Ritz values
N_BOUND_STEPS = 40  # for the least eigenvalue of P K
LEAST_MARGIN = 0.5  # on that eigenvalue, which is found from above
LARGEST_MARGIN = 1.05  # on the largest one, which is found from below
LEAST_SHARE = 0.03  # of v^T M v in v^T diag(M) v: 27 nodes of a cell can add up, no more
Known = tuple[Array, Array, float]
Bounds = tuple[float, float]
GAP_SHARE = 0.8  # of the gap above the last mode, where the shift lies


class BlockSearch:
    """The lowest m modes of K x = lambda M x, K and M positive definite, beside some left out.

    Of the spare ones beyond, good eigenvalues will do; ``inverse`` is one of K, or of K with a
    positive shift, with its matrix; ``deflated`` (n_local, d) are M-orthonormal.

    Source:
        Knyazev, SIAM J. Sci. Comput. 23 (2001) 517; locking: Knyazev et al., ibid. 29 (2007) 2224;
        orthonormal bases by the scaled Gram matrix: Stathopoulos and Wu, ibid. 23 (2002) 2165;
        Duersch et al., ibid. 40 (2018) C655.
    """

    def __init__(self, ops: Any, inverse: ConjugateGradients, deflated: Array, m: int, spare: int):
        self.ops, self.inverse, self.m, self.k = ops, inverse, m, m + spare
        self.deflated, self.M_deflated = deflated, ops.apply_M(deflated)
        self.width = self.k + max(MIN_GUARDS, int(GUARD_RATIO * self.k))
        self.width = min(self.width, ops.n - deflated.shape[1])
        self.rtol = np.repeat([MODE_RTOL, SPARE_RTOL], [m, self.width - m])
        self._take(inverse.approximate(ops.apply_M(gaussian_block(ops, self.width))))

    def solve(self) -> None:
        """Iterate until the modes sought have converged."""
        still = np.zeros(self.width)  # eigenvalues of converged vectors
        self.D = self.X[:, :0]
        for iteration in range(MAX_ITERATIONS):
            active = np.abs(self.theta - still) > STILL_RTOL * self.theta
            R = self.AX[:, active] - self.theta[active] * self.MX[:, active]
            W = self.inverse.approximate(R)
            error = np.zeros(self.width)
            products = np.einsum("ij,ij->j", R, W)
            error[active] = np.sqrt(np.abs(self.ops.comm.allreduce(products)) / self.theta[active])
            done = error <= self.rtol
            still = np.where(done, self.theta, 0.0)
            if done[: self.k].all():
                if active[: self.k].all():
                    self.error = float(error[: self.m].max())
                    return
                still[:] = 0.0  # once more, all of them
                continue
            self._improve(np.hstack([W[:, ~done[active]], self.D]), ~done)
            if iteration % N_BETWEEN_REFRESHES == N_BETWEEN_REFRESHES - 1:
                self._take(self.X)
        raise SolverError(
            f"{(~done[: self.k]).sum()} of {self.k} modes did not converge in {MAX_ITERATIONS} "
            f"iterations (residual {error[: self.k].max():.1e}).",
            hint='Use solver="direct" if the factor fits, or improve cells of extreme shape.',
        )

    def _take(self, X: Array) -> None:
        """Start from the span of X: its Ritz vectors."""
        X, MX = self._orthonormal(X)
        AX = dense_rows(self.inverse.A, X)
        self.theta, U = np.linalg.eigh(self.ops.gram(X, AX))
        self.X, self.AX, self.MX = X @ U, AX @ U, MX @ U

    def _improve(self, Y: Array, wanted: npt.NDArray[np.bool_]) -> None:
        """Ritz vectors of X and Y together, and the directions in which those wanted have moved."""
        Y, MY = self._orthonormal(Y, self.X, self.MX)
        AY = dense_rows(self.inverse.A, Y)
        coupling = self.ops.gram(self.X, AY)
        H = np.block([[np.diag(self.theta), coupling], [coupling.T, self.ops.gram(Y, AY)]])
        theta, U = np.linalg.eigh(0.5 * (H + H.T))
        b = self.width
        self.theta, U = theta[:b], U[:, :b]
        D = Y @ U[b:]
        self.X = self.X @ U[:b] + D
        self.AX = self.AX @ U[:b] + AY @ U[b:]
        self.MX = self.MX @ U[:b] + MY @ U[b:]
        self.D = D[:, wanted]

    def _orthonormal(
        self, Y: Array, X: Array | None = None, MX: Array | None = None
    ) -> tuple[Array, Array]:
        """An M-orthonormal basis of Y beside X and the deflated modes, and M times it."""
        for _ in range(2):
            Y = Y - self.deflated @ self.ops.gram(self.M_deflated, Y)
            if X is not None:
                Y = Y - X @ self.ops.gram(MX, Y)
            MY = self.ops.apply_M(Y)
            G = self.ops.gram(Y, MY)
            scale = 1.0 / np.sqrt(np.maximum(np.diag(G), np.finfo(float).tiny))
            g, U = np.linalg.eigh(G * scale * scale[:, None])
            kept = g > DEPENDENT_RTOL * g[-1]
            T = scale[:, None] * U[:, kept] / np.sqrt(g[kept])
            Y, MY = Y @ T, MY @ T
        return Y, MY

    def prove(self) -> float:
        """Bound of the probability that one of the modes sought was missed; a miss is taken in."""
        ops = self.ops
        loads = gaussian_block(ops, N_COLUMNS, self.width) * ops.mass_diagonal[:, None]
        bounds = spectral_bounds(ops, self.inverse, loads)
        for _ in range(MAX_MISSES):
            ratio = self.theta[self.m : self.k] / self.theta[self.m - 1 : self.k - 1]
            j = self.m + int(ratio.argmax())
            theta = float(self.theta[j - 1])
            Phi = np.hstack([self.deflated, self.X[:, :j]])
            MPhi = np.hstack([self.M_deflated, self.MX[:, :j]])
            sigma = theta + GAP_SHARE * float(self.theta[j] - theta)
            verdict = searched(ops, self.inverse, (Phi, MPhi, theta), sigma, loads, bounds)
            if verdict.direction is None:
                return verdict.chance
            self._take(np.hstack([self.X[:, :-1], verdict.direction]))
            self.solve()
        raise ModesMissedError(
            f"after {MAX_MISSES} modes that were missed below "
            f"{np.sqrt(sigma) / (2 * np.pi):.6g} Hz one more was found.",
            hint='Ask for one mode more, or use solver="direct".',
        )


def lowest_modes(
    ops: Any, inverse: ConjugateGradients, sigma: float, deflated: Array, m: int, spare: int
) -> tuple[Array, Array]:
    """The m + spare lowest eigenvalues, ascending, and their mass-normalised modes, no factor.

    ``inverse`` is one of K - sigma M, sigma zero or negative; see `BlockSearch`.
    """
    with piece(SEARCH_PIECE):
        search = BlockSearch(ops, inverse, deflated, m, spare)
        search.solve()
        note(MISS_NOTE, search.prove())
        note(RESIDUAL_NOTE, search.error)
    return sigma + search.theta[: search.k], search.X[:, : search.k]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the search for a missed eigenvalue has found."""

    chance: float  # bound of the probability that one at or below the last mode was missed
    direction: Array | None  # (n_local, 1) where A' is negative, M-orthogonal to the modes


def spectral_bounds(ops: Any, inverse: ConjugateGradients, loads: Array) -> Bounds:
    """The least and the largest eigenvalue of P K, with a margin."""
    found = Recurrence(ops.comm, lambda X: dense_rows(inverse.A, X), inverse.approximate, loads)
    for _ in range(min(N_BOUND_STEPS, ops.n - 1)):
        found.step()
    least, largest = found.eigenvalues()
    return LEAST_MARGIN * float(least.min()), max(1.0, LARGEST_MARGIN * float(largest.max()))


def searched(
    ops: Any, inverse: ConjugateGradients, modes: Known, sigma: float, loads: Array, bounds: Bounds
) -> Verdict:
    """Look for an eigenvalue below sigma beside the modes found.

    Those are Phi (n_local, k), M Phi, and the largest Rayleigh quotient theta, below sigma; loads
    (n_local, N_COLUMNS) are Gaussian, bounds those of the eigenvalues of P K.
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
            again = Recurrence(ops.comm, apply, inverse.approximate, loads[:, column : column + 1])
            V = run.vector(column, again)
            return Verdict(1.0, V - Phi @ ops.gram(MPhi, V))
        degree = np.array([len(run.diagonals) - 1.0])
        growth = log_chebyshev(degree, 1.0 + 2.0 * mu / bounds[1])
        c2 = np.exp(np.log(bounds[1] * run.first / (mu * variance)) - 2.0 * growth)
        chance = float(np.minimum(1.0, np.sqrt(2.0 / np.pi * c2)).prod())
        if chance <= MAX_MISS_PROBABILITY:
            break
    return Verdict(chance, None)
