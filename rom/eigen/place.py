"""Where on the body a motion is: what an error about a singular matrix can say."""

from typing import Any

import numpy as np

from rom.model import Array, Index

X_Y_Z = ((1, 5, 1.0), (0, 5, -1.0), (1, 3, -1.0))  # row of a node, column of a rotation, and sign
ROWS_RTOL = 1e-9  # of a node's rows in the rigid motions from unit translations
MOVING_RATIO = 1e-3  # of the largest motion: less is that of a part at rest


def moves_most(ops: Any, X: Array, rows: Index | None = None) -> str:
    """Words for the node that moves most in the columns X, and for the part that moves with it.

    Args:
        ops: operators whose rigid motions tell where their nodes are.
        X: (n_local, k) motions on the rows of this rank.
        rows: (n_local,) which rows of ``ops`` these are; all if not given.
    """
    node = (np.arange(X.shape[0]) if rows is None else rows) // 3
    square = np.square(np.where(np.isfinite(X), X, 0.0)).max(axis=1, initial=0.0)
    size = np.sqrt(np.bincount(node, square, minlength=1))
    at = int(np.argmax(size))
    largest = float(size[at])
    point = _point(ops.rigid, 3 * at) if largest > 0.0 else None
    largest, found = max(ops.from_all((largest, point)), key=lambda pair: pair[0])
    if found is None:
        return ""
    loose = np.flatnonzero(size > MOVING_RATIO * largest)
    return f" It moves most at {_words(found)}, {_part(ops, loose)}."


def _part(ops: Any, loose: Index) -> str:
    """Words for some nodes of this rank and those of the others: how many, and where."""
    points = [_point(ops.rigid, 3 * int(node)) for node in loose]
    there = np.array([point for point in points if point is not None]).reshape(-1, 3)
    there = np.vstack(ops.from_all(there))
    share = f"{len(there)} of {ops.n // 3} nodes move"
    return f"and {share}, between {_words(there.min(axis=0))} and {_words(there.max(axis=0))}"


def _words(point: Array) -> str:
    """A place as it is printed."""
    return f"({', '.join(f'{x:.4g}' for x in point + 0.0)}) m"


def _point(rigid: Array, first: int) -> Array | None:
    """(3,) place of the node whose rows begin there, from u = omega x p in its rotations."""
    rows = rigid[first : first + 3]
    if rows.shape[0] < 3 or np.abs(rows[:, :3] - np.eye(3)).max() > ROWS_RTOL:
        return None
    point: Array = np.array([sign * rows[row, column] for row, column, sign in X_Y_Z])
    return point + 0.0
