"""Markers whose axes are the rotation nearest to their surface, at any angle."""

from dataclasses import replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import rom
from cases.mbs.mechanisms import nodal_body, prepared, random_body, random_pose, random_state
from cases.mbs.tangents import check_tangents, constraint_derivatives, difference, shifted
from cases.mbs.trusses import covariance_of
from rom.mbs.equations.equations import evaluate, linearize_constraints
from rom.mbs.kernels.algebra import row
from rom.mbs.kernels.markers import nearest_rotation

# corners of a plate and a point off it, seen from the first; the third turns about it in the plane
PLATE = np.array([[0.0, 0, 0], [1.0, 0, 0], [1.1, 0.8, 0], [-0.1, 0.7, 0]])


def fitted(body, rng, flat=True):
    """The same body, its markers fitted to surfaces of random motion; they turn by about a rad."""
    for name, marker in body.markers.items():
        X = rng.normal(size=(9, 3)) * ([1, 0.7, 0] if flat else [1, 0.7, 1.2])
        X = X @ Rotation.random(random_state=3).as_matrix()
        found = covariance_of(X, 4 * rng.normal(size=(9, 3, body.n_modes)))
        body.markers[name] = replace(marker, covariance=found)
    return body


@njit
def nearest(B):
    return nearest_rotation(row(B, 0, 0), row(B, 1, 0), row(B, 2, 0))


@pytest.mark.parametrize("rank", [2, 3])
@pytest.mark.parametrize("angle", [1e-9, 0.4, 1.7, 3.1])
def test_the_rotation_is_that_of_the_least_squares(rank, angle):
    """Kabsch's, by singular values: points that turn, stretch, and slide in other ways."""
    rng = np.random.default_rng(2)
    X = rng.normal(size=(12, 3)) * [1.0, 0.6, 0.8 * (rank - 2)]
    R = Rotation.from_rotvec(angle * np.array([0.6, 0.0, 0.8])).as_matrix()
    B = (X + 0.1 * rng.normal(size=X.shape)) @ R.T
    B = B.T @ X
    U, s, Vt = np.linalg.svd(B)
    expected = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    found = np.array(nearest(B))
    assert_allclose(found, expected, atol=1e-13)
    assert_allclose(found @ found.T, np.eye(3), atol=1e-14)
    assert_allclose(found.T @ B, B.T @ found, atol=1e-13 * s[0])


def joined(rng, flat):
    """A body with fitted markers on joints to others, with moments on its markers."""
    mech = rom.Mechanism(gravity=(0.3, -9.0, 2.0))
    one = mech.add_flexible("one", fitted(random_body(rng), rng, flat), **random_pose(rng))
    two = mech.add_flexible("two", random_body(rng, 3), **random_pose(rng))
    rigid = mech.add_rigid("rigid", mass=1.3, inertia=(1.0, 1.2, 1.5), markers={"c": (0.1, 0, 0.3)},
                           **random_pose(rng))  # fmt: skip
    mech.revolute("hinge", one.marker("a"), rigid.marker("c"), axis=(1, 2, 2))
    mech.fixed("weld", two.marker("b"), one.marker("b"))
    mech.torque("twist", one.marker("b"), (2.0, -3.0, 1.5))
    return mech


@pytest.mark.parametrize("flat", [True, False])
def test_motion_of_fitted_markers_is_the_derivative_of_their_place(flat):
    rng = np.random.default_rng(5)
    packed, W = prepared(joined(rng, flat))
    s, (q, v, *_) = packed.system, random_state(rng, packed)
    rows = np.flatnonzero(s.markers.fit >= 0)
    assert rows.size == 2

    def turned(delta):
        evaluate(s, W, shifted(packed, q, delta), v)
        return np.concatenate([W.E[k].ravel() for k in rows])

    def twist(delta):
        evaluate(s, W, shifted(packed, q, delta), v)
        return np.concatenate([W.V[k] for k in rows])

    rate = difference(lambda x: turned(x[0] * v), 1)[:, 0].reshape(-1, 3, 3)
    conv = difference(lambda x: twist(x[0] * v), 1)[:, 0]
    evaluate(s, W, q, v)
    angles = [Rotation.from_matrix(W.A[0].T @ W.E[k]).magnitude() for k in rows]
    assert max(angles) > 0.5
    for k, found in zip(rows, rate, strict=True):
        assert_allclose(W.E[k] @ W.E[k].T, np.eye(3), atol=1e-14)
        spin = found @ W.E[k].T
        assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], W.V[k, 3:], atol=1e-7)
    assert_allclose(np.concatenate([W.conv[k] for k in rows]), conv, atol=1e-6)


@pytest.mark.parametrize("flat", [True, False])
def test_constraints_and_tangents_at_fitted_markers_are_exact(flat):
    """Not for small rotations only, as those of other markers are."""
    rng = np.random.default_rng(6)
    packed, W = prepared(joined(rng, flat))
    packed.system.markers.twist[packed.system.markers.fit < 0] *= 1e-4
    s, state = packed.system, random_state(rng, packed)
    q, v, *_ = state
    G, _ = constraint_derivatives(packed, W, q, v)
    linearize_constraints(s, W, q, v)
    assert_allclose(W.G, G, atol=2e-8 * np.abs(G).max())
    check_tangents(packed, W, state, np.eye(v.size), 1e-6)


def plate():
    """Four masses whose elastic coordinates carry any deformation, and a marker on all."""
    free = [(1, 0), (2, 0), (2, 1), (3, 0), (3, 1), (3, 2)]
    shapes = np.zeros((len(free), *PLATE.shape))
    for k, place in enumerate(free):
        shapes[(k, *place)] = 1.0
    K = 30.0 * np.eye(len(free))
    means = {"mean": (PLATE.mean(axis=0), shapes.mean(axis=1).T, np.zeros((3, len(free))))}
    body = nodal_body(PLATE, np.diag([0.7, 0.4, 0.5, 0.3]), shapes, K, markers=means)
    found = covariance_of(PLATE, np.moveaxis(shapes, 0, 2))
    body.markers["mean"] = replace(body.markers["mean"], covariance=found)
    return body


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
def test_a_rotor_on_a_marker_that_turns_far_keeps_energy_and_momentum():
    """On a hinge with a spring: they drift if axes, rates and moments are not of one kind."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible(
        "plate", plate(), omega=(0.4, -1.0, 0.7), q=[0.2, -0.3, 0.4, 0.3, -0.2, 0.5]
    )
    middle = part.point(part.marker("mean"))
    rotor = mech.add_rigid("rotor", mass=0.4, inertia=(0.03, 0.05, 0.04), at=middle,
                           markers={"c": (0, 0, 0)})  # fmt: skip
    mech.revolute("hinge", part.marker("mean"), rotor.marker("c"), axis=(0, 0, 1))
    mech.rotational_spring("coil", "hinge", stiffness=0.6)
    solution = rom.simulate(mech, t_end=2.0, dt=0.02, method="dop853", assemble=True)
    total, (_, angular) = solution.energy.total, solution.momentum
    assert_allclose(total, total[0], rtol=1e-8)
    assert_allclose(angular, np.tile(angular[0], (len(angular), 1)), atol=1e-8)
    turn = np.einsum("tij,tik->tjk", solution.axes("plate", "mean"), solution.axes("rotor", "c"))
    assert_allclose(turn[:, 2, 2], 1.0, atol=1e-9)
    assert np.ptp(solution.joint("hinge").angle) > 0.1
