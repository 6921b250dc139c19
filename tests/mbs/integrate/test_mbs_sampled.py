"""A law that is called once a sample, against the exact motion of a block between two samples."""

import numpy as np
import pytest
from scipy.linalg import expm

import rom
from cases.mbs.motions import sampled
from cases.refusals import refuses

STEP = expm(1e-2 * np.array([[0, 1, 0], [-150, 0, 0.5], [0, 0, 0]]))  # mass 2, stiffness 300


@pytest.mark.parametrize("method", ["generalized-alpha", "bdf"])
def test_a_sampled_law_holds_the_block_with_order_two(method):
    exact, total, errors = [np.array([0.0, 1.0])], 0.0, []
    for _ in range(50):
        x, v = exact[-1]
        total += x
        exact.append((STEP @ [x, v, -400 * (x - 0.3) - 12 * v - 0.5 * total])[:2])
    for n in (4, 8):
        sol = rom.simulate(sampled(), t_end=0.5, dt=1e-2 / n, method=method)
        states = np.c_[sol.position("block")[:, 0], sol.velocity("block")[:, 0]]
        errors.append(np.abs(states[::n] - exact).max())
        assert sol.law("servo").memory[-1, 1] == 50  # calls
        assert rom.audit(sol).ok
    assert errors[1] < 4e-3
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)


@pytest.mark.parametrize("how", [
    {}, {"dt": 3e-3}, {"dt": 1e-2, "method": "dop853"}, {"dt": 1e-3, "method": "bdf", "order": 3},
])  # fmt: skip
def test_what_has_no_samples_is_refused(how):
    refuses(rom.ConfigError, "servo", rom.simulate, sampled(), t_end=0.1, **how)
    refuses(rom.ConfigError, "servo", rom.linearize, sampled())
