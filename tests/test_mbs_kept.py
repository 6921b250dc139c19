"""A motion is never lost: whatever ends a run, what came before is kept, and the run goes on."""

import os
import signal

import numpy as np
import pytest
from mbs_cases import simulate_quietly
from numpy.testing import assert_array_equal

import rom
from rom.errors import ConfigError, InterruptedRun, RomError, SolverError
from rom.mbs.mechanism import Mechanism

PARTS = ("t", "q", "v", "a", "lam", "work", "base", "signals")
T_END = 0.06
METHODS = {
    "alpha": {"dt": 1e-3, "rho_inf": 0.8},
    "bdf": {"dt": 1e-3, "method": "bdf"},
    "bdf3": {"dt": 1e-3, "method": "bdf", "order": 3},
    "stabilised": {"dt": 1e-3, "stabilised": True, "save_every": 7},
    "alpha chosen": {"rtol": 1e-3},
    "bdf chosen": {"method": "bdf", "rtol": 1e-3, "save_every": 3},
    "dop853": {"dt": 2e-3, "method": "dop853", "rtol": 1e-9},
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
    "SIGTERM": (
        lambda value: os.kill(os.getpid(), signal.SIGTERM),
        InterruptedRun,
        "interrupted at",
    ),
}


def endless():
    return endless()


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
    mech = Mechanism()
    arm = {
        "mass": 1.0,
        "inertia": (0.1, 0.1, 0.1),
        "markers": {"a": (-0.5, 0, 0), "b": (0.5, 0, 0)},
    }
    one, two = (mech.add_rigid(name, at=(x, 0, 0), **arm) for name, x in (("1", 0.5), ("2", 1.5)))
    three = mech.add_rigid("3", at=(0, 2, 0), mass=1.0, inertia=(1, 1, 1), markers={"c": (0, 0, 0)})
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), one.marker("a"), axis=(0, 1, 0))
    mech.revolute("knee", one.marker("b"), two.marker("a"), axis=(0, 1, 0))
    mech.revolute("axle", mech.ground.marker((0, 2, 0)), three.marker("c"), axis=(0, 0, 1))
    mech.drive("drive", "axle", lambda t: laws["drive"](t, 3 * t + float(t) ** 3))
    mech.motor("motor", "hinge", lambda t, x, v: laws["motor"](t, -0.1 * v), compiled=False)
    mech.force("load", two.marker("b"), lambda t: laws["load"](t, (0, 0, 5 * np.sin(9 * t))))
    mech.user_force(
        "force", lambda t, a: laws["force"](t, (-0.1 * a.velocity, (0, 0, 0))), two.marker("b")
    )
    mech.event("event", lambda t, x: laws["event"](t, x.position("1")[2] + 0.1))
    return mech


def run(where, broken, options, **more):
    return simulate_quietly(mechanism(where, broken), t_end=T_END, **options, **more)


@pytest.fixture(scope="module")
def whole():
    """The motions that nothing interrupts, by method."""
    found = {}

    def of(method):
        if method not in found:
            found[method] = run("force", Broken(), METHODS[method])
        return found[method]

    return of


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


@pytest.mark.parametrize("where", ["force", "motor", "drive", "event", "load"])
@pytest.mark.parametrize("method", METHODS)
def test_a_function_that_breaks_is_named_and_the_repaired_run_has_the_same_bits(
    method, where, whole, tmp_path, monkeypatch
):
    reference = whole(method)
    monkeypatch.setattr(Broken, "at", 0.6 * T_END)
    for fault, (action, kind, words) in FAULTS.items():
        monkeypatch.setattr(Broken, "fault", staticmethod(action))
        folder = tmp_path / fault
        with pytest.raises(RomError) as caught:
            run(where, Broken(), METHODS[method], keep=rom.Keeping(folder))
        error = caught.value
        assert type(error) is kind and words in str(error), error
        assert kind is InterruptedRun or f"'{where}'" in str(error), error
        assert "at t = 0.0" in str(error), error
        assert 0.02 < error.solution.t[-1] <= Broken.at
        assert_array_equal(error.solution.q, reference.q[: error.solution.t.size])
        Broken.at, at = np.inf, Broken.at
        again = run(where, Broken(), METHODS[method], keep=rom.Keeping(folder, resume=True))
        same(again, reference)
        state = rom.load_state(rom.save_state(error.solution.final, tmp_path / "state.npz"))
        more = run(where, Broken(), METHODS[method], state=state)
        assert more.t[0] == error.solution.final.t > 0.02
        if METHODS[method].get("save_every", 1) == 1:
            assert_array_equal(more.q[1:], reference.q[reference.t > state.t])
        Broken.at = at
