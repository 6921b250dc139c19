"""Matrices in the exchange format of Matrix Market: real or integer, as coordinates or dense.

Read here and not by SciPy: on a damaged file its version 1.17 ends the whole process, and 1.10
takes the memory that a wrong head announces.

Source:
    R. F. Boisvert, R. Pozo, K. A. Remington, The Matrix Market Exchange Formats, NISTIR 5935, 1996.
"""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from rom.errors import FileFormatError, UnsafeFileError, in_file
from rom.io.files import check_last_line
from rom.model import Array, Index

BANNER_TEXT = b"%%MatrixMarket"
MOST_ROWS = 10_000_000
SIGNS = {"general": 0.0, "symmetric": 1.0, "hermitian": 1.0, "skew-symmetric": -1.0}


def read_market(path: str | Path) -> csr_matrix:
    """The whole matrix, both triangles of a symmetric one.

    Raises:
        FileFormatError: if the file is no such file, cut, or holds a matrix that is not real.
        UnsafeFileError: if its head announces more numbers than the file can hold.
    """
    path = Path(path)
    check_last_line(path)
    with in_file(path), path.open(encoding="latin1") as file:
        words = file.readline(200).lower().split()[1:]
        line = file.readline(2000)
        while line.startswith("%") or (line and not line.strip()):
            line = file.readline(2000)
        if words[:1] != ["matrix"] or len(words) != 4 or words[2] not in ("real", "integer"):
            raise FileFormatError("the matrix is not real.")
        _, form, _, symmetry = words
        try:
            if form not in ("coordinate", "array") or symmetry not in SIGNS:
                raise ValueError(f"'{form} {words[2]} {symmetry}' is unknown")
            sizes = _sizes(line, 3 if form == "coordinate" else 2)
            if max(sizes[:2]) > MOST_ROWS or 2 * sizes[-1] > path.stat().st_size:
                raise UnsafeFileError(f"sizes {sizes} do not fit the file.")
            table = _table(file)
            read = _coordinates if form == "coordinate" else _dense
            i, j, values = read(table, sizes, SIGNS[symmetry])
        except (ValueError, OverflowError) as error:
            raise FileFormatError(f"this is no Matrix Market file: {error}.") from error
    mirrored = SIGNS[symmetry] * values * (i != j)
    both = (np.r_[values, mirrored], (np.r_[i, j], np.r_[j, i])) if SIGNS[symmetry] else (
        values, (i, j))  # fmt: skip
    return coo_matrix(both, shape=sizes[:2]).tocsr()


def _sizes(line: str, n: int) -> tuple[int, ...]:
    """Rows and columns, and entries of coordinates."""
    sizes = tuple(int(word) for word in line.split())
    if len(sizes) != n or min(sizes) < 0 or min(sizes[:2]) < 1:
        raise ValueError(f"{line.strip()!r} are no sizes")
    return sizes


def _table(file: Any) -> Array:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of NumPy, if there is no line
        return np.loadtxt(file, comments="%", ndmin=2)


def _coordinates(table: Array, sizes: tuple[int, ...], _: float) -> tuple[Index, Index, Array]:
    """Rows and columns from zero, and values."""
    if table.size != 3 * sizes[2] or table.shape[1] not in (0, 3):
        raise ValueError(f"{len(table)} lines where {sizes[2]} entries are announced")
    place = table.reshape(-1, 3)[:, :2]
    if not ((place >= 1) & (place <= sizes[:2]) & (place % 1 == 0)).all():
        raise ValueError(f"an entry is outside of {sizes[0]} x {sizes[1]}")
    i, j = place.astype(np.int64).T - 1
    return i, j, table.reshape(-1, 3)[:, 2]


def _dense(table: Array, sizes: tuple[int, ...], sign: float) -> tuple[Index, Index, Array]:
    """Column by column; of symmetric matrices the lower triangle, of skew ones without diagonal."""
    rows, columns = sizes
    n = rows * columns if not sign else rows * (rows + int(sign)) // 2
    if table.size != n:
        raise ValueError(f"{table.size} numbers where {n} are announced")
    if not sign:
        j, i = np.divmod(np.arange(n), rows)
        return i, j, table.ravel()
    if rows != columns:
        raise ValueError(f"{rows} x {columns} is not square")
    j, i = np.triu_indices(rows, 0 if sign > 0 else 1)
    return i, j, table.ravel()
