"""Coordinate systems of decks: rectangular (R), cylindrical (C), spherical (S); in degrees."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from rom.errors import FileFormatError
from rom.model import Array

MIN_HEIGHT_RATIO = 1e-9  # height over length of a triangle whose corners lie on a line


@dataclass(frozen=True, slots=True)
class System:
    """Origin (3,), x, y and z as columns of axes (3, 3), kind of coordinates."""

    origin: Array
    axes: Array
    kind: str = "R"

    def basic(self, x: Array) -> Array:
        """(k, 3) positions in the basic system of (k, 3) coordinates in this one."""
        r, one, two = x[:, 0], np.radians(x[:, 1]), np.radians(x[:, 2])
        if self.kind == "C":  # r, around z, z
            x = np.column_stack([r * np.cos(one), r * np.sin(one), x[:, 2]])
        elif self.kind == "S":  # r, from z, around z
            away = r * np.sin(one)
            x = np.column_stack([away * np.cos(two), away * np.sin(two), r * np.cos(one)])
        return self.origin + x @ self.axes.T

    def axes_at(self, x: Array) -> Array:
        """(k, 3, 3) directions of the coordinates, columns, at basic points (k, 3).

        Around an axis or a centre they are those of the point; on the axis, of the system itself.
        """
        x, y, z = ((x - self.origin) @ self.axes).T
        if self.kind == "R":
            return np.tile(self.axes, (z.size, 1, 1))
        away = np.hypot(x, y)
        around = np.where(away > 0.0, np.arctan2(y, x), 0.0)
        if self.kind == "C":
            return self.axes @ Rotation.from_euler("z", around[:, None]).as_matrix()
        tilted = Rotation.from_euler("ZY", np.column_stack([around, np.arctan2(away, z)]))
        return self.axes @ tilted.as_matrix() @ np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])


BASIC_SYSTEM = System(np.zeros(3), np.eye(3))


def system(first: int, corners: Array, kind: str, where: str) -> System:
    """That of the rows (3, 3): its origin, a point on an axis, one in a plane of it.

    The first axis is 2 on CORD cards (z, then z and x), 0 after ``*SYSTEM`` (x, then x and y).
    """
    along, beside = corners[1:] - corners[0]
    across = np.cross(along, beside)
    size = np.linalg.norm(along) * np.linalg.norm(beside)
    if not np.linalg.norm(across) > MIN_HEIGHT_RATIO * size:
        raise FileFormatError("the points of a coordinate system lie on a line.", where=where)
    a, c = along / np.linalg.norm(along), across / np.linalg.norm(across)
    axes = np.empty((3, 3))
    axes[:, first], axes[:, first - 1], axes[:, first - 2] = a, c, np.cross(c, a)
    return System(corners[0], axes, kind)
