"""Lowest modes by SLEPc, the shift with which they are sought, and one sign on all ranks.

Krylov-Schur, shift-invert with a MUMPS factor at hand.
"""

from typing import Any

from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

import numpy as np
from scipy.linalg import eigh

from rom.eigen.search import ESTIMATE_SHIFT, estimated_by_iteration, refined
from rom.errors import SolverError
from rom.fe.operators.factor import Corrected, Factor
from rom.fe.operators.substructures.shared import SubstructuredFactor
from rom.model import Array
from rom.process.stopwatch import SEARCH_PIECE, piece

EIGENVALUE_RTOL = 1e-11  # SLEPc's residual, of the eigenvalue
QUOTIENT_RTOL = 1e-6  # of a Rayleigh quotient's distance from the shift: what an error leaves
MAX_RESTARTS = 500
Inverse = Factor | SubstructuredFactor | Corrected
EQUAL_ENTRY_RTOL = 1e-6  # difference of entries that count as equally large
DIRECTIONS = np.array([[3.1, 1.7, 2.3], [1.3, 3.7, 1.9], [2.1, 1.1, 3.3]])  # no symmetry


def fixed_vector(comm: MPI.Comm, rigid: Array | None, first: int, n_local: int) -> Array:
    """(n_local,) vector that depends on the place of a dof and not on its number.

    A smooth field without symmetry, so that no mode of a symmetric body is orthogonal to it.
    Without geometry it depends on the number.
    """
    if rigid is None:
        return np.sin(1.0 + np.arange(first, first + n_local))
    points = points_of(rigid)
    low, high = _box(comm, points)
    size = (high - low).max()
    return np.sin((points - low) / size @ DIRECTIONS + np.arange(1.0, 4.0)).ravel()


def points_of(rigid: Array) -> Array:
    """(n_local/3, 3) coordinates of the nodes whose rigid motions are given [m]."""
    x, y, z = rigid[1::3, 5], rigid[2::3, 3], rigid[0::3, 4]
    return np.column_stack([x, y, z])


def _box(comm: MPI.Comm, points: Array) -> tuple[Array, Array]:
    """Lowest and highest coordinates of all ranks."""
    low, high = points.min(axis=0, initial=np.inf), points.max(axis=0, initial=-np.inf)
    comm.Allreduce(MPI.IN_PLACE, low, MPI.MIN)
    comm.Allreduce(MPI.IN_PLACE, high, MPI.MAX)
    return low, high


def polynomial_fields(comm: MPI.Comm, rigid: Array) -> Array:
    """(n_local, 60) displacements that are polynomials of degree up to three in the coordinates."""
    x = points_of(rigid)
    low, high = _box(comm, x)
    x = 2.0 * (x - low) / np.maximum(high - low, 1e-9 * (high - low).max()) - 1.0
    powers = [np.polynomial.legendre.legvander(column, 3).T for column in x.T]
    scalar = [
        powers[0][i] * powers[1][j] * powers[2][k]
        for i in range(4)
        for j in range(4 - i)
        for k in range(4 - i - j)
    ]
    return np.kron(np.array(scalar).T, np.eye(3))


def first_elastic(ops: Any, R: Array | None = None) -> float:
    """First elastic eigenvalue, for a shift: an upper bound, or without geometry its magnitude."""
    if ops.parent is not None:
        return first_elastic(ops.parent)
    return _by_polynomials(ops) if ops.geometric else _by_inverse_iteration(ops)


def _by_polynomials(ops: Any) -> float:
    """Upper bound of the first elastic eigenvalue: Rayleigh and Ritz with polynomial fields."""
    X = polynomial_fields(ops.comm, ops.rigid)
    K, M = ops.gram(X, ops.apply_K(X)), ops.gram(X, ops.apply_M(X))
    lam, U = eigh(M)
    kept = lam > 1e-10 * lam[-1]  # few nodes cannot tell all polynomials apart
    U = U[:, kept] / np.sqrt(lam[kept])
    lam = eigh(U.T @ K @ U, eigvals_only=True)
    return float(lam[min(6, lam.size - 1)])


def _by_inverse_iteration(ops: Any) -> float:
    """Smallest eigenvalue that is not zero, estimated without geometry."""
    shifted = ops.shifted(-ESTIMATE_SHIFT * ops.largest())
    factor = Factor(shifted, definite=True, solver=ops.solver)
    found = estimated_by_iteration(ops, factor, np.zeros((ops.n_local, 0)))
    factor.release()
    return found


def signed(ops: Any, Phi: Array) -> Array:
    """Columns turned so that their largest entry, over all ranks, is positive.

    Among equally large entries the place decides, not the numbering.
    """
    size = np.abs(Phi)
    largest = size.max(axis=0, initial=0.0)
    ops.comm.Allreduce(MPI.IN_PLACE, largest, MPI.MAX)
    if Phi.shape[0]:
        key = np.where(size >= (1 - EQUAL_ENTRY_RTOL) * largest, ops.fixed[:, None], -np.inf)
        row = key.argmax(axis=0)
        best = np.vstack([np.take_along_axis(a, row[None], axis=0) for a in (key, Phi)])
    else:
        best = np.full((2, Phi.shape[1]), -np.inf)
    best = np.array(ops.comm.allgather(best))
    chosen = best[:, 0].argmax(axis=0)
    return Phi * np.where(best[chosen, 1, np.arange(Phi.shape[1])] < 0, -1.0, 1.0)


def krylov_schur(
    ops: Any, factor: Inverse, sigma: float, deflated: Array, k: int
) -> tuple[Array, Array]:
    """The k eigenvalues next to the shift, ascending, and their mass-normalised modes.

    The shift lies below all eigenvalues sought, the factor is of K - sigma M, and M-orthonormal
    modes, ``deflated`` (n_local, d), are left out.

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


def factor_at_hand(factor: Inverse) -> PETSc.KSP:
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

    def __init__(self, factor: Inverse):
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

    With a factor that is round-off a space looks converged and is not: Rayleigh quotients differ.
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
