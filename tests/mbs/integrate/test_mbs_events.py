"""Zeros of functions of the motion, and the motion between its instants."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from cases.mbs.mechanisms import simulate_quietly, slider_crank
from cases.mbs.motions import G, ball, falling, heavy_top, pendulum
from cases.refusals import refuses
from rom.errors import ConfigError, SolverError
from rom.mbs.integrate import fixed_step
from rom.mbs.integrate.simulation import simulate
from rom.mbs.results.interpolation import vector_rate


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_a_bouncing_ball_touches_the_floor_when_it_must(method):
    mech, state, times, e = falling(), None, [], 0.8
    for _ in range(4):
        sol = simulate(mech, t_end=10.0, dt=0.013, method=method, state=state)
        times.append(sol.t[-1])
        v = sol.final.v.copy()
        v[2] *= -e
        state = replace(sol.final, v=v)
    first = np.sqrt(2 / G)
    wanted = first * (1 + 2 * np.cumsum([0, e, e**2, e**3]))
    assert_allclose(times, wanted, rtol=0, atol=1e-10)
    assert sol.status == f"Stopped by event 'floor' at t = {times[-1]:.9g} s."
    assert_allclose(sol.position("ball")[-1, [0, 2]], [0.3 * times[-1], 0], atol=1e-10)
    assert sol.events["floor"].t[-1] == sol.t[-1] == sol.final.t


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_events_that_do_not_end_the_run_change_no_bit_of_it(method):
    mech = falling(terminal=False)
    mech.event("rise", lambda t, x: x.position("ball")[2] - 0.5, direction=1)
    mech.event("either", lambda t, x: x.position("ball")[2] - 0.5)
    sol = simulate(mech, t_end=1.0, dt=0.01, method=method, save_every=7)
    bare = simulate(ball(), t_end=1.0, dt=0.01, method=method, save_every=7)
    for name in ("t", "q", "v", "lam"):
        assert_array_equal(getattr(sol, name), getattr(bare, name))
    assert_allclose(sol.events["floor"].t, np.sqrt(2 / G), atol=1e-10)
    assert_allclose(sol.events["either"].t, np.sqrt(1 / G), atol=1e-10)
    assert sol.events["rise"].t.shape == (0,) and sol.events["rise"].q.shape == (0, 7)
    assert sol.status == "Reached t = 1 s."


@pytest.mark.parametrize("chunk", [4096, 7])
def test_steps_behind_the_event_that_ends_a_run_are_not_counted(chunk, monkeypatch):
    """How many are taken at once depends on the clock."""
    monkeypatch.setattr(fixed_step, "FIRST_CHUNK", chunk)
    monkeypatch.setattr(fixed_step, "LARGEST_CHUNK", chunk)
    sol = simulate(falling(), t_end=10.0, dt=1e-3)
    assert sol.statistics["steps"] == np.ceil(np.sqrt(2 / G) / 1e-3)


def test_looking_for_events_leaves_the_bits_of_a_mechanism_with_joints():
    mech = slider_crank()
    mech.event("half", lambda t, x: x.position("slider", "b")[0] - 0.3)
    sol, bare = (simulate_quietly(m, t_end=0.2, dt=1e-3) for m in (mech, slider_crank()))
    assert sol.events["half"].t.size == 3
    assert_array_equal(sol.q, bare.q)
    assert_array_equal(sol.lam, bare.lam)


def test_a_pendulum_passes_its_lowest_point_at_a_quarter_of_its_period():
    """Period 4 K(sin^2(angle / 2)) sqrt(J / (m g l)), J = 1.1 kg m^2; found both ways."""
    mech = pendulum()
    mech.event("lowest", lambda t, x: -x.position("bob")[0] + 0 * x.velocity("bob", "pin")[0])
    quarter = ellipk(np.sin(0.6) ** 2) * np.sqrt(1.1 / G)
    sol = simulate(mech, t_end=6 * quarter, dt=0.02, method="dop853")
    assert_allclose(sol.events["lowest"].t, quarter * np.array([1, 3, 5]), rtol=1e-9)
    coarse = simulate(mech, t_end=6 * quarter, dt=2e-3)
    assert_allclose(coarse.events["lowest"].t, quarter * np.array([1, 3, 5]), rtol=1e-5)


def test_the_end_by_an_event_satisfies_joints_and_goes_on():
    mech = slider_crank()
    mech.event("half", lambda t, x: x.position("slider", "b")[0] - 0.3, terminal=True)
    sol = simulate_quietly(mech, t_end=1.0, dt=1e-3, save_every=3)
    assert np.abs(sol.gap[-1]).max() < 1e-14
    angle = 50 * sol.t[-1]
    place = 0.1 * np.cos(angle) + np.sqrt(0.09 - 0.01 * np.sin(angle) ** 2)
    assert_allclose(place, 0.3, atol=1e-12)
    assert sol.final.memory is None and np.all(np.diff(sol.t) > 0)
    more = simulate_quietly(mech, t_end=sol.t[-1] + 1e-2, dt=1e-3, state=sol.final)
    assert more.status.startswith("Reached")


def test_a_zero_at_the_start_is_no_event_and_one_on_a_step_is():
    mech = ball()
    mech.event("start", lambda t, x: x.position("ball")[0], terminal=True)
    mech.event("clock", lambda t, x: t - 0.25, terminal=True)
    sol = simulate(mech, t_end=1.0, dt=0.125)
    assert sol.events["start"].t.size == 0
    assert sol.t[-1] == 0.25


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_an_event_function_that_fails_is_named(method):
    mech = ball()
    mech.event("broken", lambda t, x: 1.0 if t < 0.3 else np.nan)
    with pytest.raises(SolverError, match=r"event 'broken' gives nan at t = 0\.\d+ s") as caught:
        simulate(mech, t_end=1.0, dt=0.1, method=method)
    assert max(caught.value.solution.t[-1], caught.value.solution.final.t) <= 0.3
    for name, function, says in (
        ("text", lambda t, x: "high", "event 'text' returned 'high'"),
        ("who", lambda t, x: x.velocity("bell")[0], "no body 'bell'"),
    ):
        mech = ball()
        mech.event(name, function)
        refuses(ConfigError, says, simulate, mech, t_end=1.0, dt=0.1, method=method)
    refuses(ConfigError, "direction = 2", mech.event, "x", lambda t, x: 0, direction=2)


def test_an_event_comes_before_a_failure_behind_it():
    mech = ball()
    mech.force("pull", mech.parts["ball"].marker((0, 0, 0)), lambda t: (0, 0, 1 / (t < 0.6)))
    mech.event("floor", lambda t, x: x.position("ball")[2] - 0.9, terminal=True)
    with np.errstate(all="ignore"):
        assert simulate(mech, t_end=1.0, dt=0.01).t[-1] < 0.3


def test_rotation_vectors_have_the_rate_of_their_angular_velocity():
    """Against the quaternion equation of motion, integrated."""
    omega = np.array([0.3, -1.2, 0.8])

    def rate(t, p):
        return 0.5 * np.concatenate([[-p[1:] @ omega], p[0] * omega + np.cross(p[1:], omega)])

    def vector(p):
        return 2 * np.arctan2(np.linalg.norm(p[1:]), p[0]) * p[1:] / np.linalg.norm(p[1:])

    start = np.array([0.8, 0.36, 0.48, 0.0])
    ends = [solve_ivp(rate, (0, h), start, rtol=1e-12, atol=1e-13).y[:, -1] for h in (1e-4, -1e-4)]
    wanted = (vector(ends[0]) - vector(ends[1])) / 2e-4
    assert_allclose(vector_rate(vector(start), omega), wanted, atol=1e-7)
    assert_allclose(vector_rate(1e-4 * omega, omega), omega, atol=1e-12)
    small = 2e-3 * np.array([0.6, 0.0, 0.8])  # here the formula changes to its series
    jump = vector_rate(small * (1 + 1e-6), omega) - vector_rate(small * (1 - 1e-6), omega)
    assert np.abs(jump).max() < 1e-8


def test_between_its_instants_a_motion_is_known_to_fourth_order():
    errors = []
    fine = simulate(heavy_top(), t_end=0.08, dt=1e-3 / 3, method="dop853")
    for h in (4e-3, 2e-3, 1e-3):
        sol = simulate(heavy_top(), t_end=0.08, dt=h, method="dop853").at(fine.t)
        errors.append([np.abs(getattr(sol, x) - getattr(fine, x)).max() for x in ("q", "v", "a")])
    order = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert (order[-1] > [3.8, 3.8, 2.8]).all()
    assert np.abs(np.linalg.norm(sol.orientation("top"), axis=1) - 1).max() < 1e-14


def test_at_the_instants_themselves_nothing_changes():
    sol = simulate_quietly(slider_crank(), t_end=0.02, dt=1e-3)
    again = sol.at(sol.t)
    for name in ("q", "v", "a", "lam", "work"):
        assert_allclose(getattr(again, name), getattr(sol, name), rtol=1e-13, atol=1e-13)
    assert_allclose(again.reaction("main"), sol.reaction("main"), rtol=1e-12, atol=1e-9)
    assert sol.at(0.0105).position("slider").shape == (1, 3)
    refuses(ConfigError, r"t = 0\.03 s must be within the motion from 0 s to 0\.02 s", sol.at, 0.03)
