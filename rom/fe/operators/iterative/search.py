"""Lowest modes without a factor: preconditioned conjugate gradients on a block."""

from typing import Any

import numpy as np
import numpy.typing as npt

from rom.eigen.gaussian import gaussian_block
from rom.errors import ModesMissedError, SolverError
from rom.fe.operators.factor import dense_rows
from rom.fe.operators.iterative.definite import GAP_SHARE, N_COLUMNS, searched, spectral_bounds
from rom.fe.operators.iterative.gradients import ConjugateGradients
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


class BlockSearch:
    """The lowest modes of K x = lambda M x, K and M positive definite, beside some left out.

    Args:
        ops: operators of the body.
        inverse: approximate inverse of K, or of K with a positive shift; with its matrix.
        deflated: (n_local, d) M-orthonormal modes to leave out.
        m: number of modes sought.
        spare: number of those beyond, of which good eigenvalues will do.

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
        """Iterate until the modes sought have converged.

        Raises:
            SolverError: if they do not.
        """
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
        """Bound of the probability that one of the modes sought was missed; a miss is taken in.

        Raises:
            ModesMissedError: if there are more and more of them.
        """
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

    Args:
        ops: operators of the body.
        inverse: an approximate inverse of K - sigma M.
        sigma: zero, or negative.
        deflated: (n_local, d) M-orthonormal modes to leave out.
        m: number of modes sought.
        spare: number of those beyond.

    Raises:
        SolverError: if they do not converge.
        ModesMissedError: if modes were missed again and again.
    """
    with piece(SEARCH_PIECE):
        search = BlockSearch(ops, inverse, deflated, m, spare)
        search.solve()
        note(MISS_NOTE, search.prove())
        note(RESIDUAL_NOTE, search.error)
    return sigma + search.theta[: search.k], search.X[:, : search.k]
