"""Matrices and nodes of other programs become a model that reduces like the one they came from.

The files in reference/foreign were written by pyyeti 1.4.7 (op4.write with 16 digits in each of
its forms, bulk.wtdmig, bulk.wtgrids) from the block below, its nodes numbered out of order; those
with six rows for each node have zeros for the rotations.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.io import loadmat, mmread, mmwrite
from scipy.sparse import csr_matrix

import rom
from cases.files.decks import DECK
from cases.paths import TESTS
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.decks.lines import real
from rom.errors import ConfigError, FileFormatError, ModelError, QualityGateError, UnsafeFileError
from rom.io.matrices.dmig import read_dmig, read_grids, write_dmig
from rom.io.matrices.matrix_files import read_matrix, write_abaqus_matrix
from rom.io.matrices.op4 import read_op4, write_op4
from rom.io.matrices.read_model import read_model
from rom.io.programs.interface_form import interface_form

HERE = TESTS / "reference" / "foreign"
LABELS = np.array([7, 3, 12, 20, 101, 55, 41, 60])  # of the nodes of the block
SIDES = {"root": [7, 3, 12, 20], "tip": [60, 101, 41, 55]}


@pytest.fixture(scope="module")
def brick():
    return block(size=(0.3, 0.2, 0.1), cells=(1, 1, 1))


def by_label(A):
    order = (3 * np.argsort(LABELS)[:, None] + np.arange(3)).ravel()
    return A.toarray()[np.ix_(order, order)]


def with_rotations(A):
    return np.pad(A.reshape(8, 3, 8, 3), [(0, 0), (0, 3)] * 2).reshape(48, 48)


@pytest.mark.parametrize(
    ("file", "name", "six"),
    [("dense.op4", "KAA", False), ("dense.op4", "MAA", False), ("bigmat_text.op4", "MAA", True),
     ("nonbigmat_text.op4", "MAA", True), ("dense_binary.op4", "KAA", True),
     ("bigmat_binary.op4", "MAA", True), ("nonbigmat_binary.op4", "MAA", True)],
)  # fmt: skip
def test_every_form_of_output4_is_read(brick, file, name, six):
    A = by_label(brick.K if name == "KAA" else brick.M)
    expected = with_rotations(A) if six else A
    found = read_op4(HERE / file)[name].toarray()
    assert_allclose(found, expected, rtol=1e-14, atol=1e-13 * np.abs(expected).max())


def test_punched_matrices_and_grids_are_read(brick):
    found = read_dmig(HERE / "brick.dmig")
    K, dofs = found["KAA"]
    assert_array_equal(dofs[:, 0], np.repeat(np.sort(LABELS), 3))
    lower = np.tril(by_label(brick.K))
    assert_allclose(K.toarray(), lower, atol=1e-9 * np.abs(lower).max())
    labels, points, _ = read_grids(HERE / "brick.bdf")
    assert_array_equal(labels, np.sort(LABELS))
    assert_allclose(points, brick.points[np.argsort(LABELS)])


SOURCES = {
    "op4": ((HERE / "dense.op4", "kaa"), (HERE / "dense.op4", "maa")),
    "six rows": (HERE / "dense_binary.op4", HERE / "bigmat_binary.op4"),
    "dmig": ((HERE / "brick.dmig", "kaa"), (HERE / "brick.dmig", "maa")),
}


@pytest.mark.parametrize("case", SOURCES)
def test_a_model_from_files_reduces_like_its_origin(brick, case):
    K, M = SOURCES[case]
    model = read_model(K, M, nodes=HERE / "brick.bdf", interfaces=SIDES)
    assert model.mass() == pytest.approx(brick.mass(), rel=1e-8)
    for name, interface in model.interfaces.items():
        ours = brick.interfaces[name]
        assert_allclose(interface.points, ours.points[np.lexsort(ours.points.T[::-1])])
    bodies = [reduced(0, m) for m in (model, brick)]
    f, expected = (body.frequencies(fixed=("root",)) for body in bodies)
    assert_allclose(f, expected, rtol=1e-7)
    assert_allclose(bodies[0].inertia, bodies[1].inertia, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("whole", [True, False])
def test_market_and_abaqus_text_with_nodes_of_an_input_deck(brick, whole, tmp_path):
    """Symmetric matrices come with both triangles or one."""
    symmetry = "general" if whole else "symmetric"
    mmwrite(str(tmp_path / "K.mtx"), csr_matrix(by_label(brick.K)), symmetry=symmetry)
    dofs = np.column_stack([np.repeat(LABELS, 3), np.tile([1, 2, 3], 8)])
    write_abaqus_matrix(brick.M, dofs, tmp_path / "M.mtx")
    if whole:
        lines = (tmp_path / "M.mtx").read_text().splitlines()
        turned = [[*(w := line.replace(" ", "").split(","))[2:4], *w[:2], w[4]] for line in lines]
        more = [",".join(words) for words in turned if words[:2] != words[2:4]]
        (tmp_path / "M.mtx").write_text("** all\n" + "\n".join(lines + more) + "\n")
    nodes = [f"{n}, {x:.9g}, {y:.9g}, {z:.9g}" for n, (x, y, z) in
             zip(LABELS, brick.points, strict=True)]  # fmt: skip
    deck = ["*HEADING", "a block", "*Node, nset=all", "** first", *nodes, "*ELEMENT", "1, 2, 3"]
    (tmp_path / "b.inp").write_text("\n".join(deck))
    K, M = tmp_path / "K.mtx", tmp_path / "M.mtx"
    model = read_model(K, M, nodes=tmp_path / "b.inp", interfaces=SIDES)
    assert_allclose(model.K.toarray(), by_label(brick.K), atol=1e-2)
    assert_allclose(model.M.toarray(), by_label(brick.M), atol=1e-12)
    (tmp_path / "b.csv").write_text("# label, x, y, z\n" + "\n".join(nodes))
    same = read_model(K, M, nodes=tmp_path / "b.csv", interfaces=SIDES)
    assert_array_equal(same.points, model.points)


def has_the_sides_of(brick, model):
    assert_allclose(model.points, brick.points[np.argsort(LABELS)])
    for name, labels in SIDES.items():
        found = np.sort(LABELS)[model.interfaces[name].nodes]
        assert_array_equal(np.sort(found), np.sort(labels))


def test_sets_of_nodes_in_the_deck_are_interfaces(brick, tmp_path):
    (tmp_path / "b.inp").write_text(DECK)
    K, M = SOURCES["op4"]
    model = read_model(K, M, nodes=tmp_path / "b.inp", interfaces=("root", "tip"))
    has_the_sides_of(brick, model)
    assert [side.area for side in model.interfaces.values()] == pytest.approx([1.0, 1.0])
    more = "*NSET, NSET=self\nSelf\n*NSET, NSET=other\nlost\n"
    more += "*NSET, NSET=huge, GENERATE\n1, 2000000000, 1\n"
    for wanted, sets, error, message in (
        (("root", "pin"), "", rom.InterfaceError,
         r"no set 'pin'; it has \['LEFT', 'ROOT', 'TIP', 'UPPER'\]"),
        ("other", more, FileFormatError, "the set 'lost' is unknown"),
        ("self", more, FileFormatError, "the set 'Self' is in itself"),
        ("huge", more, UnsafeFileError, "has 2000000000 nodes"),
        ("odd", f"{more}*NSET, NSET=odd, GENERATE\n1, x\n", FileFormatError,
         r"b\.inp, line \d+: \*NSET .* a label is a whole number"),
    ):  # fmt: skip
        (tmp_path / "b.inp").write_text(DECK + sets)
        refuses(error, message, read_model, K, M, nodes=tmp_path / "b.inp", interfaces=wanted)
    bdf = HERE / "brick.bdf"
    for given, message in (
        (bdf, r"read from \.inp, not from"),
        (read_grids(bdf)[:2], r"need nodes from an \.inp file"),
    ):
        refuses(ConfigError, message, read_model, K, M, nodes=given, interfaces=["root"])


def test_decks_in_several_files(brick, tmp_path):
    nodes, sets = DECK.partition("*NSET")[::2]
    rows = [line for line in nodes.splitlines() if line[0] != "*"]
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "nodes.txt").write_text("** label, x, y, z\n" + "\n".join(rows))
    (tmp_path / "parts" / "sets.inp").write_text(f"*NSET{sets}".replace("left", "3, 7"))
    deck = tmp_path / "b.inp"
    deck.write_text('*Node, input=parts/nodes.txt\n*INCLUDE, INPUT="parts/sets.inp"\n')
    given = {"nodes": deck, "interfaces": ("root", "tip")}
    has_the_sides_of(brick, read_model(*SOURCES["op4"], **given))
    for name in ("gone.inp", "x" * 300, "x" * 300 + "/y", "nul\0", "b.inp"):
        says = "include each other too deep" if name == "b.inp" else f"{name}: there is no such"
        deck.write_text(f"*INCLUDE, INPUT={name}\n")
        refuses(FileFormatError, says, read_model, *SOURCES["op4"], **given)


def test_units_are_converted_at_the_border(brick, tmp_path):
    """Newton, millimetre, tonne: 1 N/mm is 1000 N/m."""
    file, (labels, points, _) = tmp_path / "b.op4", read_grids(HERE / "brick.bdf")
    write_op4({"K": by_label(brick.K) / 1e3, "M": by_label(brick.M) / 1e3}, file)
    given = {"nodes": (labels, 1e3 * points), "interfaces": SIDES, "units": "mm-t-s"}
    model = read_model((file, "K"), (file, "M"), **given)
    assert model.mass() == pytest.approx(brick.mass())
    assert_allclose(model.K.toarray(), by_label(brick.K), rtol=1e-12, atol=1e-3)


def test_written_matrices_come_back(tmp_path):
    rng = np.random.default_rng(4)
    A = rng.normal(size=(7, 7))
    A[:, 3] = A[2] = 0.0
    dofs = np.array([[4, 1], [4, 3], [9, 6], [11, 2], [1001, 0], [1002, 0], [1003, 0]])
    write_dmig({"A": A + A.T + np.eye(7)}, dofs, tmp_path / "a.dmig", nodes={4: (0.1, -2e-3, 3e7)})
    back, same = read_dmig(tmp_path / "a.dmig")["A"]
    assert_array_equal(same, dofs)
    assert_allclose(back.toarray(), np.tril(A + A.T + np.eye(7)), rtol=1e-9)
    labels, points, _ = read_grids(tmp_path / "a.dmig")
    assert_array_equal(labels, [4])
    assert_allclose(points, [[0.1, -2e-3, 3e7]])


def test_short_and_free_cards_are_read(tmp_path):
    """Numbers without the letter of the exponent, continuations with + or blanks, comments."""
    (tmp_path / "a.bdf").write_text(
        "$ free\nDMIG,KX,0,6,1,0\nDMIG,KX,1,1,,1,1,2.+3\nDMIG,KX,2,1,,2,1,4.0\n,2,2,-5.-1\n"
        "DMIG    KX             2       2               2       2 1.5E+1\n"
        "GRID           1             1.0      2.      3.\n"
        "DMIG    KX             2       3               2       3     7.\n"
        "+              3       1     -9.                       \n"
    )
    A, dofs = read_dmig(tmp_path / "a.bdf")["KX"]
    assert_array_equal(dofs, [[1, 1], [2, 1], [2, 2], [2, 3], [3, 1]])
    expected = np.diag([2000.0, 4.0, 15.0, 7.0, 0.0])
    expected[2, 1], expected[4, 3] = -0.5, -9.0
    assert_allclose(A.toarray(), expected)
    assert real("1.5-3") == 1.5e-3 and real("-.25+2") == -25 and real("1.D+2") == 100


def test_what_does_not_fit_is_named(brick, tmp_path):
    K, M = SOURCES["op4"]
    nodes = HERE / "brick.bdf"

    def read(**other):
        given = {"K": K, "M": M, "nodes": nodes, "interfaces": SIDES} | other
        return read_model(given.pop("K"), given.pop("M"), **given)

    def written(name, A):
        return write_op4({"X": A}, tmp_path / f"{name}.op4")

    labels, points, _ = read_grids(nodes)
    turning, skew = with_rotations(by_label(brick.K)), by_label(brick.K)
    turning[3, 3] = 1.0
    skew[0, 5] += 1e9
    supported, uneven = by_label(brick.K), by_label(brick.M)
    supported[0, 0] += 1e9
    uneven[0, 0] += 1.0
    (tmp_path / "K.xyz").write_text("")
    dense, less = HERE / "dense.op4", (labels[1:], points[1:])
    for error, message, given in (
        (ConfigError, r"2 matrices: KAA .*line 1\), MAA .*line 220\)", {"K": dense}),
        (ConfigError, "has no matrix 'KGG'", {"K": (dense, "KGG")}),
        (ConfigError, "unit system", {"units": "inch"}),
        (rom.InterfaceError, r"'tip' needs nodes of the model; unknown are \[8\]",
         {"interfaces": {"tip": [7, 8]}}),
        (FileFormatError, "24 rows are neither 3 nor 6 for each of 7", {"nodes": less}),
        (FileFormatError, r"nodes that are not given: \[3\]",
         {"K": SOURCES["dmig"][0], "nodes": less}),
        (FileFormatError, "occurs twice", {"nodes": (np.r_[labels[1:], 7], points)}),
        (QualityGateError, "a rigid motion meets the stiffness", {"nodes": (labels, points[::-1])}),
        (ConfigError, r"ending '\.xyz'", {"K": tmp_path / "K.xyz"}),
        (ModelError, r"1 nodes turn about an .* \(nodes 3\)", {"K": written("t", turning)}),
        (QualityGateError, "the body is supported", {"K": written("s", supported)}),
        (ModelError, "not the same along x, y and z", {"M": written("m", uneven)}),
        (QualityGateError, "not symmetric", {"K": written("n", skew)}),
    ):  # fmt: skip
        refuses(error, message, read, **given)


@pytest.fixture(scope="module")
def body():
    return reduced(3, block(cells=(4, 1, 1)), damping=rom.Rayleigh(0.0, 1e-6))


def test_the_interface_form_has_its_damping_and_labels(body):
    """Stiffness and mass as files have them are judged in test_exchange.py."""
    form = interface_form(body)
    assert_allclose(form.D[12:, 12:], 1e-6 * np.diag(form.omega**2), atol=1e-6)
    assert_array_equal(form.dofs[[0, 5, 6, 11, 12, 14]].ravel(),
                       [1, 1, 1, 6, 2, 1, 2, 6, 1001, 0, 1003, 0])  # fmt: skip
    root = replace(body.markers["root"], hold=np.zeros((5, 6 + body.n_modes)))
    other = replace(body, markers=body.markers | {"root": root})
    refuses(ConfigError, "interface 'root' has other coordinates", interface_form, other)
    refuses(ConfigError, "it has 0", interface_form, replace(body, markers={}))


@pytest.mark.parametrize("ending", ["op4", "dmig"])
def test_a_reduced_body_is_exported_for_nastran(body, ending, tmp_path):
    form = interface_form(body)
    path = rom.export(body, tmp_path / f"rod.{ending}")
    found = read_op4(path) if ending == "op4" else {k: A for k, (A, _) in read_dmig(path).items()}
    for name, A in (("KAAX", form.K), ("MAAX", form.M), ("BAAX", form.D)):
        got = found[name].toarray()
        expected = A if ending == "op4" else np.tril(A)
        assert_allclose(got, expected, rtol=1e-9, atol=0 if ending == "op4" else 1e-30)


def test_a_reduced_body_is_exported_for_simscape(body, tmp_path):
    """Read back by SciPy; mass, stiffness and places are judged in test_exchange.py."""
    found, form = loadmat(rom.export(body, tmp_path / "rod.mat")), interface_form(body)
    assert_array_equal(found["K"], form.K)
    assert_array_equal(found["C"], form.D)
    assert [str(name[0][0]) for name in found["interfaces"]] == list(body.interface_names)
    assert_allclose(found["frequencies"][:, 0], body.frequencies(fixed=("root", "tip")), rtol=1e-7)
    assert_array_equal(found["quaternions"], [[1, 0, 0, 0]] * 2)
    again = rom.export(body, tmp_path / "again.mat")
    assert again.read_bytes() == (tmp_path / "rod.mat").read_bytes()


@pytest.mark.parametrize("symmetry", ["general", "symmetric", "skew-symmetric"])
@pytest.mark.parametrize("dense", [True, False])
@pytest.mark.parametrize("field", ["real", "integer"])
def test_matrix_market_is_read_as_scipy_reads_it(symmetry, dense, field, tmp_path):
    rng = np.random.default_rng(6)
    A = np.round(50 * rng.normal(size=(5, 5))) * rng.integers(0, 2, (5, 5))
    A = {"general": A, "symmetric": A + A.T, "skew-symmetric": A - A.T}[symmetry]
    A = A / 7 if field == "real" else A.astype(int)
    path = tmp_path / "A.mtx"
    mmwrite(str(path), A if dense else csr_matrix(A), symmetry=symmetry, comment="one\n\ntwo")
    head = path.read_text().splitlines()[0].split()
    assert head[2:] == ["array" if dense else "coordinate", field, symmetry]
    found = read_matrix(path)
    assert_allclose(found.A.toarray(), A, rtol=1e-14)
    assert_allclose(found.A.toarray(), csr_matrix(mmread(str(path))).toarray(), rtol=0)


def test_what_is_no_matrix_market_is_named(tmp_path):
    for head, rest, message in (
        ("coordinate real general", "3 3 1\n4 1 1.0\n", "outside of 3 x 3"),
        ("coordinate real general", "3 3 1\n1 0 1.0\n", "outside of 3 x 3"),
        ("coordinate real general", "3 3 1\n1.5 1 1.0\n", "outside of 3 x 3"),
        ("coordinate real general", "3 3 2\n1 1 1.0\n", "1 lines where 2 entries"),
        ("coordinate real general", "3 3 3\n1\n", "1 lines where 3 entries"),
        ("coordinate real general", "3 3 0\n1 1 1.0\n", "1 lines where 0 entries"),
        ("array real symmetric", "2 2\n1\n2\n", "2 numbers where 3"),
        ("array real symmetric", "2 1\n1\n2\n3\n", "2 x 1 is not square"),
        ("array real general", "3 3\n1\n", "1 numbers where 9"),
        ("coordinate pattern general", "2 2 1\n1 1\n", "not real"),
        ("coordinate complex general", "1 1 1\n1 1 1 1\n", "not real"),
        ("cordinate real general", "2 2 1\n1 1 1\n", "'cordinate real general' is unknown"),
        ("coordinate real general", "3 3 999999999999\n1 1 1.0\n", "A.mtx"),
        ("coordinate real general", "999999999 999999999 1\n1 1 1.0\n", "A.mtx"),
        ("coordinate real general", "-1 3 x\n1 1 1.0\n", "A.mtx"),
    ):
        (tmp_path / "A.mtx").write_text(f"%%MatrixMarket matrix {head}\n{rest}")
        refuses(FileFormatError, message, read_matrix, tmp_path / "A.mtx")


@pytest.mark.parametrize("ending", ["dmig", "mtx"])
def test_files_cut_between_two_lines_are_no_model(brick, ending, tmp_path):
    """Nothing in such a file says where it ends; rigid motions tell."""
    dofs = np.column_stack([np.repeat(LABELS, 3), np.tile([1, 2, 3], 8)])
    write = {"dmig": lambda A, path: write_dmig({"A": A}, dofs, path),
             "mtx": lambda A, path: write_abaqus_matrix(A, dofs, path)}[ending]  # fmt: skip
    K, M, cut = (tmp_path / f"{name}.{ending}" for name in ("K", "M", "cut"))
    write(brick.K, K)
    write(brick.M, M)
    nodes = HERE / "brick.bdf"
    assert read_model(K, M, nodes=nodes, interfaces=SIDES).mass() == pytest.approx(47.1)
    for k, path in enumerate((K, M)):
        lines = path.read_text().splitlines(keepends=True)
        for n in np.random.default_rng(k).integers(1, len(lines), 12):
            cut.write_text("".join(lines[:n]))
            files = ((cut, M), (K, cut))[k]
            refuses(rom.RomError, None, read_model, *files, nodes=nodes, interfaces=SIDES)
