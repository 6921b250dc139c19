"""Stress of displacement fields: averaged at nodes, or at the quadrature points of the cells."""

from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from scipy.sparse import csr_matrix

from rom.fe.compat import (
    assemble_matrix,
    cell_dofs,
    cell_name,
    evaluated,
    geometry_degree,
    quadrature_points,
    reference_points,
    to_global,
)
from rom.fe.forms.finite_strain import FiniteStrain
from rom.fe.forms.large_strain import LargeStrain
from rom.fe.forms.material import geometric_stiffness, stress
from rom.fe.jit import compiling
from rom.fe.operators.aij import gathered
from rom.fe.operators.factor import dense_rows
from rom.fe.operators.memory import give_back
from rom.model import PAIRS, Array, Index, Integers


class Stresses:
    """Hooke's law on the mesh of a model.

    Args:
        V: displacement space.
        numbers: coefficients of the material, see `rom.fe.forms.material.coefficients`.
        degree: of the displacement.
        regions: (cells,) region of each cell and {region: tag}; None where they are not known.
    """

    def __init__(self, V: Any, numbers: dict[str, Any], degree: int, regions: Any = None):
        self.V, self.numbers, self.degree, self.regions = V, numbers, degree, regions
        self.mesh = V.mesh
        self.n_cells = self.mesh.topology.index_map(3).size_local

    def at_nodes(self, U: Array, nodes: Index) -> Array:
        """Stress at nodes: the mean of what their cells say, not weighted.

        Args:
            U: (n_local, k) displacements [m].
            nodes: (p,) node numbers, equal on all ranks.

        Returns:
            (p, 6, k) stress xx, yy, zz, yz, xz, xy [Pa], equal on all ranks.
        """
        cells, table = self._cells_at(nodes)
        X = reference_points(self.V)
        order = self._order(cells, X)
        place = np.full(self.V.dofmap.index_map.size_global, -1)
        place[nodes] = np.arange(nodes.size)
        to = place[table]  # (cells, points of a cell): where each value belongs, or -1
        sums = np.zeros((nodes.size, 6, U.shape[1]))
        for k, values in enumerate(self._evaluated(U, cells, X)):
            ordered = np.take_along_axis(values, order[:, :, None], axis=1)
            np.add.at(sums[:, :, k], to[to >= 0], ordered[to >= 0])
        count = np.bincount(to[to >= 0], minlength=nodes.size).astype(float)
        self.mesh.comm.Allreduce(MPI.IN_PLACE, sums)
        self.mesh.comm.Allreduce(MPI.IN_PLACE, count)
        return sums / count[:, None, None]

    def at_gauss_points(self, U: Array) -> tuple[Array, Array]:
        """Stress at the quadrature points of this rank's cells.

        Args:
            U: (n_local, k) displacements [m].

        Returns:
            (g, 3) points [m] and (g, 6, k) stress xx, yy, zz, yz, xz, xy [Pa].
        """
        cells = np.arange(self.n_cells, dtype=np.int32)
        X = quadrature_points(self.mesh, 2 * (self.degree - 1))
        with compiling(self.mesh.comm):
            x = fem.Expression(ufl.SpatialCoordinate(self.mesh), X)
        points = evaluated(x, self.mesh, cells).reshape(-1, 3)
        found = [values.reshape(-1, 6) for values in self._evaluated(U, cells, X)]
        return points, np.stack(found, axis=2)

    def geometric_stiffness(self, U: Array, Psi: Array) -> Array:
        """Stiffness that the stress of loads gives to shapes, at any element degree.

        The second variation of the strain energy, see `material.geometric_stiffness`.

        Args:
            U: (n_local, l) displacements under the loads [m].
            Psi: (n_local, r) shapes.

        Returns:
            (l, r, r) symmetric, equal on all ranks.
        """
        load = fem.Function(self.V)
        form = self._second_variation(load)
        out = np.empty((U.shape[1], Psi.shape[1], Psi.shape[1]))
        for k, column in enumerate(U.T):
            load.x.array[: column.size] = column
            load.x.scatter_forward()
            with compiling(self.mesh.comm):
                A = assemble_matrix(form)
            out[k] = Psi.T @ dense_rows(A, Psi)
            A.destroy()
        give_back()
        self.mesh.comm.Allreduce(MPI.IN_PLACE, out)
        return 0.5 * (out + out.transpose(0, 2, 1))

    def prestress(self, u: Array) -> csr_matrix:
        """(n, n) geometric stiffness of the stress of one displacement, equal on all ranks.

        Args:
            u: (n,) displacement of all dofs [m], equal on all ranks.
        """
        load = fem.Function(self.V)
        rows, per_node = self.V.dofmap.index_map.local_range, self.V.dofmap.index_map_bs
        own = u[rows[0] * per_node : rows[1] * per_node]
        load.x.array[: own.size] = own
        load.x.scatter_forward()
        with compiling(self.mesh.comm):
            A = assemble_matrix(self._second_variation(load))
        K_geo = gathered(A)
        A.destroy()
        return K_geo

    def finite_strain(self) -> Any:
        """The same solid in large motion, `finite_strain.FiniteStrain`."""
        return FiniteStrain(self.V, self.numbers, self.degree, *self.regions)

    def large_strain(self) -> Any:
        """Energy of shapes at finite strain, `large_strain.LargeStrain`."""
        return LargeStrain(self.V, self.numbers, self.degree)

    def _second_variation(self, load: Any) -> ufl.Form:
        """Bilinear form; quadrature exact on straight tetrahedra, as for the mass on others."""
        u, v = ufl.TrialFunction(self.V), ufl.TestFunction(self.V)
        sigma = stress(ufl.sym(ufl.grad(load)), self.numbers)
        curved = geometry_degree(self.mesh) - 1
        if cell_name(self.mesh) == "tetrahedron":
            degree = 3 * (self.degree - 1) + 3 * curved
        else:
            degree = 3 * self.degree + 2 * curved
        dx = ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": max(degree, 1)})
        return geometric_stiffness(u, v, sigma) * dx

    def _evaluated(self, U: Array, cells: Integers, X: Array) -> Any:
        """(cells, points, 6) stress of each column."""
        u = fem.Function(self.V)
        s = stress(ufl.sym(ufl.grad(u)), self.numbers)
        voigt = ufl.as_vector([s[i, j] for i, j in PAIRS])
        with compiling(self.mesh.comm):
            expression = fem.Expression(voigt, X)
        for column in U.T:
            u.x.array[: column.size] = column
            u.x.scatter_forward()
            yield evaluated(expression, self.mesh, cells).reshape(cells.size, len(X), 6)

    def _cells_at(self, nodes: Index) -> tuple[Integers, Index]:
        """Cells of this rank that touch the nodes, and the global numbers of their nodes."""
        local = cell_dofs(self.V)[: self.n_cells]
        table = to_global(self.V.dofmap.index_map, local.ravel()).reshape(local.shape)
        touching = np.isin(table, nodes).any(axis=1)
        return np.flatnonzero(touching).astype(np.int32), table[touching]

    def _order(self, cells: Integers, X: Array) -> Index:
        """(cells, k) which evaluated point is which node: edges may run either way."""
        with compiling(self.mesh.comm):
            expression = fem.Expression(ufl.SpatialCoordinate(self.mesh), X)
        x = evaluated(expression, self.mesh, cells).reshape(cells.size, len(X), 3)
        nodes = self.V.tabulate_dof_coordinates()[cell_dofs(self.V)[cells]]
        gaps = np.linalg.norm(nodes[:, :, None] - x[:, None], axis=3)
        return np.argmin(gaps, axis=2)
