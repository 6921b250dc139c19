"""Matrices in Nastran's OUTPUT4 files: text and binary, dense and sparse.

A matrix is a header (columns, rows, form, type, name) and strings of consecutive values of one
column. A negative number of rows announces strings with long headers. Lengths count words, of four
bytes or, in binary files whose headers have 48 bytes, of eight.

Source:
    MSC Nastran 2012 DMAP Programmer's Guide, OUTPUT4, tables of formats.
"""

import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import NoReturn

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_matrix, csr_matrix

from rom.errors import ConfigError, FileFormatError, UnsafeFileError
from rom.io.files import check_readable, damaged, need, write_lines
from rom.model import Array
from rom.names import MAX_NAMED

MOST_ROWS = 10_000_000
SYMMETRIC_FORM, RECTANGULAR_FORM = 6, 2
DIGITS = re.compile(rb"[ \d-]{24}")
FORMAT_PATTERN = re.compile(r"\(?(?:1P,?)?(\d+)[EDG](\d+)\.\d+(?:E\d)?\)?")
BARE_EXPONENT = re.compile(r"(?<=\d)(?=[+-])")  # where Fortran leaves no place for the letter
WIDE_MARK = "|I16"  # ends headers whose first two numbers have 16 columns
COMPLEX_KINDS, DOUBLE_KINDS = (3, 4), (2, 4)
Values = Array | npt.NDArray[np.complex128]


@dataclass(slots=True)
class _Strings:
    """A matrix as it is read: values of consecutive rows of one column."""

    name: str
    place: str
    rows: int
    columns: int
    long: bool
    kind: int
    found: list[tuple[int, int, Values]] = field(default_factory=list)

    def add(self, column: int, row: int, numbers: Array) -> None:
        values: Values = numbers
        if self.kind in COMPLEX_KINDS:
            values = np.ascontiguousarray(numbers).view(np.complex128)
        inside = 0 <= column < self.columns and 0 <= row <= self.rows - values.size
        need(inside, f"a string of {self.name} reaches beyond {self.rows} rows")
        need(np.isfinite(values).all(), f"{self.name} holds a number that is not finite")
        self.found.append((column, row, values))

    def matrix(self) -> csr_matrix:
        columns = [np.full(v.size, c) for c, _, v in self.found]
        rows = [np.arange(r, r + v.size) for _, r, v in self.found]
        data = [v for _, _, v in self.found]
        i, j, v = (np.concatenate(x) if x else np.zeros(0) for x in (rows, columns, data))
        return csr_matrix((v, (i.astype(int), j.astype(int))), shape=(self.rows, self.columns))


class Matrices(dict[str, csr_matrix]):
    """Matrices of a file by their names, ``NAME#1``, ``NAME#2`` where a name stands twice."""

    def __init__(self, where: str, found: Mapping[str, csr_matrix], places: Mapping[str, str]):
        super().__init__(found)
        self.where, self.places = where, places

    def __missing__(self, key: str) -> NoReturn:
        doubled = [k for k in self if k.rpartition("#")[0] == key] if key else []
        what = f"{len(doubled)} matrices" if doubled else "no matrix"
        each = ", ".join(map(self._described, sorted(doubled or self)[:MAX_NAMED]))
        named = f"{what} {key!r}; there are" if key else f"{len(self)} matrices:"
        raise ConfigError(
            f"{self.where} has {named} {each}.",
            hint=f"Name one, as in (file, {(doubled or [*self])[-1]!r}), on the command line "
            "FILE:NAME.",
        )

    def _described(self, key: str) -> str:
        rows, columns = self[key].shape
        kind = " complex" if np.iscomplexobj(self[key]) else ""
        at = f", {self.places[key]}" if key in self.places else ""
        return f"{key} ({rows} x {columns}{kind}{at})"


def read_op4(path: str | Path) -> Matrices:
    """All matrices of a file, real and complex, by their names in capitals.

    Where a name stands more than once, the keys are ``NAME#1``, ``NAME#2`` in the order of the
    file, and the name alone raises an error that says where each stands.

    Args:
        path: a text or binary file, of either byte order and words of four or eight bytes.

    Raises:
        FileFormatError: if the file is missing or cut.
        UnsafeFileError: if it is larger than 4 GiB, or a matrix has more than ten million rows.
    """
    path = check_readable(path)
    data = path.read_bytes()
    reader: _Text | _Binary = _Text(data) if DIGITS.match(data[:24]) else _Binary(data)
    all_found: list[_Strings] = []
    try:
        with damaged("no OUTPUT4 matrix stands here"):
            while (found := reader.next()) is not None:
                all_found.append(found)
    except FileFormatError as error:
        error.where = f"{path}, {reader.place}"
        raise
    if not all_found:
        raise FileFormatError("the file holds no matrix.", where=str(path))
    return _by_name(str(path), all_found)


def _by_name(where: str, all_found: list[_Strings]) -> Matrices:
    names = [found.name for found in all_found]
    keys = [
        name if names.count(name) == 1 else f"{name}#{names[:k].count(name) + 1}"
        for k, name in enumerate(names)
    ]
    matrices = {key: found.matrix() for key, found in zip(keys, all_found, strict=True)}
    return Matrices(where, matrices, dict(zip(keys, (f.place for f in all_found), strict=True)))


def write_op4(matrices: Mapping[str, Array | csr_matrix], path: str | Path) -> Path:
    """Write matrices as text with 17 digits.

    Args:
        matrices: {name of at most 8 characters: (n, m) matrix}, in units of any kind.
        path: file to write.
    """
    texts = (_written(name, csc_matrix(A)) for name, A in matrices.items())
    return write_lines(path, chain.from_iterable(texts))


def _written(name: str, A: csc_matrix) -> Iterator[str]:
    rows, columns = A.shape
    symmetric = rows == columns and abs(A - A.T).max() == 0
    form = SYMMETRIC_FORM if symmetric else RECTANGULAR_FORM
    yield f"{columns:8d}{rows:8d}{form:8d}{2:8d}{name.upper():<8.8}1P,3E23.16"
    for c in range(columns):
        column = A[:, c].toarray().ravel()
        (filled,) = np.nonzero(column)
        if filled.size:
            values = column[filled[0] : filled[-1] + 1]
            yield f"{c + 1:8d}{filled[0] + 1:8d}{values.size:8d}"
            yield from _packed(values)
    yield f"{columns + 1:8d}{1:8d}{1:8d}"
    yield from _packed(np.ones(1))


def _packed(values: Array) -> Iterator[str]:
    for k in range(0, values.size, 3):
        yield "".join(f"{v:23.16E}" for v in values[k : k + 3])


def _checked(columns: int, rows: int, kind: int, name: str, place: str) -> _Strings:
    need(1 <= kind <= 4, f"{name} is of the unknown type {kind}")
    need(columns and rows, f"{name} has {rows} rows and {columns} columns")
    if max(abs(columns), abs(rows)) > MOST_ROWS:
        raise UnsafeFileError(f"{name} has {abs(rows)} rows and {columns} columns.")
    return _Strings(name.strip().upper(), place, abs(rows), abs(columns), rows < 0, kind)


class _Text:
    """Matrices of a text file, one after the other."""

    def __init__(self, data: bytes):
        self.lines, self.number = data.decode("ascii", "replace").splitlines(), 0

    @property
    def place(self) -> str:
        return f"line {self.number}"

    def next(self) -> _Strings | None:
        if not any(line.strip() for line in self.lines[self.number :]):
            return None
        line = self._line().rstrip()
        if line.endswith(WIDE_MARK):
            line = f"{int(line[:16]):8d}{int(line[16:32]):8d}{line[32:].removesuffix(WIDE_MARK)}"
        columns, rows, _, kind = (int(line[8 * k : 8 * k + 8]) for k in range(4))
        text = line[40:].strip().upper() or "1P,5E16.9"
        found = FORMAT_PATTERN.fullmatch(text)
        if found is None or not int(found[1]) or not int(found[2]):
            raise ValueError(f"the format {text!r} is unknown")
        self.per_line, self.width = int(found[1]), int(found[2])
        matrix = _checked(columns, rows, kind, line[32:40], self.place)
        self.words = 2 if kind in DOUBLE_KINDS else 1  # that a number counts in sparse columns
        while True:
            line = self._line()
            words = line.split() if len(line.split()) == 3 else re.findall(".{8}", line)
            column, row, n = (int(word) for word in words[:3])
            if column > matrix.columns:
                self._values(n)
                return matrix
            if row > 0:
                matrix.add(column - 1, row - 1, self._values(n))
                continue
            while n > 0:
                n -= self._string(matrix, column - 1)

    def _string(self, matrix: _Strings, column: int) -> int:
        """Read one sparse string; how many words it took."""
        line = self._line()
        head = (int(line[:8]), int(line[8:16])) if matrix.long else divmod(int(line), 65536)
        length, row = head
        matrix.add(column, row - 1, self._values((length - 1) // self.words))
        return length + matrix.long

    def _values(self, n: int) -> Array:
        most = (len(self.lines) - self.number) * self.per_line
        need(0 < n <= most, f"{n} values are announced")
        out: list[float] = []
        while len(out) < n:
            line, count = self._line().upper().replace("D", "E"), min(self.per_line, n - len(out))
            cells = [line[self.width * k : self.width * (k + 1)] for k in range(count)]
            out += [float(c if "E" in c else BARE_EXPONENT.sub("E", c)) for c in cells]
        return np.array(out)

    def _line(self) -> str:
        self.number += 1
        need(self.number <= len(self.lines), "the file ends too early")
        return self.lines[self.number - 1]


class _Binary:
    """Matrices of a binary file of Fortran records, one after the other."""

    def __init__(self, data: bytes):
        self.data, self.at = data, 0
        self.order = "<" if data[:4] in (struct.pack("<i", n) for n in (24, 48)) else ">"

    @property
    def place(self) -> str:
        return f"byte {self.at}"

    def next(self) -> _Strings | None:
        if self.at >= len(self.data):
            return None
        place, head = self.place, self._record()
        need(len(head) in (24, 48), f"a header has 24 or 48 bytes, not {len(head)}")
        self.size = len(head) // 6  # bytes of a word
        columns, rows, _, kind = self._integers(head, 0, 4)
        name = head[4 * self.size :].decode("ascii", "replace")
        matrix = _checked(columns, rows, kind, "".join(name.split()), place)
        self.real = f"{self.order}f{max(self.size, 8 if kind in DOUBLE_KINDS else 4)}"
        while True:
            record = self._record()
            column, row, words = self._integers(record, 0, 3)
            if column > matrix.columns:
                return matrix
            values = record[3 * self.size :]
            if row > 0:
                matrix.add(column - 1, row - 1, self._values(values, words))
            else:
                self._strings(matrix, column - 1, values[: self.size * words])

    def _strings(self, matrix: _Strings, column: int, data: bytes) -> None:
        at = 0
        while at < len(data):
            head = self._integers(data, at, 1 + matrix.long)
            length, row = head if matrix.long else divmod(head[0], 65536)
            at += self.size * len(head)
            need(length > 1, f"a string of {length - 1} words")
            matrix.add(column, row - 1, self._values(data[at:], length - 1))
            at += self.size * (length - 1)

    def _integers(self, data: bytes, at: int, n: int) -> tuple[int, ...]:
        kind = "i" if self.size == 4 else "q"
        return struct.unpack_from(f"{self.order}{n}{kind}", data, at)

    def _values(self, data: bytes, words: int) -> Array:
        n, rest = divmod(self.size * words, int(self.real[-1]))
        there = 0 < self.size * words <= len(data) and not rest
        need(there, f"{words} words are announced, {len(data) // self.size} are there")
        return np.frombuffer(data, self.real, n).astype(float)

    def _record(self) -> bytes:
        (n,) = struct.unpack_from(f"{self.order}i", self.data, self.at)
        end = self.at + 4 + n
        closes = n >= 12 and struct.unpack_from(f"{self.order}i", self.data, end) == (n,)
        need(closes, f"a record of {n} bytes does not close")
        record, self.at = self.data[self.at + 4 : end], end + 4
        return record
