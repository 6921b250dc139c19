"""What can be put right in a mesh without changing the body."""

from dataclasses import replace

import numpy as np

from rom.errors import MeshError
from rom.fe.mesh.cell_types import jacobians
from rom.fe.mesh.solid import SolidMesh, compact
from rom.fe.mesh.topology import find_rows, row_ids
from rom.model import Index

# Serendipity shape functions at the centre of a face, and of the cell: corners, then mid-edges.
AT_FACE, AT_MIDDLE = 4 * (-0.25,) + 4 * (0.5,), 8 * (-0.25,) + 12 * (0.25,)


def repair(mesh: SolidMesh) -> SolidMesh:
    """Complete 20-node hexahedra, turn mirrored cells round, drop unused nodes and facet copies.

    Renumbers the nodes. A mesh with node numbers out of range or numbers that are not finite comes
    back unchanged; the checks of `rom.fe.mesh.validate.validate` name the culprit.
    """
    n = mesh.points.shape[0]
    rows = (mesh.cells, *mesh.facets.values())
    if not mesh.cells.size or any(r.size and (r.min() < 0 or r.max() >= n) for r in rows):
        return mesh
    mesh = compact(replace(mesh, facets={k: _distinct(f) for k, f in mesh.facets.items()}))
    if not np.isfinite(mesh.points).all():
        return mesh
    return _turned(_complete(mesh) if mesh.cell_type == "hex20" else mesh)


def _distinct(rows: Index) -> Index:
    """Rows without copies, order kept."""
    return rows[np.sort(np.unique(np.sort(rows, axis=1), axis=0, return_index=True)[1])]


def _turned(mesh: SolidMesh) -> SolidMesh:
    """Cells of negative volume with their nodes in mirrored order.

    Whether the mesh is folded does not show here but at the faces: after this, two neighbours
    run around their face in the same direction (`rom.fe.mesh.validate`).
    """
    kind = mesh.kind
    centre = kind.straight.nodes.mean(axis=0, keepdims=True)
    volume = jacobians(mesh.points[mesh.corners], kind.straight.gradients(centre))[:, 0]
    mirrored = volume < 0
    if not mirrored.any():
        return mesh
    cells = mesh.cells.copy()
    cells[mirrored] = cells[mirrored][:, kind.mirrored]
    return replace(mesh, cells=cells)


def _complete(mesh: SolidMesh) -> SolidMesh:
    """27-node hexahedra with the same geometry as the 20-node ones: the new nodes are on it."""
    kind, cells, x = mesh.kind, mesh.cells, mesh.points
    if cells.shape[1] != kind.n_nodes:
        raise MeshError(f"a 20-node hexahedron needs 20 nodes, got {cells.shape[1]}.")
    n, m = len(x), len(cells)
    faces = cells[:, np.array(kind.face_nodes)].reshape(-1, 8)
    number, n_faces = row_ids(np.sort(faces[:, :4], axis=1), n)
    centres = np.empty((n_faces, 3))
    centres[number] = sum(w * x[faces[:, k]] for k, w in enumerate(AT_FACE))
    middles = sum(w * x[cells[:, k]] for k, w in enumerate(AT_MIDDLE))
    full = np.hstack([cells, n + number.reshape(m, 6), n + n_faces + np.arange(m)[:, None]])
    facets = {}
    for name, rows in mesh.facets.items():
        place = find_rows(rows[:, :4], faces[:, :4], n)
        known = (place >= 0).all()  # else the checks tell
        facets[name] = np.hstack([rows, n + number[place][:, None]]) if known else rows
    points = np.vstack([x, centres, middles])
    return replace(mesh, points=points, cells=full, cell_type="hex27", facets=facets)
