"""A body as data for the joint "modal" of MBDyn (``.fem``), and back.

Record groups: 1 header, 2 labels of the nodes, 3 and 4 start, 5 to 7 positions, 8 shapes (six
numbers for each node), 9 mass, 10 stiffness, 11 lumped masses of the nodes, only read, 12
rigid inertia about the mass centre, 13 damping; 14 to 18 inertia invariants, row by row, with x~
the matrix of the cross product::

    Inv3 int phi_k    Inv4 int x x phi_k    Inv8 -int x~ phi~_j    Inv5 int phi_j x phi_k
    Inv9 int phi~_j phi~_k

and 19 stress stiffening per unit of xx, yy, zz, xy, yz, zx of angular velocities (1 to 6), angular
acceleration (7 to 9), acceleration (10 to 12), then force and moment on each node.

Source:
    MBDyn input manual, joint "modal", and what its reader of these groups stores where.
"""

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from rom.arguments import symmetric
from rom.body.flexible import FlexibleBody
from rom.body.inertia import point_integrals
from rom.body.stiffening import known_loads
from rom.decks.lines import whole
from rom.errors import ConfigError, UnsafeFileError, in_file, warn
from rom.io.files import check_last_line, damaged, need, number, numbers_line, write_lines
from rom.io.sid.body import UNEVEN_RTOL, Rigid, body_of, invariants
from rom.io.sid.reading import MAX_BYTES, MOST_MODES
from rom.model import Array
from rom.names import ORIGIN_MARK, named
from rom.readable import check_readable

GROUP_PATTERN = re.compile(r"^\*\*[ \t]*RECORD[ \t]+GROUP[ \t]+(\d+)", re.IGNORECASE | re.MULTILINE)
END_PATTERN = re.compile(r"^\*\*[ \t]*END[ \t]+OF[ \t]+FILE", re.IGNORECASE | re.MULTILINE)
INVARIANTS = ("Inv3", "Inv4", "Inv8", "Inv5", "Inv9")  # record groups 14 to 18
LUMPED_RTOL = 1e-2  # by which lumped masses may differ from each other, and from the modal mass


def write_mbdyn(body: FlexibleBody, path: str | Path) -> Path:
    """Write the interfaces of a body as nodes, its inertia to second order, and its stiffening.

    The modal joint has to list the nodes in their order here, as stiffening counts them so; give
    it "use invariant 9" where it asks.

    Raises:
        ConfigError: if there is no shape or no interface, or names differ in blanks alone.
    """
    if not body.n_modes or not body.markers:
        both = f"{body.n_modes} shapes and {len(body.markers)} interfaces"
        raise ConfigError(f"body {body.name!r} has {both}; MBDyn needs one of each.")
    labels = ["_".join(name.split()) for name in body.markers]
    if len(set(labels)) < len(labels):
        raise ConfigError(f"interfaces need names that differ in more than blanks, got {labels}.")
    return write_lines(path, _document(body, labels))


def _document(body: FlexibleBody, labels: list[str]) -> Iterator[str]:
    r, points = body.n_modes, np.array([m.point for m in body.markers.values()])
    yield f"** MBDyn MODAL DATA FILE, {ORIGIN_MARK}"
    yield from _group(1, "HEADER")
    yield "**   REVISION, NODES, NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES"
    yield f"      REV0 {len(labels)} {r} 0 0 0"
    yield from _group(2, "FINITE ELEMENT NODE LIST")
    yield " ".join(labels)
    for group, what in ((3, "DISPLACEMENTS"), (4, "VELOCITIES")):
        yield from _group(group, f"INITIAL MODAL {what}", np.zeros((1, r)))
    for axis, letter in enumerate("XYZ"):
        yield from _group(5 + axis, f"NODAL {letter} COORDINATES", points[:, axis, None])
    yield from _group(8, "MODE SHAPES")
    for k in range(r):
        yield f"**    NORMAL MODE SHAPE #  {k + 1}"
        for m in body.markers.values():
            yield numbers_line(np.r_[m.translation[:, k], m.rotation[:, k]])
    yield from _group(9, "MODAL MASS MATRIX", body.M)
    yield from _group(10, "MODAL STIFFNESS MATRIX", body.K)
    centre = body.first_moment / body.mass
    about = body.inertia - body.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    yield from _group(12, "RIGID BODY INERTIA MATRIX", [[body.mass], centre, *about])
    yield from _group(13, "MODAL DAMPING MATRIX", body.D)
    for group, (name, A) in enumerate(invariants(body).items(), 14):
        yield from _group(group, f"INVARIANT {name[3:]}", A.reshape(3, -1))
    if body.K_geo:
        yield from _stiffening(body)


def _stiffening(body: FlexibleBody) -> Iterator[str]:
    loads = enumerate(known_loads(body)[: -body.n_modes], 1)  # without those of shapes
    taken = {k: body.K_geo[load] for k, load in loads if load in body.K_geo}
    yield from _group(19, "MODAL STRESS STIFFENING MATRIX")
    yield f"{len(taken)}"
    for load, A in taken.items():
        yield f"{load}"
        yield from map(numbers_line, A)


def _group(group: int, title: str, rows: Iterable[Iterable[float]] = ()) -> Iterator[str]:
    yield "**"
    yield f"** RECORD GROUP {group}, {title}"
    yield from map(numbers_line, rows)


def read_mbdyn(path: str | Path) -> FlexibleBody:
    """Read the data of a modal joint, whose nodes become interfaces; see `rom.io.read_body`.

    Without invariants, they are those of lumped masses; without these as well, shapes have no
    momentum. Inertia as a whole is that of record group 12, of the shapes that of 9.
    """
    check_last_line(path := check_readable(path, MAX_BYTES))
    with in_file(path), damaged("this is no modal data file of MBDyn", path):
        words = _words(path.read_text(encoding="latin1"))
        found = _numbers(words, path.stat().st_size)
        moves = zip(words[2], found[5], found[8].transpose(1, 2, 0), strict=True)
        nodes = {label: (x, A[:3], A[3:]) for label, x, A in moves}
        K, M, origin = found[10], found[9], {"from": path.name}
        matrices = K, found.get(13, np.zeros_like(K)), M
        body = body_of(path.stem, *_inertia(found), *matrices, nodes=nodes, provenance=origin)
        if any(found[k].any() for k in (3, 4) if k in found):
            warn(f"{path}: amplitudes at the start are left out.")
        return replace(body, K_geo=_stiffness(body, found[19])) if 19 in found else body


def _words(text: str) -> dict[int, list[str]]:
    """{record group: its words}; the line behind the head of the first is a comment."""
    _, *parts = GROUP_PATTERN.split(END_PATTERN.split(text)[0])
    found = dict[int, list[str]]()
    for group, part in zip(map(int, parts[::2]), parts[1::2], strict=True):
        need(group not in found and 1 <= group <= 19, f"record group {group} is twice or unknown")
        lines = part.splitlines()[2 if group == 1 else 1 :]
        found[group] = [w for line in lines if not line.startswith("**") for w in line.split()]
    missing = {1, 2, *range(5, 11)} - set(found)
    need(not missing, f"it lacks the record groups {named(sorted(missing))}")
    return found


def _numbers(words: dict[int, list[str]], n_bytes: int) -> dict[int, Array]:
    """{record group from 3: its numbers}, points of the nodes (n, 3) as the fifth."""
    n, *several, rejected = (whole(word) for word in words[1][1:])
    r = sum(several) - rejected
    counts = len(several) == 3 and min(*several, rejected) >= 0 and min(n, r) > 0
    need(counts, f"{' '.join(words[1])!r:.80} does not count nodes and modes")
    if r > MOST_MODES or 12 * n * r > n_bytes:
        raise UnsafeFileError(f"{n} nodes and {r} modes do not fit the file.")
    need(len(words[2]) == len(set(words[2])) == n, f"record group 2 is no list of {n} labels")
    k = whole(words[19].pop(0)) if 19 in words else 0
    shapes = {3: (r,), 4: (r,), 5: (n,), 6: (n,), 7: (n,), 8: (rejected + r, n, 6), 9: (r, r),
              10: (r, r), 11: (n, 6), 12: (13,), 13: (r, r), 14: (3, r), 15: (3, r), 16: (3, r, 3),
              17: (3, r, r), 18: (3, r, r, 3), 19: (k, 1 + r * r)}  # fmt: skip
    found = dict[int, Array]()
    for group in words.keys() & shapes.keys():
        values, wanted = [number(word) for word in words[group]], math.prod(shapes[group])
        fits = len(values) >= wanted and not any(values[wanted:])  # those of NASTRAN end in zeros
        need(fits, f"record group {group} has {len(values)} numbers, not {wanted}")
        found[group] = np.reshape(values[:wanted], shapes[group])
    return found | {5: np.column_stack([found[k] for k in (5, 6, 7)]), 8: found[8][rejected:]}


def _inertia(found: dict[int, Array]) -> tuple[Rigid, dict[str, Array]]:
    """Mass, first moment, inertia; and invariants."""
    known = {name: found[group] for group, name in enumerate(INVARIANTS, 14) if group in found}
    lacking = ", ".join(name for name in ("Inv3", "Inv8", "Inv9") if name not in known)
    need(11 in found or 12 in found, "neither record group 11 nor 12 says the mass of the body")
    need(11 not in found or not known, "it has lumped masses and invariants of others")
    if 11 in found:
        (m, J), (shapes, turns) = np.split(found[11], 2, axis=1), np.split(found[8], 2, axis=2)
        alike = found[11].min() >= 0 and np.ptp(m, axis=1).max() <= LUMPED_RTOL * m.max()
        need(alike, "lumped masses must be positive, and the same along x, y and z")
        part = point_integrals(found[5], m[:, 0], shapes.reshape(len(shapes), -1).T)
        known = invariants(part)
        known["Inv4"] += np.einsum("na,kna->ak", J, turns)
        rigid = part.mass, part.first_moment, part.inertia + np.diag(J.sum(axis=0))
        M = np.einsum("aakl->kl", part.S_kl) + np.einsum("na,kna,lna->kl", J, turns, turns)
        if (gap := np.abs(M - found[9]).max()) > LUMPED_RTOL * np.abs(M).max():
            warn(f"lumped masses give shapes another mass than record group 9, by {gap:.3g}.")
    elif lacking:
        warn(f"the file has no {lacking}; inertia that they would say is left out.")
    if 12 in found:
        mass, (c, *about) = float(found[12][0]), found[12][1:].reshape(4, 3)
        rigid = mass, mass * c, np.array(about) + mass * (c @ c * np.eye(3) - np.outer(c, c))
    return rigid, known


def _stiffness(body: FlexibleBody, table: Array) -> dict[str, Array]:
    """Geometric stiffness of rows (k, 1 + r r) that begin with the number of a load."""
    loads, numbers = known_loads(body)[: -body.n_modes], set(table[:, 0])
    once = numbers <= set(range(1, len(loads) + 1)) and len(numbers) == len(table)
    need(once, f"record group 19 is not of loads 1 to {len(loads)}, each once")
    K = {loads[int(row[0]) - 1]: row[1:].reshape(body.K.shape) for row in table}
    for load, A in K.items():
        symmetric(f"the geometric stiffness {load!r}", A, UNEVEN_RTOL)
    return {load: 0.5 * (A + A.T) for load, A in K.items()}
