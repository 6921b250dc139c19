"""The linear stiffness of a sheet summed side by side, in shares for several processes."""

import numpy as np
from scipy.sparse import csr_matrix

from rom.arguments import typed
from rom.components.assumed_strain.motion import Metal
from rom.components.assumed_strain.triangles import Sheet, constant_gradients, placed, sides_of
from rom.errors import ConfigError
from rom.model import Array, Index


@typed
def stiffness_by_sides(body: Sheet, metal: Metal, *, share: tuple[int, int] = (0, 1)) -> csr_matrix:
    """(2n, 2n) linear stiffness of the element "F3" where the sheet began [N/m].

    K = sum over sides of V/3 B^T D B, V the volume of the triangles at the side. Its gradient is
    theirs, averaged by area: the same as that of the four nodes in a patch. A side needs nothing
    but its triangles, so that processes can share the sides; their matrices add up to K.

    Args:
        body: a plane sheet; of its points and triangles, not of its element.
        metal: its material.
        share: (number of this process, number of processes).

    Raises:
        ConfigError: with axial symmetry, or for a share that does not exist.
        MeshError: if a triangle is turned over.

    Source:
        Edge-based smoothed elements: Liu, Nguyen-Thoi and Lam, J. Sound Vib. 320 (2009) 1100.
    """
    mine, of = share
    if not 0 <= mine < of or body.state == "axisymmetric":
        raise ConfigError(f"share {mine} of {of}, {body.state}: needed is a share of a plane one.")
    triangles, there = (rows[mine::of] for rows in _triangles_at_sides(body.triangles))
    G, area = constant_gradients(body.points, body.triangles)
    parts = area[triangles] * there
    whole = parts.sum(axis=1)
    gradient = (parts / whole[:, None])[..., None, None] * G[triangles, :3]
    B = _strains(gradient.reshape(-1, 6, 2))
    volume = whole / 3 * body.thickness
    K = np.swapaxes(B, 1, 2) @ (volume[:, None, None] * (_elasticity(body, metal) @ B))
    nodes = body.triangles[triangles].reshape(-1, 6)  # some twice: their entries add up
    dofs = (2 * nodes[:, :, None] + np.arange(2)).reshape(-1, 12)
    return placed(K, dofs, dofs, 2 * len(body.points))


def _triangles_at_sides(T: Index) -> tuple[Index, Array]:
    """(m, 2) triangles at each side, and whether they are there; at an edge one is named twice."""
    sides = np.sort(sides_of(T), axis=1)
    side = np.unique(sides, axis=0, return_inverse=True)[1].ravel()
    order, t = np.argsort(side, kind="stable"), np.tile(np.arange(len(T)), 3)
    first = np.flatnonzero(np.diff(side[order], prepend=-1))
    last = np.append(first[1:], side.size) - 1
    pair = np.column_stack([t[order[first]], t[order[last]]])
    return pair, np.column_stack([np.ones(len(pair)), last > first])


def _strains(gradient: Array) -> Array:
    """B (m, 3, 12) from gradients (m, 6, 2): strains along both axes, and the shear angle."""
    B = np.zeros((len(gradient), 3, 12))
    B[:, 0, ::2] = B[:, 2, 1::2] = gradient[..., 0]
    B[:, 1, 1::2] = B[:, 2, ::2] = gradient[..., 1]
    return B


def _elasticity(body: Sheet, metal: Metal) -> Array:
    """(3, 3) Hooke's law in the plane [Pa]."""
    E, nu = metal.E, metal.nu
    if body.state == "plane strain":
        E, nu = E / (1 - nu**2), nu / (1 - nu)
    return E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
