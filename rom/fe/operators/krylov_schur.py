"""Lowest modes by SLEPc: Krylov-Schur, shift-invert with a MUMPS factor at hand."""

from typing import Any

from petsc4py import PETSc
from slepc4py import SLEPc

import numpy as np

from rom.eigen.search import refined
from rom.errors import SolverError
from rom.fe.operators.factor import Corrected, Factor
from rom.fe.operators.substructures.shared import SubstructuredFactor
from rom.model import Array
from rom.process.stopwatch import SEARCH_PIECE, piece

EIGENVALUE_RTOL = 1e-11  # SLEPc's residual, of the eigenvalue
QUOTIENT_RTOL = 1e-6  # of a Rayleigh quotient's distance from the shift: what an error leaves
MAX_RESTARTS = 500


def krylov_schur(
    ops: Any,
    factor: Factor | SubstructuredFactor | Corrected,
    sigma: float,
    deflated: Array,
    k: int,
) -> tuple[Array, Array]:
    """The k eigenvalues next to the shift, ascending, and their mass-normalised modes.

    Args:
        ops: operators of the body.
        factor: of K - sigma M.
        sigma: the shift, below all eigenvalues sought.
        deflated: (n_local, d) M-orthonormal modes to leave out.
        k: number of modes sought.

    Raises:
        SolverError: if they do not converge.

    Source:
        Stewart, A Krylov-Schur algorithm for large eigenproblems, SIAM J. Matrix Anal. Appl. 23
        (2002) 601, as implemented in SLEPc.
    """
    k = min(k, ops.n - deflated.shape[1])
    solver = SLEPc.EPS().create(ops.comm)
    solver.setOperators(ops.K, ops.M)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTarget(sigma)
    solver.setDimensions(k, min(2 * k + 15, ops.n - deflated.shape[1]))
    solver.setTolerances(EIGENVALUE_RTOL, MAX_RESTARTS)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    transform.setShift(sigma)
    transform.setKSP(factor_at_hand(factor))
    solver.setInitialSpace([vector(ops.K, ops.fixed)])  # depends on the place, not on the rank
    if deflated.shape[1]:
        solver.setDeflationSpace([vector(ops.K, column) for column in deflated.T])
    with piece(SEARCH_PIECE):
        solver.solve()
    pairs = mode_pairs(ops, solver, k, sigma)
    solver.destroy()  # it refers to the factor, which could not be freed
    return pairs


def factor_at_hand(factor: Factor | SubstructuredFactor | Corrected) -> PETSc.KSP:
    """A solver that applies a factor; given the factor's own, SLEPc would factor K - sigma M again.

    The second factor would cost as much as the first, and its work space would be what MUMPS
    predicts, without what `Factor` offers when that is too small.
    """
    ksp = PETSc.KSP().create(factor.A.comm)
    ksp.setType(PETSc.KSP.Type.PREONLY)
    ksp.getPC().setType(PETSc.PC.Type.PYTHON)
    ksp.getPC().setPythonContext(_Applied(factor))
    return ksp


class _Applied:
    """A factor as PETSc's preconditioner."""

    def __init__(self, factor: Factor | SubstructuredFactor | Corrected):
        self.factor = factor

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve A x = b."""
        self.factor.apply(b, x)


def vector(A: Any, values: Array) -> Any:
    """A PETSc vector with the layout of the columns of A."""
    x = A.createVecRight()
    x.array[:] = values
    return x


def mode_pairs(ops: Any, solver: SLEPc.EPS, k: int, sigma: float) -> tuple[Array, Array]:
    """The k lowest eigenvalues a solver has found, and their mass-normalised modes.

    Raises:
        SolverError: if there are less, or the modes have other Rayleigh quotients: with a factor
            that is round-off a space looks converged and is not.
    """
    n_found = solver.getConverged()
    if n_found < k:
        raise SolverError(
            f"only {n_found} of {k} modes converged (reason {solver.getConvergedReason()}).",
            hint="Ask for fewer modes, or check the mesh for cells of extreme shape.",
        )
    lam = np.array([solver.getEigenvalue(i).real for i in range(n_found)])
    x, Phi = ops.K.createVecRight(), np.zeros((ops.n_local, n_found))
    for i in range(n_found):
        solver.getEigenvector(i, x)
        Phi[:, i] = x.array
    order = np.argsort(lam)[:k]
    lam, Phi = lam[order], Phi[:, order]
    Phi = Phi / np.sqrt(np.diag(ops.gram(Phi, ops.apply_M(Phi))))
    exact = refined(ops, lam, Phi)
    worst = (np.abs(exact - lam) / np.abs(exact - sigma)).max()
    if worst > QUOTIENT_RTOL:
        raise SolverError(
            f"modes that look converged differ from their Rayleigh quotients by {worst:.1e}.",
            hint="Stiffness or mass may span more than thirteen digits; hold the body, or name "
            "another shift sigma.",
        )
    order = np.argsort(exact, kind="stable")
    return exact[order], Phi[:, order]
