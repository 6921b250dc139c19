"""Archives of Ansys Mechanical APDL, ``.cdb``, as CDWRITE writes them in blocks.

Regions are the material numbers of the solids ("material_1"), made of their MP or MPDATA.
Interfaces are components of nodes that hold whole facets of the outer surface; Workbench makes one
of each named selection of faces. Commands without which mass or stiffness would be those of another
body are refused.

Source:
    Ansys Mechanical APDL command reference: CDWRITE, NBLOCK, EBLOCK, CMBLOCK, ET, MP, MPDATA.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from rom.decks.lines import Place, Unread, at, real, whole
from rom.errors import FileFormatError, MeshError
from rom.fe.mesh.solid import Read
from rom.fe.mesh.sources.deck import Solid, of_materials, only_type
from rom.names import named

SOLID_TYPES = (45, 64, 73, 92, 95, 185, 186, 187, 285)
MESH_TYPES = (151, 152, 153, 154, 200)  # for loads on faces, and of meshes alone
CELLS = {4: "tet4", 10: "tet10", 8: "hex8", 20: "hex20"}  # by their number of nodes
# places in a brick that is a tetrahedron: corners I J K M, then the nodes amid edges
TETRAHEDRON = {8: (0, 1, 2, 4), 20: (0, 1, 2, 4, 8, 9, 11, 16, 17, 18)}
LOST = "CDREAD /INPUT E CE CERIG CP CPINTF CPLGEN CPNGEN RBE3".split()  # other files, and ties
ELASTIC = ("EX", "NUXY", "DENS")
DIRECTED = "EY EZ GXY GYZ GXZ NUYZ NUXZ PRYZ PRXZ".split()  # of orthotropic materials
PLASTIC = "BISO MISO BKIN MKIN KINH NLIS CHAB PLAS CREE SDAM".split()  # laws beside elastic ones
COMMAND = re.compile(r"\s*(/?[A-Z]\w*)\s*,(.*)")
FIELDS = re.compile(r"(\d*)([IE])(\d+)")  # of a format: how many, of which kind, how wide
MATERIAL, TYPE, COUNT, NUMBER, HEAD = 0, 1, 8, 10, 11  # places in a row of EBLOCK


@dataclass(slots=True)
class Command:
    """A command in capitals, and the lines of data of a block."""

    name: str
    fields: list[str]
    place: Place
    rows: list[str] = field(default_factory=list)

    def wrong(self, what: object) -> FileFormatError:
        """An error at the command."""
        return FileFormatError(f"{self.name} cannot be read: {what}.", where=at(self.place))

    def table(self) -> tuple[str, list[list[str]]]:
        """Kinds of the fields as the first line of data says, and the words of the others."""
        found = [
            (k, int(w)) for n, k, w in FIELDS.findall(self.rows[0]) for _ in range(int(n or 1))
        ]
        if not found:
            raise self.wrong(f"{self.rows[0].strip()[:40]!r} is no format")
        places = list(pairwise(np.cumsum([0, *(width for _, width in found)]).tolist()))
        rows = [[row[a:b].strip() for a, b in places] for row in self.rows[1:]]
        return "".join(kind for kind, _ in found), rows


@dataclass(slots=True)
class Deck:
    """What an archive says, in its own numbers."""

    nodes: dict[int, list[float]] = field(default_factory=dict)  # places
    solids: dict[int, tuple[int, list[int]]] = field(default_factory=dict)  # material, nodes
    types: dict[int, int] = field(default_factory=dict)  # of elements, by their own numbers
    sets: dict[str, list[int]] = field(default_factory=dict)  # of nodes
    laws: list[Command] = field(default_factory=list)  # of materials
    unread: Unread = field(default_factory=Unread)


def read(path: str) -> Read:
    """Read an archive, or refuse what would be lost."""
    deck = Deck()
    for command in _commands(Path(path)):
        if command.name in TAKEN:
            try:
                TAKEN[command.name](deck, command)
            except (ValueError, IndexError) as error:
                raise command.wrong(error) from error
        elif command.name in LOST or (command.name == "EN" and "-1" not in command.fields):
            deck.unread.add(command.name, command.place)
    deck.unread.refuse()
    materials, nodes = zip(*deck.solids.values(), strict=True) if deck.solids else ((), ())
    types = [CELLS.get(len(cell), "wedge or pyramid") for cell in nodes]
    if only_type(types) not in CELLS.values():
        raise MeshError("the cells are wedges or pyramids; tetrahedra or hexahedra are needed.")
    labels, points = np.array(list(deck.nodes)), np.array([*deck.nodes.values()])
    solid = Solid.of(labels, points, list(deck.solids), types, nodes)
    names = {int(number): f"material_{number}" for number in np.unique(materials)}
    told = of_materials(_materials, deck.laws, names)
    return solid.read(names, np.array(materials), *solid.facets(deck.sets), told)


def _commands(path: Path) -> Iterator[Command]:
    """Commands, each with the lines up to the next one."""
    command = Command("", [], (path, 0))
    with path.open(encoding="latin1") as file:
        for number, line in enumerate(file, 1):
            text = line.partition("!")[0].upper().rstrip()
            if found := COMMAND.match(text):
                yield command
                fields = [word.strip() for word in found[2].split(",")]
                command = Command(found[1], fields, (path, number))
            elif text.strip() and command.name in BLOCKS:
                command.rows.append(text)
    yield command


def _type(deck: Deck, command: Command) -> None:
    """``ET``, or the rows of an ``ETBLOCK``: the number here and that of the manual."""
    rows = [row.split() for row in command.rows[1:]] or [command.fields]
    for number, kind, *_ in (row for row in rows if row[0] != "-1"):
        digits = int("0" + "".join(c for c in kind if c.isdigit()))
        if digits not in SOLID_TYPES + MESH_TYPES:
            deck.unread.add(f"ET, {kind}", command.place)
        deck.types[int(number) if number.isdigit() else 0] = digits


def _nodes(deck: Deck, command: Command) -> None:
    kinds, rows = command.table()
    first = kinds.index("E")
    for row in rows:
        if row[0] != "-1":
            deck.nodes[whole(row[0])] = [real(word) for word in row[first : first + 3]]


def _elements(deck: Deck, command: Command) -> None:
    """Solids; blocks without SOLID hold faces for loads and contacts, whose ET is refused."""
    if "SOLID" not in command.fields:
        return
    rows = iter(command.table()[1])
    for row in rows:
        if row[0] == "-1":
            break
        head, nodes = [whole(word) for word in row[:HEAD]], row[HEAD:]
        while len(nodes) < head[COUNT]:
            nodes = nodes + next(rows)
        if head[TYPE] not in deck.types:
            raise command.wrong(f"element {head[NUMBER]}: no ET says what its type {head[TYPE]} is")
        if deck.types[head[TYPE]] not in SOLID_TYPES:
            continue
        if head[NUMBER] in deck.solids:
            raise command.wrong(f"element {head[NUMBER]} is defined twice")
        cell = [whole(word or "0") for word in nodes[: head[COUNT]]]
        deck.solids[head[NUMBER]] = head[MATERIAL], _cell(cell)


def _cell(nodes: list[int]) -> list[int]:
    """Nodes of a solid, of a tetrahedron where it is drawn as a brick, of no others."""
    corners = 4 if len(nodes) in (4, 10) else 8
    nodes = nodes if any(nodes[corners:]) else nodes[:corners]
    if corners == 8 and len(set(nodes[:8])) == 4:
        return [nodes[k] for k in TETRAHEDRON[len(nodes)]]
    if 0 in nodes or len(set(nodes)) < len(nodes):
        return []  # a wedge, a pyramid, or one with some nodes amid edges
    return nodes


def _component(deck: Deck, command: Command) -> None:
    """Numbers of nodes; one below zero ends a range that the one before begins."""
    if command.fields[1] != "NODE":  # of elements, that is
        return
    found: list[int] = []
    for number in (whole(word) for row in command.table()[1] for word in row if word):
        found += range(found[-1] + 1, 1 - number) if number < 0 else [number]
    deck.sets[command.fields[0]] = found


BLOCKS = ("NBLOCK", "EBLOCK", "CMBLOCK", "ETBLOCK")
TAKEN: dict[str, Callable[[Deck, Command], None]] = {
    **dict.fromkeys(("ET", "ETBLOCK"), _type),
    **dict.fromkeys(("MP", "MPDATA", "TB"), lambda deck, command: deck.laws.append(command)),
    "NBLOCK": _nodes,
    "EBLOCK": _elements,
    "CMBLOCK": _component,
}


def _materials(laws: list[Command], names: dict[int, str]) -> dict[str, list[float]]:
    """{region: E, nu and rho} of the material of each number, in units of the archive."""
    unread, found = Unread(), {name: dict[str, float]() for name in names.values()}
    for law in laws:
        try:
            label, place, *values = law.fields
            if law.name == "MPDATA":  # R5.0, how many, label, material, place of the first, values
                label, place, _, *values = law.fields[1 + label.startswith("R5") :]
            number, numbers = whole(place), [real(x) for x in values if law.name != "TB"]
        except (ValueError, IndexError) as error:
            raise law.wrong(error) from error
        label = label[:4].replace("PRXY", "NUXY")  # the same number of an isotropic solid
        odd = label not in PLASTIC if law.name == "TB" else label in DIRECTED
        if number in names and (odd or (label in ELASTIC and any(numbers[1:]))):
            unread.add(f"{law.name}, {label}", law.place)
        elif number in names and label in ELASTIC:
            found[names[number]][label] = numbers[0]
    unread.refuse()
    for name, row in found.items():
        if missing := [label for label in ELASTIC if label not in row]:
            raise FileFormatError(f"{name} has no {named(missing)}.")
    return {name: [row[label] for label in ELASTIC] for name, row in found.items()}
