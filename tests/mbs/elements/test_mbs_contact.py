"""Contact of simple shapes, capsules and surfaces against closed forms and quadrature."""

from dataclasses import replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose
from scipy.integrate import quad, solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize
from scipy.special import gamma

import rom
from cases.mbs import tangents
from cases.mbs.mechanisms import prepared, random_state, stored_at, two_soft
from cases.mbs.parts import X, Y, Z, boxed, refused_on
from cases.refusals import refuses
from cases.solid import block, reduced
from rom import rotation
from rom.mbs.elements.contact import points
from rom.mbs.elements.contact.impact import Impact, damping_of, hertz_stiffness
from rom.mbs.elements.contact.points import across_of, nearest
from rom.mbs.parts.bodies import Marker, surface_place

TILTED = np.array([1.0, 2.0, 2.0]) / 3
g = 9.81
CAPSULES, INSIDE = {"radius1": 7.0, "radius2": 5.0, "axis1": TILTED, "axis2": X}, {"inside": True}
KINDS = {  # of which capsules touch along them, and where both end
    "plane": ("sphere_on_plane", {"normal": TILTED, "radius": 9.0}),
    "disc": ("disc_on_plane", {"normal": TILTED, "axis": X, "radius": 15.0}),
    "sphere": ("sphere_on_sphere", {"radius1": 7.0, "radius2": 5.0}),
    "cylinder": ("sphere_on_cylinder", {"axis": TILTED, "radius1": 9.0, "radius2": 6.0}),
    "bore": ("sphere_on_cylinder", {"axis": TILTED, "radius1": 0.4, "radius2": 0.3} | INSIDE),
    "capsules": ("capsule_on_capsule", CAPSULES | {"length1": 40.0, "length2": 30.0}),
    "ends": ("capsule_on_capsule", CAPSULES | {"length1": 0.5, "length2": 0.3}),
}
BRISTLES = {"slides": {}, "holds": {"tangential_stiffness": 0.5, "tangential_damping": 0.05},
            "slips": {"tangential_stiffness": 5e3, "tangential_damping": 0.05}}  # fmt: skip
SIZE = (0.4, 0.3, 0.2)
WEIGHT = 7850.0 * 0.4 * 0.3 * 0.2 * g
LAW = Impact(stiffness=4e8, exponent=1.0, damping=20.0, mu=0.3, transition_speed=1e-3)


def random_contact(kind, law):
    rng = np.random.default_rng(5)
    mech, one, two = two_soft(rng, damped=False)
    method, shape = KINDS[kind]
    getattr(mech, method)("c", one.marker("a"), two.marker("b"), law, **shape)
    packed, W = prepared(mech)
    packed.system.markers.twist[:] *= 1e-3
    q, v, a, lam = random_state(rng, packed)
    assert stored_at(packed.system, W, q, v) > 0.0
    return packed, W, (q, v, a, lam)


@pytest.mark.parametrize("kind", KINDS)
def test_forces_without_loss_are_the_gradient_of_the_energy(kind):
    packed, W, (q, _, _, lam) = random_contact(kind, Impact(3.0))
    stiffness = packed.elements[points.CONTACTS_FAMILY].law[:, 0]
    gradient, found = tangents.elastic_forces(packed, W, q, stiffness, lam)
    assert np.abs(gradient).max() > 0.1
    assert_allclose(found, gradient, atol=2e-7 * np.abs(gradient).max())


@pytest.mark.parametrize("how", BRISTLES)
@pytest.mark.parametrize("kind", KINDS)
def test_tangents_are_derivatives_of_the_forces(kind, how):
    """With friction and damping; the velocity of the markers is held in the position block."""
    law = Impact(3.0, damping=0.02, mu=0.4, transition_speed=0.5, **BRISTLES[how])
    packed, W, (q, v, a, lam) = random_contact(kind, law)
    tangents.forces_at(packed, W, q, v, a, lam)
    W.base[:] = W.fresh  # it touched there before
    q = tangents.shifted(packed, q, 0.01 * np.random.default_rng(7).normal(size=v.size))
    found, C = tangents.by_velocity(packed, W, q, v, a, lam)
    assert_allclose(found, C, atol=1e-7 * np.abs(C).max())
    v[:] = 0.0  # then nothing is left out
    found, K = tangents.by_position(packed, W, q, v, a, lam, 1e-6)
    assert_allclose(found, K, atol=1e-6 * np.abs(K).max())


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_lost_is_what_the_forces_take(kind):
    """Power of the contact on all bodies = - rate of its energy - power lost."""
    law = Impact(3.0, damping=0.02, mu=0.4, transition_speed=0.5)
    packed, W, (q, v, a, lam) = random_contact(kind, law)
    s = packed.system
    rate = tangents.difference(
        lambda t: np.array([stored_at(s, W, tangents.shifted(packed, q, t * v), v)]), 1
    )[0, 0]
    force, lost = tangents.forces_at(packed, W, q, v, a, lam), W.power[2]
    packed.elements[points.CONTACTS_FAMILY].law[:, 0] = 0.0
    force, lost = tangents.forces_at(packed, W, q, v, a, lam) - force, lost - W.power[2]
    assert lost > 0.0
    assert_allclose(force @ v, -rate - lost, rtol=1e-6)


def ball(law, height=0.5, radius=0.1, mass=2.0, **more):
    mech = rom.Mechanism(gravity=(0, 0, -g))
    J = 0.4 * mass * radius**2
    mech.add_rigid("ball", mass=mass, inertia=(J, J, J), at=(0, 0, height + radius), **more)
    mech.sphere_on_plane("floor", "ground", "ball", law, normal=Z, radius=radius)
    return mech


def test_one_instant_of_a_spinning_ball_that_comes_down():
    """Force k depth^1.5 (1 + damping v) upwards, friction against the lowest point."""
    k, chi, mu, v, spin, depth, radius = 1e6, 0.3, 0.2, 0.5, 4.0, 1e-3, 0.1
    law = Impact(k, damping=chi, mu=mu, transition_speed=1e-9)
    mech = ball(law, height=-depth, velocity=(0, 0, -v), omega=(0, spin, 0))
    packed, W = prepared(mech)
    found = -tangents.forces_at(packed, W, packed.q, packed.v)
    normal = k * depth**1.5 * (1 + chi * v)
    force = np.array([mu * normal, 0, normal])
    moment = np.cross([0, 0, -radius], force)
    found[2] += 2.0 * g
    assert_allclose(found, [*force, *moment], rtol=1e-9, atol=1e-9)
    lost = chi * v * k * depth**1.5 * v + mu * normal * spin * radius
    assert_allclose(W.power[2], lost, rtol=1e-9)


def test_a_sphere_of_hertz_is_in_touch_for_the_time_of_the_closed_form():
    """T = 2.9433 depth / v, depth = (5 m v^2 / 4 k)^(2/5): 3.2181 (m^2 / k^2 v)^(1/5)."""
    radius, m, v = 0.05, 4.0, 0.8
    k = hertz_stiffness(2e11, 0.3, 2e11, 0.3, radius)
    assert_allclose(k, 4 / 3 * np.sqrt(radius) * 2e11 / (2 * 0.91), rtol=1e-12)
    number = 2 * np.sqrt(np.pi) * gamma(7 / 5) / gamma(9 / 10)
    assert_allclose(number, 2 * quad(lambda x: 1 / np.sqrt(1 - x**2.5), 0, 1)[0], rtol=1e-8)
    assert_allclose(number, 2.943275, rtol=1e-6)  # also in specifications of rockfall
    deepest = (5 * m * v**2 / (4 * k)) ** 0.4
    time = number * deepest / v
    assert_allclose(time, 3.218066 * (m**2 / (k**2 * v)) ** 0.2, rtol=1e-5)
    mech = ball(Impact(k), height=1e-6, radius=radius, mass=m, velocity=(0, 0, -v))
    mech.gravity = np.zeros(3)
    sol = rom.simulate(mech, t_end=2 * time, dt=time / 400, method="dop853")
    depth = radius - sol.position("ball")[:, 2]
    assert_allclose(depth.max(), deepest, rtol=1e-4)
    touched_and_left = CubicSpline(sol.t, depth).roots(extrapolate=False)
    assert_allclose(np.diff(touched_and_left), [time], rtol=1e-3)
    assert_allclose(sol.velocity("ball")[-1, 2], v, rtol=1e-8)
    implicit = rom.simulate(mech, t_end=2 * time, dt=time / 400)
    assert_allclose(implicit.velocity("ball")[-1, 2], v, rtol=1e-4)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("e", [0.95, 0.7, 0.3])
def test_damping_gives_the_restitution_asked_for(e, exponent):
    """Against the equation of the impact, integrated by itself; whatever exponent and stiffness."""
    v0, k, m = 1.3, 4e5, 0.7
    chi = damping_of(e, v0)

    def fall(t, y):
        return y[1], -k / m * max(y[0], 0.0) ** exponent * max(1 + chi * y[1], 0.0)

    def leaves(t, y):
        return y[0] + 1e-12

    leaves.terminal, leaves.direction = True, -1
    out = solve_ivp(fall, (0, 1), (0, v0), events=leaves, rtol=1e-11, atol=1e-14).y[1, -1]
    assert_allclose(-out / v0, e, rtol=1e-6)


def test_little_loss_is_that_of_hunt_and_crossley():
    """E = 1 - (2 / 3) damping v, their relation alpha = (2 / 3) damping for e near one."""
    for loss in (1e-2, 1e-3):
        assert_allclose(damping_of(1 - loss, 2.0) * 2.0, 1.5 * loss, rtol=1.1 * loss)
    assert damping_of(1.0, 2.0) == 0.0


@pytest.mark.parametrize("method", ["generalized-alpha", "dop853"])
def test_a_bouncing_ball_returns_to_the_height_of_its_restitution(method):
    height, e = 0.5, 0.7
    v0 = np.sqrt(2 * g * height)
    mech = ball(Impact(1e7, restitution=e, impact_speed=v0), height=height)
    flight = np.sqrt(2 * height / g) * (1 + e)
    step = 1e-4 if method == "generalized-alpha" else 1e-3
    sol = rom.simulate(mech, t_end=flight, dt=step, method=method)
    top = sol.position("ball")[sol.t > 0.4, 2].max() - 0.1
    assert_allclose(top, e**2 * height, rtol=1.5e-2)  # gravity acts in the contact as well
    lost = sol.energy.damping[-1] / (2.0 * g * height)
    assert_allclose(lost, 1 - e**2, rtol=1.5e-2)
    if method == "dop853":
        assert np.abs(sol.energy.balance).max() < 1e-8 * sol.energy.kinetic.max()


def test_a_sliding_ball_rolls_in_the_end_with_five_sevenths_of_its_speed():
    """It slides for 2 v0 / (7 mu g), whatever the law of friction did meanwhile."""
    mu, v0 = 0.2, 2.0
    law = Impact(1e6, damping=1.0, mu=mu, transition_speed=1e-3)
    sink = (2.0 * g / 1e6) ** (2 / 3)
    mech = ball(law, height=-sink, velocity=(v0, 0, 0))
    slides = 2 * v0 / (7 * mu * g)
    sol = rom.simulate(mech, t_end=1.5 * slides, dt=2e-4)
    v, w = sol.velocity("ball")[:, 0], sol.omega("ball")[:, 1]
    assert_allclose(v[-1], 5 / 7 * v0, rtol=2e-3)
    assert_allclose(v[-1], 0.1 * w[-1], rtol=1e-2)
    assert_allclose(np.interp(0.5 * slides, sol.t, v), v0 - 0.5 * mu * g * slides, rtol=1e-3)
    assert_allclose(sol.energy.damping[-1], 0.5 * 2.0 * v0**2 * 2 / 7, rtol=3e-3)
    assert rom.audit(sol).ok, rom.audit(sol)


def test_a_ball_slides_to_and_fro_in_a_bore_like_a_pendulum():
    """Without friction the arm of the pendulum is the clearance; small swings."""
    R, r, k = 0.5, 0.2, 1e9
    mech = rom.Mechanism(gravity=(0, 0, -g))
    a = 1e-3
    sink = (g / k) ** (2 / 3)
    arm = R - r + sink
    at, sizes = (0, arm * np.sin(a), -arm * np.cos(a)), {"radius1": R, "radius2": r}
    mech.add_rigid("ball", mass=1.0, inertia=(1e-2,) * 3, at=at)
    mech.sphere_on_cylinder("bore", "ground", "ball", Impact(k), axis=X, **sizes, **INSIDE)
    sol = rom.simulate(mech, t_end=1.0, dt=1e-3)
    wanted = arm * a * np.cos(np.sqrt(g / arm) * sol.t)
    assert_allclose(sol.position("ball")[:, 1], wanted, atol=1e-3 * arm * a)


def test_two_discs_are_a_cylinder_that_rolls_down_a_slope():
    """Acceleration 2/3 g sin when friction suffices; the rims share the weight."""
    angle, radius = 0.2, 0.1
    mech = rom.Mechanism(gravity=(g * np.sin(angle), 0, -g * np.cos(angle)))
    sink = 0.5 * 2.0 * g * np.cos(angle) / 1e5
    ends = {"left": (0, 0.2, 0), "right": (0, -0.2, 0)}
    inertia = (0.03, 0.5 * 2.0 * radius**2, 0.03)
    mech.add_rigid("roller", mass=2.0, inertia=inertia, at=(0, 0, radius - sink), markers=ends)
    law = Impact(1e5, exponent=1.0, damping=5.0, mu=0.5, transition_speed=1e-2)
    for end in ends:
        mech.disc_on_plane(end, "ground", f"roller.{end}", law, normal=Z, axis=Y, radius=radius)
    sol = rom.simulate(mech, t_end=1.0, dt=1e-3)
    a = 2 / 3 * g * np.sin(angle)
    assert_allclose(sol.velocity("roller")[-1, 0], a, rtol=2e-3)
    assert_allclose(sol.position("roller")[-1, 2], radius - sink, atol=1e-6)
    assert rom.audit(sol).ok, rom.audit(sol)


test_wrong_contacts_are_refused_by_name = refused_on(boxed, {
    "no axis": (lambda m, a, b: m.disc_on_plane("s", a, b, Impact(1), normal=Z, axis=0 * Z,
                                                radius=1), "axis of s"),
    "too large": (lambda m, a, b: m.sphere_on_cylinder("s", a, b, Impact(1), axis=Z, radius1=1,
                                                       radius2=1, inside=True), "must be smaller"),
    "itself": (lambda m, a, b: m.sphere_on_sphere("s", b, b, Impact(1), radius1=1, radius2=1),
               "with itself"),
    "no capsule": (lambda m, a, b: m.capsule_on_capsule("s", a, b, Impact(1), radius1=1, radius2=1,
                                                        length1=2), "length1 = 2 m without axis1"),
    "crossing": (lambda m, a, b: m.capsule_on_capsule("s", a, b, Impact(1), radius1=1, radius2=1),
                 "the axes cross"),
    "soft": (lambda m, a, b: hertz_stiffness(0, 0.3, 1, 0.3, 1), "E1 = 0"),
    "gas": (lambda m, a, b: hertz_stiffness(1, 0.6, 1, 0.3, 1), "nu1 = 0.6"),
})  # fmt: skip


@njit
def touched(gap, e, s, half_i, half_j):
    """Places along both, vector between them, and from the middle of the second."""
    return nearest(gap, e, s, half_i, half_j), across_of(gap, e, s, half_i, half_j)


def test_nearest_points_are_those_of_a_search():
    """Bounded minimisation of the distance by another program, from the middles."""
    rng, ends = np.random.default_rng(3), 0
    for _ in range(60):
        gap, *axes = rng.normal(size=(3, 3))
        gap, (e, s) = 2.0 * gap, (axis / np.linalg.norm(axis) for axis in axes)
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
    mech = rom.Mechanism(gravity=(0, 0, -g))
    motion = {"at": (x, 0, 0.15 - depth), "velocity": velocity}
    mech.add_rigid("bar", mass=mass, inertia=(1e6,) * 3, **motion)
    mech.capsule_on_capsule("c", "ground", "bar", law, radius1=0.1, radius2=0.05, axis1=X, axis2=Y,
                            length1=4.0, length2=1.0)  # fmt: skip
    return mech


def test_a_bar_that_slides_along_another_is_slowed_by_coulomb():
    mu, v, k = 0.3, 1.0, 1e5
    law = Impact(k, exponent=1.0, mu=mu, transition_speed=1e-3)
    mech = crossing(law, x=-0.5, depth=g / k, velocity=(v, 0, 0))
    sol = rom.simulate(mech, t_end=0.5, dt=1e-3)
    stop = v / (mu * g)
    moving = sol.t < 0.95 * stop
    assert_allclose(sol.velocity("bar")[moving, 0], v - mu * g * sol.t[moving], atol=1e-3)
    assert_allclose(sol.position("bar")[-1, 0], -0.5 + v**2 / (2 * mu * g), atol=5e-4)
    force = sol.element("c").force
    assert_allclose(force[:, 0], -force[:, 1], atol=1e-12)
    assert_allclose(force[-1, 1, 2], g, rtol=1e-9)
    assert rom.audit(sol).ok, rom.audit(sol)


@pytest.mark.parametrize("kind", ["sphere_on_sphere", "capsule_on_capsule"])
def test_balls_of_steel_meet_as_hertz_says(kind):
    """Deepest penetration and duration: Johnson, Contact Mechanics (1985), 11.22 to 11.24."""
    E, nu, R, m, v = 210e9, 0.3, 0.02, 0.26, 0.5
    k = hertz_stiffness(E, nu, E, nu, R / 2)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for name, x, u in (("one", 0, v), ("two", 2 * R + 1e-6, 0)):
        mech.add_rigid(name, mass=m, inertia=(1e-5,) * 3, at=(x, 0, 0), velocity=(u, 0, 0))
    getattr(mech, kind)("c", "one", "two", Impact(k, mu=0.0), radius1=R, radius2=R)
    sol = rom.simulate(mech, t_end=2e-4, dt=1e-7, method="dop853")
    depth = 2 * R - (sol.position("two") - sol.position("one"))[:, 0]
    deepest = (15 * (m / 2) * v**2 / (16 * np.sqrt(R / 2) * (E / (1 - nu**2) / 2))) ** 0.4
    assert_allclose(depth.max(), deepest, rtol=1e-4)
    assert_allclose(np.ptp(sol.t[depth > 0]), 2.943 * deepest / v, rtol=5e-3)
    assert_allclose(sol.velocity("one")[-1], 0.0, atol=1e-8)
    assert_allclose(sol.velocity("two")[-1], v * X, atol=1e-8)
    assert rom.audit(sol).ok, rom.audit(sol)


def test_momentum_and_energy_of_capsules_that_meet_in_space():
    mech = rom.Mechanism(gravity=(0, 0, 0))
    law = Impact(1e5, damping=0.3, mu=0.4, transition_speed=1e-2)
    mech.add_rigid("one", mass=1.0, inertia=(1e-2, 1e-2, 1e-3), at=(0, 0, 0))
    mech.add_rigid("two", mass=0.5, inertia=(1e-3, 5e-3, 5e-3), at=(0.05, 0.2, 0.1),
                   velocity=(0.3, -2.0, 0.2), omega=(0, 1.0, 0))  # fmt: skip
    mech.capsule_on_capsule("c", "one", "two", law, radius1=0.05, radius2=0.04, axis1=Z, axis2=X,
                            length1=0.5, length2=0.3)  # fmt: skip
    sol = rom.simulate(mech, t_end=0.2, dt=1e-4, method="dop853")
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
    mech = rom.Mechanism(gravity=(0, 0, -g))
    depth = N / k
    mech.add_rigid("bar", mass=weight / g, inertia=(1.0,) * 3, at=(0, 0, 0))
    for side in (-1, 1):
        jaw = mech.ground.marker((0, side * (2 * radius - depth), 0))
        mech.capsule_on_capsule(f"jaw {side}", jaw, "bar", law, radius1=radius, radius2=radius,
                                axis1=X, axis2=Z, length1=0.4, length2=4.0)  # fmt: skip
    sol = rom.simulate(mech, t_end=0.1, dt=2e-4, rho_inf=0.5)
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


def below(points):
    return points[:, 2] < 1e-9


@pytest.fixture(scope="module")
def brick():
    return reduced(2, block(size=SIZE, cells=(3, 2, 2)))


def on_floor(brick, law=LAW, **start):
    mech = rom.Mechanism(gravity=(0, 0, -g))
    part = mech.add_flexible("brick", brick, **start)
    mech.surface_on_plane("floor", "ground", part, law, normal=(0, 0, 1), where=below)
    return mech, part


def at_point(sol, k):
    """(n_t, 3) position of a point of the surface."""
    return sol.position("brick", Marker("brick", surface_place(int(k))))


def guide(mech, part):
    """Let one end go up and down only."""
    place = mech.design_point(part.marker("root"))
    mech.prismatic("guide", mech.ground.marker(place), part.marker("root"), axis=(0, 0, 1))


def test_the_areas_of_the_points_are_those_of_the_face(brick):
    areas = brick.surface_areas(below)
    assert_allclose(areas.sum(), 0.4 * 0.3)
    assert (brick.surface.points[areas > 0, 2] < 1e-9).all()
    assert_allclose(brick.surface_areas().sum(), 2 * (0.12 + 0.08 + 0.06))


def test_points_of_the_surface_move_with_its_shapes(brick):
    rng = np.random.default_rng(4)
    q = 1e-3 * rng.normal(size=brick.n_modes)
    mech, _ = on_floor(brick, at=(0.1, 0, 1.0), orientation=(0.6, 0, 0.8, 0), q=q)
    sol = rom.simulate(mech, t_end=1e-6, dt=1e-6)
    bent = brick.surface.points + (brick.surface.shape @ q).reshape(-1, 3)
    wanted = [0.1, 0, 1.0] + bent @ rotation.matrix([0.6, 0, 0.8, 0]).T
    for k in np.flatnonzero(brick.surface_areas(below)):
        assert_allclose(at_point(sol, k)[0], wanted[k], atol=1e-12)


def test_a_brick_sinks_into_its_foundation_by_its_weight(brick):
    """A steel brick on a soft foundation stays flat: depth W / (k A) everywhere."""
    mech, part = on_floor(brick)
    guide(mech, part)
    state = rom.equilibrium(mech)
    sol = rom.simulate(mech, t_end=1e-3, dt=1e-4, state=state)
    depth = WEIGHT / (4e8 * 0.12)
    for k in np.flatnonzero(brick.surface_areas(below)):
        assert_allclose(at_point(sol, k)[:, 2], -depth, rtol=0.02)
    load = sol.interface_loads("ground")[(0.0, 0.0, 0.0)]
    assert_allclose(load[0, 2], -WEIGHT, rtol=1e-9)
    assert_allclose(sol.v, 0, atol=1e-9)


def test_a_sliding_brick_slows_down_by_friction(brick):
    """Deceleration mu g while it slides, whatever the share of each point."""
    mech, part = on_floor(brick)
    guide(mech, part)
    q = rom.equilibrium(mech).q
    mech, _ = on_floor(brick, at=q[:3], orientation=q[3:7], q=q[7:], velocity=(1.0, 0, 0))
    sol = rom.simulate(mech, t_end=0.1, dt=5e-4, rho_inf=0.5)
    speed = sol.velocity("brick", "root")[:, 0]
    assert_allclose(np.polyfit(sol.t, speed, 1)[0], -0.3 * g, rtol=0.01)
    load = sol.interface_loads("ground")[(0.0, 0.0, 0.0)]
    assert_allclose(load[:, 0].mean(), 0.3 * WEIGHT, rtol=0.01)
    lost = sol.energy.damping[-1]
    assert_allclose(lost, 0.5 * WEIGHT / g * (1 - speed[-1] ** 2), rtol=0.01)


def test_a_brick_pushed_along_the_floor_rests_by_springs_per_area(brick):
    """Their way, averaged over the area, is F / (k_t A), however it tilts."""
    mech, part = on_floor(brick)
    guide(mech, part)
    q, F = rom.equilibrium(mech).q, 0.1 * WEIGHT
    law = replace(LAW, tangential_stiffness=2e8, tangential_damping=1e6)
    mech, part = on_floor(brick, law, at=q[:3], orientation=q[3:7], q=q[7:])
    mech.force("push", part.marker("root"), (F, 0.0, 0.0))
    areas, start = brick.surface_areas(below), rom.simulate(mech, t_end=1e-9, dt=1e-9)
    found = rom.snapshot(mech, rom.equilibrium(mech))
    way = sum(
        areas[k] * (at_point(sol, k)[0, 0] * sign)
        for sol, sign in ((found, 1), (start, -1)) for k in np.flatnonzero(areas)
    ) / areas.sum()  # fmt: skip
    assert_allclose(way, F / (2e8 * 0.12), rtol=1e-4)
    dropped = rom.simulate(mech, t_end=0.1, dt=5e-4, rho_inf=0.5)
    assert_allclose(dropped.velocity("brick")[-1], 0.0, atol=1e-6)


def test_what_sticks_stores_the_energy_of_its_spring():
    """Without damping nothing is lost: work of the push, motion and spring balance."""
    law = Impact(stiffness=1e6, exponent=1.0, mu=0.5, tangential_stiffness=2e4)
    mech, r = rom.Mechanism(gravity=(0, 0, -g)), 0.1
    mech.add_rigid("ball", mass=1.0, inertia=(1, 1, 1), at=(0, 0, r - g / 1e6))
    mech.sphere_on_plane("floor", "ground", "ball", law, radius=r, normal=Z)
    mech.force("push", "ball", (2.0, 0, 0))
    energy = rom.simulate(mech, t_end=0.05, dt=1e-4).energy
    assert energy.kinetic.max() > 1e-4
    assert_allclose(energy.balance, 0, atol=1e-7)


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "bore"])
def test_a_round_thing_presses_as_the_sum_over_the_points(brick, kind):
    """Against the sum of k a_i depth_i^1.5 along the normals, from the positions alone."""
    mech = rom.Mechanism(gravity=(0, 0, -g))
    part = mech.add_flexible("brick", brick)
    guide(mech, part)
    law = Impact(stiffness=5e9, exponent=1.5)
    radius, centre = 1.0, np.array([0.2, 0.15, -0.97])
    if kind == "bore":
        centre = np.array([0.2, 0.15, 0.98])
    m1, axis = mech.ground.marker(tuple(centre)), np.array([0, 1.0, 0])
    if kind == "sphere":
        mech.surface_on_sphere("round", m1, part, law, radius=radius, where=below)
    else:
        inside = {"axis": axis, "inside": kind == "bore"}
        mech.surface_on_cylinder("round", m1, part, law, radius=radius, where=below, **inside)
    state = rom.equilibrium(mech)
    sol = rom.simulate(mech, t_end=1e-5, dt=1e-5, state=state)
    areas, total = brick.surface_areas(below), np.zeros(3)
    for k in np.flatnonzero(areas):
        at = at_point(sol, k)[0] - centre
        across = at if kind == "sphere" else at - axis * at[1]
        far = np.linalg.norm(across)
        depth = max(radius - far if kind != "bore" else far - radius, 0.0)
        sign = -1 if kind == "bore" else 1
        total += sign * 5e9 * areas[k] * depth**1.5 * across / far
    load = sol.interface_loads("ground")[tuple(centre)]
    assert_allclose(load[0, :3], -total, rtol=1e-8, atol=1e-8 * WEIGHT)
    assert_allclose(total[2], WEIGHT, rtol=1e-8)


def test_messages(brick):
    mech, part = on_floor(brick)
    floor = mech.ground.marker((0, 0, 0))
    box = mech.add_rigid("box", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))
    add, ball = mech.surface_on_sphere, {"law": LAW, "radius": 1.0}
    refuses(rom.ConfigError, "used twice", add, "floor", floor, part, **ball)
    refuses(rom.ConfigError, "body 'box' is rigid, it has no surface", add, "x", floor, box, **ball)
    refuses(rom.ConfigError, "with itself", add, "x", part.marker("root"), part, **ball)
    refuses(rom.ConfigError, "is flexible; use its markers", part.marker, (0.0, 0.0, 0.0))
    bare = rom.Mechanism()
    bald = bare.add_flexible("brick", replace(brick, surface=None))
    refuses(rom.ModelError, "carries no surface", bare.surface_on_sphere, "x", floor, bald, **ball)
