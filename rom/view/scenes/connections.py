"""Joints, springs and contacts of a mechanism, as the symbols of machine drawings."""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from rom.fields import find
from rom.mbs.elements.contact.points import BORE, CAPSULE, CYLINDER, DISC, PLANE
from rom.mbs.kernels.system import NORMAL
from rom.mbs.parts.bodies import GROUND, Marker
from rom.model import Array
from rom.rotation import matrix
from rom.view.canvas import symbols
from rom.view.canvas.scene import Actor
from rom.view.canvas.solids import Mesh, across, cylinder, ellipsoid, joined
from rom.view.scenes import ground
from rom.view.scenes.ground import JOINT_COLOUR, Scenery, lines, solid
from rom.view.scenes.places import Places, placed

if TYPE_CHECKING:
    from rom.mbs.elements.bushings import Bushing
    from rom.mbs.elements.joint_laws import Turn
    from rom.mbs.elements.springs import Spring
    from rom.mbs.mechanism import Mechanism
    from rom.mbs.parts.joints import Joint

SPRING_COLOUR, DAMPER_COLOUR, ROD_COLOUR = "#b5541c", "#4a5560", "#5c636e"
LINE_WIDTH = 2.0  # of springs, rods and wheels [pixel]
Place = tuple[float, ...]  # three numbers
# kind of joint: what is drawn at its second marker
BUSHES: dict[str, Callable[[float], Mesh]] = {"prismatic": symbols.sleeve, "fixed": symbols.weld}
BUSHES |= {"revolute": symbols.hinge, "universal": symbols.cross}
BUSHES |= dict.fromkeys(("cylindrical", "screw"), symbols.round_sleeve)
BUSHES |= dict.fromkeys(("spherical", "point on line", "point on plane"), symbols.ball)
BEARING_RATIO, MAX_BEARING_RATIO = 1.5, 5.0  # size of a bearing over its shaft; over other joints
FOOT_RATIO = 0.02  # of a body, the part that counts as its end at a wall
ROUND_RATIO = 0.2  # of its radius, by which the end of a shaft is beside its axis at most
HANGING_COSINE = 0.5  # of a body below its joint, whose support is above then
SLIDING_KINDS = ("prismatic", "cylindrical", "screw", "point on line")
PLANE_KINDS = ("planar", "point on plane", "rolling")


def connections(
    places: Places, drawn: dict[str, Array], surfaces: set[str], up: Array
) -> list[Actor]:
    """Symbols of everything between the bodies of a mechanism, upright along ``up`` (3,).

    Bodies are drawn by points (n, 3) in their frames [m]; surfaces of some may hide symbols.
    """
    shapes = {name: X for name, X in drawn.items() if name in surfaces}
    scenery = Scenery(places, shapes, ground.symbol_size(places, drawn), up / np.linalg.norm(up))
    mechanism = places.mechanism
    actors: list[Actor] = []
    for joint in mechanism.joints.values():
        actors += _joint(scenery, joint)
    for family, elements in mechanism.families().items():
        draw = find("symbols", family.name)
        for name, element in elements.items() if draw else ():
            for one in draw(scenery, name, element):
                actors.append(one if isinstance(one, Actor) else circle(places, *one))
    return actors + list(_contacts(scenery))


def axis_of(joint: "Joint", mechanism: "Mechanism") -> Array | None:
    """(3,) axis of a joint, or normal of its plane, in the world at the start; None without one."""
    one, two = (matrix(mechanism.part(m.body).p) for m in joint.markers[:2])
    if joint.kind == "universal":
        return two @ joint.rows[-1].b
    if joint.kind in ("point on line", "point on plane", "rolling"):
        return one @ (joint.displacement or joint.rows[0]).a
    if joint.kind in ("fixed", "spherical"):
        return None
    return next((two @ row.b for row in joint.rows if row.kind == NORMAL), None)


def _joint(scenery: Scenery, joint: "Joint") -> Iterator[Actor]:
    mechanism, (first, second) = scenery.places.mechanism, joint.markers[:2]
    axis = axis_of(joint, mechanism)
    if joint.kind == "distance":
        points = np.stack(_both(scenery.places, first, second), axis=1)
        yield Actor(points, np.array([[0, 1]]), colour=ROD_COLOUR, width=1.5 * LINE_WIDTH)
    if joint.kind in BUSHES:
        yield from _bush(scenery, joint, axis)
    if joint.kind in SLIDING_KINDS and axis is not None:
        along = matrix(mechanism.part(first.body).p).T @ axis
        yield from ground.guide(scenery, first, second, along)
    elif joint.kind in PLANE_KINDS and axis is not None:
        yield from _on_plane(scenery, joint, axis)
    elif joint.kind in BUSHES and GROUND in (first.body, second.body):
        yield from _grounded(scenery, joint, axis)


def _bush(scenery: Scenery, joint: "Joint", axis: Array | None) -> Iterator[Actor]:
    places, second = scenery.places, joint.markers[1]
    B = matrix(places.mechanism.part(second.body).p)
    local = np.eye(3) if axis is None else np.column_stack(across(np.zeros(3), B.T @ axis))
    if joint.kind == "universal":  # the other axis of its cross
        A = matrix(places.mechanism.part(joint.markers[0].body).p)
        x, z = B.T @ A @ joint.rows[-1].a, local[:, 2]
        local = np.column_stack([x, np.cross(z, x), z])
    shift, size = _bearing(scenery, joint, axis)
    pose = places.frame(second, local, B.T @ shift)
    yield from solid(BUSHES[joint.kind](size), pose, JOINT_COLOUR)


def _bearing(scenery: Scenery, joint: "Joint", axis: Array | None) -> tuple[Array, float]:
    """(3,) from a hinge on the ground to the nearer end of its shaft, and the size of its bush."""
    mover = next((m for m in joint.markers if m.body in scenery.solid), None)
    grounded = GROUND in {m.body for m in joint.markers}
    if mover is None or axis is None or not grounded or joint.kind != "revolute":
        return np.zeros(3), scenery.size
    along = matrix(scenery.places.mechanism.part(mover.body).p).T @ axis
    ends = [scenery.beyond(mover, sign * along) for sign in (-1.0, 1.0)]
    side = int(np.argmin(ends))
    shift = (2 * side - 1) * ends[side]
    X = scenery.around(mover)
    face = X[np.abs(X @ along - shift) < 0.02 * scenery.size]
    radial = face - np.outer(face @ along, along)
    radius = float(np.linalg.norm(radial, axis=1).max(initial=0.0))
    round_ = len(face) > 2 and np.linalg.norm(radial.mean(axis=0)) < ROUND_RATIO * radius
    size = BEARING_RATIO * radius if round_ else 0.0
    size = float(np.clip(size, scenery.size, MAX_BEARING_RATIO * scenery.size))
    beyond = 0.5 * size * (2 * side - 1) if round_ else 0.0  # most of the shaft stays in sight
    return (shift + beyond) * axis, size


def _grounded(scenery: Scenery, joint: "Joint", axis: Array | None) -> Iterator[Actor]:
    first, second = joint.markers
    here, mover = (first, second) if first.body == GROUND else (second, first)
    point = scenery.places.point(here)[0]
    if joint.kind == "fixed":
        normal = _towards(scenery, mover)
        yield from ground.wall(scenery, point, normal, _foot(scenery, mover, normal))
        return
    shift, size = _bearing(scenery, joint, axis)
    centre = scenery.places.pose(mover.body)[0][0] - point
    hanging = bool(centre @ scenery.up < -HANGING_COSINE * np.linalg.norm(centre))
    about = None if joint.kind == "spherical" else axis
    yield from ground.support(scenery, point + shift, about, above=hanging, size=size)


def _foot(scenery: Scenery, marker: Marker, normal: Array) -> float:
    """How wide a body is where it leaves a wall, about a marker [m]; 0 without a surface."""
    X = scenery.around(marker)
    if not len(X):
        return 0.0
    inward = scenery.places.pose(marker.body)[1][0].T @ normal
    face = X[X @ inward < FOOT_RATIO * np.ptp(X, axis=0).max()]
    radial = face - np.outer(face @ inward, inward)
    return 2 * float(np.linalg.norm(radial, axis=1).max(initial=0.0))


def _towards(scenery: Scenery, marker: Marker) -> Array:
    """(3,) direction of an axis of a body, from a marker to where most of the body is."""
    part = scenery.places.mechanism.part(marker.body)
    A = scenery.places.pose(marker.body)[1][0]
    centre = np.asarray(part.first) / part.mass - part.point(marker)
    k = int(np.argmax(np.abs(centre)))
    along: Array = np.sign(centre[k]) * A[:, k]
    return along if np.abs(centre[k]) > 1e-9 * scenery.size else scenery.up


def _on_plane(scenery: Scenery, joint: "Joint", normal: Array) -> Iterator[Actor]:
    places, (first, second) = scenery.places, joint.markers
    radius = joint.rows[0].radius
    if joint.kind == "rolling" and joint.rows[0].b.any():
        yield circle(places, second, joint.rows[0].b, radius)
    elif joint.kind == "rolling" and second.body not in scenery.solid:
        yield from _ball(places, second, radius)
    A = matrix(places.mechanism.part(first.body).p)
    yield from ground.plane(scenery, first, A.T @ normal, [(second, radius)])


def _both(places: Places, first: Marker, second: Marker) -> tuple[Array, Array]:
    a, b = np.broadcast_arrays(places.point(first), places.point(second))
    return a, b


def _ball(places: Places, marker: Marker, radius: float) -> list[Actor]:
    shape = symbols.ball(radius / symbols.BALL_RATIO)
    return solid(shape, places.frame(marker), JOINT_COLOUR, 0.5)


def spiral(scenery: Scenery, _: str, turn: "Turn") -> Iterator[Actor]:
    """A spring about a joint."""
    joint = scenery.places.mechanism.joints[turn.joint]
    axis = axis_of(joint, scenery.places.mechanism)
    if axis is None:
        return
    second = joint.markers[1]
    B = matrix(scenery.places.mechanism.part(second.body).p)
    local = np.column_stack(across(np.zeros(3), B.T @ axis))
    shift, size = _bearing(scenery, joint, axis)
    pose = scenery.places.frame(second, local, B.T @ (shift + 1.3 * size * axis))
    yield lines(symbols.spiral(size), pose, SPRING_COLOUR, LINE_WIDTH)


def spring(scenery: Scenery, _: str, spring: "Spring") -> Iterator[Actor]:
    """Coil and dashpot between two markers, stretched as they move."""
    ends = _both(scenery.places, spring.i, spring.j)
    if np.linalg.norm(ends[1] - ends[0], axis=1).max() < scenery.size:
        yield from bushing(scenery, "", spring)
        return
    if spring.stiffness:
        yield stretched(symbols.spring(scenery.size), ends, SPRING_COLOUR)
    if spring.damping:
        yield stretched(symbols.dashpot(scenery.size), ends, DAMPER_COLOUR)
    for k, marker in enumerate((spring.i, spring.j)):
        if marker.body == GROUND:
            gap = ends[1 - k][0] - ends[k][0]
            normal = gap / np.linalg.norm(gap) if gap.any() else scenery.up
            yield from ground.wall(scenery, ends[k][0], normal)


def stretched(shape: symbols.Lines, ends: tuple[Array, Array], colour: str) -> Actor:
    """Lines along z from 0 to 1, drawn from one end (f, 3) to the other in all instants."""
    a, b = ends
    d = b - a
    z = d / np.maximum(np.linalg.norm(d, axis=1)[:, None], 1e-300)
    helper = np.eye(3)[np.argmin(np.abs(z).max(axis=0))]
    x = np.cross(z, helper)
    x /= np.maximum(np.linalg.norm(x, axis=1)[:, None], 1e-300)
    axes = np.stack([x, np.cross(z, x), d], axis=2)
    return Actor(placed(shape[0][None], (a, axes)), shape[1], colour=colour, width=LINE_WIDTH)


def bushing(scenery: Scenery, _: str, element: "Spring | Bushing") -> Iterator[Actor]:
    """What holds two markers together."""
    places = scenery.places
    yield from solid(symbols.weld(scenery.size), places.frame(element.j), SPRING_COLOUR)
    for marker in (element.i, element.j):
        if marker.body == GROUND:
            yield from ground.support(scenery, places.point(marker)[0], None)


def _contacts(scenery: Scenery) -> Iterator[Actor]:
    """Planes, bores and cylinders that bodies touch, each one once, and rims of discs."""
    planes: dict[tuple[Marker, Place], list[tuple[Marker, float]]] = {}
    rounds: set[tuple[Marker, Place, float]] = set()
    capsules: set[tuple[Marker, Place, float, float]] = set()
    for contact in scenery.places.mechanism.contacts.values():
        key = contact.i, tuple(np.asarray(contact.e).tolist())
        if contact.kind in (PLANE, DISC):
            planes.setdefault(key, []).append((contact.j, contact.radius[0]))
            if contact.kind == DISC:
                yield circle(scenery.places, contact.j, contact.s, contact.radius[0])
        elif contact.kind in (CYLINDER, BORE):
            rounds.add((*key, contact.radius[1]))
        elif contact.kind == CAPSULE:
            ends = (contact.j, contact.i), (contact.s, contact.e), contact.radius, contact.half
            for marker, axis, radius, half in zip(*ends, strict=True):
                capsules.add((marker, tuple(np.asarray(axis).tolist()), radius, half))
            continue
        if contact.radius[0] and contact.kind != DISC and contact.j.body not in scenery.solid:
            yield from _ball(scenery.places, contact.j, contact.radius[0])
    for (marker, normal), touching in planes.items():
        yield from ground.plane(scenery, marker, np.array(normal), touching)
    for marker, along, radius in rounds:
        yield circle(scenery.places, marker, np.array(along), radius)
    for one in capsules:
        yield from _capsule(scenery.places, *one)


def _capsule(
    places: Places, marker: Marker, axis: Place, radius: float, half: float
) -> Iterator[Actor]:
    end = half * np.array(axis)
    balls = [ellipsoid((radius,) * 3, x) for x in (-end, end)[: 2 if half else 1]]
    shape = joined([*balls, cylinder(-end, end, 2 * radius)]) if half else balls[0]
    yield from solid(shape, places.frame(marker), ROD_COLOUR, 0.6)


def circle(places: Places, marker: Marker, axis: Array, radius: float) -> Actor:
    """A circle about an axis of the body of a marker."""
    local = np.column_stack(across(np.zeros(3), axis))
    return lines(symbols.circle(radius), places.frame(marker, local), width=LINE_WIDTH)
