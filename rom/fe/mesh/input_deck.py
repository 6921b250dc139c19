"""A mesh of tetrahedra as an input deck that CalculiX and Abaqus run.

Regions become element sets, interfaces node sets and surfaces of one name, in the node order of
`rom.fe.mesh.sources.abaqus`, which reads the deck back. CalculiX takes at most 20 characters for a
number.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from rom.arguments import one_of, whole
from rom.decks.lines import row
from rom.errors import InterfaceError, MeshError, TagError
from rom.fe.mesh.cell_types import CELL_TYPES, DECK_EDGES
from rom.fe.mesh.solid import SolidMesh
from rom.fe.mesh.sources.abaqus import sides
from rom.fe.mesh.topology import find_rows
from rom.model import Material, Orthotropic
from rom.names import ORIGIN_MARK, check_known, named

STEPS = {"frequencies": "*FREQUENCY\n{n}", "matrices": "*FREQUENCY, SOLVER=MATRIXSTORAGE"}
ELEMENTS = {"tet4": "C3D4", "tet10": "C3D10"}
NAME_PATTERN = re.compile(r"[A-Za-z][\w.-]{0,79}", re.ASCII)
Materials = Material | Orthotropic | Mapping[str, Material | Orthotropic]
PER_LINE = 8  # numbers


def input_deck(
    mesh: SolidMesh,
    *,
    material: Materials | None = None,
    degree: int = 2,
    fixed: Sequence[str] = (),
    step: str = "frequencies",
    n_modes: int = 20,
) -> str:
    """The text of a deck in SI: nodes, elements, sets, and with a material a step to run.

    Stiffness is that of `rom.fe.model`, for straight elements and the same degree. The mass of
    CalculiX is not: see `rom.io.matrices.matrix_files`.

    The mesh is of tetrahedra; without a material it stands alone. C3D4 have the degree 1, C3D10
    the degree 2; ``fixed`` interfaces are held in all directions. The step "matrices" gives
    stiffness and mass that `rom.read_model` reads.
    """
    one_of("step", step, STEPS)
    for name in fixed:
        text = f"{name!r} cannot be held; there are"
        check_known(name, mesh.facets, text, InterfaceError)
    if mesh.ties:
        text = f"the mesh comes from a deck that ties or loads nodes, {named(mesh.ties)}"
        raise MeshError(f"{text}; these would be lost. Keep the deck.")
    _check_names(mesh.region_names.values())
    _check_names(mesh.facets)
    mesh = _of_degree(mesh, degree)
    parts = [*_nodes_and_elements(mesh), *_interfaces(mesh)]
    if material is not None:
        parts += [*_materials(mesh, material), *_step(fixed, STEPS[step].format(n=n_modes))]
    return "\n".join(parts) + "\n"


def _of_degree(mesh: SolidMesh, degree: int) -> SolidMesh:
    if mesh.cell_type not in ELEMENTS:
        text = f"cells of the type {mesh.cell_type} have other shape functions there"
        raise MeshError(f"{text}; mesh with tetrahedra.")
    whole("degree", degree, 1, 2, reason="decks have such elements")
    if degree == 1 and mesh.cell_type == "tet10":
        raise MeshError("the mesh has curved edges, which need degree=2.")
    if degree == 1 or mesh.cell_type == "tet10":
        return mesh
    # a node amid each edge, numbered behind the corners
    supports = np.array(CELL_TYPES["tet10"].supports[4:])
    edges = np.sort(mesh.cells[:, supports], axis=2).reshape(-1, 2)
    ends, place = np.unique(edges, axis=0, return_inverse=True)
    cells = np.column_stack([mesh.cells, len(mesh.points) + place.reshape(-1, len(supports))])
    points = np.vstack([mesh.points, mesh.points[ends].mean(axis=1)])
    return replace(mesh, points=points, cells=cells, cell_type="tet10")


def _nodes_and_elements(mesh: SolidMesh) -> Iterator[str]:
    yield f"** {ORIGIN_MARK}: lengths in m, forces in N, masses in kg"
    yield "*NODE"
    yield from (f"{k}, {row(x)}" for k, x in enumerate(mesh.points, 1))
    order = [0, 1, 2, 3, *mesh.kind.among(DECK_EDGES["tet10"])]
    for tag, name in mesh.region_names.items():
        yield f"*ELEMENT, TYPE={ELEMENTS[mesh.cell_type]}, ELSET={name}"
        for k in np.flatnonzero(mesh.regions == tag):
            yield ", ".join(map(str, [k + 1, *(mesh.cells[k, order] + 1)]))


def _interfaces(mesh: SolidMesh) -> Iterator[str]:
    kind, n = mesh.kind, len(mesh.points)
    side = {face: label for label, face in sides(kind).items()}
    listed = mesh.cells[:, np.array(kind.faces)].reshape(-1, 3)
    for name, facets in mesh.facets.items():
        cell, face = np.divmod(find_rows(facets[:, :3], listed, n), len(side))
        nodes = np.unique(mesh.cells[cell[:, None], np.array(kind.face_nodes)[face]]) + 1
        yield f"*NSET, NSET={name}"
        for k in range(0, nodes.size, PER_LINE):
            yield ", ".join(map(str, nodes[k : k + PER_LINE]))
        yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
        yield from (f"{c + 1}, {side[f]}" for c, f in zip(cell, face, strict=True))


def _materials(mesh: SolidMesh, material: Materials) -> Iterator[str]:
    from rom.fe.forms.material import by_region

    solids = by_region(material, {name: tag for tag, name in mesh.region_names.items()})
    for tag, name in mesh.region_names.items():
        solid, turned = solids[tag], ""
        yield f"*MATERIAL, NAME={name}"
        if isinstance(solid, Orthotropic):
            axes = np.asarray(solid.axes, dtype=np.float64)[:2].ravel()
            turned = f", ORIENTATION={name}"
            first, last = (*solid.E, *solid.nu, *solid.G[:2]), solid.G[2:]
            yield f"*ELASTIC, TYPE=ENGINEERING CONSTANTS\n{row(first)}\n{row(last)}"
        else:
            yield f"*ELASTIC\n{row((solid.E, solid.nu))}"
        yield f"*DENSITY\n{row((solid.rho,))}"
        if turned:
            yield f"*ORIENTATION, NAME={name}, SYSTEM=RECTANGULAR\n{row(axes)}"
        yield f"*SOLID SECTION, ELSET={name}, MATERIAL={name}{turned}"


def _step(fixed: Sequence[str], kind: str) -> Iterator[str]:
    if fixed:
        yield "*BOUNDARY"
        yield from (f"{name}, 1, 3" for name in fixed)
    yield f"*STEP\n{kind}\n*NODE FILE\nU\n*END STEP"


def _check_names(names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if not NAME_PATTERN.fullmatch(name):
            raise TagError(
                f"{name!r} is no name for a deck.",
                hint="It begins with a letter, followed by at most 79 letters, digits, _, - or .",
            )
        if name.upper() in seen:
            raise TagError(f"{name!r} names two sets; use another, decks have no small letters.")
        seen.add(name.upper())
