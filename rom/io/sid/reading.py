"""Reads Standard Input Data, whichever program wrote them."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np

from rom.errors import FileFormatError, UnsafeFileError
from rom.io.files import check_readable
from rom.io.sid.format import BLOCKS, NODE_BLOCKS, SIZES, SYMMETRIC, UNIT, ZERO, shape_of
from rom.model import Array
from rom.names import ORIGIN_MARK, is_whole

MAX_BYTES = 2**28  # of a file that is still read
MOST_MODES = 1000  # blocks grow with their square
ASSIGNMENT_PATTERN = re.compile(r"([A-Za-z]\w*(?:\s+\w+)?)\s*(?:\(([^)]*)\))?\s*=\s*(.*)")
HEAD_PATTERN = re.compile(r"^\d+\s+\d+\s*:No\. nodes, No\. modes:")
LONGEST_MESSAGE = 200  # characters that quote a damaged file


@dataclass(slots=True)
class RawBlock:
    """A block as written; the order of the three indices of m1 is not known yet."""

    name: str
    line: int  # where it begins
    sizes: dict[str, int] = field(default_factory=dict)  # order, nrow, ncol, nq, nqn, structure
    m0: dict[tuple[int, int], float] = field(default_factory=dict)  # indices from one
    m1: dict[tuple[int, int, int], float] = field(default_factory=dict)
    dropped: int = 0


@dataclass(slots=True)
class RawFile:
    """A file as written."""

    path: Path
    title: str = ""
    name: str = ""
    mass: float = np.nan
    n_modes: int = -1
    coordinates: dict[int, str] = field(default_factory=dict)
    nodes: dict[str, dict[str, RawBlock]] = field(default_factory=dict)
    blocks: dict[str, RawBlock] = field(default_factory=dict)

    def refuse(self, message: str, line: int) -> NoReturn:
        """Raise an error that names file and line."""
        message = message if len(message) <= LONGEST_MESSAGE else f"{message[:LONGEST_MESSAGE]}..."
        raise FileFormatError(f"{message.rstrip('.')}.", where=f"{self.path}, line {line}")


class _Lines:
    """Lines that are not empty, with their numbers, one of them known ahead."""

    def __init__(self, file: RawFile, text: str):
        self.file, self.number = file, 0
        self._rest: Iterator[tuple[int, str]] = (
            (k, line.strip()) for k, line in enumerate(text.splitlines(), 1) if line.strip()
        )

    def next(self) -> str:
        self.number, line = next(self._rest, (self.number, ""))
        if not line:
            self.file.refuse("the file ends too early", self.number)
        return " ".join(line.split())


def read_raw(path: str | Path) -> RawFile:
    """The content of a file as written, its sizes checked before memory is taken."""
    file = RawFile(check_readable(path, MAX_BYTES))
    lines = _Lines(file, file.path.read_bytes().decode("ascii", "replace"))
    file.title = HEAD_PATTERN.sub("", lines.next()).strip().removesuffix(f"; {ORIGIN_MARK}")
    _expect(lines, "part")
    key, _, file.name = lines.next().partition("=")
    if key.split() != ["new", "modal"]:
        file.refuse("'new modal =' was expected", lines.number)
    file.name = file.name.strip()
    _expect(lines, "refmod")
    _reference(file, lines)
    _expect(lines, "frame")
    _frames(file, lines)
    while (name := lines.next()) != "end modal":
        _enter(file, file.blocks, name, BLOCKS, lines)
    _expect(lines, "end part")
    missing = [name for name in BLOCKS if name not in file.blocks]
    if missing:
        file.refuse(f"the block {', '.join(missing)} is missing", lines.number)
    return file


def values(file: RawFile, block: RawBlock, *, mode_second: bool) -> tuple[Array, Array | None]:
    """M0 (n, m) and M1 (r, n, m) or None, symmetric blocks completed."""
    n, m = block.sizes["nrow"], block.sizes["ncol"]
    symmetric = block.sizes["structure"] == SYMMETRIC
    M0 = np.eye(n, m) if block.sizes["structure"] == UNIT else np.zeros((n, m))
    for (i, j), value in block.m0.items():
        M0[i - 1, j - 1] = value
        if symmetric and (j, i) not in block.m0:
            M0[j - 1, i - 1] = value
    if block.sizes["order"] == 0:
        return M0, None
    M1 = np.zeros((file.n_modes, n, m))
    for (i, b, c), value in block.m1.items():
        k, j = (b, c) if mode_second else (c, b)
        M1[k - 1, i - 1, j - 1] = value
        if symmetric and ((j, k, i) if mode_second else (j, i, k)) not in block.m1:
            M1[k - 1, j - 1, i - 1] = value
    return M0, M1


def _expect(lines: _Lines, word: str) -> None:
    if (line := lines.next()) != word:
        lines.file.refuse(f"{word!r} was expected, found {line[:60]!r}", lines.number)


def _reference(file: RawFile, lines: _Lines) -> None:
    while (line := lines.next()) != "end refmod":
        key, index, value = _assignment(lines, line)
        if key == "mass":
            file.mass = _real(lines, value)
        elif key == "nelastq":
            file.n_modes = _integer(lines, value)
        elif key == "ielastq":
            file.coordinates[_integer(lines, index)] = value
    if not file.mass > 0 or file.n_modes < 0:
        file.refuse(f"mass {file.mass:g} and nelastq {file.n_modes} are no body", lines.number)
    if file.n_modes > MOST_MODES:
        raise UnsafeFileError(
            f"nelastq = {file.n_modes} is above the limit of {MOST_MODES}.", where=str(file.path)
        )


def _frames(file: RawFile, lines: _Lines) -> None:
    while (line := lines.next()) != "end frame":
        key, _, label = _assignment(lines, line)
        if key != "new node" or label in file.nodes:
            file.refuse(f"a new node was expected, found {line[:60]!r}", lines.number)
        node = file.nodes[label] = {}
        while (line := lines.next()) != "end node":
            if not line.startswith("rframe"):
                _enter(file, node, line, NODE_BLOCKS, lines)
        missing = [name for name in NODE_BLOCKS[:4] if name not in node]
        if missing:
            file.refuse(f"node {label!r} has no {', '.join(missing)}", lines.number)


def _enter(
    file: RawFile, found: dict[str, RawBlock], name: str, known: tuple[str, ...], lines: _Lines
) -> None:
    if name not in known or name in found:
        what = "twice" if name in found else "unknown"
        file.refuse(f"the block {name[:60]!r} is {what}", lines.number)
    block = found[name] = RawBlock(name, lines.number)
    while (line := lines.next()) != f"end {name}":
        key, index, value = _assignment(lines, line)
        if key in SIZES and not index:
            block.sizes[key] = _integer(lines, value)
            continue
        if len(block.sizes) < len(SIZES):
            file.refuse(f"{key!r} stands before the sizes of {name}", lines.number)
        _fill(file, block, key, index, _real(lines, value), lines.number)
    _check_sizes(file, block)


def _fill(file: RawFile, block: RawBlock, key: str, index: str, value: float, line: int) -> None:
    numbers = index.split(",")
    wanted = {"m0": 2, "m1": 3, "mn": 3}
    if len(numbers) != wanted.get(key) or not all(is_whole(n.strip()) for n in numbers):
        file.refuse(f"{key}({index}) is no entry of a block", line)
    if key == "mn":
        block.dropped += 1
        return
    place = tuple(int(n) for n in numbers)
    n, m, r = block.sizes["nrow"], block.sizes["ncol"], file.n_modes
    high = max(m, r) if key == "m1" else m
    if not (1 <= place[0] <= n and all(1 <= i <= high for i in place[1:])):
        file.refuse(f"{key}({index}) is outside of {block.name}, {n} x {m}", line)
    (block.m0 if key == "m0" else block.m1)[place] = value  # type: ignore[index]


def _check_sizes(file: RawFile, block: RawBlock) -> None:
    missing = [key for key in SIZES if key not in block.sizes]
    if missing:
        file.refuse(f"{block.name} has no {', '.join(missing)}", block.line)
    shape = block.sizes["nrow"], block.sizes["ncol"]
    known = [shape_of(block.name, file.n_modes)] + [(6, 1)] * (block.name == "J")
    if shape not in known:
        file.refuse(f"{block.name} is {shape[0]} x {shape[1]}, expected {known[0]}", block.line)
    structure, order = block.sizes["structure"], block.sizes["order"]
    if structure not in range(5) or (structure in (SYMMETRIC, UNIT) and shape[0] != shape[1]):
        file.refuse(f"{block.name} has the structure {structure}", block.line)
    unfit = {place: x for place, x in block.m0.items() if x != (place[0] == place[1])}
    if unfit if structure == UNIT else structure == ZERO and block.m0:
        file.refuse(f"{block.name} has entries, but the structure {structure}", block.line)
    if not 0 <= order <= 2 or (order == 0 and block.m1):
        file.refuse(f"{block.name} has the order {order}", block.line)


def _assignment(lines: _Lines, line: str) -> tuple[str, str, str]:
    found = ASSIGNMENT_PATTERN.fullmatch(line)
    if found is None:
        lines.file.refuse(f"{line[:60]!r} is neither a block nor an assignment", lines.number)
    return found[1], found[2] or "", found[3]


def _integer(lines: _Lines, text: str) -> int:
    if not re.fullmatch(r"\s*\d{1,9}\s*", text):
        lines.file.refuse(f"{text[:40]!r} is no whole number", lines.number)
    return int(text)


def _real(lines: _Lines, text: str) -> float:
    try:
        value = float(text.upper().replace("D", "E"))
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        lines.file.refuse(f"{text[:40]!r} is no finite number", lines.number)
    return value
