"""Decks of Abaqus and CalculiX.

Regions are the element sets of ``*SOLID SECTION``, made of its ``*ELASTIC`` and ``*DENSITY``, or
without any the ``ELSET`` of ``*ELEMENT``.
Interfaces are ``*SURFACE`` of element faces or nodes, sets of skin elements (S3, S4, M3D3, CPS3,
...), and each ``*NSET`` that contains whole facets of the outer surface. ``*RIGID BODY``,
``*COUPLING`` and ``*MPC`` of beams make interfaces too, by the names of their sets and surfaces,
``*MASS`` and ``*ROTARY INERTIA`` what these and nodes carry, and ``*SPRING`` what acts between
them. Every keyword is read, left aside because a free body does not need it, or refused by name.

Source:
    Abaqus Keywords Reference Guide; CalculiX CrunchiX user's manual.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, product
from pathlib import Path

import numpy as np

from rom.decks.keywords import Block, Sets
from rom.decks.lines import Unread
from rom.decks.nodes import NODE_KEYWORDS, SET_OPTIONS, Nodes, Table
from rom.decks.rigid import ALL, DISPLACED, Average, PointMass, Rigid, Spring
from rom.errors import FileFormatError
from rom.fe.mesh.cell_types import READ_TYPES, CellType
from rom.fe.mesh.solid import Read
from rom.fe.mesh.sources.deck import Solid, of_materials, positions, regions_of
from rom.model import Index
from rom.names import is_whole, named

SOLIDS = {4: "tet4", 10: "tet10", 8: "hex8", 20: "hex20"}
SKIN_TYPES = tuple("S3 S4 S6 S8 STRI3 STRI65 M3D3 M3D4 M3D6 M3D8 SFM3D CPS".split())
LINE_TYPES = ("T3D2", "T3D3")  # without a section, as gmsh writes curves
SECTION = "SOLID SECTION"
COUPLINGS = ("KINEMATIC", "DISTRIBUTING")  # what follows *COUPLING
BODY_SETS = ("NSET", "TIE NSET", "PIN NSET")  # of nodes of a *RIGID BODY
USUAL = {"WEIGHTING METHOD": "UNIFORM", "COUPLING": "CONTINUUM"}
SPRINGS = ("SPRINGA", "SPRING2")
# and what says their numbers
POINT_TYPES = {"MASS": "MASS", "ROTARYI": "ROTARY INERTIA"} | dict.fromkeys(SPRINGS, "SPRING")
MOST_GENERATED = 10_000_000  # elements by a row
# corners of the faces S1, S2, ... of a cell
SIDES = {
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
Elements = dict[int, tuple[str, list[int]]]  # {number: type, nodes}
Labels = dict[str, list[int]]  # of the nodes of surfaces, by name


@dataclass
class Deck(Nodes):
    """What a deck says, in its own numbers.

    Solids are {number: (cell type, nodes)}, skin {number: nodes}, at_nodes {number: (type, nodes)},
    surfaces {name: (type, rows)}; own are names of the element sets of ``*ELEMENT``, kept are
    sections, materials, what ties nodes and what hangs on them.
    """

    aside: Unread = field(default_factory=Unread)
    solids: Elements = field(default_factory=dict)
    skin: dict[int, list[int]] = field(default_factory=dict)
    at_nodes: Elements = field(default_factory=dict)
    cell_sets: Sets = field(default_factory=lambda: Sets("elements"))
    surfaces: dict[str, tuple[str, list[list[str]]]] = field(default_factory=dict)
    own: list[str] = field(default_factory=list)
    kept: list[Block] = field(default_factory=list)

    def of(self, *keywords: str) -> list[Block]:
        """Blocks of some keywords that are kept."""
        return [block for block in self.kept if block.keyword in keywords]


def read(path: str) -> Read:
    """Read a deck, or refuse keywords whose mass or stiffness would be lost."""
    deck = Deck(Path(path))
    for block in deck.blocks():
        if block.keyword in MESH_KEYWORDS:
            deck.take(block, MESH_KEYWORDS)
        elif block.keyword in LAWS:
            deck.kept.append(block)
        elif block.keyword not in HARMLESS_KEYWORDS:
            counted = deck.aside if block.keyword in LOAD_KEYWORDS else deck.unread
            counted.add(f"*{block.keyword}", block.place)
    ties = _ties(deck)
    deck.unread.refuse()
    types, nodes = zip(*deck.solids.values(), strict=True) if deck.solids else ((), ())
    solid = Solid.of(*deck.placed(), list(deck.solids), types, nodes)
    names, regions = _regions(deck, solid.ids)
    facets, remarks = _facets(deck, solid)
    labels = {name: solid.labels[np.unique(rows)].tolist() for name, rows in facets.items()}
    elements = [*_points(deck), *(one for tie in ties for one in _tied(deck, *tie, labels))]
    turned = (b.options["ROT NODE"] for b in deck.kept if "ROT NODE" in b.options)
    rotating = [node for word in turned for node in deck.node_sets.meant(word).tolist()]
    remarks = [*deck.aside.remark(), *remarks]
    told = of_materials(_materials, deck)
    return solid.read(names, regions, facets, remarks, told, elements, rotating)


def _element(deck: Deck, block: Block) -> None:
    kind = block.option("TYPE").upper()
    digits = "".join(c for c in kind.removeprefix("C3D") if c.isdigit())
    if kind.startswith((*SKIN_TYPES, *LINE_TYPES)):
        rows = _numbers(block)
        deck.cell_sets.add(block.options.get("ELSET", kind), [row[0] for row in rows])
        if kind in LINE_TYPES:
            deck.aside.add(f"*ELEMENT, TYPE={kind}", block.place)
        else:
            deck.skin |= {row[0]: row[1:] for row in rows}
    elif kind in POINT_TYPES:
        _put(deck, block, deck.at_nodes, kind, _table(block, 2 + (kind in SPRINGS)))
    elif kind.startswith("C3D") and is_whole(digits) and int(digits) in SOLIDS:
        cell_type = SOLIDS[int(digits)]
        rows = _table(block, 1 + READ_TYPES[cell_type].n_nodes)
        _put(deck, block, deck.solids, cell_type, rows)
    else:
        deck.unread.add(f"*ELEMENT, TYPE={kind}", block.place)


def _numbers(block: Block) -> list[list[int]]:
    """The whole numbers of each line."""
    rows = enumerate(block.rows)
    return [[block.whole(r, k) for k, word in enumerate(row) if word] for r, row in rows]


def _table(block: Block, width: int) -> list[list[int]]:
    """Element number and nodes of each element, which may run over several lines."""
    numbers = list(chain.from_iterable(_numbers(block)))
    if len(numbers) % width:
        raise block.wrong(f"{len(numbers)} numbers are no multiple of {width}: a line is cut")
    return [numbers[k : k + width] for k in range(0, len(numbers), width)]


def _put(deck: Deck, block: Block, found: Elements, kind: str, rows: list[list[int]]) -> None:
    """Elements in a set, which of solids is a region where there are no sections."""
    for label, *nodes in rows:
        if label in deck.solids or label in deck.at_nodes:
            raise block.wrong(f"element {label} is defined twice")
        found[label] = kind, nodes
    solid = found is deck.solids
    name = block.options.get("ELSET", "body" if solid else kind)
    deck.cell_sets.add(name, [row[0] for row in rows])
    deck.own += [name] * solid


def _copies(deck: Deck, block: Block) -> None:
    """``*ELGEN``: an element again and again along rows, rows and layers."""
    for r in range(len(block.rows)):
        master = block.whole(r, 0)
        if master not in deck.solids:
            raise block.wrong(f"element {master} is not defined", r)
        cell_type, nodes = deck.solids[master]
        # along each direction: how often, and steps of nodes and elements
        whole, fields = partial(block.whole, r), ((1, 1), (4, 0), (7, 0))
        given = [(whole(k, 1), whole(k + 1, step), whole(k + 2, step)) for k, step in fields]
        counts = [n for n, _, _ in given]
        if min(counts) < 1 or np.prod(counts, dtype=float) > MOST_GENERATED:
            raise block.wrong(f"{counts} elements along its directions", r)
        steps = np.array(list(product(*map(range, counts))), dtype=np.int64)[1:]
        by_node, by_cell = (steps @ np.array([row[k] for row in given]) for k in (1, 2))
        shifts = zip(by_cell.tolist(), by_node.tolist(), strict=True)
        rows = [[master + c, *(n + node for node in nodes)] for c, n in shifts]
        _put(deck, block, deck.solids, cell_type, rows)
        if "ELSET" in block.options:
            deck.cell_sets.add(block.option("ELSET"), [master])


def _surface(deck: Deck, block: Block) -> None:
    kind = block.options.get("TYPE", "ELEMENT").upper()
    rows = deck.surfaces.setdefault(block.option("NAME"), (kind, []))[1]
    rows.extend(block.rows)


def _keep(deck: Deck, block: Block) -> None:
    deck.kept.append(block)


MESH_KEYWORDS: Table = {
    **NODE_KEYWORDS,
    "ELEMENT": (_element, ("TYPE", "ELSET")),
    "ELGEN": (_copies, ("ELSET",)),
    "ELSET": (lambda deck, block: deck.cell_sets.add(block.option("ELSET"), block.members()),
              ("ELSET", *SET_OPTIONS)),
    "SURFACE": (_surface, ("NAME", "TYPE", "INTERNAL")),
    SECTION: (_keep, ("ELSET", "MATERIAL", "ORIENTATION", "CONTROLS")),
    "MASS": (_keep, ("ELSET",)),
    "ROTARY INERTIA": (_keep, ("ELSET",)),
    "SPRING": (_keep, ("ELSET",)),
    "RIGID BODY": (_keep, (*BODY_SETS, "ELSET", "REF NODE", "ROT NODE")),
    "COUPLING": (_keep, ("CONSTRAINT NAME", "REF NODE", "SURFACE")),
    "KINEMATIC": (_keep, ()),
    "DISTRIBUTING": (_keep, ("WEIGHTING METHOD", "COUPLING")),
    "MPC": (_keep, ()),
    "SURFACE SECTION": (lambda deck, block: None, ("ELSET",)),  # without a density
}  # fmt: skip
# of materials, with the options of each that may be there
LAWS = {"MATERIAL": {"NAME"}, "ELASTIC": {"TYPE", "MODULI"}, "DENSITY": set[str]()}
HARMLESS_KEYWORDS = set(  # what else a material says; output
    "HEADING,PREPRINT,ASSEMBLY,END ASSEMBLY,EXPANSION,CONDUCTIVITY,"
    "SPECIFIC HEAT,PLASTIC,CYCLIC HARDENING,CREEP,DAMPING,HYPERELASTIC,VISCOELASTIC,DEPVAR,"
    "USER MATERIAL,ORIENTATION,TRANSFORM,SECTION CONTROLS,AMPLITUDE,PHYSICAL CONSTANTS,"
    "SURFACE INTERACTION,SURFACE BEHAVIOR,FRICTION,RESTART,TIME POINTS,NODE PRINT,EL PRINT,"
    "NODE FILE,EL FILE,FILE FORMAT".split(",")
)
LOAD_KEYWORDS = set("STEP,BOUNDARY,INITIAL CONDITIONS,CLOAD,DLOAD,DSLOAD,TEMPERATURE".split(","))


def _regions(deck: Deck, ids: Index) -> tuple[dict[int, str], Index]:
    """{region number: name} and the region number of each cell."""
    sets = [section.option("ELSET") for section in deck.of(SECTION)] or deck.own
    chosen = {}
    for name in dict.fromkeys(sets):
        members = deck.cell_sets.of(name)
        if (others := np.setdiff1d(members, ids)).size:
            raise FileFormatError(
                f"the section of {name!r} has elements that are no solids: "
                f"{named(others.tolist())}.",
                hint="Shells, trusses and beams are not read; take their section out.",
            )
        chosen[name] = np.flatnonzero(np.isin(ids, members))
    return regions_of(chosen, ids, "section", "Every solid element needs a *SOLID SECTION.")


def _materials(deck: Deck) -> dict[str, list[float]]:
    """{region: E, nu and rho} of the material of each section, in units of the deck."""
    laws: dict[str, dict[str, Block]] = {}
    own: dict[str, Block] = {}
    for block in deck.of(*LAWS):
        if block.keyword == "MATERIAL":
            own = laws.setdefault(block.option("NAME").upper(), {})
        if own.setdefault(block.keyword, block) is not block:
            raise block.wrong("it is defined twice")
    unread, numbers = Unread(), {}
    for section in deck.of(SECTION):
        own = laws.get(section.options.get("MATERIAL", "").upper(), {})
        for name in ("ELASTIC", "DENSITY"):
            kind = _unlike(own[name]) if name in own else f"*SOLID SECTION without *{name}"
            if kind:
                unread.add(kind, own.get(name, section).place)
        if not unread:
            elastic = own["ELASTIC"].reals(0, 0, 1)
            numbers[section.option("ELSET")] = [*elastic, *own["DENSITY"].reals(0, 0)]
    unread.refuse()
    return numbers


def _unlike(block: Block) -> str:
    """The keyword, with what tells it from one of linear isotropic solids; or nothing."""
    kind, odd = block.options.get("TYPE", "ISO"), sorted(block.options.keys() - LAWS[block.keyword])
    odd += [f"TYPE={kind}"] * (not kind.upper().startswith("ISO"))
    odd += [f"{len(block.rows)} rows"] * (len(block.rows) != 1)
    return ", ".join([f"*{block.keyword}", *odd]) if odd else ""


def _facets(deck: Deck, solid: Solid) -> tuple[dict[str, Index], list[str]]:
    facets: dict[str, Index] = {}
    known = deck.node_sets.names.items()
    sets = {name: deck.node_sets.of(key) for key, name in known if name not in deck.surfaces}
    for name, (kind, rows) in deck.surfaces.items():
        if kind == "NODE":
            sets[name] = np.concatenate([deck.node_sets.meant(row[0]) for row in rows])
        else:
            facets[name] = np.vstack([_facets_of(deck, row, solid) for row in rows])
    for name, nodes in _skin_nodes(deck).items():
        sets.setdefault(name, nodes)
    by_nodes, remarks = solid.facets(sets)
    return facets | by_nodes, remarks


def _skin_nodes(deck: Deck) -> dict[str, Index]:
    """Nodes of skin elements by the element sets that hold nothing else."""
    found = {}
    for key, name in deck.cell_sets.names.items():
        members = deck.cell_sets.of(key).tolist()
        if members and all(label in deck.skin for label in members):
            nodes = {node for label in members for node in deck.skin[label]}
            found[name] = np.array(sorted(nodes), dtype=np.int64)
    return found


def _points(deck: Deck) -> Iterator[PointMass | Spring]:
    """Of ``*MASS`` and ``*ROTARY INERTIA``, whose products of inertia are entries of the tensor."""
    open_ = dict(deck.at_nodes)
    for block in deck.of(*POINT_TYPES.values()):
        for label in deck.cell_sets.of(block.option("ELSET")).tolist():
            kind, nodes = open_.pop(label, ("", []))
            if POINT_TYPES.get(kind) != block.keyword:
                raise block.wrong(f"element {label} is not of its type, or has one already")
            if kind in SPRINGS:
                yield _spring(deck, block, kind, label, nodes)
                continue
            m, J = block.reals(0, 0)[0] if kind == "MASS" else 0.0, np.zeros((3, 3))
            if kind != "MASS":
                xx, yy, zz, xy, xz, yz = block.reals(0, *range(6))
                J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            yield PointMass(f"{kind} {label}", block.place, nodes[0], m, np.zeros(3), J)
    for label, (kind, _) in open_.items():
        text = f"element {label} of the type {kind} has no *{POINT_TYPES[kind]}."
        raise FileFormatError(text, where=str(deck.deck))


def _spring(deck: Deck, block: Block, kind: str, label: int, nodes: list[int]) -> Spring:
    """One along its line, or between a component of each node, which stands in the first row."""
    rows = [r for r, row in enumerate(block.rows) if any(row)]
    if len(rows) != 1 + (kind == "SPRING2"):
        raise block.wrong(f"element {label}: it has {len(rows)} rows, not those of one stiffness")
    a, b = (deck.nodes.get(node, np.zeros(3)) for node in nodes)
    components, axes = [1, 1], [(b - a) / (np.linalg.norm(b - a) or 1.0)] * 2
    if kind == "SPRING2":
        components = [block.whole(rows[0], n) for n in (0, 1)]
        axes = [np.eye(3)[(c - 1) % 3] for c in components]
    ends = zip(nodes, components, axes, strict=True)
    return Spring.scalar((f"{kind} {label}", block.place), block.reals(rows[-1], 0)[0], *ends)


def _ties(deck: Deck) -> list[tuple[Block, Block]]:
    """Blocks that tie, and those that say how; others are counted as not read."""
    found, coupling = [], None
    for block in [*deck.kept, Block("", {}, (deck.deck, 0))]:
        if coupling and block.keyword not in COUPLINGS:
            deck.unread.add("*COUPLING that says no kind", coupling.place)
        elif block.keyword in COUPLINGS and not coupling:
            deck.unread.add(f"*{block.keyword} without *COUPLING", block.place)
        elif odd := _odd(block):
            deck.unread.add(odd, block.place)
        elif block.keyword in (*COUPLINGS, "RIGID BODY", "MPC"):
            found.append((coupling or block, block))
        coupling = block if block.keyword == "COUPLING" else None
    return found


def _odd(block: Block) -> str:
    """The keyword with what keeps it from tying whole motions; or nothing."""
    if block.keyword == "MPC":
        kinds = [row[0].upper() for row in block.rows if row[0].upper() != "BEAM"]
        return f"*MPC, {kinds[0]}" if kinds else ""
    if block.keyword not in COUPLINGS:
        return ""
    for name, usual in USUAL.items():
        if (value := block.options.get(name, usual).upper()) != usual:
            return f"*{block.keyword}, {name}={value}"
    held = _components(block)
    if held >= (ALL if block.keyword == "DISTRIBUTING" else DISPLACED):
        return ""
    return f"*{block.keyword} of the components {''.join(sorted(held))}"


def _components(block: Block) -> set[str]:
    """What the rows from one component to another say; all where they say nothing."""
    ends = [(block.whole(r, 0, 0), block.whole(r, 1, 0)) for r in range(len(block.rows))]
    found = {c for low, high in ends for c in ALL if low <= int(c) <= (high or low)}
    return found if any(low for low, _ in ends) else set(ALL)


def _tied(deck: Deck, block: Block, how: Block, labels: Labels) -> Iterator[Rigid | Average]:
    """What a block ties, of surfaces that have these nodes."""
    if block.keyword == "MPC":
        leads: dict[int, list[int]] = {}
        for r, row in enumerate(block.rows):
            if len(row) != 3:
                raise block.wrong("a row is BEAM, a node or set that follows, one that leads", r)
            leads.setdefault(_one(deck, block, row[2]), []).extend(
                deck.node_sets.meant(row[1]).tolist()
            )
        for node, led in leads.items():
            yield Rigid(f"MPC {node}", block.place, node, led, turning=True)
        return
    lead = _one(deck, block, block.option("REF NODE"))
    name, nodes = _body(deck, block) if block is how else _coupled(deck, block, labels)
    if how.keyword == "DISTRIBUTING":
        of_area = deck.surfaces[name][0] != "NODE"
        yield Average(name, block.place, lead, dict.fromkeys(nodes, 1.0), of_area)
    else:
        led, turning = [n for n in nodes if n != lead], block is how or _components(how) >= ALL
        yield Rigid(name, block.place, lead, led, turning)


def _one(deck: Deck, block: Block, word: str) -> int:
    """The one node that a word says."""
    if len(nodes := deck.node_sets.meant(word).tolist()) != 1:
        raise block.wrong(f"{word!r} is {len(nodes)} nodes instead of one")
    return nodes[0]


def _coupled(deck: Deck, block: Block, labels: Labels) -> tuple[str, list[int]]:
    """Name and nodes of the surface of a coupling."""
    names = {name.upper(): name for name in deck.surfaces}
    if (name := names.get(block.option("SURFACE").upper(), "")) not in deck.surfaces:
        raise block.wrong(f"the surface {block.option('SURFACE')!r} is unknown")
    kind, rows = deck.surfaces[name]
    if kind != "NODE":
        return name, labels[name]
    return name, np.unique(np.concatenate([deck.node_sets.meant(row[0]) for row in rows])).tolist()


def _body(deck: Deck, block: Block) -> tuple[str, list[int]]:
    """Name and nodes of a rigid body of sets of nodes, or of elements."""
    names = [block.options[key] for key in BODY_SETS if key in block.options]
    found = {node for name in names for node in deck.node_sets.of(name).tolist()}
    if "ELSET" in block.options:
        names.append(block.option("ELSET"))
        for label in deck.cell_sets.of(names[-1]).tolist():
            own = deck.solids[label][1] if label in deck.solids else deck.skin.get(label, [])
            found.update(own)
    if not names:
        raise block.wrong("it has no set")
    known = deck.cell_sets.names | deck.node_sets.names
    return known[names[0].upper()], sorted(found)


def sides(kind: CellType) -> dict[str, int]:
    """{S1, S2, ...: number of this face here}."""
    faces = [set(face) for face in kind.faces]
    return {f"S{k}": faces.index(set(side)) for k, side in enumerate(SIDES[kind.n_corners], 1)}


def _facets_of(deck: Deck, row: list[str], solid: Solid) -> Index:
    """(f, kf) facets of one line ``element or set, S1``."""
    faces, label = sides(solid.kind), row[1].upper() if len(row) > 1 else ""
    if label not in faces:
        shape, n = solid.kind.shape, len(faces)
        raise FileFormatError(f"{label!r} is no face of a {shape}; S1 to S{n} are.")
    wanted = positions(solid.ids, deck.cell_sets.meant(row[0]), "element")
    return solid.cells[wanted][:, solid.kind.face_nodes[faces[label]]]
