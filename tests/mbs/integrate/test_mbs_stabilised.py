"""Constraints of positions and velocities together, BDF of orders one to five, orders of all."""

from itertools import product

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

import rom
from cases.mbs.mechanisms import simulate_quietly, slider_crank
from cases.mbs.motions import ball, free_crank, heavy_top, order_of, swing
from cases.refusals import refuses
from rom import rotation
from rom.mbs.equations.equations import linearize_constraints
from rom.mbs.integrate.bdf import joined, multistep_coefficients
from rom.mbs.kernels.work import workspace

BDF = [{"method": "bdf", "order": k} for k in (1, 3, 4, 5)]
PLAIN = [{"rho_inf": 0.6}, {"method": "bdf"}]
STABILISED = [{"stabilised": True}, {"method": "bdf", "stabilised": True}]
TOP, LOOP = (heavy_top, 0.1), (free_crank, 0.05)
ORDERS = [  # motion, the longer step, tolerances of the method and of the order; options
    *product([(*TOP, 5e-4, 1e-12, 0.15)], [*STABILISED, *BDF]),
    *product([(*LOOP, 6.25e-5, 1e-11, 0.2)], [*STABILISED, BDF[1]]),
    *product([(*TOP, 2.5e-4, 1e-11, 0.03), (*LOOP, 6.25e-5, 1e-11, 0.03)], PLAIN),
]


@njit
def joined_turns(a, b):
    return joined(a, b)


def velocity_gap(sol):
    """Largest violation of the constraints by the velocities, over all instants but the first."""
    packed = sol.packed
    W = workspace(packed.system, len(packed.signals))
    signal, largest = packed.system.rows.signal, 0.0
    for k in range(1, sol.t.size):
        W.signal[:] = sol.signals[k]
        linearize_constraints(packed.system, W, sol.q[k], sol.v[k])
        wanted = np.where(signal >= 0, W.signal[signal, 1], 0.0) if len(W.signal) else 0.0
        largest = max(largest, np.abs(W.G @ sol.v[k] - wanted).max())
    return largest


@pytest.mark.parametrize(("run", "options"), ORDERS)
def test_every_method_has_its_order(run, options):
    """Coordinates, velocities, accelerations and multipliers, large rotations and a loop.

    The start sets off vibrations of order h^3 in the multipliers, which 0.9 keeps for long.
    """
    build, t_end, step, tolerance, atol = run
    exact = simulate_quietly(build(), t_end=t_end, dt=t_end / 10, method="dop853")
    options = {"tolerance": tolerance, **options}
    found = order_of(build, t_end, (step, step / 2), exact, options)
    assert_allclose(found, options.get("order", 2), atol=atol)


@pytest.mark.parametrize("build", [heavy_top, free_crank, lambda: slider_crank(gravity=9.81)])
@pytest.mark.parametrize("method", ["generalized-alpha", "bdf"])
def test_velocities_fit_the_constraints_to_round_off(build, method):
    """Without, they miss by the square of the step."""
    gaps = {}
    for stabilised in (False, True):
        for h in (5e-4, 2.5e-4):
            options = {"dt": h, "method": method, "stabilised": stabilised}
            sol = simulate_quietly(build(), t_end=0.02, **options)
            gaps[stabilised, h] = velocity_gap(sol)
            assert np.abs(sol.gap).max() < 1e-13
    assert gaps[True, 5e-4] < 1e-13
    if build in (heavy_top, free_crank):
        assert_allclose(np.log2(gaps[False, 5e-4] / gaps[False, 2.5e-4]), 2.0, atol=0.2)


@pytest.mark.parametrize("options", [*STABILISED, BDF[2]], ids=str)
def test_rolling_goes_with_it(options):
    """Acceleration g sin / (1 + I / m r^2)."""
    mech = rom.Mechanism(gravity=(3.0, 0, -9.0))
    mech.add_rigid("ball", mass=2.0, inertia=(0.008,) * 3, at=(0, 0, 0.1))
    mech.rolling("roll", "ground", "ball", radius=0.1, normal=(0, 0, 1))
    sol = simulate_quietly(mech, t_end=0.5, dt=5e-3, **options)
    assert_allclose(sol.position("ball")[-1, 0], 0.5 * 3.0 / 1.4 * 0.25, rtol=1e-9)
    assert velocity_gap(sol) < 1e-12


def test_chosen_steps_can_be_stabilised():
    exact = simulate_quietly(heavy_top(), t_end=0.1, dt=0.05, method="dop853")
    for method in ("generalized-alpha", "bdf"):
        sol = simulate_quietly(heavy_top(), t_end=0.1, method=method, rtol=1e-4, stabilised=True)
        assert np.abs(sol.q[-1] - exact.q[-1]).max() < 1e-3
        assert velocity_gap(sol) < 1e-12


def test_energy_of_a_flexible_body_agrees_with_the_reference():
    exact = simulate_quietly(swing(), t_end=0.2, dt=0.02, method="dop853")
    for options, tolerance in ((STABILISED[0], 3e-3), (BDF[2], 2e-3)):
        sol = simulate_quietly(swing(), t_end=0.2, dt=1e-3, save_every=20, **options)
        assert np.abs(sol.q - exact.q).max() < tolerance * np.abs(exact.q).max()
        assert np.abs(sol.energy.balance).max() < 5e-3 * np.ptp(sol.energy.kinetic)


def test_an_event_can_end_the_first_steps():
    mech = ball()
    mech.event("low", lambda t, now: now.position("ball")[2] - 0.99, terminal=True)
    sol = rom.simulate(mech, t_end=1.0, dt=0.02, method="bdf", order=5)
    assert_allclose(sol.t[-1], np.sqrt(2 * 0.01 / 9.81), rtol=1e-6)


def test_weights_differentiate_polynomials_of_their_order():
    for order in range(1, 6):
        method, weights = multistep_coefficients(0.3, order)
        past = 2.0 - 0.3 * np.arange(order + 1)
        assert_allclose(weights @ past**order, order * 2.0 ** (order - 1), rtol=1e-10)
        assert_allclose(method[:3], [0.3, 1 / (0.3 * weights[0]) ** 2, 1 / (0.3 * weights[0])])


def test_turns_join_to_the_turn_of_their_product():
    rng = np.random.default_rng(1)
    for size in (1e-9, 0.3, 2.5):
        a, b = size * rng.normal(size=(2, 3)) / 2
        wanted = rotation.log(rotation.multiply(rotation.exp(a), rotation.exp(b)))
        assert_allclose(joined_turns(tuple(a), tuple(b)), wanted, rtol=1e-9, atol=1e-15)
    assert_allclose(joined_turns((0.2, 0.1, 0.0), (-0.2, -0.1, 0.0)), 0.0, atol=1e-16)


def test_what_a_method_does_not_offer_is_refused():
    for words, options in (
        ("order = 3 is for bdf only", {"order": 3}),
        ("steps of one length", {"method": "bdf", "order": 4, "dt": None}),
        ("stabilised is for implicit methods", {"method": "dop853", "stabilised": True}),
        ("needs 4 steps to begin with", {"method": "bdf", "order": 5, "t_end": 3e-3}),
    ):
        given = {"t_end": 1.0, "dt": 1e-3} | options
        refuses(rom.ConfigError, words, rom.simulate, heavy_top(), **given)
