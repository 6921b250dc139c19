"""Steps of chosen length: against closed forms, at any number of steps per call, and kept."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import ellipj, ellipk

import rom
from cases.long import few
from cases.mbs import motions
from cases.mbs.mechanisms import simulate_quietly, slider_crank
from cases.mbs.motions import PARTS, TOP, G, free_crank, heavy_top, pendulum, wound_drive
from cases.mbs.parts import ORIGIN
from rom.errors import ModelError, SolverError
from rom.mbs.integrate import adaptive_step, fixed_step
from rom.mbs.integrate.run import Record

IMPLICIT = ["generalized-alpha", "bdf"]
ANGLE, PENDULUM_RATE = 1.2, np.sqrt(G / 1.1)  # 1 kg m^2 of the ball's place and 0.1 of its own
LEAPS = {pendulum: (0.3, 1e-3), heavy_top: (0.02, 1e-3), free_crank: (0.05, 1e-3)}
LEAPS |= {slider_crank: (0.03, 1e-4), wound_drive: (0.03, 1e-4)}
LEAPS |= {motions.swing: (0.05, 1e-3), motions.four_links: (0.3, 1e-3)}
WAYS = [{}, {"method": "bdf"}, {"stabilised": True}, {"rho_inf": 0.5, "save_every": 3}]


def swung(t):
    """(n, 2) position of the pendulum let go at 1.2 rad, by elliptic functions."""
    k = np.sin(ANGLE / 2)
    _, cn, dn, _ = ellipj(PENDULUM_RATE * t, k**2)
    angle = 2 * np.arcsin(k * cn / dn)
    return np.stack([np.sin(angle), -np.cos(angle)], axis=1)


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_pendulum_follows_elliptic_functions_to_the_tolerance(method):
    """Over a period; a tenth of the tolerance takes as many steps more as a second order does."""
    t_end = 4 * ellipk(np.sin(ANGLE / 2) ** 2) / PENDULUM_RATE
    tolerances, found, steps = (1e-3, 1e-4, 1e-5, 1e-6), [], []
    for rtol in tolerances:
        sol = rom.simulate(pendulum(), t_end=t_end, rtol=rtol, method=method)
        found.append(np.abs(sol.q[:, :2] - swung(sol.t)).max())
        steps.append(sol.statistics["steps"])
        assert 0.5 < np.divide(*np.diff(sol.t)[-2:]) < 2.0  # none is tiny
    assert (np.array(found) < tolerances).all()
    assert_allclose(np.diff(np.log10(found[1:])), -1.0, atol=0.1)
    assert_allclose(np.diff(np.log10(steps[1:])), 0.5, atol=0.05)


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_heavy_top_keeps_energy_and_momenta_to_the_tolerance(method):
    """The spin and the momentum about the vertical are constant, which has no limit of its own."""
    rtol = 1e-6
    sol = rom.simulate(heavy_top(), t_end=0.5, rtol=rtol, method=method)
    mass, J, omega = TOP["mass"], np.array(TOP["inertia"]), sol.omega("top")
    x, v = sol.q[:, :3], sol.v[:, :3]
    energy = 0.5 * mass * (v**2).sum(1) + 0.5 * (J * omega**2).sum(1) + mass * G * x[:, 2]
    world = np.array([rom.rotation.matrix(p) for p in sol.q[::1000, 3:7]])
    turning = np.einsum("tij,tj->ti", world, J * omega[::1000])
    vertical = turning[:, 2] + mass * np.cross(x, v)[::1000, 2]
    assert np.abs(energy / energy[0] - 1).max() < rtol
    assert np.abs(omega[:, 1] / omega[0, 1] - 1).max() < rtol
    assert np.abs(vertical - vertical[0]).max() < 2 * rtol * np.abs(turning[0]).max()
    assert_allclose(x[-1], TOP["positions"]["0.5"], atol=2e-6)
    assert sol.statistics["steps"] > 20_000


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize(
    ("build", "t_end", "rtol"),
    [(pendulum, 1.0, 1e-4), (free_crank, 0.05, 1e-4), (slider_crank, 0.1, 1e-5)],
)
def test_one_call_of_compiled_code_takes_many_steps(method, build, t_end, rtol, monkeypatch):
    """With drives, too: they are sampled ahead while the length of the steps stays."""
    calls, take = [], adaptive_step.control.take_steps
    monkeypatch.setattr(adaptive_step.control, "take_steps", lambda *x: calls.append(1) or take(*x))
    sol = simulate_quietly(build(), t_end=t_end, rtol=rtol, method=method)
    assert len(calls) < 0.2 * sol.statistics["steps"]


@pytest.mark.parametrize("options", WAYS, ids=str)
@pytest.mark.parametrize(("build", "t_end", "rtol"), [(k, *v) for k, v in LEAPS.items()])
def test_how_many_steps_a_call_takes_changes_no_bit(build, t_end, rtol, options, monkeypatch):
    """Nor where it stops between two steps for something outside."""
    runs = []
    for most in (1, 2, 4096):
        monkeypatch.setattr(fixed_step, "LARGEST_CHUNK", most)
        monkeypatch.setattr(fixed_step, "FIRST_CHUNK", most)
        runs.append(simulate_quietly(build(), t_end=t_end, rtol=rtol, **options))
    for run in runs[1:]:
        for name in (*PARTS, "work"):
            assert_array_equal(getattr(run, name), getattr(runs[0], name), err_msg=name)
        for name in ("steps", "iterations", "rejected", "shortest", "longest"):
            assert run.statistics[name] == runs[0].statistics[name], name


class Brake:
    """A force that breaks in a call of the run, until it is mended; a push sets in at a time."""

    def __init__(self, breaks_at=np.inf, pushes_at=np.inf):
        self.breaks_at, self.pushes_at, self.times = breaks_at, pushes_at, []

    def __call__(self, t, marker):
        self.times.append(t)
        if len(self.times) == self.breaks_at:
            raise ZeroDivisionError
        push = 0.5 + 0.5 * np.tanh((t - self.pushes_at) / 1e-4)
        return -0.3 * marker.velocity + 5.0 * push, (0, 0, 0)


def braked(brake, build):
    mech = build()
    part, point = ("bob", "tip") if "bob" in mech.parts else ("slider", "b")
    mech.user_force("brake", brake, mech.parts[part].marker(point))
    return mech


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize(("build", "t_end"), few(1, [(pendulum, 0.3), (wound_drive, 0.03)]))
def test_a_run_that_breaks_within_a_call_goes_on_to_the_same_bits(build, t_end, method, tmp_path):
    """In any evaluation: of steps, of the instants at their ends, of steps that are rejected."""
    options, push = {"t_end": t_end, "rtol": 1e-4, "method": method}, 0.6 * t_end
    count = Brake(pushes_at=push)
    whole = simulate_quietly(braked(count, build), **options)
    pushed = int(np.argmax(np.array(count.times) > push))
    early = [int(share * len(count.times)) for share in (0.3, 0.5)]
    for call in (*early, early[1] + 1, *range(pushed + 2, pushed + 40, 6)):
        folder = tmp_path / str(call)
        with pytest.raises(SolverError, match="'brake' failed") as caught:
            broken = braked(Brake(call, push), build)
            simulate_quietly(broken, keep=rom.Keeping(folder), **options)
        known = caught.value.solution.t.size
        assert 0.1 * whole.t.size < known < whole.t.size
        assert_array_equal(caught.value.solution.q, whole.q[:known])
        keep = rom.Keeping(folder, resume=True)
        rest = simulate_quietly(braked(Brake(pushes_at=push), build), keep=keep, **options)
        for name in PARTS:
            assert_array_equal(getattr(rest, name), getattr(whole, name), err_msg=name)


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_step_that_breaks_gives_back_all_that_it_had_changed(method, monkeypatch):
    """The factors, too: what is remembered is what a run by single steps remembers there."""
    options, found = {"t_end": 0.3, "rtol": 1e-4, "method": method}, {}
    with monkeypatch.context() as patch:
        for name in ("FIRST_CHUNK", "LARGEST_CHUNK"):
            patch.setattr(fixed_step, name, 1)
        patch.setattr(Record, "pause", lambda self: found.update({self.t: self.final.memory}))
        count = Brake(pushes_at=0.18)
        rom.simulate(braked(count, pendulum), **options)
    pushed = int(np.argmax(np.array(count.times) > 0.18))
    for call in range(pushed - 20, pushed + 40, 5):
        with pytest.raises(SolverError) as caught:
            rom.simulate(braked(Brake(call, 0.18), pendulum), **options)
        state = caught.value.solution.final
        for name, x in found[state.t].arrays.items():
            assert_array_equal(state.memory.arrays[name], x, err_msg=name)


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_drive_that_fails_in_a_step_to_come_fails_when_it_is_reached(method):
    mech = slider_crank()
    mech.drives.clear()
    mech.drive("motor", "main", lambda t: np.where(t < 0.02, 50.0 * t, np.nan))
    with pytest.raises(SolverError, match=r"'motor' gives .*nan.* at t = 0\.02") as caught:
        simulate_quietly(mech, t_end=0.03, rtol=1e-4, method=method)
    last = caught.value.solution.t[-2:]
    assert 0.02 - 3 * (last[1] - last[0]) < last[1] < 0.02


def test_velocities_of_drives_that_contradict_each_other_later_are_named():
    """Two drives of one axle: their angles part by less than a gap may be, their rates by more."""
    mech, o = rom.Mechanism(), (0, 0, 0)
    wheel = mech.add_rigid("wheel", mass=1.0, inertia=(1, 1, 1), at=o, markers={"a": o})
    for name, late in (("one", 0.0), ("two", 1e-12)):
        mech.revolute(name, mech.ground.marker(o), wheel.marker("a"), axis=(0, 0, 1))
        mech.drive(
            f"drive {name}",
            name,
            lambda t, late=late: t + late * np.sin(1e6 * np.maximum(t - 0.5, 0)),
            rate=lambda t, late=late: 1.0 + 1e6 * late * (t > 0.5) * np.cos(1e6 * (t - 0.5)),
            acceleration=lambda t: 0 * t,
        )
    with pytest.raises(ModelError, match=r"contradict each other: 'drive (one|two)' misses .*e-07"):
        simulate_quietly(mech, t_end=1.0, rtol=1e-3)


def test_dop853_keeps_its_own_steps_and_ends_at_the_end():
    exact = {"method": "dop853", "rtol": 1e-10, "atol": 1e-12}
    sol = rom.simulate(pendulum(), t_end=1.3, **exact)
    assert sol.t[-1] == 1.3 and sol.t.size == sol.statistics["steps"] + 1
    assert np.diff(sol.t).max() > 2 * np.diff(sol.t)[0]
    assert np.abs(sol.q[:, :2] - swung(sol.t)).max() < 1e-9
    fifth = rom.simulate(pendulum(), t_end=1.3, save_every=5, **exact)
    assert_array_equal(fifth.t[:-1], sol.t[::5][: fifth.t.size - 1])
    assert_array_equal(fifth.q[-1], sol.q[-1])
    assert fifth.t[-1] == 1.3


def test_dop853_without_an_interval_goes_on_to_the_same_bits(tmp_path):
    options = {"t_end": 0.5, "method": "dop853", "rtol": 1e-9, "save_every": 2}
    count = Brake()
    whole = rom.simulate(braked(count, pendulum), **options)
    with pytest.raises(SolverError, match="'brake' failed") as caught:
        broken = braked(Brake(len(count.times) // 2), pendulum)
        rom.simulate(broken, keep=rom.Keeping(tmp_path / "a"), **options)
    assert 2 < caught.value.solution.t.size < whole.t.size
    keep = rom.Keeping(tmp_path / "a", resume=True)
    rest = rom.simulate(braked(Brake(), pendulum), keep=keep, **options)
    for name in PARTS:
        assert_array_equal(getattr(rest, name), getattr(whole, name), err_msg=name)
    state = caught.value.solution.final
    more = rom.simulate(braked(Brake(), pendulum), state=state, **options)
    assert_array_equal(more.q[-1], whole.q[-1])


@pytest.mark.filterwarnings("ignore:.*constraints repeat others")
@pytest.mark.parametrize("options", [{}, {"stabilised": True}, {"method": "bdf"}])
def test_what_comes_to_rest_contradicts_nothing(options):
    """Where all stand still, velocities are round-off, and so are their gaps."""
    mech, z = rom.Mechanism(gravity=(0, -9.81, 0)), (0, 0, 1)
    crank = mech.add_rigid("crank", mass=1.0, inertia=(1e-3, 1e-3, 2e-3), at=(0.05, 0, 0),
                           markers={"p": (-0.05, 0, 0), "q": (0.05, 0, 0)},
                           velocity=(1e-3, 0, 0))  # fmt: skip
    rod = mech.add_rigid("rod", mass=1.0, inertia=(1e-3, 1e-3, 2e-3), at=(0.25, 0.05, 0),
                         markers={"p": (-0.15, -0.05, 0), "q": (0.15, -0.05, 0)})  # fmt: skip
    slider = mech.add_rigid("slider", mass=1.0, inertia=(1e-3,) * 3, at=(0.4, 0, 0)).marker(ORIGIN)
    mech.revolute("main", mech.ground.marker((0, 0, 0)), crank.marker("p"), axis=z)
    mech.revolute("pin", crank.marker("q"), rod.marker("p"), axis=z)
    mech.revolute("wrist", rod.marker("q"), slider, axis=z)
    mech.prismatic("guide", mech.ground.marker((0.4, 0, 0)), slider, axis=(1, 0, 0))
    mech.drive("motor", "main", lambda t: 0.05 * (1 - np.where(t < 0.1, (1 - 10 * t) ** 4, 0.0)))
    sol = rom.simulate(mech, t_end=0.3, assemble=True, **options)
    assert sol.t[-1] == 0.3
    assert np.abs(sol.v[0]).max() > 1.0
    assert np.abs(sol.v[sol.t > 0.11]).max() < 1e-9
    assert sol.joint("main").angle[-1] == pytest.approx(0.05, abs=1e-9)
