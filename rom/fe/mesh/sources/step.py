"""STEP geometries: one solid, metres, named faces.

gmsh reads no face names from STEP. They are taken from the text: the faces of the shells, in the
order of the file, are the surfaces of gmsh in theirs.
"""

import re
from pathlib import Path
from types import ModuleType

import numpy as np

from rom.arguments import positive
from rom.errors import ConfigError, FileFormatError, MeshError, TagError
from rom.fe.mesh.solid import Made, Request, shown
from rom.fe.mesh.sources.builder import check_parameters
from rom.fe.mesh.sources.cad_faces import diagonal, group, surfaces
from rom.fe.mesh.topology import parts_of

FACE_PATTERN = re.compile(r"#(\d+)\s*=\s*ADVANCED_FACE\s*\(\s*'((?:[^']|'')*)'", re.IGNORECASE)
SHELL_PATTERN = re.compile(
    r"=\s*(?:CLOSED|OPEN)_SHELL\s*\(\s*'(?:[^']|'')*'\s*,\s*\(([^)]*)\)", re.I
)
ELEMENTS_ACROSS = 20  # default element size: this part of the diagonal
# of round faces, at least: with fewer, cells at small bores are turned inside out
EDGES_PER_TURN = 8
CELLS_PER_CUBE = 8.0  # tetrahedra in a cube of the element size
MOST_CELLS = 3e7  # beyond what a machine with 100 GB can mesh


def make(gmsh: ModuleType, path: Path, request: Request) -> Made:
    """Import the file and name its faces; the element size used, and its default."""
    check_parameters(path, request["parameters"], ["lc", "unite"])
    text = path.read_bytes().decode("latin-1")
    if not text.lstrip().startswith("ISO-10303-21"):
        raise FileFormatError("is not a STEP file: it does not start with ISO-10303-21.")
    gmsh.option.setString("Geometry.OCCTargetUnit", "M")
    gmsh.model.add(path.stem)
    gmsh.model.occ.importShapes(str(path))
    solids = gmsh.model.occ.getEntities(3)
    if request["parameters"].get("unite") and len(solids) > 1:  # they share faces from here on
        gmsh.model.occ.fragment(solids, [])
    gmsh.model.occ.synchronize()
    _check_solid(gmsh)
    _name_faces(gmsh, text)
    default = diagonal(gmsh) / ELEMENTS_ACROSS
    lc = request["parameters"].get("lc", default)
    _check_size(gmsh, lc)
    gmsh.option.setNumber("Mesh.MeshSizeMax", lc)
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", EDGES_PER_TURN)
    return {"lc": lc}, {"lc": default}


def _check_solid(gmsh: ModuleType) -> None:
    """Refuse what is no single body, before it is meshed."""
    solids = [tag for _, tag in gmsh.model.getEntities(3)]
    if not solids:
        n = len(gmsh.model.getEntities(2))
        what = f", only {n} loose faces without a volume inside" if n else ""
        raise MeshError(
            f"the STEP file contains no solid{what}.",
            hint="Let the CAD program close the faces to a solid body, and export that.",
        )
    place = {tag: k for k, tag in enumerate(solids)}
    faces = {face: gmsh.model.getAdjacencies(2, face)[0] for face in surfaces(gmsh)}
    pairs = np.array([(place[int(tag)], face) for face, tags in faces.items() for tag in tags])
    if parts_of(*pairs.T)[0] > 1:
        volumes = sorted((gmsh.model.occ.getMass(3, tag) for tag in solids), reverse=True)
        listed = shown([f"{v:.4g}" for v in volumes])
        raise MeshError(
            f"the STEP file holds {len(solids)} solids, of {listed} m^3, that share no face; "
            "one model is one body.",
            hint="Solids that touch become one part by --unite (in Python the parameter unite=1), "
            "which leaves those apart that do not; export these into files of their own, and join "
            "them in a mechanism.",
        )


def _check_size(gmsh: ModuleType, lc: object) -> None:
    """Refuse a mesh size that is none, or far too fine, as when the units are mixed up."""
    lc = positive("lc", lc)
    volume = sum(gmsh.model.occ.getMass(3, tag) for _, tag in gmsh.model.getEntities(3))
    cells = CELLS_PER_CUBE * volume / lc**3
    if cells > MOST_CELLS:
        raise ConfigError(
            f"lc = {lc:g} m would give about {cells:.1g} cells in a body {diagonal(gmsh):.3g} m "
            "long.",
            hint="STEP files are read in metres.",
        )


def _name_faces(gmsh: ModuleType, text: str) -> None:
    names = dict(FACE_PATTERN.findall(text))
    listed = [f for shell in SHELL_PATTERN.findall(text) for f in re.findall(r"#(\d+)", shell)]
    named = {f: names[f].strip() for f in listed if names.get(f, "").strip(" '")}
    surfaces = sorted(tag for _, tag in gmsh.model.getEntities(2))
    if not named or set(named.values()) == {"NONE"}:
        return
    if len(listed) != len(surfaces):  # some are split where solids touch
        raise TagError(
            f"the file names {len(named)} faces, but its {len(listed)} faces became "
            f"{len(surfaces)} surfaces, so the names cannot be placed.",
            hint="Pick the faces by points with faces={...}.",
        )
    for name in sorted(set(named.values()) - {"NONE"}):
        tags = [s for f, s in zip(listed, surfaces, strict=True) if named.get(f) == name]
        group(gmsh, name, tags)
