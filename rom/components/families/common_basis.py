"""One basis for a range of parameters: bases at several points, without what repeats.

All bases keep the interface coordinates, so that a shape of one point minus the constraint modes of
the first, moved as its interfaces are, leaves the interfaces at rest::

    Psi = [ Psi_b(p_0)  Phi(p_0)  Y ],   span Y of  Psi(p_s) - Psi_b(p_0) [Psi(p_s)]_b

The constraint modes of the first point contain the rigid motions, at every other point too.
"""

from dataclasses import dataclass

import numpy as np

from rom.eigen.verbs import Operators
from rom.errors import ConfigError
from rom.model import Array, Basis, Index

LAST_MODE_SHARE = 0.3  # part of the last normal mode, by size, that is too little to be kept
SHAPE_RTOL = 1e-7  # of a shape's own size: remainders below are round-off


@dataclass(frozen=True, slots=True)
class CommonBasis:
    """A basis that grows by the bases of further points.

    Attributes:
        ops: operators at the first point, in interface coordinates.
        basis: interface columns first.
        n_b: number of interface coordinates.
        weight: factor of M in the inner product K + weight M [rad^2/s^2].
        small: size of what is dropped, of the shape it belongs to; errors of frequencies are its
            square.
    """

    ops: Operators
    basis: Basis
    n_b: int
    weight: float
    small: float

    def joined(self, other: Basis, boundary: Index) -> "CommonBasis":
        """With what is new at another point.

        The error that a normal mode leaves falls with the square of its frequency, and the method
        stopped at the last one: of the others the more must be kept the lower they are.

        Args:
            other: basis there, in the same interface coordinates.
            boundary: (n_b,) dof numbers of the interface coordinates.
        """
        weight = np.ones(other.Psi.shape[1])
        if other.omega.size:
            falling = self.small / LAST_MODE_SHARE * (other.omega[-1] / other.omega) ** 2
            weight[-other.omega.size :] = np.minimum(falling, 1.0)
        return self.with_shapes(other.Psi * weight, boundary, max(self.small, SHAPE_RTOL), weight)

    def with_shapes(
        self, shapes: Array, boundary: Index, small: float = SHAPE_RTOL, weight: Array | float = 1.0
    ) -> "CommonBasis":
        """With what is new in some shapes.

        Args:
            shapes: (n_local, k) in the same interface coordinates.
            boundary: (n_b,) dof numbers of the interface coordinates.
            small: size of what is dropped, of a shape of weight one.
            weight: (k,) of the shapes.
        """
        ops, Psi = self.ops, self.basis.Psi
        inner = self._orthonormal(Psi[:, self.n_b :], 0.0)
        size = np.sqrt(np.diag(self._product(shapes, shapes))) / weight
        X = (shapes - Psi[:, : self.n_b] @ ops.rows(shapes, boundary)) / size
        for _ in range(2):
            X = X - inner @ self._product(inner, X)
        Y = self._orthonormal(X, small)
        first = Psi.shape[1] - self.n_b
        labels = tuple(f"sampled {first + k + 1}" for k in range(Y.shape[1]))
        columns = np.hstack([Psi, Y])
        basis = Basis(columns, self.basis.omega, self.basis.labels + labels)
        return CommonBasis(ops, basis, self.n_b, self.weight, self.small)

    def _product(self, X: Array, Y: Array) -> Array:
        ops = self.ops
        return ops.gram(X, ops.apply_K(Y) + self.weight * ops.apply_M(Y))

    def _orthonormal(self, X: Array, small: float) -> Array:
        """Orthonormal columns of the span of X, principal directions below a size left out."""
        if not X.shape[1]:
            return X
        G = self._product(X, X)
        scale = 1 / np.sqrt(np.diag(G)) if small == 0.0 else np.ones(X.shape[1])
        lam, U = np.linalg.eigh(scale[:, None] * (0.5 * (G + G.T)) * scale)
        kept = np.flatnonzero(lam > max(small**2, 1e-14 * lam[-1]))[::-1]
        return X @ (scale[:, None] * U[:, kept] / np.sqrt(lam[kept]))


def first_sample(ops: Operators, basis: Basis, boundary: Index, small: float) -> CommonBasis:
    """The basis of the first point.

    Args:
        ops: operators at the point, in interface coordinates.
        basis: made there by a method that keeps interface coordinates.
        boundary: (n_b,) dof numbers of the interface coordinates.
        small: see `CommonBasis`.

    Raises:
        ConfigError: if the first columns are not one unit of each interface coordinate.
    """
    n_b = boundary.size
    moved = ops.rows(basis.Psi[:, :n_b], boundary) if basis.Psi.shape[1] >= n_b > 0 else None
    if moved is None or np.abs(moved - np.eye(n_b)).max() > 1e-9:
        raise ConfigError(
            "the bases of several parameters join in their interface coordinates, which this "
            "method does not keep.",
            hint="Use CraigBampton, Guyan or MomentMatching, and name an interface.",
        )
    X = basis.Psi
    K, M = (np.diag(ops.gram(X, AX)) for AX in (ops.apply_K(X), ops.apply_M(X)))
    elastic = K > 1e-9 * (K / M).max() * M
    weight = float((K[elastic] / M[elastic]).min(initial=np.inf))
    return CommonBasis(ops, basis, n_b, weight if np.isfinite(weight) else 1.0, small)
