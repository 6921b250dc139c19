"""Bodies of large deflection at rest: snaps, buckling, loads in space, a guided leaf, refusals."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh, null_space
from scipy.optimize import brentq

import rom
import rom.body.nonlinear.ranges
from cases.beam import elastica, load_at
from cases.long import COARSE, few
from cases.mbs.slender import SYMMETRIC, Full, assembled, reduced, slender
from cases.refusals import refuses
from rom.body.nonlinear.statics import follow
from rom.errors import ConfigError, InterfaceError, ModelError, RomError, RomWarning

pytestmark = COARSE
HALF, RISE, HEIGHT, PRESSED = 0.5, 0.03, 0.01, 600.0  # of a clamped arch [m], and its load [N]


@pytest.fixture(scope="module")
def arch():
    """Half of it; it snaps on the way to the largest load."""
    model = assembled((HALF, HEIGHT, HEIGHT), (10, 1, 1), rise=RISE)
    how = {"n_modes": 8, "active": 7, "tol": 1e-5, "fixed": SYMMETRIC}
    return reduced(model, (0, 0, -PRESSED, 0, 0, 0), **how), model


def test_a_shallow_arch_snaps_at_the_loads_of_the_full_model(arch):
    """Its crown is pushed down in steps: the force on it has a maximum and a minimum."""
    body, model = arch
    found = body.critical_loads({"tip": (0, 0, -PRESSED, 0, 0, 0)}, fixed=SYMMETRIC) * PRESSED
    assert found.size == 2
    full, u = Full(model, held=range(6)), np.zeros(model.n_dofs)
    steps = np.r_[0.004, 0.008, 0.0115, 0.0128, 0.0141, 0.021, 0.028, 0.034, 0.0353, 0.0366]
    forces = {}
    for down in steps:
        u, held = full.state(u, np.zeros(6), -down * np.eye(12)[8])
        forces[down] = -held[8]
    for load, around in zip(found, (steps[2:5], steps[7:]), strict=True):
        a, b, c = np.polyfit(around, [forces[x] for x in around], 2)
        assert around[0] < -b / (2 * a) < around[-1]
        assert_allclose(load, c - b**2 / (4 * a), rtol=0.01)
    assert forces[steps[3]] > 1.5 * forces[steps[8]]


def test_behind_its_snap_the_arch_rests_where_the_full_model_does(arch):
    body, model = arch
    load = np.array([0, 0, -PRESSED, 0, 0, 0])
    before, behind = body.equilibria({"tip": load}, shares=(0.5, 1.0), fixed=SYMMETRIC)
    down = body.marker("tip").translation[2]
    assert down @ before > -0.2 * RISE and down @ behind < -1.5 * RISE
    full, moved = Full(model, held=(0, 1, 3, 4, 5)), Full(model, held=range(6))
    u = np.zeros(model.n_dofs)
    for share in (0.3, 0.6, 1.0):
        u, _ = moved.state(u, np.zeros(6), share * (down @ behind) * np.eye(12)[8])
    u, _ = full.state(u, load, np.zeros(11))
    assert_allclose(down @ behind, (full.motion @ u)[8], rtol=5e-3)


def test_a_column_buckles_at_eulers_load():
    """pi^2 EI / 4 at first in both planes, 9 times that then; nearly 4 pi^2 EI between clamps."""
    model, EI = slender(50, 12)
    body = reduced(model, (EI, 0, 0, 0, 0, 0), n_modes=8)
    euler = np.pi**2 / 4
    found = 25 * body.critical_loads({"tip": (-25 * EI, 0, 0, 0, 0, 0)})
    assert_allclose(found, [euler, euler, 9 * euler, 9 * euler], rtol=2e-2)
    assert_allclose(found[:2], euler, rtol=3e-3)
    clamped = body.critical_loads({"tip": (-45 * EI, 0, 0, 0, 0, 0)}, fixed={"tip": "yzrxryrz"})
    assert_allclose(45 * clamped, 16 * euler, rtol=0.03)
    assert body.critical_loads({"tip": (EI, 0, 0, 0, 0, 0)}).size == 0
    u, full = np.zeros(model.n_dofs), Full(model)
    u, _ = full.state(u, np.array([-1e-3 * EI, 0, 0, 0, 0, 0]), np.zeros(6))
    N = null_space(full.C)
    softer = 0.5e3 * (full.solid.tangent(-u) - full.solid.tangent(u))
    rest = full.solid.tangent(0 * u)
    share = eigh(N.T @ (softer @ N), N.T @ (rest @ N), eigvals_only=True)[::-1][:4]
    assert_allclose(found, 1 / share, rtol=2e-3)


@pytest.mark.parametrize("nu, rtol", few(1, [(0.3, 3e-3), (0.0, 5e-3)]))
def test_a_cantilever_bends_in_space_as_finite_elements_do(nu, rtol):
    model, EI = slender(50, 8, nu)
    loads = np.array([0.2, 1.0, 0.6, 0.3, 0, 0]) * EI
    body = reduced(model, loads, n_modes=10, active=2, n_steps=2)
    (q,) = body.equilibria({"tip": loads * [-1, 1, -1, 1, 0, 0]})
    full = Full(model).under(loads * [-1, 1, -1, 1, 0, 0])[6:]
    found = body.marker("tip").translation @ q
    assert_allclose(found, full[:3], rtol=0, atol=rtol * np.linalg.norm(full[:3]))
    assert np.linalg.norm(full[3:]) > 0.4


@pytest.mark.long
def test_with_poissons_ratio_a_cantilever_bends_to_70_degrees_as_finite_elements_do():
    """P L^2 / EI = 5, where sections warp with the curvature: states of the full model show how."""
    model, EI = slender(100, 40, nu=0.3)
    load = np.array([0, 5 * EI, 0, 0, 0, 0])
    body = reduced(model, load, n_shapes=15, snapshots=True)
    assert body.n_modes <= 25
    shares = np.array([0.05, 0.1, 0.2, 0.4, 0.7, 1.0])
    tip, full, u = body.marker("tip"), Full(model), np.zeros(model.n_dofs)
    for share, q in zip(shares, body.equilibria({"tip": load}, shares=shares), strict=True):
        u, _ = full.state(u, share * load, np.zeros(6))
        known = (full.motion @ u)[6:]
        found = np.r_[tip.translation @ q, (tip.rotation @ q)]
        assert_allclose(found[[0, 1, 5]], known[[0, 1, 5]], rtol=3e-3)
    assert known[5] > 0.9


# flapwise and edgewise deflection [mm] at angles of 30, 60, 90 degrees under 8.896 N: solid
# elements of Ansys (4 x 12 x 500) and its beams, Obrezkov, Mikkola and Matikainen, Nonlinear
# Dyn. 109 (2022) 31, as quoted by ANCFBeamTest.py of Exudyn; a geometrically exact beam.
PRINCETON = {
    30: [(76.967, 9.938), (79.395, 10.112), (79.547, 10.208)],
    60: [(127.251, 6.500), (129.888, 6.605), (129.958, 6.742)],
    90: [(143.849, 0.0), (146.246, 0.0), (146.252, 0.0)],
}


@pytest.mark.slow
@pytest.mark.long
def test_the_princeton_beam_is_no_further_from_published_solids_than_published_beams_are():
    """The tip goes down by a quarter of the length; these solids and beams are 2 to 3 % apart."""
    force, b, t = 8.896, 12.3777e-3, 3.2024e-3
    aluminium = rom.Material(E=71.7e9, nu=0.31, rho=2700.0)
    model = assembled((0.508, b, t), (12, 1, 1), material=aluminium)
    how = {"n_modes": 12, "active": 1, "tol": 1e-6, "snapshots": True}
    body = reduced(model, (0, force, force, 0, 0, 0), **how)
    tip = body.marker("tip").translation
    for angle, (solid, *beams) in PRINCETON.items():
        beta = np.radians(angle)
        load = force * np.array([0, -np.cos(beta), np.sin(beta), 0, 0, 0])
        (q,) = body.equilibria({"tip": load})
        found = 1e3 * np.array([1, -1]) * (tip @ q)[[2, 1]]
        away = np.linalg.norm(np.subtract(beams, solid), axis=1)
        assert np.linalg.norm(found - solid) < away.min() < 0.04 * np.linalg.norm(solid)
        assert_allclose(found, solid, rtol=2.5e-2, atol=1e-6)  # in the stiff direction, too
        full = 1e3 * Full(model).under(load, np.linspace(0.25, 1, 4))[[8, 7]] * [1, -1]
        assert_allclose(found, full, rtol=1e-3, atol=1e-6)


def test_supports_that_are_none_bodies_of_small_deflection_and_bare_matrices_are_refused():
    (model, _), load = slender(20, 2), (0, 1.0, 0, 0, 0, 0)
    for fixed, error, says in (
        (("hub",), InterfaceError, "hub"),
        (("root",), InterfaceError, "root"),
        ({"tip": "up"}, ConfigError, "directions are"),
        ({"tip": "y"}, ConfigError, "tip f_y where the body is held"),
    ):
        refuses(error, says, reduced, model, load, n_modes=2, active=1, fixed=fixed)
    bare = rom.FEModel(model.K, model.M, model.points, model.interfaces)
    refuses(ConfigError, "no finite elements", reduced, bare, load, method=rom.Guyan())
    body = rom.reduce(model, method=rom.CraigBampton(n_modes=2), certify=False,
                      interfaces={"root": "rbe3", "tip": "rbe3"}, reference="root")  # fmt: skip
    for ask in (body.equilibria, body.critical_loads):
        refuses(ModelError, "small deflection", ask, {"tip": (1.0, 0, 0, 0, 0, 0)})
    refuses(ConfigError, "loads", body.forces_on, {"tip": (1.0, 2.0)})


GUIDED = {"tip": "rxryrz"}
STEEPEST = 0.5  # slope half way [rad]
RTOL = 3e-3


def exact_leaf(slope):
    """Force times L^2 / EI, deflection and shortening over L of a guided leaf, by its slope.

    Half of it is a cantilever under a force across its end.
    """
    load = load_at(slope)
    _, along, across = elastica(load)
    return 4 * load, across, 1 - along


def test_a_guided_leaf_hardens_and_comes_back_as_its_elastica_says():
    """Deflection, shortening and energy at rest at two slopes."""
    model, EI = slender(50, 32)
    slopes = (STEEPEST / 2, STEEPEST)

    def work(slope):  # of the force on the way
        F, across, _ = np.array([exact_leaf(x) for x in np.linspace(1e-6, slope, 200)]).T
        return EI * np.sum(0.5 * (F[1:] + F[:-1]) * np.diff(across))

    loads, *known = np.array([(*exact_leaf(slope), work(slope)) for slope in slopes]).T
    force, how = loads[-1] * EI, {"n_modes": 4, "active": 4, "fixed": GUIDED, "tol": 1e-5}
    body = reduced(model, (0, force, 0, 0, 0, 0), **how)
    along, across = body.marker("tip").translation[:2]
    q = follow(body.quartic, np.outer(loads * EI, across), body.mean_rows(GUIDED))
    found = [q @ across, -(q @ along), [body.quartic.energy(x) for x in q]]
    assert_allclose(found, known, rtol=RTOL)
    linear = loads[1] / 12  # a linear leaf is softer
    assert linear / found[0][1] > 1.08
    slope = brentq(lambda s: exact_leaf(s)[1] - 1e-3, 1e-4, 0.1)
    assert_allclose(exact_leaf(slope)[2], 0.6e-6, rtol=1e-4)


@pytest.fixture(scope="module")
def beam():
    model, EI = slender(20, 6)
    load = np.array([0, EI, 0, 0, 0, 0])
    return model, load, Full(model).under(load)[6:9]


def snapshots(model):
    """Functions found from one state of bending, in which the section turns."""
    X = model.interfaces["tip"].points - model.interfaces["tip"].origin
    return rom.Snapshots(np.cross([0, 0, 0.1], X).reshape(-1, 1), n=6)


KINDS = {"rbe3": "rbe3", "full": "full", "affine": rom.Polynomial(1), "square": rom.Polynomial(2),
         "rigid": "rbe2", "found": snapshots}  # fmt: skip
WITH_MODES = (rom.CraigBampton, rom.BalancedTruncation, rom.Herting, rom.Rubin,
              rom.EnhancedCraigBampton, rom.FreeFree, rom.AssumedModes)  # fmt: skip
METHODS = {method.__name__: method(n_modes=4) for method in WITH_MODES}
METHODS |= {"Guyan": rom.Guyan(), "MomentMatching": rom.MomentMatching(order=1)}
FEW = {("rbe3", name) for name in METHODS} | {(name, "CraigBampton") for name in KINDS}


@pytest.mark.parametrize("kind, method", sorted(FEW))
def test_any_kind_of_interface_and_method_is_right_or_refused_by_name(beam, kind, method):
    model, load, known = beam
    of = KINDS[kind](model) if callable(KINDS[kind]) else KINDS[kind]
    try:
        body = reduced(model, load, method=METHODS[method], tip=of, active=2, n_steps=2)
    except RomError as error:
        assert any(word in str(error) for word in ("interface", "method", "coordinates")), error
        assert "equilibrium" not in str(error)
        assert (kind, method) not in {("rbe3", "CraigBampton"), ("affine", "CraigBampton")}
        return
    (q,) = body.equilibria({"tip": load})
    assert_allclose(body.marker("tip").translation @ q, known, rtol=0, atol=1e-2)


def test_frames_that_are_no_interface_are_refused(beam):
    model, load, _ = beam
    for frame in ("free", "mean-axis", "buckens", ("root", "tip"), "hub", ""):
        how, errors = {"method": rom.Guyan(), "reference": frame}, (ConfigError, InterfaceError)
        refuses(errors, "reference|seen from|hub", reduced, model, load, **how)


@pytest.mark.parametrize("size", [30.0, pytest.param(1e3, marks=pytest.mark.long), 1e5])
@pytest.mark.parametrize("component", few(4, [0, 1, 3, 5, 2, 4]))  # the section is square
def test_a_load_beyond_what_one_body_carries_is_refused_or_fails_its_certificate(component, size):
    model, EI = slender(20, 4)
    load = np.zeros(6)
    load[component] = size * EI
    try:
        options = {"active": 0, "n_steps": 2, "n_shapes": 6, "certify": True}
        body = reduced(model, load, method=rom.Guyan(), **options)
    except ModelError as error:
        assert "of the range" in str(error) and "smaller loads" in str(error)
        return
    name = rom.body.nonlinear.ranges.FORCES[component]
    failed = [row.quantity for row in body.certificate.failures if f"tip {name}" in row.quantity]
    assert failed
    table = body.provenance["large deflection"]
    assert min(case["holds to"] for case in table.values()) < 1.0


FAR = [((0, 0, 0, 0, 0, 3.0), 172), ((0, 25.0, 0, 0, 0, 0), 90), ((0, 0, 0, 0, 0, 1.3), 0)]


@pytest.mark.parametrize("load, degrees", [*FAR, ((0, 2.0, 0, 0, 0, 0), 0)])
def test_a_range_that_turns_farther_than_one_body_carries_names_pieces(load, degrees):
    """A moment as far as M L / EI, a force towards a right angle as the elastica does."""
    model, EI = slender(40, 5)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", RomWarning)
        reduced(model, EI * np.array(load), n_modes=2, active=2)
    turns = [str(w.message) for w in said if "turns by" in str(w.message)]
    assert bool(turns) == bool(degrees)
    assert all(f"turns by {degrees} degrees" in x and "rom.reduce_pieces" in x for x in turns)
