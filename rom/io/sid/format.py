"""Standard Input Data of flexible bodies (SID): what the files hold, and their text.

A block is a matrix that depends on the elastic coordinates to first order,
M = M0 + sum_j M1_j q_j. Programs disagree on the order of the indices and of the columns; here
everything has one layout, see `StandardInput`, and `rom.io.sid.dialect` tells the dialects apart.

Source:
    Wallrapp, Standard input data of flexible members in multibody systems, in Advanced Multibody
    System Dynamics (1993) 445; Schwertassek and Wallrapp, Dynamik flexibler Mehrkoerpersysteme
    (1999), chapter 6.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rom.arguments import one_of
from rom.io.files import write_whole
from rom.model import Array
from rom.names import ORIGIN_MARK

ZERO, DIAGONAL, SYMMETRIC, GENERAL, UNIT = range(5)
SIZES = ("order", "nrow", "ncol", "nq", "nqn", "structure")
NODE_BLOCKS = ("origin", "phi", "psi", "AP", "sigma")
BLOCKS = ("mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De")
ALWAYS_SYMMETRIC = ("J", "Me", "Ke", "De")
TENSOR_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # entries of J in a column of six
DIALECTS = {  # mode is the second index of m1; columns of Gr and of Ge axis by axis; J a column
    "fembs": (True, True, True, True),
    "pysid": (True, False, True, True),
    "geisler": (False, False, False, False),
}


@dataclass(frozen=True, slots=True)
class Taylor:
    """A matrix of first order in the elastic coordinates."""

    M0: Array  # (n, m) for the undeformed body
    M1: Array | None = None  # (r, n, m) change per elastic coordinate; None for order zero


@dataclass(frozen=True, slots=True)
class StandardInput:
    """A flexible body as SID knows it; r elastic coordinates.

    Attributes:
        title: first line of the file.
        name: name of the modal body.
        mass: [kg].
        coordinates: (r,) what each coordinate is.
        nodes: {label: {"origin": 3 x 1, "phi": 3 x r, "psi": 3 x r, "AP": 3 x 3}}, some with
            "sigma" 6 x 1.
        blocks: mdCM 3 x 1; J 3 x 3; Ct, Cr r x 3; Me, Ke, De r x r; Gr 3 x 3r and Ge r x 3r, the
            columns of all coordinates for x, then y, then z; Oe r x 6 for the products xx, yy,
            zz, xy, yz, xz of angular velocities; ksigma r x 1.
        dialect: how the file was written, or "" for a record that was made here.
        lines: {block: line of the file where it begins}.
    """

    title: str
    name: str
    mass: float
    coordinates: tuple[str, ...]
    nodes: dict[str, dict[str, Taylor]]
    blocks: dict[str, Taylor]
    dialect: str = field(default="", compare=False)
    lines: dict[str, int] = field(default_factory=dict, compare=False)

    def place(self, block: str) -> str:
        """A block for messages, such as "Oe (line 812)"; without a file its name alone."""
        return block + (f" (line {self.lines[block]})" if block in self.lines else "")

    @property
    def n_modes(self) -> int:
        """Number r of elastic coordinates."""
        return len(self.coordinates)


def shape_of(block: str, r: int) -> tuple[int, int]:
    """Rows and columns of a block for r elastic coordinates."""
    shapes = {
        "origin": (3, 1), "phi": (3, r), "psi": (3, r), "AP": (3, 3), "sigma": (6, 1),
        "mdCM": (3, 1), "J": (3, 3), "Ct": (r, 3), "Cr": (r, 3), "Me": (r, r), "Gr": (3, 3 * r),
        "Ge": (r, 3 * r), "Oe": (r, 6), "ksigma": (r, 1), "Ke": (r, r), "De": (r, r),
    }  # fmt: skip
    return shapes[block]


def write_sid(record: StandardInput, path: str | Path, *, dialect: str = "fembs") -> Path:
    """Write a file of Standard Input Data.

    Args:
        record: the body.
        path: usually ending in ``.SID_FEM``.
        dialect: "fembs" for Simpack, "pysid", or "geisler" (FEMBeam, welib).

    Raises:
        ConfigError: for an unknown dialect or a place that is not writable.
    """
    one_of("dialect", dialect, DIALECTS)
    text = "\n".join(_document(record, dialect)) + "\n"
    return write_whole(path, text.encode("ascii", "replace"))


def repacked(A: Array, *, by_axis: bool) -> Array:
    """Columns (..., 3 r) axis by axis from columns mode by mode, or back."""
    r = A.shape[-1] // 3
    grid = A.reshape(*A.shape[:-1], *((r, 3) if by_axis else (3, r)))
    return np.swapaxes(grid, -1, -2).reshape(A.shape)


def _document(record: StandardInput, dialect: str) -> Iterator[str]:
    title = f"{_line(record.title)}; {ORIGIN_MARK}"
    yield f"{len(record.nodes)} {record.n_modes} :No. nodes, No. modes: {title}"
    yield " part"
    yield f"      new modal = {_line(record.name)}"
    yield _indented(2, "refmod")
    yield _assigned(3, "mass", _number(record.mass))
    yield _assigned(3, "nelastq", str(record.n_modes))
    for k, text in enumerate(record.coordinates):
        yield _assigned(3, f"ielastq ({k + 1:4d})", f" {_line(text)}")
    yield _indented(2, "end refmod")
    yield _indented(2, "frame")
    for label, node in record.nodes.items():
        yield _assigned(3, "new node", f" {_line(label)}")
        yield _assigned(4, "rframe", " body ref")
        for name in NODE_BLOCKS:
            if name in node:
                yield from _block(4, name, node[name], record.n_modes, dialect)
        yield _indented(3, "end node")
    yield _indented(2, "end frame")
    for name in BLOCKS:
        yield from _block(2, name, record.blocks[name], record.n_modes, dialect)
    yield "      end modal"
    yield " end part"


def _block(depth: int, name: str, block: Taylor, r: int, dialect: str) -> Iterator[str]:
    mode_second = DIALECTS[dialect][0]
    M0, M1 = in_dialect(name, block, dialect)
    structure = _structure(name, M0, M1)
    triangle = structure == SYMMETRIC and not mode_second  # FEMBeam writes the lower one only
    yield _indented(depth, name)
    sizes = int(M1 is not None), *M0.shape, r, 0, structure
    for key, value in zip(SIZES, sizes, strict=True):
        yield _assigned(depth + 1, key, f" {value}")
    if structure not in (ZERO, UNIT):
        for i, j in np.argwhere(M0):
            if not triangle or i >= j:
                yield _assigned(depth + 1, f"m0({i + 1:2d},{j + 1:2d})", _number(M0[i, j]))
    if M1 is not None:
        for k, i, j in np.argwhere(M1):
            if not triangle or i >= j:
                a, b = (k, j) if mode_second else (j, k)
                key = f"m1({i + 1:2d},{a + 1:2d},{b + 1:2d})"
                yield _assigned(depth + 1, key, _number(M1[k, i, j]))
    yield _indented(depth, f"end {name}")


def in_dialect(name: str, block: Taylor, dialect: str) -> tuple[Array, Array | None]:
    """M0 and M1 with rows and columns as a dialect has them."""
    _, gr_by_axis, ge_by_axis, column = DIALECTS[dialect]
    by_mode = (name, gr_by_axis) == ("Gr", False) or (name, ge_by_axis) == ("Ge", False)

    def turned(A: Array) -> Array:
        if name == "J" and column:
            i, j = np.transpose(TENSOR_ENTRIES)
            A = A[..., i, j][..., None]
        return repacked(A, by_axis=False) if by_mode else A

    return turned(block.M0), None if block.M1 is None else turned(block.M1)


def _structure(name: str, M0: Array, M1: Array | None) -> int:
    changes = M1 is not None and M1.any()
    if not M0.any() and not changes:
        return ZERO
    if M0.shape[0] == M0.shape[1] and not changes and np.array_equal(M0, np.eye(len(M0))):
        return UNIT
    if M0.shape[0] != M0.shape[1] or name not in ALWAYS_SYMMETRIC:
        return GENERAL
    return SYMMETRIC if changes or (M0 - np.diag(np.diag(M0))).any() else DIAGONAL


def _indented(depth: int, text: str) -> str:
    return " " * (1 + 5 * depth) + text


def _assigned(depth: int, key: str, value: str) -> str:
    return _indented(depth, key).ljust(48) + "=" + value


def _number(value: float) -> str:
    return f"{value: .11E}".replace("E", "D")


def _line(text: str) -> str:
    return " ".join(str(text).split())
