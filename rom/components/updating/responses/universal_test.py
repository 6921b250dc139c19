"""Tests in universal files: functions (58), nodes (15, 2411), units (164) and shapes (55).

Source:
    SDRC, Universal file datasets, as published by the University of Cincinnati.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from rom.components.updating.measured import MeasuredModes
from rom.components.updating.responses import unit_labels
from rom.components.updating.responses.grid import COHERENCE_KIND
from rom.components.updating.responses.unit_labels import IN_G, NO_UNITS, plain
from rom.errors import ConfigError, FileFormatError
from rom.io.fields.universal import FREQUENCY_RESPONSE, Function, reals, scan
from rom.io.files import damaged, need
from rom.model import Array

SETS = dict[str, list[list[str]]]
NODE_SETS = ("15", "2411")
AXES_SETS = ("18", "2420")  # of local coordinate systems
CARTESIAN_TYPE = 0  # type of a coordinate system
N_SHAPE_RECORDS = 8  # before the values of a dataset 55
NORMAL, COMPLEX = 2, 3  # analyses of a dataset 55
UNITS_RTOL = 1e-3  # of factors that say the same


def functions_and_points(path: Path) -> tuple[tuple[Function, ...], dict[int, Array]]:
    """Functions in SI units, and {node: point [m]}."""
    functions, others = scan(path)
    factors = _factors(others)
    return tuple(_in_si(f, factors) for f in functions), _points(others, factors)


def modes_of(path: Path, points: dict[int, Array] | None = None) -> MeasuredModes:
    """Measured modes of all datasets 55 that hold one, with points {node: [m]} of another file."""
    _, others = scan(path)
    places = _points(others, _factors(others)) | (points or {})
    found = list(filter(None, map(_shape, others.get("55", []))))
    if not found:
        raise FileFormatError("there is no mode (dataset 55).")
    nodes = sorted({node for _, _, values in found for node in values})
    if missing := [node for node in nodes if node not in places]:
        raise FileFormatError(f"node {missing[0]} has no coordinates.")
    zero = np.zeros(3)  # records of zeros need not appear
    shapes = np.array([[values.get(node, zero) for node in nodes] for _, _, values in found])
    order = np.argsort([f for f, _, _ in found])
    f, zeta = (np.array([s[k] for s in found])[order] for k in (0, 1))
    return MeasuredModes(f, zeta, np.array([places[node] for node in nodes]), shapes[order])


def _factors(others: SETS) -> tuple[float, float] | None:
    """Units of the file per metre and newton, where it says."""
    found = set()
    for lines in others.get("164", []):
        with damaged("dataset 164 is cut"):
            length, force = reals(lines[1], (25, 25))
        found.add((length, force))
    if len(found) > 1 or not all(np.isfinite(f).all() and min(f) > 0 for f in found):
        raise FileFormatError(f"dataset 164 has the factors {sorted(found)}.")
    return found.pop() if found else None


def _points(others: SETS, factors: tuple[float, float] | None) -> dict[int, Array]:
    length = factors[0] if factors else 1.0
    points: dict[int, Array] = {}
    with damaged("a dataset 18 or 2420 is cut"):
        names, same = _systems(others)
    local = any(name in others for name in AXES_SETS)
    for name in NODE_SETS:
        for lines in others.get(name, []):
            with damaged(f"dataset {name} is cut"):
                records = lines if name == "15" else _pairs(lines)
                nodes = [_node(line, 13 if name == "15" else 25) for line in records]
            for node, system, turned, x in nodes:
                if local and (other := {system, turned} - same):
                    named = [f"{k} {names.get(k, '')}".strip() for k in sorted(other)]
                    text = f"node {node} is in the local coordinate system {', '.join(named)}."
                    hint = "Export the test in global axes; local ones are not read."
                    raise FileFormatError(text, hint=hint)
                points[node] = x / length
    return points


def _systems(others: SETS) -> tuple[dict[int, str], set[int]]:
    """Names of coordinate systems, and numbers of those that are the global one.

    Dataset 18 gives the origin, a point on the x axis and one in the xz plane; dataset 2420 the
    rows of a rotation and the origin.
    """
    names, same = dict[int, str](), {0}
    for kind, first, size, width in (("18", 0, 4, 13), ("2420", 2, 6, 25)):
        for lines in others.get(kind, []):
            for head, name, *rows in (lines[k : k + size] for k in range(first, len(lines), size)):
                number, shape, reference = (int(head[a : a + 10] or 0) for a in (0, 10, 20))
                names[number] = name.strip()
                A = np.array([x for row in rows for x in _columns(row, width)]).reshape(-1, 3)
                if kind == "18":
                    along = A[1, 0] > 0 and A[2, 2] > 0 and not (A[0].any() or A[1, 2])
                    is_same = reference in same | {number} and along and not A[1:, 1].any()
                else:
                    is_same = np.array_equal(A, np.eye(4, 3))
                if is_same and shape == CARTESIAN_TYPE:
                    same.add(number)
    return names, same


def _node(line: str, width: int) -> tuple[int, int, int, Array]:
    """Number, coordinate systems of place and displacement, and place of a node."""
    node, system, turned = (int(line[a : a + 10]) for a in (0, 10, 20))
    x, y, z = reals(line[40:], [width] * 3)
    return node, system, turned, np.array([x, y, z])


def _pairs(lines: list[str]) -> list[str]:
    need(len(lines) % 2 == 0, "it has an odd line")
    return [f"{a:<40}"[:40] + b for a, b in zip(lines[::2], lines[1::2], strict=True)]


def _in_si(f: Function, factors: tuple[float, float] | None) -> Function:
    """The function in SI units, by the labels at its axis, else by the units of the file."""
    if f.kind not in (FREQUENCY_RESPONSE, COHERENCE_KIND):
        return f
    try:
        if plain(f.abscissa) not in NO_UNITS:
            f = replace(f, x=f.x * unit_labels.in_si(f.abscissa, "frequency"))
        if f.kind == COHERENCE_KIND:
            return f
        replace(f, x=np.ones(1), y=np.ones(1)).receptance()  # refuses what is no response
        motion, force = (1 / k for k in factors or (1.0, 1.0))
        if plain(f.units[0]) not in NO_UNITS:
            kind, own = unit_labels.motion_of_unit(f.units[0])
            if kind != f.numerator:
                raise ConfigError(f"its numerator needs unit {f.numerator}, got {f.units[0]!r}.")
            motion = _agreed(own, motion if factors and plain(f.units[0]) not in IN_G else own)
        if plain(f.units[1]) not in NO_UNITS:
            own = unit_labels.in_si(f.units[1], "force")
            force = _agreed(own, force if factors else own)
    except ConfigError as error:
        where = f"function of {f.response} by {f.reference}"
        raise FileFormatError(error.message, where=where, hint=error.hint) from error
    return replace(f, y=f.y * motion / force)


def _agreed(label: float, units: float) -> float:
    if abs(label / units - 1) > UNITS_RTOL:
        text = f"the unit at its axis is {label / units:.4g} times that of dataset 164."
        hint = "Correct one of the two in the file; which is right is not known here."
        raise ConfigError(text, hint=hint)
    return label


def _shape(lines: list[str]) -> tuple[float, float, dict[int, Array]] | None:
    """Frequency [Hz], damping ratio and {node: (3,)} of one dataset 55; None if it is no mode."""
    with damaged("dataset 55 is cut"):
        analysis, kind = (int(lines[5][a : a + 10]) for a in (10, 40))
        if analysis not in (NORMAL, COMPLEX):
            return None
        real = _columns(lines[7])
        if analysis == NORMAL:
            f, zeta = real[0], real[2]
        else:
            size = np.hypot(real[0], real[1])
            f, zeta = size / (2 * np.pi), -real[0] / size
        return float(f), float(zeta), _values(lines[N_SHAPE_RECORDS:], kind == 5)


def _values(lines: list[str], is_complex: bool) -> dict[int, Array]:
    """{node: (3,)}; how many values each has is counted, as some programs announce half of them."""
    numbers: dict[int, list[float]] = {}
    node = 0  # none, which fails below
    for line in filter(str.strip, lines):
        if "." in line:
            numbers[node] += _columns(line)
        else:
            numbers[node := int(line)] = []
    sizes = {len(found) for found in numbers.values()}
    enough = len(sizes) == 1 and min(sizes) >= (6 if is_complex else 3)
    need(enough, f"nodes have {sorted(sizes)} numbers")
    found = {node: np.array(x) for node, x in numbers.items()}
    return {n: (x[:6:2] + 1j * x[1:6:2] if is_complex else x[:3]) for n, x in found.items()}


def _columns(line: str, width: int = 13) -> list[float]:
    return reals(line, [width] * (len(line) // width + 1))
