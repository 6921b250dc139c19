"""From an open gmsh model to arrays: cells by region, facets by name; runs in the child process.

Of plane sections, triangles, curves and surfaces.
"""

import re
from collections.abc import Iterator
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
    volumes, kinds, ids, cells = zip(*_solids(gmsh), strict=True)
    sizes = dict(zip(volumes, map(len, ids), strict=True))
    region = _regions(gmsh, sizes, groups, strict=strict)
    facets = {
        name: positions(tags, _facets(gmsh, tag, name, repeated=repeated), "node")
        for (dim, tag), name in groups.items()
        if dim == 2
    }
    return packed(
        points,
        positions(tags, np.vstack(cells), "node"),
        SOLIDS[kinds[0]],
        np.repeat([region[volume] for volume in volumes], list(sizes.values())),
        np.concatenate(ids),
        facets=facets,
        region_names={tag: name for (dim, tag), name in groups.items() if dim == 3} or {1: "body"},
        warnings=_remarks(groups) if strict else [],
    )


def elements(gmsh: ModuleType, dim: int, entity: int = -1) -> Iterator[tuple[int, Index, Index]]:
    """Type, numbers (m,) and tags of nodes (m, k) of elements, of one entity or all of its kind."""
    for kind, ids, nodes in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
        size = gmsh.model.mesh.getElementProperties(kind)[3]
        yield int(kind), ids.astype(np.int64), nodes.astype(np.int64).reshape(-1, size)


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


def _check_names(names: Groups) -> None:
    """A name must stand for one group."""
    seen: dict[str, str] = {}
    for (dim, tag), name in names.items():
        what = f"physical {DIMENSIONS[dim]} {tag}"
        if name in seen:
            text = f"the name {name!r} stands for {seen[name]} and {what}"
            raise TagError(f"{text}; give each group its own name.")
        seen[name] = what


def _remarks(groups: Groups) -> list[str]:
    found = [
        f"physical {DIMENSIONS[dim]} {name!r} is ignored: interfaces are surfaces."
        for (dim, _), name in groups.items()
        if dim < 2
    ]
    if not any(dim == 3 for dim, _ in groups):
        found.append("no physical volume is named; the whole solid is the region 'body'.")
    return found


def _solids(gmsh: ModuleType) -> list[tuple[int, int, Index, Index]]:
    """Volumes with type in gmsh, numbers and nodes of their elements, all of one type."""
    found = [
        (volume, *block)
        for _, volume in gmsh.model.getEntities(3)
        if not gmsh.model.getType(3, volume).startswith("Ghost")  # copies for neighbours of a part
        for block in elements(gmsh, 3, volume)
    ]
    if not found:
        raise _no_solid(gmsh)
    kinds = {kind for _, kind, *_ in found}
    name = only_type(gmsh.model.mesh.getElementProperties(kind)[0] for kind in kinds)
    if not kinds <= SOLIDS.keys():
        raise MeshError(
            f"cells of type {name} are not supported.",
            hint="Supported are tetrahedra and hexahedra of first and second order.",
        )
    return found


def _no_solid(gmsh: ModuleType) -> MeshError:
    n = sum(len(ids) for _, ids, _ in elements(gmsh, 2))
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


def _regions(
    gmsh: ModuleType, sizes: dict[int, int], groups: Groups, *, strict: bool
) -> dict[int, int]:
    """{volume: region number}; every volume in exactly one group, or no group at all."""
    volumes, surfaces = (sorted(n for (d, _), n in groups.items() if d == k) for k in (3, 2))
    if surfaces and strict and not volumes:
        text = f"the surfaces {surfaces} are named, but no volume is."
        raise TagError(text, hint='Add Physical Volume("body") = {...};')
    if not volumes:
        return dict.fromkeys(sizes, 1)
    return {v: _region(gmsh, v, n, groups, volumes) for v, n in sizes.items()}


def _region(gmsh: ModuleType, volume: int, n: int, groups: Groups, others: list[str]) -> int:
    tags = [int(t) for t in gmsh.model.getPhysicalGroupsForEntity(3, volume)]
    if min(tags, default=1) < 1:
        why = f"is in the physical group {min(tags)}: numbers of groups start at 1"
        hint = "A volume has no other side; write both numbers without a minus."
    elif len(tags) > 1:
        one, other, *_ = (groups[3, tag] for tag in tags)
        why = f"is in the physical groups {one!r} and {other!r}"
        hint = "Each part of the body has one material: one group per volume."
    elif not tags:
        why = f"with {n} cells is in no physical group, while {others} exist"
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
        for _, _, rows in elements(gmsh, 2, surface):
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
    ids, cells = _triangles(gmsh)
    surfaces = _plane_surfaces(gmsh, ids)
    used = np.unique(cells)
    points, cells = points[positions(tags, used, "node")], np.searchsorted(used, cells)
    extent = np.ptp(points, axis=0)
    if (height := np.abs(points[:, 2]).max()) > FLAT_RTOL * extent.max():
        text = f"the mesh leaves the plane z = 0 by {height:.3g} m."
        raise MeshError(text, hint="Draw a plane section in x and y.")
    curves = {
        gmsh.model.getPhysicalName(dim, tag) or f"curve_{tag}": _lines(gmsh, tag, used)
        for dim, tag in gmsh.model.getPhysicalGroups(1)
    }
    told = {"region_names": {1: "body"}, "surface_names": list(surfaces), "warnings": []}
    regions = np.ones(len(cells), dtype=int)
    arrays, notes = packed(points, cells, "tri3", regions, ids, facets=curves, **told)
    return arrays | {f"surface {i}": rows for i, rows in enumerate(surfaces.values())}, notes


def _triangles(gmsh: ModuleType) -> tuple[Index, Index]:
    """Numbers (m,) and tags of the corners (m, 3) of all triangles."""
    found = {kind: (ids, rows) for kind, ids, rows in elements(gmsh, 2)}
    if others := found.keys() - {TRIANGLE}:
        name = gmsh.model.mesh.getElementProperties(min(others))[0]
        text = f"cells of the type {name}: triangles with three nodes are needed."
        raise MeshError(text, hint="Leave out Recombine, and keep Mesh.ElementOrder = 1.")
    if not found:
        text = "there are no triangles: the geometry has no plane surface."
        raise MeshError(text, hint="Add Plane Surface(1) = {...};")
    return found[TRIANGLE]


def _plane_surfaces(gmsh: ModuleType, ids: Index) -> dict[str, Index]:
    """Triangles of each plane surface: those of physical ones if there are any, or of all."""
    named: dict[str, int] = {}
    for dim, tag in gmsh.model.getPhysicalGroups(2):
        parts = [int(part) for part in gmsh.model.getEntitiesForPhysicalGroup(dim, tag)]
        name = gmsh.model.getPhysicalName(dim, tag) or f"surface_{tag}"
        single = len(parts) == 1
        named |= {name if single else f"{name} {k}": part for k, part in enumerate(parts, 1)}
    named = named or {f"surface {tag}": tag for _, tag in gmsh.model.getEntities(2)}
    blocks = {name: [own for _, own, _ in elements(gmsh, 2, tag)] for name, tag in named.items()}
    return {name: positions(ids, np.hstack([ids[:0], *own]), "") for name, own in blocks.items()}


def _lines(gmsh: ModuleType, tag: int, used: Index) -> Index:
    """(k, 2) nodes, as places in those used, of the sides of a physical curve."""
    curves = gmsh.model.getEntitiesForPhysicalGroup(1, tag)
    blocks = (block for curve in curves for block in elements(gmsh, 1, curve))
    found = [rows for kind, _, rows in blocks if kind == LINE]
    sides = np.vstack([np.zeros((0, 2), dtype=np.int64), *found])
    return np.searchsorted(used, sides[np.isin(sides, used).all(axis=1)])
