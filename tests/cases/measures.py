"""Areas and volumes of meshes."""

import numpy as np

from rom.fe.mesh.cell_types import jacobians


def areas(mesh):
    """Area of each named surface of straight triangles."""
    found = {}
    for name, rows in mesh.facets.items():
        a, b, c = np.moveaxis(mesh.points[rows[:, :3]], 1, 0)
        found[name] = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return found


def volume(mesh):
    """Volume by the quadrature points of the cells' own rule."""
    kind = mesh.kind
    n = kind.degree + 1
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = (x + 1) / 2, w / 2
    weights = np.array([a * b * c for a in w for b in w for c in w])
    if kind.shape == "tetrahedron":  # Jacobian of the collapsed cube
        u, v = np.repeat(x, n * n), np.tile(np.repeat(x, n), n)
        weights = weights * (1 - u) ** 2 * (1 - v)
    return float(
        (jacobians(mesh.points[mesh.cells], kind.gradients(kind.quadrature)) @ weights).sum()
    )
