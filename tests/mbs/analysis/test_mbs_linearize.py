"""Small motions around states: closed forms at rest and in rotation."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import rom
from cases.beam import FLAP, FLAP_ON_HUB, stiffened_beam
from cases.mbs.mechanisms import random_body, rotor
from cases.mbs.parts import ORIGIN, X, Y, Z, below, on_axle, on_guide, on_hinge
from cases.mbs.trusses import HUB_INERTIA, MASS, REST, SPRING, dumbbell
from cases.refusals import refuses
from rom.mbs.analysis.few_modes import modes
from rom.mbs.analysis.linearize import linearize
from rom.mbs.analysis.local_equations import difference, instant
from rom.mbs.integrate.consistent_start import initial_state

g, TINY = 9.81, (1e-12, 1e-12, 1e-12)


def pendulum(length=0.7, angle=0.0, inertia=TINY):
    mech = rom.Mechanism(gravity=(0, 0, -g))
    on_hinge(mech, below(angle, length), inertia=inertia)
    return mech


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 2, 2.5])
def test_a_pendulum_let_go_varies_by_the_cosine_of_its_angle(angle):
    """The bob accelerates: K = m g L cos / (m L^2 + J), which is negative in the upper half."""
    found = linearize(pendulum(angle=angle, inertia=(0.1, 0.3, 0.3)))
    stiffness = 2.0 * g * 0.7 * np.cos(angle) / (2.0 * 0.7**2 + 0.3)
    assert_allclose(found.K, [[stiffness]], rtol=1e-8, atol=1e-8)
    turn, way = found.shapes[4, 0], np.cross(Y, below(angle, 0.7))
    assert_allclose(found.shapes[:, 0], turn * np.array([*way, 0, 1, 0]), atol=1e-9)
    if angle != np.pi / 2:
        assert found.stable == (angle < 2)
        assert_allclose(found.eigenvalues, [np.sqrt(complex(-stiffness))], rtol=1e-8)


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")  # the stiffness changes on the way
@pytest.mark.parametrize("rate", [0.0, 2.5])
def test_a_ladder_slides_down_its_walls(rate):
    """Its joints turn the free motion in its own axes: J x'' = m g L / 2 cos x, J = m L^2 / 3."""
    length, m, angle = 1.2, 3.0, 0.9
    foot, top = length * np.array([np.cos(angle), 0, 0]), length * np.array([0, 0, np.sin(angle)])
    mech = rom.Mechanism(gravity=(0, 0, -g))
    motion = {"omega": rate * Y, "velocity": rate / 2 * np.array([-top[2], 0, foot[0]])}
    solid = {"mass": m, "inertia": (0.2, m * length**2 / 12, 0.2)}
    rod = mech.add_rigid("rod", **solid, at=(foot + top) / 2, **motion)
    corner, low = mech.ground.marker(ORIGIN), rod.marker((foot - top) / 2)
    mech.planar("room", corner, low, normal=Y)
    mech.point_on_plane("floor", corner, low, normal=Z)
    mech.point_on_plane("wall", corner, rod.marker((top - foot) / 2), normal=X)
    found = rom.linearize(mech)
    assert_allclose(found.K, [[-1.5 * g / length * np.sin(angle)]], rtol=1e-6)
    assert_allclose(found.C, 0.0, atol=2e-5)


def test_eigenvalues_of_matrices_without_symmetry():
    rng = np.random.default_rng(0)
    C, K = rng.normal(size=(4, 4)), 3 * rng.normal(size=(4, 4)) + 9 * np.eye(4)
    roots, V, every = modes(C, K, 1e-7)
    for root, v in zip(roots, V.T, strict=True):
        assert np.abs((root**2 * np.eye(4) + root * C + K) @ v).max() < 1e-12 * abs(root) ** 2
        assert np.abs(every - root).min() < 1e-12
    assert np.all(np.diff(roots.imag) >= 0) and np.all(roots.imag >= 0)


def test_double_pendulum():
    """omega^2 = (g / L)(2 -+ sqrt 2) for equal masses and lengths; shapes 1 : +-sqrt 2."""
    length, mech = 0.5, rom.Mechanism(gravity=(0, 0, -g))
    last = mech.ground.marker(ORIGIN)
    for k in (1, 2):
        bob = mech.add_rigid(f"bob {k}", mass=1.5, inertia=TINY, at=-k * length * Z)
        mech.revolute(f"hinge {k}", last, bob.marker(length * Z), axis=Y)
        last = bob.marker(ORIGIN)
    found = linearize(mech)
    squares = g / length * np.array([2 - np.sqrt(2), 2 + np.sqrt(2)])
    assert_allclose((2 * np.pi * found.frequencies) ** 2, squares, rtol=1e-8)
    ratio = found.shapes[10] / found.shapes[4]
    assert_allclose(ratio, [np.sqrt(2), -np.sqrt(2)], rtol=1e-8)
    assert found.shapes[6, 0] > 0 and found.shapes[10, 1] > 0  # the largest part is positive
    mass = np.diag(([1.5] * 3 + [1e-12] * 3) * 2)
    assert_allclose(found.shapes.T @ mass @ found.shapes, np.eye(2), atol=1e-8)


def chain(n=3, *, mass=2.0, stiffness=50.0, damping=0.0, held=True):
    """Masses on a rail along x, joined by springs; the first one to the ground."""
    mech = rom.Mechanism(gravity=(0, 0, -g))
    last = mech.ground.marker(ORIGIN)
    for k in range(n):
        hook = on_guide(mech, f"cart {k}", mass=mass, at=(k + 1.0, 0, 0), guide=f"rail {k}")
        if k or held:
            mech.spring_damper(f"spring {k}", last, hook, stiffness=stiffness, damping=damping)
        last = hook
    return mech


def test_chains_held_and_free():
    """omega = 2 sqrt(k / m) sin(...): one end held, or both free with the motion of the whole."""
    k = np.arange(3)
    held = 2 * np.sqrt(25.0) * np.sin((2 * k + 1) * np.pi / 14)
    assert_allclose(2 * np.pi * linearize(chain()).frequencies, held, rtol=1e-8)
    free, rates = linearize(chain(held=False)), 2 * np.sqrt(25.0) * np.sin(k * np.pi / 6)
    assert free.frequencies[0] == 0.0 and free.damping_ratios[0] == 0.0
    assert_allclose(2 * np.pi * free.frequencies, rates, rtol=1e-8)


@pytest.mark.parametrize("c", [3.0, 40.0])
def test_one_damped_mass(c):
    """lambda = -delta +- sqrt(delta^2 - k / m): swings, or creeps with frequency zero."""
    found, delta = linearize(chain(1, damping=c)), c / 4
    root = -delta + np.sqrt(complex(delta**2 - 25.0))
    assert_allclose(found.eigenvalues, [root], rtol=1e-9)
    assert_allclose(found.damping_ratios, [-root.real / abs(root)], rtol=1e-9)
    assert_allclose(2 * np.pi * found.frequencies, [root.imag], atol=1e-9)
    assert found.stable


def clamped(body, **pose):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    beam = mech.add_flexible("beam", body, **pose)
    root = beam.marker("root")
    mech.fixed("clamp", mech.ground.marker(mech.design_point(root)), root)
    return mech


@pytest.mark.once
def test_a_clamped_flexible_body_has_its_clamped_frequencies():
    body = stiffened_beam(3.0, 2.0, 0.4, n_modes=8)
    exact = body.frequencies(fixed=("root",))
    turned = {"at": (1, 2, 3), "orientation": (0.5, 0.5, -0.1, 0.7)}
    for one in (body, body.with_reference("mean-axis")):
        assert_allclose(linearize(clamped(one, **turned)).frequencies, exact, rtol=1e-8)


def turning_beam(eta, axis, hub=0.0):
    """The beam on the rim of a hub that is driven with the speed eta."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    turn = eta * np.array(axis, dtype=float)
    at = np.array([hub, 0, 0])
    motion = {"velocity": np.cross(turn, at), "omega": turn}
    mech.add_flexible("beam", stiffened_beam(), at=at, **motion)
    on_axle(mech, "hub", inertia=(1, 1, 1), omega=turn, axis=axis)
    mech.fixed("clamp", mech.part("hub").marker(at), "beam.root")
    mech.drive("motor", "axle", lambda t: eta * t, rate=lambda t: eta, acceleration=lambda t: 0)
    return mech


@pytest.mark.parametrize("eta", [1, 5, 12])
def test_a_turning_beam_has_southwells_frequencies(eta):
    """The mechanism knows nothing of rotating frames: centrifugal terms come out of its motion."""
    flap = 2 * np.pi * linearize(turning_beam(eta, Y)).frequencies
    assert_allclose(flap[:4], FLAP[eta], rtol=2e-5)
    lag = 2 * np.pi * linearize(turning_beam(eta, Z)).frequencies
    assert_allclose(lag**2, flap**2 - eta**2, rtol=1e-8)


def test_a_turning_beam_on_a_hub_as_long_as_itself():
    for eta, exact in FLAP_ON_HUB.items():
        flap = 2 * np.pi * linearize(turning_beam(eta, Y, hub=1.0)).frequencies
        assert_allclose(flap[:2], exact, rtol=5e-6)


@pytest.mark.parametrize("speed", [0.0, 20.0, 300.0])
def test_a_disc_that_spins_splits_its_tilt_into_forward_and_backward_whirl(speed):
    """omega = sqrt(k / A + (C W / 2 A)^2) +- C W / 2 A in the axes of the bearing."""
    found = linearize(rotor(speed, kx=400.0, ky=400.0), frame="world")
    half, mean = 0.5 * 0.5 * speed / 0.3, np.sqrt(400.0 / 0.3 + (0.5 * 0.5 * speed / 0.3) ** 2)
    exact = [0.0, mean - half, mean + half]
    assert_allclose(2 * np.pi * found.frequencies, exact, rtol=2e-6)
    assert found.stable
    if speed:
        tip = next(m for m in found.packed.markers if m.place == "tip")
        tilt = found.motion(tip)[:2] @ found.vectors[:, 1:]
        assert_allclose(tilt[1] / tilt[0], [1j, -1j], atol=1e-4)  # backward, then forward


def test_coefficients_that_change_with_time_are_noticed():
    """The same disc in its own axes, where the unequal springs go round."""
    with pytest.warns(rom.RomWarning, match="change with time"):
        linearize(rotor(20.0))
    with warnings.catch_warnings(action="error"):
        linearize(rotor(20.0), frame="world")
        linearize(turning_beam(5, Z, hub=1.0))


def swinging_arm(seed=0, **pose):
    """A random stiffened body on a ball joint, held by a spring: every term of the tangent."""
    rng = np.random.default_rng(seed)
    mech = rom.Mechanism(gravity=(0.03, -0.3, 0.1))
    arm = mech.add_flexible("arm", random_body(rng, stiffened=True), **pose)
    a, b = arm.marker("a"), arm.marker("b")
    mech.spherical("ball", mech.ground.marker(mech.design_point(a)), a)
    mech.spring_damper("rope", mech.ground.marker((2, 1, 0)), b, stiffness=3.0, free_length=1.0)
    mech.force("pull", b, (0.1, 0.2, 0.3), frame="body")
    return mech


def test_stiffness_is_the_change_of_the_forces_of_neighbours_at_rest():
    """Second method: reactionless forces at closed neighbouring positions, by differences."""
    mech = swinging_arm()
    state = rom.equilibrium(mech)
    found, now = rom.linearize(mech, state), instant(mech, 0.0)
    assert np.abs(found.C - found.basis.T @ now.matrices(state)[1] @ found.basis).max() < 1e-9

    def acceleration(y):
        q = now.shifted(state.q, found.basis @ y)
        for _ in range(4):  # back onto the joints
            gap, G, _ = now.gradient(q, state.v)
            q = now.shifted(q, -np.linalg.pinv(G) @ gap)
        return initial_state(replace(now.packed, q=q, v=0 * state.v)).a

    step = np.full(len(found.K), 1e-5)
    change = difference(acceleration, step)
    M = now.gradient(state.q, state.v)[2]
    assert_allclose(-found.basis.T @ M @ change, found.K, atol=2e-6 * np.abs(found.K).max())


def test_exact_tangents_and_differences_agree():
    """For a moving body whose marker does not turn by deformation; both ways are in use."""
    mech = swinging_arm(1, omega=(1.0, -2.0, 0.5))
    now = instant(mech, 0.0)
    now.packed.system.markers.twist[:] = 0.0
    now.packed.system.markers.bend[:, 3:] = 0.0
    rng = np.random.default_rng(3)
    state = initial_state(now.packed, assemble=True)
    state = replace(state, a=rng.normal(size=10), v=rng.normal(size=10), lam=rng.normal(size=3))
    assert now.exact(state)

    def residual(dq):
        return now.residual(now.shifted(state.q, dq), state.v, state.a, state.lam)

    K, by_differences = now.matrices(state)[2], difference(residual, now.probe())
    assert_allclose(K, by_differences, atol=1e-7 * np.abs(by_differences).max())


def test_states_that_do_not_fit_are_named():
    mech = pendulum()
    good = initial_state(instant(mech, 0.0).packed)
    open_ = replace(good, q=good.q + 0.01 * np.eye(7)[2])
    torn = replace(good, v=good.v + 0.1 * np.eye(6)[0])
    stranger = mech.parts["bob"].marker((1, 2, 3))
    refuses(rom.ModelError, "'hinge' stays open by 0.0143", linearize, mech, open_)
    refuses(rom.ModelError, "'hinge' contradicts the velocities", linearize, mech, torn)
    refuses(rom.ConfigError, "this mechanism has 21, 18 and 15", linearize, chain(held=True), good)
    refuses(rom.ConfigError, "frame: no body", linearize, mech, good, frame={"bib": "world"})
    refuses(rom.ConfigError, "is none of 'body', 'world'", linearize, mech, good, frame="hub")
    refuses(rom.ConfigError, "is not a marker", linearize(mech, good).motion, stranger)


def test_a_state_of_a_run_is_good_enough():
    """A free top in the middle of its motion; the spin of a free body has no stiffness."""
    mech = rotor(20.0, kx=400.0, ky=400.0)
    sol = rom.simulate(mech, t_end=0.05, dt=1e-3)
    found = rom.linearize(mech, sol.final, frame="world")
    assert_allclose(found.frequencies, rom.linearize(mech, frame="world").frequencies, rtol=1e-6)


def test_a_wheel_that_rolls_is_linearised_at_rest_only():
    mech = rom.Mechanism(gravity=(0, 0, -g))
    mech.add_rigid("wheel", mass=1.0, inertia=(1, 1, 1), at=Z / 2)
    mech.rolling("road", "ground", "wheel", radius=0.5, normal=Z)
    mech.spring_damper("rope", mech.ground.marker((2, 0, 0.5)), "wheel", stiffness=80.0)
    swing = 2 * np.pi * rom.linearize(mech).frequencies
    assert_allclose(swing[-1], np.sqrt(80.0 / (1.0 + 1.0 / 0.25)), rtol=1e-8)
    assert_allclose(swing[:-1], 0.0)


def dry_pendulum(angle, rate):
    """A pendulum under way whose hinge rubs by its load, with a damper to the ground."""
    mech, at = rom.Mechanism(gravity=(0, 0, -g)), below(angle, 0.7)
    moving = {"omega": (0, -rate, 0), "velocity": np.cross((0, -rate, 0), at)}
    on_hinge(mech, at, inertia=(0.3, 0.2, 0.3), **moving)
    mech.friction("rub", "hinge", transition_speed=2.0, mu=0.4, radius=0.1, coulomb=0.3)
    law = {"stiffness": 9.0, "damping": 4.0, "free_length": 0.8}
    mech.spring_damper("rope", mech.ground.marker((1, 0, -1)), "bob", **law)
    return mech


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")  # it swings, its coefficients change
@pytest.mark.parametrize(("angle", "rate"), [(0.5, 0.0), (0.5, 1.5), (2.0, -3.0)])
def test_friction_by_load_and_dampers_of_a_moving_pendulum(angle, rate):
    """Second method: how its angular acceleration changes with angle and rate."""

    def acceleration(x):
        packed = instant(dry_pendulum(angle + x[0], rate + x[1]), 0.0).packed
        return -initial_state(packed).a[4:5]

    found = rom.linearize(dry_pendulum(angle, rate))
    exact = -difference(acceleration, np.full(2, 1e-5))
    assert_allclose(np.r_[found.K[0], found.C[0]], exact[0], rtol=2e-6)


@pytest.mark.parametrize("speed", [50.0, 150.0])
def test_a_sleeping_top_stands_if_it_spins_fast_enough(speed):
    """A w^2 - C W w + m g l = 0: two precessions, or growth below W = sqrt(4 A m g l) / C."""
    m, length, A, C = 2.0, 0.3, 0.05 + 2.0 * 0.09, 0.04
    mech = rom.Mechanism(gravity=(0, 0, -g))
    solid = {"mass": m, "inertia": (0.05, 0.05, C)}
    top = mech.add_rigid("top", **solid, at=length * Z, omega=speed * Z)
    mech.spherical("foot", mech.ground.marker(ORIGIN), top.marker(-length * Z))
    found = rom.linearize(mech, frame="world")
    roots = np.roots([A, -C * speed, m * g * length])
    assert found.stable == (speed > 100)
    assert found.stable == (abs(roots.imag).max() == 0)
    assert_allclose(2 * np.pi * found.frequencies[1:], np.sort(roots.real), rtol=1e-6)
    assert_allclose(-found.damping_ratios.min(), abs(roots.imag).max() / abs(roots[0]), atol=1e-6)


def column_frequency(P):
    """Lowest root of w'''' + P w'' = omega^2 w, clamped; no moment and no side force at the tip."""

    def boundary(omega):
        root = np.sqrt(P**2 / 4 + omega**2)
        a, b = np.sqrt(root + P / 2), np.sqrt(root - P / 2)
        C, S, c, s = np.cosh(b), np.sinh(b), np.cos(a), np.sin(a)
        moment = b**2 * C + a**2 * c, b**2 * S + a * b * s
        force = b**3 * S - a**3 * s + P * (b * S + a * s), b**3 * C + a**2 * b * c
        force = force[0], force[1] + P * (b * C - b * c)
        return moment[0] * force[1] - moment[1] * force[0]

    return brentq(boundary, 0.1, 8.0)


@pytest.mark.parametrize("share", [-0.9, 0.5, 3.0])
def test_the_frequency_of_a_loaded_column(share):
    """Dead load at the tip, in Euler's loads, tension positive."""
    load, mech = share * np.pi**2 / 4, clamped(stiffened_beam())
    mech.force("load", mech.parts["beam"].marker("tip"), (load, 0, 0))
    found = rom.linearize(mech, rom.equilibrium(mech))
    assert_allclose(2 * np.pi * found.frequencies[0], column_frequency(-load), rtol=5e-5)


def test_beyond_eulers_load_the_straight_column_is_unstable():
    mech = clamped(stiffened_beam(n_modes=6))
    mech.force("load", mech.parts["beam"].marker("tip"), (-1.01 * np.pi**2 / 4, 0, 0))
    with pytest.warns(rom.RomWarning, match="unstable: body 'beam' deforms and"):
        state = rom.equilibrium(mech)
    assert not rom.linearize(mech, state).stable


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")  # inertia changes on the way
def test_coordinates_of_unit_mass_follow_a_body_that_pulsates():
    """Inertia J(s) of a dumbbell under way: C = 0, K = -(sqrt J)'' / sqrt J where it tumbles."""
    stretch, speed = 0.12, 1.7
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("bell", dumbbell(), q=[stretch], qd=[speed])
    found = rom.linearize(mech)
    s, square = REST + stretch, 2 * SPRING / MASS
    J = 2 * MASS * s**2 + HUB_INERTIA / np.array([2, 1])
    first, second = 4 * MASS * s * speed, 4 * MASS * (speed**2 - s * square * stretch)
    tumbling = -(second / (2 * J) - first**2 / (4 * J**2))
    assert_allclose(found.C, 0.0, atol=1e-4)
    assert_allclose(found.K, found.K.T, atol=1e-2)
    assert_allclose(np.linalg.eigvals(found.K).real.max(), square, rtol=1e-6)
    others = np.sort(np.linalg.eigvals(found.K).real)[-3:-1]
    assert_allclose(others, np.sort(tumbling), rtol=1e-4)
