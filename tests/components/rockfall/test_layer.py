"""Sand: what it gives back, the end of an impact, contact and spread; slabs that yield."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad, solve_ivp
from scipy.linalg import eigh

from cases.refusals import refused
from rom.components import rockfall
from rom.components.rockfall import Cushion, Layer, Slab, arriving, strike
from rom.errors import ConfigError, SolverError

HERTZ_SLOPE = np.sqrt(2) / np.pi / (1 - 0.25**2)


def baseline(**change):
    parts = Cushion.of_sand(4000.0, 1e6), rockfall.Shear(2e9), Slab.of_mass(6000.0, 1.2e8)
    return replace(rockfall.Gallery(4000.0, 15.0, 2500.0, *parts), **change)


@pytest.mark.parametrize("height", [2.0, 15.0, 40.0])
@pytest.mark.parametrize("cushion", [Cushion.of_sand(4e3, 1e6), Layer.of_sand(4e3, 1e6, 3.0)])
def test_sand_gives_back_less_than_a_twentieth_of_the_energy(cushion, height):
    got = strike(baseline(cushion=cushion, height=height))
    assert 0.0 < got.rebound < 0.05
    assert got.energy[-1, 1] / got.energy[0, 0] > 0.8
    elastic = strike(baseline(cushion=replace(cushion, recovery=1.0), height=height))
    assert elastic.rebound > 0.6


def seen_to_its_end(g):
    got, long = strike(g), strike(g, t_end=30.0)
    assert_allclose(got.peaks, long.peaks, rtol=2e-3)
    assert got.deflection == pytest.approx(long.deflection, rel=2e-3)
    return got


@pytest.mark.parametrize("slab", [(6e4, 5e6), (2e5, 2e6), (6e3, 1.2e8)])
@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_an_impact_ends_after_its_peaks(slab, damping):
    """A slab as soft as the first two is at its peak long after 0.15 s."""
    g = baseline(slab=Slab.of_mass(*slab, damping=damping), weight=False)
    got = seen_to_its_end(g)
    assert got.t[-1] < 6 * g.longest_period
    assert 1000 <= got.t.size <= 2000
    assert_allclose(np.diff(got.t), got.t[1], rtol=1e-9)


def test_the_longest_period_is_that_of_all_masses_on_the_slab():
    """Exact for one mode; from above for several, of which a boulder that sticks moves all."""
    period = 2 * np.pi * np.sqrt((4000 + 2500 + 6000) / 1.2e8)
    assert baseline().longest_period == pytest.approx(period)
    M = np.eye(3) + 6500 * np.outer(PLATE.phi, PLATE.phi)
    lowest = eigh(np.diag(PLATE.omega**2), M, eigvals_only=True)[0]
    bound = baseline(slab=PLATE).longest_period
    assert 1.0 < bound * np.sqrt(lowest) / (2 * np.pi) < 1.2


def test_a_slab_that_flows_is_followed_until_it_rests():
    """Its force stays at the capacity for longer than two periods, while it sinks."""
    slab = Slab.of_mass(1e5, 1e9, damping=0.0, capacity=2e4)
    got = seen_to_its_end(baseline(slab=slab, weight=False))
    assert got.deflection > 1000 * 2e4 / 1e9


def test_a_rigid_gallery_is_seen_until_the_cushion_lets_go():
    rigid = Slab.of_mass(1e3, 1e11, damping=0.0)
    got = strike(baseline(slab=rigid, shear=rockfall.Shear(1e11, damping=0.0)))
    assert got.forces[-1, 0] < 0.05 * got.peaks[0] + 2 * 9.81 * 4000


def test_the_step_follows_the_cushion_on_its_way_back():
    """Where the gallery is heavy and soft, the highest frequency is that of the boulder alone."""
    heavy = {"plug": 1e9, "slab": Slab.of_mass(1e9, 1e6), "shear": rockfall.Shear(1e6)}
    g = baseline(**heavy)
    c, d = g.cushion, g.cushion.penetration(g.energy)
    slope = (c.force(d) - c.force(d * (1 - 1e-6), d)) / (1e-6 * d)
    assert g.highest_frequency() == pytest.approx(np.sqrt(slope / 4000), rel=1e-4)


def test_a_soft_slab_was_not_at_its_peak():
    """One mass under a short blow: z = J / sqrt(k M), a quarter of a period later."""
    g = baseline(slab=Slab.of_mass(2e5, 2e6, damping=0.0), weight=False)
    got = strike(g)
    J = 4000.0 * g.speed * (1 + np.sqrt(got.rebound))  # the plug is carried along
    expected = J / np.sqrt(2e6 * (2e5 + 2500.0))
    assert got.deflection == pytest.approx(expected, rel=0.05)
    assert strike(g, t_end=0.15).deflection < 0.6 * got.deflection


def test_a_boulder_that_never_stops_is_named(monkeypatch):
    monkeypatch.setattr("rom.components.rockfall.impact.MAX_STEPS", 2000)
    with pytest.raises(SolverError, match="still grow after") as error:
        strike(baseline(cushion=Cushion(1e-9)), dt=1e-4)
    assert error.value.solution.t[-1] == pytest.approx(0.2, rel=0.01)


GOOD, HARD = Layer(3e6, 0.6, 0.9), Cushion(2e6, limit=0.5, hardening=1.0)
PRESSED = [(Cushion(2e6), 0.4), (HARD, 0.45), (HARD, 0.49), (GOOD, 0.5)]
PRESSED += [(replace(GOOD, strength=2e5), 0.8)]


def test_a_thick_layer_is_hertz():
    """By the angle whose cone has the stiffness of the half space, 25.6 degrees for nu = 1/4."""
    assert np.degrees(np.arctan(HERTZ_SLOPE)) == pytest.approx(25.65, abs=0.01)
    layer = Layer.of_sand(4000.0, 1e6, 1e5, angle=np.arctan(HERTZ_SLOPE))
    hertz = Cushion.of_sand(4000.0, 1e6)
    for d in (1e-6, 1e-3):  # the contact of Hertz is a chord that is small
        assert layer.force(d) == pytest.approx(hertz.force(d), rel=2e-3)


@pytest.mark.parametrize("thickness", [0.9, 2.5])
@pytest.mark.parametrize("depth", [0.02, 0.5, 0.85])
def test_the_force_is_the_integral_of_the_stiffness_of_the_cone(thickness, depth):
    """Slices of the cone in series: 1 / k is the integral of dz / E pi (a + s z)^2."""
    layer = Layer(3e6, 0.6, thickness, angle=0.4)

    def stiffness(d):
        a = layer.contact(d)
        slices = quad(lambda z: 1 / (3e6 * np.pi * (a + np.tan(0.4) * z) ** 2), 0, thickness - d)
        return 1 / slices[0]

    expected = quad(stiffness, 0, depth, points=[0.6] if depth > 0.6 else None, limit=200)[0]
    assert layer.force(depth) == pytest.approx(expected, rel=1e-6)


def test_a_shallow_contact_on_a_thick_layer_loses_no_digits():
    """At d / e = 9e-4, by the series of the logarithm."""
    layer = Layer(3e6, 60.0, 100.0, angle=0.01)
    way = quad(lambda x: layer.contact(x) * layer.spread(x) / (100 - x), 0, 0.09, epsrel=1e-12)
    assert layer.force(0.09) == pytest.approx(3e6 * np.pi * way[0], rel=1e-6)


def test_contact_spreads_the_plug_has_the_mass_of_its_cones_and_its_ring_shears_as_lame_says():
    layer = Layer(3e6, 0.6, 0.9)
    assert layer.contact(0.0) == 0.0
    assert layer.contact(0.6) == layer.contact(0.8) == 0.6  # the equator
    assert layer.contact(0.3) == pytest.approx(np.sqrt(0.6**2 - 0.3**2))  # a chord
    assert layer.spread(0.3) == pytest.approx(layer.contact(0.3) + 0.3)  # 2:1 over 0.6 m
    assert layer.spread(0.0) == pytest.approx(0.45)
    layer = Layer(3e6, 0.6, 0.9, angle=0.4)
    r = layer.spread(0.3)
    sand = quad(lambda z: np.pi * (layer.contact(0.3) + np.tan(0.4) * z) ** 2, 0, 0.6)[0]
    concrete = quad(lambda z: np.pi * (r + z) ** 2, 0, 0.25)[0]
    assert layer.plug(0.3, 0.25) == pytest.approx(1800 * sand + 2500 * concrete)
    straight = Layer(3e6, 0.6, 0.9, angle=1e-9)
    assert straight.plug(0.6, 1e-9) == pytest.approx(1800 * np.pi * 0.36 * 0.3, rel=1e-6)
    shear = GOOD.shear(0.3, 0.25, modulus=12e9, strength=1e6, reinforced=1e7)
    r = GOOD.spread(0.3)
    # antiplane shear of a ring: w' = F / 2 pi r h G
    way = quad(lambda x: 1 / (2 * np.pi * x * 0.25 * 12e9), r, r + 0.25)[0]
    assert shear.stiffness == pytest.approx(1 / way)
    assert shear.capacity == pytest.approx(1e6 * 2 * np.pi * (r + 0.125) * 0.25)
    assert shear.reinforced == 1e7


def test_a_thinner_layer_is_stiffer_and_strikes_harder():
    layers = (Layer.of_sand(4000.0, 1e6, e) for e in (5.0, 2.0, 1.2))
    peaks = [strike(baseline(cushion=layer)).peaks[0] for layer in layers]
    assert peaks[0] < peaks[1] < peaks[2]
    assert peaks[0] == pytest.approx(strike(baseline()).peaks[0], rel=0.1)


def test_the_modulus_of_a_layer_is_varied_as_its_stiffness():
    thick = baseline(cushion=Layer.of_sand(4000.0, 1e6, 5.0))
    change = rockfall.sensitivity(thick, lambda g: g.cushion.force(0.1), (2.0,))
    assert change["stiffness of the cushion"] == pytest.approx([1.0])
    assert change["mass of the plug"] == pytest.approx([0.0])
    assert "strength of the cushion" not in change
    weak = baseline(cushion=replace(GOOD, strength=2e5))
    change = rockfall.sensitivity(weak, lambda g: g.cushion.force(0.5), (1.25,))
    assert change["strength of the cushion"] == pytest.approx([0.25])


PLATE = Slab(np.array([0.012, 0.009, -0.006]), np.array([150.0, 400.0, 900.0]), damping=0.0)


def test_several_modes_yield_as_a_slip_under_the_plug():
    """Against the same slip, viscous below a millisecond, by an implicit integrator."""
    cap = 6e5
    slab = replace(PLATE, capacity=cap)
    cushion = Cushion(4e6, exponent=1.0, recovery=1.0)
    g = baseline(slab=slab, cushion=cushion, shear=rockfall.Shear(3e7, damping=0.0), weight=False)
    got = strike(g, t_end=0.1)
    phi, omega, k3 = slab.phi, slab.omega, slab.stiffness
    shape = k3 * phi / omega**2

    def rates(_, y):
        z1, v1, z2, v2, slip, q, w = y[0], y[1], y[2], y[3], y[4], y[5:8], y[8:]
        F1, F2 = 4e6 * max(z1 - z2, 0.0), 3e7 * (z2 - phi @ q)
        S = k3 * (phi @ q - slip)
        flow = np.sign(S) * max(abs(S) - cap, 0.0) / (k3 * 2e-6)
        pull = phi * F2 - omega**2 * (q - slip * shape)
        return np.concatenate([[v1, -F1 / 4000, v2, (F1 - F2) / 2500, flow], w, pull])

    y = solve_ivp(rates, (0, 0.1), [0, g.speed] + 9 * [0], method="LSODA", rtol=1e-8, atol=1e-9).y
    assert got.plastic == pytest.approx(y[4, -1], rel=5e-3)
    assert got.plastic > 0.02
    assert got.deflection == pytest.approx((phi @ y[5:8]).max(), rel=5e-3)
    assert got.energy[-1, 5] == pytest.approx(cap * got.plastic, rel=1e-9)
    assert np.abs(got.balance).max() < 1e-3 * got.energy[0, 0]
    assert_allclose(got.peaks[2], cap, rtol=1e-9)


def test_one_mode_yields_as_it_did():
    one = Slab.of_mass(6000.0, 1.2e8, damping=0.0, capacity=1.2e6)
    modes = np.full(2, 6000.0**-0.5 / np.sqrt(2)), np.full(2, np.sqrt(1.2e8 / 6000))
    twin = Slab(*modes, damping=0.0, capacity=1.2e6)
    a, b = (strike(baseline(slab=s), t_end=0.2) for s in (one, twin))
    assert a.plastic == pytest.approx(b.plastic, rel=1e-9) and a.plastic > 0.005


def test_what_stays_is_the_shape_of_the_static_deflection():
    slab = replace(PLATE, damping=0.3, capacity=6e5)
    got = strike(baseline(slab=slab, weight=False), t_end=2.0)
    shape = slab.stiffness * slab.phi / slab.omega**2
    late = got.modal[-1]
    assert_allclose(late, got.plastic * shape, atol=2e-3 * np.abs(late).max())


def test_a_contact_that_fails_bears_its_strength_only():
    soft = replace(GOOD, strength=2e5)
    assert soft.force(0.01) == GOOD.force(0.01)
    assert soft.force(0.3) == pytest.approx(2e5 * np.pi * (0.6**2 - 0.3**2))
    assert soft.force(0.7) == soft.force(0.8) == pytest.approx(2e5 * np.pi * 0.36)


@pytest.mark.parametrize("recovery", [1.0, 0.3, 0.03])
@pytest.mark.parametrize(("cushion", "deepest"), PRESSED)
def test_recovery_is_the_share_of_the_energy(cushion, deepest, recovery):
    """Of compacted sand too: it gave back more than it took, or a ninth instead of 3 %."""
    c = replace(cushion, recovery=recovery)
    taken = quad(c.force, 0, deepest, limit=400)[0]
    kink = deepest - 3 * recovery * taken / c.force(deepest)
    returned = quad(c.force, 0, deepest, args=(deepest,), limit=400, points=[kink])[0]
    if c.exponent * recovery * taken < 0.7 * deepest * c.force(deepest):  # there is way enough
        assert returned / taken == pytest.approx(recovery, rel=0.04)
    assert returned < 1.02 * recovery * taken


@pytest.mark.parametrize(("recovery", "grows"), [(0.03, False), (0.5, True)])
def test_a_second_blow_is_seen_where_it_is_the_larger_one(recovery, grows):
    """The cushion is stiff by then: 2589 kN after 2095, which an end at the first blow left out."""
    g = baseline(cushion=Cushion.of_sand(4000.0, 1e6, recovery=recovery), weight=True)
    assert (seen_to_its_end(g).t[-1] > 2.0) == grows


DELAY = 0.01  # s


def sampled(shape, end=0.3, n=30001):
    t = np.linspace(0.0, end, n)
    return t, shape(t)


@pytest.mark.parametrize("reflection", [0.0, 0.5, 1.0])
def test_what_arrives_is_what_a_chain_of_masses_and_springs_passes_on(reflection):
    """By central differences; a floor of impedance Z gives back (Z - 1) / (Z + 1) of a wave."""
    t, force = sampled(lambda t: np.where(t < 0.05, np.sin(np.pi * t / 0.05) ** 2, 0.0), n=3001)
    found, n = arriving(t, force, DELAY, reflection=reflection), 300
    m, k, dt = 1 / n, float(n), 0.5 / n
    x, v = np.zeros(n + 1), np.zeros(n + 1)
    mass = np.full(n + 1, m)
    mass[[0, -1]] = 0.5 * m
    out, times = [], np.arange(0.0, t[-1] / DELAY, dt)
    for s in times:
        pull = k * np.diff(x)
        f = np.append(pull, 0.0) - np.append(0.0, pull)
        f[0] += np.interp(s * DELAY, t, force)
        v += dt * f / mass
        Z = (1 + reflection) / (1 - reflection) if reflection < 1.0 else np.inf
        v[-1] /= 1 + dt * Z / mass[-1]  # at the end of the step, which is stable for any floor
        out.append(Z * v[-1] if reflection < 1.0 else -pull[-1])
        x += dt * v
    assert_allclose(found, np.interp(t, times * DELAY, out), atol=0.02)


def test_a_force_that_stays_is_doubled_and_gone_in_turns_and_one_that_grows_slowly_is_not():
    """A step on an undamped column: 2 from the first to the third delay, 0 to the fifth."""
    t, force = sampled(np.ones_like)
    found, turn = arriving(t, force, DELAY), np.floor((t / DELAY + 1e-9 + 1) / 2) % 2
    between = np.abs((t / DELAY) % 2 - 1) > 1e-6
    assert_allclose(found[between], 2 * turn[between], atol=1e-9)
    half = arriving(t, force, DELAY, reflection=0.5)
    assert half.max() == pytest.approx(1.5)
    assert half[-1] == pytest.approx(1.0, abs=1e-4)  # statics: what acts on top arrives
    # over four delays waves of the beginning and the end of the ramp cancel for good
    t, force = sampled(lambda t: np.minimum(t / (4 * DELAY), 1.0))
    found = arriving(t, force, DELAY)
    assert found.max() == pytest.approx(1.0, abs=1e-9)
    assert_allclose(found[t > 3 * DELAY], 1.0, atol=1e-9)


def test_short_pulses_are_doubled_and_long_ones_arrive_as_they_are():
    """Half sines: doubled as long as the peak arrives before the first wave is back, T < 4 tau."""
    # between: 4 cos(w (t - 2 tau)) sin(w tau) of one reflection, and 2 sin(2 w tau) before it
    for share, exact in ((0.5, 2), (2, 2), (4, 2), (6, np.sqrt(3)), (10, 2 * np.sin(np.pi / 5))):
        T = share * DELAY
        t, force = sampled(lambda t, T=T: np.where(t < T, np.sin(np.pi * t / T), 0.0))
        assert arriving(t, force, DELAY).max() == pytest.approx(exact, rel=1e-4)
    t, force = sampled(lambda t: np.sin(np.pi * t / 3.0), end=3.0)
    assert arriving(t, force, DELAY).max() == pytest.approx(1.0, abs=0.02)


def test_the_delay_of_a_layer_is_that_of_its_bar_wave():
    """E = 25 MPa and 1800 kg/m^3 have 117.85 m/s."""
    sand = Layer(25e6, 0.7, 0.9)
    assert rockfall.wave_delay(sand) == pytest.approx(0.9 / 117.851, rel=1e-5)
    assert rockfall.wave_delay(sand, 0.3) == pytest.approx(0.6 / 117.851, rel=1e-5)


HIGH = baseline(cushion=GOOD, height=300.0)
test_messages_name_what_is_wrong = refused(
    (lambda: GOOD.contact(0.9), r"d \[m\] = 0.9 must be"),
    (lambda: GOOD.spread(-0.1), r"d \[m\] = -0.1"),
    (lambda: strike(HIGH), "pressed through"),
    (lambda: strike(HIGH, dt=1e-5), SolverError, "through the cushion of 0.9 m"),
    (lambda: arriving([0, 1], [1.0], 0.1), "a row of 2 numbers"),
    (lambda: arriving([0, 0], [1.0, 1.0], 0.1), "2 or more numbers that ascend"),
    (lambda: arriving([0, 1], [1.0, 1.0], 1e-9), "passages of a wave of 1e-09 s in 1 s"),
    (lambda: rockfall.wave_delay(Layer(25e6, 0.7, 0.9), 1.0), r"d \[m\] = 1 must be"),
    error=ConfigError,
)
