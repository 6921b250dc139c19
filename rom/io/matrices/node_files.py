"""Nodes, and sets of nodes, in the files of other finite element programs."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.decks.bulk import cards
from rom.decks.keywords import Block
from rom.decks.lines import whole
from rom.decks.nodes import NODE_KEYWORDS, Nodes
from rom.errors import ConfigError, FileFormatError, InterfaceError, in_file
from rom.io.files import check_readable, damaged, lines_of, need
from rom.io.matrices.dmig import Dofs, read_grids
from rom.model import Array, Index
from rom.names import named, offered

CARDS = (".bdf", ".dat", ".pch", ".asm", ".dmig")
COMPONENTS = {"UX": 1, "UY": 2, "UZ": 3, "ROTX": 4, "ROTY": 5, "ROTZ": 6}  # of Ansys
AXES_TOL = 1e-6  # of axes that are orthonormal
Placed = tuple[Index, Array, Array]
# keywords that make nodes in ways that are not read, or turn the rows of matrices
REFUSED_KEYWORDS = ("NGEN", "NFILL", "NCOPY", "NMAP", "TRANSFORM", "PARAMETER")


def read_nodes(nodes: str | Path | tuple[npt.ArrayLike, ...]) -> Placed:
    """Ascending labels (k,), positions (k, 3), in units of the file, and axes (k, 3, 3).

    Along the axes, which are columns, the rows of matrices move the nodes.

    Args:
        nodes: these, the axes only where they are not those of the body; or a file: ``.inp``,
            ``.csv``, or bulk data with GRID cards.

    Raises:
        ConfigError: for another ending.
        FileFormatError: naming the line, if a file is missing or damaged, or a label occurs twice.
    """
    if isinstance(nodes, str | Path):
        where, (labels, points, *axes) = str(nodes), _node_file(Path(nodes))
    else:
        where = "nodes"
        if len(nodes) not in (2, 3):
            raise ConfigError("nodes are labels, positions and perhaps axes, or a file.")
        labels, points, *axes = (np.asarray(part) for part in nodes)
    if points.shape != (labels.size, 3) or not labels.size or not np.isfinite(points).all():
        raise FileFormatError(f"{labels.size} labels and positions {points.shape}.", where=where)
    turned = axes[0] if axes else np.tile(np.eye(3), (labels.size, 1, 1))
    if (
        turned.shape != (labels.size, 3, 3)
        or np.abs(turned.swapaxes(1, 2) @ turned - np.eye(3)).max() > AXES_TOL
    ):
        raise FileFormatError("axes of nodes are (k, 3, 3), orthonormal columns.", where=where)
    order = np.argsort(labels)
    labels = labels[order].astype(np.int64)
    if (same := labels[1:] == labels[:-1]).any():
        raise FileFormatError(f"the node {labels[1:][same][0]} occurs twice.", where=where)
    return labels, points[order].astype(float), np.asarray(turned, dtype=float)[order]


def _node_file(path: Path) -> tuple[npt.NDArray[Any], ...]:
    ending = path.suffix.lower()
    if ending in CARDS:
        return read_grids(path)
    if ending not in (".inp", ".csv"):
        raise ConfigError(f"{path}: nodes must come from .inp, .csv, {', '.join(CARDS)}.")
    return _deck(path).placed() if ending == ".inp" else _table(path)


def _deck(path: Path) -> Nodes:
    deck = Nodes(path)
    for block in deck.blocks():
        if block.keyword in NODE_KEYWORDS:
            deck.take(block, NODE_KEYWORDS)
        elif block.keyword in REFUSED_KEYWORDS:
            deck.unread.add(f"*{block.keyword}", block.place)
    deck.unread.refuse()
    return deck


def _table(path: Path) -> tuple[Index, Array]:
    block = Block("NODE", {}, (check_readable(path), 1))
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            if line.strip() and not line.startswith(("**", "#")):
                block.rows.append([word.strip() for word in line.split(",")])
                block.places.append((path, number))
                if not all(block.rows[-1][:4]) or len(block.rows[-1]) < 4:
                    where = f"{path}, line {number}"
                    raise FileFormatError("a node is label, x, y, z.", where=where)
    rows = range(len(block.rows))
    labels = np.array([block.whole(r, 0) for r in rows], dtype=np.int64)
    return labels, np.array([block.reals(r, 1, 2, 3) for r in rows]).reshape(-1, 3)


def read_dofs(dofs: npt.ArrayLike | str | Path) -> Dofs | None:
    """Label and component (n, 2) of each row; component 0 is a coordinate without a place.

    Args:
        dofs: these, or a file: ``.csv`` with lines ``label, component``; ``.mapping`` of Ansys,
            with lines ``row, node, UX``; bulk data with EXTRN cards, None where there are none.

    Raises:
        ConfigError: for another ending.
        FileFormatError: naming the line, if the file is missing or damaged, or a row occurs twice.

    Source:
        Ansys Mechanical APDL command reference, HBMAT; MSC Nastran Quick Reference Guide, EXTRN.
    """
    where = str(dofs) if isinstance(dofs, str | Path) else "dofs"
    if not isinstance(dofs, str | Path):
        rows = np.asarray(dofs).tolist()
    elif (ending := Path(dofs).suffix.lower()) in CARDS:
        rows = list(_retained(Path(dofs)))
    elif ending in (".csv", ".mapping"):
        rows = list(_listed(Path(dofs), ending == ".mapping"))
    else:
        raise ConfigError(f"{dofs}: dofs must come from .csv, .mapping, or bulk data with EXTRN.")
    if not rows and isinstance(dofs, str | Path):
        return None
    with damaged("dofs are (n, 2) labels and components, 0 to 6, each once", where):
        found = np.array(rows)
        fits = found.ndim == 2 and found.shape[1] == 2 and np.issubdtype(found.dtype, np.integer)
        need(fits, f"these are of shape {found.shape}")
        need(((found[:, 1] >= 0) & (found[:, 1] <= 6)).all(), "a component is another")
        own, n = np.unique(found, axis=0, return_counts=True)
        need(len(own) == len(found), f"{own[n.argmax()].tolist()} comes twice")
    return found.astype(np.int64)


def _retained(path: Path) -> Iterator[tuple[int, int]]:
    """Those of EXTRN cards, pairs of a grid point and all its components, in ascending order."""
    found = set[tuple[int, int]]()
    for card in cards(path):
        if card.name == "EXTRN":
            for k in range(0, len(card.fields), 2):
                if card.text(k):
                    label = card.whole(k)
                    found |= {(label, int(c)) for c in str(card.whole(k + 1, 0))}
    return iter(sorted(found))


def _listed(path: Path, mapped: bool) -> Iterator[tuple[int, int]]:
    """Of lines of text; in a mapping these begin with the number of a row, in any order."""
    what = "a line is row, node, UX to ROTZ" if mapped else "a line is label, component"
    found = list[tuple[int, ...]]()
    with lines_of(path, what) as lines:
        for line in lines:
            words = line.partition("#")[0].replace(",", " ").split()
            if mapped and words and words[0].isdecimal():
                row, label, name = words
                found.append((int(row), whole(label), COMPONENTS[name.upper()]))
            elif words and not mapped:
                label, component = words
                found.append((len(found) + 1, whole(label), whole(component)))
        found.sort()
        need([row[0] for row in found] == list(range(1, len(found) + 1)), "a row is missing")
    return ((label, component) for _, label, component in found)


def read_node_sets(path: str | Path, names: tuple[str, ...]) -> dict[str, Index]:
    """{name: (k,) labels} of the nodes of sets, ``*NSET`` or ``*NODE, NSET=``, of an input deck.

    Args:
        path: the deck, ``.inp``.
        names: sets wanted, capitals or not.

    Raises:
        ConfigError: if the file is no ``.inp``.
        FileFormatError: naming the line, if it is missing or damaged.
        InterfaceError: listing the sets that exist.
    """
    path = Path(path)
    if path.suffix.lower() != ".inp":
        text = f"sets of nodes are read from .inp, not from {path}"
        raise ConfigError(f"{text}; give a dictionary of labels.")
    sets = _deck(path).node_sets
    known = {name: name.upper() for name in names}
    missing = [name for name, key in known.items() if key not in sets.members]
    if missing:
        raise InterfaceError(f"{path} has no set {named(missing)}; it has {offered(sets.members)}.")
    with in_file(path):
        return {name: sets.of(key) for name, key in known.items()}
