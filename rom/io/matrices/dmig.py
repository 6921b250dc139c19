"""Matrices in Nastran bulk data and punch files: DMIG cards, with nodes as GRID cards.

Source:
    MSC Nastran Quick Reference Guide, entries DMIG, GRID and SPOINT, formats of bulk data.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix, csr_matrix

from rom.decks.bulk import POINTS, Cards, cards, grids
from rom.decks.lines import at, real, whole
from rom.errors import FileFormatError
from rom.io.files import check_last_line, damaged, need, write_lines
from rom.model import Array, Index
from rom.names import ORIGIN_MARK

SYMMETRIC_FORM, SQUARE_FORM = 6, 1
Dofs = Index  # (n, 2) label and component, 1 to 6, or 0 for a scalar point
Named = Mapping[str, Array | csr_matrix]
Entry = tuple[int, int, int, int, float]  # node and component of row and column, value


def read_dmig(path: str | Path) -> dict[str, tuple[csr_matrix, Dofs]]:
    """All real square matrices of a file: {name: (sparse (n, n), (n, 2) label and component)}.

    Of symmetric ones only the triangle that is written. Loads, recovery and complex matrices beside
    them, as in punch files of superelements, are left out.

    Raises:
        FileFormatError: naming the line, if the file is missing or cut, or all are left out.
        UnsafeFileError: if it is larger than 4 GiB.
    """
    path = Path(path)
    check_last_line(path)
    entries: dict[str, list[Entry]] = {}
    others = set[str]()
    for card in cards(path):
        if card.name == "DMIG":
            with damaged("this is no DMIG card", at(card.place)):
                _enter(entries, others, card.fields)
    if not entries:
        named = f"; {', '.join(sorted(others))} are not" if others else ""
        text = f"the file holds no DMIG matrix that is square and real{named}."
        raise FileFormatError(text, where=str(path))
    return {name: labelled(rows) for name, rows in entries.items()}


def read_grids(path: str | Path) -> tuple[Index, Array, Array]:
    """Labels (k,), positions (k, 3) in the basic system, and axes (k, 3, 3) of GRID cards.

    The axes, which are columns, are those of field 7, along which a grid point moves.

    Raises:
        FileFormatError: naming the line, for a damaged card.
    """
    found = Cards()
    for card in cards(path):
        if card.name in POINTS:
            found.add(card)
    return grids(found)[:3]


def write_dmig(
    matrices: Named, dofs: Dofs, path: str | Path, *, nodes: dict[int, Array] | None = None
) -> Path:
    """Write symmetric matrices, ten digits each.

    Args:
        matrices: {name of at most 8 characters: (n, n)}.
        dofs: (n, 2) label and component of each row; component 0 for a scalar point.
        path: file to write.
        nodes: {label: (3,) position, in units of the matrices}, written as GRID cards, with the
            scalar points as SPOINT.
    """
    lines = [f"$ {ORIGIN_MARK}", *_points(dofs, nodes)] if nodes else []
    for name, A in matrices.items():
        lines += _written(name.upper(), csc_matrix(A), dofs)
    return write_lines(path, lines)


def _enter(entries: dict[str, list[Entry]], others: set[str], fields: list[str]) -> None:
    name = fields[0].upper()
    if fields[1] == "0":  # the header card: form, type
        form, kind = int(fields[2]), int(fields[3])
        if form in (SYMMETRIC_FORM, SQUARE_FORM) and kind in (1, 2):
            entries.setdefault(name, [])
        else:
            others.add(name)
        return
    if name in others:
        return
    need(name in entries, f"{name} has no header")
    column = whole(fields[1]), whole(fields[2] or "0")
    for k in range(4, len(fields), 4):
        node, component, value = fields[k : k + 3]
        if node:
            entries[name].append((whole(node), whole(component or "0"), *column, real(value)))


def labelled(rows: list[Entry]) -> tuple[csr_matrix, Dofs]:
    """Matrix (n, n) and dofs of entries."""
    table = np.array([row[:4] for row in rows], dtype=np.int64).reshape(-1, 2, 2)
    dofs, place = np.unique(table.reshape(-1, 2), axis=0, return_inverse=True)
    i, j = place.reshape(-1, 2).T
    values = np.array([row[4] for row in rows])
    return coo_matrix((values, (i, j)), shape=(len(dofs),) * 2).tocsr(), dofs


def _points(dofs: Dofs, nodes: dict[int, Array]) -> Iterator[str]:
    for label, point in nodes.items():
        x, y, z = (_real16(v) for v in point)
        yield f"{'GRID*':<8}{label:16d}{'':16}{x}{y}"
        yield f"{'*':<8}{z}"
    for label in dofs[dofs[:, 1] == 0, 0]:
        yield f"SPOINT  {label:8d}"


def _written(name: str, A: csc_matrix, dofs: Dofs) -> Iterator[str]:
    n = A.shape[0]
    yield f"{'DMIG':<8}{name:<8.8}{0:8d}{SYMMETRIC_FORM:8d}{2:8d}{0:8d}{0:8d}{'':8}{n:8d}"
    for c in range(n):
        column = A[:, c].toarray().ravel()
        rows = c + np.flatnonzero(column[c:])  # the lower triangle
        if rows.size:
            yield f"{'DMIG*':<8}{name:<16.16}{dofs[c, 0]:16d}{dofs[c, 1]:16d}"
            for r in rows:
                yield f"{'*':<8}{dofs[r, 0]:16d}{dofs[r, 1]:16d}{_real16(column[r])}"


def _real16(value: float) -> str:
    return f"{value:16.9E}".replace("E", "D")
