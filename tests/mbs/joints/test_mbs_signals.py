"""Functions of time that drive a joint: their derivatives, and that nobody asks beyond the run."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

import rom
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.signals import Signal

POLYNOMIAL = np.polynomial.Polynomial([0.3, -1.0, 2.0, 0.7, -0.4])


def test_derivatives_are_exact_for_a_quartic_from_the_first_time_to_the_last():
    """Five points: forward, central, backward weights all pass a polynomial of degree four."""
    t, span = np.linspace(-1.0, 2.0, 31), (-1.0, 2.0)
    table = Signal("motor", POLYNOMIAL).sample(t, span, 0.1)
    wanted = [POLYNOMIAL(t), POLYNOMIAL.deriv(1)(t), POLYNOMIAL.deriv(2)(t)]
    assert_allclose(table, np.transpose(wanted), atol=1e-10)


def test_given_derivatives_are_used():
    signal = Signal("motor", np.sin, lambda t: 3.0, lambda t: 5.0)
    assert_allclose(signal.sample(np.array([0.2]), (0.0, 1.0), 0.1), [[np.sin(0.2), 3.0, 5.0]])


def wheel(function):
    mech = Mechanism(gravity=(0, 0, 0))
    body = mech.add_rigid("wheel", mass=1.0, inertia=(1, 1, 0.5), at=(0, 0, 0))
    mech.revolute("axle", mech.ground.marker((0, 0, 0)), body.marker((0, 0, 0)), axis=(0, 0, 1))
    mech.drive("motor", "axle", function)
    return mech, body


def test_round_off_asks_for_nothing_outside_the_span():
    rng = np.random.default_rng(0)
    for start, length, parts in rng.uniform((-1, 0.1, 5), (1, 2, 50), size=(200, 3)):
        asked = []
        span = (start, start + length)
        signal = Signal("motor", lambda t, asked=asked: asked.append(float(t)) or float(t))
        signal.sample(np.array(span), span, length / parts)
        assert (min(asked), max(asked)) == span


@pytest.mark.parametrize("dt", [0.01, 0.1 / 3, 0.3])
@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_nobody_asks_a_function_for_times_outside_the_run(method, dt):
    asked = []

    def angle(t):
        asked.append(float(t))
        return np.sin(float(t))

    mech, body = wheel(angle)
    mech.force("push", body.marker((0, 0, 0)), lambda t: (angle(t), 0, 0))
    simulate(mech, t_start=0.3, t_end=1.0, dt=dt, method=method, assemble=True)
    assert min(asked) == 0.3
    assert max(asked) == 1.0


@pytest.mark.parametrize(("method", "tolerance"), [("generalized-alpha", 3e-5), ("dop853", 2e-6)])
def test_a_table_that_ends_with_the_run_drives_it_to_the_end(method, tolerance):
    """Beyond its last entry the spline is not a number."""
    t = np.linspace(0, 1, 201)
    table = CubicSpline(t, np.sin(t), extrapolate=False)
    sol = simulate(wheel(table)[0], t_end=1.0, dt=1e-2, method=method)
    assert sol.t[-1] == pytest.approx(1.0)
    assert_allclose(sol.omega("wheel")[:, 2], np.cos(sol.t), atol=tolerance)
    assert_allclose(sol.reaction("motor")[1:, 5], -0.5 * np.sin(sol.t[1:]), atol=tolerance)


@pytest.mark.parametrize("t_end", [1e-10, 1e-8, 6e-8, 1e-6, 1e-4])
@pytest.mark.parametrize("speed", [3.0, 300.0])
def test_round_off_of_a_soft_start_is_no_jump(t_end, speed):
    """Three terms of size one cancel to a motion of t^4: what is left at first is round-off."""
    T = 2 * np.pi / 300.0

    def angle(t):
        start = t**2 / (2 * T) + T / (2 * np.pi) ** 2 * (np.cos(2 * np.pi * t / T) - 1)
        return speed * start

    mech = rom.Mechanism(gravity=(0, 0, 0))
    crank = mech.add_rigid("crank", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))
    pin = crank.marker((0, 0, 0))
    mech.revolute("bearing", mech.ground.marker((0, 0, 0)), pin, axis=(0, 0, 1))
    mech.drive("motor", "bearing", angle)
    sol = rom.simulate(mech, t_end=t_end, dt=t_end)
    assert abs(sol.joint("bearing").angle[-1] - angle(t_end)) < 1e-14
