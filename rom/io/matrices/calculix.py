"""Matrices that CalculiX stores, ``*FREQUENCY, SOLVER=MATRIXSTORAGE``.

Stiffness ``.sti`` and mass ``.mas`` hold lines ``row column value`` of the upper triangle, rows
counted from 1, every diagonal entry among them; ``.dof`` of the same name holds a line
``node.component`` for each row. Rows of supports and of dependent nodes are left out.

CalculiX integrates the mass with the Gauss points of the stiffness: one for C3D4, four for C3D10.
Straight elements have the stiffness of `rom.fe` to round-off but too little inertia in short waves:
ten frequencies of a coarse beam are up to 0.2 % (C3D10) and 9 % (C3D4) above those with exact
mass.

Source:
    CalculiX CrunchiX user's manual, *FREQUENCY; files and matrices of version 2.20.
"""

import re
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from rom.errors import FileFormatError
from rom.io.files import check_last_line
from rom.io.matrices.dmig import Dofs
from rom.model import Array

MATRIX_ENDINGS = (".sti", ".mas")
LABEL_PATTERN = re.compile(r"(\d{1,18})\.([1-6])")
REWRITE_HINT = "Let CalculiX write .sti, .mas and .dof again; they belong together."


def read_stored_matrix(path: str | Path) -> tuple[csr_matrix, Dofs]:
    """The upper triangle (n, n) and (n, 2) node and component of each row.

    Args:
        path: ``.sti`` or ``.mas``; the ``.dof`` stands beside.

    Raises:
        FileFormatError: naming the line, if one of the two is missing, damaged or cut, or they do
            not fit together.
    """
    path = Path(path)
    dofs = _dofs(path.with_suffix(".dof"))
    table = _table(path)
    place = table[:, :2].astype(np.int64)
    outside = (place < 1) | (place > len(dofs)) | (place != table[:, :2])
    if outside.any():
        line = int(np.flatnonzero(outside.any(axis=1))[0])
        raise FileFormatError(
            f"rows and columns are 1 to {len(dofs)}, as {path.stem}.dof lists them.",
            where=f"{path}, line {line + 1}",
            hint=REWRITE_HINT,
        )
    i, j = place.T - 1
    missing = np.setdiff1d(np.arange(len(dofs)), i[i == j])
    twice = len(place) - len(np.unique(i * len(dofs) + j))
    if missing.size or twice:
        raise FileFormatError(
            f"{missing.size} of {len(dofs)} diagonal entries are missing and {twice} entries "
            "come twice: the file is cut or changed.",
            where=str(path),
            hint=REWRITE_HINT,
        )
    return coo_matrix((table[:, 2], (i, j)), shape=(len(dofs),) * 2).tocsr(), dofs


def _table(path: Path) -> Array:
    """(entries, 3) row, column, value."""
    check_last_line(path)
    try:
        table = np.loadtxt(path, comments=None, ndmin=2, encoding="latin1")
        if table.shape[1] == 3:
            return table
    except ValueError:
        pass
    with path.open(encoding="latin1") as file:
        number = next((k for k, line in enumerate(file, 1) if not _is_entry(line)), 1)
    raise FileFormatError(
        "an entry is row, column, value.", where=f"{path}, line {number}", hint=REWRITE_HINT
    )


def _is_entry(line: str) -> bool:
    try:
        return len([float(word) for word in line.split()]) == 3
    except ValueError:
        return False


def _dofs(path: Path) -> Dofs:
    """(n, 2); the label is text: read as a number, 12.10 would be 12.1."""
    check_last_line(path)
    rows = []
    with path.open(encoding="latin1") as file:
        for number, line in enumerate(file, 1):
            found = LABEL_PATTERN.fullmatch(line.strip())
            if not found:
                raise FileFormatError(
                    "a row is node.component, with 1 to 6 for the component.",
                    where=f"{path}, line {number}",
                    hint=REWRITE_HINT,
                )
            rows.append((int(found[1]), int(found[2])))
    dofs = np.array(rows, dtype=np.int64)
    if len(np.unique(dofs, axis=0)) < len(dofs):
        raise FileFormatError("a row is listed twice.", where=str(path), hint=REWRITE_HINT)
    return dofs
