"""Nastran bulk data.

Regions are the property numbers of the solids ("property_1"), made of their MAT1. Interfaces are
skin elements (CTRIA3, CTRIA6, CQUAD4, CQUAD8) by property number ("property_5") and the nodes of
SPC and SPC1 cards by set number ("spc_7"), where they contain whole facets of the outer surface.
RBE2, RBAR and RBE3 make interfaces too ("RBE2 7"), and CONM1 and CONM2 what these and nodes carry.
Every card is read, left aside because a free body does not need it, or refused by name.

Source:
    MSC Nastran Quick Reference Guide: CONM1, CONM2, RBAR, RBE2, RBE3.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from rom.decks.bulk import POINTS, Card, cards, grids
from rom.decks.lines import Unread
from rom.decks.rigid import ALL, DISPLACED, Average, Element, PointMass, Rigid
from rom.decks.systems import System
from rom.fe.mesh.cell_types import LOWER_EDGES, UPPER_EDGES, UPRIGHT_EDGES
from rom.fe.mesh.solid import Read, packed
from rom.fe.mesh.sources.deck import (
    facets_of_nodes,
    hung_on,
    of_materials,
    only_type,
    positions,
    to_gmsh,
)
from rom.model import Array, Index

SOLIDS = {"CTETRA": {4: "tet4", 10: "tet10"}, "CHEXA": {8: "hex8", 20: "hex20"}}
# mid-edge nodes where not as in Abaqus
EDGES = {"hex20": (*LOWER_EDGES, *UPRIGHT_EDGES, *UPPER_EDGES)}
SKIN_CARDS = {"CTRIA3": 3, "CTRIA6": 3, "CQUAD4": 4, "CQUAD8": 4}  # corners
LINES = ("CBAR",)  # without a property, as gmsh writes curves
MASSES, TIES = ("CONM1", "CONM2"), ("RBE2", "RBAR", "RBE3")
MESH_CARDS = {*POINTS, *SOLIDS, *SKIN_CARDS, "SPC", "SPC1", *MASSES}
SECTIONS, MATERIALS = ("PSOLID", "PLSOLID"), "MAT"
OF_MAT1 = {"MAT1", "MATS1", "MATCID"}  # with what a linear isotropic solid does not need
HARMLESS_CARDS = tuple("EIG TABLE SET1 SET3 PLOTEL ECHO".split())
BODY_RTOL = 1e-6  # of a mass matrix, up to which it is that of a rigid body
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
    found, ties, remarks = _sorted(Path(path))
    ids, points, _, system = grids(found)
    solids = [card for name in SOLIDS for card in found.get(name, ())]
    nodes = [_nodes(card) for card in solids]
    cell_type = only_type(_type(*solid) for solid in zip(solids, nodes, strict=True))
    raw = np.array(nodes, dtype=np.int64)
    properties = np.array([_property(card) for card in solids], dtype=np.int64)
    numbers = np.array([card.whole(0) for card in solids], dtype=np.int64)
    positions(numbers, numbers[:1], "element")  # refuses a number given twice
    cells = to_gmsh(positions(ids, raw, "node"), cell_type, EDGES.get(cell_type))
    labels = {name: np.array(nodes, dtype=np.int64) for name, nodes in _sets(found, ids).items()}
    sets = {name: positions(ids, nodes, "node") for name, nodes in labels.items()}
    facets, left = facets_of_nodes(cells, sets, cell_type, len(points))
    names = {int(p): f"property_{p}" for p in np.unique(properties)}
    cards = [card for name in MASSES for card in found.get(name, ())]
    place = dict(zip(ids.tolist(), points, strict=True)) if cards or ties else {}
    masses = [_mass(card, place, system, _per_weight(found)) for card in cards]
    told, more = hung_on([*ties, *masses], ids, points, cells)
    told |= {"region_names": names, "warnings": [*remarks, *left, *more]}
    told |= {"provenance": {"parameters": {}}} | of_materials(_materials, found, list(names))
    return packed(points, cells, cell_type, properties, numbers, facets=facets, **told)


def _sorted(path: Path) -> tuple[dict[str, list[Card]], list[Element], list[str]]:
    """Cards that are read, by name, ties, and remarks on those that need not be."""
    found: dict[str, list[Card]] = {}
    unread, aside, ties = Unread(), Unread(), list[Element]()
    for card in cards(path):
        if card.name in SECTIONS and card.text(6) not in ("", "SMECH"):
            unread.add(f"{card.name}, {card.text(6)}", card.place)
        elif card.name in TIES:
            tie = _averaged(card) if card.name == "RBE3" else _rigid(card)
            if isinstance(tie, str):
                unread.add(tie, card.place)
            else:
                ties.append(tie)
        elif card.name in (*MESH_CARDS, *SECTIONS, "PARAM") or card.name.startswith(MATERIALS):
            found.setdefault(card.name, []).append(card)
        elif card.name in LOAD_CARDS or card.name in LINES:
            aside.add(card.name, card.place)
        elif not card.name.startswith(HARMLESS_CARDS):
            unread.add(card.name, card.place)
    unread.refuse()
    return found, ties, aside.remark()


def _named(card: Card) -> tuple[str, tuple[Path, int]]:
    """Name and place of an element."""
    return f"{card.name} {card.whole(0)}", card.place


def _filled(card: Card, start: int) -> list[int]:
    """Fields from one on that are not empty, without the expansion at the end."""
    filled = [k for k in range(start, len(card.fields)) if card.text(k)]
    return filled[:-1] if filled and "." in card.text(filled[-1]) else filled


def _rigid(card: Card) -> Rigid | str:
    """RBE2, or RBAR of which one end follows in all directions; else what is not read."""
    if card.name == "RBE2":
        lead, nodes, moved = card.whole(1), _filled(card, 3), card.text(2)
    else:
        a, b = (1, 2) if card.text(3) else (2, 1)  # the end that leads, the other one
        lead, nodes, moved = card.whole(a), [b], card.text(4 + b) or "123456"
        if set(card.text(2 + a)) != ALL or card.text(2 + b) or card.text(4 + a):
            return "RBAR of which no end leads"
    if not set(moved) >= DISPLACED:
        return f"{card.name} of the components {moved or None}"
    return Rigid(*_named(card), lead, [card.whole(k) for k in nodes], set(moved) == ALL)


def _averaged(card: Card) -> Average | str:
    """RBE3 whose reference node follows displacements in all directions; else what is not read."""
    weights, weight, components = dict[int, float](), 0.0, True
    words = {card.text(k) for k in range(4, len(card.fields))}
    if "UM" in words or set(card.text(3)) != ALL:
        return "RBE3 with UM" if "UM" in words else f"RBE3 of the components {card.text(3) or None}"
    for k in (k for k in range(4, len(card.fields)) if card.text(k)):
        if card.text(k) == "ALPHA":
            break
        if "." in card.text(k):
            (weight,), components = card.reals(k), False
            if not weight > 0.0:
                raise card.wrong(f"field {k + 2}: a weight is {weight:g}, not above zero")
        elif not components:
            components = True
            if set(card.text(k)) != DISPLACED:
                return f"RBE3 averaging the components {card.text(k)}"
        else:
            weights[card.whole(k)] = weights.get(card.whole(k), 0.0) + weight
    if not all(weights.values()):
        raise card.wrong("a node has no weight")
    return Average(*_named(card), card.whole(2), weights)


def _mass(
    card: Card,
    place: dict[int, Array],
    system: Callable[[int, Card], System],
    per_weight: float,
) -> PointMass:
    """CONM1 or CONM2, in the axes that its coordinate system has at its node."""
    node, number = card.whole(1), card.whole(2, 0)
    if node not in place:
        raise card.wrong(f"node {node} is not defined")
    Q = np.eye(3) if number <= 0 else system(number, card).axes_at(place[node][None])[0]
    mass, arm, J = _of_matrix(card) if card.name == "CONM1" else _of_body(card)
    offset = arm - place[node] if number == -1 and card.name == "CONM2" else Q @ arm
    J = Q @ J @ Q.T * per_weight
    return PointMass(*_named(card), node, mass * per_weight, offset, J)


def _of_body(card: Card) -> tuple[float, Array, Array]:
    """Mass, arm and inertia of a CONM2, whose products of inertia are integrals of x_i x_j."""
    xx, yx, yy, zx, zy, zz = card.reals(*range(8, 14))
    J = np.array([[xx, -yx, -zx], [-yx, yy, -zy], [-zx, -zy, zz]])
    return card.reals(3)[0], np.array(card.reals(4, 5, 6)), J


def _of_matrix(card: Card) -> tuple[float, Array, Array]:
    """The same of a CONM1, whose matrix must be that of a rigid body."""
    M = np.zeros((6, 6))
    M[np.tril_indices(6)] = card.reals(*range(3, 24))
    M += np.tril(M, -1).T
    m, S = M[0, 0], M[3:, :3]
    arm = np.array([S[2, 1], S[0, 2], S[1, 0]]) / (m or 1.0)
    skew = np.cross(np.eye(3), m * arm)
    off = max(np.abs(M[:3, :3] - m * np.eye(3)).max(), np.abs(S - skew).max())
    if off > BODY_RTOL * np.abs(M).max():
        raise card.wrong("its matrix is not that of a rigid body")
    return m, arm, M[3:, 3:] - m * (arm @ arm * np.eye(3) - np.outer(arm, arm))


def _per_weight(found: dict[str, list[Card]]) -> float:
    """Mass of what is given as a weight, PARAM WTMASS."""
    factors = {card.reals(1)[0] for card in found.get("PARAM", ()) if card.text(0) == "WTMASS"}
    if len(factors) > 1:
        raise found["PARAM"][0].wrong(f"WTMASS has the values {sorted(factors)}")
    return factors.pop() if factors else 1.0


def _type(card: Card, nodes: list[int]) -> str:
    known = SOLIDS[card.name]
    if len(nodes) not in known:
        raise card.wrong(f"it has {len(nodes)} nodes, not {' or '.join(map(str, known))}")
    return known[len(nodes)]


def _nodes(card: Card) -> list[int]:
    """Nodes of a solid, up to the last that is not empty or zero."""
    n = len(card.fields)
    while n > 2 and not card.fields[n - 1].strip("0"):
        n -= 1
    return [card.whole(k) for k in range(2, n)]


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
    solids = (
        _isotropic(card, _per_weight(found)) for card in _numbered(found.get("MAT1", []), used)
    )
    return {f"property_{p}": numbers for p, numbers in zip(properties, solids, strict=True)}


def _numbered(some: list[Card], wanted: list[int]) -> list[Card]:
    """The cards of these numbers, each there once."""
    labels, name = np.array([card.whole(0) for card in some]), some[0].name if some else "MAT1"
    return [some[k] for k in positions(labels, np.array(wanted), name)]


def _isotropic(card: Card, per_weight: float) -> list[float]:
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
