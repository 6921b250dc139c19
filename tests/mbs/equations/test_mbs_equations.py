"""The equations of motion: against direct nodal dynamics and finite differences."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import null_space

from cases.mbs.mechanisms import (
    nodal_body,
    prepared,
    random_body,
    random_nodes,
    random_pose,
    random_state,
    tangents_at,
)
from cases.mbs.tangents import GRAVITY, check_tangents, constraint_derivatives
from rom import rotation
from rom.body.rotating import rotating_matrices
from rom.body.stiffening import elastic_loads
from rom.mbs.equations.equations import linearize_constraints, rates
from rom.mbs.integrate.consistent_start import initial_state
from rom.mbs.mechanism import Mechanism


def nodal_accelerations(nodes, q_f, qd, p, w):
    """Accelerations of frame and elastic coordinates from the nodes themselves.

    Nodes at r + A (x + sum q phi), with the full scalar mass matrix; the equations are the normal
    equations of Gauss's principle, no inertia integral occurs.
    """
    x, Ms, phi, K, D = nodes
    r, n = phi.shape[0], x.shape[0]
    A = rotation.matrix(p)
    P = x + np.einsum("k,kia->ia", q_f, phi)
    Pd = np.einsum("k,kia->ia", qd, phi)
    J = np.zeros((3 * n, 6 + r))
    for i in range(n):
        J[3 * i : 3 * i + 3, :3] = np.eye(3)
        J[3 * i : 3 * i + 3, 3:6] = -A @ rotation.skew(P[i])
        J[3 * i : 3 * i + 3, 6:] = A @ phi[:, i].T
    conv = (np.cross(w, np.cross(w, P)) + 2 * np.cross(w, Pd)) @ A.T
    M = np.kron(Ms, np.eye(3))
    force = J.T @ M @ (np.tile(GRAVITY, n) - conv.ravel())
    force[6:] -= K @ q_f + D @ qd
    return np.linalg.solve(J.T @ M @ J, force)


def test_frame_equations_equal_direct_nodal_dynamics():
    """C1: a dropped inertia integral, sign or transpose changes the accelerations."""
    rng = np.random.default_rng(1)
    for _ in range(5):
        nodes = random_nodes(rng)
        mech = Mechanism(gravity=GRAVITY)
        pose = random_pose(rng)
        q, qd = rng.normal(size=4), rng.normal(size=4)
        mech.add_flexible("body", nodal_body(*nodes), q=q, qd=qd, **pose)
        packed, W = prepared(mech)
        y = np.concatenate([packed.q, packed.v, np.zeros(3)])
        a = np.zeros(10)
        assert rates(packed.system, W, y, 0, True, a, np.zeros(0), np.zeros_like(y))
        exact = nodal_accelerations(nodes, q, qd, pose["orientation"], pose["omega"])
        assert_allclose(a, exact, rtol=1e-10, atol=1e-10 * np.abs(exact).max())


def everything(rng, *, angles=True):
    """Two flexible bodies, one of them stiffened, and a rigid one with every joint and load."""
    mech = Mechanism(gravity=GRAVITY)
    one = mech.add_flexible("one", random_body(rng, stiffened=True), **random_pose(rng))
    two = mech.add_flexible("two", random_body(rng, r=3), **random_pose(rng))
    box = mech.add_rigid(
        "box",
        mass=2.0,
        inertia=(1.0, 1.5, 2.0),
        markers={"a": (0.3, 0.2, -0.1)},
        **random_pose(rng),
    )
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
    """All kinds of rows, between flexible, rigid and ground markers."""
    rng = np.random.default_rng(seed)
    packed, W = prepared(everything(rng))
    s, (q, v, _, _) = packed.system, random_state(rng, packed)
    G, convective = constraint_derivatives(packed, W, q, v)
    linearize_constraints(s, W, q, v)
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
    body = random_body(rng, damped=False, stiffened=True).with_reference("mean-axis")
    for load in elastic_loads(body.n_modes):  # they act on a body that is bent
        del body.K_geo[load]
    w, arm, pose = rng.normal(size=3), rng.normal(size=3), random_pose(rng)
    mech = Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("body", body, **pose | {"omega": w})
    packed, W = prepared(mech)
    a, none = np.zeros(10), np.zeros(0)
    a[:3] = rotation.matrix(pose["orientation"]) @ np.cross(w, np.cross(w, -arm))
    tangents_at(packed.system, W, packed.q, packed.v, a, none, (0.0, 1.0, 1.0))
    K, G = rotating_matrices(body, w, arm)
    assert_allclose(W.Kt[6:, 6:], K, atol=1e-12 * np.abs(K).max())
    assert_allclose(W.S[6:, 6:], G, atol=1e-12 * np.abs(G).max())


def test_stiffness_of_drives_and_coils_is_exact_where_the_joint_is_closed():
    rng = np.random.default_rng(4)
    mech = Mechanism(gravity=GRAVITY)
    one = mech.add_flexible("one", random_body(rng), **random_pose(rng))
    two = mech.add_flexible("two", random_body(rng, r=3), **random_pose(rng))
    mech.revolute("hinge", one.marker("a"), two.marker("b"), axis=(1.0, 2.0, 2.0))
    mech.drive("motor", "hinge", lambda t: 0.4 + t)
    mech.rotational_spring("coil", "hinge", stiffness=5.0, damping=0.4)
    packed, W = prepared(mech)
    packed.system.markers.twist[:] *= 1e-3
    packed.system.markers.bend[:, 3:] *= 1e-3
    start = initial_state(packed, assemble=True)
    W.signal[:, 0] = 0.4
    linearize_constraints(packed.system, W, start.q, start.v)
    motions = null_space(W.G[:5])
    _, v, a, lam = random_state(rng, packed)
    check_tangents(packed, W, (start.q, v, a, lam), motions, 1e-6)
