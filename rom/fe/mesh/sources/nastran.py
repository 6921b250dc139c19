"""Nastran bulk data.

Regions are the property numbers of the solids ("property_1"), made of their MAT1. Interfaces are
skin elements (CTRIA3, CTRIA6, CQUAD4, CQUAD8) by property number ("property_5") and the nodes of
SPC and SPC1 cards by set number ("spc_7"), where they contain whole facets of the outer surface.
Every card is read, left aside because a free body does not need it, or refused by name.
"""

from pathlib import Path

import numpy as np

from rom.decks.bulk import POINTS, Card, cards, grids
from rom.decks.lines import Unread
from rom.fe.mesh.cell_types import LOWER_EDGES, UPPER_EDGES, UPRIGHT_EDGES
from rom.fe.mesh.solid import Read, packed
from rom.fe.mesh.sources.deck import (
    facets_of_nodes,
    of_materials,
    only_type,
    positions,
    to_gmsh,
    unused,
)
from rom.model import Index

SOLIDS = {"CTETRA": {4: "tet4", 10: "tet10"}, "CHEXA": {8: "hex8", 20: "hex20"}}
# mid-edge nodes where not as in Abaqus
EDGES = {"hex20": (*LOWER_EDGES, *UPRIGHT_EDGES, *UPPER_EDGES)}
SKIN_CARDS = {"CTRIA3": 3, "CTRIA6": 3, "CQUAD4": 4, "CQUAD8": 4}  # corners
LINES = ("CBAR",)  # without a property, as gmsh writes curves
MESH_CARDS = {*POINTS, *SOLIDS, *SKIN_CARDS, "SPC", "SPC1"}
SECTIONS, MATERIALS = ("PSOLID", "PLSOLID"), "MAT"
OF_MAT1 = {"MAT1", "MATS1", "MATCID"}  # with what a linear isotropic solid does not need
HARMLESS_CARDS = tuple("EIG TABLE SET1 SET3 PLOTEL ECHO".split())
CONTRADICTION = 0.01  # of E, G and NU, from where Nastran warns
# loads, supports, steps, and what a reduction there holds
LOAD_CARDS = set(
    "FORCE FORCE1 FORCE2 MOMENT MOMENT1 MOMENT2 PLOAD PLOAD1 PLOAD2 PLOAD4 GRAV ACCEL ACCEL1 "
    "RFORCE LOAD DLOAD DAREA TLOAD1 TLOAD2 RLOAD1 RLOAD2 DELAY DPHASE LSEQ RANDPS TEMP TEMPD "
    "TEMPP1 SPCD SPCADD SUPORT SUPORT1 FREQ FREQ1 FREQ2 FREQ3 FREQ4 TSTEP TSTEPNL NLPARM TIC "
    "ASET ASET1 BSET BSET1 CSET CSET1 QSET QSET1 OMIT OMIT1 SPOINT".split()
)


def read(path: str) -> Read:
    """Read bulk data, or refuse cards whose mass or stiffness would be lost."""
    found = _sorted(Path(path))
    ids, points, _ = grids(found[0])
    solids = [card for name in SOLIDS for card in found[0].get(name, ())]
    cell_type = only_type(_type(card) for card in solids)
    raw = np.array([_nodes(card, 2) for card in solids], dtype=np.int64)
    properties = np.array([_property(card) for card in solids], dtype=np.int64)
    numbers = np.array([card.whole(0) for card in solids], dtype=np.int64)
    positions(numbers, numbers[:1], "element")  # refuses a number given twice
    cells = to_gmsh(positions(ids, raw, "node"), cell_type, EDGES.get(cell_type))
    labels = {name: np.array(nodes, dtype=np.int64) for name, nodes in _sets(found[0], ids).items()}
    sets = {name: positions(ids, nodes, "node") for name, nodes in labels.items()}
    n = len(points)
    facets, remarks = facets_of_nodes(cells, sets, cell_type, n)
    names = {int(p): f"property_{p}" for p in np.unique(properties)}
    remarks = [*found[1], *remarks, *unused(ids, cells)]
    told = {"region_names": names, "warnings": remarks, "provenance": {"parameters": {}}}
    told |= of_materials(_materials, found[0], list(names))
    return packed(points, cells, cell_type, properties, numbers, facets=facets, **told)


def _sorted(path: Path) -> tuple[dict[str, list[Card]], list[str]]:
    """Cards that are read, by name, and remarks on those that need not be."""
    found: dict[str, list[Card]] = {}
    unread, aside = Unread(), Unread()
    for card in cards(path):
        if card.name in SECTIONS and card.text(6) not in ("", "SMECH"):
            unread.add(f"{card.name}, {card.text(6)}", card.place)
        elif card.name in (*MESH_CARDS, *SECTIONS, "PARAM") or card.name.startswith(MATERIALS):
            found.setdefault(card.name, []).append(card)
        elif card.name in LOAD_CARDS or card.name in LINES:
            aside.add(card.name, card.place)
        elif not card.name.startswith(HARMLESS_CARDS):
            unread.add(card.name, card.place)
    unread.refuse()
    return found, aside.remark()


def _type(card: Card) -> str:
    nodes, known = _nodes(card, 2), SOLIDS[card.name]
    if len(nodes) not in known:
        raise card.wrong(f"it has {len(nodes)} nodes, not {' or '.join(map(str, known))}")
    return known[len(nodes)]


def _nodes(card: Card, start: int) -> list[int]:
    """Labels from a field on, up to the last that is not empty or zero."""
    words = card.fields[start:]
    while words and not words[-1].strip("0"):
        words = words[:-1]
    return [card.whole(k) for k in range(start, start + len(words))]


def _property(card: Card) -> int:
    if not card.text(1):
        raise card.wrong("it has no property number")
    return card.whole(1)


def _materials(found: dict[str, list[Card]], properties: list[int]) -> dict[str, list[float]]:
    """{region: E, nu and rho} of the material of each property, in units of the deck."""
    sections = _numbered([card for name in SECTIONS for card in found.get(name, ())], properties)
    used, unread = [card.whole(1) for card in sections], Unread()
    for name in sorted(found.keys() - OF_MAT1):
        for card in found[name]:
            if name.startswith(MATERIALS) and card.whole(0) in used:
                unread.add(name, card.place)
    unread.refuse()
    factors = {card.reals(1)[0] for card in found.get("PARAM", ()) if card.text(0) == "WTMASS"}
    if len(factors) > 1:
        raise found["PARAM"][0].wrong(f"WTMASS has the values {sorted(factors)}")
    solids = (_isotropic(card, *factors) for card in _numbered(found.get("MAT1", []), used))
    return {f"property_{p}": numbers for p, numbers in zip(properties, solids, strict=True)}


def _numbered(some: list[Card], wanted: list[int]) -> list[Card]:
    """The cards of these numbers, each there once."""
    labels, name = np.array([card.whole(0) for card in some]), some[0].name if some else "MAT1"
    return [some[k] for k in positions(labels, np.array(wanted), name)]


def _isotropic(card: Card, per_weight: float = 1.0) -> list[float]:
    """E, nu and rho of a MAT1, of whose E, G and NU one may be missing."""
    E, G, nu, rho = card.reals(1, 2, 3, 4)
    if (E > 0) + (G > 0) + bool(card.text(3)) < 2:
        raise card.wrong("two of E, G and NU are needed")
    if rho <= 0:
        raise card.wrong(f"RHO = {rho:g}, and a body needs mass")
    E = E or 2 * (1 + nu) * G
    nu = nu if card.text(3) else E / (2 * G) - 1
    if G and abs(E - 2 * (1 + nu) * G) > CONTRADICTION * E:
        raise card.wrong(f"E = {E:g}, G = {G:g} and NU = {nu:g} contradict each other")
    return [E, nu, rho * per_weight]


def _sets(found: dict[str, list[Card]], ids: Index) -> dict[str, list[int]]:
    """Nodes of skin elements by property, and of SPC and SPC1 cards by set number."""
    sets: dict[str, list[int]] = {}
    for name, n_corners in SKIN_CARDS.items():
        for card in found.get(name, ()):
            corners = [card.whole(k) for k in range(2, 2 + n_corners)]
            sets.setdefault(f"property_{_property(card)}", []).extend(corners)
    for card in [*found.get("SPC", ()), *found.get("SPC1", ())]:
        sets.setdefault(f"spc_{card.whole(0)}", []).extend(_held(card, ids))
    return sets


def _held(card: Card, ids: Index) -> list[int]:
    if card.text(3) == "THRU":  # not all points in between need exist
        between = (ids >= card.whole(2)) & (ids <= card.whole(4))
        return ids[between].tolist()
    places = (1, 4) if card.name == "SPC" else range(2, len(card.fields))
    return [card.whole(k) for k in places if card.text(k)]
