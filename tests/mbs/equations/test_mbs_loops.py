"""Closed loops: repeated and contradicting constraints, and runs that go on from others."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import null_space

from cases.mbs.mechanisms import prepared, random_body, simulate_quietly
from rom.errors import ConfigError, ModelError, RomWarning
from rom.mbs.equations.equations import linearize_constraints
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.audit import audit

X, Y, Z = np.eye(3)
# crank, coupler, rocker, distance of the pivots [m]; start angle [rad], speed [rad/s]
A, B, C, D = 0.1, 0.4, 0.3, 0.35
START, SPEED = 0.6, 20.0


def elbow(phi):
    """Position of both crank pins (n, 2) of the four-bar: intersection of two circles."""
    pin = A * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    reach = np.array([D, 0.0]) - pin
    far = np.linalg.norm(reach, axis=-1, keepdims=True)
    along = (far**2 + B**2 - C**2) / (2 * far)
    across = np.stack([-reach[..., 1], reach[..., 0]], axis=-1) / far
    return pin, pin + along * reach / far + np.sqrt(B**2 - along**2) * across


def bar_between(mech, name, start, end, mass):
    """A slender rigid bar in the xy plane with a marker at each end."""
    start, end = np.append(start, 0.0), np.append(end, 0.0)
    length = np.linalg.norm(end - start)
    e = (end - start) / length
    J = mass * length**2 / 12
    return mech.add_rigid(
        name, mass=mass, inertia=(1e-4, J, J), at=0.5 * (start + end),
        orientation=np.column_stack([e, np.cross(Z, e), Z]),
        markers={"a": (-0.5 * length, 0, 0), "b": (0.5 * length, 0, 0)},
    )  # fmt: skip


def four_bar(*, repeated=True, drive=True):
    """Four hinges, or hinges, a ball and a Cardan joint that only just hold it in its plane."""
    mech = Mechanism(gravity=(0, -9.81, 0))
    pin, knee = elbow(np.array(START))
    crank = bar_between(mech, "crank", (0, 0), pin, 0.4)
    coupler = bar_between(mech, "coupler", pin, knee, 1.0)
    rocker = bar_between(mech, "rocker", (D, 0), knee, 0.8)
    mech.revolute("O", mech.ground.marker((0, 0, 0)), crank.marker("a"), axis=Z)
    if repeated:
        mech.revolute("A", crank.marker("b"), coupler.marker("a"), axis=Z)
        mech.revolute("B", coupler.marker("b"), rocker.marker("b"), axis=Z)
    else:
        mech.universal("A", crank.marker("b"), coupler.marker("a"), axis1=Z, axis2=X)
        mech.spherical("B", coupler.marker("b"), rocker.marker("b"))
    mech.revolute("C", mech.ground.marker((D, 0, 0)), rocker.marker("a"), axis=Z)
    if drive:
        mech.drive("motor", "O", lambda t: SPEED * t)
    return mech


def test_four_bar_of_hinges_warns_by_name_and_moves_as_its_closed_form():
    with pytest.warns(RomWarning, match="3 of 21 constraints .* joints O, A, B, C share"):
        sol = simulate(four_bar(), t_end=0.4, dt=1e-3)
    pin, knee = elbow(START + SPEED * sol.t)
    assert_allclose(sol.position("crank", "b")[:, :2], pin, atol=1e-9)
    assert_allclose(sol.position("rocker", "b")[:, :2], knee, atol=1e-9)
    assert np.ptp(knee, axis=0).min() > 0.05
    assert sol.statistics["rank"] == 18
    assert sol.statistics["redundant"] == 3


def test_loads_of_the_repeated_four_bar_are_those_of_the_one_that_repeats_nothing():
    """In the plane equilibrium decides; out of it the least loads are none at all."""
    repeated = simulate_quietly(four_bar(), t_end=0.2, dt=1e-3)
    single = simulate(four_bar(repeated=False), t_end=0.2, dt=1e-3)
    assert single.statistics["redundant"] == 0
    for joint in "OABC":
        force, wanted = repeated.reaction(joint), single.reaction(joint)
        size = np.abs(wanted[:, :3]).max()
        assert_allclose(force[:, :2], wanted[:, :2], atol=1e-6 * size)
        assert np.abs(force[:, 2:5]).max() < 1e-9 * size
    torque = repeated.reaction("motor")[:, 5]
    assert_allclose(torque, single.reaction("motor")[:, 5], atol=1e-6 * np.abs(torque).max())


def tumbling_door():
    """A leaf on two hinges of a frame; both tumble across the line of the hinges."""
    mech = Mechanism(gravity=(0, 0, 0))
    points = {"low": (0, 0, -0.8), "high": (0, 0, 0.8)}
    frame = mech.add_rigid("frame", mass=30.0, inertia=(9.0, 8.0, 4.0), at=(0, 0, 0),
                           markers=points, omega=(2.0, 1.0, 0.5))  # fmt: skip
    leaf = mech.add_rigid("leaf", mass=20.0, inertia=(3.0, 2.0, 1.2), at=(0.4, 0, 0.1),
                          markers={k: np.array(x) - [0.4, 0, 0.1] for k, x in points.items()},
                          omega=(2.0, 1.0, 3.0))  # fmt: skip
    for name in points:
        mech.revolute(name, frame.marker(name), leaf.marker(name), axis=Z)
    return mech


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_multipliers_stay_those_of_least_norm_while_the_hinges_tumble(method):
    """They have no share in the loads that the hinges could exchange among themselves."""
    mech = tumbling_door()
    sol = simulate_quietly(mech, t_end=1.0, dt=2e-3, method=method, save_every=50)
    packed, W = prepared(mech)
    for q, v, lam in zip(sol.q, sol.v, sol.lam, strict=True):
        linearize_constraints(packed.system, W, q, v)
        among = null_space(W.G.T, rcond=1e-8)
        assert among.shape[1] == 5
        assert np.abs(among.T @ lam).max() < 1e-6 * np.abs(lam).max()
    turned = sol.axes("frame", "low")[-1] @ Z
    assert turned @ Z < 0.5


def hinge_and_ball(*drives):
    """A box on a hinge with every given drive, and a flexible body at rest on a ball joint."""
    mech = Mechanism(gravity=(0, 0, 0))
    box = mech.add_rigid("box", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0),
                         markers={"a": (0, 0, 0), "b": (1, 0, 0)})  # fmt: skip
    body = random_body(np.random.default_rng(1))
    bar = mech.add_flexible("bar", body, at=X - np.asarray(body.markers["a"].point))
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), box.marker("a"), axis=Z)
    mech.spherical("ball", box.marker("b"), bar.marker("a"))
    for k, function in enumerate(drives):
        mech.drive(f"motor {k}", "hinge", function)
    return mech


def test_drives_of_different_speed_are_refused_by_name():
    """Rows of the ball joint are at rest: their round-off must not hide the drives."""
    mech = hinge_and_ball(lambda t: t, lambda t: 2 * t)
    with pytest.warns(RomWarning), pytest.raises(ModelError, match=r"'motor [01]' misses 0\.5"):
        simulate(mech, t_end=0.01, dt=1e-3)


def test_drives_of_different_position_are_refused_by_name():
    mech = hinge_and_ball(lambda t: 0.0, lambda t: 0.1)
    with pytest.raises(ModelError, match=r"'(motor [01]|hinge)' stays open by"):
        simulate(mech, t_end=0.01, dt=1e-3)


def test_drives_that_part_on_the_way_are_seen_by_the_audit():
    sol = simulate_quietly(hinge_and_ball(lambda t: t**2, lambda t: 2 * t**2), t_end=0.05, dt=1e-3)
    assert [r.quantity for r in audit(sol).failures] == ["largest gap in a joint / size"]


def coil():
    """A wheel on a coil that turns several times."""
    mech = Mechanism(gravity=(0, 0, 0))
    wheel = mech.add_rigid("wheel", mass=1.0, inertia=(1, 1, 0.5), at=(0, 0, 0), omega=(0, 0, 40.0))
    mech.revolute("axle", mech.ground.marker((0, 0, 0)), wheel.marker((0, 0, 0)), axis=Z)
    mech.rotational_spring("coil", "axle", stiffness=2.0)
    return mech


@pytest.mark.parametrize("build", [hinge_and_ball, coil])
def test_a_state_of_the_same_bodies_with_other_joints_is_refused(build):
    """Compiled code would write beyond the end of its arrays."""
    joined = build()
    free = Mechanism(gravity=(0, 0, 0))
    free.parts.update(joined.parts)
    for one, other in ((joined, free), (free, joined)):
        state = simulate(one, t_end=0.01, dt=1e-3).final
        with pytest.raises(ConfigError, match=r"the state has \d+ coordinates.* constraints; this"):
            simulate(other, t_end=0.02, dt=1e-3, state=state)


def test_a_state_without_the_coil_is_refused():
    bare, wound = coil(), coil()
    bare.turns.clear()
    state = simulate(bare, t_end=0.01, dt=1e-3).final
    with pytest.raises(
        ConfigError,
        match="0 followed joint coordinates and remembered numbers; this mechanism has 1",
    ):
        simulate(wound, t_end=0.02, dt=1e-3, state=state)
