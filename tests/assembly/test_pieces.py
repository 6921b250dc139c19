"""One solid as several reduced bodies: statics far out, frequencies, momentum, and its refusals."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

import rom
from cases.beam import elastica
from cases.long import COARSE
from cases.paths import RANKS
from cases.ranks.environment import written_on_each
from cases.refusals import refuses
from rom import rotation
from rom.assembly.pieces import Tree, together
from rom.checks.glued import GluedSolid
from rom.errors import ConfigError, InterfaceError, ModelError

pytestmark = COARSE
E, THICK = 210e9, 0.01
EI = E * THICK**4 / 12


def beam(n, cells, *, nu=0.0, thick=THICK):
    size = {"L": 1.0, "b": thick, "h": thick, "hex": 1, "nx": cells, "ny": 1, "nz": 1}
    material = rom.Material(E=E, nu=nu, rho=7850.0)
    if n == 1:
        return rom.fe.model("meshes/beam.geo", material=material, parameters=size)
    return rom.fe.pieces("meshes/beam.geo", n=n, axis=(1, 0, 0), material=material, parameters=size)


def made(models, load=None, *, n_modes=2, active=2, **options):
    large = load and rom.Geometric(loads={"tip": load}, n_modes=active, **options)
    how = {"reference": "root", "nonlinear": large, "certify": False}
    return rom.reduce_pieces(models, method=rom.CraigBampton(n_modes=n_modes), **how)


def clamped(pieces):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    markers = pieces.add_to(mech, "beam")
    assert set(markers) == {"root", "tip"}
    mech.fixed("wall", mech.ground.marker((0, 0, 0)), markers["root"])
    return mech, markers["tip"]


def tip_at(mech, tip, steps):
    """Slope [rad], place along and across [m]."""
    still = rom.snapshot(mech, rom.equilibrium(mech, steps=steps))
    x, _, z = still.position(tip.body, tip.place)[0]
    A = still.axes(tip.body, tip.place)[0]
    return np.array([np.arctan2(A[2, 0], A[0, 0]), x, z])


def test_a_cantilever_of_pieces_follows_the_elastica_to_ten():
    assert_allclose(elastica(5.0), [1.215368, 1 - 0.387628, 0.713792], atol=1e-6)
    pieces = made(beam(4, 40), (0, 0, 10 * EI, 0, 0, 0), n_modes=4, n_steps=2)
    for load in (2.0, 10.0):
        mech, tip = clamped(pieces)
        mech.force("load", tip, (0, 0, load * EI))
        assert_allclose(tip_at(mech, tip, 16), elastica(load), rtol=0, atol=3e-4)


@pytest.mark.parametrize(
    "n, cells, turns", [(4, 64, 0.5), pytest.param(6, 48, 1.0, marks=pytest.mark.long)]
)
def test_a_moment_bends_pieces_to_a_circle_that_closes(n, cells, turns):
    """The moment turns with the section: pieces are made for pairs of forces that do, too."""
    angle = 2 * np.pi * turns
    pieces = made(beam(n, cells), (0, 0, 0, 0, angle * EI, 0), n_steps=2)
    mech, tip = clamped(pieces)
    mech.torque("load", tip, (0, -angle * EI, 0))
    slope, x, z = tip_at(mech, tip, 24)
    gap = np.linalg.norm([x, z - (1 - np.cos(angle)) / angle])
    assert gap < 1e-3
    assert abs(np.exp(1j * (slope - angle)) - 1) < 1e-3 * angle


@pytest.fixture(scope="module")
def three():
    """Linear pieces with Poisson's ratio, and the models they are of."""
    models = beam(3, 12, nu=0.3, thick=0.05)
    return made(models, n_modes=12), models


def test_frequencies_and_mass_are_those_of_one_body(three):
    """Flexible ones of the cantilever; rigid sections would stiffen the pieces."""
    pieces, models = three
    mech = rom.Mechanism()
    refuses(ConfigError, "pieces take no 'q'", pieces.add_to, mech, "beam", q=np.zeros(3))
    whole = beam(1, 12, nu=0.3, thick=0.05)
    assert_allclose(pieces.mass, whole.mass(), rtol=1e-12)
    body = rom.reduce(whole, method=rom.CraigBampton(n_modes=30), reference="root",
                      interfaces={"root": "rbe3", "tip": "rbe3"}, certify=False)  # fmt: skip
    known = np.sort(body.frequencies(6, fixed=("root",)))
    found = cantilever_frequencies(pieces)
    assert_allclose(found[:4], known[:4], rtol=2e-4)
    stiff = dict.fromkeys(("cut 1", "cut 2"), "rbe2")
    rigid = rom.reduce_pieces(models, reference="root", method=rom.CraigBampton(n_modes=12),
                              interfaces=stiff, certify=False)  # fmt: skip
    worse = cantilever_frequencies(rigid)[:2] / known[:2] - 1
    assert worse.min() > 10 * np.abs(found[:2] / known[:2] - 1).max()


def cantilever_frequencies(pieces):
    mech, _ = clamped(pieces)
    return np.sort(rom.linearize(mech, rom.equilibrium(mech)).frequencies)


def test_pieces_that_spin_freely_keep_energy_and_momentum():
    pieces = made(beam(2, 8), (0, 0, EI, 0, 0, 0), active=1, n_shapes=6)
    drifts, pulse = [], 0.01  # relative, after a kick that bends the beam far
    for dt in (5e-5, 2.5e-5):
        mech = rom.Mechanism(gravity=(0, 0, 0))
        how = {"at": (1, 2, 3), "velocity": (0.2, 0, -0.1), "omega": (0, 4.0, 1)}
        markers = pieces.add_to(mech, "beam", **how)
        mech.force("kick", markers["tip"], lambda t: (0, 0, EI * (t < pulse)))
        found = rom.simulate(mech, t_end=0.03, dt=dt, rho_inf=1.0)
        one, two = found.position("beam 1", "cut 1"), found.position("beam 2", "cut 1")
        assert_allclose(one, two, atol=1e-8)
        bent = found.position("beam 1", "root") + found.position("beam 2", "tip") - 2 * one
        assert np.linalg.norm(bent, axis=1).max() > 0.04
        free = found.t > pulse + 2.5e-4
        kept, energy = [momentum[free] for momentum in found.momentum], found.energy.total[free]
        off = [np.abs(p - p[0]).max() / np.linalg.norm(p[0]) for p in kept]
        drifts.append([*off, np.abs(energy / energy[0] - 1).max()])
    assert np.all(np.array(drifts[1]) < [2e-4, 2e-4, 1e-5])
    assert np.all(np.array(drifts[0]) > 3 * np.array(drifts[1]))


def test_pieces_that_repeat_each_other_are_reduced_once_for_the_largest_of_their_loads():
    """Frames set off from rest as the parts of one body that turns: momentum is that of the bar."""
    models, loads = beam(3, 6), {"tip": (0, 0, EI, 0, 0, 0)}
    how = {"reference": "root", "method": rom.Guyan(), "certify": False,
           "nonlinear": rom.Geometric(loads=loads, n_modes=0, n_shapes=6, n_steps=1)}  # fmt: skip
    pieces = rom.reduce_pieces(models, **how)
    assert len({id(body.quartic) for body in pieces.bodies.values()}) == 1
    assert list(pieces.bodies["2"].markers) == ["cut 1", "cut 2"]
    assert pieces.bodies["3"].reference == "cut 2"
    mech, turn = rom.Mechanism(gravity=(0, 0, 0)), np.array([0.1, 0.4, -0.3])
    A = rotation.matrix(rotation.exp(turn))
    markers = pieces.add_to(mech, "bar", at=(1, 2, 3), orientation=A, omega=(0, 2.0, 3.0))
    assert set(markers) == {"root", "tip"}
    still = rom.simulate(mech, t_end=1e-9, dt=1e-9)
    tip = still.position("bar 3", "tip")[0]
    assert_allclose(tip, [1, 2, 3] + A @ [1, 0, 0], atol=1e-12)
    mass = 7850 * THICK**2
    assert_allclose(still.momentum[0][0], mass * A @ [0, 1.5, -1.0], atol=1e-6)
    thicker = models | {"3": replace(models["3"], M=2 * models["3"].M)}
    other = rom.reduce_pieces(thicker, **how)
    assert len({id(body.quartic) for body in other.bodies.values()}) == 2
    full = rom.reduce_pieces(models, interfaces={"cut 2": rom.Polynomial(1)}, **how)
    assert len({id(body.quartic) for body in full.bodies.values()}) == 3


@pytest.fixture(scope="module")
def halves():
    how = {"reference": "root", "method": rom.CraigBampton(n_modes=4), "certify": False}
    loads = rom.Geometric(loads={"tip": (0, 0, 2 * EI, 0, 0, 0)}, n_modes=2, n_steps=2)
    return beam(2, 8, nu=0.3), loads, how


def test_the_certificate_of_pieces_compares_them_with_the_whole_solid(halves):
    """Glued of their finite elements, up to 45 degrees; pieces of small deflection fail."""
    models, loads, how = halves
    pieces = rom.reduce_pieces(models, nonlinear=loads, **how)
    assert pieces.certificate is None
    report = rom.certify_pieces(pieces, models, nonlinear=loads).certificate
    rows = {row.quantity: row for row in report.rows}
    assert report.ok and len(rows) == 6, report
    small = rom.reduce_pieces(models, **how)
    report = rom.certify_pieces(small, models, nonlinear=loads).certificate
    failed = {row.quantity: row.value for row in report.failures}
    assert 0.01 < failed["tip f_z: displacement"] < 0.2


TURNED = rom.Geometric(loads={"tip": (0, 0, 0.3 * EI, 0, 0.8 * EI, 0)}, n_modes=2, snapshots=True)


@pytest.mark.long
@pytest.mark.parametrize(
    "large, snapshots, least, most",
    [(True, True, 0.0, 1e-3), (True, False, 1e-3, 0.2), (False, False, 1e-2, 0.2)],
)
def test_pieces_are_certified_under_moments_that_turn_with_their_section(
    halves, large, snapshots, least, most
):
    """With a force beside it, to a slope of 46 degrees; without states of full models worse."""
    models, _, how = halves
    turned = replace(TURNED, snapshots=snapshots)
    pieces = rom.reduce_pieces(models, nonlinear=turned if large else None, **how)
    report = rom.certify_pieces(pieces, models, nonlinear=turned).certificate
    row = next(row for row in report.rows if row.quantity == "tip m_y: displacement")
    assert least < row.value < most and row.ok == large
    assert not snapshots or (report.ok and len(report.rows) == 18), report


def test_a_moment_on_a_section_turns_with_it_as_one_on_a_marker_does(halves):
    """It works on the turn of least squares; its stiffness is the slope of its forces."""
    models, *_ = halves
    solid, rng = GluedSolid.of(models, {"cut 1": ("1", "2")}), np.random.default_rng(4)
    section, moment = solid.section("tip"), np.array([1.0, -2.0, 0.5])
    R, place = rotation.matrix(rotation.exp([0.4, -0.8, 0.3])), np.zeros(solid.n)
    place[section.dofs] = (section.points @ (1.02 * R.T) - section.points).ravel()

    def turn(u):
        U, _, Vt = np.linalg.svd(section.covariance(u))
        return U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt

    def forces(u):
        found = np.zeros(solid.n)
        found[section.dofs] = section.force(section.covariance(u), moment)
        return found

    assert_allclose(turn(place), R, atol=1e-12)
    f = section.force(section.covariance(place), moment).reshape(-1, 3)
    assert_allclose(f.sum(axis=0), 0.0, atol=1e-9)
    du = np.zeros(solid.n)
    du[section.dofs] = 1e-7 * THICK * rng.standard_normal(section.dofs.size)
    spin = (turn(place + du) - turn(place - du)) @ R.T / 2
    power = moment @ [spin[2, 1], spin[0, 2], spin[1, 0]]
    assert_allclose(forces(place) @ du, power, rtol=1e-6)
    X, Y = section.stiffness(place, moment)
    slope = (forces(place + du) - forces(place - du)) / 2
    assert_allclose(X @ (Y.T @ du), slope, rtol=0, atol=1e-6 * np.abs(slope).max())


def test_the_solid_glued_of_pieces_is_the_one_that_was_cut(halves):
    models, *_ = halves
    whole, glued = beam(1, 8, nu=0.3), GluedSolid.of(models, {"cut 1": ("1", "2")})
    assert glued.n == whole.n_dofs
    x = np.zeros((glued.n // 3, 3))
    for key, model in models.items():
        x[glued.dofs[key][::3] // 3] = model.points
    at = cKDTree(x).query(whole.points)[1]
    dofs = (3 * at[:, None] + np.arange(3)).ravel()
    u = 0.01 * np.sin(40 * x + x[:, [1, 2, 0]]).ravel()
    solid = whole.stresses.finite_strain()
    force, K = solid.force(u[dofs]), solid.tangent(u[dofs])
    assert_allclose(glued.force(u)[dofs], force, rtol=0, atol=1e-9 * np.abs(force).max())
    assert abs(glued.tangent(u)[dofs][:, dofs] - K).max() < 1e-9 * abs(K).max()
    assert_allclose(glued.M.sum(), 3 * whole.mass(), rtol=1e-10)
    shifted = replace(models["2"].interfaces["cut 1"], points=models["2"].points[:25] + 1.0)
    apart = replace(models["2"], interfaces={"cut 1": shifted})
    glue = models | {"2": apart}, {"cut 1": ("1", "2")}
    refuses(ModelError, "do not meet at 'cut 1'", GluedSolid.of, *glue)


def test_pieces_are_certified_for_what_the_whole_can_bear_too(halves):
    models, loads, how = halves
    pieces = rom.reduce_pieces(models, **how)
    for given, change, says in (
        (models, {"spin": (0, 0, 3.0)}, "loads on interfaces; the range has 'omega_z"),
        (models, {"fixed": ("tip",)}, "holds .*'tip'"),
        (models, {"loads": {"cut 1": (1.0, 0, 0, 0, 0, 0)}}, "names 'cut 1'"),
        ({"1": models["1"]}, {}, "the models are '1', the pieces '1', '2'"),
    ):
        other = replace(loads, **change)
        refuses(ConfigError, says, rom.certify_pieces, pieces, given, nonlinear=other)


def test_loads_reach_the_sections_of_pieces():
    """Three pieces of a third of a metre; by hand."""
    models = beam(3, 3)
    tree = Tree.of(models, "root")
    assert tree.reference == {"1": "root", "2": "cut 1", "3": "cut 2"}
    ranges = tree.ranges(rom.Geometric(loads={"tip": (0, 0, -3.0, 0, 0, 0)}, tol=1e-3), models)
    assert all(r.tol == 1e-3 for r in ranges.values())
    assert_allclose(ranges["1"].loads["cut 1"], [0, 0, 3, 0, 2, 0], atol=1e-12)
    assert_allclose(ranges["2"].loads["cut 2"], [3, 0, 3, 0, 1, 0], atol=1e-12)
    assert_allclose(ranges["3"].loads["tip"], [3, 0, 3, 0, 0, 0], atol=1e-12)
    copies = tree.repeated(models, {})
    assert {key: one.of for key, one in copies.items()} == {"2": "1", "3": "1"}
    both = together(ranges["1"], [(ranges[key], one) for key, one in copies.items()])
    assert_allclose(both.loads["cut 1"], [3, 0, 3, 0, 2, 0], atol=1e-12)
    other = rom.Geometric(loads={"tip": (0, 4.0, 3.0, 0, 0, 0)})
    ranges = tree.ranges(other, models)
    assert_allclose(ranges["1"].loads["cut 1"], [0, 4, 3, 0, 2, 8 / 3], atol=1e-12)
    assert_allclose(ranges["2"].loads["cut 2"], np.repeat([5, 5 / 3], 3), atol=1e-12)
    from_tip = Tree.of(models, "tip")
    assert from_tip.reference == {"3": "tip", "2": "cut 2", "1": "cut 1"}
    at_root = rom.Geometric(loads={"root": (1, 0, 0, 0, 0, 0)})
    assert_allclose(from_tip.ranges(at_root, models)["3"].loads["cut 2"], [1, 0, 0, 0, 0, 0])


def test_pieces_that_make_no_body_are_refused_by_name():
    models = beam(3, 3)

    def named(key, *names):
        face = next(iter(models[key].interfaces.values()))
        return replace(models[key], interfaces=dict.fromkeys(names, face))

    refuses(ConfigError, "1 pieces are no body", Tree.of, {"1": models["1"]}, "root")
    refuses(InterfaceError, "'hub' is no interface of one piece", Tree.of, models, "hub")
    refuses(InterfaceError, "'cut 1' is no interface of one piece", Tree.of, models, "cut 1")
    tree, x = Tree.of(models, "root"), (1, 0, 0, 0, 0, 0)
    shared = {key: named(key, "x", f"end {key}") for key in models}
    ring = {"1": named("1", "root", "x", "y"), "2": named("2", "x", "y")}
    loose = models | {"3": named("3", "tip")}
    held, spun = rom.Geometric({"tip": x}, fixed=("tip",)), rom.Geometric({}, spin=(0, 0, 1.0))
    for error, says, call, *given in (
        (InterfaceError, "piece '3' does not hang on", Tree.of, loose, "root"),
        (ModelError, "form a ring that closes at 'y'", Tree.of, ring, "root"),
        (InterfaceError, "'x' is of '1', '2', '3'", Tree.of, shared, "end 1"),
        (InterfaceError, "names 'cut 1'", tree.ranges, rom.Geometric({"cut 1": x}), models),
        (ConfigError, "with supports beside the reference", tree.ranges, held, models),
        (ConfigError, "which centrifugal force pulls", tree.ranges, spun, models),
    ):
        refuses(error, says, call, *given)
    how = {"reference": "root", "interfaces": {"hub": "rbe3"}}
    refuses(InterfaceError, "no interface 'hub'", rom.reduce_pieces, models, **how)


@pytest.mark.mpi
@pytest.mark.long
def test_pieces_are_the_same_on_two_processes(tmp_path):
    found = written_on_each((1, 2), tmp_path, RANKS / "pieces_under_mpi.py", timeout=300)
    assert_allclose(found[1]["mass"], 11.775 + 0.5, rtol=1e-12)
    for name in ("a", "b", "mass"):
        assert_allclose(found[2][name], found[1][name], rtol=1e-7)
