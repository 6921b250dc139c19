"""A body with some dofs held: its stiffness factored once, for many answers."""

from typing import Any

import numpy as np

from rom.eigen.search import RIGID_RTOL, HeldBody
from rom.errors import InterfaceError
from rom.fe.operators.place import moves_most
from rom.model import Array, Index

COARSE_RTOL = 1e-2  # residual of solutions that only show whether there is stiffness
SHIFT_RTOL = 1e-9  # of the largest eigenvalue: below zero, where a singular stiffness has a factor


class HeldPETSc(HeldBody):
    """K with the held dofs eliminated, factored once by MUMPS; call it to solve."""

    def __init__(self, ops: Any, held: Index, shift: float = 0.0):
        super().__init__(ops, held, shift)
        if self.n_free:
            if ops.solver.iterative:
                self._refuse_loose()
            self.make()
            if not shift:
                self._refuse_free_motion()

    def make(self) -> None:
        """Factor the stiffness, or K - shift M."""
        if self.shift:
            self.factor = self.inner.indefinite(self.shift)
            return
        near_null = None if self.ops.rigid is None else self.ops.rigid[self.mine]
        self.factor = self.inner.stiffness_inverse(near_null, self.held.size)
        self.ops.counted = getattr(self.factor, "counted", None)

    def _refuse_loose(self) -> None:
        """Iteration on a body that can move would only run on: judge the held dofs first."""
        R = self.ops.rigid
        if R is None:
            return
        if np.linalg.matrix_rank(self.ops.rows(R, self.held), tol=1e-9) < R.shape[1]:
            raise self._singular()

    def _singular(self, place: str = "") -> InterfaceError:
        return InterfaceError(
            f"K_ii is singular: the {self.held.size} boundary dofs leave a rigid motion free."
            + place,
            hint="Fix at least three nodes that do not lie on one line, or hold another interface; "
            "a part of the mesh that hangs on a point or on a line moves alone.",
        )

    def _coarsely_solved(self, F: Array) -> Array:
        """K_ii^-1 F, by iteration only so well that motions without stiffness show."""
        if self.ops.solver.iterative:
            return np.asarray(self.factor.solve(F, COARSE_RTOL))
        return np.asarray(self.factor.solve(F))

    def _refuse_free_motion(self) -> None:
        """What is not held moves, after one inverse iteration from anywhere, without stiffness."""
        ops, stiff, X = self.ops, False, np.zeros((self.mine.size, 1))
        if self.factor.ok:
            X = self._coarsely_solved(ops.apply_M(ops.fixed[:, None])[self.mine])
            if ops.all_finite(X):
                together = np.diag(self.inner.gram(X, self.inner.apply_K(X)))
                alone = self.inner.gram(X, self.inner.stiffness_diagonal[:, None] * X)
                stiff = bool((together > RIGID_RTOL * np.diag(alone)).all())
        if not stiff:
            if not self.factor.ok and not ops.solver.out_of_core:
                X = self._loose()
            raise self._singular(moves_most(ops, X, self.mine))

    def _loose(self) -> Array:
        """(n_free here, 1) the motion without stiffness on which a factor broke down."""
        self.release()
        factor = self.inner.indefinite(-SHIFT_RTOL * self.inner.largest())
        X = self.ops.fixed[self.mine][:, None]
        for _ in range(2):
            X = factor.solve(self.inner.apply_M(X))
        factor.release()
        return X
