"""Files are written whole or not at all, and looked at before they are read."""

import os
import secrets
import shutil
import struct
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import IO, Any

from rom.decks.lines import real
from rom.errors import ConfigError, FileFormatError, ResourceError
from rom.names import MAX_FILE_NAME_BYTES, TEMPORARY_BYTES
from rom.readable import MAX_FILE_BYTES as MAX_FILE_BYTES
from rom.readable import check_readable as check_readable


def write_whole(path: str | Path, content: bytes | Callable[[IO[bytes]], object]) -> Path:
    """Write a file whole or not at all, by bytes or a function: it replaces one of that name."""
    path = check_writable(path)
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        with part.open("xb") as file:
            file.write(content) if isinstance(content, bytes) else content(file)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    except OSError as error:
        free = shutil.disk_usage(path.parent).free / 2**20
        text = f"{path} was not written: {error.strerror}; {free:.4g} MiB are free there."
        raise ResourceError(text, hint="Nothing was left behind.") from error
    finally:
        part.unlink(missing_ok=True)
    return path


def write_lines(path: str | Path, lines: Iterable[str]) -> Path:
    """Write lines of text, see `write_whole`."""
    return write_whole(path, ("\n".join(lines) + "\n").encode())


def numbers_line(values: Iterable[float]) -> str:
    """Numbers of 17 digits as a line of text."""
    return " ".join(f"{v:.16e}" for v in values)


@dataclass(slots=True)
class Line:
    """A line of a file, for messages."""

    path: Path
    number: int = 0

    def __str__(self) -> str:
        return f"{self.path}, line {self.number}"


WRONG_TEXT = (ValueError, IndexError, KeyError, OverflowError, struct.error)  # what it causes
WRONG_JSON = (*WRONG_TEXT, TypeError, AttributeError, RecursionError)


@contextmanager
def damaged(
    what: str, where: object = "", hint: str = "", causes: tuple[type[Exception], ...] = WRONG_TEXT
) -> Iterator[None]:
    """Turn what wrong text causes, a ValueError, say, into an error that names its place."""
    try:
        yield
    except causes as error:
        raise FileFormatError(f"{what}: {error!s:.200}.", where=str(where), hint=hint) from error


@contextmanager
def lines_of(
    path: Path, what: str, hint: str = "", encoding: str = "latin1"
) -> Iterator[Iterator[str]]:
    """The lines of a text file; what its reader raises as of wrong text names the last one read."""
    check_last_line(path)
    at = Line(path)

    def numbered(file: IO[str]) -> Iterator[str]:
        for at.number, line in enumerate(file, 1):
            yield line

    with path.open(encoding=encoding, errors="replace") as file, damaged(what, at, hint):
        yield numbered(file)


def need(holds: object, otherwise: str) -> None:
    """Raise a ValueError, for `damaged`, in these words unless something holds."""
    if not holds:
        raise ValueError(otherwise)


def number(text: str) -> float:
    """A finite number, its exponent with E, D or sign; else a ValueError, for `damaged`."""
    need(text.strip(), "'' is no finite number")
    return real(text)


def check_writable(path: str | Path) -> Path:
    """The path, if a file of that name can be written; to be asked before a long computation."""
    path = Path(path)
    try:
        size = len(os.fsencode(path.name)) + TEMPORARY_BYTES
    except UnicodeEncodeError:
        size = MAX_FILE_NAME_BYTES + 1
    if "\0" in str(path) or size > MAX_FILE_NAME_BYTES:
        text = f"no file can have the name {path.name[:60]!a}, of {len(path.name)} characters."
        hint = f"Up to {MAX_FILE_NAME_BYTES - TEMPORARY_BYTES} bytes of text can be written."
        raise ConfigError(text, hint=hint)
    if path.is_dir():
        raise ConfigError(f"{path} is a folder; a file name is needed.")
    if not path.parent.is_dir():
        raise ConfigError(f"the folder {path.parent} does not exist.", hint="Make it first.")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        text = f"the folder {path.parent} is not writable."
        hint = "Choose another folder, or ask for the right to write there."
        raise ConfigError(text, hint=hint)
    return path


def check_last_line(path: Path) -> None:
    """For programs that end every line: a number that is cut would still be a number."""
    with check_readable(path).open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(size - 1, 0))
        if file.read(1) != b"\n":
            raise FileFormatError(
                "the last line is cut." if size else "the file is empty.",
                where=str(path),
                hint="Let the program that made it write it again, or end the line if it is whole.",
            )


def library(name: str) -> Any:
    """A library that is there for some files only."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise ResourceError(f"{name} is not installed.", hint=f"pip install {name}") from error


def h5py(otherwise: str) -> Any:
    """The module; otherwise is the ending of files that do without.

    Wheels of h5py and dolfinx bring an HDF5 each. From ``dolfinx.fem.petsc`` on, every library of
    the process sees that of dolfinx, and h5py refuses it; loaded before, h5py keeps its own.
    """
    try:
        return import_module("h5py")
    except ModuleNotFoundError as error:
        text = "h5py is not installed."
        hint = f"rom doctor says what to type; {otherwise} needs nothing."
        raise ResourceError(text, hint=hint) from error
    except (ImportError, ValueError) as error:
        if "dolfinx" in sys.modules:
            cause = ": dolfinx has loaded another HDF5 before"
            cure = "Import h5py first in your script, or rom.fe before dolfinx"
        else:
            cause, cure = "", "rom doctor says what does not fit"
        raise ResourceError(
            f"h5py cannot be loaded{cause} ({error}).", hint=f"{cure}; {otherwise} needs nothing."
        ) from error
