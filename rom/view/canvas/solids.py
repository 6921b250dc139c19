"""Surfaces of simple solids, to give rigid bodies a shape in pictures."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from rom.arguments import between, finite, typed, whole
from rom.errors import ConfigError
from rom.model import Array, Index

Mesh = tuple[Array, Index]
Angle = TypeVar("Angle", float, Array)
BORE_SIDES = 48  # of a hole at least
COIL_POINTS = 24  # of a spring, to a turn
FILLET_RATIO = 0.25  # of the gap of a gear, by which a tooth is wider at its root


@typed
def box(size: npt.ArrayLike, centre: npt.ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
    """Block with faces along the axes.

    Args:
        size: (3,) lengths of the edges [m].
        centre: (3,) its centre [m].

    Returns:
        (8, 3) points and (12, 3) triangles, seen from outside counter-clockwise.
    """
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6)]
    quads = np.array([*sides, (0, 2, 6, 4), (1, 5, 7, 3)])
    triangles = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return corners * np.asarray(size, dtype=float) + np.asarray(centre, dtype=float), triangles


@typed
def bar(
    a: npt.ArrayLike, b: npt.ArrayLike, size: tuple[float, float], broad: npt.ArrayLike
) -> Mesh:
    """Rectangular bar from one point to another.

    Args:
        a: (3,) middle of one end [m].
        b: (3,) middle of the other end [m].
        size: of the section along ``broad`` and across it [m].
        broad: (3,) direction across the bar [1].

    Raises:
        ConfigError: if the direction is that of the bar, or both ends are in one place.
    """
    a, b, broad = (np.asarray(x, dtype=float) for x in (a, b, broad))
    along = across(a, b)[2]
    side = broad - (broad @ along) * along
    if not np.linalg.norm(side) > 1e-9 * np.linalg.norm(broad):
        raise ConfigError(f"broad = {broad} must be a direction across the bar from {a} to {b}.")
    side /= np.linalg.norm(side)
    points, triangles = box((float(np.linalg.norm(b - a)), *size))
    return points @ np.array([along, side, np.cross(along, side)]) + (a + b) / 2, triangles


@typed
def cylinder(a: npt.ArrayLike, b: npt.ArrayLike, diameter: float, *, sides: int = 48) -> Mesh:
    """Round bar from one point to another, closed at its ends.

    Args:
        a: (3,) middle of one end [m].
        b: (3,) middle of the other end [m].
        diameter: [m].
        sides: number of flat faces around.

    Returns:
        (2 sides + 2, 3) points and (4 sides, 3) triangles.
    """
    return tube(np.stack([a, b]), diameter, sides=sides)


@typed
def ring(
    a: npt.ArrayLike, b: npt.ArrayLike, inner: float, outer: float, *, sides: int = 48
) -> Mesh:
    """Hollow cylinder from one point to another: a bush, the film of a bearing, a tube.

    Args:
        a: (3,) middle of one end [m].
        b: (3,) middle of the other end [m].
        inner: diameter of the bore [m].
        outer: diameter outside [m].
        sides: number of flat faces around.

    Returns:
        (4 sides, 3) points and (8 sides, 3) triangles.

    Raises:
        ConfigError: if the bore is not inside.
    """
    if not 0.0 < inner < outer:
        raise ConfigError(f"a bore of {inner:g} m must be smaller than its ring of {outer:g} m.")
    x, y, _ = across(a, b)
    corners = ((a, inner), (a, outer), (b, outer), (b, inner))
    return _hollow([np.asarray(end) + _circle(x, y, d / 2, sides) for end, d in corners])


@typed
def ellipsoid(
    semi_axes: npt.ArrayLike, centre: npt.ArrayLike = (0.0, 0.0, 0.0), *, sides: int = 32
) -> Mesh:
    """Ellipsoid, or ball, with its axes along x, y and z, and its points on the surface.

    Args:
        semi_axes: (3,) half of its lengths [m].
        centre: (3,) its centre [m].
        sides: number of flat faces around; half as many from pole to pole.
    """
    latitudes = np.pi * np.arange(1, sides // 2) / (sides // 2)
    circle = _circle(np.eye(3)[0], np.eye(3)[1], 1.0, sides)
    rows = [np.sin(u) * circle - np.cos(u) * np.eye(3)[2] for u in latitudes]
    points, triangles = _closed(rows, -np.eye(3)[2], np.eye(3)[2])
    scaled = points * np.asarray(semi_axes, dtype=float)
    return scaled + np.asarray(centre, dtype=float), triangles


@typed
def tube(line: npt.ArrayLike, diameter: float, *, sides: int = 16) -> Mesh:
    """Round bar along a curve, closed at its ends.

    Args:
        line: (k, 3) points of its middle line, k > 1, no two of them in one place [m].
        diameter: [m]; smaller than twice the radius of each bend.
        sides: number of flat faces around.

    Returns:
        (k sides + 2, 3) points and triangles; sections are normal to the curve.

    Raises:
        ConfigError: if the points are no curve.
    """
    X = _curve(line)[0]
    rims = [_circle(x, y, diameter / 2, sides) for x, y in zip(*_sections(X), strict=True)]
    return _closed([*(X[:, None] + rims)], X[0], X[-1])


def _closed(loops: Sequence[Array], start: Array, end: Array) -> Mesh:
    """Loops of as many points, one after the other, and a fan to a point at either end."""
    sides = len(loops[0])
    i, j = np.arange(sides), np.roll(np.arange(sides), -1)
    n, last = sides * len(loops), sides * (len(loops) - 1)
    triangles = [_band(k * sides + i, (k + 1) * sides + i) for k in range(len(loops) - 1)]
    triangles += [np.column_stack([0 * i + n, j, i])]
    triangles += [np.column_stack([0 * i + n + 1, last + i, last + j])]
    return np.vstack([*loops, start, end]), np.vstack(triangles)


def _hollow(loops: Sequence[Array]) -> Mesh:
    """Loops of as many points, each joined to the next one, and the last to the first."""
    sides, n = len(loops[0]), len(loops)
    i = np.arange(sides)
    bands = [_band(k * sides + i, (k + 1) % n * sides + i) for k in range(n)]
    return np.vstack(loops), np.vstack(bands)


@typed
def coil(
    a: npt.ArrayLike, b: npt.ArrayLike, diameter: float, wire: float, *, turns: float = 6.0
) -> Mesh:
    """Helical spring from one point to another.

    Args:
        a: (3,) middle of one end [m].
        b: (3,) middle of the other end [m].
        diameter: of the middle line of the wire [m].
        wire: diameter of the wire [m].
        turns: number of turns.

    Raises:
        ConfigError: if the wire is thicker than its bends allow.
    """
    return wound(np.stack([a, b]), diameter, wire, turns=turns)


@typed
def wound(line: npt.ArrayLike, diameter: float, wire: float, *, turns: float = 6.0) -> Mesh:
    """Helical spring about a curve: one that is bent.

    Args:
        line: (k, 3) points of its middle line, k > 1, no two of them in one place [m].
        diameter: of the middle line of the wire [m].
        wire: diameter of the wire [m].
        turns: number of turns.

    Raises:
        ConfigError: if the points are no curve, or the wire is thicker than its bends allow.
    """
    if not 0.0 < wire < diameter:
        raise ConfigError(f"a wire of {wire:g} m must be thinner than its coil of {diameter:g} m.")
    X, s = _curve(line)
    even = np.linspace(0.0, s[-1], int(np.ceil(COIL_POINTS * turns)) + 1)
    X = np.column_stack([np.interp(even, s, x) for x in X.T])
    x, y = _sections(X)
    angle = (2 * np.pi * turns * even / s[-1])[:, None]
    return tube(X + 0.5 * diameter * (np.cos(angle) * x + np.sin(angle) * y), wire, sides=12)


def _curve(line: npt.ArrayLike) -> tuple[Array, Array]:
    """(k, 3) points of a curve and (k,) way along it [m]."""
    X = finite("the line of a tube", line, (None, 3))
    whole("points of the line of a tube", len(X), 2)
    lengths = np.linalg.norm(np.diff(X, axis=0), axis=1)
    if not (lengths > 0.0).all():
        raise ConfigError("two points of the line of a tube are in one place; leave one out.")
    return X, np.concatenate([[0.0], np.cumsum(lengths)])


def _sections(X: Array) -> tuple[Array, Array]:
    """(k, 3) axes x and y across a curve, which turn about it as little as can be."""
    steps = np.diff(X, axis=0)
    ahead = steps / np.linalg.norm(steps, axis=1)[:, None]
    along = np.vstack([ahead[:1], ahead[1:] + ahead[:-1], ahead[-1:]])
    along /= np.linalg.norm(along, axis=1)[:, None]
    x, rows = across(np.zeros(3), along[0])[0], []
    for t in along:
        x = x - (x @ t) * t
        x = x / np.linalg.norm(x)
        rows.append(x)
    return np.array(rows), np.cross(along, rows)


@typed
def extruded(outline: npt.ArrayLike, width: float, *, bore: float = 0.0) -> Mesh:
    """Plate in the plane of x and y, half of its width on either side.

    Args:
        outline: (n, 2) corners, counter-clockwise, all of them in sight of the origin [m].
        width: along z [m].
        bore: diameter of a round hole about the origin [m]; 0 for none.

    Raises:
        ConfigError: if the outline is not seen from the origin, or the bore leaves it.
    """
    P = finite("outline", outline, (None, 2))
    whole("corners of the outline", len(P), 3)
    Q = np.roll(P, -1, axis=0)
    turning = P[:, 0] * Q[:, 1] - P[:, 1] * Q[:, 0]
    if not (turning > 0.0).all():
        raise ConfigError("the outline must turn counter-clockwise about the origin.")
    d = Q - P
    foot = np.clip(-np.sum(P * d, axis=1) / np.sum(d * d, axis=1), 0.0, 1.0)
    nearest = float(np.linalg.norm(P + foot[:, None] * d, axis=1).min())
    between("bore", bore, 0, 2 * nearest, "[)")

    def raised(x: Array, side: int) -> Array:
        return np.column_stack([x, np.full(len(x), side * width / 2)])

    if not bore:
        middle = np.array([0.0, 0.0, width / 2])
        return _closed([raised(P, -1), raised(P, 1)], -middle, middle)
    k = -(-BORE_SIDES // len(P))  # as many points as a round hole needs
    share = np.arange(k)[:, None, None] / k
    P = (P + share * d).swapaxes(0, 1).reshape(-1, 2)
    inside = bore / 2 * P / np.linalg.norm(P, axis=1)[:, None]
    return _hollow([raised(inside, -1), raised(P, -1), raised(P, 1), raised(inside, 1)])


@typed
def gear(
    teeth: int,
    module: float,
    width: float,
    *,
    bore: float = 0.0,
    pressure_angle: float = np.deg2rad(20.0),
    points: int = 6,
) -> Mesh:
    """Spur gear with involute flanks, its axis z, a space between two teeth on the x axis.

    Args:
        teeth: number of teeth, 6 or more.
        module: pitch diameter / number of teeth [m].
        width: [m].
        bore: diameter of a round hole [m]; 0 for none.
        pressure_angle: [rad].
        points: on each flank.

    Returns:
        Points and triangles; addendum of one module, dedendum of 1.25. Below the base circle
        straight lines widen the teeth, as fillets do.

    Raises:
        ConfigError: for too few teeth, or a pressure angle at which they are pointed.
    """
    return extruded(gear_outline(teeth, module, pressure_angle, points), width, bore=bore)


def gear_outline(teeth: int, module: float, pressure_angle: float, points: int = 6) -> Array:
    """(n, 2) outline of a spur gear, counter-clockwise [m]; see `gear`."""
    pitch, top = 0.5 * teeth * module, (0.5 * teeth + 1.0) * module
    base, root = pitch * np.cos(pressure_angle), (0.5 * teeth - 1.25) * module
    half = np.pi / (2 * teeth) + involute(pressure_angle)  # angle of half a tooth at the base
    if teeth < 6 or not involute(np.arccos(base / top)) < half:
        raise ConfigError(
            f"{teeth} teeth of a pressure angle of {np.rad2deg(pressure_angle):g} degrees are "
            "pointed, or too few; use more."
        )
    r = np.linspace(max(base, root), top, points)
    flank = involute(np.arccos(np.minimum(base / r, 1.0))) - half
    foot = flank[0] - (FILLET_RATIO * (np.pi / teeth + flank[0]) if root < base else 0.0)
    tip = np.linspace(flank[-1], -flank[-1], points)[1:-1]
    gap = np.linspace(-foot, 2 * np.pi / teeth + foot, points)
    gap = gap[:-1] if root < base else gap[1:-1]  # the flanks begin on the root circle
    angle = np.concatenate([flank, tip, -flank[::-1], gap])
    radius = np.concatenate([r, np.full(tip.size, top), r[::-1], np.full(gap.size, root)])
    if root < base:
        angle, radius = np.append(foot, angle), np.append(root, radius)
    turns = np.pi / teeth + 2 * np.pi * np.arange(teeth) / teeth
    every = (turns[:, None] + angle).ravel()
    return np.tile(radius, teeth)[:, None] * np.column_stack([np.cos(every), np.sin(every)])


def involute(angle: Angle) -> Angle:
    """Involute function: angle of a point on the curve where the pressure angle is that."""
    return np.tan(angle) - angle


@typed
def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Several surfaces as one; all still, or in as many pictures."""
    points, triangles = zip(*meshes, strict=True)
    first = np.cumsum([0, *(np.shape(x)[-2] for x in points)])[:-1]
    moved = [several + n for several, n in zip(triangles, first, strict=True)]
    return np.concatenate(points, axis=-2), np.vstack(moved)


def across(a: npt.ArrayLike, b: npt.ArrayLike) -> tuple[Array, Array, Array]:
    """Right-handed unit vectors x, y and z with z from one point towards the other."""
    z = np.asarray(b, dtype=float) - np.asarray(a, dtype=float)
    length = np.linalg.norm(z)
    if not length > 0.0:
        raise ConfigError(f"two points in one place, {a!r}, have no direction; give another one.")
    z = z / length
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x = x / np.linalg.norm(x)
    return x, np.cross(z, x), z


def _circle(x: Array, y: Array, radius: float, sides: int) -> Array:
    """(sides, 3) points around the origin, from x towards y."""
    angle = 2 * np.pi * np.arange(sides) / sides
    circle: Array = radius * (np.outer(np.cos(angle), x) + np.outer(np.sin(angle), y))
    return circle


def _band(one: Index, two: Index) -> Index:
    """Triangles between two closed rows of as many points, the second one ahead of the first."""
    i, j = np.roll(one, -1), np.roll(two, -1)
    return np.vstack([np.column_stack([one, i, j]), np.column_stack([one, j, two])])
