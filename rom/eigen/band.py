"""All modes up to a frequency, counted, with strict bounds of their errors."""

from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import issparse

from rom.arguments import between, positive
from rom.eigen.held import HeldBody
from rom.eigen.lanczos import capacity
from rom.eigen.scipy import SciPyOperators, SymmetricLU
from rom.eigen.search import dof_set, missed
from rom.eigen.verbs import Matrix, column_blocks
from rom.errors import ModelError, ParallelError, SolverError
from rom.model import Array, Modes
from rom.process.memory import check_memory, free_bytes

COUNT_RATIO = 1.0137  # where eigenvalues are counted, over the last one asked for
ROUND_OFF = 1e-13  # of the last eigenvalue: what sums over the dofs leave uncertain
STIFF_ROUND_OFF = 1e-15  # of the largest eigenvalue of the mesh, likewise in solutions


def substructured_modes(
    K: Matrix, M: Matrix, f_max: float, *, rigid: Array | None = None, tol: float = 1e-3
) -> Modes:
    """All modes up to a frequency, of plain matrices.

    A count by inertia proves that none is missed, and makes the bounds of Lehmann for their errors
    strict. The name is that of a search by substructures, which was no faster than Lanczos.

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
        Lehmann, Optimale Eigenwerteinschliessungen, Numer. Math. 5 (1963) 246.

    Example:
        >>> K = np.diag(np.full(9, 2.0)) - np.eye(9, k=1) - np.eye(9, k=-1)  # held chain
        >>> found = rom.eigen.substructured_modes(K, np.eye(9), f_max=0.1)
        >>> np.round(found.omega, 6)  # 2 sin(k pi / 20)
        array([0.312869, 0.618034])
    """
    return modes_up_to(SciPyOperators(K, M, rigid), (), f_max, tol)


def modes_up_to(ops: Any, held: Any, f_max: float, tol: float) -> Modes:
    """`substructured_modes` of operators in one process, some dofs held or what `hold` returned."""
    between("tol", tol, 0, 1, "()")
    last = (2 * np.pi * positive("f_max", f_max)) ** 2
    if ops.n_local != ops.n:
        text = "modes up to a frequency are computed in one process"
        raise ParallelError(f"{text}; ask for a number of modes, or run without mpirun.")
    made = isinstance(held, HeldBody)
    support: Any = held if made else dof_set(held, ops.n)
    still = 0 if made or support.size or ops.rigid is None else ops.rigid.shape[1]
    support = support if made or still else ops.hold(support)
    body, mine = (ops, slice(None)) if still else (support.inner, support.mine)
    rho = COUNT_RATIO * last
    n_below = body.count_below(rho)
    if n_below is None:  # an iterative solver has no factor
        K, M = (ops.gathered(A) for A in (ops.K, ops.M))
        held = () if still else support.held
        return modes_up_to(SciPyOperators(K, M, ops.rigid), held, f_max, tol)
    need, there = 8.0 * body.n * (2 * capacity(n_below) + 3 * n_below), free_bytes()
    hint = "Ask for modes up to a lower frequency, or use a coarser mesh."
    check_memory(f"finding {n_below} modes of {body.n} dofs", need, there, hint)
    omega, Phi = ops.modes(support, n_below, finished=not made)
    lam = omega[still:] ** 2
    n_found = still + int(np.count_nonzero(lam < rho))
    if n_found != n_below:
        raise missed(n_found, rho, n_below, "Change f_max a little.")
    lower = lehmann_bounds(lam, _residual(body, lam, Phi[mine, still:]), rho)
    lower -= ROUND_OFF * rho + STIFF_ROUND_OFF * body.largest()
    m = int(np.count_nonzero(lower <= last))
    error = 1.0 - np.sqrt(np.maximum(lower[:m], 0.0) / lam[:m])
    if (worst := error.max(initial=0.0)) > tol:
        text = f"the frequencies up to {f_max:g} Hz are known within {worst:.2g} only."
        raise SolverError(text, hint=f"Allow a larger error than tol = {tol:g}.")
    return Modes(omega[: still + m], Phi[:, : still + m], error=np.r_[np.zeros(still), error])


def _residual(body: Any, lam: Array, Phi: Array) -> Array:
    """(k, k) scalar products of K x - lambda M x in M^-1 [rad^4/s^4]."""
    try:
        mass = SymmetricLU(body.M if issparse(body.M) else body.gathered(body.M))
    except RuntimeError as error:
        text = "some motions have no mass, and bounds of frequencies need that of all"
        raise ModelError(f"{text}; ask for a number of modes.") from error
    R, MR = np.empty(Phi.shape), np.empty(Phi.shape)
    for some in column_blocks(lam.size):
        R[:, some] = body.apply_K(Phi[:, some]) - body.apply_M(Phi[:, some]) * lam[some]
        MR[:, some] = mass.solve(R[:, some])
    return R.T @ MR


def lehmann_bounds(theta: Array, residual: Array, rho: float) -> Array:
    """(m,) lower bounds of the eigenvalues below rho, of Lehmann; see `substructured_modes`.

    As many of the ascending Ritz values theta (k,) [rad^2/s^2] must lie below rho as eigenvalues;
    ``residual`` (k, k) has the scalar products of K x - theta M x in M^-1 [rad^4/s^4].
    """
    B = np.diag((theta - rho) ** 2) + residual
    tau = eigh(np.diag(theta - rho), 0.5 * (B + B.T), eigvals_only=True) if theta.size else theta
    return rho + 1.0 / tau[tau < 0][::-1]
