"""What the text of a gmsh script says it would do to the machine, told before gmsh runs it.

A ``.geo`` is a program. It may build geometry and read files; it may not start programs, nor write
or remove files, and neither may the scripts it includes. The text is read as gmsh reads it; where
gmsh could read it in two ways, it is refused.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rom.errors import FileFormatError, UnsafeFileError

STARTS = {"SystemCall", "NonBlockingSystemCall", "OnelabRun", "SendToServer"}
STARTS |= {"ExternalProcess", "CommandLine"}  # a field of mesh sizes by another program
COMMANDS = {"System", "Print", "Save", "CreateDir"}  # words one may also call a variable by
PLUGINS_THAT_WRITE = {"Bubbles", "NearToFarField", "VoroMetal"}
NAMES_FROM_TEXT = {"StringToName", "S2N"}  # with which a command can be spelt
INCLUDE_COMMAND, MERGE_COMMANDS = "Include", ("Merge", "MergeWithBoundingBox")
# endings, in these letters only, of files that gmsh gives to readers which run nothing
SHAPES = (".step", ".STEP", ".stp", ".STP", ".iges", ".IGES", ".igs", ".IGS", ".brep", ".brp",
          ".stl", ".STL")  # fmt: skip
MESHES, SCRIPTS = (".msh", ".pos"), (".geo", ".pos", ".opt", ".geo_unrolled", "")
MESH_STARTS = (b"$MeshFormat", b"$Comments", b"$PostFormat", b"$View")
LONGEST_TEXT = 1000  # characters; gmsh cuts at 1023 and runs what follows
MOST_FILES, MOST_BYTES = 200, 2 * 10**7
TOKEN_PATTERN = re.compile(
    rb"""(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<text>"[^"]*"|'[^']*')
    |(?P<number>(?:\d+\.\d*|\.\d+|\d+)(?:[Ee][-+]?\d+)?)|(?P<word>[A-Za-z_][A-Za-z_0-9]*)
    |(?P<open>/\*|["'])|(?P<sign>>>|[^\s])""",
    re.DOTALL | re.VERBOSE,
)
# Skipping a block, gmsh looks for its end from these letters on, and does not see what follows one
BLIND_PATTERN = re.compile(rb"(?<![A-Za-z_])[EFIR]$")


@dataclass(frozen=True, slots=True)
class Token:
    """A word, text or sign of a script, and its line."""

    kind: str
    value: str
    line: int


END_TOKEN = Token("sign", ";", 0)


def check_script(path: Path) -> None:
    """Refuse a script that would do more than make a geometry.

    Args:
        path: the script; what it includes and merges is read as well.

    Raises:
        UnsafeFileError: it starts a program, writes a file, or hides what it does.
        FileFormatError: it includes itself.
    """
    _check(path, (), [])


def _check(path: Path, around: tuple[Path, ...], seen: list[Path]) -> None:
    real = path.resolve()
    if real in around:
        raise FileFormatError(
            f"includes itself{_chain((*around, real))}.",
            where=_where(around[0], around[1:]),
            hint="Take the Include out.",
        )
    seen.append(real)
    if len(seen) > MOST_FILES or path.stat().st_size > MOST_BYTES:
        raise UnsafeFileError(
            f"{path.name} is script number {len(seen)} of at most {MOST_FILES}, or larger than "
            f"{MOST_BYTES / 1e6:g} MB.",
            where=_where(path, around),
            hint="Merge data as .msh files.",
        )
    where = _where(path, around)
    tokens = list(_tokens(path, where))
    for line, why in _refusals(tokens):
        raise UnsafeFileError(
            f"line {line}: {why}.",
            where=where,
            hint="Read the file and take that out: a geometry needs no such command.",
        )
    for command, name in _read_files(tokens, where):
        _check_read(path.parent / name, command, (*around, real), seen)
    _check_read(Path(f"{path}.opt"), INCLUDE_COMMAND, (*around, real), seen)  # gmsh runs it as well


def _where(path: Path, around: tuple[Path, ...]) -> str:
    """Name of a script that another one reads; the first is called as its reader called it."""
    return str(path) if around else ""


def _chain(files: tuple[Path, ...]) -> str:
    names = [file.name for file in files[files.index(files[-1]) :]]
    return f" ({' includes '.join(names)})" if len(names) > 2 else ""


def _check_read(path: Path, command: str, around: tuple[Path, ...], seen: list[Path]) -> None:
    """A file that a script reads, by the way gmsh would read it; gmsh says when there is none."""
    if not path.is_file():
        return
    if command == INCLUDE_COMMAND:
        _check(path, around, seen)
        return
    finished = path.suffix in MESHES and _start(path).startswith(MESH_STARTS)
    if not finished and path.suffix in SCRIPTS:
        _check(path, around, seen)
    elif finished or path.suffix in SHAPES:
        _check_read(Path(f"{path}.opt"), INCLUDE_COMMAND, around, seen)
    else:
        raise UnsafeFileError(
            f"merges {path.name}, and what gmsh would do with that depends on what is in it.",
            where=_where(around[-1], around[:-1]),
            hint=f"Mergeable are .geo, .msh, .pos, {', '.join(SHAPES)}.",
        )


def _start(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(16)


def _tokens(path: Path, where: str) -> Iterator[Token]:
    """Words, texts and signs, without comments and numbers.

    Raises:
        UnsafeFileError: gmsh may read the text in another way.
    """
    data = path.read_bytes()
    line, last = 1, 0
    for found in TOKEN_PATTERN.finditer(data):
        line, last = line + data.count(b"\n", last, found.start()), found.start()
        kind, value = str(found.lastgroup), found.group()
        hidden = kind in ("text", "comment") and BLIND_PATTERN.search(data[max(last - 2, 0) : last])
        long = kind == "text" and len(value) > LONGEST_TEXT
        if kind == "open" or hidden or long or b"\0" in value:
            raise UnsafeFileError(
                f"line {line}: what is text here and what a command cannot be told.",
                where=where,
                hint="Close every text and comment, keep texts short, and put a blank before "
                "quotes and comments.",
            )
        if kind not in ("comment", "number"):
            yield Token(kind, value.decode("utf-8", "replace"), line)


def _refusals(tokens: list[Token]) -> Iterator[tuple[int, str]]:
    """Lines that do more than make a geometry, and what they do."""
    printing, depth = False, 0
    for token, after in zip(tokens, [*tokens[1:], END_TOKEN][: len(tokens)], strict=True):
        if token.kind == "sign":
            depth += (token.value == "(") - (token.value == ")")
            if token.value in (">", ">>") and printing and depth <= 0:
                yield token.line, "Printf with > writes a file, which a geometry may not"
            printing = printing and token.value != ";"
        if token.kind != "word":
            continue
        if token.value == "Printf":
            printing, depth = True, 0
        starts = token.value in STARTS or (token.value == "System" and _commands(after))
        if starts:
            yield token.line, f"{token.value} starts a program, which a geometry may not"
        if token.value in NAMES_FROM_TEXT:
            yield token.line, f"{token.value} makes names from text, also those of commands"
        if token.value in PLUGINS_THAT_WRITE or (token.value in COMMANDS and _commands(after)):
            yield token.line, f"{token.value} writes to the disk, which a geometry may not"


def _commands(after: Token) -> bool:
    """Whether a word before this token is a command, and no variable or group of options."""
    return not (after.kind == "sign" and after.value in "=.,;+-*/^<>!&|?:)]}~")


def _read_files(tokens: list[Token], where: str) -> Iterator[tuple[str, str]]:
    """Commands that read files, with the names of these."""
    for k, token in enumerate(tokens):
        if token.kind != "word" or token.value not in (INCLUDE_COMMAND, *MERGE_COMMANDS):
            continue
        end = next((j for j in range(k, len(tokens)) if tokens[j].value == ";"), len(tokens))
        name = _named(tokens[k + 1 : end])
        if name is None:
            raise UnsafeFileError(
                f"line {token.line}: which file {token.value} reads cannot be told from the text.",
                where=where,
                hint=f'Write its name as a text: {token.value} "part.geo";',
            )
        yield token.value, name


def _named(statement: list[Token]) -> str | None:
    """The file a command names: a text, alone or behind the folder of the script."""
    words = [t.value for t in statement if t.kind != "sign"]
    for known in (("StrCat", "Str"), ("CurrentDirectory", "CurrentDir")):
        words = words[1:] if words and words[0] in known else words
    plain = {t.value for t in statement if t.kind == "sign"} <= set("()[],")
    return words[0][1:-1] if len(words) == 1 and words[0][0] in "'\"" and plain else None
