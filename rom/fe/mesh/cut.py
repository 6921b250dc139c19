"""A mesh cut along faces of its cells, by planes or by regions."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, whole
from rom.errors import ConfigError, MeshError, TagError
from rom.fe.mesh.solid import SolidMesh
from rom.fe.mesh.topology import faces_of, find_rows
from rom.model import Array, Index, Mask
from rom.names import named

Cuts = dict[str, tuple[tuple[int, int], Index]]  # numbers of the two pieces, and facets
PLANE_RTOL = 1e-6  # of the length along the axis: how far nodes of a cut may lie from its plane


def cut(
    mesh: SolidMesh, n: int | None = None, axis: npt.ArrayLike | None = None
) -> dict[str, SolidMesh]:
    """{name: piece} of a mesh, cut into n along an axis, or by its regions.

    Where two pieces meet both have the surface, of one name: "cut 1" between the pieces "1" and "2"
    of an axis, "hub-blade" between two regions. Pieces along an axis (3,) are about equally long,
    and cut between layers of cells, which must be flat there; no cut may cross a named surface.
    """
    normal = None if axis is None else finite("axis", axis, (3,))
    if (n is None) != (normal is None) or (normal is not None and not normal.any()):
        raise ConfigError(
            f"n = {n!r} and axis = {axis!r} say no cuts.",
            hint="Give both, as n=4, axis=(1, 0, 0), or neither to make a piece of each region.",
        )
    faces = faces_of(mesh.cells, mesh.kind, len(mesh.points))
    if n is None or normal is None:
        piece, names = _by_regions(mesh)
    else:
        piece, names = _by_planes(
            mesh, whole("n", n, 2, reason="one piece is the whole body"), normal
        )
    rows = mesh.cells[:, np.array(mesh.kind.face_nodes)]
    cuts: Cuts = {}
    inner = faces.count[faces.of_cell] == 2
    for i, j in combinations(range(len(names)), 2):
        both = [np.unique(faces.of_cell[piece == k][inner[piece == k]]) for k in (i, j)]
        shared = np.intersect1d(*both)
        if shared.size:
            of_first = np.isin(faces.of_cell, shared) & (piece == i)[:, None]
            name = f"cut {i + 1}" if normal is not None else f"{names[i]}-{names[j]}"
            cuts[name] = (i, j), rows[of_first]
    if double := sorted(set(cuts) & set(mesh.facets)):
        text = f"surface {named(double)} has the name of a cut."
        raise TagError(text, hint="Give it another one.")
    if normal is not None:
        _refuse_rough(mesh, cuts, normal)
    found = {name: _piece(mesh, piece, k, cuts, name) for k, name in enumerate(names)}
    for cut_name, ((i, j), _) in cuts.items():
        doubled = set(found[names[i]].facets) & set(found[names[j]].facets) & set(mesh.facets)
        if doubled:
            text = f"surface {named(sorted(doubled))} lies on {cut_name!r}."
            raise TagError(text, hint="Leave it without a name: the cut has one.")
    return found


def _by_planes(mesh: SolidMesh, n: int, a: Array) -> tuple[Index, list[str]]:
    """The piece of each cell by its middle, and the names of the pieces."""
    along = mesh.points @ (a / np.linalg.norm(a))
    middle = along[mesh.corners].mean(axis=1)
    low, high = along.min(), along.max()
    piece = np.floor(n * (middle - low) / (high - low)).astype(np.int64)
    if empty := sorted(set(range(n)) - set(piece.tolist())):
        text = f"piece {empty[0] + 1} of {n} along {a.tolist()} has no cells: they are longer"
        raise MeshError(f"{text}; ask for fewer pieces, or mesh more finely along the axis.")
    return piece, [str(k + 1) for k in range(n)]


def _by_regions(mesh: SolidMesh) -> tuple[Index, list[str]]:
    """The piece of each cell is its region."""
    tags = sorted(mesh.region_names)
    if len(tags) < 2:
        raise TagError(
            f"the mesh has one region, {named(mesh.region_names.values())}: nowhere to cut it.",
            hint="Give n and axis, or name volumes that share faces in the geometry.",
        )
    return np.searchsorted(tags, mesh.regions), [mesh.region_names[tag] for tag in tags]


def _refuse_rough(mesh: SolidMesh, cuts: Cuts, axis: Array) -> None:
    """Say where the faces between two pieces do not lie in a plane."""
    along = mesh.points @ (axis / np.linalg.norm(axis))
    for name, (_, rows) in cuts.items():
        depth = float(np.ptp(along[rows]))
        if depth > PLANE_RTOL * np.ptp(along):
            raise MeshError(
                f"{name!r} is not flat: its nodes lie {depth:.3g} m apart along {axis.tolist()}, "
                "the cells are not in layers there.",
                hint="Cut the geometry in gmsh and name the volumes: without n and axis each "
                "region is a piece.",
            )


def _piece(mesh: SolidMesh, piece: Index, k: int, cuts: Cuts, name: str) -> SolidMesh:
    """The cells of one piece, with the surfaces that it has."""
    own = piece == k
    outer = {key: rows for key, (pair, rows) in cuts.items() if k in pair}
    used = set(np.unique(mesh.regions[own]).tolist())
    ids = np.flatnonzero(own) if mesh.cell_ids is None else mesh.cell_ids[own]
    facets = _named_facets(mesh, own, name) | outer
    return replace(
        mesh,
        cells=mesh.cells[own],
        regions=mesh.regions[own],
        region_names={tag: text for tag, text in mesh.region_names.items() if tag in used},
        facets=facets,
        cell_ids=ids,
        warnings=None,
        axes={key: axis for key, axis in mesh.axes.items() if key in facets},
        provenance=mesh.provenance | {"piece": name},
    )


def _named_facets(mesh: SolidMesh, own: Mask, name: str) -> dict[str, Index]:
    """Those surfaces of the mesh that are faces of the cells of one piece."""
    c, found = mesh.kind.corners_per_face, {}
    listed = mesh.corners[own][:, np.array(mesh.kind.faces)].reshape(-1, c)
    for key, rows in mesh.facets.items():
        inside = find_rows(rows[:, :c], listed, len(mesh.points)) >= 0
        if inside.all():
            found[key] = rows
        elif inside.any():
            text = f"surface {key!r} lies partly on piece {name!r}: a cut crosses it"
            raise TagError(f"{text}; name the parts of the surface, or cut elsewhere.")
    return found
