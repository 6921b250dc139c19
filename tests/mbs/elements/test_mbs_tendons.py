"""Tendons: an energy whatever the path, exact tangents, ropes and pulleys in closed form."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.mechanisms import prepared, random_body, random_pose, stored_at, tangents_at
from cases.mbs.parts import on_axle, on_guide
from cases.mbs.tangents import by_velocity, check_tangents, elastic_forces, forces_at, near
from cases.refusals import refuses
from rom.components.tendons.tendons import TENDONS_FAMILY
from rom.errors import ConfigError, RomWarning, SolverError
from rom.mbs import Pulley

G = 9.81
SMALL = (1e-3, 1e-3, 1e-3)
ORIGIN, Z = (0, 0, 0), (0, 0, 1)
CORNERS = [(0.0, 0.0, 1.0), (0.3, 0.0, 1.2), (0.4, 0.2, 1.0)]


def strung(rng, pulleys, **more):
    """Two flexible bodies and the ground on a cable; axes of neighbouring pulleys are parallel."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    one = mech.add_flexible("one", random_body(rng, damped=False), **random_pose(rng))
    two = mech.add_flexible("two", random_body(rng, r=3, damped=False), **random_pose(rng))
    a, b, c, d = (part.marker(place) for part in (one, two) for place in "ab")
    n = rng.normal(size=3)
    mu = more.pop("rub", 0.0)
    wheels = {
        "none": [b, mech.ground.marker((4, 5, 6)), c],
        "one": [b, Pulley(c, 0.05, n, mu), mech.ground.marker((4, 5, 6))],
        "pair": [b, Pulley(mech.ground.marker((4, 5, 6)), 0.1, -n), Pulley(c, 0.05, n, mu)],
    }[pulleys]
    mech.tendon("rope", [a, *wheels, d], **more)
    return mech


@pytest.mark.parametrize("pulleys", ["none", "one", "pair"])
@pytest.mark.parametrize("seed", range(3))
def test_forces_are_the_gradient_of_the_energy(seed, pulleys):
    rng = np.random.default_rng(seed)
    packed, W = prepared(strung(rng, pulleys, EA=30.0, pretension=5.0))
    packed.system.markers.twist[:] *= 1e-3  # of the marker Jacobian, see `wrench_stiffness`
    q, _, _, lam = near(rng, packed, 0.02)
    stiffness = packed.elements[TENDONS_FAMILY].law[:, 0]
    gradient, gained = elastic_forces(packed, W, q, stiffness, lam)
    assert np.abs(gradient).max() > 1.0
    assert_allclose(gained, gradient, atol=1e-7 * np.abs(gradient).max())


KINDS = {
    "elastic": {"EA": 30.0, "pretension": 5.0},
    "friction": {"EA": 30.0, "pretension": 5.0, "friction": 0.3, "transition_speed": 2.0,
                 "rub": 0.2},
    "saturated": {"EA": 30.0, "pretension": 5.0, "damping": 3000.0},  # more than elastic
    "pulled": {"tension": 7.0, "friction": 0.3, "transition_speed": 2.0, "rub": 0.2},
    "winch": {"EA": 30.0, "free_length": lambda t: 8.0 - 0.5 * t, "damping": 3.0,
              "friction": 0.3, "transition_speed": 2.0, "rub": 0.2},
}  # fmt: skip


def test_a_second_cable_is_like_the_first():
    """Tangents and forces of two cables are the sum of those of each."""
    rng = np.random.default_rng(4)
    mech = strung(rng, "one", **KINDS["friction"])
    a, b = mech.parts["one"].marker("a"), mech.parts["two"].marker("a")
    corner = mech.ground.marker((2, -1, 0))
    mech.tendon("other", [a, corner, b, mech.ground.marker((0, 3, 1))], tension=9.0, friction=0.2,
                transition_speed=2.0)  # fmt: skip
    state, K, forces = None, [], []
    for kept in (("rope", "other"), ("rope",), ("other",), ()):
        elements = dict(mech.elements)
        for name in {"rope", "other"} - {*kept}:
            del mech.elements[name]
        packed, W = prepared(mech)
        packed.system.markers.twist[:] *= 1e-3
        mech.elements.update(elements)
        state = near(rng, packed, 0.02) if state is None else state
        q, v, a_, lam = state
        tangents_at(packed.system, W, q, v, a_, lam, (0.0, 1.0, 1.0))
        K.append(W.S + W.Kt)
        forces.append(forces_at(packed, W, q, v, a_, lam))
    for both, one, two, none in (K, forces):
        assert_allclose(both - none, one + two - 2 * none, atol=1e-12 * np.abs(both).max())
        assert np.abs(two - none).max() > 1e-3 * np.abs(both).max()


@pytest.mark.parametrize("pulleys", ["none", "one", "pair"])
@pytest.mark.parametrize("kind", KINDS)
def test_tangents_are_derivatives_of_the_forces(kind, pulleys):
    rng = np.random.default_rng(3)
    packed, W = prepared(strung(rng, pulleys, **KINDS[kind]))
    packed.system.markers.twist[:] *= 1e-3
    W.signal[:, 0], W.signal[:, 1] = 8.0, -0.5
    s, state = packed.system, near(rng, packed, 0.02)
    found, C = by_velocity(packed, W, *state)
    assert_allclose(found, C, atol=1e-7 * np.abs(C).max())
    v = state[1]
    for at, r in zip(s.bodies.v_at, s.bodies.r, strict=True):
        v[at + 3 : at + 6 + r] = 0.0  # velocities of markers that do not change with positions
    check_tangents(packed, W, state, np.eye(v.size), 1e-6)


def weight(mech, name, at, mass=1.0, axis=Z):
    """A body that slides along an axis; its marker."""
    return on_guide(mech, name, mass=mass, at=at, base=at, axis=axis, guide=f"{name} slides")


def sizes(solution, name):
    """(n_t, K) size of the force on each marker."""
    return np.linalg.norm(solution.element(name).force, axis=2)


@pytest.mark.parametrize(("sense", "shift"), [(-1, 2.0), (1, 4.0)], ids=["outer", "inner"])
def test_lengths_over_two_pulleys_are_those_of_plane_geometry(sense, shift):
    """Wheels of 3 m and 1 m, 10 m apart: the tangent is sqrt(10^2 - shift^2), shift 3 -+ 1.

    From a point 5 m from the centre of 3 m the tangent is 4 m long, from one at sqrt(2) of 1 m 1 m.
    """
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("far", mass=1.0, inertia=SMALL, at=(0, 0, 50))
    g = mech.ground.marker
    wheels = Pulley(g(ORIGIN), 3.0, (0, 0, -1)), Pulley(g((10, 0, 0)), 1.0, (0, 0, sense))
    path = [g((-5, 0, 0)), *wheels, g((10 + np.sqrt(2), 0, 0))]
    mech.tendon("rope", path, EA=1.0, free_length=1.0)
    up = np.arccos(shift / 10)  # of the radius to the tangent, from the line of centres
    first = np.pi - np.arccos(3 / 5) - up
    second = up - np.pi / 4 if sense == -1 else np.pi - np.pi / 4 - up
    wanted = 4.0 + 3.0 * first + np.sqrt(100 - shift**2) + second + 1.0
    packed, W = prepared(mech)
    stretch = np.sqrt(2 * stored_at(packed.system, W, packed.q, 0 * packed.v))
    assert 1.0 + stretch == pytest.approx(wanted, rel=1e-12)


def test_a_cable_is_as_long_as_its_design_at_the_start():
    """The free length is taken where bodies were added: it begins without tension."""
    rng = np.random.default_rng(8)
    for pulleys in ("none", "one", "pair"):
        mech = strung(rng, pulleys, EA=1e6)
        packed, W = prepared(mech)
        assert stored_at(packed.system, W, packed.q, 0 * packed.v) < 1e-18 * 1e6


def test_masses_over_a_pulley_fall_as_atwood_says():
    mech = rom.Mechanism(gravity=(0, 0, -G))
    a, b = weight(mech, "a", (-0.1, 0, -1.0), 2.0), weight(mech, "b", (0.1, 0, -1.5))
    mech.tendon("rope", [a, Pulley(mech.ground.marker(ORIGIN), 0.1, (0, 1, 0)), b],
                EA=1e6, damping=2e3, pretension=2 * G * 2 / 3)  # fmt: skip
    moved = rom.simulate(mech, t_end=0.5, dt=1e-3, progress=False)
    fallen = moved.position("a")[:, 2] + 1.0
    assert_allclose(fallen, -0.5 * G / 3 * moved.t**2, atol=1e-5)
    assert sizes(moved, "rope")[-1, 0] == pytest.approx(4 / 3 * G, rel=1e-6)
    assert sizes(moved, "rope")[-1, 2] == pytest.approx(4 / 3 * G, rel=1e-6)


@pytest.mark.parametrize("sheave", [0.0, 0.2])
def test_a_sheave_that_the_rope_grips_turns_with_it(sheave):
    """a = (m1 - m2) g / (m1 + m2 + J / R^2)."""
    mech = rom.Mechanism(gravity=(0, 0, -G))
    a, b = weight(mech, "a", (-0.1, 0, -1.0), 2.0), weight(mech, "b", (0.1, 0, -1.5))
    inertia = 0.02
    wheel = on_axle(mech, inertia=(0.02, inertia, 0.02), axis=(0, 1, 0))
    rope = [a, Pulley(wheel, 0.1, (0, 1, 0), friction=sheave), b]
    mech.tendon("rope", rope, EA=1e5, damping=2e3, transition_speed=1e-3, pretension=13.0)
    moved = rom.simulate(mech, t_end=0.5, dt=2e-4, progress=False)
    shared = inertia / 0.1**2 if sheave else 0.0
    wanted = -0.5 * G / (3.0 + shared) * moved.t[-1] ** 2
    assert moved.position("a")[-1, 2] + 1.0 == pytest.approx(wanted, rel=2e-3)
    turned = 0.1 * moved.joint("axle").angle[-1]
    assert turned == pytest.approx(wanted if sheave else 0.0, rel=3e-3, abs=1e-9)


@pytest.mark.parametrize("way", [1, -1])
def test_friction_at_eyelets_is_that_of_euler_and_eytelwein(way):
    """T_end = T_start exp(- way mu (sum of angles)), pulled in or let out."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    g, mu = mech.ground.marker, 0.35
    load = weight(mech, "load", (0.4, 0.2, 0.0))
    mech.drive("pull", "load slides", lambda t: way * 0.1 * t, rate=lambda t: way * 0.1 + 0 * t)
    path = [(-1.0, 0.0, 1.0), *CORNERS]
    mech.tendon("rope", [*map(g, path), load], tension=40.0, friction=mu, transition_speed=1e-4)
    moved = rom.simulate(mech, t_end=0.1, dt=1e-3, progress=False)
    legs = np.diff(np.array([*path, (0.4, 0.2, 0.0)]), axis=0)
    legs /= np.linalg.norm(legs, axis=1)[:, None]
    angle = np.arccos((legs[:-1] * legs[1:]).sum(axis=1)).sum()
    force = sizes(moved, "rope")[-1]
    assert force[0] == pytest.approx(40.0, rel=1e-12)
    assert force[-1] == pytest.approx(40.0 * np.exp(-way * mu * angle), rel=1e-9)
    # the hand at the first end works against the drive, which takes the rest, and friction
    assert moved.energy.forces[-1] == pytest.approx(way * 40.0 * 0.01, rel=1e-6)
    assert np.abs(moved.energy.balance).max() < 1e-6 * 40.0 * 0.01


@pytest.mark.parametrize("turns", [0, 2])
def test_a_turning_drum_shifts_tension_by_its_whole_wrap(turns):
    """The rope stands, the drum slides below it: T2 / T1 = exp(mu theta), torque R (T2 - T1).

    Pieces stretch together as far as before: what the one gains the other loses.
    """
    mech = rom.Mechanism(gravity=(0, 0, 0))
    g, R, mu = mech.ground.marker, 0.2, 0.15
    drum = on_axle(mech, "drum", inertia=(0.02,) * 3)
    mech.drive("speed", "axle", lambda t: 5.0 * t, rate=lambda t: 5.0 + 0 * t)
    wheel = Pulley(drum, R, Z, friction=mu, turns=turns)
    law = {"EA": 1e5, "pretension": 100.0, "transition_speed": 1e-4}
    mech.tendon("rope", [g((-1, -R, 0)), wheel, g((-1, R, 0))], **law)
    moved = rom.simulate(mech, t_end=1.0, dt=1e-2, progress=False)
    slack, taut = sizes(moved, "rope")[-1, [2, 0]]
    theta = np.pi * (1 + 2 * turns)
    assert taut / slack == pytest.approx(np.exp(mu * theta), rel=1e-9)
    assert 0.5 * (taut + slack) == pytest.approx(100.0, rel=1e-9)
    torque = moved.drive_load("speed")[-1]
    assert abs(torque) == pytest.approx(R * (taut - slack), rel=1e-9)
    lost = moved.energy.damping
    assert lost[-1] - lost[-2] == pytest.approx(5.0 * R * (taut - slack) * 1e-2, rel=1e-6)


def tackle(**more):
    """A block on four falls of a rope, the first end at a winch: 12 kg."""
    mech = rom.Mechanism(gravity=(0, 0, -G))
    g, block = mech.ground.marker, weight(mech, "block", (0, 0, -2.0), 12.0)
    y, R = (0, 1, 0), 0.05
    body = mech.parts["block"]
    # falls at x = -3 R, -R, R, 3 R; the rope goes down to the left of each wheel
    path = [g((-3 * R, 0, 0)), Pulley(body.marker((-2 * R, 0, 0)), R, (0, -1, 0)),
            Pulley(g((0, 0, 0)), R, y), Pulley(body.marker((2 * R, 0, 0)), R, (0, -1, 0)),
            g((3 * R, 0, 0))]  # fmt: skip
    mech.tendon("rope", path, **more)
    return mech, block


def test_a_tackle_carries_a_quarter_on_each_fall():
    mech, _ = tackle(EA=1e5)
    state = rom.equilibrium(mech)
    record = rom.snapshot(mech, state).element("rope")
    assert np.linalg.norm(record.force[0, 0]) == pytest.approx(12.0 * G / 4, rel=1e-9)
    # four falls of 2 m and three half turns stretch by T L / EA, the block sinks by a quarter
    L = 8.0 + 3 * np.pi * 0.05
    sunk = -2.0 - rom.snapshot(mech, state).position("block")[0, 2]
    assert sunk == pytest.approx(12 * G / 4 * L / 1e5 / 4, rel=3e-3)


def test_a_winch_lifts_a_tackle_by_a_quarter_of_its_rope():
    L = 8.0 + 3 * np.pi * 0.05
    start = L / (1.0 + 12 * G / 4 / 1e6)
    mech, _ = tackle(EA=1e6, damping=1e4, free_length=lambda t: start - 0.2 * t**2)
    moved = rom.simulate(mech, t_end=1.0, dt=1e-3, progress=False)
    assert_allclose(moved.position("block")[:, 2] + 2.0, 0.05 * moved.t**2, atol=2e-5)
    energy = moved.energy
    assert energy.drives[-1] == pytest.approx(12 * (G * 0.05 + 0.5 * 0.1**2), rel=1e-4)
    assert np.abs(energy.balance).max() < 1e-6 * energy.drives[-1]


def test_a_bead_on_a_taut_string_swings_across_and_slides_along():
    """omega^2 = T (1 / a + 1 / b) / m across, none along."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    g = mech.ground.marker
    bead = mech.add_rigid("bead", mass=0.1, inertia=SMALL, at=(0.3, 0, 0))
    mech.tendon("string", [g(ORIGIN), bead.marker(ORIGIN), g((1, 0, 0))], EA=1e4, pretension=50.0)
    found = rom.linearize(mech).frequencies
    wanted = np.sqrt(50.0 * (1 / 0.3 + 1 / 0.7) / 0.1) / (2 * np.pi)
    assert_allclose(np.sort(found)[-2:], wanted, rtol=1e-9)
    assert np.abs(np.sort(found)[:-2]).max() < 1e-3


def test_what_falls_into_a_slack_cable_stretches_it_by_its_energy():
    """x = m g / k (1 + sqrt(1 + 2 k h / (m g))); it falls freely before, and flies up again."""
    m, h, L, EA = 2.0, 0.5, 1.0, 2e4
    mech = rom.Mechanism(gravity=(0, 0, -G))
    end = weight(mech, "stone", (0, 0, -L + h), m)
    mech.tendon("rope", [mech.ground.marker(ORIGIN), end], EA=EA, free_length=L)
    moved = rom.simulate(mech, t_end=1.0, dt=1e-4, progress=False)
    z, sink = moved.position("stone")[:, 2], m * G / EA
    deepest = sink * (1 + np.sqrt(1 + 2 * h / sink))
    assert z.min() == pytest.approx(-L - deepest, rel=1e-6)
    touched = np.sqrt(2 * h / G)
    free = moved.t < touched
    assert_allclose(z[free], -L + h - 0.5 * G * moved.t[free] ** 2, atol=1e-9)
    assert np.abs(moved.energy.balance).max() < 1e-4 * m * G * h
    assert z[moved.t > 1.5 * touched].max() > -L + 0.9 * h
    assert (moved.element("rope").along >= 0).all()


def test_free_bodies_on_a_cable_with_friction_keep_their_momentum_and_lose_what_rubs():
    rng = np.random.default_rng(5)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    parts = [
        mech.add_rigid(f"b{k}", mass=1.0 + k, inertia=(0.2, 0.3, 0.4), at=at,
                       velocity=0.3 * rng.normal(size=3), omega=0.3 * rng.normal(size=3))
        for k, at in enumerate([(0, 0, 0), (1, 0.3, 0), (2, 0, 0.4), (3, 0.2, 0)])
    ]  # fmt: skip
    a, b, c, d = (p.marker((0.05, 0.02, 0.1)) for p in parts)
    wheel = Pulley(b, 0.1, (0, 0.1, 1), friction=0.2)
    mech.tendon("rope", [a, wheel, c, d], EA=500.0, damping=5.0, pretension=5.0, friction=0.3,
                transition_speed=0.05)  # fmt: skip
    # at the ends of steps: within the one in which the rope goes slack, work is interpolated badly
    moved = rom.simulate(mech, t_end=1.0, method="dop853", rtol=1e-10, progress=False)
    for kind in moved.momentum:
        assert np.ptp(kind, axis=0).max() < 1e-9
    lost = np.diff(moved.energy.damping)
    assert (lost > -1e-8 * lost.sum()).all() and lost.sum() > 0.1
    assert np.abs(moved.energy.balance).max() < 1e-7


def test_a_cable_that_leaves_its_pulley_is_named():
    """The end swings around until the cable is straight beside the wheel."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    g = mech.ground.marker
    end = weight(mech, "end", (1.0, -0.1, 0.0), axis=(0, 1, 0))
    mech.drive("move", "end slides", lambda t: t, rate=lambda t: 1.0 + 0 * t)
    mech.tendon("rope", [g((-1, 0, 0)), Pulley(g(ORIGIN), 0.2, (0, 0, -1)), end], EA=1.0)
    with pytest.raises(SolverError, match="path of 'rope' is lost: it has left a pulley") as told:
        rom.simulate(mech, t_end=1.0, dt=1e-2, progress=False)
    # it is straight where the end is on the tangent from (-1, 0)
    reached = 0.1 + np.tan(np.arcsin(0.2)) * 2.0
    assert told.value.solution.t[-1] == pytest.approx(reached, abs=0.011)


def place(mech, *x):
    return mech.ground.marker(x)


def wheel(mech, x=0.0, radius=0.2, axis=Z, **more):
    return Pulley(place(mech, x, 0.0, 0.0), radius, axis, **more)


def route(*middle):
    return lambda m: [place(m, -1.0, 0.0, 0.0), *(f(m) for f in middle), place(m, 1.0, 0.0, 0.0)]


STRAIGHT = route()
WRONG = [  # path, numbers, what is said
    (lambda m: [place(m, 0, 0, 0)], {"EA": 1.0}, "needs at least two places, got 1"),
    (lambda m: [], {"EA": 1.0}, "got 0"),
    (lambda m: ["ground", rom.mbs.Marker("far", ORIGIN)], {"EA": 1.0}, "no body 'far'"),
    (lambda m: [place(m, 0, 0, 0), wheel(m, 1.0)], {"EA": 1.0}, "ends at a pulley"),
    (route(lambda m: place(m, 1.0, 0.0, 0.0)), {"EA": 1.0}, "places 2 and 3 .* are at one point"),
    (route(lambda m: wheel(m, 0.9)), {"EA": 1.0}, "no room"),
    (route(wheel, lambda m: wheel(m, 0.3, axis=(0, 0, -1))), {"EA": 1.0}, "no room"),
    (route(wheel, lambda m: wheel(m, 0.6, axis=(0, 1, 1))), {"EA": 1.0},
     "45 degrees apart"),
    (route(lambda m: wheel(m, axis=(0, 0, 0))), {"EA": 1.0}, "of rope has length zero"),
    (route(lambda m: wheel(m, friction=0.1)), {"EA": 1.0}, "has friction, but no transition_speed"),
    (STRAIGHT, {}, "exactly one of EA and tension"),
    (STRAIGHT, {"EA": 1.0, "tension": 1.0}, "exactly one of EA and tension"),
    (STRAIGHT, {"EA": 1.0, "pretension": 1.0, "free_length": 1.0}, "pretension or free_length,"),
    (STRAIGHT, {"EA": 1.0, "free_length": 0.0}, "free_length"),
    (STRAIGHT, {"tension": -1.0}, "tension of tendon 'rope' = -1"),
    (STRAIGHT, {"tension": 1.0, "free_length": 1.0}, "does not stretch"),
]  # fmt: skip


@pytest.mark.parametrize(("path", "numbers", "said"), WRONG)
def test_what_is_no_cable_is_refused(path, numbers, said):
    mech = rom.Mechanism()
    refuses(ConfigError, said, lambda: mech.tendon("rope", path(mech), **numbers))
    assert not mech.tendons


def test_much_friction_is_doubted():
    mech = rom.Mechanism()
    with pytest.warns(RomWarning, match="coefficient of friction of .*'rope' is 30"):
        mech.tendon("rope", route(lambda m: place(m, 0.0, 1.0, 0.0))(mech), EA=1.0, friction=30.0,
                    transition_speed=1.0)  # fmt: skip


def test_a_winch_that_takes_in_all_of_its_cable_is_named():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    end = weight(mech, "end", (1.0, 0, 0), axis=(1, 0, 0))
    mech.drive("hold", "end slides", lambda t: 0.0 * t)
    mech.tendon("rope", [mech.ground.marker(ORIGIN), end], EA=1e3, free_length=lambda t: 0.35 - t)
    with pytest.raises(SolverError, match=r"path of 'rope' is lost.*a winch took it all"):
        rom.simulate(mech, t_end=1.0, dt=1e-1, progress=False)
