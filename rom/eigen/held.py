"""A body with some dofs held: its stiffness factored once, for many answers; and what moves."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rom.eigen.verbs import Searched, given_rigid_motions, held_rows
from rom.errors import InterfaceError
from rom.model import Array, Index

RIGID_RTOL = 1e-13  # energy of a motion over that of its dofs alone, below which it has none
SHIFT_RTOL = 1e-9  # of the largest eigenvalue: below zero, where a singular stiffness has a factor
X_Y_Z = ((1, 5, 1.0), (0, 5, -1.0), (1, 3, -1.0))  # row of a node, column of a rotation, and sign
ROWS_RTOL = 1e-9  # of a node's rows in the rigid motions from unit translations
MOVING_RATIO = 1e-3  # of the largest motion: less is that of a part at rest


class HeldBody:
    """A body with some dofs held, its stiffness factored for many answers; call it to solve.

    Of the dofs held, global numbers, ``mine`` are the rows of this rank that are free, ``inner``
    the operators on them, None when there are none; ``make`` makes the factor of their stiffness,
    or of K - shift M, which is None while nobody needs it.
    """

    make: Callable[[], None]
    factorable = True  # whether another factor may be made to name a place

    def __init__(self, ops: Searched, held: Index, shift: float = 0.0):
        self.ops: Any = ops
        self.held, self.shift = held, shift
        self.mine = np.flatnonzero(~held_rows(ops, held))
        self.inner: Any = ops.part(self.mine) if ops.n > held.size else None
        self.n_free = 0 if self.inner is None else self.inner.n_massive
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
        """What is not held moves, after one inverse iteration from anywhere, without stiffness."""
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


def moves_most(ops: Searched, X: Array, rows: Index | None = None) -> str:
    """Words for the node that moves most in the columns X, and for the part that moves with it.

    X (n_local, k) has motions on these rows of ``ops``, whose rigid motions tell where nodes are.
    """
    node = (np.arange(X.shape[0]) if rows is None else rows) // 3
    square = np.square(np.where(np.isfinite(X), X, 0.0)).max(axis=1, initial=0.0)
    size = np.sqrt(np.bincount(node, square, minlength=1))
    at = int(np.argmax(size))
    largest = float(size[at])
    point = _point(given_rigid_motions(ops), 3 * at) if largest > 0.0 else None
    largest, found = max(ops.from_all((largest, point)), key=lambda pair: pair[0])
    if found is None:
        return ""
    loose = np.flatnonzero(size > MOVING_RATIO * largest)
    return f" It moves most at {_words(found)}, {_part(ops, loose)}."


def _part(ops: Searched, loose: Index) -> str:
    """Words for some nodes of this rank and those of the others: how many, and where."""
    rigid = given_rigid_motions(ops)
    points = [_point(rigid, 3 * int(node)) for node in loose]
    there = np.array([point for point in points if point is not None]).reshape(-1, 3)
    there = np.vstack(ops.from_all(there))
    share = f"{len(there)} of {ops.n // 3} nodes move"
    return f"and {share}, between {_words(there.min(axis=0))} and {_words(there.max(axis=0))}"


def _words(point: Array) -> str:
    return f"({', '.join(f'{x:.4g}' for x in point + 0.0)}) m"


def _point(rigid: Array, first: int) -> Array | None:
    """(3,) place of the node whose rows begin there, from u = omega x p in its rotations."""
    rows = rigid[first : first + 3]
    if rows.shape[0] < 3 or np.abs(rows[:, :3] - np.eye(3)).max() > ROWS_RTOL:
        return None
    return np.array([sign * rows[row, column] for row, column, sign in X_Y_Z]) + 0.0
