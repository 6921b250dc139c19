"""Surfaces made small enough for a page: fewer points, numbers of 16 bit."""

import base64

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix

from rom.model import Array, Index, Mask
from rom.view.canvas.scene import directed_edges

MAX_INT16 = np.iinfo(np.int16).max
TYPES = {"int16": "<i2", "uint16": "<u2", "uint32": "<u4", "float32": "<f4"}
CELL_GROWTH = 1.1
MOST_COLLAPSED = 10  # times the wanted number of points: more are put together in cells first
EVENNESS_RATIO = 0.01  # weight of the squared way of a point against its distance from planes
LEAST_HEIGHT = 0.02  # of a triangle that changes, over its longer side
LEAST_COSINE = 0.2  # between the normals of a triangle before and after


def coarsened(points: Array, triangles: Index, n_max: int) -> tuple[Index, Index]:
    """A surface with at most so many points, all of them points of the given one.

    One end of an edge moves into the other where that changes the shape least, which is measured
    by the squared distances from the planes of the triangles; many edges at once, far from each
    other. So edges of the body stay sharp, and flat faces keep points to bend by. What is far too
    fine is first put together in the cells of a cubic grid, and so is what has no such edge left.
    Given back are the numbers (k,) of the points that are kept and the triangles (m, 3) of these.

    Source:
        Garland and Heckbert, Surface simplification using quadric error metrics, SIGGRAPH 97
        (1997) 209; Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex
        scenes, in Modeling in Computer Graphics (1993) 455.
    """
    kept, found = _used(np.arange(len(points)), triangles)
    if len(kept) <= n_max:
        return kept, found
    size = max(float(np.ptp(points[kept], axis=0).max()), 1e-300)
    X = (points - points[kept].mean(axis=0)) / size
    kept, found = _clustered(X, kept, found, MOST_COLLAPSED * n_max)
    kept, found = _collapsed(X, kept, found, n_max)
    return _clustered(X, kept, found, n_max)


def _used(kept: Index, triangles: Index) -> tuple[Index, Index]:
    """The points triangles use, and the triangles by the places of these."""
    used, corners = np.unique(triangles, return_inverse=True)
    return kept[used], corners.reshape(-1, 3)


def _collapsed(X: Array, kept: Index, triangles: Index, n_max: int) -> tuple[Index, Index]:
    """Move ends of edges into each other, round by round, until few enough points are left."""
    Q, area = _quadrics(X[kept], triangles)
    while (excess := len(kept) - n_max) > 0:
        gone, into = _cheapest(X[kept], triangles, Q, area)
        if not len(gone):
            break
        gone, into = gone[:excess], into[:excess]
        np.add.at(Q, into, Q[gone])
        np.add.at(area, into, area[gone])
        target = np.arange(len(kept))
        target[gone] = into
        left = np.delete(np.arange(len(kept)), gone)
        kept, triangles = _used(kept, _whole(target[triangles]))
        if len(kept) != len(left):  # a piece of the surface has vanished
            return kept, triangles
        Q, area = Q[left], area[left]
    return kept, triangles


def _whole(triangles: Index) -> Index:
    """Triangles with three corners, each once."""
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    return triangles[np.sort(first)]


def _quadrics(X: Array, triangles: Index) -> tuple[Array, Array]:
    """(n, 4, 4) squared distances from the planes of the triangles around each point, and area."""
    a, b, c = np.moveaxis(X[triangles], 1, 0)
    twice = np.cross(b - a, c - a)
    area = 0.5 * np.linalg.norm(twice, axis=1)
    normal = 0.5 * twice / np.maximum(area, 1e-300)[:, None]
    plane = np.column_stack([normal, -np.einsum("ij,ij->i", normal, a)])
    of_triangle = area[:, None, None] * plane[:, :, None] * plane[:, None, :]
    Q, around = np.zeros((len(X), 4, 4)), np.zeros(len(X))
    for corner in triangles.T:
        np.add.at(Q, corner, of_triangle)
        np.add.at(around, corner, area)
    return Q, around


def _error(Q: Array, area: Array, x: Array, moved: Array) -> Array:
    """What it costs to stand at x (m, 3), which is so far (m, 3) from where one stood."""
    at = np.column_stack([x, np.ones(len(x))])
    off = np.einsum("mi,mij,mj->m", at, Q, at)
    return off + EVENNESS_RATIO * area * np.einsum("mi,mi->m", moved, moved)


def _cheapest(X: Array, triangles: Index, Q: Array, area: Array) -> tuple[Index, Index]:
    """Points that may go at once, the cheapest first, and the neighbour each moves into."""
    n = len(X)
    pairs, _ = directed_edges(triangles)
    count = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(n, n)).tocsr()
    count = count + count.T  # triangles at each edge
    common = count.astype(bool).astype(int)
    common = (common @ common).multiply(common).tocsr()  # neighbours of both ends
    u, v = common.nonzero()
    fixed = np.zeros(n, dtype=bool)  # where the surface ends or branches
    rows, columns = count.nonzero()
    fixed[rows[np.asarray(count[rows, columns]).ravel() != 2]] = True
    free = (np.asarray(common[u, v]).ravel() == 2) & ~fixed[u]
    u, v = u[free], v[free]
    cost = _error(Q[u] + Q[v], area[u], X[v], X[u] - X[v])
    order = np.lexsort((cost, u))
    u, v, cost = u[order], v[order], cost[order]
    first = np.flatnonzero(np.r_[True, u[1:] != u[:-1]][: len(u)])
    into, price = np.arange(n), np.full(n, np.inf)
    into[u[first]], price[u[first]] = v[first], cost[first]
    price[_turned_over(X, triangles, into)] = np.inf
    rank = np.full(n, n)
    able = np.flatnonzero(np.isfinite(price))
    able = able[np.argsort(price[able], kind="stable")]
    rank[able] = np.arange(len(able))
    near = _least(_least(rank, pairs), pairs)
    gone = able[near[able] == rank[able]]
    return gone, into[gone]


def _least(values: Index, pairs: Index) -> Index:
    """(n,) the least of the values of each point and its neighbours."""
    found = values.copy()
    np.minimum.at(found, pairs[:, 0], values[pairs[:, 1]])
    np.minimum.at(found, pairs[:, 1], values[pairs[:, 0]])
    return found


def _turned_over(X: Array, triangles: Index, into: Index) -> Mask:
    """(n,) whether a point would turn a triangle over, or flatten it, by moving where it may."""
    found = np.zeros(len(X), dtype=np.bool_)
    for k in range(3):
        u, a, b = np.roll(triangles, -k, axis=1).T
        v = into[u]
        stays = (v != a) & (v != b) & (v != u)
        u, v, a, b = u[stays], v[stays], a[stays], b[stays]
        old, new = (np.cross(X[a] - X[w], X[b] - X[w]) for w in (u, v))
        before, after = (np.linalg.norm(normal, axis=1) for normal in (old, new))
        longest = np.maximum(*(np.linalg.norm(X[end] - X[v], axis=1) for end in (a, b)))
        turned = np.einsum("ij,ij->i", old, new) <= LEAST_COSINE * before * after
        found[u[turned | (after < LEAST_HEIGHT * longest**2)]] = True
    return found


def _clustered(X: Array, kept: Index, triangles: Index, n_max: int) -> tuple[Index, Index]:
    """Points in one cell of a cubic grid become that of them which changes the shape least."""
    if len(kept) <= n_max:
        return kept, triangles
    Q, area = _quadrics(X[kept], triangles)
    size = max(np.sqrt(area.sum() / 3 / n_max), 1e-9)
    while (cell := _cells(X[kept], size)).max() >= n_max:
        size *= CELL_GROWTH
    n, count = cell.max() + 1, np.bincount(cell)
    middle, quadric, whole = np.zeros((n, 3)), np.zeros((n, 4, 4)), np.zeros(n)
    for total, values in ((middle, X[kept]), (quadric, Q), (whole, area)):
        np.add.at(total, cell, values)
    away = X[kept] - (middle / count[:, None])[cell]
    order = np.lexsort((_error(quadric[cell], whole[cell], X[kept], away), cell))
    best = order[np.r_[0, np.cumsum(count)[:-1]]]
    return _used(kept[best], _whole(cell[triangles]))


def _cells(X: Array, size: float) -> Index:
    """(n,) number of the cell of a grid in which each point is."""
    grid = np.floor((X - X.min(axis=0)) / size).astype(np.int64)
    return np.unique(grid, axis=0, return_inverse=True)[1].ravel()


def array(values: npt.ArrayLike, kind: str) -> dict[str, str]:
    """An array as text: its type, and its numbers in base 64, the lowest byte first."""
    data = np.ascontiguousarray(values, dtype=TYPES[kind]).tobytes()
    return {"type": kind, "data": base64.b64encode(data).decode("ascii")}


def corners(cells: Index, n_points: int) -> dict[str, str]:
    """Numbers of points, in 16 bit where these suffice."""
    return array(cells, "uint16" if n_points <= np.iinfo(np.uint16).max else "uint32")


def quantised_points(points: Array) -> dict[str, object]:
    """Points (n, 3) = centre + step * values, the values of 16 bit."""
    low, high = points.min(axis=0), points.max(axis=0)
    centre, reach = 0.5 * (low + high), 0.5 * float((high - low).max())
    step = reach / MAX_INT16 or 1.0
    values = array(np.rint((points - centre) / step), "int16")
    return {"centre": centre.tolist(), "step": step, "values": values}


def quantised_column(column: Array) -> dict[str, object]:
    """A column = scale * values, the values of 16 bit."""
    scale = float(np.abs(column).max(initial=0.0)) / MAX_INT16 or 1.0
    return {"scale": scale, "values": array(np.rint(column / scale), "int16")}
