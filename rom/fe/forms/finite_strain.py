"""Solids in large motion: forces, tangent stiffness and geometric stiffness, with heat.

St. Venant-Kirchhoff material in the total Lagrangian description::

    F = I + grad u,   E = (F^T F - I) / 2,   S = C : (E - theta I)
    f . v = integral of F S : grad v

with the stiffness C of the linear model and theta the free thermal strain. All forms share one
quadrature, so that a solid in equilibrium has rigid motions without stiffness to round-off.
"""

from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from scipy.sparse import csr_matrix

from rom.fe.compat import (
    assemble_matrix,
    assembled_vector,
    compiled,
    degree_of_slopes,
    give_own,
    per_cell,
)
from rom.fe.forms.material import geometric_stiffness, stress
from rom.fe.forms.nodes import gathered as gathered_rows
from rom.fe.jit import compiling
from rom.fe.operators.aij import aij, gathered, symmetric, wrapped
from rom.model import Array


class FiniteStrain:
    """Forces and stiffness of a solid at any displacement.

    Displacements, forces and matrices are those of the whole solid, on every rank.

    Args:
        V: displacement space.
        numbers: coefficients of the material, see `rom.fe.forms.material.coefficients`.
        degree: of the displacement.
        tags: (cells,) region of each cell.
        names: {region: tag}.
        neo_hookean: the law of `rom.body.nonlinear.sampled` instead, for isotropic cold material.
    """

    def __init__(
        self, V: Any, numbers: dict[str, Any], degree: int, tags: Array, names: dict[str, int],
        *, neo_hookean: bool = False,
    ):  # fmt: skip
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

        Args:
            expansion: {region: coefficient of expansion alpha [1/K]}, all regions.
            change: {region: change of temperature dT [K]}, all regions.
            nodes: (n / 3,) what the temperature of the nodes adds to it [K].
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

    def layout(self, A: csr_matrix) -> Any:
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

    def _give(self, function: Any, u: Array) -> None:
        """Let a function of the displacement's space have the values (n,) of the whole solid."""
        give_own(function, u[slice(*self._own)])

    def _matrix(self, form: Any) -> csr_matrix:
        A = assemble_matrix(form)
        if self.mesh.comm.size == 1:
            return symmetric(A)
        found = gathered(A)
        A.destroy()
        return found

    @cached_property
    def _force(self) -> Any:
        v = ufl.TestFunction(self.V)
        return self._compiled(ufl.inner(ufl.dot(self._F, self._S), ufl.grad(v)))

    @cached_property
    def _tangent(self) -> Any:
        w, v = ufl.TrialFunction(self.V), ufl.TestFunction(self.V)
        if self.neo_hookean:
            force = ufl.inner(ufl.dot(self._F, self._S), ufl.grad(v))
            return self._compiled(ufl.derivative(force, self.u, w))
        dE, dE_v = (ufl.sym(ufl.dot(self._F.T, ufl.grad(x))) for x in (w, v))
        material = ufl.inner(stress(dE, self.numbers), dE_v)
        return self._compiled(material + ufl.inner(ufl.dot(ufl.grad(w), self._S), ufl.grad(v)))

    @cached_property
    def _geometric(self) -> Any:
        w, v = ufl.TrialFunction(self.V), ufl.TestFunction(self.V)
        sigma = self._stress(ufl.sym(ufl.grad(self.u)))
        return self._compiled(geometric_stiffness(w, v, sigma))

    @property
    def _F(self) -> Any:
        return ufl.Identity(3) + ufl.grad(self.u)

    @property
    def _S(self) -> Any:
        if self.neo_hookean:
            inverse, log = ufl.inv(ufl.dot(self._F.T, self._F)), ufl.ln(ufl.det(self._F))
            lam, mu = self.numbers["lam"], self.numbers["mu"]
            return mu * (ufl.Identity(3) - inverse) + lam * log * inverse
        H = ufl.grad(self.u)  # F^T F - I would leave small strains no digits
        return self._stress(ufl.sym(H) + 0.5 * ufl.dot(H.T, H))

    def _stress(self, strain: Any) -> Any:
        return stress(strain - self.theta * ufl.Identity(3), self.numbers)

    def _compiled(self, integrand: Any) -> Any:
        with compiling(self.mesh.comm):
            return compiled(integrand * self.dx)
