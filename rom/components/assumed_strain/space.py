"""A flat sheet as a body in space: the triangle in its plane, Morley's plate across.

Morley's triangle has the deflections of its corners and the normal slopes at the middles of its
sides; it converges on every mesh. Here the slope of an inner side is that of a quadratic fitted to
the nodes around it, and a slope at a free edge is the one of least energy. What is left is a part
of Morley's space that holds every quadratic, so that it converges as well, and nothing but a plane
is free of energy.

Source:
    Morley, The triangular equilibrium element in the solution of plate bending problems, Aero.
    Quart. 19 (1968) 149. Slopes from the nodes around: after Nay and Utku, An alternative for the
    finite element method, Variational Methods in Engineering (1972).
"""

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, eye, identity, kron, vstack

from rom.arguments import check_places, typed
from rom.components.assumed_strain.motion import Metal, mass, tangent
from rom.components.assumed_strain.triangles import Sheet, each_side, placed
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, FEModel, Index, Interface, Mask, SurfaceMesh


@typed
def in_space(body: Sheet, metal: Metal, interfaces: dict[str, Index]) -> FEModel:
    """Stiffness and mass of a plane-stress sheet in the plane z = 0, free, for any reduction.

    The sheet is in plane stress; interfaces {name: (k,) nodes} hold whole triangles: a line could
    turn about itself.

    Raises:
        ConfigError: for another state than plane stress.
        InterfaceError: if the nodes of an interface contain no triangle or do not exist.

    Source:
        Bending: Morley, Aero. Quart. 19 (1968) 149, with fitted slopes as `bending` says.
    """
    if body.state != "plane stress":
        raise ConfigError(f"a sheet in space must be in plane stress, not {body.state}.")
    n, parts = len(body.points), tuple(np.unique(nodes) for nodes in interfaces.values())
    points = np.column_stack([body.points, np.zeros(n)])
    K = _placed(tangent(body, metal, body.points), (0, 1))
    K += _placed(bending(body, metal, parts), (2,))
    M = kron(mass(body, metal)[::2, ::2], identity(3), "csr")
    each = zip(interfaces, parts, strict=True)
    faces = {name: _interface(name, nodes, body, points) for name, nodes in each}
    surface = SurfaceMesh(np.arange(n), body.triangles)
    made = {"geometry": "sheet", "material": metal, "thickness [m]": body.thickness}
    return FEModel(K, M, points, faces, surface=surface, provenance=made)


def _placed(A: csr_matrix, axes: tuple[int, ...]) -> csr_matrix:
    """A matrix of nodes times axes among the three dofs of each node in space."""
    n = A.shape[0] // len(axes)
    dofs = (3 * np.arange(n)[:, None] + np.array(axes)).ravel()
    A = A.tocoo()
    return coo_matrix((A.data, (dofs[A.row], dofs[A.col])), shape=(3 * n,) * 2).tocsr()


def _interface(name: str, nodes: Index, body: Sheet, points: Array) -> Interface:
    check_places(f"nodes of interface {name!r}:", nodes, len(points), error=InterfaceError)
    inside = np.isin(body.triangles, nodes).all(axis=1)
    if not inside.any():
        text = f"interface {name!r} has no triangle among its {nodes.size} nodes"
        raise InterfaceError(f"{text}; add the next row.")
    T, area = np.searchsorted(nodes, body.triangles[inside]), body.area[inside]
    S = placed(area[:, None, None] / 12 * (1 + np.eye(3)), T, T, nodes.size)
    origin = S.sum(axis=0) @ points[nodes] / S.sum()
    return Interface(name, nodes, points[nodes], S, np.asarray(origin).ravel())


QUADRATIC_RTOL = 1e-3  # least singular value of a fit, relative: below, its nodes lie on a conic


def bending(body: Sheet, metal: Metal, parts: tuple[Index, ...] = ()) -> csr_matrix:
    """(n, n) stiffness against deflection w [N/m], without rotations as unknowns; edges are free.

    Frequencies err by h^2 on any mesh. Parts are nodes (k,) moved or held as one; slopes of their
    sides are fitted to their own nodes, so that a held part clamps the sheet where it ends.
    """
    n = len(body.points)
    ends, side, places, inner = each_side(body.triangles)
    B, normal = _curvatures(body, ends, side)
    nu, D = metal.nu, metal.E * body.thickness**3 / 12 / (1 - metal.nu**2)
    law = D * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    K = np.swapaxes(B, 1, 2) @ (law * body.area[:, None, None]) @ B
    for t in np.flatnonzero(~inner[side].all(axis=1)):
        _free_slopes(K[t], 3 + np.flatnonzero(~inner[side[t]]))
    dofs = np.hstack([body.triangles, n + side])
    whole = placed(K, dofs, dofs, n + len(ends))
    slopes = vstack([eye(n), _fitted_slopes(body, side, places, inner, normal, parts)], "csr")
    return (slopes.T @ whole @ slopes).tocsr()


def _curvatures(body: Sheet, ends: Index, side: Index) -> tuple[Array, Array]:
    """Curvature B (t, 3, 6) of three deflections and three slopes; unit normals (s, 2) of sides.

    The mean second derivative is the sum over sides of normal (x) gradient, times length / area.
    """
    X, T = body.points, body.triangles
    along = X[ends[:, 1]] - X[ends[:, 0]]
    normal = np.column_stack([along[:, 1], -along[:, 0]])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    B = np.zeros((len(T), 3, 6))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        tangent = X[T[:, j]] - X[T[:, i]]
        length = np.linalg.norm(tangent, axis=1)[:, None]
        tangent /= length
        out = np.column_stack([tangent[:, 1], -tangent[:, 0]])
        B[:, :, 3 + k] = _second(out, normal[side[:, k]]) * length / body.area[:, None]
        change = _second(out, tangent) / body.area[:, None]
        B[:, :, i] -= change
        B[:, :, j] += change
    return B, normal


def _second(a: Array, b: Array) -> Array:
    """(t, 3) curvatures 11, 22 and twice 12 of normal times gradient."""
    return np.column_stack([a[:, 0] * b[:, 0], a[:, 1] * b[:, 1], (a[:, ::-1] * b).sum(axis=1)])


def _free_slopes(K: Array, free: Index) -> None:
    """Slopes at an edge of the sheet take their least energy; K (6, 6) in place."""
    K -= K[:, free] @ np.linalg.pinv(K[np.ix_(free, free)], rcond=1e-12) @ K[free]
    K[free], K[:, free] = 0.0, 0.0


def _fitted_slopes(
    body: Sheet, side: Index, places: Index, inner: Mask, normal: Array, parts: tuple[Index, ...]
) -> csr_matrix:
    """(s, n) normal slope of each inner side from deflections [1/m]; nothing at an edge."""
    e, X, two = np.flatnonzero(inner), body.points, places[inner] % len(body.triangles)
    near = np.sort(body.patch[two].reshape(-1, 12), axis=1)
    there = np.diff(near, axis=1, prepend=-1) > 0
    part = _part_of_sides(body, side, parts)[e]
    own = np.ones((len(parts) + 1, len(X)), dtype=bool)
    for k, nodes in enumerate(parts):
        own[k] = np.isin(np.arange(len(X)), nodes)
    there &= own[part[:, None], near]
    one, other = np.moveaxis(body.triangles[two], 1, 0)
    ends = X[one[(one[:, :, None] == other[:, None]).any(axis=2)].reshape(-1, 2)]
    middle = ends.mean(axis=1)
    size = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    slope, exact = _fit((X[near] - middle[:, None]) / size[:, None, None], there, normal[e])
    slope[~exact] = 0.0
    place = [(np.repeat(e, 12), near.ravel(), (slope / size[:, None]).ravel())]
    at = (np.repeat(np.arange(len(body.triangles)), 3), body.triangles.ravel())
    of = coo_matrix((np.ones(at[0].size), at), shape=(len(body.triangles), len(X))).tocsr()
    joined = (of.T @ of).tocsr()  # nodes that share a triangle
    for k in np.flatnonzero(~exact):
        found = _wider_fit(X, joined, own[part[k]], near[k][there[k]], middle[k], normal[e[k]])
        place.append((np.full(found[0].size, e[k]), *found))
    rows, columns, values = (np.concatenate(each) for each in zip(*place, strict=True))
    return coo_matrix((values, (rows, columns)), shape=(len(inner), len(X))).tocsr()


def _part_of_sides(body: Sheet, side: Index, parts: tuple[Index, ...]) -> Index:
    """(s,) the part that has a whole triangle at the side; -1 for none."""
    part = np.full(side.max() + 1, -1)
    for k, nodes in enumerate(parts):
        part[side[np.isin(body.triangles, nodes).all(axis=1)]] = k
    return part


def _wider_fit(
    X: Array, joined: csr_matrix, own: Array, nodes: Index, middle: Array, normal: Array
) -> tuple[Index, Array]:
    """Nodes and their share in the slope [1/m]; rows of neighbours join until a quadratic fits."""
    size = np.linalg.norm(X[nodes] - middle, axis=1).min()
    while True:
        x = (X[nodes] - middle) / size
        slope, exact = _fit(x[None], np.ones((1, nodes.size), dtype=bool), normal[None])
        more = np.unique(joined[nodes].indices)
        more = more[own[more]]
        if exact[0] or more.size == nodes.size:
            return nodes, slope[0] / size
        nodes = more


def _fit(x: Array, there: Mask, normal: Array) -> tuple[Array, Mask]:
    """Shares (s, k) of nodes in the slope at the origin, and whether quadratics are exact.

    Least squares, near nodes weighing more. A plane is exact also where a quadratic cannot be.
    """
    weight = np.exp(-0.5 * (x**2).sum(axis=2)) * there
    plane = np.concatenate([np.ones_like(x[..., :1]), x], axis=2) * weight[..., None]
    a, b = x[..., 0], x[..., 1]
    second = np.stack([a * a / 2, b * b / 2, a * b], axis=2) * weight[..., None]
    of_plane = np.linalg.pinv(plane)
    rest = second - plane @ (of_plane @ second)
    values = np.linalg.svd(rest, compute_uv=False)
    exact = values[:, -1] > QUADRATIC_RTOL * values[:, 0]
    of_second = np.linalg.pinv(rest, rcond=QUADRATIC_RTOL)
    data = of_plane @ (np.eye(x.shape[1]) - second @ of_second)
    return (normal[:, None, :] @ data[:, 1:])[:, 0] * weight, exact
