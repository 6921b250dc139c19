"""Weak forms of a solid, whole or region by region, and their matrices."""

from collections.abc import Iterator, Mapping
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import ufl
from scipy.sparse import csr_matrix

from rom.fe.compat import assemble_matrix, cell_name, geometry_degree
from rom.fe.jit import compiling
from rom.fe.material import Solid, of_region, stress
from rom.fe.stress import Stresses
from rom.model import Array, Region


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
        self, V: Any, tags: Array, solids: dict[int, Solid], names: dict[str, int], degree: int
    ):
        self.V, self.tags, self.solids, self.names, self.degree = V, tags, solids, names, degree

    def __getitem__(self, name: str) -> Region:
        mesh, tag = self.V.mesh, self.names[name]
        with compiling(mesh.comm):
            numbers = of_region(mesh, self.tags, self.solids, tag)
            K, M = (assemble_matrix(form) for form in forms(self.V, numbers, self.degree))
        if mesh.comm.size == 1:
            K, M = (aij(symmetric(A)) for A in (K, M))
        return Region(K, M, Stresses(self.V, numbers, self.degree))

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


def _quadrature(name: str, degree: int, curved: int) -> tuple[int, int]:
    """Quadrature degrees of K and M.

    On straight tetrahedra the integrands are polynomials of these degrees. On hexahedra the
    determinant of the map adds 3 g - 1 per direction to the mass, on curved tetrahedra 3 (g - 1)
    in total, g the degree of the geometry.
    """
    if name == "tetrahedron":
        return 2 * (degree - 1) + 3 * (curved - 1), 2 * degree + 3 * (curved - 1)
    return 2 * degree + 2 * (curved - 1), 2 * degree + 3 * curved - 1


def symmetric(A: PETSc.Mat) -> csr_matrix:
    """(A + A^T) / 2 as a SciPy matrix, on one process."""
    starts, columns, values = A.getValuesCSR()
    half = csr_matrix((0.5 * values, columns, starts), shape=A.getSize())
    return (half + half.T).tocsr()


def aij(A: csr_matrix) -> PETSc.Mat:
    """The same numbers in the same memory, for PETSc."""
    csr = (A.indptr, A.indices, A.data)
    return PETSc.Mat().createAIJWithArrays(A.shape, csr, bsize=3, comm=MPI.COMM_SELF)
