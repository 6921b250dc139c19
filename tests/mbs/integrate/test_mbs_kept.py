"""A motion is never lost: whatever ends a run, what came before is kept, and the run goes on."""

import os
import random
import signal
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.long import ROM_LONG
from cases.mbs.mechanisms import simulate_quietly
from cases.mbs.motions import ball
from cases.refusals import refuses
from rom.errors import ConfigError, InterruptedRun, ResourceError, RomError, SolverError
from rom.mbs.integrate import keeping, simulation
from rom.mbs.integrate.run import Record

FAULTS_EACH = 10 if ROM_LONG else 1

PARTS = ("t", "q", "v", "a", "lam", "work", "base", "signals")
T_END = 0.072
METHODS = {
    "alpha": {"dt": 3e-3, "rho_inf": 0.8},
    "bdf": {"dt": 3e-3, "method": "bdf"},
    "bdf3": {"dt": 3e-3, "method": "bdf", "order": 3},
    "stabilised": {"dt": 3e-3, "stabilised": True, "save_every": 7},
    "alpha chosen": {"rtol": 1e-3},
    "bdf chosen": {"method": "bdf", "rtol": 1e-3, "save_every": 3},
    "dop853": {"dt": 3e-3, "method": "dop853", "rtol": 1e-9},
}
FAULTS = {  # what a function does, and the class and the words by which the run ends
    "exception": (lambda value: 1 / 0, SolverError, "ZeroDivisionError"),
    "exit": (lambda value: exit(3), SolverError, "SystemExit: 3"),
    "recursion": (lambda value: endless(), SolverError, "RecursionError"),
    "memory": (lambda value: raised(MemoryError()), SolverError, "MemoryError"),
    "not a number": (lambda value: np.nan * np.array(value), SolverError, "nan"),
    "text": (lambda value: "much", ConfigError, "'much'"),
    "nothing": (lambda value: None, ConfigError, "returned None"),
    "shape": (lambda value: np.zeros((2, 2)), ConfigError, "returned array"),
    "Ctrl-C": (lambda value: raised(KeyboardInterrupt()), InterruptedRun, "interrupted at"),
    "SIGTERM": (lambda value: terminated(), InterruptedRun, "interrupted at"),
}


def endless():
    return endless()


def terminated():
    os.kill(os.getpid(), signal.SIGTERM)


def raised(error):
    raise error


class Broken:
    """A function that breaks at a time, until it is repaired."""

    at = np.inf
    fault = None

    def __call__(self, t, value):
        # float() refuses arrays, so that repaired and broken functions are called alike
        return type(self).fault(value) if float(t) > type(self).at else value


def mechanism(where, broken):
    """Two bodies on hinges, with all that a user may hand over; one of it breaks."""
    laws = dict.fromkeys(("force", "motor", "drive", "event", "load"), lambda t, value: value)
    laws[where] = broken
    mech = rom.Mechanism()
    arm = {"mass": 1.0, "inertia": (0.1,) * 3, "markers": {"a": (-0.5, 0, 0), "b": (0.5, 0, 0)}}
    one, two = (mech.add_rigid(name, at=(x, 0, 0), **arm) for name, x in (("1", 0.5), ("2", 1.5)))
    three = mech.add_rigid("3", at=(0, 2, 0), mass=1.0, inertia=(1, 1, 1), markers={"c": (0, 0, 0)})
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), one.marker("a"), axis=(0, 1, 0))
    mech.revolute("knee", one.marker("b"), two.marker("a"), axis=(0, 1, 0))
    mech.revolute("axle", mech.ground.marker((0, 2, 0)), three.marker("c"), axis=(0, 0, 1))
    mech.drive("drive", "axle", lambda t: laws["drive"](t, 3 * t + float(t) ** 3))
    mech.motor("motor", "hinge", lambda t, x, v: laws["motor"](t, -0.1 * v), compiled=False)
    end = two.marker("b")
    mech.force("load", end, lambda t: laws["load"](t, (0, 0, 5 * np.sin(9 * t))))
    mech.user_force("force", lambda t, a: laws["force"](t, (-0.1 * a.velocity, (0, 0, 0))), end)
    mech.event("event", lambda t, x: laws["event"](t, x.position("1")[2] + 0.1))
    return mech


def run(where, broken, options, **more):
    return simulate_quietly(mechanism(where, broken), t_end=T_END, **options, **more)


@cache
def whole(method):
    return run("force", Broken(), METHODS[method])


def same(one, other):
    for name in PARTS:
        assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    for name, found in other.events.items():
        for part in ("t", "q", "v"):
            assert_array_equal(getattr(one.events[name], part), getattr(found, part))
    assert one.status == other.status
    counts = ("steps", "iterations", "factorisations", "rejected", "shortest", "evaluations")
    for name in set(counts) & set(other.statistics):
        assert one.statistics[name] == other.statistics[name], name


@pytest.mark.once
@pytest.mark.parametrize("where", ["force", "motor", "drive", "event", "load"])
@pytest.mark.parametrize("method", METHODS)
def test_a_function_that_breaks_is_named_and_the_repaired_run_has_the_same_bits(
    method, where, tmp_path, monkeypatch
):
    reference, rng = whole(method), random.Random(method + where)
    monkeypatch.setattr(os, "fsync", lambda _: None)  # whole files are tested elsewhere
    for fault in rng.sample(list(FAULTS), FAULTS_EACH):
        at = rng.choice((0.4, 0.85)) * T_END  # in the first chunk of steps, or in the second
        if FAULTS[fault][1] is InterruptedRun:  # while functions of a chunk to come are sampled
            at = 0.85 * T_END
        error = failed(where, method, fault, at, tmp_path / fault)
        # a step of dop853 that is tried may be ten times the last one
        assert at / 11 < error.solution.final.t <= at >= error.solution.t[-1]
        known = np.isin(error.solution.t, reference.t)  # the last one may lie between
        assert known[:-1].all()
        assert_array_equal(error.solution.q[known], reference.q[: known.sum()])
        keep = rom.Keeping(tmp_path / fault, resume=True)
        same(run(where, Broken(), METHODS[method], keep=keep), reference)
        state = rom.load_state(rom.save_state(error.solution.final, tmp_path / "state.npz"))
        more = run(where, Broken(), METHODS[method], state=state)
        assert more.t[0] == error.solution.final.t
        if METHODS[method].get("save_every", 1) == 1:
            # a run of its own begins its finite differences of drives anew: orders of bdf feel it
            off = 1e-14 if method == "bdf3" else 0.0
            rest = reference.q[reference.t > state.t]
            assert_allclose(more.q[1:], rest, rtol=0, atol=off)


def failed(where, method, fault, at, folder):
    """The error of a run whose function breaks: of its class, with the name and the time."""
    action, kind, words = FAULTS[fault]
    with pytest.MonkeyPatch.context() as patch, pytest.raises(RomError) as caught:
        patch.setattr(Broken, "fault", staticmethod(action))
        patch.setattr(Broken, "at", at)
        run(where, Broken(), METHODS[method], keep=rom.Keeping(folder))
    error = caught.value
    assert type(error) is kind and words in str(error), error
    assert kind is InterruptedRun or f"'{where}'" in str(error), error
    assert "at t = 0.0" in str(error), error
    return error


@pytest.mark.parametrize("where", ["force", "motor", "drive", "event", "load"])
@pytest.mark.parametrize("method", METHODS)
def test_a_function_that_breaks_at_once_leaves_no_motion_but_the_start(method, where, monkeypatch):
    monkeypatch.setattr(Broken, "at", -1.0)
    monkeypatch.setattr(Broken, "fault", staticmethod(FAULTS["exception"][0]))
    says = f"'{where}' failed at t = 0 s: ZeroDivisionError"
    with pytest.raises(SolverError, match=says) as found:
        run(where, Broken(), METHODS[method])
    assert found.value.solution is None
    assert isinstance(found.value.__cause__, ZeroDivisionError)
    assert f"({__file__}, line " in str(found.value)


def test_a_function_that_takes_other_arguments_is_a_mistake_of_its_writer():
    mech = mechanism("force", Broken())
    mech.user_force("short", lambda t: None, mech.parts["1"].marker("b"))
    says = r"'short' cannot be called at t = 0 s: TypeError: .*<lambda>"
    refuses(ConfigError, says, rom.simulate, mech, t_end=0.1, dt=1e-3)


def test_an_unknown_error_of_ours_keeps_its_type_and_carries_the_motion(monkeypatch):
    for found, kind in ((LookupError("x"), LookupError), (MemoryError(), ResourceError)):
        monkeypatch.setattr(Record, "pause", lambda _, error=found: raised(error))
        with pytest.raises(kind) as caught:
            run("force", Broken(), METHODS["alpha"])
        assert caught.value.solution.t[-1] == 16 * 3e-3  # the first chunk


def test_a_warning_that_is_an_error_does_not_take_the_motion_with_it(monkeypatch):
    def warn(solution):
        raise rom.errors.QualityGateError("too fast.")

    monkeypatch.setattr(simulation, "warn_of_limits", warn)
    with pytest.raises(rom.errors.QualityGateError) as caught:
        run("force", Broken(), METHODS["alpha"])
    assert caught.value.solution.t[-1] == pytest.approx(T_END)


@pytest.mark.parametrize("method", ["generalized-alpha", "bdf", "dop853"])
@pytest.mark.parametrize(
    ("options", "kind", "words"),
    [
        ({"dt": 1e-18}, ConfigError, r"takes 1e\+18 steps to t_end = 1 s; at most 1e\+12"),
        ({"dt": 1e-13}, ConfigError, r"takes 1e\+13 steps"),
        ({"dt": 5e-324}, ConfigError, "takes inf steps"),
        ({"dt": 1e-11}, ResourceError, r"keeping 1e\+11 instants takes .* free.*save_every"),
        ({"dt": 5.0, "t_end": 0.02}, ConfigError, r"5 s is longer than the motion of 0\.02 s"),
        ({"dt": 1.0, "t_start": 1e17, "t_end": 1e17 + 64}, ConfigError, "is lost beside t = 1e"),
        ({"dt": 1e-9, "t_start": 1e9 - 1, "t_end": 1e9}, ConfigError, "is lost beside t = 1e"),
    ],
)
def test_more_than_can_be_computed_or_kept_is_refused_before_a_try(options, kind, words, method):
    refuses(kind, words, rom.simulate, ball(), method=method, **{"t_end": 1.0} | options)


def test_a_short_run_leaves_no_folder_and_a_long_one_writes_parts(tmp_path, monkeypatch):
    monkeypatch.setattr(keeping, "MIN_INTERVAL", 60.0)
    run("force", Broken(), METHODS["alpha"], keep=rom.Keeping(tmp_path / "short"))
    assert not (tmp_path / "short").exists()
    monkeypatch.setattr(keeping, "MIN_INTERVAL", 0.0)
    monkeypatch.setattr(keeping, "WRITE_TIME_FACTOR", 0.0)
    keep = rom.Keeping(tmp_path / "long")
    whole = run("force", Broken(), METHODS["alpha"], keep=keep)
    names = sorted(path.name for path in (tmp_path / "long").iterdir())
    assert names[:2] == ["part-000001.npz", "part-000002.npz"] and names[-1] == "state.npz"
    with pytest.raises(ConfigError, match="did not come to its end"):
        run("force", Broken(), METHODS["alpha"], keep=rom.Keeping(tmp_path / "long"))
    options = METHODS["alpha"] | {"keep": rom.Keeping(tmp_path / "long", resume=True)}
    half = rom.simulate(mechanism("force", Broken()), t_end=0.5 * T_END, **options)
    assert_array_equal(half.q, whole.q[: half.t.size])
    assert half.t[-1] == pytest.approx(0.5 * T_END)
    keep.remove()
    assert not (tmp_path / "long").exists()
    with pytest.raises(ConfigError, match="there is nothing to resume"):
        run("force", Broken(), METHODS["alpha"], keep=rom.Keeping(tmp_path / "long", resume=True))


def test_an_event_in_the_very_step_in_which_another_one_breaks_is_found_once(tmp_path, monkeypatch):
    def timed(**more):
        mech = ball()
        mech.event("first", lambda t, x: t - 0.0305)
        mech.event("second", lambda t, x: Broken()(t, 1.0))
        return rom.simulate(mech, t_end=0.06, dt=3e-3, **more)

    monkeypatch.setattr(Broken, "fault", staticmethod(FAULTS["exception"][0]))
    with monkeypatch.context() as patch, pytest.raises(SolverError, match="'second' failed"):
        patch.setattr(Broken, "at", 0.031)
        timed(keep=rom.Keeping(tmp_path / "kept"))
    again = timed(keep=rom.Keeping(tmp_path / "kept", resume=True))
    assert_allclose(again.events["first"].t, [0.0305], rtol=1e-12)
