"""What all decks share: lines of a file and those it includes, numbers, and cards not read."""

import math
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from rom.errors import FileFormatError
from rom.readable import check_readable

BARE_EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")
WHOLE_PATTERN = re.compile(r"[+-]?\d{1,18}", re.ASCII)
MOST_INCLUDED = 20  # files in files
Place = tuple[Path, int]  # file and line
CURES = {  # words of cards that are not read -> what to do instead
    r"\bR(BE|BAR|ROD)|MPC|COUPLING|EQUATION|TIE|RIGID|\bC[EP]|ET, (17\d|184)\b": "Ties: "
    "rigid and averaging elements of all directions are read from .bdf and .inp; take others out, "
    "and interfaces={...} makes rigid (rbe2) and distributing (rbe3) ones; a stiff spring ties one "
    "component.",
    r"CONM|MASS|NSM|INERTIA|ET, 21\b": "Masses: point masses are read from .bdf and .inp; take "
    "others out, and rom.Attachment adds them to the model.",
    r"BUSH|ELAS|CDAMP|SPRING|DASHPOT|COMBIN|ET, (14|39|40)\b": "Springs: linear ones between nodes "
    "are read from .bdf and .inp; others, and those to ground, stand in the mechanism.",
    r"PSHELL|PCOMP|SHELL SECTION": "Shells without this card only name faces of the solid.",
    r"COPY|GEN|FILL|INSTANCE|PART|SYSTEM": "Write all nodes and elements out, in one system.",
}


def lines(path: Path, include: re.Pattern[str], depth: int = 0) -> Iterator[tuple[Place, str]]:
    """All lines of a deck, with those of the files it includes in their places.

    The pattern finds the ``file`` in a line; a ``keyword`` other than INCLUDE keeps the line.
    """
    check_readable(path)
    if depth > MOST_INCLUDED:
        raise FileFormatError("files include each other too deep.", where=str(path))
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            found = include.match(line)
            if not found or found["keyword"].strip().upper() != "INCLUDE":
                yield (path, number), line
            if found:
                other = path.parent / found["file"].strip().strip("\"'")
                yield from lines(other, include, depth + 1)


def at(place: Place) -> str:
    """File and line, for messages."""
    return f"{place[0]}, line {place[1]}"


def real(text: str) -> float:
    """A number of a deck, e.g. 1.5D+3, 1.5+3 or .5; nothing is zero. ValueError if it is none."""
    word = text.strip().upper().replace("D", "E") or "0"
    try:
        value = float(word if "E" in word else BARE_EXPONENT.sub(r"E\1", word))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{text.strip()[:20]!r} is no finite number")
    return value


def row(values: Iterable[float]) -> str:
    """Numbers as a line of a deck, in fourteen digits."""
    return ", ".join(f"{v:.13e}" for v in values)


def whole(text: str) -> int:
    """The label of a node, or a component. ValueError if it is none, or fits no eight bytes."""
    if not WHOLE_PATTERN.fullmatch(text.strip()):
        raise ValueError(f"{text.strip()[:20]!r} is no whole number of at most 18 digits")
    return int(text)


class Unread(dict[str, list[Place]]):
    """Cards of a deck that are not read, and where they stand."""

    def add(self, name: str, place: Place) -> None:
        """Note a card."""
        self.setdefault(name, []).append(place)

    def __str__(self) -> str:
        first = {name: (len(places), *places[0]) for name, places in self.items()}
        return ", ".join(f"{name} ({n}, {p.name} line {k})" for name, (n, p, k) in first.items())

    def refuse(self) -> None:
        """Raise a FileFormatError that names all of them, if there are any."""
        if self:
            cures = (cure for words, cure in CURES.items() if re.search(words, " ".join(self)))
            raise FileFormatError(
                f"the deck has cards that are not read, {self}: without what they mean, mass or "
                "stiffness would be those of another body.",
                where=str(next(iter(self.values()))[0][0]),
                hint=" ".join(cures) or "Take them out; solids, their nodes and sets are read.",
            )

    def remark(self) -> list[str]:
        """Of cards that a free body does not need."""
        return [f"left aside, as a free body needs none of it: {self}."] if self else []
