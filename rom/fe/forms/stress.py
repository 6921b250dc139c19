"""Stress and gradient of displacements: averaged at nodes, or at the points of a quadrature."""

from collections.abc import Callable, Iterator

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from scipy.sparse import csr_matrix
from ufl.core.expr import Expr

from rom.fe.compat import (
    assemble_matrix,
    cell_dofs,
    degree_of_slopes,
    evaluated,
    give_own,
    reference_points,
    to_global,
)
from rom.fe.forms.large_strain import FiniteStrain, LargeStrain
from rom.fe.forms.material import Coefficients, geometric_stiffness, stiffness, stress
from rom.fe.jit import compiling
from rom.fe.operators.aij import gathered
from rom.fe.operators.factor import dense_rows
from rom.fe.operators.memory import give_back
from rom.model import PAIRS, Array, Index, Integers


class Stresses:
    """Hooke's law on the mesh of a model, with the numbers of `material.coefficients`.

    ``regions`` are the region (cells,) of each cell and {region: tag}; None where not known.
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        numbers: Coefficients,
        degree: int,
        regions: tuple[Index, dict[str, int]] | None = None,
    ):
        self.V, self.numbers, self.degree = V, numbers, degree
        self.regions = regions or (np.zeros(0, dtype=np.int64), {})
        self.mesh = V.mesh
        self.n_cells = self.mesh.topology.index_map(3).size_local

    def at_nodes(self, U: Array, nodes: Index) -> Array:
        """(p, 6, k) stress xx, yy, zz, yz, xz, xy [Pa] at nodes (p,) of U (n_local, k) [m].

        The mean of what their cells say, not weighted; nodes and stress are equal on all ranks.
        """
        one = np.zeros(self.n_cells, dtype=np.int64)
        return self._means(self._hooke, 6, U, nodes, one)[0]

    def gradients_at_nodes(self, U: Array, nodes: Index) -> dict[str, Array]:
        """The arrays of `rom.body.nonlinear.cauchy.CauchyRecovery` at nodes (p,).

        Gradients of displacements U (n_local, k) [m] are means of cells, material by material.
        """

        def slopes(u: fem.Function) -> Expr:
            return ufl.as_vector([ufl.grad(u)[a, b] for a in range(3) for b in range(3)])

        laws, of_cell = self._laws()
        gradient, node, material, count = self._means(slopes, 9, U, nodes, of_cell)
        return {
            "gradient": gradient.reshape(9 * len(node), -1),
            "stiffness": laws,
            "node": node,
            "material": material,
            "share": count / np.bincount(node, count, nodes.size)[node],
        }

    def _means(
        self, of: Callable[[fem.Function], Expr], width: int, U: Array, nodes: Index, group: Index
    ) -> tuple[Array, Index, Index, Array]:
        """Means over the cells of one group at nodes, for all pairs of the two that exist.

        ``of`` makes a ufl vector of so many numbers of a displacement; ``group`` has that of each
        cell of this rank. Returned are means (s, width, k), and number of the node, group, and
        number of cells of each of the s pairs, node by node; equal on all ranks.
        """
        local = cell_dofs(self.V)[: self.n_cells]
        table = to_global(self.V.dofmap.index_map, local.ravel()).reshape(local.shape)
        touching = np.isin(table, nodes).any(axis=1)
        cells, table = np.flatnonzero(touching).astype(np.int32), table[touching]
        X = reference_points(self.V)
        order = self._order(cells, X)
        place = np.full(self.V.dofmap.index_map.size_global, -1)
        place[nodes] = np.arange(nodes.size)
        at = place[table]  # (cells, points of a cell): where each value belongs, or -1
        n_groups = self.mesh.comm.allreduce(int(group.max(initial=0)), MPI.MAX) + 1
        pair = at * n_groups + group[cells][:, None]
        count = np.bincount(pair[at >= 0], minlength=nodes.size * n_groups).astype(float)
        self.mesh.comm.Allreduce(MPI.IN_PLACE, count)
        kept = np.flatnonzero(count)
        row = np.searchsorted(kept, pair[at >= 0])
        sums = np.zeros((kept.size, width, U.shape[1]))
        for k, values in enumerate(self._evaluated(of, width, U, cells, X)):
            ordered = np.take_along_axis(values, order[:, :, None], axis=1)
            np.add.at(sums[:, :, k], row, ordered[at >= 0])
        self.mesh.comm.Allreduce(MPI.IN_PLACE, sums)
        means = sums / count[kept][:, None, None]
        return means, kept // n_groups, kept % n_groups, count[kept]

    def _laws(self) -> tuple[Array, Index]:
        """(m, 6, 6) stiffness of each material [Pa], and the number of that of each own cell."""
        cells = np.arange(self.n_cells, dtype=np.int32)
        x = ufl.SpatialCoordinate(self.mesh)
        with compiling(self.mesh.comm):
            law = fem.Expression(stiffness(self.numbers, x), reference_points(self.V)[:1])
        C = evaluated(law, self.mesh, cells).reshape(cells.size, 36)
        mine = np.unique(C, axis=0)
        every = np.unique(np.vstack(self.mesh.comm.allgather(mine)), axis=0)
        of_cell = np.zeros(cells.size, dtype=np.int64)
        for number, row in enumerate(every):
            of_cell[(row == C).all(axis=1)] = number
        return every.reshape(-1, 6, 6), of_cell

    def geometric_stiffness(self, U: Array, Psi: Array) -> Array:
        """(l, r, r) stiffness that the stress of loads gives to shapes Psi (n_local, r).

        Of displacements U (n_local, l) [m] under the loads: the second variation of the strain
        energy, see `material.geometric_stiffness`; symmetric, equal on all ranks.
        """
        load = fem.Function(self.V)
        form = self._second_variation(load)
        out = np.empty((U.shape[1], Psi.shape[1], Psi.shape[1]))
        for k, column in enumerate(U.T):
            give_own(load, column)
            with compiling(self.mesh.comm):
                A = assemble_matrix(form)
            out[k] = Psi.T @ dense_rows(A, Psi)
            A.destroy()
        give_back()
        self.mesh.comm.Allreduce(MPI.IN_PLACE, out)
        return 0.5 * (out + out.transpose(0, 2, 1))

    def prestress(self, u: Array) -> csr_matrix:
        """(n, n) geometric stiffness of the stress of a displacement (n,) [m], on all ranks."""
        load = fem.Function(self.V)
        rows, per_node = self.V.dofmap.index_map.local_range, self.V.dofmap.index_map_bs
        give_own(load, u[rows[0] * per_node : rows[1] * per_node])
        with compiling(self.mesh.comm):
            A = assemble_matrix(self._second_variation(load))
        K_geo = gathered(A)
        A.destroy()
        return K_geo

    def finite_strain(self, *, neo_hookean: bool = False) -> FiniteStrain:
        """The same solid in large motion, `large_strain.FiniteStrain`."""
        return FiniteStrain(
            self.V, self.numbers, self.degree, *self.regions, neo_hookean=neo_hookean
        )

    def large_strain(self) -> LargeStrain:
        """Energy of shapes at finite strain, `large_strain.LargeStrain`."""
        return LargeStrain(self.V, self.numbers, self.degree)

    def _second_variation(self, load: fem.Function) -> ufl.Form:
        """Bilinear form; quadrature exact on straight tetrahedra, as for the mass on others."""
        u, v = ufl.TrialFunction(self.V), ufl.TestFunction(self.V)
        sigma = stress(ufl.sym(ufl.grad(load)), self.numbers)
        order = degree_of_slopes(self.mesh, self.degree, 3)
        dx = ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": order})
        return geometric_stiffness(u, v, sigma) * dx

    def _hooke(self, u: fem.Function) -> Expr:
        """Stress xx, yy, zz, yz, xz, xy of a displacement, a ufl vector."""
        s = stress(ufl.sym(ufl.grad(u)), self.numbers)
        return ufl.as_vector([s[i, j] for i, j in PAIRS])

    def _evaluated(
        self, of: Callable[[fem.Function], Expr], width: int, U: Array, cells: Integers, X: Array
    ) -> Iterator[Array]:
        """(cells, points, width) numbers of each column, of a ufl vector of the displacement."""
        u = fem.Function(self.V)
        with compiling(self.mesh.comm):
            expression = fem.Expression(of(u), X)
        for column in U.T:
            give_own(u, column)
            yield evaluated(expression, self.mesh, cells).reshape(cells.size, len(X), width)

    def _order(self, cells: Integers, X: Array) -> Index:
        """(cells, k) which evaluated point is which node: edges may run either way."""
        with compiling(self.mesh.comm):
            expression = fem.Expression(ufl.SpatialCoordinate(self.mesh), X)
        x = evaluated(expression, self.mesh, cells).reshape(cells.size, len(X), 3)
        nodes = self.V.tabulate_dof_coordinates()[cell_dofs(self.V)[cells]]
        gaps = np.linalg.norm(nodes[:, :, None] - x[:, None], axis=3)
        return np.argmin(gaps, axis=2)
