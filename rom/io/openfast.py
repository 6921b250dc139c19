"""Superelements of OpenFAST's module ExtPtfm, in its format FlexASCII.

Six coordinates of the interface to the tower, translations then rotations, at the platform
reference point of OpenFAST and along its axes (z up), then modes with the interface held. Loads
are a table over time; the weight of the superelement has to be among them.

Source:
    OpenFAST documentation, ExtPtfm, input files; what its reader takes from each line.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError, FileFormatError, QualityGateError, UnsafeFileError
from rom.io.files import check_last_line, write_whole
from rom.io.interface_form import interface_form
from rom.model import Array

MARK = "flex 5 format"
DIMENSION, STEP, DURATION = (
    "!dimension:",
    "!time increment in simulation:",
    "!total simulation time in file:",
)
MATRICES = {"!mass matrix": "M", "!stiffness matrix": "K", "!damping matrix": "D"}
LOADING = "!loading and wave elevation"
SPAN = 1e5  # s; the loads written are constant as long
MOST = 10_000  # coordinates
ASYMMETRY, UNEVEN = 1e-6, 1e-3
GRAVITY = (0.0, 0.0, -9.81)


@dataclass(frozen=True, slots=True)
class Superelement:
    """What a file holds; n is 6 and the number of modes.

    Attributes:
        M, K, D: (n, n) mass, stiffness, damping.
        t: (k,) times [s], evenly spaced.
        loads: (k, n) forces and moments on the interface [N], [N m], and on the modes.
        elevation: (k,) of the waves [m]; zero where the file has none.
    """

    M: Array
    K: Array
    D: Array
    t: Array
    loads: Array
    elevation: Array


def write_openfast(
    body: FlexibleBody,
    path: str | Path,
    *,
    held: Sequence[str] = (),
    gravity: npt.ArrayLike = GRAVITY,
) -> Path:
    """Write a body with one free interface.

    Args:
        body: all its interfaces have six coordinates (rbe2, rbe3), z is up.
        path: file to write.
        held: interfaces that stand still, as the foot of a jacket.
        gravity: (3,) acceleration [m/s^2] whose loads are written.

    Raises:
        ConfigError: if not exactly one interface is free, or the place is not writable.
        ModelError: if the shapes do not let the interfaces move one by one.
    """
    form = interface_form(body)
    if unknown := sorted(set(held) - set(form.names)):
        raise ConfigError(f"{unknown[0]!r} cannot be held; the interfaces are {form.names}.")
    free = [name for name in form.names if name not in held]
    if len(free) != 1:
        raise ConfigError(
            f"body {body.name!r} has {len(free)} free interfaces, {free}; OpenFAST takes one.",
            hint="Hold the others: held=(...), on the command line --held.",
        )
    n_b = 6 * len(form.names)
    first = 6 * form.names.index(free[0])
    rows = np.r_[first : first + 6, n_b : len(form.K)]
    along = np.zeros((len(form.K), 3))
    along[:n_b] = np.tile(np.eye(6, 3), (len(form.names), 1))
    weight = (form.M @ along @ np.asarray(gravity, dtype=float))[rows]
    K, M, D = (A[np.ix_(rows, rows)] for A in (form.K, form.M, form.D))
    text = "\n".join(_document(body.name, {"Mass": M, "Stiffness": K, "Damping": D}, weight)) + "\n"
    write_whole(path, lambda file: file.write(text.encode()))
    return Path(path)


def read_openfast(path: str | Path) -> Superelement:
    """Read a superelement.

    Raises:
        FileFormatError: naming the line, if the file is missing, damaged or cut, or its times are
            not those its head announces.
        QualityGateError: if a matrix is not symmetric, or the mass not positive.
        UnsafeFileError: if it announces more coordinates than a dense matrix can have.
    """
    path = Path(path)
    check_last_line(path)
    lines = path.read_text(encoding="latin1").splitlines()
    if len(lines) < 2 or MARK not in lines[1].lower():
        raise FileFormatError(
            f"the second line does not say {MARK!r}.",
            where=f"{path}, line 2",
            hint="This is no FlexASCII; GuyanASCII is not read.",
        )
    reader = _Reader(str(path), lines)
    reader.run()
    return reader.superelement()


class _Reader:
    """Goes through the lines as OpenFAST does: keywords, then blocks of a known length."""

    def __init__(self, path: str, lines: list[str]):
        self.path, self.lines, self.at = path, lines, 0
        self.head: dict[str, float] = {}
        self.blocks: dict[str, Array] = {}

    def run(self) -> None:
        while self.at < len(self.lines):
            line = self.lines[self.at].strip().lower()
            self.at += 1
            key = next((k for k in (DIMENSION, STEP, DURATION) if line.startswith(k)), "")
            block = next((name for k, name in MATRICES.items() if line.startswith(k)), "")
            if key:
                self.head[key] = self.number(line[len(key) :])
            elif block:
                self.blocks[block] = self.rows(self.n, (self.n,))
            elif line.startswith(LOADING):
                self.blocks["loads"] = self.rows(self.steps, (self.n + 1, self.n + 2))

    @property
    def n(self) -> int:
        n = self.head.get(DIMENSION, 0)
        if n > MOST:
            raise UnsafeFileError(f"{n:.0f} coordinates are not read.", where=self.path)
        if n < 6 or n != int(n):
            raise self.error(f"{DIMENSION!r} 6 or more has to come before the blocks")
        return int(n)

    @property
    def steps(self) -> int:
        """Lines of loads that OpenFAST reads."""
        dt, T = self.head.get(STEP, 0.0), self.head.get(DURATION, -1.0)
        if not (dt > 0 and 0 <= T / dt < len(self.lines)):
            raise self.error(f"a time step {dt:g} s and a duration {T:g} s do not fit the file")
        return round(T / dt) + 1

    def rows(self, k: int, widths: tuple[int, ...]) -> Array:
        """The next k rows, behind a line of comment."""
        self.at += 1
        found: list[list[float]] = []
        for _ in range(k):
            words = self.lines[self.at].split() if self.at < len(self.lines) else []
            self.at += 1
            if len(words) not in widths or (found and len(words) != len(found[0])):
                raise self.error(f"row {len(found) + 1} of {k} has {len(words)} numbers")
            found.append([self.number(word) for word in words])
        return np.array(found)

    def number(self, word: str) -> float:
        try:
            value = float(word.lower().replace("d", "e"))
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise self.error(f"{word.strip()!r} is not a finite number")
        return value

    def error(self, what: str) -> FileFormatError:
        return FileFormatError(
            f"{what}.",
            where=f"{self.path}, line {min(self.at, len(self.lines))}",
            hint="Write the file again; it is cut or changed.",
        )

    def superelement(self) -> Superelement:
        if missing := sorted({"M", "K", "D", "loads"} - set(self.blocks)):
            raise self.error(f"the blocks {missing} are missing")
        n, loads = self.n, self.blocks["loads"]
        t, dt = loads[:, 0], self.head[STEP]
        if np.abs(np.diff(t) - dt).max(initial=0.0) > UNEVEN * dt:
            raise self.error(f"the times of the loads are not {dt:g} s apart")
        elevation = loads[:, n + 1] if loads.shape[1] == n + 2 else np.zeros(t.size)
        found = Superelement(self.blocks["M"], self.blocks["K"], self.blocks["D"], t,
                             loads[:, 1 : n + 1], elevation)  # fmt: skip
        _check(found, self.path)
        return found


def _check(found: Superelement, path: str) -> None:
    for name in ("M", "K", "D"):
        A = getattr(found, name)
        if np.abs(A - A.T).max() > ASYMMETRY * np.abs(A).max():
            raise QualityGateError(f"the matrix {name} is not symmetric.", where=path)
    size = np.sqrt(np.abs(np.diag(found.M)))
    size[size == 0] = 1.0
    if np.linalg.eigvalsh(found.M / np.outer(size, size))[0] <= 0:
        raise QualityGateError("the mass is not positive: some motion has no inertia.", where=path)


def _document(name: str, matrices: dict[str, Array], weight: Array) -> Iterator[str]:
    n = weight.size
    yield f"! {name}"
    yield "! Flex 5 Format"
    yield f"!Dimension: {n}"
    yield f"!Time increment in simulation: {SPAN:g}"
    yield f"!Total simulation time in file: {SPAN:g}"
    for kind, units in (("Mass", "kg, m"), ("Stiffness", "N, m"), ("Damping", "N, m, s")):
        yield f"!{kind} Matrix (Units ({units}))"
        yield f"!Dimension: {n}"
        yield from map(_row, matrices[kind])
    yield f"!{LOADING[1:].title()} (Units (N, m))"
    yield f"!Dimension: 1 time column - {n} force columns - 1 wave elevation column"
    yield from (_row(np.r_[t, weight, 0.0]) for t in (0.0, SPAN))


def _row(values: Array) -> str:
    return " ".join(f"{v:.16e}" for v in values)
