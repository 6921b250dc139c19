"""Meshes of solids: one record, whatever file they come from.

A mesh is read and checked on one process as NumPy arrays, before dolfinx sees it. gmsh and the
readers of decks, which broken files can crash, run in a process of their own (`rom.fe.mesh.child`).
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rom.arguments import positive, typed
from rom.decks import bulk, keywords
from rom.decks.lines import lines
from rom.errors import (
    ConfigError,
    FileFormatError,
    ParallelError,
    TagError,
    UnsafeFileError,
    in_file,
)
from rom.fe.mesh.cad import Axis, Face, from_plain
from rom.fe.mesh.cell_types import CELL_TYPES
from rom.fe.mesh.child import read_apart
from rom.fe.mesh.curving import without_middles
from rom.fe.mesh.picks import EVERY_FACE, picks
from rom.fe.mesh.quality import straighten
from rom.fe.mesh.repair import repair
from rom.fe.mesh.solid import GEOMETRIES, PROGRAMS, Arrays, Notes, Request, SolidMesh, Spring, Tie
from rom.fe.mesh.validate import checked
from rom.model import Array, Attachment, Index
from rom.names import check_known, check_text
from rom.readable import check_readable
from rom.units import UnitSystem, unit_system

if TYPE_CHECKING:
    from mpi4py import MPI

    from dolfinx.mesh import Mesh

    from rom.fe.compat import MeshTags

INCLUDES = {"abaqus": keywords.INCLUDE_PATTERN, "nastran": bulk.INCLUDE_PATTERN}
LARGEST_FILE = 2**32  # bytes; some ten million nodes
FACET_SHAPE = {"tetrahedron": "triangle", "hexahedron": "quadrilateral"}
ENDINGS = {  # of files, by what reads them
    "geo": ".geo", "builder": ".py", "step": ".step .stp", "msh": ".msh", "unv": ".unv",
    "abaqus": ".inp", "nastran": ".bdf .nas .dat .fem", "ansys": ".cdb", "med": ".med",
}  # fmt: skip
READERS = {ending: reader for reader, own in ENDINGS.items() for ending in own.split()}
DECKS = ("abaqus", "nastran", "ansys")  # may say what regions are made of


@typed
def read_mesh(  # noqa: PLR0913  limits and trust beside what is read
    path: str | Path,
    *,
    parameters: Mapping[str, Any] | None = None,
    faces: Mapping[str, Any] | None = None,
    scale: float = 1.0,
    units: str = "SI",
    order: int | None = None,
    trust: bool = False,
    time_limit: float | None = None,
    memory_limit: float | None = None,
) -> SolidMesh:
    """Read or make a mesh and check it.

    A ``.geo`` is a program; one that starts processes or writes files is refused. A ``.py`` can do
    what its reader can do, and is run only with ``trust``.

    Args:
        path: ``.geo`` gmsh geometry; ``.py`` file with ``build(gmsh, **parameters)``; ``.step``;
            ``.msh`` 2.2 or 4.1; ``.unv`` and ``.med`` with groups; Abaqus ``.inp``; Nastran
            ``.bdf``; Ansys ``.cdb``.
        parameters: named values for a geometry: those with ``Name`` in a ``.geo``, the arguments of
            ``build``, or ``lc`` (element size [m]) for ``.step``.
        faces: surfaces to name in a ``.step``: a face number, a point (3) near the face, a box (6)
            around it, a text as "radius:0.006", "normal:0,0,1" or "3+4", see
            `rom.fe.mesh.picks`, or a list of these; lengths in metres. {"face": "every"} names
            all faces without a name "face 1", "face 2", ...
        scale: factor on all coordinates, e.g. 1e-3 for a mesh drawn in millimetres.
        units: unit system of a mesh or deck, with the materials a deck says: "SI", "mm-t-s" (N,
            MPa), "mm-kg-ms" or "in-lbf-s"; in place of a scale.
        order: degree of the geometry when the mesh is made here: 1 for straight edges, 2 for
            curved ones, with nodes amid edges and faces on the surface; None for 2 where the body
            is curved and 1 where it is not.
        trust: run a ``.py`` file.
        time_limit: of meshing a geometry [s]; by default half an hour, 0 for none.
        memory_limit: of meshing a geometry [bytes]; by default 80 % of the machine's, 0 for none.

    Returns:
        A mesh that passed `rom.fe.mesh.validate.validate`, whose warnings are also issued.

    Raises:
        ConfigError: unknown suffix or parameter.
        FileFormatError: the file is missing, cut, or not what its name promises.
        UnsafeFileError: a geometry would do more than make a mesh, or is a ``.py`` not trusted.
        MeshError: the cells do not form one solid.
        TagError: a physical group is missing, doubled or ambiguous.
        ResourceError: meshing exceeds its limit of time or memory.
    """
    path = Path(path)
    with in_file(path):
        request = _request(path, parameters, scale, trust=trust, faces=faces, order=order)
        unit = unit_system(units)
        if units != "SI" and (scale != 1.0 or is_geometry(path)):
            text = f"units={units!r} is for finished meshes, in place of scale="
            raise ConfigError(f"{text}; a .geo takes scale=, a .step says its unit.")
    reader = request["reader"]
    files = {path}  # a deck may include others
    if reader in INCLUDES:
        files |= {place[0] for place, _ in lines(path, INCLUDES[reader])}
    size = sum(file.stat().st_size for file in files)
    limits = {"time_limit": time_limit, "memory_limit": memory_limit}
    arrays, notes = read_apart(request, where=str(path), size=size, **limits)
    provenance = {
        "path": str(path),
        "sha256": _digest(*sorted(files)),
        "scale": scale * unit.length,
        **notes["provenance"],
    }
    if scale != 1.0 and "materials" in notes:
        text = f"scale={scale:g} is of lengths alone and says no unit of the"
        hint = "Give units= instead, as 'mm-t-s'"
        notes["unread"] = {
            "message": f"{text} materials of the deck.",
            "hint": f"{hint}, or others.",
        }
        if notes.get("carried") or notes.get("springs"):
            raise FileFormatError(f"{text} masses and springs.", where=str(path), hint=f"{hint}.")
    mesh, remarks = _solid(arrays, notes, provenance, scale, unit), notes["warnings"]
    if reader in GEOMETRIES:
        mesh, straightened = straighten(repair(mesh))
        mesh = mesh if order else without_middles(mesh)
        remarks = [*remarks, *straightened]
    if reader == "step" and scale != 1.0:
        twice = (
            f"a STEP file says its own unit and was read in metres, {mesh.size / scale:.4g} m "
            f"long; scale={scale:g} on top makes it {mesh.size:.4g} m. Leave scale out unless the "
            "file is wrong."
        )
        remarks = [*remarks, twice]
    return checked(mesh, remarks)


@dataclass(frozen=True, slots=True)
class FlatMesh:
    """Triangles of a plane section."""

    points: Array  # (n, 2) coordinates [m]
    triangles: Index  # (t, 3) corners, counter-clockwise
    # {name: (k, 2)} nodes of the sides of physical curves, the solid on the left
    curves: dict[str, Index]
    # {name: (k,)} triangles of each plane surface; those of a physical surface of several are
    # numbered, "stone 1", "stone 2". Without physical ones, all there are
    surfaces: dict[str, Index]
    provenance: Notes  # where the mesh comes from: path, sha256, parameters, versions

    def nodes(self, name: str) -> Index:
        """(k,) nodes of a physical curve."""
        check_known(name, self.curves, f"there is no curve {name!r}; there are", TagError)
        return np.unique(self.curves[name])


@typed
def read_triangles(
    path: str | Path,
    *,
    parameters: Mapping[str, Any] | None = None,
    scale: float = 1.0,
    trust: bool = False,
) -> FlatMesh:
    """Read or make the triangles of a plane section, for sheets and other plane solids.

    Args:
        path: ``.geo`` gmsh geometry with plane surfaces in z = 0; ``.py`` file with
            ``build(gmsh, **parameters)``; ``.msh`` 2.2 or 4.1.
        parameters: named values for a geometry.
        scale: factor on all coordinates, e.g. 1e-3 for a mesh drawn in millimetres.
        trust: run a ``.py`` file.

    Raises:
        ConfigError, FileFormatError, UnsafeFileError, ResourceError: as `read_mesh`.
        MeshError: there are no triangles, other cells, or they leave the plane.
    """
    path = Path(path)
    with in_file(path):
        request = _request(path, parameters, scale, trust=trust) | {"flat": True}
        if request["reader"] not in ("geo", "builder", "msh"):
            text = f"the suffix {path.suffix!r} holds no plane section"
            raise ConfigError(f"{text}; give .geo, .py or .msh.")
    arrays, notes = read_apart(request, where=str(path), size=path.stat().st_size)
    provenance = {"path": str(path), "sha256": _digest(path), "scale": scale}
    X, T = arrays["points"][:, :2] * scale, arrays["cells"]
    u, v = X[T[:, 1]] - X[T[:, 0]], X[T[:, 2]] - X[T[:, 0]]
    T = np.where((u[:, 0] * v[:, 1] < u[:, 1] * v[:, 0])[:, None], T[:, ::-1], T)
    sides = _tables(arrays, "facets", notes["facet_names"])
    n, curves = T.max() + 1, {}
    there = np.concatenate([n * T[:, k] + T[:, (k + 1) % 3] for k in range(3)])
    for name, rows in sides.items():  # the solid on the left
        known = np.isin(n * rows[:, 0] + rows[:, 1], there)
        curves[name] = np.where(known[:, None], rows, rows[:, ::-1])
    surfaces = _tables(arrays, "surface", notes["surface_names"])
    return FlatMesh(X, T, curves, surfaces, provenance | notes["provenance"])


def to_dolfinx(
    mesh: SolidMesh | None, comm: "MPI.Comm"
) -> "tuple[Mesh, MeshTags, dict[str, MeshTags]]":
    """Share the mesh of rank 0, checked if it was not, among the ranks, which all must call.

    Returned are the dolfinx mesh, MeshTags with the region number of each cell, and MeshTags of the
    facets of each named surface. Node i of the dolfinx mesh on this rank is node
    ``geometry.input_global_indices[i]`` of the record. Errors are raised on all ranks.
    """
    from rom.fe.compat import create_mesh, gmsh_order, tag_entities
    from rom.fe.parallel import on_root

    kept: list[SolidMesh] = []

    def prepare() -> tuple[str, list[str]]:
        if mesh is None:
            raise ParallelError("rank 0 gave no mesh to share.", hint="Read it on rank 0.")
        kept.append(mesh if mesh.warnings is not None else checked(mesh))
        return kept[0].cell_type, list(kept[0].facets)

    cell_type, names = on_root(comm, prepare)
    kind, none = CELL_TYPES[cell_type], np.empty(0, dtype=np.int64)
    facets = dict.fromkeys(names, none.reshape(0, kind.nodes_per_face))
    empty = SolidMesh(np.empty((0, 3)), none.reshape(0, kind.n_nodes), cell_type, none, {}, facets)
    solid = kept[0] if kept else empty
    cells = np.ascontiguousarray(solid.cells[:, gmsh_order(kind.shape, kind.n_nodes)])
    made = create_mesh(comm, cells, solid.points, kind.shape, kind.degree)
    cell_tags = tag_entities(made, 3, cells, solid.regions)
    order = gmsh_order(FACET_SHAPE[kind.shape], kind.nodes_per_face)
    facet_tags = {}
    for name in names:
        rows = np.ascontiguousarray(solid.facets[name][:, order])
        facet_tags[name] = tag_entities(made, 2, rows, np.ones(len(rows), dtype=np.int32))
        facet_tags[name].name = name
    return made, cell_tags, facet_tags


def _solid(
    arrays: Arrays, notes: Notes, provenance: Notes, scale: float, unit: UnitSystem
) -> SolidMesh:
    scale *= unit.length
    return SolidMesh(
        points=arrays["points"] * scale,
        cells=arrays["cells"],
        cell_type=notes["cell_type"],
        regions=arrays["regions"],
        region_names={int(tag): name for tag, name in notes["region_names"].items()},
        facets=_tables(arrays, "facets", notes["facet_names"]),
        provenance=provenance,
        cell_ids=arrays["cell_ids"],
        axes={k: from_plain(Axis, axis, scale) for k, axis in notes.get("axes", {}).items()},
        materials={
            name: (E * unit.pressure, nu, rho * unit.density)
            for name, (E, nu, rho) in notes.get("materials", {}).items()
        },
        unread=notes.get("unread", {}),
        ties={name: _tie(tie, scale) for name, tie in notes.get("ties", {}).items()},
        carried=tuple(_carried(body, scale, unit) for body in notes.get("carried", ())),
        springs=tuple(_spring(spring, unit) for spring in notes.get("springs", ())),
        faces=tuple(from_plain(Face, face, scale) for face in notes.get("faces", ())),
    )


def _tie(values: Notes, scale: float) -> Tie:
    points, weights, origin = (np.array(values[k]) for k in ("points", "weights", "origin"))
    weights = weights[:0] if values.get("of area") else weights
    return Tie(points * scale, weights, origin * scale, values["kind"])


def _carried(values: Notes, scale: float, unit: UnitSystem) -> Attachment:
    inertia = np.array(values["inertia"]) * unit.mass * unit.length**2
    at = np.array(values["at"]) * scale
    return Attachment(values["interface"], values["mass"] * unit.mass, inertia, at)


def _spring(values: Notes, unit: UnitSystem) -> Spring:
    turns = np.tile([1.0, unit.length], 2).repeat(3)
    stiffness = np.array(values["stiffness"]) * np.outer(turns, turns) * unit.force / unit.length
    return Spring(values["name"], tuple(values["ends"]), stiffness)


def _tables(arrays: Arrays, kind: str, names: Sequence[str]) -> dict[str, Index]:
    """The arrays of one kind, by their names in the notes."""
    return {name: arrays[f"{kind} {i}"] for i, name in enumerate(names)}


def _request(
    path: Path,
    parameters: Mapping[str, Any] | None,
    scale: float,
    *,
    trust: bool,
    faces: Mapping[str, Any] | None = None,
    order: int | None = None,
) -> Request:
    """What is asked of the reader of a file, checked."""
    check_readable(path, LARGEST_FILE)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        text = f"no reader for the suffix {path.suffix!r}; known are {sorted(READERS)}."
        hint = "Export the mesh with its named surfaces as .msh, .med, .unv, .inp, .bdf or .cdb."
        raise ConfigError(text, hint=hint)
    request: Request = {
        "path": str(path.absolute()),
        "reader": reader,
        "parameters": dict(parameters or {}),
        "faces": dict(faces or {}),
        "order": order,
    }
    _check_request(request, scale)
    if reader in PROGRAMS and trust is not True:
        raise UnsafeFileError(
            "is a Python program, which can do to this machine whatever you can.",
            hint="Read it; if you trust it, run it with --trust or trust=True.",
        )
    return request


def is_geometry(path: str | Path) -> bool:
    """Whether a file is meshed here, and is no finished mesh."""
    return READERS.get(Path(path).suffix.lower()) in GEOMETRIES


def is_deck(path: str | Path) -> bool:
    """Whether a file may say what its regions are made of."""
    return READERS.get(Path(path).suffix.lower()) in DECKS


def _check_request(request: Request, scale: float) -> None:
    reader, faces, order = request["reader"], request["faces"], request["order"]
    given, finished = sorted(request["parameters"]), reader not in GEOMETRIES
    picked = f"faces={sorted(faces)} can be picked in a .step file only"
    for wrong, text in (
        (given and finished, f"a finished mesh takes no parameters, got {given}."),
        (faces and reader != "step", f"{picked}; name physical surfaces in the geometry instead."),
        (
            order not in (None, 1, 2) or (order and finished),
            f"order={order!r} must be 1 or 2, or None where the file is a mesh.",
        ),
    ):
        if wrong:
            raise ConfigError(text)
    positive("scale", scale)
    for name, wanted in faces.items():
        check_text(name, "a surface", TagError)
        try:
            if not (isinstance(wanted, str) and wanted == EVERY_FACE):
                picks(wanted)
        except ConfigError as error:
            raise ConfigError(f"face {name!r}: {error.message}", hint=error.hint) from None


def _digest(*files: Path) -> str:
    digest = hashlib.sha256()
    try:
        for path in files:
            with path.open("rb") as stream:
                hashlib.file_digest(stream, lambda: digest)
        return digest.hexdigest()
    except OSError as error:
        raise FileFormatError(f"cannot be read: {error}.", where=str(path)) from error
