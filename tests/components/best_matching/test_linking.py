"""The extended system: brackets of its constraints, and its gauges against Newton's motion."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.refusals import refuses
from rom.components import best_matching
from rom.components.best_matching import Bodies, Extended, Linking
from rom.errors import ConfigError, ModelError, SolverError

MASS = np.array([1.0, 1.5, 2.0, 0.7, 1.2])
THREE = np.array([1.0, 1.5, 2.0])
X0 = np.array([(1, 0.2, 0), (-0.7, 0.5, 0), (0.1, -0.9, 0)])
START = X0, np.array([(0.3, -0.5, 0), (0.2, 0.6, 0), (-0.4, 0.1, 0)])


def started(mass, degree, seed=4):
    """Bodies in space, E = P = L = 0, far from close encounters."""
    rng, bodies = np.random.default_rng(seed), Bodies(mass, degree)
    x, v = rng.normal(size=(2, len(mass), 3))
    x = 1.5 * x + 3 * np.eye(len(mass), 3)
    return bodies, *bodies.at_rest_as_a_whole(x, v + 0.8 * x)


@pytest.fixture(scope="module", params=[-1.0, -0.6])
def five(request):
    bodies, x, v = started(MASS, request.param)
    linking = Linking(bodies)
    t = np.linspace(0, 2, 21)
    return linking, linking.state(x, v), t, bodies.move(x, v, t)


def unflat(y):
    n = len(y) // 2
    return Extended(y[: n - 1].reshape(-1, 3), y[n : 2 * n - 1].reshape(-1, 3), y[n - 1], y[-1])


def gradient(f, state):
    y, h = np.r_[state.x.ravel(), state.phi, state.p.ravel(), state.pi], 1e-5
    steps = h * np.eye(len(y))
    return np.array([f(unflat(y + e)) - f(unflat(y - e)) for e in steps]) / (2 * h)


def bracket(f, g, state):
    a, b = gradient(f, state), gradient(g, state)
    n = len(a) // 2
    return a[:n] @ b[n:] - a[n:] @ b[:n]


@pytest.mark.parametrize("degree", [-1.0, -0.6])
def test_constraints_are_first_class_also_off_their_surface(degree):
    """{H, Q} = 0, and both commute with momentum and angular momentum, at points without H = 0."""
    rng = np.random.default_rng(0)
    linking = Linking(Bodies(MASS, degree))
    state = Extended(rng.normal(size=(5, 3)), rng.normal(size=(5, 3)), 0.3, -0.8)
    state = replace(state, x=state.x - MASS @ state.x / MASS.sum())
    H, Q = linking.energy_constraint, linking.size_constraint
    assert abs(H(state)) > 1
    assert abs(bracket(H, Q, state)) < 1e-7
    assert abs(bracket(H, lambda s: s.pi, state)) > 1
    assert abs(bracket(lambda s: s.phi, Q, state) - 1) < 1e-7
    for a in range(3):
        turn = lambda s, a=a: np.cross(s.x, s.p).sum(axis=0)[a]  # noqa: E731
        assert abs(bracket(H, turn, state)) < 1e-7
        assert abs(bracket(Q, turn, state)) < 1e-7


def test_rates_are_brackets_with_the_constraints(five):
    linking, state, _, _ = five
    state = state.scaled(0.4)
    N, growth = 0.7, -0.3

    def total(s):
        return N * linking.energy_constraint(s) + growth * linking.size_constraint(s)

    d = gradient(total, state)
    n = len(d) // 2
    y = np.concatenate([state.x.ravel(), state.p.ravel(), [state.phi, state.pi, 0.0]])
    found = linking._rates(y, lambda *_: (N, growth))
    expected = np.concatenate([d[n:-1], -d[: n - 1], [d[-1], -d[n - 1], N]])
    assert_allclose(found, expected, atol=1e-7)


def test_phi_zero_is_newton_whatever_the_scale(five):
    linking, state, t, (x, v) = five
    found = linking.move(state, best_matching.newton_gauge, t)
    assert_allclose(found.x, x, atol=1e-9)
    assert_allclose(found.p, MASS[:, None] * v, atol=1e-9)
    assert_allclose(found.time, t, atol=1e-12)
    assert not found.phi.any()
    growth = [linking.bodies.growth(*s) for s in zip(x, v, strict=True)]
    assert_allclose(found.pi, growth, atol=1e-9)
    other = state.scaled(-0.7)
    assert linking.energy_constraint(other) == pytest.approx(0, abs=1e-9)
    assert linking.size_constraint(other) == pytest.approx(0, abs=1e-9)
    assert_allclose(np.exp(other.phi) * other.x, state.x, rtol=1e-14)
    assert_allclose(other.scaled(0.0).p, state.p, rtol=1e-13)


def test_pi_as_clock_is_newton_without_size(five):
    linking, state, t, (x, v) = five
    clock = np.array([linking.bodies.growth(*s) for s in zip(x, v, strict=True)])
    small = state.scaled(np.log(np.sqrt(linking.bodies.size(state.x))))
    found = linking.move(small, best_matching.shape_gauge, clock)
    assert_allclose(found.pi, clock, atol=1e-10)
    assert_allclose([linking.bodies.size(y) for y in found.x], 1.0, atol=1e-10)
    assert_allclose(np.exp(found.phi), np.sqrt([linking.bodies.size(y) for y in x]), rtol=1e-9)
    newton = found.scaled(0.0)
    assert_allclose(newton.time, t, atol=1e-9)
    assert_allclose(newton.x, x, atol=1e-9)
    assert_allclose(newton.p, MASS[:, None] * v, atol=1e-9)


def test_any_other_gauge_is_the_same_motion(five):
    linking, state, _, (x, v) = five
    found = linking.move(state, lambda _, s: (np.exp(s.phi), 0.4 - s.phi), np.linspace(0, 1.3, 14))
    newton = found.scaled(0.0)
    bodies = linking.bodies
    there = bodies.move(x[0], v[0], newton.time)
    assert newton.time[-1] > 1.3 and found.phi[-1] > 0.1
    assert_allclose(newton.x, there[0], atol=1e-9)
    assert_allclose(newton.p, MASS[:, None] * there[1], atol=1e-9)
    each = [Extended(*s) for s in zip(found.x, found.p, found.phi, found.pi, strict=True)]
    assert np.abs([linking.energy_constraint(s) for s in each]).max() < 1e-9
    assert np.abs([linking.size_constraint(s) for s in each]).max() < 1e-9


def test_the_hamiltonian_of_shapes_makes_the_same_shapes(five):
    linking, state, _, (x, v) = five
    clock = np.array([linking.bodies.growth(*s) for s in zip(x, v, strict=True)])
    alone, momenta = linking.move_shapes(*linking.shapes(state), clock)
    R = np.sqrt([linking.bodies.size(y) for y in x])
    assert_allclose(alone, x / R[:, None, None], atol=1e-9)
    expected = linking.shapes(Extended(x, MASS[:, None] * v, 0 * R, clock))[1]
    assert_allclose(momenta, expected, atol=1e-9)
    scale = [linking.scale(*s) for s in zip(alone, momenta, clock, strict=True)]
    assert_allclose(np.exp(scale), R, rtol=1e-9)


def test_the_dividing_point_is_passed_and_three_bodies_agree_with_the_sphere():
    """From t = -6 to 6 through smallest size, where the clock is zero; R = 7.104722808 at t = 3."""
    bodies = Bodies(THREE)
    x, v = bodies.at_rest_as_a_whole(*START)
    early = bodies.move(x, v, np.array([0.0, -6.0]))
    t = np.linspace(-6, 6, 121)
    x, v = bodies.move(early[0][-1], early[1][-1], t)
    linking, sphere = Linking(bodies), best_matching.ShapeSphere(bodies)
    clock = np.array([bodies.growth(*s) for s in zip(x, v, strict=True)])
    start = Extended(x[0], THREE[:, None] * v[0], 0.0, clock[0], t[0])
    found = linking.move(start, best_matching.shape_gauge, clock)
    newton = found.scaled(0.0)
    assert np.interp(0.0, found.pi, newton.time) == pytest.approx(-0.569365, abs=2e-3)
    assert_allclose(newton.time, t, atol=2e-9)
    assert np.sqrt(bodies.size(newton.x[90])) == pytest.approx(7.104722808, rel=1e-9)
    n, p = sphere.shape(x[0]), sphere.momentum(x[0], v[0])
    shapes = np.array([sphere.shape(y) for y in found.x])
    assert_allclose(shapes, sphere.move(n, p, clock)[0], atol=1e-9)


def test_what_has_a_size_a_frame_or_no_clock_is_refused():
    bodies, x, v = started(MASS, -1.0)
    linking = Linking(bodies)
    refuses(ConfigError, "degree = -2", lambda: Linking(Bodies(MASS, -2.0)))
    refuses(ConfigError, "bodies", linking.state, x[:3], v[:3])
    refuses(ModelError, "'energy'", linking.state, x, 1.1 * v)
    refuses(ModelError, "'momentum'", linking.state, x, v + np.array([0.1, 0, 0]))
    refuses(ModelError, "'angular momentum'", linking.state, x, v + np.cross([0, 0, 0.1], x))
    refuses(ModelError, "size", linking.move_shapes, 2 * x, v, np.arange(2.0))
    shape = x / np.sqrt(bodies.size(x))
    refuses(ModelError, "growth", linking.move_shapes, shape, x, np.arange(2.0))
    two, x = Linking(Bodies(np.ones(2))), np.array([(1.0, 0, 0), (-1, 0, 0)])
    falling = two.state(*two.bodies.at_rest_as_a_whole(x, -x))
    errors, gauge = (SolverError, ModelError), best_matching.newton_gauge
    refuses(errors, "same place|too close", two.move, falling, gauge, np.array([0.0, 5.0]))
