"""Which faces of a STEP file are meant: the words of the command line, of files and of Python.

====================  =============================================================
``12``                face 12 of those that ``rom mesh part.step --faces`` lists
``0.1,0,0.02``        the face nearest to a point [m]
``radius:0.006``      every cylinder face of this radius [m]
``normal:0,0,1``      the plane face with this outward normal
``3+4``               several of these together
====================  =============================================================
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from numbers import Integral, Real

import numpy as np

from rom.errors import ConfigError

EVERY_FACE = "every"  # in place of a pick: names all faces without a name by their numbers
KINDS_OF_LISTS = {3: "point", 6: "box"}
WORDS = {"radius": 1, "normal": 3}  # and how many numbers follow
PLUS_PATTERN = re.compile(r"(?<![eE])\+")  # joins picks; 1e+3 is one number
GRAMMAR_HINT = (
    "A face is a number, as 12, a point X,Y,Z [m], radius:R [m] for cylinders, normal:X,Y,Z for a "
    "plane, or several of these, as 3+4."
)


@dataclass(frozen=True, slots=True)
class Pick:
    """One wish."""

    kind: str  # "number", "point", "radius", "normal", or "box" for all faces inside of one
    # the number; (3,) point [m]; radius [m]; (3,) direction; (6,) corners of the box [m]
    values: tuple[float, ...]
    text: str  # as it was written, for messages


def picks(wanted: object) -> tuple[Pick, ...]:
    """What a face is picked by: text as above, a number, a point (3), a box (6), or a list."""
    if isinstance(wanted, str):
        return tuple(_of_text(part.strip(), wanted) for part in PLUS_PATTERN.split(wanted))
    if isinstance(wanted, np.ndarray):
        wanted = wanted.tolist()
    if isinstance(wanted, Integral) and not isinstance(wanted, bool):
        return (_number(int(wanted)),)
    if isinstance(wanted, list | tuple):
        return tuple(_of_list(wanted))
    raise ConfigError(f"{wanted!r} is no face.", hint=GRAMMAR_HINT)


def is_pick(text: str) -> bool:
    """Whether a text picks a face, well or not, and is no name of one."""
    word, colon, _ = text.partition(":")
    return bool((colon and word in WORDS) or re.fullmatch(r"[-+.,eE\d\s]*\d[-+.,eE\d\s]*", text))


def _of_text(part: str, whole: str) -> Pick:
    word, colon, numbers = part.partition(":")
    if part.isdecimal():
        return _number(int(part))
    kind, size = (word, WORDS.get(word, -1)) if colon else ("point", 3)
    values = _floats(numbers if colon else part)
    if len(values) != size:
        why = f" ({part!r} has no meaning)" if part != whole else ""
        if size == 3 and values:
            why = f": {part!r} is not three numbers with commas, as in 0,0,1"
    elif kind == "radius" and not values[0] > 0:
        why = ": its radius must be positive [m]"
    elif kind == "normal" and not any(values):
        why = ": a normal needs a direction, such as 0,0,1"
    else:
        return Pick(kind, values, part)
    raise ConfigError(f"{whole!r} is no face{why}.", hint=GRAMMAR_HINT)


def _floats(text: str) -> tuple[float, ...]:
    """Numbers with commas; none if they are no finite numbers."""
    try:
        values = tuple(float(x) for x in text.split(","))
    except ValueError:
        return ()
    return values if all(abs(x) < float("inf") for x in values) else ()


def _number(number: int) -> Pick:
    return Pick("number", (number,), str(number))


def _of_list(wanted: Sequence[object]) -> Iterator[Pick]:
    """Three numbers are a point and six a box; other lists hold picks."""
    numbers = [x for x in wanted if isinstance(x, Real) and not isinstance(x, bool)]
    plain = len(numbers) == len(wanted)
    if plain and not all(x - x == 0 for x in numbers):
        why = "its numbers are not finite"
    elif plain and len(numbers) in KINDS_OF_LISTS:
        text = ",".join(f"{x:g}" for x in numbers)
        yield Pick(KINDS_OF_LISTS[len(numbers)], tuple(map(float, numbers)), text)
        return
    elif wanted and not (plain and any(not isinstance(x, Integral) for x in wanted)):
        for one in wanted:
            yield from picks(one)
        return
    else:
        why = "a point has 3 numbers, a box 6"
    raise ConfigError(f"{wanted!r} is no face: {why}.", hint=GRAMMAR_HINT)
