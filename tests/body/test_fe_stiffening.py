"""Geometric stiffness of solids: rotating beams, buckling, and the same loads by another road."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh, eigvalsh
from scipy.sparse.linalg import eigsh, spsolve

import rom
from cases.beam import gauss_hermite, hermite_beam
from cases.long import SHARED_BY, few
from cases.ranks.environment import written_on_each
from cases.refusals import refuses
from cases.solid import KINDS, reduced
from rom.body.prestress import UnitLoads, _turning, centrifugal
from rom.body.recovery import CENTRIFUGAL_LOADS
from rom.body.rotating import rotating_matrices
from rom.body.stiffening import ANGULAR_LOADS, LINEAR_LOADS, elastic_loads, interface_loads
from rom.components.wheels.rotation import rotation_matrices
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, ModelError, RomWarning
from rom.reduction.full_model import operators
from rom.reduction.interfaces.connection import connect

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
import ufl
from dolfinx.fem import Function

from rom.fe.compat import assemble_matrix
from rom.fe.forms.material import stress
from rom.fe.operators.aij import symmetric

pytestmark = [
    pytest.mark.fenicsx,
    pytest.mark.filterwarnings("ignore:.*fixed-interface modes are kept"),
    pytest.mark.filterwarnings("ignore:Number of integration points"),
]
E, RHO, L, B, H = 70e9, 2700.0, 1.0, 0.03, 0.02
AREA, STIFFNESS = B * H, E * B * H**3 / 12
UNIT = np.sqrt(STIFFNESS / (RHO * AREA * L**4))  # rad/s of a dimensionless frequency of one
FLANKS = {"flank_left": "rbe2", "flank_right": "rbe2"}
CENTRE = np.array([0.0, 0.0, -0.25])  # of the rotor of a blade
# first flapwise frequency by speed: exact Euler-Bernoulli beam, and the same solid clamped at its
# root by 40 x 2 x 2 quadratic hexahedra, from an independent program
TABLE = {
    0: (3.51601527, 3.52316), 1: (3.68164681, 3.68866), 2: (4.13731957, 4.14407),
    3: (4.79727853, 4.80381), 5: (6.44954475, 6.45604), 10: (11.2023278, 11.20984),
    12: (13.1701505, 13.17808),
}  # fmt: skip


def solid(degree=2, nu=0.3, attachments=(), **sizes):
    parameters = {"L": L, "b": B, "h": H, "hex": 1, "nx": 40, "ny": 2, "nz": 2} | sizes
    return rom.fe.model(
        "meshes/beam.geo", material=rom.Material(E=E, nu=nu, rho=RHO), degree=degree,
        parameters=parameters, attachments=attachments,
    )  # fmt: skip


def stiffened(model, interfaces=KINDS, reference="root", n_modes=8, stiffening=True):
    how = {"interfaces": interfaces, "reference": reference, "stiffening": stiffening}
    return reduced(n_modes, model, **how)


def rotating(body, eta, axis=(0, 0, 1)):
    found = body.rotating_frequencies(eta * UNIT, axis, fixed=("root",), at=(0, 0, 0))
    return found * 2 * np.pi / UNIT


@pytest.fixture(scope="module")
def blade():
    return stiffened(solid(), {"root": "rbe2"}, reference="mean-axis", n_modes=20)


@pytest.fixture(scope="module")
def model():
    return solid(nx=12, ny=1, nz=1)


@pytest.fixture(scope="module")
def body(model):
    return stiffened(model)


@pytest.mark.parametrize("eta", TABLE)
def test_a_rotating_solid_has_the_published_frequencies(blade, eta):
    """Axis along z, flapwise along z; the lag branch crosses the flap branch above 4."""
    exact, by_solids = TABLE[eta]
    flap = nearest(rotating(blade, eta)[:2], exact)
    assert_allclose(flap, exact, rtol=2.5e-3)
    assert_allclose(flap, by_solids, rtol=1e-4)


def nearest(found, wanted):
    return min(found, key=lambda x: abs(x - wanted))


def test_the_lag_mode_feels_softening_and_coriolis(blade):
    """Without Coriolis force that of the beam, 2.25 times as stiff as across; with it, lower.

    Coriolis force of the lag velocity stretches the bar quasi-statically, u'' = 2 omega w' rho / E,
    which the energy of the axial motion takes from the lag motion.
    """
    root = blade.with_reference("root")
    K, G = rotating_matrices(root, np.array([0.0, 0.0, 10 * UNIT]), np.zeros(3))
    assert_allclose(G, -G.T, atol=1e-12 * np.abs(G).max())
    assert_allclose(np.sqrt(eigh(K, root.M)[0][0]) / UNIT, 6.59013596, rtol=2e-3)
    lam, V = eigh(K, root.M)
    push = G @ V[:, 0]
    lowered = lam[0] / (1 + push @ np.linalg.solve(K, push))  # quasi-static answer of all others
    found = rotating(blade, 10)
    assert_allclose(found[0] * UNIT, np.sqrt(lowered), rtol=1e-4)
    assert found[0] < 6.595
    assert_allclose(nearest(found, 33.64), 33.6403659, rtol=2.5e-3)  # the second across


def test_southwell_bounds_hold_at_every_speed(blade):
    """String from below; from above the Rayleigh quotient of the mode at rest, 1.1933 eta^2."""
    at_rest, alpha = rotating(blade, 0)[0], 1.193336 * 1.0025
    for eta in (0.5, 2, 4, 8, 16, 30):
        squares = rotating(blade, eta)[:4] ** 2
        inside = (at_rest**2 + eta**2 < squares) & (squares < at_rest**2 + alpha * eta**2)
        assert inside.any()


def test_a_column_buckles_under_eulers_load_and_its_own_weight(body):
    """The tip pressed towards the root: pi^2 EI / 4 L^2 about the weaker axis.

    Greenhill: rho A g L^3 / EI = 7.8373; acceleration along x presses on the root.
    """
    lam = eigvalsh(body.K_geo["tip f_x"], body.K).max()
    assert_allclose(1 / lam, np.pi**2 * STIFFNESS / (4 * L**2), rtol=8e-3)
    lam = -eigvalsh(body.K_geo["a_x"], body.K).min()
    assert_allclose(RHO * AREA * L**3 / STIFFNESS / lam, 7.8373, rtol=1.2e-2)


def test_a_deep_cantilever_tips_over_sideways():
    """Prandtl and Michell: P L^2 = 4.0126 sqrt(EI GJ) for a force at the tip along the height."""
    deep = stiffened(solid(nu=0.0, b=0.004, h=0.05, nx=24, ny=1, nz=2), n_modes=16)
    tip, compliance = deep.marker("tip"), np.linalg.inv(deep.K)
    weak, twist = (1 / (row @ compliance @ row) for row in (tip.translation[1], tip.rotation[0]))
    assert_allclose(weak * L**3 / 3, E * 0.05 * 0.004**3 / 12, rtol=2e-3)
    lam = np.abs(eigvalsh(deep.K_geo["tip f_z"], deep.K)).max()
    assert_allclose(1 / lam, 4.0126 * np.sqrt(weak * L**3 / 3 * twist * L) / L**2, rtol=0.03)


def test_unit_loads_with_the_root_held_by_the_full_model(model, body):
    """The frame on the root turns inertia relief into reactions: the same stress, held directly."""
    ops, c = operators(model), connect(operators(model), model, KINDS)
    fields = np.hstack([-rigid_motions(model.points), centrifugal(model.points)])
    force = ops.apply_M(fields)
    tip = np.zeros((c.ops.n, 6))
    tip[c.held(("tip",)), np.arange(6)] = 1.0
    held = c.ops.hold(c.held(("root",)))
    U = c.ops.expand(held(np.hstack([c.ops.restrict(force), tip])))
    Psi = c.ops.expand(rom.CraigBampton(8).basis(c.ops, c.boundary, c.labels).Psi)
    rows = (3 * model.surface.nodes[:, None] + np.arange(3)).ravel()
    Psi = Psi @ np.linalg.lstsq(Psi[rows], body.surface.shape, rcond=None)[0]
    K = model.stresses.geometric_stiffness(U, Psi)
    face = model.interfaces["tip"]
    p = (ops.apply_K(U) - np.hstack([force, np.zeros((ops.n, 6))]))[face.dofs]
    moment = np.einsum("nal,nb->lab", p.reshape(-1, 3, 18), face.points - face.origin)
    K += _turning(moment, body.marker("tip").rotation)
    loads = *LINEAR_LOADS, *ANGULAR_LOADS, *CENTRIFUGAL_LOADS, *interface_loads("tip")
    for load, A in zip(loads, K, strict=True):
        assert_allclose(body.K_geo[load], A, atol=1e-6 * np.abs(A).max(), err_msg=load)


@pytest.mark.parametrize("reference", ["tip", ("root", "tip")])
def test_there_and_back_to_another_frame(model, body, reference):
    back = body.with_reference(reference).with_reference("root")
    assert set(back.K_geo) == set(body.K_geo)
    sign = np.sign(np.sum(back.surface.shape * body.surface.shape, axis=0))
    turned = dict(zip(elastic_loads(body.n_modes), sign, strict=True))
    largest = max(np.abs(body.K_geo[load]).max() for load in turned)
    for load, A in body.K_geo.items():
        seen = turned.get(load, 1.0) * sign[:, None] * back.K_geo[load] * sign
        scale = largest if load in turned else np.abs(A).max()
        assert_allclose(seen, A, atol=1e-8 * scale, err_msg=load)
        assert np.array_equal(A, A.T)
    free = body.with_reference("mean-axis")
    assert not {*LINEAR_LOADS, *ANGULAR_LOADS} & set(free.K_geo)  # inertia relief: no stress
    seen = (rotating(b.with_reference(reference), 8.0) for b in (body, free))
    assert_allclose(*seen, rtol=1e-7)


def of_green_strain(stresses, u):
    """What the law of Hooke in Green's strain adds to a tangent that it has not in Biot's.

    Second derivative at u of half sigma : eps eps, the difference of their energies.
    """
    w, v, at = ufl.TrialFunction(stresses.V), ufl.TestFunction(stresses.V), Function(stresses.V)
    at.x.array[:] = u
    e, g, h = (ufl.sym(ufl.grad(x)) for x in (at, w, v))
    turns = (e, g, h), (g, h, e), (h, e, g)
    form = sum(ufl.inner(stress(a, stresses.numbers), ufl.sym(ufl.dot(b, c))) for a, b, c in turns)
    return symmetric(assemble_matrix(form * ufl.dx))


def held_at_speed(model, held, centre, speed, *, large):
    """Four frequencies [Hz] of all finite elements that turn about x, without Coriolis forces.

    Of the undeformed shape under the stress of centrifugal force, or in large displacements.
    """
    loose, finite = np.setdiff1d(np.arange(model.n_dofs), held), model.stresses.finite_strain()
    softening = speed**2 * rotation_matrices(model.M, np.eye(3)[0])[1]
    u, pull = np.zeros(model.n_dofs), softening @ (model.points - centre).ravel()
    u[loose] = spsolve(model.K[loose][:, loose].tocsc(), pull[loose])
    K = model.K + model.stresses.prestress(u) - softening
    for _ in range(5 if large else 0):
        K = finite.tangent(u) - of_green_strain(model.stresses, u) - softening
        out_of_balance = finite.force(u) - pull - softening @ u
        u[loose] -= spsolve(K[loose][:, loose].tocsc(), out_of_balance[loose])
    K, M = (A[loose][:, loose].tocsc() for A in (K, model.M))
    return np.sqrt(np.sort(eigsh(K, 4, M, sigma=0.0)[0])) / (2 * np.pi)


@pytest.mark.long
@pytest.mark.parametrize(("degree", "hertz", "rtol"), [(1, 125.0, 4e-4), (2, 62.5, 6e-5)])
def test_a_twisted_blade_has_the_frequencies_of_the_shape_it_takes_at_speed(degree, hertz, rtol):
    """Centrifugal force untwists it, in the first order of the load; any frame says the same."""
    model = rom.fe.model(
        "meshes/compressor_blade.geo", material=rom.Material(E=114e9, nu=0.33, rho=4430.0),
        parameters={"lc": 0.012, "lc_flank": 0.006}, degree=degree,
    )  # fmt: skip
    held, speed = np.concatenate([model.interfaces[x].dofs for x in FLANKS]), 2 * np.pi * hertz
    large, undeformed = (held_at_speed(model, held, CENTRE, speed, large=x) for x in (True, False))
    body = stiffened(model, FLANKS, "flank_left", n_modes=20)
    found, centre = [], (0, 0, 0)
    for seen in map(body.with_reference, ("flank_left", "mean-axis")):  # held on a heavy rotor
        mech = rom.Mechanism(gravity=(0, 0, 0))
        seats = {"at": centre, "markers": {x: seen.marker(x).point - CENTRE for x in FLANKS}}
        rotor = mech.add_rigid("rotor", mass=500.0, inertia=(50, 50, 50), **seats)
        part = mech.add_flexible("blade", seen, at=-CENTRE)
        mech.revolute("axle", mech.ground.marker(centre), rotor.marker(centre), axis=(1, 0, 0))
        for name in FLANKS:
            mech.fixed(name, rotor.marker(name), part.marker(name))
        diagram = rom.campbell(mech, [0.5 * speed, speed], n=4, axis=(1, 0, 0))
        found.append(diagram.frequencies[1])
    assert_allclose(*found, rtol=1e-6)
    assert_allclose(found[0], large, rtol=rtol)
    assert np.abs(undeformed / large - 1).max() > 1.5e-3


def test_unit_loads_are_balanced_and_need_no_support(monkeypatch):
    model = rom.fe.model(
        "meshes/bent_blade.geo", material=rom.Material(E=114e9, nu=0.33, rho=4430.0), degree=1,
        attachments=[rom.Attachment("tip", 0.05, 1e-5 * np.eye(3))],
    )  # fmt: skip
    found = []
    for six in (slice(6), slice(-6, None)):
        monkeypatch.setattr(UnitLoads, "_six_dofs", lambda x, six=six: x.connection.boundary[six])
        found.append(stiffened(model, n_modes=6).K_geo)
    assert set(elastic_loads(12)) < set(found[0]) == set(found[1])
    for load, A in found[0].items():
        assert_allclose(found[1][load], A, atol=1e-8 * np.abs(A).max(), err_msg=load)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_a_rod_pulled_by_its_own_rotation(degree):
    """Stretch L (tan k / k - 1), k = omega L sqrt(rho / E), of a bar without Poisson effect."""
    sizes = {"b": 0.2, "h": 0.2, "nx": 6 if degree == 3 else 12, "ny": 1, "nz": 1}
    rod = stiffened(solid(degree, nu=0.0, **sizes), n_modes=12)
    w = np.array([0.0, 0.0, 0.3 / L * np.sqrt(E / RHO)])
    rod.K_geo.clear()  # stretch stiffens at the order of the strain, which the formula leaves out
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RomWarning)
        K = rotating_matrices(rod, w, np.zeros(3))[0]
    q = np.linalg.solve(K, np.einsum("a,aak->k", w @ w - w**2, rod.Ibar_kl))
    stretch = (rod.marker("tip").translation @ q)[0]
    assert_allclose(stretch, L * (np.tan(0.3) / 0.3 - 1), rtol=1e-3)


def test_stiffening_does_not_need_the_modes_that_carry_the_load(model):
    """Only the first lag and flap mode are kept, and the tension is still exact."""
    few = stiffened(model, {"root": "rbe2"}, n_modes=2)
    flap, lag = np.sort(rotating(few, 3)) ** 2 - rotating(few, 0) ** 2
    assert_allclose(flap, 1.193336 * 9, rtol=5e-3)
    assert_allclose(lag, 0.193336 * 9, rtol=5e-2)


def test_a_mass_beyond_the_tip_pulls_like_a_pendulum():
    """Point mass on a rigid arm: a beam of Hermite elements whose tip turns the arm out."""
    m, arm, eta = 0.5 * RHO * AREA * L, 0.25 * L, 4.0
    mass = rom.Attachment("tip", m, 1e-9 * np.eye(3), at=(L + arm, 0, 0))
    body = stiffened(solid(nu=0.0, nx=20, ny=1, nz=1, attachments=(mass,)), {"root": "rbe2"})
    K, M = hermite_beam()
    x, weight, _, slopes = gauss_hermite(40, 1.0)
    reach, turn = np.zeros(82), np.zeros(82)
    reach[-2:], turn[-1] = (1.0, 0.25), 1.0
    M += 0.5 * np.outer(reach, reach)
    tension = 0.5 * (1 - x**2) + 0.5 * 1.25
    pull = (slopes.T * (weight * tension)) @ slopes + 0.5 * 1.25 * 0.25 * np.outer(turn, turn)
    exact = np.sqrt(eigvalsh((K + eta**2 * pull)[2:, 2:], M[2:, 2:])[:2])
    found = rotating(body, eta)
    assert_allclose([nearest(found, value) for value in exact], exact, rtol=2e-3)


@pytest.mark.parametrize("kind", ["full", "rbe3", "polynomial:2"])
def test_the_kind_of_the_support_hardly_matters(model, kind):
    """A deformable root held everywhere is the rigid one; an averaged one is a little softer."""
    rigid = stiffened(model, {"root": "rbe2"}, n_modes=12)
    other = stiffened(model, {"root": kind}, n_modes=12)
    tolerance = 1e-2 if kind == "rbe3" else 1e-3
    assert_allclose(rotating(other, 6)[:3], rotating(rigid, 6)[:3], rtol=tolerance)


def test_the_command_line_stiffens_too(tmp_path):
    from rom.cli.main import main

    path = tmp_path / "beam.rom.npz"
    asked = "reduce meshes/beam.geo -p lc=0.1 --E 70e9 --nu 0.3 --rho 2700 -i root=rbe2 -m 2 -q"
    assert main([*asked.split(), "--stiffening", "--no-certificate", "-o", str(path)]) == 0
    assert "omega_z^2" in rom.load(path).K_geo


def test_bodies_and_questions_without_an_answer_are_refused_or_warned_of(body, model):
    refuses(ConfigError, "no finite elements, from", stiffened, replace(model, stresses=None))
    free, z = rom.reduce(model, method=rom.FreeFree(6), interfaces=KINDS, certify=False), (0, 0, 1)
    alone, root = "free-free modes only", {"fixed": ("root",)}
    refuses(ModelError, alone, free.rotating_frequencies, 10.0, z, **root)
    refuses(ConfigError, "needs a support", body.rotating_frequencies, 10.0, z, fixed=())
    refuses(ConfigError, "axis ", body.rotating_frequencies, 10.0, (0, 0, 0), **root)
    bare = stiffened(model, n_modes=4, stiffening=False)
    with pytest.warns(RomWarning, match="softens it only"):
        bare.rotating_frequencies(1.0, (0, 0, 1), fixed=("root",))
    with pytest.warns(RomWarning, match="used up its stiffness"):
        rotating(bare, 6.0)
    bare.K_geo["sideways"] = np.eye(bare.n_modes)
    refuses(ConfigError, "unknown load 'sideways'", bare.with_reference, "tip")


SCRIPT = """
import sys, numpy as np, rom
mass = rom.Attachment("tip", 0.4, np.diag([1e-3, 2e-3, 2e-3]), at=(0.45, 0.0, 0.02))
model = rom.fe.model("meshes/beam.geo", material=rom.Material(E=70e9, nu=0.3, rho=2700.0),
                     parameters={"L": 0.4, "lc": 0.025}, attachments=(mass,))
body = rom.reduce(model, method=rom.CraigBampton(6), reference="root", stiffening=True,
                  interfaces={"root": "rbe2", "tip": "rbe3"}, certify=False)
if model.operators.first == 0:
    rom.save(body, sys.argv[1])
"""


@pytest.mark.long
@pytest.mark.mpi
def test_the_number_of_processes_does_not_matter(tmp_path):
    bodies = written_on_each((1, *SHARED_BY), tmp_path, "-c", SCRIPT, load=rom.load)
    one = bodies.pop(1)
    assert len(one.K_geo) == 6 + 6 + 6 + one.n_modes
    elastic = elastic_loads(one.n_modes)  # some are round-off: all of one size
    largest = max(np.abs(one.K_geo[load]).max() for load in elastic)
    for many in bodies.values():
        assert set(many.K_geo) == set(one.K_geo)
        for load, A in one.K_geo.items():
            size = largest if load in elastic else np.abs(A).max()
            assert_allclose(many.K_geo[load], A, atol=1e-9 * size, err_msg=load)


@pytest.mark.parametrize("stiffening", few(1, [True, False]))
def test_a_bar_stretched_by_its_rotation_follows_hooke(stiffening):
    """4 % of strain at the hub: u'' + k^2 (x + u) / L^2 = 0, stretched by L (tan(k) / k - 1)."""
    model = solid(nu=0.0, nx=24, ny=1, nz=1)
    body, k = stiffened(model, n_modes=40, stiffening=stiffening), np.sqrt(0.08)
    speed = k * np.sqrt(E / RHO) / L
    mech = rom.Mechanism(gravity=(0, 0, 0))
    bar = mech.add_flexible("bar", body)
    mech.revolute("hub", mech.ground.marker((0, 0, 0)), bar.marker("root"), axis=(0, 0, 1))
    mech.drive("motor", "hub", lambda t: speed * t)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RomWarning)  # beyond the speed that softens it to nothing
        turning = rom.snapshot(mech, rom.equilibrium(mech, spin=(0, 0, speed)))
    stretch = np.linalg.norm(turning.position("bar", "tip")[0]) - 1.0
    assert_allclose(stretch, np.tan(k) / k - 1, rtol=1e-4)
