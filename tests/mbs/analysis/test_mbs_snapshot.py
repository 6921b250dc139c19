"""One state asked like a motion, and points of rods in both."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.mechanisms import random_body
from cases.mbs.parts import held_rod, on_hinge
from rom.errors import ConfigError

GRAVITY, MASS, LENGTH, BENDING = 9.81, 3.0, 2.0, 50.0


def cantilever(n=80):
    """A rod along z, clamped at its start, with a small force across at its tip."""
    section = {"stretch": 1e6, "bend": BENDING, "mass": 0.1, "inertia": (1e-4, 1e-4, 2e-4)}
    mech, rod = held_rod(n, length=LENGTH, **section)
    mech.force("load", rod.marker("end"), (0.05, 0, 0))
    return mech


def test_a_cantilever_bends_by_its_closed_form():
    """F z^2 (3 l - z) / 6 EI at every frame, and what the clamp carries."""
    mech = cantilever()
    rest = rom.snapshot(mech, rom.equilibrium(mech))
    points, start, end = rest.position("rod"), *(rest.position("rod", x) for x in ("start", "end"))
    assert points.shape == (1, len(mech.nonlinear["rod"].parts), 3)
    assert_allclose(points[:, [0, -1]], np.stack([start, end], 1), rtol=0)
    z = points[0, :, 2]
    bent = 0.05 * z**2 * (3 * LENGTH - z) / (6 * BENDING)
    assert_allclose(points[0, :, 0], bent, atol=2e-3 * bent.max())
    assert_allclose(rest.position("rod", -1), end, rtol=0)
    assert_allclose(rest.reaction("hook")[0, 0], -0.05, rtol=1e-6)
    slope = rest.axes("rod", "end")[0] @ rest.axes("rod", "start")[0].T @ [0, 0, 1]
    assert slope[0] == pytest.approx(0.05 * LENGTH**2 / (2 * BENDING), rel=2e-2)
    strain = 0.5 * 0.05 * end[0, 0]  # Clapeyron
    assert rest.energy.strain[0] == pytest.approx(strain, rel=2e-3)


def test_points_of_a_rod_move_as_their_frames():
    mech = cantilever(6)
    sol = rom.simulate(mech, t_end=0.05, dt=1e-3)
    frames = [part.name for part in mech.nonlinear["rod"].parts]
    for ask in (sol.position, sol.velocity, sol.orientation, sol.omega):
        assert_allclose(ask("rod"), np.stack([ask(name) for name in frames], axis=1), rtol=0)
    assert_allclose(sol.velocity("rod", "end"), sol.velocity(frames[-1]), rtol=0)
    assert np.abs(sol.velocity("rod", "end")).max() > 1e-4
    with pytest.raises(ConfigError, match=r"'rod' has no marker 'tip'; it has \['end', 'start'\]"):
        sol.position("rod", "tip")


def test_a_body_at_rest_weighs_on_its_pin():
    mech = rom.Mechanism(gravity=(0, 0, -GRAVITY))
    on_hinge(mech, (0.3, 0, -0.4), mass=MASS, inertia=(1, 1, 1))
    rest = rom.snapshot(mech, rom.equilibrium(mech))
    assert_allclose(rest.position("bob"), [[0, 0, -0.5]], atol=1e-9)
    assert_allclose(rest.reaction("hinge"), [[0, 0, MASS * GRAVITY, 0, 0, 0]], atol=1e-6)
    assert_allclose(rest.joint("hinge").angle, np.arctan2(0.3, 0.4), rtol=1e-9)
    assert_allclose(rest.interface_loads("bob")["pin"], rest.reaction("hinge"), atol=1e-9)
    assert rest.at(0.0) is rest
    with pytest.raises(ConfigError, match=r"t = 1 s must be within the motion from 0 s to 0 s"):
        rest.at(1.0)


def test_the_end_of_a_motion_answers_as_the_motion_does():
    """Flexible, driven, pushed by a function in Python; but for velocities across the joints."""
    mech = rom.Mechanism(gravity=(0, 0, -GRAVITY))
    body = mech.add_flexible("one", random_body(np.random.default_rng(3)))
    mech.revolute("pin", mech.ground.marker(mech.design_point(body.marker("a"))),
                  body.marker("a"), axis=(0, 0, 1))  # fmt: skip
    mech.drive("speed", "pin", lambda t: 2.0 * t**2)
    push = lambda t, state: ((0.0, 3.0 + t, 0.0), (0.0, 0.0, 0.0))  # noqa: E731
    mech.user_force("push", push, body.marker("b"))
    sol = rom.simulate(mech, t_end=0.1, dt=1e-3)
    last = rom.snapshot(mech, sol.final)
    assert last.t == sol.t[-1]
    for ask in (lambda s: s.position("one", "b"), lambda s: s.velocity("one", "b"),
                lambda s: s.joint("pin").angle, lambda s: s.elastic("one"),
                lambda s: s.momentum[1], lambda s: s.energy.total,
                lambda s: s.signals):  # fmt: skip
        assert_allclose(ask(last)[0], ask(sol)[-1], rtol=1e-4, atol=1e-9)
    for ask in (lambda s: s.reaction("pin"), lambda s: s.interface_loads("one")["b"]):
        assert_allclose(ask(last)[0], ask(sol)[-1], rtol=0, atol=1e-3 * np.abs(ask(sol)).max())


def test_a_state_of_another_mechanism_is_refused():
    with pytest.raises(ConfigError, match="this mechanism has"):
        rom.snapshot(cantilever(3), rom.equilibrium(cantilever(4)))
