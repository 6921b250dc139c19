"""The only place that knows which dolfinx this is: 0.5, 0.9, 0.10, or 0.11, told by feature."""

import inspect
import logging
from typing import Any, Protocol

from mpi4py import MPI
from petsc4py import PETSc

import basix
import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.common import IndexMap
from dolfinx.fem import petsc as fem_petsc
from dolfinx.mesh import Mesh

from rom.fe.jit import JIT_OPTIONS
from rom.model import Array, Index, Integers

CellMap = Any  # from the reference cell: of another class in each version
Compiled = Any  # a form ready to assemble: of another class in each version
# ffcx routes all warnings of the process into a log; a warning belongs to whoever listens for it.
logging.captureWarnings(False)

PARTS_KEEP_COLUMNS = (3, 23)  # the first PETSc not tried; 3.22 does not, 3.25 does

CELLS_AT_ONCE = 100_000  # whose coordinates are computed, which takes some ten megabytes


class MeshTags(Protocol):
    """Numbers of some entities of a mesh, whose class has another name in each version."""

    name: str
    indices: Integers
    values: Integers


def lagrange(mesh: Mesh, degree: int) -> fem.FunctionSpace:
    """Space of continuous displacements: three components at each node."""
    if hasattr(fem, "functionspace"):
        return fem.functionspace(mesh, ("Lagrange", degree, (3,)))
    return fem.VectorFunctionSpace(mesh, ("Lagrange", degree))


def per_cell(mesh: Mesh, values: Array) -> fem.Function:
    """A coefficient with one number or tensor (cells of this rank with ghosts, ...) per cell."""
    shape = values.shape[1:]
    if hasattr(fem, "functionspace"):
        space = fem.functionspace(mesh, ("DG", 0, shape) if shape else ("DG", 0))
    elif shape:
        space = fem.TensorFunctionSpace(mesh, ("DG", 0), shape=shape)
    else:
        space = fem.FunctionSpace(mesh, ("DG", 0))
    function = fem.Function(space)
    block = int(np.prod(shape, dtype=int))
    dofs = cell_dofs(space)[:, :1].ravel()
    function.x.array.reshape(-1, block)[dofs] = values.reshape(-1, block)
    return function


def give_own(function: fem.Function, own: Array) -> None:
    """Let a function have these values at the dofs of this rank, and those of others at ghosts."""
    function.x.array[: own.size] = own
    function.x.scatter_forward()


def cell_dofs(space: fem.FunctionSpace) -> Integers:
    """(cells, k) node numbers of each cell on this rank, ghosts included."""
    table = space.dofmap.list
    table = np.asarray(getattr(table, "array", table))
    cells = space.mesh.topology.index_map(3)
    rows = cells.size_local + cells.num_ghosts
    return table.reshape(rows, table.size // max(rows, 1))  # a rank may have no cell


def assemble_matrix(form: ufl.Form) -> PETSc.Mat:
    """Matrix of a bilinear form, distributed over the ranks."""
    A = fem_petsc.assemble_matrix(compiled(form))
    A.assemble()
    if not hasattr(fem, "functionspace"):
        return A
    # dolfinx 0.9 on PETSc 3.22: createSubMatrix of such a matrix crashes on several ranks; one made
    # anew from its rows does not
    rows = A.getValuesCSR()
    copy = PETSc.Mat().createAIJ(A.getSizes(), bsize=A.getBlockSize(), csr=rows, comm=A.comm)
    copy.assemble()
    A.destroy()
    return copy


def assembled_vector(form: Compiled) -> Array:
    """(n_local,) vector of a compiled linear form, summed over the ranks that share a node."""
    b = fem_petsc.assemble_vector(form)
    b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
    values = b.array.copy()
    b.destroy()
    return values


def compiled(form: ufl.Form) -> Compiled:
    """Form ready to assemble, with our options."""
    name = "jit_options" if hasattr(fem, "functionspace") else "jit_params"
    return fem.form(form, **{name: dict(JIT_OPTIONS)})


def cell_name(mesh: Mesh) -> str:
    """Shape of the cells: "tetrahedron" or "hexahedron"."""
    return mesh.topology.cell_type.name


def geometry_degree(mesh: Mesh) -> int:
    """Polynomial degree of the map from the reference cell: 2 for curved cells."""
    return _cell_map(mesh).degree


def _cell_map(mesh: Mesh) -> CellMap:
    """The map from the reference cell, of which all cells have the same kind."""
    geometry = mesh.geometry
    if hasattr(type(geometry), "cmaps"):
        return geometry.cmaps[0]
    return geometry.cmap() if callable(geometry.cmap) else geometry.cmap


def sub_entities(name: str) -> list[list[list[int]]]:
    """Corner numbers of the vertices, edges, facets and volume of the reference cell."""
    return basix.topology(getattr(basix.CellType, name))


def to_global(index_map: IndexMap, local: Integers) -> Index:
    """Global numbers of local entities."""
    return np.asarray(index_map.local_to_global(local.astype(np.int32)), dtype=np.int64)


def same_layout(A: PETSc.Mat, B: PETSc.Mat) -> bool:
    """Whether values of A can be copied into B, whose entries stand in the same places.

    Ranks of PETSc 3.25 keep columns of other ranks in a part of a matrix in which nothing stands;
    sums of such parts drop them.
    """
    return A.comm.size == B.comm.size == 1 or PETSc.Sys.getVersion() < PARTS_KEEP_COLUMNS


def versions() -> dict[str, str]:
    """Versions of the libraries a model was made with."""
    from slepc4py import SLEPc

    found = {"PETSc": PETSc.Sys.getVersion(), "SLEPc": SLEPc.Sys.getVersion()}
    numbers = {name: ".".join(map(str, version)) for name, version in found.items()}
    return {"dolfinx": dolfinx.__version__, **numbers}


def create_mesh(comm: MPI.Comm, cells: Integers, points: Array, shape: str, degree: int) -> Mesh:
    """Distributed mesh from arrays on rank 0; the other ranks give none.

    Cells (m, k) in the order of dolfinx, points (n, 3) [m], and the degree of the geometry.
    """
    from dolfinx.mesh import create_mesh

    if hasattr(fem, "functionspace"):
        from basix.ufl import element

        e = element("Lagrange", shape, degree, shape=(3,))
        return create_mesh(comm, cells=cells, x=points, e=e)
    e = ufl.VectorElement("Lagrange", ufl.Cell(shape, 3), degree, variant="equispaced")
    return create_mesh(comm, cells, points, ufl.Mesh(e))


def gmsh_order(shape: str, n_nodes: int) -> Integers:
    """Positions in gmsh's node order, listed in the order of dolfinx."""
    from dolfinx.cpp.io import perm_gmsh
    from dolfinx.cpp.mesh import CellType

    return np.array(perm_gmsh(getattr(CellType, shape), n_nodes))


def tag_entities(mesh: Mesh, dim: int, nodes: Integers, values: Integers) -> MeshTags:
    """MeshTags (e,) of cells, dim 3, or facets, 2, that rank 0 knows by their nodes (e, k).

    Nodes have the numbers given to `create_mesh`, in the order of dolfinx.
    """
    from dolfinx.mesh import meshtags_from_entities

    nodes, values = nodes.astype(np.int64), values.astype(np.int32)
    if hasattr(fem, "functionspace"):
        from dolfinx.graph import adjacencylist
        from dolfinx.io import distribute_entity_data

        found, tags = distribute_entity_data(mesh, dim, nodes, values)
    else:
        from dolfinx.cpp.graph import AdjacencyList_int32 as adjacencylist
        from dolfinx.cpp.io import distribute_entity_data

        found, tags = distribute_entity_data(mesh._mesh, dim, nodes, values)
    mesh.topology.create_connectivity(dim, 0)
    mesh.topology.create_connectivity(dim, mesh.topology.dim)
    return meshtags_from_entities(mesh, dim, adjacencylist(found), tags.astype(np.int32))


def reference_points(space: fem.FunctionSpace) -> Array:
    """(k, 3) where the nodes of a cell lie in the reference cell."""
    points = space.element.interpolation_points
    return np.asarray(points() if callable(points) else points)


def node_coordinates(space: fem.FunctionSpace) -> Array:
    """(k, 3) coordinates of the nodes this rank owns [m], the same bits from whatever cell.

    Shape functions of the geometry are halves, quarters or eighths at the nodes of second degree of
    straight cells, zero and one at those of curved ones; their round-off, which dolfinx leaves in,
    follows the cell.
    """
    geometry, nodes, X = space.mesh.geometry, cell_dofs(space), reference_points(space)
    if not len(nodes):  # a rank may have no cell
        return np.zeros((0, 3))
    corners = np.asarray(getattr(geometry.dofmap, "array", geometry.dofmap)).reshape(len(nodes), -1)
    mapped = _cell_map(space.mesh).push_forward
    unit = np.eye(corners.shape[1], -(-corners.shape[1] // 3) * 3)
    table = [mapped(X, unit[:, k : k + 3].copy()) for k in range(0, unit.shape[1], 3)]
    shapes = np.hstack(table)[:, : corners.shape[1]]
    eighths = np.round(8 * shapes) / 8
    shapes = np.where(np.abs(shapes - eighths) < 1e-12, eighths, shapes)
    x = np.zeros((space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, 3))
    for some in np.array_split(np.arange(len(nodes)), 1 + len(nodes) // CELLS_AT_ONCE):
        x[nodes[some]] = shapes @ geometry.x[corners[some]]
    return x[: space.dofmap.index_map.size_local]


def degree_of_slopes(mesh: Mesh, degree: int, power: int, in_bricks: int | None = None) -> int:
    """Quadrature degree for a power of the gradient of displacements, exact on straight tetrahedra.

    Curved cells get more; on hexahedra another power may count, ``in_bricks``.
    """
    curved = geometry_degree(mesh) - 1
    if cell_name(mesh) == "tetrahedron":
        return power * (degree - 1) + 3 * curved
    return (in_bricks or power) * degree + 2 * curved


def quadrature_rule(mesh: Mesh, degree: int) -> tuple[Array, Array]:
    """Points (k, 3) and weights (k,) of a quadrature exact for that degree, reference cell."""
    kind = getattr(basix.CellType, cell_name(mesh))
    points, weights = basix.make_quadrature(kind, max(degree, 1))
    return np.asarray(points), np.asarray(weights)


def evaluated(expression: fem.Expression, mesh: Mesh, cells: Integers) -> Array:
    """Values of an expression at its points in some cells."""
    parameters = inspect.signature(expression.eval).parameters
    arguments = (mesh, cells) if "mesh" in parameters else (cells,)
    return np.asarray(expression.eval(*arguments))
