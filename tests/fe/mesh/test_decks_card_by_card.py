"""Decks are read card by card: all of what they mean, or refused by the name of the card.

Random decks of a box are compared with its volume, centre and end face in closed form.
"""

from contextlib import contextmanager

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.files.random_decks import CARDS, KEYWORDS, SIZE, random_deck
from cases.long import few
from cases.refusals import refuses
from rom.decks.bulk import cards
from rom.errors import FileFormatError, RomError
from rom.fe.mesh.read import read_mesh
from rom.fe.mesh.sources import abaqus, nastran
from rom.fe.mesh.sources.gmsh_session import session
from rom.io.matrices.node_files import read_nodes

READERS = {"bdf": nastran.read, "inp": abaqus.read}
# corners of the six tetrahedra of a brick around its diagonal from 0 to 6
DIAGONAL = ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))


def volume_and_centre(points, cells):
    """Of straight cells, summed over tetrahedra."""
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
    _, points = read_nodes(path)  # with matrices of another program
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
    """Angles in degrees, of a sphere from z and then around it; blank fields are those of GRDSET.

    Node 101 lies on y, 102 on -x, 103 on z of a system at (1, 0, 0); through 101 and 102 runs z of
    the next one, -(1, 1, 0) / sqrt(2), and its x is the basic z.
    """
    (tmp_path / "s.bdf").write_text(SPHERE + "GRID,1,,1.,0.,2.\nGRID,2,0,1.,0.,2.\n")
    labels, points = read_nodes(tmp_path / "s.bdf")
    found = dict(zip(labels.tolist(), points, strict=True))
    assert_allclose(found[101], [1, 2, 0], atol=1e-14)
    assert_allclose(found[102], [-1, 0, 0], atol=1e-14)
    assert_allclose(found[103], [1, 0, 5], atol=1e-14)
    assert_allclose(found[2], [1, 0, 2])
    z = -np.array([1, 1, 0]) / np.sqrt(2)
    x = np.array([0, -2, 5]) - (np.array([0, -2, 5]) @ z) * z
    assert_allclose(found[1], [1, 2, 0] + x / np.linalg.norm(x) + 2 * z)


EIGHT = ["1", "2", "3", "4", "5", "6", "7", "8"]
FORMS = {  # what is written, the fields it means
    "narrow": ("CHEXA   1       2       3       4       5       6       7       8", EIGHT),
    "right": (f"CHEXA   {1:8}{2:8}{3:8}{4:8}{5:8}{6:8}{7:8}{8:8}", EIGHT),
    "free": ("chexa, 1,2 , 3,4,5,6,7,8", EIGHT),
    "tabs": ("CHEXA\t1\t2\t3\t4\t5\t6\t7\t8", EIGHT),
    "wide": (f"CHEXA*  {1:<16}{2:<16}{3:<16}{4:<16}*A\n*A      {5:16}{6:16}{7:16}{8:16}", EIGHT),
    "wide and free": ("CHEXA*,1,2,3,4,*\n*,5,6,7,8", EIGHT),
    "half a wide one": ("CHEXA*,1,2,3,4\n+,9", [*EIGHT[:4], "", "", "", "", "9"]),
    "named": (
        "CHEXA   1       2       3       4       5       6       7       8       +X1\n+X1,9",
        [*EIGHT, "9"],
    ),
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


def test_a_piece_of_a_ring_weighs_what_it_does(tmp_path):
    (tmp_path / "ring.inp").write_text(RING)
    steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
    pytest.importorskip("dolfinx", reason="dolfinx is not installed")
    with pytest.warns(rom.errors.RomWarning, match="1 nodes belong to no solid .* 99; check"):
        model = rom.fe.model(tmp_path / "ring.inp", material=steel, degree=1)
    area = 0.5 * (0.1**2 - 0.08**2) * np.sin(np.radians(ARC))
    assert model.mass() == pytest.approx(7850 * area * 0.03, rel=1e-12)


CUBE = "".join(
    f"GRID,{k + 1},,{x}.,{y}.,{z}.\n"
    for k, (x, y, z) in enumerate(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    )
)
CUBE += "CHEXA,1,1,1,2,3,4,5,6\n,7,8\n"
IN_SYSTEM, UNCHANGED = ("GRID,1,,", "GRID,1,3,"), ("", "")
FAULTS = {  # what is put in front, what is put in the place of what, what is said
    "a flat system": ("CORD2R,3,,0.,0.,0.,0.,0.,1.\n,0.,0.,2.\n", *IN_SYSTEM, "on a line"),
    "no system": ("", *IN_SYSTEM, r"deck.bdf, line 1: .* system 3 is not defined"),
    "a system of itself": ("CORD1R,3,1,2,3\n", *IN_SYSTEM, "3 is defined by itself"),
    "a node twice": ("", "GRID,2,", "GRID,1,", "node 1 is defined twice"),
    "a node for a system": ("CORD1R,3,77,2,3\n", *IN_SYSTEM, "node 77 is not defined"),
    "a long line": ("", "5,6\n,7,8", "5,6,7,8", "11 fields; 9 are read"),
    "a foreign continuation": ("", "5,6\n,7", "5,6,+A\n+B,7", r"'\+B', does not continue"),
    "no card": ("", "GRID,1,,", ",1,,", "does not continue"),
    "seven nodes": ("", ",7,8", ",7", "CHEXA is not read: it has 7 nodes, not 8 or 20"),
    "no property": ("", "CHEXA,1,1", "CHEXA,1,", "no property number"),
    "words": ("", "GRID,1,,0.", "GRID,1,,O.", r"deck.bdf, line 1: .*'O.' is no finite number"),
    "all at once": (
        "RBE3,1\nCONM2,2\nRBE3,4\n",
        *UNCHANGED,
        r"RBE3 \(2, .*CONM2 \(1, .*rbe3.*Attachment",
    ),
    "a lost file": ("INCLUDE 'gone.blk'\n", *UNCHANGED, "gone.blk: there is no such file"),
    "itself": ("INCLUDE 'deck.bdf'\n", *UNCHANGED, "include each other too deep"),
}


@pytest.mark.parametrize("case", FAULTS)
def test_what_is_wrong_with_a_card_is_named(case, tmp_path):
    front, old, new, message = FAULTS[case]
    assert old in CUBE
    (tmp_path / "deck.bdf").write_text(front + CUBE.replace(old, new))
    refuses(RomError, message, nastran.read, str(tmp_path / "deck.bdf"))


PART = "*PART, NAME=a\n" + RING.partition("*NODE\n")[0] + "*END PART\n"
ONE, TWO = ("*INSTANCE, NAME=a-1, PART=a\n*END INSTANCE\n", "*INSTANCE, NAME=a-2, PART=a\n")
PARTS = {
    "two instances": (PART + ONE + TWO, "2 instances, 'a-1', 'a-2'"),
    "two parts": (PART + PART.replace("=a\n", "=b\n"), "2 parts, 'a', 'b'"),
    "a moved instance": (PART + TWO + "1., 0., 0.\n", r"moved \*INSTANCE \(1"),
    "a reference point": (PART + ONE + "*NODE\n1, 0., 0., 0.\n", r"\*NODE outside of the part"),
    "half a system": ("*SYSTEM\n1., 2., 3., 4., 5., 6.\n" + RING, "6 numbers instead of 0, 3 or 9"),
    "a flat system": ("*SYSTEM\n0., 0., 0., 1., 0., 0.\n2., 0., 0.\n" + RING, "on a line"),
    "a section of trusses": (
        RING + "*ELEMENT, TYPE=T3D2, ELSET=bar\n9, 1, 2\n*SOLID SECTION, ELSET=bar\n",
        "elements that are no solids: 9",
    ),
    "a section of a skin": (
        RING + "*ELEMENT, TYPE=S4, ELSET=skin\n9, 1, 2, 12, 11\n*SOLID SECTION, ELSET=skin\n",
        "elements that are no solids: 9",
    ),
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
ROWS = [("a.bdf", TURNED, "nodes 2 move along axes"), ("a.inp", RING + TRANSFORM, "TRANSFORM"),
        ("a.inp", RING + "*NFILL\n", "NFILL")]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "message"), ROWS)
def test_nodes_of_matrices_whose_rows_are_turned_are_refused(name, text, message, tmp_path):
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


@pytest.mark.parametrize("form", ["bdf", "inp"])
@pytest.mark.parametrize("order", [1, 2])
def test_decks_of_gmsh_are_read(form, order, tmp_path):
    """It writes curves as CBAR or T3D2 without properties, and faces as plane elements."""
    with box_in_gmsh() as gmsh:
        gmsh.option.setNumber("Mesh.SaveAll", 1)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(tmp_path / f"box.{form}"))
    arrays, notes = READERS[form](str(tmp_path / f"box.{form}"))
    assert notes["cell_type"] == ("tet4", "tet10")[order - 1]
    assert len(notes["facet_names"]) == {"bdf": 6, "inp": 7}[form]  # in .inp also by its group
    volume = volume_and_centre(arrays["points"], arrays["cells"])[0]
    assert volume == pytest.approx(np.prod(SIZE), rel=1e-5)
