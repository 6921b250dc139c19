"""Nodes, and sets of nodes, in the files of other finite element programs."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rom.errors import ConfigError, FileFormatError, InterfaceError, UnsafeFileError
from rom.io.files import check_readable
from rom.io.matrices.dmig import read_grids, whole
from rom.model import Array, Index
from rom.names import named, offered

CARDS = (".bdf", ".dat")
WITH_FILES, MOST_INCLUDED = ("*INCLUDE", "*NODE", "*NSET"), 20
MOST_NESTED, MOST_NODES = 200, 100_000_000  # sets in sets, nodes in a set


def read_nodes(nodes: Any) -> tuple[Index, Array]:
    """Ascending labels (k,) and positions (k, 3), in units of the file.

    Args:
        nodes: both; or a file: ``.inp``, ``.bdf``, ``.dat`` or ``.csv``.

    Raises:
        ConfigError: for another ending.
        FileFormatError: naming the line, if a file is missing or damaged, or a label occurs twice.
    """
    if isinstance(nodes, str | Path):
        where, (labels, points) = str(nodes), _node_file(Path(nodes))
    else:
        where, (labels, points) = "nodes", (np.asarray(part) for part in nodes)
    if points.shape != (labels.size, 3) or not labels.size or not np.isfinite(points).all():
        raise FileFormatError(f"{labels.size} labels and positions {points.shape}.", where=where)
    order = np.argsort(labels)
    labels = labels[order].astype(np.int64)
    if (same := labels[1:] == labels[:-1]).any():
        raise FileFormatError(f"the node {labels[1:][same][0]} occurs twice.", where=where)
    return labels, points[order].astype(float)


def _node_file(path: Path) -> tuple[Index, Array]:
    ending = path.suffix.lower()
    if ending in CARDS:
        return read_grids(path)
    if ending not in (".inp", ".csv"):
        raise ConfigError(f"nodes are read from .inp, .bdf, .dat or .csv, not from {path}.")
    rows = []
    for line in _lines(path):
        if line.keyword == ("" if ending == ".csv" else "*NODE"):
            try:
                rows.append((whole(line.words[0]), *(float(line.words[k]) for k in (1, 2, 3))))
            except (ValueError, IndexError) as error:
                raise FileFormatError("a node is label, x, y, z.", where=line.where) from error
    labels = np.array([row[0] for row in rows], dtype=np.int64)
    return labels, np.array([row[1:] for row in rows]).reshape(-1, 3)


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
        raise ConfigError(
            f"sets of nodes are read from .inp, not from {path}.",
            hint="Give a dictionary of labels.",
        )
    sets = _Sets()
    for line in _lines(path):
        name = line.options.get("NSET", "").upper()
        if not name or line.keyword not in ("*NSET", "*NODE"):
            continue
        members = sets.members.setdefault(name, [])
        if line.keyword == "*NODE":
            members.append(line.whole(0))
        elif "GENERATE" in line.options:
            step = line.whole(2) if len(line.words) > 2 else 1
            members.append(range(line.whole(0), line.whole(1) + 1, max(step, 1)))
        else:
            members += [
                line.whole(k) if w.isdecimal() else w.upper() for k, w in enumerate(line.words) if w
            ]
    known = {name: name.upper() for name in names}
    missing = [name for name, key in known.items() if key not in sets.members]
    if missing:
        raise InterfaceError(f"{path} has no set {named(missing)}; it has {offered(sets.members)}.")
    return {name: sets.of(key, str(path)) for name, key in known.items()}


@dataclass(slots=True)
class _Sets:
    """Members of each set: labels, ranges of labels, names of sets; each is resolved once."""

    members: dict[str, list[Any]] = field(default_factory=dict)
    known: dict[str, Index | None] = field(default_factory=dict)

    def of(self, name: str, where: str) -> Index:
        if name in self.known and (found := self.known[name]) is not None:
            return found
        if name not in self.members or name in self.known or len(self.known) > MOST_NESTED:
            what = "in itself" if name in self.known else "unknown, or nested too deep"
            raise FileFormatError(f"the set {name!r} is {what}.", where=where)
        self.known[name] = None
        parts = [np.zeros(0, dtype=np.int64)]
        for member in self.members[name]:
            if isinstance(member, str):
                parts.append(self.of(member, where))
            elif isinstance(member, range) and len(member) > MOST_NODES:
                raise UnsafeFileError(f"the set {name!r} has {len(member)} nodes.", where=where)
            else:
                parts.append(np.atleast_1d(np.array(member, dtype=np.int64)))
        self.known[name] = out = np.unique(np.concatenate(parts))
        return out


@dataclass(frozen=True, slots=True)
class _Line:
    """A line of data of a deck, and the keyword it stands under."""

    keyword: str
    options: dict[str, str]
    words: list[str]
    where: str

    def whole(self, k: int) -> int:
        try:
            return whole(self.words[k])
        except (ValueError, IndexError) as error:
            raise FileFormatError("a label is a whole number.", where=self.where) from error


def _lines(
    path: Path, keyword: str = "", options: dict[str, str] | None = None, depth: int = 0
) -> Iterator[_Line]:
    """Lines of data of a deck and of the files it includes, whole or as data of a keyword."""
    check_readable(path)
    if depth > MOST_INCLUDED:
        raise FileFormatError("files include each other too deep.", where=str(path))
    options = options or {}
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            if line.startswith(("**", "#")) or not line.strip():
                continue
            words = [word.strip() for word in line.strip().rstrip(",").split(",")]
            if not line.startswith("*"):
                yield _Line(keyword, options, words, f"{path}, line {number}")
                continue
            pairs = (word.partition("=") for word in words[1:])
            found = {key.strip().upper(): value.strip() for key, _, value in pairs}
            if words[0].upper() != "*INCLUDE":
                keyword, options = words[0].upper(), found
            if "INPUT" in found and words[0].upper() in WITH_FILES:
                other = path.parent / found["INPUT"].strip("\"'")
                yield from _lines(other, keyword, options, depth + 1)
