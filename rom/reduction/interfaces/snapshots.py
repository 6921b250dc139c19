"""Interface functions learnt from displacements that the surface has been seen to take."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from rom.arguments import Between, Count, finite, one_given, typed
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError
from rom.model import Array, Interface

RANK_RTOL = 1e-9  # singular value of round-off, of the size of the snapshots


@typed
@dataclass(frozen=True, slots=True, eq=False)
class Snapshots:
    """Rigid motions, and the proper orthogonal modes of given displacements of the surface.

    What the six rigid motions leave of the snapshots is split by a singular value decomposition
    in the inner product of the surface mass, so that the size of elements does not weigh. Unlike
    polynomials the functions know the loads the snapshots come from, and no others.

    Attributes:
        values: (3k, s) displacements of the surface [m], ``3*i + axis`` for its i-th node.
        energy: share [1] of the squared displacement beyond rigid motion that is kept.
        n: alternatively, number of functions, the six rigid motions among them.

    Raises:
        ConfigError: for values of another shape, or unless one of energy and n is given.

    Source:
        Sirovich, Turbulence and the dynamics of coherent structures, Q. Appl. Math. 45 (1987) 561.
    """

    values: Any
    energy: Annotated[float, Between(0, 1, "(]")] | None = None
    n: Annotated[int, Count(6)] | None = None

    def __post_init__(self) -> None:
        X = finite("values", self.values, None)
        object.__setattr__(self, "values", X)
        if X.ndim != 2 or X.shape[0] % 3 or not X.size:
            text = f"snapshots of shape {X.shape} are not displacements of nodes, (3 k, s)"
            raise ConfigError(f"{text}; give one column per snapshot, x y z node by node.")
        if not X.any():
            raise ConfigError(f"all {X.shape[1]} snapshots are zero: one must show a motion.")
        one_given("Snapshots", energy=self.energy, n=self.n)

    def __repr__(self) -> str:
        """Size instead of numbers, for provenance and labels."""
        chosen = f"n={self.n}" if self.energy is None else f"energy={self.energy}"
        return f"Snapshots({self.values.shape[1]} of {self.values.shape[0]} dofs, {chosen})"


def snapshot_functions(kind: Snapshots, interface: Interface) -> Array:
    """(3k, m) functions with Q^T (S x I_3) Q = I, rigid motions first, then by falling energy."""
    if kind.values.shape[0] != interface.dofs.size:
        text = f"snapshots of {kind.values.shape[0]} dofs do not fit interface {interface.name!r}"
        raise ConfigError(f"{text} with {interface.dofs.size}; give all of them, in its order.")
    S = interface.surface_mass
    L = np.linalg.cholesky(S.toarray() if hasattr(S, "toarray") else np.asarray(S))
    x = interface.points - interface.points.mean(axis=0)
    motions = rigid_motions(x / (np.linalg.norm(x, axis=1).max() or 1.0))
    weighted = [_per_axis(L.T, A) for A in (motions, kind.values)]
    R = np.linalg.qr(weighted[0])[0]
    X = weighted[1] - R @ (R.T @ weighted[1])
    X = X - R @ (R.T @ X)
    U, sigma, _ = np.linalg.svd(X, full_matrices=False)
    rank = int(np.count_nonzero(sigma > RANK_RTOL * np.linalg.norm(weighted[1])))
    m = _number(kind, sigma[:rank], interface.name)
    return _per_axis(np.linalg.inv(L.T), np.hstack([R, U[:, :m]]))


def _number(kind: Snapshots, sigma: Array, name: str) -> int:
    """How many functions beyond the rigid motions."""
    if kind.n is None:
        share = np.cumsum(sigma**2) / max((sigma**2).sum(), 1e-300)
        return min(int(np.searchsorted(share, kind.energy * (1 - 1e-14))) + 1, sigma.size)
    if kind.n > 6 + sigma.size:
        text = f"n = {kind.n}, but the {kind.values.shape[1]} snapshots of interface {name!r} hold"
        there = f"{6 + sigma.size} independent functions with six rigid ones."
        raise ConfigError(f"{text} {there}", hint="Ask for fewer, or take more snapshots.")
    return kind.n - 6


def _per_axis(A: Array, X: Array) -> Array:
    """(A x I_3) X."""
    return (A @ X.reshape(A.shape[1], -1)).reshape(-1, X.shape[1])
