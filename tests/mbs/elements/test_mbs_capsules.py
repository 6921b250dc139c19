"""Contact of capsules: where they are nearest, and closed forms of rest, friction and impact."""

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose
from scipy.optimize import minimize

from rom.mbs.elements.contact.impact import Impact, hertz_stiffness
from rom.mbs.elements.contact.points import across_of, nearest
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.audit import audit

X, Y, Z = np.eye(3)
g = 9.81


@njit
def touched(gap, e, s, half_i, half_j):
    """Places along both, vector between them, and from the middle of the second."""
    return nearest(gap, e, s, half_i, half_j), across_of(gap, e, s, half_i, half_j)


def unit(x):
    return x / np.linalg.norm(x)


def test_nearest_points_are_those_of_a_search():
    """Bounded minimisation of the distance by another program, from the middles."""
    rng, ends = np.random.default_rng(3), 0
    for _ in range(60):
        gap, e, s = 2.0 * rng.normal(size=3), unit(rng.normal(size=3)), unit(rng.normal(size=3))
        half = rng.uniform(0.2, 2.0, 2)

        def square(x, gap=gap, e=e, s=s):
            d = gap + x[1] * s - x[0] * e
            return d @ d

        found = minimize(square, np.zeros(2), bounds=[(-h, h) for h in half], tol=1e-14)
        (a, b), found_there = touched(*(tuple(x.tolist()) for x in (gap, e, s)), *half)
        d, out = map(np.array, found_there)
        assert_allclose(d @ d, found.fun, rtol=1e-7, atol=1e-10)
        assert_allclose(out, b * s)
        ends += (abs(a) == half[0]) + (abs(b) == half[1])
    assert 20 < ends < 100


@pytest.mark.parametrize(("way", "place"), [(0.0, 0.0), (1.5, 0.75), (-1.5, -0.75), (5.0, 1.0)])
def test_parallel_capsules_touch_in_the_middle_of_where_they_are_side_by_side(way, place):
    (a, b), _ = touched((way, 0.3, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0, 1.0)
    assert_allclose([a, way + b], [place, place if way < 4 else way - 1.0])


def crossing(law, *, mass=1.0, x=0.0, depth=0.0, velocity=(0, 0, 0)):
    """A bar along y, which hardly turns, on a fixed bar along x."""
    mech = Mechanism(gravity=(0, 0, -g))
    bar = mech.add_rigid("bar", mass=mass, inertia=(1e6,) * 3, at=(x, 0, 0.15 - depth),
                         velocity=velocity)  # fmt: skip
    mech.capsule_on_capsule("c", mech.ground.marker((0, 0, 0)), bar.marker((0, 0, 0)), law,
                            radius1=0.1, radius2=0.05, axis1=X, axis2=Y, length1=4.0,
                            length2=1.0)  # fmt: skip
    return mech


def test_a_bar_that_slides_along_another_is_slowed_by_coulomb():
    mu, v, k = 0.3, 1.0, 1e5
    law = Impact(k, exponent=1.0, mu=mu, transition_speed=1e-3)
    mech = crossing(law, x=-0.5, depth=g / k, velocity=(v, 0, 0))
    sol = simulate(mech, t_end=0.5, dt=1e-3)
    stop = v / (mu * g)
    moving = sol.t < 0.95 * stop
    assert_allclose(sol.velocity("bar")[moving, 0], v - mu * g * sol.t[moving], atol=1e-3)
    assert_allclose(sol.position("bar")[-1, 0], -0.5 + v**2 / (2 * mu * g), atol=5e-4)
    force = sol.element("c").force
    assert_allclose(force[:, 0], -force[:, 1], atol=1e-12)
    assert_allclose(force[-1, 1, 2], g, rtol=1e-9)
    assert audit(sol).ok, audit(sol)


def test_a_bar_at_rest_on_another_sinks_by_the_law():
    k = 1e6
    mech = crossing(Impact(k), depth=(g / k) ** (2 / 3))
    sol = simulate(mech, t_end=0.1, dt=1e-3)
    assert_allclose(sol.position("bar")[:, 2], 0.15 - (g / k) ** (2 / 3), atol=1e-12)


def test_balls_of_steel_meet_as_hertz_says():
    """Deepest penetration and duration of an impact; momenta before and after.

    Source: Johnson, Contact Mechanics (1985), equations 11.22 to 11.24.
    """
    E, nu, R, m, v = 210e9, 0.3, 0.02, 0.26, 0.5
    k = hertz_stiffness(E, nu, E, nu, R / 2)
    mech = Mechanism(gravity=(0, 0, 0))
    law = Impact(k, mu=0.0)
    gap = 1e-6
    one, two = (
        mech.add_rigid(name, mass=m, inertia=(1e-5,) * 3, at=at, velocity=(u, 0, 0))
        for name, at, u in (("one", (0, 0, 0), v), ("two", (2 * R + gap, 0, 0), 0.0))
    )
    mech.capsule_on_capsule("c", one.marker((0, 0, 0)), two.marker((0, 0, 0)), law, radius1=R,
                            radius2=R)  # fmt: skip
    sol = simulate(mech, t_end=2e-4, dt=1e-7, method="dop853")
    depth = 2 * R - (sol.position("two") - sol.position("one"))[:, 0]
    deepest = (15 * (m / 2) * v**2 / (16 * np.sqrt(R / 2) * (E / (1 - nu**2) / 2))) ** 0.4
    assert_allclose(depth.max(), deepest, rtol=1e-4)
    assert_allclose(np.ptp(sol.t[depth > 0]), 2.943 * deepest / v, rtol=5e-3)
    assert_allclose([sol.velocity("one")[-1, 0], sol.velocity("two")[-1, 0]], [0, v], atol=1e-7)


def test_momentum_and_energy_of_capsules_that_meet_in_space():
    """Oblique, with friction and loss: both momenta stay, the energy goes where it is booked."""
    mech = Mechanism(gravity=(0, 0, 0))
    law = Impact(1e5, damping=0.3, mu=0.4, transition_speed=1e-2)
    one = mech.add_rigid("one", mass=1.0, inertia=(1e-2, 1e-2, 1e-3), at=(0, 0, 0))
    two = mech.add_rigid("two", mass=0.5, inertia=(1e-3, 5e-3, 5e-3), at=(0.05, 0.2, 0.1),
                         velocity=(0.3, -2.0, 0.2), omega=(0, 1.0, 0))  # fmt: skip
    mech.capsule_on_capsule("c", one.marker((0, 0, 0)), two.marker((0, 0, 0)), law, radius1=0.05,
                            radius2=0.04, axis1=Z, axis2=X, length1=0.5, length2=0.3)  # fmt: skip
    sol = simulate(mech, t_end=0.2, dt=1e-4, method="dop853")
    linear, angular = sol.momentum
    assert np.ptp(sol.velocity("one")[:, 1]) > 0.3
    assert_allclose(linear - linear[0], 0, atol=1e-10)
    assert_allclose(angular - angular[0], 0, atol=1e-10)
    assert sol.energy.damping[-1] > 1e-2
    assert_allclose(sol.energy.balance, 0, atol=1e-6)


@pytest.mark.parametrize("share", [0.3, 0.9, 1.5])
def test_a_clamped_bar_creeps_or_slips_as_the_law_says(share):
    """Between two jaws: weight = share of the limit; creep v0 r / sqrt(1 - r^2), or falling."""
    N, mu, v0 = 20.0, 0.5, 1e-2
    weight = share * 2 * mu * N
    k, radius = 1e5, 0.05
    law = Impact(k, exponent=1.0, mu=mu, transition_speed=v0)
    mech = Mechanism(gravity=(0, 0, -g))
    depth = N / k
    bar = mech.add_rigid("bar", mass=weight / g, inertia=(1.0,) * 3, at=(0, 0, 0))
    for side in (-1, 1):
        jaw = mech.ground.marker((0, side * (2 * radius - depth), 0))
        mech.capsule_on_capsule(f"jaw {side}", jaw, bar.marker((0, 0, 0)), law, radius1=radius,
                                radius2=radius, axis1=X, axis2=Z, length1=0.4,
                                length2=4.0)  # fmt: skip
    sol = simulate(mech, t_end=0.1, dt=2e-4, rho_inf=0.5)
    v = sol.velocity("bar")[:, 2]
    if share < 1.0:
        assert_allclose(v[-1], -v0 * share / np.sqrt(1 - share**2), rtol=1e-4)
    else:
        late = sol.t > 0.05
        fall = -np.diff(v[late]).mean() / 2e-4
        assert_allclose(fall, g * (1 - 1 / share), rtol=3e-3)
    for jaw in ("jaw -1", "jaw 1"):
        force = sol.element(jaw).force[-1, 1]
        assert_allclose(abs(force[1]), N, rtol=1e-6)
        assert_allclose(force[2], min(weight / 2, mu * N), rtol=1e-3)
