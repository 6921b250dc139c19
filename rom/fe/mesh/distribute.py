"""From a mesh on rank 0 to a dolfinx mesh on all ranks."""

from typing import Any

from mpi4py import MPI

import numpy as np

from rom.errors import ParallelError
from rom.fe.compat import create_mesh, gmsh_order, tag_entities
from rom.fe.mesh.cell_types import CELL_TYPES
from rom.fe.mesh.solid import SolidMesh
from rom.fe.mesh.validate import checked
from rom.fe.parallel import on_root
from rom.model import Index, Integers

FACET_SHAPE = {"tetrahedron": "triangle", "hexahedron": "quadrilateral"}


def distribute(mesh: SolidMesh | None, comm: MPI.Comm) -> tuple[Any, Any, dict[str, Any]]:
    """Share a mesh among the ranks; see `rom.fe.mesh.read.to_dolfinx`."""
    solid, (cell_type, names) = _prepared(mesh, comm)
    kind = CELL_TYPES[cell_type]
    order = gmsh_order(kind.shape, kind.n_nodes)
    cells = _rows(solid.cells if solid else None, order)
    points = solid.points if solid else np.empty((0, 3))
    made = create_mesh(comm, cells, points, kind.shape, kind.degree)
    regions = solid.regions if solid else np.empty(0, dtype=np.int64)
    cell_tags = tag_entities(made, 3, cells, regions)
    order = gmsh_order(FACET_SHAPE[kind.shape], kind.nodes_per_face)
    facet_tags = {}
    for name in names:
        facets = _rows(solid.facets[name] if solid else None, order)
        facet_tags[name] = tag_entities(made, 2, facets, np.ones(len(facets), dtype=np.int32))
        facet_tags[name].name = name
    return made, cell_tags, facet_tags


def _prepared(
    mesh: SolidMesh | None, comm: MPI.Comm
) -> tuple[SolidMesh | None, tuple[str, list[str]]]:
    """The checked mesh on rank 0, and on all ranks its cell type and surface names."""
    kept: list[SolidMesh] = []

    def prepare() -> tuple[str, list[str]]:
        if mesh is None:
            raise ParallelError("rank 0 gave no mesh to share.", hint="Read it on rank 0.")
        solid = mesh if mesh.warnings is not None else checked(mesh)
        kept.append(solid)
        return solid.cell_type, list(solid.facets)

    head = on_root(comm, prepare)
    return (kept[0] if kept else None), head


def _rows(rows: Index | None, order: Integers) -> Index:
    """Rows in the order of dolfinx; none on ranks that hold no mesh."""
    if rows is None:
        return np.empty((0, order.size), dtype=np.int64)
    return np.ascontiguousarray(rows[:, order])
