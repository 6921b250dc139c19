"""Weak forms of a solid, whole or region by region, and their matrices."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import ufl

from rom.fe.compat import assemble_matrix, cell_dofs, cell_name, geometry_degree
from rom.fe.forms.material import Solid, of_region, stress
from rom.fe.forms.stress import Stresses
from rom.fe.jit import compiling
from rom.fe.operators.aij import symmetric, wrapped
from rom.model import Array, Index, Layered, Region

LAYER_GAP_RTOL = 1e-9  # of the extent: gap between cells of one layer


class Regions(Mapping[str, Region]):
    """Shares of the regions, assembled when they are asked for; on all ranks together.

    Args:
        V: displacement space.
        tags: (cells of this rank with ghosts,) region of each cell.
        solids: {tag: material}.
        names: {region: tag}.
        degree: of the displacement.
    """

    def __init__(
        self, V: Any, tags: Index, solids: dict[int, Solid], names: dict[str, int], degree: int
    ):
        self.V, self.tags, self.solids, self.names, self.degree = V, tags, solids, names, degree

    def __getitem__(self, name: str) -> Region:
        mesh, tag = self.V.mesh, self.names[name]
        with compiling(mesh.comm):
            numbers = of_region(mesh, self.tags, self.solids, tag)
            K, M = (assemble_matrix(form) for form in forms(self.V, numbers, self.degree))
        if mesh.comm.size == 1:
            K, M = (wrapped(symmetric(A)) for A in (K, M))
        stresses = Stresses(self.V, numbers, self.degree)
        return Region(K, M, stresses, lambda axis: self._stretched(tag, numbers, axis))

    def _stretched(self, tag: int, numbers: dict[str, Any], axis: int) -> Layered:
        mesh = self.V.mesh
        with compiling(mesh.comm):
            split = stretched_forms(self.V, numbers, self.degree, axis)
            parts = [assemble_matrix(form) for form in split]
        if mesh.comm.size == 1:
            parts = [wrapped(symmetric(A)) for A in parts]
        return Layered(self._layers(tag, axis), *parts)

    def _layers(self, tag: int, axis: int) -> tuple[tuple[float, float], ...]:
        """Extent of the region along an axis, cells that touch joined; equal on all ranks."""
        mesh = self.V.mesh
        n = mesh.topology.index_map(3).size_local
        own = np.flatnonzero(self.tags[:n] == tag)
        x = self.V.tabulate_dof_coordinates()[cell_dofs(self.V)[own]][:, :, axis]
        ends = np.column_stack([x.min(axis=1), x.max(axis=1)]) if own.size else np.zeros((0, 2))
        return joined(np.vstack(mesh.comm.allgather(np.unique(ends, axis=0))))

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


def forms(V: Any, numbers: dict[str, Any], degree: int) -> tuple[ufl.Form, ufl.Form]:
    """Stiffness and mass; quadrature exact on straight cells, more than enough on curved ones."""
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    q_K, q_M = _quadrature(cell_name(V.mesh), degree, geometry_degree(V.mesh))
    dx = ufl.Measure("dx", domain=V.mesh)
    sigma = stress(ufl.sym(ufl.grad(u)), numbers)
    K = ufl.inner(sigma, ufl.sym(ufl.grad(v))) * dx(metadata={"quadrature_degree": q_K})
    M = numbers["rho"] * ufl.inner(u, v) * dx(metadata={"quadrature_degree": q_M})
    return K, M


def stretched_forms(
    V: Any, numbers: dict[str, Any], degree: int, axis: int
) -> tuple[ufl.Form, ufl.Form, ufl.Form]:
    """Stiffness split by whether strains come from derivatives along an axis; see `Layered`."""
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    q_K, _ = _quadrature(cell_name(V.mesh), degree, geometry_degree(V.mesh))
    dx = ufl.Measure("dx", domain=V.mesh, metadata={"quadrature_degree": q_K})
    P = ufl.as_matrix([[float(i == j == axis) for j in range(3)] for i in range(3)])

    def strains(w: Any) -> tuple[Any, Any]:
        across = ufl.sym(ufl.dot(ufl.grad(w), P))
        return ufl.sym(ufl.grad(w)) - across, across

    (a, c), (b, d) = strains(u), strains(v)
    mixed = ufl.inner(stress(a, numbers), d) + ufl.inner(stress(c, numbers), b)
    return (
        ufl.inner(stress(a, numbers), b) * dx,
        mixed * dx,
        ufl.inner(stress(c, numbers), d) * dx,
    )


def joined(ends: Array) -> tuple[tuple[float, float], ...]:
    """Unions of the intervals (low, high) that touch, ascending."""
    found: list[list[float]] = []
    touch = LAYER_GAP_RTOL * float(np.ptp(ends)) if ends.size else 0.0
    for low, high in ends[np.argsort(ends[:, 0])].tolist():
        if found and low <= found[-1][1] + touch:
            found[-1][1] = max(found[-1][1], high)
        else:
            found.append([low, high])
    return tuple((low, high) for low, high in found)


def _quadrature(name: str, degree: int, curved: int) -> tuple[int, int]:
    """Quadrature degrees of K and M.

    On straight tetrahedra the integrands are polynomials of these degrees. On hexahedra the
    determinant of the map adds 3 g - 1 per direction to the mass, on curved tetrahedra 3 (g - 1)
    in total, g the degree of the geometry.
    """
    if name == "tetrahedron":
        return 2 * (degree - 1) + 3 * (curved - 1), 2 * degree + 3 * (curved - 1)
    return 2 * degree + 2 * (curved - 1), 2 * degree + 3 * curved - 1
