"""Loads inside a body: the reduced static answer is the full one; both implementations."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.operators import KINDS
from cases.solid import block
from rom.errors import ConfigError
from rom.reduction.interfaces.connection import connect

INTERFACES = {"root": "rbe2", "tip": "polynomial:1"}


@pytest.fixture(scope="module")
def model():
    return block(cells=(10, 2, 2))


@pytest.fixture(params=KINDS)
def connection(request, model):
    return connect(request.param(model), model, INTERFACES)


def pinch(model):
    """Two loads on nodes off the interfaces, and one along a whole row."""
    F = np.zeros((model.n_dofs, 2))
    F[3 * 40 + 1, 0], F[3 * 50 + 2, 0] = 1.0, -1.0
    F[3 * np.arange(30, 60), 1] = 0.3
    return F


def static_error(connection, method, F):
    """Error of the static deflection with the root held, relative to the largest one."""
    ops, root = connection.ops, connection.boundary[connection.parts["root"]]
    full = ops.hold(root)(F)
    basis = method.basis(ops, connection.boundary, connection.labels)
    free = np.setdiff1d(np.arange(basis.Psi.shape[1]), connection.parts["root"])
    Psi = basis.Psi[:, free]
    reduced = Psi @ np.linalg.solve(Psi.T @ ops.apply_K(Psi), Psi.T @ F)
    return np.abs(reduced - full).max() / np.abs(full).max()


@pytest.mark.parametrize("method", [rom.Guyan(), rom.CraigBampton(3), rom.MomentMatching((0.0,))])
def test_statics_under_the_loads_is_exact(connection, model, method):
    F = connection.ops.restrict(pinch(model))
    assert static_error(connection, method, F) > 1e-4
    assert static_error(connection, rom.WithLoads(method, pinch(model)), F) < 1e-9


def test_gravity_is_a_load(connection):
    F = connection.ops.apply_M(connection.ops.rigid[:, :3])
    assert static_error(connection, rom.Guyan(), F) > 1e-3
    assert static_error(connection, rom.WithLoads(rom.Guyan()), F) < 1e-9


def test_restrict_is_the_adjoint_of_expand(connection, model):
    rng, ops = np.random.default_rng(2), connection.ops
    a, F = rng.normal(size=(ops.n, 3)), rng.normal(size=(model.n_dofs, 2))
    assert_allclose(ops.expand(a).T @ F, a.T @ ops.restrict(F), rtol=1e-10)


def test_what_the_basis_knows_is_not_added_again(connection, model):
    method = rom.WithLoads(rom.WithLoads(rom.CraigBampton(4), pinch(model)), pinch(model))
    basis = method.basis(connection.ops, connection.boundary, connection.labels)
    assert sum(label.startswith("load") for label in basis.labels) == 2
    assert basis.omega.size == 4
    assert basis.labels[-4:] == tuple(f"fixed-interface {k}" for k in (1, 2, 3, 4))


def test_the_body_has_a_certificate(model):
    method = rom.WithLoads(rom.CraigBampton(25), pinch(model))
    body = rom.reduce(model, method=method, interfaces=INTERFACES)
    assert body.certificate.ok, body.certificate


@pytest.mark.parametrize(
    ("method", "loads", "words"),
    [
        (rom.Guyan(), "wind", "the only word known"),
        (rom.Guyan(), np.zeros((5, 1)), r"shape \(5, 1\)"),
        (rom.Guyan(), np.full((297, 1), np.nan), "finite forces"),
        (rom.FreeFree(3), "gravity", "has no constraint modes"),
    ],
)
def test_messages(connection, method, loads, words):
    with pytest.raises(ConfigError, match=words):
        rom.WithLoads(method, loads).basis(connection.ops, connection.boundary, connection.labels)
