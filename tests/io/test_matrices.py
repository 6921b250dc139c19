"""Matrices people bring, and a reduced body in the eyes of another program: pyyeti's cbcheck.

``PYTHONPATH=tests python tests/io/test_matrices.py`` writes the Craig-Bampton matrices that
tests/reference/cbcheck.py asks pyyeti of.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import rom
from benchmarks.models import KINDS
from benchmarks.models import bar as bar_of
from cases.paths import TESTS
from cases.refusals import refuses
from cases.solid import reduced
from rom.eigen.verbs import rigid_motions
from rom.errors import QualityGateError, RomWarning
from rom.reduction.full_model import operators
from rom.reduction.interfaces.connection import connect


@pytest.fixture(scope="module")
def square():
    """A bar of square section: its bending modes come in pairs."""
    return bar_of((0.5, 0.05, 0.05), (12, 1, 1))


def test_matrices_that_are_not_definite_are_named(square):
    row, column = 60, 66  # two dofs along one axis: the difference of their motions gets -lam
    lam = 1.5 * square.M.diagonal().max()
    turns = csr_matrix((np.full(2, lam), ([row, column], [column, row])), shape=square.M.shape)
    bare = square.M.tolil()
    bare[60, 60] = 0.0
    for change, message in (
        ({"K": -square.K}, r"K has \d+ negative eigenvalues"),
        ({"M": square.M + turns}, r"M has \d+ negative eigenvalues"),
        (
            {"M": bare.tocsr()},
            "M has 0 on the diagonal of dof 60; without mass it needs stiffness, and no",
        ),
    ):
        refuses(QualityGateError, message, reduced, 4, replace(square, **change))


def test_a_repeated_frequency_is_kept_whole(square):
    pairs = reduced(5, square).frequencies(4, fixed=tuple(KINDS))
    assert pairs[0] == pytest.approx(pairs[1], rel=1e-9)
    with pytest.warns(RomWarning, match="2 fixed-interface modes are kept instead of 1"):
        body = reduced(1, square)
    assert body.n_modes == 6 + 2
    assert body.frequencies(fixed=tuple(KINDS)) == pytest.approx(pairs[:2], rel=1e-9)


REFERENCE = TESTS / "reference"
N_MODES = 12


def bar():
    return bar_of((0.5, 0.06, 0.04), (10, 2, 2))


def matrices(model):
    """Craig-Bampton mass and stiffness, interface coordinates first."""
    connection = connect(operators(model), model, KINDS)
    ops = connection.ops
    basis = rom.CraigBampton(N_MODES).basis(ops, connection.boundary, connection.labels)
    K, M = (ops.gram(basis.Psi, apply(basis.Psi)) for apply in (ops.apply_K, ops.apply_M))
    return 0.5 * (K + K.T), 0.5 * (M + M.T)


@pytest.fixture(scope="module")
def body():
    return rom.reduce(bar(), method=rom.CraigBampton(N_MODES), interfaces=KINDS)


@pytest.fixture(scope="module")
def pyyeti():
    return json.loads((REFERENCE / "cbcheck.json").read_text())


def test_the_matrices_judged_are_ours():
    given = np.load(REFERENCE / "cbcheck.npz")
    for name, ours in zip("KM", matrices(bar()), strict=True):
        size = np.sqrt(np.diag(ours))
        signs = np.sign(np.sum(given["M"][: len(ours)] * matrices(bar())[1], axis=0))
        theirs = given[name] * np.outer(signs, signs)
        assert np.abs((ours - theirs) / np.outer(size, size)).max() < 1e-7, name


def test_rigid_body_mass_is_that_of_cbcheck(body, pyyeti):
    R = np.eye(6 + body.n_modes)[:, :6]
    M, _ = body.full_matrices()
    theirs = np.array(pyyeti["rigid body mass about the origin"])
    assert np.abs(R.T @ M @ R - theirs).max() < 1e-10 * body.mass
    certificate = {row.quantity: row for row in body.certificate.rows}
    assert certificate["mass, centre, inertia: body against full"].ok
    rigid = np.array(pyyeti["stiffness-based rigid motions"])  # no grounding
    assert rigid[6:9, :3] == pytest.approx(np.eye(3), abs=1e-9)


def test_fixed_base_frequencies_and_effective_masses_are_those_of_cbcheck(body, pyyeti):
    theirs = np.array(pyyeti["fixed-base frequencies [Hz]"])
    assert body.frequencies(fixed=tuple(KINDS)) == pytest.approx(theirs, rel=1e-8)
    theirs = np.array(pyyeti["effective mass"])
    ours = body.effective_mass(fixed=tuple(KINDS))
    assert ours.shape == theirs.shape == (N_MODES, 6)
    assert np.abs(ours - theirs).max() < 1e-7 * theirs.max()
    rows = {row.quantity: row.value for row in body.certificate.rows}
    share = theirs[:, :3].sum(axis=0) / body.mass
    for axis, value in zip("xyz", share, strict=True):
        assert rows[f"all interfaces held: effective mass along {axis}"] == pytest.approx(value)


def test_effective_masses_of_all_modes_add_up_to_what_the_interior_can_carry():
    """Kammer and Triller: the sum over all modes is (M R)_i^T M_ii^-1 (M R)_i, without modes."""
    model = bar_of((0.5, 0.06, 0.04), (3, 1, 1))
    held = np.concatenate([face.dofs for face in model.interfaces.values()])
    inner = np.setdiff1d(np.arange(model.n_dofs), held)
    body = reduced(inner.size, model)
    MR = (model.M @ rigid_motions(model.points))[inner]
    expected = np.diag(MR.T @ np.linalg.solve(model.M[inner][:, inner].toarray(), MR))
    ours = body.effective_mass(fixed=tuple(KINDS)).sum(axis=0)
    assert ours == pytest.approx(expected, rel=1e-7)


if __name__ == "__main__":
    K, M = matrices(bar())
    points = np.array([bar().interfaces[name].origin for name in KINDS])
    np.savez(REFERENCE / "cbcheck.npz", K=K, M=M, points=points)
