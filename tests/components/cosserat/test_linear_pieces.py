"""Linear bodies in series against the rod they are cut from."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rom.components.cosserat import clamped, equilibrium, linearised, loads, reference, straight
from rom.components.cosserat.linear_pieces import bend_in_pieces, cut
from rom.components.wind.wind_turbine import blade
from rom.errors import ConfigError, SolverError


def test_a_small_load_does_not_see_the_cuts():
    one = blade(16)
    force = np.outer(np.linspace(0, 1e-3, 17), [1.0, 0.5, 0])
    free = clamped(one)
    K = linearised(one, reference(one))[1][np.ix_(free, free)]
    full = np.zeros((18, 6))
    full[:-1, 3:] = force
    u = np.zeros((18, 6))
    u.ravel()[6:-3] = np.linalg.solve(K, full.ravel()[6:-3])
    for k in (1, 2, 5, 16):
        assert_allclose(bend_in_pieces(one, k, force) - one.x, u[:-1, 3:], rtol=1e-4, atol=1e-12)


def test_more_linear_bodies_come_closer_to_the_rod():
    """267 kN on a blade: one body misses that the tip comes in, eight are within 2 %."""
    one = blade(48)
    eta = np.linspace(0, 1, 49)
    share = eta * np.append(np.ones(48), 0.5)
    force = np.outer(267e3 * share / share.sum(), [1.0, 0, 0])
    exact = equilibrium(one, loads(one, force=force)).x[-1]
    tip = np.array([bend_in_pieces(one, k, force)[-1] for k in (1, 2, 4, 8, 16)])
    error = np.linalg.norm(tip - exact, axis=1)
    assert (np.diff(error) < 0).all()
    assert abs(tip[0, 2] - one.x[-1, 2]) < 0.02  # no shortening at all
    assert error[3] < 0.02 * np.linalg.norm(exact - one.x[-1])
    order = np.log2(error[2:-1] / error[3:])
    assert ((order > 1.7) & (order < 2.3)).all(), order


def test_what_cannot_be_cut_or_found_is_named():
    one = straight(1.0, 4, stretch=1e4, bend=1.0)
    assert [piece.h.size for piece in cut(one, 3)] == [1, 2, 1]
    with pytest.raises(ConfigError, match="5 pieces of a rod of 4 segments"):
        cut(one, 5)
    with pytest.raises(SolverError, match="2 linear pieces found no equilibrium"):
        bend_in_pieces(one, 2, np.outer([0, 0, 0, 0, 1.0], [30.0, 0, -60.0]))
