"""Small solid meshes made by hand, a plain writer of gmsh's version 2.2, and decks of a box."""

from itertools import permutations

import numpy as np

import rom
from rom.fe.mesh.cell_types import CELL_TYPES
from rom.fe.mesh.solid import SolidMesh

SIZE = (0.4, 0.05, 0.03)  # of the box of decks
GMSH = {"tet4": 4, "hex8": 5, "tet10": 11, "hex27": 12, "tri3": 2, "quad4": 3, "tri6": 9}
TRIANGLES = {3: "tri3", 4: "quad4", 6: "tri6"}


def grid(counts=(3, 2, 2), size=(3.0, 1.0, 1.0)):
    """Points and eight-node bricks of a box, in gmsh order."""
    nx, ny, nz = counts
    number = np.arange((nx + 1) * (ny + 1) * (nz + 1)).reshape(nx + 1, ny + 1, nz + 1)
    axes = [np.linspace(0, s, n + 1) for s, n in zip(size, counts, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    ring = ((0, 0), (1, 0), (1, 1), (0, 1))
    corners = [(i, j, k) for k in (0, 1) for i, j in ring]
    cells = [number[i : nx + i, j : ny + j, k : nz + k].ravel() for i, j, k in corners]
    return points, np.column_stack(cells)


def tetrahedra(bricks):
    """Six tetrahedra of positive volume per brick, conforming across bricks."""
    corner = {(i, j, k): 4 * k + (0, 3, 1, 2)[2 * i + j] for i, j, k in np.ndindex(2, 2, 2)}
    found = []
    for order in permutations(range(3)):
        at, path = [0, 0, 0], [0]
        for axis in order:
            at[axis] = 1
            path.append(corner[tuple(at)])
        odd = order in ((0, 2, 1), (1, 0, 2), (2, 1, 0))
        found.append([path[0], path[2], path[1], path[3]] if odd else path)
    return np.vstack([bricks[:, path] for path in found])


def solid(kind="tet4", counts=(3, 2, 2), size=(3.0, 1.0, 1.0)):
    """A box with the surfaces "root" (x = 0) and "tip" (x = size)."""
    points, cells = grid(counts, size)
    if kind.startswith("tet"):
        cells = tetrahedra(cells)
    name = "tet4" if kind.startswith("tet") else "hex8"
    facets = {"root": side(points, cells, name, 0.0), "tip": side(points, cells, name, size[0])}
    mesh = SolidMesh(points, cells, name, np.ones(len(cells), dtype=int), {1: "body"}, facets)
    return mesh if kind == name else second_order(mesh)


def side(points, cells, kind, x):
    faces = cells[:, np.array(CELL_TYPES[kind].faces)].reshape(-1, 3 if kind == "tet4" else 4)
    return faces[np.abs(points[faces, 0] - x).max(axis=1) < 1e-9]


def second_order(mesh):
    """The same mesh with nodes in the middle of edges, faces and bricks."""
    kind = CELL_TYPES["tet10" if mesh.cell_type == "tet4" else "hex27"]
    points, known = list(mesh.points), {}

    def node(corners):
        key = tuple(sorted(corners))
        if len(key) == 1:
            return key[0]
        if key not in known:
            known[key] = len(points)
            points.append(mesh.points[list(key)].mean(axis=0))
        return known[key]

    cells = np.array([[node(cell[list(s)]) for s in kind.supports] for cell in mesh.cells])
    facets = {}
    for name, rows in mesh.facets.items():
        n = rows.shape[1]
        sets = [(i,) for i in range(n)] + [(i, (i + 1) % n) for i in range(n)]
        sets += [tuple(range(4))] if n == 4 else []
        facets[name] = np.array([[node(row[list(s)]) for s in sets] for row in rows])
    return SolidMesh(np.array(points), cells, kind.name, mesh.regions, mesh.region_names, facets)


def write_msh(path, points, blocks, names=(), ids=None):
    """Write version 2.2 of blocks (element type, physical tag, elementary tag, nodes from zero).

    Names are (dimension, tag, name) of the physical groups, ids (n,) node numbers in the file.
    """
    ids = np.arange(len(points)) + 1 if ids is None else np.asarray(ids)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat"]
    if names:
        lines += ["$PhysicalNames", str(len(names))]
        lines += [f'{dim} {tag} "{name}"' for dim, tag, name in names] + ["$EndPhysicalNames"]
    lines += ["$Nodes", str(len(points))]
    lines += [f"{i} {x!r} {y!r} {z!r}" for i, (x, y, z) in zip(ids, points.tolist(), strict=True)]
    lines += ["$EndNodes", "$Elements", str(sum(len(rows) for *_, rows in blocks))]
    number = 0
    for kind, physical, elementary, rows in blocks:
        for row in rows:
            number += 1
            nodes = " ".join(str(ids[i]) if 0 <= i < len(ids) else str(i + 1) for i in row)
            lines.append(f"{number} {GMSH[kind]} 2 {physical} {elementary} {nodes}")
    path.write_text("\n".join([*lines, "$EndElements", ""]))
    return path


def blocks_of(mesh):
    """Blocks and names for `write_msh`: the whole mesh, one elementary tag per group."""
    blocks, names = [(mesh.cell_type, 1, 1, mesh.cells)], [(3, 1, "body")]
    for tag, (name, rows) in enumerate(mesh.facets.items(), 11):
        blocks.append((TRIANGLES[rows.shape[1]], tag, tag, rows))
        names.append((2, tag, name))
    return blocks, names


def bulk(*cards, mesh=None, nodes=()):
    """Bulk data of a box whose ends are SPC1 1 and 2, with cards and nodes {label: place}."""
    mesh = mesh or solid("hex8", (4, 1, 1), SIZE)
    out = [f"GRID,{k},,{x!r},{y!r},{z!r}" for k, (x, y, z) in enumerate(mesh.points.tolist(), 1)]
    out += [f"GRID,{k},,{x!r},{y!r},{z!r}" for k, (x, y, z) in nodes]
    out += [f"CHEXA,{k},1,{long(row + 1)}" for k, row in enumerate(mesh.cells, 1)]
    out += [f"SPC1,{k},123,{long(ends(mesh, name))}" for k, name in ((1, "root"), (2, "tip"))]
    out += ["PSOLID,1,1", "MAT1,1,2.1+11,,.3,7850."]
    return "\n".join([*out, *cards, ""])


def long(numbers):
    """Fields behind the third, over as many lines as they need."""
    words = [str(n) for n in numbers]
    rows = [words[:6], *(words[k : k + 8] for k in range(6, len(words), 8))]
    return "\n,".join(",".join(row) for row in rows)


def ends(mesh, name):
    return np.unique(mesh.facets[name]) + 1


def keywords(text, mesh=None, nodes=(), kind="C3D8"):
    mesh = mesh or solid("hex8", (4, 1, 1), SIZE)
    rows = [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(mesh.points.tolist(), 1)]
    rows += [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in nodes]
    cells = [f"{k}, {', '.join(map(str, row + 1))}" for k, row in enumerate(mesh.cells, 1)]
    sets = [f"*NSET, NSET={n}\n{', '.join(map(str, ends(mesh, n)))}" for n in ("root", "tip")]
    law = "*SOLID SECTION, ELSET=e, MATERIAL=m\n"
    law += "*MATERIAL, NAME=m\n*ELASTIC\n210e9, .3\n*DENSITY\n7850."
    head = ["*NODE", *rows, f"*ELEMENT, TYPE={kind}, ELSET=e", *cells, *sets]
    return "\n".join([*head, "*SURFACE, NAME=face, TYPE=ELEMENT\n4, S4", law, text, ""])


def model_of(text, folder, **options):
    path = folder / ("a.inp" if text.startswith("*") or "*NODE" in text else "a.bdf")
    path.write_text(text)
    return rom.fe.model(path, **{"degree": 1} | options)
