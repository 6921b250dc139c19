"""Blocks of Abaqus and CalculiX decks: a keyword with options, and its rows of data."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rom.decks.lines import Place, at, lines, real, whole
from rom.errors import FileFormatError, UnsafeFileError
from rom.model import Index
from rom.names import is_whole

INCLUDE_PATTERN = re.compile(
    r"""\s*\*(?P<keyword>[^*,][^,]*),(.*,)?\s*INPUT\s*=\s*(?P<file>"[^"]*"|[^,\n]+)""",
    re.IGNORECASE,
)
Member = int | range | str  # a number, some of them, or the name of another set
MOST_NESTED, MOST_NODES = 200, 100_000_000  # sets in sets, numbers in a set


@dataclass(slots=True)
class Block:
    """A keyword in capitals, its options, and the words of each row with file and line."""

    keyword: str
    options: dict[str, str]
    place: Place
    rows: list[list[str]] = field(default_factory=list)
    places: list[Place] = field(default_factory=list)

    def option(self, name: str) -> str:
        """The value of an option that must be given."""
        if not self.options.get(name):
            raise self.wrong(f"it has no {name}")
        return self.options[name]

    def whole(self, row: int, k: int, empty: int | None = None) -> int:
        """A label in a row, with a value for one that is left out."""
        word = self.rows[row][k] if k < len(self.rows[row]) else ""
        try:
            return empty if not word and empty is not None else whole(word)
        except ValueError as error:
            raise self.wrong("a label is a whole number", row) from error

    def reals(self, row: int, *columns: int) -> list[float]:
        """Numbers in a row; those that are left out are zero."""
        words = self.rows[row]
        try:
            return [real(words[k]) if k < len(words) else 0.0 for k in columns]
        except ValueError as error:
            raise self.wrong(error, row) from error

    def members(self) -> list[Member]:
        """Numbers, ranges of numbers and names of sets, as the rows of a set list them."""
        if "GENERATE" in self.options:
            rows = range(len(self.rows))
            ends = ((self.whole(r, 0), self.whole(r, 1), self.whole(r, 2, 1)) for r in rows)
            return [range(low, high + 1, max(step, 1)) for low, high, step in ends]
        words = (word.strip('"') for row in self.rows for word in row if word)
        return [int(word) if is_whole(word) else word for word in words]

    def wrong(self, why: object, row: int | None = None) -> FileFormatError:
        """The error of this block, or of a row of it."""
        where = at(self.place if row is None else self.places[row])
        return FileFormatError(f"*{self.keyword} is not read: {why}.", where=where)


def blocks(path: str | Path) -> Iterator[Block]:
    """The blocks of a deck and of the files it includes, whole or as data of a keyword."""
    block: Block | None = None
    head = ""
    for place, line in lines(Path(path), INCLUDE_PATTERN):
        line = line.strip()
        if not line or line.startswith("**"):
            continue
        if line[0] == "*" or head:
            head += line
            if head[-1] != ",":  # else the options go on in the next line
                if block:
                    yield block
                block, head = Block(*_options(head), place), ""
        elif block:
            block.rows.append([word.strip() for word in line.split(",")])
            block.places.append(place)
    if block:
        yield block


def _options(line: str) -> tuple[str, dict[str, str]]:
    words = [word.strip() for word in line[1:].split(",") if word.strip()]
    pairs = [word.partition("=") for word in words[1:]]
    name = " ".join(words[0].upper().split()) if words else ""
    return name, {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}


@dataclass(slots=True)
class Sets:
    """Sets of numbers by name, capitals or not; ``names`` has them as first written."""

    what: str = "nodes"
    names: dict[str, str] = field(default_factory=dict)
    members: dict[str, list[Member]] = field(default_factory=dict)
    known: dict[str, Index | None] = field(default_factory=dict)  # None while being resolved

    def add(self, name: str, members: Sequence[Member]) -> None:
        """Put members into a set."""
        self.names.setdefault(name.upper(), name)
        self.members.setdefault(name.upper(), []).extend(members)

    def meant(self, word: str) -> Index:
        """The one number that a word is, or those in the set it names."""
        return np.array([int(word)], dtype=np.int64) if is_whole(word) else self.of(word.strip('"'))

    def of(self, name: str) -> Index:
        """Ascending numbers in a set, those of the sets it names included."""
        key = name.upper()
        if key in self.known and (found := self.known[key]) is not None:
            return found
        if key not in self.members or key in self.known or len(self.known) > MOST_NESTED:
            what = "in itself" if key in self.known else "unknown, or nested too deep"
            raise FileFormatError(f"the set {name!r} is {what}.")
        self.known[key] = None
        parts = [np.zeros(0, dtype=np.int64)]
        for member in self.members[key]:
            if isinstance(member, range) and len(member) > MOST_NODES:
                raise UnsafeFileError(f"the set {name!r} has {len(member)} {self.what}.")
            own = self.of(member) if isinstance(member, str) else np.array(member)
            parts.append(np.atleast_1d(own).astype(np.int64))
        self.known[key] = out = np.unique(np.concatenate(parts))
        return out
