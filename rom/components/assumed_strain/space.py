"""A flat sheet as a body in space: the triangle in its plane, bending without rotations across."""

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, identity, kron

from rom.components.assumed_strain.motion import Metal, mass, tangent
from rom.components.assumed_strain.triangles import Sheet
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, FEModel, Index, Interface, SurfaceMesh


def in_space(body: Sheet, metal: Metal, interfaces: dict[str, Index]) -> FEModel:
    """Stiffness and mass of a plane-stress sheet in the plane z = 0, free, for any reduction.

    Args:
        body: the sheet, plane stress.
        metal: its material.
        interfaces: {name: (k,) nodes} that hold whole triangles: a line could turn about itself.

    Raises:
        ConfigError: for another state than plane stress.
        InterfaceError: if the nodes of an interface contain no triangle.

    Source:
        Bending by a quadratic fitted to the patch of a triangle: Nay and Utku, An alternative
        for the finite element method, Variational Methods in Engineering (1972).
    """
    if body.state != "plane stress":
        raise ConfigError(f"a sheet in space is in plane stress, not {body.state}.")
    n = len(body.points)
    points = np.column_stack([body.points, np.zeros(n)])
    K = _placed(tangent(body, metal, body.points), (0, 1)) + _placed(bending(body, metal), (2,))
    M = kron(mass(body, metal)[::2, ::2], identity(3), "csr")
    faces = {name: _interface(name, np.unique(nodes), body, points)
             for name, nodes in interfaces.items()}  # fmt: skip
    surface = SurfaceMesh(np.arange(n), body.triangles)
    made = {"geometry": "sheet", "material": metal, "thickness [m]": body.thickness}
    return FEModel(K, M, points, faces, surface=surface, provenance=made)


def bending(body: Sheet, metal: Metal) -> csr_matrix:
    """(n, n) stiffness against deflection w [N/m], without rotations as unknowns.

    The curvature of a triangle is that of the quadratic through the nodes of its patch. At an edge,
    where nodes are missing, it is the one of least energy: the edge is free. Meshes with diagonals
    along one direction converge. Crossed ones do not, whatever their size: a uniform curvature has
    its energy, but its moments load inner nodes, and bending frequencies stay a fifth too low.

    Source:
        After Nay and Utku, who fit a quadratic to the patch by least squares.
    """
    X, size = body.points[body.patch], np.sqrt(body.area)[:, None]
    x, y = np.moveaxis((X - X[:, :3].mean(axis=1, keepdims=True)) / size[..., None], 2, 0)
    linear = np.stack([np.ones_like(x), x, y], axis=2)
    quadratic = np.stack([x * x / 2, y * y / 2, x * y / 2], axis=2)  # the last is twice the twist
    L = linear[:, 3:] @ np.linalg.inv(linear[:, :3])  # neighbours from the plane of the corners
    N = quadratic[:, 3:] - L @ quadratic[:, :3]
    above = np.concatenate([-L, np.broadcast_to(np.eye(3), L.shape)], axis=2)
    alone = body.patch[:, 3:] == body.triangles
    N[alone], above[alone] = 0.0, 0.0
    t, nu = body.thickness, metal.nu
    D = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    D *= metal.E * t**3 / 12 / (1 - nu**2)
    root = np.linalg.inv(np.linalg.cholesky(D).T)  # curvature = root y has the energy y^T y / 2
    Y = np.linalg.pinv(N @ root, rcond=1e-9) @ above / size[..., None]
    K = np.swapaxes(Y, 1, 2) @ Y  # the area cancels one power of the size in each factor
    rows, columns = np.repeat(body.patch, 6, axis=1).ravel(), np.tile(body.patch, (1, 6)).ravel()
    return coo_matrix((K.ravel(), (rows, columns)), shape=(len(body.points),) * 2).tocsr()


def _placed(A: csr_matrix, axes: tuple[int, ...]) -> csr_matrix:
    """A matrix of nodes times axes among the three dofs of each node in space."""
    n = A.shape[0] // len(axes)
    dofs = (3 * np.arange(n)[:, None] + np.array(axes)).ravel()
    A = A.tocoo()
    return coo_matrix((A.data, (dofs[A.row], dofs[A.col])), shape=(3 * n,) * 2).tocsr()


def _interface(name: str, nodes: Index, body: Sheet, points: Array) -> Interface:
    inside = np.isin(body.triangles, nodes).all(axis=1)
    if not inside.any():
        raise InterfaceError(
            f"interface {name!r} has no triangle among its {nodes.size} nodes: a line could turn "
            "about itself.",
            hint="Add the next row of nodes.",
        )
    T, area = np.searchsorted(nodes, body.triangles[inside]), body.area[inside]
    data = (area[:, None, None] / 12 * (1 + np.eye(3))).ravel()
    place = (np.repeat(T, 3, axis=1).ravel(), np.tile(T, (1, 3)).ravel())
    S = coo_matrix((data, place), shape=(nodes.size,) * 2).tocsr()
    origin = S.sum(axis=0) @ points[nodes] / S.sum()
    return Interface(name, nodes, points[nodes], S, np.asarray(origin).ravel())
