"""Reads Standard Input Data, whichever program wrote them."""

import re
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rom.decks.lines import whole
from rom.errors import UnsafeFileError
from rom.io.files import Line, check_readable, damaged, need, number
from rom.io.sid.format import BLOCKS, NODE_BLOCKS, SIZES, SYMMETRIC, UNIT, ZERO, shape_of
from rom.model import Array
from rom.names import ORIGIN_MARK, is_whole

MAX_BYTES = 2**28  # of a file that is still read
MOST_MODES = 1000  # blocks grow with their square
ASSIGNMENT_PATTERN = re.compile(r"([A-Za-z]\w*(?:\s+\w+)?)\s*(?:\(([^)]*)\))?\s*=\s*(.*)")
HEAD_PATTERN = re.compile(r"^\d+\s+\d+\s*:No\. nodes, No\. modes:")
MOST_QUOTED = 40  # characters of a damaged file


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


class _Lines(Line):
    """Lines that are not empty, with their numbers; written in a message, the place of the last."""

    def __init__(self, path: Path, text: str):
        super().__init__(path)
        self._rest: Iterator[tuple[int, str]] = (
            (k, line.strip()) for k, line in enumerate(text.splitlines(), 1) if line.strip()
        )

    def next(self) -> str:
        self.number, line = next(self._rest, (self.number, ""))
        need(line, "the file ends too early")
        return " ".join(line.split())

    def until(self, end: str) -> Iterator[str]:
        """Lines before the one that ends what they are of."""
        return iter(self.next, end)

    def expect(self, word: str) -> None:
        line = self.next()
        need(line == word, f"{word!r} was expected, found {line[:MOST_QUOTED]!r}")


def read_raw(path: str | Path) -> RawFile:
    """The content of a file as written, its sizes checked before memory is taken."""
    file = RawFile(check_readable(path, MAX_BYTES))
    lines = _Lines(file.path, file.path.read_bytes().decode("ascii", "replace"))
    with damaged("this is no Standard Input Data", lines):
        file.title = HEAD_PATTERN.sub("", lines.next()).strip().removesuffix(f"; {ORIGIN_MARK}")
        lines.expect("part")
        key, _, name = lines.next().partition("=")
        need(key.split() == ["new", "modal"], "'new modal =' was expected")
        file.name = name.strip()
        lines.expect("refmod")
        _reference(file, lines)
        lines.expect("frame")
        _frames(file, lines)
        for name in lines.until("end modal"):
            _enter(file, file.blocks, name, BLOCKS, lines)
        lines.expect("end part")
        _need_all(BLOCKS, file.blocks, "the file")
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


def _need_all(names: Sequence[str], found: Container[str], whose: str) -> None:
    missing = [name for name in names if name not in found]
    need(not missing, f"{whose} has no {', '.join(missing)}")


def _reference(file: RawFile, lines: _Lines) -> None:
    for line in lines.until("end refmod"):
        key, index, value = _assignment(line)
        if key == "mass":
            file.mass = number(value)
        elif key == "nelastq":
            file.n_modes = whole(value)
        elif key == "ielastq":
            file.coordinates[whole(index)] = value
    exists = file.mass > 0 and file.n_modes >= 0
    need(exists, f"mass {file.mass:g} and nelastq {file.n_modes} are no body")
    if file.n_modes > MOST_MODES:
        text = f"nelastq = {file.n_modes} is above the limit of {MOST_MODES}."
        raise UnsafeFileError(text, where=str(file.path))


def _frames(file: RawFile, lines: _Lines) -> None:
    for line in lines.until("end frame"):
        key, _, label = _assignment(line)
        new = key == "new node" and label not in file.nodes
        need(new, f"a new node was expected, found {line[:MOST_QUOTED]!r}")
        node = file.nodes[label] = {}
        for name in lines.until("end node"):
            if not name.startswith("rframe"):
                _enter(file, node, name, NODE_BLOCKS, lines)
        _need_all(NODE_BLOCKS[:4], node, f"node {label[:MOST_QUOTED]!r}")


def _enter(
    file: RawFile, found: dict[str, RawBlock], name: str, known: tuple[str, ...], lines: _Lines
) -> None:
    what = "twice" if name in found else "unknown"
    need(name in known and name not in found, f"the block {name[:MOST_QUOTED]!r} is {what}")
    block = found[name] = RawBlock(name, lines.number)
    for line in lines.until(f"end {name}"):
        key, index, value = _assignment(line)
        if key in SIZES and not index:
            block.sizes[key] = whole(value)
            continue
        sized = len(block.sizes) == len(SIZES)
        need(sized, f"{key[:MOST_QUOTED]!r} stands before the sizes of {name}")
        _fill(block, key, index, number(value), file.n_modes)
    _check_sizes(file, block)


def _fill(block: RawBlock, key: str, index: str, value: float, r: int) -> None:
    numbers, wanted = index.split(","), {"m0": 2, "m1": 3, "mn": 3}
    entry = f"{key}({index})"[:MOST_QUOTED]
    plain = all(is_whole(n.strip()) for n in numbers)
    need(len(numbers) == wanted.get(key) and plain, f"{entry} is no entry of a block")
    if key == "mn":
        block.dropped += 1
        return
    place = tuple(int(n) for n in numbers)
    n, m = block.sizes["nrow"], block.sizes["ncol"]
    high = max(m, r) if key == "m1" else m
    inside = 1 <= place[0] <= n and all(1 <= i <= high for i in place[1:])
    need(inside, f"{entry} is outside of {block.name}, {n} x {m}")
    (block.m0 if key == "m0" else block.m1)[place] = value  # type: ignore[index]


def _check_sizes(file: RawFile, block: RawBlock) -> None:
    _need_all(SIZES, block.sizes, block.name)
    shape = block.sizes["nrow"], block.sizes["ncol"]
    known = [shape_of(block.name, file.n_modes)] + [(6, 1)] * (block.name == "J")
    need(shape in known, f"{block.name} is {shape[0]} x {shape[1]}, expected {known[0]}")
    structure, order = block.sizes["structure"], block.sizes["order"]
    square = shape[0] == shape[1] or structure not in (SYMMETRIC, UNIT)
    need(structure in range(5) and square, f"{block.name} has the structure {structure}")
    unfit = {place: x for place, x in block.m0.items() if x != (place[0] == place[1])}
    wrong = unfit if structure == UNIT else structure == ZERO and block.m0
    need(not wrong, f"{block.name} has entries, but the structure {structure}")
    fits = 0 <= order <= 2 and not (order == 0 and block.m1)
    need(fits, f"{block.name} has the order {order}")


def _assignment(line: str) -> tuple[str, str, str]:
    found = ASSIGNMENT_PATTERN.fullmatch(line)
    if found is None:
        raise ValueError(f"{line[:MOST_QUOTED]!r} is neither a block nor an assignment")
    return found[1], found[2] or "", found[3]
