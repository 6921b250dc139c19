"""Nastran bulk data, read by meshio.

Regions are the property numbers of the solids ("property_1"). Interfaces are skin elements
(CTRIA3, CTRIA6, CQUAD4, CQUAD8) by property number ("property_5") and the nodes of SPC and SPC1
cards by set number ("spc_7"), where they contain whole facets of the outer surface.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np

from rom.errors import FileFormatError, MeshError
from rom.fe.mesh.solid import Read, packed
from rom.fe.mesh.sources.deck import facets_of_nodes, only_type, outer_facets, positions, to_gmsh
from rom.model import Index

SOLIDS = {"tetra": "tet4", "tetra10": "tet10", "hexahedron": "hex8", "hexahedron20": "hex20"}
PROPERTY_FIELD = "nastran:ref"


def read(path: str) -> Read:
    """Read bulk data; see `rom.fe.mesh.sources.readers.read`.

    Raises:
        FileFormatError: the file is damaged, or solids have no property.
        MeshError: no solid cells, or of several types.
    """
    import meshio

    mesh = meshio.read(path, file_format="nastran")
    solids = [i for i, block in enumerate(mesh.cells) if block.dim == 3]
    cell_type = only_type(SOLIDS.get(mesh.cells[i].type, mesh.cells[i].type) for i in solids)
    cells = np.vstack([mesh.cells[i].data for i in solids]).astype(np.int64)
    if cell_type not in SOLIDS.values():
        raise MeshError(f"cells of type {cell_type!r} are not supported; {sorted(SOLIDS)} are.")
    properties = np.concatenate([_property(mesh, i) for i in solids])
    sets = _skin(mesh) | _constrained(Path(path), mesh.points_id)
    cells, n = to_gmsh(cells, cell_type), len(mesh.points)
    facets, remarks = facets_of_nodes(outer_facets(cells, cell_type, n), sets, cell_type, n)
    return packed(
        mesh.points,
        cells,
        cell_type,
        properties,
        np.concatenate([mesh.cells_id[i] for i in solids]),
        facets=facets,
        region_names={int(p): f"property_{p}" for p in np.unique(properties)},
        warnings=remarks,
        provenance={"meshio": meshio.__version__, "parameters": {}},
    )


def _property(mesh: Any, block: int) -> Index:
    numbers = mesh.cell_data.get(PROPERTY_FIELD, [])
    if block >= len(numbers) or len(numbers[block]) != len(mesh.cells[block].data):
        raise FileFormatError("elements have no property number.", hint="Give each cell a PID.")
    return np.asarray(numbers[block], dtype=np.int64)


def _skin(mesh: Any) -> dict[str, Index]:
    """Nodes of skin elements by property."""
    found: dict[str, Index] = {}
    for i, block in enumerate(mesh.cells):
        if block.dim == 2:
            numbers = _property(mesh, i)
            for p in np.unique(numbers):
                name = f"property_{p}"
                nodes = np.unique(np.asarray(block.data)[numbers == p])
                found[name] = np.union1d(found.get(name, nodes), nodes)
    return found


def _constrained(path: Path, ids: Index) -> dict[str, Index]:
    """Nodes of SPC and SPC1 cards by set number."""
    found: dict[str, list[int]] = {}
    for fields in _cards(path.read_text(encoding="utf-8")):
        nodes = _spc1(fields[3:]) if fields[0] == "SPC1" else [int(x) for x in fields[2::3] if x]
        found.setdefault(f"spc_{int(fields[1])}", []).extend(nodes)
    return {name: positions(ids, np.array(nodes), "node") for name, nodes in found.items()}


def _cards(text: str) -> list[list[str]]:
    """Fields of the SPC and SPC1 cards, continuation lines joined."""
    cards: list[list[str]] = []
    inside = False
    for line in text.splitlines():
        line = line.partition("$")[0].rstrip()
        if inside and re.match(r"[+*,]|\s{8}\S", line):
            cards[-1] += _fields(line)[1:9]
            continue
        inside = re.match(r"SPC1?\b(?!\*)", line) is not None
        if inside:
            cards.append([f.upper() for f in _fields(line)[:9]])
    return [_trimmed(card) for card in cards]


def _fields(line: str) -> list[str]:
    if "," in line:
        return [f.strip() for f in line.split(",")]
    return [line[i : i + 8].strip() for i in range(0, max(len(line), 8), 8)]


def _trimmed(card: list[str]) -> list[str]:
    while card and not card[-1]:
        card = card[:-1]
    return card


def _spc1(fields: list[str]) -> list[int]:
    words = [f.upper() for f in fields if f]
    if len(words) == 3 and words[1] == "THRU":
        return list(range(int(words[0]), int(words[2]) + 1))
    return [int(w) for w in words]
