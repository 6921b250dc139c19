"""In which order bodies and joints are eliminated.

Bodies hang in trees whose roots are bodies joined to the ground. Of those whose outer bodies are
gone, the one coupled to the fewest unknowns is next, the outermost of equals, and the joint towards
its root follows it: a tree then gets no new couplings. The other joints close loops. Each waits for
the body in which its loop comes together, or for the roots of all trees it connects: until then its
multipliers are not determined.
"""

import heapq
from typing import NamedTuple


class Group(NamedTuple):
    """Constraint rows of one joint, the bodies they move, and whether all are couplings."""

    rows: tuple[int, ...]
    bodies: tuple[int, ...]
    couples: bool


class Forest(NamedTuple):
    """Trees of bodies.

    Attributes:
        parent: body towards the root, -1 for roots.
        joint: group towards the root or the ground, -1 for a free root.
    """

    parent: list[int]
    joint: list[int]


def forest(groups: list[Group], n_bodies: int) -> Forest:
    """Trees along joints of two bodies, breadth first, from all bodies joined to the ground."""
    parent, joint = [-1] * n_bodies, [-1] * n_bodies
    edges: list[list[tuple[int, int]]] = [[] for _ in range(n_bodies)]
    for g, group in enumerate(groups):
        if group.rows and not group.couples:
            for a, b in zip(group.bodies, reversed(group.bodies), strict=True):
                edges[a].append((b, g))
    grounded: dict[int, int] = {}
    for g, group in enumerate(groups):
        if group.rows and not group.couples and len(group.bodies) == 1:
            grounded.setdefault(group.bodies[0], g)
    for b, g in grounded.items():
        joint[b] = g
    reached: set[int] = set()
    for starts in (list(grounded), *([b] for b in range(n_bodies))):
        queue = [b for b in starts if b not in reached]
        reached.update(queue)
        for a in queue:
            for b, g in edges[a]:
                if b not in reached:
                    reached.add(b)
                    parent[b], joint[b] = a, g
                    queue.append(b)
    return Forest(parent, joint)


class Ordering:
    """Elimination on paper: which nodes each one is coupled to when its turn comes.

    Attributes:
        size: unknowns of each node: bodies, then groups of constraint rows.
        sequence: nodes in the order of elimination.
        later: nodes coupled to each node when it goes.
        cost: multiplications and additions of a factorisation.
    """

    def __init__(
        self, size: list[int], neighbours: list[list[int]], groups: list[Group], trees: Forest
    ):
        self.size, self.groups, self.trees = size, groups, trees
        self.sequence: list[int] = []
        self.later: dict[int, set[int]] = {}
        self.cost, self.n = 0.0, len(neighbours)
        self.depth = self._depths()
        self.coupled = [set(others) - {b} for b, others in enumerate(neighbours)]
        self.coupled += [set(group.bodies) for group in groups]
        for g, group in enumerate(groups):
            for b in group.bodies:
                self.coupled[b].add(self.n + g)

    def run(self, limit: float) -> bool:
        """Eliminate all nodes; False as soon as that costs more than the limit."""
        children = [0] * self.n
        for p in self.trees.parent:
            if p >= 0:
                children[p] += 1
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
            parent = self.trees.parent[b]
            if parent >= 0:
                children[parent] -= 1
                if not children[parent]:
                    heapq.heappush(queue, self._turn(parent))
        return True

    def _eliminate_with_joints(self, b: int) -> None:
        """A body, the joint towards its root, and the loops that come together in it."""
        self._eliminate(b)
        if self.trees.joint[b] >= 0:
            self._eliminate(self.n + self.trees.joint[b])
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
        in_trees, waits = set(self.trees.joint), {}
        waiting: dict[int, list[int]] = {}
        for g, group in enumerate(self.groups):
            if not group.rows or g in in_trees:
                continue
            tops = self._tops(group.bodies)
            waits[g] = len(tops)
            for b in tops:
                waiting.setdefault(b, []).append(g)
        return waiting, waits

    def _depths(self) -> list[int]:
        depth = [-1] * self.n
        for b in range(self.n):
            path = [b]
            while depth[path[-1]] < 0 and self.trees.parent[path[-1]] >= 0:
                path.append(self.trees.parent[path[-1]])
            top = max(depth[path[-1]], 0)
            for up, node in enumerate(reversed(path)):
                depth[node] = top + up
        return depth

    def _tops(self, bodies: tuple[int, ...]) -> set[int]:
        """Where paths from the bodies towards the ground meet, or the roots of different trees."""
        tops, parent = set(bodies), self.trees.parent
        while len(tops) > 1:
            low = max(tops, key=lambda b: self.depth[b])
            if parent[low] < 0:
                return tops
            tops = (tops - {low}) | {parent[low]}
        return tops
