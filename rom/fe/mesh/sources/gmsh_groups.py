"""From an open gmsh model to arrays: cells by region, facets by name; runs in the child process.

Of plane sections, triangles, curves and surfaces.
"""

import re
from pathlib import Path
from types import ModuleType

import numpy as np

from rom.errors import MeshError, TagError
from rom.fe.mesh.solid import Read, packed
from rom.fe.mesh.sources.deck import only_type, positions
from rom.model import Array, Index

# gmsh element types
SOLIDS = {4: "tet4", 5: "hex8", 11: "tet10", 12: "hex27", 17: "hex20"}
NAMES = re.compile(rb'^\s*([0-3])\s+(\d{1,18})\s+"([^"\r\n]*)"\s*$', re.MULTILINE)
LINE, TRIANGLE = 1, 2  # likewise
FLAT_RTOL = 1e-9  # height over the extent of a plane section
DIMENSIONS = ("point", "curve", "surface", "volume")
Blocks = dict[int, tuple[Index, Index]]  # numbers and nodes of the elements of each volume
Groups = dict[tuple[int, int], str]  # names by dimension and tag


def declared_groups(path: Path) -> list[tuple[int, int, str]]:
    """(dimension, tag, name) of all groups a ``.msh`` file declares, also of empty ones."""
    with path.open("rb") as stream:
        head = stream.read(2**20)
    section = head.partition(b"$PhysicalNames")[2].partition(b"$EndPhysicalNames")[0]
    return [(int(d), int(t), n.decode("utf-8", "replace")) for d, t, n in NAMES.findall(section)]


def check_declared(gmsh: ModuleType, declared: Path) -> None:
    """Refuse what gmsh drops in silence: empty groups, and the second group of a name."""
    present, groups = set(gmsh.model.getPhysicalGroups()), declared_groups(declared)
    _check_names({(dim, tag): name for dim, tag, name in groups})
    for dim, tag, name in groups:
        if dim >= 2 and (dim, tag) not in present:
            raise TagError(
                f"the physical {DIMENSIONS[dim]} {name!r} is empty.",
                hint="Check that it names surfaces or volumes that exist, and that the selection, "
                "e.g. its bounding box, finds them with these parameters.",
            )


def version(path: Path) -> int:
    """Main version of a ``.msh`` file; 0 when it does not tell."""
    with path.open("rb") as stream:
        found = re.search(rb"\$MeshFormat\s+(\d{1,9})", stream.read(2**20))
    return int(found[1]) if found else 0


def collect(gmsh: ModuleType, declared: Path, *, strict: bool, repeated: bool) -> Read:
    """Arrays and notes of the mesh, as `rom.fe.mesh.child.read` returns them.

    The header of a ``.msh`` file, ``declared``, lists the names of the groups; ``strict`` where
    named surfaces without a named volume are an error; ``repeated`` where the file lists a facet
    once for each of its groups, as version 2 does.
    """
    check_declared(gmsh, declared)
    # of a .unv, gmsh puts all that is in no group into one of the number 0
    groups = {key: name for key, name in _group_names(gmsh).items() if key[1] or strict}
    tags, points = _nodes(gmsh)
    kind, blocks = _solids(gmsh)
    region = _regions(gmsh, blocks, groups, strict=strict)
    cells = np.vstack([nodes for _, nodes in blocks.values()])
    counts = [len(ids) for ids, _ in blocks.values()]
    facets = {
        name: positions(tags, _facets(gmsh, tag, name, repeated=repeated), "node")
        for (dim, tag), name in groups.items()
        if dim == 2
    }
    return packed(
        points,
        positions(tags, cells, "node"),
        SOLIDS[kind],
        np.repeat([region[volume] for volume in blocks], counts),
        np.concatenate([ids for ids, _ in blocks.values()]),
        facets=facets,
        region_names={tag: name for (dim, tag), name in groups.items() if dim == 3} or {1: "body"},
        warnings=_remarks(groups) if strict else [],
    )


def _nodes(gmsh: ModuleType) -> tuple[Index, Array]:
    """Tags, ascending, and (n, 3) points of all nodes."""
    tags, x, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags, kind="stable")
    return tags[order].astype(np.int64), x.reshape(-1, 3)[order]


def _group_names(gmsh: ModuleType) -> Groups:
    """{(dimension, tag): name}; nameless groups get one."""
    names = {
        (dim, tag): gmsh.model.getPhysicalName(dim, tag) or f"{DIMENSIONS[dim]}_{tag}"
        for dim, tag in gmsh.model.getPhysicalGroups()
        if dim != 2 or _surfaces(gmsh, tag)
    }
    _check_names(names)
    return names


def _check_names(names: dict[tuple[int, int], str]) -> None:
    """A name must stand for one group."""
    seen: dict[str, str] = {}
    for (dim, tag), name in names.items():
        what = f"physical {DIMENSIONS[dim]} {tag}"
        if name in seen:
            text = f"the name {name!r} stands for {seen[name]} and {what}"
            raise TagError(f"{text}; give each group its own name.")
        seen[name] = what


def _remarks(groups: dict[tuple[int, int], str]) -> list[str]:
    found = [
        f"physical {DIMENSIONS[dim]} {name!r} is ignored: interfaces are surfaces."
        for (dim, _), name in groups.items()
        if dim < 2
    ]
    if not any(dim == 3 for dim, _ in groups):
        found.append("no physical volume is named; the whole solid is the region 'body'.")
    return found


def _solids(gmsh: ModuleType) -> tuple[int, Blocks]:
    """Element type in gmsh, and element numbers and nodes of each volume."""
    blocks, kinds = {}, set()
    for _, volume in gmsh.model.getEntities(3):
        if gmsh.model.getType(3, volume).startswith("Ghost"):  # copies for the neighbours of a part
            continue
        types, ids, nodes = gmsh.model.mesh.getElements(3, volume)
        kinds |= {int(t) for t in types}
        if len(types) == 1:
            blocks[volume] = ids[0].astype(np.int64), nodes[0].astype(np.int64)
    if not kinds:
        raise _no_solid(gmsh)
    name = only_type(gmsh.model.mesh.getElementProperties(kind)[0] for kind in kinds)
    if not kinds <= SOLIDS.keys():
        raise MeshError(
            f"cells of type {name} are not supported.",
            hint="Supported are tetrahedra and hexahedra of first and second order.",
        )
    size = gmsh.model.mesh.getElementProperties(min(kinds))[3]
    return kinds.pop(), {v: (ids, nodes.reshape(-1, size)) for v, (ids, nodes) in blocks.items()}


def _no_solid(gmsh: ModuleType) -> MeshError:
    types = gmsh.model.mesh.getElements(2)[1]
    n = sum(len(ids) for ids in types)
    if not n:
        return MeshError(
            "there are no volume cells: the geometry is not meshed.",
            hint="Run gmsh -3, or give the .geo file.",
        )
    surfaces = [gmsh.model.getPhysicalName(2, tag) for _, tag in gmsh.model.getPhysicalGroups(2)]
    return MeshError(
        f"there are no volume cells, only {n} facets (named surfaces: {surfaces}).",
        hint="A solid is needed. A file with physical groups holds only what is in one: add a "
        "Physical Volume.",
    )


def _regions(gmsh: ModuleType, blocks: Blocks, groups: Groups, *, strict: bool) -> dict[int, int]:
    """{volume: region number}; every volume in exactly one group, or no group at all."""
    if not any(dim == 3 for dim, _ in groups):
        if groups and strict and any(dim == 2 for dim, _ in groups):
            raise TagError(
                f"the surfaces {sorted(n for (d, _), n in groups.items() if d == 2)} are named, "
                "but no volume is.",
                hint='Add Physical Volume("body") = {...};',
            )
        return dict.fromkeys(blocks, 1)
    return {volume: _region(gmsh, volume, blocks, groups) for volume in blocks}


def _region(gmsh: ModuleType, volume: int, blocks: Blocks, groups: Groups) -> int:
    tags = [int(t) for t in gmsh.model.getPhysicalGroupsForEntity(3, volume)]
    if min(tags, default=1) < 1:
        why = f"is in the physical group {min(tags)}: numbers of groups start at 1"
        hint = "A volume has no other side; write both numbers without a minus."
    elif len(tags) > 1:
        one, other, *_ = (groups[3, tag] for tag in tags)
        why = f"is in the physical groups {one!r} and {other!r}"
        hint = "Each part of the body has one material: one group per volume."
    elif not tags:
        others = sorted(name for (dim, _), name in groups.items() if dim == 3)
        why = f"with {len(blocks[volume][0])} cells is in no physical group, while {others} exist"
        hint = "Put every volume into a group, or remove what does not belong to the body."
    else:
        return tags[0]
    raise TagError(f"volume {volume} {why}.", hint=hint)


def _surfaces(gmsh: ModuleType, tag: int) -> list[int]:
    """Those of a group, without the cuts of a partition, which have the group of their volume."""
    surfaces = gmsh.model.getEntitiesForPhysicalGroup(2, tag)
    return [int(s) for s in surfaces if gmsh.model.getParent(2, s)[0] != 3]


def _facets(gmsh: ModuleType, tag: int, name: str, *, repeated: bool) -> Index:
    """(f, kf) node tags of a physical surface."""
    found = []
    for surface in _surfaces(gmsh, tag):
        groups = len(gmsh.model.getPhysicalGroupsForEntity(2, surface))
        for kind, _, nodes in zip(*gmsh.model.mesh.getElements(2, surface), strict=True):
            size = gmsh.model.mesh.getElementProperties(kind)[3]
            rows = nodes.astype(np.int64).reshape(-1, size)
            if groups > 1 and repeated:
                _check_copies(rows, groups, name)
            found.append(rows)
    if not found:
        raise TagError(f"the physical surface {name!r} has no facets.", hint="Mesh it.")
    if len({rows.shape[1] for rows in found}) > 1:
        raise MeshError(f"the physical surface {name!r} mixes types of facets; use only one.")
    return np.vstack(found)


def _check_copies(rows: Index, groups: int, name: str) -> None:
    """Without a copy of each facet for each group, gmsh has mixed up the groups."""
    if len(np.unique(np.sort(rows, axis=1), axis=0)) * groups != len(rows):
        raise TagError(
            f"the facets of {name!r} share their elementary number with another group, and gmsh "
            "cannot tell them apart.",
            hint="Save the mesh in version 4.1, or give each surface its own elementary number.",
        )


def triangles(gmsh: ModuleType) -> Read:
    """Arrays and notes as `collect` returns them, of triangles in z = 0, facets being curves."""
    tags, points = _nodes(gmsh)
    cells, ids = _triangles(gmsh, tags)
    surfaces = _plane_surfaces(gmsh, ids)
    used, cells = np.unique(cells, return_inverse=True)
    points, cells = points[used], cells.reshape(-1, 3)
    extent = np.ptp(points, axis=0)
    if (height := np.abs(points[:, 2]).max()) > FLAT_RTOL * extent.max():
        text = f"the mesh leaves the plane z = 0 by {height:.3g} m."
        raise MeshError(text, hint="Draw a plane section in x and y.")
    place = np.full(tags.size, -1)
    place[used] = np.arange(used.size)
    curves = {
        gmsh.model.getPhysicalName(dim, tag) or f"curve_{tag}": _lines(gmsh, tag, tags, place)
        for dim, tag in gmsh.model.getPhysicalGroups(1)
    }
    told = {"region_names": {1: "body"}, "surface_names": list(surfaces), "warnings": []}
    regions = np.ones(len(cells), dtype=int)
    arrays, notes = packed(points, cells, "tri3", regions, ids, facets=curves, **told)
    return arrays | {f"surface {i}": rows for i, rows in enumerate(surfaces.values())}, notes


def _triangles(gmsh: ModuleType, tags: Index) -> tuple[Index, Index]:
    """Corners as positions among the tags, and numbers, of all triangles."""
    kinds, ids, nodes = gmsh.model.mesh.getElements(2)
    others = [gmsh.model.mesh.getElementProperties(kind)[0] for kind in kinds if kind != TRIANGLE]
    if others:
        text = f"cells of the type {others[0]}: triangles with three nodes are needed."
        raise MeshError(text, hint="Leave out Recombine, and keep Mesh.ElementOrder = 1.")
    if not len(kinds):
        text = "there are no triangles: the geometry has no plane surface."
        raise MeshError(text, hint="Add Plane Surface(1) = {...};")
    return np.searchsorted(tags, nodes[0].astype(np.int64)).reshape(-1, 3), ids[0].astype(np.int64)


def _plane_surfaces(gmsh: ModuleType, ids: Index) -> dict[str, Index]:
    """Triangles of each plane surface: those of physical ones if there are any, or of all."""
    named: dict[str, int] = {}
    for dim, tag in gmsh.model.getPhysicalGroups(2):
        parts = [int(part) for part in gmsh.model.getEntitiesForPhysicalGroup(dim, tag)]
        name = gmsh.model.getPhysicalName(dim, tag) or f"surface_{tag}"
        single = len(parts) == 1
        named |= {name if single else f"{name} {k}": part for k, part in enumerate(parts, 1)}
    named = named or {f"surface {tag}": tag for _, tag in gmsh.model.getEntities(2)}
    found, order = {}, np.argsort(ids, kind="stable")
    for name, tag in named.items():
        kinds = [x.astype(np.int64) for x in gmsh.model.mesh.getElements(2, tag)[1]]
        some = np.concatenate([np.zeros(0, dtype=np.int64), *kinds])
        found[name] = order[np.searchsorted(ids[order], some)]
    return found


def _lines(gmsh: ModuleType, tag: int, tags: Index, place: Array) -> Index:
    """(k, 2) nodes of the sides of a physical curve."""
    found = [np.zeros((0, 2), dtype=np.int64)]
    for curve in gmsh.model.getEntitiesForPhysicalGroup(1, tag):
        kinds, _, nodes = gmsh.model.mesh.getElements(1, curve)
        for kind, rows in zip(kinds, nodes, strict=True):
            if kind == LINE:
                found.append(place[np.searchsorted(tags, rows.astype(np.int64))].reshape(-1, 2))
    return np.vstack(found)
