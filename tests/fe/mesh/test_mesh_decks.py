"""Abaqus and Nastran decks: what is read, card by card, and what would be lost: refused."""

from contextlib import contextmanager

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.files.archives import archive
from cases.files.cells import solid
from cases.files.damage import changed, damaged, outcome
from cases.files.random_decks import CARDS, KEYWORDS, SIZE, random_deck
from cases.long import few
from cases.refusals import refuses
from cases.solid import STEEL
from rom.decks.bulk import cards
from rom.errors import FileFormatError, MeshError, ResourceError, RomError, RomWarning, TagError
from rom.fe.mesh import child
from rom.fe.mesh.cell_types import CELL_TYPES
from rom.fe.mesh.read import read_mesh
from rom.fe.mesh.sources import abaqus, nastran
from rom.fe.mesh.sources.gmsh_session import session
from rom.io.matrices.node_files import read_nodes

MESHIO = {"tet4": "tetra", "tet10": "tetra10", "hex8": "hexahedron", "hex20": "hexahedron20"}
# node order of VTK, which meshio uses, in that of gmsh
VTK = {
    "tet10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
    "hex20": [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15],
}


def meshio_box(kind):
    meshio = pytest.importorskip("meshio", reason="meshio is not installed")
    mesh = solid("hex27" if kind == "hex20" else kind, (2, 2, 2), (2.0, 1.0, 1.0))
    used = np.unique(mesh.cells[:, :20])
    cells, points = np.searchsorted(used, mesh.cells[:, :20]), mesh.points[used]
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
def test_decks_written_by_meshio_come_back(tmp_path, kind):
    """Of Nastran regions by property number, interfaces by the set number of SPC1 cards."""
    meshio, box, mesh = meshio_box(kind)
    meshio.write(tmp_path / "box.inp", box)
    found = read_mesh(tmp_path / "box.inp")
    assert list(found.facets) == ["root"] and found.region_names == {1: "body"}
    check_box(found, mesh)
    box.cell_data = {"nastran:ref": [np.where(np.arange(len(box.cells[0].data)) < 3, 4, 9)]}
    path = tmp_path / "box.bdf"
    meshio.write(path, box, file_format="nastran")
    root = [str(i + 1) for i in box.point_sets["root"]]
    cards = [f"SPC1,7,123456,{','.join(root[:5])}"]
    cards += [f"+,{','.join(root[i : i + 8])}" for i in range(5, len(root), 8)]
    path.write_text(path.read_text().replace("ENDDATA", "\n".join([*cards, "ENDDATA"])))
    found = read_mesh(path)
    assert found.region_names == {4: "property_4", 9: "property_9"}
    assert (found.regions == 4).sum() == 3 and list(found.facets) == ["spc_7"]
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
    """Three-dimensional solid elements: corners opposite to S1..S4, planes of S1..S6 of a brick."""
    cell = CELL_TYPES[kind]
    sides = [cell.nodes[list(side)] for side in abaqus.SIDES[cell.n_corners]]
    if kind == "tet4":
        opposite = [set(range(4)) - set(side) for side in abaqus.SIDES[4]]
        assert opposite == [{3}, {2}, {0}, {1}]
    else:
        planes = [(axis, x[0, axis]) for x in sides for axis in range(3) if np.ptp(x[:, axis]) == 0]
        assert planes == [(2, 0.0), (2, 1.0), (1, 0.0), (0, 1.0), (1, 1.0), (0, 0.0)]


def test_nastran_skin_elements_and_fixed_fields(tmp_path):
    mesh = solid("hex8", (1, 1, 1), (1.0, 1.0, 1.0))
    cards = ["SOL 101", "BEGIN BULK"]
    for i, (x, y, z) in enumerate(mesh.points):
        cards.append(f"GRID    {i + 1:<8}{'':8}{x:<8}{y:<8}{z:<8}")
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
test_broken_abaqus_deck_is_refused = pytest.mark.once(changed(
    DECK, "deck.inp", read_mesh,
    ("40,\n 11, 21, 31, 41", "40", "cut"),
    ("8, 20, 52, 53", "8, 20, 52, 99", "node 99"),
    (" 53, 2., 1., 0.", " 52, 2., 1., 0.", "node 52"),
    (" 8, 20, 52", " 7, 20, 52", "element 7"),
    ("every, S2", "evry, S2", "'evry'"),
    ("8, S4", "8, S7", "'S7'"),
    ("left, right", "every", "'every'"),
    ("*SOLID SECTION, ELSET=left, MATERIAL=brass", "", TagError, "element 7"),
    ("ELSET=left, MATERIAL", "ELSET=every, MATERIAL", TagError, "element 8"),
    ("type=c3d8,", "type=c3d6,", r"\*ELEMENT, TYPE=C3D6 \(1, deck\.inp"),
    (RIGHT, "type=c3d4\n 8, 20, 52, 53, 30", MeshError, r"\['hex8', 'tet4'\]"),
    ("** a comment", "*INCLUDE, INPUT=deck.inp", "too deep"),
    (" 62, 2., 0., 1.", " 62, 2., zero, 1.", "zero"),
))  # fmt: skip


def test_broken_nastran_deck_is_refused(tmp_path):
    path, bulk = tmp_path / "deck.bdf", "BEGIN BULK\n"
    for text in ("", "GRID,1,,0.,0.,0.\n", f"{bulk}CTETRA,1,1,1,2,3,4\nENDDATA\n", f"{bulk}GRID"):
        path.write_text(text)
        refuses((FileFormatError, MeshError), r"deck\.bdf", read_mesh, path)
    path.write_text("INCLUDE 'gone.blk'\n")
    refuses(RomError, "gone.blk: there is no such file", nastran.read, str(path))


@pytest.mark.parametrize("ending", [".inp", ".bdf", ".cdb"])
def test_damaged_decks_are_refused_or_harmless(ending, tmp_path):
    """In this process, without the guard of `rom.fe.mesh.child`, which names the file."""
    path = tmp_path / f"x{ending}"
    kind = {".inp": "abaqus", ".bdf": "nastran", ".cdb": "ansys"}[ending]
    path.write_text(archive("tet4")[0])
    if kind != "ansys":
        meshio, box, _ = meshio_box("tet4")
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


READERS = {"bdf": nastran.read, "inp": abaqus.read}
# corners of the six tetrahedra of a brick around its diagonal from 0 to 6
DIAGONAL = ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))


def volume_and_centre(points, cells):
    parts = [cells[:, :4]]
    if cells.shape[1] in (8, 20):
        parts = [cells[:, [0, a, b, 6]] for a, b in DIAGONAL]
    x = points[np.vstack(parts)]
    v = np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / 6
    return v.sum(), (v[:, None] * x.mean(axis=1)).sum(axis=0) / v.sum()


CASES = [(form, seed) for seed in range(30) for form in ("bdf", "inp")]


@pytest.mark.parametrize(("form", "seed"), few(14, CASES))
def test_random_decks_are_read_whole_or_refused_by_card(form, seed, tmp_path):
    deck = random_deck(seed, form)
    for name, text in deck.files.items():
        (tmp_path / name).write_text(text)
    path = str(tmp_path / f"deck.{form}")
    if deck.refused:
        with pytest.raises(FileFormatError) as caught:
            READERS[form](path)
        assert f"{deck.refused} (1, deck.{form} line " in str(caught.value)
        return
    arrays, notes = READERS[form](path)
    local = (arrays["points"] - deck.origin) @ deck.turn
    assert notes["cell_type"] == deck.kind and len(arrays["cells"]) == deck.n_cells
    rtol = 10.0 ** (3 - deck.digits)
    volume, centre = volume_and_centre(local, arrays["cells"])
    assert volume == pytest.approx(np.prod(SIZE), rel=30 * rtol)
    assert_allclose(centre, np.array(SIZE) / 2, atol=rtol)
    (root,) = (arrays[f"facets {k}"] for k, name in enumerate(notes["facet_names"])
               if name.upper() in ("SPC_7", "ROOT"))  # fmt: skip
    assert_allclose(local[root, 0], 0.0, atol=rtol)
    _, points, _ = read_nodes(path)  # with matrices of another program
    assert_allclose(np.sort(points, axis=0), np.sort(arrays["points"], axis=0))


ARC = 11.25  # degrees of an element
RING = """*NODE, SYSTEM=C
 1, .1\n 2, .08\n 3, .1, 11.25\n 4, .08, 11.25
 11, .1, 0., .03\n 12, .08, 0., .03\n 13, .1, 11.25, .03\n 14, .08, 11.25, .03
*ELEMENT, TYPE=C3D8
 7, 1, 3, 4, 2, 11, 13, 14, 12
*NSET, NSET=root
 1, 2, 11, 12
*NODE
 99, 0., 0., 5.
"""
SPHERE = """CORD2S  4               1.      0.      0.      1.      0.      1.
        2.      0.      0.
CORD1R,5,101,102,103
GRID,101,4,2.0,90.,90.
GRID,102,4,2.0,90.,180.
GRID,103,4,5.0,0.0,77.
GRDSET,,5
"""


def test_systems_lead_where_the_manuals_say(tmp_path):
    """Degrees of a sphere, from z, then around it; blank fields are those of GRDSET."""
    # at (1, 0, 0) 101 lies on y, 102 on -x, 103 on z; their system has z = -(1, 1, 0) / sqrt(2)
    (tmp_path / "s.bdf").write_text(SPHERE + "GRID,1,,1.,0.,2.\nGRID,2,0,1.,0.,2.\n")
    labels, points, _ = read_nodes(tmp_path / "s.bdf")
    found = dict(zip(labels.tolist(), points, strict=True))
    assert_allclose(found[101], [1, 2, 0], atol=1e-14)
    assert_allclose(found[102], [-1, 0, 0], atol=1e-14)
    assert_allclose(found[103], [1, 0, 5], atol=1e-14)
    assert_allclose(found[2], [1, 0, 2])
    z = -np.array([1, 1, 0]) / np.sqrt(2)
    x = np.array([0, -2, 5]) - (np.array([0, -2, 5]) @ z) * z
    assert_allclose(found[1], [1, 2, 0] + x / np.linalg.norm(x) + 2 * z)


EIGHT = ["1", "2", "3", "4", "5", "6", "7", "8"]
NARROW = "CHEXA   1       2       3       4       5       6       7       8"
FORMS = {  # what is written, the fields it means
    "narrow": (NARROW, EIGHT),
    "right": (f"CHEXA   {1:8}{2:8}{3:8}{4:8}{5:8}{6:8}{7:8}{8:8}", EIGHT),
    "free": ("chexa, 1,2 , 3,4,5,6,7,8", EIGHT),
    "tabs": ("CHEXA\t1\t2\t3\t4\t5\t6\t7\t8", EIGHT),
    "wide": (f"CHEXA*  {1:<16}{2:<16}{3:<16}{4:<16}*A\n*A      {5:16}{6:16}{7:16}{8:16}", EIGHT),
    "wide and free": ("CHEXA*,1,2,3,4,*\n*,5,6,7,8", EIGHT),
    "half a wide one": ("CHEXA*,1,2,3,4\n+,9", [*EIGHT[:4], "", "", "", "", "9"]),
    "named": (f"{NARROW}       +X1\n+X1,9", [*EIGHT, "9"]),
    "a comment": ("CHEXA,1,2,3,4,5,6,7,8 $ 9\n$ 10\n\n,9", [*EIGHT, "9"]),
}


@pytest.mark.parametrize("form", FORMS)
def test_forms_of_cards_mean_the_same(form, tmp_path):
    text, fields = FORMS[form]
    (tmp_path / "a.bdf").write_text(f"{text}\nENDDATA\nafter the end\n")
    (card,) = cards(tmp_path / "a.bdf")
    n = len(fields)
    assert (card.name, card.fields[:n]) == ("CHEXA", fields) and not any(card.fields[n:])


@pytest.mark.parametrize("name", [*CARDS, *KEYWORDS])
def test_every_card_that_would_be_lost_is_refused_by_name(name, tmp_path):
    path = tmp_path / ("a.inp" if name in KEYWORDS else "a.bdf")
    path.write_text(RING + KEYWORDS[name] if name in KEYWORDS else CUBE + CARDS[name])
    with pytest.raises(FileFormatError) as caught:
        READERS[path.suffix[1:]](str(path))
    assert f"{name} (1, {path.name} line " in str(caught.value)


CORNERS = ("0.,0.,0.", "1.,0.,0.", "1.,1.,0.", "0.,1.,0.",
           "0.,0.,1.", "1.,0.,1.", "1.,1.,1.", "0.,1.,1.")  # fmt: skip
CUBE = "".join(f"GRID,{k},,{x}\n" for k, x in enumerate(CORNERS, 1))
CUBE += "CHEXA,1,1,1,2,3,4,5,6\n,7,8\n"
SYSTEM = ("GRID,1,,", "GRID,1,3,")
test_what_is_wrong_with_a_card_is_named = changed(
    f"$\n{CUBE}", "deck.bdf", lambda path: nastran.read(str(path)),
    ("$\nGRID,1,,", "CORD2R,3,,0.,0.,0.,0.,0.,1.\n,0.,0.,2.\nGRID,1,3,", "on a line"),
    (*SYSTEM, "line 2: .* system 3 is not defined"),
    ("$\nGRID,1,,", "CORD1R,3,1,2,3\nGRID,1,3,", "3 is defined by itself"),
    ("GRID,2,", "GRID,1,", "node 1 is defined twice"),
    ("$\nGRID,1,,", "CORD1R,3,77,2,3\nGRID,1,3,", "node 77 is not defined"),
    ("5,6\n,7,8", "5,6,7,8", "11 fields; 9 are read"),
    ("5,6\n,7", "5,6,+A\n+B,7", r"'\+B', does not continue"),
    ("GRID,1,,", ",1,,", "does not continue"),
    (",7,8", ",7", "CHEXA is not read: it has 7 nodes, not 8 or 20"),
    ("CHEXA,1,1", "CHEXA,1,", "no property number"),
    ("GRID,1,,0.", "GRID,1,,O.", "line 2: .*'O.' is no finite number"),
    ("$", "MPC,1\nNSM,2\nMPC,4", r"MPC \(2, .*NSM \(1, .*rbe3.*Attachment"),
    ("$", "INCLUDE 'deck.bdf'", "include each other too deep"),
    error=RomError,
)  # fmt: skip
SAID = f"$\nBEGIN BULK\n{CUBE}PSOLID,1,4\nMAT1,4,210000.,,0.3,7.85-9\n"
# psi, lbf/in^3, over 386.089 in/s^2 before the bulk data
WEIGHED = (
    f" param, wtmass, 2.59008-3\n{SAID.replace('210000.,,0.3,7.85-9', '3.045792+7,,.3,.283599')}"
)
OF_RING = f"""{RING.replace("C3D8", "C3D8, ELSET=e")}*MATERIAL, NAME=STEEL\n*ELASTIC\n210., 0.3
*DENSITY\n7.85e-6,\n*SOLID SECTION, ELSET=e, MATERIAL=Steel\n"""


@pytest.mark.parametrize(("units", "name", "text"), [
    ("mm-t-s", "a.bdf", SAID), ("mm-kg-ms", "a.inp", OF_RING),
    ("mm-t-s", "a.bdf", SAID.replace("210000.,,0.3", "210000.,80769.2308,")),
    ("mm-t-s", "a.bdf", SAID.replace("210000.,,0.3", ",80769.2308,0.3")),
    ("in-lbf-s", "a.bdf", WEIGHED), ("in-lbf-s", "a.bdf", WEIGHED.replace("BEGIN BULK\n", "")),
])  # fmt: skip
def test_materials_of_decks_are_read_in_their_units(units, name, text, tmp_path):
    (tmp_path / name).write_text(text)
    (steel,) = read_mesh(tmp_path / name, units=units).solids().values()
    assert_allclose((steel.E, steel.nu, steel.rho), (210e9, 0.3, 7850.0), rtol=2e-5)
    refuses(rom.ConfigError, "scale", read_mesh, tmp_path / name, units=units, scale=2.0)
    refuses(FileFormatError, "unit", read_mesh(tmp_path / name, scale=0.1).solids)


test_materials_that_are_not_ours_are_refused_by_card = changed(
    SAID, "a.bdf", lambda path: read_mesh(path, units="mm-t-s").solids(),
    ("MAT1,4", "MAT9,4", r"MAT9 \(1, a.bdf line"), ("PSOLID,1,4", "PSOLID,1,5", "MAT1 5 is used"),
    ("MAT1,4", "MATT1,4,1\nMAT1,4", r"MATT1 \(1"), ("PSOLID,1", "PSOLID,2", "PSOLID 1 is used"),
    ("PSOLID,1,4", "PSOLID,1,4,,,,,PFLUID", r"PSOLID, PFLUID \(1"), (",7.85-9", "", "RHO = 0"),
    ("000.,,0.3", "000.,9.+4,0.3", "contradict"), ("210000.,,0.3", ",,0.3", "two of E, G and NU"),
    ("PSOLID", "MAT1,4,1.,,0.3,1.\nPSOLID", "MAT1 4 is defined twice"),
    ("$", "PARAM,WTMASS,1.\nPARAM,WTMASS,2.", "WTMASS has the values"),
)  # fmt: skip
test_laws_that_are_not_ours_are_refused_by_keyword = changed(
    OF_RING, "a.inp", lambda path: read_mesh(path, units="mm-kg-ms").solids(),
    ("*ELASTIC", "*ELASTIC, TYPE=ANISO", r"\*ELASTIC, TYPE=ANISO \(1"),
    (".3\n*D", ".3\n200., 0.3, 100.\n*D", r"\*ELASTIC, 2 rows \(1"),
    ("*DENSITY\n7.85e-6,\n", "", r"without \*DENSITY \(1"),
    ("*DENSITY", "*MATERIAL, NAME=Steel\n*ELASTIC\n1.\n*DENSITY", "twice"),
    ("*SOLID SECTION, ELSET=e, MATERIAL=Steel", "", rom.ConfigError, "'e'"),
)  # fmt: skip


@pytest.mark.fenicsx
def test_a_piece_of_a_ring_weighs_what_it_does(tmp_path):
    (tmp_path / "ring.inp").write_text(OF_RING)
    with pytest.warns(RomWarning, match="1 nodes belong to no solid .* 99; check"):
        model = rom.fe.model(tmp_path / "ring.inp", units="mm-kg-ms", degree=1)
    area = 0.5 * (0.1**2 - 0.08**2) * np.sin(np.radians(ARC))
    assert model.mass() == pytest.approx(7850e-9 * area * 0.03, rel=1e-12)


@pytest.mark.fenicsx
def test_a_deck_alone_makes_a_cantilever(tmp_path, caplog):
    """Two properties; what the user gives wins and is told. Euler-Bernoulli, 1.8751^2 = 3.516."""
    mesh = solid("hex8", (40, 1, 1), (1000.0, 50.0, 30.0))
    bulk = [f"GRID,{k},," + ",".join(f"{v:.9g}" for v in x) for k, x in enumerate(mesh.points, 1)]
    for k, row in enumerate((mesh.cells + 1).astype(str), 1):
        bulk += [f"CHEXA,{k},{1 + k % 2}," + ",".join(row[:6]), "," + ",".join(row[6:])]
    root = ",".join(str(k + 1) for k in np.unique(mesh.facets["root"]))
    bulk += [f"SPC1,7,123,{root}\nPSOLID,1,4\nPSOLID,2,5\nMAT1,4,210000.,,0.3,7.85-9"]
    (tmp_path / "a.bdf").write_text("\n".join([*bulk, "MAT1,5,210000.,,0.3,3.85-9"]))
    for given, rho in ({}, 5850.0), ({"material": STEEL}, 7850.0):
        model = rom.fe.model(tmp_path / "a.bdf", units="mm-t-s", **given)
        assert model.mass() == pytest.approx(0.0015 * rho, rel=1e-9)
        (first,) = rom.modes(model, 1, fixed=("spc_7",)).frequencies
        beam = 3.516 * 0.03 / (2 * np.pi) * np.sqrt(210e9 / (12 * rho))
        assert first == pytest.approx(beam, rel=0.01)
        assert ("takes the place" in caplog.text) == bool(given)


PART = "*PART, NAME=a\n" + RING.partition("*NODE\n")[0] + "*END PART\n"
ONE, TWO = ("*INSTANCE, NAME=a-1, PART=a\n*END INSTANCE\n", "*INSTANCE, NAME=a-2, PART=a\n")
TRUSS = "*ELEMENT, TYPE=T3D2, ELSET=e\n9, 1, 2\n"
SKIN = "*ELEMENT, TYPE=S4, ELSET=e\n9, 1, 2, 12, 11\n"
SECTION = "*SOLID SECTION, ELSET=e\n"
PARTS = {
    "two instances": (PART + ONE + TWO, "2 instances, 'a-1', 'a-2'"),
    "two parts": (PART + PART.replace("=a\n", "=b\n"), "2 parts, 'a', 'b'"),
    "a moved instance": (PART + TWO + "1., 0., 0.\n", r"moved \*INSTANCE \(1"),
    "a reference point": (PART + ONE + "*NODE\n1, 0., 0., 0.\n", r"\*NODE outside of the part"),
    "half a system": ("*SYSTEM\n1., 2., 3., 4., 5., 6.\n" + RING, "6 numbers instead of 0, 3 or 9"),
    "a flat system": ("*SYSTEM\n0., 0., 0., 1., 0., 0.\n2., 0., 0.\n" + RING, "on a line"),
    "a section of trusses": (RING + TRUSS + SECTION, "elements that are no solids: 9"),
    "a section of a skin": (RING + SKIN + SECTION, "elements that are no solids: 9"),
    "copies of nothing": (RING + "*ELGEN\n8, 3\n", "ring.inp, line .*element 8 is not defined"),
    "copies without end": (RING + "*ELGEN\n7, 99999999\n", r"\[99999999, 1, 1\] elements"),
    "an option": (RING + "*NODE, NSET=a, SHIFT=3\n", r"\*NODE, SHIFT \(1"),
}


@pytest.mark.parametrize("case", PARTS)
def test_what_is_wrong_with_a_keyword_is_named(case, tmp_path):
    text, message = PARTS[case]
    (tmp_path / "ring.inp").write_text(text)
    refuses(RomError, message, abaqus.read, str(tmp_path / "ring.inp"))


TURNED = CUBE.replace("GRID,2,,1.,0.,0.", "GRID,2,,1.,0.,0.,6")
TRANSFORM = "*TRANSFORM, NSET=root, TYPE=C\n0., 0., 0., 0., 0., 1.\n"


def test_nodes_of_matrices_whose_rows_are_turned_are_refused(tmp_path):
    for name, text, message in (("a.bdf", TURNED, "coordinate system 6 is not defined"),
        ("a.inp", RING + TRANSFORM, "TRANSFORM"), ("a.inp", RING + "*NFILL\n", "NFILL"),
    ):  # fmt: skip
        (tmp_path / name).write_text(text)
        refuses(FileFormatError, message, read_nodes, tmp_path / name)


def test_loads_and_supports_are_left_aside_and_told(tmp_path):
    (tmp_path / "a.bdf").write_text(CUBE + "FORCE,1,1,0,1.,1.,0.,0.\nFORCE,1,2,0,1.,1.,0.,0.\n")
    assert nastran.read(str(tmp_path / "a.bdf"))[1]["warnings"] == [
        "left aside, as a free body needs none of it: FORCE (2, a.bdf line 11)."
    ]
    (tmp_path / "a.inp").write_text(PART + ONE + "*STEP\n*STATIC\n*CLOAD\n1, 1, 5.\n*END STEP\n")
    _, notes = abaqus.read(str(tmp_path / "a.inp"))
    assert "none of it: *STEP (1, a.inp" in notes["warnings"][0]
    assert notes["facet_names"] == ["root"]


@contextmanager
def box_in_gmsh():
    """gmsh with the meshed box, its volume and one end named, in groups of the same number."""
    gmsh = pytest.importorskip("gmsh", reason="gmsh is not installed")
    with session(gmsh):
        gmsh.model.occ.addBox(0, 0, 0, *SIZE)
        gmsh.model.occ.synchronize()
        for dimension, name in ((3, "body"), (2, "root")):
            gmsh.model.addPhysicalGroup(dimension, [1], 1)
            gmsh.model.setPhysicalName(dimension, 1, name)
        gmsh.option.setNumber("Mesh.MeshSizeMin", 0.05)
        gmsh.model.mesh.generate(3)
        yield gmsh


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("ghosts", [0, 1])
def test_meshes_cut_for_several_processes_are_whole(version, ghosts, tmp_path):
    """Copies of the neighbours' cells and the cuts between the parts are no cells and no faces."""
    with box_in_gmsh() as gmsh:
        gmsh.option.setNumber("Mesh.PartitionCreateGhostCells", ghosts)
        gmsh.model.mesh.partition(2)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.write(str(tmp_path / "parts.msh"))
    mesh = read_mesh(tmp_path / "parts.msh")
    assert volume_and_centre(mesh.points, mesh.cells)[0] == pytest.approx(np.prod(SIZE))
    assert mesh.region_names == {1: "body"} and list(mesh.facets) == ["root"]
    assert (mesh.points[mesh.facets["root"], 0] == 0.0).all()


@pytest.mark.parametrize("form", ["bdf", "inp", "unv"])
@pytest.mark.parametrize("order", [1, 2])
def test_decks_of_gmsh_are_read(form, order, tmp_path):
    """It writes curves as CBAR or T3D2 without properties, and faces as plane elements."""
    with box_in_gmsh() as gmsh:
        gmsh.option.setNumber("Mesh.SaveAll", 1)
        gmsh.model.mesh.setOrder(order)
        if form == "unv":  # which has one number for all dimensions
            gmsh.model.removePhysicalGroups([(3, 1)])
        gmsh.write(str(tmp_path / f"box.{form}"))
    mesh = read_mesh(tmp_path / f"box.{form}")
    assert mesh.cell_type == ("tet4", "tet10")[order - 1]
    assert len(mesh.facets) == {"bdf": 6, "inp": 7, "unv": 1}[form]  # in .inp also by its group
    volume = volume_and_centre(mesh.points, mesh.cells)[0]
    assert volume == pytest.approx(np.prod(SIZE), rel=1e-5)
