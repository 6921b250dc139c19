"""From an open gmsh model to flat triangles, curves and surfaces; runs in the child process."""

from typing import Any

import numpy as np

from rom.errors import MeshError
from rom.fe.mesh.solid import Read, packed
from rom.model import Array, Index

LINE, TRIANGLE = 1, 2  # types of gmsh
FLAT_RTOL = 1e-9  # height over the extent


def triangles(gmsh: Any) -> Read:
    """Arrays and notes as `rom.fe.mesh.sources.readers.read` returns them, facets being curves.

    Raises:
        MeshError: without triangles, with other cells, or off the plane z = 0.
    """
    tags, x, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags, kind="stable")
    tags, points = tags[order].astype(np.int64), x.reshape(-1, 3)[order]
    cells, ids = _cells(gmsh, tags)
    surfaces = _surfaces(gmsh, ids)
    used, cells = np.unique(cells, return_inverse=True)
    points, cells = points[used], cells.reshape(-1, 3)
    extent = np.ptp(points, axis=0)
    if np.abs(points[:, 2]).max() > FLAT_RTOL * extent.max():
        raise MeshError(f"the mesh leaves the plane z = 0 by {np.abs(points[:, 2]).max():.3g} m.",
                        hint="Draw a plane section in x and y.")  # fmt: skip
    place = np.full(tags.size, -1)
    place[used] = np.arange(used.size)
    curves = {
        gmsh.model.getPhysicalName(dim, tag) or f"curve_{tag}": _lines(gmsh, tag, tags, place)
        for dim, tag in gmsh.model.getPhysicalGroups(1)
    }
    arrays, notes = packed(
        points, cells, "tri3", np.ones(len(cells), dtype=int), ids, facets=curves,
        region_names={1: "body"}, surface_names=list(surfaces), warnings=[],
    )  # fmt: skip
    return arrays | {f"surface {i}": rows for i, rows in enumerate(surfaces.values())}, notes


def _cells(gmsh: Any, tags: Index) -> tuple[Index, Index]:
    """Corners as positions among the tags, and numbers, of all triangles."""
    kinds, ids, nodes = gmsh.model.mesh.getElements(2)
    others = [gmsh.model.mesh.getElementProperties(kind)[0] for kind in kinds if kind != TRIANGLE]
    if others:
        raise MeshError(f"cells of the type {others[0]}: triangles with three nodes are needed.",
                        hint="Leave out Recombine, and keep Mesh.ElementOrder = 1.")  # fmt: skip
    if not len(kinds):
        raise MeshError("there are no triangles: the geometry has no plane surface.",
                        hint="Add Plane Surface(1) = {...};")  # fmt: skip
    return np.searchsorted(tags, nodes[0].astype(np.int64)).reshape(-1, 3), ids[0].astype(np.int64)


def _surfaces(gmsh: Any, ids: Index) -> dict[str, Index]:
    """Triangles of each plane surface: those of physical ones if there are any, or of all."""
    named: dict[str, int] = {}
    for dim, tag in gmsh.model.getPhysicalGroups(2):
        parts = [int(part) for part in gmsh.model.getEntitiesForPhysicalGroup(dim, tag)]
        name = gmsh.model.getPhysicalName(dim, tag) or f"surface_{tag}"
        single = len(parts) == 1
        named |= {name if single else f"{name} {k}": part for k, part in enumerate(parts, 1)}
    named = named or {f"surface {tag}": tag for _, tag in gmsh.model.getEntities(2)}
    order = np.argsort(ids, kind="stable")
    return {name: order[np.searchsorted(ids[order], _triangle_ids(gmsh, tag))]
            for name, tag in named.items()}  # fmt: skip


def _triangle_ids(gmsh: Any, surface: int) -> Index:
    found = gmsh.model.mesh.getElements(2, surface)[1]
    return np.concatenate([np.zeros(0, dtype=np.int64), *(x.astype(np.int64) for x in found)])


def _lines(gmsh: Any, tag: int, tags: Index, place: Array) -> Index:
    """(k, 2) nodes of the sides of a physical curve."""
    found = [np.zeros((0, 2), dtype=np.int64)]
    for curve in gmsh.model.getEntitiesForPhysicalGroup(1, tag):
        kinds, _, nodes = gmsh.model.mesh.getElements(1, curve)
        for kind, rows in zip(kinds, nodes, strict=True):
            if kind == LINE:
                found.append(place[np.searchsorted(tags, rows.astype(np.int64))].reshape(-1, 2))
    return np.vstack(found)
