"""Responses in texts of spectrum analysers: a column of frequencies, and one for each part.

A column is named ``12+Z/3-Y real [m/s^2/N]``: node and direction of the sensor and of the force,
the part (real, imag, magnitude, phase or coherence) and its unit. Lines above the names are passed
over. Columns stand between commas, semicolons or tabs; with these two, numbers may have a comma.
"""

import codecs
import re
from pathlib import Path

import numpy as np

from rom.components.updating.responses.grid import COHERENCE_KIND
from rom.components.updating.responses.unit_labels import in_si, motion_per_force
from rom.errors import FileFormatError
from rom.io.fields.universal import FORCE_TYPE, FREQUENCY_RESPONSE, Function
from rom.io.files import check_readable
from rom.model import Array

MAX_TABLE_BYTES = 2**29
COLUMN_NAME = re.compile(
    r"(\d+)\s*:?\s*([+-]?)([XYZ])\s*/\s*(\d+)\s*:?\s*([+-]?)([XYZ])[\s,;:]*"
    r"(real|imag|magnitude|phase|coherence)\s*(?:[\[(](.+)[\])])?",
    re.IGNORECASE,
)
POINT_COLUMN = re.compile(r"([xyz])\s*[\[(](.+)[\])]", re.IGNORECASE)
ANGLES = {"deg": np.pi / 180, "rad": 1.0}
NAME_HINT = (
    "A column is named as in 12+Z/3-Y real [m/s^2/N]; parts are real and imag, or magnitude and "
    "phase [deg], and coherence."
)
Row = list[str]
Pair = tuple[tuple[int, int], tuple[int, int]]  # node and direction of sensor and force


def functions_of(path: Path) -> tuple[Function, ...]:
    """All functions of a table, in SI units."""
    names, rows = _cells(path, re.compile(r"freq", re.IGNORECASE))
    values = _numbers(rows)
    if label := re.search(r"[\[(]([^\])]+)[\])]", names[0]):
        values[:, 0] *= in_si(label.group(1), "frequency")
    parts: dict[Pair, dict[str, tuple[str, Array]]] = {}
    for k, name in enumerate(names[1:], 1):
        found = COLUMN_NAME.fullmatch(name)
        if not found:
            raise FileFormatError(f"column {k + 1} has the name {name!r}.", hint=NAME_HINT)
        s, s_sign, s_axis, e, e_sign, e_axis, part, unit = found.groups()
        pair = (int(s), _axis(s_sign, s_axis)), (int(e), _axis(e_sign, e_axis))
        own = parts.setdefault(pair, {})
        if part.lower() in own:
            raise FileFormatError(f"two columns are named {name!r}.")
        own[part.lower()] = unit or "", values[:, k]
    return tuple(f for pair, own in parts.items() for f in _functions(pair, own, values[:, 0]))


def points_of(path: Path) -> tuple[dict[int, Array], dict[int, str]]:
    """{node: point [m]} by columns node, x [m], y [m] and z [m]; {node: body} where one is body."""
    names, rows = _cells(path, re.compile(r"node", re.IGNORECASE))
    named = names[-1].lower() == "body"
    owners = [cells.pop().strip().strip('"') for _, cells in rows] if named else []
    names = names[:-1] if named else names
    values = _numbers(rows)
    found = [POINT_COLUMN.fullmatch(name) for name in names[1:]]
    axes = [m.group(1).lower() for m in found if m]
    if axes != ["x", "y", "z"] or len(names) != 4:
        needed = "node, x [m], y [m], z [m], and body if there are several"
        raise FileFormatError(f"columns {names}: {needed}.")
    factors = np.array([in_si(m.group(2), "length") for m in found if m])
    nodes = values[:, 0]
    if len(set(nodes)) < len(nodes) or (nodes != np.floor(nodes)).any():
        raise FileFormatError("nodes are whole numbers, each one once.")
    places = {int(row[0]): row[1:] * factors for row in values}
    return places, dict(zip(places, owners, strict=True)) if named else {}


def _axis(sign: str, axis: str) -> int:
    return ("XYZ".index(axis.upper()) + 1) * (-1 if sign == "-" else 1)


def _functions(pair: Pair, own: dict[str, tuple[str, Array]], x: Array) -> list[Function]:
    response = set(own) - {"coherence"}
    if response not in ({"real", "imag"}, {"magnitude", "phase"}, set()):
        raise FileFormatError(f"of {pair} there is {sorted(response)} alone.", hint=NAME_HINT)
    found = []
    if response:
        first, second = ("real", "imag") if "real" in own else ("magnitude", "phase")
        (unit, a), (other, b) = own[first], own[second]
        if first == "real" and other != unit:
            raise FileFormatError(f"of {pair} the units are {unit!r} and {other!r}.")
        if first == "magnitude" and other not in ANGLES:
            raise FileFormatError(f"of {pair} the phase has the unit {other!r}.", hint=NAME_HINT)
        kind, factor = motion_per_force(unit)
        y = a + 1j * b if first == "real" else a * np.exp(1j * b * ANGLES[other])
        found.append(Function(FREQUENCY_RESPONSE, x, y * factor, *pair, kind, FORCE_TYPE, ()))
    if "coherence" in own:
        c = own["coherence"][1].astype(complex)
        found.append(Function(COHERENCE_KIND, x, c, *pair, 0, FORCE_TYPE, ()))
    return found


def _cells(path: Path, first: re.Pattern[str]) -> tuple[Row, list[tuple[int, Row]]]:
    """Names of columns, the first of which is like a pattern; cells of each line by its number."""
    text = _decoded(check_readable(path, MAX_TABLE_BYTES).read_bytes()).splitlines()
    for above, line in enumerate(text, 1):
        separator = max("\t;,", key=line.count)
        names = [cell.strip().strip('"') for cell in line.split(separator)]
        if len(names) > 1 and first.match(names[0]):
            rest = text[above:]
            break
    else:
        raise FileFormatError(f"no column is named {first.pattern!r}.")
    rows = [(n, line.split(separator)) for n, line in enumerate(rest, above + 1) if line.strip()]
    for number, cells in rows:
        if len(cells) != (n := len(names)):
            raise FileFormatError(f"line {number} has {len(cells)} numbers under {n} names.")
    if not rows:
        raise FileFormatError("there are no numbers under the names.")
    return names, rows


def _decoded(data: bytes) -> str:
    """Text in Unicode, or as Windows writes it in the west."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16", "replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def _numbers(rows: list[tuple[int, Row]]) -> Array:
    """(n, columns) numbers of cells, which have no comma where columns stand between commas."""
    found = []
    if all(any(c in x for _, cells in rows for x in cells) for c in ",."):
        text = "numbers have commas and points: one of them is of thousands."
        raise FileFormatError(text, hint="Write numbers without separators of thousands.")
    for number, cells in rows:
        try:
            found.append([float(cell.strip().strip('"').replace(",", ".")) for cell in cells])
        except ValueError as error:
            raise FileFormatError(f"line {number}: {error}.") from error
    return np.array(found)
