"""What a mesh holds, in numbers."""

from dataclasses import asdict

import numpy as np

from rom.fe.mesh.cell_types import DECK_EDGES
from rom.fe.mesh.quality import aspect_ratio, cell_volumes, scaled_jacobian
from rom.fe.mesh.solid import Notes, SolidMesh
from rom.fe.mesh.topology import find_rows, outer_facets
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
                # where a joint on this interface sits, if the CAD knows an axis
                **({"axis": list(a.direction), "point": list(a.point)} if a else {}),
            }
            for name, facets, a in ((k, f, mesh.axes.get(k)) for k, f in mesh.facets.items())
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
    n, c = len(mesh.points), mesh.kind.corners_per_face
    skin = outer_facets(mesh.cells, mesh.kind, n)
    named = np.vstack([skin[:0], *mesh.facets.values()])
    rest = skin[find_rows(skin[:, :c], named[:, :c], n) < 0]
    return {name: _pieces(rows, c) for name, rows in (mesh.facets | {"": rest}).items()}


def _pieces(facets: Index, c: int) -> Index:
    """Triangles of facets with c corners, which nodes amid their edges may follow."""
    corners = inner = facets[:, :c]
    around = np.empty((0, 3), dtype=np.int64)
    if facets.shape[1] > c:
        inner = facets[:, c : 2 * c]
        around = np.stack([np.roll(inner, 1, axis=1), corners, inner], axis=-1).reshape(-1, 3)
    if c == 4:
        inner = np.vstack([inner[:, [0, 1, 2]], inner[:, [0, 2, 3]]])
    return np.vstack([inner, around])


def _box(points: Array) -> Array:
    return np.array([points.min(axis=0), points.max(axis=0)])


def vtk_cells(mesh: SolidMesh) -> tuple[Index, int]:
    """(m, k) node numbers in VTK's order, and VTK's number of the cell."""
    in_bricks = (*DECK_EDGES["hex20"], *VTK_HEX_FACES, tuple(range(8)))
    more = {"tet10": DECK_EDGES["tet10"], "hex27": in_bricks}
    order = mesh.kind.among(more.get(mesh.cell_type, ()))
    return np.hstack([mesh.corners, mesh.cells[:, list(order)]]), VTK_TYPES[mesh.cell_type]
