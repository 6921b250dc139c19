"""More wrong input to mechanisms and runs: numbers, names, markers of others, signals, Ctrl-C."""

import numpy as np
import pytest

from cases.mbs.mechanisms import random_body, simulate_quietly, slider_crank
from rom.errors import ConfigError, InterruptedRun, SolverError
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.audit import audit

Z = (0, 0, 1)
NAN, INF = float("nan"), float("inf")
UNIT = {"mass": 1.0, "inertia": (1.0, 1.0, 1.0), "at": (0, 0, 0)}


def body():
    return random_body(np.random.default_rng(1))


@pytest.fixture
def parts():
    """A mechanism with a hinge, its rigid box and its flexible bar."""
    mech = Mechanism()
    box = mech.add_rigid("box", **UNIT, markers={"a": (0, 0, 0), "b": (1, 0, 0)})
    bar = mech.add_flexible("bar", body(), at=(1, 0, 0) - body().marker("a").point)
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), box.marker("a"), axis=Z)
    mech.spherical("ball", box.marker("b"), bar.marker("a"))
    return mech, box, bar


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"mass": NAN}, "mass = nan"),
        ({"mass": [1, 2]}, "mass = [1, 2] must be a finite number"),
        ({"inertia": (1, 1, INF)}, "inertia = (1, 1, inf) must be finite"),
        ({"inertia": (1, 2)}, "inertia has shape (2,)"),
        ({"at": (0, NAN, 0)}, "at = (0, nan, 0) must be finite"),
        ({"at": (0, 0)}, "at has shape (2,)"),
        ({"velocity": (INF, 0, 0)}, "velocity = (inf"),
        ({"omega": (0, 0, NAN)}, "omega = (0, 0, nan)"),
        ({"orientation": (NAN, 0, 0, 1)}, "orientation = (nan"),
        ({"markers": {"tip": (0, 0, NAN)}}, "markers['tip'] = (0, 0, nan)"),
        ({"markers": {"tip": (0, 0)}}, "marker tip has shape (2,)"),
    ],
)
def test_numbers_of_a_rigid_body_are_named(wrong, words):
    with pytest.raises(ConfigError) as caught:
        Mechanism().add_rigid("box", **UNIT | wrong)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"q": (NAN, 0, 0, 0)}, "q = (nan"),
        ({"qd": (0, 0, 0)}, "qd has shape (3,), needed is (4,)"),
        ({"omega": (0, 0)}, "omega has shape (2,)"),
        ({"at": (0, 0, INF)}, "at = (0, 0, inf)"),
    ],
)
def test_numbers_of_a_flexible_body_are_named(wrong, words):
    with pytest.raises(ConfigError) as caught:
        Mechanism().add_flexible("bar", body(), **wrong)
    assert words in str(caught.value)


WRONG = {
    "axis not finite": (lambda m, a, b: m.revolute("j", a, b, axis=(0, 0, NAN)),
                        "'j': axis = (0, 0, nan)"),
    "axis of two": (lambda m, a, b: m.prismatic("j", a, b, axis=(0, 1)), "axis of j"),
    "cross without arm": (lambda m, a, b: m.universal("j", a, b, axis1=Z, axis2=(0, 0, 0)),
                          "axis2 of j has length zero"),
    "joint twice": (lambda m, a, b: m.revolute("hinge", a, b, axis=Z), "'hinge' is used twice"),
    "joint like a body": (lambda m, a, b: m.fixed("box", a, b), "'box' is used twice"),
    "load like a joint": (lambda m, a, b: m.force("ball", a, Z), "'ball' is used twice"),
    "spring of nan": (lambda m, a, b: m.spring_damper("s", a, b, stiffness=NAN),
                      "stiffness = nan"),
    "damper of inf": (lambda m, a, b: m.spring_damper("s", a, b, stiffness=1, damping=INF),
                      "damping = inf"),
    "length of nan": (lambda m, a, b: m.spring_damper("s", a, b, stiffness=1, free_length=NAN),
                      "free_length = nan"),
    "spring with one end": (lambda m, a, b: m.spring_damper("s", a, None, stiffness=1),
                            "'s': m2 = None must be of type Marker"),
    "coil of nan": (lambda m, a, b: m.rotational_spring("c", "hinge", stiffness=NAN),
                    "stiffness = nan"),
    "coil on a ball": (lambda m, a, b: m.rotational_spring("c", "ball", stiffness=1.0),
                       "'ball' is spherical"),
    "rate by a number": (lambda m, a, b: m.drive("d", "hinge", np.sin, rate=1.0),
                         "'d': rate = 1.0 must be a function"),
    "force of nan": (lambda m, a, b: m.force("f", a, (0, 0, NAN)), "vector of f"),
    "torque of text": (lambda m, a, b: m.torque("f", a, "up"), "vector of f = 'up'"),
    "law on nothing": (lambda m, a, b: m.user_force("u", lambda t, x: 0, None),
                       "'u': m1 = None must be"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_wrong_joints_and_forces_are_refused_and_leave_no_trace(case, parts):
    mech, box, bar = parts
    act, words = WRONG[case]
    entries = (mech.parts, mech.joints, mech.drives, mech.springs, mech.turns, mech.loads,
               mech.user_forces)  # fmt: skip
    before = [set(x) for x in entries]
    with pytest.raises(ConfigError) as caught:
        act(mech, box.marker("b"), bar.marker("b"))
    assert words in str(caught.value)
    assert [set(x) for x in entries] == before


@pytest.mark.parametrize(
    ("name", "place", "words"),
    [
        ("car", "a", "no body 'car'; the mechanism has ['bar', 'box']"),
        ("bar", "hub", "body 'bar' has no marker 'hub'; it has ['a', 'b']"),
        ("bar", (0, 0, 0), "'bar' is flexible; use its markers ['a', 'b']"),
    ],
)
def test_markers_of_another_mechanism_are_refused_when_they_fit_nothing(name, place, words, parts):
    other = Mechanism().add_rigid(name, **UNIT, markers={"a": (0, 0, 0), "hub": (0, 0, 0)})
    mech, box, _ = parts
    with pytest.raises(ConfigError) as caught:
        mech.spherical("j", box.marker("b"), other.marker(place))
    assert words in str(caught.value)
    assert "j" not in mech.joints


@pytest.mark.parametrize(
    "options",
    [
        {"dt": "fast"},
        {"dt": 1e-3j},
        {"dt": True},
        {"dt": [1e-3]},
        {"t_start": NAN},
        {"rho_inf": NAN},
        {"rtol": -1.0},
        {"atol": 0.0},
        {"save_every": "all"},
        {"save_every": NAN},
        {"save_every": -1},
        {"tolerance": INF},
    ],
)
def test_wrong_arguments_of_a_run_are_named_whatever_their_type(options, parts):
    (name,) = options
    with pytest.raises(ConfigError, match=rf"\b{name} = "):
        simulate(parts[0], **{"t_end": 0.01, "dt": 1e-3} | options)


def test_numbers_of_numpy_are_numbers(parts):
    options = {"t_end": np.float64(0.01), "dt": np.float32(1e-3), "save_every": np.int64(2)}
    assert simulate(parts[0], **options).t.size == 6


def driven(function):
    """A box on a hinge."""
    mech = Mechanism(gravity=(0, 0, 0))
    box = mech.add_rigid("box", **UNIT)
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), box.marker((0, 0, 0)), axis=Z)
    mech.drive("motor", "hinge", function)
    return mech


def pushed(function):
    mech = driven(lambda t: t)
    mech.force("push", mech.parts["box"].marker((0, 0, 0)), function)
    return mech


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
@pytest.mark.parametrize(
    ("build", "name"),
    [(lambda: driven(lambda t: NAN), "motor"), (lambda: pushed(lambda t: (0, 0, NAN)), "push")],
)
def test_a_signal_that_is_no_number_at_the_start_is_named_itself(build, name, method):
    """Not the joint it drives, which no position could close."""
    with pytest.raises(SolverError, match=f"'{name}' gives .*nan.* at t = 0 s") as caught:
        simulate(build(), t_end=0.1, dt=1e-3, method=method)
    assert caught.value.solution is None


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: driven(lambda t: (t, t)), "'motor' returned .* needed is a number"),
        (lambda: driven(lambda t: "x"), "'motor' returned 'x' at t = 0 s"),
        (lambda: pushed(lambda t: (t, t)), "'push' returned .* a vector of 3 numbers"),
    ],
)
def test_signals_of_the_wrong_shape_are_named(build, words):
    with pytest.raises(ConfigError, match=words):
        simulate(build(), t_end=0.1, dt=1e-3)


def test_a_load_that_ceases_to_be_a_number_keeps_the_motion_so_far():
    mech = pushed(lambda t: (1.0, 0, 0 if t < 0.05 else NAN))
    with pytest.raises(SolverError, match=r"'push' gives .*nan.* at t = 0\.05 s") as caught:
        simulate(mech, t_end=0.1, dt=1e-3)
    assert caught.value.solution.t[-1] == pytest.approx(0.049)


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_ctrl_c_inside_a_drive_keeps_the_motion_so_far(method):
    """Drives are sampled ahead, so that the motion ends some steps before the function did."""

    def angle(t):
        if np.max(t) > 0.5:
            raise KeyboardInterrupt
        return 2.0 * t

    with pytest.raises(InterruptedRun, match=r"interrupted at t = 0\.\d+ s of 1 s") as caught:
        simulate(driven(angle), t_end=1.0, dt=1e-3, method=method)
    kept = caught.value.solution
    assert 0.01 < kept.t[-1] <= 0.5
    assert np.abs(kept.omega("box")[:, 2] - 2.0).max() < 1e-9
    assert kept.final.t == kept.t[-1]


def test_steps_far_too_long_are_seen_by_the_audit():
    """Twelve steps to a turn: the joints stay closed, the energy is not kept."""
    sol = simulate_quietly(slider_crank(gravity=9.81), t_end=0.1, dt=0.01)
    assert [row.quantity for row in audit(sol).failures] == [
        "energy balance / energy",
        "drift of energy / energy",
    ]
