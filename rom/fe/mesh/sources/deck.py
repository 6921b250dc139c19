"""What files of other programs share: node order, regions, faces by number and by node set."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rom.decks.rigid import Element, hung
from rom.errors import FileFormatError, MeshError, TagError
from rom.fe.mesh.cell_types import DECK_EDGES, READ_TYPES, CellType
from rom.fe.mesh.solid import Notes, Read, packed
from rom.fe.mesh.topology import outer_facets
from rom.model import Array, Index, Integers
from rom.names import named


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


Facets = dict[str, Index]  # {name: (f, kf) nodes}


@dataclass(frozen=True, slots=True)
class Solid:
    """Nodes and cells of a deck, the latter of one type, as rows of nodes in the order of gmsh."""

    labels: Index  # (n,) of the nodes
    points: Array  # (n, 3)
    ids: Index  # (m,) of the cells
    kind: CellType
    cells: Index  # (m, k)

    @classmethod
    def of(
        cls,
        labels: Index,
        points: npt.ArrayLike,
        ids: npt.ArrayLike,
        types: Iterable[str],
        nodes: Sequence[Sequence[int]] | Index,
        edges: Mapping[str, tuple[tuple[int, int], ...]] = DECK_EDGES,
    ) -> "Solid":
        """That of cells with nodes in the order of decks, those amid edges as in Abaqus or given.

        Raises:
            MeshError: where there are no cells, or several types.
            FileFormatError: where a node is not defined.
        """
        kind = READ_TYPES[only_type(types)]
        cells = positions(labels, np.array(nodes, dtype=np.int64), "node")
        places, n = kind.among(edges.get(kind.name, ())), kind.n_corners
        cells = cells[:, [*range(n), *(n + np.argsort(places))]]
        return cls(labels, np.asarray(points), np.array(ids, dtype=np.int64), kind, cells)

    def facets(self, sets: Mapping[str, Sequence[int] | Index]) -> tuple[Facets, list[str]]:
        """Outer facets all of whose corners are in a set of nodes, and remarks on sets left out."""
        outer, n = outer_facets(self.cells, self.kind, self.labels.size), self.kind.corners_per_face
        facets, remarks = {}, []
        for name, nodes in sets.items():
            chosen = np.zeros(self.labels.size, dtype=bool)
            chosen[positions(self.labels, np.array(nodes, dtype=np.int64), "node")] = True
            rows = outer[chosen[outer[:, :n]].all(axis=1)]
            if 0 < len(rows) < len(outer):
                facets[name] = rows
            else:
                what = "contains no complete facet" if not len(rows) else "is the whole surface"
                remarks.append(f"the node set {name!r} {what} and is no interface.")
        return facets, remarks

    def read(
        self,
        names: Mapping[int, str],
        regions: Integers,
        facets: Facets,
        remarks: Iterable[str],
        more: Mapping[str, Notes],
        elements: Iterable[Element] = (),
        known: Iterable[int] = (),
    ) -> Read:
        """Arrays and notes, with what hangs on nodes; a remark on nodes of no known use."""
        used = np.zeros(self.labels.size, dtype=bool)
        used[self.cells] = True
        row = dict(zip(self.labels.tolist(), range(self.labels.size), strict=True))

        def place(node: int) -> Array:
            if node not in row:
                raise FileFormatError(f"node {node} is used but not defined.")
            return self.points[row[node]]

        found = hung(elements, set(self.labels[used].tolist()), place)
        lonely = self.labels[~used & ~np.isin(self.labels, [*found.nodes, *known])]
        text = f"{lonely.size} nodes belong to no solid and are left out: {named(lonely.tolist())}"
        lost = [f"{text}; check that no element is missing."] if lonely.size else []
        told: Notes = {"ties": found.ties, "carried": found.carried, "springs": found.springs}
        told |= {"region_names": names, "warnings": [*remarks, *lost], "facets": facets, **more}
        told |= {"provenance": {"parameters": {}}}
        return packed(self.points, self.cells, self.kind.name, regions, self.ids, **told)
