"""Square matrices of other finite element programs, each in its own kind of file.

Matrix Market is read here and not by SciPy: on a damaged file its version 1.17 ends the whole
process, and 1.10 takes the memory that a wrong head announces.

CalculiX stores by ``*FREQUENCY, SOLVER=MATRIXSTORAGE``: stiffness ``.sti`` and mass ``.mas`` hold
lines ``row column value`` of the upper triangle, rows counted from 1, every diagonal entry among
them; ``.dof`` of the same name holds a line ``node.component`` for each row. Rows of supports and
of dependent nodes are left out. It integrates the mass with the Gauss points of the stiffness: one
for C3D4, four for C3D10. Straight elements have the stiffness of `rom.fe` to round-off but too
little inertia in short waves: ten frequencies of a coarse beam are up to 0.2 % (C3D10) and 9 %
(C3D4) above those with exact mass.

Ansys writes its matrices as Harwell-Boeing files (HBMAT) or Matrix Market (*EXPORT).

Source:
    R. F. Boisvert, R. Pozo, K. A. Remington, The Matrix Market Exchange Formats, NISTIR 5935, 1996.
    I. S. Duff, R. G. Grimes, J. G. Lewis, Users' guide for the Harwell-Boeing sparse matrix
    collection, 1992.
    CalculiX CrunchiX user's manual, *FREQUENCY; files and matrices of version 2.20.
"""

import re
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from rom.decks.lines import whole
from rom.errors import ConfigError, FileFormatError, UnsafeFileError, in_file
from rom.io.files import (
    check_last_line,
    check_readable,
    damaged,
    lines_of,
    need,
    number,
    write_lines,
)
from rom.io.matrices.dmig import Dofs, labelled, read_dmig
from rom.io.matrices.op4 import Matrices, read_op4
from rom.io.matrices.user_element import read_user_element
from rom.model import Array, Index
from rom.names import offered

BANNER_TEXT = b"%%MatrixMarket"
MOST_ROWS = 10_000_000
BOEING_PATTERN = re.compile(rb"(?:[^\n]*\n){2}[RCPI][SUZHR][AE] ", re.IGNORECASE)
FIELD_PATTERN = re.compile(r"(\d*)[IDEFG](\d+)")  # of Fortran formats: how many, how wide
SIGNS = {"general": 0.0, "symmetric": 1.0, "hermitian": 1.0, "skew-symmetric": -1.0}
MATRIX_ENDINGS = (".sti", ".mas")
CURES = {  # ending: what to do with what is not read
    ".op2": "Let Nastran write DMIGPCH, or MATOP4.",
    ".full": "Let Ansys write it by HBMAT, or by *EXPORT as Matrix Market.",
    ".mnf": "Let the program that made it write stiffness and mass.",
}
LABEL_PATTERN = re.compile(r"(\d{1,18})\.([1-6])")
REWRITE_HINT = "Let CalculiX write .sti, .mas and .dof again; they belong together."
HEAD_BYTES = 10_000  # among which a user element is announced


@dataclass(frozen=True, slots=True)
class NamedMatrix:
    """A matrix of another program."""

    where: str  # file and name, for messages
    A: csr_matrix  # (n, n) as written: of a symmetric one there may be one triangle only
    dofs: Dofs | None = None  # (n, 2) label, component 1 to 6; None for rows in the order of nodes


def read_matrix(source: str | Path | tuple[str | Path, str]) -> NamedMatrix:
    """A square matrix: Matrix Market, Abaqus, CalculiX, OUTPUT4, or DMIG.

    Args:
        source: file, or (file, name) where it holds several: ``.mtx`` and ``.mm`` for Matrix Market
            or Abaqus text, matrices or a linear user element, the latter also in ``.inp``; ``.sti``
            and ``.mas`` for CalculiX, with ``.dof`` beside, ``.op4`` for OUTPUT4, ``.bdf``,
            ``.dat``, ``.pch``, ``.dmig`` for DMIG cards. Matrix Market and Harwell-Boeing are told
            by their first lines, whatever the ending.

    Raises:
        ConfigError: for another ending, or if a name is needed or unknown.
        FileFormatError: if the file is missing, cut, or holds no real square matrix.
        UnsafeFileError: if it asks for more memory than its size can mean.
    """
    path, name = source if isinstance(source, tuple) else (source, None)
    path = check_readable(path)
    found, dofs = _all(path)
    only = next(iter(found)) if len(found) == 1 else ""
    key = only if name is None else name.upper()
    A = found[key]
    if A.shape[0] != A.shape[1] or np.iscomplexobj(A):
        what = "complex" if np.iscomplexobj(A) else f"{A.shape[0]} x {A.shape[1]}"
        raise FileFormatError(
            f"the matrix {key} is {what}.",
            where=str(path),
            hint=f"Stiffness and mass are real and square; the file holds {offered(found, key)}.",
        )
    if not np.isfinite((A := csr_matrix(A)).data).all():
        raise FileFormatError("a number is not finite.", where=str(path))
    return NamedMatrix(f"{path} {key}".strip(), A, dofs.get(key))


def write_abaqus_matrix(A: Array | csr_matrix, dofs: Dofs, path: str | Path) -> Path:
    """Write the lower triangle of a symmetric matrix as text that ``*MATRIX INPUT`` reads.

    Args:
        A: (n, n) dense or sparse, in units of any kind.
        dofs: (n, 2) node and component of each row.
        path: file to write.
    """
    found = coo_matrix(np.tril(A) if isinstance(A, np.ndarray) else A)
    entries = zip(found.row, found.col, found.data, strict=True)
    lines = (
        f"{dofs[i, 0]},{dofs[i, 1]}, {dofs[j, 0]},{dofs[j, 1]}, {v:.16e}"
        for i, j, v in entries
        if i >= j and v
    )
    return write_lines(path, lines)


def _all(path: Path) -> tuple[Matrices, dict[str, Dofs]]:
    """Matrices by name, and of those whose rows have labels these."""
    if path.suffix.lower() == ".op4":
        return read_op4(path), {}
    pairs = _pairs(path)
    dofs = {name: dofs for name, (_, dofs) in pairs.items() if dofs is not None}
    return Matrices(str(path), {name: A for name, (A, _) in pairs.items()}, {}), dofs


def _pairs(path: Path) -> Mapping[str, tuple[csr_matrix, Dofs | None]]:
    ending = path.suffix.lower()
    with path.open("rb") as file:
        start = file.read(HEAD_BYTES)
    if start.startswith(BANNER_TEXT):
        return {"": (read_market(path), None)}
    if BOEING_PATTERN.match(start):
        return {"": (read_boeing(path), None)}
    if ending in (".bdf", ".dat", ".pch", ".dmig"):
        return read_dmig(path)
    if ending in MATRIX_ENDINGS:
        return {"": read_stored_matrix(path)}
    if ending not in (".mtx", ".mm", ".inp"):
        raise ConfigError(
            f"{path} has the ending {ending!r}; known: .mtx, .mm, .inp, .sti, .mas, "
            ".op4, .bdf, .dat, .pch, .dmig.",
            hint=CURES.get(ending, ""),
        )
    if ending == ".inp" or b"*USER ELEMENT" in start.upper():
        return read_user_element(path)
    return {"": _abaqus(path)}


def _abaqus(path: Path) -> tuple[csr_matrix, Dofs | None]:
    """Lines ``node, component, node, component, value`` of ``*MATRIX GENERATE``.

    Or ``row, column, value``, in its format of coordinates.
    """
    rows = list[tuple[Any, ...]]()
    with lines_of(path, "this is no entry", encoding="ascii") as lines:
        for line in lines:
            if line.strip() and not line.startswith("*"):
                *place, value = line.replace(",", " ").split()
                rows.append((*map(whole, place), float(value)))
                need(len(rows[-1]) == len(rows[0]) in (3, 5), f"{line.strip()!r} is none")
                inside = all(1 <= k <= MOST_ROWS for k in rows[-1][:2])
                need(len(place) > 2 or inside, f"{place} is no place in a matrix")
    if not rows:
        raise FileFormatError("the file holds no entry.", where=str(path))
    if len(rows[0]) > 3:
        return labelled(rows)
    *place, values = np.array(rows).T
    i, j = np.array(place, dtype=np.int64) - 1
    A = coo_matrix((values, (i, j)), shape=(max(i.max(), j.max()) + 1,) * 2)
    return A.tocsr(), None


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
        with damaged("this is no Matrix Market file", path):
            known = form in ("coordinate", "array") and symmetry in SIGNS
            need(known, f"'{form} {words[2]} {symmetry}' is unknown")
            sizes = _sizes(line, 3 if form == "coordinate" else 2)
            if max(sizes[:2]) > MOST_ROWS or 2 * sizes[-1] > path.stat().st_size:
                raise UnsafeFileError(f"sizes {sizes} do not fit the file.")
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # of NumPy, if there is no line
                table = np.loadtxt(file, comments="%", ndmin=2)
            read = _coordinates if form == "coordinate" else _dense
            i, j, values = read(table, sizes, SIGNS[symmetry])
    if SIGNS[symmetry]:
        mirrored = SIGNS[symmetry] * values * (i != j)
        i, j, values = np.r_[i, j], np.r_[j, i], np.r_[values, mirrored]
    return coo_matrix((values, (i, j)), shape=sizes[:2]).tocsr()


def _sizes(line: str, n: int) -> tuple[int, ...]:
    sizes = tuple(int(word) for word in line.split())
    possible = len(sizes) == n and min(sizes) >= 0 and min(sizes[:2]) >= 1
    need(possible, f"{line.strip()!r} are no sizes")
    return sizes


def _coordinates(table: Array, sizes: tuple[int, ...], _: float) -> tuple[Index, Index, Array]:
    fits = table.size == 3 * sizes[2] and table.shape[1] in (0, 3)
    need(fits, f"{len(table)} lines where {sizes[2]} entries are announced")
    place = table.reshape(-1, 3)[:, :2]
    inside = ((place >= 1) & (place <= sizes[:2]) & (place % 1 == 0)).all()
    need(inside, f"an entry is outside of {sizes[0]} x {sizes[1]}")
    i, j = place.astype(np.int64).T - 1
    return i, j, table.reshape(-1, 3)[:, 2]


def _dense(table: Array, sizes: tuple[int, ...], sign: float) -> tuple[Index, Index, Array]:
    """Column by column; of symmetric matrices the lower triangle, of skew ones without diagonal."""
    rows, columns = sizes
    n = rows * columns if not sign else rows * (rows + int(sign)) // 2
    need(table.size == n, f"{table.size} numbers where {n} are announced")
    if not sign:
        j, i = np.divmod(np.arange(n), rows)
        return i, j, table.ravel()
    need(rows == columns, f"{rows} x {columns} is not square")
    j, i = np.triu_indices(rows, 0 if sign > 0 else 1)
    return i, j, table.ravel()


def read_boeing(path: str | Path) -> csr_matrix:
    """An assembled real matrix, of a symmetric one the triangle that is written.

    Raises:
        FileFormatError: if the file is no such file, cut, or holds a matrix that is not real.
        UnsafeFileError: if its head announces more numbers than the file can hold.
    """
    path = Path(path)
    check_last_line(path)
    with (
        in_file(path),
        path.open(encoding="latin1") as file,
        damaged("this is no Harwell-Boeing file", path),
    ):
        file.readline()
        counts = [int(word) for word in file.readline().split()]
        kind, *sizes = file.readline().split()
        rows, columns, n = map(int, sizes[:3])
        need(kind.upper() in ("RSA", "RUA"), f"a matrix {kind} is not real, square and assembled")
        if max(rows, columns) > MOST_ROWS or 2 * max(n, columns) > path.stat().st_size:
            raise UnsafeFileError(f"sizes {rows} x {columns}, {n} entries do not fit the file.")
        formats = FIELD_PATTERN.findall(file.readline().upper())
        if counts[4:] > [0]:
            file.readline()  # of right-hand sides, which come last
        parts = [columns + 1, n, n]
        texts = zip(counts[1:4], formats, parts, strict=False)
        ends, i, values = (_fields(file, k, int(w), m) for k, (_, w), m in texts)
        place = np.diff(ends.astype(np.int64))
        need(ends[0] == 1 and (place >= 0).all() and ends[-1] == n + 1, "columns do not ascend")
        need(((i >= 1) & (i <= rows)).all(), f"a row is none of {rows}")
    j = np.repeat(np.arange(columns), place)
    return coo_matrix((values, (i.astype(np.int64) - 1, j)), shape=(rows, columns)).tocsr()


def _fields(file: IO[str], n_lines: int, width: int, n: int) -> Array:
    """(n,) numbers of lines of Fortran, between blanks or else in fields of one width."""
    lines = [file.readline().rstrip() for _ in range(n_lines)]
    words = " ".join(lines).split()  # SciPy 1.10 announces fields wider than it writes them
    if len(words) != n:
        words = [line[k : k + width] for line in lines for k in range(0, len(line), width)]
    need(len(words) == n, f"{len(words)} numbers where {n} are announced")
    return np.array([number(word) for word in words])


def read_stored_matrix(path: str | Path) -> tuple[csr_matrix, Dofs]:
    """The upper triangle (n, n) and (n, 2) node and component of each row of ``.sti`` or ``.mas``.

    The ``.dof`` stands beside.

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
    table = np.zeros((0, 0))
    with suppress(ValueError):
        table = np.loadtxt(path, comments=None, ndmin=2, encoding="latin1")
    if table.shape[1] != 3:
        with lines_of(path, "an entry is row, column, value", REWRITE_HINT) as lines:
            for line in lines:
                need(len([float(word) for word in line.split()]) == 3, f"{line[:40]!r} is none")
            need(False, "one is none")  # what NumPy does not take for a number, Python does
    return table


def _dofs(path: Path) -> Dofs:
    """(n, 2); the label is text: read as a number, 12.10 would be 12.1."""
    rows = dict[tuple[int, int], None]()
    what = "a row is node.component, with 1 to 6 for the component"
    with lines_of(path, what, REWRITE_HINT) as lines:
        for line in lines:
            word = line.strip()
            need(LABEL_PATTERN.fullmatch(word), f"{word[:40]!r} is none")
            label, component = map(int, word.split("."))
            need((label, component) not in rows, f"{word} is listed twice")
            rows[label, component] = None
    return np.array(list(rows), dtype=np.int64)
