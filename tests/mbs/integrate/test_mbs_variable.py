"""Order of single steps, and steps that are chosen to meet a tolerance."""

from typing import NamedTuple

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

import rom
from cases.mbs.mechanisms import prepared, simulate_quietly, slider_crank
from cases.mbs.motions import G, errors, falling, four_links, free_crank, heavy_top, pendulum, swing
from cases.mbs.parts import on_guide
from rom import rotation
from rom.mbs.equations.packing import pack
from rom.mbs.integrate import adaptive_step, generalized_alpha, step_control, step_memory
from rom.mbs.kernels.work import HAS_FACTOR, STEPS, Step, workspace

IMPLICIT = ["generalized-alpha", "bdf"]
STATISTICS = ("steps", "iterations", "factorisations", "rejected", "shortest", "longest")


class End(NamedTuple):
    v: np.ndarray
    a: np.ndarray


@njit
def increment_between(s, h, left, right, out):
    step_control.increment(s, h, left, right, out)


def test_dop853_has_its_order_in_the_error_per_tolerance():
    """Errors go with the tolerance; steps with its eighth root."""
    exact = rom.simulate(heavy_top(), t_end=0.2, dt=0.05, method="dop853")
    options = ({"rtol": tol, "atol": tol} for tol in (1e-5, 1e-9))
    runs = [rom.simulate(heavy_top(), t_end=0.2, dt=0.05, method="dop853", **o) for o in options]
    steps = [run.statistics["steps"] for run in runs]
    assert 1e4 ** (1 / 9) < steps[1] / steps[0] < 1e4 ** (1 / 7)
    assert errors(runs[1], exact, "q")[0] < 1e-3 * errors(runs[0], exact, "q")[0]


@pytest.mark.parametrize("method", IMPLICIT)
def test_the_very_first_step_has_the_order_already(method):
    table = []
    for h in (4e-4, 2e-4, 1e-4):
        sol = rom.simulate(heavy_top(), t_end=h, dt=h, method=method, tolerance=1e-12)
        exact = rom.simulate(heavy_top(), t_end=h, dt=h, method="dop853")
        table.append(errors(sol, exact, ("a", "lam")))
    order = np.log2(np.array(table)[:-1] / np.array(table)[1:])
    assert (order[-1] > 1.8).all()


def test_the_increment_of_a_step_is_known_to_fourth_order():
    """A body that moves as sin t and turns with a given angular velocity, turned exactly."""

    def omega(t):
        return np.array([np.cos(t), 0.5 * np.sin(2 * t), 0.3])

    def rate(t, p):
        w = omega(t)
        return 0.5 * np.concatenate([[-p[1:] @ w], p[0] * w + np.cross(p[1:], w)])

    def end(t):
        v = np.concatenate([[np.cos(t), 0, 0], omega(t)])
        return End(v, np.array([-np.sin(t), 0, 0, -np.sin(t), np.cos(2 * t), 0]))

    gaps, start, found, body = [], 0.4, np.zeros(6), pack(falling()).system
    for h in (0.2, 0.1):
        p = solve_ivp(rate, (start, start + h), [1.0, 0, 0, 0], rtol=1e-12, atol=1e-13).y[:, -1]
        psi = np.concatenate([[np.sin(start + h) - np.sin(start), 0, 0], rotation.log(p)])
        increment_between(body, h, end(start), end(start + h), found)
        gaps.append(np.abs(psi - found))
    ratio = gaps[0][[0, 3, 4, 5]] / gaps[1][[0, 3, 4, 5]]
    assert (ratio > 13).all()


@pytest.mark.parametrize("build, t_end", [(pendulum, 0.3), (heavy_top, 0.02), (four_links, 0.3)])
def test_another_length_of_steps_prepares_the_method_for_it(build, t_end, monkeypatch):
    """Acceleration a + (alpha_m - alpha_f) h da/dt, velocity ahead across constraints only."""
    seen = []
    original = adaptive_step._Run.chunk

    def chunk(self, limit):
        before = self.now.number[step_control.LENGTH]
        taken, h = original(self, 1), self.now.number[step_control.LENGTH]
        if self.T.count[STEPS] < 5 or h == before or self.T.count[HAS_FACTOR]:
            return taken
        now, T, record = self.record.final, self.T, self.record
        lag = (T.method[3] - T.method[4]) * h * self.now.jerk
        ahead = h**2 * step_memory.shift_ahead(record, now, T.method, self.now.jerk)
        across_ahead = step_memory.across(record, workspace(record.packed.system, 0), now, ahead)
        moved = (T.a - now.a, lag), (T.v - now.v, across_ahead)
        seen.append([np.linalg.norm(x - known) / np.linalg.norm(known) for x, known in moved])
        return taken

    monkeypatch.setattr(adaptive_step._Run, "chunk", chunk)
    rom.simulate(build(), t_end=t_end, rtol=1e-3, rho_inf=0.0)
    assert len(seen) > 2
    assert (np.max(seen, axis=0) < [0.3, 1e-6]).all()


@pytest.mark.parametrize("before", [0.1, 0.25, 0.4])
def test_weights_of_bdf_differentiate_parabolas_exactly(before):
    h = 0.2
    method, weights = generalized_alpha.bdf_coefficients(h, before)
    t = np.array([0.0, -h, -h - before])
    values = np.array([np.ones(3), t, t**2])
    assert_allclose(values @ weights, [0.0, 1.0, 0.0], atol=1e-13)
    _, beta, gamma, *_ = method
    assert_allclose([gamma / (beta * h), 1 / (beta * h**2)], [weights[0], weights[0] ** 2])
    assert_allclose(generalized_alpha.bdf_coefficients(h, 0.0)[1], [1 / h, -1 / h, 0])


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize(("build", "t_end"), [(pendulum, 1.0), (free_crank, 0.05)])
def test_chosen_steps_meet_the_tolerance(method, build, t_end):
    """Against dop853: lengths relative to 1 m, velocities to the largest; better with rtol."""
    worst = []
    for rtol in (1e-2, 1e-3):
        sol = simulate_quietly(build(), t_end=t_end, method=method, rtol=rtol)
        exact = simulate_quietly(build(), t_end=t_end, dt=t_end / 20, method="dop853")
        at = sol.at(exact.t)
        q, v = errors(at, exact, ("q", "v"))
        worst.append(max(q, v / np.abs(exact.v).max()))
        assert worst[-1] < rtol
        assert sol.t[-1] == t_end and sol.status.startswith("Reached")
        assert all(name in sol.statistics for name in STATISTICS)
        assert sol.t.size == sol.statistics["steps"] + 1
        assert_allclose(np.diff(sol.t).min(), sol.statistics["shortest"], rtol=1e-9)
    assert 3 < worst[0] / worst[1] < 30


def test_what_a_variable_run_saves_fits_joints_and_drives():
    sol = simulate_quietly(slider_crank(), t_end=0.05, rtol=1e-2)
    assert np.abs(sol.gap).max() < 1e-9
    assert_allclose(sol.omega("crank")[:, 2], 50.0, rtol=1e-9)
    angle = 50 * sol.t
    rod = np.sqrt(0.09 - 0.01 * np.sin(angle) ** 2)
    speed = -5 * np.sin(angle) * (1 + 0.1 * np.cos(angle) / rod)
    assert_allclose(sol.velocity("slider")[:, 0], speed, atol=1e-6)
    exact = simulate_quietly(slider_crank(), t_end=0.05, dt=0.01, method="dop853")
    assert_allclose(sol.reaction("main")[-1], exact.reaction("main")[-1], atol=2e-3)


@pytest.mark.parametrize("method", [*IMPLICIT, "dop853"])
def test_events_are_found_with_chosen_steps(method):
    """Free fall: every step is exact for generalised-alpha."""
    atol = 1e-10 if method != "bdf" else 1e-5
    for terminal, end in ((True, np.sqrt(2 / G)), (False, 1.0)):
        sol = rom.simulate(falling(terminal), t_end=1.0, method=method, rtol=1e-5)
        assert_allclose([sol.t[-1], *sol.events["floor"].t], [end, np.sqrt(2 / G)], atol=atol)
        assert sol.status.startswith("Stopped by event 'floor'") == terminal
        assert (np.diff(sol.t) > 0).all()


def test_a_variable_run_goes_on_and_saves_less_if_asked():
    half = rom.simulate(pendulum(), t_end=0.5, rtol=1e-3)
    rest = rom.simulate(pendulum(), t_end=1.0, rtol=1e-3, state=half.final)
    exact = rom.simulate(pendulum(), t_end=1.0, dt=0.5, method="dop853")
    assert np.abs(rest.q[-1] - exact.q[-1]).max() < 2e-3
    some = rom.simulate(pendulum(), t_end=0.5, rtol=1e-3, save_every=7)
    assert_array_equal(some.t[:-1], half.t[::7][: some.t.size - 1])
    assert some.t[-1] == 0.5


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_force_that_jumps_all_the_time_makes_the_step_too_small(method):
    def jumping(t, a):
        return (1e3 * np.sign(np.sin(1e15 * t)), 0, 0), (0, 0, 0)

    mech, says = pendulum(), r"the step became too small at t = .* its error"
    mech.user_force("noise", jumping, mech.parts["bob"].marker("tip"))
    with pytest.raises(rom.SolverError, match=says) as caught:
        rom.simulate(mech, t_end=1.0, method=method, rtol=1e-6)
    assert caught.value.solution.t[-1] < 1.0


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_first_step_that_is_far_too_long_is_shortened_until_it_fits(method):
    """A vibration of a millisecond in a run of a day: exp(-w D t) times a sine."""
    w, D, x0, day = 1e4, 0.9, 0.2, 86400.0
    mech = rom.Mechanism(gravity=(0, 0, 0))
    law = {"stiffness": w**2, "damping": 2 * D * w, "free_length": 1.0}
    mass = on_guide(mech, at=(1 + x0, 0, 0))
    mech.spring_damper("spring", mech.ground.marker((0, 0, 0)), mass, **law)
    sol = rom.simulate(mech, t_end=day, method=method, rtol=1.0, save_every=20)
    fast, t = w * np.sqrt(1 - D**2), sol.t
    exact = x0 * np.exp(-D * w * t) * (np.cos(fast * t) + D * w / fast * np.sin(fast * t))
    assert_allclose(sol.position("mass")[:, 0] - 1.0, exact, atol=1e-6 * x0)
    assert sol.statistics["shortest"] < 1e-12 * day


@njit
def turned_columns(s, W, T):
    generalized_alpha.turn_columns(s, W, T, 1)


def change(psi, delta):
    """Rotation in the body frame from exp(psi) to exp(psi + delta)."""
    return rotation.log(rotation.multiply(rotation.exp(-psi), rotation.exp(psi + delta)))


def test_columns_of_rotations_count_in_increments_of_the_rotation_vector():
    """A wrong tangent only makes Newton slower: no motion would tell."""
    rng = np.random.default_rng(6)
    packed, W = prepared(swing())
    n, m = packed.v.size, W.value.size
    psi = rng.normal(size=n)
    vectors = [np.zeros(k) for k in (packed.q.size, n, n, n, m, packed.q.size, n, n, m)]
    counts = np.zeros(11, dtype=np.int64)
    constants = (np.zeros(4), generalized_alpha.coefficients(1e-3, 0.9), np.zeros(3))
    history = np.zeros((2, 1, n)), np.zeros(n)
    T = Step(*vectors, psi, np.zeros(3), np.zeros(3), counts, *constants, *history)
    W.Kt[:], W.UG[:] = rng.normal(size=(n, n)), rng.normal(size=(m, n))
    W.UGT[:] = W.UG
    tangent, step = np.eye(n), 1e-6
    for j, e in enumerate(np.eye(3)):
        both = change(psi[3:6], step * e) - change(psi[3:6], -step * e)
        tangent[3:6, 3 + j] = both / (2 * step)
    wanted, border = W.Kt @ tangent, W.UG[0] @ tangent
    turned_columns(packed.system, W, T)
    assert_allclose(W.S, wanted, atol=1e-8)
    assert_allclose(W.UGT[0], border, atol=1e-8)
