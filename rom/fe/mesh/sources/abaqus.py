"""Abaqus decks.

Regions are the element sets of ``*SOLID SECTION``, or without any the ``ELSET`` of ``*ELEMENT``.
Interfaces are ``*SURFACE`` of element faces or nodes, skin elements (S3, S4, M3D3, ...) by their
``ELSET``, and each ``*NSET`` that contains whole facets of the outer surface. One flat part.
meshio 5.0 is not used here: it keeps only the last ``*NODE`` block and drops surfaces.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from rom.errors import FileFormatError, MeshError, TagError
from rom.fe.mesh.solid import Read, packed
from rom.fe.mesh.sources.deck import (
    QUADRATIC_HEX,
    facets_of_nodes,
    kind_of,
    only_type,
    outer_facets,
    positions,
    rings,
    to_gmsh,
)
from rom.model import Array, Index
from rom.names import is_whole

SOLIDS = {4: "tet4", 10: "tet10", 8: "hex8", 20: "hex20"}
SKIN_TYPES = ("S3", "S4", "S6", "S8", "STRI3", "STRI65", "M3D3", "M3D4", "M3D6", "M3D8", "SFM3D")
# corners of the faces S1, S2, ... of a cell
SIDES = {
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}


@dataclass
class Deck:
    """What a deck says, in its own numbers. Sets hold numbers and names of other sets."""

    nodes: list[list[str]] = field(default_factory=list)
    blocks: list[tuple[str, str, list[list[str]]]] = field(
        default_factory=list
    )  # type, elset, rows
    node_sets: dict[str, list[int | str]] = field(default_factory=dict)
    cell_sets: dict[str, list[int | str]] = field(default_factory=dict)
    surfaces: dict[str, tuple[str, list[list[str]]]] = field(default_factory=dict)
    sections: list[str] = field(default_factory=list)


def read(path: str) -> Read:
    """Read a deck; see `rom.fe.mesh.sources.readers.read`.

    Raises:
        FileFormatError: the deck is damaged, or has parts this reader does not follow.
        MeshError: no solid cells, or of several types.
        TagError: an element in two sections, or in none.
    """
    deck = Deck()
    for keyword, options, rows in _sections(Path(path).read_text(encoding="utf-8")):
        BLOCK_READERS.get(keyword, _ignore)(deck, options, rows)
    blocks = [block for block in deck.blocks if not block[0].startswith(SKIN_TYPES)]
    cell_type = only_type(_solid(block[0]) for block in blocks)
    width = QUADRATIC_HEX if cell_type == "hex20" else kind_of(cell_type).n_nodes
    tables = [_table(rows, width) for _, _, rows in blocks]
    own: dict[str, list[int | str]] = {}
    for (_, name, _), table in zip(blocks, tables, strict=True):
        own.setdefault(name or "body", []).extend(table[:, 0].tolist())
    ids, raw = np.vstack(tables)[:, 0], np.vstack(tables)[:, 1:]
    positions(ids, ids[:1], "element")  # refuses a number given twice
    deck = replace(deck, cell_sets={**deck.cell_sets, **own})
    node_ids, points = _points(deck)
    cells = to_gmsh(positions(node_ids, raw, "node"), cell_type)
    names, regions = _regions(deck, list(own), ids)
    facets, remarks = _facets(deck, ids, cells, cell_type, node_ids)
    return packed(
        points, cells, cell_type, regions, ids,
        facets=facets, region_names=names, warnings=remarks, provenance={"parameters": {}},
    )  # fmt: skip


def _sections(text: str) -> Iterator[tuple[str, dict[str, str], list[list[str]]]]:
    """(keyword, options, data rows) of each keyword line."""
    rows: list[list[str]] = []
    keyword, line_open = "", False
    for line in text.splitlines():
        line = line.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*") or line_open:
            if line_open:
                keyword += line
            else:
                if keyword:
                    yield *_options(keyword), rows
                keyword, rows = line, []
            line_open = line.endswith(",")
        else:
            rows.append([x.strip() for x in line.split(",")])
    if keyword:
        yield *_options(keyword), rows


def _options(line: str) -> tuple[str, dict[str, str]]:
    words = [w.strip() for w in line.lstrip("*").split(",") if w.strip()]
    pairs = [w.partition("=") for w in words[1:]]
    name = " ".join(words[0].upper().split()) if words else ""
    return name, {k.strip().upper(): v.strip().strip('"') for k, _, v in pairs}


def _node(deck: Deck, options: dict[str, str], rows: list[list[str]]) -> None:
    deck.nodes += rows
    if "NSET" in options:
        deck.node_sets.setdefault(options["NSET"], []).extend(int(row[0]) for row in rows)


def _element(deck: Deck, options: dict[str, str], rows: list[list[str]]) -> None:
    deck.blocks.append((_needed(options, "TYPE").upper(), options.get("ELSET", ""), rows))


def _node_set(deck: Deck, options: dict[str, str], rows: list[list[str]]) -> None:
    deck.node_sets.setdefault(_needed(options, "NSET"), []).extend(_members(options, rows))


def _cell_set(deck: Deck, options: dict[str, str], rows: list[list[str]]) -> None:
    deck.cell_sets.setdefault(_needed(options, "ELSET"), []).extend(_members(options, rows))


def _needed(options: dict[str, str], name: str) -> str:
    if name not in options:
        raise FileFormatError(f"a keyword line has no {name}.")
    return options[name]


def _members(options: dict[str, str], rows: list[list[str]]) -> list[int | str]:
    if "GENERATE" in options:
        ranges = [[*(int(x) for x in row if x), 1][:3] for row in rows]
        return [i for first, last, step in ranges for i in range(first, last + 1, step)]
    return [_number(x) for row in rows for x in row if x]


def _number(word: str) -> int | str:
    return int(word) if is_whole(word) else word.strip('"')


def _numbers(sets: dict[str, list[int | str]], name: int | str, depth: int = 20) -> list[int]:
    """Numbers in a set, those of the sets it names included."""
    if isinstance(name, int):
        return [name]
    if name not in sets:
        raise FileFormatError(f"the set {name!r} is used but not defined.")
    if not depth:
        raise FileFormatError(f"the set {name!r} contains itself.")
    return [i for one in sets[name] for i in _numbers(sets, one, depth - 1)]


def _surface(deck: Deck, options: dict[str, str], rows: list[list[str]]) -> None:
    deck.surfaces[_needed(options, "NAME")] = options.get("TYPE", "ELEMENT").upper(), rows


def _section(deck: Deck, options: dict[str, str], rows: list[list[str]]) -> None:
    deck.sections.append(_needed(options, "ELSET"))


def _foreign(deck: Deck, options: dict[str, str], rows: list[list[str]]) -> None:
    raise FileFormatError(
        "the deck has *INCLUDE or a moved *INSTANCE, which this reader does not follow.",
        hint="Write one flat input file, without parts and includes.",
    )


def _instance(deck: Deck, options: dict[str, str], rows: list[list[str]]) -> None:
    if rows:
        _foreign(deck, options, rows)


def _ignore(deck: Deck, options: dict[str, str], rows: list[list[str]]) -> None:
    pass


BLOCK_READERS = {
    "NODE": _node,
    "ELEMENT": _element,
    "NSET": _node_set,
    "ELSET": _cell_set,
    "SURFACE": _surface,
    "SOLID SECTION": _section,
    "INCLUDE": _foreign,
    "INSTANCE": _instance,
}


def _solid(name: str) -> str:
    digits = "".join(c for c in name.removeprefix("C3D") if c.isdigit())
    if not name.startswith("C3D") or not is_whole(digits) or int(digits) not in SOLIDS:
        raise MeshError(
            f"elements of type {name} are not supported.",
            hint="Supported are C3D4, C3D10, C3D8, C3D20 and their variants.",
        )
    return SOLIDS[int(digits)]


def _table(rows: list[list[str]], width: int) -> Index:
    """(m, 1 + width) element number and nodes; an element may run over several lines."""
    numbers = np.array([int(x) for row in rows for x in row if x], dtype=np.int64)
    if numbers.size % (width + 1):
        raise FileFormatError(
            f"an *ELEMENT block has {numbers.size} numbers, not a multiple of "
            f"{width + 1}: a line is cut."
        )
    return numbers.reshape(-1, width + 1)


def _points(deck: Deck) -> tuple[Index, Array]:
    """(n,) node numbers and (n, 3) coordinates."""
    ids = np.array([int(row[0]) for row in deck.nodes], dtype=np.int64)
    return ids, np.array([[float(x) for x in row[1:4]] for row in deck.nodes]).reshape(-1, 3)


def _regions(deck: Deck, own: list[str], ids: Index) -> tuple[dict[int, str], Index]:
    """{region number: name} and the region number of each cell."""
    names = dict(enumerate(deck.sections or own, 1))
    regions = np.zeros(ids.size, dtype=np.int64)
    for number, name in names.items():
        chosen = np.isin(ids, np.array(_numbers(deck.cell_sets, name), dtype=np.int64))
        if (both := chosen & (regions > 0)).any():
            raise TagError(
                f"element {ids[both][0]} is in the sections {names[regions[both][0]]!r} and "
                f"{name!r}; it must be in one."
            )
        regions[chosen] = number
    if not regions.all():
        raise TagError(
            f"element {ids[regions == 0][0]} is in no section, while {sorted(names.values())} are.",
            hint="Every solid element needs a *SOLID SECTION.",
        )
    return names, regions


def _facets(
    deck: Deck, ids: Index, cells: Index, cell_type: str, node_ids: Index
) -> tuple[dict[str, Index], list[str]]:
    n = node_ids.size
    outer = outer_facets(cells, cell_type, n)
    facets: dict[str, Index] = {}
    sets = {k: v for k, v in deck.node_sets.items() if k not in deck.surfaces}
    for name, (kind, rows) in deck.surfaces.items():
        if kind == "NODE":
            sets[name] = [_number(row[0]) for row in rows]
        else:
            facets[name] = np.vstack([_sides(deck, row, ids, cells, cell_type) for row in rows])
    for name, nodes in _skin_nodes(deck).items():
        sets.setdefault(name, nodes)
    found = {
        name: positions(node_ids, np.array(_all_numbers(deck, members), dtype=np.int64), "node")
        for name, members in sets.items()
    }
    by_nodes, remarks = facets_of_nodes(outer, found, cell_type, n)
    return facets | by_nodes, remarks


def _all_numbers(deck: Deck, members: list[int | str]) -> list[int]:
    return [i for one in members for i in _numbers(deck.node_sets, one)]


def _skin_nodes(deck: Deck) -> dict[str, list[int | str]]:
    """Nodes of the skin elements by element set."""
    found: dict[str, list[int | str]] = {}
    for kind, name, rows in deck.blocks:
        if kind.startswith(SKIN_TYPES) and name:
            found.setdefault(name, []).extend(int(x) for row in rows for x in row[1:] if x)
    return found


def _sides(deck: Deck, row: list[str], ids: Index, cells: Index, cell_type: str) -> Index:
    """(f, kf) facets of one line ``element or set, S1``."""
    members = np.array(_numbers(deck.cell_sets, _number(row[0])), dtype=np.int64)
    kind = kind_of(cell_type)
    sides = [set(side) for side in SIDES[kind.n_corners]]
    label = row[1].upper() if len(row) > 1 else ""
    if label not in {f"S{i + 1}" for i in range(len(sides))}:
        raise FileFormatError(f"{label!r} is no face of a {kind.shape}; S1 to S{len(sides)} are.")
    face = next(i for i, f in enumerate(kind.faces) if set(f) == sides[int(label[1:]) - 1])
    return cells[positions(ids, members, "element")][:, rings(cell_type)[face]]
