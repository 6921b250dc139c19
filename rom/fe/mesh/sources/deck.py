"""What files of other programs share: node order, regions, faces by number and by node set."""

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from rom.decks.rigid import Element, hung
from rom.errors import FileFormatError, MeshError, TagError
from rom.fe.mesh.cell_types import DECK_EDGES, READ_TYPES
from rom.fe.mesh.solid import Notes
from rom.fe.mesh.topology import outer_facets
from rom.model import Array, Index
from rom.names import named

Edges = tuple[tuple[int, int], ...]


def to_gmsh(cells: Index, cell_type: str, edges: Edges | None = None) -> Index:
    """Cells in gmsh order from cells in deck order, mid-edge nodes as in Abaqus or as given."""
    kind = READ_TYPES[cell_type]
    places = kind.among(edges or DECK_EDGES.get(cell_type, ()))
    return cells[:, [*range(kind.n_corners), *(kind.n_corners + np.argsort(places))]]


def only_type(found: Iterable[str]) -> str:
    """The one cell type of a deck; a MeshError where there is none, or several."""
    types = sorted(set(found))
    if not types:
        raise MeshError("there are no volume cells in the deck.", hint="A solid is needed.")
    if len(types) > 1:
        text = f"the cells are of several types, {types}; one mesh needs one type"
        raise MeshError(f"{text}; mesh all volumes with tetrahedra, or all with hexahedra.")
    return types[0]


def regions_of(
    sets: Mapping[str, Index], ids: Index, what: str, hint: str = ""
) -> tuple[dict[int, str], Index]:
    """{region number: name} and the region number of each cell, of the rows in each set.

    Without any set the whole solid is the region "body"; else each cell must be in one.
    """
    names, regions = dict(enumerate(sets or ["body"], 1)), np.full(ids.size, int(not sets))
    for number, (name, rows) in enumerate(sets.items(), 1):
        if (both := rows[regions[rows] > 0]).size:
            first = names[regions[both[0]]]
            text = f"element {ids[both[0]]} is in the {what}s {first!r} and {name!r}"
            raise TagError(f"{text}; give it to only one.")
        regions[rows] = number
    if not regions.all():
        text = f"element {ids[regions == 0][0]} is in no {what}, while {sorted(sets)} are."
        raise TagError(text, hint=hint or f"Give every solid element a {what}, or none.")
    return names, regions


def of_materials(read: Callable[..., Notes], *deck: object) -> dict[str, Notes]:
    """Materials of the regions, or why they are not read, which hurts where nobody gives others."""
    try:
        return {"materials": read(*deck)}
    except FileFormatError as error:
        hint = "Materials of your own take their place: material=, or --material."
        return {"unread": {"message": error.message, "where": error.where, "hint": hint}}


def facets_of_nodes(
    cells: Index, sets: Mapping[str, Index], cell_type: str, n_points: int
) -> tuple[dict[str, Index], list[str]]:
    """Outer facets all of whose corners are in a node set, and remarks on sets left out."""
    outer = outer_facets(cells, READ_TYPES[cell_type], n_points)
    facets, remarks = {}, []
    for name, nodes in sets.items():
        chosen = np.zeros(n_points, dtype=bool)
        chosen[nodes] = True
        rows = outer[chosen[outer[:, : READ_TYPES[cell_type].corners_per_face]].all(axis=1)]
        if 0 < len(rows) < len(outer):
            facets[name] = rows
        else:
            what = "contains no complete facet" if not len(rows) else "is the whole surface"
            remarks.append(f"the node set {name!r} {what} and is no interface.")
    return facets, remarks


def positions(ids: Index, wanted: Index, what: str) -> Index:
    """Rows of the wanted numbers among those of a deck, in any order; refused twice, or missing."""
    order = np.argsort(ids, kind="stable")
    ordered = ids[order]
    if (twice := ordered[1:][ordered[1:] == ordered[:-1]]).size:
        raise FileFormatError(f"{what} {named(np.unique(twice).tolist())} is defined twice.")
    if not ordered.size:
        raise FileFormatError(f"no {what} is defined.")
    place = np.minimum(np.searchsorted(ordered, wanted), ordered.size - 1)
    if (missing := np.asarray(wanted)[ordered[place] != wanted]).size:
        raise FileFormatError(
            f"{what} {named(np.unique(missing).tolist())} is used but not defined."
        )
    return order[place]


def hung_on(
    elements: Iterable[Element], ids: Index, points: Array, cells: Index, known: Iterable[int] = ()
) -> tuple[Notes, list[str]]:
    """Ties, what they carry, and springs as notes; a remark on nodes of no known use."""
    solid = np.zeros(ids.size, dtype=bool)
    solid[cells] = True
    row = dict(zip(ids.tolist(), range(ids.size), strict=True))

    def place(node: int) -> Array:
        if node not in row:
            raise FileFormatError(f"node {node} is used but not defined.")
        return points[row[node]]

    found = hung(elements, set(ids[solid].tolist()), place)
    lonely = ids[~solid & ~np.isin(ids, [*found.nodes, *known])]
    text = f"{lonely.size} nodes belong to no solid and are left out: {named(lonely.tolist())}"
    remarks = [f"{text}; check that no element is missing."] if lonely.size else []
    return {"ties": found.ties, "carried": found.carried, "springs": found.springs}, remarks
