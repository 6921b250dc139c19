"""Stress at large deflection, and neo-Hookean bodies with the energy of a few weighted elements."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import rom
from cases.boxes import box
from cases.long import COARSE
from cases.mbs.mechanisms import prepared, random_state, residual_at, stored_at, tangents_at
from cases.mbs.slender import E_STEEL, STEEL, TIMBER, Full, assembled, cantilever, reduced, slender
from cases.mbs.tangents import difference, shifted
from cases.refusals import refuses
from rom.body.nonlinear.cauchy import CauchyRecovery
from rom.body.nonlinear.sampled import Sampled, chosen
from rom.body.projection import cauchy_recovery
from rom.body.recovery import von_mises
from rom.components.updating.observers.operation import stress_rows
from rom.errors import ConfigError, FileFormatError, ModelError, ResourceError
from rom.updating import Channels

pytestmark = COARSE
VOIGT = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]


def tensor(voigt):
    xx, yy, zz, yz, xz, xy = voigt.T
    return np.moveaxis(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), 2, 0)


def hooke(material):
    """(3, 3, 3, 3) stiffness, filled in by the symmetries of its indices."""
    C = np.empty((3,) * 4)
    for row, (i, j) in enumerate(VOIGT):
        for column, (k, l) in enumerate(VOIGT):
            value = material.stiffness[row, column]
            for a, b in ((i, j), (j, i)):
                C[a, b, k, l] = C[a, b, l, k] = value
    return C


def cauchy(C, F):
    """(3, 3) stress of St. Venant-Kirchhoff material, all indices summed."""
    E = 0.5 * (np.einsum("ki,kj->ij", F, F) - np.eye(3))
    S = np.einsum("ijkl,kl->ij", C, E)
    return np.einsum("ia,ab,jb->ij", F, S, F) / np.linalg.det(F)


@pytest.mark.parametrize("kind, material", [("hexahedron", STEEL), ("tetrahedron", TIMBER)])
def test_stress_of_quadratic_fields_is_that_of_their_gradients(kind, material):
    """u_i = a_ijk x_j x_k, which the elements hold exactly, at strains of some tenths."""
    model = assembled((1.0, 0.6, 0.5), (3, 2, 2), kind, material=material, distorted=True)
    a = 0.25 * np.random.default_rng(1).standard_normal((3, 3, 3, 3))
    x = model.points
    E = np.einsum("nijk,pj,pk->pin", a, x, x).reshape(-1, 3)
    q = np.array([0.4, -0.3, 0.5])
    found = cauchy_recovery(model, E).field(q)
    whole = np.einsum("n,nijk->ijk", q, a)
    H = np.einsum("ijk,pk->pij", whole + whole.swapaxes(1, 2), x[model.surface.nodes])
    expected = np.array([cauchy(hooke(material), F) for F in np.eye(3) + H])
    assert np.abs(H).max() > 0.3
    assert_allclose(tensor(found), expected, rtol=0, atol=1e-11 * np.abs(expected).max())


@pytest.fixture(scope="module")
def bent():
    """Finite elements, body, coordinates under a force across its tip, and its nodal shapes."""
    model, EI = slender(50, 12, nu=0.3)
    shapes, load = [], {"tip": (0, 3 * EI, EI, 0, 0, 0)}

    def recovery(model, E):
        shapes.append(E)
        return cauchy_recovery(model, E)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rom.stages.deflection.cauchy_recovery", recovery)
        body = reduced(model, load["tip"], stress=True)
    return model, body, body.equilibria(load, shares=(0.5, 1.0))[-1], shapes[0], load["tip"]


def gradients(model, u):
    """(p, 3, 3) mean gradients at the surface: interpolated cell by cell, gathered by place."""
    import ufl
    from dolfinx import fem

    from rom.fe.compat import evaluated, reference_points

    V = model.stresses.V
    field = fem.Function(V)
    field.x.array[:] = u
    cells, X = np.arange(model.stresses.n_cells, dtype=np.int32), reference_points(V)
    of = (ufl.grad(field), ufl.SpatialCoordinate(V.mesh))
    H, x = (evaluated(fem.Expression(value, X), V.mesh, cells) for value in of)
    here = cKDTree(x.reshape(-1, 3)).query_ball_point(model.points[model.surface.nodes], 1e-9)
    assert max(map(len, here)) > 1
    return np.array([H.reshape(-1, 3, 3)[k].mean(axis=0) for k in here])


def test_stress_in_the_span_is_that_of_the_finite_elements(bent):
    model, body, q, E, _ = bent
    rows = (3 * model.surface.nodes[:, None] + np.arange(3)).ravel()
    assert_allclose(body.surface.shape, E[rows], rtol=0, atol=1e-12)
    F = np.eye(3) + gradients(model, E @ q)
    assert np.abs(F - np.eye(3)).max() > 0.75
    expected = np.array([cauchy(hooke(STEEL), one) for one in F])
    found = tensor(body.stress.field(q))
    assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


def test_stress_under_a_load_is_that_of_the_full_solution(bent):
    """Its own equilibrium, in steps of the load; away from the ends, whose section it holds."""
    model, body, q, _, load = bent
    full, u = Full(model), np.zeros(model.n_dofs)
    for share in (0.25, 0.5, 0.75, 1.0):
        u, _ = full.state(u, share * np.array(load), np.zeros(6))
    expected = von_mises(cauchy_recovery(model, u[:, None]).field(np.ones(1)))
    found = body.stress.von_mises(q)
    inner = np.abs(body.stress.points[:, 0] - 0.5) < 0.45
    assert_allclose(found[inner], expected[inner], rtol=0, atol=0.02 * expected.max())
    linear = bent[3] @ np.linalg.solve(body.K, body.forces_on({"tip": load}))
    hooke = von_mises(model.stresses.at_nodes(linear[:, None], model.surface.nodes)[..., 0])
    assert hooke[inner].max() > 1.2 * expected[inner].max()


def test_the_certificate_has_a_row_of_stress(monkeypatch):
    model, EI = slender(50, 8)
    rows = {}
    for name in ("all", "locked"):
        if name == "locked":
            monkeypatch.setattr("rom.stages.deflection.enriched", lambda bent: bent.basis)
        body = reduced(model, (0, EI, 0, 0, 0, 0), n_modes=2, certify=True, stress=True)
        rows[name] = next(r for r in body.certificate.rows if r.quantity == "tip f_y: stress")
    assert rows["all"].ok and rows["all"].value < 0.02
    assert not rows["locked"].ok and 0.5 < rows["locked"].value < 2.0


def test_pure_bending_has_the_stress_of_an_arc():
    """Fibres at y stretch by 1 - k y, and S = E (stretch^2 - 1) / 2, sigma = stretch S.

    The moment EI / L is a pair of dead forces, whose arms turn with the tip: k L = cos(k L).
    """
    h, k = 1 / 50, 0.7390851332
    model, EI = slender(50, 24)
    few = {"n_modes": 4, "active": 2, "n_steps": 2}
    body = reduced(model, (0, 0, 0, 0, 0, EI), n_shapes=18, stress=True, **few)
    q = body.equilibria({"tip": (0, 0, 0, 0, 0, EI)}, shares=(0.5, 1.0))[-1]
    s, p = body.stress.field(q), body.stress.points
    for side in (0.0, h):
        edge = (np.abs(p[:, 0] - 0.5) < 0.2) & (np.abs(p[:, 1] - side) < 1e-9)
        y, angle = side - h / 2, k * p[edge, 0]
        along = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
        found = np.einsum("pi,pij,pj->p", along, tensor(s[edge]), along)
        stretch = 1 - k * y
        assert_allclose(found, E_STEEL * stretch * (stretch**2 - 1) / 2, rtol=0.02)
        assert_allclose(found, -E_STEEL * k * y, rtol=0.03)  # as Bernoulli says


@pytest.fixture(scope="module")
def homogeneous():
    """A box whose nine coordinates are the entries of F - 1, row by row."""
    model = assembled((1.0, 0.4, 0.3), (2, 1, 1))
    return cauchy_recovery(model, np.kron(np.eye(3), model.points[:, None]).reshape(-1, 9))


def deformed(recovery, F):
    return tensor(recovery.field((np.asarray(F) - np.eye(3)).ravel()))


@pytest.mark.parametrize("stretch", [0.8, 1.3])
def test_uniaxial_stretch_has_the_closed_form(homogeneous, stretch):
    nu, strain = 0.3, (stretch**2 - 1) / 2
    lateral = np.sqrt(1 - 2 * nu * strain)
    q = (np.diag([stretch, lateral, lateral]) - np.eye(3)).ravel()
    S = np.zeros((3, 3))
    S[0, 0] = E_STEEL * strain
    assert_allclose(tensor(homogeneous.second_piola(q))[0], S, atol=1e-4)
    S[0, 0] *= stretch / lateral**2
    assert_allclose(tensor(homogeneous.field(q))[0], S, atol=1e-4)
    assert_allclose(homogeneous.von_mises(q), abs(S[0, 0]), rtol=1e-12)


def test_simple_shear_has_the_closed_form(homogeneous):
    """F = 1 + g e1 e2^T: E_12 = g / 2, E_22 = g^2 / 2, and no change of volume."""
    g, nu = 0.4, 0.3
    mu, lam = E_STEEL / (2 * (1 + nu)), E_STEEL * nu / ((1 + nu) * (1 - 2 * nu))
    s11, s22, s12 = lam * g**2 / 2, (lam / 2 + mu) * g**2, mu * g
    expected = np.diag([s11 + 2 * g * s12 + g**2 * s22, s22, s11])
    expected[0, 1] = expected[1, 0] = s12 + g * s22
    F = np.eye(3) + g * np.outer([1, 0, 0], [0, 1, 0])
    assert_allclose(deformed(homogeneous, F)[3], expected, atol=1e-4)


def test_rotation_has_no_stress_and_turns_the_one_there_is(homogeneous):
    rng = np.random.default_rng(3)
    R = Rotation.from_rotvec([0.9, -1.4, 1.1]).as_matrix()
    U = np.eye(3) + 0.1 * rng.standard_normal((3, 3))
    assert np.abs(deformed(homogeneous, R)).max() < 1e-13 * E_STEEL
    still = deformed(homogeneous, U)
    assert_allclose(deformed(homogeneous, R @ U), R @ still @ R.T, atol=1e-12 * E_STEEL)
    S = [homogeneous.second_piola((F - np.eye(3)).ravel()) for F in (U, R @ U)]
    assert_allclose(*S, atol=1e-12 * E_STEEL)


def test_where_materials_meet_small_deflection_has_the_stress_of_hookes_law():
    from dolfinx import mesh as dm

    from rom.fe.elasticity import assemble

    mesh, _ = box((1.0, 0.3, 0.2), (4, 1, 1))
    middles = dm.compute_midpoints(mesh, 3, np.arange(4, dtype=np.int32))
    outer = (middles[:, 0] > 0.5).astype(np.int32)
    tags = dm.meshtags(mesh, 3, np.arange(4, dtype=np.int32), outer)
    two = {"cell_tags": tags, "regions": {"inner": 0, "outer": 1}}
    soft = rom.Material(E=70e9, nu=0.34, rho=2700.0)
    for other in (soft, TIMBER):
        model = assemble(mesh, **two, material={"inner": STEEL, "outer": other})
        U = np.random.default_rng(4).standard_normal((model.n_dofs, 2))
        nodes = np.arange(len(model.points))
        recovery = CauchyRecovery(model.points, **model.stresses.gradients_at_nodes(U, nodes))
        assert len(recovery.stiffness) == 2 and 0.0 < recovery.share.min() < 1.0
        for k in range(2):
            small = 1e-11 * np.eye(2)[k]
            expected = model.stresses.at_nodes(U, nodes)[:, :, k]
            assert_allclose(recovery.field(small) / 1e-11, expected, rtol=0,
                            atol=1e-7 * np.abs(expected).max())  # fmt: skip


def test_files_and_other_units_keep_it(bent, tmp_path):
    _, body, q, *_ = bent
    read = rom.load(rom.save(body, tmp_path / "body.rom.npz"))
    assert_allclose(read.stress.field(q), body.stress.field(q), rtol=0, atol=0)
    other, tip = body.in_units("mm-t-s"), body.marker("tip").translation
    same = q * 1e3 * tip[0, 0] / other.marker("tip").translation[0, 0]
    assert_allclose(other.stress.field(same), 1e-6 * body.stress.field(q), atol=1e-8)
    assert_allclose(other.stress.points, 1e3 * body.stress.points)
    whole = body.stress
    for wrong in (
        {"gradient": whole.gradient[:, 1:]}, {"gradient": whole.gradient[9:]},
        {"stiffness": whole.stiffness[0]}, {"node": whole.node + 1}, {"node": 0 * whole.node},
        {"material": whole.material + 1}, {"share": 0.5 * whole.share},
        {"node": whole.node.astype(float)},
    ):  # fmt: skip
        cut = replace(body, stress=replace(whole, **wrong))
        file = rom.save(cut, tmp_path / "cut.rom.npz")
        refuses(FileFormatError, "stress recovery does not fit", rom.load, file)


def test_a_mechanism_tells_it_at_each_instant_and_a_file_shows_it(bent, tmp_path):
    _, body, q, _, load = bent
    mech, part = cantilever(body)
    mech.force("load", part.marker("tip"), load[:3])
    state = rom.equilibrium(mech, steps=4)
    still = rom.snapshot(mech, state)
    expected = body.stress.field(state.q[7:])
    assert_allclose(still.stress("beam", 0), expected)
    assert_allclose(state.q[7:], q, rtol=0, atol=1e-7 * np.abs(q).max())  # as alone
    rom.io.write_stress_history(still, "beam", tmp_path / "beam.pvd")
    rom.io.write_stress(body, state.q[7:], tmp_path / "beam.vtu")
    series = (tmp_path / "beam" / "beam_000000.vtu").read_text()
    assert series == (tmp_path / "beam.vtu").read_text() and "von Mises" in series


def test_what_cannot_be_is_refused_by_name(bent, monkeypatch, homogeneous):
    model, body, q, *_ = bent
    refuses(ConfigError, "modes left out", body.stress.field, q, np.zeros(12 + q.size))
    refuses(ConfigError, rf"q has shape .*{q.size - 1}", body.stress.field, q[1:])
    refuses(ConfigError, "not finite", body.stress.von_mises, q * np.nan)
    turned_over, large = np.diag([-0.2, 1.0, 1.0]), "'body' is that of large deflection"
    refuses(ModelError, "out: its volume is -0.2 ", deformed, homogeneous, turned_over)
    gauges = Channels([body.stress.points[0]], [[1, 0, 0]])
    refuses(ModelError, large, stress_rows, body, gauges, "gauge")
    monkeypatch.setattr("rom.body.nonlinear.cauchy.MAX_BYTES", 1e5)
    much, load = r"\d+ points at large deflection takes [\d.e-]+ GiB", (0, 1.0, 0, 0, 0, 0)
    refuses(ResourceError, much, reduced, model, load, n_shapes=2, stress=True)


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
def strip():
    model = assembled((1.0, THICK, THICK), (12, 1, 2), material=RUBBER)
    return reduced(model, LOADS, n_modes=2, active=1, n_steps=2, sampling=1e-3, certify=True)


def test_energy_force_and_tangent_are_those_of_the_finite_elements():
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


def test_few_elements_bear_the_loads_of_the_range_as_all_do(strip):
    """The full solid of the same law at loads and frequencies that were trained and were not."""
    compared = [row for row in strip.certificate.rows if "tip f_z" in row.quantity]
    beside = [row for row in compared if "compliance" in row.quantity]
    assert len(compared) == 8 and all(row.ok for row in compared if row not in beside)
    assert not any(row.ok for row in beside)  # nothing was trained in twisting
    how = strip.provenance["sampling"]
    assert how["error of forces"] <= 1e-3 and how["elements"] < how["of"]
    assert_allclose(how["volume"], 1.0, rtol=0.1)
    assert how["elements"] == len(strip.quartic.weights) / 125
    mech, part = cantilever(strip)
    mech.force("load", part.marker("tip"), LOADS[:3])
    q = strip.equilibria({"tip": LOADS}, shares=(0.5, 1.0))[-1]
    found = rom.equilibrium(mech, steps=4).q[7:]
    assert_allclose(found, q, rtol=0, atol=1e-6 * np.abs(q).max())


def test_weights_are_found_where_they_are_known():
    """Three elements of unlike forces and a fourth that is the sum of two: it stands for both."""
    rng = np.random.default_rng(2)
    G = rng.standard_normal((4, 9, 5))
    states = 0.05 * rng.standard_normal((6, 5))
    twice = Sampled(np.eye(5), np.concatenate([G, G[:1]]), np.ones(5), np.ones((5, 2)))
    weights, error = chosen(twice, np.arange(5), states, 1e-10)
    assert error < 1e-10 and np.count_nonzero(weights) == 4
    assert_allclose(weights[1:4], 1.0, atol=1e-8)
    assert_allclose(weights[0] + weights[4], 2.0, atol=1e-8)


def test_forces_are_slopes_of_the_energy_in_a_mechanism_too(strip):
    body, mech = strip, rom.Mechanism(gravity=(0, 0, 0))
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

    slope = difference(stored, v.size, step=1e-7)[0]
    assert_allclose(beyond, slope, atol=1e-7 * np.abs(slope).max())


def test_what_sampled_elements_cannot_do_is_refused_by_name(strip, tmp_path):
    body, model = strip, assembled(cells=(2, 1, 1))
    refuses(ConfigError, "which no file holds", rom.save, body, tmp_path / "body.rom.npz")
    refuses(ConfigError, "one unit system", body.in_units, "mm-t-s")
    grown, few = assembled(cells=(2, 1, 1), material=TIMBER), {"n_modes": 1, "sampling": 0.1}
    spun = few | {"active": 0, "spin": (0, 0, 1.0)}
    stressed = {"method": rom.Guyan(), "stress": True, "sampling": 0.1}
    refuses(ConfigError, "sampling and spin", reduced, model, LOADS, n_steps=1, **spun)
    refuses(ConfigError, "stress and sampling", reduced, model, LOADS, **stressed)
    refuses(ModelError, "is isotropic", reduced, grown, (0, 1.0, 0, 0, 0, 0), active=0, **few)
