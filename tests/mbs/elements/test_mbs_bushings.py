"""Bushings: an energy whatever the rotation, closed forms, curves, exact tangents."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.mechanisms import prepared, two_soft
from cases.mbs.parts import Z, boxed, on_axle, refused_on
from cases.mbs.tangents import by_velocity, check_tangents, energy_gradient, forces_at, near
from rom import rotation
from rom.mbs.elements import bushings

TILT = np.array([0.9, 0.1, -0.3, 0.3]) / np.linalg.norm([0.9, 0.1, -0.3, 0.3])
NEAR_SIZE = 0.4  # rotations of the bushing stay well below half a turn
DIAGONAL = (800.0, 450.0, 200.0, 10.8, 8.0, 2.8)


def full_matrix(rng, size=30.0):
    A = rng.normal(size=(6, 6))
    return size * (A @ A.T / 6 + np.eye(6))


def bushed(rng, damped=False):
    """Two flexible bodies on a bushing with a full matrix, tilted axes and two curves."""
    mech, one, two = two_soft(rng, damped=False)
    x = np.linspace(-0.6, 0.6, 5)
    mech.bushing("rubber", one.marker("a"), two.marker("b"), stiffness=full_matrix(rng), axes=TILT,
                 damping=full_matrix(rng, 2.0) if damped else None,
                 curves={"y": (x, 40 * x**3), "rx": (x, np.sinh(3 * x))})  # fmt: skip
    return mech


@pytest.mark.parametrize("seed", range(3))
def test_forces_are_the_gradient_of_the_energy(seed):
    rng = np.random.default_rng(seed)
    packed, W = prepared(bushed(rng))
    packed.system.markers.twist[:] *= 1e-3  # of the marker Jacobian, see `wrench_stiffness`
    q, v, _, lam = near(rng, packed, NEAR_SIZE)
    gradient, body = energy_gradient(packed, W, q), forces_at(packed, W, q, 0 * v, lam=lam)
    packed.elements[bushings.BUSHINGS_FAMILY].stiffness[:] = 0.0
    packed.elements[bushings.BUSHINGS_FAMILY].curve[:] = -1
    found = body - forces_at(packed, W, q, 0 * v, lam=lam)
    assert_allclose(found, gradient, atol=1e-7 * np.abs(gradient).max())


@pytest.mark.parametrize("seed", range(2))
def test_tangents_are_derivatives_of_the_forces(seed):
    rng = np.random.default_rng(seed)
    packed, W = prepared(bushed(rng, damped=True))
    packed.system.markers.twist[:] *= 1e-3
    state = near(rng, packed, NEAR_SIZE)
    found, C = by_velocity(packed, W, *state)
    assert_allclose(found, C, atol=1e-7 * np.abs(C).max())
    packed.elements[bushings.BUSHINGS_FAMILY].damping[:] = 0.0
    check_tangents(packed, W, state, np.eye(packed.v.size), 1e-6)


def box(mech, name="box", **more):
    return mech.add_rigid(name, **{"mass": 2.0, "inertia": (0.3, 0.5, 0.7), "at": (0, 0, 0)} | more)


@pytest.mark.parametrize("k", range(6))
def test_small_vibrations_have_the_frequency_of_a_spring(k):
    """Omega^2 = k / m along, k / J about each axis of the bushing."""
    omega = np.sqrt(DIAGONAL[k] / np.array([2.0, 2.0, 2.0, 0.3, 0.5, 0.7])[k])
    mech = rom.Mechanism(gravity=(0, 0, 0))
    kick = 1e-6 * np.eye(6)[k]
    box(mech, velocity=kick[:3], omega=kick[3:])
    mech.bushing("rubber", "ground", "box", stiffness=DIAGONAL)
    sol = rom.simulate(mech, t_end=1.0, dt=0.01, method="dop853", rtol=1e-10, atol=1e-18)
    wanted = kick[k] * np.cos(omega * sol.t)
    assert_allclose(sol.v[:, k], wanted, atol=1e-5 * kick[k])


def alike(joint, t_end, ways, **start):
    """Motions of a box on a joint along z, to which each way adds something of its own."""
    for add in ways:
        mech = rom.Mechanism(gravity=(0, 0, -9.81))
        box(mech, **start)
        getattr(mech, joint)("joint", "ground", "box", axis=Z)
        add(mech, "ground", "box")
        yield rom.simulate(mech, t_end=t_end, dt=1e-3)


def test_a_large_turn_about_one_axis_is_that_of_a_torsion_spring():
    one, other = alike("revolute", 2.0, omega=(0, 0, 4.0), ways=(
        lambda m, *_: m.rotational_spring("coil", "joint", stiffness=2.8, damping=0.2),
        lambda m, *ends: m.bushing("rubber", *ends, stiffness=DIAGONAL, damping=0.2 * np.eye(6)[5]),
    ))  # fmt: skip
    assert_allclose(one.q, other.q, atol=1e-9)
    assert 2 * np.arccos(one.q[:, 3]).max() > 1.5


def test_a_bushing_along_a_line_is_a_spring_with_a_damper():
    axes, K = rotation.matrix(TILT), np.zeros((6, 6))
    K[:3, :3] = axes.T @ np.diag([0, 0, 200.0]) @ axes
    one, other = alike("prismatic", 1.0, at=(0, 0, -1), ways=(
        lambda m, *ends: m.spring_damper("spring", *ends, stiffness=200.0, damping=3.0),
        lambda m, *ends: m.bushing("rubber", *ends, stiffness=K, damping=K * 0.015, axes=axes),
    ))  # fmt: skip
    assert_allclose(one.q, other.q, atol=1e-10)
    assert_allclose(one.energy.damping, other.energy.damping, rtol=1e-9)


def test_a_load_at_rest_is_carried_by_the_full_matrix():
    """Small deflections K^-1 F under a force and a torque, after the damper has done its work."""
    rng = np.random.default_rng(2)
    K = full_matrix(rng, 3e5)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    box(mech)
    mech.bushing("rubber", "ground", "box", stiffness=K, damping=1e-2 * K)
    load = np.array([1.0, -2.0, 0.5, 0.3, 0.2, -0.4])
    mech.force("force", "box", load[:3])
    mech.torque("torque", "box", load[3:])
    q = rom.simulate(mech, t_end=2.0, dt=1e-2, rho_inf=0.3).q[-1]
    assert_allclose(np.r_[q[:3], 2 * q[4:7]], np.linalg.solve(K, load), rtol=1e-4, atol=1e-10)


def test_a_curve_of_points_on_a_line_is_a_spring_and_a_bent_one_keeps_its_energy():
    x = np.array([-0.2, -0.05, 0.1, 0.2])
    runs = {}
    for kind, stiffness, curves in (("spring", 200.0, None), ("line", 0.0, {"x": (x, 200 * x)}),
                                    ("bent", 0.0, {"x": (x, 200 * x + 4e4 * x**3)})):  # fmt: skip
        mech = rom.Mechanism(gravity=(0, 0, 0))
        box(mech, velocity=(3.0, 0, 0))
        mech.bushing("rubber", "ground", "box", stiffness=stiffness * np.eye(6)[0], curves=curves)
        runs[kind] = rom.simulate(mech, t_end=2.0, dt=1e-3, rho_inf=1.0)
    assert np.abs(runs["spring"].q[:, 0]).max() > 0.25  # beyond the points
    assert_allclose(runs["line"].q, runs["spring"].q, atol=1e-10)
    assert np.abs(runs["bent"].q - runs["spring"].q).max() > 0.05
    assert rom.audit(runs["bent"]).ok, rom.audit(runs["bent"])
    assert np.abs(runs["bent"].energy.balance).max() < 3e-4 * 9.0


WRONG = {
    "not symmetric": ({"stiffness": np.eye(6) + np.eye(6, k=1)}, "is not symmetric"),
    "negative": ({"stiffness": (1, 1, 1, 1, 1, -1)}, "negative in a direction"),
    "driving damper": ({"stiffness": np.ones(6), "damping": -np.ones(6)}, "damping of s"),
    "curve of nothing": ({"stiffness": np.ones(6), "curves": {"w": ([0, 1], [0, 1])}}, "'w'"),
    "curve back": ({"stiffness": np.ones(6), "curves": {"x": ([0, 0], [0, 1])}}, "ascend"),
    "uneven curve": ({"stiffness": np.ones(6), "curves": {"x": ([0, 1], [0, 1, 2])}}, "shape"),
}


test_wrong_bushings_are_refused_by_name = refused_on(boxed, {
    case: (lambda mech, *ends, given=given: mech.bushing("s", *ends, **given), words)
    for case, (given, words) in WRONG.items()
})  # fmt: skip


@pytest.mark.parametrize(("end", "told"), [(0.45, False), (0.6, True)])
def test_a_bushing_turned_by_half_a_turn_is_told(end, told):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    on_axle(mech, "rod", axle="pin", omega=(0, 0, 2 * np.pi))
    mech.bushing("rubber", "ground", "rod", stiffness=(0, 0, 0, 0, 0, 10.0))
    mech.drive("turn", "pin", lambda t: 2 * np.pi * t)
    with warnings.catch_warnings(record=True, action="always") as caught:
        rom.simulate(mech, t_end=end, dt=1e-2)
    assert ["bushing 'rubber' was turned by" in str(w.message) for w in caught] == [True] * told
