"""Solving without an exact factor: multigrid, conjugate gradients on top, modes by Davidson."""

from collections.abc import Callable
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

import numpy as np

from rom.errors import ModesMissedError, SolverError
from rom.fe.operators.factor import Factor, dense_rows
from rom.fe.operators.krylov_schur import mode_pairs, vector
from rom.model import Array

RESIDUAL_RTOL = 1e-12  # in the norm of the preconditioner
MAX_ITERATIONS = 400  # well posed elasticity takes 20 to 60, at any size
MODE_TOLERANCE = 1e-8  # residual over eigenvalue; the eigenvalue itself errs by its square
MODE_ITERATIONS = 20_000
MISSED_EIGENVALUE_RTOL = 1e-5  # distance below the last eigenvalue of one that was missed
MULTIGRID_OPTIONS = {
    "pc_type": "gamg",
    "pc_gamg_agg_nsmooths": 1,
    "pc_gamg_threshold": 0.02,  # drops weak couplings of stretched cells
    "mg_levels_ksp_type": "chebyshev",  # symmetric, as conjugate gradients need it
    "mg_levels_pc_type": "jacobi",
}


class ConjugateGradients:
    """A^-1 of a positive definite matrix, for many right-hand sides, by an approximate inverse.

    Args:
        A: the matrix.
        approximate: (n_local, k) -> (n_local, k), symmetric and positive definite.
        pc: the same as a PETSc preconditioner, for eigensolvers.

    Attributes:
        ok: True; an approximate inverse always exists.
    """

    ok = True

    def __init__(self, A: PETSc.Mat, approximate: Callable[[Array], Array], pc: PETSc.PC):
        self.A, self.approximate, self.pc = A, approximate, pc
        self.comm = A.comm.tompi4py()

    def solve(self, F: Array) -> Array:
        """A^-1 F for (n_local, k) right-hand sides; columns leave as they converge.

        Raises:
            SolverError: if a column does not converge.
        """
        X, R = np.zeros(F.shape), F.copy()
        Z = self.approximate(R)
        P, rz = Z.copy(), self._dots(R, Z)
        goal, left = RESIDUAL_RTOL**2 * rz, np.flatnonzero(rz > 0.0)
        for _ in range(MAX_ITERATIONS):
            if not left.size:
                return X
            AP = dense_rows(self.A, P[:, left])
            step = rz[left] / self._dots(P[:, left], AP)
            X[:, left] += step * P[:, left]
            R[:, left] -= step * AP
            Z = self.approximate(R[:, left])
            new = self._dots(R[:, left], Z)
            P[:, left] = Z + new / rz[left] * P[:, left]
            rz[left] = new
            left = left[new > goal[left]]
        raise SolverError(
            f"{left.size} of {F.shape[1]} static solutions did not converge in {MAX_ITERATIONS} "
            f"iterations (residual {np.sqrt((rz / goal).max()) * RESIDUAL_RTOL:.1e}).",
            hint='Use solver="direct" if the factor fits, or improve cells of extreme shape.',
        )

    def release(self) -> None:
        """Give the memory of the preconditioner back."""
        self.pc.destroy()

    def _dots(self, X: Array, Y: Array) -> Array:
        return self.comm.allreduce(np.einsum("ij,ij->j", X, Y), op=MPI.SUM)


Inverse = Factor | ConjugateGradients


def multigrid(A: PETSc.Mat, near_null: Array) -> ConjugateGradients:
    """Conjugate gradients preconditioned by smoothed aggregation.

    Args:
        A: positive definite.
        near_null: (n_local, 6) rigid motions on the rows of A: what coarse levels must represent.

    Source:
        Vanek, Mandel and Brezina, Computing 56 (1996) 179, as implemented in PETSc.
    """
    A.setOption(PETSc.Mat.Option.SPD, True)
    columns = [vector(A, column) for column in _orthonormal(A, near_null).T]
    A.setNearNullSpace(PETSc.NullSpace().create(vectors=columns, comm=A.comm))
    pc = PETSc.PC().create(A.comm)
    pc.setOperators(A)
    options, prefix = PETSc.Options(), "rom_multigrid_"
    for key, value in MULTIGRID_OPTIONS.items():
        options[prefix + key] = value
    pc.setOptionsPrefix(prefix)
    pc.setFromOptions()
    pc.setUp()
    x, y = A.createVecs()

    def cycle(F: Array) -> Array:
        Z = np.empty(F.shape)
        for k, f in enumerate(F.T):
            x.array[:] = f
            pc.apply(x, y)
            Z[:, k] = y.array
        return Z

    return ConjugateGradients(A, cycle, pc)


def refined(factor: Factor) -> ConjugateGradients:
    """Conjugate gradients that make good what a compressed factor has dropped."""
    return ConjugateGradients(factor.A, factor.solve, factor.ksp.getPC())


def davidson(ops: Any, inverse: ConjugateGradients, deflated: Array, k: int) -> tuple[Array, Array]:
    """The k lowest eigenvalues, ascending, and their mass-normalised modes, without a factor.

    Nothing counts eigenvalues here; a second search beside the modes found looks for missed ones.

    Args:
        ops: operators of the body.
        inverse: an approximate inverse of K, or of K with a small positive shift.
        deflated: (n_local, d) M-orthonormal modes to leave out.
        k: number of modes sought.

    Raises:
        SolverError: if they do not converge.
        ModesMissedError: if the second search finds a lower one.

    Source:
        Morgan and Scott, Generalizations of Davidson's method, SIAM J. Sci. Stat. Comput. 7 (1986)
        817, as implemented in SLEPc.
    """
    lam, Phi = _davidson(ops, inverse, deflated, k, MODE_TOLERANCE)
    beside, _ = _davidson(ops, inverse, np.hstack([deflated, Phi]), 1, 1e-2)
    if beside[0] < (1.0 - MISSED_EIGENVALUE_RTOL) * lam[-1]:
        raise ModesMissedError(
            f"a mode near {np.sqrt(beside[0]) / (2 * np.pi):.6g} Hz was missed below the last one "
            f"found at {np.sqrt(lam[-1]) / (2 * np.pi):.6g} Hz.",
            hint='Ask for one mode more, or use solver="direct".',
        )
    return lam, Phi


def _davidson(
    ops: Any, inverse: ConjugateGradients, deflated: Array, k: int, tolerance: float
) -> tuple[Array, Array]:
    solver = SLEPc.EPS().create(ops.comm)
    solver.setOperators(ops.K, ops.M)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setType(SLEPc.EPS.Type.GD)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.SMALLEST_REAL)
    solver.setDimensions(k, max(3 * k, k + 30))
    solver.setTolerances(tolerance, MODE_ITERATIONS)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.PRECOND)
    transform.getKSP().setType(PETSc.KSP.Type.PREONLY)
    transform.getKSP().setPC(inverse.pc)
    start = inverse.approximate(ops.apply_M(ops.fixed[:, None]))[:, 0]
    solver.setInitialSpace([vector(ops.K, start)])
    if deflated.shape[1]:
        solver.setDeflationSpace([vector(ops.K, column) for column in deflated.T])
    solver.solve()
    found = mode_pairs(ops, solver, k)
    # SLEPc 3.25 empties the preconditioner it holds when it goes; this one is still needed
    transform.getKSP().setPC(PETSc.PC().create(ops.comm))
    return found


def _orthonormal(A: PETSc.Mat, X: Array) -> Array:
    gram = A.comm.tompi4py().allreduce(X.T @ X, op=MPI.SUM)
    lam, V = np.linalg.eigh(gram)
    return X @ (V / np.sqrt(lam))
