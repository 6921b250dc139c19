"""Assemblies of families with an unknown joint, updated."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.components import updating
from cases.components.updating import BOLTS, assert_alike, fed, halves, noisy_test, refuse, walked
from rom.body.recovery import StressRecovery
from rom.components.families.parameters import centre
from rom.components.updating.family_model import Parts
from rom.components.updating.models import modal
from rom.components.updating.normal_equations import responses_at
from rom.errors import InterfaceError
from rom.parametric import FamilyAssembly
from rom.updating import AddedMass, Channels, Drift, GroundSpring, JointSpring, Sensors

tracked = rom.updating.parameter_tracker
HELD = (("frame", "root"),)
LINES = np.linspace(20, 1000, 150)
TEST = {"level": 0.03, "averages": 50}
POINTS = [[x, y, 0.08] for x in (0.25, 0.375, 0.625, 0.75, 1.0) for y in (0.0, 0.1)]
CHANNELS = updating.crossed(POINTS), Channels([[0.75, 0.1, 0.0]], [[0, 1, 2]])
TRACKED = {"dt": 1e-3, "walk": 100.0, "unmodelled": 1e-3, "damping": 0.02}


@pytest.fixture(scope="module")
def families():
    return halves()


@pytest.fixture(scope="module")
def bolted(families):
    return FamilyAssembly(families)


@pytest.fixture(scope="module")
def joined(families):
    return FamilyAssembly(families, ((("frame", "tip"), ("arm", "root")),))


def model_of(family, attached, fixed=HELD):
    return updating.model_of(family, CHANNELS, fixed, attached)


def measured(family, attached, true):
    return noisy_test(family, true, CHANNELS, LINES, attached=attached, fixed=HELD, **TEST)


def test_families_pass_their_projection_on(families):
    """Meshes that differ are coupled by common functions, at all values."""
    functions, coupled = rom.Polynomial(1), ((("frame", "tip"), ("arm", "root")),)
    one = FamilyAssembly(families, coupled, functions)
    assert one.nominal.projection is functions is one.at(**{"arm.E": 1.1}).projection
    with pytest.raises(rom.errors.ConfigError, match="gives no functions"):
        FamilyAssembly(families, coupled, "linear")


def test_coupled_families_have_the_frequencies_of_their_assembly(joined):
    model = model_of(joined, {})
    assert model.names == ("frame.E", "arm.E") and model.n_rigid == 0
    found = modal(model.at(np.log([1.2, 0.8])), ()).lam[:8]
    values = {"frame.E": 1.2, "arm.E": 0.8}
    expected = joined.at(**values).modes(8, fixed=HELD).omega
    assert_allclose(np.sqrt(found), expected, rtol=1e-8)
    modes = joined.nominal.modes(fixed=HELD)
    seen, driven = (
        sum(side.rows({name: body}, "channel", 0.6) @ modes.shapes[name]
            * (np.asarray(side.points)[:, :1] > 0.5 if name == "arm"
               else np.asarray(side.points)[:, :1] < 0.5)
            for name, body in joined.nominal.bodies.items())
        for side in CHANNELS
    )  # fmt: skip
    w = 2 * np.pi * LINES
    H = np.einsum("sn,fn,en->fse", seen, 1 / (modes.omega**2 - w[:, None] ** 2), driven)
    x = np.log(list(centre(joined.parameters).values()))
    same = responses_at(model, x, np.array([1e-12]), w)
    assert_allclose(same, H, rtol=1e-6, atol=1e-9 * np.abs(H).max())


def test_a_soft_spring_lets_two_masses_swing_and_a_stiff_joint_couples_them(joined, bolted):
    """A soft spring along x: omega^2 = k (1/m + 1/m) of two halves; 11 other motions are free."""
    k = 1e3
    soft = JointSpring(("frame", "tip"), ("arm", "root"), (k, 0, 0), 0.1, 10.0)
    model = model_of(bolted, {"bolts": soft}, fixed=())
    assert model.n_rigid == 11
    half = 7850.0 * 0.5 * 0.1 * 0.08
    assert_allclose(modal(model.at(np.zeros(3)), ()).lam[11], 2 * k / half, rtol=1e-5)
    assert model_of(bolted, {"bolts": BOLTS}, fixed=()).n_rigid == 6
    stiff = replace(BOLTS, stiffness=(1e14,) * 3 + (1e12,) * 3)
    found = modal(model_of(bolted, {"bolts": stiff}).at(np.zeros(3)), ()).lam[:6]
    assert_allclose(found, modal(model_of(joined, {}).at(np.zeros(2)), ()).lam[:6], rtol=1e-4)


def test_a_spring_reaches_a_body_that_is_apart_by_a_rigid_arm(bolted):
    parts = Parts.of(bolted)
    long = JointSpring(("frame", "root"), ("arm", "tip"), (3.0, 4.0, 5.0), 0.1, 10.0)
    K, _ = long.term(parts)
    rigid = np.zeros((parts.n, 6))
    for columns in parts.columns.values():
        rigid[columns.start : columns.start + 6] = np.eye(6)
    assert_allclose(K @ rigid, 0.0, atol=1e-12)
    moved = np.zeros(parts.n)
    moved[parts.columns["arm"].start + np.array([2, 5])] = 2.0, 1.0  # along and about z
    y = 0.05  # of the root, which is at x = 0: along x the turn moves it by -y
    assert_allclose(moved @ K @ moved, 5.0 * 2.0**2 + 3.0 * y**2)


def test_bolts_that_are_alike_share_one_factor(bolted):
    """Two at one place are twice as stiff; at two places each feels its own motion, by a turn."""
    tip, root = ("frame", "tip"), ("arm", "root")
    twice = JointSpring((tip, tip), (root, root), (1e3, 0, 0), 0.1, 10.0)
    half = 7850.0 * 0.5 * 0.1 * 0.08
    found = modal(model_of(bolted, {"bolts": twice}, fixed=()).at(np.zeros(3)), ()).lam[11]
    assert_allclose(found, 2 * 2 * 1e3 / half, rtol=1e-5)
    ends = (tip, ("frame", "root")), (root, ("arm", "tip"))
    parts, k = Parts.of(bolted), (3.0, 4.0, 5.0)
    K, _ = JointSpring(*ends, k, 0.1, 10.0).term(parts)
    moved = np.zeros(parts.n)
    moved[parts.columns["arm"].start + np.array([2, 5])] = 2.0, 1.0  # along and about z
    at = np.array([(0.5, 0.05), (0.0, 0.05)])  # of the tip and the root: the turn is (-y, x)
    by_hand = sum(3.0 * y**2 + 4.0 * x**2 + 5.0 * 2.0**2 for x, y in at)
    assert_allclose(moved @ K @ moved, by_hand)
    refuse(
        (
            lambda: JointSpring(ends[0], ends[1][:1], k, 0.1, 10.0).term(parts),
            "1 places of the other",
        ),
        (lambda: JointSpring((), (), k, 0.1, 10.0).term(parts), r"must be \(body, interface\) of"),
    )


def test_a_joint_and_both_moduli_are_found(bolted):
    true = {"frame.E": 1.2, "arm.E": 0.85, "bolts": 0.5}
    attached = {"bolts": BOLTS}
    test = measured(bolted, attached, true)
    found = rom.update(bolted, test, fixed=HELD, attached=attached)
    assert found.verdict.ok, found
    updating.assert_right(found, true)
    assert max(found.deviations[name] for name in true) < 0.1 / 4
    own = np.delete(np.arange(20), 18)  # of two along y on the rigid face of the tip one is enough
    fewer = replace(test, H=test.H[:, own], sensors=test.sensors.some(own))
    options = {"attached": attached, "residual": "response-function"}
    other = rom.update(bolted, fewer, fixed=HELD, **options)
    for name, value in true.items():
        assert_allclose(other.factors[name], value, rtol=0.02)
    bodies = found.assembly.bodies
    assert bodies["arm"].provenance["updating"]["factors"] == found.factors
    alone = bolted.families["arm"].at(E=found.factors["arm.E"])
    assert_allclose(bodies["arm"].frequencies(4), alone.frequencies(4), rtol=1e-12)
    drawn = found.drawn(LINES[:3], *CHANNELS, n=2)
    assert drawn.shape == (2, 3, 20, 1)


def test_a_joint_taken_for_rigid_is_refused_and_a_missing_mass_is_named(joined, bolted):
    attached = {"bolts": BOLTS}
    test = measured(bolted, attached, {"bolts": 0.3})
    assert not rom.update(joined, test, fixed=HELD).verdict.ok
    heavy = {"cable": AddedMass(("arm", "tip"), 1.0, 0.1, 10.0)}
    test = measured(bolted, attached | heavy, {})
    prop = {"prop": GroundSpring(("frame", "tip"), (1e6, 1e6, 1e6), 0.1, 10.0)}
    found = rom.update(bolted, test, fixed=HELD, attached=attached, candidates=heavy | prop)
    assert not found.verdict.ok
    assert max(found.scores, key=lambda name: abs(found.scores[name])) == "cable"


def test_an_assembly_of_one_is_planned_and_tracked_as_a_body(families):
    family, one = families["frame"], FamilyAssembly({"frame": families["frame"]})
    offered = rom.updating.candidates(family.body, 3, fixed=("root",))
    load = AddedMass("tip", 2.0, 0.1, 10.0)
    options = {"n_sensors": 2, "noise": 0.05}
    alone = rom.updating.place(family, offered, offered, LINES[::5], fixed=("root",),
                  attached={"load": load}, **options)  # fmt: skip
    named = replace(offered, bodies="frame")
    same = rom.updating.place(one, named, named, LINES[::5], fixed=HELD,
                 attached={"load": replace(load, at=("frame", "tip"))}, **options)  # fmt: skip
    assert alone.names[:2] == ("E", "load") and same.names[:2] == ("frame.E", "load")
    assert_allclose(same.covariance, alone.covariance, rtol=1e-8)
    for line, own in zip(same.csv().split(), alone.csv().split(), strict=True):
        assert line == f"{own},{'body' if own.startswith('kind') else 'frame'}"
    drift = Drift(0.1, 0.02)
    alone = tracked(family, *watched(), parameters={"E": drift}, fixed=("root",), **TRACKED)
    same = tracked(one, *watched("frame"), parameters={"frame.E": drift}, fixed=HELD, **TRACKED)
    y = np.sqrt(alone.R) * np.random.default_rng(0).standard_normal((200, 3))
    names = ("values", "forces", "factors", "surprise")
    assert_alike(same.run(y), alone.run(y), names, 1e-8)


def test_channels_name_the_body_on_which_they_lie(bolted):
    parts = Parts.of(bolted)
    bodies = parts.bodies
    at = [[0.5, 0.1, 0.08]] * 2, [[0, 0, 1]] * 2
    both = Channels(*at, ("arm", "frame"))
    rows = both.rows(bodies, "sensor")
    for row, name in zip(rows, both.bodies, strict=True):
        alone = Channels(at[0][:1], at[1][:1]).rows(bodies[name], "sensor")[0]
        assert_allclose(row[parts.columns[name]], alone)
        assert np.count_nonzero(row) == np.count_nonzero(alone)
    assert both.owners(bodies, "sensor") == ["arm", "frame"]
    assert both.some([1]).bodies == ("frame",) and Channels(*at, "arm").bodies == ("arm", "arm")
    leg, off = Channels(*at, "leg"), Channels([[0.1, 0.1, 0.08]], [[0, 0, 1]], "arm")
    refuse(
        (lambda: leg.rows(bodies, "sensor"), "sensor 0 lies on 'leg'; give of 'frame', 'arm'"),
        (lambda: off.rows(bodies, "sensor"), "sensor 0 at .* m off 'arm'"),
        (lambda: both.rows(bodies["arm"], "sensor"), "lies on 'arm'; give none of this body"),
        (lambda: Channels(*at, ("arm",)), "1 names of bodies for 2 channels"),
    )
    offered = rom.updating.candidates(bolted, 12, fixed=HELD)
    assert set(offered.bodies) == {"frame", "arm"} and len(offered.points) == 36


def watched(body=None):
    up = [[0.0, 0.0, 1.0]]
    end = Channels([[0.5, 0.1, 0.08]], up, body)
    strain = Sensors(Channels([[0.125, 0.05, 0.08]], [[1, 0, 0]]), "strain", 1e-8)
    sensors = strain, Sensors(end, "acceleration", 0.1), Sensors(end, "displacement", 1e-6)
    return sensors, Channels([[0.375, 0.1, 0.08]], up), (Sensors(end, "velocity"),)


def test_bodies_that_are_coupled_are_tracked_with_their_own_damping(families):
    """D = beta K of each is beta omega^2 of each mode of the whole; a force that lasts bends it."""
    beta, dt, couplings = 1e-5, 1e-5, ((("frame", "tip"), ("arm", "root")),)
    bodies = {name: replace(one.body, D=beta * one.body.K) for name, one in families.items()}
    whole = rom.Assembly(bodies, couplings)
    sensors, force, _ = watched("arm")
    t = rom.updating.tracker(whole, sensors, force, sensors[2:], dt=dt, walk=1.0, fixed=HELD)
    modes = whole.modes(fixed=HELD)
    damped = np.array([np.roots([1.0, beta * w**2, w**2]) for w in modes.omega]).ravel()
    found, expected = np.linalg.eigvals(t.A), np.r_[np.exp(damped * dt), 1.0]
    assert found.size == expected.size
    assert max(np.abs(found - one).min() for one in expected) < 1e-7
    motion = np.linalg.solve(np.eye(len(t.A) - 1) - t.A[:-1, :-1], t.A[:-1, -1])
    end = replace(sensors[2].channels, bodies=None).rows(bodies["arm"], "channel")
    tip = end @ modes.shapes["arm"]
    driven = force.rows(bodies["frame"], "channel") @ modes.shapes["frame"]
    assert_allclose(t.W[0, :-1] @ motion, np.sum(tip * driven / modes.omega**2), rtol=1e-6)


def test_a_body_beside_one_that_it_does_not_touch_is_tracked_as_alone(families):
    """Stress too, which is of the coordinates of its body; bricks recover none, any will do."""
    rng, family = np.random.default_rng(2), families["frame"]
    shares = [replace(s, stress=rng.normal(size=(6, family.body.n_modes))) for s in family.shares]
    at = [[0.125, 0.1, 0.08]]
    stress = StressRecovery(np.array(at), sum(s.stress for s in shares))
    family = replace(family, shares=tuple(shares), body=replace(family.body, stress=stress))
    sensors, force, _ = watched("frame")
    options = dict(TRACKED, parameters={"E": Drift(0.1, 0.02)})
    wanted = (Sensors(Channels(at, [[1, 0, 0]]), "stress"),)
    alone = tracked(family, watched()[0], force, wanted, fixed=("root",), **options)
    options["parameters"] = {"frame.E": Drift(0.1, 0.02)}
    two = FamilyAssembly({"arm": families["arm"], "frame": family})
    same = tracked(two, sensors, force, wanted, fixed=(("arm", "root"), *HELD), **options)
    y = np.sqrt(alone.R) * rng.standard_normal((200, 3))
    assert_alike(same.run(y), alone.run(y), ("values", "deviations", "factors"), 1e-8)


@pytest.mark.long  # that of a family is tried in test_parameter_tracking.py
def test_the_fmu_of_an_assembly_follows_as_python_does(bolted, tmp_path):
    fmus = importlib.import_module("cases.mbs.fmu_instance")  # skips where fmpy is not installed
    drifts = {"arm.E": Drift(0.05, 0.05), "bolts": Drift(0.05, 0.05)}
    t = tracked(bolted, *watched("arm"), parameters=drifts, fixed=HELD,
                          attached={"bolts": BOLTS}, **TRACKED)  # fmt: skip
    y = 30 * np.sqrt(t.R) * np.sin(np.arange(60)[:, None] * [0.5, 0.9, 0.2])
    expected = t.run(y)
    one = fmus.Instance(rom.io.write_observer_fmu(t, tmp_path / "bolted.fmu"), tmp_path).begin()
    sensors = [f"{name}[1]" for name in ("strain", "acceleration", "displacement")]
    names = ("velocity[1]", "force[1]", "factor.'arm.E'", "factor.bolts")
    found = fed(one, sensors, y, [f"estimate.{name}" for name in names], TRACKED["dt"])
    same = np.hstack([expected.values, expected.forces, expected.factors])
    scale = np.abs(same).max(axis=0)
    assert_allclose(found / scale, same / scale, rtol=0, atol=1e-10)


def test_a_joint_that_loosens_is_followed(bolted):
    up = [[0.0, 0.0, 1.0]]
    ends = (Channels([[0.5, 0.1, 0.08]], up, name) for name in bolted.families)
    sensors = tuple(Sensors(end, "displacement", 1e-8) for end in ends)
    force = Channels([[1.0, 0.1, 0.08]], up)
    wanted = (Sensors(force, "displacement"),)
    options = dict(TRACKED, dt=2e-4, walk=1e4, first=10.0, attached={"bolts": BOLTS}, fixed=HELD)
    t = tracked(bolted, sensors, force, wanted,
                          parameters={"bolts": Drift(0.02, 0.05)}, **options)  # fmt: skip
    true, _, y = walked(t, np.random.default_rng(3), 3000, every=100)
    found = t.run(y)
    off = (np.log(found.factors) - true)[:, 0] / found.factor_deviations[:, 0]
    assert found.factor_deviations[-1, 0] < 0.03
    assert np.mean(np.abs(off[500:]) < 2.5) > 0.9
    assert_allclose(found.surprise[500:].mean(), 2.0, rtol=0.12)
    held = t.held(bolts=0.9).run(y[:50])
    assert held.values.shape == (50, 1)


def test_what_does_not_fit_an_assembly_is_named(families, bolted):
    test = measured(bolted, {"bolts": BOLTS}, {})

    def updated(test=test, attached=BOLTS, fixed=HELD):
        return rom.update(bolted, test, fixed=fixed, attached={"bolts": attached})

    seam = replace(test, inputs=Channels([[0.5, 0.1, 0.08]], [[0, 0, 1]]))
    arm, single = families["arm"], families["frame"]
    two = replace(arm, parameters={"b.E": arm.parameters["E"]})
    inches = replace(arm, body=replace(arm.body, units="mm-t-s"))
    one, leg, knee = AddedMass("tip", 1.0, 0.1, 1.0), ("leg", "tip"), ("arm", "knee")
    there = (Channels([[0.375, 0.1, 0.08]], [[0, 1, 2]]),) * 2
    own = noisy_test(single, {}, there, LINES, fixed=("root",), **TEST)
    part, whole = rom.update(single, own, fixed=("root",)), updated()
    place = "must be .body, interface"
    refuse(
        (lambda: updated(seam), "input 0 at .* is as near to one as to another of 'frame', 'arm'"),
        (lambda: updated(attached=one), "'tip' must be .body, interface. of .'arm', 'frame'"),
        (lambda: updated(attached=replace(BOLTS, one=leg)), place),
        (lambda: updated(attached=replace(BOLTS, one=knee)), InterfaceError, "knee"),
        (lambda: updated(fixed=(("leg", "root"),)), place),
        (lambda: updated(fixed=("root",)), place),
        (lambda: updated(fixed="root"), place),
        (lambda: updated(fixed={"root": "x"}), place),
        (lambda: replace(BOLTS, low=20.0), "has the range 20.0 to 10.0"),
        (lambda: FamilyAssembly({}), "there is no family"),
        (lambda: FamilyAssembly({"": arm}), "the name of a family must be a text"),
        (lambda: FamilyAssembly({"a": two, "a.b": arm}), r"have one name among 'a\.b\.E'"),
        (lambda: FamilyAssembly(families | {"arm": inches}), "families 'arm' are not in SI"),
        (lambda: part.assembly, "one body was updated"),
        (lambda: whole.body, "has several bodies"),
    )
