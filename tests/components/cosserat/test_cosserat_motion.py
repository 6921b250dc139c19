"""Rods in motion: published swings, spin-up, invariants, decay, frequencies, cost."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.beam import FLAP
from cases.components.rods import ALONG_X, moved
from cases.refusals import refuses
from rom import rotation
from rom.components import cosserat
from rom.components.cosserat import loads, simulate, straight
from rom.components.cosserat.vibration import gyroscopic
from rom.components.wind.wind_turbine import ramp
from rom.errors import ConfigError, SolverError


def elbow(n):
    """Two legs at a right angle, after Simo and Vu-Quoc 1988."""
    s = np.linspace(0, 10, n + 1)[:, None]
    x = np.concatenate([s * [1, 0, 0], [10, 0, 0] + s[1:] * [0, 1, 0]])
    legs = [rotation.quaternion(A) for A in (ALONG_X, np.roll(ALONG_X, 1, axis=0))]
    return cosserat.rod(x, np.repeat(legs, n + 1, axis=0), stretch=1e6, bend=1e3, mass=1.0,
               inertia=(10, 10, 20))  # fmt: skip


def hit(one, n):
    def load(t):
        force = np.zeros_like(one.x)
        force[n, 2] = 50 * max(0.0, 1 - abs(t - 1))
        return loads(one, force=force)

    return load


def test_right_angle_cantilever_swings_as_published():
    """Finite elements with 40 elements and 0.005 s: 8.25 at 7.44, -9.73 at 15.87, elbow -4.06."""
    one = elbow(10)
    motion = simulate(one, 17.0, 0.05, load=hit(one, 10))
    tip, corner = motion.x[:, -1, 2], motion.x[:, 10, 2]
    assert_allclose([tip.max(), tip.min(), corner.min()], [8.260, -9.687, -4.058], rtol=1e-3)
    assert_allclose([tip.max(), tip.min(), corner.min()], [8.25, -9.73, -4.06], rtol=0.01)
    at = motion.t[[tip.argmax(), tip.argmin(), corner.argmin()]]
    assert_allclose(at, [7.44, 15.87, 10.87], atol=0.1)


def test_energy_is_kept_without_damping_of_the_scheme():
    one = elbow(10)
    motion = simulate(one, 20.0, 0.02, load=hit(one, 10), rho_inf=1.0)
    after = motion.energies().sum(axis=1)[motion.t >= 2.0]
    assert_allclose(after[0], 114.86, rtol=3e-3)
    assert np.abs(after / after[0] - 1).max() < 1e-4


def test_a_free_rod_keeps_the_momentum_it_was_given():
    n = 10
    one = straight(10.0, n, stretch=1e4, bend=500.0, mass=1.0, inertia=10.0)

    def pushed(t):
        share = 8 * max(0.0, 1 - abs(t - 2.5) / 2.5)
        return loads(one, tip=(share, 0, share / 10), tip_moment=(0, 10 * share, 10 * share))

    drift = []
    for dt in (0.1, 0.05):
        free = cosserat.clamped(one, start=False)
        motion = simulate(one, 10.0, dt, load=pushed, free=free, rho_inf=1.0)
        v = np.append(motion.v, np.zeros((len(motion.t), 3)), axis=1).reshape(-1, n + 2, 6)
        u = v[:, :-1, 3:]
        momentum = np.einsum("i,tic->tc", one.mass, u)[motion.t > 5.01]
        assert_allclose(momentum, np.tile([20.0, 0, 2.0], (len(momentum), 1)), atol=0.05 * dt)
        A = np.array([[rotation.matrix(q) for q in p] for p in motion.p])
        turn = np.einsum("tiab,ib,tib->ta", A, motion.rod.inertia, v[:, :, :3])
        L = turn + np.einsum("i,tic->tc", one.mass, np.cross(motion.x, u))
        later = L[motion.t > 5.01]
        drift.append(np.abs(later - later[0]).max() / np.linalg.norm(later[0]))
        energy = motion.energies().sum(axis=1)[motion.t > 5.01]
        assert np.abs(energy / energy[0] - 1).max() < 40 * dt**2
    assert drift[0] < 5e-3 and drift[1] < 0.35 * drift[0]


SPEED, RISE = 6.0, 15.0


def test_spin_up_lags_and_stretches_and_its_work_is_energy():
    """Kane's beam: a linear body without centrifugal stiffness would fly away here."""
    section = {"stretch": (1e7, 1e7, 2.8e7), "bend": 1.4e4, "mass": 1.2, "inertia": 6e-4}
    speed, angle = ramp(SPEED, RISE)

    def root(t):
        p = rotation.multiply(rotation.exp([0, 0, angle(t)]), rotation.quaternion(ALONG_X))
        return np.zeros(3), p, np.zeros(3), [0, speed(t), 0]

    lag = []
    for n in (20, 10):
        motion = simulate(straight(10.0, n, frame=ALONG_X, **section), 20.0, 0.01, root=root)
        turned, tip = np.array([angle(t) for t in motion.t]), motion.x[:, -1]
        across = np.cos(turned) * tip[:, 1] - np.sin(turned) * tip[:, 0]
        lag.append(across.min())
        if n == 20:
            at = [round(s / 0.01) for s in (2.5, 5.0, 7.5, 10.0, 12.5)]
            known = (-0.1514, -0.4690, -0.5602, -0.3644, -0.1133)
            assert_allclose(across[at], known, rtol=8e-3)
            along = np.cos(turned) * tip[:, 0] + np.sin(turned) * tip[:, 1] - 10
            stretch = along[motion.t > RISE].mean()
            assert_allclose(stretch, 1.2 * 36 * 1000 / (3 * 2.8e7), rtol=3e-3)
    assert_allclose(lag[0], -0.5766, rtol=2e-3)
    assert_allclose(lag[0] + (lag[0] - lag[1]) / 3, -0.5740, rtol=3e-3)
    power = np.einsum("tc,tc->t", motion.root[:, 3:], motion.v[:, :3])
    work = np.concatenate([[0], np.cumsum((power[1:] + power[:-1]) / 2 * 0.01)])
    total = motion.energies().sum(axis=1)
    assert_allclose(work, total, atol=2e-3 * total.max())


@pytest.mark.long
def test_viscosity_damps_a_mode_at_its_rate():
    """Stiffness-proportional damping: half the ratio times omega^2."""
    ratio = 2e-3
    one = straight(1.0, 10, stretch=1e5, bend=1.0, mass=1.0, inertia=1e-6, viscosity=ratio)
    omega = 2 * np.pi * cosserat.modes(one, cosserat.reference(one), 1).frequencies[0]
    bent = cosserat.equilibrium(one, loads(one, tip=(1e-3, 0, 0)))
    motion = simulate(one, 20 * np.pi / omega, np.pi / (50 * omega), start=bent, rho_inf=1.0)
    energy = motion.energies().sum(axis=1)[200:]  # after two periods, when higher modes are gone
    rate = np.log(energy[-1] / energy[0]) / (motion.t[-1] - motion.t[200])
    assert_allclose(rate, -ratio * omega**2, rtol=0.01)


def test_frequencies_of_a_slender_cantilever():
    """Euler and Bernoulli, second order in the segments; torsion and stretch by closed forms."""
    exact = np.array([1.875104069, 4.694091133, 7.854757438]) ** 2 / (2 * np.pi)
    error = []
    for n in (20, 40):
        one = straight(1.0, n, stretch=1e7, bend=(1.0, 1e4, 1e4), mass=1.0, inertia=1e-9)
        f = cosserat.modes(one, cosserat.reference(one), 3).frequencies
        error.append(np.abs(f / exact - 1))
    assert (error[1] < 6e-3).all()
    assert_allclose(error[0] / error[1], 4.0, rtol=0.05)
    one = straight(1.0, 80, stretch=(1e9, 1e9, 9.0), bend=(1e6, 1e6, 16.0), mass=1.0, inertia=4.0)
    f = cosserat.modes(one, cosserat.reference(one), 2).frequencies
    assert_allclose(f, [0.5, 0.75], rtol=1e-3)  # sqrt(GJ / rho I) / 4 L, sqrt(EA / rho A) / 4 L


@pytest.mark.parametrize("speed", [1, 5])
def test_rotation_stiffens_flapping_and_less_so_lagging(speed):
    """Out of the plane as Southwell's beam; in the plane omega^2 is less by that of spin."""
    flap = np.array(FLAP[speed][:2])
    section = {"stretch": 1e8, "bend": (1e4, 1.0, 1e4), "mass": 1.0, "inertia": 1e-9}
    one = straight(1.0, 60, frame=ALONG_X, **section)
    for axis, squares in ((0, flap**2), (1, flap**2 - speed**2)):  # the soft direction is y
        spin = speed * np.roll([0, 1.0, 0], 0 if axis == 0 else 1)
        shape = cosserat.equilibrium(one, loads(one), spin=spin)
        f = 2 * np.pi * cosserat.modes(one, shape, 2, spin=spin).frequencies
        assert_allclose(f**2, squares, rtol=5e-3)


def test_a_shaft_that_spins_whirls_slower_and_faster():
    """Seen in axes that turn with it, a round shaft has its frequency less and plus the speed."""
    one = straight(1.0, 20, stretch=1e5, bend=(1.0, 1.0, 1e3), mass=1.0, inertia=1e-7)
    still = cosserat.modes(one, cosserat.reference(one), 1).frequencies[0]
    turning = cosserat.modes(one, cosserat.reference(one), 2, spin=(0, 0, 1.0)).frequencies
    assert_allclose(2 * np.pi * (turning - still), [-1.0, 1.0], rtol=1e-4)


def test_forces_of_steady_rotation_have_their_tangent():
    rng = np.random.default_rng(4)
    one = straight(1.0, 3, stretch=3.0, bend=2.0, mass=1.3, inertia=(0.3, 0.5, 0.9))
    spin = np.array([0.4, -1.1, 0.7])
    shape = cosserat.equilibrium(one, loads(one, tip=(0.3, 0.1, 0), tip_moment=(0, 0, 0.3)))
    K = cosserat.linearised(one, shape, spin=spin)[1] - cosserat.linearised(one, shape)[1]
    n = len(K)

    def forces(d):
        there = moved(shape, d)
        return cosserat.linearised(one, there, spin=spin)[0] - cosserat.linearised(one, there)[0]

    d = rng.normal(size=n)
    assert_allclose(K @ d, (forces(1e-5 * d) - forces(-1e-5 * d)) / 2e-5, atol=1e-8)
    G = gyroscopic(one, shape, spin).toarray()
    assert_allclose(G, -G.T, atol=1e-14)


def coning(t):
    """A root on a circle, which spins about an axis that sways."""
    sway, spin = rotation.exp([0.5 * np.sin(t), 0, 0]), rotation.exp([0, 0, 4 * t])
    p = rotation.multiply(rotation.multiply(sway, spin), rotation.quaternion(ALONG_X))
    A = rotation.matrix(rotation.multiply(spin, rotation.quaternion(ALONG_X))).T
    w = A @ [0.5 * np.cos(t), 0, 4.0]
    return [np.cos(t) - 0.5, np.sin(t), 0], p, [-np.sin(t), np.cos(t), 0], w


def test_a_root_goes_its_way_and_what_it_needs_is_what_changes_the_momentum(recwarn):
    one = straight(1.0, 6, frame=ALONG_X, stretch=1e5, bend=50.0, mass=1.0, inertia=1e-3)
    one = one._replace(x=np.add(one.x, [0.5, 0, 0]))
    motion = simulate(one, 4.0, 0.005, root=coning)
    for k in (0, 123, 800):
        x, p, v, w = coning(motion.t[k])
        assert_allclose(motion.x[k, 0], x, atol=1e-9)
        assert_allclose(np.abs(motion.p[k, 0] @ p), 1.0, atol=1e-14)
        assert_allclose(motion.v[k, :6], [*w, *v], atol=1e-3)
    assert not recwarn.list
    u = np.append(motion.v, np.zeros((len(motion.t), 3)), axis=1).reshape(-1, 8, 6)[:, 1:-1, 3:]
    impulse = np.cumsum(0.0025 * (motion.root[1:, :3] + motion.root[:-1, :3]), axis=0)[-1]
    gained = np.einsum("i,tic->tc", one.mass[1:], u)
    assert_allclose(impulse, gained[-1] - gained[0], atol=5e-3)

    def tumbling(t):
        p = rotation.multiply(rotation.exp([3 * t, 0, 0]), rotation.exp([0, 0, 5 * t]))
        return np.zeros(3), p, *np.zeros((2, 3))

    refuses(ConfigError, "the root tumbles", simulate, one, 4.0, 0.1, root=tumbling)
    refuses(ConfigError, "section 3 is free", simulate, one, 1.0, 0.1, free=np.arange(45) != 18)


def test_what_has_no_mass_or_inertia_follows_the_rest():
    one = straight(1.0, 10, stretch=1e6, bend=1.0, mass=1.0)
    bent = cosserat.equilibrium(one, loads(one, tip=(1e-3, 0, 0)))
    omega = 2 * np.pi * cosserat.modes(one, cosserat.reference(one), 1).frequencies[0]
    motion = simulate(one, 6 * np.pi / omega, np.pi / (50 * omega), start=bent)
    tip = motion.x[:, -1, 0] / bent.x[-1, 0]
    assert_allclose(tip, np.cos(omega * motion.t), atol=0.06)  # higher modes


def test_bad_runs_are_refused_and_lost_ones_kept():
    one = straight(1.0, 4, stretch=1e3, bend=1.0, mass=1.0, inertia=1e-3)
    load, words = (np.zeros((4, 3)), np.zeros((6, 3))), r"shapes \(\(4, 3\), \(6, 3\)\) and 33 dofs"
    refuses(ConfigError, words, simulate, one, 1.0, 0.1, load=load)
    with pytest.raises(SolverError, match="did not converge") as error:
        simulate(one, 100.0, 10.0, load=loads(one, tip=(1e4, 0, 0)))
    t = error.value.solution.t
    assert t.size > 1 and t.tolist() == (10.0 * np.arange(t.size)).tolist()
    unstable = straight(1.0, 20, stretch=1e4, bend=1.0, mass=1.0, inertia=1e-3)
    load = loads(unstable, tip=(0, 0, -3.0))
    bent = cosserat.equilibrium(unstable, load)
    refuses(SolverError, "the shape is not stable", cosserat.modes, unstable, bent, 1, load=load)
