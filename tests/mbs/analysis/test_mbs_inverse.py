"""Loads of prescribed and simulated motions against closed forms and the rate of momentum."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

import rom
from cases.mbs.mechanisms import crank_torque, slider_crank
from cases.mbs.motions import swing
from cases.mbs.parts import X, Z, on_hinge, slender
from cases.refusals import refuses
from rom.errors import ConfigError, ModelError

G = 9.81
SPEED = 50.0


def driven_pendulum(mass=2.0, reach=0.4, inertia=0.1):
    """A bar on a hinge about z, driven as 0.8 sin 3t from the x axis."""
    mech = rom.Mechanism(gravity=(0, -G, 0))
    on_hinge(mech, reach * X, "bar", mass=mass, inertia=(0.01, inertia, inertia), axis=Z)
    mech.drive("motor", "hinge", lambda t: 0.8 * np.sin(3 * t))
    return mech


def test_a_driven_pendulum_needs_the_torque_of_its_equation():
    """Torque (I + m c^2) theta'' + m g c cos theta; hinge force m (a - g)."""
    t = np.linspace(0, 2, 81)
    sol = rom.inverse_dynamics(driven_pendulum(), t)
    angle, rate, pull = 0.8 * np.sin(3 * t), 2.4 * np.cos(3 * t), -7.2 * np.sin(3 * t)
    torque = (0.1 + 2.0 * 0.4**2) * pull + 2.0 * G * 0.4 * np.cos(angle)
    assert_allclose(sol.drive_load("motor"), torque, atol=1e-5)
    along = np.column_stack([np.cos(angle), np.sin(angle)])
    across = np.column_stack([-np.sin(angle), np.cos(angle)])
    a = 0.4 * (pull[:, None] * across - rate[:, None] ** 2 * along)
    assert_allclose(sol.reaction("hinge")[:, :2], 2.0 * (a + np.array([0, G])), atol=1e-5)
    assert_allclose(sol.omega("bar")[:, 2], rate, atol=1e-6)


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
def test_a_slider_crank_needs_the_torque_of_lagranges_equation():
    t = np.linspace(0, 0.15, 61)
    sol = rom.inverse_dynamics(slider_crank(speed=SPEED, gravity=G), t)
    wanted = crank_torque(SPEED * t, speed=SPEED, gravity=G)
    assert np.ptp(wanted) > 10.0
    assert_allclose(sol.drive_load("motor"), wanted, atol=1e-9 * np.abs(wanted).max())
    assert_allclose(sol.reaction("motor")[:, 5], wanted, atol=1e-9 * np.abs(wanted).max())
    energy = sol.energy.kinetic + sol.energy.potential
    work = CubicSpline(t, SPEED * wanted).antiderivative()(t)
    assert_allclose(energy - energy[0], work, atol=2e-4)
    assert_allclose(sol.energy.drives, work, atol=0.1)  # trapezoids over 61 times


def test_interface_loads_and_gravity_are_the_rate_of_momentum():
    mech = swing()
    hook, end = mech.joints["hook"].markers[0], mech.part("one").marker("b")
    mech.force("push", end, (0.1, 0, 0.2), frame="body")
    mech.torque("twist", end, (0.2, -0.1, 0.3))
    mech.user_force("resistance", lambda t, a: ((0, 0, 0), -0.05 * a.omega), end)
    mech.spring_damper("coil", hook, end, stiffness=30.0, damping=0.2)
    sol = rom.simulate(mech, t_end=0.3, dt=2e-3, method="dop853")
    loads = sol.interface_loads("one")
    assert set(loads) == {"a", "b"}
    force = sum(x[:, :3] for x in loads.values())
    arms = {place: sol.position("one", place) for place in loads}
    moment = sum(x[:, 3:] + np.cross(arms[place], x[:, :3]) for place, x in loads.items())
    linear, angular = (CubicSpline(sol.t, p)(sol.t, 1) for p in sol.momentum)
    body, g = mech.part("one").flexible, np.array([0, 0, -G])
    mass, first = body.mass, body.first_moment + sol.elastic("one") @ body.S.T
    A = np.array([rom.rotation.matrix(p) for p in sol.orientation("one")])
    centre = sol.position("one") + np.einsum("nab,nb->na", A, first) / mass
    inner = slice(5, -5)
    scale = np.abs(linear).max()
    assert_allclose((force + mass * g)[inner], linear[inner], atol=1e-6 * scale)
    moment += np.cross(centre, mass * g)
    assert_allclose(moment[inner], angular[inner], atol=1e-6 * np.abs(angular).max())
    on_ground = sum(sol.interface_loads("ground").values())[:, :3]
    applied = loads["b"][:, :3] - _spring(sol)
    assert_allclose(on_ground, applied - force, atol=1e-9 * scale)
    own = sol.interface_loads("one", frame="body")
    for place, load in loads.items():
        for part in (slice(0, 3), slice(3, 6)):
            assert_allclose(np.einsum("nab,nb->na", A, own[place][:, part]), load[:, part])


def _spring(sol):
    """(n_t, 3) pull of the spring on the body."""
    hook = sol.mechanism.springs["coil"].i
    at, rate = sol.position("one", "b") - hook.place, sol.velocity("one", "b")
    length = np.linalg.norm(at, axis=1, keepdims=True)
    e = at / length
    speed = (e * rate).sum(axis=1, keepdims=True)
    return -(30.0 * (length - sol.mechanism.springs["coil"].free_length) + 0.2 * speed) * e


def test_motions_that_nothing_prescribes_are_refused():
    mech, ask = driven_pendulum(), rom.inverse_dynamics
    sol = ask(mech, [0.0, 0.01])
    refuses(ConfigError, "that ascend", ask, mech, [1.0, 0.0])
    refuses(ConfigError, "no drive 'hinge'.*motor", sol.drive_load, "hinge")
    refuses(ConfigError, "frame = 'marker' is none of", sol.interface_loads, "bar", frame="marker")
    mech.drives.clear()
    refuses(ModelError, "1 motions are not prescribed.*add drives", ask, mech, [0.0, 1.0])


def linkage(n, seed):
    """n bars on hinges: a crank, and pairs of bars from a moving hinge to the ground."""
    rng = np.random.default_rng(seed)
    hinges, bars, feet = [(0.06, 0.08)], [(None, 0)], [(0.0, 0.0)]  # a bar: from, to a hinge
    pairs = []
    for _ in range((n - 1) // 2):
        start, foot = int(rng.integers(len(hinges))), rng.uniform((0.25, -0.1), (0.45, 0.1))
        hinges.append(tuple(foot + rng.uniform((-0.05, 0.2), (0.05, 0.3))))
        new = len(hinges) - 1
        pairs.append((start, tuple(foot), new))
        bars += [(start, new), (None, new)]
        feet += [None, tuple(foot)]
    return hinges, bars, feet, pairs


def as_mechanism(n, hinges, bars, feet):
    mech, owner = rom.Mechanism(gravity=(0, -G, 0)), {}
    for k, ((start, end), foot) in enumerate(zip(bars, feet, strict=True)):
        a = foot if start is None else hinges[start]
        bar = slender(mech, f"bar {k}", a, hinges[end])
        before = mech.ground.marker((*a, 0)) if start is None else owner[start]
        mech.revolute(f"foot {k}", before, bar.marker("a"), axis=(0, 0, 1))
        if end in owner:
            mech.revolute(f"head {k}", owner[end], bar.marker("b"), axis=(0, 0, 1))
        owner.setdefault(end, bar.marker("b"))
    mech.drive("turn", "foot 0", lambda t: t)
    if n % 2 == 0:  # a bar more that another drive holds
        bar = mech.add_rigid("held", mass=1.0, inertia=(1, 1, 1), at=(1, 0, 0))
        mech.revolute("arm", mech.ground.marker((1, 1, 0)), bar.marker((0, 1, 0)), axis=(0, 0, 1))
        mech.drive("hold", "arm", lambda t: 0.0)
    return mech


def torque(hinges, bars, feet, pairs, t):
    """Change of the energy of the bars per radian of the crank, hinges where circles intersect."""

    def ends(t):
        c, s = np.cos(t), np.sin(t)
        x, y = hinges[0]
        found = [np.array([c * x - s * y, s * x + c * y])]
        for start, foot, new in pairs:
            drawn = [np.array(p) for p in (hinges[start], foot, hinges[new])]
            ra, rb = (np.linalg.norm(drawn[2] - p) for p in drawn[:2])
            side = np.sign(np.linalg.det([drawn[1] - drawn[0], drawn[2] - drawn[0]]))
            a, d = found[start], foot - found[start]
            along = (ra**2 - rb**2 + d @ d) / 2 / (d @ d)
            up = side * np.sqrt(ra**2 / (d @ d) - along**2)
            found.append(a + along * d + up * np.array([-d[1], d[0]]))
        at = [foot if i is None else found[i] for (i, _), foot in zip(bars, feet, strict=True)]
        return np.array(at), np.array([found[j] for _, j in bars])

    def energy(t, h=1e-5):
        va, vb = ((p - m) / 2 / h for p, m in zip(ends(t + h), ends(t - h), strict=True))
        a, b = ends(t)
        return (va**2 + vb**2 + va * vb).sum() / 6 + G * (a + b)[:, 1].sum() / 2

    return (energy(t + 1e-4) - energy(t - 1e-4)) / 2e-4


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
@pytest.mark.parametrize("n", [4, 5, 6, 7, 8, 9, 10, 21])
def test_linkages_of_many_bars_need_the_torque_of_their_energy(n):
    """Hinges about parallel axes repeat each other, which bodies in blocks must know."""
    parts = linkage(n, n)
    sol = rom.inverse_dynamics(as_mechanism(n, *parts[:3]), np.linspace(0, 0.05, 6))
    wanted = torque(*parts, sol.t[3])
    assert_allclose(sol.drive_load("turn")[3], wanted, rtol=1e-5)
