"""The ground, and what stays with a body that others slide on: supports, walls, rails, planes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rom.mbs.parts.bodies import GROUND, Marker
from rom.model import Array
from rom.view.canvas import symbols
from rom.view.canvas.scene import Actor, sharp_edges
from rom.view.canvas.solids import Mesh, across
from rom.view.scenes.places import Places, Pose, at, placed

GROUND_COLOUR, JOINT_COLOUR, INK_COLOUR = "#e3e7ec", "#f4f1e4", "#23282f"
PLANE_OPACITY = 0.5
SIZE_RATIOS = (0.022, 0.3)  # of a symbol: of all there is, and of the body of middle size
WALL_RATIO = 1.6  # of a wall, of the width of what stands on it
STRIP_RATIO = 0.3  # width of each strip of a rail, of what slides on both
MAX_TOUCHING = 200  # markers by which the size of a plane is found


@dataclass(frozen=True, slots=True)
class Scenery:
    """What symbols are drawn with."""

    places: Places  # where everything is
    solid: dict[str, Array]  # {body: (n, 3)} points of surfaces that are drawn, in their frames [m]
    size: float  # of a joint, about its radius [m]
    up: Array  # (3,) upright unit vector

    def around(self, marker: Marker) -> Array:
        """(n, 3) points of the surface of a body from a marker, in its frame [m]; or none."""
        if marker.body not in self.solid:
            return np.zeros((0, 3))
        return self.solid[marker.body] - self.places.mechanism.part(marker.body).point(marker)

    def beyond(self, marker: Marker, direction: Array) -> float:
        """How far the surface of a body goes from a marker in a direction (3,) of its frame [m]."""
        return float((self.around(marker) @ direction).max(initial=0.0))

    def seen_from(self, marker: Marker, others: Sequence[Marker]) -> Array:
        """(k, 3) places of other markers in all instants, from one in the frame of its body [m]."""
        r, A = self.places.point(marker), self.places.pose(marker.body)[1]
        apart = [self.places.point(other) - r for other in others[:MAX_TOUCHING]]
        return np.vstack([(d[:, None] @ A)[:, 0] for d in apart])


def symbol_size(places: Places, drawn: dict[str, Array]) -> float:
    """Of a joint: small against all there is, and not large against its bodies [m]."""
    origins = np.concatenate([r for r, _ in places.poses.values()] or [np.zeros((1, 3))])
    reaches = [float(np.ptp(X, axis=0).max()) for X in drawn.values() if len(X)] or [1.0]
    whole = float(np.ptp(origins, axis=0).max()) + max(reaches)
    return min(SIZE_RATIOS[0] * whole, SIZE_RATIOS[1] * float(np.median(reaches)))


def solid(mesh: Mesh, pose: Pose, colour: str, opacity: float = 1.0) -> list[Actor]:
    """A surface that moves, and its edges."""
    points = placed(mesh[0][None], pose)
    edges = Actor(points, sharp_edges(*mesh), colour=INK_COLOUR, width=1.2)
    return [Actor(points, mesh[1], colour=colour, opacity=opacity), edges]


def lines(shape: symbols.Lines, pose: Pose, colour: str = INK_COLOUR, width: float = 1.2) -> Actor:
    """Lines that move."""
    return Actor(placed(shape[0][None], pose), shape[1], colour=colour, width=width)


def upright(axis: Array, up: Array) -> Array:
    """(3, 3) axes as columns: x along a direction, z as near to the upright one as can be."""
    z = up - (up @ axis) * axis
    if np.linalg.norm(z) < 1e-3:
        z = across(np.zeros(3), axis)[0]
    z = z / np.linalg.norm(z)
    return np.column_stack([axis, np.cross(z, axis), z])


def support(
    scenery: Scenery,
    point: Array,
    axis: Array | None,
    *,
    above: bool = False,
    size: float | None = None,
) -> Iterator[Actor]:
    """A wedge on hatched ground below or above a joint at a point (3,), about an axis or none."""
    axis = across(np.zeros(3), scenery.up)[0] if axis is None else axis
    pose = at(point[None], upright(axis, -scenery.up if above else scenery.up)[None])
    size = scenery.size if size is None else size
    wedge, plate = symbols.pedestal(size, 1.5 * size)
    yield from solid(wedge, pose, JOINT_COLOUR)
    yield from _hatched(plate, pose)


def wall(scenery: Scenery, point: Array, normal: Array, foot: float = 0.0) -> Iterator[Actor]:
    """Hatched ground at a point (3,) that faces along a normal (3,), about a foot so wide [m]."""
    axes = np.roll(upright(normal, scenery.up), -1, axis=1)  # the normal last
    size = max(5.0 * scenery.size, WALL_RATIO * foot)
    plate = symbols.ground_plate(size, size, 0.16 * size)
    yield from _hatched(plate, at(point[None], axes[None]))


def guide(scenery: Scenery, first: Marker, second: Marker, axis: Array) -> Iterator[Actor]:
    """A line, or on the ground a rail, of the second marker along an axis (3,) of the first one."""
    places, size = scenery.places, scenery.size
    way = scenery.seen_from(first, [second]) @ axis
    solid_ends = max(scenery.beyond(second, axis), scenery.beyond(second, -axis))
    over = solid_ends + size if solid_ends else 3.0 * size
    low, high = way.min() - over, way.max() + over
    if first.body != GROUND:
        local = np.stack([low * axis, high * axis])
        yield lines(symbols.polyline(local), places.frame(first), width=2.0)
        return
    axes = upright(axis, scenery.up)
    A = places.pose(second.body)[1][0]
    below = scenery.beyond(second, -A.T @ axes[:, 2]) or 1.1 * size
    sides = [scenery.beyond(second, sign * A.T @ axes[:, 1]) for sign in (-1.0, 1.0)]
    across_rail = places.point(second)[0] - places.point(first)[0]
    middle = (across_rail @ axes[:, 1] + (sides[1] - sides[0]) / 2) * axes[:, 1]
    down = across_rail @ axes[:, 2] - below
    place = places.point(first)[0] + 0.5 * (low + high) * axis + middle + down * axes[:, 2]
    wide = sum(sides)
    strips, width = [0.0], 3 * size
    if wide >= 3 * size:  # under a block two, between which something may swing
        strips, width = [s * (1 - STRIP_RATIO) / 2 * wide for s in (-1, 1)], STRIP_RATIO * wide
    for beside in strips:
        plate = symbols.ground_plate(high - low, width, 0.8 * size)
        yield from _hatched(plate, at((place + beside * axes[:, 1])[None], axes[None]))


def plane(
    scenery: Scenery, first: Marker, normal: Array, touching: Sequence[tuple[Marker, float]]
) -> Iterator[Actor]:
    """The plane of a contact, as large as what moves on it; hatched on the ground.

    Its normal (3,) is in the frame of the body of its first marker; the markers that touch it have
    a radius each [m].
    """
    places = scenery.places
    seen = scenery.seen_from(first, [marker for marker, _ in touching])
    flat = seen - np.outer(seen @ normal, normal)
    ahead = np.linalg.svd(flat - flat.mean(axis=0))[2][0] if len(flat) > 1 else np.zeros(3)
    ahead = ahead - (ahead @ normal) * normal
    if np.linalg.norm(ahead) < 0.5 or np.ptp(flat, axis=0).max() < 1e-9:
        ahead = across(np.zeros(3), normal)[0]
    x = ahead / np.linalg.norm(ahead)
    axes = np.column_stack([x, np.cross(normal, x), normal])
    pad = 3.0 * scenery.size + 1.2 * max(radius for _, radius in touching)
    low, high = (flat @ axes).min(axis=0) - pad, (flat @ axes).max(axis=0) + pad
    plate, hatching = symbols.ground_plate(high[0] - low[0], high[1] - low[1], 0.8 * scenery.size)
    pose = places.frame(first, axes, axes[:, :2] @ (low + high)[:2] / 2)
    points = placed(plate[0][None], pose)
    yield Actor(points, plate[1], colour=GROUND_COLOUR, opacity=PLANE_OPACITY)
    if first.body == GROUND:
        yield lines(hatching, pose, width=1.0)
    else:
        yield Actor(points, sharp_edges(*plate), colour=INK_COLOUR, width=1.0)


def _hatched(plate: tuple[Mesh, symbols.Lines], pose: Pose) -> Iterator[Actor]:
    mesh, hatching = plate
    yield Actor(placed(mesh[0][None], pose), mesh[1], colour=GROUND_COLOUR)
    yield lines(hatching, pose, width=1.0)
