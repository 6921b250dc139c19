"""Matrices in Nastran's OUTPUT4 files: text and binary, dense and sparse.

A matrix is a header (columns, rows, form, type, name) and strings of consecutive values of one
column. A negative number of rows announces strings with long headers.

Source:
    MSC Nastran 2012 DMAP Programmer's Guide, OUTPUT4, tables of formats.
"""

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix

from rom.errors import FileFormatError, UnsafeFileError
from rom.io.files import check_readable, write_whole
from rom.model import Array

MOST_ROWS = 10_000_000
SYMMETRIC_FORM, RECTANGULAR_FORM = 6, 2
DIGITS = re.compile(rb"[ \d-]{24}")


@dataclass(slots=True)
class _Strings:
    """A matrix as it is read: values of consecutive rows of one column."""

    name: str
    rows: int
    columns: int
    long: bool
    words: int  # of four bytes per value
    found: list[tuple[int, int, Array]] = field(default_factory=list)

    def add(self, column: int, row: int, values: Array) -> None:
        if not (0 <= column < self.columns and 0 <= row <= self.rows - values.size):
            raise ValueError(f"a string of {self.name} reaches beyond {self.rows} rows")
        if not np.isfinite(values).all():
            raise ValueError(f"{self.name} holds a number that is not finite")
        self.found.append((column, row, values))

    def matrix(self) -> csr_matrix:
        columns = [np.full(v.size, c) for c, _, v in self.found]
        rows = [np.arange(r, r + v.size) for _, r, v in self.found]
        data = [v for _, _, v in self.found]
        i, j, v = (np.concatenate(x) if x else np.zeros(0) for x in (rows, columns, data))
        return csr_matrix((v, (i.astype(int), j.astype(int))), shape=(self.rows, self.columns))


def read_op4(path: str | Path) -> dict[str, csr_matrix]:
    """All real matrices of a file, by their names in capitals.

    Args:
        path: a text or binary file, of either byte order.

    Raises:
        FileFormatError: if the file is missing, cut, or holds a complex matrix.
        UnsafeFileError: if it is larger than 4 GiB, or a matrix has more than ten million rows.
    """
    path = check_readable(path)
    data = path.read_bytes()
    reader: Any = _Text(data) if DIGITS.match(data[:24]) else _Binary(data)
    out: dict[str, csr_matrix] = {}
    try:
        while (found := reader.next()) is not None:
            out[found.name] = found.matrix()
    except UnsafeFileError as error:
        raise UnsafeFileError(error.message, where=f"{path}, {reader.place}") from error
    except (ValueError, IndexError, struct.error, OverflowError) as error:
        where = f"{path}, {reader.place}"
        raise FileFormatError(f"no OUTPUT4 matrix stands here: {error}.", where=where) from error
    if not out:
        raise FileFormatError("the file holds no matrix.", where=str(path))
    return out


def write_op4(matrices: dict[str, Any], path: str | Path) -> Path:
    """Write matrices as text with 17 digits.

    Args:
        matrices: {name of at most 8 characters: (n, m) dense or sparse matrix}.
        path: file to write.

    Raises:
        ConfigError: if the place is not writable.
        ResourceError: if the disk is full.
    """
    text = "".join(_written(name, csc_matrix(A)) for name, A in matrices.items())
    write_whole(path, lambda file: file.write(text.encode("ascii")))
    return Path(path)


def _written(name: str, A: csc_matrix) -> str:
    rows, columns = A.shape
    symmetric = rows == columns and abs(A - A.T).max() == 0
    form = SYMMETRIC_FORM if symmetric else RECTANGULAR_FORM
    lines = [f"{columns:8d}{rows:8d}{form:8d}{2:8d}{name.upper():<8.8}1P,3E23.16"]
    for c in range(columns):
        column = A[:, c].toarray().ravel()
        (filled,) = np.nonzero(column)
        if filled.size:
            values = column[filled[0] : filled[-1] + 1]
            lines.append(f"{c + 1:8d}{filled[0] + 1:8d}{values.size:8d}")
            lines += _packed(values)
    lines += [f"{columns + 1:8d}{1:8d}{1:8d}", *_packed(np.ones(1))]
    return "\n".join(lines) + "\n"


def _packed(values: Array) -> Iterator[str]:
    for k in range(0, values.size, 3):
        yield "".join(f"{v:23.16E}" for v in values[k : k + 3])


def _checked(columns: int, rows: int, kind: int, name: str) -> _Strings:
    if kind not in (1, 2):
        raise ValueError(f"{name} is complex or of the unknown type {kind}")
    if not (0 < columns and rows):
        raise ValueError(f"{name} has {rows} rows and {columns} columns")
    if max(columns, abs(rows)) > MOST_ROWS:
        raise UnsafeFileError(f"{name} has {abs(rows)} rows and {columns} columns.")
    return _Strings(name.strip().upper(), abs(rows), columns, rows < 0, kind)


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
        line = self._line()
        columns, rows, _, kind = (int(line[8 * k : 8 * k + 8]) for k in range(4))
        self._set_format(line[40:].strip().upper())
        matrix = _checked(columns, rows, kind, line[32:40])
        while True:
            line = self._line()
            column, row, n = (int(line[8 * k : 8 * k + 8]) for k in range(3))
            if column > columns:
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
        if matrix.long:
            length, row, head = int(line[:8]) - 1, int(line[8:16]), 2
        else:
            length, row = int(line) // 65536 - 1, int(line) % 65536
            head = 1
        matrix.add(column, row - 1, self._values(length // matrix.words))
        return length + head

    def _set_format(self, text: str) -> None:
        found = re.fullmatch(r"(?:1P,)?(\d+)[ED](\d+)\.\d+", text or "1P,5E16.9")
        if found is None or not int(found[1]) or not int(found[2]):
            raise ValueError(f"the format {text!r} is unknown")
        self.per_line, self.width = int(found[1]), int(found[2])

    def _values(self, n: int) -> Array:
        if not 0 < n <= (len(self.lines) - self.number) * self.per_line:
            raise ValueError(f"{n} values are announced")
        out: list[float] = []
        while len(out) < n:
            line, count = self._line().replace("D", "E"), min(self.per_line, n - len(out))
            out += [float(line[self.width * k : self.width * (k + 1)]) for k in range(count)]
        return np.array(out)

    def _line(self) -> str:
        self.number += 1
        if self.number > len(self.lines):
            raise ValueError("the file ends too early")
        return self.lines[self.number - 1]


class _Binary:
    """Matrices of a binary file of Fortran records, one after the other."""

    def __init__(self, data: bytes):
        self.data, self.at = data, 0
        self.order = "<" if data[:4] == struct.pack("<i", 24) else ">"

    @property
    def place(self) -> str:
        return f"byte {self.at}"

    def next(self) -> _Strings | None:
        if self.at >= len(self.data):
            return None
        head = self._record()
        if len(head) != 24:
            _refuse_header(len(head))
        columns, rows, _, kind = struct.unpack(f"{self.order}4i", head[:16])
        matrix = _checked(columns, rows, kind, head[16:].decode("ascii", "replace"))
        while True:
            record = self._record()
            column, row, words = struct.unpack(f"{self.order}3i", record[:12])
            if column > columns:
                return matrix
            if row > 0:
                matrix.add(column - 1, row - 1, self._values(record[12:], words, matrix.words))
            else:
                self._strings(matrix, column - 1, record[12 : 12 + 4 * words])

    def _strings(self, matrix: _Strings, column: int, data: bytes) -> None:
        at = 0
        while at < len(data):
            if matrix.long:
                length, row = struct.unpack_from(f"{self.order}2i", data, at)
                length, at = length - 1, at + 8
            else:
                (both,) = struct.unpack_from(f"{self.order}i", data, at)
                length, row, at = both // 65536 - 1, both % 65536, at + 4
            if length <= 0:
                raise ValueError(f"a string of {length} words")
            matrix.add(column, row - 1, self._values(data[at:], length, matrix.words))
            at += 4 * length

    def _values(self, data: bytes, words: int, per_value: int) -> Array:
        if not 0 < 4 * words <= len(data) or words % per_value:
            raise ValueError(f"{words} words are announced, {len(data) // 4} are there")
        kind = f"{self.order}f{4 * per_value}"
        return np.frombuffer(data, kind, words // per_value).astype(float)

    def _record(self) -> bytes:
        (n,) = struct.unpack_from(f"{self.order}i", self.data, self.at)
        end = self.at + 4 + n
        if n < 12 or struct.unpack_from(f"{self.order}i", self.data, end) != (n,):
            raise ValueError(f"a record of {n} bytes does not close")
        record, self.at = self.data[self.at + 4 : end], end + 4
        return record


def _refuse_header(n: int) -> NoReturn:
    what = "the numbers have eight bytes; write it with BIGMAT=FALSE" if n == 48 else f"{n} bytes"
    raise ValueError(f"a header has 24 bytes: {what}")
