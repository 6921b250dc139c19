"""What makes modes the same for any number of ranks, and the shift with which they are sought."""

from itertools import pairwise
from typing import Any

from mpi4py import MPI

import numpy as np
from scipy.linalg import eigh

from rom.fe.operators.factor import Factor
from rom.fe.operators.held import RIGID_RTOL
from rom.model import Array

CLUSTER_RTOL = 1e-7  # distance of eigenvalues whose modes are only defined as a plane
EQUAL_ENTRY_RTOL = 1e-6  # difference of entries that count as equally large
PLACE_SCALE = 2.0**40  # places that differ by less are one
COUNTER_STEP = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio: steps of the counter
MIXING_STEPS = (  # Steele, Lea and Flood, OOPSLA 2014, with the constants of Stafford
    (np.uint64(30), np.uint64(0xBF58476D1CE4E5B9)),
    (np.uint64(27), np.uint64(0x94D049BB133111EB)),
)
DIRECTIONS = np.array([[3.1, 1.7, 2.3], [1.3, 3.7, 1.9], [2.1, 1.1, 3.3]])  # no symmetry


def fixed_vector(comm: MPI.Comm, rigid: Array | None, first: int, n_local: int) -> Array:
    """(n_local,) vector that depends on the place of a dof and not on its number.

    A smooth field without symmetry, so that no mode of a symmetric body is orthogonal to it.
    Without geometry it depends on the number.
    """
    if rigid is None:
        return np.sin(1.0 + np.arange(first, first + n_local))
    points = points_of(rigid)
    low = comm.allreduce(points.min(axis=0, initial=np.inf), op=MINIMUM_OP)
    high = comm.allreduce(points.max(axis=0, initial=-np.inf), op=MAXIMUM_OP)
    size = (high - low).max()
    return np.sin((points - low) / size @ DIRECTIONS + np.arange(1.0, 4.0)).ravel()


def gaussian_block(ops: Any, k: int, n_before: int = 0) -> Array:
    """(n_local, k) Gaussian columns with components of about one in all modes.

    The numbers depend on the place of a dof, mixed beyond recognition, and not on its rank. Blocks
    are independent when each is given how many columns were drawn before it.
    """
    key = np.round(ops.fixed * PLACE_SCALE).astype(np.int64).view(np.uint64)
    numbers = np.arange(1 + 2 * n_before, 1 + 2 * (n_before + k), dtype=np.uint64)
    counter = key[:, None] + COUNTER_STEP * numbers
    u = (_mixed(counter) >> np.uint64(11)).astype(float) * 2.0**-53 + 2.0**-54
    normal = np.sqrt(-2.0 * np.log(u[:, :k])) * np.cos(2.0 * np.pi * u[:, k:])  # Box and Muller
    return normal / np.sqrt(np.maximum(ops.mass_diagonal, np.finfo(float).tiny))[:, None]


def _mixed(x: Any) -> Any:
    """64 bits of which each depends on all those given: the finaliser of SplitMix64."""
    for shift, factor in MIXING_STEPS:
        x = (x ^ (x >> shift)) * factor
    return x ^ (x >> np.uint64(31))


def points_of(rigid: Array) -> Array:
    """(n_local/3, 3) coordinates of the nodes whose rigid motions are given [m]."""
    x, y, z = rigid[1::3, 5], rigid[2::3, 3], rigid[0::3, 4]
    return np.column_stack([x, y, z])


def _elementwise(function: Any) -> MPI.Op:
    return MPI.Op.Create(lambda a, b, _: function(a, b), commute=True)


MINIMUM_OP, MAXIMUM_OP = _elementwise(np.minimum), _elementwise(np.maximum)


def polynomial_fields(comm: MPI.Comm, rigid: Array) -> Array:
    """(n_local, 60) displacements that are polynomials of degree up to three in the coordinates."""
    x = points_of(rigid)
    low = comm.allreduce(x.min(axis=0, initial=np.inf), op=MINIMUM_OP)
    high = comm.allreduce(x.max(axis=0, initial=-np.inf), op=MAXIMUM_OP)
    x = 2.0 * (x - low) / np.maximum(high - low, 1e-9 * (high - low).max()) - 1.0
    powers = [np.polynomial.legendre.legvander(column, 3).T for column in x.T]
    scalar = [
        powers[0][i] * powers[1][j] * powers[2][k]
        for i in range(4)
        for j in range(4 - i)
        for k in range(4 - i - j)
    ]
    return np.kron(np.array(scalar).T, np.eye(3))


def first_elastic(ops: Any) -> float:
    """Estimate of the first elastic eigenvalue, for the choice of a shift.

    With geometry, an upper bound; new coordinates leave its order of magnitude.
    """
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
    floor = RIGID_RTOL * ops.largest()
    factor = Factor(ops.shifted(-1e-6 * ops.largest()), definite=True, solver=ops.solver)
    X = ops.fixed[:, None] ** np.arange(1.0, 9.0)
    for _ in range(4):
        X = factor.solve(ops.apply_M(X))
        X = np.linalg.solve(np.linalg.cholesky(ops.gram(X, X)), X.T).T
    lam = eigh(ops.gram(X, ops.apply_K(X)), ops.gram(X, ops.apply_M(X)), eigvals_only=True)
    return float(max(lam[np.argmax(lam > floor)], floor))


def settled(ops: Any, lam: Array, Phi: Array) -> Array:
    """Modes with equal frequencies turned within their plane to the same place on any machine.

    Args:
        ops: the operators the modes belong to.
        lam: (m,) ascending eigenvalues.
        Phi: (n_local, m) mass-normalised modes.
    """
    Phi = Phi.copy()
    apart = np.diff(lam) > CLUSTER_RTOL * np.abs(lam[1:])
    edges = np.concatenate([[0], np.flatnonzero(apart) + 1, [lam.size]])
    for start, end in pairwise(edges):
        if end - start > 1:
            probes = ops.fixed[:, None] ** np.arange(1, end - start + 1)
            Q, _ = np.linalg.qr(ops.gram(Phi[:, start:end], probes))
            Phi[:, start:end] = Phi[:, start:end] @ Q
    return Phi


def signed(ops: Any, Phi: Array) -> Array:
    """Columns turned so that their largest entry, over all ranks, is positive.

    Among equally large entries the place decides, not the numbering.
    """
    size = np.abs(Phi)
    largest = ops.comm.allreduce(size.max(axis=0, initial=0.0), op=MAXIMUM_OP)
    if Phi.shape[0]:
        key = np.where(size >= (1 - EQUAL_ENTRY_RTOL) * largest, ops.fixed[:, None], -np.inf)
        row = key.argmax(axis=0)
        best = np.vstack([np.take_along_axis(a, row[None], axis=0) for a in (key, Phi)])
    else:
        best = np.full((2, Phi.shape[1]), -np.inf)
    best = np.array(ops.comm.allgather(best))
    chosen = best[:, 0].argmax(axis=0)
    return Phi * np.where(best[chosen, 1, np.arange(Phi.shape[1])] < 0, -1.0, 1.0)
