"""Stress recovery against closed forms, and the reduced static stress against the full one."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import null_space

import rom
from benchmarks.models import bar
from cases.refusals import refuses
from cases.solid import KINDS, STEEL
from rom.errors import ConfigError
from rom.reduction.full_model import operators
from rom.reduction.interfaces.connection import connect

pytestmark = pytest.mark.fenicsx
L, B, H = 0.4, 0.05, 0.03


def beam(degree=2, lc=0.02):
    parameters = {"L": L, "b": B, "h": H, "lc": lc}
    return rom.fe.model("meshes/beam.geo", material=STEEL, parameters=parameters, degree=degree)


@pytest.fixture(scope="module")
def model():
    return beam()


def stressed(model, n=4, kinds=KINDS, **options):
    options = {"method": rom.CraigBampton(n), "stress": True, "certify": False} | options
    return rom.reduce(model, interfaces=kinds, **options)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_a_uniform_strain_has_its_stress_everywhere(degree):
    """Patch test with Hooke's law in closed form; a rotation beside it has no stress."""
    model = beam(degree, 0.06)
    A = 1e-3 * np.array([[1.0, 0.4, -0.2], [0.1, -0.5, 0.3], [0.7, -0.6, 0.2]])
    e = 0.5 * (A + A.T)
    voigt = [e[0, 0], e[1, 1], e[2, 2], 2 * e[1, 2], 2 * e[0, 2], 2 * e[0, 1]]
    exact = STEEL.stiffness @ voigt
    u = (model.points @ A.T).reshape(-1, 1)
    found = model.stresses.at_nodes(u, model.surface.nodes)
    every = np.tile(exact, (len(found), 1))
    assert_allclose(found[:, :, 0], every, atol=1e-9 * abs(exact).max())


def test_pure_bending_is_linear_over_the_height(model):
    """Prismatic bar bent about y by the curvature kappa: sigma_xx = -E kappa z alone."""
    x, y, z = model.points.T
    nu, kappa = STEEL.nu, 1e-2
    u = kappa * np.stack([-x * z, nu * y * z, 0.5 * (x**2 + nu * (z**2 - y**2))], axis=1)
    nodes = model.surface.nodes
    found = model.stresses.at_nodes(u.reshape(-1, 1), nodes)[:, :, 0]
    exact = np.zeros_like(found)
    exact[:, 0] = -STEEL.E * kappa * z[nodes]
    assert_allclose(found, exact, atol=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize("kind", ["rbe2", "rbe3", "polynomial:2"])
@pytest.mark.parametrize("reference", ["mean-axis", "root"])
def test_the_reduced_static_stress_is_the_full_one(model, kind, reference):
    """Loads on the tip, the root held: constraint modes are exact, and so is their stress."""
    kinds = {"root": "rbe2", "tip": kind}
    body = stressed(model, 3, kinds, reference=reference)
    connection = connect(operators(model), model, kinds)
    ops, root, tip = connection.ops, connection.held(("root",)), connection.held(("tip",))
    F = np.zeros((ops.n_local, 6))
    F[tip[:6], np.arange(6)] = 1e3
    full = model.stresses.at_nodes(ops.expand(ops.hold(root)(F)), model.surface.nodes)
    held, tip_rows = body.marker("root").hold, body.marker("tip").hold
    rigid = -np.linalg.lstsq(held[:, :6], held[:, 6:], rcond=None)[0]
    motion = tip_rows[:6, :6] @ rigid + tip_rows[:6, 6:]  # of the coordinates that carry loads
    for k in range(6):
        q = np.linalg.solve(body.K, motion[k] * 1e3)
        size = np.abs(full[:, :, k]).max()
        assert_allclose(body.stress.field(q), full[:, :, k], atol=1e-9 * size)


def test_stress_survives_files_and_a_change_of_frame(model, tmp_path):
    meshio = pytest.importorskip("meshio", reason="meshio is not installed")
    body = stressed(model)
    q = np.linspace(1.0, 2.0, body.n_modes)
    rom.save(body, tmp_path / "beam.rom.npz")
    again = rom.load(tmp_path / "beam.rom.npz")
    assert np.array_equal(again.stress.field(q), body.stress.field(q))
    xx, yy, zz, yz, xz, xy = body.stress.field(q).T
    deviator = np.array([xx, yy, zz]) - (xx + yy + zz) / 3
    second = 0.5 * (deviator**2).sum(axis=0) + yz**2 + xz**2 + xy**2
    assert_allclose(body.stress.von_mises(q), np.sqrt(3 * second), rtol=1e-10)
    rom.write_stress(body, q, tmp_path / "beam.vtu")
    seen = meshio.read(tmp_path / "beam.vtu").point_data
    assert_allclose(seen["stress xx yy zz yz xz xy [Pa]"], body.stress.field(q))
    assert_allclose(seen["von Mises stress [Pa]"].ravel(), body.stress.von_mises(q))
    assert_allclose(seen["displacement [m]"].ravel(), body.surface.shape @ q)
    # the same deformation seen from another frame has the same stress: largest over a mode
    for fixed in ((), ("root",)):
        one, other = (b.modes(9, fixed=fixed)[1][6:, 8] for b in (body, body.with_reference("tip")))
        stresses = [body.stress.field(one), body.with_reference("tip").stress.field(other)]
        sign = np.sign(np.sum(stresses[0] * stresses[1]))
        assert_allclose(stresses[1], sign * stresses[0], atol=1e-7 * np.abs(stresses[0]).max())


def test_what_has_no_stress_is_named(model):
    body, plain = stressed(model, 2), bar((0.4, 0.05, 0.03), (4, 1, 1))
    without, q = replace(body, stress=None), np.zeros(8)
    refuses(ConfigError, "cannot be recovered", rom.write_stress, without, q, "x.vtu")
    refuses(ConfigError, r"q has shape \(3,\)", body.stress.field, np.zeros(3))
    refuses(ConfigError, "has no finite elements", stressed, plain, method=rom.Guyan())
    body = stressed(model, method=rom.Rubin(5))  # the correction needs constraint modes
    q, states = np.zeros(body.n_modes), np.zeros(12 + body.n_modes)
    refuses(ConfigError, "stress of the modes it left out", body.stress.field, q, states)
    mech = rom.Mechanism()
    mech.add_rigid("ball", mass=1.0, inertia=np.eye(3), at=(0, 0, 0))
    sol = rom.simulate(mech, t_end=1e-3, dt=1e-3)
    refuses(ConfigError, "cannot be recovered", sol.stress, "ball", 0)


@pytest.mark.long
@pytest.mark.parametrize("method", [rom.CraigBampton(5), rom.Guyan(), rom.MomentMatching()])
def test_modes_left_out_follow_inertia(model, method):
    """A cantilever carried along: its stress is that of the full equilibrium, in any frame."""
    connection = connect(operators(model), model, {"root": "full", "tip": "rbe2"})
    ops = connection.ops
    held = ops.hold(connection.held(("root",)))
    a, alpha, omega = np.array([[-0.3, 9.81, -2.0], [3.0, -2.0, 5.0], [20.0, 30.0, -10.0]])
    W = omega[:, None] * omega - omega @ omega * np.eye(3)
    pulls = -np.cross(omega, np.cross(omega, model.points))
    fields = pulls - (a + np.cross(alpha, model.points))
    load = operators(model).apply_M(fields.reshape(-1, 1))
    U = ops.expand(held(ops.restrict(load)))
    full = model.stresses.at_nodes(U, model.surface.nodes)[:, :, 0]
    body = stressed(model, kinds={"root": "full", "tip": "rbe2"}, method=method)
    for reference in ("mean-axis", "tip"):
        seen = body.with_reference(reference)
        # held on its root under its inertia, from its integrals
        pull = np.r_[-W @ seen.first_moment, -np.cross(omega, seen.inertia @ omega)]
        M, K = seen.full_matrices()
        load = -M[:, :6] @ np.r_[a, alpha] + np.r_[pull, -np.einsum("ab,abk->k", W, seen.Ibar_kl)]
        N = null_space(seen.marker("root").hold)
        q = (N @ np.linalg.solve(N.T @ K @ N, N.T @ load))[6:]
        states = seen.stress.accelerations(a=a, alpha=alpha, omega=omega, qdd=0 * q)
        found = seen.stress.field(q, states)
        assert_allclose(found, full, atol=1e-8 * np.abs(full).max())
        plain = seen.stress.field(q)
        assert np.abs(plain - full).max() > 1e-4 * np.abs(full).max()


def test_a_vibrating_body_has_the_stress_of_the_full_mode(model):
    """With the accelerations of a free mode, in any frame, errors fall by an order or more."""
    body, full = stressed(model), rom.modes(model, 10, interfaces=KINDS)
    exact = model.stresses.at_nodes(full.shapes[:, 6:], model.surface.nodes)
    for reference in ("mean-axis", "root"):
        seen = body.with_reference(reference)
        omega, shapes = seen.modes(10)
        for k in range(4):
            z, q = -(omega[6 + k] ** 2) * shapes[:6, 6 + k], shapes[6:, 6 + k]
            moving = seen.stress.accelerations(z[:3], z[3:], np.zeros(3), -(omega[6 + k] ** 2) * q)
            plain, corrected = (
                min(np.abs(sign * found - exact[:, :, k]).max() for sign in (1, -1))
                for found in (seen.stress.field(q), seen.stress.field(q, moving))
            )
            assert corrected < 0.2 * plain


def test_a_bar_that_spins_in_free_fall_has_the_stress_of_closed_form(model, tmp_path):
    """sigma = rho omega^2 (L^2 / 8) (1 - (2 x / L)^2) along it; falling adds none."""
    pv = pytest.importorskip("pyvista", reason="pictures need pyvista")
    body, speed = stressed(model, 2, damping=rom.Rayleigh(beta=1e-4)), 100.0
    mech = rom.Mechanism(gravity=(0, 0, -9810.0))  # so strong that one forgotten would show
    mech.add_flexible("bar", body, omega=(0, 0, speed), velocity=(0, -speed * L / 2, 0))
    sol = rom.simulate(mech, t_end=0.02, dt=2e-4)
    x = body.stress.points[:, 0]
    inner = np.abs(x - L / 2) < 0.25 * L
    exact = STEEL.rho * speed**2 * L**2 / 8 * (1 - (2 * x[inner] / L - 1) ** 2)
    assert_allclose(sol.stress("bar", -1)[inner, 0], exact, rtol=0.03)
    plain = body.stress.field(sol.elastic("bar")[-1])[inner, 0]
    assert np.abs(plain / exact - 1).max() > 0.1
    series = rom.write_stress_history(sol, "bar", tmp_path / "bar.pvd", every=50)
    last = pv.get_reader(series)
    assert_allclose(last.time_values, sol.t[::50])
    last.set_active_time_value(sol.t[-1])
    seen = last.read()[0]["stress xx yy zz yz xz xy [Pa]"]
    assert_allclose(seen, sol.stress("bar", -1))
    one = tmp_path / "bar.vtu"
    refuses(ConfigError, "a motion is written as", rom.write_stress_history, sol, "bar", one)
