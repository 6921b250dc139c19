"""Surfaces made small enough for a page: fewer points, numbers of 16 bit."""

import base64
from typing import Any

import numpy as np

from rom.model import Array, Index

MAX_INT16 = np.iinfo(np.int16).max
TYPES = {"int16": "<i2", "uint16": "<u2", "uint32": "<u4", "float32": "<f4"}
CELL_GROWTH = 1.1


def coarsened(points: Array, triangles: Index, n_max: int) -> tuple[Index, Index]:
    """A surface with at most so many points, all of them points of the given one.

    Points in one cell of a cubic grid become that of them which is nearest to their middle.

    Args:
        points: (s, 3) of a surface.
        triangles: (t, 3) its corners.
        n_max: most points that are kept, at least 4.

    Returns:
        (k,) numbers of the points that are kept, and (m, 3) triangles between them.

    Source:
        Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex scenes, in
        Modeling in Computer Graphics (1993) 455.
    """
    used, corners = np.unique(triangles, return_inverse=True)
    corners = corners.reshape(-1, 3)
    if len(used) <= n_max:
        return used, corners
    X = points[used]
    a, b, c = np.moveaxis(X[corners], 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    size = max(np.sqrt(area / n_max), 1e-9 * np.ptp(X), 1e-300)
    while len((cells := _cells(X, size))[0]) > n_max:
        size *= CELL_GROWTH
    nearest, cell = cells
    merged = cell[corners]
    a, b, c = merged.T
    merged = merged[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(merged, axis=1), axis=0, return_index=True)
    return used[nearest], merged[np.sort(first)]


def _cells(X: Array, size: float) -> tuple[Index, Index]:
    """The point nearest to the middle of those in each cell (k,), and the cell of each point."""
    grid = np.floor((X - X.min(axis=0)) / size).astype(np.int64)
    _, cell, count = np.unique(grid, axis=0, return_inverse=True, return_counts=True)
    cell = cell.ravel()
    middle = np.zeros((len(count), 3))
    np.add.at(middle, cell, X)
    far = np.linalg.norm(X - (middle / count[:, None])[cell], axis=1)
    order = np.lexsort((far, cell))
    return order[np.r_[0, np.cumsum(count)[:-1]]], cell


def array(values: Any, kind: str) -> dict[str, str]:
    """An array as text: its type, and its numbers in base 64, the lowest byte first."""
    data = np.ascontiguousarray(values, dtype=TYPES[kind]).tobytes()
    return {"type": kind, "data": base64.b64encode(data).decode("ascii")}


def corners(cells: Index, n_points: int) -> dict[str, str]:
    """Numbers of points, in 16 bit where these suffice."""
    return array(cells, "uint16" if n_points <= np.iinfo(np.uint16).max else "uint32")


def quantised_points(points: Array) -> dict[str, Any]:
    """Points (n, 3) = centre + step * values, the values of 16 bit."""
    low, high = points.min(axis=0), points.max(axis=0)
    centre, reach = 0.5 * (low + high), 0.5 * float((high - low).max())
    step = reach / MAX_INT16 or 1.0
    values = array(np.rint((points - centre) / step), "int16")
    return {"centre": centre.tolist(), "step": step, "values": values}


def quantised_column(column: Array) -> dict[str, Any]:
    """A column = scale * values, the values of 16 bit."""
    scale = float(np.abs(column).max(initial=0.0)) / MAX_INT16 or 1.0
    return {"scale": scale, "values": array(np.rint(column / scale), "int16")}
