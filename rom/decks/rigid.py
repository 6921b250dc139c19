"""Point masses, springs and rigid elements of decks, and what they make of a solid.

Both dialects come to the same records. What hangs on a reference node becomes a rigid body that an
interface carries; the interface is made of the nodes of the solid that a rigid element ties.
Springs act between two such interfaces, or nodes of the solid.
"""

from collections.abc import Callable, Iterable, Set
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from rom.decks.lines import Place, at
from rom.errors import FileFormatError
from rom.model import Array, moved_rigidly

DISPLACED, ALL = set("123"), set("123456")
RIGID_KIND, AVERAGE_KIND, LOOSE_KIND = "rbe2", "rbe3", ""
ASKEW_RTOL = 1e-6  # angle between two directions that are meant to be one
APART_RTOL = 1e-9  # of their coordinates, up to which two nodes lie in one place


@dataclass(frozen=True, eq=False)
class Element:
    """Anything that hangs on a node: its name, as "RBE2 7", where it stands, and the node."""

    name: str
    place: Place
    node: int

    def wrong(self, why: str, hint: str = "") -> FileFormatError:
        """The error of this element."""
        return FileFormatError(f"{self.name}: {why}.", where=at(self.place), hint=hint)


@dataclass(frozen=True, eq=False)
class PointMass(Element):
    """A rigid body that hangs on a node."""

    mass: float
    offset: Array  # (3,) of its mass centre from the node, basic axes
    inertia: Array  # (3, 3) about its mass centre, basic axes


@dataclass(frozen=True, eq=False)
class Rigid(Element):
    """Nodes that move with a reference node as one rigid piece."""

    nodes: list[int]
    turning: bool  # whether they turn with it as well; nodes of solids never turn


@dataclass(frozen=True, eq=False)
class Average(Element):
    """A reference node that follows the mean motion of nodes, which stay free."""

    weights: dict[int, float]  # by node
    of_area: bool = False  # each node with its area of the surface of this name


@dataclass(frozen=True, eq=False)
class Spring(Element):
    """Stiffness (m,) between the motions of two nodes.

    It is stretched by (m, 12) times displacements and rotations, basic axes, of one and the other.
    """

    other: int
    stiffness: Array
    stretch: Array

    @classmethod
    def scalar(cls, named: tuple[str, Place], k: float, *ends: tuple[int, int, Array]) -> "Spring":
        """One between components of two nodes: number, 1 to 6 and direction (3,) of each."""
        rows = [np.kron([i <= 3, 3 < i <= 6], d) for _, i, d in ends]
        a, b = (node * (component > 0) for node, component, _ in ends)
        return cls(*named, a, b, np.array([k]), np.hstack([-rows[0], rows[1]])[None])


@dataclass(frozen=True)
class Hung:
    """What the elements of a deck make of the nodes of its solid, in what fits into JSON."""

    solid: Set[int]
    x: Callable[[int], Array]  # (3,) position of any node
    # {interface: kind, points (k, 3), weights (k,), origin (3,)}
    ties: dict[str, dict[str, Any]] = field(default_factory=dict)
    carried: list[dict[str, Any]] = field(default_factory=list)  # as `rom.Attachment`
    # name, ends, stiffness (12, 12) of the motions at their origins
    springs: list[dict[str, Any]] = field(default_factory=list)
    nodes: set[int] = field(default_factory=set)  # that are of use without an element
    turning: dict[int, str] = field(default_factory=dict)  # {node that turns: its interface}

    def tie(self, element: Element, kind: str, weights: dict[int, float], origin: int) -> None:
        """Make an interface of nodes."""
        if element.name in self.ties:
            raise element.wrong("another has this name")
        self.ties[element.name] = {
            "kind": kind,
            "points": [self.x(node).tolist() for node in weights],
            "weights": list(weights.values()),
            "origin": self.x(origin).tolist(),
        }


def hung(elements: Iterable[Element], solid: Set[int], x: Callable[[int], Array]) -> Hung:
    """Ties between nodes of a solid, by the positions (3,) of all nodes, and what they carry.

    Rigid elements that share a reference node, or of which one leads the other, are one tie, with
    the name of the first.

    Raises:
        FileFormatError: naming the element: nodes that depend twice, circles, hinges, masses that
            hang on nothing, negative ones, inertia without mass, springs that resist rigid motion.
    """
    elements, found = list(elements), Hung(solid, x)
    turning, rigid = found.turning, [e for e in elements if isinstance(e, Rigid)]
    for lead, parts in _pieces(rigid).items():
        followers = {node for part in parts for node in (part.node, *part.nodes)}
        tied = sorted(followers & solid)
        if not tied:
            raise parts[0].wrong("none of its nodes belongs to the solid")
        found.tie(parts[0], RIGID_KIND, dict.fromkeys(tied, 1.0), lead)
        led = {node for part in parts if part.turning for node in part.nodes if node not in solid}
        turning.update(dict.fromkeys({lead, *led}, parts[0].name))
        found.nodes.update(followers)
    dependent = {node for part in rigid for node in part.nodes}
    for one in (e for e in elements if isinstance(e, Average)):
        if one.node in solid | turning.keys() | dependent:
            raise one.wrong(f"its reference node {one.node} moves with something else as well")
        if strange := sorted(one.weights.keys() - solid):
            raise one.wrong(f"its node {strange[0]} does not belong to the solid")
        found.tie(one, AVERAGE_KIND, one.weights, one.node)
        found.ties[one.name] |= {"of area": True} if one.of_area else {}
        turning[one.node] = one.name
        found.nodes.add(one.node)
    masses: dict[int, list[PointMass]] = {}
    for mass in (e for e in elements if isinstance(e, PointMass)):
        masses.setdefault(mass.node, []).append(mass)
    for node, some in masses.items():
        found.nodes.add(node)
        if (body := _as_one(some, x(node))) is None:
            continue
        if node not in turning:
            _check_plain(some, node, solid)
            found.tie(some[0], LOOSE_KIND, {node: 1.0}, node)
        found.carried.append({"interface": turning.get(node, some[0].name)} | body)
    for spring in (e for e in elements if isinstance(e, Spring)):
        _spring(found, spring)
    return found


def _pieces(rigid: list[Rigid]) -> dict[int, list[Rigid]]:
    """Rigid elements by the node that leads all of them."""
    leaders: dict[int, Rigid] = {}
    for one in rigid:
        for node in one.nodes:
            if (other := leaders.setdefault(node, one)) is not one:
                hint = "Tie a node once; elements with one reference node are one rigid piece."
                raise one.wrong(f"node {node} depends on {other.name} as well", hint)
    pieces: dict[int, list[Rigid]] = {}
    for one in rigid:
        top, passed = one, [one]
        while top.node in leaders:
            node, top = top.node, leaders[top.node]
            if top in passed:
                raise one.wrong(f"its reference node {one.node} follows itself, in a circle")
            if not top.turning:
                raise one.wrong(f"its reference node {node} is a hinge: {top.name} only moves it")
            passed.append(top)
        pieces.setdefault(top.node, []).append(one)
    return pieces


def _as_one(masses: list[PointMass], x: Array) -> dict[str, Any] | None:
    """Mass, centre and inertia of what hangs on a node at x (3,); None where that is nothing."""
    if negative := [one for one in masses if one.mass < 0.0]:
        raise negative[0].wrong(f"its mass is {negative[0].mass:g}, below zero")
    total = sum(one.mass for one in masses)
    inertia = sum((one.inertia for one in masses), np.zeros((3, 3)))
    if not total:
        if inertia.any():
            raise masses[0].wrong("it has inertia and no mass", "Give it the mass it belongs to.")
        return None
    centre = sum((one.mass * one.offset for one in masses), np.zeros(3)) / total
    for one in masses:
        arm = one.offset - centre
        inertia = inertia + one.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return {"mass": total, "inertia": inertia.tolist(), "at": (x + centre).tolist()}


def _check_plain(masses: list[PointMass], node: int, solid: Set[int]) -> None:
    """Refuse what a node of a solid, which does not turn, cannot carry."""
    for one in masses:
        if node not in solid:
            raise one.wrong(f"node {node} belongs neither to the solid nor to what turns with it")
        if one.inertia.any() or one.offset.any():
            text = f"node {node} of the solid does not turn, so it carries no inertia and no offset"
            raise one.wrong(text, "Hang it on the reference node of a rigid element.")


def _spring(found: Hung, one: Spring) -> None:
    """Put a spring between two interfaces, or refuse what would resist rigid motion."""
    nodes, k = (one.node, one.other), one.stiffness
    if not all(nodes):
        raise one.wrong("an end of it is at ground", "Springs to ground stand in the mechanism.")
    if k.min() < 0.0 or not (k @ one.stretch).any():
        raise one.wrong(f"its stiffness is {k.min():g}, not above zero, or without direction")
    if loose := set(nodes) - found.turning.keys() - found.solid:
        raise one.wrong(f"node {min(loose)} belongs neither to the solid nor to what turns with it")
    a, b = map(found.x, nodes)
    line = (b - a) * (np.linalg.norm(b - a) > APART_RTOL * np.abs([a, b]).max())
    unit = np.repeat([1.0, np.linalg.norm(line) or 1.0], 3)  # of rotations, as displacements
    felt = np.array([turns for n in nodes for turns in (True, n in found.turning)]).repeat(3)
    rigid = (np.vstack([np.eye(6), moved_rigidly(line)]) * np.tile(unit, 2)[:, None] / unit)[felt]
    given, W = one.stretch[k > 0.0] / np.tile(unit, 2), np.zeros((np.count_nonzero(k), 12))
    W[:, felt] = given[:, felt] @ (np.eye(len(rigid)) - rigid @ np.linalg.pinv(rigid, 1e-9))
    if (np.abs(W - given) > ASKEW_RTOL * np.abs(given).max(axis=1, keepdims=True)).any():
        text = "it would hold the body against rigid motion, or turn a node of the solid"
        raise one.wrong(text, "Use a CBUSH between reference nodes of rigid elements.")
    ends, W = [found.turning.get(n, f"node {n}") for n in nodes], W * np.tile(unit, 2)
    for end, node, own in zip(ends, nodes, (W[:, :6], W[:, 6:]), strict=True):
        if end not in found.ties:
            found.tie(replace(one, name=end), LOOSE_KIND, {node: 1.0}, node)
        own[:] = own @ moved_rigidly(found.x(node) - found.ties[end]["origin"])
    found.nodes.update(nodes)
    K = (W.T * k[k > 0.0] @ W).tolist()
    found.springs.append({"name": one.name, "ends": ends, "stiffness": K})
