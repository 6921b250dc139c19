"""A flat sheet as a body in space: the triangle in its plane, bending without rotations across."""

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, identity, kron

from rom.arguments import typed
from rom.components.assumed_strain.motion import Metal, mass, tangent
from rom.components.assumed_strain.plates import bending
from rom.components.assumed_strain.triangles import Sheet, placed
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, FEModel, Index, Interface, SurfaceMesh


@typed
def in_space(body: Sheet, metal: Metal, interfaces: dict[str, Index]) -> FEModel:
    """Stiffness and mass of a plane-stress sheet in the plane z = 0, free, for any reduction.

    Args:
        body: the sheet, plane stress.
        metal: its material.
        interfaces: {name: (k,) nodes} that hold whole triangles: a line could turn about itself.

    Raises:
        ConfigError: for another state than plane stress.
        InterfaceError: if the nodes of an interface contain no triangle or do not exist.

    Source:
        Bending: Morley, Aero. Quart. 19 (1968) 149, with fitted slopes as `plates` says.
    """
    if body.state != "plane stress":
        raise ConfigError(f"a sheet in space must be in plane stress, not {body.state}.")
    n, parts = len(body.points), tuple(np.unique(nodes) for nodes in interfaces.values())
    points = np.column_stack([body.points, np.zeros(n)])
    K = _placed(tangent(body, metal, body.points), (0, 1)) + _placed(
        bending(body, metal, parts), (2,)
    )
    M = kron(mass(body, metal)[::2, ::2], identity(3), "csr")
    faces = {name: _interface(name, nodes, body, points)
             for name, nodes in zip(interfaces, parts, strict=True)}  # fmt: skip
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
    if nodes.size and not 0 <= nodes[0] <= nodes[-1] < len(points):
        raise InterfaceError(
            f"interface {name!r} names the nodes {nodes[0]} to {nodes[-1]}; "
            f"there are {len(points)} points.",
            hint="Count nodes from zero.",
        )
    inside = np.isin(body.triangles, nodes).all(axis=1)
    if not inside.any():
        raise InterfaceError(
            f"interface {name!r} has no triangle among its {nodes.size} nodes: a line could turn "
            "about itself.",
            hint="Add the next row of nodes.",
        )
    T, area = np.searchsorted(nodes, body.triangles[inside]), body.area[inside]
    S = placed(area[:, None, None] / 12 * (1 + np.eye(3)), T, T, nodes.size)
    origin = S.sum(axis=0) @ points[nodes] / S.sum()
    return Interface(name, nodes, points[nodes], S, np.asarray(origin).ravel())
