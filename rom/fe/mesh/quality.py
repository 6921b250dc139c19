"""Shape of the cells: volume, Jacobian, aspect ratio."""

from collections.abc import Iterator
from dataclasses import replace
from functools import reduce
from itertools import chain, repeat

import numpy as np

from rom.fe.mesh.cell_types import CellType, jacobians, over_blocks
from rom.fe.mesh.curving import BOUND_GAP, bent, smallest_determinants, straightened
from rom.fe.mesh.solid import SolidMesh, cell_names, refuse_cells
from rom.fe.mesh.topology import faces_of
from rom.model import Array, Index

# Smallest over largest possible determinant: round-off of coordinates gives 1e-16 times the
# distance from the origin over the cell size, bad but usable cells of gmsh have 1e-4.
FLAT_CELL_RTOL = 1e-10
MIN_CURVED_QUALITY = 1e-3  # curved cells below are made straighter if this is allowed
SHARES = (0.1, 0.2, 0.4, 1.0)  # of the way to the straight cell, one after the other
FEW_STRAIGHTENED = 0.01  # of the curved cells: a geometry with fillets has some in any mesh
MAX_ASPECT_RATIO = 100.0  # beyond it we warn; tetrahedra of a good mesh stay below 10
# Of one layer of tetrahedra by the degree of the displacement: length over thickness of the cells
# from where it is told, and error of frequencies at ten times; measured on plates against finer
# ones. On a ring of 50 thicknesses it is 1 % at five times and 50 % at ten. Bricks do better.
ONE_LAYER = {1: (1.5, 0.0), 2: (6.0, 0.03), 3: (12.0, 0.003)}
BRICKS, THIN_SHARE, FINE_RATIO = 1.5, 0.3, 5.0  # limits of them, share of the cells, what cures


def check_shape(mesh: SolidMesh) -> list[str]:
    """Refuse cells without volume and inverted ones by a MeshError, warn about slender ones."""
    quality, sampled = scaled_jacobian(mesh), _sampled(mesh) / _longest_edge(mesh) ** 3
    refuse_cells(
        mesh,
        np.abs(sampled) < FLAT_CELL_RTOL,
        f"cells have no volume (quality {np.abs(sampled).min():.2g})",
        "Mesh again; see gmsh's Mesh.Optimize.",
    )
    refuse_cells(
        mesh,
        quality < -FLAT_CELL_RTOL,
        f"cells are inverted: the Jacobian changes sign inside (quality {quality.min():.2g})",
        "Mid-side nodes are too far out or corners are crossed; use smaller elements, straight "
        "edges, or Mesh.HighOrderOptimize of gmsh.",
    )
    ratio = aspect_ratio(mesh)
    slender = np.flatnonzero(ratio > MAX_ASPECT_RATIO)
    if not slender.size:
        return []
    return [
        f"{slender.size} cells are slender, aspect ratio up to {ratio.max():.3g} (cells "
        f"{cell_names(mesh, slender)}): expect stiff and ill-conditioned results."
    ]


def scaled_jacobian(mesh: SolidMesh) -> Array:
    """(m,) smallest Jacobian determinant over the cube of the cell.

    1 for a cube and 0.71 for a regular tetrahedron; 0 for a flat cell, negative for an inverted
    one. Of straight cells at the quadrature points, of curved ones anywhere in the cell, to 1e-4.
    """
    kind, cube, smallest = mesh.kind, _longest_edge(mesh) ** 3, _sampled(mesh)
    if kind.degree == 2:
        curved = np.flatnonzero(bent(mesh))
        smallest[curved] = smallest_determinants(
            mesh.points, mesh.cells[curved], kind, BOUND_GAP * cube[curved]
        )
    return smallest / cube


def straighten(mesh: SolidMesh) -> tuple[SolidMesh, list[str]]:
    """The mesh with straighter edges where curved ones would turn a cell inside out, and remarks.

    A tetrahedron with two faces on one smooth surface has no angle between them once both follow
    it. Its nodes go back towards the straight cell, no further than needed. For meshes made from a
    geometry; in a finished mesh inverted cells are an error. Counts stand in the provenance.
    """
    if mesh.kind.degree == 1:
        return mesh, []
    start, curved = mesh.points, bent(mesh)
    changed = np.zeros(len(mesh.cells), dtype=bool)
    for share in chain(SHARES, repeat(1.0)):
        bad = (scaled_jacobian(mesh) < MIN_CURVED_QUALITY) & bent(mesh)
        if not bad.any():
            break
        changed |= bad
        mesh = straightened(mesh, bad, share)
    numbers = {"curved cells": int(curved.sum()), "straightened cells": int(changed.sum())}
    mesh = replace(mesh, provenance=mesh.provenance | numbers)
    if changed.sum() <= FEW_STRAIGHTENED * curved.sum():
        return mesh, []
    shift = np.linalg.norm(mesh.points - start, axis=1).max()
    return mesh, [
        f"{changed.sum()} of {curved.sum()} curved cells got straighter edges, because they would "
        f"have been turned inside out; nodes moved by up to {shift:.2g} m. Smaller elements follow "
        "the surface."
    ]


def layer_doubt(mesh: SolidMesh, degree: int) -> str:
    """What a single layer of cells through a thin body costs, in a sentence, or nothing."""
    (limit, cost), slender = ONE_LAYER[degree], aspect_ratio(mesh)
    limit *= BRICKS if mesh.kind.shape == "hexahedron" else 1.0
    thin = slender > limit
    if thin.mean() < THIN_SHARE:
        return ""
    n = len(mesh.points)
    faces, skin = faces_of(mesh.cells, mesh.kind, n), np.zeros(n, bool)
    skin[faces.corners[faces.count == 1]] = True
    thin &= skin[mesh.corners].all(axis=1)
    volumes, outer = cell_volumes(mesh), faces.of_cell[thin]
    x = mesh.points[faces.corners[outer[faces.count[outer] == 1]]]
    sides = np.cross(x[:, 2] - x[:, 0], x[:, -1] - x[:, 1])  # by diagonals, or two edges
    share = volumes[thin].sum() / volumes.sum()
    if share < THIN_SHARE or not sides.any():
        return ""
    thickness = 4 * volumes[thin].sum() / np.linalg.norm(sides, axis=1).sum()
    ratio = np.median(np.minimum(slender, _longest_edge(mesh) / thickness)[thin])
    if ratio < limit:
        return ""
    error = f"{ratio:.2g} times" if degree == 1 else f"{cost * ratio**2:.0f} %"
    cure = ("degree=2, with", "degree=3, or", "at most")[degree - 1]
    size = FINE_RATIO * thickness
    return (
        f"cells with {share:.0%} of the volume reach from surface to surface, {ratio:.2g} times as "
        f"long as thick: with degree={degree} frequencies of bending come out up to about {error} "
        f"too high, far more where it is curved. Use {cure} elements of {size:.2g} m."
    )


def cell_volumes(mesh: SolidMesh) -> Array:
    """(m,) volumes of the cells [m^3], exact for curved ones too."""
    at, weights = mesh.kind.quadrature
    gradients = mesh.kind.gradients(at)
    return over_blocks(mesh.cells, lambda block: jacobians(mesh.points[block], gradients) @ weights)


def _sampled(mesh: SolidMesh) -> Array:
    """(m,) smallest determinant at the quadrature points."""
    kind = mesh.kind
    smallest = _smallest(mesh.points, mesh.corners, kind.straight)
    if kind.degree == 2:
        curved = np.flatnonzero(bent(mesh))
        smallest[curved] = _smallest(mesh.points, mesh.cells[curved], kind)
    return smallest


def _smallest(points: Array, cells: Index, kind: CellType) -> Array:
    at, _ = kind.quadrature
    gradients = kind.gradients(at[:1] if kind.name == "tet4" else at)
    return over_blocks(cells, lambda block: jacobians(points[block], gradients).min(axis=1))


def _edge_lengths(mesh: SolidMesh) -> Iterator[Array]:
    """(m,) lengths of the edges of all cells, one edge after the other."""
    x, corners = mesh.points, mesh.corners
    rings = (zip(f, f[1:] + f[:1], strict=True) for f in mesh.kind.faces)
    edges = {(min(ends), max(ends)) for ring in rings for ends in ring}
    return (np.linalg.norm(x[corners[:, b]] - x[corners[:, a]], axis=1) for a, b in edges)


def _longest_edge(mesh: SolidMesh) -> Array:
    return reduce(np.maximum, _edge_lengths(mesh))


def aspect_ratio(mesh: SolidMesh) -> Array:
    """(m,) longest edge over the smallest height (tetrahedra) or edge (hexahedra)."""
    x, corners, longest = mesh.points, mesh.corners, _longest_edge(mesh)
    if mesh.kind.shape == "hexahedron":
        return longest / reduce(np.minimum, _edge_lengths(mesh))
    a, b, c = (x[corners[:, i]] - x[corners[:, 0]] for i in (1, 2, 3))
    volume = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c)))
    areas = [
        np.linalg.norm(np.cross(u, v), axis=1) for u, v in ((a, b), (b, c), (c, a), (b - a, c - a))
    ]
    return longest * np.max(areas, axis=0) / volume
