"""Meshes of Salome and Code_Aster, ``.med``.

Groups of cells are regions, groups of facets interfaces, and groups of nodes, too, where they hold
whole facets of the outer surface. Read by h5py: meshio 5.0 fails on groups of nodes.

Source:
    MED-fichier 4, data model: meshes, families, connectivity without interlacing.
"""

from typing import Any

import numpy as np

from rom.errors import FileFormatError
from rom.fe.mesh.solid import Read
from rom.fe.mesh.sources.deck import Solid, only_type, regions_of
from rom.model import Index
from rom.names import named

SOLIDS = {"TE4": "tet4", "T10": "tet10", "HE8": "hex8", "H20": "hex20"}
SKINS = ("TR3", "TR6", "QU4", "QU8")
LINES = ("PO1", "SE2", "SE3")  # points and curves carry no mass here
Group = Any  # of h5py


def read(path: str) -> Read:
    """Read the one mesh of a file, at its first step."""
    import h5py

    try:
        file = h5py.File(path)
    except OSError as error:
        raise FileFormatError(f"is no MED file, or is cut: {error}.") from error
    with file:
        meshes = file.get("ENS_MAA", {})
        if len(meshes) != 1:
            text = f"it holds {len(meshes)} meshes, {named(list(meshes))}, and one is read."
            raise FileFormatError(text, hint="Export the mesh of the solid alone.")
        ((name, steps),) = meshes.items()
        groups = {kind: _groups(file[f"FAS/{name}"].get(kind, {})) for kind in ("ELEME", "NOEUD")}
        return _mesh(next(iter(steps.values())), groups)


def _mesh(step: Group, groups: dict[str, dict[int, list[str]]]) -> Read:
    points = step["NOE/COO"][()].reshape(3, -1).T
    blocks = {kind: step["MAI"][kind] for kind in step["MAI"] if kind not in LINES}
    cell_type = only_type(SOLIDS.get(kind, kind) for kind in blocks if kind not in SKINS)
    if cell_type not in SOLIDS.values():
        raise FileFormatError(f"cells are {cell_type}, none of {named(list(SOLIDS))}.")
    (block,) = (block for kind, block in blocks.items() if kind in SOLIDS)
    ids = block["NUM"][()] if "NUM" in block else np.arange(int(block["NOD"].attrs["NBR"])) + 1
    solid = Solid.of(np.arange(len(points)), points, ids, [cell_type], _nodes(block))
    names, regions = regions_of(_members(block, groups["ELEME"]), ids, "group")
    facets: dict[str, Index] = {}
    for kind in sorted(blocks.keys() & set(SKINS)):
        skin, members = _nodes(blocks[kind]), _members(blocks[kind], groups["ELEME"])
        facets |= {name: skin[rows] for name, rows in members.items()}
    found, remarks = solid.facets(_members(step["NOE"], groups["NOEUD"]))
    return solid.read(names, regions, found | facets, remarks, {})


def _nodes(block: Group) -> Index:
    """(n, k) numbers of the nodes, from zero; stored are all first ones, all second ones, ..."""
    return block["NOD"][()].reshape(-1, int(block["NOD"].attrs["NBR"])).T - 1


def _groups(families: Group) -> dict[int, list[str]]:
    """Names of the groups that each family belongs to."""
    found = {}
    for family in families.values():
        rows = family["GRO/NOM"][()] if "GRO" in family else ()
        texts = (bytes(row.astype(np.uint8)).decode("utf-8", "replace") for row in rows)
        found[int(family.attrs["NUM"])] = [text.partition("\0")[0].strip() for text in texts]
    return found


def _members(block: Group, groups: dict[int, list[str]]) -> dict[str, Index]:
    """Rows of a block in each group."""
    family = block["FAM"][()] if "FAM" in block else np.zeros(0)
    found: dict[str, list[Index]] = {}
    for number, names in groups.items():
        for name in names if (family == number).any() else ():
            found.setdefault(name, []).append(np.flatnonzero(family == number))
    return {name: np.sort(np.concatenate(rows)) for name, rows in found.items()}
