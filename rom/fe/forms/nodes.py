"""Interfaces and outer surface of a distributed model, the same on all ranks and any number."""

from itertools import pairwise

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import exterior_facet_indices
from scipy.sparse import csr_matrix

from rom.errors import InterfaceError
from rom.fe.compat import (
    MeshTags,
    assemble_matrix,
    cell_dofs,
    cell_name,
    node_coordinates,
    sub_entities,
    to_global,
)
from rom.model import Array, Index, Integers, Interface, Numbers, SurfaceMesh

COINCIDENT_RTOL = 1e-8  # of the size, when nodes are sorted
GRID_OFFSET = 0.381966  # keeps round coordinates away from the edge between two cells of that grid


def gathered(comm: MPI.Comm, rows: Numbers) -> Numbers:
    """Rows of all ranks, one below the other, on all ranks."""
    return np.concatenate(comm.allgather(rows)) if comm.size > 1 else rows


def all_points(V: fem.FunctionSpace) -> Array:
    """(n/3, 3) coordinates of all nodes in global numbering [m]."""
    return np.ascontiguousarray(gathered(V.mesh.comm, node_coordinates(V)))


def by_position(points: Array, size: float) -> Index:
    """Order of points by x, then y, then z, blind to round-off."""
    x, y, z = np.floor(points / (COINCIDENT_RTOL * size) + GRID_OFFSET).T
    return np.lexsort((z, y, x))


def interface(name: str, tags: MeshTags, V: fem.FunctionSpace, points: Array) -> Interface:
    """The nodes, surface mass and centroid of a surface, tagged by MeshTags of its facets."""
    comm, facets = V.mesh.comm, tags.indices
    if comm.allreduce(facets.size) == 0:
        raise InterfaceError(f"the interface {name!r} has no facet; use tags of the mesh.")
    local = fem.locate_dofs_topological(V, 2, facets.astype(np.int32))
    nodes = np.unique(gathered(comm, to_global(V.dofmap.index_map, local)))
    nodes = nodes[by_position(points[nodes], np.ptp(points, axis=0).max())]
    S = _surface_mass(V, facets, nodes)
    weights = np.asarray(S.sum(axis=0)).ravel()
    if not weights.sum() > 0.0:
        text = f"the interface {name!r} lies inside the solid and has no outer surface"
        raise InterfaceError(f"{text}; interfaces are parts of the outer boundary.")
    return Interface(name, nodes, points[nodes], S, weights @ points[nodes] / weights.sum())


def _surface_mass(V: fem.FunctionSpace, facets: Integers, nodes: Index) -> csr_matrix:
    """(k, k) integrals of N_i N_j over the facets, on all ranks."""
    from dolfinx.mesh import meshtags

    facets = np.sort(facets).astype(np.int32)
    tags = meshtags(V.mesh, 2, facets, np.ones(facets.size, dtype=np.int32))
    ds = ufl.Measure("ds", domain=V.mesh, subdomain_data=tags)
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    A = assemble_matrix(u[0] * v[0] * ds(1))
    starts, columns, values = A.getValuesCSR()
    rows = np.repeat(np.arange(*A.getOwnershipRange()), np.diff(starts))
    A.destroy()
    keep = (values != 0.0) & (rows % 3 == 0)
    comm = V.mesh.comm
    i, j, values = (gathered(comm, part[keep]) for part in (rows // 3, columns // 3, values))
    order = np.argsort(nodes)
    i, j = (order[np.searchsorted(nodes[order], numbers)] for numbers in (i, j))
    S = csr_matrix((values, (i, j)), shape=(nodes.size, nodes.size))
    return 0.5 * (S + S.T)


def outer_surface(V: fem.FunctionSpace, points: Array, degree: int) -> SurfaceMesh:
    """Triangles of the boundary through all its nodes, seen from outside counter-clockwise.

    Quadratic facets are split at their middle nodes; of cubic ones the corners are used.
    """
    triangles = gathered(V.mesh.comm, _boundary_triangles(V, points, min(degree, 3)))
    nodes, corners = np.unique(triangles, return_inverse=True)
    order = by_position(points[nodes], np.ptp(points, axis=0).max())
    place = np.empty(nodes.size, dtype=np.int64)
    place[order] = np.arange(nodes.size)
    corners = place[corners].reshape(-1, 3)
    first = np.argmin(corners, axis=1)  # start each triangle at its lowest corner
    corners = np.take_along_axis(corners, (first[:, None] + np.arange(3)) % 3, axis=1)
    return SurfaceMesh(nodes[order], corners[np.lexsort(corners.T[::-1])])


def _boundary_triangles(V: fem.FunctionSpace, points: Array, degree: int) -> Index:
    """(t, 3) global nodes of this rank's boundary facets."""
    topology = V.mesh.topology
    topology.create_connectivity(2, 3)
    topology.create_connectivity(3, 2)
    facets = exterior_facet_indices(topology)
    cells_at, facets_of = (topology.connectivity(*dims).links for dims in ((2, 3), (3, 2)))
    pairs = [(f, cells_at(f)[0]) for f in facets]
    local = np.array([np.flatnonzero(facets_of(c) == f)[0] for f, c in pairs], dtype=np.int64)
    cells = np.array([c for _, c in pairs], dtype=np.int64)
    name = cell_name(V.mesh)
    corners = [V.dofmap.dof_layout.entity_dofs(0, i)[0] for i in range(len(sub_entities(name)[0]))]
    table, parts = cell_dofs(V), [np.empty((0, 3), dtype=np.int64)]
    for k, pattern in enumerate(_patterns(V, name, degree)):
        dofs = table[cells[local == k]]
        nodes = to_global(V.dofmap.index_map, dofs.ravel()).reshape(dofs.shape)
        centre = points[nodes[:, corners]].mean(axis=1)
        parts += [_outward(nodes[:, triangle], points, centre) for triangle in pattern]
    return np.concatenate(parts)


def _outward(triangles: Index, points: Array, inside: Array) -> Index:
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - inside) < 0
    return np.where(inward[:, None], triangles[:, [0, 2, 1]], triangles)


def _patterns(V: fem.FunctionSpace, name: str, degree: int) -> list[list[list[int]]]:
    """For each facet of the reference cell, triangles in the dof numbers of the cell."""
    layout, entities = V.dofmap.dof_layout, sub_entities(name)
    patterns = []
    for k, facet in enumerate(entities[2]):
        ring = facet if len(facet) == 3 else [facet[i] for i in (0, 1, 3, 2)]
        corners = [layout.entity_dofs(0, vertex)[0] for vertex in ring]
        if degree != 2:
            patterns.append([[corners[0], b, c] for b, c in pairwise(corners[1:])])
            continue
        edges = [sorted(pair) for pair in zip(ring, ring[1:] + ring[:1], strict=True)]
        middles = [layout.entity_dofs(1, entities[1].index(edge))[0] for edge in edges]
        centre = layout.entity_dofs(2, k)[0] if len(ring) == 4 else None
        patterns.append(_split(corners, middles, centre))
    return patterns


def _split(corners: list[int], middles: list[int], centre: int | None) -> list[list[int]]:
    """Triangles of a quadratic facet: one at each corner, the rest around the centre."""
    n = len(corners)
    tips = [[corners[i], middles[i], middles[i - 1]] for i in range(n)]
    if centre is None:
        return [*tips, list(middles)]
    return tips + [[centre, middles[i - 1], middles[i]] for i in range(n)]
