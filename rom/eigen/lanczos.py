"""Lowest modes by shift-invert Lanczos in blocks.

Solving for a block of right-hand sides costs about as much as solving for two or three single
ones, because the factor is read from memory once. A Krylov method that asks for one solution at a
time spends twice the factorisation on twenty modes; in blocks it takes half of it.
"""

import numpy as np
from scipy.linalg.blas import dgemm

from rom.eigen.completeness import MAX_MISS_PROBABILITY, gaussian_block, miss_probability
from rom.eigen.verbs import Factor, Searched
from rom.errors import SolverError
from rom.model import Array
from rom.process.stopwatch import MISS_NOTE, note

BLOCK_SIZE = 8  # columns solved together: fewer make solving dearer, more make the space larger
MAX_EXTRA_BLOCKS = 20  # beside the modes sought before a restart; twenty are seldom used
MAX_RESTARTS = 20  # after which the method has failed
MAX_FURTHER_BLOCKS = 6  # beyond convergence, for a proof; more cost as much as a count
SPENT_RTOL = 1e-14  # length of a column beside the space, of all of it, that is round-off
CANCELLED_RTOL = 1e-6  # the same, below which it is no longer orthogonal to the last digits
EIGENVALUE_RTOLS = 1e-7, 1e-5  # of modes sought and spare ones, whose error is its square


class BlockLanczos:
    """Krylov space of (K - sigma M)^-1 M, orthogonal to M-orthonormal modes, deflated (n_local, d).

    The shift lies below all eigenvalues sought, ``factor`` solves with K - sigma M for as many
    columns at once as there are random ones to start from (n_local, p); ``tol`` (k,) allows
    residuals of the modes sought, over the inverse's eigenvalues.

    Source:
        Grimes, Lewis and Simon, A shifted block Lanczos algorithm for solving sparse symmetric
        generalized eigenproblems, SIAM J. Matrix Anal. Appl. 15 (1994) 228; here with full
        orthogonalisation, and the thick restart of Wu and Simon, ibid. 22 (2000) 602.
    """

    def __init__(
        self, ops: Searched, factor: Factor, sigma: float, deflated: Array, start: Array, tol: Array
    ):
        self.ops, self.factor, self.sigma = ops, factor, sigma
        self.k, self.tolerance = tol.size, tol
        self.n_deflated, self.width = deflated.shape[1], start.shape[1]
        shape = (ops.n_local, self.n_deflated + capacity(self.k))
        self.V, self.MV = np.empty(shape, order="F"), np.empty(shape, order="F")
        self.size, self.coupled = 0, 0
        self.found: tuple[Array, Array] | None = None  # all pairs of T
        self.T = np.zeros((0, 0))
        self.next_look, self.restarted = 0.0, False
        self._append(deflated, ops.apply_M(deflated))
        W, MW, _, self.start = self._orthonormal(start)
        self._append(W, MW)

    def solve(self) -> None:
        """Let the space grow until the k leading pairs have converged."""
        for _ in range(MAX_RESTARTS):
            while self.size + self.width <= self.V.shape[1]:
                self._grow()
                if self._converged():
                    return
            self._restart()
        hint = "Ask for fewer modes, or check the mesh for cells of extreme shape."
        raise SolverError(f"{self.k} modes did not converge in {MAX_RESTARTS} restarts.", hint=hint)

    def iterated(self) -> tuple[Array, Array]:
        """The k eigenvalues next to the shift, ascending, and their mass-normalised modes.

        The modes after one more inverse iteration, B V S / theta = V S + W R S_last / theta, for
        which the last block W has paid. They stay orthonormal to the square of their residuals.
        """
        theta, S = self._ritz(self.k)
        V, W = np.split(self.V[:, self.n_deflated : self.size], [-self.width], axis=1)
        return self.sigma + 1.0 / theta, V @ S + W @ (self.R @ S[-self.width :] / theta)

    def _append(self, X: Array, MX: Array) -> None:
        new = slice(self.size, self.size + X.shape[1])
        self.V[:, new], self.MV[:, new] = X, MX
        self.size = new.stop

    def _grow(self) -> None:
        """One more block, and R (p, p), its coupling to the block before."""
        load = self.MV[:, self.size - self.width : self.size]
        W, MW, H, self.R = self._orthonormal(self.factor.solve(load))
        k, H = self.T.shape[0], H[self.n_deflated :]
        self.T = np.block([[self.T, H[:k]], [H[:k].T, 0.5 * (H[k:] + H[k:].T)]])
        self._append(W, MW)
        self.coupled, self.found = self.size - 2 * self.width, None

    def _orthonormal(self, W: Array) -> tuple[Array, Array, Array, Array]:
        """W made M-orthonormal to the space, M W, its components in the space, and the rest.

        The first pass goes over what the recurrence couples it with, the second over all. Where
        the space holds a column already, round-off is left: a random one takes its place, with
        which the search goes on to eigenvalues that are repeated more often than W has columns.
        """
        H, R = np.zeros((self.size, W.shape[1])), np.eye(W.shape[1])
        W = np.asfortranarray(W)
        for first in (self.coupled, 0):
            W = self._beside(W, H, R, first)
        length = np.sqrt(np.square(H).sum(axis=0).max(initial=0.0))
        W, MW, R, share = self._normalised(W, self.ops.apply_M(W), R, length)
        if share.min() < CANCELLED_RTOL:
            spent = share == 0.0
            n_before = self.width * self.n_deflated + self.size
            X = gaussian_block(self.ops, np.count_nonzero(spent), n_before)
            X = np.asfortranarray(self.factor.solve(self.ops.apply_M(X)))  # held rows are zero
            W[:, spent] = X / np.sqrt(np.diag(self.ops.gram(X, self.ops.apply_M(X))))
            for _ in range(2):
                W = self._beside(W, H, R)
            MW = self.ops.apply_M(W)
        W, MW, R, _ = self._normalised(W, MW, R, 0.0)
        return W, MW, H, R

    def _beside(self, W: Array, H: Array, R: Array, first: int = 0) -> Array:
        """W without its components in the columns of the space from one on; W R's go to H."""
        these = slice(first, self.size)
        G = self.ops.gram(self.MV[:, these], W)
        H[these] += G @ R
        W, V = np.asfortranarray(W), self.V[:, these]
        return dgemm(-1.0, V, G, 1.0, W, overwrite_c=True) if W.size and V.size else W

    def _normalised(self, W: Array, MW: Array, R: Array, length: float) -> tuple[Array, ...]:
        """W made M-orthonormal, M W, R with W R as it was, and what of a length was left of W.

        What is round-off counts as nothing.
        """
        g, U = np.linalg.eigh(self.ops.gram(W, MW))
        root = np.sqrt(np.maximum(g, 0.0))
        whole = max(np.hypot(length, root[-1]), np.finfo(float).tiny)
        root[root < SPENT_RTOL * whole] = 0.0
        T = U / np.where(root > 0.0, root, whole)
        return _combined(W, T), _combined(MW, T), (U * root).T @ R, root / whole

    def prove(self, m: int) -> bool:
        """Go on until surely none of the lowest m modes is missing; False if that stays open."""
        if self.restarted:
            return False
        for _ in range(MAX_FURTHER_BLOCKS):
            chance = miss_probability(self.T, self.start, self._residuals(), m)
            if chance <= MAX_MISS_PROBABILITY:
                note(MISS_NOTE, chance)
                return True
            if chance == 1.0 or self.size + self.width > self.V.shape[1]:
                break
            self._grow()
        return False

    def _residuals(self) -> Array:
        """(N,) of all Ritz values, over them."""
        theta, S = self._ritz(self.T.shape[0])
        return np.linalg.norm(self.R @ S[-self.width :], axis=0) / np.abs(theta)

    def _restart(self) -> None:
        """Keep the leading Ritz vectors and the last block only."""
        self.next_look, self.restarted = 0.0, True
        kept = self.k + self.width
        theta, S = self._ritz(kept)
        ends = self.n_deflated + np.array([0, kept, kept + self.width])
        for V in (self.V, self.MV):
            last = V[:, self.size - self.width : self.size].copy()
            V[:, ends[0] : ends[1]] = V[:, ends[0] : self.size - self.width] @ S
            V[:, ends[1] : ends[2]] = last
        self.size, self.T = ends[2], np.diag(theta)
        self.coupled, self.found = 0, None

    def _converged(self) -> bool:
        """Whether the residuals of the k leading Ritz values are small."""
        N = self.T.shape[0]
        if N < max(self.k, self.next_look):
            return False
        self.next_look = N + N**2 / self.ops.n  # to look costs as much as to grow by this
        return bool((self._residuals()[: self.k] <= self.tolerance).all())

    def _ritz(self, k: int) -> tuple[Array, Array]:
        if self.found is None:
            theta, S = np.linalg.eigh(self.T)
            self.found = theta[::-1], np.asfortranarray(S[:, ::-1])  # which BLAS takes as it is
        theta, S = self.found
        return theta[:k], S[:, :k]


def _combined(W: Array, U: Array) -> Array:
    """W U by columns, as the space is kept."""
    return dgemm(1.0, W, U) if W.size else W


def capacity(k: int) -> int:
    """Columns the space of k modes may have."""
    return 2 * k + MAX_EXTRA_BLOCKS * BLOCK_SIZE
