"""Rolling bearings: Hertz in closed form, loads and angles of Stribeck and Harris, energy, cage."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.optimize import brentq, root

import rom
from cases.long import few
from cases.mbs.mechanisms import prepared, residual_at
from cases.mbs.tangents import by_position, by_velocity, energy_gradient, forces_at, shifted
from cases.refusals import refused, refuses
from rom.components.rolling_bearing.bearings import ROLLING_BEARINGS_FAMILY
from rom.components.rolling_bearing.races import elliptic_stiffness
from rom.errors import ConfigError, ModelError

ORIGIN, Z = (0, 0, 0), (0, 0, 1)
BALLS = rom.mbs.BallBearing(9, 12.7e-3, 65e-3, clearance=15e-6)  # a 6209
ANGULAR = rom.mbs.BallBearing(13, 12.7e-3, 65e-3, contact_angle=np.radians(25))
MOUNT = {"stiffness": (1e3, 1e3, 1e6, 1e3, 1e3, 0), "damping": (2e3, 2e3, 2e3, 20.0, 20.0, 0)}
ROLLERS = rom.mbs.RollerBearing(14, 10e-3, 10e-3, 65e-3, clearance=-4e-6)


def test_a_ball_on_a_plane_is_as_stiff_as_hertz_says():
    """k = 4/3 E* sqrt(R), and of two cylinders that cross, too; ellipses lie between spheres."""
    R, E = 0.01, 113e9
    sphere = 4 / 3 * E * np.sqrt(R)
    assert elliptic_stiffness(np.array([1 / R, 1 / R, 0, 0]), E) == pytest.approx(sphere, rel=1e-12)
    crossed = elliptic_stiffness(np.array([1 / R, 0, 0, 1 / R]), E)
    assert crossed == pytest.approx(sphere, rel=1e-12)


def test_an_ellipse_of_contact_follows_from_the_potential_of_its_pressure():
    """Hertz's integrals by quadrature: z = c (I - I_a x^2 - I_b y^2), force 4/3 pi E* c."""
    A, B, E = 10.0, 40.0, 113e9  # gap A x^2 + B y^2

    def integrals(m):  # semiaxes 1 and sqrt(1 - m), w = s^2
        def over(f):
            return quad(lambda s: 2 * f(s * s) / np.sqrt((1 + s * s) * (1 - m + s * s)),
                        0, np.inf, epsabs=0, epsrel=1e-11)[0]  # fmt: skip

        return over(lambda w: 1.0), over(lambda w: 1 / (1 + w)), over(lambda w: 1 / (1 - m + w))

    m = brentq(lambda m: np.divide(*integrals(m)[1:]) - A / B, 1e-6, 1 - 1e-9)
    depth, by_x, _ = integrals(m)
    c = A / by_x
    found = elliptic_stiffness(2 * np.array([A, B, 0.0, 0.0]), E)
    assert found == pytest.approx(4 / 3 * np.pi * E * c / (c * depth) ** 1.5, rel=1e-6)


def test_curvatures_of_a_6209_are_those_of_harris():
    """Harris: curvature sums 0.202 and 0.138 per mm, deflections 0.602 and 0.658."""
    steel = rom.mbs.BallBearing(9, 12.7e-3, 65e-3, E=206.9e9)
    for race, (total, deflection) in enumerate(((0.202, 0.602), (0.138, 0.658))):
        k = 2.15e5 * total**-0.5 * deflection**-1.5 * 1e3**1.5
        assert steel.race_stiffness(race) == pytest.approx(k, rel=1e-2)
    g = 12.7 / 65
    assert steel.cage == pytest.approx(0.5 * (1 - g))
    assert steel.curvature_distance == pytest.approx(0.04 * 12.7e-3)


def bearing(kind, loads=None, axis=Z, **more):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("shaft", mass=1.0, inertia=(1e-2,) * 3, at=ORIGIN)
    mech.rolling_bearing("bearing", "shaft", "ground", axis=axis, bearing=kind, **more)
    if loads is not None:
        mech.force("load", "shaft", loads)
    return mech


def free_pair(kind, rng, **more):
    """Two free rings, near each other."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    solid = {"mass": 1.0, "inertia": (1e-3, 2e-3, 3e-3), "at": (1, 2, 3)}
    for name, omega in (("inner", (0.1, 0.2, 40)), ("outer", (0.0, 0.1, -3))):
        mech.add_rigid(name, **solid, velocity=0.02 * rng.normal(size=3), omega=omega)
    mech.rolling_bearing("bearing", "inner", "outer", axis=Z, bearing=kind, **more)
    return mech


def near(packed, rng):
    move = np.concatenate([part * rng.normal(size=3) for part in (2e-5, 3e-4) * 2])
    move[[5, 11]] = rng.normal(size=2)  # turned at will
    return shifted(packed, packed.q, move)


@pytest.mark.parametrize("kind", [BALLS, ANGULAR, ROLLERS], ids=["deep", "angular", "rollers"])
@pytest.mark.parametrize("seed", range(3))
def test_forces_are_the_gradient_of_the_energy(kind, seed):
    rng = np.random.default_rng(seed)
    packed, W = prepared(free_pair(kind, rng))
    q = near(packed, rng)
    gradient, found = energy_gradient(packed, W, q, 1e-8), forces_at(packed, W, q, np.zeros(12))
    assert np.abs(gradient).max() > 1.0
    assert_allclose(found, gradient, atol=1e-5 * np.abs(gradient).max())


@pytest.mark.parametrize("kind", [BALLS, ANGULAR, ROLLERS], ids=["deep", "angular", "rollers"])
def test_tangents_are_derivatives_but_for_the_turning_of_the_bearing(kind):
    rng = np.random.default_rng(1)
    packed, W = prepared(free_pair(kind, rng, damping=2.0))
    q, v = near(packed, rng), 1e-3 * rng.normal(size=12)
    (K, stiff), (D, loss) = by_position(packed, W, q, v), by_velocity(packed, W, q, v)
    lever = np.tile([1.0, 1.0, 1.0, *3 * [kind.radius]], 2)
    size = np.abs(stiff[:3, :3]).max() * np.outer(lever, lever)
    assert np.abs((K - stiff) / size).max() < 3e-3
    assert_allclose(D, loss, atol=1e-6 * np.abs(loss).max())


@pytest.mark.parametrize(("kind", "number"), [("balls", 4.37), ("rollers", 4.08)])
def test_the_largest_load_is_that_of_stribeck(kind, number):
    """Q_max = 4.37 F / Z of balls, 4.08 F / Z of rollers without play: many of them."""
    made = (rom.mbs.BallBearing(90, 2e-3, 65e-3, E=206e9) if kind == "balls"
            else rom.mbs.RollerBearing(90, 2e-3, 5e-3, 65e-3))  # fmt: skip
    n = made.exponent
    whole = np.pi / quad(lambda x: np.cos(x) ** (n + 1), 0, np.pi / 2)[0]
    assert whole == pytest.approx(number, abs=5e-3)
    mech = bearing(made, (-1000.0, 0, 0))
    state = resting(mech)
    depth = -rom.snapshot(mech, state).position("shaft")[0, 0]
    assert made.stiffness * depth**n == pytest.approx(whole * 1000.0 / 90, rel=2e-3)


def resting(mech):
    """Equilibrium of a shaft that a soft coil keeps from turning."""
    mech.bushing("soft", "ground", "shaft", stiffness=(1e-3, 1e-3, 1e-3, 1e6, 1e6, 1e6))
    return rom.equilibrium(mech)


def test_thrust_turns_the_contact_angle_of_a_radial_bearing():
    """Harris: F / (Z K A^1.5) = sin a (cos a0 / cos a - 1)^1.5, cos a0 = 1 - P / (2 A)."""
    b, thrust = BALLS, 3000.0
    A, free = b.curvature_distance, 1 - b.clearance / (2 * b.curvature_distance)
    unit = thrust / (b.balls * b.stiffness * A**1.5)
    wanted = brentq(lambda a: np.sin(a) * (free / np.cos(a) - 1) ** 1.5 - unit,
                    np.arccos(free) + 1e-9, 1.0)  # fmt: skip
    mech = bearing(b, (0, 0, thrust))
    found = rom.snapshot(mech, resting(mech)).position("shaft")[0, 2]
    assert found == pytest.approx(A * free * np.tan(wanted), rel=1e-6)


def test_an_angular_bearing_bears_thrust_one_way_only():
    mech = bearing(ANGULAR, (0, 0, 2000.0))
    z = rom.snapshot(mech, resting(mech)).position("shaft")[0, 2]
    assert 0 < z < 50e-6
    packed, W = prepared(bearing(ANGULAR))
    away = shifted(packed, packed.q, np.array([0, 0, -1e-5, 0, 0, 0]))
    residual_at(packed.system, W, away, np.zeros(6), np.zeros(6), np.zeros(0))
    assert not W.wrench.any()


def test_balls_that_pass_below_the_load_shake_the_shaft_with_their_frequency():
    """Z times the speed of the cage, 1/2 (1 - d / D) of that of the shaft."""
    speed = 2 * np.pi * 25
    mech = bearing(BALLS, (-3000.0, 0, 0), damping=2.0)
    mech.bushing("mount", "ground", "shaft", **MOUNT)
    mech.parts["shaft"].omega[:] = 0, 0, speed
    sol = rom.simulate(mech, t_end=0.4, dt=2e-5, progress=False, save_every=2)
    late = sol.t > 0.1
    x = sol.position("shaft")[late, 0]
    spectrum = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(x.size)))
    found = np.fft.rfftfreq(x.size, 4e-5)[spectrum.argmax()]
    assert found == pytest.approx(9 * BALLS.cage * 25, abs=2.0)
    # as far as statics with a ball, or two balls, below the load
    depths = [statics(3000.0, phase) for phase in (0.0, np.pi / 9)]
    assert np.ptp(x) == pytest.approx(abs(depths[0] - depths[1]), rel=0.3)


def test_balls_pass_alike_under_a_shaft_that_spins_in_its_frame():
    """Also the energy is booked: what keeps it spinning does the work of the passing balls."""
    found = []
    for way in ("omega", "spin"):
        mech = rom.Mechanism(gravity=(0, 0, 0))
        solid = {"mass": 2.0, "inertia": (0.01, 0.01, 0.008), "at": ORIGIN}
        mech.add_rigid("shaft", **solid, **{way: (0, 0, 150.0)})
        mech.rolling_bearing("bearing", "shaft", "ground", axis=Z, bearing=BALLS, damping=2.0)
        mech.bushing("mount", "ground", "shaft", **MOUNT)
        mech.force("load", "shaft", (-3000.0, 0, 0))
        sol = rom.simulate(mech, t_end=0.02, dt=1e-5, save_every=10)
        found.append(sol.position("shaft"))
        assert rom.audit(sol).ok, rom.audit(sol)
    assert np.ptp(found[0][100:], axis=0).max() > 1e-7
    assert_allclose(found[1], found[0], atol=1e-10)


def statics(load, phase):
    """Radial displacement under a load towards angle 0, ball by ball."""
    angles = phase + 2 * np.pi * np.arange(9) / 9
    A = BALLS.curvature_distance

    def missing(x):
        depth = np.abs(A - BALLS.clearance / 2 + x * np.cos(angles)) - A
        return (BALLS.stiffness * np.maximum(depth, 0) ** 1.5) @ np.cos(angles) - load

    return brentq(missing, 0, 1e-4)


def test_free_rings_keep_momentum_and_energy_while_their_balls_roll():
    rng = np.random.default_rng(3)
    mech = free_pair(BALLS, rng)
    sol = rom.simulate(mech, t_end=0.02, dt=1e-4, method="dop853", rtol=1e-10, progress=False)
    load = np.linalg.norm(sol.element("bearing").force[:, 0], axis=1)
    assert load.max() > 10.0
    for kind in sol.momentum:
        assert np.ptp(kind, axis=0).max() < 1e-9 * np.abs(kind).max()
    assert np.abs(sol.energy.balance).max() < 1e-7 * sol.energy.total[0]


@pytest.mark.parametrize("damping", few(1, [2.0, 5.0]))
def test_damping_takes_energy_and_never_gives_any(damping):
    """Steps that are too long for the stiff contact behind a flight are tried again, shorter."""
    mech = free_pair(BALLS, np.random.default_rng(3), damping=damping)
    sol = rom.simulate(mech, t_end=0.05, dt=1e-4, method="dop853", rtol=1e-10, progress=False)
    lost = np.diff(sol.energy.damping)
    assert (lost > -1e-8 * lost.sum()).all() and lost.sum() > 1e-4  # interpolated within steps
    assert np.abs(sol.energy.balance).max() < 1e-7 * sol.energy.total[0]


test_what_is_no_bearing_is_refused = refused(
    (lambda: replace(BALLS, ball_diameter=0.07), "no bearing has 9 balls"),
    (lambda: replace(BALLS, balls=20), "do not fit"),
    (lambda: replace(BALLS, clearance=2e-3), "clearance = 0.002 must"),
    (lambda: replace(BALLS, conformity=(0.5, 0.52)), "a groove is a little wider"),
    (lambda: replace(BALLS, contact_angle=25.0), "not below 80 degrees"),
    error=ModelError,
)


def test_rings_that_are_not_at_one_place_are_refused():
    mech = rom.Mechanism()
    mech.add_rigid("shaft", mass=1.0, inertia=(1e-2,) * 3, at=ORIGIN)
    far, add = mech.ground.marker((0, 0, 2e-3)), mech.rolling_bearing
    for other, axis, words in ((far, Z, "rings of bearing 'b' are 2 mm apart"),
                               ("ground", ORIGIN, "axis of b has length zero"),
                               ("shaft", Z, "connects body 'shaft' with itself")):  # fmt: skip
        refuses(ConfigError, words, add, "b", "shaft", other, axis=axis, bearing=BALLS)
    assert not mech.rolling_bearings


@pytest.mark.parametrize("phase", [0.0, 0.2, np.pi / 8])
def test_eight_balls_bear_a_load_one_by_one(phase):
    """Under a load along y, from which the phase counts for a bearing about z."""
    b = rom.mbs.BallBearing(8, 12.7e-3, 65e-3, clearance=5e-6)
    angles, A = phase + 2 * np.pi * np.arange(8) / 8, b.curvature_distance

    def loads(move):
        r = A - b.clearance / 2 + move[0] * np.sin(-angles) + move[1] * np.cos(angles)
        return b.stiffness * np.maximum(np.abs(r) - A, 0) ** 1.5

    def missing(move):
        Q = loads(move)
        return [Q @ np.sin(-angles), Q @ np.cos(angles) - 2000.0]

    wanted = root(missing, [0.0, 2e-5], tol=1e-14).x
    mech = bearing(b, (0, 2000.0, 0), phase=phase)
    state = resting(mech)
    found = rom.snapshot(mech, state).position("shaft")[0, :2]
    assert_allclose(found, wanted, rtol=1e-5, atol=1e-12)
    packed, W = prepared(mech)
    residual_at(packed.system, W, state.q, state.v, 0 * state.v, np.zeros(0))
    found = packed.elements[ROLLING_BEARINGS_FAMILY].load[0]
    assert found == pytest.approx(loads(wanted).sum(), rel=1e-5)
