"""Shape of the cells: volume, Jacobian, aspect ratio."""

from dataclasses import replace

import numpy as np

from rom.errors import MeshError
from rom.fe.mesh.cell_types import CELL_TYPES, CellType, jacobians
from rom.fe.mesh.solid import SolidMesh, cell_names
from rom.model import Array, Index, Mask

# Smallest over largest possible determinant: round-off of coordinates gives 1e-16 times the
# distance from the origin over the cell size, bad but usable cells of gmsh have 1e-4.
FLAT_CELL_RTOL = 1e-10
MIN_CURVED_QUALITY = 1e-3  # curved cells below are made straight if this is allowed
MAX_ASPECT_RATIO = 100.0  # beyond it we warn; tetrahedra of a good mesh stay below 10
STRAIGHT_EDGE_RTOL = 1e-9  # of the edge: distance of its mid-side node from the middle
BLOCK_SIZE = 20_000  # cells looked at together, bounds the memory


def check_shape(mesh: SolidMesh) -> list[str]:
    """Refuse cells without volume and inverted ones, warn about slender ones.

    Raises:
        MeshError: with the numbers of the cells and the worst quality.
    """
    quality = scaled_jacobian(mesh)
    _refuse(
        mesh,
        np.abs(quality) < FLAT_CELL_RTOL,
        quality,
        "have no volume",
        "Mesh again; see gmsh's Mesh.Optimize.",
    )
    _refuse(
        mesh,
        quality < 0,
        quality,
        "are inverted: the Jacobian changes sign inside",
        "Mid-side nodes are too far out or corners are crossed; use smaller elements or "
        "straight edges.",
    )
    ratio = aspect_ratio(mesh)
    slender = np.flatnonzero(ratio > MAX_ASPECT_RATIO)
    if not slender.size:
        return []
    return [
        f"{slender.size} cells are slender, aspect ratio up to {ratio.max():.3g} (cells "
        f"{cell_names(mesh, slender)}): expect stiff and ill-conditioned results."
    ]


def _refuse(mesh: SolidMesh, bad: Mask, quality: Array, what: str, hint: str) -> None:
    cells = np.flatnonzero(bad)
    if cells.size:
        worst = quality[cells[np.abs(quality[cells]).argmin() if "no" in what else 0]]
        raise MeshError(
            f"{cells.size} cells {what}: cells {cell_names(mesh, cells)} (quality {worst:.2g}).",
            hint=hint,
        )


def scaled_jacobian(mesh: SolidMesh) -> Array:
    """(m,) smallest Jacobian determinant at the quadrature points over the cube of the cell.

    1 for a cube and 0.71 for a regular tetrahedron; 0 for a flat cell, negative for an inverted
    one.
    """
    kind = mesh.kind
    straight = CELL_TYPES["tet4" if kind.shape == "tetrahedron" else "hex8"]
    smallest = _smallest(mesh.points, mesh.corners, straight)
    if kind.degree == 2:
        curved = np.flatnonzero(_bent(mesh.points, mesh.cells, kind))
        smallest[curved] = _smallest(mesh.points, mesh.cells[curved], kind)
    return smallest / _longest_edge(mesh) ** 3


def straighten(mesh: SolidMesh) -> tuple[SolidMesh, list[str]]:
    """Straight edges where curved ones would turn a cell inside out.

    Where two curved surfaces touch, a second-order mesh cannot follow both. For meshes made from a
    geometry; in a finished mesh inverted cells are an error.

    Returns:
        The mesh, and a remark with the number of cells and the largest shift of a node.
    """
    kind, start = mesh.kind, mesh.points
    if kind.degree == 1:
        return mesh, []
    changed = np.zeros(len(mesh.cells), dtype=bool)
    while True:
        bad = (scaled_jacobian(mesh) < MIN_CURVED_QUALITY) & _bent(mesh.points, mesh.cells, kind)
        if not bad.any():
            break
        changed |= bad
        points, cells = mesh.points.copy(), mesh.cells[bad]
        for node, support in enumerate(kind.supports[kind.n_corners :], kind.n_corners):
            points[cells[:, node]] = points[cells[:, list(support)]].mean(axis=1)
        mesh = replace(mesh, points=points)
    if not changed.any():
        return mesh, []
    shift = np.linalg.norm(mesh.points - start, axis=1).max()
    return mesh, [
        f"{changed.sum()} cells got straight edges, because curved ones would have turned them "
        f"inside out; nodes moved by up to {shift:.2g} m."
    ]


def _smallest(points: Array, cells: Index, kind: CellType) -> Array:
    at = kind.quadrature[:1] if kind.name == "tet4" else kind.quadrature
    gradients = kind.gradients(at)
    blocks = [cells[i : i + BLOCK_SIZE] for i in range(0, len(cells), BLOCK_SIZE)]
    found = [jacobians(points[block], gradients).min(axis=1) for block in blocks]
    return np.concatenate(found) if found else np.empty(0)


def _bent(points: Array, cells: Index, kind: CellType) -> Mask:
    """(m,) whether any node lies away from the mean of its corners."""
    bent = np.zeros(len(cells), dtype=np.bool_)
    for node, support in enumerate(kind.supports[kind.n_corners :], kind.n_corners):
        corners = points[cells[:, list(support)]]
        away = np.abs(points[cells[:, node]] - corners.mean(axis=1)).max(axis=1)
        bent |= away > STRAIGHT_EDGE_RTOL * np.ptp(corners, axis=1).max(axis=1)
    return bent


def _edges(kind: CellType) -> list[tuple[int, int]]:
    """Corner pairs next to each other on a face."""
    rings = [zip(f, f[1:] + f[:1], strict=True) for f in kind.faces]
    return sorted({(min(e), max(e)) for ring in rings for e in ring})


def _longest_edge(mesh: SolidMesh) -> Array:
    x, corners = mesh.points, mesh.corners
    longest = np.zeros(len(corners))
    for a, b in _edges(mesh.kind):
        edge = x[corners[:, b]] - x[corners[:, a]]
        np.maximum(longest, np.einsum("ij,ij->i", edge, edge), out=longest)
    return np.sqrt(longest)


def aspect_ratio(mesh: SolidMesh) -> Array:
    """(m,) longest edge over the smallest height (tetrahedra) or edge (hexahedra)."""
    x, corners = mesh.points, mesh.corners
    if mesh.kind.shape == "hexahedron":
        lengths = [
            np.linalg.norm(x[corners[:, b]] - x[corners[:, a]], axis=1)
            for a, b in _edges(mesh.kind)
        ]
        return np.max(lengths, axis=0) / np.min(lengths, axis=0)
    a, b, c = (x[corners[:, i]] - x[corners[:, 0]] for i in (1, 2, 3))
    volume = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c)))
    areas = [
        np.linalg.norm(np.cross(u, v), axis=1) for u, v in ((a, b), (b, c), (c, a), (b - a, c - a))
    ]
    return _longest_edge(mesh) * np.max(areas, axis=0) / volume
