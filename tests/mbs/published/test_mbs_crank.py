"""Slider-cranks: the published flexible one, and the rigid one in closed form."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.mbs import motions
from cases.mbs.mechanisms import crank_torque, simeon_crank, simulate_quietly, slider_crank
from cases.paths import TESTS

REFERENCE = json.loads((TESTS / "reference" / "simeon_crank.json").read_text())


def angle(sol, body):
    p = sol.orientation(body)
    return 2 * np.arctan2(p[:, 3], p[:, 0])


@pytest.mark.long
@pytest.mark.once
@pytest.mark.parametrize(
    ("kind", "divisor", "rtol", "limits"),
    [("published", 1.0, 1e-11, (2e-9, 2e-8)), ("physical", 15.0, 1e-9, (1e-6, 1e-5))],
)
def test_published_solution_of_the_flexible_slider_crank(kind, divisor, rtol, limits):
    """C2: 13 digits of an independent formulation, with its own inertia integrals.

    And with the consistent axial mass, fifteen times lighter and four times faster.
    """
    options = {"method": "dop853", "rtol": rtol, "atol": rtol / 100}
    sol = simulate_quietly(simeon_crank(divisor), t_end=0.1, dt=0.1, **options)
    want, (positions, velocities) = REFERENCE[kind], limits
    assert_allclose(angle(sol, "rod")[-1], want["phi2"], rtol=positions)
    assert_allclose(sol.position("slider", "b")[-1, 0], want["x3"], rtol=positions)
    assert_allclose(sol.elastic("rod")[-1], want["q"], rtol=2.5 * positions)
    assert_allclose(sol.omega("rod")[-1, 2], want["phi2_rate"], rtol=velocities)
    assert_allclose(sol.velocity("slider", "b")[-1, 0], want["x3_rate"], rtol=velocities)
    assert_allclose(sol.v[-1, 12], want["q1_rate"], rtol=velocities)
    loop, drive = sol.reaction("wrist")[-1], sol.reaction("motor")[-1]
    assert_allclose([-loop[0], loop[1]], [want["loop_x"], want["loop_y"]], rtol=velocities)
    assert_allclose(-drive[5], want["drive"], rtol=velocities)


def test_largest_bending_of_the_published_crank_with_generalized_alpha():
    """max |q1| = 1.65152e-3 m at 0.04756 s, 0.02 per cent above the peak at 0.0362 s."""
    sol = simulate_quietly(simeon_crank(), t_end=0.1, dt=2e-5)
    bending = np.abs(sol.elastic("rod")[:, 0])
    assert_allclose(bending.max(), 1.65152e-3, rtol=1e-4)
    assert_allclose(sol.t[bending.argmax()], 0.04756, atol=2e-5)


def test_generalized_alpha_converges_with_order_two_in_coordinates_velocities_multipliers():
    """Errors over the whole time against DOP853; the multipliers from the first step on."""
    exact = {"method": "dop853", "rtol": 1e-12, "atol": 1e-15}
    reference = simulate_quietly(simeon_crank(), t_end=0.0032, dt=1.6e-4, **exact)
    errors = []
    for h in (16e-6, 8e-6, 4e-6):
        sol = simulate_quietly(simeon_crank(), t_end=0.0032, dt=h, save_every=round(1.6e-4 / h))
        assert_allclose(sol.t, reference.t, atol=1e-12)
        bent = np.abs(sol.elastic("rod") - reference.elastic("rod")).max()
        errors.append([bent, *motions.errors(sol, reference, ("v", "lam"))])
    coarse, fine = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert_allclose(fine[:2], 2.0, atol=0.1)
    # round-off of the redundant multipliers, divided by h^2, reaches their error at the finest step
    assert_allclose(coarse[2], 2.0, atol=0.1)


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_rigid_slider_crank_equals_its_closed_form(method):
    """Two turns; the torque of the motor is that of Lagrange's equation."""
    sol = simulate_quietly(slider_crank(), t_end=0.25, dt=1e-4, method=method, tolerance=1e-12)
    s, c = -0.1 / 0.3 * np.sin(50 * sol.t), np.cos(50 * sol.t)  # of the rod, of the crank
    rod = np.sqrt(1 - s**2)
    assert_allclose(sol.position("slider")[:, 0], 0.1 * c + 0.3 * rod, atol=1e-8 * 0.4)
    assert_allclose(angle(sol, "rod"), np.arcsin(s), atol=1e-8)
    dx = 15.0 * s + 5.0 * c * s / rod
    exact = method == "dop853"
    assert_allclose(sol.velocity("slider")[:, 0], dx, atol=1e-8 * 5 if exact else 1e-4 * 5)
    wanted, limit = crank_torque(50.0 * sol.t), 1e-7 if exact else 1e-3
    assert_allclose(sol.reaction("motor")[:, 5], wanted, atol=limit * np.abs(wanted).max())


def test_work_of_the_motor_balances_the_energy():
    """10 J go in and out; the work is summed by the trapezoidal rule, of order two."""
    worst = []
    for h in (1e-4, 5e-5):
        e = simulate_quietly(slider_crank(gravity=9.81), t_end=0.25, dt=h).energy
        assert np.ptp(e.drives) > 10.0
        worst.append(np.abs(e.balance).max())
    assert worst[0] < 3e-4
    assert worst[1] < 0.3 * worst[0]
