"""All modes up to a frequency by automated multilevel substructuring, with bounds of their errors.

The matrices are cut into a tree of substructures, each block of the eliminated stiffness gives its
modes up to a cut-off, and Rayleigh and Ritz do the rest. Inverse iteration on the whole block of
modes then takes most of the error away, and shows by its step how much there was.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh, qr
from scipy.sparse import csr_matrix, issparse

from rom.arguments import between, positive
from rom.eigen.fronts import SubstructuredBody, refuse_beyond
from rom.eigen.gaussian import gaussian_block
from rom.eigen.held import RIGID_RTOL
from rom.eigen.lanczos import BlockLanczos, capacity
from rom.eigen.scipy import SciPyOperators, dof_set
from rom.eigen.verbs import canonical_signs, orthonormal
from rom.errors import ModelError, ModesMissedError, ParallelError, SolverError
from rom.model import Array, Modes

CUTOFF_RATIOS = (9.0, 16.0)  # eigenvalues of substructures kept up to, over the last one sought
COUNT_RATIOS = (1.08, 1.18)  # eigenvalues, over the last one sought, between which they are counted
SPARE_RATIOS = (1.6, 2.4)  # eigenvalues up to here are taken along: they come out too high
COUNT_STEP = 2  # whose frequencies are near enough to choose a gap
SHIFT_SHARE = 1e-3  # of the last eigenvalue, by which free bodies are shifted
SHIFT_RTOL = 1e-11  # of the largest eigenvalue of the mesh: a smaller shift would be round-off
MAX_STEPS = 4  # of inverse iteration; two are usual, after which modes are counted
N_COLUMNS = 256  # solved together: more take memory, fewer make products of matrices slow
WORK_COLUMNS, WORK_MATRICES = 5, 6  # of n rows so many times N_COLUMNS, of k rows k columns
N_ROWS = 4096  # turned together, in place
LANCZOS_WIDTH = 24  # columns of the search among modes of substructures
LANCZOS_RTOL = 0.02  # of its eigenvalues, whose modes are only where the iteration starts
ENOUGH_SHARE = 0.85  # of the limit up to which they are sought
LOOSE_SHARE = 0.25  # of them, the last ones, that need not have converged
ROUND_OFF = 1e-13  # of the last eigenvalue: what sums over the dofs leave uncertain
STIFF_ROUND_OFF = 1e-15  # of the largest eigenvalue of the mesh, likewise in solutions


def substructured_modes(
    K: Any, M: Any, f_max: float, *, rigid: Array | None = None, tol: float = 1e-3
) -> Modes:
    """All modes up to a frequency, by automated multilevel substructuring.

    For hundreds to thousands of modes. Frequencies are those of Rayleigh and Ritz. A count by
    inertia proves that none is missed, and makes the bounds of Lehmann for their errors strict.

    Args:
        K: (n, n) stiffness [N/m], symmetric.
        M: (n, n) mass [kg], symmetric positive definite.
        f_max: the last frequency [Hz].
        rigid: (n, 6) rigid motions of a free body, kept exactly; None if the body is held.
        tol: largest error of a frequency [1], by its bound.

    Returns:
        Modes with their bounds ``error``; the true frequencies lie between
        (1 - error) omega and omega [rad/s]. The last may lie above f_max by as much.

    Raises:
        ConfigError: if the frequency or the tolerance is out of range.
        InterfaceError: if a body that should be held is free.
        ModelError: if a free body has other motions without stiffness.
        ModesMissedError: if the inertia count differs.
        ResourceError: if the memory is foreseen not to suffice.
        SolverError: if the bounds stay above the tolerance.

    Source:
        Bennighof and Lehoucq, An automated multilevel substructuring method for eigenspace
        computation in linear elastodynamics, SIAM J. Sci. Comput. 25 (2004) 2084; Gao, Li, Yang
        and Bai, ACM Trans. Math. Softw. 34 (2008) 20.

    Example:
        >>> K = np.diag(np.full(9, 2.0)) - np.eye(9, k=1) - np.eye(9, k=-1)  # held chain
        >>> found = rom.eigen.substructured_modes(K, np.eye(9), f_max=0.1)
        >>> np.round(found.omega, 6)  # 2 sin(k pi / 20)
        array([0.312869, 0.618034])
    """
    between("tol", tol, 0, 1, "()")
    ops = SciPyOperators(K, M, rigid)
    last = (2 * np.pi * positive("f_max", f_max)) ** 2
    for ratio, spare in zip(CUTOFF_RATIOS, SPARE_RATIOS, strict=True):
        search = _Search(ops, last, ratio, spare)
        for k in range(1, MAX_STEPS + 1):
            search.step()
            if (
                k >= COUNT_STEP
                and search.complete
                and (worst := search.bounds()[1].max(initial=0.0)) <= tol
            ):
                return search.modes()
    if search.complete:
        raise SolverError(
            f"the frequencies up to {f_max:g} Hz are known within {worst:.2g} only.",
            hint=f"Allow a larger error than tol = {tol:g}.",
        )
    raise ModesMissedError(
        f"{search.n_found} modes were found below {np.sqrt(search.rho) / (2 * np.pi):.6g} Hz, but "
        f"the inertia of K - sigma M counts {search.n_below}.",
        hint="Change f_max a little.",
    )


def modes_up_to(ops: Any, held: npt.ArrayLike, f_max: float, tol: float) -> Modes:
    """`substructured_modes` with some dofs held, of operators in one process."""
    if ops.n_local != ops.n:
        raise ParallelError(
            "modes up to a frequency are computed in one process.",
            hint="Ask for a number of modes, or run without mpirun.",
        )
    K, M = (A if issparse(A) else ops.gathered(A) for A in (ops.K, ops.M))
    free = np.setdiff1d(np.arange(ops.n), dof_set(held, ops.n))
    whole = free.size == ops.n
    rigid = ops.rigid if whole else None
    found = substructured_modes(K[free][:, free], M[free][:, free], f_max, rigid=rigid, tol=tol)
    Phi = np.zeros((ops.n, found.omega.size))
    Phi[free] = found.shapes
    return replace(found, shapes=Phi)


class _Search:
    """Inverse iteration on a block of modes, from those of substructures.

    Z solves (K + shift M) Z = M X, so that three Gram matrices tell how far Z is from an
    invariant space, in the norm of M^-1 of what is left of K z - lambda M z.
    """

    def __init__(self, ops: SciPyOperators, last: float, cutoff_ratio: float, spare_ratio: float):
        self.ops, self.last = ops, last
        self.shift = shift = 0.0 if ops.rigid is None else _shift(ops, last)
        limit = spare_ratio * last + shift
        self.R = np.zeros((ops.n, 0)) if ops.rigid is None else orthonormal(ops, ops.rigid)
        self.MR = ops.M @ self.R
        K = csr_matrix(ops.K + shift * ops.M)
        self.body = SubstructuredBody(K, ops.M, cutoff_ratio * last + shift)
        k = np.count_nonzero(self.body.compliance > 1.0 / limit)  # about as many as there are
        self._refuse_beyond_memory(k)
        Y = _kept_modes(self.body, limit, k)
        X = np.empty((ops.n, Y.shape[1]))
        for new in _blocks(Y.shape[1], N_COLUMNS):
            X[:, new] = self.body.expand(Y[:, new])
        self.X, self.gram = self._elastic(X)
        self.n_steps = 0

    def _refuse_beyond_memory(self, k: int) -> None:
        r, n = self.body.n_kept, self.ops.n
        N = min(capacity(k), r)
        search = 2 * r * N + 3 * N**2
        iteration = n * (k + WORK_COLUMNS * min(N_COLUMNS, k)) + WORK_MATRICES * k**2
        answer = 2 * n * k  # the block, and the part of it that is handed out
        refuse_beyond(8.0 * max(search, iteration, answer), f"finding {k} modes of {n} dofs")

    def _elastic(self, X: Array) -> tuple[Array, Array]:
        """X without rigid motions and the columns that are nearest to them, and X^T M X."""
        B = self.MR.T @ X
        if self.R.size:
            leading = qr(B, mode="r", pivoting=True)[1][: self.R.shape[1]]
            X, B = np.delete(X, leading, axis=1), np.delete(B, leading, axis=1)
            X -= self.R @ B
        return X, np.eye(X.shape[1]) - B.T @ B

    def step(self) -> None:
        """Solve with the block, and take the best modes in the space of the solutions."""
        A0, A1 = self._solve()
        scale = 1.0 / np.sqrt(np.diag(A0))
        A0, A1, A2 = (A * np.outer(scale, scale) for A in (A0, A1, self.gram))
        self.theta, C = _eigh(A1, A0)
        self.residual = C.T @ A2 @ C - np.diag(self.theta**2)
        self.gram, C = C.T @ A0 @ C, scale[:, None] * C
        for rows in _blocks(self.ops.n, N_ROWS):
            self.X[rows] = self.X[rows] @ C
        self.n_steps += 1
        if self.n_steps == COUNT_STEP:
            self._count()

    def _solve(self) -> tuple[Array, Array]:
        """Put Z with (K + shift M) Z = M X in the place of X; Z^T M Z and Z^T M X."""
        k = self.X.shape[1]
        A0, A1 = np.zeros((k, k)), np.zeros((k, k))
        for new in _blocks(k, N_COLUMNS):
            MX = self.ops.M @ self.X[:, new]
            Z = self.body.solve(MX)
            Z -= self.R @ (self.MR.T @ Z)
            self.X[:, new] = Z
            for A, load in ((A0, self.ops.M @ Z), (A1, MX)):
                A[: new.stop, new] = self.X[:, : new.stop].T @ load
        A0, A1 = (np.triu(A) + np.triu(A, 1).T for A in (A0, A1))
        return A0, A1

    def _count(self) -> None:
        """Count the eigenvalues up to the widest gap behind the last one asked for."""
        first, last = (ratio * self.last + self.shift for ratio in COUNT_RATIOS)
        between = self.theta[(self.theta > first) & (self.theta < last)]
        edges = np.array([first, *between, last])
        widest = int(np.argmax(np.diff(edges)))
        self.rho = float(0.5 * (edges[widest] + edges[widest + 1]))
        self.n_below = self.body.count(self.rho) - self.R.shape[1]

    @property
    def n_found(self) -> int:
        """Number of modes below the place of the count, rigid motions left out."""
        return int(np.count_nonzero(self.theta < self.rho))

    @property
    def complete(self) -> bool:
        """Whether as many modes were found as there are."""
        return self.n_found == self.n_below

    def bounds(self) -> tuple[Array, Array]:
        """Eigenvalues asked for, rigid motions left out, and errors that bound their roots.

        Valid when they are complete.
        """
        lam, largest = self.theta[: self.n_below] - self.shift, self.ops.largest()
        self._refuse_loose(lam, largest)
        lower = lehmann_bounds(self.theta, self.residual, self.rho) - self.shift
        lower -= ROUND_OFF * self.rho + STIFF_ROUND_OFF * largest
        m = np.count_nonzero(lower <= self.last)
        return lam[:m], 1.0 - np.sqrt(np.maximum(lower[:m], 0.0) / lam[:m])

    def modes(self) -> Modes:
        """The modes asked for, rigid motions first."""
        (lam, error), still = self.bounds(), np.zeros(self.R.shape[1])
        return Modes(
            np.concatenate([still, np.sqrt(lam)]),
            np.hstack([self.R, canonical_signs(self.X[:, : lam.size])]),
            error=np.concatenate([still, error]),
        )

    def _refuse_loose(self, lam: Array, largest: float) -> None:
        loose = np.flatnonzero(lam < RIGID_RTOL * largest)
        if loose.size:
            raise ModelError(
                f"{loose.size} motions without stiffness"
                + (" more than the six of a connected body." if self.R.size else ".")
                + self.ops.where(self.X[:, loose]),
                hint="Hold the body, or give the rigid motions of a free one; parts of the mesh "
                "may not be connected, or joined at a point or an edge only.",
            )


class _Kept:
    """Modes of substructures as Lanczos sees them: their stiffness is one."""

    def __init__(self, body: SubstructuredBody):
        self.n = self.n_local = body.n_kept
        self.solve = body.apply_mass
        self.fixed, self.mass_diagonal = np.arange(float(self.n)), np.ones(self.n)

    def apply_M(self, X: Array) -> Array:
        """X."""
        return X

    def gram(self, X: Array, Y: Array) -> Array:
        """X^T Y."""
        return X.T @ Y


def _kept_modes(body: SubstructuredBody, limit: float, k: int) -> Array:
    """(r, about k) modes of all substructures together up to a limit, M-orthonormal, ascending."""
    r = body.n_kept
    while 2 * capacity(k) < r:
        kept = _Kept(body)
        start = gaussian_block(kept, LANCZOS_WIDTH)
        allowed = np.where(np.arange(k) < (1.0 - LOOSE_SHARE) * k, LANCZOS_RTOL, np.inf)
        space = BlockLanczos(kept, kept, 0.0, start[:, :0], start, allowed)
        space.solve()
        lam, Y = space.pairs()
        if k and lam[-1] >= ENOUGH_SHARE * limit:
            return Y * np.sqrt(lam)
        k = 10 + 3 * k // 2
    if not r:
        return np.zeros((0, 0))
    mass = body.apply_mass(np.eye(r))
    mu, Y = eigh(mass, subset_by_value=(1.0 / limit, np.inf), driver="evr")
    return (Y / np.sqrt(mu))[:, ::-1]


def _blocks(n: int, size: int) -> list[slice]:
    return [slice(first, min(first + size, n)) for first in range(0, n, size)]


def _shift(ops: SciPyOperators, last: float) -> float:
    return max(SHIFT_SHARE * last, SHIFT_RTOL * ops.largest())


def lehmann_bounds(theta: Array, residual: Array, rho: float) -> Array:
    """(m,) lower bounds of the eigenvalues below rho, whose number is that of the theta below.

    Args:
        theta: (k,) Ritz values of mass-normalised vectors x, ascending [rad^2/s^2].
        residual: (k, k) scalar products of K x - theta M x in M^-1 [rad^4/s^4].
        rho: no eigenvalue, so that as many lie below it as Ritz values [rad^2/s^2].

    Source:
        Lehmann, Optimale Eigenwerteinschliessungen, Numer. Math. 5 (1963) 246.
    """
    B = np.diag((theta - rho) ** 2) + residual
    tau = eigh(np.diag(theta - rho), 0.5 * (B + B.T), eigvals_only=True) if theta.size else theta
    return rho + 1.0 / tau[tau < 0][::-1]


def _eigh(A: Array, B: Array) -> tuple[Array, Array]:
    """All pairs of a symmetric pencil, also of none."""
    if not A.size:
        return np.zeros(0), np.zeros((0, 0))
    return eigh(0.5 * (A + A.T), 0.5 * (B + B.T))
