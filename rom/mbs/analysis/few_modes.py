"""Modes: all of small matrices of second order, or a few under constraints of sparse ones.

Few are found by shift-invert Lanczos; undamped ones are counted by the signature of the stiffness
at two shifts, so that none is missed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eig, eigh
from scipy.sparse import bmat, csc_matrix, csr_matrix, diags, identity
from scipy.sparse.linalg import LinearOperator, eigs, eigsh

from rom.arguments import finite, not_both, whole
from rom.errors import ConfigError, ModelError, ModesMissedError, SolverError
from rom.mbs.analysis.local_equations import Instant
from rom.mbs.equations.sparse_solve import Constrained, bordered, signature, unit_rows
from rom.mbs.integrate.consistent_start import RANK_PIVOT_RTOL
from rom.mbs.results.state import State
from rom.model import Array, Index

SHIFT_SHARE = 1e-6  # of the stiffest square, where the search for the lowest mode begins
N_SPARE = 3  # modes beyond those asked for, so that a gap for counting is found
N_PROBES, N_PASSES = 12, 3  # of the inverse iteration that looks for the lowest eigenvalue
MAX_SHIFTS = 12  # each a thousandth of the last
ROUND_OFF = 32 * np.finfo(float).eps  # of the terms that add up to an eigenvalue
MIN_GAP = 1e-6  # between neighbouring eigenvalues in which modes are counted, relative
SYMMETRY_RTOL = 1e-9
SAME_MOTIONS_RTOL = 1e-8  # share of motions that joints of another instant would stop
MAX_WHOLE = 12  # motions up to which all are computed
MIN_RATIO = 4  # motions per mode from which Lanczos is quicker than all modes at once
SPAN_RTOL = 1e-13  # square of a direction, of the largest, that shapes of one space still have
ASYMMETRY_RTOL = 1e-9  # of small matrices


def modes(C: Array, K: Array, zero: float) -> tuple[Array, Array, Array]:
    """Eigenvalue and vector per mode of y'' + C y' + K y = 0, and all 2 f eigenvalues.

    Frequencies ascend. A pair of real eigenvalues is one mode, its larger value is given.
    Below the share ``zero`` of the highest frequency counts as a motion that nothing holds.
    """
    symmetric = np.abs(K - K.T).max(initial=0.0) <= ASYMMETRY_RTOL * np.abs(K).max(initial=0.0)
    if symmetric and not C.any():
        squares, V = np.linalg.eigh(0.5 * (K + K.T))
        roots = np.sqrt((-squares).astype(complex))
        every = np.concatenate([roots, -roots])
        roots[np.abs(roots) < zero * np.abs(every).max(initial=0.0)] = 0.0
        order = np.lexsort((-roots.real, roots.imag))
        return roots[order], V[:, order], every
    n, s = len(K), max(np.sqrt(np.linalg.norm(K, 2)), np.linalg.norm(C, 2))
    every, X = eig(np.block([[np.zeros((n, n)), s * np.eye(n)], [-K / s, -C]]))
    limit = zero * np.abs(every).max(initial=0.0)
    order, roots = _one_per_mode(every, limit)
    roots[np.abs(roots) < limit] = 0.0
    V = X[:n, order]
    return roots, V / np.linalg.norm(V, axis=0), every


def _one_per_mode(every: Array, zero: Array | float) -> tuple[Index, Array]:
    """Numbers and values of real eigenvalues, the larger of each pair, then of those that swing."""
    real = np.flatnonzero(np.abs(every.imag) <= zero)
    real = real[np.argsort(-every[real].real)][: (real.size + 1) // 2]
    swing = np.flatnonzero(every.imag > zero)
    order = np.concatenate([real, swing[np.argsort(every[swing].imag)]])
    roots = every[order]
    roots[: real.size] = roots[: real.size].real
    return order, roots


def phases(X: Array) -> Array:
    """(f,) factors of size one that make the largest entry of each column real and positive."""
    if not X.size:
        return np.ones(X.shape[1])
    largest = X[np.abs(X).argmax(axis=0), np.arange(X.shape[1])]
    return np.abs(largest) / largest


def _probes(n: int, k: int) -> Array:
    """(n, k) motions to begin a search with, always the same."""
    return np.sin(np.outer(1.0 + np.arange(n), 1.0 + np.arange(k)))


@dataclass(frozen=True)
class Wanted:
    """Which modes are wanted: the n lowest, or those between two frequencies."""

    n: int  # 0 with a band
    band: tuple[float, float] = (0.0, np.inf)  # [rad/s]

    @classmethod
    def of(cls, n: int | None, band: tuple[float, float] | None) -> "Wanted | None":
        """What the caller says; None for all modes."""
        if n is None and band is None:
            return None
        if band is None:
            return cls(n or 0)
        not_both("linearize", n=n, band=band)
        low, high = finite("band", band, (2,))
        if not 0 <= low < high:
            raise ConfigError(f"band = ({low:g}, {high:g}) Hz must be two growing frequencies.")
        return cls(0, (2 * np.pi * low, 2 * np.pi * high))

    def among(self, roots: Array) -> Index:
        """Numbers of those wanted among all eigenvalues (f,) in ascending order [rad/s]."""
        if self.n > roots.size:
            whole("n", self.n, 1, roots.size, reason="the motions that the joints leave")
        low, high = self.band
        kept = np.flatnonzero((roots.imag >= low) & (roots.imag < high))
        if not kept.size:
            self.refuse(roots.imag)
        return kept[: self.n] if self.n else kept

    def refuse(self, near: Array) -> None:
        """Say that the band is empty, and which rates [rad/s] are near."""
        low, high = np.array(self.band) / (2 * np.pi)
        middle = 0.5 * sum(self.band)
        found = sorted(sorted(np.unique(near), key=lambda w: abs(w - middle))[:2])
        modes = " and ".join(f"{w / (2 * np.pi):.6g}" for w in found)
        text = f"no mode lies between {low:g} and {high:g} Hz; near are {modes} Hz."
        raise ModelError(text, hint="Widen band.")


@dataclass(frozen=True)
class Pencil:
    """M u'' + C u' + K u + G^T l = 0 with G u = 0, in units that give M a diagonal of ones."""

    K: csc_matrix  # (n, n) stiffness [1/s^2]
    C: csc_matrix  # (n, n) damping [1/s]
    M: csc_matrix  # (n, n) mass [1]
    G: csr_matrix  # (m, n) constraints, rows of length one
    groups: Sequence[Index]  # unknowns of u and l in the order of their elimination
    scale: float  # square of a rate at which the search for the lowest mode begins [1/s^2]
    basis: csc_matrix  # (n, n) variation of the coordinates, as in `State.v`, per u
    row: Array  # (m,) lengths of the rows as the mechanism has them
    independent: bool = False  # whether no constraint is known to repeat others

    @classmethod
    def of(cls, now: Instant, state: State, motions: tuple[csc_matrix, ...]) -> "Pencil":
        """Small motions around a state, counted as `small_motions` says, from sparse matrices."""
        assert now.pattern is not None
        T, T1, T2, T3 = motions
        M, C, K = now.matrices(state)
        D = diags(1 / np.sqrt(M.diagonal()))
        basis = T @ D
        if state.v.any() or state.a.any():
            K2, C2 = K @ T + C @ T1 + M @ T3, C @ T + M @ T2
        else:
            K2, C2 = K @ T, C @ T
        K2, C2 = basis.T @ K2 @ D, basis.T @ C2 @ D
        G, row = unit_rows(now.gradient(state.q, state.v)[1] @ basis)
        stiffest = abs(K2).max() if K2.nnz else 0.0
        K2, C2, M2 = (csc_matrix(A) for A in (K2, C2, basis.T @ M @ basis))
        scale = SHIFT_SHARE * stiffest or 1.0
        groups = now.pattern.groups
        return cls(K2, C2, M2, G, groups, scale, csc_matrix(basis), row, now.independent)

    @cached_property
    def redundant(self) -> int:
        """Number of constraints that repeat others."""
        if self.independent or not self.G.shape[0]:
            return 0
        A = bmat([[identity(self.M.shape[0]), self.G.T], [self.G, None]], format="csc")
        return signature(A, self.groups, RANK_PIVOT_RTOL).zero

    @property
    def n_free(self) -> int:
        """Number of motions that the constraints leave."""
        return int(self.M.shape[0] - self.G.shape[0] + self.redundant)

    @cached_property
    def symmetric(self) -> bool:
        """Whether there is nothing but masses and springs."""
        K = self.K
        odd = abs(K - K.T).max() if K.nnz else 0.0
        return bool(odd <= SYMMETRY_RTOL * abs(K).max() and not abs(self.C).max() > 0.0)

    @cached_property
    def even(self) -> csc_matrix:
        """Symmetric part of the stiffness."""
        return csc_matrix(0.5 * (self.K + self.K.T))

    def affords(self, wanted: Wanted) -> bool:
        """Whether the modes are few of many: otherwise all together are cheaper."""
        n = wanted.n or self.within(*wanted.band)
        return MIN_RATIO * (n + 2 * N_SPARE) < self.n_free

    def within(self, low: float, high: float) -> int:
        """Number of undamped modes between two rates [rad/s]."""
        return self.count(high**2) - self.count(low**2)

    def wanted(self, wanted: Wanted) -> tuple[Array, Array]:
        """Squares [1/s^2] and shapes (n, k) of undamped modes; round-off is zero."""
        low, high = (w**2 for w in wanted.band)
        squares, X = self.lowest(wanted.n) if wanted.n else self.between(low, high)
        if not squares.size:
            near = self.near(0.5 * (low + high) * (1 + 1e-7), 2)[0]
            wanted.refuse(np.sqrt(np.maximum(near, 0.0)))
        return np.where(np.abs(squares) <= self.round_off(X), 0.0, squares), X

    def wanted_damped(self, wanted: Wanted) -> tuple[Array, Array, Array]:
        """Eigenvalues [1/s], vectors (2 k, k) in motions of unit mass (n, 2 k).

        Real eigenvalues come in pairs, of which the larger stands for a mode.
        """
        low, high = wanted.band
        if wanted.n:
            shift, k = np.sqrt(-self.low_shift()), 2 * wanted.n
        else:
            shift, k = 0.5j * (low + high), self.within(low, high)
        every, Z = self.damped(shift, k + 2 * N_SPARE)
        mass = np.einsum("ik,ik->k", Z.conj(), self.M @ Z).real
        zero = np.sqrt(self.round_off(Z / np.sqrt(mass)))
        every = np.where(np.abs(every) <= zero, 0.0, every)
        order, roots = _one_per_mode(every, zero)
        kept = wanted.among(roots)
        return self._in_real_motions(roots[kept], Z[:, order[kept]])

    def _in_real_motions(self, roots: Array, Z: Array) -> tuple[Array, Array, Array]:
        """Shapes as combinations (2 k, k) of real motions (n, 2 k) of unit mass."""
        R = np.hstack([Z.real, Z.imag])
        R = R / np.maximum(np.linalg.norm(R, axis=0), 1e-300)
        squares, V = eigh(R.T @ (self.M @ R))
        kept = squares > SPAN_RTOL * squares[-1]
        Q = R @ (V[:, kept] / np.sqrt(squares[kept]))
        Y = Q.T @ (self.M @ Z)
        return roots, Y / np.linalg.norm(Y, axis=0), Q

    def count(self, shift: float) -> int:
        """Number of undamped modes below a shift [1/s^2]."""
        A = bordered(self.even - shift * self.M, self.G, redundant=not self.independent)
        return signature(A, self.groups).negative - self.G.shape[0]

    def inverse(self, K: csc_matrix) -> Constrained:
        """The factorised equations with K in place of the stiffness."""
        return Constrained(csc_matrix(K), self.G, redundant=not self.independent)

    def allows(self, other: "Pencil") -> bool:
        """Whether the joints of another instant allow the same motions."""
        if other is self or not self.G.shape[0]:
            return True
        n = self.M.shape[0]
        U = self.inverse(identity(n)).solve(_probes(n, N_PASSES))[0]
        return bool(np.abs(other.G @ U).max() <= SAME_MOTIONS_RTOL * np.abs(U).max())

    def seen_in(self, Q: Array) -> tuple[Array, Array]:
        """Stiffness and damping (k, k) in some motions (n, k)."""
        return Q.T @ (self.K @ Q), Q.T @ (self.C @ Q)

    def round_off(self, X: Array) -> Array:
        """(k,) eigenvalues of the shapes X (n, k) of unit mass that may be round-off [1/s^2]."""
        A = abs(X)
        return ROUND_OFF * np.einsum("ik,ik->k", A, abs(self.even) @ A)

    def near(self, shift: float, k: int) -> tuple[Array, Array]:
        """The k undamped modes nearest to a shift: squares (k,) [1/s^2] ascending, X (n, k)."""
        if self.n_free <= MAX_WHOLE:
            squares, X = self._whole
            kept = np.sort(np.argsort(np.abs(squares - shift))[:k])
            return squares[kept], X[:, kept]
        solve = self.inverse(self.even - shift * self.M).solve
        n = self.M.shape[0]
        operator = LinearOperator((n, n), matvec=lambda x: solve(x)[0], dtype=float)
        start = solve(_probes(n, 1)[:, 0])[0]
        squares, X = eigsh(self.even, k, self.M, shift, OPinv=operator, v0=start, tol=0.0)
        order = np.argsort(squares)
        return squares[order], X[:, order]

    @cached_property
    def _whole(self) -> tuple[Array, Array]:
        """All undamped modes, where the joints leave too few motions for Lanczos."""
        n = self.M.shape[0]
        X = self.inverse(identity(n)).solve(_probes(n, self.n_free))[0]
        return self._modes_in(np.linalg.qr(X)[0])

    def _modes_in(self, X: Array) -> tuple[Array, Array]:
        """Undamped modes in some motions (n, k): squares (k,) and shapes (n, k)."""
        squares, V = eigh(X.T @ (self.even @ X), X.T @ (self.M @ X))
        return squares, X @ V

    def low_shift(self) -> float:
        """A shift below all modes, and no further from the lowest elastic one than needed."""
        shift, n = -abs(self.scale), self.M.shape[0]
        X = _probes(n, min(N_PROBES, self.n_free))
        for _ in range(MAX_SHIFTS):
            if self._ritz(shift, X) > -shift:
                break
            shift *= 1e-3
        while self.count(shift):
            shift *= 10.0
        return shift

    def _ritz(self, shift: float, X: Array) -> float:
        """Estimate of the lowest eigenvalue that is not round-off."""
        solve = self.inverse(self.even - shift * self.M).solve
        for _ in range(N_PASSES):
            X = np.linalg.qr(solve(self.M @ X)[0])[0]
        squares, X = self._modes_in(X)
        noise = self.round_off(X)
        real = np.abs(squares) > noise
        return float(np.abs(squares[real]).min()) if real.any() else float(noise.max())

    def lowest(self, n: int) -> tuple[Array, Array]:
        """The n lowest undamped modes: squares of rates [1/s^2], shapes of unit mass."""
        k = min(n + N_SPARE, self.n_free)
        squares, X = self.near(self.low_shift(), k)
        if k > n:
            found, at = _gap(squares, n)
            self.confirm(found, at, self.count(at))
        return squares[:n], X[:, :n]

    def between(self, low: float, high: float) -> tuple[Array, Array]:
        """The undamped modes with squares of rates [1/s^2] between two bounds; see `lowest`."""
        n = self.count(high) - self.count(low)
        if n == 0:
            return np.zeros(0), np.zeros((self.M.shape[0], 0))
        k, middle = n, 0.5 * (low + high) * (1 + 1e-7)
        while k < self.n_free:
            k = min(2 * k + N_SPARE, self.n_free)
            squares, X = self.near(middle, k)
            inside = (squares >= low) & (squares < high)
            if inside.sum() >= n:
                break
        self.confirm(int(inside.sum()), high, n)
        return squares[inside], X[:, inside]

    def confirm(self, found: int, shift: float, count: int) -> None:
        """Compare what was found with what there is."""
        if found != count:
            text = f"{found} modes were found up to {np.sqrt(abs(shift)) / (2 * np.pi):.6g} Hz, but"
            hint = "Ask for a few more modes, or for another band."
            raise ModesMissedError(f"{text} there are {count}.", hint=hint)

    def damped(self, shift: complex, k: int) -> tuple[Array, Array]:
        """The k eigenvalues nearest to a shift [1/s], and shapes (n, k), of s^2 M + s C + K.

        Source:
            Saad, Numerical Methods for Large Eigenvalue Problems, 2011, sections 8.2 and 10.1:
            shift-invert on u and s u, of which only matrices (n, n) are factorised.
        """
        n = self.M.shape[0]
        solve = self.inverse(shift**2 * self.M + shift * self.C + self.K).solve
        D = self.C + shift * self.M

        def inverse(z: Array) -> Array:
            u = solve(-(D @ z[:n] + self.M @ z[n:]))[0]
            return np.concatenate([u, shift * u + z[:n]])

        kind = complex if np.iscomplexobj(shift) else float
        operator = LinearOperator((2 * n, 2 * n), matvec=inverse, dtype=kind)
        start = inverse(inverse(_probes(2 * n, 1)[:, 0].astype(kind)))
        inverses, Z = eigs(operator, k, v0=start, tol=0.0)
        return shift + 1 / inverses, Z[:n]


def _gap(squares: Array, n: int) -> tuple[int, float]:
    """Number of eigenvalues below the widest gap behind the n-th, and the middle of the gap."""
    upper, lower = squares[n:], squares[n - 1 : -1]
    size = np.abs(squares).max()
    gaps = (upper - lower) / np.maximum(np.abs(upper), 1e-12 * size)
    j = int(np.argmax(gaps))
    if gaps[j] < MIN_GAP:
        text = f"modes {n} to {squares.size} have one frequency: they cannot be counted apart."
        raise SolverError(text, hint="Ask for a few modes more or less.")
    return n + j, float(0.5 * (upper[j] + lower[j]))
