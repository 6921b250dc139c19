"""Superelements of OpenFAST: each block obeys its identities, and files come back or are named."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import eigh

import rom
from cases.files.damage import changed
from cases.paths import TESTS
from cases.refusals import refuses
from cases.solid import KINDS, block, reduced
from rom.cli.main import main
from rom.errors import ConfigError, QualityGateError, UnsafeFileError
from rom.io.programs.openfast import LOAD_DURATION, read_openfast, superelement, write_openfast

HERE = TESTS / "reference" / "foreign"
G = np.array([0.0, 0.0, -9.81])


@pytest.fixture(scope="module")
def model():
    return block(cells=(6, 1, 1))


@pytest.fixture(scope="module")
def body(model):
    return reduced(4, model, damping=rom.Rayleigh(0.0, 1e-6))


@pytest.fixture(params=[4, 5])
def path(request, body, tmp_path):
    return write_openfast(body, tmp_path / "jacket.dat", held=["root"], version=request.param)


def test_the_interface_has_the_condensed_stiffness_and_the_exact_sag(model, path):
    """Statics of the interface is exact whatever the number of modes.

    K and weight of the full model, root held, tip rigid: free nodes, then six of the tip.
    """
    root, tip = (model.interfaces[name] for name in KINDS)
    n = len(model.points)
    inner = np.setdiff1d(np.arange(n), [*root.nodes, *tip.nodes])
    T = np.zeros((3 * n, 3 * inner.size + 6))
    T[(3 * inner[:, None] + np.arange(3)).ravel(), np.arange(3 * inner.size)] = 1.0
    for node, x in zip(tip.nodes, tip.points - tip.origin, strict=True):
        T[3 * node : 3 * node + 3, -6:] = np.hstack([np.eye(3), np.cross(np.eye(3), x).T])
    K, f = T.T @ model.K @ T, T.T @ model.M @ np.tile(G, n)
    found = read_openfast(path)
    flexibility, ours = np.linalg.inv(K)[-6:, -6:], np.linalg.inv(found.K[:6, :6])
    assert_allclose(ours, flexibility, rtol=1e-7, atol=1e-8 * np.abs(flexibility).max())
    sag = np.linalg.solve(K, f)[-6:]
    assert sag[2] < 0
    weight = found.weight + (found.loads[0] if found.t.size else 0.0)
    assert_allclose(ours @ weight[:6], sag, rtol=1e-7, atol=1e-9 * np.abs(sag).max())


def test_modes_and_frequencies_are_those_of_the_body(body, path):
    found = read_openfast(path)
    modes = slice(6, None)
    lam = eigh(found.K[modes, modes], found.M[modes, modes], eigvals_only=True)
    assert_allclose(np.sqrt(lam) / (2 * np.pi), body.frequencies(fixed=("root", "tip")), rtol=1e-9)
    assert_allclose(np.diag(found.M)[modes], 1.0, rtol=1e-9)
    assert_array_equal(found.K[:6, modes], 0.0)  # what is not rigid follows the interface
    lam = eigh(found.K, found.M, eigvals_only=True)
    assert_allclose(np.sqrt(lam) / (2 * np.pi), body.frequencies(fixed=("root",)), rtol=1e-8)
    assert_allclose(found.D, 1e-6 * found.K, atol=1e-9 * np.abs(found.K).max() * 1e-6)


def floating(model, m, folder):
    body = rom.reduce(model, method=rom.CraigBampton(m), interfaces={"tip": "rbe2"}, certify=False)
    return body, read_openfast(rom.export(body, folder / "float.dat", to="openfast"))


def test_a_floating_body_is_free_and_has_its_weight(model, tmp_path):
    """The moment of the weight is about the interface; the identities OpenFAST 5 asks for."""
    body, found = floating(model, 5, tmp_path)
    assert_array_equal(found.K[:6], 0.0)
    m, (x, y, z) = body.mass, body.first_moment / body.mass - body.marker("tip").point
    W, K_W = found.weight, found.K_W
    near = {"rtol": 1e-9, "atol": 1e-8 * m}
    assert_allclose(found.M[:3, :3], m * np.eye(3), **near)
    assert_allclose(W[:6], [*(m * G), *np.cross((x, y, z), m * G)], **near)
    assert_allclose([K_W[0, 4], K_W[1, 3]], [W[2], -W[2]], **near)
    assert_allclose([K_W[3, 3], K_W[4, 4]], [W[2] * z, W[2] * z], **near)
    assert_allclose([K_W[5, 3], K_W[5, 4]], [-W[2] * x, -W[2] * y], **near)
    assert_array_equal(K_W[:, [0, 1, 2]], 0.0)
    assert_allclose(K_W[:, 5], 0.0, **near)
    old = read_openfast(rom.export(body, tmp_path / "old.dat", to="openfast-4"))
    assert_allclose(old.loads, [W, W], **near)
    assert_array_equal(old.t, [0.0, LOAD_DURATION])
    assert_array_equal(old.elevation, [0.0, 0.0])
    still = read_openfast(write_openfast(body, tmp_path / "0.dat", gravity=(0, 0, 0)))
    assert_array_equal(still.weight, 0.0)


def test_the_weight_turns_with_the_frame(model, tmp_path):
    """Finite rotation of the whole model: the loads on interface and modes seen from the frame."""
    body, found = floating(model, 3, tmp_path)
    theta, h = np.array([0.2, -0.5, 0.3]), 1e-6
    turned = []
    for sign in (1, -1):
        a = sign * h * theta
        R = np.eye(3) + np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
        other = write_openfast(body, tmp_path / "g.dat", gravity=R.T @ G)
        turned.append(read_openfast(other).weight)
    slope = (turned[0] - turned[1]) / (2 * h)
    assert_allclose(slope, -found.K_W[:, 3:6] @ theta, atol=1e-7 * np.abs(found.K_W).max())


def test_a_file_of_the_project_itself_is_read(body):
    """Written by openfast-io 5.0.0 from the matrices of this body, nine digits each."""
    found = read_openfast(HERE / "openfast.dat")
    ours = superelement(body, held=["root"])
    for name in ("M", "K", "D", "weight", "K_W"):
        A, B = getattr(found, name), getattr(ours, name)
        assert_allclose(A, B, atol=1e-7 * max(np.abs(B).max(), 1.0))


BY_HAND = """! a table with waves, half a second apart
! Made by hand, FLEX 5 FORMAT
!Dimension:                         6
!Time increment in simulation:      5D-1
! a remark
!Total simulation time in file:     1.0
!MASS MATRIX (Units (kg,m))
!Dimension: ignored
{M}
!Stiffness Matrix
!
{K}
not a keyword
!Damping Matrix
!
{K}
!Loading and Wave Elevation
!Dimension: ignored
0.0 1 2 3 4 5 6 0.1
0.5 1 2 3 4 5 7 0.2
1.0 1 2 3 4 5 8 0.3
beyond what is read
""".format(
    M="\n".join(" ".join("2.5" if i == j else "0" for j in range(6)) for i in range(6)),
    K="\n".join(" ".join(str(i + j) for j in range(6)) for i in range(6)),
)


def test_a_table_with_waves_is_read(tmp_path):
    path = tmp_path / "a.dat"
    path.write_text(BY_HAND)
    found = read_openfast(path)
    assert_array_equal(found.M, 2.5 * np.eye(6))
    assert_array_equal(found.K, np.add.outer(np.arange(6), np.arange(6)))
    assert_array_equal(found.t, [0.0, 0.5, 1.0])
    assert_array_equal(found.loads[:, 5], [6, 7, 8])
    assert_array_equal(found.elevation, [0.1, 0.2, 0.3])
    path.write_text(re.sub(r" 0.[123]\n", "\n", BY_HAND))
    found = read_openfast(path)
    assert_array_equal(found.loads[:, 5], [6, 7, 8])
    assert_array_equal(found.elevation, np.zeros(3))


DIMENSION, DIAGONAL = "!Dimension:                         6", "2.5 0 0 0 0 0\n"
test_what_openfast_would_misread_is_named = changed(
    BY_HAND,
    "a.dat",
    read_openfast,
    ("FLEX 5", "GUYAN", "line 8: .*row 1 of 6 has 2 words.*GuyanASCII is not"),
    (DIMENSION, "!Dimension: x", "line 3: .*'x'"),
    (DIMENSION, "!", "line 7: .*'!dimension:'"),
    ("                         6\n", " 99999\n", UnsafeFileError, "99999 coordinates"),
    ("5D-1", "0", "line 32: .*a time step 0 s and a duration 1 s"),
    ("5D-1", "1e-9", "do not fit the file"),
    ("5D-1", "0.25", "row 4 of 5 has 4 words"),
    ("0.5 1", "0.6 1", "times of the loads are not 0.5 s apart"),
    ("0.2\n", "\n", "line 35: .*row 2 of 3 has 7 words"),
    (DIAGONAL, "", "line 14: .*row 6 of 6 has 2 words"),
    (DIAGONAL, "2.5 0 1 0 0 0\n", QualityGateError, "M is not symmetric"),
    (DIAGONAL, "0 0 0 0 0 0\n", QualityGateError, "mass must be positive"),
    (DIAGONAL, "2,5 0 0 0 0 0\n", "line 9: .*'2,5' is no finite"),
    ("!Damping", "!Dumping", r"the blocks \['D'\] are missing"),
)


def test_one_interface_is_free(body, tmp_path, capsys):
    path = tmp_path / "a.dat"
    for message, how in (
        (r"has 2 free interfaces, \['root', 'tip'\]", {}),
        ("'bore' cannot be held", {"held": ["bore"]}),
        ("has 0 free interfaces", {"held": ("root", "tip")}),
        ("dmig holds no interfaces, openfast does", {"held": ["root"], "to": "dmig"}),
    ):
        refuses(ConfigError, message, rom.export, body, path, **{"to": "openfast"} | how)
    third = {"held": ["root"], "version": 3}
    refuses(ConfigError, "version 3 of OpenFAST is unknown", write_openfast, body, path, **third)
    file = rom.save(body, tmp_path / "b.rom.npz")
    assert main(["export", str(file), str(path), "--to", "openfast", "--held", "root"]) == 0
    assert "as openfast" in capsys.readouterr().out
    same = write_openfast(body, tmp_path / "c.dat", held=["root"])
    assert_array_equal(read_openfast(path).M, read_openfast(same).M)
