"""A body as data for the joint "modal" of MBDyn (``.fem``).

Record groups: 1 header, 2 labels of the nodes, 3 and 4 start, 5 to 7 positions, 8 shapes (six
numbers for each node), 9 mass, 10 stiffness, 12 rigid inertia about the mass centre, 13 damping;
14 to 18 inertia invariants, row by row, with x~ the matrix of the cross product::

    Inv3 int phi_k    Inv4 int x x phi_k    Inv8 -int x~ phi~_j    Inv5 int phi_j x phi_k
    Inv9 int phi~_j phi~_k

and 19 stress stiffening per unit of xx, yy, zz, xy, yz, zx of angular velocities (1 to 6), angular
acceleration (7 to 9), acceleration (10 to 12), then force and moment on each node.

Source:
    MBDyn input manual, joint "modal", and what its reader of these groups stores where.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rom.body.flexible import FlexibleBody
from rom.body.stiffening import ELASTIC_LOAD, known_loads
from rom.errors import ConfigError
from rom.io.files import numbers_line, write_lines
from rom.io.sid.body import invariants
from rom.model import Array
from rom.names import ORIGIN_MARK


def write_mbdyn(body: FlexibleBody, path: str | Path) -> Path:
    """Write the interfaces of a body as nodes, its inertia to second order, and its stiffening.

    The modal joint has to list the nodes in their order here, as stiffening counts them so; give
    it "use invariant 9" where it asks.

    Args:
        body: with at least one shape and one interface.
        path: file, usually ending in ``.fem``.

    Raises:
        ConfigError: if there is no shape or no interface, names become equal without their
            blanks, or the place is not writable.
        ResourceError: if the disk is full.
    """
    if not body.n_modes or not body.markers:
        raise ConfigError(
            f"body {body.name!r} has {body.n_modes} shapes and {len(body.markers)} interfaces; "
            "MBDyn needs one of each."
        )
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
    for number, what in ((3, "DISPLACEMENTS"), (4, "VELOCITIES")):
        yield from _group(number, f"INITIAL MODAL {what}")
        yield numbers_line(np.zeros(r))
    for axis, letter in enumerate("XYZ"):
        yield from _group(5 + axis, f"NODAL {letter} COORDINATES")
        yield from map(numbers_line, points[:, axis, None])
    yield from _group(8, "MODE SHAPES")
    for k in range(r):
        yield f"**    NORMAL MODE SHAPE #  {k + 1}"
        for m in body.markers.values():
            yield numbers_line(np.r_[m.translation[:, k], m.rotation[:, k]])
    yield from _group(9, "MODAL MASS MATRIX", body.M)
    yield from _group(10, "MODAL STIFFNESS MATRIX", body.K)
    centre = body.first_moment / body.mass
    about = body.inertia - body.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    yield from _group(12, "RIGID BODY INERTIA MATRIX")
    yield numbers_line([body.mass])
    yield from map(numbers_line, [centre, *about])
    yield from _group(13, "MODAL DAMPING MATRIX", body.D)
    for number, (name, A) in enumerate(invariants(body).items(), 14):
        yield from _group(number, f"INVARIANT {name[3:]}", A.reshape(3, -1))
    if body.K_geo:
        yield from _stiffening(body)


def _stiffening(body: FlexibleBody) -> Iterator[str]:
    own = {load: k for k, load in enumerate(known_loads(body), 1)}
    taken = [load for load in body.K_geo if not load.startswith(ELASTIC_LOAD)]
    yield from _group(19, "MODAL STRESS STIFFENING MATRIX")
    yield f"{len(taken)}"
    for load in taken:
        yield f"{own[load]}"
        yield from map(numbers_line, body.K_geo[load])


def _group(number: int, title: str, rows: Array | None = None) -> Iterator[str]:
    yield "**"
    yield f"** RECORD GROUP {number}, {title}"
    if rows is not None:
        yield from map(numbers_line, rows)
