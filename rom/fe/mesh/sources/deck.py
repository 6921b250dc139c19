"""What Abaqus and Nastran decks share: node order, faces by number, faces by node set."""

from collections.abc import Iterable, Mapping

import numpy as np

from rom.errors import FileFormatError, MeshError
from rom.fe.mesh.cell_types import CELL_TYPES, CellType
from rom.fe.mesh.topology import faces_of
from rom.model import Index
from rom.names import named

QUADRATIC_HEX = 20  # nodes of a serendipity hexahedron; completed to 27 after reading
# Mid-edge nodes by their corners, in the order of Abaqus and VTK.
LOWER_EDGES, UPPER_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0)), ((4, 5), (5, 6), (6, 7), (7, 4))
UPRIGHT_EDGES = ((0, 4), (1, 5), (2, 6), (3, 7))
DECK_EDGES = {
    "tet10": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "hex20": (*LOWER_EDGES, *UPPER_EDGES, *UPRIGHT_EDGES),
}
Edges = tuple[tuple[int, int], ...]
WHOLE_TYPES = ("tet4", "hex8")


def kind_of(cell_type: str) -> CellType:
    """Faces and node order; those of hex27 also serve hex20, whose nodes are the first 20."""
    return CELL_TYPES["hex27" if cell_type == "hex20" else cell_type]


def to_gmsh(cells: Index, cell_type: str, edges: Edges | None = None) -> Index:
    """Cells in gmsh order from cells in deck order, mid-edge nodes as in Abaqus or as given."""
    if cell_type in WHOLE_TYPES:
        return cells
    n_corners = kind_of(cell_type).n_corners
    wanted = [set(s) for s in kind_of(cell_type).supports[n_corners : cells.shape[1]]]
    listed = [set(e) for e in edges or DECK_EDGES[cell_type]]
    order = [*range(n_corners), *(n_corners + listed.index(e) for e in wanted)]
    return cells[:, order]


def only_type(found: Iterable[str]) -> str:
    """The one cell type of a deck.

    Raises:
        MeshError: there is none, or several.
    """
    types = sorted(set(found))
    if not types:
        raise MeshError("there are no volume cells in the deck.", hint="A solid is needed.")
    if len(types) > 1:
        raise MeshError(
            f"the cells are of several types, {types}; one mesh needs one type.",
            hint="Use tetrahedra or hexahedra throughout.",
        )
    return types[0]


def rings(cell_type: str) -> list[list[int]]:
    """For each face, its nodes in gmsh order: corners in turn, then mid-edge nodes in turn."""
    kind = kind_of(cell_type)
    n_nodes = QUADRATIC_HEX if cell_type == "hex20" else kind.n_nodes
    edge = {frozenset(s): i for i, s in enumerate(kind.supports[:n_nodes]) if len(s) == 2}
    found = []
    for face in kind.faces:
        sides = zip(face, face[1:] + face[:1], strict=True)
        found.append([*face, *(edge[frozenset(s)] for s in sides if edge)])
    return found


def outer_facets(cells: Index, cell_type: str, n_points: int) -> Index:
    """(f, kf) facets of the outer surface."""
    faces = faces_of(cells, kind_of(cell_type), n_points)
    listed = cells[:, np.array(rings(cell_type))]
    return listed[faces.count[faces.of_cell] == 1]


def facets_of_nodes(
    outer: Index, sets: Mapping[str, Index], cell_type: str, n_points: int
) -> tuple[dict[str, Index], list[str]]:
    """Outer facets all of whose corners are in a node set, and remarks on sets left out."""
    facets, remarks = {}, []
    for name, nodes in sets.items():
        chosen = np.zeros(n_points, dtype=bool)
        chosen[nodes] = True
        rows = outer[chosen[outer[:, : kind_of(cell_type).corners_per_face]].all(axis=1)]
        if 0 < len(rows) < len(outer):
            facets[name] = rows
        else:
            what = "contains no complete facet" if not len(rows) else "is the whole surface"
            remarks.append(f"the node set {name!r} {what} and is no interface.")
    return facets, remarks


def positions(ids: Index, wanted: Index, what: str) -> Index:
    """Rows of the wanted numbers among the numbers of a deck, which come in any order.

    Raises:
        FileFormatError: a number is defined twice, or not at all.
    """
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


def unused(ids: Index, cells: Index) -> list[str]:
    """A remark on the nodes of a deck that no solid uses."""
    lonely = np.setdiff1d(np.arange(ids.size), cells)
    text = f"{lonely.size} nodes belong to no solid and are left out: {named(ids[lonely].tolist())}"
    return [f"{text}; check that no element is missing."] if lonely.size else []
