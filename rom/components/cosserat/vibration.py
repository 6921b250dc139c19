"""Small vibrations of a rod about a shape at rest or in steady rotation.

Source:
    See docs/theory/rods.md.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import cholesky, eigh, solve_triangular
from scipy.sparse import block_diag, csc_matrix
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from rom import rotation
from rom.arguments import whole
from rom.components.cosserat.energy import Rod
from rom.components.cosserat.shapes import Shape
from rom.components.cosserat.statics import clamped, linearised
from rom.errors import SolverError
from rom.model import Array, Modes


@dataclass(frozen=True)
class Vibrations(Modes):
    """Modes of a rod, lowest first.

    Attributes:
        omega: (n,) circular frequencies [rad/s].
        shapes: (6 N + 9, n) increments, complex in rotation; order of `statics.clamped`.
    """


def lumped_mass(rod: Rod) -> Array:
    """(6 N + 9,) diagonal of the mass matrix, section axes for rotations [kg], [kg m^2]."""
    M = np.zeros((len(rod.p), 6))
    M[:, :3], M[:-1, 3:] = rod.inertia, rod.mass[:, None]
    return M.ravel()[:-3]


def gyroscopic(rod: Rod, shape: Shape, spin: npt.ArrayLike) -> csc_matrix:
    """(n, n) matrix of the forces that velocities meet in a rotating frame; it is skew."""
    spin = np.asarray(spin, dtype=float)
    G = np.zeros((len(rod.p), 6, 6))
    for k, (J, p) in enumerate(zip(rod.inertia, shape.p, strict=True)):
        w = rotation.matrix(p).T @ spin
        W = rotation.skew(w)
        G[k, :3, :3] = J[:, None] * W + W * J - rotation.skew(J * w)
    G[:-1, 3:, 3:] = 2 * rod.mass[:, None, None] * rotation.skew(spin)
    n = 6 * rod.h.size + 9
    return block_diag(G, format="csc")[:n, :n]


def modes(
    rod: Rod,
    shape: Shape,
    n: int,
    *,
    load: tuple[Array, Array] | None = None,
    free: npt.ArrayLike | None = None,
    spin: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> Vibrations:
    """The n lowest modes of vibration, without damping.

    Args:
        rod: the rod.
        shape: an equilibrium, see `statics.equilibrium`.
        n: number of modes.
        load: the dead loads of that equilibrium, see `loads`.
        free: (6 N + 9,) which dofs may move [1]; without it the plate at the start is held.
        spin: (3,) angular velocity of the axes in which the shape rests [rad/s].

    Raises:
        ConfigError: for a number of modes that the rod cannot have.
        SolverError: if the shape is not stable, or the modes of a rotating rod were not found.
    """
    free = clamped(rod) if free is None else np.asarray(free, dtype=bool)
    whole("n", n, 1, int(free.sum()))
    K = linearised(rod, shape, load, spin)[1][np.ix_(free, free)]
    K, M = (K + K.T) / 2, lumped_mass(rod)[free]
    if np.any(spin):
        G = gyroscopic(rod, shape, spin)[free][:, free]
        omega, part = _rotating(K, M, G, n)
    else:
        omega, part = _resting(K, M, n)
    Phi = np.zeros((free.size, n), dtype=part.dtype)
    Phi[free] = part
    return Vibrations(omega, Phi)


def _resting(K: Array, M: Array, m: int) -> tuple[Array, Array]:
    """Modes without spin, from M q = K q / omega^2: dofs without mass do no harm there."""
    n = len(K)
    try:
        flexible, Phi = eigh(np.diag(M), K, subset_by_index=(n - m, n - 1))
    except np.linalg.LinAlgError:
        raise SolverError("the shape is not stable; hold it, or find one that lasts.") from None
    omega = 1 / np.sqrt(flexible[::-1])
    return omega, Phi[:, ::-1] * omega


def _rotating(K: Array, M: Array, G: csc_matrix, m: int) -> tuple[Array, Array]:
    """Modes from M a + G v + K q = 0 by Lanczos' method on the inverse, which is Hermitian.

    With K = L L^T and y = (sqrt(M) v, L^T q) the inverse is skew; i times it has 1 / omega.
    """
    try:
        L = cholesky(K, lower=True)
    except np.linalg.LinAlgError:
        raise SolverError("the rotating shape is not stable.", hint="Lower the speed.") from None
    n, root = len(M), np.sqrt(M)
    X = root[:, None] * solve_triangular(L, np.eye(n), lower=True).T
    Y = solve_triangular(L, solve_triangular(L, G.toarray(), lower=True).T, lower=True).T

    def inverse(y: Array) -> Array:
        first, second = y[:n], y[n:]
        return 1j * np.concatenate([X @ second, -X.T @ first - Y @ second])

    operator = LinearOperator((2 * n, 2 * n), matvec=inverse, dtype=complex)
    start = np.sin(1.0 + np.arange(2 * n)).astype(complex)
    try:
        values, vectors = eigsh(operator, k=m, which="LA", v0=start, ncv=4 * m + 20)
    except ArpackError as error:
        raise SolverError(f"the modes of a rotating rod were not found: {error}.") from error
    order = np.argsort(-values)
    q = solve_triangular(L.T, vectors[n:, order])
    return 1 / values[order], q
