"""The equations of motion: against nodal dynamics and differences; dense systems, signatures."""

from itertools import pairwise

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose
from scipy.linalg import null_space
from scipy.sparse import csc_matrix

from cases.mbs import mechanisms
from cases.mbs.mechanisms import prepared, random_pose, random_state, two_soft
from cases.mbs.tangents import GRAVITY, check_tangents, constraint_derivatives
from rom import rotation
from rom.body import rotating, stiffening
from rom.mbs.equations import equations, sparse_solve
from rom.mbs.integrate.consistent_start import initial_state
from rom.mbs.kernels.algebra import PANEL_WIDTH, back_substitute, factorise
from rom.mbs.mechanism import Mechanism


def test_frame_equations_equal_direct_nodal_dynamics():
    """C1: a dropped inertia integral, sign or transpose changes the accelerations.

    No inertia integral occurs in the equations of the nodes, which are linear in accelerations.
    """
    rng, psi, each = np.random.default_rng(1), np.zeros((4, 4, 7, 3)), [np.zeros(10), *np.eye(10)]
    for _ in range(5):
        nodes = mechanisms.random_nodes(rng)
        mech = Mechanism(gravity=GRAVITY)
        pose = random_pose(rng)
        q, qd = rng.normal(size=4), rng.normal(size=4)
        mech.add_flexible("body", mechanisms.nodal_body(*nodes), q=q, qd=qd, **pose)
        packed, W = prepared(mech)
        y = np.concatenate([packed.q, packed.v, np.zeros(3)])
        a = np.zeros(10)
        assert equations.rates(packed.system, W, y, 0, True, a, np.zeros(0), np.zeros_like(y))
        moving = q, qd, pose["orientation"], pose["omega"]
        left = [mechanisms.nodal_residual(nodes, psi, moving, b, GRAVITY) for b in each]
        exact = np.linalg.solve(np.array(left[1:]).T - left[0][:, None], -left[0])
        assert_allclose(a, exact, rtol=1e-10, atol=1e-10 * np.abs(exact).max())


def everything(rng, *, angles=True):
    """Two flexible bodies, one of them stiffened, and a rigid one with every joint and load."""
    mech, one, two = two_soft(rng, GRAVITY, stiffened=True)
    box = mech.add_rigid("box", mass=2.0, inertia=(1.0, 1.5, 2.0),
                         markers={"a": (0.3, 0.2, -0.1)}, **random_pose(rng))  # fmt: skip
    m1, m2, m3 = one.marker("a"), two.marker("b"), box.marker("a")
    x, y = np.array([1.0, 2, 2]) / 3, np.array([2.0, 1, -2]) / 3
    mech.revolute("revolute", m1, m2, axis=x)
    mech.cylindrical("cylindrical", m2, m3, axis=y)
    mech.prismatic("prismatic", m3, one.marker("b"), axis=x)
    mech.universal("universal", mech.ground.marker((1, 1, 0)), m3, axis1=x, axis2=y)
    mech.fixed("fixed", two.marker("a"), m1)
    mech.spherical("spherical", m1, mech.ground.marker((0, 1, 1)))
    if angles:
        mech.drive("motor", "revolute", lambda t: 0.1 + t)
        mech.rotational_spring("coil", "cylindrical", stiffness=5.0, damping=0.4)
    mech.drive("jack", "prismatic", lambda t: 0.1 + t)
    mech.spring_damper("spring", m2, m3, stiffness=30.0, damping=2.0, free_length=0.7)
    mech.force("push", m1, (1.0, 2.0, 3.0), frame="body")
    mech.torque("twist", m3, (0.3, -2.0, 1.0), frame="body")
    mech.torque("wind", m2, (0.3, -2.0, 1.0))
    return mech


@pytest.mark.parametrize("seed", range(3))
def test_constraint_gradient_and_convective_term_are_derivatives_of_the_residual(seed):
    rng = np.random.default_rng(seed)
    packed, W = prepared(everything(rng))
    s, (q, v, _, _) = packed.system, random_state(rng, packed)
    G, convective = constraint_derivatives(packed, W, q, v)
    equations.linearize_constraints(s, W, q, v)
    assert_allclose(W.G, G, atol=2e-8 * np.abs(G).max())
    assert_allclose(W.gamma, convective, atol=1e-7 * np.abs(convective).max())


@pytest.mark.parametrize("seed", range(3))
def test_iteration_matrix_is_the_derivative_of_the_residual(seed):
    """For small elastic twists of the markers, see `wrench_stiffness`."""
    rng = np.random.default_rng(seed)
    packed, W = prepared(everything(rng, angles=False))
    packed.system.markers.twist[:] *= 1e-3
    packed.system.markers.bend[:, 3:] *= 1e-3
    check_tangents(packed, W, random_state(rng, packed), np.eye(packed.v.size), 1e-6)


def test_a_rotating_body_is_linearised_as_it_moves():
    """Stiffness and gyroscopic matrix of the body: the derivatives of its equations of motion."""
    rng = np.random.default_rng(6)
    body = mechanisms.random_body(rng, damped=False, stiffened=True).with_reference("mean-axis")
    for load in stiffening.elastic_loads(body.n_modes):  # they act on a body that is bent
        del body.K_geo[load]
    w, arm, pose = rng.normal(size=3), rng.normal(size=3), random_pose(rng)
    mech = Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("body", body, **pose | {"omega": w})
    packed, W = prepared(mech)
    a, none = np.zeros(10), np.zeros(0)
    a[:3] = rotation.matrix(pose["orientation"]) @ np.cross(w, np.cross(w, -arm))
    mechanisms.tangents_at(packed.system, W, packed.q, packed.v, a, none, (0.0, 1.0, 1.0))
    K, G = rotating.rotating_matrices(body, w, arm)
    assert_allclose(W.Kt[6:, 6:], K, atol=1e-12 * np.abs(K).max())
    assert_allclose(W.S[6:, 6:], G, atol=1e-12 * np.abs(G).max())


def test_stiffness_of_drives_and_coils_is_exact_where_the_joint_is_closed():
    rng = np.random.default_rng(4)
    mech, one, two = two_soft(rng, GRAVITY)
    mech.revolute("hinge", one.marker("a"), two.marker("b"), axis=(1.0, 2.0, 2.0))
    mech.drive("motor", "hinge", lambda t: 0.4 + t)
    mech.rotational_spring("coil", "hinge", stiffness=5.0, damping=0.4)
    packed, W = prepared(mech)
    packed.system.markers.twist[:] *= 1e-3
    packed.system.markers.bend[:, 3:] *= 1e-3
    start = initial_state(packed, assemble=True)
    W.signal[:, 0] = 0.4
    equations.linearize_constraints(packed.system, W, start.q, start.v)
    motions = null_space(W.G[:5])
    _, v, a, lam = random_state(rng, packed)
    check_tangents(packed, W, (start.q, v, a, lam), motions, 1e-6)


@njit
def solve(A, n, pivot, x):
    if not factorise(A, n, pivot):
        return False
    back_substitute(A, n, pivot, x)
    return True


@pytest.mark.parametrize("n", [*range(1, 3 * PANEL_WIDTH + 2), 100])
@pytest.mark.parametrize("share", [1.0, 0.15])
def test_solutions_are_those_of_numpy(n, share):
    rng = np.random.default_rng(n)
    A = rng.standard_normal((n + 3, n + 3)) * (rng.random((n + 3, n + 3)) < share)
    A[:n, :n] += np.roll(np.diag(np.full(n, 3.0)), 1, axis=0)  # pivots off the diagonal
    b = rng.standard_normal(n + 3)
    work, x = A.copy(), b[:n].copy()
    assert solve(work, n, np.zeros(n, dtype=np.int64), x)
    condition = np.linalg.cond(A[:n, :n])
    expected = np.linalg.solve(A[:n, :n], b[:n])
    assert_allclose(x, expected, atol=1e-13 * condition * np.abs(expected).max())
    assert np.array_equal(work[n:], A[n:])  # what is beside the leading block stays
    assert np.array_equal(work[:, n:], A[:, n:])


@pytest.mark.parametrize("column", [0, 7, 8, 18])
def test_a_pivot_that_vanishes_is_said(column):
    A = np.random.default_rng(1).standard_normal((19, 19))
    A[:, column] = 0.0
    assert not solve(A, 19, np.zeros(19, dtype=np.int64), np.ones(19))
    A[3, 3] = np.nan
    assert not solve(A, 19, np.zeros(19, dtype=np.int64), np.ones(19))


def random_symmetric(rng, n_groups, *, massless):
    """A sparse matrix of groups of three to five unknowns, between them ones without a diagonal."""
    sizes = rng.integers(3, 6, n_groups)
    sizes[1::3] = rng.integers(1, 3, sizes[1::3].size)
    first = np.concatenate([[0], np.cumsum(sizes)])
    groups = [np.arange(a, b) for a, b in pairwise(first)]
    A = np.zeros((first[-1],) * 2)
    for k, rows in enumerate(groups):
        light = massless and k % 3 == 1
        others = [j for j in (k - 1, (k + 1) % n_groups) if light or rng.random() < 0.7]
        for j in others if light else [*others, k]:
            block = rng.normal(size=(sizes[k], sizes[j])) * 10.0 ** rng.uniform(-2, 2)
            A[np.ix_(rows, groups[j])] += block
    A = A + A.T
    for rows in groups[1::3] if massless else ():  # almost without: pivots that nothing survives
        A[rows, rows] = 1e-13
    return A, groups


@pytest.mark.parametrize("massless", [False, True])
@pytest.mark.parametrize("seed", range(12))
def test_signs_of_eigenvalues_are_counted_in_any_order(seed, massless):
    rng = np.random.default_rng(seed)
    A, groups = random_symmetric(rng, 40, massless=massless)
    exact = np.linalg.eigvalsh(A)
    assert np.abs(exact).min() > 1e-8 * np.abs(exact).max()  # none of them is zero
    for order in (groups, groups[::-1], [groups[k] for k in rng.permutation(len(groups))]):
        found = sparse_solve.signature(csc_matrix(A), order)
        assert found == (np.sum(exact < 0), 0, np.sum(exact > 0))


@pytest.mark.parametrize("copies", [0, 1, 5])
def test_constraints_that_repeat_others_are_counted_as_zero(copies):
    rng = np.random.default_rng(copies)
    G = rng.normal(size=(7, 30))
    G = np.vstack([G, rng.normal(size=(copies, 7)) @ G])
    A = np.block([[np.diag(rng.uniform(1, 9, 30)), G.T], [G, np.zeros((len(G),) * 2)]])
    groups = [np.arange(a, a + 5) for a in range(0, 30, 5)] + [np.arange(30, len(A))]
    assert sparse_solve.signature(csc_matrix(A), groups, 1e-10) == (7, copies, 30)
