"""The file of a study: a line for its head and one for each sample, each with its checksum.

Lines are only ever put behind: what ends the process, even in the middle of one, leaves all those
before. A number is written so that it is read to the bit.
"""

import base64
import fcntl
import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from rom.errors import ConfigError, FileFormatError, ResourceError
from rom.model import Array
from rom.readable import check_readable

SCHEMA, VERSION = "rom-study", 1
LARGEST_FILE = 2**36  # bytes
SAME_HINT = "Give the samples, and the generator they come from, as they were; or another file."
FULL_HINT = "What was measured is kept: make room, and go on with resume=True, or --resume."
Row = dict[str, Any]


class Journal:
    """A file that is being written, by this process alone."""

    def __init__(self, path: Path, head: Mapping[str, Any], *, resume: bool):
        self.path, self.rows = path, list[Row]()
        head = {"schema": SCHEMA, "version": VERSION, **head}
        try:
            self.file: IO[bytes] = path.open("r+b" if path.exists() else "w+b")
        except OSError as error:
            text = f"{path} cannot be written: {error.strerror}."
            raise ConfigError(text, hint="Choose a file in a folder that is there.") from error
        try:
            fcntl.flock(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            self.file.close()
            raise ResourceError(f"another study is writing {path}; wait for its end.") from error
        if path.stat().st_size:
            if not resume:
                text = f"{path} exists already; go on with its study by resume=True (--resume)"
                raise ConfigError(f"{text}, or remove it.")
            there, self.rows, whole = _read(path)
            _check_same(path, there, head)
            self.file.truncate(whole)
            self.file.seek(whole)
        else:
            self._write(head)

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()

    def add(self, row: Row) -> None:
        """Put a row behind."""
        self._write(row)
        self.rows.append(row)

    def _write(self, row: Mapping[str, Any]) -> None:
        text = json.dumps(row, separators=(",", ":")).encode()
        try:
            self.file.write(b"%08x %s\n" % (zlib.crc32(text), text))
            self.file.flush()
        except OSError as error:
            text_ = f"{self.path} was not written: {error.strerror}."
            raise ResourceError(text_, hint=FULL_HINT) from error


def read(path: str | Path) -> tuple[Row, list[Row]]:
    """Head and rows of a file; a last line that is cut is left out."""
    return _read(check_readable(path, LARGEST_FILE))[:2]


def _read(path: Path) -> tuple[Row, list[Row], int]:
    """Head, rows, and where the last whole line ends."""
    rows, whole = [], 0
    with path.open("rb") as file:
        for number, line in enumerate(file, 1):
            if not line.endswith(b"\n"):
                break
            text = line[9:-1]
            try:
                if line[8:9] != b" " or int(line[:8], 16) != zlib.crc32(text):
                    raise ValueError("its checksum is another one")
                row = json.loads(text)
                if number == 1 and (row["schema"], row["version"]) != (SCHEMA, VERSION):
                    raise ValueError(f"schema {row['schema']!r:.40} {row['version']!r:.10}")
            except (ValueError, KeyError, TypeError, RecursionError) as error:
                text_ = f"is no line of a study: {error!s:.100}."
                raise FileFormatError(text_, where=f"{path}, line {number}") from error
            rows.append(row)
            whole += len(line)
    if not rows:
        raise FileFormatError("holds no study: its first line is missing.", where=str(path))
    return rows[0], rows[1:], whole


def _check_same(path: Path, there: Row, head: Row) -> None:
    for what, other in (("measure", "another measure"), ("parameters", "other samples")):
        if there.get(what) != json.loads(json.dumps(head[what])):
            raise ConfigError(f"{path} is of a study with {other}.", hint=SAME_HINT)


def packed(array: Array) -> float | dict[str, Any]:
    """A number, or an array, as JSON has it."""
    if not array.ndim:
        return float(array)
    data = base64.b64encode(np.ascontiguousarray(array, dtype="<f8").tobytes()).decode()
    return {"shape": array.shape, "f8": data}


def unpacked(value: float | Mapping[str, Any]) -> Array:
    """The number or array that was `packed`."""
    if not isinstance(value, Mapping):
        return np.array(value, dtype=float)
    return np.frombuffer(base64.b64decode(value["f8"]), "<f8").reshape(value["shape"])
