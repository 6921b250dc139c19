"""What can be put right in a mesh without changing the body."""

from dataclasses import replace

import numpy as np

from rom.errors import MeshError
from rom.fe.mesh.cell_types import CellType, jacobians
from rom.fe.mesh.solid import SolidMesh, compact
from rom.fe.mesh.topology import row_ids
from rom.model import Array, Index

# Serendipity shape functions at the centre of a face, and of the cell: corners, then mid-edges.
FACE_CORNER, FACE_EDGE, CELL_CORNER, CELL_EDGE = -0.25, 0.5, -0.25, 0.25


def repair(mesh: SolidMesh) -> SolidMesh:
    """Complete 20-node hexahedra, turn mirrored cells round, drop unused nodes and facet copies.

    Renumbers the nodes. A mesh with node numbers out of range or numbers that are not finite comes
    back unchanged; the checks of `rom.fe.mesh.validate.validate` name the culprit.
    """
    n = mesh.points.shape[0]
    rows = (mesh.cells, *mesh.facets.values())
    if not mesh.cells.size or any(r.size and (r.min() < 0 or r.max() >= n) for r in rows):
        return mesh
    mesh = compact(replace(mesh, facets={k: _distinct(f, n) for k, f in mesh.facets.items()}))
    if not np.isfinite(mesh.points).all():
        return mesh
    return _turned(_complete(mesh) if mesh.cell_type == "hex20" else mesh)


def _distinct(rows: Index, n: int) -> Index:
    """Rows without copies, order kept."""
    if not rows.size:
        return rows
    number, _ = row_ids(np.sort(rows, axis=1), n + rows.size + 1)
    return rows[np.sort(np.unique(number, return_index=True)[1])]


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
    n, m = x.shape[0], cells.shape[0]
    faces = cells[:, np.array(kind.faces)]
    number, n_faces = row_ids(np.sort(faces.reshape(-1, 4), axis=1), n)
    centres = np.empty((n_faces, 3))
    centres[number] = _face_centres(x, cells, kind).reshape(-1, 3)
    middle = CELL_CORNER * x[cells[:, :8]].sum(axis=1) + CELL_EDGE * x[cells[:, 8:]].sum(axis=1)
    full = np.hstack([cells, n + number.reshape(m, 6), n + n_faces + np.arange(m)[:, None]])
    facets = {name: _complete_facets(f, faces, number, n) for name, f in mesh.facets.items()}
    points = np.vstack([x, centres, middle])
    return replace(mesh, points=points, cells=full, cell_type="hex27", facets=facets)


def _face_centres(x: Array, cells: Index, kind: CellType) -> Array:
    """(m, 6, 3) centres of the faces."""
    centres = []
    for nodes in map(list, kind.face_nodes):
        corner, edge = (x[cells[:, some]].sum(axis=1) for some in (nodes[:4], sorted(nodes[4:])))
        centres.append(FACE_CORNER * corner + FACE_EDGE * edge)
    return np.stack(centres, axis=1)


def _complete_facets(facets: Index, faces: Index, number: Index, n: int) -> Index:
    """(f, 9) facets with the centre of their face; (f, 8) ones of no face come back unchanged."""
    known = np.sort(faces.reshape(-1, 4), axis=1)
    both, _ = row_ids(np.vstack([known, np.sort(facets[:, :4], axis=1)]), n)
    face = np.full(both.max(initial=0) + 1, -1)
    face[both[: len(known)]] = number
    centre = face[both[len(known) :]]
    return facets if (centre < 0).any() else np.hstack([facets, n + centre[:, None]])
