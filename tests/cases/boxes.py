"""Boxes and curved sectors meshed for dolfinx, with their faces tagged."""

import numpy as np

BOX_GEO = """SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 1, 1, 1};
Physical Volume("body", 1) = {1};
Physical Surface("root", 11) = {1};
Mesh.MeshSizeMin = 1; Mesh.MeshSizeMax = 1;
"""  # a cube that gmsh meshes, one face of which is named
FACES = {"x0": (0, 0), "x1": (0, 1), "y0": (1, 0), "y1": (1, 1), "z0": (2, 0), "z1": (2, 1)}


def box(size=(1.0, 0.1, 0.08), cells=(8, 2, 2), kind="hexahedron", comm=None):
    """A dolfinx mesh of a box with a corner in the origin, and MeshTags of its six faces."""
    from mpi4py import MPI

    from dolfinx import mesh as dm

    mesh = dm.create_box(
        comm or MPI.COMM_WORLD, [[0.0] * 3, list(size)], list(cells), getattr(dm.CellType, kind)
    )
    tags = {}
    for name, (axis, side) in FACES.items():
        place = side * size[axis]
        facets = dm.locate_entities_boundary(
            mesh, 2, lambda x, a=axis, p=place: np.isclose(x[a], p, atol=1e-9 * max(size))
        )
        tags[name] = dm.meshtags(mesh, 2, np.sort(facets), np.ones(facets.size, dtype=np.int32))
    return mesh, tags


def distort(mesh, amount=0.1, seed=0):
    """Move the inner vertices of a box at random."""
    x = mesh.geometry.x
    inside = np.all((x > x.min(axis=0) + 1e-9) & (x < x.max(axis=0) - 1e-9), axis=1)
    step = amount * np.ptp(x, axis=0) * np.random.default_rng(seed).uniform(-1, 1, x.shape)
    x[inside] += step[inside]
    return mesh


def faces_held(model, held):
    """Dofs of {face of the bounding box: axes}, each once."""
    low, high = model.points.min(axis=0), model.points.max(axis=0)
    parts = []
    for face, axes in held.items():
        axis, side = FACES[face]
        place, x = (low, high)[side][axis], model.points[:, axis]
        nodes = np.flatnonzero(np.isclose(x, place, atol=1e-9 * np.ptp(model.points)))
        parts.append((3 * nodes[:, None] + np.array(axes)).ravel())
    return np.unique(np.concatenate(parts))
