"""STEP geometries: metres, named faces, faces picked by a point, a box or a number.

gmsh reads no face names from STEP. They are taken from the text: the faces of the shells, in the
order of the file, are the surfaces of gmsh in theirs.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np

from rom.errors import ConfigError, FileFormatError, MeshError, TagError
from rom.fe.mesh.solid import Made
from rom.names import named

FACE_PATTERN = re.compile(r"#(\d+)\s*=\s*ADVANCED_FACE\s*\(\s*'((?:[^']|'')*)'", re.IGNORECASE)
SHELL_PATTERN = re.compile(
    r"=\s*(?:CLOSED|OPEN)_SHELL\s*\(\s*'(?:[^']|'')*'\s*,\s*\(([^)]*)\)", re.I
)
ELEMENTS_ACROSS = 20  # default element size: this part of the diagonal
CELLS_PER_CUBE = 8.0  # tetrahedra in a cube of the element size
MOST_CELLS = 3e7  # beyond what a machine with 100 GB can mesh
MAX_DISTANCE_RATIO = 0.05  # of the diagonal: a point further from every face is a mistake
EVERY_FACE = "every"  # names all faces without a name by their numbers
TIE_RTOL = 1e-6  # of the diagonal: difference in distance of two faces that are equally near


def make(gmsh: Any, path: Path, request: dict[str, Any]) -> Made:
    """Import the file and name its faces.

    Returns:
        The element size used, and its default.

    Raises:
        FileFormatError: the file is no STEP file.
        MeshError: it contains no solid.
        ConfigError: a parameter other than lc.
    """
    unknown = sorted(set(request["parameters"]) - {"lc"})
    if unknown:
        raise ConfigError(f"a .step file has no parameter {named(unknown)}; there is ['lc'].")
    text = path.read_bytes().decode("latin-1")
    if not text.lstrip().startswith("ISO-10303-21"):
        raise FileFormatError("is not a STEP file: it does not start with ISO-10303-21.")
    gmsh.option.setString("Geometry.OCCTargetUnit", "M")
    gmsh.model.add(path.stem)
    gmsh.model.occ.importShapes(str(path))
    gmsh.model.occ.synchronize()
    if not gmsh.model.getEntities(3):
        raise MeshError("the STEP file contains no solid.", hint="Export a closed body.")
    _name_faces(gmsh, text)
    default = _diagonal(gmsh) / ELEMENTS_ACROSS
    lc = request["parameters"].get("lc", default)
    _check_size(gmsh, lc)
    gmsh.option.setNumber("Mesh.MeshSizeMax", lc)
    return {"lc": lc}, {"lc": default}


def _check_size(gmsh: Any, lc: Any) -> None:
    """Refuse a mesh size that is none, or far too fine, as when the units are mixed up."""
    if not isinstance(lc, int | float) or not 0.0 < lc < float("inf"):
        raise ConfigError(f"lc = {lc!r} must be a positive number of metres.")
    volume = sum(gmsh.model.occ.getMass(3, tag) for _, tag in gmsh.model.getEntities(3))
    cells = CELLS_PER_CUBE * volume / lc**3
    if cells > MOST_CELLS:
        raise ConfigError(
            f"lc = {lc:g} m would give about {cells:.1g} cells in a body {_diagonal(gmsh):.3g} m "
            "long.",
            hint="STEP files are read in metres.",
        )


def _name_faces(gmsh: Any, text: str) -> None:
    names = dict(FACE_PATTERN.findall(text))
    listed = [f for shell in SHELL_PATTERN.findall(text) for f in re.findall(r"#(\d+)", shell)]
    named = {f: names[f].strip() for f in listed if names.get(f, "").strip(" '")}
    surfaces = sorted(tag for _, tag in gmsh.model.getEntities(2))
    if not named or set(named.values()) == {"NONE"}:
        return
    if len(listed) != len(surfaces):
        raise TagError(
            f"the file names {len(named)} faces, but its {len(listed)} faces became "
            f"{len(surfaces)} surfaces, so the names cannot be placed.",
            hint="Pick the faces by points with faces={...}.",
        )
    for name in sorted(set(named.values()) - {"NONE"}):
        tags = [s for f, s in zip(listed, surfaces, strict=True) if named.get(f) == name]
        _group(gmsh, name, tags)


def _group(gmsh: Any, name: str, tags: list[int]) -> None:
    group = gmsh.model.addPhysicalGroup(2, tags)
    gmsh.model.setPhysicalName(2, group, name)


def pick(gmsh: Any, faces: dict[str, Any]) -> None:
    """Name the picked faces of a meshed geometry.

    Raises:
        TagError: nothing, or two faces, at the place given.
    """
    for name, wanted in faces.items():
        if wanted == EVERY_FACE:
            _number(gmsh, name)
            continue
        _group(
            gmsh,
            name,
            sorted({s for one in _wishes(name, wanted) for s in _surfaces(gmsh, name, one)}),
        )


def _number(gmsh: Any, name: str) -> None:
    for _, tag in gmsh.model.getEntities(2):
        if not gmsh.model.getPhysicalGroupsForEntity(2, tag).size:
            _group(gmsh, f"{name} {tag}", [tag])


def _wishes(name: str, wanted: Any) -> list[Any]:
    """A number, a point, a box, or a list of these, as a list."""
    if isinstance(wanted, int):
        return [wanted]
    flat = isinstance(wanted, list) and all(isinstance(x, int | float) for x in wanted)
    if flat and len(wanted) in (3, 6):
        return [wanted]
    if (
        isinstance(wanted, list)
        and wanted
        and not (flat and not all(isinstance(x, int) for x in wanted))
    ):
        return [one for part in wanted for one in _wishes(name, part)]
    raise ConfigError(
        f"face {name!r} is picked by a number, a point (3) or a box (6), got {wanted!r}."
    )


def _surfaces(gmsh: Any, name: str, wish: Any) -> list[int]:
    if isinstance(wish, int):
        found = [tag for _, tag in gmsh.model.getEntities(2) if tag == wish]
    elif len(wish) == 6:
        found = [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*wish, 2)]
    else:
        found = [_nearest(gmsh, name, wish)]
    if not found:
        raise TagError(
            f"face {name!r}: no face at {wish}.",
            hint=f"The faces are numbered 1 to {len(gmsh.model.getEntities(2))}, lengths are in m.",
        )
    return found


def _nearest(gmsh: Any, name: str, point: list[float]) -> int:
    """The surface nearest to the point, measured to nodes and centres of its facets."""
    distance = {tag: _distance(gmsh, tag, point) for _, tag in gmsh.model.getEntities(2)}
    order, size = sorted(distance, key=lambda tag: distance[tag]), _diagonal(gmsh)
    best = distance[order[0]]
    if best > MAX_DISTANCE_RATIO * size:
        raise TagError(
            f"face {name!r}: the nearest face is {best:.3g} m from {point}, the body {size:.3g} m "
            "long.",
            hint="Points are in metres, on or near the face.",
        )
    if len(order) > 1 and distance[order[1]] - best < TIE_RTOL * size:
        raise TagError(
            f"face {name!r}: faces {order[0]} and {order[1]} are equally near to {point}.",
            hint="Choose a point away from the edge.",
        )
    return order[0]


def _distance(gmsh: Any, tag: int, point: list[float]) -> float:
    nodes, x, _ = gmsh.model.mesh.getNodes(2, tag, includeBoundary=True)
    x, order = x.reshape(-1, 3), np.argsort(nodes)
    centres = []
    for kind, _, corners in zip(*gmsh.model.mesh.getElements(2, tag), strict=True):
        size = gmsh.model.mesh.getElementProperties(kind)[3]
        rows = order[np.searchsorted(nodes, corners, sorter=order)].reshape(-1, size)
        centres.append(x[rows].mean(axis=1))
    return float(np.linalg.norm(np.vstack([x, *centres]) - point, axis=1).min())


def _diagonal(gmsh: Any) -> float:
    box = np.array(gmsh.model.getBoundingBox(-1, -1))
    return float(np.linalg.norm(box[3:] - box[:3]))
