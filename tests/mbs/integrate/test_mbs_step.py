"""Inside a step of generalised-alpha: rotations count in increments of their rotation vector."""

import numpy as np
from numba import njit
from numpy.testing import assert_allclose

from cases.mbs.mechanisms import prepared, random_body
from rom import rotation
from rom.mbs.integrate.generalized_alpha import Step, coefficients, turn_columns
from rom.mbs.mechanism import Mechanism


@njit
def turned_columns(s, W, T):
    turn_columns(s, W, T, 1)


def change(psi, delta):
    """Rotation in the body frame from exp(psi) to exp(psi + delta)."""
    return rotation.log(rotation.multiply(rotation.exp(-psi), rotation.exp(psi + delta)))


def hung():
    """A flexible body on a ball joint."""
    mech = Mechanism()
    one = mech.add_flexible("one", random_body(np.random.default_rng(5)))
    mech.spherical("hook", mech.ground.marker(mech.design_point(one.marker("a"))), one.marker("a"))
    return prepared(mech)


def test_columns_of_rotations_count_in_increments_of_the_rotation_vector():
    """A wrong tangent only makes Newton slower: no motion would tell."""
    rng = np.random.default_rng(6)
    packed, W = hung()
    n, m = packed.v.size, W.value.size
    psi = rng.normal(size=n)
    vectors = [np.zeros(k) for k in (packed.q.size, n, n, n, m, packed.q.size, n, n, m)]
    counts = np.zeros(11, dtype=np.int64)
    constants = (np.zeros(4), coefficients(1e-3, 0.9), np.zeros(3))
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
