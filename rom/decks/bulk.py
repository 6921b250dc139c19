"""Cards of Nastran bulk data, and the places of its grid points.

Source:
    MSC Nastran Quick Reference Guide: formats of bulk data; entries GRID, GRDSET, CORD1R, CORD1C,
    CORD1S, CORD2R, CORD2C, CORD2S and INCLUDE.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from rom.decks.lines import Place, at, lines, real, whole
from rom.decks.systems import BASIC_SYSTEM, System, system
from rom.errors import FileFormatError
from rom.model import Array, Index

INCLUDE_PATTERN = re.compile(
    r"""\s*(?P<keyword>INCLUDE)\s+["']?(?P<file>[^"'\n$]+)""", re.IGNORECASE
)
BEGIN_PATTERN, END_PATTERN = (
    re.compile(p, re.IGNORECASE) for p in (r"\s*BEGIN(\s+BULK)?\s*(\$|$)", r"ENDDATA")
)
PARAM_PATTERN = re.compile(r"\s*PARAM\s*,", re.IGNORECASE)
POINTS = ("GRID", "GRDSET", "CORD1R", "CORD1C", "CORD1S", "CORD2R", "CORD2C", "CORD2S")
Number = TypeVar("Number", int, float)
PER_LINE = 8  # fields of a line, of 8 characters each or 4 of 16, behind the name


@dataclass(slots=True)
class Card:
    """Name and fields in capitals, empty ones "", and the mark of the line that continues it."""

    name: str
    fields: list[str]
    place: Place
    mark: str = ""

    def text(self, k: int) -> str:
        """Field k, or "" behind the last."""
        return self.fields[k] if k < len(self.fields) else ""

    def whole(self, k: int, empty: int | None = None) -> int:
        """Field k as a whole number, with a value for an empty one."""
        return empty if not self.text(k) and empty is not None else self._read(whole, k)

    def reals(self, *places: int) -> list[float]:
        """Fields as numbers; empty ones are zero."""
        return [self._read(real, k) for k in places]

    def _read(self, kind: Callable[[str], Number], k: int) -> Number:
        try:
            return kind(self.text(k))
        except ValueError as error:
            raise self.wrong(f"field {k + 2}: {error}") from error

    def wrong(self, why: object) -> FileFormatError:
        """The error of this card."""
        return FileFormatError(f"this {self.name} is not read: {why}.", where=at(self.place))


class Cards(dict[str, list[Card]]):
    """Cards by their names."""

    def add(self, card: Card) -> None:
        """Put a card to those of its name."""
        self.setdefault(card.name, []).append(card)

    def of(self, *names: str) -> list[Card]:
        """All cards of some names."""
        return [card for name in names for card in self.get(name, ())]


Systems = Callable[[int, Card], System]  # finds that of a number that a card names


def cards(path: str | Path) -> Iterator[Card]:
    """All cards of the bulk data of a file and those it includes, continuations joined.

    What stands before BEGIN BULK is left out, but for PARAM; without that line, the file is bulk
    data alone.
    """
    path = Path(path)
    bulk = not any(BEGIN_PATTERN.match(line) for _, line in lines(path, INCLUDE_PATTERN))
    card = Card("", [], (path, 0))
    for place, line in lines(path, INCLUDE_PATTERN):
        line = line.partition("$")[0].rstrip()
        if not line or not (bulk or PARAM_PATTERN.match(line)):
            bulk = bulk or BEGIN_PATTERN.match(line) is not None
            continue
        if END_PATTERN.match(line):
            break
        head, fields, mark = _fields(line.upper().expandtabs(PER_LINE), place)
        if head and head[0] not in "+*":
            if card.name:
                yield card
            card = Card(head.rstrip("*_ "), fields, place)  # meshio writes CTETRA_
        elif not card.name or (card.mark[1:] and head[1:] and card.mark[1:] != head[1:]):
            why = f"this line, marked {head!r}, does not continue the card before it."
            hint = "Put continuations behind their cards."
            raise FileFormatError(why, where=at(place), hint=hint)
        else:
            if len(fields) == PER_LINE:  # a lonely wide line is half a narrow one
                card.fields += [""] * (-len(card.fields) % PER_LINE)
            card.fields += fields
        card.mark = mark
    if card.name:
        yield card


def _fields(line: str, place: Place) -> tuple[str, list[str], str]:
    """First field, the next eight or four, and the mark of the line that follows."""
    wide = "*" in line[:PER_LINE].partition(",")[0]
    n = PER_LINE // 2 if wide else PER_LINE
    if "," in line:
        head, *words = (word.strip() for word in line.split(","))
        words += [""] * (n + 1 - len(words))
        if any(words[n + 1 :]) or words[n][:1] not in ("", "+", "*"):
            why = f"a line has {1 + len(words)} fields; {n + 1} are read."
            hint = "Continue on the next line, behind a + and a comma."
            raise FileFormatError(why, where=at(place), hint=hint)
        return head, words[:n], words[n]
    fields = [line[k : k + 64 // n].strip() for k in range(PER_LINE, 72, 64 // n)]
    return line[:PER_LINE].strip(), fields, line[72:80].strip()


def grids(found: Cards) -> tuple[Index, Array, Array, Systems]:
    """Labels (k,), positions (k, 3), and axes of displacements (k, 3, 3), in the basic system.

    Of the cards of `POINTS`; axes are columns.
    """
    default = next(iter(found.of("GRDSET")), Card("GRDSET", [], (Path(), 0)))
    own, turned = default.whole(1, 0), default.whole(5, 0)
    grid: dict[int, tuple[int, list[float], int]] = {}
    for card in found.of("GRID"):
        row = card.whole(1, own), card.reals(2, 3, 4), card.whole(5, turned)
        if grid.setdefault(card.whole(0), row) is not row:
            raise card.wrong(f"node {card.whole(0)} is defined twice")
    places = [(card, k) for card in found.of(*POINTS[2:]) for k in (0, 4) if not k or card.text(k)]
    axes = {card.whole(k): (card, k) for card, k in places if not k or card.name[4] == "1"}
    known: dict[int, System | None] = {0: BASIC_SYSTEM}  # None while it is being resolved

    def resolved(number: int, by: Card) -> System:
        if number not in known:
            if number not in axes:
                raise by.wrong(f"the coordinate system {number} is not defined")
            known[number] = None
            card, start = axes[number]
            if card.name[4] == "2":
                x = np.array(card.reals(*range(2, 11))).reshape(3, 3)
                corners = resolved(card.whole(1, 0), card).basic(x)
            else:
                corners = np.vstack([point(card.whole(start + k), card) for k in (1, 2, 3)])
            known[number] = system(2, corners, card.name[5], at(card.place))
        if (found := known[number]) is None:
            raise by.wrong(f"the coordinate system {number} is defined by itself")
        return found

    def point(label: int, by: Card) -> Array:
        if label not in grid:
            raise by.wrong(f"node {label} is not defined")
        return resolved(grid[label][0], by).basic(np.array([grid[label][1]]))

    used, moved = np.array([row[::2] for row in grid.values()], np.int64).reshape(-1, 2).T
    x = np.array([row[1] for row in grid.values()]).reshape(-1, 3)
    moves = np.tile(np.eye(3), (len(x), 1, 1))
    for number in np.unique(used):
        here = used == number
        x[here] = resolved(int(number), found["GRID"][int(here.argmax())]).basic(x[here])
    for number in np.unique(moved[moved > 0]):
        here = moved == number
        moves[here] = resolved(int(number), found["GRID"][int(here.argmax())]).axes_at(x[here])
    return np.array(list(grid), dtype=np.int64), x, moves, resolved
