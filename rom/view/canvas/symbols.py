"""Symbols of machine drawings, in a frame of their own: z is the axis of a joint, or upright."""

from itertools import pairwise

import numpy as np

from rom.model import Array, Index
from rom.view.canvas.solids import Mesh, box, cylinder, ellipsoid, extruded, joined, ring

Lines = tuple[Array, Index]  # (n, 3) points and (m, 2) pairs of them
BALL_RATIO = 0.8  # radius of a ball over the size of a symbol
COIL_TURNS, COIL_POINTS = 6, 16  # of a spring; points to a turn
LEAD_RATIO = 0.15  # of the length of a spring, straight at either end


def hinge(size: float) -> Mesh:
    """Revolute joint: a bush along the axis."""
    return ring((0, 0, -1.1 * size), (0, 0, 1.1 * size), 0.7 * size, 1.6 * size, sides=32)


def ball(size: float) -> Mesh:
    """Spherical joint."""
    return ellipsoid((BALL_RATIO * size,) * 3, sides=24)


def sleeve(size: float) -> Mesh:
    """Prismatic joint: a square sleeve along the axis."""
    half, wall, long = 0.9 * size, 0.3 * size, 3.0 * size
    plates = [box((2 * half, wall, long), (0, side * half, 0)) for side in (-1, 1)]
    inner = (wall, 2 * half - wall, long)
    plates += [box(inner, (side * (half - wall / 2), 0, 0)) for side in (-1, 1)]
    return joined(plates)


def round_sleeve(size: float) -> Mesh:
    """Cylindrical joint, and screw: a long bush along the axis."""
    return ring((0, 0, -1.8 * size), (0, 0, 1.8 * size), 0.8 * size, 1.6 * size, sides=32)


def weld(size: float) -> Mesh:
    """Fixed joint: a square."""
    return box((1.3 * size,) * 3)


def cross(size: float) -> Mesh:
    """Universal joint: its cross, along x and z."""
    a, b = np.array([1.4 * size, 0, 0]), np.array([0, 0, 1.4 * size])
    return joined([cylinder(-end, end, 0.6 * size, sides=24) for end in (a, b)])


def spiral(size: float) -> Lines:
    """Rotational spring about the axis."""
    s = np.linspace(0.0, 1.0, 73)
    angle, radius = 5 * np.pi * s, size * (1.1 + 0.9 * s)
    return polyline(np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * s]))


def pedestal(size: float, width: float) -> tuple[Mesh, tuple[Mesh, Lines]]:
    """Support of a joint at the origin: a wedge, its edges along x, and a hatched plate below."""
    outline = size * np.array([(-1.5, -1.2), (1.5, -1.2), (0.35, 1.0), (-0.35, 1.0)])
    wedge = extruded(outline, width)
    points = np.roll(wedge[0], 1, axis=1) - (0, 0, size)  # the outline from x, y to y, z
    plate, hatching = ground_plate(1.6 * width, 4.4 * size, 0.5 * size)
    below = np.array([0.0, 0.0, -2.2 * size])
    return (points, wedge[1]), ((plate[0] + below, plate[1]), (hatching[0] + below, hatching[1]))


def ground_plate(x: float, y: float, thick: float) -> tuple[Mesh, Lines]:
    """Ground whose surface is z = 0: a plate, hatched on its sides, and its upper edges."""
    corners = np.array([(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)]) / 2
    lines = []
    for a, b in pairwise(corners):
        length = float(np.linalg.norm(b - a))
        n = max(3, min(40, round(length / (0.8 * thick))))
        for s in np.arange(n) / n:
            top = a + (b - a) * min(1.0, s + 1 / n)
            foot = a + (b - a) * max(0.0, min(1.0, s + 1 / n - thick / length))
            lines.append(((*top, 0.0), (*foot, -thick)))
        lines.append(((*a, 0.0), (*b, 0.0)))
    pairs = np.arange(2 * len(lines)).reshape(-1, 2)
    return box((x, y, thick), (0, 0, -thick / 2)), (np.array(lines).reshape(-1, 3), pairs)


def circle(radius: float) -> Lines:
    """About z; of a wheel, or a bore."""
    angle = 2 * np.pi * np.arange(65) / 64
    return polyline(radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]))


def spring(size: float) -> Lines:
    """Spring along z whose length is one: z is stretched, x and y are not."""
    s = np.linspace(0.0, 1.0, COIL_TURNS * COIL_POINTS + 1)
    angle = 2 * np.pi * COIL_TURNS * s
    z = LEAD_RATIO + (1 - 2 * LEAD_RATIO) * s
    wound = np.column_stack([size * np.sin(angle), size * (1 - np.cos(angle)) - size, z])
    ends = np.array([(0, 0, x) for x in (0, LEAD_RATIO, 1 - LEAD_RATIO, 1)])
    return polyline(np.vstack([ends[:2], wound, ends[2:]]))


def dashpot(size: float) -> Lines:
    """Damper along z whose length is one, stretched like a spring: a pot, and a piston in it."""

    def rim(radius: float, z: float) -> Array:
        return circle(radius * size)[0][::4] + np.array([0.0, 0.0, z])

    rounds = [polyline(rim(0.5, z)) for z in (0.32, 0.66)]
    rounds += [polyline(rim(0.42, z)) for z in (0.48, 0.52)]
    walls = [np.stack([rim(0.5, z)[k] for z in (0.32, 0.66)]) for k in (0, 4, 8, 12)]
    rods = [np.array([(0, 0, 0), (0, 0, 0.32)]), np.array([(0, 0, 0.52), (0, 0, 1.0)])]
    return joined([*rounds, *(polyline(line) for line in (*walls, *rods))])


def polyline(points: Array) -> Lines:
    """One line through all points."""
    n = np.arange(len(points) - 1)
    return points, np.column_stack([n, n + 1])
