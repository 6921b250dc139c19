"""Weak forms of a solid, whole or region by region, and their matrices."""

from collections.abc import Iterator, Mapping

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from ufl.core.expr import Expr

from rom.fe.compat import assemble_matrix, cell_dofs, cell_name, degree_of_slopes, geometry_degree
from rom.fe.forms.material import Coefficients, Solid, of_region, stress
from rom.fe.forms.stress import Stresses
from rom.fe.jit import compiling
from rom.fe.operators.aij import symmetric, wrapped
from rom.model import Array, Index, Layered, Region

LAYER_GAP_RTOL = 1e-9  # of the extent: gap between cells of one layer


class Regions(Mapping[str, Region]):
    """Shares of the regions, assembled when they are asked for; on all ranks together.

    Regions are tags (cells of this rank with ghosts,), {tag: material} and {region: tag}.
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        tags: Index,
        solids: dict[int, Solid],
        names: dict[str, int],
        degree: int,
    ):
        self.V, self.tags, self.solids, self.names, self.degree = V, tags, solids, names, degree

    def __getitem__(self, name: str) -> Region:
        mesh, tag = self.V.mesh, self.names[name]
        with compiling(mesh.comm):
            numbers = of_region(mesh, self.tags, self.solids, tag)
            K, M = map(self._matrix, forms(self.V, numbers, self.degree))
        stresses = Stresses(self.V, numbers, self.degree)
        return Region(K, M, stresses, lambda axis: self._stretched(tag, numbers, axis))

    def _stretched(self, tag: int, numbers: Coefficients, axis: int) -> Layered:
        with compiling(self.V.mesh.comm):
            parts = map(self._matrix, stretched_forms(self.V, numbers, self.degree, axis))
            return Layered(self._layers(tag, axis), *parts)

    def _matrix(self, form: ufl.Form) -> PETSc.Mat:
        A = assemble_matrix(form)
        return wrapped(symmetric(A)) if self.V.mesh.comm.size == 1 else A

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


def forms(V: fem.FunctionSpace, numbers: Coefficients, degree: int) -> tuple[ufl.Form, ufl.Form]:
    """Stiffness and mass; quadrature exact on straight cells, more than enough on curved ones."""
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    q_K, q_M = degree_of_slopes(V.mesh, degree, 2), _mass_degree(V.mesh, degree)
    dx = ufl.Measure("dx", domain=V.mesh)
    sigma = stress(ufl.sym(ufl.grad(u)), numbers)
    K = ufl.inner(sigma, ufl.sym(ufl.grad(v))) * dx(metadata={"quadrature_degree": q_K})
    M = numbers["rho"] * ufl.inner(u, v) * dx(metadata={"quadrature_degree": q_M})
    return K, M


def stretched_forms(
    V: fem.FunctionSpace, numbers: Coefficients, degree: int, axis: int
) -> tuple[ufl.Form, ufl.Form, ufl.Form]:
    """Stiffness split by whether strains come from derivatives along an axis; see `Layered`."""
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    q_K = degree_of_slopes(V.mesh, degree, 2)
    dx = ufl.Measure("dx", domain=V.mesh, metadata={"quadrature_degree": q_K})
    P = ufl.as_matrix([[float(i == j == axis) for j in range(3)] for i in range(3)])

    def strains(w: Expr) -> tuple[Expr, Expr]:
        across = ufl.sym(ufl.dot(ufl.grad(w), P))
        return ufl.sym(ufl.grad(w)) - across, across

    (a, c), (b, d) = strains(u), strains(v)
    mixed = ufl.inner(stress(a, numbers), d) + ufl.inner(stress(c, numbers), b)
    along, across = ufl.inner(stress(a, numbers), b), ufl.inner(stress(c, numbers), d)
    return along * dx, mixed * dx, across * dx


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


def _mass_degree(mesh: Mesh, degree: int) -> int:
    """Quadrature degree of M: the determinant of the map adds to that of the displacements.

    On hexahedra 3 g - 1 per direction, on tetrahedra 3 (g - 1) in total, g the degree of the
    geometry.
    """
    map_degree = 3 * geometry_degree(mesh)
    return 2 * degree + map_degree - (3 if cell_name(mesh) == "tetrahedron" else 1)
