"""Abaqus and Nastran decks; meshio is the second opinion on node order."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cases.files.cells import solid
from cases.files.damage import damaged, outcome
from cases.refusals import refuses
from rom.errors import FileFormatError, MeshError, ResourceError, RomError, RomWarning, TagError
from rom.fe.mesh import child
from rom.fe.mesh.cell_types import CELL_TYPES
from rom.fe.mesh.read import read_mesh
from rom.fe.mesh.sources import abaqus

MESHIO = {"tet4": "tetra", "tet10": "tetra10", "hex8": "hexahedron", "hex20": "hexahedron20"}
# node order of VTK, which meshio uses, in that of gmsh
VTK = {
    "tet10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
    "hex20": [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15],
}


def meshio_box(kind):
    """A box as meshio sees it, and the record it must become."""
    meshio = pytest.importorskip("meshio", reason="meshio is not installed")
    mesh = solid("hex27" if kind == "hex20" else kind, (2, 2, 2), (2.0, 1.0, 1.0))
    if kind == "hex20":
        used = np.unique(mesh.cells[:, :20])
        cells = np.searchsorted(used, mesh.cells[:, :20])
        points = mesh.points[used]
    else:
        cells, points = mesh.cells, mesh.points
    root = np.flatnonzero(points[:, 0] == 0.0)
    ordered = cells[:, VTK.get(kind, range(cells.shape[1]))]
    return meshio, meshio.Mesh(points, [(MESHIO[kind], ordered)], point_sets={"root": root}), mesh


def check_box(found, mesh):
    x, y = (m.points[m.cells] for m in (found, mesh))
    assert_allclose(x, y, atol=1e-12)
    (root,) = found.facets.values()
    assert (found.points[root, 0] == 0.0).all()
    assert root.shape == mesh.facets["root"].shape


@pytest.mark.parametrize("kind", MESHIO)
def test_abaqus_written_by_meshio_comes_back(tmp_path, kind):
    meshio, box, mesh = meshio_box(kind)
    meshio.write(tmp_path / "box.inp", box)
    found = read_mesh(tmp_path / "box.inp")
    assert list(found.facets) == ["root"] and found.region_names == {1: "body"}
    check_box(found, mesh)


@pytest.mark.parametrize("kind", MESHIO)
def test_nastran_written_by_meshio_comes_back(tmp_path, kind):
    """Regions by property number, interfaces by the set number of SPC1 cards."""
    meshio, box, mesh = meshio_box(kind)
    box.cell_data = {"nastran:ref": [np.where(np.arange(len(box.cells[0].data)) < 3, 4, 9)]}
    path = tmp_path / "box.bdf"
    meshio.write(path, box, file_format="nastran")
    root = [str(i + 1) for i in box.point_sets["root"]]
    cards = [f"SPC1,7,123456,{','.join(root[:5])}"]
    cards += [f"+,{','.join(root[i : i + 8])}" for i in range(5, len(root), 8)]
    path.write_text(path.read_text().replace("ENDDATA", "\n".join([*cards, "ENDDATA"])))
    found = read_mesh(path)
    assert found.region_names == {4: "property_4", 9: "property_9"}
    assert (found.regions == 4).sum() == 3
    assert list(found.facets) == ["spc_7"]
    check_box(found, mesh)


DECK = """*HEADING
 two bricks
*NODE, NSET=first
 10, 0., 0., 0.
 20, 1., 0., 0.
 30, 1., 1., 0.
 40, 0., 1., 0.
*Node
 11, 0., 0., 1.
 21, 1., 0., 1.
 31, 1., 1., 1.
 41, 0., 1., 1.
 52, 2., 0., 0.
 53, 2., 1., 0.
 62, 2., 0., 1.
 63, 2., 1., 1.
*ELEMENT, TYPE=C3D8R, ELSET=left
 7, 10, 20, 30, 40,
 11, 21, 31, 41
*element, type=c3d8, elset=right
 8, 20, 52, 53, 30, 21, 62, 63, 31
** a comment
*NSET, NSET=left_face, GENERATE
 10, 11, 1
*NSET, NSET=left_face
 40, 41
*NSET, NSET=line
 52, 53
*ELSET, ELSET=every
 left, right
*SURFACE, NAME=top, TYPE=ELEMENT
 every, S2
*SURFACE, NAME=end
 8, S4
*SURFACE, NAME=by_nodes, TYPE=NODE
 left_face,
*SOLID SECTION, ELSET=right, MATERIAL=steel
*SOLID SECTION, ELSET=left, MATERIAL=brass
"""


def test_abaqus_sections_sets_and_surfaces(tmp_path):
    """Several *NODE blocks, lower case, continued lines, sets of sets: meshio gets these wrong."""
    (tmp_path / "deck.inp").write_text(DECK)
    with pytest.warns(RomWarning, match="node set 'line' contains no complete facet"):
        mesh = read_mesh(tmp_path / "deck.inp")
    assert mesh.region_names == {1: "right", 2: "left"}
    assert_array_equal(mesh.regions, [2, 1])
    assert_array_equal(mesh.cell_ids, [7, 8])
    assert set(mesh.facets) == {"first", "top", "end", "left_face", "by_nodes"}
    places = {name: mesh.points[np.unique(rows)] for name, rows in mesh.facets.items()}
    assert (places["top"][:, 2] == 1.0).all() and len(places["top"]) == 6
    assert (places["end"][:, 0] == 2.0).all() and len(places["end"]) == 4
    assert (places["left_face"][:, 0] == 0.0).all() and len(places["left_face"]) == 4
    assert_array_equal(places["left_face"], places["by_nodes"])


@pytest.mark.parametrize("kind", ["tet4", "hex8"])
def test_abaqus_side_numbers_follow_the_manual(kind):
    """Outer corner opposite to side S1..S4 of a tetrahedron; planes of S1..S6 of a brick.

    Source: Abaqus manual, three-dimensional solid element library, element faces.
    """
    cell = CELL_TYPES[kind]
    sides = [cell.nodes[list(side)] for side in abaqus.SIDES[cell.n_corners]]
    if kind == "tet4":
        opposite = [set(range(4)) - set(side) for side in abaqus.SIDES[4]]
        assert opposite == [{3}, {2}, {0}, {1}]
    else:
        planes = [(axis, x[0, axis]) for x in sides for axis in range(3) if np.ptp(x[:, axis]) == 0]
        assert planes == [(2, 0.0), (2, 1.0), (1, 0.0), (0, 1.0), (1, 1.0), (0, 0.0)]


def test_nastran_skin_elements_and_fixed_fields(tmp_path):
    """Small fields, THRU, and a skin of quadrilaterals with their own property."""
    mesh = solid("hex8", (1, 1, 1), (1.0, 1.0, 1.0))
    cards = ["SOL 101", "BEGIN BULK"]
    cards += [
        f"GRID    {i + 1:<8}{'':8}{x:<8}{y:<8}{z:<8}" for i, (x, y, z) in enumerate(mesh.points)
    ]
    nodes = [str(i + 1) for i in mesh.cells[0]]
    cards += [f"CHEXA,5,2,{','.join(nodes[:6])}", f"+,{','.join(nodes[6:])}"]
    ring = mesh.facets["root"][0] + 1
    cards += ["CQUAD4  6       3       " + "".join(f"{i:<8}" for i in ring)]
    cards += ["SPC1    4       123     5       THRU    8", "SPC,9,1,123", "ENDDATA", ""]
    (tmp_path / "box.bdf").write_text("\n".join(cards))
    with pytest.warns(RomWarning, match="'spc_9' contains no complete facet"):
        found = read_mesh(tmp_path / "box.bdf")
    assert found.region_names == {2: "property_2"} and found.cell_ids[0] == 5
    assert set(found.facets) == {"property_3", "spc_4"}
    assert (found.points[found.facets["property_3"], 0] == 0.0).all()
    assert (found.points[found.facets["spc_4"], 0] == 1.0).all()


def test_a_missing_library_is_named(tmp_path, monkeypatch):
    def reader(name):
        raise ModuleNotFoundError("No module named 'gmsh'", name="gmsh")

    monkeypatch.setattr(child, "import_module", reader)
    with pytest.raises(ResourceError, match=r"needs gmsh.*python3-gmsh"):
        child.read({"reader": "nastran", "path": "x"})


RIGHT = "type=c3d8, elset=right\n 8, 20, 52, 53, 30, 21, 62, 63, 31"
ABAQUS_FAULTS = {
    "cut element": (("40,\n 11, 21, 31, 41", "40"), FileFormatError, "cut"),
    "undefined node": (("8, 20, 52, 53", "8, 20, 52, 99"), FileFormatError, "node 99"),
    "node twice": ((" 53, 2., 1., 0.", " 52, 2., 1., 0."), FileFormatError, "node 52"),
    "element twice": ((" 8, 20, 52", " 7, 20, 52"), FileFormatError, "element 7"),
    "unknown set": (("every, S2", "evry, S2"), FileFormatError, "'evry'"),
    "unknown side": (("8, S4", "8, S7"), FileFormatError, "'S7'"),
    "set of itself": (("left, right", "every"), FileFormatError, "'every'"),
    "no section": (("*SOLID SECTION, ELSET=left, MATERIAL=brass", ""), TagError, "element 7"),
    "two sections": (("ELSET=left, MATERIAL", "ELSET=every, MATERIAL"), TagError, "element 8"),
    "wedge": (("type=c3d8,", "type=c3d6,"), FileFormatError, "*ELEMENT, TYPE=C3D6 (1, deck.inp"),
    "mixed": ((RIGHT, "type=c3d4\n 8, 20, 52, 53, 30"), MeshError, "['hex8', 'tet4']"),
    "include": (("** a comment", "*INCLUDE, INPUT=deck.inp"), FileFormatError, "too deep"),
    "letters": ((" 62, 2., 0., 1.", " 62, 2., zero, 1."), FileFormatError, "zero"),
}


@pytest.mark.once
@pytest.mark.parametrize("fault", ABAQUS_FAULTS)
def test_broken_abaqus_deck_is_refused(tmp_path, fault):
    (old, new), error, culprit = ABAQUS_FAULTS[fault]
    assert old in DECK
    (tmp_path / "deck.inp").write_text(DECK.replace(old, new))
    with pytest.raises(error) as caught:
        read_mesh(tmp_path / "deck.inp")
    assert culprit in str(caught.value) and "deck.inp" in str(caught.value)


@pytest.mark.parametrize(
    "text",
    ["", "GRID,1,,0.,0.,0.\n", "BEGIN BULK\nCTETRA,1,1,1,2,3,4\nENDDATA\n", "BEGIN BULK\nGRID"],
)
def test_broken_nastran_deck_is_refused(tmp_path, text):
    (tmp_path / "deck.bdf").write_text(text)
    refuses((FileFormatError, MeshError), r"deck\.bdf", read_mesh, tmp_path / "deck.bdf")


@pytest.mark.parametrize("ending", [".inp", ".bdf"])
def test_damaged_decks_are_refused_or_harmless(ending, tmp_path):
    """In this process, without the guard of `rom.fe.mesh.child`, which names the file."""
    meshio, box, _ = meshio_box("tet4")
    path, kind = tmp_path / f"x{ending}", {".inp": "abaqus", ".bdf": "nastran"}[ending]
    box.cell_data = {"nastran:ref": [np.ones(len(box.cells[0].data), dtype=int)]}
    meshio.write(path, box, file_format=kind)

    def read(path):
        try:
            child.read({"reader": kind, "path": str(path)})
        except RomError as error:
            raise type(error)(error.message, where=str(path)) from error

    assert outcome(read, path) is None
    data, refused = path.read_bytes(), 0
    for _, content in damaged(data, np.random.default_rng(2), 100):
        path.write_bytes(content)
        refused += outcome(read, path) is not None
    assert refused > 20
