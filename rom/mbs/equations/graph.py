"""The graph of a mechanism: storage of its blocks, and the choice of how its equations are solved.

Whole matrices are quicker for a few bodies.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rom.mbs.elements.family import integers, starts
from rom.mbs.equations.ordering import Group, Ordering, forest
from rom.mbs.kernels.plan import Graph, Plan
from rom.model import Index

# operations of a whole factorisation over those by blocks, from which blocks are quicker: measured
# on chains of rigid and flexible links
BLOCK_GAIN = 4.0


def graph_of(system: Any, coupled: Sequence[Any], *, whole: bool = False) -> Graph:
    """Storage and elimination plan of a mechanism whose other arrays are complete.

    Args:
        system: the arrays of the mechanism.
        coupled: groups of bodies that elements couple.
        whole: store whole matrices whatever they cost.
    """
    neighbours, groups = _neighbours(system, coupled), _groups(system)
    plan = None if whole else _plan(system, neighbours, groups)
    compact = plan is not None
    width, bodies = 6 + system.bodies.r, system.bodies
    first = starts([len(others) for others in neighbours])
    other = integers([c for others in neighbours for c in others])
    body = np.repeat(np.arange(width.size), np.diff(first))
    x, y = bodies.v_at[body], bodies.v_at[other]
    if compact:
        x, y = starts(width[body])[:-1], np.zeros_like(other)
    own = integers([first[b] + others.index(b) for b, others in enumerate(neighbours)])
    touched, at = _touched(system, compact)
    rows = [group.rows for group in groups]
    return Graph(
        int(compact), 0, *(first, other, x, y, own, touched, at),
        starts([len(r) for r in rows]), integers([k for r in rows for k in r]),
        plan or NO_PLAN,
    )  # fmt: skip


def _neighbours(system: Any, coupled: Sequence[Any]) -> list[list[int]]:
    """Bodies that each body is coupled to by the stiffness of joints and forces, and itself."""
    found: list[set[int]] = [{b} for b in range(system.bodies.mass.size)]
    body, rows, C = system.markers.body, system.rows, system.coordinates
    sides = ((rows.i, rows.j), (rows.joint_i, rows.joint_j), (C.i, C.j))
    pairs = [group for i, j in sides for group in zip(body[i], body[j], strict=True)]
    for group in (*pairs, *coupled):
        moved = {int(b) for b in group if b >= 0}
        for b in moved:
            found[b] |= moved
    return [sorted(others) for others in found]


def _groups(system: Any) -> list[Group]:
    """Constraint rows and moved bodies of each joint, its drives included."""
    R = system.rows
    rows: list[list[int]] = [[] for _ in R.joint_i]
    for k, joint in enumerate(R.pair):
        rows[joint].append(k)
    return [
        Group(tuple(mine), tuple(dict.fromkeys(b for k in mine for b in _bodies_of(system, k))),
              bool((R.at[mine, 0] >= 0).all()))
        for mine in rows
    ]  # fmt: skip


def _bodies_of(system: Any, row: int) -> list[int]:
    """Different bodies that a constraint row moves."""
    rows, body = system.rows, system.markers.body
    markers = [m[row] for m in (rows.i, rows.j, rows.k, rows.l) if m[row] >= 0]
    return list(dict.fromkeys(int(body[m]) for m in markers if body[m] >= 0))


def _touched(system: Any, compact: bool) -> tuple[Index, Index]:
    """(m, 4) bodies that each row moves and their first columns in Work.G, padded with -1."""
    bodies, m = system.bodies, system.rows.kind.size
    body, at = np.full((m, 4), -1, dtype=np.int64), np.full((m, 4), -1, dtype=np.int64)
    for k in range(m):
        moved = _bodies_of(system, k)
        body[k, : len(moved)] = moved
        own = starts(6 + bodies.r[moved])[:-1] if compact else bodies.v_at[moved]
        at[k, : len(moved)] = own
    return body, at


def _plan(system: Any, neighbours: list[list[int]], groups: list[Group]) -> Plan | None:
    """The elimination plan, or None if whole matrices are quicker."""
    width = 6 + system.bodies.r
    size = [*map(int, width), *(len(group.rows) for group in groups)]
    total = sum(size)
    limit = 2 / 3 * total**3 / BLOCK_GAIN
    ordering = Ordering(size, neighbours, groups, forest(groups, len(width)))
    if not ordering.run(limit):
        return None
    return _tables(system, ordering, neighbours, groups)


def _tables(
    system: Any, ordering: Ordering, neighbours: list[list[int]], groups: list[Group]
) -> Plan:
    """Where everything is in the factor."""
    sequence, n_bodies = ordering.sequence, len(neighbours)
    place = {node: k for k, node in enumerate(sequence)}
    later = [sorted(place[other] for other in ordering.later[node]) for node in sequence]
    d = np.array([ordering.size[node] for node in sequence], dtype=np.int64)
    shift = [starts(d[others]) for others in later]
    c = np.array([s[-1] for s in shift], dtype=np.int64)
    begin = starts(d * d + 2 * d * c)
    pivot, right = begin[:-1], begin[:-1] + d * d
    below = right + d * c
    column = [dict(zip(o, s, strict=False)) for o, s in zip(later, shift, strict=True)]

    def where(p: int, q: int) -> tuple[int, int]:
        """First entry and row distance of the block of the nodes at places p and q."""
        if p == q:
            return pivot[p], d[p]
        if p < q:
            return right[p] + column[p][q], c[p]
        return below[q] + column[q][p] * d[q], d[q]

    pairs = [where(p, q) for others in later for p in others for q in others]
    blocks = [where(place[b], place[o]) for b, others in enumerate(neighbours) for o in others]
    start = starts(d)
    width, v_at = 6 + system.bodies.r, system.bodies.v_at
    m, n = system.rows.kind.size, int(width.sum())
    position = np.zeros(n + m, dtype=np.int64)
    for b in range(n_bodies):
        position[v_at[b] + np.arange(width[b])] = start[place[b]] + np.arange(width[b])
    row_to, back, stride = (np.zeros((m, 4), dtype=np.int64) for _ in range(3))
    corner = np.zeros(m, dtype=np.int64)
    for g, group in enumerate(groups):
        mine = place[n_bodies + g] if group.rows else -1
        for i, k in enumerate(group.rows):
            position[n + k] = start[mine] + i
            corner[k] = pivot[mine] + i * (d[mine] + 1)
            for side, b in enumerate(_bodies_of(system, k)):
                to, apart = where(mine, place[b])
                row_to[k, side] = to + i * apart
                to, stride[k, side] = where(place[b], mine)
                back[k, side] = to + i
    return Plan(
        *(position, d, c, start[:-1], pivot, right, below),
        *(starts([len(o) for o in later]), integers([q for o in later for q in o])),
        integers([x for s in shift for x in s[:-1]]),
        *(starts([len(o) ** 2 for o in later])[:-1], *_columns(pairs), *_columns(blocks)),
        *(corner, row_to, back, stride, begin[-1:]),
    )


def elimination_order(system: Any, coupled: Sequence[Any]) -> list[Index]:
    """Unknowns of each body and each joint, rows of constraints after all velocities, in turn."""
    neighbours, groups = _neighbours(system, coupled), _groups(system)
    width, v_at = 6 + system.bodies.r, system.bodies.v_at
    size = [*map(int, width), *(len(group.rows) for group in groups)]
    ordering = Ordering(size, neighbours, groups, forest(groups, len(width)))
    ordering.run(np.inf)
    n, total = len(width), int(width.sum())
    found = [
        v_at[node] + np.arange(width[node]) if node < n else total + integers(groups[node - n].rows)
        for node in ordering.sequence
    ]
    return [unknowns for unknowns in found if unknowns.size]


def _columns(pairs: list[tuple[int, int]]) -> Any:
    """Two vectors from a list of pairs of numbers."""
    return np.ascontiguousarray(np.array(pairs, dtype=np.int64).reshape(-1, 2).T)


NO_PLAN = Plan(
    *(np.zeros(0, dtype=np.int64) for _ in range(16)),
    *(np.zeros((0, 4), dtype=np.int64) for _ in range(3)),
    np.zeros(1, dtype=np.int64),
)
