"""Tangents by differences."""

import numpy as np
from numpy.testing import assert_allclose

from cases.mbs.mechanisms import random_state, residual_at, stored_at, tangents_at
from rom.mbs.elements import joint_laws, springs
from rom.mbs.equations.equations import evaluate, linearize_constraints, retract

GRAVITY, NONE = np.array([0.3, -9.0, 2.0]), np.zeros(0)


def difference(f, n, step=1e-6):
    """Central differences of f by n parameters, as columns."""
    columns = [(f(step * e) - f(-step * e)) / (2 * step) for e in np.eye(n)]
    return np.array(columns).T


def shifted(packed, q, delta):
    out = np.empty_like(q)
    retract(packed.system, q, delta, out)
    return out


def forces_at(packed, W, q, v, a=None, lam=None):
    """The residual; at rest and without multipliers where they are not given."""
    residual_at(packed.system, W, q, v, 0 * v if a is None else a, NONE if lam is None else lam)
    return W.residual.copy()


def energy_gradient(packed, W, q, step=1e-6):
    """Differences of the stored energy by the motions from a position."""
    none = 0 * packed.v

    def energy(delta):
        return np.array([stored_at(packed.system, W, shifted(packed, q, delta), none)])

    return difference(energy, none.size, step)[0]


def near(rng, packed, size):
    """A state that is not far from the start, and moves at random."""
    q, v, a, lam = random_state(rng, packed)
    q[:] = shifted(packed, packed.q, size * rng.normal(size=packed.v.size))
    return q, v, a, lam


def constraint_derivatives(packed, W, q, v):
    """Differences of the gaps by the motions (m, n), and of their rates along the velocity (m,)."""

    def value(delta):
        evaluate(packed.system, W, shifted(packed, q, delta), v)
        return W.value.copy()

    def rate(time):
        linearize_constraints(packed.system, W, shifted(packed, q, time * v), v)
        return W.G @ v

    return difference(value, v.size), difference(lambda x: rate(x[0]), 1)[:, 0]


def assert_forces_are_the_gradient(packed, W, mesh, q):
    """The forces of one mesh of two bodies follow from its energy, and leave nothing over."""
    gradient = energy_gradient(packed, W, q, 1e-8)
    forces_at(packed, W, q, np.zeros(12))
    assert mesh.load[0] > 1e3
    assert_allclose(W.residual, gradient, atol=1e-6 * np.abs(gradient).max())
    one, two = W.wrench[mesh.i[0]], W.wrench[mesh.j[0]]
    apart = W.P[mesh.j[0]] - W.P[mesh.i[0]]
    assert_allclose(one[:3] + two[:3], 0.0, atol=1e-12 * np.abs(one[:3]).max())
    moment = one[3:] + two[3:] + np.cross(apart, two[:3])
    assert_allclose(moment, 0.0, atol=1e-11 * np.abs(one[3:]).max())


def by_position(packed, W, q, v, a=None, lam=NONE, step=1e-9):
    """Derivatives of the forces by the position: as the tangent has them, and by differences."""
    a = 0 * v if a is None else a
    at = lambda x: forces_at(packed, W, shifted(packed, q, x), v, a, lam)  # noqa: E731
    wanted = difference(at, v.size, step)
    tangents_at(packed.system, W, q, v, a, lam, (0.0, 0.0, 1.0))
    return W.Kt.copy(), wanted


def by_velocity(packed, W, q, v, a=None, lam=NONE):
    """Derivatives of the forces by the velocity: as the tangent has them, and by differences."""
    a = 0 * v if a is None else a
    wanted = difference(lambda x: forces_at(packed, W, q, v + x, a, lam), v.size)
    tangents_at(packed.system, W, q, v, a, lam, (0.0, 1.0, 0.0))
    return W.S.copy(), wanted


def elastic_forces(packed, W, q, stiffness, lam=NONE, step=1e-6):
    """Slopes of the stored energy, and the forces at rest that go with a stiffness, both (n,)."""
    none = 0 * packed.v
    gradient, whole = energy_gradient(packed, W, q, step), forces_at(packed, W, q, none, lam=lam)
    stiffness[:] = 0.0
    return gradient, whole - forces_at(packed, W, q, none, lam=lam)


def check_tangents(packed, W, state, motions, tolerance):
    """Mass, velocity and position blocks along the columns of ``motions``.

    The change of a damper's velocity with the position is left out of the iteration matrix: the
    position block is compared without dampers.
    """
    s, (q, v, a, lam) = packed.system, state
    zero = np.zeros(v.size)

    def at(dq, da):
        return forces_at(packed, W, shifted(packed, q, dq), v, a + da, lam)

    found, C = by_velocity(packed, W, *state)
    assert_allclose(found, C, atol=1e-7 * np.abs(C).max())
    for family in (springs.SPRINGS_FAMILY, joint_laws.TURNS_FAMILY):
        if family in packed.elements:
            packed.elements[family].law[:, 1] = 0.0
    M = difference(lambda x: at(zero, x), v.size)
    K = difference(lambda x: at(motions @ x, zero), motions.shape[1])
    tangents_at(s, W, q, v, a, lam, (1.0, 0.0, 1.0))
    assert_allclose(W.S, M, atol=1e-7 * np.abs(M).max())
    assert_allclose(W.Kt @ motions, K, atol=tolerance * np.abs(K).max())
