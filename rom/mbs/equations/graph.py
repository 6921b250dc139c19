"""The graph of a mechanism: storage of its blocks, and the choice of how its equations are solved.

Whole matrices are quicker for a few bodies.

Bodies hang in trees whose roots are bodies joined to the ground. Of those whose outer bodies are
gone, the one coupled to the fewest unknowns is next, the outermost of equals, and the joint towards
its root follows it: a tree then gets no new couplings. The other joints close loops. Each waits for
the body in which its loop comes together, or for the roots of all trees it connects: until then its
multipliers are not determined.
"""

import heapq
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rom.mbs.elements.family import integers, starts
from rom.mbs.kernels.system import Graph, Plan, System
from rom.model import Index

# operations of a whole factorisation over those by blocks, from which blocks are quicker: measured
# on chains of rigid and flexible links
BLOCK_GAIN = 4.0


class Group(NamedTuple):
    """Constraint rows of one joint, the bodies they move, and whether all are couplings."""

    rows: tuple[int, ...]
    bodies: tuple[int, ...]
    couples: bool


def forest(groups: list[Group], n_bodies: int) -> tuple[list[int], list[int], list[int]]:
    """Trees along joints of two bodies, breadth first, from all bodies joined to the ground.

    Of each body the one towards the root, -1 for roots, the group towards the root or the ground,
    -1 for a free root, and how many bodies lie on the way to the root.
    """
    parent, joint, depth = [-1] * n_bodies, [-1] * n_bodies, [0] * n_bodies
    edges: list[list[tuple[int, int]]] = [[] for _ in range(n_bodies)]
    grounded: dict[int, int] = {}
    for g, group in enumerate(groups):
        if group.rows and not group.couples:
            for a, b in zip(group.bodies, reversed(group.bodies), strict=True):
                edges[a].append((b, g))
            if len(group.bodies) == 1:
                grounded.setdefault(group.bodies[0], g)
    for b, g in grounded.items():
        joint[b] = g
    reached: set[int] = set()
    for roots in (list(grounded), *([b] for b in range(n_bodies))):
        queue = [b for b in roots if b not in reached]
        reached.update(queue)
        for a in queue:
            for b, g in edges[a]:
                if b not in reached:
                    reached.add(b)
                    parent[b], joint[b], depth[b] = a, g, depth[a] + 1
                    queue.append(b)
    return parent, joint, depth


class Ordering:
    """Elimination on paper: which nodes each one is coupled to when its turn comes.

    Nodes are bodies, then groups of constraint rows; ``size`` counts their unknowns, and ``cost``
    the multiplications and additions of a factorisation.
    """

    def __init__(self, width: Index, neighbours: list[list[int]], groups: list[Group]):
        self.size = [*map(int, width), *(len(group.rows) for group in groups)]
        self.groups = groups
        self.parent, self.joint, self.depth = forest(groups, len(width))
        self.sequence: list[int] = []
        self.later: dict[int, set[int]] = {}
        self.cost, self.n = 0.0, len(neighbours)
        self.coupled = [set(others) - {b} for b, others in enumerate(neighbours)]
        self.coupled += [set(group.bodies) for group in groups]
        for g, group in enumerate(groups):
            for b in group.bodies:
                self.coupled[b].add(self.n + g)

    def run(self, limit: float) -> bool:
        """Eliminate all nodes; False as soon as that costs more than the limit."""
        children = Counter(self.parent)  # {body: how many hang on it}
        self.waiting, self.waits = self._loops()
        queue = [self._turn(b) for b in range(self.n) if not children[b]]
        heapq.heapify(queue)
        while queue:
            turn = heapq.heappop(queue)
            b = turn[-1]
            if turn < self._turn(b):  # others have coupled it to more since
                heapq.heappush(queue, self._turn(b))
                continue
            self._eliminate_with_joints(b)
            if self.cost > limit:
                return False
            parent = self.parent[b]
            if parent >= 0:
                children[parent] -= 1
                if not children[parent]:
                    heapq.heappush(queue, self._turn(parent))
        return True

    def _eliminate_with_joints(self, b: int) -> None:
        """A body, the joint towards its root, and the loops that come together in it."""
        self._eliminate(b)
        if self.joint[b] >= 0:
            self._eliminate(self.n + self.joint[b])
        for g in self.waiting.get(b, ()):
            self.waits[g] -= 1
            if not self.waits[g]:
                self._eliminate(self.n + g)

    def _eliminate(self, node: int) -> None:
        others = self.coupled[node]
        for other in others:
            self.coupled[other] |= others
            self.coupled[other] -= {node, other}
        self.sequence.append(node)
        self.later[node] = others
        d, c = self.size[node], sum(self.size[other] for other in others)
        self.cost += 2 / 3 * d**3 + 2 * d * d * c + 2 * d * c * c

    def _turn(self, b: int) -> tuple[int, int, int]:
        """What decides who is next: unknowns coupled to a body, then how far out it is."""
        return sum(self.size[other] for other in self.coupled[b]), -self.depth[b], b

    def _loops(self) -> tuple[dict[int, list[int]], dict[int, int]]:
        """Groups that wait for each body, and for how many bodies each group waits."""
        in_trees, waits = set(self.joint), {}
        waiting: dict[int, list[int]] = {}
        for g, group in enumerate(self.groups):
            if not group.rows or g in in_trees:
                continue
            tops = self._tops(group.bodies)
            waits[g] = len(tops)
            for b in tops:
                waiting.setdefault(b, []).append(g)
        return waiting, waits

    def _tops(self, bodies: tuple[int, ...]) -> set[int]:
        """Where paths from the bodies towards the ground meet, or the roots of different trees."""
        tops, parent = set(bodies), self.parent
        while len(tops) > 1:
            low = max(tops, key=lambda b: self.depth[b])
            if parent[low] < 0:
                return tops
            tops = (tops - {low}) | {parent[low]}
        return tops


def graph_of(system: System, coupled: Sequence[Sequence[int]], *, whole: bool = False) -> Graph:
    """Storage and elimination plan of a system whose other arrays are complete.

    ``coupled`` are groups of bodies that elements couple; ``whole`` stores whole matrices anyhow.
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
    joints = starts([len(r) for r in rows]), integers([k for r in rows for k in r])
    stored = first, other, x, y, own, touched, at
    return Graph(int(compact), 0, *stored, *joints, plan or NO_PLAN)


def _neighbours(system: System, coupled: Sequence[Sequence[int]]) -> list[list[int]]:
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


def _groups(system: System) -> list[Group]:
    """Constraint rows and moved bodies of each joint, its drives included."""
    R = system.rows
    rows: list[list[int]] = [[] for _ in R.joint_i]
    for k, joint in enumerate(R.pair):
        rows[joint].append(k)
    found = []
    for mine in rows:
        bodies = dict.fromkeys(b for k in mine for b in _bodies_of(system, k))
        found.append(Group(tuple(mine), tuple(bodies), bool((R.at[mine, 0] >= 0).all())))
    return found


def _bodies_of(system: System, row: int) -> list[int]:
    """Different bodies that a constraint row moves."""
    rows, body = system.rows, system.markers.body
    markers = [m[row] for m in (rows.i, rows.j, rows.k, rows.l) if m[row] >= 0]
    return list(dict.fromkeys(int(body[m]) for m in markers if body[m] >= 0))


def _touched(system: System, compact: bool) -> tuple[Index, Index]:
    """(m, 4) bodies that each row moves and their first columns in Work.G, padded with -1."""
    bodies, m = system.bodies, system.rows.kind.size
    body, at = np.full((m, 4), -1, dtype=np.int64), np.full((m, 4), -1, dtype=np.int64)
    for k in range(m):
        moved = _bodies_of(system, k)
        body[k, : len(moved)] = moved
        own = starts(6 + bodies.r[moved])[:-1] if compact else bodies.v_at[moved]
        at[k, : len(moved)] = own
    return body, at


def _plan(system: System, neighbours: list[list[int]], groups: list[Group]) -> Plan | None:
    """The elimination plan, or None if whole matrices are quicker."""
    ordering = Ordering(6 + system.bodies.r, neighbours, groups)
    limit = 2 / 3 * sum(ordering.size) ** 3 / BLOCK_GAIN
    return _tables(system, ordering, neighbours) if ordering.run(limit) else None


def _tables(system: System, ordering: Ordering, neighbours: list[list[int]]) -> Plan:
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
    for g, group in enumerate(ordering.groups):
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


def elimination_order(system: System, coupled: Sequence[Sequence[int]]) -> list[Index]:
    """Unknowns of each body and each joint, rows of constraints after all velocities, in turn."""
    neighbours, groups = _neighbours(system, coupled), _groups(system)
    width, v_at = 6 + system.bodies.r, system.bodies.v_at
    ordering = Ordering(width, neighbours, groups)
    ordering.run(np.inf)
    n, total = len(width), int(width.sum())
    found = [
        v_at[node] + np.arange(width[node]) if node < n else total + integers(groups[node - n].rows)
        for node in ordering.sequence
    ]
    return [unknowns for unknowns in found if unknowns.size]


def _columns(pairs: list[tuple[int, int]]) -> Index:
    """Two vectors from a list of pairs of numbers."""
    return np.ascontiguousarray(np.array(pairs, dtype=np.int64).reshape(-1, 2).T)


NO_PLAN = Plan(
    *(np.zeros(0, dtype=np.int64) for _ in range(16)),
    *(np.zeros((0, 4), dtype=np.int64) for _ in range(3)),
    np.zeros(1, dtype=np.int64),
)
