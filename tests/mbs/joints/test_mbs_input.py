"""Wrong input to mechanisms and runs: the class of the error, and the culprit in its words."""

import numpy as np
import pytest

import rom
from cases.mbs import mechanisms
from cases.mbs.mechanisms import simulate_quietly, slider_crank
from cases.mbs.parts import Z, on_axle, refused_on
from cases.refusals import refuses
from rom.errors import ConfigError, ModelError, SolverError

UNIT = {"mass": 1.0, "inertia": (1.0, 1.0, 1.0), "at": (0, 0, 0)}
BODY = mechanisms.random_body(np.random.default_rng(1))
GOOD = {"t_end": 0.01, "dt": 1e-3}


def mechanism():
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    box = mech.add_rigid("box", **UNIT, markers={"a": (0, 0, 0), "b": (1, 0, 0)})
    bar = mech.add_flexible("bar", BODY, at=(1, 0, 0) - BODY.marker("a").point)
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), box.marker("a"), axis=Z)
    mech.spherical("ball", box.marker("b"), bar.marker("a"))
    return mech, box, bar


def singular_body():
    """Shapes that move all nodes alike: a translation, which the frame already is."""
    x, Ms, phi, K, _ = mechanisms.random_nodes(np.random.default_rng(2), r=2)
    phi[0] = np.array([1.0, 0, 0])
    return mechanisms.nodal_body(x, Ms, phi, K)


def with_a_slide():
    """A mechanism with a joint that does not turn, and markers of both its bodies."""
    mech, box, bar = mechanism()
    mech.prismatic("slide", mech.ground.marker((0, 0, 0)), bar.marker("b"), axis=Z)
    return mech, box.marker("a"), bar.marker("a")


def wrong(**more):
    """A call that adds a body with other numbers."""
    return lambda mech, *_: mech.add_rigid(**{"name": "x"} | UNIT | more)


test_wrong_parts_of_a_mechanism_are_refused_where_they_are_made = refused_on(with_a_slide, {
    "inertia negative": (wrong(inertia=(1, 1, -1)), ModelError, "principal moments"),
    "inertia of no body": (wrong(inertia=(1, 1, 3)), ModelError, "no body has this inertia"),
    "inertia skewed": (wrong(inertia=[[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]), ModelError, "symmetric"),
    "quaternion zero": (wrong(orientation=(0, 0, 0, 0)), "quaternion [0.0, 0.0, 0.0, 0.0]"),
    "stretch as orientation": (wrong(orientation=np.diag([2, 1, 1])), "orientation"),
    "marker nowhere": (wrong(markers={"tip": (0, 0, np.nan)}), "markers['tip'] = (0, 0, nan)"),
    "rates too short": (lambda m, a, b: m.add_flexible("x", BODY, qd=(0, 0, 0)),
                        "qd has shape (3,), needed is (4,)"),
    "name twice": (wrong(name="box"), "'box' is used twice"),
    "name of the ground": (wrong(name="ground"), "ground"),
    "name empty": (wrong(name=""), "name"),
    "marker unknown": (lambda m, a, b: m.parts["box"].marker("c"), "no marker 'c'"),
    "free point on a flexible body": (lambda m, a, b: m.parts["bar"].marker((0, 0, 0)),
                                      "is flexible"),
    "rigid motion in the shapes": (lambda m, a, b: m.add_flexible("x", singular_body()), ModelError,
                                   "singular"),
    "axis zero": (lambda m, a, b: m.revolute("j", a, b, axis=(0, 0, 0)), "axis of j"),
    "joint with itself": (lambda m, a, b: m.spherical("j", a, m.parts["box"].marker("b")),
                          "with itself"),
    "axes not perpendicular": (lambda m, a, b: m.universal("j", a, b, axis1=Z, axis2=(0, 1, 1)),
                               "must be perpendicular"),
    "drive of nothing": (lambda m, a, b: m.drive("d", "hunge", lambda t: t), "no joint 'hunge'"),
    "joint like a body": (lambda m, a, b: m.fixed("box", a, b), "'box' is used twice"),
    "load like a joint": (lambda m, a, b: m.force("ball", a, Z), "'ball' is used twice"),
    "coil on a ball": (lambda m, a, b: m.rotational_spring("c", "ball", stiffness=1.0),
                       "'ball' is spherical"),
    "coil on a slide": (lambda m, a, b: m.rotational_spring("c", "slide", stiffness=1.0),
                        "no coordinate 'angle'"),
})  # fmt: skip


def test_a_run_that_ends_where_it_starts_or_has_no_body_is_refused():
    with pytest.raises(ConfigError, match="t_end = 0 s is not after 0 s"):
        rom.simulate(slider_crank(), t_end=0.0, dt=1e-3)
    refuses(ConfigError, "bod", rom.simulate, rom.Mechanism(), **GOOD)


def test_a_crank_that_cannot_pass_stops_with_the_reason():
    """The rod is shorter than the crank: at asin(1/3) of the crank angle it is at its end."""
    mech = slider_crank(l1=0.3, l2=0.1, speed=10.0)
    with pytest.raises(SolverError, match=r"at t = 0\.03[34]") as caught:
        simulate_quietly(mech, t_end=0.2, dt=1e-3)
    assert "near a singular position" in str(caught.value)
    assert caught.value.solution.t[-1] == pytest.approx(np.arcsin(1 / 3) / 10.0, abs=2e-3)


def test_questions_about_unknown_bodies_joints_and_markers_are_answered_with_names():
    sol = rom.simulate(mechanism()[0], **GOOD)
    for ask, words in (
        (lambda: sol.position("bux"), "no body 'bux'"),
        (lambda: sol.position("box", "c"), "no marker 'c'"),
        (lambda: sol.reaction("hunge"), "no joint or drive 'hunge'"),
        (lambda: sol.position("box", (0.1, 0.2, 0.3)), "was not a marker of the run"),
    ):
        refuses(ConfigError, words, ask)


@pytest.mark.parametrize(
    ("name", "place", "words"),
    [
        ("car", "a", "no body 'car'; the mechanism has ['bar', 'box']"),
        ("bar", "hub", "body 'bar' has no marker 'hub'; it has ['a', 'b']"),
        ("bar", (0, 0, 0), "'bar' is flexible; use its markers ['a', 'b']"),
    ],
)
def test_markers_of_another_mechanism_are_refused_when_they_fit_nothing(name, place, words):
    other = rom.Mechanism().add_rigid(name, **UNIT, markers={"a": (0, 0, 0), "hub": (0, 0, 0)})
    mech, box, _ = mechanism()
    with pytest.raises(ConfigError) as caught:
        mech.spherical("j", box.marker("b"), other.marker(place))
    assert words in str(caught.value)
    assert "j" not in mech.joints


def test_numbers_of_numpy_are_numbers():
    options = {"t_end": np.float64(0.01), "dt": np.float32(1e-3), "save_every": np.int64(2)}
    mech = mechanism()[0]
    mech.gravity = (0, 0, -10)  # of integers, as an attribute may be set
    assert rom.simulate(mech, **options).t.size == 6


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
@pytest.mark.parametrize("name", ["motor", "push"])
def test_a_signal_that_is_no_number_at_the_start_is_named_itself(name, method):
    """Not the joint it drives, which no position could close."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    centre = on_axle(mech, "box", axle="hinge")
    mech.drive("motor", "hinge", lambda t: np.nan if name == "motor" else t)
    mech.force("push", centre, lambda t: (0, 0, np.nan if name == "push" else 0.0))
    with pytest.raises(SolverError, match=f"'{name}' gives .*nan.* at t = 0 s") as caught:
        rom.simulate(mech, t_end=0.1, dt=1e-3, method=method)
    assert caught.value.solution is None
