"""Functions of interfaces: orthogonal polynomials and harmonics, and what snapshots teach."""

import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import diags, identity, kron

import rom
from benchmarks.models import bar
from cases.measures import TURN, surface
from cases.refusals import refused, refuses
from cases.solid import block, reduced
from rom.eigen.scipy import HeldSciPy
from rom.eigen.verbs import constraint_modes, quadratic, rigid_motions
from rom.errors import ConfigError, InterfaceError
from rom.model import Interface
from rom.reduction.full_model import operators
from rom.reduction.interfaces.connection import connect
from rom.reduction.interfaces.kinds import tie
from rom.reduction.interfaces.polynomial import cylinder_coordinates, interface_functions
from rom.reduction.interfaces.snapshots import snapshot_functions

FLAT, QUADRIC, OTHER = [3, 6, 10, 15], [4, 9, 16, 25], [4, 10, 20, 35]
RANKS = {"plane": FLAT, "strip": FLAT, "cylinder": QUADRIC, "sphere": QUADRIC, "wave": OTHER}
MODEL = block(cells=(6, 3, 3))


@pytest.mark.parametrize(("name", "ranks"), RANKS.items())
def test_number_of_functions_is_the_rank_of_the_polynomials_on_the_surface(name, ranks):
    """(p+1)(p+2)/2 on planes, (p+1)^2 on quadrics, (p+1)(p+2)(p+3)/6 elsewhere."""
    interface = surface(name)
    bases = [interface_functions(rom.Polynomial(order), interface) for order in (1, 2, 3, 4)]
    assert [Q.shape[1] for Q in bases] == ranks
    if name == "wave":  # they are nested
        assert_allclose(bases[1], bases[-1][:, : ranks[1]], atol=1e-12)


KINDS = [rom.Polynomial(1), rom.Polynomial(5), rom.FourierLegendre(3, 2)]


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_functions_are_orthonormal_over_the_area_and_move_rigidly(kind):
    interface = surface("cylinder")
    Q, S = interface_functions(kind, interface), interface.surface_mass
    assert_allclose(Q.T @ (S @ Q), np.eye(Q.shape[1]), atol=1e-13)
    R = rigid_motions(interface.points).reshape(-1, 3, 6)
    left = R - np.einsum("kj,jax->kax", Q, np.einsum("kj,kax->jax", S @ Q, R))
    assert np.abs(left).max() < 1e-13 * np.abs(R).max()


def test_the_angle_runs_around_the_axis_of_a_bore():
    angle, height = np.meshgrid(2 * np.pi * np.arange(24) / 24, [0.0, 0.1, 0.2, 0.3])
    x = 0.1 * np.column_stack([np.cos(angle.ravel()), np.sin(angle.ravel()), 0 * angle.ravel()])
    x[:, 2] = height.ravel()
    S = diags(np.ones(96)).tocsr()
    bore = Interface("bore", np.arange(96), x @ TURN.T, S, np.zeros(3))
    theta, zeta = cylinder_coordinates(bore)
    turned = np.exp(1j * (theta - angle.ravel())), np.exp(1j * (theta + angle.ravel()))
    assert min(np.abs(t - t[0]).max() for t in turned) < 1e-9
    assert_allclose(np.abs(zeta), np.abs(2 * height.ravel() / 0.3 - 1), atol=1e-9)


def test_functions_around_a_known_axis_hold_no_product_twice():
    """Nodes crowd on one side: their centroid lies beside the axis."""
    t, height = np.meshgrid(2 * np.pi * np.arange(24) / 24, [0.0, 0.1, 0.2, 0.3])
    angle = t.ravel() + 0.2 * np.cos(t.ravel())
    middle = np.array([0.3, -0.2, 0.15])
    x = TURN @ np.array([0.3 + 0.1 * np.cos(angle), 0.1 * np.sin(angle) - 0.2, height.ravel()])
    S = diags(np.ones(96)).tocsr()
    bore = Interface("bore", np.arange(96), x.T, S, TURN @ middle, axis=TURN @ [0.0, 0.0, 1.0])
    Q = interface_functions(rom.FourierLegendre(3, 2), bore)
    assert Q.shape == (96, 7 * 3)
    wave = np.cos(3 * angle) * height.ravel()
    assert_allclose(Q @ (Q.T @ wave), wave, atol=1e-12)


def test_two_bodies_around_one_bore_choose_the_same_functions():
    """Where two directions lie equally far from the axis, round-off must not choose."""
    angle, height = np.meshgrid(2 * np.pi * (np.arange(24) + 0.3) / 24, [0.0, 0.1, 0.2, 0.3])
    ring = [np.cos(angle.ravel()), np.sin(angle.ravel()), 10 * height.ravel()]
    S, found = diags(np.ones(96)).tocsr(), []
    for seed in range(6):
        x = 0.1 * np.column_stack(ring) + np.random.default_rng(seed).normal(size=(96, 3)) * 1e-15
        bore = Interface("bore", np.arange(96), x, S, np.zeros(3))
        found.append(interface_functions(rom.FourierLegendre(2, 1), bore))
    for Q in found[1:]:
        assert_allclose(Q, found[0], atol=1e-9 * np.abs(Q).max())


def test_frequencies_fall_with_the_order_towards_the_full_interface():
    kinds = ("full", *(rom.Polynomial(p) for p in (1, 2, 3, 6)))
    bodies = (reduced(15, MODEL, interfaces={"root": kind, "tip": kind}) for kind in kinds)
    full, *steps = np.array([body.frequencies(12)[6:] for body in bodies])
    assert (np.diff(steps, axis=0) < 1e-9 * full).all()
    assert (steps[0] > full * (1 + 1e-4)).any()
    assert (steps >= full * (1 - 1e-9)).all()
    # 16 nodes of a face are all told apart by polynomials of degree 3 + 3
    assert_allclose(steps[-1], full, rtol=1e-9)


def test_only_as_many_solutions_as_functions_are_computed(monkeypatch):
    model, solved = block(cells=(4, 4, 4)), []
    solve = HeldSciPy.__call__

    def counted(self, F):
        solved.append(F.shape[1])
        return solve(self, F)

    monkeypatch.setattr(HeldSciPy, "__call__", counted)
    ops = operators(model)
    connection = connect(ops, model, {"root": rom.Polynomial(1), "tip": rom.Polynomial(2)})
    assert connection.boundary.size == 3 * (3 + 6)
    rom.CraigBampton(4).basis(connection.ops, connection.boundary, connection.labels)
    assert sum(solved) <= 27
    assert model.interfaces["root"].dofs.size == 75


@pytest.mark.parametrize("kind", ["polynomial:2", rom.FourierLegendre(2, 1)], ids=str)
def test_the_certificate_holds_and_interfaces_can_be_held(kind):
    kinds = {"root": kind, "tip": "rbe2"}
    body = rom.reduce(MODEL, method=rom.CraigBampton(25), interfaces=kinds, reference="root")
    assert body.certificate.ok, body.certificate
    full = rom.modes(MODEL, 4, fixed=("root",), interfaces=kinds).frequencies
    assert_allclose(body.frequencies(4, fixed=("root",)), full, rtol=1e-3)
    assert body.markers["root"].kind in ("polynomial:2", "fourier:2,1")
    assert_allclose(body.markers["root"].translation, 0, atol=1e-9)


def test_text_and_record_name_the_same_kind():
    interface = surface("plane")
    assert tie(interface, "polynomial:3").label == tie(interface, rom.Polynomial(3)).label
    one, other = tie(interface, "fourier:3,0"), tie(interface, rom.FourierLegendre(3, 0))
    assert_allclose(one.by_masters.toarray(), other.by_masters.toarray())


def copies(work, columns):
    """The memory that work takes at most, over that of the (n, r) columns it works on."""
    tracemalloc.start()
    work()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / columns.nbytes


def test_columns_of_a_large_surface_are_worked_on_few_at_a_time():
    """625 nodes, 45 functions, 3 directions: a copy of everything would double the memory."""
    model = bar((0.1, 1.0, 1.0), (1, 12, 12))
    made = connect(operators(model), model, {"root": rom.Polynomial(8)})
    n_functions = (8 + 1) * (8 + 2) // 2
    assert made.ties["root"].by_masters.nnz <= 3 * 625 * n_functions  # nothing off the directions
    held = made.ops.hold(made.boundary)
    Psi = constraint_modes(made.ops, held, made.boundary)
    assert Psi.shape[1] == 3 * n_functions
    E = np.zeros((made.ops.n_local, made.boundary.size))  # at once, by their definition
    E[made.boundary, np.arange(made.boundary.size)] = 1.0
    assert_allclose(Psi, E - held(made.ops.apply_K(E)), rtol=1e-9, atol=1e-15)
    assert copies(lambda: constraint_modes(made.ops, held, made.boundary), Psi) < 2.5
    ops, whole = operators(model), made.ops.expand(Psi)
    expected = whole.T @ (model.K @ whole)
    found = quadratic(ops, ops.apply_K, whole)
    assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
    assert copies(lambda: quadratic(ops, ops.apply_K, whole), whole) < 0.9


def icosahedron():
    g = (1 + np.sqrt(5)) / 2
    x = [np.roll([0, a, b * g], k) for k in range(3) for a in (-1, 1) for b in (-1, 1)]
    return Interface("sphere", np.arange(12), np.array(x), diags(np.ones(12)).tocsr(), np.zeros(3))


def tied(face, kind):
    return lambda: tie(face, kind)


test_kinds_that_a_surface_cannot_have_are_refused = refused(
    (tied(surface("plane"), "polynomial"), ConfigError, "on 'plane' is open"),
    (tied(surface("plane"), "polynomial:x"), ConfigError, "known kinds"),
    (tied(surface("plane"), "fourier:2"), ConfigError, "known kinds"),
    (tied(surface("plane"), "polynomial:0"), ConfigError, "order = 0"),
    (tied(surface("line"), "polynomial:2"), InterfaceError, "'line' lie on a line"),
    (tied(icosahedron(), "fourier:2,2"), InterfaceError, "'sphere' has no axis"),
)
ROOT = MODEL.interfaces["root"]
N = ROOT.dofs.size
RANDOM = np.random.default_rng(1).normal(size=(N, 60))


@pytest.fixture(scope="module")
def seen():
    return rom.modes(MODEL, 30).shapes[ROOT.dofs]


def elastic(kind):
    found = reduced(15, MODEL, interfaces={"root": kind, "tip": "full"}).frequencies(12)
    assert (found[:6] == 0.0).all()
    return found[6:]


def test_motions_of_the_body_teach_more_than_noise(seen):
    full = elastic("full")
    for n in (12, 18):
        learnt, guessed = (elastic(rom.Snapshots(X, n=n)) / full - 1 for X in (seen, RANDOM))
        assert (learnt >= -1e-9).all() and (guessed >= -1e-9).all()
        assert learnt.max() < 0.1 * guessed.max()
    assert learnt.max() < 1e-6
    assert_allclose(elastic(rom.Snapshots(RANDOM, n=N)), full, rtol=1e-9)  # a complete set
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
    (lambda: rom.Snapshots(np.ones((48, 0)), n=6), r"shape \(48, 0\)"),
    (lambda: rom.Snapshots(np.zeros((48, 3)), n=6), "all 3 snapshots are zero"),
    (lambda: rom.Snapshots(np.diag([1.0, 1.0, np.nan]), n=6), r"values = .* is not finite"),
    (lambda: rom.Snapshots(RANDOM), "exactly one of energy and n"),
    (lambda: rom.Snapshots(RANDOM, n=8, energy=0.9), "exactly one of energy and n"),
    (tied(ROOT, rom.Snapshots(RANDOM[:45], n=6)), "45 dofs do not fit .*'root' with 48"),
    (tied(ROOT, rom.Snapshots(RANDOM[:, :4], n=11)), "but the 4 .* 'root' hold 10 independent"),
    error=ConfigError,
)


def test_one_surface_with_different_functions_on_its_sides_is_not_coupled(seen):
    behind = block(cells=(6, 3, 3), origin=(1.0, 0, 0))
    a = reduced(4, MODEL, interfaces={"tip": rom.Snapshots(seen, n=10)})
    b = reduced(4, behind, interfaces={"root": rom.Snapshots(RANDOM, n=10)})
    said, coupling = "share 16 nodes, but .* functions of its own", (("a", "tip"), ("b", "root"))
    refuses(InterfaceError, said, rom.Assembly, {"a": a, "b": b}, (coupling,))
