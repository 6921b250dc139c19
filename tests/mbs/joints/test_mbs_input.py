"""Wrong input to mechanisms and runs: the class of the error, and the culprit in its words."""

import numpy as np
import pytest

from cases.mbs.mechanisms import (
    nodal_body,
    random_body,
    random_nodes,
    simulate_quietly,
    slider_crank,
)
from rom.errors import ConfigError, InterruptedRun, ModelError, SolverError
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism

Z = (0, 0, 1)
UNIT = {"mass": 1.0, "inertia": (1.0, 1.0, 1.0), "at": (0, 0, 0)}


def mechanism():
    mech = Mechanism(gravity=(0, 0, -9.81))
    box = mech.add_rigid("box", **UNIT, markers={"a": (0, 0, 0), "b": (1, 0, 0)})
    body = random_body(np.random.default_rng(1))
    bar = mech.add_flexible("bar", body, at=(1, 0, 0) - body.marker("a").point)
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), box.marker("a"), axis=Z)
    mech.spherical("ball", box.marker("b"), bar.marker("a"))
    return mech, box, bar


def singular_body():
    """Shapes that move all nodes alike: a translation, which the frame already is."""
    x, Ms, phi, K, _ = random_nodes(np.random.default_rng(2), r=2)
    phi[0] = np.array([1.0, 0, 0])
    return nodal_body(x, Ms, phi, K)


WRONG = {
    "gravity of two": (lambda m, box, bar: Mechanism(gravity=(0, 1)), ConfigError, "gravity"),
    "gravity not finite": (lambda m, box, bar: Mechanism(gravity=(0, 0, np.nan)), ConfigError,
                           "gravity"),
    "mass zero": (lambda m, *_: m.add_rigid("x", **UNIT | {"mass": 0}), ConfigError, "mass"),
    "mass negative": (lambda m, *_: m.add_rigid("x", **UNIT | {"mass": -1}), ConfigError, "mass"),
    "inertia negative": (lambda m, *_: m.add_rigid("x", **UNIT | {"inertia": (1, 1, -1)}),
                         ModelError, "principal moments"),
    "inertia of no body": (lambda m, *_: m.add_rigid("x", **UNIT | {"inertia": (1, 1, 3)}),
                           ModelError, "no body has this inertia"),
    "inertia skewed": (lambda m, *_: m.add_rigid(
        "x", **UNIT | {"inertia": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}), ModelError, "symmetric"),
    "quaternion zero": (lambda m, *_: m.add_rigid("x", **UNIT, orientation=(0, 0, 0, 0)),
                        ConfigError, "quaternion [0.0, 0.0, 0.0, 0.0]"),
    "quaternion of length 1.1": (lambda m, *_: m.add_rigid("x", **UNIT, orientation=(1.1, 0, 0, 0)),
                                 ConfigError, "quaternion"),
    "stretch as orientation": (lambda m, *_: m.add_rigid(
        "x", **UNIT, orientation=np.diag([2, 1, 1])), ConfigError, "orientation"),
    "mirror as orientation": (lambda m, *_: m.add_rigid(
        "x", **UNIT, orientation=np.diag([1, 1, -1])), ConfigError, "orientation"),
    "position of text": (lambda m, *_: m.add_rigid("x", **UNIT | {"at": ("a", 0, 0)}),
                         ConfigError, "at"),
    "name twice": (lambda m, *_: m.add_rigid("box", **UNIT), ConfigError, "'box' is used twice"),
    "name of the ground": (lambda m, *_: m.add_rigid("ground", **UNIT), ConfigError, "ground"),
    "name empty": (lambda m, *_: m.add_rigid("", **UNIT), ConfigError, "name"),
    "marker unknown": (lambda m, box, bar: box.marker("c"), ConfigError, "no marker 'c'"),
    "free point on a flexible body": (lambda m, box, bar: bar.marker((0, 0, 0)), ConfigError,
                                      "is flexible"),
    "rigid motion in the shapes": (lambda m, *_: m.add_flexible("x", singular_body()), ModelError,
                                   "singular"),
    "elastic start too short": (lambda m, *_: m.add_flexible(
        "x", random_body(np.random.default_rng(1)), q=(1.0,)), ConfigError, "q"),
    "axis zero": (lambda m, box, bar: m.revolute(
        "j", box.marker("a"), bar.marker("a"), axis=(0, 0, 0)), ConfigError, "axis of j"),
    "joint with itself": (lambda m, box, bar: m.spherical(
        "j", box.marker("a"), box.marker("b")), ConfigError, "with itself"),
    "joint without marker": (lambda m, box, bar: m.spherical("j", box, bar), ConfigError,
                             "must be of type Marker"),
    "axes not perpendicular": (lambda m, box, bar: m.universal(
        "j", box.marker("a"), bar.marker("a"), axis1=Z, axis2=(0, 1, 1)), ConfigError,
        "must be perpendicular"),
    "drive of a ball": (lambda m, *_: m.drive("d", "ball", lambda t: t), ConfigError,
                        "'ball' is spherical"),
    "drive of nothing": (lambda m, *_: m.drive("d", "hunge", lambda t: t), ConfigError,
                         "no joint 'hunge'"),
    "drive by a number": (lambda m, *_: m.drive("d", "hinge", 3.0), ConfigError,
                          "function = 3.0 must be a function"),
    "stiffness of text": (lambda m, box, bar: m.spring_damper(
        "s", box.marker("a"), bar.marker("a"), stiffness="hard"), ConfigError, "stiffness"),
    "coil on a slide": (lambda m, box, bar: (
        m.prismatic("slide", mechanism_ground(m), bar.marker("b"), axis=Z),
        m.rotational_spring("coil", "slide", stiffness=1.0)), ConfigError, "no coordinate 'angle'"),
    "force of two": (lambda m, box, bar: m.force("f", box.marker("a"), (1, 2)), ConfigError,
                     "vector of f"),
    "force in no frame": (lambda m, box, bar: m.force(
        "f", box.marker("a"), (1, 2, 3), frame="local"), ConfigError, "'local'"),
    "law of a number": (lambda m, box, bar: m.user_force("u", 1.0, box.marker("a")), ConfigError,
                        "function = 1.0 must be a function"),
}  # fmt: skip


def mechanism_ground(m):
    return m.ground.marker((0, 0, 0))


@pytest.mark.parametrize("case", WRONG)
def test_wrong_parts_of_a_mechanism_are_refused_where_they_are_made(case):
    act, error, words = WRONG[case]
    mech, box, bar = mechanism()
    before = (set(mech.parts), set(mech.drives), set(mech.springs), set(mech.loads))
    with pytest.raises(error) as caught:
        act(mech, box, bar)
    assert words in f"{caught.value} {caught.value.where}"
    assert (set(mech.parts), set(mech.drives), set(mech.springs), set(mech.loads)) == before


GOOD = {"t_end": 0.01, "dt": 1e-3}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"dt": 0.0}, "dt = 0"),
        ({"dt": -1e-3}, "dt = -0.001"),
        ({"dt": np.nan}, "dt = nan"),
        ({"t_end": 0.0}, "t_end = 0 s is not after 0 s"),
        ({"t_end": np.inf}, "t_end = inf"),
        ({"t_end": "1"}, "t_end = '1'"),
        ({"rho_inf": 1.1}, "rho_inf = 1.1"),
        ({"rho_inf": -0.1}, "rho_inf = -0.1"),
        ({"tolerance": 0.0}, "tolerance = 0"),
        ({"save_every": 0}, "save_every = 0"),
        ({"save_every": 1.5}, "save_every = 1.5"),
        ({"method": "euler"}, "method = 'euler' is none of "),
    ],
)
def test_wrong_arguments_of_a_run_are_named(options, words):
    with pytest.raises(ConfigError) as caught:
        simulate(slider_crank(), **GOOD | options)
    assert words in str(caught.value)


def test_a_state_of_another_mechanism_is_refused():
    state = simulate_quietly(slider_crank(), **GOOD).final
    with pytest.raises(ConfigError, match="the state has 21 coordinates, 18 velocities"):
        simulate(mechanism()[0], t_end=1.0, dt=0.1, state=state)


def test_an_empty_mechanism_is_refused():
    with pytest.raises(ConfigError, match="bod"):
        simulate(Mechanism(), **GOOD)


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_a_drive_that_is_no_number_ends_the_run_with_the_motion_so_far(method):
    mech = Mechanism(gravity=(0, 0, 0))
    box = mech.add_rigid("box", **UNIT)
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), box.marker((0, 0, 0)), axis=Z)
    mech.drive("motor", "hinge", lambda t: t if t < 0.05 else np.nan)
    with pytest.raises(SolverError, match=r"'motor' gives .*nan.* at t = ") as caught:
        simulate(mech, t_end=0.1, dt=1e-3, method=method)
    kept = caught.value.solution
    assert 0.02 < kept.t[-1] <= 0.05
    assert "Stopped" in kept.status


@pytest.mark.parametrize("value", [(np.zeros(3), np.array([0, np.inf, 0])), 3.0, (1, 2)])
def test_a_law_that_returns_nonsense_ends_the_run(value):
    mech, box, _ = mechanism()
    mech.user_force("law", lambda t, a: value, box.marker("a"))
    with pytest.raises((SolverError, ConfigError), match="'law'"):
        simulate(mech, **GOOD)


def test_an_error_inside_a_law_is_not_swallowed():
    mech, box, _ = mechanism()
    mech.user_force("law", lambda t, a: 1 / 0, box.marker("a"))
    with pytest.raises(SolverError, match="'law' failed at t = 0 s: ZeroDivisionError") as caught:
        simulate(mech, **GOOD)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_ctrl_c_keeps_the_motion_so_far():
    def interrupted(t, a):
        if t > 0.005:
            raise KeyboardInterrupt
        return np.zeros(3), np.zeros(3)

    mech, box, _ = mechanism()
    mech.user_force("law", interrupted, box.marker("a"))
    with pytest.raises(InterruptedRun, match=r"interrupted at t = 0.005 s of 0.01 s") as caught:
        simulate(mech, **GOOD)
    assert caught.value.solution.t[-1] == pytest.approx(0.005)
    assert np.isfinite(caught.value.solution.q).all()


def test_a_crank_that_cannot_pass_stops_with_the_reason():
    """The rod is shorter than the crank: at asin(1/3) of the crank angle it is at its end."""
    mech = slider_crank(l1=0.3, l2=0.1, speed=10.0)
    with pytest.raises(SolverError, match=r"at t = 0\.03[34]") as caught:
        simulate_quietly(mech, t_end=0.2, dt=1e-3)
    assert "near a singular position" in str(caught.value)
    assert caught.value.solution.t[-1] == pytest.approx(np.arcsin(1 / 3) / 10.0, abs=2e-3)


def test_questions_about_unknown_bodies_joints_and_markers_are_answered_with_names():
    sol = simulate(mechanism()[0], **GOOD)
    for ask, words in (
        (lambda: sol.position("bux"), "no body 'bux'"),
        (lambda: sol.position("box", "c"), "no marker 'c'"),
        (lambda: sol.reaction("hunge"), "no joint or drive 'hunge'"),
        (lambda: sol.position("box", (0.1, 0.2, 0.3)), "was not a marker of the run"),
    ):
        with pytest.raises(ConfigError, match=words):
            ask()
