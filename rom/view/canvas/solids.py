"""Surfaces of simple solids, to give rigid bodies a shape in pictures."""

import numpy as np
import numpy.typing as npt

from rom.arguments import typed
from rom.model import Array, Index

Mesh = tuple[Array, Index]


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
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4],
                      [1, 5, 7, 3]])  # fmt: skip
    triangles = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return corners * np.asarray(size, dtype=float) + np.asarray(centre, dtype=float), triangles


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
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    axis = (b - a) / np.linalg.norm(b - a)
    x = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    x /= np.linalg.norm(x)
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = (
        0.5 * diameter * (np.outer(np.cos(angle), x) + np.outer(np.sin(angle), np.cross(axis, x)))
    )
    i = np.arange(sides)
    j = (i + 1) % sides
    first, last = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    triangles = [(i, j, sides + j), (i, sides + j, sides + i), (first, j, i)]
    triangles.append((last, sides + i, sides + j))
    return np.vstack([a + ring, b + ring, a, b]), np.vstack(
        [np.stack(t, axis=1) for t in triangles]
    )
