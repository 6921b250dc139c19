"""Bodies of neo-Hookean material whose energy is that of a few weighted elements."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import rom
from cases.long import COARSE
from cases.mbs.mechanisms import prepared, random_state, residual_at, stored_at, tangents_at
from cases.mbs.slender import TIMBER, assembled, cantilever, reduced
from cases.mbs.tangents import difference, shifted
from cases.refusals import refuses
from rom.body.nonlinear.sampled import Sampled, chosen
from rom.errors import ConfigError, ModelError

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = COARSE
RUBBER = rom.Material(E=3e6, nu=0.3, rho=1100.0)
THICK = 0.04
EI = 3e6 * THICK**4 / 12
LOADS = (0, 0, EI, 0, 0, 0)


def all_points(model, E):
    """The energy of shapes with all elements, and the element of each point."""
    G, w, cell, C = model.stresses.large_strain().at_points(E)
    K = np.eye(E.shape[1])
    return Sampled(K, G, w, np.column_stack([C[:, 0, 1], C[:, 3, 3]])), cell


@pytest.fixture(scope="module")
def bent():
    """A strip of rubber, one metre long, that bends to 26 degrees."""
    model = assembled((1.0, THICK, THICK), (12, 1, 2), material=RUBBER)
    return reduced(model, LOADS, n_modes=2, active=1, n_steps=2, sampling=1e-3, certify=True)


def test_energy_force_and_tangent_are_those_of_the_finite_elements():
    """Against the derivatives that UFL takes, and those of the matrices of the full solid."""
    import ufl
    from dolfinx import fem

    model = assembled(cells=(2, 1, 2), distorted=True, material=RUBBER)
    rng = np.random.default_rng(1)
    E, q = 5e-4 * rng.standard_normal((model.n_dofs, 4)), rng.standard_normal(4)
    found, _ = all_points(model, E)
    solid = model.stresses.finite_strain(neo_hookean=True)
    solid.dx = ufl.dx(metadata={"quadrature_degree": model.stresses.large_strain().order})
    u = fem.Function(model.stresses.V)
    u.x.array[:] = E @ q
    lam, mu = (RUBBER.stiffness[k] for k in ((0, 1), (3, 3)))
    F = ufl.Identity(3) + ufl.grad(u)
    log = ufl.ln(ufl.det(F))
    W = 0.5 * mu * (ufl.inner(F, F) - 3) - mu * log + 0.5 * lam * log**2
    assert_allclose(found.energy(q), fem.assemble_scalar(fem.form(W * solid.dx)), rtol=1e-9)
    force, K = E.T @ solid.force(E @ q), E.T @ (solid.tangent(E @ q) @ E)
    assert_allclose(found.force(q), force, rtol=0, atol=1e-10 * np.abs(force).max())
    assert_allclose(found.tangent(q), K, rtol=0, atol=1e-10 * np.abs(K).max())
    assert found.expansion(np.array([1e3, 0, 0, 0]))[0] == np.inf


def test_a_block_is_pulled_as_the_closed_form_says():
    """Stretch a along x, b across with mu (b^2 - 1) + lam ln(a b^2) = 0."""
    model = assembled((1.0, 0.4, 0.3), (2, 1, 1), material=RUBBER)
    x = model.points
    E = np.column_stack([np.kron(x[:, k], np.eye(3)[k]) for k in range(3)])
    found, _ = all_points(model, E)
    lam, mu = RUBBER.stiffness[0, 1], RUBBER.stiffness[3, 3]
    for a in (0.5, 1.8):
        b = brentq(lambda b, a=a: mu * (b * b - 1) + lam * np.log(a * b * b), 0.1, 3)
        force = found.force(np.array([a, b, b]) - 1) / (0.4 * 0.3)
        assert_allclose(force, [mu * (a - 1 / a) + lam * np.log(a * b * b) / a, 0, 0], atol=1e-3)


def test_few_elements_bear_the_loads_of_the_range_as_all_do(bent):
    """The full solid of the same law at loads and frequencies that were trained and were not."""
    compared = [row for row in bent.certificate.rows if "tip f_z" in row.quantity]
    beside = [row for row in compared if "compliance" in row.quantity]
    assert len(compared) == 8 and all(row.ok for row in compared if row not in beside)
    assert not any(row.ok for row in beside)  # nothing was trained in twisting
    how = bent.provenance["sampling"]
    assert how["error of forces"] <= 1e-3 and how["elements"] < how["of"]
    assert_allclose(how["volume"], 1.0, rtol=0.1)
    assert how["elements"] == len(bent.quartic.weights) / 125
    mech, part = cantilever(bent)
    mech.force("load", part.marker("tip"), LOADS[:3])
    q = bent.equilibria({"tip": LOADS}, shares=(0.5, 1.0))[-1]
    found = rom.equilibrium(mech, steps=4).q[7:]
    assert_allclose(found, q, rtol=0, atol=1e-6 * np.abs(q).max())


def test_weights_are_found_where_they_are_known():
    """Three elements of unlike forces and a fourth that is the sum of two: it stands for both."""
    rng = np.random.default_rng(2)
    G = rng.standard_normal((4, 9, 5))
    every = Sampled(np.eye(5), G, np.ones(4), np.ones((4, 2)))
    states = 0.05 * rng.standard_normal((6, 5))
    twice = replace(every, gradients=np.concatenate([G, G[:1]]), weights=np.ones(5),
                    lame=np.ones((5, 2)))  # fmt: skip
    weights, error = chosen(twice, np.arange(5), states, 1e-10)
    assert error < 1e-10 and np.count_nonzero(weights) == 4
    assert_allclose(weights[1:4], 1.0, atol=1e-8)
    assert_allclose(weights[0] + weights[4], 2.0, atol=1e-8)


def test_forces_are_slopes_of_the_energy_in_a_mechanism_too(bent):
    body, mech = bent, rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("a", body)
    mech.add_flexible("b", body, at=(0, 1, 0))
    packed, W = prepared(mech)
    q, v, _, lam = random_state(np.random.default_rng(3), packed)
    for at in packed.system.bodies.q_at + 7:
        mine = slice(at, at + body.n_modes)
        q[mine] *= 0.1 / np.abs(body.quartic.gradients @ q[mine]).max()
    none = 0 * v

    def force(delta):
        residual_at(packed.system, W, shifted(packed, q, delta), none, none, lam)
        return W.residual.copy()

    K = difference(force, v.size)
    force(none)
    tangents_at(packed.system, W, q, none, none, lam, (0.0, 0.0, 1.0))
    assert_allclose(W.Kt, K, atol=1e-6 * np.abs(K).max())
    beyond = force(none)  # that of small deflection is the body's own
    for q_at, v_at in zip(packed.system.bodies.q_at, packed.system.bodies.v_at, strict=True):
        mine = slice(q_at + 7, q_at + 7 + body.n_modes)
        beyond[v_at + 6 : v_at + 6 + body.n_modes] -= body.K @ q[mine]

    def stored(delta):
        return np.array([stored_at(packed.system, W, shifted(packed, q, delta), none)])

    slope = difference(stored, v.size)[0]
    assert_allclose(beyond, slope, atol=3e-6 * np.abs(slope).max())


def test_what_sampled_elements_cannot_do_is_refused_by_name(bent, tmp_path):
    body, model = bent, assembled(cells=(2, 1, 1))
    refuses(ConfigError, "which no file holds", rom.save, body, tmp_path / "body.rom.npz")
    refuses(ConfigError, "one unit system", body.in_units, "mm-t-s")
    refuses(ConfigError, "sampling = 2", rom.Geometric, loads={"tip": LOADS}, sampling=2)
    with pytest.raises(ConfigError, match="sampling and spin"):
        reduced(model, LOADS, n_modes=1, active=0, n_steps=1, sampling=0.1, spin=(0, 0, 1.0))
    with pytest.raises(ConfigError, match="stress and sampling"):
        reduced(model, LOADS, method=rom.Guyan(), stress=True, sampling=0.1)
    grown = assembled(cells=(2, 1, 1), material=TIMBER)
    with pytest.raises(ModelError, match="is isotropic"):
        reduced(grown, (0, 1.0, 0, 0, 0, 0), n_modes=1, active=0, sampling=0.1)
