"""Checks of a mesh in NumPy, before dolfinx sees it.

dolfinx 0.5 stops the whole process, hangs, or computes with NaN on several of the meshes refused
here. Cells are named by their numbers in the file.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from rom.arguments import one_of
from rom.errors import MeshError, TagError, in_file, warn
from rom.fe.mesh.cell_types import CELL_TYPES
from rom.fe.mesh.quality import check_shape
from rom.fe.mesh.repair import repair
from rom.fe.mesh.solid import SolidMesh, cell_names, refuse_cells, shown
from rom.fe.mesh.topology import Faces, faces_of, find_rows, parts, row_ids
from rom.names import check_text, named
from rom.plausible import SIZE, far_doubt

SIZE_LIMITS = (1e-60, 1e60)  # m; beyond, volumes times stiffness leave the range of numbers
COINCIDENT_RTOL = 1e-9  # of the mesh's size


def validate(mesh: SolidMesh) -> list[str]:
    """Check that a mesh, repaired, is one solid of valid cells with valid names.

    Returned are warnings of what is legal, but a careful user wants to know.
    """
    for what, names in (("a region", mesh.region_names.values()), ("a surface", mesh.facets)):
        for name in names:
            check_text(name, what, TagError)
    for check in (_check_tables, _check_numbers, _check_cells):
        check(mesh)
    warnings = check_shape(mesh)
    faces = faces_of(mesh.cells, mesh.kind, mesh.points.shape[0])
    _check_faces(mesh, faces)
    _check_connected(mesh, faces)
    _check_facets(mesh, faces)
    _check_regions(mesh)
    if same := _coincident_nodes(mesh, faces):
        warnings.append(
            f"{same} nodes of the surface lie at the same place as another: the body has a slit of "
            "no width there. Merge the nodes if that is not meant."
        )
    distance = float(np.linalg.norm(0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))))
    doubts = SIZE.doubt(mesh.size, "the mesh"), far_doubt(distance, mesh.size, "the mesh")
    return [*warnings, *filter(None, doubts)]


def _check_tables(mesh: SolidMesh) -> None:
    one_of("the type of cells", mesh.cell_type, CELL_TYPES, error=MeshError)
    kind, m = mesh.kind, mesh.cells.shape[0]
    if not m:
        raise MeshError("there are no volume cells; mesh in 3D, or give the .geo or .step file.")
    shapes = {
        "points": (mesh.points.shape[1:], (3,)),
        "cells": (mesh.cells.shape[1:], (kind.n_nodes,)),
        "regions": (mesh.regions.shape, (m,)),
    }
    for name, (found, wanted) in shapes.items():
        if found != wanted:
            raise MeshError(f"{name} has rows of shape {found}, {kind.name} needs {wanted}.")
    for name, rows in mesh.facets.items():
        if rows.shape[1:] != (kind.nodes_per_face,) or not rows.size:
            raise TagError(
                f"surface {name!r} has {rows.shape[0]} facets of {rows.shape[1]} nodes; facets "
                f"of {kind.name} have {kind.nodes_per_face}."
            )


def _check_numbers(mesh: SolidMesh) -> None:
    n = mesh.points.shape[0]
    outside = ((mesh.cells < 0) | (mesh.cells >= n)).any(axis=1)
    refuse_cells(mesh, outside, f"cells name nodes outside 0 to {n - 1}")
    bad = ~np.isfinite(mesh.points).all(axis=1)
    if bad.any():
        where, cells = mesh.points[bad.argmax()], np.flatnonzero(bad[mesh.cells].any(axis=1))
        raise MeshError(
            f"{bad.sum()} nodes have coordinates that are not finite, the first {where.tolist()}; "
            f"they belong to cells {cell_names(mesh, cells)}."
        )
    size = np.ptp(mesh.points, axis=0).max()
    if not SIZE_LIMITS[0] < size < SIZE_LIMITS[1]:
        raise MeshError(f"the body has a size of {size:.3g} m.", hint="Check the scale.")
    for name, rows in mesh.facets.items():
        if rows.min() < 0 or rows.max() >= n:
            raise TagError(f"surface {name!r} must name nodes from 0 to {n - 1} only.")


def _check_cells(mesh: SolidMesh) -> None:
    ordered = np.sort(mesh.cells, axis=1)
    refuse_cells(
        mesh,
        (ordered[:, 1:] == ordered[:, :-1]).any(axis=1),
        "cells use a node twice",
        "Collapsed cells have no volume; mesh again.",
    )
    number, _ = row_ids(np.sort(mesh.corners, axis=1), mesh.points.shape[0])
    refuse_cells(
        mesh,
        np.bincount(number)[number] > 1,
        "cells have the same corners as another one",
        "Part of the body is there twice; remove the copy.",
    )


def _check_faces(mesh: SolidMesh, faces: Faces) -> None:
    refuse_cells(
        mesh,
        (faces.count[faces.of_cell] > 2).any(axis=1),
        "cells share a face with more than one other cell",
        "Cells overlap; fragment the volumes in the geometry.",
    )
    # at an inner face the two directions cancel when the cells lie on opposite sides
    number = faces.of_cell.ravel()
    total = np.bincount(number, weights=faces.sign.ravel(), minlength=faces.count.size)
    folded = (faces.count == 2) & (total != 0)
    refuse_cells(
        mesh,
        folded[faces.of_cell].any(axis=1),
        "cells lie on the same side of a common face: the mesh is folded",
        "Mesh again with smaller elements, or repair the geometry.",
    )


def _check_connected(mesh: SolidMesh, faces: Faces) -> None:
    n_parts, part = parts(faces.of_cell)
    if n_parts == 1:
        return
    n_loose = parts(mesh.corners)[0]
    sizes = shown(np.sort(np.bincount(part))[::-1])
    if n_loose == 1:
        why, hint = "meet only in an edge or a point, like a hinge", "Let the parts share faces."
    else:
        same = _coincident_nodes(mesh, faces)
        what = f"{same} nodes of them lie on nodes of others" if same else "they do not touch"
        why, n_parts = f"are not connected; {what}", n_loose
        hint = (
            "One model is one body: fragment the volumes (BooleanFragments, Coherence) or merge "
            "doubled nodes before meshing, or make a model of each part."
        )
    raise MeshError(f"the mesh has {n_parts} parts ({sizes} cells) that {why}.", hint=hint)


def _coincident_nodes(mesh: SolidMesh, faces: Faces) -> int:
    """Number of corners of the outer surface that have another one at the same place."""
    skin = np.unique(faces.corners[faces.count == 1])
    tree = cKDTree(mesh.points[skin])
    return int(np.unique(tree.query_pairs(COINCIDENT_RTOL * mesh.size, output_type="ndarray")).size)


def _check_facets(mesh: SolidMesh, faces: Faces) -> None:
    for name, rows in mesh.facets.items():
        corners = rows[:, : mesh.kind.corners_per_face]
        alien = find_rows(corners, faces.corners, len(mesh.points)) < 0
        if alien.any():
            raise TagError(
                f"{alien.sum()} of {alien.size} facets of surface {name!r} are not faces of any "
                f"cell; the first has the nodes {rows[alien.argmax()].tolist()}.",
                hint="The surface is not part of the meshed volume, or meshed on its own.",
            )


def _check_regions(mesh: SolidMesh) -> None:
    used = {int(r) for r in np.unique(mesh.regions)}
    names = list(mesh.region_names.values())
    nameless = sorted(used - mesh.region_names.keys())
    unused = sorted(name for tag, name in mesh.region_names.items() if tag not in used)
    double = sorted({name for name in names if names.count(name) > 1})
    for some, text in (
        (nameless, "region {} has cells and needs a name in region_names."),
        (unused, "region {} needs cells; leave the name out without."),
        (double, "the name {} stands for several regions; each needs its own."),
    ):
        if some:
            raise TagError(text.format(named(some)))


def checked(mesh: SolidMesh, remarks: Sequence[str] = ()) -> SolidMesh:
    """Repair and validate a mesh, e.g. one made by hand; issues its warnings as `RomWarning`.

    Remarks are warnings of the reader; errors those of `validate`.
    """
    where = str(mesh.provenance.get("path", ""))
    with in_file(where):
        mesh = repair(mesh)
        found = (*remarks, *validate(mesh))
    for text in found:
        warn(f"{where}: {text}" if where else text)
    return replace(mesh, warnings=found)
