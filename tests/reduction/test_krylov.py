"""Moment matching: exact at the frequencies chosen, to twice the order; both implementations."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.operators import KINDS
from cases.refusals import refused, refuses
from cases.solid import block
from rom.errors import ConfigError, InterfaceError, SolverError
from rom.reduction.interfaces.connection import connect

INTERFACES = {"root": "rbe2", "tip": "rbe2"}


@pytest.fixture(scope="module")
def model():
    return block(cells=(10, 2, 2))


@pytest.fixture(params=KINDS)
def connection(request, model):
    return connect(request.param(model), model, INTERFACES)


def dynamic_stiffness(K, M, s, b):
    """What the boundary feels of K - s M."""
    S, inner = K - s * M, np.setdiff1d(np.arange(len(K)), b)
    return S[np.ix_(b, b)] - S[np.ix_(b, inner)] @ np.linalg.solve(
        S[np.ix_(inner, inner)], S[np.ix_(inner, b)]
    )


def errors(connection, method, shifts):
    """Relative error of the dynamic stiffness of the reduced body at each shift."""
    ops, b = connection.ops, connection.boundary
    E = np.eye(ops.n)
    K, M = ops.apply_K(E), ops.apply_M(E)
    basis = method.basis(ops, b, connection.labels)
    K_r, M_r = basis.Psi.T @ K @ basis.Psi, basis.Psi.T @ M @ basis.Psi
    found = []
    for s in shifts:
        exact, ours = (
            dynamic_stiffness(*pair, s, dofs)
            for pair, dofs in (((K, M), b), ((K_r, M_r), np.arange(b.size)))
        )
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


def test_at_rest_the_static_set_counts_as_one_more(connection):
    near = errors(connection, rom.MomentMatching((0.0,), 1), [shift(100.0), 2 * shift(100.0)])
    assert np.log2(near[1] / near[0]) == pytest.approx(4, abs=0.3)


def test_frequencies_are_upper_bounds_and_converge(connection, model):
    full = rom.modes(model, 14, interfaces=INTERFACES).frequencies[6:]
    worst = []
    for order in (1, 2, 3):
        method = rom.MomentMatching((0.0, 1500.0), order)
        body = rom.reduce(model, method=method, interfaces=INTERFACES, certify=False)
        reduced = body.frequencies()[6:14]
        assert (reduced >= full * (1 - 1e-9)).all()
        worst.append((reduced / full - 1).max())
    assert worst[0] > worst[1] > worst[2]
    assert worst[2] < 1e-4


def test_the_body_has_a_certificate(model):
    method = rom.MomentMatching((0.0, 1500.0), 3)
    body = rom.reduce(model, method=method, interfaces=INTERFACES)
    assert body.certificate.ok, body.certificate


def test_enough_moments_are_the_whole_body():
    model = block(cells=(2, 1, 1))
    kinds = {"root": "full", "tip": "full"}
    body = rom.reduce(model, method=rom.MomentMatching((0.0,), 3), interfaces=kinds, certify=False)
    full = rom.modes(model, model.n_dofs, interfaces=kinds).frequencies
    assert body.n_modes + 6 == model.n_dofs
    assert_allclose(body.frequencies()[6:], full[6:], rtol=1e-8)


def test_a_resonance_is_refused(connection):
    ops, b = connection.ops, connection.boundary
    omega, _ = ops.modes(b, 2)
    f = float(omega[0]) / (2 * np.pi)
    with pytest.raises(SolverError, match=r"interfaces held|is singular"):
        rom.MomentMatching((f,), 1).basis(ops, b, connection.labels)


test_wrong_frequencies_are_refused = refused(
    (lambda: rom.MomentMatching(()), "a frequency"),
    (lambda: rom.MomentMatching((-1.0,)), "0 Hz"),
    (lambda: rom.MomentMatching((5.0, 5.0)), "different"),
    error=ConfigError,
)


def test_messages_for_wrong_boundaries(connection):
    method = rom.MomentMatching()
    refuses(ConfigError, "none is given", method.basis, connection.ops, np.zeros(0, dtype=int), ())
    with pytest.raises(InterfaceError, match="leave a rigid motion free"):
        method.basis(connection.ops, connection.boundary[:3], ("",) * 3)
