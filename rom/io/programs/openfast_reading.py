"""Reads superelements of OpenFAST's module ExtPtfm, of both generations; see `programs.openfast`.

Source:
    OpenFAST documentation, ExtPtfm, input files; what its readers take from each line.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rom.arguments import symmetric
from rom.errors import FileFormatError, QualityGateError, UnsafeFileError
from rom.io.files import check_readable
from rom.model import Array

OLD_FORMAT_MARK = "flex 5 format"  # second line of files for versions 2.3 to 4
DIMENSION_LINE, STEP_LINE, DURATION_LINE = (
    "!dimension:",
    "!time increment in simulation:",
    "!total simulation time in file:",
)
MATRICES = {"!mass": "M", "!stiffness": "K", "!damping": "D", "!weight stiffness": "K_W"}
WEIGHT_LINE, LOADING_LINE = "!weight constant", "!loading and wave elevation"
MAX_COORDINATES = 10_000  # coordinates
ASYMMETRY_RTOL, TIME_STEP_RTOL = 1e-6, 1e-3


@dataclass(frozen=True, slots=True)
class Superelement:
    """What a file holds; n is 6 and the number of modes.

    Attributes:
        M, K, D: (n, n) mass [kg], stiffness [N/m], damping [N s/m], moments and rotations likewise.
        weight: (n,) constant weight [N, N m]; zero in files up to version 4, which have it in the
            loads.
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


def read_openfast(path: str | Path) -> Superelement:
    """Read a superelement, as of version 5 or with the mark "Flex 5 Format" of those before.

    Raises:
        FileFormatError: naming the line, if the file is missing, damaged or cut, or its times are
            not those its head announces.
        QualityGateError: if a matrix is not symmetric, or the mass not positive.
        UnsafeFileError: if it announces more coordinates than a dense matrix can have.
    """
    path = check_readable(path)
    reader = _Reader(str(path), path.read_text(encoding="latin1").splitlines())
    reader.run()
    return reader.superelement()


class _Reader:
    """Goes through the lines as OpenFAST does: keywords, then blocks of a known length."""

    def __init__(self, path: str, lines: list[str]):
        self.path, self.lines, self.at = path, lines, 0
        self.old = len(lines) > 1 and OLD_FORMAT_MARK in lines[1].lower()
        self.head: dict[str, float] = {}
        self.blocks: dict[str, Array] = {}

    def run(self) -> None:
        while self.at < len(self.lines):
            line = self.lines[self.at].strip().lower()
            self.at += 1
            key = next(
                (k for k in (DIMENSION_LINE, STEP_LINE, DURATION_LINE) if line.startswith(k)), ""
            )
            block = next((name for k, name in MATRICES.items() if line.startswith(k)), "")
            if key:
                self.head[key] = self.number(line[len(key) :])
            elif block:
                self.blocks[block] = self.rows(self.n, (self.n,))
            elif line.startswith(WEIGHT_LINE):
                self.blocks["weight"] = self.rows(1, (self.n,))[0]
            elif line.startswith(LOADING_LINE):
                self.blocks["loads"] = self.rows(self.steps, (self.n + 1, self.n + 2))

    @property
    def n(self) -> int:
        n = self.head.get(DIMENSION_LINE, 0)
        if n > MAX_COORDINATES:
            raise UnsafeFileError(f"{n:.0f} coordinates are not read.", where=self.path)
        if n < 6 or n != int(n):
            raise self.error(f"{DIMENSION_LINE!r} 6 or more has to come before the blocks")
        return int(n)

    @property
    def steps(self) -> int:
        """Lines of loads that OpenFAST reads."""
        dt, T = self.head.get(STEP_LINE, 0.0), self.head.get(DURATION_LINE, -1.0)
        if not (dt > 0 and 0 <= T / dt < len(self.lines)):
            raise self.error(f"a time step {dt:g} s and a duration {T:g} s do not fit the file")
        return round(T / dt) + 1

    def rows(self, k: int, widths: tuple[int, ...]) -> Array:
        """The next k rows; old files have a line of comment before them."""
        self.at += self.old
        found: list[list[float]] = []
        for _ in range(k):
            words = self.lines[self.at].split() if self.at < len(self.lines) else []
            self.at += 1
            if len(words) not in widths or (found and len(words) != len(found[0])):
                raise self.error(f"row {len(found) + 1} of {k} has {len(words)} words")
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
            hint="Write the file again; it is cut, changed, or of another kind (GuyanASCII is not "
            "read).",
        )

    def superelement(self) -> Superelement:
        needed = {"M", "K", "D"} | ({"loads"} if self.old else {"weight", "K_W"})
        if missing := sorted(needed - set(self.blocks)):
            raise self.error(f"the blocks {missing} are missing")
        n, b = self.n, self.blocks
        loads = b.get("loads", np.zeros((0, n + 2)))
        if np.abs(np.diff(loads[:, 0]) - self.head.get(STEP_LINE, 0.0)).max(initial=0.0) > (
            TIME_STEP_RTOL * self.head.get(STEP_LINE, 0.0)
        ):
            raise self.error(f"the times of the loads are not {self.head[STEP_LINE]:g} s apart")
        found = Superelement(
            M=b["M"],
            K=b["K"],
            D=b["D"],
            weight=b.get("weight", np.zeros(n)),
            K_W=b.get("K_W", np.zeros((n, n))),
            t=loads[:, 0],
            loads=loads[:, 1 : n + 1],
            elevation=loads[:, n + 1] if loads.shape[1] == n + 2 else np.zeros(len(loads)),
        )
        _check(found, self.path)
        return found


def _check(found: Superelement, path: str) -> None:
    for name in ("M", "K", "D"):
        symmetric(f"the matrix {name}", getattr(found, name), ASYMMETRY_RTOL, where=path)
    size = np.sqrt(np.abs(np.diag(found.M)))
    size[size == 0] = 1.0
    if np.linalg.eigvalsh(found.M / np.outer(size, size))[0] <= 0:
        raise QualityGateError("the mass must be positive: some motion has no inertia.", where=path)
