"""Superelements for OpenFAST's module ExtPtfm.

Six coordinates of the interface to the tower, translations then rotations, at the platform
reference point of OpenFAST and along its axes (z up), then modes with the interface held. The
weight of the superelement has to be in the file. Version 5 takes it as ``W_0 - K_W q`` in a frame
that follows a floating platform; versions 2.3 to 4 take a table of loads over time (FlexASCII).

Source:
    OpenFAST documentation, ExtPtfm, input files, of versions 4 and 5; what its readers take from
    each line.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rom.arguments import symmetric
from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError, QualityGateError, UnsafeFileError
from rom.io.files import Line, check_readable, damaged, need, number, numbers_line, write_lines
from rom.io.programs.interface_form import InterfaceForm, interface_form
from rom.model import Array
from rom.names import ORIGIN_MARK, check_known

VERSIONS = (4, 5)
LOAD_DURATION = 1e5  # [s]; how long the loads of version 4 are constant
GRAVITY = (0.0, 0.0, -9.81)
UNITS = {"Mass": "kg, m", "Stiffness": "N, m", "Damping": "N, m, s"}
OLD_FORMAT_MARK = "flex 5 format"  # second line of files for versions 2.3 to 4
HEAD_LINES = ("!dimension:", "!time increment in simulation:", "!total simulation time in file:")
DIMENSION_LINE, STEP_LINE, DURATION_LINE = HEAD_LINES
WEIGHT_LINE, LOADING_LINE = "!weight constant", "!loading and wave elevation"
BLOCKS = {"!mass": "M", "!stiffness": "K", "!damping": "D", "!weight stiffness": "K_W",
          WEIGHT_LINE: "weight", LOADING_LINE: "loads"}  # fmt: skip
KEYWORDS = (*HEAD_LINES, *BLOCKS)
MAX_COORDINATES = 10_000  # coordinates
ASYMMETRY_RTOL, TIME_STEP_RTOL = 1e-6, 1e-3
REWRITE_HINT = (
    "Write the file again; it is cut, changed, or of another kind (GuyanASCII is not read)."
)


@dataclass(frozen=True, slots=True)
class Superelement:
    """What a file holds; n is 6 and the number of modes.

    Attributes:
        M, K, D: (n, n) mass [kg], stiffness [N/m], damping [N s/m], moments and rotations likewise.
        weight: (n,) constant weight [N, N m]; zero up to version 4, where it is in the loads.
        K_W: (n, n) [N/m, N m/rad]: the weight is ``weight - K_W q``; zero in files up to version 4.
        t: (k,) times [s], evenly spaced; none in files of version 5.
        loads: (k, n) forces and moments on the interface [N], [N m], and on the modes.
        elevation: (k,) of the waves [m]; zero where the file has none.
    """

    M: Array
    K: Array
    D: Array
    weight: Array
    K_W: Array
    t: Array
    loads: Array
    elevation: Array


def write_openfast(
    body: FlexibleBody,
    path: str | Path,
    *,
    held: Sequence[str] = (),
    gravity: npt.ArrayLike = GRAVITY,
    version: int = 5,
) -> Path:
    """Write a body with one free interface.

    Args:
        body: all its interfaces have six coordinates (rbe2, rbe3), z is up.
        path: file to write.
        held: interfaces that stand still, as the foot of a jacket; none for a floating platform.
        gravity: (3,) acceleration [m/s^2] whose loads are written.
        version: of OpenFAST: 5, or 4 for 2.3 to 4.

    Raises:
        ConfigError: if not exactly one interface is free, the version is unknown, or the place is
            not writable.
        ModelError: if the shapes do not let the interfaces move one by one.
    """
    check_known(version, VERSIONS, f"version {version!r} of OpenFAST is unknown; known:")
    found = superelement(body, held=held, gravity=gravity)
    lines = _document(found, old=version < 5)
    return write_lines(path, [f"! {body.name}, {ORIGIN_MARK}", *lines])


def superelement(
    body: FlexibleBody, *, held: Sequence[str] = (), gravity: npt.ArrayLike = GRAVITY
) -> Superelement:
    """The matrices and the weight, without a table of loads; see `write_openfast`.

    In the frame of a floating body gravity turns; its change with the modes is left out.
    """
    form = interface_form(body)
    rows = _rows(body, form, held)
    n_b = 6 * len(form.names)
    along = np.zeros((len(form.K), 3))
    along[:n_b] = np.tile(np.eye(6, 3), (len(form.names), 1))
    g, S = np.asarray(gravity, dtype=float), (form.M @ along)[rows]
    K, M, D = (A[np.ix_(rows, rows)] for A in (form.K, form.M, form.D))
    K_W = np.zeros_like(K)
    if not held:
        K_W[:, 3:6] = -S @ np.cross(g, np.eye(3)).T  # the frame sees the gravity g - theta x g
        K[:6], K[:, :6] = 0.0, 0.0  # round-off, which OpenFAST warns of
    n = rows.size
    return Superelement(M, K, D, S @ g, K_W, np.zeros(0), np.zeros((0, n)), np.zeros(0))


def _rows(body: FlexibleBody, form: InterfaceForm, held: Sequence[str]) -> npt.NDArray[np.int64]:
    """Rows of the free interface, then of the modes."""
    for name in held:
        check_known(name, form.names, f"{name!r} cannot be held; there are")
    free = [name for name in form.names if name not in held]
    if len(free) != 1:
        text = f"body {body.name!r} has {len(free)} free interfaces, {free}; OpenFAST takes one"
        raise ConfigError(f"{text}; hold the others: held=(...), on the command line --held.")
    first = 6 * form.names.index(free[0])
    return np.r_[first : first + 6, 6 * len(form.names) : len(form.K)]


def _document(found: Superelement, *, old: bool) -> Iterator[str]:
    n = len(found.M)
    size = f"!Dimension: {n}"
    if old:
        yield "! Flex 5 Format"
    yield size
    if old:
        yield f"!Time increment in simulation: {LOAD_DURATION:g}"
        yield f"!Total simulation time in file: {LOAD_DURATION:g}"
    for kind, A in zip(UNITS, (found.M, found.K, found.D), strict=True):
        yield f"!{kind} Matrix (Units ({UNITS[kind]}))"
        yield from [size] * old
        yield from map(numbers_line, A)
    if old:
        yield f"!{LOADING_LINE[1:].title()} (Units (N, m))"
        yield f"!Dimension: 1 time column - {n} force columns - 1 wave elevation column"
        yield from (numbers_line(np.r_[t, found.weight, 0.0]) for t in (0.0, LOAD_DURATION))
        return
    yield "!Weight constant (Units (N, m))"
    yield numbers_line(found.weight)
    yield "!Weight stiffness (Units (N, m))"
    yield from map(numbers_line, found.K_W)


def read_openfast(path: str | Path) -> Superelement:
    """Read a superelement, as of version 5 or with the mark "Flex 5 Format" of those before.

    Raises:
        FileFormatError: naming the line, if the file is missing, damaged or cut, or its times are
            not those its head announces.
        QualityGateError: if a matrix is not symmetric, or the mass not positive.
        UnsafeFileError: if it announces more coordinates than a dense matrix can have.
    """
    path = check_readable(path)
    lines, at = path.read_text(encoding="latin1").splitlines(), Line(path)
    with damaged("this is no superelement", at, REWRITE_HINT):
        found = _superelement(*_blocks(lines, at))
    _check(found, str(path))
    return found


def _blocks(lines: list[str], at: Line) -> tuple[int, float, dict[str, Array]]:
    """Size, time step and blocks, as OpenFAST finds them: a keyword, then a known number of lines.

    Old files have a line of comment between the two.
    """
    old = len(lines) > 1 and OLD_FORMAT_MARK in lines[1].lower()
    head, blocks, n = dict.fromkeys(HEAD_LINES, 0.0) | {DURATION_LINE: -1.0}, dict[str, Array](), 0
    while at.number < len(lines):
        line = lines[at.number].strip().lower()
        at.number += 1
        key = next((known for known in KEYWORDS if line.startswith(known)), "")
        if key in HEAD_LINES:
            head[key] = number(line[len(key) :])
        elif key:
            n = int(head[DIMENSION_LINE])
            if n > MAX_COORDINATES:
                raise UnsafeFileError(f"{n} coordinates are not read.", where=str(at.path))
            whole = n >= 6 and n == head[DIMENSION_LINE]
            need(whole, f"{DIMENSION_LINE!r} 6 or more has to come before the blocks")
            k, widths = 1 if key == WEIGHT_LINE else n, [n]
            if key == LOADING_LINE:
                k, widths = _steps(head, len(lines)), [n + 1, n + 2]
            at.number += old
            rows = _table(lines, at, k, widths)
            blocks[BLOCKS[key]] = rows[0] if key == WEIGHT_LINE else rows
    missing = sorted({"M", "K", "D", *(("loads",) if old else ("weight", "K_W"))} - set(blocks))
    need(not missing, f"the blocks {missing} are missing")
    return n, head[STEP_LINE], blocks


def _steps(head: dict[str, float], most: int) -> int:
    """Lines of loads that OpenFAST reads."""
    dt, T = head[STEP_LINE], head[DURATION_LINE]
    fits = dt > 0 and 0 <= T / dt < most
    need(fits, f"a time step {dt:g} s and a duration {T:g} s do not fit the file")
    return round(T / dt) + 1


def _table(lines: list[str], at: Line, k: int, widths: list[int]) -> Array:
    found = list[list[float]]()
    for row in range(1, k + 1):
        words = lines[at.number].split() if at.number < len(lines) else []
        at.number = min(at.number + 1, len(lines))
        fits = len(words) in widths and (not found or len(words) == len(found[0]))
        need(fits, f"row {row} of {k} has {len(words)} words")
        found.append([number(word) for word in words])
    return np.array(found)


def _superelement(n: int, dt: float, b: dict[str, Array]) -> Superelement:
    loads = b.pop("loads", np.zeros((0, n + 2)))
    uneven = np.abs(np.diff(loads[:, 0]) - dt).max(initial=0.0)
    need(uneven <= TIME_STEP_RTOL * dt, f"the times of the loads are not {dt:g} s apart")
    waves = loads[:, n + 1] if loads.shape[1] == n + 2 else np.zeros(len(loads))
    still = {"weight": np.zeros(n), "K_W": np.zeros((n, n))}
    return Superelement(**still | b, t=loads[:, 0], loads=loads[:, 1 : n + 1], elevation=waves)


def _check(found: Superelement, path: str) -> None:
    for name in ("M", "K", "D"):
        symmetric(f"the matrix {name}", getattr(found, name), ASYMMETRY_RTOL, where=path)
    size = np.sqrt(np.abs(np.diag(found.M)))
    size[size == 0] = 1.0
    if np.linalg.eigvalsh(found.M / np.outer(size, size))[0] <= 0:
        raise QualityGateError("the mass must be positive: some motion has no inertia.", where=path)
