"""The lowest modes of a body, free or held, whoever factors and wherever its rows live.

A Krylov space that begins with p columns holds p of equal frequencies, and any search may pass one
over. What a count by inertia finds missing is sought beside what was found, until they agree.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import LinAlgError, eigh, eigvalsh

from rom.arguments import check_places, whole
from rom.eigen.completeness import gaussian_block
from rom.eigen.condensed import Supported
from rom.eigen.held import RIGID_RTOL, HeldBody
from rom.eigen.lanczos import BLOCK_SIZE, EIGENVALUE_RTOLS, BlockLanczos, capacity
from rom.eigen.verbs import (
    Factor,
    Matrix,
    Operators,
    Searched,
    Weighted,
    count_shift,
    every_row,
    orthonormal,
    own_rows,
)
from rom.errors import ModelError, ModesMissedError, QualityGateError, SolverError
from rom.model import Array, Index, Mask
from rom.names import check_once
from rom.process.stopwatch import SEARCH_PIECE, piece

N_SPARE_MODES = 3  # beyond the ones asked for, so that a gap for counting is found
MAX_DENSE_DOFS = 300  # all eigenvalues are computed at once up to here
MAX_SEARCHES = 12  # for what a count misses; a cluster seen in part doubles what is sought
MAX_LAST_DOFS = 2000  # the same where a search does not come to an end: some seconds
SHIFT_RATIO = 0.02  # of the first elastic eigenvalue, below zero: K - sigma M is positive definite
CANCELLING_RTOL = 1e-10  # the same, below which products with K have lost too many digits
CLUSTER_RTOL = 1e-7  # distance of eigenvalues whose modes are only defined as a plane
ESTIMATE_SHIFT = 1e-6  # of the largest eigenvalue, below zero, with which the first is estimated
ESTIMATE_STEPS = 4  # of inverse iteration, on eight columns
ALL_LOOSE_RATIO = 1e5  # estimate over round-off where all columns have found motions at rest
MASSLESS_RTOL = 1e-14  # of the largest scaled mass, below which a motion has none
NO_INERTIA = "some motion would have no inertia"
Seek = Callable[[int, Array], tuple[Array, Array, bool]]


class ModeSearch(Searched):
    """What `rom.eigen.scipy.SciPyOperators` and those of PETSc have in common: verbs and search."""

    held_kind: type[HeldBody]

    def apply_K(self, X: Array) -> Array:
        """K X."""
        return self.product(self.K, X)

    def apply_M(self, X: Array) -> Array:
        """M X."""
        return self.product(self.M, X)

    def expand(self, A: Array) -> Array:
        """T A."""
        return A if self.T is None else self.product(self.T, A)

    def hold(self, dofs: npt.ArrayLike, shift: float = 0.0) -> HeldBody:
        """Eliminate the held dofs and factor the rest of K - shift M."""
        return self.held_kind(self, dof_set(dofs, self.n), shift)

    def plus_mass(self, dM: Matrix) -> Operators:
        """The same body with the mass M + dM."""
        return self.like(self.K, self.plus(self.M, dM), self.rigid)

    def on_springs(self, dK: Matrix) -> Operators:
        """The body held by springs to the ground: stiffness K + dK, no rigid motion of its own."""
        return self.like(self.plus(self.K, dK), self.M, None)

    def varied(self, stiffness: Weighted, mass: Weighted, rigid: Array | None = None) -> Operators:
        """The same dofs with k K + sum k_i K_i and m M + sum m_i M_i."""
        K, M = self.weighted(self.K, *stiffness), self.weighted(self.M, *mass)
        return self.like(K, M, self.rigid if rigid is None else rigid)

    def all_finite(self, X: Array) -> bool:
        """True when X is finite on every rank."""
        return all(self.from_all(bool(np.isfinite(X).all())))

    def largest(self) -> float:
        """Estimate of the largest eigenvalue from the diagonals."""
        massive = self.mass_diagonal > 0.0
        ratio = self.stiffness_diagonal[massive] / self.mass_diagonal[massive]
        return float(max(self.from_all(ratio.max(initial=0.0))))

    @property
    def n_massive(self) -> int:
        """Number of dofs that have mass, and thereby of modes."""
        return sum(self.from_all(int(np.count_nonzero(self.mass_diagonal > 0.0))))

    def modes(
        self, held: Any, m: int, sigma: float | None = None, *, finished: bool = False
    ) -> tuple[Array, Array]:
        """Lowest m modes, mass-normalised: omega (m,) [rad/s] and Phi (n_local, m)."""
        if isinstance(held, Supported):
            return self._condensed_modes(held, m)
        in_blocks = isinstance(held, HeldBody)
        if not isinstance(held, HeldBody):
            if np.size(held) == 0:
                whole("n_modes", m, 0, self.n, reason="the dofs of the model")
                R = self._rigid_modes()
                lam, Phi = self._elastic_modes(R, max(m - R.shape[1], 0), sigma)
                omega = np.concatenate([np.zeros(R.shape[1]), np.sqrt(lam)])
                return omega[:m], np.hstack([R, self.signed(Phi)])[:, :m]
            held, finished = self.hold(held), True
        reason = f"{self.n} dofs without {held.held.size} boundary dofs leave no more"
        whole("n_modes", m, 0, held.n_free, reason=reason)
        lam, Phi = np.zeros(0), np.zeros((self.n_local, m))
        if m:
            how = {"in_blocks": in_blocks, "finished": finished}
            lam, Phi[held.mine] = held.inner.supported_modes(m, held, **how)
        return np.sqrt(lam), self.signed(Phi)

    def supported_modes(
        self, m: int, held: HeldBody, *, in_blocks: bool, finished: bool
    ) -> tuple[Array, Array]:
        """Lowest m eigenpairs of a body that cannot move as a whole, K factored."""

        def seek(k: int, found: Array) -> tuple[Array, Array, bool]:
            blocks = in_blocks or found.shape[1] > 0
            return self._sought(k, 0.0, held.made(), found, blocks=blocks)

        def count(sigma: float) -> int | None:
            number = self.count_below(sigma, held.factor if finished else None)
            if finished:
                held.release()
            return number

        if self._all_at_once(m, 0):
            lam, Phi = self.all_modes()
        else:
            lam, Phi = self._complete(m, np.zeros((self.n_local, 0)), seek, count)
        return lam[:m], settled(self, lam, Phi)[:, :m]

    def _condensed_modes(self, support: Supported, m: int) -> tuple[Array, Array]:
        """Lowest m modes with the factor of the inside alone; where they leave a doubt, with all.

        The other path factors the whole body anew, and counts.
        """
        R = np.zeros((self.n_local, 0)) if support.dofs.size else self._rigid_modes()
        n_elastic = m - R.shape[1]
        if n_elastic <= 0 or self._all_at_once(n_elastic, R.shape[1] + support.dofs.size):
            return self.modes(support.dofs, m)
        lam, Phi, proven = self.by_blocks(n_elastic, 0.0, support, R)
        if not proven:
            return self.modes(support.dofs, m)
        lam, Phi = lam[:n_elastic], settled(self, lam, Phi)[:, :n_elastic]
        omega = np.concatenate([np.zeros(R.shape[1]), np.sqrt(lam)])
        return omega, np.hstack([R, self.signed(Phi)])

    def _rigid_modes(self) -> Array:
        """M-orthonormal rigid motions, from the geometry or, without one, none."""
        if self.rigid is None:
            return np.zeros((self.n_local, 0))
        return orthonormal(self, self.rigid)

    def _elastic_modes(self, R: Array, m: int, sigma: float | None) -> tuple[Array, Array]:
        """The m modes above the rigid ones."""
        n_rigid = R.shape[1]
        if m == 0:
            return np.zeros(0), np.zeros((self.n_local, 0))
        if self._all_at_once(m, n_rigid):
            lam, Phi = (part[..., n_rigid:] for part in self.all_modes())
        else:
            shift = -SHIFT_RATIO * self.first_elastic(R) if sigma is None else sigma

            def seek(k: int, found: Array) -> tuple[Array, Array, bool]:
                inverse, again = self.shift_inverse(shift), found.shape[1] > n_rigid
                lam, Phi, _ = self._sought(k, shift, inverse, found, blocks=again)
                inverse.release()  # counting needs its memory
                self._refuse_mechanisms(lam, Phi, n_rigid)
                return np.where(self._at_rest(Phi, lam), 0.0, lam), Phi, False

            def count(sigma: float) -> int | None:
                number = self.count_below(sigma)
                return None if number is None else number - n_rigid

            lam, Phi = self._complete(m, R, seek, count)
        lam = np.where(self._at_rest(Phi, lam), 0.0, lam)
        return lam[:m], settled(self, lam, Phi)[:, :m]

    def _at_rest(self, Phi: Array, lam: Array) -> Mask:
        """(m,) True for mass-normalised motions without stiffness."""
        alone = self.gram(Phi, self.stiffness_diagonal[:, None] * Phi)
        return lam < RIGID_RTOL * np.diag(alone)

    def _refuse_mechanisms(self, lam: Array, Phi: Array, n_rigid: int) -> None:
        loose = self._at_rest(Phi, lam)
        if n_rigid and loose.any():
            text = f"at least {loose.sum()} more motions without stiffness than the six"
            hint = "Parts of the mesh are not connected, or joined at a point or an edge only."
            raise ModelError(f"{text} of a connected body.{self.where(Phi[:, loose])}", hint=hint)

    def _all_at_once(self, m: int, beside: int) -> bool:
        """Whether a space for m modes would be the whole of a small body."""
        return self.n <= max(MAX_DENSE_DOFS, capacity(m + N_SPARE_MODES) + beside)

    def _sought(
        self, k: int, sigma: float, inverse: Factor, found: Array, *, blocks: bool
    ) -> tuple[Array, Array, bool]:
        """The k lowest eigenpairs and some more beside those found, and whether surely all."""
        if blocks:
            return self.by_blocks(k, sigma, inverse, found)
        return *self.lowest(k + N_SPARE_MODES, sigma, inverse, found), False

    def _complete(
        self, m: int, deflated: Array, seek: Seek, count: Callable[[float], int | None]
    ) -> tuple[Array, Array]:
        """At least m eigenpairs, ascending, none of the lowest missing.

        What does not come to an end is left, for a small body, to a dense solution. ``seek`` finds
        so many eigenpairs beside those given, some more, and whether surely all; ``count`` says how
        many lie below a shift, without the deflated ones (n_local, d), or None.
        """
        try:
            return self._counted(m, deflated, seek, count)
        except (ModesMissedError, SolverError):
            self.refuse_wrong_mass()
            if self.n > MAX_LAST_DOFS:
                raise
        lam, Phi = self.all_modes()
        return lam[deflated.shape[1] :], Phi[:, deflated.shape[1] :]

    def _counted(
        self, m: int, deflated: Array, seek: Seek, count: Callable[[float], int | None]
    ) -> tuple[Array, Array]:
        """Search and count until they agree, see `_complete`."""
        lam, Phi, proven = seek(m, deflated)
        for _ in range(MAX_SEARCHES):
            if proven:
                return lam, Phi
            found, sigma = count_shift(lam, m)
            number: int | None = found
            lacking = lam.size  # without a gap the cluster goes on
            if lam[found] - lam[found - 1] > CLUSTER_RTOL * lam[found]:
                number = count(sigma)
                if number is None or number == found:
                    return lam, Phi
                lacking = number - found
            if lacking < 0 or self._all_at_once(lam.size + lacking, deflated.shape[1]):
                break
            more, Psi, _ = seek(lacking, np.hstack([deflated, Phi]))
            lam, Phi = np.concatenate([lam, more]), np.hstack([Phi, Psi])
            order = np.argsort(lam, kind="stable")
            lam, Phi = lam[order], Phi[:, order]
        raise missed(found, sigma, number, "Ask for more modes, or give another shift sigma.")

    def all_modes(self) -> tuple[Array, Array]:
        """All eigenpairs of a small body, solved densely on every rank."""
        E = own_rows(self, np.eye(self.n))
        K, M = (every_row(self, apply(E)) for apply in (self.apply_K, self.apply_M))
        try:
            follow = _without_mass(K, M)
            lam, Phi = eigh(follow.T @ K @ follow, follow.T @ M @ follow)
            Phi = follow @ Phi
        except LinAlgError as error:
            n_negative = int(np.count_nonzero(eigvalsh(M) <= 0.0))
            raise indefinite("M", n_negative, NO_INERTIA) from error
        return lam, own_rows(self, Phi)

    def refuse_wrong_mass(self) -> None:
        """Say so where the mass is why search and count differ."""

    def lowest(self, k: int, sigma: float, inverse: Any, deflated: Array) -> tuple[Array, Array]:
        """The k eigenvalues above sigma beside the deflated columns, and their modes."""
        return self.by_blocks(k - N_SPARE_MODES, sigma, inverse, deflated)[:2]

    def by_blocks(
        self, m: int, sigma: float, inverse: Factor, deflated: Array
    ) -> tuple[Array, Array, bool]:
        """Some more than m eigenvalues above sigma, modes, and whether surely none is missing."""
        with piece(SEARCH_PIECE):
            k = min(m + N_SPARE_MODES, self.n - deflated.shape[1])
            start = gaussian_block(self, BLOCK_SIZE, BLOCK_SIZE * deflated.shape[1])
            start[getattr(inverse, "mine", [])] = 0.0  # rows that a support holds
            sought = np.repeat(EIGENVALUE_RTOLS, [max(m, 1), k - max(m, 1)])
            space = BlockLanczos(self, inverse, sigma, deflated, start, sought)
            space.solve()
            proven = space.prove(m)
            lam, Phi = space.iterated()
            lam = refined(self, lam, Phi)
            order = np.argsort(lam, kind="stable")
            return lam[order], Phi[:, order], proven


def _without_mass(K: Array, M: Array) -> Array:
    """(n, m) motions of a body in which what has no mass follows what has, as its stiffness asks.

    Small matrices (n, n); the identity where every motion has mass.
    """
    scale = np.sqrt(np.maximum(np.diag(M), 0.0))
    scale = 1.0 / np.where(scale > 0.0, scale, 1.0)
    mu, Q = np.linalg.eigh(scale[:, None] * M * scale)
    N = scale[:, None] * Q[:, np.abs(mu) <= MASSLESS_RTOL * mu[-1]]
    if not N.shape[1]:
        return np.eye(len(K))
    W = scale[:, None] * Q[:, np.abs(mu) > MASSLESS_RTOL * mu[-1]]
    return W - N @ np.linalg.solve(N.T @ K @ N, N.T @ K @ W)


def refined(ops: Searched, lam: Array, Phi: Array) -> Array:
    """(m,) eigenvalues lam as energies of normalised modes, free of a factor's round-off.

    Where a body hangs almost free, energies cancel, and lam is better.
    """
    found = np.diag(ops.gram(Phi, ops.apply_K(Phi)))
    alone = np.diag(ops.gram(Phi, ops.stiffness_diagonal[:, None] * Phi))
    return np.where(found > CANCELLING_RTOL * alone, found, lam)


def indefinite(name: str, n_negative: int, meaning: str) -> QualityGateError:
    """The error of a matrix that should be positive definite, and what it means that it is not."""
    text = f"{name} has {n_negative} negative eigenvalues: {meaning}."
    return QualityGateError(text, hint="Check signs and supports where the matrix was made.")


def shift_is_eigenvalue(shift: float) -> SolverError:
    """The error of K - shift M that has no inverse."""
    return SolverError(f"K - {shift:.6g} M is singular: the shift is an eigenvalue.")


def settled(ops: Searched, lam: Array, Phi: Array) -> Array:
    """Modes with equal frequencies turned within their plane to the same place on any machine."""
    Phi = Phi.copy()
    apart = np.diff(lam) > CLUSTER_RTOL * np.abs(lam[1:])
    edges = np.concatenate([[0], np.flatnonzero(apart) + 1, [lam.size]])
    for start, end in pairwise(edges):
        if end - start > 1:
            probes = ops.fixed[:, None] ** np.arange(1, end - start + 1)
            Q, _ = np.linalg.qr(ops.gram(Phi[:, start:end], probes))
            Phi[:, start:end] = Phi[:, start:end] @ Q
    return Phi


def estimated_by_iteration(ops: Searched, factor: Factor, R: Array) -> float:
    """The least eigenvalue that is not zero, estimated without geometry.

    The factor is of the stiffness with a little mass, `ESTIMATE_SHIFT`; the M-orthonormal motions
    R (n_local, r) are left out.
    """
    X = gaussian_block(ops, BLOCK_SIZE)
    for _ in range(ESTIMATE_STEPS):
        X = X - R @ ops.gram(R, ops.apply_M(X))
        X = orthonormal(ops, factor.solve(ops.apply_M(X)))
    lam, U = np.linalg.eigh(ops.gram(X, ops.apply_K(X)))
    X = X @ U
    floor = RIGID_RTOL * np.diag(ops.gram(X, ops.stiffness_diagonal[:, None] * X))
    elastic = lam[lam > floor]
    return float(elastic.min() if elastic.size else ALL_LOOSE_RATIO * floor.max())


def missed(found: int, sigma: float, number: int | None, cure: str) -> ModesMissedError:
    """The error of modes found below a shift [rad^2/s^2] that the inertia counts otherwise."""
    text = f"{found} modes were found below {np.sqrt(abs(sigma)) / (2 * np.pi):.6g} Hz"
    return ModesMissedError(f"{text}, but the inertia of K - sigma M counts {number}.", hint=cure)


def dof_set(dofs: npt.ArrayLike, n: int) -> Index:
    """Dof numbers as given, checked: distinct, within 0..n-1."""
    b = np.asarray(dofs, dtype=np.int64).ravel()
    check_places("boundary dof", b, n)
    check_once(b.tolist(), "boundary dof")
    return b
