"""What a mesh holds, in numbers."""

from dataclasses import asdict

import numpy as np

from rom.fe.mesh.cad import Axis
from rom.fe.mesh.cell_types import DECK_EDGES
from rom.fe.mesh.quality import aspect_ratio, cell_volumes, scaled_jacobian
from rom.fe.mesh.solid import Notes, SolidMesh
from rom.fe.mesh.topology import faces_of, row_ids
from rom.model import Array, Index

COUNTED_CELLS = ("curved cells", "straightened cells")  # where the mesh was made here
VTK_TYPES = {"tet4": 10, "tet10": 24, "hex8": 12, "hex27": 29}
VTK_HEX_FACES = ((0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7))


def summary(mesh: SolidMesh) -> Notes:
    """Sizes, regions, interfaces and quality of a mesh, in plain Python."""
    volumes = cell_volumes(mesh)
    return {
        "file": str(mesh.provenance.get("path", "")),
        "cell_type": mesh.cell_type,
        "cells": len(mesh.cells),
        "nodes": len(mesh.points),
        "parameters": {
            name: value
            for name, value in mesh.provenance.get("parameters", {}).items()
            if isinstance(value, int | float)
        },
        "box": _box(mesh.points).T.tolist(),
        "volume": float(volumes.sum()),
        "regions": {
            name: {
                "cells": int((mesh.regions == tag).sum()),
                "volume": float(volumes[mesh.regions == tag].sum()),
            }
            for tag, name in mesh.region_names.items()
        },
        "interfaces": {
            name: {
                "facets": len(facets),
                "nodes": len(np.unique(facets)),
                "middle": np.mean(_box(mesh.points[facets.ravel()]), axis=0).tolist(),
                **_axis(mesh.axes.get(name)),
            }
            for name, facets in mesh.facets.items()
        },
        "ties": {name: len(tie.points) for name, tie in mesh.ties.items() if tie.kind},
        "masses": [{"interface": body.interface, "mass": body.mass} for body in mesh.carried],
        "springs": [spring.name for spring in mesh.springs],
        "quality": {
            "smallest scaled Jacobian": float(scaled_jacobian(mesh).min()),
            "largest aspect ratio": float(aspect_ratio(mesh).max()),
            **{name: mesh.provenance[name] for name in COUNTED_CELLS if name in mesh.provenance},
        },
        **({"faces": [asdict(face) for face in mesh.faces]} if mesh.faces else {}),
    }


def surface_triangles(mesh: SolidMesh) -> dict[str, Index]:
    """{name: (t, 3) nodes} of the named surfaces, and under "" of the rest of the skin.

    Facets of cells of second order come in pieces between their corners and middles of edges.
    """
    faces = faces_of(mesh.cells, mesh.kind, len(mesh.points))
    skin = faces.corners[faces.count == 1]
    named = {name: rows[:, : mesh.kind.corners_per_face] for name, rows in mesh.facets.items()}
    every = np.sort(np.vstack([skin, *named.values()]), axis=1)
    number, _ = row_ids(every, len(mesh.points))
    rest = skin[~np.isin(number[: len(skin)], number[len(skin) :])]
    return {name: _pieces(mesh, rows) for name, rows in (named | {"": rest}).items()}


def _pieces(mesh: SolidMesh, rows: Index) -> Index:
    """Triangles of facets, given by their corners."""
    k = rows.shape[1]
    inner, around = rows, np.empty((0, 3), dtype=np.int64)
    if mesh.kind.degree == 2:
        after = np.roll(rows, -1, axis=1)
        inner = _edge_middles(mesh, np.stack([rows, after], axis=-1).reshape(-1, 2)).reshape(-1, k)
        around = np.stack([np.roll(inner, 1, axis=1), rows, inner], axis=-1).reshape(-1, 3)
    if k == 4:
        inner = np.vstack([inner[:, [0, 1, 2]], inner[:, [0, 2, 3]]])
    return np.vstack([inner, around])


def _edge_middles(mesh: SolidMesh, edges: Index) -> Index:
    """(m,) node in the middle of each edge (m, 2) of cells of second order."""
    n, supports = len(mesh.points), mesh.kind.supports
    middle = {i: list(s) for i, s in enumerate(supports) if len(s) == 2}
    pairs = np.vstack([np.sort(mesh.cells[:, ends], axis=1) for ends in middle.values()])
    keys, first = np.unique(pairs[:, 0] * n + pairs[:, 1], return_index=True)
    wanted = np.sort(edges, axis=1)
    nodes = mesh.cells[:, list(middle)].T.ravel()[first]
    found: Index = nodes[np.searchsorted(keys, wanted[:, 0] * n + wanted[:, 1])]
    return found


def _axis(axis: Axis | None) -> Notes:
    """Where a joint on this interface sits, if the CAD knows an axis."""
    return {"axis": list(axis.direction), "point": list(axis.point)} if axis else {}


def _box(points: Array) -> Array:
    return np.array([points.min(axis=0), points.max(axis=0)])


def vtk_cells(mesh: SolidMesh) -> tuple[Index, int]:
    """(m, k) node numbers in VTK's order, and VTK's number of the cell."""
    in_bricks = (*DECK_EDGES["hex20"], *VTK_HEX_FACES, tuple(range(8)))
    more = {"tet10": DECK_EDGES["tet10"], "hex27": in_bricks}
    order = mesh.kind.among(more.get(mesh.cell_type, ()))
    return np.hstack([mesh.corners, mesh.cells[:, list(order)]]), VTK_TYPES[mesh.cell_type]
