"""A foreign geometry: what its text would do to the machine, and what its process cannot do.

The first is told before gmsh runs a script. A ``.geo`` is a program. It may build geometry and read
files; it may not start programs, nor write or remove files, and neither may the scripts it
includes. What may stand there is listed: any other word is refused, except names of the script's
own where no command can stand. The text is read as gmsh reads it; where gmsh could read it in two
ways, it is refused.

The second is for what the text does not show. On Linux the process that reads a foreign geometry
starts no process and opens no connection (seccomp), and writes nowhere but in its own folder and
runs no program (Landlock, from kernel 5.13 on). Neither needs a privilege.
"""

import ctypes
import os
import platform
import re
import struct
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from rom.errors import FileFormatError, UnsafeFileError, in_file

# What may stand before a bracket, a text or another word: geometry, control, functions, mesh sizes
KNOWN_WORDS = frozenset("""
Point Line Curve Circle Ellipse Ellipsis Conic Spline BSpline Bezier Nurbs Wire Loop Compound Plane
Surface Ruled Bezier Volume Sphere Block Box Cylinder Cone Torus Wedge Disk Rectangle Physical
Parametric In Extrude Layers Recombine RecombLaterals ScaleLastLayer Hole Alias AliasWithOptions
Using Index View ThruSections Pipe Fillet Chamfer Translate Rotate Symmetry Affine Dilate Duplicata
Delete Recursive Coherence Split Intersect Unique Boundary CombinedBoundary PointsOf Closest
BooleanUnion BooleanIntersection BooleanDifference BooleanFragments Object Tool BoundingBox
CenterOfMass MatrixOfInertia Mass Parent Fuzzy Transfinite Progression Bump Beta Left Right
Alternate AlternateLeft AlternateRight Periodic Reverse ReverseMesh RelocateMesh Smoother
Characteristic Length MeshSize SizeField Field Background BoundaryLayer MeshAlgorithm
MeshSizeFromBoundary Embed Elliptic Quad TransfQuadTri QuadTriAddVerts QuadTriNoNewVerts
QuadTriDbl QuadTriSngl Levelset Color Show Hide Homology Cohomology SetFactory SetMaxTag SetOrder
OptimizeMesh RefineMesh RecombineMesh PartitionMesh CreateTopology CreateGeometry ClassifySurfaces
RenumberMeshNodes RenumberMeshElements Mesh Knots Weights Order Coordinates SyncModel
If ElseIf Else EndIf For EndFor Macro Function Return Call Abort Exit Error Warning Printf
DefineConstant DefineNumber DefineString UndefineConstant DefineStruct Struct Append AppendUnique
Name Min Max Step Range Choices Visible ReadOnly ReadOnlyRange Help Label Highlight Closed Units
Graph AutoCheck Loop Kind
Exp Log Log10 Sqrt Sin Asin Cos Acos Tan Atan Atan2 Sinh Cosh Tanh Abs Fabs Floor Ceil Round Fmod
Modulo Hypot Rand Step Sign Exists FileExists GetNumber GetString GetForced ForceNumber LinSpace
LogSpace ListFromFile Find List ListAlt Cross Dot Norm Str StrCat StrPrefix StrRelative StrReplace
StrSub StrLen StrCmp StrFind StrChoice UpperCase LowerCase LowerCaseIn Sprintf NameFromString
CurrentDirectory CurrentDir CurrentFileName AbsolutePath DirName Include Merge MergeWithBoundingBox
Nurb Bounding NewModel Today TestLevel DimNameSpace NameStruct Text2D Text3D TIME
""".split())  # fmt: skip
FIELDS = frozenset("""
Attractor AttractorAnisoCurve AutomaticMeshSizeField Ball BoundaryLayer Box Centerline Constant
Curvature Cylinder Distance Extend Frustum Gradient IntersectAniso Laplacian LonLat MathEval
MathEvalAniso Max MaxEigenHessian Mean Min MinAniso Octree Param PostView Restrict Sphere
Structured Threshold
""".split())  # fmt: skip
OPTION_GROUPS = {"Mesh", "Geometry", "Print"}  # whose options say how, and never where or by whom
GENERAL_OPTIONS = {"Terminal", "Verbosity", "ExpertMode", "NumThreads", "AbortOnError"}
OPERATOR_SIGNS = "=.,;+-*/^<>!&|?:)]}~%"  # behind a variable; no command has one behind it
INCLUDE_COMMAND, MERGE_COMMANDS = "Include", ("Merge", "MergeWithBoundingBox")
# endings, in these letters only, of files that gmsh gives to readers which run nothing
SHAPES = tuple(".step .STEP .stp .STP .iges .IGES .igs .IGS .brep .brp .stl .STL".split())
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

PR_SET_NO_NEW_PRIVS, PR_SET_SECCOMP, SECCOMP_MODE_FILTER = 38, 22, 2
LOAD, EQUAL, SET, ABOVE, RETURN = 0x20, 0x15, 0x45, 0x35, 0x06  # codes of the Berkeley filter
ALLOW, KILL = 0x7FFF0000, 0x80000000
ENOSYS, EACCES = 0x00050026, 0x0005000D  # fail with this error
NUMBER, MACHINE, FIRST = 0, 4, 16  # where the filter finds call, machine and first argument
CLONE_THREAD = 0x00010000
OTHER_NUMBERING = 0x40000000  # calls of x32 on x86_64
LANDLOCK_CREATE, LANDLOCK_ADD, LANDLOCK_RESTRICT = 444, 445, 446
PATH_BENEATH = 1
# execute; write, remove and make files of all kinds; by the version that brought them
RIGHTS = {1: 0b1_1111_1111_0011, 2: 1 << 13, 3: 1 << 14}
EXECUTE, TRUNCATE, WRITE_FILE = 1, 1 << 14, 2


@dataclass(frozen=True, slots=True)
class Token:
    """A word, text or sign of a script, and its line."""

    kind: str
    value: str
    line: int


END_TOKEN = Token("sign", ";", 0)


def check_script(path: Path) -> None:
    """Refuse a script that would do more than make a geometry, or that hides what it does.

    What it includes and merges is read as well.
    """
    _check(path, (), [])


def _check(path: Path, around: tuple[Path, ...], seen: list[Path]) -> None:
    real = path.resolve()
    if real in around:
        names = [file.name for file in (*around[around.index(real) :], real)]
        chain = f" ({' includes '.join(names)})" if len(names) > 2 else ""
        raise FileFormatError(
            f"includes itself{chain}.",
            where=_where(around[0], around[1:]),
            hint="Take the Include out.",
        )
    seen.append(real)
    with in_file(_where(path, around)):
        if len(seen) > MOST_FILES or path.stat().st_size > MOST_BYTES:
            raise UnsafeFileError(
                f"{path.name} is script number {len(seen)} of at most {MOST_FILES}, or larger than "
                f"{MOST_BYTES / 1e6:g} MB.",
                hint="Merge data as .msh files.",
            )
        tokens = list(_tokens(path))
        for line, why in _refusals(tokens):
            raise UnsafeFileError(
                f"line {line}: {why}.",
                hint="Read the file and take that out: a geometry needs no such command.",
            )
        files = list(_read_files(tokens))
    for command, name in files:
        _check_read(path.parent / name, command, (*around, real), seen)
    _check_read(Path(f"{path}.opt"), INCLUDE_COMMAND, (*around, real), seen)  # gmsh runs it as well


def _where(path: Path, around: tuple[Path, ...]) -> str:
    """Name of a script that another one reads; the first is called as its reader called it."""
    return str(path) if around else ""


def _check_read(path: Path, command: str, around: tuple[Path, ...], seen: list[Path]) -> None:
    """A file that a script reads, by the way gmsh would read it; gmsh says when there is none."""
    if not path.is_file():
        return
    if command == INCLUDE_COMMAND:
        _check(path, around, seen)
        return
    with path.open("rb") as stream:
        finished = path.suffix in MESHES and stream.read(16).startswith(MESH_STARTS)
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


def _tokens(path: Path) -> Iterator[Token]:
    """Words, texts and signs, without comments and numbers; refused where gmsh may read another."""
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
                hint="Close every text and comment, keep texts short, and put a blank before "
                "quotes and comments.",
            )
        if kind not in ("comment", "number"):
            yield Token(kind, value.decode("utf-8", "replace"), line)


def _refusals(tokens: list[Token]) -> Iterator[tuple[int, str]]:
    """Lines that do more than make a geometry, and what they do."""
    printing, depth = False, 0
    for k, token in enumerate(tokens):
        if token.kind == "sign":
            depth += (token.value == "(") - (token.value == ")")
            if token.value in (">", ">>") and printing and depth <= 0:
                yield token.line, "Printf with > writes a file, which a geometry may not"
            printing = printing and token.value != ";"
        if token.kind != "word":
            continue
        if token.value == "Printf":
            printing, depth = True, 0
        if not _allowed(
            tokens[k - 1] if k else END_TOKEN, token, [*tokens[k + 1 : k + 3], END_TOKEN]
        ):
            yield token.line, f"{token.value} is none of the commands with which a geometry is made"
        field = _kind_of_field(tokens, k) if token.value == "Field" else None
        if field is not None and field.value not in FIELDS:
            yield (
                field.line,
                f"{field.value} is none of the fields that say mesh sizes by themselves",
            )


def _allowed(before: Token, word: Token, behind: list[Token]) -> bool:
    """Whether a word is known, an option, or stands where only the script's own names can stand.

    No word of gmsh outside the vocabulary begins with a small letter or has one or two characters;
    so such names may have brackets. Other ones are variables where an operator is behind them.
    """
    after = behind[0]
    if before.value == ".":  # an option, whose group was asked before
        return True
    if before.value in ("Macro", "Function") or (before.value == "For" and after.value == "In"):
        return after.kind == "word"
    if after.value == "." and word.value[0].isupper():
        general = word.value == "General" and behind[1].value in GENERAL_OPTIONS
        return general or word.value in OPTION_GROUPS
    if word.value in KNOWN_WORDS:
        return True
    own = not word.value[0].isupper() or len(word.value) <= 2 or "_" in word.value
    return after.kind == "sign" and after.value in (
        OPERATOR_SIGNS + "([{" if own else OPERATOR_SIGNS
    )


def _kind_of_field(tokens: list[Token], k: int) -> Token | None:
    """What a field is said to be: the word behind ``Field[...] =``."""
    if tokens[k + 1 : k + 2] and tokens[k + 1].value != "[":
        return None
    end = next((j for j in range(k, len(tokens)) if tokens[j].value in "=;."), len(tokens))
    return tokens[end + 1] if end + 1 < len(tokens) and tokens[end].value == "=" else None


def _read_files(tokens: list[Token]) -> Iterator[tuple[str, str]]:
    """Commands that read files, with the names of these."""
    for k, token in enumerate(tokens):
        if token.kind != "word" or token.value not in (INCLUDE_COMMAND, *MERGE_COMMANDS):
            continue
        end = next((j for j in range(k, len(tokens)) if tokens[j].value == ";"), len(tokens))
        name = _named(tokens[k + 1 : end])
        if name is None:
            raise UnsafeFileError(
                f"line {token.line}: which file {token.value} reads cannot be told from the text.",
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


class Calls(NamedTuple):
    """Machine, as the kernel numbers it, and numbers of its system calls."""

    machine: int
    clone: int
    clone3: int
    socket: int
    starters: tuple[int, ...]  # fork, vfork, execve, execveat


CALLS = {
    "x86_64": Calls(0xC000003E, 56, 435, 41, (57, 58, 59, 322)),
    "aarch64": Calls(0xC00000B7, 220, 435, 198, (221, 281)),
}


def confine(folder: Path) -> None:
    """Confine this process to a folder, once all it needs is loaded; threads still work.

    Where the system offers neither way nothing happens.
    """
    if not sys.platform.startswith("linux"):
        return
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0):
        return
    _write_only_below(libc, folder)
    calls = CALLS.get(platform.machine())
    if calls is not None:
        steps = _filter(calls)
        code = b"".join(struct.pack("=HBBI", *step) for step in steps)
        buffer = ctypes.create_string_buffer(code)
        program = struct.pack("@HP", len(steps), ctypes.addressof(buffer))
        libc.prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, program, 0, 0)


def _filter(calls: Calls) -> list[tuple[int, int, int, int]]:
    """A process that tries to start another is killed by SIGSYS, which its parent can tell."""
    return [
        (LOAD, 0, 0, MACHINE),
        (EQUAL, 1, 0, calls.machine),
        (RETURN, 0, 0, KILL),
        (LOAD, 0, 0, NUMBER),
        *_answer(ABOVE, [OTHER_NUMBERING], KILL),
        *_answer(EQUAL, calls.starters, KILL),
        *_answer(EQUAL, [calls.socket], EACCES),
        *_answer(EQUAL, [calls.clone3], ENOSYS),  # whose flags no filter sees; clone follows
        (EQUAL, 0, 3, calls.clone),
        (LOAD, 0, 0, FIRST),
        (SET, 1, 0, CLONE_THREAD),
        (RETURN, 0, 0, KILL),
        (RETURN, 0, 0, ALLOW),
    ]


def _answer(test: int, values: Iterable[int], verdict: int) -> list[tuple[int, int, int, int]]:
    steps = [[(test, 0, 1, value), (RETURN, 0, 0, verdict)] for value in values]
    return [step for pair in steps for step in pair]


def _write_only_below(libc: ctypes.CDLL, folder: Path) -> None:
    version = libc.syscall(LANDLOCK_CREATE, None, 0, 1)
    rights = sum(right for since, right in RIGHTS.items() if since <= version)
    if not rights:
        return
    rules = libc.syscall(LANDLOCK_CREATE, struct.pack("=Q", rights), 8, 0)
    if rules < 0:
        return
    _allow(libc, rules, folder, rights & ~EXECUTE)
    _allow(libc, rules, Path(os.devnull), rights & (WRITE_FILE | TRUNCATE))
    libc.syscall(LANDLOCK_RESTRICT, rules, 0)
    os.close(rules)


def _allow(libc: ctypes.CDLL, rules: int, path: Path, rights: int) -> None:
    place = os.open(path, os.O_PATH)
    libc.syscall(LANDLOCK_ADD, rules, PATH_BENEATH, struct.pack("=Qi", rights, place), 0)
    os.close(place)
