"""Square matrices of other finite element programs, each in its own kind of file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from rom.decks.lines import whole
from rom.errors import ConfigError, FileFormatError
from rom.io.files import check_last_line, check_readable, write_whole
from rom.io.matrices.calculix import MATRIX_ENDINGS, read_stored_matrix
from rom.io.matrices.dmig import Dofs, labelled, read_dmig
from rom.io.matrices.market import BANNER_TEXT, read_market
from rom.io.matrices.op4 import Matrices, read_op4
from rom.io.matrices.user_element import read_user_element
from rom.names import offered

HEAD_BYTES = 10_000  # among which a user element is announced


@dataclass(frozen=True, slots=True)
class NamedMatrix:
    """A matrix of another program.

    Attributes:
        where: file and name, for messages.
        A: (n, n) sparse, as written: of a symmetric one there may be one triangle only.
        dofs: (n, 2) label and component 1 to 6 of each row; None for rows in the order of nodes.
    """

    where: str
    A: csr_matrix
    dofs: Dofs | None = None


def read_matrix(source: Any) -> NamedMatrix:
    """A square matrix: Matrix Market, Abaqus, CalculiX, OUTPUT4, or DMIG.

    Args:
        source: file, or (file, name) where it holds several: ``.mtx`` and ``.mm`` for Matrix Market
            (told by its first line) or Abaqus text, matrices or a linear user element, the latter
            also in ``.inp``; ``.sti`` and ``.mas`` for CalculiX, with
            ``.dof`` beside, ``.op4`` for OUTPUT4, ``.bdf``, ``.dat``, ``.pch``, ``.dmig`` for DMIG
            cards.

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
    return NamedMatrix(f"{path} {key}".strip(), csr_matrix(A), dofs.get(key))


def write_abaqus_matrix(A: Any, dofs: Dofs, path: str | Path) -> Path:
    """Write the lower triangle of a symmetric matrix as text that ``*MATRIX INPUT`` reads.

    Args:
        A: (n, n) dense or sparse.
        dofs: (n, 2) node and component of each row.
        path: file to write.

    Raises:
        ConfigError: if the place is not writable.
        ResourceError: if the disk is full.
    """
    found = coo_matrix(np.tril(A) if isinstance(A, np.ndarray) else A)
    lines = [
        f"{dofs[i, 0]},{dofs[i, 1]}, {dofs[j, 0]},{dofs[j, 1]}, {v:.16e}"
        for i, j, v in zip(found.row, found.col, found.data, strict=True)
        if i >= j and v
    ]
    text = "\n".join(lines) + "\n"
    return write_whole(path, text.encode("ascii"))


def _all(path: Path) -> tuple[Matrices, dict[str, Dofs]]:
    """Matrices by name, and of those whose rows have labels these."""
    if path.suffix.lower() == ".op4":
        return read_op4(path), {}
    pairs = _pairs(path)
    dofs = {name: dofs for name, (_, dofs) in pairs.items() if dofs is not None}
    return Matrices(str(path), {name: A for name, (A, _) in pairs.items()}), dofs


def _pairs(path: Path) -> dict[str, tuple[Any, Dofs | None]]:
    ending = path.suffix.lower()
    if ending in (".bdf", ".dat", ".pch", ".dmig"):
        return dict(read_dmig(path))
    if ending in MATRIX_ENDINGS:
        A, dofs = read_stored_matrix(path)
        return {"": (_finite(A, path), dofs)}
    if ending not in (".mtx", ".mm", ".inp"):
        raise ConfigError(
            f"{path} has the ending {ending!r}; known: .mtx, .mm, .inp, .sti, .mas, "
            ".op4, .bdf, .dat, .pch, .dmig."
        )
    with path.open("rb") as file:
        start = file.read(HEAD_BYTES)
    if ending == ".inp" or b"*USER ELEMENT" in start.upper():
        return dict(read_user_element(path))
    return {
        "": (_finite(read_market(path), path), None)
        if start.startswith(BANNER_TEXT)
        else _abaqus(path)
    }


def _abaqus(path: Path) -> tuple[Any, Dofs]:
    """Lines ``node, component, node, component, value`` of ``*MATRIX GENERATE`` output."""
    check_last_line(path)
    rows = []
    with path.open(encoding="ascii", errors="replace") as file:
        for number, line in enumerate(file, 1):
            if not line.strip() or line.startswith("*"):
                continue
            words = line.replace(",", " ").split()
            try:
                if len(words) != 5:
                    raise ValueError(f"{len(words)} numbers instead of 5")
                i, a, j, b = map(whole, words[:4])
                rows.append((i, a, j, b, float(words[4])))
            except ValueError as error:
                where = f"{path}, line {number}"
                raise FileFormatError(f"this is no entry: {error}.", where=where) from error
    if not rows:
        raise FileFormatError("the file holds no entry.", where=str(path))
    A, dofs = labelled(rows)
    return _finite(A, path), dofs


def _finite(A: Any, path: Path) -> Any:
    if not np.isfinite(A.data).all():
        raise FileFormatError("a number is not finite.", where=str(path))
    return A
