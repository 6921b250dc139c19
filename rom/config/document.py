"""A TOML file with the line of each of its keys."""

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rom.errors import ConfigError, FileFormatError
from rom.io.files import check_readable

MAX_BYTES = 1_000_000  # bytes
MAX_DEPTH = 40  # brackets or tables inside each other: more is an accident, and costs the stack
STRING_PATTERN = r'"""(?:\\.|[^\\])*?"""' + r"|'''.*?'''" + r'|"(?:\\.|[^"\\\n])*"' + r"|'[^'\n]*'"
TOKEN_PATTERN = re.compile(STRING_PATTERN + r"|\#[^\n]*|[^\"'\#\[\]{}=\n]+|.", re.S | re.X)
WORD_PATTERN = re.compile(r'"(?:\\.|[^"\\])*"|\'[^\']*\'|[A-Za-z0-9_-]+')
KeyPath = tuple[str, ...]
Values = dict[str, Any]  # of a table, by key


@dataclass(frozen=True, slots=True)
class Document:
    """What a file says, and where."""

    path: Path
    data: Values
    lines: dict[KeyPath, int] = field(default_factory=dict)  # of keys on lines of their own

    def where(self, path: KeyPath) -> str:
        """File and line of a key, of the table around it, or of the last key."""
        for n in range(len(path), 0, -1):
            if path[:n] in self.lines:
                return f"{self.path}:{self.lines[path[:n]]}"
        return f"{self.path}:{max(self.lines.values(), default=1)}"


def read_document(path: str | Path) -> Document:
    """Read a TOML file."""
    path = check_readable(path)
    if path.stat().st_size > MAX_BYTES:
        raise FileFormatError(f"more than {MAX_BYTES} bytes are no description.", where=str(path))
    try:
        text = path.read_bytes().decode("utf-8").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"is no text in UTF-8: {error.reason}.", where=str(path)) from None
    return parsed(text, path)


def parsed(text: str, path: Path) -> Document:
    """The document of a text."""
    found = list(statements(text))
    _check_depth(text, path)
    for key, line in found:
        if len(key) > MAX_DEPTH:
            where = f"{path}:{line}"
            raise ConfigError(f"a key must be at most {MAX_DEPTH} tables deep.", where=where)
    try:
        data = tomllib.loads(text)
    except ValueError as error:
        raise _refusal(str(error), found, path) from None
    lines: dict[KeyPath, int] = {}
    for key, line in found:
        for n in range(len(key), 0, -1):  # tables that stand nowhere begin with their first key
            lines.setdefault(key[:n], line)
    return Document(path, data, lines)


def _check_depth(text: str, path: Path) -> None:
    depth = 0
    for token in TOKEN_PATTERN.finditer(text):
        depth += (token[0] in ("[", "{")) - (token[0] in ("]", "}"))
        if depth > MAX_DEPTH:
            where = f"{path}:{text.count(chr(10), 0, token.start()) + 1}"
            raise ConfigError(f"at most {MAX_DEPTH} brackets may be in each other.", where=where)


def _refusal(message: str, found: list[tuple[KeyPath, int]], path: Path) -> ConfigError:
    """What the parser says, with file and line; for a key given twice both lines."""
    if message.startswith("Cannot"):
        seen: dict[KeyPath, int] = {}
        for key, line in found:
            if key in seen:
                return ConfigError(
                    f"{'.'.join(key)!r} is given twice, in lines {seen[key]} and {line}.",
                    where=f"{path}:{line}",
                    hint="Keep one of them.",
                )
            seen[key] = line
    place = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)", message)
    line = int(place[1]) if place and place[1] else max((n for _, n in found), default=1)
    reason = re.sub(r" \(at [^)]*\)", "", message).rstrip(".")
    return ConfigError(
        f"this is no TOML: {reason[0].lower()}{reason[1:]}.",
        where=f"{path}:{line}",
        hint="Texts stand in quotes, and so do numbers with a unit.",
    )


def statements(text: str) -> Iterator[tuple[KeyPath, int]]:
    """Full path and line of every table and key that begins a line; inline tables count as one."""
    table: KeyPath = ()
    for head, line in _heads(text):
        words = tuple(word.strip("\"'") for word in WORD_PATTERN.findall(head))
        if head.startswith("["):
            table = words
            if not head.startswith("[["):
                yield table, line
        else:
            yield (*table, *words), line


def _heads(text: str) -> Iterator[tuple[str, int]]:
    """What stands before each ``=`` outside of values, and each line in brackets."""
    line, depth, head, in_value = 1, 0, "", False
    for token in TOKEN_PATTERN.finditer(text + "\n"):
        word = token[0]
        if word == "\n" and depth <= 0:
            if head.strip().startswith("["):
                yield head.strip(), line
            head, in_value, depth = "", False, 0
        elif in_value:
            depth += (word in ("[", "{")) - (word in ("]", "}"))
        elif word == "=" and not head.lstrip().startswith("["):
            yield head.strip(), line
            in_value = True
        elif not word.startswith("#"):
            head += word
        line += word.count("\n")
