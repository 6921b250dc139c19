"""A body with some dofs held, on all ranks."""

from typing import Any

import numpy as np

from rom.eigen.held import HeldBody
from rom.model import Array, Index

COARSE_RTOL = 1e-2  # residual of solutions that only show whether there is stiffness


class HeldPETSc(HeldBody):
    """K with the held dofs eliminated, factored once by MUMPS; call it to solve."""

    def __init__(self, ops: Any, held: Index, shift: float = 0.0):
        super().__init__(ops, held, shift)
        self.factorable = not ops.solver.out_of_core
        if self.n_free:
            if ops.solver.iterative:
                self._refuse_loose()
            self.make()
            if not shift:
                self.refuse_free_motion()

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
            raise self.singular(np.zeros((self.mine.size, 1)))

    def coarsely_solved(self, F: Array) -> Array:
        """K_ii^-1 F, by iteration only so well that motions without stiffness show."""
        if self.ops.solver.iterative:
            return np.asarray(self.factor.solve(F, COARSE_RTOL))
        return super().coarsely_solved(F)
