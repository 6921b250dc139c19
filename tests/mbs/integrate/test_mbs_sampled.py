"""Laws that are called once a sample, against the exact motion of a block between two samples."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

import rom
from cases.mbs.motions import EVERY, MASS, STIFFNESS, sampled_block
from cases.refusals import refuses
from rom.errors import ConfigError


def exact(n):
    """(n + 1, 2) place and velocity at the samples; the controller adds up what it has seen."""
    A = np.array([[0, 1, 0], [-STIFFNESS / MASS, 0, 1 / MASS], [0, 0, 0]])
    step, state, total, found = expm(A * EVERY), np.array([0.0, 1.0]), 0.0, []
    for _ in range(n + 1):
        found.append(state)
        total += EVERY * state[0]
        force = -400 * (state[0] - 0.3) - 12 * state[1] - 50 * total
        state = (step @ [*state, force])[:2]
    return np.array(found)


@pytest.mark.parametrize("method", ["generalized-alpha", "bdf"])
@pytest.mark.parametrize("by", ["motor", "law", "user_force"])
def test_a_sampled_law_holds_the_block_with_order_two(method, by):
    errors = []
    for n in (4, 8):
        mech, calls = sampled_block(by)
        sol = rom.simulate(mech, t_end=50 * EVERY, dt=EVERY / n, method=method)
        states = np.c_[sol.position("block")[:, 0], sol.velocity("block")[:, 0]]
        errors.append(np.abs(states[::n] - exact(50)).max())
        assert_allclose(calls, EVERY * np.arange(50), atol=1e-12)
        assert rom.audit(sol).ok
    assert errors[1] < 4e-3
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)


@pytest.mark.parametrize("what", [
    lambda mech: rom.simulate(mech, t_end=0.1),
    lambda mech: rom.simulate(mech, t_end=0.1, dt=3e-3),
    lambda mech: rom.simulate(mech, t_end=0.1, dt=1e-2, method="dop853"),
    lambda mech: rom.simulate(mech, t_end=0.1, dt=1e-3, method="bdf", order=3),
    rom.equilibrium,
    rom.linearize,
])  # fmt: skip
def test_what_has_no_samples_is_refused(what):
    refuses(ConfigError, "servo", what, sampled_block("motor")[0])
