"""Nodes and sets of nodes of Abaqus and CalculiX decks, of one part.

Source:
    Abaqus Keywords Reference Guide, *NODE, *SYSTEM, *NSET, *PART, *INSTANCE.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rom.decks.keywords import Block, Sets, blocks
from rom.decks.lines import Unread, at
from rom.decks.systems import BASIC_SYSTEM, System, system
from rom.errors import FileFormatError
from rom.model import Array, Index
from rom.names import named

SET_OPTIONS = ("GENERATE", "INTERNAL", "UNSORTED", "INSTANCE")
# keyword -> what takes it up, and the options it knows
Table = dict[str, tuple[Callable[[Any, Block], None], tuple[str, ...]]]


@dataclass
class Nodes:
    """What a deck says of its nodes: {number: position}, sets, axes of what follows; the unread."""

    deck: Path
    nodes: dict[int, Array] = field(default_factory=dict)
    node_sets: Sets = field(default_factory=Sets)
    axes: System = BASIC_SYSTEM
    unread: Unread = field(default_factory=Unread)

    def blocks(self) -> Iterator[Block]:
        """The blocks of the one part, and those outside of parts and steps.

        A set of the part is called "instance.set" where there is one of its name outside.
        """
        found = list(blocks(self.deck))
        instances = [block for block in found if block.keyword == "INSTANCE"]
        parts = [block for block in found if block.keyword == "PART"]
        names = [block.option("NAME") for block in instances or parts]
        if len(names) > 1:
            raise FileFormatError(
                f"the deck has {len(names)} {'instances' if instances else 'parts'}, "
                f"{named(names)}, which share no node; one model is one body.",
                where=at((instances or parts)[1].place),
                hint="Write a deck of each part, and a model of each deck.",
            )
        prefix, inside, other, step = "".join(f"{name}." for name in names), False, False, False
        outside: set[str] = set()
        kept = []
        for block in found:
            if block.keyword in ("PART", "INSTANCE"):
                wanted = (instances or parts)[0].options.get("PART", block.option("NAME"))
                other = block in parts and block.option("NAME").upper() != wanted.upper()
                inside = True
            if not (other or step) or block.keyword == "MODEL CHANGE":
                kept.append((inside or not names, block))
                if names and not inside:
                    sorts = {"NSET", "ELSET"} & block.options.keys()
                    outside |= {block.options[sort].upper() for sort in sorts}
            step = block.keyword == "STEP" or (step and block.keyword != "END STEP")
            if block.keyword in ("END PART", "END INSTANCE"):
                inside = other = False
        for inside, block in kept:
            if not inside and block.keyword in ("NODE", "ELEMENT"):
                self.unread.add(f"*{block.keyword} outside of the part", block.place)
                continue
            if names:
                _rename(block, prefix, outside, inside=inside)
            yield block

    def take(self, block: Block, read: Table) -> None:
        """Take up a block by a table of keywords, and count options that it does not know."""
        call, options = read[block.keyword]
        for name in block.options.keys() - {*options, "INPUT"}:
            self.unread.add(f"*{block.keyword}, {name}", block.place)
        call(self, block)

    def placed(self) -> tuple[Index, Array]:
        """Numbers (n,) and positions (n, 3)."""
        labels = np.array(list(self.nodes), dtype=np.int64)
        return labels, np.array(list(self.nodes.values())).reshape(-1, 3)


def _rename(block: Block, prefix: str, outside: set[str], *, inside: bool) -> None:
    def name(word: str) -> str:
        own = word.upper().startswith(prefix.upper()) and not inside
        plain = word[len(prefix) :] if own else word
        return prefix + plain if plain.upper() in outside and (own or inside) else plain

    for sort in {"NSET", "ELSET"} & block.options.keys():
        block.options[sort] = name(block.options[sort])
    if block.keyword in ("NSET", "ELSET", "SURFACE"):
        block.rows = [[name(word) for word in row] for row in block.rows]


def _system(deck: Nodes, block: Block) -> None:
    """``*SYSTEM``, of one point, three, or none; a part begins and ends without."""
    given = [[k for k, word in enumerate(row) if word] for row in block.rows]
    x = np.array([v for r, columns in enumerate(given) for v in block.reals(r, *columns)])
    if x.size not in (0, 3, 9):
        raise block.wrong(f"it has {x.size} numbers instead of 0, 3 or 9")
    deck.axes = System(x, np.eye(3)) if x.size == 3 else BASIC_SYSTEM
    if x.size == 9:
        deck.axes = system(0, x.reshape(3, 3), "R", at(block.place))


def _node(deck: Nodes, block: Block) -> None:
    kind = block.options.get("SYSTEM", "R").upper()
    if kind not in ("R", "C"):
        deck.unread.add(f"*NODE, SYSTEM={kind}", block.place)
        return
    rows = range(len(block.rows))
    x = np.array([block.reals(r, 1, 2, 3) for r in rows]).reshape(-1, 3)
    x = deck.axes.basic(System(np.zeros(3), np.eye(3), kind).basic(x))
    labels = [block.whole(r, 0) for r in rows]
    for label, point in zip(labels, x, strict=True):
        if deck.nodes.setdefault(label, point) is not point:
            raise block.wrong(f"node {label} is defined twice")
    if "NSET" in block.options:
        deck.node_sets.add(block.option("NSET"), labels)


def _part(deck: Nodes, block: Block) -> None:
    deck.axes = BASIC_SYSTEM
    if block.rows:
        deck.unread.add(f"moved *{block.keyword}", block.place)


NODE_KEYWORDS: Table = {
    "PART": (_part, ("NAME",)),
    "END PART": (_part, ()),
    "INSTANCE": (_part, ("NAME", "PART")),
    "END INSTANCE": (_part, ()),
    "SYSTEM": (_system, ()),
    "NODE": (_node, ("NSET", "SYSTEM")),
    "NSET": (lambda deck, block: deck.node_sets.add(block.option("NSET"), block.members()),
             ("NSET", *SET_OPTIONS)),
}  # fmt: skip
