"""Solids at finite strain: forces and stiffness in large motion with heat, and energy of shapes.

St. Venant-Kirchhoff material in the total Lagrangian description, with the stiffness C of the
linear model and theta the free thermal strain::

    F = I + grad u,   E = (F^T F - I) / 2,   S = C : (E - theta I)
    f . v = integral of F S : grad v

The strain energy of shapes is a polynomial of fourth order in their amplitudes,
u = sum_i psi_i q_i, with L(u) = sym grad u and Q(a, b) = sym(grad a^T grad b)::

    E = sum_i L_i q_i + sum_jk Q_jk q_j q_k / 2,     U = integral of E : C : E / 2

All products are entries of one Gram matrix, of the columns L_i and Q_jk (j <= k).

Source:
    Mignolet, Przekop, Rizzi and Spottswood, A review of indirect/non-intrusive reduced order
    modeling of nonlinear geometric structures, J. Sound Vib. 332 (2013) 2437.
"""

from collections.abc import Iterator
from functools import cached_property

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from scipy.sparse import csr_matrix
from ufl.core.expr import Expr

from rom.fe.compat import (
    Compiled,
    assemble_matrix,
    assembled_vector,
    compiled,
    degree_of_slopes,
    evaluated,
    give_own,
    per_cell,
    quadrature_rule,
)
from rom.fe.forms.material import Coefficients, geometric_stiffness, stiffness, stress
from rom.fe.forms.nodes import gathered as gathered_rows
from rom.fe.jit import compiling
from rom.fe.operators.aij import aij, gathered, symmetric, wrapped
from rom.model import PAIRS, Array, Index, Integers

BLOCK_BYTES = 64e6  # of the columns of a block of cells, of which a few copies are made


class FiniteStrain:
    """Forces and stiffness of a solid at any displacement.

    Displacements, forces and matrices are those of the whole solid, on every rank. All forms share
    one quadrature, so that a solid in equilibrium has rigid motions without stiffness to round-off.
    ``numbers`` are of `rom.fe.forms.material.coefficients`, tags (cells,) and {region: tag} say
    where regions are; ``neo_hookean`` is the law of `rom.body.nonlinear.sampled`, for isotropic
    cold material.
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        numbers: Coefficients,
        degree: int,
        tags: Index,
        names: dict[str, int],
        *,
        neo_hookean: bool = False,
    ):
        self.neo_hookean = neo_hookean
        self.V, self.mesh, self.numbers = V, V.mesh, numbers
        self.tags, self.names = tags, names
        cold = np.zeros(tags.size)
        self.u, self.at_nodes = fem.Function(V), fem.Function(V)
        with compiling(self.mesh.comm):
            self.expansion, self.in_cells = per_cell(self.mesh, cold), per_cell(self.mesh, cold)
        # the first component is the temperature: nodes of another space have other numbers
        self.share = fem.Constant(self.mesh, 1.0)
        self.theta = self.share * self.expansion * (self.in_cells + self.at_nodes[0])
        # on straight tetrahedra exact: forces have the fourth power of grad u
        order = degree_of_slopes(self.mesh, degree, 4, in_bricks=3)
        self.dx = ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": order})

    def warm(self, share: float) -> None:
        """Apply a share of the heat from now on."""
        self.share.value = share

    def heat(self, expansion: dict[str, float], change: dict[str, float], nodes: Array) -> None:
        """Set the free thermal strain alpha dT of the forms.

        Of all regions {region: alpha [1/K]} and {region: dT [K]}, to which nodes (n / 3,) add [K].
        """
        for function, table in ((self.expansion, expansion), (self.in_cells, change)):
            values = np.zeros(self.tags.size)
            for name, tag in self.names.items():
                values[self.tags == tag] = table[name]
            function.x.array[:] = per_cell(self.mesh, values).x.array
        self._give(self.at_nodes, np.repeat(nodes, 3))

    def force(self, u: Array) -> Array:
        """(n,) forces that hold the solid at a displacement (n,) [N]."""
        self._give(self.u, u)
        return gathered_rows(self.mesh.comm, assembled_vector(self._force))

    def tangent(self, u: Array) -> csr_matrix:
        """(n, n) derivative of the forces at a displacement (n,) [N/m]."""
        self._give(self.u, u)
        return self._matrix(self._tangent)

    def geometric(self, u: Array) -> csr_matrix:
        """(n, n) geometric stiffness of the stress C : (eps(u) - theta I) [N/m]."""
        self._give(self.u, u)
        return self._matrix(self._geometric)

    def layout(self, A: csr_matrix) -> PETSc.Mat:
        """The same matrix for the operators of the model."""
        if self.mesh.comm.size == 1:
            return wrapped(A)
        rows, n = A[slice(*self._own)], A.shape[0]
        size = (rows.shape[0], n)
        return aij(rows, (size, size), self.mesh.comm, 3)

    @property
    def _own(self) -> tuple[int, int]:
        """First dof of this rank, and the first of the next."""
        first, end = self.V.dofmap.index_map.local_range
        return 3 * first, 3 * end

    def _give(self, function: fem.Function, u: Array) -> None:
        """Let a function of the displacement's space have the values (n,) of the whole solid."""
        give_own(function, u[slice(*self._own)])

    def _matrix(self, form: Compiled) -> csr_matrix:
        A = assemble_matrix(form)
        if self.mesh.comm.size == 1:
            return symmetric(A)
        found = gathered(A)
        A.destroy()
        return found

    @cached_property
    def _force(self) -> Compiled:
        v = ufl.TestFunction(self.V)
        return self._compiled(ufl.inner(ufl.dot(self._F, self._S), ufl.grad(v)))

    @cached_property
    def _tangent(self) -> Compiled:
        w, v = ufl.TrialFunction(self.V), ufl.TestFunction(self.V)
        if self.neo_hookean:
            force = ufl.inner(ufl.dot(self._F, self._S), ufl.grad(v))
            return self._compiled(ufl.derivative(force, self.u, w))
        dE, dE_v = (ufl.sym(ufl.dot(self._F.T, ufl.grad(x))) for x in (w, v))
        material = ufl.inner(stress(dE, self.numbers), dE_v)
        return self._compiled(material + ufl.inner(ufl.dot(ufl.grad(w), self._S), ufl.grad(v)))

    @cached_property
    def _geometric(self) -> Compiled:
        w, v = ufl.TrialFunction(self.V), ufl.TestFunction(self.V)
        sigma = self._stress(ufl.sym(ufl.grad(self.u)))
        return self._compiled(geometric_stiffness(w, v, sigma))

    @property
    def _F(self) -> Expr:
        return ufl.Identity(3) + ufl.grad(self.u)

    @property
    def _S(self) -> Expr:
        if self.neo_hookean:
            inverse, log = ufl.inv(ufl.dot(self._F.T, self._F)), ufl.ln(ufl.det(self._F))
            lam, mu = self.numbers["lam"], self.numbers["mu"]
            return mu * (ufl.Identity(3) - inverse) + lam * log * inverse
        H = ufl.grad(self.u)  # F^T F - I would leave small strains no digits
        return self._stress(ufl.sym(H) + 0.5 * ufl.dot(H.T, H))

    def _stress(self, strain: Expr) -> Expr:
        return stress(strain - self.theta * ufl.Identity(3), self.numbers)

    def _compiled(self, integrand: Expr) -> Compiled:
        with compiling(self.mesh.comm):
            return compiled(integrand * self.dx)


class LargeStrain:
    """Energy of shapes at finite strain, and the forces of second order that shapes cause."""

    def __init__(self, V: fem.FunctionSpace, numbers: Coefficients, degree: int):
        self.V, self.mesh, self.numbers = V, V.mesh, numbers
        # for the fourth power of grad u, and for the linear stiffness
        self.order, self.few = (degree_of_slopes(V.mesh, degree, power) for power in (4, 2))
        self.points, self.weights = quadrature_rule(self.mesh, self.order)
        self.n_cells = self.mesh.topology.index_map(3).size_local

    @property
    def n_points(self) -> int:
        """Number of quadrature points to choose shapes by, of all ranks."""
        n_cells = int(self.mesh.topology.index_map(3).size_global)
        return len(quadrature_rule(self.mesh, self.few)[1]) * n_cells

    def gram(self, E: Array, *, exact: bool = True) -> Array:
        """(N, N) integrals of Z^T C Z of shapes E (n_local, r) [m], equal on all ranks [N m].

        Z has the columns L_i, then Q_jk for j <= k, row by row of the upper triangle, so that
        N = r + r (r + 1) / 2. Points are enough for fourth order if ``exact``; otherwise for linear
        stiffness, which does to choose shapes by, as rotations still strain nothing.
        """
        r = E.shape[1]
        N = r + r * (r + 1) // 2
        G = np.zeros((N, N))
        order = self.order if exact else self.few
        for H, w, C in self._gradients(E, self._blocks(6 * N + 9 * r * r), order):
            Z = np.concatenate([linear_strain(H), quadratic_strain(H)], axis=2)
            root = np.sqrt(w)[:, None, None] * np.linalg.cholesky(C).transpose(0, 2, 1)
            Z = np.matmul(root, Z).reshape(-1, N)
            G += Z.T @ Z
        self.mesh.comm.Allreduce(MPI.IN_PLACE, G)
        return 0.5 * (G + G.T)

    def least_stretch(self, U: Array) -> Array:
        """(s,) least principal stretch [1] of each displacement (n_local, s), on all ranks."""
        least = np.full(U.shape[1], np.inf)
        for H in self._slopes(U, self._blocks(27 * U.shape[1]), self.points):
            F = np.moveaxis(H, 3, 0) + np.eye(3)
            squares = np.linalg.eigvalsh(F.swapaxes(-1, -2) @ F)[..., 0]
            least = np.minimum(least, squares.min(axis=1))
        self.mesh.comm.Allreduce(MPI.IN_PLACE, least, MPI.MIN)
        return np.sqrt(np.maximum(least, 0.0))

    def unresolved(self, U: Array) -> Array:
        """(s,) share of the strain energy of displacements (n_local, s) not linear in cells.

        Quadratic cells bear bending, whose strain is linear, and cannot help more than that: one
        that turns by the angle a is strained along by a^2 (x^2 / l^2 - 1 / 12) / 2 although a bent
        line keeps its length. Where that matters the mesh is too coarse for the turn.
        """
        linear = np.column_stack([np.ones(len(self.points)), self.points])
        weighted = linear * self.weights[:, None]
        fit = linear @ np.linalg.solve(linear.T @ weighted, weighted.T)
        sums = np.zeros((2, U.shape[1]))
        for H, w, C in self._gradients(U, self._blocks(27 * U.shape[1]), self.order):
            whole = linear_strain(H + 0.5 * np.einsum("pmas,pmbs->pabs", H, H))
            in_cells = whole.reshape(-1, len(fit), 6 * U.shape[1])
            beyond = (in_cells - fit @ in_cells).reshape(whole.shape)
            for total, strain in zip(sums, (whole, beyond), strict=True):
                total += np.einsum("p,pis,pij,pjs->s", w, strain, C, strain, optimize=True)
        self.mesh.comm.Allreduce(MPI.IN_PLACE, sums)
        return np.asarray(sums[1] / np.maximum(sums[0], 1e-300))

    def at_points(self, E: Array) -> tuple[Array, Array, Array, Array]:
        """Of this process: gradients (p, 9, r), weights (p,), cells (p,), stiffness (p, 6, 6)."""
        every: list[Integers] = [np.arange(self.n_cells, dtype=np.int32)]
        blocks = list(self._gradients(E, every, self.order))
        H, w, C = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
        cells = np.repeat(np.arange(self.n_cells), len(self.points))
        return H.reshape(len(w), 9, -1), w, cells, C

    def _blocks(self, numbers: int) -> list[Integers]:
        """Blocks of cells for so many numbers at each quadrature point."""
        per_cell = len(self.weights) * 8 * numbers
        n_blocks = 1 + int(self.n_cells * per_cell / BLOCK_BYTES)
        return np.array_split(np.arange(self.n_cells, dtype=np.int32), n_blocks)

    def second_forces(self, U: Array, pairs: Index) -> Array:
        """(n_local, p) forces D^2 f [u_i, u_j] at no displacement [N], of pairs (p, 2) i and j."""
        a, b, v = fem.Function(self.V), fem.Function(self.V), ufl.TestFunction(self.V)
        slopes = (map(ufl.grad, turn) for turn in ((a, b, v), (v, a, b), (v, b, a)))
        density = sum(
            ufl.inner(stress(ufl.sym(ufl.dot(X.T, Y)), self.numbers), ufl.sym(Z))
            for X, Y, Z in slopes
        )
        dx = ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": self.order})
        with compiling(self.mesh.comm):
            form = compiled(density * dx)
        out = np.empty((U.shape[0], len(pairs)))
        for k, (i, j) in enumerate(pairs):
            give_own(a, U[:, i])
            give_own(b, U[:, j])
            out[:, k] = assembled_vector(form)
        return out

    def _gradients(
        self, E: Array, blocks: list[Integers], order: int
    ) -> Iterator[tuple[Array, ...]]:
        """Gradients (p, 3, 3, r) [1], weights (p,) and C (p, 6, 6) of each block, at points."""
        points, weights = quadrature_rule(self.mesh, order)
        x, p = ufl.SpatialCoordinate(self.mesh), len(points)
        with compiling(self.mesh.comm):
            volume = fem.Expression(ufl.JacobianDeterminant(self.mesh), points)
            law = fem.Expression(stiffness(self.numbers, x), points[:1])
        filled = [cells for cells in blocks if cells.size]
        for cells, H in zip(filled, self._slopes(E, filled, points), strict=True):
            w = np.abs(evaluated(volume, self.mesh, cells).reshape(-1, p)) * weights
            C = evaluated(law, self.mesh, cells).reshape(-1, 6, 6)
            yield H, w.ravel(), np.repeat(C, p, axis=0)

    def _slopes(self, E: Array, blocks: list[Integers], points: Array) -> Iterator[Array]:
        """Gradients (p, 3, 3, r) [1] of each block that has cells, at points of the cells."""
        u = fem.Function(self.V)
        columns = []
        for column in E.T:  # every rank exchanges all columns, however many blocks it has
            give_own(u, column)
            columns.append(u.x.array.copy())
        with compiling(self.mesh.comm):
            grad = fem.Expression(ufl.grad(u), points)
        for cells in blocks:
            if not cells.size:
                continue
            H = np.empty((cells.size * len(points), 3, 3, E.shape[1]))
            for k, column in enumerate(columns):
                u.x.array[:] = column
                H[..., k] = evaluated(grad, self.mesh, cells).reshape(-1, 3, 3)
            yield H


def linear_strain(H: Array) -> Array:
    """(p, 6, r) Voigt columns of sym grad u, shear doubled, from gradients (p, 3, 3, r) [1]."""
    rows = [H[:, a, a] if a == b else H[:, a, b] + H[:, b, a] for a, b in PAIRS]
    return np.stack(rows, axis=1)


def quadratic_strain(H: Array) -> Array:
    """(p, 6, r (r + 1) / 2) Voigt columns of sym(grad a^T grad b), shear doubled [1]."""
    p, r = H.shape[0], H.shape[3]
    flat = H.reshape(p, 3, 3 * r)
    products = np.matmul(flat.transpose(0, 2, 1), flat).reshape(p, 3, r, 3, r)
    j, k = np.triu_indices(r)
    rows = [products[:, a, j, b, k] for a, b in PAIRS]
    for row, (a, b) in zip(rows, PAIRS, strict=True):
        if a != b:
            row += products[:, b, j, a, k]
    return np.stack(rows, axis=1)
