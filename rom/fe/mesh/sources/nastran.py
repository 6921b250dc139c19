"""Nastran bulk data.

Regions are the property numbers of the solids ("property_1"), made of their MAT1. Interfaces are
skin elements (CTRIA3, CTRIA6, CQUAD4, CQUAD8) by property number ("property_5") and the nodes of
SPC and SPC1 cards by set number ("spc_7"), where they contain whole facets of the outer surface.
RBE2, RBAR and RBE3 make interfaces too ("RBE2 7"), CONM1 and CONM2 what these and nodes carry, and
CELAS1, CELAS2 and CBUSH are springs between them. Every card is read, left aside because a free
body does not need it, or refused by name.

Source:
    MSC Nastran Quick Reference Guide: CBUSH, CELAS1, CELAS2, CONM1, CONM2, PBUSH, PELAS, RBAR,
    RBE2, RBE3.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from rom.decks.bulk import POINTS, Card, Cards, Systems, cards, grids
from rom.decks.lines import Unread, at
from rom.decks.rigid import ALL, DISPLACED, Average, Element, PointMass, Rigid, Spring
from rom.decks.systems import system
from rom.fe.mesh.cell_types import DECK_EDGES, LOWER_EDGES, UPPER_EDGES, UPRIGHT_EDGES
from rom.fe.mesh.solid import Read
from rom.fe.mesh.sources.deck import Solid, of_materials, positions
from rom.model import Array, Index, moved_rigidly
from rom.names import is_whole
from rom.rotation import axial

SOLIDS = {"CTETRA": {4: "tet4", 10: "tet10"}, "CHEXA": {8: "hex8", 20: "hex20"}}
# mid-edge nodes where not as in Abaqus
EDGES = DECK_EDGES | {"hex20": (*LOWER_EDGES, *UPRIGHT_EDGES, *UPPER_EDGES)}
SKIN_CARDS = {"CTRIA3": 3, "CTRIA6": 3, "CQUAD4": 4, "CQUAD8": 4}  # corners
LINES = ("CBAR",)  # without a property, as gmsh writes curves
MASSES, TIES = ("CONM1", "CONM2"), ("RBE2", "RBAR", "RBE3")
SPRINGS, OF_SPRINGS = ("CELAS1", "CELAS2", "CBUSH"), ("PELAS", "PBUSH")
MESH_CARDS = {*POINTS, *SOLIDS, *SKIN_CARDS, "SPC", "SPC1", *MASSES, *SPRINGS, *OF_SPRINGS}
SECTIONS, MATERIALS = ("PSOLID", "PLSOLID"), "MAT"
OF_MAT1 = {"MAT1", "MATS1", "MATCID"}  # with what a linear isotropic solid does not need
HARMLESS_CARDS = tuple("EIG TABLE SET1 SET3 PLOTEL ECHO".split())
BODY_RTOL = 1e-6  # of a mass matrix, up to which it is that of a rigid body
CONTRADICTION = 0.01  # of E, G and NU, from where Nastran warns
NO_LINE = 1e-4  # in units of the deck, below which the nodes of a CBUSH give it no direction
# loads, supports, steps, and what a reduction there holds
LOAD_CARDS = set(
    "FORCE FORCE1 FORCE2 MOMENT MOMENT1 MOMENT2 PLOAD PLOAD1 PLOAD2 PLOAD4 GRAV ACCEL ACCEL1 "
    "RFORCE LOAD DLOAD DAREA TLOAD1 TLOAD2 RLOAD1 RLOAD2 DELAY DPHASE LSEQ RANDPS TEMP TEMPD "
    "TEMPP1 SPCD SPCADD SUPORT SUPORT1 FREQ FREQ1 FREQ2 FREQ3 FREQ4 TSTEP TSTEPNL NLPARM TIC "
    "ASET ASET1 BSET BSET1 CSET CSET1 QSET QSET1 OMIT OMIT1 SPOINT".split()
)
At = dict[int, Array]  # by node


def read(path: str) -> Read:
    """Read bulk data, or refuse cards whose mass or stiffness would be lost."""
    found, ties, remarks = _sorted(Path(path))
    labels, points, axes, systems = grids(found)
    solids, springs = found.of(*SOLIDS), found.of(*SPRINGS)
    nodes = [_nodes(card) for card in solids]
    numbers = np.array([card.whole(0) for card in (*solids, *springs)], dtype=np.int64)
    positions(numbers, numbers[:1], "element")  # refuses a number given twice
    types = (_type(*one) for one in zip(solids, nodes, strict=True))
    solid = Solid.of(labels, points, numbers[: len(solids)], types, nodes, EDGES)
    regions = np.array([_property(card) for card in solids], dtype=np.int64)
    names = {int(p): f"property_{p}" for p in np.unique(regions)}
    facets, left = solid.facets(_sets(found, labels))
    place, moves = (dict(zip(labels.tolist(), some, strict=True)) for some in (points, axes))
    masses = (_mass(card, place, systems, _per_weight(found)) for card in found.of(*MASSES))
    elements = [*ties, *masses, *_springs(found, place, moves, systems)]
    told = of_materials(_materials, found, names)
    return solid.read(names, regions, facets, [*remarks, *left], told, elements)


def _sorted(path: Path) -> tuple[Cards, list[Element], list[str]]:
    """Cards that are read, ties, and remarks on those that need not be."""
    found, unread, aside, ties = Cards(), Unread(), Unread(), list[Element]()
    for card in cards(path):
        for word in _beside(card) if card.name in (*SPRINGS, *OF_SPRINGS) else ():
            (aside if word in ("B", "GE") else unread).add(f"{card.name}, {word}", card.place)
        if card.name in SECTIONS and card.text(6) not in ("", "SMECH"):
            unread.add(f"{card.name}, {card.text(6)}", card.place)
        elif card.name in TIES:
            tie = _averaged(card) if card.name == "RBE3" else _rigid(card)
            if isinstance(tie, str):
                unread.add(tie, card.place)
            else:
                ties.append(tie)
        elif card.name in (*MESH_CARDS, *SECTIONS, "PARAM") or card.name.startswith(MATERIALS):
            found.add(card)
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


def _mass(card: Card, place: At, systems: Systems, per_weight: float) -> PointMass:
    """CONM1 or CONM2, in the axes that its coordinate system has at its node."""
    (node,), number = _ends(card, place, 1), card.whole(2, 0)
    Q = np.eye(3) if number <= 0 else systems(number, card).axes_at(place[node][None])[0]
    mass, arm, J = _of_matrix(card) if card.name == "CONM1" else _of_body(card)
    offset = arm - place[node] if number == -1 and card.name == "CONM2" else Q @ arm
    J = Q @ J @ Q.T * per_weight
    return PointMass(*_named(card), node, mass * per_weight, offset, J)


def _beside(card: Card) -> list[str]:
    """What the card of a spring says beside its place, stiffness and factors of stress."""
    if card.name == "PBUSH":
        return [word for word in card.fields if word.isalpha() and word not in ("K", "RCV")]
    if card.name == "CBUSH":
        return ["OCID"] * (card.text(9) not in ("", "-1"))
    return ["GE"] * any(card.reals(*{"CELAS2": (6,), "PELAS": (2, 6)}.get(card.name, ())))


def _springs(found: Cards, place: At, moves: At, systems: Systems) -> Iterator[Spring]:
    """CELAS1 and CELAS2 between components of two nodes, CBUSH between their whole motions."""
    halves = [(card, k) for card in found.of("PELAS") for k in (0, 4) if card.text(k)]
    elastic = [replace(card, fields=card.fields[k:]) for card, k in halves]
    pairs = [(card, card) for card in found.of("CELAS2")]
    for name, some in (("CELAS1", elastic), ("CBUSH", found.of("PBUSH"))):
        if users := found.get(name):
            wanted = [card.whole(1, card.whole(0)) for card in users]
            pairs += zip(users, _numbered(some, wanted, f"property of a {name}"), strict=True)
    for card, own in pairs:
        if card.name == "CBUSH":
            yield _bush(card, own, place, moves, systems)
            continue
        ends = zip(_ends(card, place, 2, 4), (card.whole(3, 0), card.whole(5, 0)), strict=True)
        turned = ((node, c, moves.get(node, np.eye(3))[:, (c - 1) % 3]) for node, c in ends)
        yield Spring.scalar(_named(card), own.reals(1)[0], *turned)


def _bush(card: Card, own: Card, place: At, moves: At, systems: Systems) -> Spring:
    """CBUSH, whose axes are those of a system, or those of its line and a vector beside it."""
    a, b = _ends(card, place, 2, 3)
    first = own.fields.index("K") + 1 if "K" in own.fields else len(own.fields)
    one = Spring(*_named(card), a, b, np.array(own.reals(*range(first, first + 6))), np.eye(6, 12))
    if not a * b:
        return one
    line, beside = place[b] - place[a], [n for n in (4, 5, 6) if card.text(n)]
    if card.text(7):
        axes = systems(card.whole(7), card).axes_at(place[a][None])[0]
    elif np.linalg.norm(line) < NO_LINE:
        raise one.wrong("its nodes lie in one place, so it needs a CID")
    elif beside or not one.stiffness[[1, 2, 4, 5]].any():
        (third,) = _ends(card, place, 4) if is_whole(card.text(4)) else (0,)  # or a vector
        v = place[third] - place[a] if third else moves[a] @ card.reals(4, 5, 6)
        v = v if beside else np.eye(3)[np.abs(line).argmin()]
        axes = system(0, np.array([np.zeros(3), line, v]), "R", at(card.place)).axes
    else:
        raise one.wrong("it has more than K1 and K4, so it needs a CID, GO or a vector")
    share = card.reals(8)[0] if card.text(8) else 0.5
    ends = np.hstack([-moved_rigidly(share * line), moved_rigidly((share - 1.0) * line)])
    return replace(one, stretch=np.vstack([axes.T @ ends[:3], axes.T @ ends[3:]]))


def _ends(card: Card, place: At, *fields: int) -> list[int]:
    """Nodes that a card names, zero for none; they must be there."""
    nodes = [card.whole(k, 0) for k in fields]
    if missing := set(nodes) - place.keys() - {0}:
        raise card.wrong(f"node {min(missing)} is not defined")
    return nodes


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
    m, centre = M[0, 0], axial(M[3:, :3]) / (M[0, 0] or 1.0)
    to_centre = moved_rigidly(-centre)
    own = to_centre.T @ M @ to_centre
    if np.abs(own[:3] - m * np.eye(3, 6)).max() > BODY_RTOL * np.abs(M).max():
        raise card.wrong("its matrix is not that of a rigid body")
    return m, centre, own[3:, 3:]


def _per_weight(found: Cards) -> float:
    """Mass of what is given as a weight, PARAM WTMASS."""
    factors = {card.reals(1)[0] for card in found.of("PARAM") if card.text(0) == "WTMASS"}
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


def _materials(found: Cards, names: dict[int, str]) -> dict[str, list[float]]:
    """{region: E, nu and rho} of the material of each property, in units of the deck."""
    sections = _numbered(found.of(*SECTIONS), list(names))
    used, unread = [card.whole(1) for card in sections], Unread()
    for name in sorted(found.keys() - OF_MAT1):
        for card in found[name]:
            if name.startswith(MATERIALS) and card.whole(0) in used:
                unread.add(name, card.place)
    unread.refuse()
    solids = (_isotropic(card, _per_weight(found)) for card in _numbered(found.of("MAT1"), used))
    return dict(zip(names.values(), solids, strict=True))


def _numbered(some: list[Card], wanted: list[int], none: str = "MAT1") -> list[Card]:
    """The cards of these numbers, each there once."""
    labels, name = np.array([card.whole(0) for card in some]), some[0].name if some else none
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


def _sets(found: Cards, ids: Index) -> dict[str, list[int]]:
    """Nodes of skin elements by property, and of SPC and SPC1 cards by set number."""
    sets: dict[str, list[int]] = {}
    for name, n_corners in SKIN_CARDS.items():
        for card in found.of(name):
            corners = [card.whole(k) for k in range(2, 2 + n_corners)]
            sets.setdefault(f"property_{_property(card)}", []).extend(corners)
    for card in found.of("SPC", "SPC1"):
        sets.setdefault(f"spc_{card.whole(0)}", []).extend(_held(card, ids))
    return sets


def _held(card: Card, ids: Index) -> list[int]:
    if card.text(3) == "THRU":  # not all points in between need exist
        between = (ids >= card.whole(2)) & (ids <= card.whole(4))
        return ids[between].tolist()
    places = (1, 4) if card.name == "SPC" else range(2, len(card.fields))
    return [card.whole(k) for k in places if card.text(k)]
