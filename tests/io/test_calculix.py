"""Matrices that CalculiX writes, and linear user elements, become models and come back.

The files reference/foreign/calculix.* were written by CalculiX 2.20 (Debian's calculix-ccx) from
the deck among them: six C3D4 elements of a block, its nodes numbered out of order, one node left
over. The .mtx is its *SUBSTRUCTURE MATRIX OUTPUT of nodes 12 (1 to 3) and 55 (1, 2).

Where CalculiX is installed it gets the same mesh: stiffness agrees to round-off. It takes the mass
with the Gauss points of the stiffness (one for C3D4, four for C3D10), which are exact for
polynomials of degree 1 and 2 instead of 2 and 4: with that quadrature the mass agrees to round-off
too, and with ours frequencies differ.
"""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import eigh
from scipy.spatial import cKDTree

import rom
from cases.command import ran
from cases.files.cells import solid, tetrahedra
from cases.files.damage import changed
from cases.files.decks import BY_HAND
from cases.long import few
from cases.paths import ROOT, TESTS
from cases.refusals import refused, refuses
from cases.solid import STEEL, block, reduced
from rom.cli.main import main
from rom.errors import ConfigError, FileFormatError, MeshError, TagError
from rom.fe.mesh.input_deck import input_deck
from rom.fe.mesh.read import read_mesh
from rom.io.matrices.matrix_files import read_matrix, read_stored_matrix
from rom.io.matrices.node_files import read_nodes
from rom.io.matrices.user_element import read_user_element, write_user_element
from rom.io.programs.interface_form import interface_form

HERE = TESTS / "reference" / "foreign"
LABELS = np.array([12, 3, 40, 7, 101, 55, 20, 60])  # of the corners, z fastest


def six_tetrahedra():
    """Textbook matrices of the block, rows in ascending order of labels, mass at one point."""
    X = np.array([[x, y, z] for x in (0, 0.3) for y in (0, 0.2) for z in (0, 0.1)])
    cells = tetrahedra(np.array([[0, 4, 6, 2, 1, 5, 7, 3]]))
    K, M = np.zeros((24, 24)), np.zeros((24, 24))
    for cell in cells:
        T = np.column_stack([np.ones(4), X[cell]])
        volume, (gx, gy, gz) = abs(np.linalg.det(T)) / 6, np.linalg.inv(T)[1:]
        B = np.zeros((6, 4, 3))
        B[0, :, 0], B[1, :, 1], B[2, :, 2] = gx, gy, gz
        B[3, :, 1], B[3, :, 2] = gz, gy
        B[4, :, 0], B[4, :, 2] = gz, gx
        B[5, :, 0], B[5, :, 1] = gy, gx
        B = B.reshape(6, 12)
        rows = (3 * np.argsort(np.argsort(LABELS))[cell][:, None] + np.arange(3)).ravel()
        K[np.ix_(rows, rows)] += volume * B.T @ STEEL.stiffness @ B
        M[np.ix_(rows, rows)] += STEEL.rho * volume / 16 * np.kron(np.ones((4, 4)), np.eye(3))
    return K, M


def stored(**other):
    given = {"nodes": HERE / "calculix.inp", "interfaces": ["root", "tip"]} | other
    return rom.read_model(HERE / "calculix.sti", HERE / "calculix.mas", **given)


def test_stored_matrices_are_those_of_the_elements_and_so_are_frequencies_and_substructures():
    """The node 5 of the deck belongs to no element and is left out."""
    model = stored()
    for found, expected in zip((model.K, model.M), six_tetrahedra(), strict=True):
        assert_allclose(found.toarray(), expected, atol=1e-12 * np.abs(expected).max())
    assert model.mass() == pytest.approx(0.3 * 0.2 * 0.1 * 7850.0, rel=1e-12)
    root = model.interfaces["root"]
    assert_array_equal(np.sort(LABELS)[root.nodes], [12, 3, 40, 7])  # by coordinates
    assert_allclose(root.origin, [0.0, 0.1, 0.05])
    unknown = r"'loose' needs nodes of the model; unknown are \[5\]"
    refuses(rom.RomError, unknown, stored, interfaces={"loose": [5]})
    # one point per element leaves the mass singular: the highest frequencies are infinite
    K, M = six_tetrahedra()
    free = np.isin(np.repeat(np.sort(LABELS), 3), LABELS[4:])
    mu = eigh(M[np.ix_(free, free)], K[np.ix_(free, free)], eigvals_only=True)[:-5:-1]
    found = rom.modes(model, 4, fixed=("root",)).frequencies
    assert_allclose(found, 1 / np.sqrt(mu) / (2 * np.pi), rtol=1e-9)
    # version 2.20 does not condense: a substructure is rows and columns of the stiffness
    found = read_matrix(HERE / "calculix.mtx")
    assert_array_equal(found.dofs, [[12, 1], [12, 2], [12, 3], [55, 1], [55, 2]])
    rows = [np.searchsorted(np.sort(LABELS), n) * 3 + c - 1 for n, c in found.dofs]
    expected = np.tril(K[np.ix_(rows, rows)])
    assert_allclose(found.A.toarray(), expected, atol=1e-12 * np.abs(expected).max())


def test_components_hold_until_others_are_given(tmp_path):
    """Columns of the upper triangle, four numbers to a line wherever the columns end."""
    path = tmp_path / "a.mtx"
    path.write_text(BY_HAND)
    A, dofs = read_user_element(path)["STIFFNESS"]
    assert_array_equal(dofs[:, 0], [9, 9, 9, 4, 4, 4, 30, 31])
    assert_array_equal(dofs[:, 1], [1, 2, 6, 1, 2, 6, 1, 1])
    upper = A.toarray().T
    assert_array_equal(upper[:3, :3], [[1, 2, 4], [0, 3, 5], [0, 0, 6]])
    assert_array_equal(upper[:, 7], np.arange(29, 37))
    path.write_text(BY_HAND.replace("** ELEMENT NODES\n** 9, 4,\n** 30, 31\n", ""))
    assert_array_equal(read_matrix(path).dofs[:, 0], [1, 1, 1, 2, 2, 2, 3, 4])


def test_a_body_goes_to_abaqus_and_comes_back(tmp_path):
    body = reduced(3, block(cells=(4, 1, 1)))
    form = interface_form(body)
    path = rom.export(body, tmp_path / "rod.inp")
    for name, A in (("stiffness", form.K), ("MASS", form.M)):
        found = read_matrix((path, name))
        assert_allclose(found.A.toarray(), np.tril(A), rtol=1e-13)
        assert_array_equal(found.dofs, np.where(form.dofs == 0, 1, form.dofs))
    refuses(ConfigError, "Name one", read_matrix, path)
    labels, points, _ = read_nodes(path)
    assert_array_equal(labels, [1, 2, 1001, 1002, 1003])
    assert_allclose(points[:2], [form.points[1], form.points[2]], atol=1e-15)
    lines = path.read_text().splitlines()
    assert lines[lines.index("** 1003") + 1 :][:3] == [
        "1, 2, 3, 4, 5, 6", "3, 1", "*MATRIX, TYPE=STIFFNESS"]  # fmt: skip
    # readers of such files put the comments together: a line that goes on ends in a comma
    comments = "".join(line[2:] for line in lines if line.startswith("**")).split("NODES")[1]
    assert [int(word) for word in comments.split(",")] == [1, 2, 1001, 1002, 1003]
    mixed = {"MASS": np.eye(3)}, [[1, 1], [2, 1], [1, 2]], path
    refuses(ConfigError, "node by node", write_user_element, *mixed, nodes={})


test_a_damaged_user_element_is_named = changed(
    BY_HAND,
    "a.mtx",
    read_user_element,
    ("LINEAR", "UNSYMM", "line 3: .*not linear and symmetric"),
    ("NODES=4", "NODES=x", "line 3: this is no user element"),
    ("NODES=4", "NODES=5", "4 nodes are named, but the element has 5"),
    ("NODES=4", "NODES=1", "line 8: .*places ascend up to NODES"),
    ("NODES=4", "NODES=999999999", rom.UnsafeFileError, "999999999 nodes"),
    ("1, 2, 6", "1, 2, 7", "line 7: .*components are 1 to 6"),
    ("3, 1\n", "1, 3\n", "line 8: .*places ascend"),
    ("30, 31", "30, 30", "a component of a node comes twice"),
    ("33., 34.", "33.", "has 35 numbers; the upper triangle of 8 rows has 36"),
    ("8.D0", "8,D0", "line 11: this is no user element"),
    ("36.", "inf", "line 18: .*no finite number"),
    ("*Matrix", "*other", "no linear user element with matrices"),
    ("1, 9, 4, 30, 31\n", BY_HAND, "line 22: .*second one"),
    ("36.\n", "36.\n*MATRIX, TYPE=STIFFNESS\n1.\n", "two matrices 'STIFFNESS'"),
)


def copied(tmp_path, ending, change):
    for part in (".sti", ".dof"):
        shutil.copy(HERE / f"calculix{part}", tmp_path)
    path = tmp_path / f"calculix{ending}"
    path.write_text(change(path.read_text()))
    return tmp_path / "calculix.sti"


DAMAGED = [
    (".sti", lambda t: t[:-30], r"calculix\.sti: the last line is cut"),
    (".sti", lambda t: "", r"calculix\.sti: the file is empty"),
    (".sti", lambda t: t[: t.rindex("\n", 0, -1) + 1], "1 of 24 diagonal entries are missing"),
    (".sti", lambda t: t + t.splitlines()[4] + "\n", "1 entries come twice"),
    (".sti", lambda t: t.replace("\n1 3 ", "\n1 3.5 ", 1), r"sti, line 4: rows and columns"),
    (".sti", lambda t: t.replace("\n1 3 ", "\n1 33 ", 1), "line 4: rows and columns are 1 to"),
    (".sti", lambda t: t.replace("\n1 3 ", "\n1 x ", 1), "line 4: an entry is row, column"),
    (".sti", lambda t: t.replace("\n1 3 ", "\n3 ", 1), "line 4: an entry is row, column"),
    (".dof", lambda t: t[:-1], r"calculix\.dof: the last line is cut"),
    (".dof", lambda t: t[:-6], r"line \d+: rows and columns are 1 to 23"),
    (".dof", lambda t: t.replace("7.2", "7.0"), r"dof, line 5: a row is node\.component"),
    (".dof", lambda t: t.replace("7.2", "7.1"), "7.1 is listed twice"),
    # component 10 of a node would be read as 1 if the label were a number
    (".dof", lambda t: t.replace("7.1\n", "7.10\n"), r"a row is node\.component"),
]


@pytest.mark.parametrize(("ending", "change", "message"), DAMAGED)
def test_damaged_matrices_are_named(ending, change, message, tmp_path):
    refuses(FileFormatError, message, read_stored_matrix, copied(tmp_path, ending, change))


def test_a_missing_part_is_named(tmp_path):
    path = shutil.copy(HERE / "calculix.sti", tmp_path)
    refuses(FileFormatError, r"calculix\.dof: there is no such file", read_matrix, path)
    nan = copied(tmp_path, ".sti", lambda t: t.replace("2.1314102564103e+10", "nan"))
    refuses(FileFormatError, "a number is not finite", read_matrix, nan)


BEAM = {"path": str(ROOT / "meshes" / "beam.geo"), "parameters": {"L": 0.3, "lc": 0.04}}
WOOD = rom.Orthotropic(
    E=(12e9, 0.9e9, 0.5e9), nu=(0.35, 0.4, 0.3), G=(0.8e9, 0.7e9, 0.1e9), rho=500.0,
    axes=((0.6, 0.8, 0.0), (-0.8, 0.6, 0.0), (0.0, 0.0, 1.0)),
)  # fmt: skip
GAUSS = {1: 1, 2: 2}  # degree of the displacement: what CalculiX's points of the mass are exact for
NO_CCX = "CalculiX (ccx, Debian's calculix-ccx) is not installed"
needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason=NO_CCX)


def run(folder, deck, n_warnings=0):
    (folder / "job.inp").write_text(deck)
    done = ran("ccx", "job", cwd=folder, timeout=600)
    assert done.returncode == 0, done.stdout[-2000:]
    assert done.stdout.count("*WARNING") == n_warnings, done.stdout[-2000:]
    return (folder / "job.dat").read_text()


def frequencies(text):
    """(m,) the fourth column of the table [Hz], seven digits."""
    rows = [line.split() for line in text.partition("P A R T I C I P")[0].splitlines()]
    return np.array([float(row[3]) for row in rows if len(row) == 5 and row[0].isdecimal()])


@pytest.fixture(scope="module")
def beam():
    return read_mesh(**BEAM)


@pytest.fixture
def same_quadrature(monkeypatch):
    """Assembly here takes the mass as CalculiX does."""
    from rom.fe.forms import region

    monkeypatch.setattr(region, "_mass_degree", lambda _mesh, degree: GAUSS[degree])


def model(degree, material=STEEL):
    return rom.fe.model(**BEAM, material=material, degree=degree)


def by_calculix(folder, deck):
    """The model of the matrices that CalculiX makes of a deck."""
    run(folder, deck)
    files = (folder / f"job.{ending}" for ending in ("sti", "mas"))
    return rom.read_model(*files, nodes=folder / "job.inp", interfaces=["root", "tip"])


def order(theirs, ours):
    """(n,) dofs of a model in the order of another one with the same nodes."""
    apart, node = cKDTree(ours.points).query(theirs.points)
    assert apart.max() < 1e-13 and len(set(node)) == len(node)
    return (3 * node[:, None] + np.arange(3)).ravel()


def difference(A, B):
    return abs(A - B).max() / abs(B).max()


@needs_ccx
@pytest.mark.fenicsx
@pytest.mark.filterwarnings("ignore:.*linear tetrahedra lock")
@pytest.mark.parametrize(("degree", "material"), few(1, [(2, WOOD), (1, STEEL), (2, STEEL)]))
def test_stiffness_and_mass_are_equal(beam, degree, material, same_quadrature, tmp_path):
    deck = input_deck(beam, material=material, degree=degree, step="matrices")
    theirs = by_calculix(tmp_path, deck)
    ours = model(degree, material)
    p = order(theirs, ours)
    assert difference(theirs.K, ours.K[p][:, p]) < 1e-12
    assert difference(theirs.M, ours.M[p][:, p]) < 1e-12
    for name, interface in theirs.interfaces.items():
        assert_allclose(interface.points, ours.interfaces[name].points, atol=1e-14)


@needs_ccx
@pytest.mark.fenicsx
@pytest.mark.filterwarnings("ignore:.*linear tetrahedra lock")
@pytest.mark.parametrize("fixed", [(), ("root",)])
@pytest.mark.parametrize(("degree", "apart"), few(1, [(2, 2e-3), (1, 0.15)]))
def test_ten_frequencies_are_equal(beam, degree, apart, fixed, same_quadrature, tmp_path):
    """To the seven digits printed; exact mass moves them by less than `apart`, never up."""
    n_rigid = 0 if fixed else 6
    deck = input_deck(beam, material=STEEL, degree=degree, fixed=fixed, n_modes=n_rigid + 10)
    theirs = frequencies(run(tmp_path, deck))[n_rigid:]
    assert theirs.size == 10
    ours = rom.modes(model(degree), n_rigid + 10, fixed=fixed).frequencies[n_rigid:]
    assert_allclose(ours, theirs, rtol=1e-6)
    with pytest.MonkeyPatch.context() as patch:
        from rom.fe.forms import region

        patch.setattr(region, "_mass_degree", lambda *_: 2 * degree)
        exact = rom.modes(model(degree), n_rigid + 10, fixed=fixed).frequencies[n_rigid:]
    assert (exact < theirs).all() and 1e-5 < (theirs / exact - 1).max() < apart


@needs_ccx
@pytest.mark.fenicsx
def test_a_body_of_their_matrices_is_a_body_of_ours(beam, same_quadrature, tmp_path):
    theirs = by_calculix(tmp_path, input_deck(beam, material=STEEL, step="matrices"))
    bodies = [reduced(6, m, certify=m is theirs) for m in (theirs, model(2))]
    rows = bodies[0].certificate.rows
    assert all(row.ok for row in rows if "reduced never below" in row.quantity)
    for fixed in ((), ("root",), ("root", "tip")):
        f, expected = (body.frequencies(6, fixed=fixed) for body in bodies)
        assert_allclose(f, expected, rtol=1e-9)
    assert_allclose(bodies[0].inertia, bodies[1].inertia, rtol=1e-9, atol=1e-12)


@needs_ccx
@pytest.mark.fenicsx
def test_guyan_stiffness_is_the_reaction_to_unit_motions(beam, tmp_path):
    """The tip moves as a rigid body by a unit along x, y, z; root held."""
    head, step = input_deck(beam, material=STEEL, fixed=("root",)).split("*STEP\n")
    assert step.startswith("*FREQUENCY")
    deck = head
    for row in np.eye(3):
        moved = "".join(f"tip, {axis}, {axis}, {u}\n" for axis, u in enumerate(row, 1))
        deck += f"*STEP\n*STATIC\n*BOUNDARY\n{moved}"
        deck += "*NODE PRINT, NSET=tip, TOTALS=ONLY\nRF\n*END STEP\n"
    lines = run(tmp_path, deck).splitlines()
    totals = [k + 2 for k, line in enumerate(lines) if "total force" in line]
    reactions = np.array([lines[k].split() for k in totals], dtype=float)
    expected = interface_form(reduced(0, model(2))).K[6:9, 6:9]
    assert_allclose(reactions, expected, rtol=1e-6, atol=2e-6 * expected.max())


@needs_ccx
@pytest.mark.fenicsx
def test_a_substructure_is_not_condensed(beam, tmp_path):
    """CalculiX 2.20 writes rows and columns of the stiffness; a cure there will be seen here."""
    head = input_deck(beam, material=STEEL).split("*STEP\n")[0]
    corners = "*NSET, NSET=corners\n1, 2, 5, 6\n"
    step = ("*STEP\n*SUBSTRUCTURE GENERATE\n*RETAINED NODAL DOFS, SORTED=NO\ncorners, 1, 3\n"
            "*SUBSTRUCTURE MATRIX OUTPUT, STIFFNESS=YES, OUTPUT FILE=USER DEFINED, FILE NAME=part\n"
            "*END STEP\n")  # fmt: skip
    run(tmp_path, head + corners + step)
    found = read_matrix(tmp_path / "part.mtx")
    assert_array_equal(found.dofs[:, 0], np.repeat([1, 2, 5, 6], 3))
    ours = model(2)
    _, node = cKDTree(ours.points).query(beam.points[found.dofs[:, 0] - 1])
    rows = 3 * node + found.dofs[:, 1] - 1
    K_bb = ours.K[rows][:, rows].toarray()
    assert_allclose(found.A.toarray(), np.tril(K_bb), atol=1e-11 * np.abs(K_bb).max())


@needs_ccx
@pytest.mark.fenicsx
def test_the_command_line_goes_to_calculix_and_back(tmp_path, capsys, same_quadrature):
    steel = ("--E", "210e9", "--nu", "0.3", "--rho", "7850")
    mesh = (BEAM["path"], "-p", "L=0.3", "-p", "lc=0.04", *steel)
    assert main(["mesh", *mesh, "--save", str(tmp_path / "job.inp")]) == 0
    run(tmp_path, (tmp_path / "job.inp").read_text())
    files = [str(tmp_path / f"job{ending}") for ending in (".sti", ".mas", ".inp")]
    theirs = [files[0], "--mass", files[1], "--nodes", files[2]]
    capsys.readouterr()
    found = []
    for words in (theirs, mesh):
        assert main(["modes", *words, "--fixed", "root", "-n", "5", "--json"]) == 0
        found.append(json.loads(capsys.readouterr().out)["frequencies"])
    assert_allclose(*found, rtol=1e-9)


@pytest.mark.parametrize("kind", ["tet4", "tet10"])
def test_a_deck_is_read_back(kind, tmp_path):
    mesh = solid(kind, (2, 1, 1))
    points = mesh.points + 0.02 * np.sin(3 * mesh.points[:, [1, 2, 0]])
    facets = mesh.facets | {"lower half": mesh.facets["root"][:1]}
    mesh = replace(mesh, points=points, regions=np.arange(len(mesh.cells)) // 6 + 1,
                   region_names={1: "left", 2: "right"}, facets=facets)  # fmt: skip
    refuses(TagError, "'lower half' is no name", input_deck, mesh)
    mesh.facets["lower_half"] = mesh.facets.pop("lower half")
    path = tmp_path / "box.inp"
    path.write_text(input_deck(mesh, degree=1 if kind == "tet4" else 2))
    assert max(len(word) for word in path.read_text().replace("\n", ",").split(",")) <= 40
    found = read_mesh(path)
    assert found.cell_type == kind and list(found.region_names.values()) == ["left", "right"]
    assert_allclose(found.points[found.cells], mesh.points[mesh.cells], atol=1e-12)
    assert_array_equal(found.regions, mesh.regions)
    for name, rows in mesh.facets.items():
        same = [np.sort(x.points[f], axis=1).sum(axis=1) for x, f in
                ((found, found.facets[name]), (mesh, rows))]  # fmt: skip
        assert_allclose(*(x[np.lexsort(x.T)] for x in same), atol=1e-12)


def test_mid_edge_nodes_are_added_and_numbers_fit():
    """CalculiX reads no number beyond 20 characters."""
    mesh = solid("tet4", (1, 1, 1), (-1e-17, 1.0, 1.0))
    text = input_deck(mesh)
    nodes = text.split("*NODE\n")[1].split("*")[0].splitlines()
    assert len(nodes) == 27  # 8 corners, 12 + 6 edges and diagonals, one across
    assert max(len(word) for line in nodes for word in line.split(", ")) == 20
    assert "C3D10" in text and "*MATERIAL" not in text and "*STEP" not in text


def deck_of(kind="tet4", more=(), **options):
    mesh = solid(kind)
    other = {name: mesh.facets[old] for name, old in more}
    return lambda: input_deck(replace(mesh, facets=mesh.facets | other), **options)


test_what_a_deck_cannot_say_is_named = refused(
    (deck_of(step="static"), ConfigError, "none of 'frequencies', 'matrices'"),
    (deck_of(fixed=["bore"]), rom.InterfaceError, r"'bore' cannot be held; .*\['root', 'tip'\]"),
    (deck_of(degree=3), ConfigError, "degree = 3"),
    (deck_of("hex8"), MeshError, "hex8 have other shape functions"),
    (deck_of("tet10", degree=1), MeshError, "curved edges"),
    (deck_of(more=[("TIP", "root")]), TagError, "'TIP' names two sets"),
)


TIP = "*NODE\n9001, .45, .02, .01\n9002, .45, .02, .01\n*RIGID BODY, NSET=tip, REF NODE=9001, "
TIP += "ROT NODE=9002\n*ELEMENT, TYPE=MASS, ELSET=m\n9001, 9001\n*MASS, ELSET=m\n200.\n"


@pytest.mark.fenicsx
@needs_ccx
def test_a_cantilever_with_a_tip_mass_vibrates_alike_in_calculix_and_in_the_textbook(tmp_path):
    """The tip mass outweighs that of the elements, for which CalculiX takes fewer Gauss points."""
    size = (0.4, 0.04, 0.03)
    deck = input_deck(solid("tet4", (8, 1, 1), size), material=STEEL, fixed=("root",), n_modes=3)
    deck = deck.replace("*STEP", f"{TIP}*STEP")
    expected = frequencies(run(tmp_path, deck, n_warnings=1))[:3]  # a mass has no E
    model = rom.fe.model(tmp_path / "job.inp")
    found = rom.modes(model, 3, fixed=("root",)).frequencies
    assert_allclose(found, expected, rtol=2e-4)
    central = deck.replace(".45, .02, .01", ".4, .02, .015")
    (tmp_path / "central.inp").write_text(central)
    found = rom.modes(rom.fe.model(tmp_path / "central.inp"), 1, fixed=("root",)).omega[0]
    length, width, height = size
    stiffness = 3 * STEEL.E * width * height**3 / 12 / length**3
    beam = STEEL.rho * length * width * height
    assert found == pytest.approx(np.sqrt(stiffness / (200.0 + 33 / 140 * beam)), rel=0.02)
