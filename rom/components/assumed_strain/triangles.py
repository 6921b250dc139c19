"""Meshes of triangles, and the gradients at the middles of their sides.

Source:
    Flores, A two-dimensional linear assumed strain triangular element for finite deformation
    analysis, J. Appl. Mech. 73 (2006) 970.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix, csr_matrix

from rom.arguments import Count, Length, Number, check_places, finite, shortened, typed
from rom.errors import ConfigError, MeshError
from rom.model import Array, Index, Mask

STATES = {"plane stress": 0, "plane strain": 1, "axisymmetric": 2}
Divisions = Annotated[int, Count(1)]  # of a side
LARGEST_WHOLE = 2**53  # up to which floats tell all whole numbers apart


@dataclass(frozen=True, slots=True)
class Sheet:
    """Triangles with the gradients of their patches; dof 2*node + axis (axis 0 is the radius).

    Attributes:
        points: (n, 2) initial coordinates [m].
        triangles: (t, 3) corners, counter-clockwise.
        patch: (t, 6) corners and the neighbours opposite to them; a corner where there is none.
        gradients: (t, p, s, 6, 2) of the patch functions; p points of s sides whose metric is
            averaged [1/m].
        weights: (t, p) volume of each point [m^3]; per radian 2 pi R for axial symmetry.
        area: (t,) areas [m^2].
        state: "plane stress", "plane strain" or "axisymmetric".
        thickness: initial thickness [m].
    """

    points: Array
    triangles: Index
    patch: Index
    gradients: Array
    weights: Array
    area: Array
    state: str
    thickness: float

    @property
    def radius(self) -> Array:
        """(t,) radius of each centroid [m]; infinite without axial symmetry."""
        if self.state != "axisymmetric":
            return np.full(len(self.triangles), np.inf)
        return self.points[self.triangles, 0].mean(axis=1)


@typed
def sheet(
    points: npt.ArrayLike,
    triangles: npt.ArrayLike,
    *,
    element: Literal["CST", "F1", "F3"] = "F3",
    state: Literal["plane stress", "plane strain", "axisymmetric"] = "plane stress",
    thickness: Length = 1.0,
) -> Sheet:
    """Prepare a mesh.

    Args:
        points: (n, 2) coordinates [m].
        triangles: (t, 3) corners, numbers of points, counter-clockwise.
        element: "F3", of three points, for elastic and modal work, "F1", of one point of mean
            metric, for plastic flow without locking, "CST", of constant strain.
        state: "plane stress", "plane strain" or "axisymmetric" (first axis is the radius).
        thickness: of a plane solid [m].

    Raises:
        MeshError: if a triangle is turned over or names no point, a point has no triangle, a side
            belongs to three, or a radius is negative.
    """
    X, T = finite("points", points, None), whole_numbers("triangles", triangles)
    _refuse_no_mesh(X, T, state)
    constant, area = constant_gradients(X, T)
    patch = np.hstack([T, _opposite(T)])
    loose = np.setdiff1d(np.arange(len(X)), T)
    if loose.size:
        text = f"{loose.size} of {len(X)} points belong to no triangle"
        raise MeshError(f"{text}, the first is {loose[0]}.")
    G = np.stack([_side_gradients(X, patch, constant, k) for k in range(3)], axis=1)
    G = {"CST": constant[:, None, None], "F1": G[:, None], "F3": G[:, :, None]}[element]
    alone = patch < 0
    patch = np.where(alone, np.hstack([T, T]), patch)
    depth = 2 * np.pi * X[T, 0].mean(axis=1) if state == "axisymmetric" else thickness
    weights = np.repeat((area * depth / G.shape[1])[:, None], G.shape[1], axis=1)
    return Sheet(X, T, patch, np.ascontiguousarray(G), weights, area, state, thickness)


def whole_numbers(
    name: str, value: npt.ArrayLike, shape: tuple[int | None, ...] | None = None
) -> Index:
    """Whole numbers, which counts of nodes or dofs are, of a shape; True and False are none."""
    found = finite(name, value, shape)
    if np.any(found % 1) or np.abs(found).max(initial=0.0) > LARGEST_WHOLE:
        text = f"{name} = {shortened(value)}: numbers of nodes or dofs are whole, 2^53 at most"
        raise ConfigError(f"{text}; np.flatnonzero makes them of a condition.")
    return found.astype(np.int64)


def _refuse_no_mesh(X: Array, T: Index, state: str) -> None:
    if X.ndim != 2 or X.shape[1] != 2 or T.ndim != 2 or T.shape[1] != 3 or not len(T):
        raise MeshError(f"points {X.shape} and triangles {T.shape} must be (n, 2) and (t, 3).")
    check_places("triangles: nodes", T, len(X), error=MeshError)
    r = X[:, 0]
    if state == "axisymmetric" and r.min() < 0:
        raise MeshError(f"the first coordinate, {r.min():.3g} m of node {r.argmin()}, is a radius.")


def constant_gradients(X: Array, T: Index) -> tuple[Array, Array]:
    """Gradients (t, 6, 2) of the linear triangle, neighbours zero, and areas (t,)."""
    a, b, c = X[T[:, 0]], X[T[:, 1]], X[T[:, 2]]
    area = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    if not area.min() > 0:
        text = f"triangle {int(area.argmin())} has the area {area.min():.3g} m^2."
        raise MeshError(text, hint="Number its corners counter-clockwise.")
    G = np.zeros((len(T), 6, 2))
    for k, side in enumerate((c - b, a - c, b - a)):
        G[:, k] = np.column_stack([-side[:, 1], side[:, 0]]) / (2 * area[:, None])
    return G, area


def placed(A: Array, rows: Index, columns: Index, n: int) -> csr_matrix:
    """Small matrices (k, r, c) added at rows (k, r) and columns (k, c) of one (n, n)."""
    i, j = np.repeat(rows, columns.shape[1], axis=1), np.tile(columns, (1, rows.shape[1]))
    return coo_matrix((A.ravel(), (i.ravel(), j.ravel())), shape=(n, n)).tocsr()


def sides_of(T: Index) -> Index:
    """(3 t, 2) nodes of the sides opposite to the first corners, then the second, then the third.

    The triangle is on the left of its sides.
    """
    return np.vstack([T[:, [1, 2]], T[:, [2, 0]], T[:, [0, 1]]])


def each_side(T: Index) -> tuple[Index, Index, Index, Mask]:
    """Each of s sides once: its ends, the sides of triangles, where it is, and which are inner.

    Ends (s, 2) ascend; (t, 3) is the side opposite to each corner; (s, 2) are its places among
    `sides_of`, one place twice at an edge.
    """
    every = np.sort(sides_of(T), axis=1)
    ends, side, count = np.unique(every, axis=0, return_inverse=True, return_counts=True)
    if count.max() > 2:
        raise MeshError(f"a side belongs to {count.max()} triangles; at most two may meet.")
    last = np.cumsum(count) - 1
    places = np.argsort(side.ravel(), kind="stable")[np.column_stack([last - count + 1, last])]
    return ends, side.reshape(3, len(T)).T, places, count == 2


def _opposite(T: Index) -> Index:
    """(t, 3) the node behind the side opposite to each corner; -1 on the boundary."""
    _, _, places, inner = each_side(T)
    found = np.full(T.size, -1)
    found[places[inner]] = T.T.ravel()[places[inner][:, ::-1]]
    return found.reshape(3, len(T)).T


def _side_gradients(X: Array, patch: Index, constant: Array, k: int) -> Array:
    """(t, 6, 2) at the middle of the side opposite to corner k.

    Only the two triangles at the side matter: f,xi = (-f1 + f2 - f3 + f4) / 2 and f,eta likewise.
    """
    own = [k, (k + 1) % 3, (k + 2) % 3, 3 + k]
    local = 0.5 * np.array([[-1.0, 1, -1, 1], [-1, -1, 1, 1]])
    whole = patch[:, 3 + k] >= 0
    J = local @ X[patch[whole][:, own]]
    G = constant.copy()
    G[whole] = 0.0
    inside = np.zeros((whole.sum(), 6, 2))
    inside[:, own] = np.swapaxes(np.linalg.solve(J, np.broadcast_to(local, (len(J), 2, 4))), 1, 2)
    G[whole] = inside
    return G


@typed
def rectangle(
    n: tuple[Divisions, Divisions],
    corners: Annotated[npt.ArrayLike, Number("m", (4, 2))],
    diagonal: Literal["/", "\\", "x"] = "/",
) -> tuple[Array, Index]:
    """Points (m, 2) [m] and triangles (t, 3) of a quadrilateral of corners (4, 2) [m].

    Corners go counter-clockwise, n are divisions along the first and the second side. Rows of
    points follow each other from the first side to the third; quadrilaterals are split by "/", by
    the other diagonal, or by both with "x".
    """
    s, t = (np.linspace(0, 1, k + 1) for k in n)
    a, b = (x.ravel() for x in np.meshgrid(s, t))
    shares = np.column_stack([(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b])
    X = shares @ np.asarray(corners, dtype=float)
    i = (np.arange(n[1])[:, None] * (n[0] + 1) + np.arange(n[0])).ravel()
    p, q, r, u = i, i + 1, i + n[0] + 2, i + n[0] + 1
    if diagonal == "x":
        m = len(X) + np.arange(i.size)
        X = np.vstack([X, (X[p] + X[q] + X[r] + X[u]) / 4])
        parts = [(p, q, m), (q, r, m), (r, u, m), (u, p, m)]
    else:
        parts = [(p, q, r), (p, r, u)] if diagonal == "/" else [(p, q, u), (q, r, u)]
    return X, np.vstack([np.column_stack(part) for part in parts])
