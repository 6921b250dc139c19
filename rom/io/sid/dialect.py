"""Tells the dialects of Standard Input Data apart by what the blocks must have in common.

Programs agree on shapes, not on the order of indices and columns, so that a file read wrongly
gives wrong motion without an error. The blocks repeat each other: with C4_j the integral of
x~ phi~_j, J1_j = -(C4_j + C4_j^T) and Gr_j = -2 C4_j, while mdCM1_j is a row of Ct0 and
Ge_j = 2 Cr1(:, j, :). Only the right order fulfils this.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from rom.arguments import one_of, typed
from rom.errors import FileFormatError, warn
from rom.io.sid.format import BLOCKS, DIALECTS, TENSOR_ENTRIES, StandardInput, Taylor, repacked
from rom.io.sid.reading import RawBlock, RawFile, read_raw, values
from rom.model import Array, Report, Row
from rom.rotation import skew_tensor

RESIDUAL_RTOL = 1e-8  # files have twelve digits
GE_FORMS = ("antisymmetric", "as_written")
BLOCK_RTOL = 1e-4  # share of what a block could be, below which its differences are round-off


@typed
def read_sid(path: str | Path, *, ge: str = "antisymmetric") -> StandardInput:
    """Read a flexible body from Standard Input Data, of any program.

    Args:
        path: the file.
        ge: "antisymmetric" keeps of Ge the part that inertia can have, which does no work;
            "as_written" keeps all.

    Raises:
        ConfigError: for another ``ge``.
        FileFormatError: naming the line, if the file is missing, cut, or no SID.
        UnsafeFileError: if it is larger than 256 MiB or has more than 1000 coordinates.

    Warns:
        RomWarning: if Ge has a part that does work, or terms of second order are left out.
    """
    one_of("ge", ge, GE_FORMS)
    record = _settled(read_raw(path))
    Ge = record.blocks["Ge"]
    even = 0.5 * (by_mode(Ge.M0) + by_mode(Ge.M0).swapaxes(0, 1))
    symmetric = even.transpose(1, 2, 0).reshape(Ge.M0.shape)
    scale = max(np.abs(Ge.M0).max(initial=0.0), _scales(record)[2])
    if ge == "antisymmetric" and np.abs(symmetric).max(initial=0.0) > RESIDUAL_RTOL * scale:
        share = np.abs(symmetric).max() / scale
        warn(
            f"{path}: the part of Ge that does work ({share:.2g} of its largest entry) is left "
            "out; it mostly is stiffening that went to a wrong place."
        )
        record.blocks["Ge"] = Taylor(Ge.M0 - symmetric, Ge.M1)
    return record


def check_sid(record: StandardInput) -> Report:
    """Residuals of the relations between the blocks, relative to their size."""
    rows = [_row(_placed(record, what, x), x) for what, x in _relations(record)]
    for name in ("Me", "Ke", "De"):
        A = record.blocks[name].M0
        rows.append(_row(f"{name} symmetric", _relative(A, A.T, 0.0)))
    lowest = float(np.linalg.eigvalsh(record.blocks["Me"].M0).min(initial=np.inf))
    rows.append(Row("smallest eigenvalue of Me", lowest, "> 0", lowest > 0))
    title = f"SID {record.name}, {len(record.nodes)} nodes, {record.n_modes} modes"
    return Report(f"{title}, dialect {record.dialect or 'none'}", tuple(rows))


def _placed(record: StandardInput, what: str, residual: float) -> str:
    """What does not hold, with the lines of its blocks."""
    named = re.findall(r"[A-Za-z]+(?=[01]*)", what) if residual > RESIDUAL_RTOL else []
    lines = [record.place(name) for name in dict.fromkeys(named) if name in record.lines]
    return ", ".join([what, *lines])


def _row(what: str, residual: float) -> Row:
    return Row(what, float(residual), f"<= {RESIDUAL_RTOL:g}", bool(residual <= RESIDUAL_RTOL))


def _relations(record: StandardInput) -> Iterator[tuple[str, float]]:
    """What must vanish, by name."""
    b, r = record.blocks, record.n_modes
    momentum, moment, mass = _scales(record)
    nodes = (_tilted(node["AP"].M1, node["psi"].M0) for node in record.nodes.values())
    yield "AP1 = skew(psi)", max(nodes, default=0.0)
    yield "mdCM1 = Ct0", _relative(first(b["mdCM"], r)[:, :, 0], b["Ct"].M0, momentum)
    J1, Gr = first(b["J"], r), by_mode(b["Gr"].M0)
    yield "Gr + Gr^T = 2 J1", _relative(Gr + Gr.swapaxes(1, 2), 2 * J1, moment)
    turned = -2 * _skew(b["Cr"].M0)
    yield "Gr - Gr^T = -2 skew(Cr0)", _relative(Gr - Gr.swapaxes(1, 2), turned, moment)
    Cr1, Ge = first(b["Cr"], r), by_mode(b["Ge"].M0)
    yield "Ge = 2 Cr1, antisymmetric part", _relative(_odd(Ge), 2 * _odd(Cr1), mass)
    J6 = np.stack([J1[:, i, j] for i, j in TENSOR_ENTRIES], axis=1)
    expected = -J6[:, [0, 1, 2, 3, 5, 4]] * np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])
    yield "Oe0 from J1", _relative(b["Oe"].M0, expected, moment)
    Oe1 = first(b["Oe"], r)
    yield "Oe1 symmetric", _relative(Oe1, Oe1.swapaxes(0, 1), mass)


def _scales(record: StandardInput) -> tuple[float, float, float]:
    """What integrals of rho phi, rho x phi and rho phi phi could be at most."""
    b = record.blocks
    mass = float(np.abs(b["Me"].M0).max(initial=0.0))
    inertia = float(np.abs(b["J"].M0).max())
    return (
        BLOCK_RTOL * np.sqrt(record.mass * mass),
        BLOCK_RTOL * np.sqrt(inertia * mass),
        BLOCK_RTOL * mass,
    )


def first(block: Taylor, r: int) -> Array:
    """(r, n, m) coefficients of first order, zero where there are none."""
    return np.zeros((r, *block.M0.shape)) if block.M1 is None else block.M1


def by_mode(A: Array) -> Array:
    """(r, n, 3) from columns (n, 3 r), axis by axis."""
    return A.reshape(A.shape[0], 3, -1).transpose(2, 0, 1)


def _odd(A: Array) -> Array:
    return A - A.swapaxes(0, 1)


def _tilted(M1: Array | None, psi: Array) -> float:
    return _relative(np.zeros((psi.shape[1], 3, 3)) if M1 is None else M1, _skew(psi.T), 0.0)


def _skew(a: Array) -> Array:
    """(k, 3, 3) matrices of the cross products with (k, 3) vectors."""
    return np.einsum("abc,kc->kab", skew_tensor(), a)


def _relative(A: Array, B: Array, floor: float) -> float:
    scale = max(np.abs(A).max(initial=0.0), np.abs(B).max(initial=0.0), floor)
    return float(np.abs(A - B).max(initial=0.0) / scale) if scale else 0.0


def _settled(file: RawFile) -> StandardInput:
    """The record, its indices and columns in the order of `StandardInput`."""
    mode_second = _mode_is_second(file)
    record = _record(file, mode_second)
    r, (_, moment, mass) = record.n_modes, _scales(record)
    J1, Cr = first(record.blocks["J"], r), record.blocks["Cr"]
    Cr0, Cr1 = Cr.M0, first(Cr, r)

    residuals: dict[str, Callable[[Array], float]] = {
        "Gr": lambda A: _relative(by_mode(A), J1 - _skew(Cr0), moment),
        "Ge": lambda A: _relative(_odd(by_mode(A)), 2 * _odd(Cr1), mass),
    }
    packing = {name: _packing(record, name, residual) for name, residual in residuals.items()}
    layout = mode_second, *packing.values(), file.blocks["J"].sizes["ncol"] == 1
    for name in [name for name, by_axis in packing.items() if by_axis is False]:
        M0, M1 = record.blocks[name].M0, record.blocks[name].M1
        turned = None if M1 is None else repacked(M1, by_axis=True)
        record.blocks[name] = Taylor(repacked(M0, by_axis=True), turned)
    fits = [
        name
        for name, dialect in DIALECTS.items()
        if all(a is None or a == b for a, b in zip(layout, dialect, strict=True))
    ]
    return replace(record, dialect=fits[0] if fits else "mixed")


def _packing(record: StandardInput, name: str, residual: Callable[[Array], float]) -> bool | None:
    """True for columns axis by axis, False for mode by mode, None when both are the same."""
    A = record.blocks[name].M0
    other = repacked(A, by_axis=True)
    if np.array_equal(A, other):
        return None
    return bool(residual(A) <= residual(other))


def _record(file: RawFile, mode_second: bool) -> StandardInput:
    blocks = {name: _taylor(file, file.blocks[name], mode_second) for name in BLOCKS}
    nodes = {
        label: {name: _taylor(file, raw, mode_second) for name, raw in node.items()}
        for label, node in file.nodes.items()
    }
    coordinates = tuple(file.coordinates.get(k + 1, "") for k in range(file.n_modes))
    dropped = sum(raw.dropped for raw in _all(file))
    if dropped:
        warn(f"{file.path}: {dropped} terms of second order are left out.")
    lines = {name: raw.line for name, raw in file.blocks.items()}
    return StandardInput(file.title, file.name, file.mass, coordinates, nodes, blocks, lines=lines)


def _taylor(file: RawFile, raw: RawBlock, mode_second: bool) -> Taylor:
    M0, M1 = values(file, raw, mode_second=mode_second)
    if raw.name == "J" and M0.shape == (6, 1):
        return Taylor(_tensor(M0[:, 0]), None if M1 is None else _tensor(M1[:, :, 0]))
    return Taylor(M0, M1)


def _tensor(six: Array) -> Array:
    out = np.zeros((*six.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(TENSOR_ENTRIES):
        out[..., i, j] = out[..., j, i] = six[..., k]
    return out


def _all(file: RawFile) -> Iterator[RawBlock]:
    yield from file.blocks.values()
    for node in file.nodes.values():
        yield from node.values()


def _mode_is_second(file: RawFile) -> bool:
    """Whether m1 counts row, mode, column, or row, column, mode: by what fits, then by meaning."""
    r, fits = file.n_modes, {True: True, False: True}
    for raw in _all(file):
        m = raw.sizes["ncol"]
        for _, b, c in raw.m1:
            fits[True] &= b <= r and c <= m
            fits[False] &= b <= m and c <= r
        if not any(fits.values()):
            text = f"the indices of m1 in {raw.name} fit no order."
            raise FileFormatError(text, where=f"{file.path}, line {raw.line}")
    if fits[True] != fits[False]:
        return fits[True]
    tilt = {second: 0.0 for second in fits}
    for second in fits:
        for node in file.nodes.values():
            M1, psi = (values(file, node[name], mode_second=second) for name in ("AP", "psi"))
            tilt[second] = max(tilt[second], _tilted(M1[1], psi[0]))
    if tilt[True] == tilt[False]:
        return file.blocks["J"].sizes["ncol"] == 1
    return tilt[True] < tilt[False]
