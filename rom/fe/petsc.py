"""The operator verbs on PETSc, MUMPS and SLEPc, distributed over the ranks."""

from typing import Any

from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh
from scipy.sparse import csr_matrix

from rom.eigen import canonical_signs, count_shift, orthonormal
from rom.errors import ConfigError, InterfaceError, ModelError, ModesMissedError, SolverError
from rom.fe.factor import BLOCK, Factor, dense, dense_rows
from rom.fe.memory import check_factor_memory
from rom.model import Array, Index
from rom.scipy_operators import dof_set

SPARE = 3  # modes computed beyond the ones asked for, so that a gap for counting is found
ZERO = 1e-13  # of the largest eigenvalue: what is smaller is a motion without stiffness
DENSE = 200  # dofs up to which all eigenvalues are computed at once


class HeldPETSc:
    """K with the held dofs eliminated, factored once by MUMPS; call it to solve."""

    def __init__(self, ops: "PETScOperators", held: Index):
        self.ops, self.held = ops, held
        mine = np.arange(ops.first, ops.first + ops.n_local)
        self.mine = np.flatnonzero(~np.isin(mine, held))
        self.free = PETSc.IS().createGeneral(mine[self.mine].astype(PETSc.IntType), comm=ops.comm)
        self.n_free = self.free.getSize()
        if self.n_free:
            self.K = _submatrix(ops.K, self.free)
            self.M = _submatrix(ops.M, self.free)
            check_factor_memory(self.n_free, held.size)
            self.factor = Factor(self.K, definite=True)
            self._refuse_free_motion()

    def __call__(self, F: Array) -> Array:
        """Solve K_ii X_i = F_i; rows of held dofs come back zero."""
        X = np.zeros(F.shape)
        if self.n_free:
            X[self.mine] = self.factor.solve(F[self.mine])
        return X

    def _refuse_free_motion(self) -> None:
        """A rigid motion that is not held has, after one inverse iteration, no stiffness."""
        ops = self.ops
        if self.factor.ok:
            R = ops.rigid if ops.rigid is not None else np.ones((ops.n_local, 1))
            X = self(ops.apply_M(R))
            if ops.all_finite(X):
                X[np.isin(np.arange(ops.first, ops.first + ops.n_local), self.held)] = 0.0
                K, M = ops.gram(X, ops.apply_K(X)), ops.gram(X, ops.apply_M(X))
                stiffness = (np.diag(K) / np.diag(M)).min()
                if stiffness > ZERO * ops.largest():
                    return
        raise InterfaceError(
            f"K_ii is singular: the {self.held.size} boundary dofs leave a rigid motion free.",
            hint="Fix at least three nodes that do not lie on one line, or hold another interface.",
        )


class PETScOperators:
    """Stiffness and mass of one body, rows distributed over the ranks.

    Args:
        K: (n, n) stiffness, PETSc AIJ, symmetric.
        M: (n, n) mass with the same layout.
        rigid: (n_local, 6) rigid motions.
        T: (n_parent, n) map to the coordinates these came from.

    Raises:
        SolverError: if an entry is not finite.
    """

    def __init__(
        self, K: PETSc.Mat, M: PETSc.Mat, rigid: Array | None = None, T: PETSc.Mat | None = None
    ):
        self.K, self.M, self.rigid, self.T = K, M, rigid, T
        self.comm = K.comm.tompi4py()
        self.n = K.getSize()[0]
        self.first, end = K.getOwnershipRange()
        self.n_local = end - self.first
        self.last = self.comm.rank == self.comm.size - 1
        for name, A in (("K", K), ("M", M)):
            if not np.isfinite(A.norm()):
                raise SolverError(f"{name} has an entry that is not finite.")

    def apply_K(self, X: Array) -> Array:
        """K X."""
        return dense_rows(self.K, X)

    def apply_M(self, X: Array) -> Array:
        """M X."""
        return dense_rows(self.M, X)

    def gram(self, X: Array, Y: Array) -> Array:
        """X^T Y summed over the ranks."""
        product = np.ascontiguousarray(X.T @ Y)
        self.comm.Allreduce(MPI.IN_PLACE, product)
        return product

    def rows(self, X: Array, dofs: npt.ArrayLike) -> Array:
        """X[dofs] on all ranks."""
        dofs = np.asarray(dofs, dtype=np.int64)
        out = np.zeros((dofs.size, X.shape[1]))
        mine = (dofs >= self.first) & (dofs < self.first + self.n_local)
        out[mine] = X[dofs[mine] - self.first]
        self.comm.Allreduce(MPI.IN_PLACE, out)
        return out

    def all_finite(self, X: Array) -> bool:
        """True when X is finite on every rank."""
        return bool(self.comm.allreduce(bool(np.isfinite(X).all()), op=MPI.LAND))

    def largest(self) -> float:
        """Estimate of the largest eigenvalue from the diagonals."""
        ratio = self.K.getDiagonal().array / self.M.getDiagonal().array
        return float(self.comm.allreduce(ratio.max(initial=0.0), op=MPI.MAX))

    def hold(self, dofs: npt.ArrayLike) -> HeldPETSc:
        """Eliminate the held dofs and factor the rest."""
        return HeldPETSc(self, dof_set(dofs, self.n))

    def transform(self, T: Any, rigid: Array) -> "PETScOperators":
        """The same body in the coordinates a of u = T a."""
        T = csr_matrix(T)
        sizes = ((self.n_local, self.n), (rigid.shape[0], T.shape[1]))
        map_ = _aij(T, sizes, self.comm)
        return PETScOperators(self.K.ptap(map_), self.M.ptap(map_), rigid, map_)

    def expand(self, A: Array) -> Array:
        """T A."""
        return A if self.T is None else dense_rows(self.T, A)

    def plus_mass(self, dM: Any) -> "PETScOperators":
        """The same body with the mass M + dM."""
        sizes = ((self.n_local, self.n), (self.n_local, self.n))
        M = self.M.copy()
        M.axpy(1.0, _aij(csr_matrix(dM), sizes, self.comm))
        return PETScOperators(self.K, M, self.rigid, self.T)

    def modes(
        self, held: npt.ArrayLike | HeldPETSc, m: int, sigma: float | None = None
    ) -> tuple[Array, Array]:
        """Lowest m modes, mass-normalised: omega (m,) [rad/s] and Phi (n_local, m)."""
        if not isinstance(held, HeldPETSc):
            if np.size(held) == 0:
                return self._free_modes(m, sigma)
            held = self.hold(held)
        if not 0 <= m <= held.n_free:
            raise ConfigError(
                f"n_modes={m}, but {self.n} dofs minus {held.held.size} boundary dofs leave "
                f"{held.n_free} interior dofs; ask for 0 to {held.n_free} modes."
            )
        Phi = np.zeros((self.n_local, m))
        if m == 0:
            return np.zeros(0), Phi
        inner = PETScOperators(held.K, held.M)
        if held.n_free <= max(DENSE, m + SPARE):
            lam, Phi_i = inner.all_modes()
            lam, Phi_i = lam[:m], Phi_i[:, :m]
        else:
            lam, Phi_i = inner.lowest(m + SPARE, 0.0, held.factor, np.zeros((inner.n_local, 0)))
            inner.verify_count(lam, m, 0)
        Phi[held.mine] = Phi_i[:, :m]
        return np.sqrt(lam[:m]), self.signed(Phi)

    def _free_modes(self, m: int, sigma: float | None) -> tuple[Array, Array]:
        R = np.zeros((self.n_local, 0)) if self.rigid is None else orthonormal(self, self.rigid)
        n_rigid = R.shape[1]
        if not 0 <= m <= self.n:
            raise ConfigError(f"n_modes={m}, but the model has {self.n} dofs.")
        n_elastic = max(m - n_rigid, 0)
        lam, Phi = np.zeros(0), np.zeros((self.n_local, 0))
        if self.n <= max(DENSE, m + SPARE):
            lam, Phi = self.all_modes()
            lam, Phi = lam[n_rigid:][:n_elastic], Phi[:, n_rigid:][:, :n_elastic]
        elif n_elastic:
            sigma = -0.05 * self._first_elastic(R) if sigma is None else sigma
            check_factor_memory(self.n)
            shifted = self._shifted(sigma)
            lam, Phi = self.lowest(n_elastic + SPARE, sigma, Factor(shifted, definite=True), R)
            self._refuse_mechanisms(lam, n_rigid)
            self.verify_count(lam, n_elastic, n_rigid)
        omega = np.concatenate([np.zeros(n_rigid), np.sqrt(np.maximum(lam[:n_elastic], 0.0))])
        return omega[:m], np.hstack([R, self.signed(Phi[:, :n_elastic])])[:, :m]

    def _refuse_mechanisms(self, lam: Array, n_rigid: int) -> None:
        zeros = int(np.count_nonzero(np.abs(lam) < ZERO * self.largest()))
        if n_rigid and zeros:
            raise ModelError(
                f"at least {zeros} more motions without stiffness than the six of a connected body.",
                hint="Parts of the mesh are not connected, or joined at a point or an edge only.",
            )

    def _shifted(self, sigma: float) -> PETSc.Mat:
        """K - sigma M."""
        A = self.K.copy()
        A.axpy(-sigma, self.M, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        return A

    def lowest(self, k: int, sigma: float, factor: Factor, deflated: Array) -> tuple[Array, Array]:
        """The k eigenvalues nearest to sigma beside the deflated columns; Krylov-Schur."""
        k = min(k, self.n - deflated.shape[1])
        solver = SLEPc.EPS().create(self.comm)
        solver.setOperators(self.K, self.M)
        solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
        solver.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
        solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        solver.setTarget(sigma)
        solver.setDimensions(k, min(2 * k + 15, self.n - deflated.shape[1]))
        solver.setTolerances(1e-11, 500)
        transform = solver.getST()
        transform.setType(SLEPc.ST.Type.SINVERT)
        transform.setShift(sigma)
        transform.setKSP(factor.ksp)
        start = self.K.createVecRight()
        start.array[:] = np.sin(1.0 + np.arange(self.first, self.first + self.n_local))
        solver.setInitialSpace([start])
        if deflated.shape[1]:
            solver.setDeflationSpace([self._vector(column) for column in deflated.T])
        solver.solve()
        return self._pairs(solver, k)

    def _vector(self, values: Array) -> PETSc.Vec:
        x = self.K.createVecRight()
        x.array[:] = values
        return x

    def _pairs(self, solver: SLEPc.EPS, k: int) -> tuple[Array, Array]:
        n_found = solver.getConverged()
        if n_found < k:
            raise SolverError(
                f"only {n_found} of {k} modes converged (reason {solver.getConvergedReason()}).",
                hint="Ask for fewer modes, or check the mesh for cells of extreme shape.",
            )
        lam = np.array([solver.getEigenvalue(i).real for i in range(n_found)])
        x, Phi = self.K.createVecRight(), np.zeros((self.n_local, n_found))
        for i in range(n_found):
            solver.getEigenvector(i, x)
            Phi[:, i] = x.array
        order = np.argsort(lam)[:k]
        Phi = Phi[:, order]
        return lam[order], Phi / np.sqrt(np.diag(self.gram(Phi, self.apply_M(Phi))))

    def verify_count(self, lam: Array, m: int, n_rigid: int) -> None:
        """Compare the number of modes found with the inertia of K - sigma M (Sylvester)."""
        found, sigma = count_shift(lam, m)
        count = Factor(self._shifted(sigma), definite=False).negative_pivots() - n_rigid
        if count != found:
            raise ModesMissedError(
                f"{found} modes were found below {np.sqrt(sigma) / (2 * np.pi):.6g} Hz, "
                f"but the inertia of K - sigma M counts {count}.",
                hint="Ask for more modes, or give another shift sigma.",
            )

    def all_modes(self) -> tuple[Array, Array]:
        """All eigenpairs of a small model, solved densely on every rank."""
        E = np.eye(self.n)[self.first : self.first + self.n_local]
        K, M = (self.rows(apply(E), np.arange(self.n)) for apply in (self.apply_K, self.apply_M))
        lam, Phi = eigh(K, M)
        return lam, Phi[self.first : self.first + self.n_local]

    def _first_elastic(self, R: Array) -> float:
        """Estimate of the first elastic eigenvalue by inverse iteration on a small block."""
        floor = ZERO * self.largest()
        factor = Factor(self._shifted(-1e-6 * self.largest()), definite=True)
        rows = np.arange(self.first, self.first + self.n_local)
        X = np.sin(np.outer(1.0 + rows, 1.0 + np.arange(8.0)))
        for _ in range(4):
            X = factor.solve(self.apply_M(X - R @ self.gram(R, self.apply_M(X))))
            L = np.linalg.cholesky(self.gram(X, X))
            X = np.linalg.solve(L, X.T).T
        X -= R @ self.gram(R, self.apply_M(X))
        lam = eigh(self.gram(X, self.apply_K(X)), self.gram(X, self.apply_M(X)), eigvals_only=True)
        return float(max(lam[np.argmax(lam > floor)], floor))

    def signed(self, Phi: Array) -> Array:
        """Columns turned so that their largest entry, over all ranks, is positive."""
        if self.comm.size == 1:
            return canonical_signs(Phi)
        largest, smallest = Phi.max(axis=0, initial=0.0), Phi.min(axis=0, initial=0.0)
        largest = self.comm.allreduce(largest, op=MPI.MAX) if Phi.size else largest
        return Phi * np.where(largest >= -smallest, 1.0, -1.0)


def _submatrix(A: PETSc.Mat, free: PETSc.IS) -> PETSc.Mat:
    return A.createSubMatrix(free, free)


def _aij(A: csr_matrix, sizes: Any, comm: MPI.Comm) -> PETSc.Mat:
    index = PETSc.IntType
    csr = (A.indptr.astype(index), A.indices.astype(index), A.data)
    matrix = PETSc.Mat().createAIJ(size=sizes, csr=csr, comm=comm)
    matrix.assemble()
    return matrix


__all__ = ["BLOCK", "HeldPETSc", "PETScOperators", "dense"]
