"""Matrices as text that ``*MATRIX GENERATE`` of Abaqus writes and ``*MATRIX INPUT`` reads."""

import numpy as np
from scipy.sparse import coo_matrix


def write_abaqus_matrix(A, dofs, path):
    """The lower triangle of a symmetric matrix; dofs (n, 2) are node and component of each row."""
    found = coo_matrix(np.tril(A) if isinstance(A, np.ndarray) else A)
    entries = zip(found.row, found.col, found.data, strict=True)
    lines = (f"{dofs[i, 0]},{dofs[i, 1]}, {dofs[j, 0]},{dofs[j, 1]}, {v:.16e}\n"
             for i, j, v in entries if i >= j and v)  # fmt: skip
    path.write_text("".join(lines))
    return path
