"""A body condensed to its interfaces: one factor of K_ii solves for it in every support."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh

from rom.eigen.verbs import (
    Held,
    Operators,
    column_blocks,
    constraint_modes,
    owned,
    quadratic,
    unit_motions,
)
from rom.errors import InterfaceError
from rom.model import Array, Index

LEAST_STIFFNESS = 1e-12  # of the scaled interface stiffness, below which a motion is free
STATIC_RTOL = 1e-6  # of the largest stiffness: what keeps a shape from being a constraint mode
LEAST_PART = 1e-10  # of rigid motions seen by the interfaces, below which one is none


@dataclass(frozen=True, slots=True)
class Condensed:
    """Constraint modes Psi (n_local, n_b) and the stiffness S = Psi^T K Psi between interfaces.

    ``held`` is the body ``ops`` with its whole boundary (n_b,) held, factored; ``alone`` (n_b,) the
    stiffness of each coordinate while nothing else moves.
    """

    ops: Operators
    held: Held
    boundary: Index
    Psi: Array
    S: Array
    alone: Array

    def support(self, dofs: Index) -> "Supported":
        """The body with some interface coordinates held, dofs (k,) of ``boundary``, or with none.

        Refused where a motion other than the six of the free body has no stiffness.
        """
        free = np.flatnonzero(~np.isin(self.boundary, dofs))
        alone, S, R = self.alone[free], self.S[np.ix_(free, free)], np.zeros((0, 6))
        if not dofs.size and self.ops.rigid is not None:
            R = self.ops.rows(self.ops.rigid, self.boundary)
            size = np.linalg.norm(R, axis=1).clip(1e-300)
            if np.linalg.matrix_rank(R / size[:, None]) == len(R):  # alone it may be without
                alone, S = size**-2, np.zeros_like(S)  # stiffness: it moves as a whole
        scale = 1.0 / np.sqrt(alone)
        S = scale[:, None] * S * scale
        if R.size:
            R = R / scale[:, None]
            U, size, _ = np.linalg.svd(R, full_matrices=False)
            U = U[:, size > LEAST_PART * size[0]]
            S = S + U @ U.T  # rigid motions cost nothing; loads in balance do not feel this
        if free.size and eigh(S, eigvals_only=True, subset_by_index=(0, 0))[0] < LEAST_STIFFNESS:
            text = "the supports leave a motion of the interfaces without stiffness"
            raise InterfaceError(f"{text}; hold one more, or one that can carry moments.")
        return Supported(self, dofs, free, scale, cho_factor(S) if free.size else None)


@dataclass(frozen=True, slots=True)
class Supported:
    """A body in one support; call it to solve, for loads that balance each other if it is free.

    With the interface coordinates r that are not held::

        u = K_ii^-1 f + Psi_r S_rr^-1 Psi_r^T f

    as constraint modes and motions of the inside have no work in common.
    """

    body: Condensed
    dofs: Index
    free: Index
    scale: Array
    factor: tuple[Array, bool] | None

    @property
    def mine(self) -> Index:
        """Rows of this rank that are held."""
        return self.dofs[owned(self.body.ops, self.dofs)] - self.body.ops.first

    def __call__(self, F: Array) -> Array:
        """(n_local, k) displacements under loads (n_local, k)."""
        X = self.body.held(F)
        if self.factor is None:
            return X
        Psi = self.body.Psi
        force = self.scale[:, None] * self.body.ops.gram(Psi, F)[self.free]
        motion = np.zeros((Psi.shape[1], F.shape[1]))
        motion[self.free] = self.scale[:, None] * cho_solve(self.factor, force)
        return X + Psi @ motion

    solve = __call__


def condensed(
    ops: Operators, held: Held, boundary: Index, Psi: Array, S: Array | None = None
) -> Condensed:
    """The body condensed to its boundary, see `Condensed`.

    Shapes Psi (n_local, n_b) that are constraint modes of this very body are taken, others
    replaced; S is Psi^T K Psi where it is known.
    """
    S = quadratic(ops, ops.apply_K, Psi) if S is None else S
    E, forces, alone = unit_motions(ops, boundary), np.empty_like(S), np.empty(boundary.size)
    for some in column_blocks(boundary.size):
        loads = ops.apply_K(E[:, some])
        forces[some], alone[some] = ops.gram(loads, Psi), np.diag(ops.rows(loads, boundary[some]))
    if np.abs(S - forces).max() > STATIC_RTOL * np.abs(S).max():
        Psi = constraint_modes(ops, held, boundary)
        S = quadratic(ops, ops.apply_K, Psi)
    return Condensed(ops, held, boundary, Psi, 0.5 * (S + S.T), alone)
