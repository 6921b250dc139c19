"""All modes up to a frequency by automated multilevel substructuring, with bounds of their errors.

The matrices are cut into a tree of substructures, each block of the eliminated stiffness gives its
modes up to a cut-off, and Rayleigh and Ritz do the rest. Inverse iteration on the whole block of
modes then takes most of the error away, and shows by its step how much there was.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import eigh, qr
from scipy.sparse import csr_matrix

from rom.arguments import positive
from rom.eigen.fronts import SubstructuredBody
from rom.eigen.scipy import RIGID_RTOL, SciPyOperators
from rom.eigen.verbs import canonical_signs, orthonormal
from rom.errors import ConfigError, ModelError, ModesMissedError
from rom.model import Array

CUTOFF_RATIO = 9.0  # largest eigenvalue of a substructure that is kept, over the last one sought
SPARE_RATIO = 1.3  # eigenvalues up to here are sought beside those asked for, to find a gap
SHIFT_SHARE = 1e-3  # of the last eigenvalue, by which free bodies are shifted
MAX_STEPS = 8  # of inverse iteration; one or two are usual
ROUND_OFF = 1e-13  # of the last eigenvalue: what sums over the dofs leave uncertain
STIFF_ROUND_OFF = 1e-15  # of the largest eigenvalue of the mesh, likewise in solutions


@dataclass(frozen=True, slots=True)
class BoundedModes:
    """Modes with bounds of their errors.

    Attributes:
        omega: (m,) circular frequencies, ascending, none below that of the matrices [rad/s].
        shapes: (n, m) mass-normalised shapes, largest entry positive [kg^-1/2].
        error: (m,) at most this share [1] of a frequency is error.
        n_kept: number of modes of substructures that were kept.
        n_steps: steps of inverse iteration after that.
    """

    omega: Array
    shapes: Array
    error: Array
    n_kept: int
    n_steps: int


def substructured_modes(
    K: Any, M: Any, f_max: float, *, rigid: Array | None = None, tol: float = 1e-4
) -> BoundedModes:
    """All modes up to a frequency, by automated multilevel substructuring.

    For hundreds to thousands of modes. Frequencies are those of Rayleigh and Ritz. A number counted
    by inertia proves that none is missed, and makes the bounds of Lehmann for the errors strict.

    Args:
        K: (n, n) stiffness [N/m], symmetric.
        M: (n, n) mass [kg], symmetric positive definite.
        f_max: the last frequency [Hz].
        rigid: (n, 6) rigid motions of a free body, kept exactly; None if the body is held.
        tol: largest error of a frequency [1], by its bound.

    Raises:
        InterfaceError: if a body that should be held is free.
        ModesMissedError: if the inertia count differs, or the bounds stay above the tolerance.

    Source:
        Bennighof and Lehoucq, An automated multilevel substructuring method for eigenspace
        computation in linear elastodynamics, SIAM J. Sci. Comput. 25 (2004) 2084; Gao, Li, Yang
        and Bai, ACM Trans. Math. Softw. 34 (2008) 20; bounds: Lehmann, Z. Angew. Math. Mech. 29
        (1949) 341.
    """
    if not 0 < tol < 1:
        raise ConfigError(f"tol = {tol!r} is a relative error between 0 and 1.")
    ops = SciPyOperators(K, M, rigid)
    last = (2 * np.pi * positive("f_max", f_max)) ** 2
    shift = 0.0 if rigid is None else SHIFT_SHARE * last
    iteration = _Iteration(ops, last, shift)
    for _ in range(MAX_STEPS):
        iteration.step()
        found = iteration.found()
        if found is not None and (found.error <= tol).all():
            return found
    raise ModesMissedError(
        f"the modes up to {f_max:g} Hz are not certain within {tol:g} after {MAX_STEPS} steps.",
        hint="Allow a larger error, or change the frequency a little.",
    )


class _Iteration:
    """Inverse iteration on a block of modes, from those of substructures.

    Z solves (K + shift M) Z = M X, so that three Gram matrices tell how far Z is from an
    invariant space, in the norm of M^-1 of what is left of K z - lambda M z.
    """

    def __init__(self, ops: SciPyOperators, last: float, shift: float):
        self.ops, self.last, self.shift = ops, last, shift
        self.limit = SPARE_RATIO * last + shift
        none = np.zeros((ops.n, 0))
        self.R = none if ops.rigid is None else orthonormal(ops, ops.rigid)
        self.MR = ops.M @ self.R
        K = csr_matrix(ops.K + shift * ops.M)
        self.body = SubstructuredBody(K, ops.M, CUTOFF_RATIO * self.limit)
        mu, Y = none[0], none[:0]
        if self.body.mass.size:
            interval = (1.0 / self.limit, np.inf)
            mu, Y = eigh(self.body.mass, subset_by_value=interval, driver="evr")
        self.X = self._elastic(self.body.expand((Y / np.sqrt(mu))[:, ::-1]))
        self.theta = 1.0 / mu
        self.rho = 0.0
        self.n_steps = 0

    def _elastic(self, X: Array) -> Array:
        """X without the columns that are nearest to rigid motions, and without these."""
        B = self.MR.T @ X
        if self.R.size:
            leading = qr(B, mode="r", pivoting=True)[1][: self.R.shape[1]]
            X, B = np.delete(X, leading, axis=1), np.delete(B, leading, axis=1)
        return X - self.R @ B

    def step(self) -> None:
        """Solve with the block, and take the best modes in the space of the solutions."""
        MX = self.ops.M @ self.X
        Z = self.body.solve(MX)
        Z -= self.R @ (self.MR.T @ Z)
        MZ = self.ops.M @ Z
        scale = 1.0 / np.sqrt(np.einsum("ij,ij->j", Z, MZ))
        for columns in (self.X, MX, Z, MZ):
            columns *= scale
        A0, A1, A2 = Z.T @ MZ, Z.T @ MX, self.X.T @ MX  # z^T M z, z^T K z, (K z)^T M^-1 K z
        self.theta, C = _eigh(A1, A0)
        self.residual = C.T @ A2 @ C - np.diag(self.theta**2)
        self.X = Z @ C
        self.n_steps += 1
        if self.n_steps == 1:
            self._count()

    def _count(self) -> None:
        """Count the eigenvalues up to the widest gap behind the last one asked for."""
        last = self.last + self.shift
        between = self.theta[(self.theta > last) & (self.theta < self.limit)]
        edges = np.array([last, *between, self.limit])
        widest = int(np.argmax(np.diff(edges)))
        self.rho = float(0.5 * (edges[widest] + edges[widest + 1]))
        self.n_below = self.body.count(self.rho) - self.R.shape[1]

    def found(self) -> BoundedModes | None:
        """The modes asked for; None as long as their number is not the one counted."""
        below = self.theta < self.rho
        if np.count_nonzero(below) != self.n_below:
            return None
        lam, largest = self.theta[below] - self.shift, self.ops._largest()
        self._refuse_loose(lam, largest)
        lower = lehmann_bounds(self.theta, self.residual, self.rho) - self.shift
        lower -= ROUND_OFF * self.rho + STIFF_ROUND_OFF * largest
        asked = lam <= self.last
        error = 1.0 - np.sqrt(np.maximum(lower, 0.0) / lam)
        n_rigid = self.R.shape[1]
        return BoundedModes(
            np.concatenate([np.zeros(n_rigid), np.sqrt(lam[asked])]),
            np.hstack([self.R, canonical_signs(self.X[:, : self.n_below][:, asked])]),
            np.concatenate([np.zeros(n_rigid), error[asked]]),
            self.body.mass.shape[0],
            self.n_steps,
        )

    def _refuse_loose(self, lam: Array, largest: float) -> None:
        n_loose = int(np.count_nonzero(lam < RIGID_RTOL * largest))
        if n_loose:
            raise ModelError(
                f"{n_loose} motions without stiffness"
                + (" more than the six of a connected body." if self.R.size else "."),
                hint="Hold the body, or give the rigid motions of a free one; parts of the mesh "
                "may not be connected, or joined at a point or an edge only.",
            )


def lehmann_bounds(theta: Array, residual: Array, rho: float) -> Array:
    """(m,) lower bounds of the eigenvalues below rho, whose number is that of the theta below.

    Args:
        theta: (k,) Ritz values of mass-normalised vectors x, ascending [rad^2/s^2].
        residual: (k, k) scalar products of K x - theta M x in M^-1 [rad^4/s^4].
        rho: no eigenvalue, so that as many lie below it as Ritz values [rad^2/s^2].

    Source:
        Lehmann, Optimale Eigenwerteinschliessungen, Numer. Math. 5 (1963) 246.
    """
    tau = _eigh(np.diag(theta - rho), np.diag((theta - rho) ** 2) + residual)[0]
    return rho + 1.0 / tau[tau < 0][::-1]


def _eigh(A: Array, B: Array) -> tuple[Array, Array]:
    """All pairs of a symmetric pencil, also of none."""
    if not A.size:
        return np.zeros(0), np.zeros((0, 0))
    return eigh(0.5 * (A + A.T), 0.5 * (B + B.T))
