"""Functions at nodal dofs in universal files: dataset 58, in text and in binary (58b).

Source:
    SDRC, Universal file datasets 58 and 58b, as published by the University of Cincinnati.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import accumulate, pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rom.errors import ConfigError, FileFormatError
from rom.io.files import check_readable, damaged, need
from rom.model import Array

Complex = npt.NDArray[np.complex128]
MAX_BYTES = 2**30  # of a file that is still read
BLOCK_MARK = b"    -1"
MARK_PATTERN = re.compile(rb"^" + BLOCK_MARK + rb"[ \t\r\v\f]*$", re.MULTILINE)  # alone in a line
N_HEADER_RECORDS = 11  # before the values
FREQUENCY_RESPONSE = 4
PER_RECEPTANCE = {8: 0, 11: 1, 12: 2}  # displacement, velocity, acceleration: powers of i omega
FORCE_TYPE = 13
UNIT_LABEL = slice(47, 67)  # columns of records 8 to 11
MAX_MEASURED = 1e30  # in units of any kind
COMPLEX_TYPES, DOUBLE_TYPES = (5, 6), (4, 6)  # types of ordinate


@dataclass(frozen=True, slots=True)
class Function:
    """One dataset 58."""

    kind: int  # 4 is a frequency response, 6 a coherence, 1 a time response
    x: Array  # (n,) abscissa, mostly frequency [Hz] or time [s]
    y: Array | Complex  # (n,) real or complex ordinate
    # node and direction: 1 to 3 translation, 4 to 6 rotation, negative against it
    response: tuple[int, int]
    reference: tuple[int, int]  # the same of the force
    numerator: int  # 8 displacement, 11 velocity, 12 acceleration, 13 force
    denominator: int  # type of what it is divided by
    labels: tuple[str, ...]  # first five lines, stripped
    units: tuple[str, str] = ("", "")  # labels, of numerator and denominator
    entities: tuple[str, str] = ("", "")  # of response and reference; "NONE" without one
    abscissa: str = ""  # label of its unit

    def receptance(self) -> Complex:
        """(n,) displacement per force [m/N], whatever was measured."""
        if self.kind != FREQUENCY_RESPONSE or self.denominator != FORCE_TYPE:
            raise ConfigError(f"{_name(self)}: the function must be a response to a force.")
        if self.numerator not in PER_RECEPTANCE:
            text = f"{self.numerator} must be of {sorted(PER_RECEPTANCE)}"
            raise ConfigError(f"{_name(self)}: {text}.")
        power = PER_RECEPTANCE[self.numerator]
        if power and not self.x.all():
            raise ConfigError(f"{_name(self)}: displacements need frequencies > 0 Hz.")
        return np.asarray(self.y / (2j * np.pi * self.x) ** power, dtype=np.complex128)


def read_universal(path: str | Path) -> tuple[Function, ...]:
    """All datasets 58 of a universal file, .unv or .uff; others are passed over.

    Raises:
        FileFormatError: if the file is missing, cut, or holds no function.
        UnsafeFileError: if it is larger than 1 GiB.
    """
    found, _ = scan(path)
    if not found:
        raise FileFormatError(f"{path} holds no function at nodal dofs (dataset 58).")
    return found


def scan(path: str | Path) -> tuple[tuple[Function, ...], dict[str, list[list[str]]]]:
    """All datasets of a universal file: functions, and lines of the others by their number."""
    path = check_readable(path, MAX_BYTES)
    data, place = path.read_bytes(), 0
    found: list[Function] = []
    others: dict[str, list[list[str]]] = {}
    while (place := _mark(data, place)) < len(data):
        place = _line_end(data, place)
        head = data[place : (after := _line_end(data, place))].split()
        kind = head[0].decode("ascii", "replace") if head else ""
        with damaged(f"dataset {len(found) + 1} is cut or no dataset 58", path):
            place, function = _dataset(data, after, kind.lower(), head)
        if function:
            found.append(function)
            continue
        with damaged(f"dataset {kind or 'without a number'} is cut", path):
            end = _closed(data, after)
        if kind:
            text = data[after:end].decode("ascii", "replace")
            others.setdefault(kind, []).append(text.splitlines())
    return tuple(found), others


def _name(f: Function) -> str:
    return f"function of {f.response} by {f.reference}"


def _line_end(data: bytes, place: int) -> int:
    """Behind the end of the line that starts here."""
    end = data.find(b"\n", place)
    return len(data) if end < 0 else end + 1


def _mark(data: bytes, place: int) -> int:
    """Start of the next line that is the mark of datasets, or the end."""
    found = MARK_PATTERN.search(data, place)
    return found.start() if found else len(data)


def _closed(data: bytes, place: int) -> int:
    need((end := _mark(data, place)) < len(data), "the closing -1 is missing")
    return end


def _dataset(data: bytes, place: int, kind: str, head: list[bytes]) -> tuple[int, Function | None]:
    """The place behind the dataset whose first record starts here, and what it holds."""
    binary = kind.startswith("58b")
    if not binary and kind != "58":
        return _line_end(data, _mark(data, place)), None
    lines = []
    for _ in range(N_HEADER_RECORDS):
        end = _line_end(data, place)
        lines.append(data[place:end].decode("ascii", "replace").rstrip("\r\n"))
        place = end
    ordinate, n, spacing = (int(lines[6][a : a + 10]) for a in (0, 10, 20))
    parts = 2 if ordinate in COMPLEX_TYPES else 1
    width = parts + (spacing == 0)
    if binary:
        even = spacing != 0 or ordinate not in DOUBLE_TYPES
        need(even, "uneven abscissas of double values are not read from binary")
        values, place = _binary(data, place, head, ordinate, n * width)
        closing = _closing(data, place)
        place = _line_end(data, _mark(data, place) if closing < 0 else closing)
    else:
        end = _closed(data, place)
        values = _numbers(data[place:end].decode("ascii"), ordinate, spacing == 0, parts)
        place = _line_end(data, end)
    need(values.size >= n * width, f"{values.size} numbers where {n * width} are announced")
    return place, _function(lines, values[: n * width].reshape(n, width), spacing, parts)


def _function(lines: list[str], values: Array, spacing: int, parts: int) -> Function:
    dof, form = lines[5], lines[6]
    x = values[:, 0]
    if spacing != 0:
        x = float(form[30:43]) + np.arange(len(values)) * float(form[43:56])
    y = values[:, -1] if parts == 1 else values[:, -2] + 1j * values[:, -1]
    return Function(
        kind=int(dof[:5]),
        x=x,
        y=y,
        response=(int(dof[41:51]), int(dof[51:55])),
        reference=(int(dof[66:76]), int(dof[76:80])),
        numerator=int(lines[8][:10]),
        denominator=int(lines[9][:10]),
        labels=tuple(line.strip() for line in lines[:5]),
        units=(lines[8][UNIT_LABEL].strip(), lines[9][UNIT_LABEL].strip()),
        entities=(dof[31:41].strip(), dof[56:66].strip()),
        abscissa=lines[7][UNIT_LABEL].strip(),
    )


def _numbers(text: str, kind: int, uneven: bool, parts: int) -> Array:
    """Values in columns that may touch: E13.5, or E20.12 for double ordinates."""
    widths = [20] * 4 if kind in DOUBLE_TYPES else [13] * 6
    if kind in DOUBLE_TYPES and uneven:
        widths = [13, 20, 20] if parts == 2 else [13, 20] * 2
    return np.array([x for line in text.splitlines() for x in reals(line, widths)])


def reals(line: str, widths: Iterable[int]) -> list[float]:
    """Numbers in columns of these widths, which may touch; empty columns are left out."""
    cells = (line[a:b].strip() for a, b in pairwise(accumulate(widths, initial=0)))
    return [float(cell.replace("D", "E")) for cell in cells if cell]


def _binary(data: bytes, place: int, head: list[bytes], kind: int, count: int) -> tuple[Array, int]:
    """Values of a 58b, whose head tells byte order (1 little) and floating point (2 IEEE).

    Some writers announce too few bytes: of complex numbers the real parts alone. They are believed
    where the closing mark stands behind as many bytes as the numbers need.
    """
    fields = [int(word) for word in b" ".join(head)[3:].split()]
    need(fields[1] == 2, "its numbers are not IEEE floating point")
    left = len(data) - place
    need(fields[3] <= left, f"{fields[3]} bytes announced, {left} left")
    order = "<" if fields[0] == 1 else ">"
    size = 8 if kind in DOUBLE_TYPES else 4
    needed = count * size
    enough = fields[3] >= needed or _closing(data, place + needed) >= 0
    need(enough, f"{fields[3]} bytes for {count} numbers of {size}")
    with np.errstate(invalid="ignore"):
        values = np.frombuffer(data, f"{order}f{size}", count, place).astype(float)
    measured = not (np.abs(values) > MAX_MEASURED).any()
    need(measured, "numbers beyond all that is measured: the order of bytes is not that said")
    return values, place + max(fields[3], needed)


def _closing(data: bytes, place: int) -> int:
    """The mark right behind values, with or without an end of line before it, or -1."""
    while data[place : place + 1] in (b"\r", b"\n"):
        place += 1
    return place if data.startswith(BLOCK_MARK, place) else -1
