"""A body with some dofs held: its stiffness factored once, for many answers."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rom.errors import InterfaceError
from rom.model import Array, Index

RIGID_RTOL = 1e-13  # energy of a motion over that of its dofs alone, below which it has none
SHIFT_RTOL = 1e-9  # of the largest eigenvalue: below zero, where a singular stiffness has a factor


class HeldBody:
    """A body with some dofs held, its stiffness factored for many answers; call it to solve.

    Attributes:
        held: the dofs held, global numbers.
        mine: rows of this rank that are free.
        n_free: number of free dofs.
        inner: operators on them, None when there are none.
        factor: of their stiffness, or of K - shift M; None while nobody needs it.
        make: factors it.
    """

    make: Callable[[], None]

    def __init__(self, ops: Any, held: Index, shift: float = 0.0):
        self.ops, self.held, self.shift = ops, held, shift
        self.mine = np.flatnonzero(~np.isin(np.arange(ops.first, ops.first + ops.n_local), held))
        self.n_free = ops.n - held.size
        self.inner: Any = ops.part(self.mine) if self.n_free else None
        self.factor: Any = None

    def __call__(self, F: Array) -> Array:
        """Solve K_ii X_i = F_i; rows of held dofs come back zero."""
        X = np.zeros(F.shape)
        if self.inner is not None:
            X[self.mine] = self.made().solve(F[self.mine])
        return X

    def made(self) -> Any:
        """The factor, made again if its memory was given back."""
        if self.factor is None:
            self.make()
        return self.factor

    def coarsely_solved(self, F: Array) -> Array:
        """K_ii^-1 F, so well that motions without stiffness show."""
        return np.asarray(self.factor.solve(F))

    def refuse_free_motion(self) -> None:
        """What is not held moves, after one inverse iteration from anywhere, without stiffness.

        Raises:
            InterfaceError: with the place that moves most, where it is known.
        """
        ops, stiff, X = self.ops, False, np.zeros((self.mine.size, 1))
        if self.factor.ok:
            X = self.coarsely_solved(ops.apply_M(ops.fixed[:, None])[self.mine])
            if ops.all_finite(X):
                together = np.diag(self.inner.gram(X, self.inner.apply_K(X)))
                alone = self.inner.gram(X, self.inner.stiffness_diagonal[:, None] * X)
                stiff = bool((together > RIGID_RTOL * np.diag(alone)).all())
        if not stiff:
            if not self.factor.ok and self.factorable:
                X = self._loose()
            raise self.singular(X)

    @property
    def factorable(self) -> bool:
        """Whether another factor may be made to name a place."""
        return True

    def _loose(self) -> Array:
        """(n_free here, 1) the motion without stiffness on which a factor broke down."""
        self.release()
        factor = self.inner.indefinite(-SHIFT_RTOL * self.inner.largest())
        X = self.ops.fixed[self.mine][:, None]
        for _ in range(2):
            X = factor.solve(self.inner.apply_M(X))
        factor.release()
        return X

    def singular(self, X: Array) -> InterfaceError:
        """The error of a stiffness that leaves motions X (n_free here, k) free."""
        return InterfaceError(
            f"K_ii is singular: the {self.held.size} boundary dofs leave a rigid motion free."
            + self.ops.where(X, self.mine),
            hint="Fix at least three nodes that do not lie on one line, or hold another interface; "
            "a part of the mesh that hangs on a point or on a line moves alone, and stiffnesses "
            "that differ by more than thirteen digits leave none of the small ones.",
        )

    def release(self) -> None:
        """Give the memory of the factor back; it is made again if it is needed."""
        if self.factor is not None:
            self.factor.release()
        self.factor = None
