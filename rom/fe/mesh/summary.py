"""What a mesh holds, in numbers."""

from itertools import product
from typing import Any

import numpy as np

from rom.fe.mesh.cell_types import CELL_TYPES, CellType, jacobians
from rom.fe.mesh.quality import aspect_ratio, scaled_jacobian
from rom.fe.mesh.solid import SolidMesh
from rom.model import Array, Index

VTK_TYPES = {"tet4": 10, "tet10": 24, "hex8": 12, "hex27": 29}
# Corner sets of VTK's nodes where its order differs from gmsh's.
VTK_TET_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
VTK_HEX_EDGES = (
    *((0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7)),
    *((0, 4), (1, 5), (2, 6), (3, 7)),
)
VTK_HEX_FACES = ((0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7))


def summary(mesh: SolidMesh) -> dict[str, Any]:
    """Sizes, regions, interfaces and quality of a mesh, in plain Python."""
    volumes = cell_volumes(mesh)
    return {
        "file": str(mesh.provenance.get("path", "")),
        "cell_type": mesh.cell_type,
        "cells": len(mesh.cells),
        "nodes": len(mesh.points),
        "box": np.column_stack([mesh.points.min(axis=0), mesh.points.max(axis=0)]).tolist(),
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
                "middle": _middle(mesh.points[facets.ravel()]),
            }
            for name, facets in mesh.facets.items()
        },
        "quality": {
            "smallest scaled Jacobian": float(scaled_jacobian(mesh).min()),
            "largest aspect ratio": float(aspect_ratio(mesh).max()),
        },
    }


def _middle(points: Array) -> list[float]:
    """Middle of the box around the points."""
    return (0.5 * (points.min(axis=0) + points.max(axis=0))).tolist()


def cell_volumes(mesh: SolidMesh) -> Array:
    """(m,) volumes of the cells [m^3], exact for curved ones too."""
    kind = mesh.kind
    determinants = jacobians(mesh.points[mesh.cells], kind.gradients(kind.quadrature))
    return determinants @ _weights(kind)


def _weights(kind: CellType) -> Array:
    """Weights of `CellType.quadrature`; the collapsed cube brings its own determinant."""
    x, w = np.polynomial.legendre.leggauss(kind.degree + 1)
    weights = np.prod(list(product(w / 2, repeat=3)), axis=1)
    if kind.shape == "hexahedron":
        return weights
    u, v, _ = np.array(list(product((x + 1) / 2, repeat=3))).T
    return weights * (1 - u) ** 2 * (1 - v)


def vtk_cells(mesh: SolidMesh) -> tuple[Index, int]:
    """(m, k) node numbers in VTK's order, and VTK's number of the cell."""
    kind = CELL_TYPES[mesh.cell_type]
    position = {frozenset(support): i for i, support in enumerate(kind.supports)}
    corners = [(i,) for i in range(kind.n_corners)]
    more = {"tet10": VTK_TET_EDGES, "hex27": (*VTK_HEX_EDGES, *VTK_HEX_FACES, tuple(range(8)))}
    order = [position[frozenset(s)] for s in (*corners, *more.get(kind.name, ()))]
    return mesh.cells[:, order], VTK_TYPES[kind.name]
