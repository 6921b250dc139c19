"""Strain energy of shapes at finite strain, a polynomial of fourth order in their amplitudes.

St. Venant-Kirchhoff material, u = sum_i psi_i q_i, with L(u) = sym grad u and
Q(a, b) = sym(grad a^T grad b)::

    E = sum_i L_i q_i + sum_jk Q_jk q_j q_k / 2,     U = integral of E : C : E / 2

All products are entries of one Gram matrix, of the columns L_i and Q_jk (j <= k).

Source:
    Mignolet, Przekop, Rizzi and Spottswood, A review of indirect/non-intrusive reduced order
    modeling of nonlinear geometric structures, J. Sound Vib. 332 (2013) 2437.
"""

from collections.abc import Iterator
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem

from rom.fe.compat import (
    assembled_vector,
    compiled,
    degree_of_slopes,
    evaluated,
    give_own,
    quadrature_rule,
)
from rom.fe.forms.material import stiffness, stress
from rom.fe.jit import compiling
from rom.model import PAIRS, Array, Index, Integers

BLOCK_BYTES = 64e6  # of the columns of a block of cells, of which a few copies are made


class LargeStrain:
    """Energy of shapes at finite strain, and the forces of second order that shapes cause.

    Args:
        V: displacement space.
        numbers: coefficients of the material, see `rom.fe.forms.material.coefficients`.
        degree: of the displacement.
    """

    def __init__(self, V: Any, numbers: dict[str, Any], degree: int):
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
        """(N, N) integrals of Z^T C Z, with the columns L_i, then Q_jk for j <= k [N m].

        Args:
            E: (n_local, r) shapes [m]; N = r + r (r + 1) / 2.
            exact: with points enough for fourth order; otherwise for linear stiffness, which does
                to choose shapes by, as rotations still strain nothing.

        Returns:
            The matrix, equal on all ranks; row by row of the upper triangle for the pairs.
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
        """Of this process: gradients (p, 9, r), weights (p,), cells (p,) and stiffness (p, 6, 6).

        Args:
            E: (n_local, r) shapes [m].
        """
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
        """(n_local, p) forces D^2 f [u_i, u_j] at no displacement [N].

        Args:
            U: (n_local, m) displacements [m].
            pairs: (p, 2) numbers i and j.
        """
        a, b, v = fem.Function(self.V), fem.Function(self.V), ufl.TestFunction(self.V)

        def L(u: Any) -> Any:
            return ufl.sym(ufl.grad(u))

        def Q(u: Any, w: Any) -> Any:
            return ufl.sym(ufl.dot(ufl.grad(u).T, ufl.grad(w)))

        density = sum(
            ufl.inner(stress(Q(x, y), self.numbers), L(z))
            for x, y, z in ((a, b, v), (v, a, b), (v, b, a))
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
    """(p, 6, r (r + 1) / 2) Voigt columns of sym(grad a^T grad b), shear doubled [1].

    Args:
        H: (p, 3, 3, r) gradients of the shapes [1].
    """
    p, r = H.shape[0], H.shape[3]
    flat = H.reshape(p, 3, 3 * r)
    products = np.matmul(flat.transpose(0, 2, 1), flat).reshape(p, 3, r, 3, r)
    j, k = np.triu_indices(r)
    rows = [products[:, a, j, b, k] if a == b else
            products[:, a, j, b, k] + products[:, b, j, a, k] for a, b in PAIRS]  # fmt: skip
    return np.stack(rows, axis=1)
