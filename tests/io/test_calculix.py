"""Matrices that CalculiX writes, and linear user elements, become models and come back.

The files reference/foreign/calculix.* were written by CalculiX 2.20 (Debian's calculix-ccx) from
the deck among them: six C3D4 elements of a block, its nodes numbered out of order, one node left
over. The .mtx is its *SUBSTRUCTURE MATRIX OUTPUT of nodes 12 (1 to 3) and 55 (1, 2).
"""

import shutil

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import eigh

import rom
from cases.files.cells import tetrahedra
from cases.files.decks import BY_HAND
from cases.paths import TESTS
from cases.solid import block, reduced
from rom.errors import ConfigError, FileFormatError, RomError, UnsafeFileError
from rom.io.matrices.matrix_files import read_matrix, read_stored_matrix
from rom.io.matrices.node_files import read_nodes
from rom.io.matrices.user_element import read_user_element, write_user_element
from rom.io.programs.interface_form import interface_form

HERE = TESTS / "reference" / "foreign"
LABELS = np.array([12, 3, 40, 7, 101, 55, 20, 60])  # of the corners, z fastest
STEEL = rom.Material(E=210e9, nu=0.3, rho=7850.0)


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


def test_stored_matrices_are_those_of_the_elements():
    """The node 5 of the deck belongs to no element and is left out."""
    model = stored()
    for found, expected in zip((model.K, model.M), six_tetrahedra(), strict=True):
        assert_allclose(found.toarray(), expected, atol=1e-12 * np.abs(expected).max())
    assert model.mass() == pytest.approx(0.3 * 0.2 * 0.1 * 7850.0, rel=1e-12)
    root = model.interfaces["root"]
    assert_array_equal(np.sort(LABELS)[root.nodes], [12, 3, 40, 7])  # by coordinates
    assert_allclose(root.origin, [0.0, 0.1, 0.05])
    with pytest.raises(RomError, match=r"'loose' needs nodes of the model; unknown are \[5\]"):
        stored(interfaces={"loose": [5]})


def test_a_model_from_calculix_has_the_frequencies_of_its_matrices():
    """One point per element leaves the mass singular: the highest frequencies are infinite."""
    K, M = six_tetrahedra()
    free = np.isin(np.repeat(np.sort(LABELS), 3), LABELS[4:])
    mu = eigh(M[np.ix_(free, free)], K[np.ix_(free, free)], eigvals_only=True)[:-5:-1]
    found = rom.modes(stored(), 4, fixed=("root",)).frequencies
    assert_allclose(found, 1 / np.sqrt(mu) / (2 * np.pi), rtol=1e-9)


def test_a_substructure_is_the_rows_calculix_left_alone():
    """Version 2.20 does not condense: what it writes are rows and columns of the stiffness."""
    found = read_matrix(HERE / "calculix.mtx")
    assert_array_equal(found.dofs, [[12, 1], [12, 2], [12, 3], [55, 1], [55, 2]])
    rows = [np.searchsorted(np.sort(LABELS), n) * 3 + c - 1 for n, c in found.dofs]
    expected = np.tril(six_tetrahedra()[0][np.ix_(rows, rows)])
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
    with pytest.raises(ConfigError, match="Name one"):
        read_matrix(path)
    labels, points = read_nodes(path)
    assert_array_equal(labels, [1, 2, 1001, 1002, 1003])
    assert_allclose(points[:2], [form.points[1], form.points[2]], atol=1e-15)
    lines = path.read_text().splitlines()
    assert lines[lines.index("** 1003") + 1 :][:3] == [
        "1, 2, 3, 4, 5, 6", "3, 1", "*MATRIX, TYPE=STIFFNESS"]  # fmt: skip
    # readers of such files put the comments together: a line that goes on ends in a comma
    comments = "".join(line[2:] for line in lines if line.startswith("**")).split("NODES")[1]
    assert [int(word) for word in comments.split(",")] == [1, 2, 1001, 1002, 1003]
    with pytest.raises(ConfigError, match="node by node"):
        write_user_element({"MASS": np.eye(3)}, [[1, 1], [2, 1], [1, 2]], path, nodes={})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("linear", "Unsymm", r"a\.mtx, line 3: .*not linear and symmetric"),
        ("nodes=4", "nodes=x", r"a\.mtx, line 3: this is no user element"),
        ("nodes=4", "nodes=5", "4 nodes are named, but the element has 5"),
        ("nodes=4", "nodes=1", r"a\.mtx, line 8: .*places ascend up to NODES"),
        ("1, 2, 6", "1, 2, 7", r"a\.mtx, line 7: .*components are 1 to 6"),
        ("3, 1\n", "1, 3\n", r"a\.mtx, line 8: .*places ascend"),
        ("30, 31", "30, 30", "a component of a node comes twice"),
        ("33., 34.", "33.", "has 35 numbers; the upper triangle of 8 rows has 36"),
        ("8.D0", "8,D0", r"a\.mtx, line 11: this is no user element"),
        ("36.", "inf", "all finite"),
        ("*matrix", "*other", "no linear user element with matrices"),
    ],
)
def test_a_damaged_user_element_is_named(old, new, message, tmp_path):
    path = tmp_path / "a.mtx"
    text = BY_HAND.replace(" 36.", " 36.").lower()
    assert old.lower() in text
    path.write_text(text.replace(old.lower(), new))
    with pytest.raises(FileFormatError, match=message):
        read_user_element(path)


def test_two_elements_or_a_huge_one_are_refused(tmp_path):
    path = tmp_path / "a.mtx"
    path.write_text(BY_HAND + BY_HAND)
    with pytest.raises(FileFormatError, match=r"line 23: .*second one"):
        read_user_element(path)
    path.write_text(BY_HAND.replace("NODES=4", "NODES=999999999"))
    with pytest.raises(UnsafeFileError, match="999999999 nodes"):
        read_user_element(path)
    path.write_text(BY_HAND + "*MATRIX, TYPE=STIFFNESS\n1.\n")
    with pytest.raises(FileFormatError, match="two matrices 'STIFFNESS'"):
        read_user_element(path)


def copied(tmp_path, ending, change):
    """The stored files, one of them changed."""
    for part in (".sti", ".dof"):
        shutil.copy(HERE / f"calculix{part}", tmp_path)
    path = tmp_path / f"calculix{ending}"
    path.write_text(change(path.read_text()))
    return tmp_path / "calculix.sti"


@pytest.mark.parametrize(
    ("ending", "change", "message"),
    [
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
        (".dof", lambda t: t.replace("7.2", "7.1"), "a row is listed twice"),
    ],
)
def test_damaged_matrices_are_named(ending, change, message, tmp_path):
    with pytest.raises(FileFormatError, match=message):
        read_stored_matrix(copied(tmp_path, ending, change))


def test_missing_parts_and_supports_are_named(tmp_path):
    shutil.copy(HERE / "calculix.sti", tmp_path)
    with pytest.raises(FileFormatError, match=r"calculix\.dof: there is no such file"):
        read_matrix(tmp_path / "calculix.sti")
    with pytest.raises(FileFormatError, match="a number is not finite"):
        read_matrix(copied(tmp_path, ".sti", lambda t: t.replace("2.1314102564103e+10", "nan")))
    # component 10 of a node would be read as 1 if the label were a number
    with pytest.raises(FileFormatError, match=r"a row is node\.component"):
        read_matrix(copied(tmp_path, ".dof", lambda t: t.replace("7.1\n", "7.10\n")))
