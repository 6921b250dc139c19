"""Second-order balanced truncation: closed forms of one oscillator, and what a body keeps."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.operators import KINDS
from cases.refusals import refused
from cases.solid import block
from rom.errors import ConfigError, ModelError, ResourceError
from rom.reduction.interfaces.connection import connect

INTERFACES = {"root": "rbe2", "tip": "rbe2"}


def chain(n=12):
    K = 1e6 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    M = np.diag(np.random.default_rng(0).uniform(0.5, 2.0, n))
    B = np.zeros((n, 1))
    B[3] = 1.0
    return K, M, 1e-4 * K + 0.1 * M, B, B.T


def response(K, M, D, B, C, s):
    return (C @ np.linalg.solve(K + 1j * s * D - s**2 * M, B))[0, 0]


def test_one_oscillator_has_the_singular_value_of_its_impulse_response():
    """The integral of its square is b^2 / (4 zeta omega^3)."""
    omega, zeta = 100.0, 0.05
    found = rom.second_order_balanced_truncation(
        [[omega**2]], [[1.0]], [[2 * zeta * omega]], [[3.0]], [[2.0]], 1
    )
    assert_allclose(found.singular_values, 3.0 * 2.0 / (4 * zeta * omega**3), rtol=1e-10)
    assert_allclose(found.K, omega**2)
    assert_allclose(found.C @ found.B, 6.0)


def test_light_damping_separates_the_modes():
    omega, zeta = np.array([100.0, 250.0, 700.0, 2000.0]), 0.001
    b, c = np.array([[1.0], [2.0], [0.5], [3.0]]), np.array([[1.0, 0.3, 2.0, 1.0]])
    found = rom.second_order_balanced_truncation(
        np.diag(omega**2), np.eye(4), np.diag(2 * zeta * omega), b, c, 4
    )
    exact = np.sort(b[:, 0] * c[0] / (4 * zeta * omega**3))[::-1]
    assert_allclose(found.singular_values, exact, rtol=1e-4)


def test_the_response_converges_and_is_exact_with_all_coordinates():
    system, grid = chain(), np.linspace(10.0, 2500.0, 100)
    full = np.array([response(*system, s) for s in grid])
    worst = []
    for r in (2, 6, 8, 10, 12):
        f = rom.second_order_balanced_truncation(*system, r)
        ours = np.array([response(f.K, f.M, f.D, f.B, f.C, s) for s in grid])
        worst.append(np.abs(ours - full).max() / np.abs(full).max())
        assert np.linalg.eigvals(f.K).real.min() > 0.0
    assert (np.diff(worst) < 0).all()
    assert worst[3] < 1e-5
    assert worst[4] < 1e-11


@pytest.mark.parametrize("make", KINDS)
def test_frequencies_of_a_body_are_upper_bounds_and_statics_is_exact(make):
    model = block(cells=(10, 2, 2))
    connection = connect(make(model), model, INTERFACES)
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
    model = block(cells=(10, 2, 2))
    body, modal = (
        rom.reduce(model, method=method, interfaces=INTERFACES, certify=False)
        for method in (rom.BalancedTruncation(6, pool=40), rom.CraigBampton(6))
    )
    seen = [b.effective_mass(fixed=tuple(INTERFACES)).sum() for b in (body, modal)]
    assert seen[0] > seen[1]


def truncated(K, M, D, r=1):
    rom.second_order_balanced_truncation(K, M, D, np.ones((len(K), 1)), np.ones((1, len(K))), r)


test_wrong_systems_are_refused = refused(
    (lambda: truncated(np.eye(2), np.eye(2), np.zeros((2, 2))), ModelError, "not stable"),
    (lambda: truncated(np.eye(2), np.eye(3), np.eye(2)), ConfigError, "M has shape"),
    (lambda: truncated(*[np.eye(2)] * 3, r=3), ConfigError, "r = 3"),
    (lambda: truncated(*[np.eye(601)] * 3), ResourceError, "above 600"),
    (lambda: truncated(*[np.eye(2)] * 3, r=2), ConfigError, "only 1 coordinates"),
)
