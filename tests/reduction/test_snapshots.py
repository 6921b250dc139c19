"""Interface functions learnt from displacements of the surface."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import identity, kron

import rom
from cases.refusals import refused
from cases.solid import block, reduced
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, InterfaceError
from rom.reduction.interfaces.kinds import tie
from rom.reduction.interfaces.snapshots import snapshot_functions

MODEL = block(cells=(6, 3, 3))
ROOT = MODEL.interfaces["root"]
N = ROOT.dofs.size
RANDOM = np.random.default_rng(1).normal(size=(N, 60))


@pytest.fixture(scope="module")
def seen():
    """What the surface does in the thirty lowest modes of the free body."""
    return rom.modes(MODEL, 30).shapes[ROOT.dofs]


def frequencies(kind):
    found = reduced(15, MODEL, interfaces={"root": kind, "tip": "full"}).frequencies(12)
    assert (found[:6] == 0.0).all()
    return found[6:]


def test_motions_of_the_body_teach_more_than_noise(seen):
    full = frequencies("full")
    errors = {
        n: [frequencies(rom.Snapshots(X, n=n)) / full - 1 for X in (seen, RANDOM)] for n in (12, 18)
    }
    for learnt, guessed in errors.values():
        assert (learnt >= -1e-9).all() and (guessed >= -1e-9).all()
        assert learnt.max() < 0.1 * guessed.max()
    assert errors[18][0].max() < 1e-6


def test_a_complete_set_is_the_full_interface():
    assert_allclose(frequencies(rom.Snapshots(RANDOM, n=N)), frequencies("full"), rtol=1e-9)
    assert snapshot_functions(rom.Snapshots(RANDOM, energy=1.0), ROOT).shape == (N, N)


@pytest.mark.parametrize("n", [6, 9, 20])
def test_functions_are_orthonormal_over_the_area_and_contain_rigid_motion(seen, n):
    Q = snapshot_functions(rom.Snapshots(seen, n=n), ROOT)
    S = kron(ROOT.surface_mass, identity(3))
    assert Q.shape == (N, n)
    assert_allclose(Q.T @ (S @ Q), np.eye(n), atol=1e-12)
    R = rigid_motions(ROOT.points)
    assert_allclose(Q[:, :6] @ (Q[:, :6].T @ (S @ R)), R, atol=1e-12)


def test_functions_are_the_best_for_their_snapshots(seen):
    """Eckart-Young: what n functions leave of the snapshots are the singular values left out."""
    S = kron(ROOT.surface_mass, identity(3)).toarray()
    Q = snapshot_functions(rom.Snapshots(seen, n=10), ROOT)
    left = seen - Q @ (Q.T @ S @ seen)
    R = Q[:, :6]
    elastic = seen - R @ (R.T @ S @ seen)
    spectrum = np.linalg.eigvalsh(elastic.T @ S @ elastic)[::-1]
    assert_allclose(np.trace(left.T @ S @ left), spectrum[4:].sum(), rtol=1e-8)


def test_energy_keeps_the_fewest_functions_that_hold_it():
    """Three shapes beyond rigid motion whose squares are as 0.9 : 0.09 : 0.01."""
    S = kron(ROOT.surface_mass, identity(3), format="csr")
    Q = snapshot_functions(rom.Snapshots(RANDOM, n=9), ROOT)
    rigid = 7.0 * rigid_motions(ROOT.points)[:, :2]
    X = np.hstack([rigid, Q[:, 6:] * np.sqrt([0.9, 0.09, 0.01])])
    for energy, n in ((0.5, 7), (0.89, 7), (0.91, 8), (0.995, 9), (1.0, 9)):
        found = snapshot_functions(rom.Snapshots(X, energy=energy), ROOT)
        assert found.shape[1] == n
    assert_allclose(np.abs(np.diag(found[:, 6:].T @ (S @ Q[:, 6:]))), 1.0, rtol=1e-9)


def test_snapshots_of_rigid_motion_leave_six_functions():
    X = rigid_motions(ROOT.points) @ np.random.default_rng(3).normal(size=(6, 4))
    assert snapshot_functions(rom.Snapshots(X, energy=0.9999), ROOT).shape == (N, 6)
    rigid = rom.modes(MODEL, 12, interfaces={"root": "rbe2"}).frequencies[6:]
    kind = rom.Snapshots(X, energy=0.9999)
    found = rom.modes(MODEL, 12, interfaces={"root": kind}).frequencies[6:]
    assert_allclose(found, rigid, rtol=1e-9)


def test_the_kind_is_named_and_can_be_held(seen):
    kind = rom.Snapshots(seen, n=14)
    assert tie(ROOT, kind).label == "snapshots:14"
    assert repr(kind) == "Snapshots(30 of 48 dofs, n=14)"
    kinds = {"root": kind, "tip": "rbe2"}
    made = reduced(25, MODEL, interfaces=kinds, reference="root", certify=True)
    assert made.certificate.ok, made.certificate
    assert_allclose(made.markers["root"].translation, 0, atol=1e-9)
    assert made.frequencies(fixed=("root",))[0] > 0


test_messages_for_wrong_snapshots = refused(
    (lambda: rom.Snapshots(np.ones((47, 3)), n=6), r"shape \(47, 3\) are not displacements"),
    (lambda: rom.Snapshots(np.ones(48), n=6), r"shape \(48,\)"),
    (lambda: rom.Snapshots(np.ones((48, 0)), n=6), r"shape \(48, 0\)"),
    (lambda: rom.Snapshots(np.zeros((48, 3)), n=6), "all 3 snapshots are zero"),
    (lambda: rom.Snapshots(np.diag([1.0, 1.0, np.nan]), n=6), r"values = .* is not finite"),
    (lambda: rom.Snapshots(RANDOM), "either energy or n"),
    (lambda: rom.Snapshots(RANDOM, n=8, energy=0.9), "either energy or n"),
    (lambda: tie(ROOT, rom.Snapshots(RANDOM[:45], n=6)), "45 dofs do not fit .*'root' with 48"),
    (
        lambda: tie(ROOT, rom.Snapshots(RANDOM[:, :4], n=11)),
        r"n = 11, but the 4 snapshots of interface 'root' hold 10 independent",
    ),
    error=ConfigError,
)


def test_one_surface_with_different_functions_on_its_sides_is_not_coupled(seen):
    bodies = {
        name: reduced(4, block(cells=(6, 3, 3), origin=(origin, 0, 0)),
                      interfaces={face: rom.Snapshots(X, n=10)})
        for name, origin, face, X in (("a", 0.0, "tip", seen), ("b", 1.0, "root", RANDOM))
    }  # fmt: skip
    with pytest.raises(InterfaceError, match=r"share 16 nodes, but each .* functions of its own"):
        rom.Assembly(bodies, ((("a", "tip"), ("b", "root")),))
