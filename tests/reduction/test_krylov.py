"""Moments, loads inside and balanced modes: exact where asked; both implementations."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.operators import KINDS
from cases.refusals import refused, refuses
from cases.solid import block
from rom import second_order_balanced_truncation
from rom.errors import ConfigError, InterfaceError, ModelError, ResourceError, SolverError
from rom.reduction.interfaces.connection import connect

INTERFACES = {"root": "rbe2", "tip": "rbe2"}
MODEL = block(cells=(10, 2, 2))


@pytest.fixture(params=KINDS)
def connection(request):
    return connect(request.param(MODEL), MODEL, INTERFACES)


def dynamic_stiffness(K, M, s, b):
    """What the boundary feels of K - s M."""
    S, i = K - s * M, np.setdiff1d(np.arange(len(K)), b)
    return S[np.ix_(b, b)] - S[np.ix_(b, i)] @ np.linalg.solve(S[np.ix_(i, i)], S[np.ix_(i, b)])


def errors(connection, method, shifts):
    ops, b = connection.ops, connection.boundary
    E = np.eye(ops.n)
    K, M = ops.apply_K(E), ops.apply_M(E)
    basis = method.basis(ops, b, connection.labels)
    K_r, M_r = basis.Psi.T @ K @ basis.Psi, basis.Psi.T @ M @ basis.Psi
    found = []
    for s in shifts:
        exact = dynamic_stiffness(K, M, s, b)
        ours = dynamic_stiffness(K_r, M_r, s, np.arange(b.size))
        size = np.sqrt(np.abs(np.diag(K_r)[: b.size]))
        found.append(np.abs((ours - exact) / np.outer(size, size)).max())
    return np.array(found)


def shift(f):
    return (2 * np.pi * f) ** 2


def test_the_dynamic_stiffness_is_exact_where_asked(connection):
    method = rom.MomentMatching(frequencies=(0.0, 900.0, 2500.0), order=1)
    at = errors(connection, method, [0.0, shift(900.0), shift(2500.0)])
    assert (at < 1e-9).all()
    beside = errors(connection, method, [shift(4000.0)])
    assert beside > 1e-6  # and nowhere else by accident


@pytest.mark.parametrize("order", [1, 2])
def test_twice_the_order_is_matched(connection, order):
    """Around s the error grows with the power 2 k of the distance (Galerkin)."""
    s, h = shift(1000.0), {1: 0.04, 2: 0.08}[order]
    near = errors(connection, rom.MomentMatching((1000.0,), order), [s * (1 + h), s * (1 + 2 * h)])
    assert np.log2(near[1] / near[0]) == pytest.approx(2 * order, abs=0.5)


def test_at_rest_the_static_set_counts_as_one_more_and_a_resonance_is_refused(connection):
    near = errors(connection, rom.MomentMatching((0.0,), 1), [shift(100.0), 2 * shift(100.0)])
    assert np.log2(near[1] / near[0]) == pytest.approx(4, abs=0.3)
    ops, b = connection.ops, connection.boundary
    f = float(ops.modes(b, 2)[0][0]) / (2 * np.pi)
    basis = rom.MomentMatching((f,), 1).basis
    refuses(SolverError, "interfaces held|is singular", basis, ops, b, connection.labels)


def test_frequencies_are_upper_bounds_and_converge(connection):
    full = rom.modes(MODEL, 14, interfaces=INTERFACES).frequencies[6:]
    worst = []
    for order in (1, 2, 3):
        method = rom.MomentMatching((0.0, 1500.0), order)
        body = rom.reduce(MODEL, method=method, interfaces=INTERFACES, certify=False)
        reduced = body.frequencies()[6:14]
        assert (reduced >= full * (1 - 1e-9)).all()
        worst.append((reduced / full - 1).max())
    assert worst[0] > worst[1] > worst[2]
    assert worst[2] < 1e-4


def test_the_body_has_a_certificate():
    loaded = rom.WithLoads(rom.CraigBampton(25), PINCH)
    for method, kinds in ((rom.MomentMatching((0.0, 1500.0), 3), INTERFACES), (loaded, MIXED)):
        body = rom.reduce(MODEL, method=method, interfaces=kinds)
        assert body.certificate.ok, body.certificate


test_wrong_frequencies_are_refused = refused(
    (lambda: rom.MomentMatching(()), "a frequency"),
    (lambda: rom.MomentMatching((-1.0,)), "frequencies = -1 must not be negative"),
    (lambda: rom.MomentMatching((5.0, 5.0)), "frequencies: 5.0 is given twice"),
    error=ConfigError,
)


def test_messages_for_wrong_boundaries(connection):
    method = rom.MomentMatching()
    refuses(ConfigError, "none is given", method.basis, connection.ops, np.zeros(0, dtype=int), ())
    few, words = connection.boundary[:3], "leave a rigid motion free"
    refuses(InterfaceError, words, method.basis, connection.ops, few, ("",) * 3)


MIXED = {"root": "rbe2", "tip": "polynomial:1"}
PINCH = np.zeros((MODEL.n_dofs, 2))  # two loads on nodes off the interfaces, one along a whole row
PINCH[3 * 40 + 1, 0], PINCH[3 * 50 + 2, 0] = 1.0, -1.0
PINCH[3 * np.arange(30, 60), 1] = 0.3


@pytest.fixture(params=KINDS)
def mixed(request):
    return connect(request.param(MODEL), MODEL, MIXED)


def static_error(mixed, method, F):
    ops, root = mixed.ops, mixed.boundary[mixed.parts["root"]]
    full = ops.hold(root)(F)
    basis = method.basis(ops, mixed.boundary, mixed.labels)
    free = np.setdiff1d(np.arange(basis.Psi.shape[1]), mixed.parts["root"])
    Psi = basis.Psi[:, free]
    reduced = Psi @ np.linalg.solve(Psi.T @ ops.apply_K(Psi), Psi.T @ F)
    return np.abs(reduced - full).max() / np.abs(full).max()


@pytest.mark.parametrize("method", [rom.Guyan(), rom.CraigBampton(3), rom.MomentMatching((0.0,))])
def test_statics_under_the_loads_is_exact(mixed, method):
    F = mixed.ops.restrict(PINCH)
    assert static_error(mixed, method, F) > 1e-4
    assert static_error(mixed, rom.WithLoads(method, PINCH), F) < 1e-9


def test_gravity_is_a_load_and_restrict_the_adjoint_of_expand(mixed):
    F = mixed.ops.apply_M(mixed.ops.rigid[:, :3])
    assert static_error(mixed, rom.Guyan(), F) > 1e-3
    assert static_error(mixed, rom.WithLoads(rom.Guyan()), F) < 1e-9
    rng, ops = np.random.default_rng(2), mixed.ops
    a, F = rng.normal(size=(ops.n, 3)), rng.normal(size=(MODEL.n_dofs, 2))
    assert_allclose(ops.expand(a).T @ F, a.T @ ops.restrict(F), rtol=1e-10)


def test_what_the_basis_knows_is_not_added_again(mixed):
    method = rom.WithLoads(rom.WithLoads(rom.CraigBampton(4), PINCH), PINCH)
    basis = method.basis(mixed.ops, mixed.boundary, mixed.labels)
    assert sum(label.startswith("load") for label in basis.labels) == 2
    assert basis.omega.size == 4
    assert basis.labels[-4:] == tuple(f"fixed-interface {k}" for k in (1, 2, 3, 4))


def test_loads_that_are_none_and_methods_without_constraint_modes_are_refused(mixed):
    for method, loads, words in (
        (rom.Guyan(), "wind", "'wind' is none of 'gravity'"),
        (rom.Guyan(), np.zeros((5, 1)), r"shape \(5, 1\)"),
        (rom.Guyan(), np.full((297, 1), np.nan), "is not finite"),
        (rom.FreeFree(3), "gravity", "has no constraint modes"),
    ):
        basis = rom.WithLoads(method, loads).basis
        refuses(ConfigError, words, basis, mixed.ops, mixed.boundary, mixed.labels)


def modal(omega, zeta, b, c):
    D = np.diag(2 * zeta * omega)
    return second_order_balanced_truncation(
        np.diag(omega**2), np.eye(omega.size), D, b[:, None], c[None], omega.size
    )


def test_oscillators_have_the_singular_values_of_their_impulse_responses():
    """The integral of its square is b^2 / (4 zeta omega^3); light damping separates modes."""
    found = modal(np.array([100.0]), 0.05, np.array([3.0]), np.array([2.0]))
    assert_allclose(found.singular_values, 3.0 * 2.0 / (4 * 0.05 * 100.0**3), rtol=1e-10)
    assert_allclose(found.K, 100.0**2)
    assert_allclose(found.C @ found.B, 6.0)
    omega = np.array([100.0, 250.0, 700.0, 2000.0])
    b, c = np.array([1.0, 2.0, 0.5, 3.0]), np.array([1.0, 0.3, 2.0, 1.0])
    exact = np.sort(b * c / (4 * 0.001 * omega**3))[::-1]
    assert_allclose(modal(omega, 0.001, b, c).singular_values, exact, rtol=1e-4)


def response(K, M, D, B, C, s):
    return (C @ np.linalg.solve(K + 1j * s * D - s**2 * M, B))[0, 0]


def test_the_response_converges_and_is_exact_with_all_coordinates():
    n, grid = 12, np.linspace(10.0, 2500.0, 100)
    K = 1e6 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    M, B = np.diag(np.random.default_rng(0).uniform(0.5, 2.0, n)), np.eye(n)[:, 3:4]
    system = K, M, 1e-4 * K + 0.1 * M, B, B.T
    full = np.array([response(*system, s) for s in grid])
    worst = []
    for r in (2, 6, 8, 10, 12):
        f = second_order_balanced_truncation(*system, r)
        ours = np.array([response(f.K, f.M, f.D, f.B, f.C, s) for s in grid])
        worst.append(np.abs(ours - full).max() / np.abs(full).max())
        assert np.linalg.eigvals(f.K).real.min() > 0.0
    assert (np.diff(worst) < 0).all()
    assert worst[3] < 1e-5 and worst[4] < 1e-11


def test_frequencies_of_a_body_are_upper_bounds_and_statics_is_exact(connection):
    ops = connection.ops
    basis = rom.BalancedTruncation(6, pool=40).basis(ops, connection.boundary, connection.labels)
    K, M = (ops.gram(basis.Psi, A(basis.Psi)) for A in (ops.apply_K, ops.apply_M))
    inner = slice(12, 18)
    assert np.abs(K[:12, inner]).max() < 1e-8 * np.abs(np.diag(K)).max()
    exact, _ = ops.modes(connection.boundary, 6)
    assert (basis.omega >= exact * (1 - 1e-9)).all()
    assert_allclose(np.sqrt(np.diag(K)[inner]), basis.omega, rtol=1e-8)
    assert_allclose(M[inner, inner], np.eye(6), atol=1e-9)


def test_modes_that_interfaces_neither_move_nor_feel_leave_first():
    """The pool in its own order, judged by what interfaces see: the sum of participations grows."""
    seen = []
    for method in (rom.BalancedTruncation(6, pool=40), rom.CraigBampton(6)):
        body = rom.reduce(MODEL, method=method, interfaces=INTERFACES, certify=False)
        seen.append(body.effective_mass(fixed=tuple(INTERFACES)).sum())
    assert seen[0] > seen[1]


def truncated(K, M, D, r=1):
    second_order_balanced_truncation(K, M, D, np.ones((len(K), 1)), np.ones((1, len(K))), r)


test_wrong_systems_are_refused = refused(
    (lambda: truncated(np.eye(2), np.eye(2), np.zeros((2, 2))), ModelError, "not stable"),
    (lambda: truncated(np.eye(2), np.eye(3), np.eye(2)), ConfigError, "M has shape"),
    (lambda: truncated(*[np.eye(2)] * 3, r=3), ConfigError, "r = 3"),
    (lambda: truncated(*[np.eye(601)] * 3), ResourceError, "above 600"),
    (lambda: truncated(*[np.eye(2)] * 3, r=2), ConfigError, "only 1 coordinates"),
)
