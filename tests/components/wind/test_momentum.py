"""Momentum balance of a rotor: against the balance itself, another solution, and publications."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.refusals import refused
from rom import rotation
from rom.components.wind import blading, rotor_load
from rom.components.wind.blading import BETZ_LIMIT, CHORD, TOWER_TUBE, slope_of_wind, wind_at
from rom.components.wind.control import power_curve, steady
from rom.components.wind.momentum import skewed
from rom.components.wind.profiles import Profile, profile, profiles
from rom.components.wind.whole_turbine import turbine
from rom.errors import ConfigError

COMPILED = wind_at, slope_of_wind, skewed
WIND_AT, SLOPE_OF_WIND, SKEWED = (getattr(f, "py_func", f) for f in COMPILED)
DESIGN_RATIO = 7.55  # speed of the tip over that of the wind at the largest power, report p. 19


def straight(**options):
    return blading(tilt=0.0, cone=0.0, **options)


def tip_ratio(ratio, wind=8.0):
    return ratio * wind / 63.0


def loss(r, phi, blades=3, R=63.0, hub=1.5):
    """Prandtl's factor as in Hansen, equation 6.34, and its likeness at the hub."""
    s = np.abs(np.sin(phi))
    tip = np.exp(-blades / 2 * (R - r) / (r * s))
    root = np.exp(-blades / 2 * (r - hub) / (hub * s))
    return (2 / np.pi) ** 2 * np.arccos(tip) * np.arccos(root)


def balances(blades, load):
    """Thrust and torque of strips over those that rings of air lose; beyond a = 0.4 as Buhl."""
    normal, driving, through, across, _, a = load.strip[0].T
    r, V = blades.radius, load.wind
    phi = np.arctan2(through, across)
    F = loss(r, phi)
    C_T = 3 * normal / (0.5 * 1.225 * V**2 * 2 * np.pi * r)
    ideal = np.where(a <= 0.4, 4 * a * F * (1 - a),
                     8 / 9 + (4 * F - 40 / 9) * a + (50 / 9 - 4 * F) * a**2)  # fmt: skip
    swirl = across - load.speed * r  # tangential velocity that the rotor gives to the air there
    gained = 4 * np.pi * r * 1.225 * through * swirl * F
    return C_T, ideal, 3 * driving, gained


@pytest.mark.parametrize("ratio", [2.0, 4.0, 7.0, DESIGN_RATIO, 9.0, 12.0, 16.0])
def test_loads_of_strips_are_the_momentum_that_rings_of_air_lose(ratio):
    blades = straight()
    load = rotor_load(blades, 8.0, tip_ratio(ratio), n_azimuths=1)
    C_T, ideal, driving, gained = balances(blades, load)
    assert_allclose(C_T, ideal, atol=1e-8)
    assert_allclose(driving, gained, atol=1e-6 * np.abs(driving).max())
    a = load.strip[0, :, 5]  # beyond 0.4 by the parabola, as in outer strips of quick rotors
    assert a.max() < 1.0 and (ratio < 12 or (a > 0.4).sum() >= 5)


def test_inductions_are_those_of_the_usual_iteration():
    """Hansen's algorithm with relaxation: another way to the same point, where it converges."""
    blades, V, speed = straight(), 8.0, tip_ratio(DESIGN_RATIO)
    found = rotor_load(blades, V, speed, n_azimuths=1).strip[0]
    for j in range(4, 17):
        r, one = blades.radius[j], blades.profile[j]
        a, b = 0.2, 0.0
        for _ in range(3000):
            phi = np.arctan2((1 - a) * V, (1 + b) * speed * r)
            attack = phi - blades.twist[j]
            lift, drag = (np.interp(attack, one.angle, x) for x in (one.lift, one.drag))
            s, c, F = np.sin(phi), np.cos(phi), loss(r, phi)
            solid = 3 * CHORD[j] / (2 * np.pi * r)
            C_T = solid * (1 - a) ** 2 * (lift * c + drag * s) / s**2
            new = 0.5 * (1 - np.sqrt(max(1 - C_T / F, 0.0)))
            if new > 0.4:
                root = C_T * (50 - 36 * F) + 12 * F * (3 * F - 4)
                new = (18 * F - 20 - 3 * np.sqrt(root)) / (36 * F - 50)
            a += 0.1 * (new - a)
            b += 0.1 * (1 / (4 * F * s * c / (solid * (lift * s - drag * c)) - 1) - b)
        assert_allclose(found[j, 5], a, rtol=1e-6)
        assert_allclose(found[j, 3], (1 + b) * speed * r, rtol=1e-8)


def test_power_is_below_betz_everywhere_and_near_the_published_peak():
    """Report: 0.482 at a tip-speed ratio of 7.55 without pitch; below Betz at any of both."""
    blades = blading()
    ratios, pitches = np.arange(1.0, 18.0, 0.5), np.radians(np.arange(-10.0, 30.0, 2.5))
    for x, p in product(ratios, pitches):
        load = rotor_load(blades, 8.0, tip_ratio(x), p, n_azimuths=6)
        assert load.power_coefficient < BETZ_LIMIT
    best = rotor_load(blades, 8.0, tip_ratio(DESIGN_RATIO))
    assert_allclose(best.power_coefficient, 0.482, rtol=0.01)
    for x, p in product((6.5, 7.55, 8.6), np.radians((-2.0, 0.0, 2.0))):
        other = rotor_load(blades, 8.0, tip_ratio(x), p)
        assert other.power_coefficient <= best.power_coefficient
    # 8 m/s at 9.1311 turns a minute, rows of a published run of OpenFAST
    load = rotor_load(blades, 7.924, 9.1311 * np.pi / 30)
    assert_allclose([load.power_coefficient, load.thrust_coefficient], [0.4907, 0.7928], rtol=0.015)


def test_no_state_of_a_rotor_lets_the_search_fail():
    rng, blades = np.random.default_rng(3), straight()
    balanced = 0
    for _ in range(400):
        V, speed = rng.uniform(0.1, 60.0), rng.choice([0.0, 1e-9, 1.0]) * rng.uniform(0.0, 4.0)
        load = rotor_load(blades, V, speed, rng.uniform(-np.pi, np.pi), n_azimuths=1)
        assert np.isfinite(load.strip).all()
        C_T, ideal, _, _ = balances(blades, load)
        a = load.strip[0, :, 5]
        usual = (a > -1.0) & (a < 1.0) & (load.strip[0, :, 3] > 0.0)
        size = np.abs(C_T[usual]).max(initial=1.0)
        assert_allclose(C_T[usual], ideal[usual], atol=1e-6 * size)
        balanced += usual.sum()
    assert balanced > 1500


@pytest.mark.parametrize("pitch", [-1.0, -0.3, 0.0, 0.3, 1.0, 1.5])
def test_loads_do_not_jump_where_a_rotor_starts(pitch):
    for yaw in (0.0, 0.3):
        loads = (rotor_load(blading(), 8.0, speed, pitch, yaw=yaw) for speed in (0.0, 1e-9))
        standing, starting = (load.strip[:, :, :2] for load in loads)
        assert_allclose(starting, standing, atol=1e-5 * np.abs(standing).max())


def test_a_turbine_starts_from_rest_in_the_wind():
    """By the published inertia of rotor and generator, 97^2 times 534.1 kg m^2 (Jonkman 2009)."""
    plant = turbine(16, tower_segments=0, gravity=0.0, wind=8.0)
    sol = rom.simulate(plant.mechanism, t_end=4.0, dt=1e-2)
    inertia = 38.76e6 + 97**2 * 534.116
    gained = inertia * sol.omega("hub")[-1] @ plant.axis / sol.t[-1]
    torque = rotor_load(blading(), 8.0, 0.0, tower=True, n_azimuths=3).torque
    assert_allclose(gained, torque, rtol=0.03)
    assert sol.statistics["iterations"] < 6 * sol.statistics["steps"]


def test_a_rotor_of_one_shape_has_coefficients_of_the_ratio_alone():
    one, other = (rotor_load(blading(), V, tip_ratio(7.0, V)) for V in (5.0, 20.0))
    assert_allclose(one.power_coefficient, other.power_coefficient, rtol=1e-9)
    assert_allclose(other.thrust / one.thrust, 16.0, rtol=1e-9)


def test_a_blade_that_is_pitched_once_round_is_the_same():
    for pitch in np.radians((-150.0, -90.0, 100.0, 170.0)):
        both = pitch, pitch - 2 * np.pi * np.sign(pitch)
        strips = (rotor_load(blading(), 8.0, 1.0, p).strip for p in both)
        here, there = (np.delete(x, 4, axis=2) for x in strips)  # but for the attack
        assert_allclose(here, there, rtol=1e-6, atol=1e-7 * np.abs(here).max())


def test_tilt_and_cone_lower_the_power_by_the_wind_that_they_miss():
    """cos^3 of the tilt times cos^2 of the cone: 0.989 and 0.998 of the power."""
    speed = tip_ratio(DESIGN_RATIO)
    both = (0.0, 0.0), (np.radians(5), 0.0), (0.0, np.radians(2.5))
    power = [rotor_load(blading(tilt, cone), 8.0, speed).power for tilt, cone in both]
    assert_allclose(power[1] / power[0], np.cos(np.radians(5)) ** 3, atol=2e-3)
    assert_allclose(power[2] / power[0], np.cos(np.radians(2.5)) ** 2, atol=2e-3)
    turned = rotor_load(blading(np.radians(5), 0.0), 8.0, speed)
    # nose up: the blade that goes down meets the wind, which has a share upward along the disc
    assert turned.strip[6, 10, 3] > turned.strip[18, 10, 3]


def test_a_blade_passes_the_dam_of_the_tower():
    speed = tip_ratio(DESIGN_RATIO)
    free, dammed = (rotor_load(blading(), 8.0, speed, tower=x) for x in (False, True))
    change = dammed.blade_torque / free.blade_torque - 1
    assert int(change.argmin()) == 12
    assert -0.25 < change[12] < -0.05
    assert_allclose(change[:6], 0.0, atol=1e-12)  # above the tower
    v = np.array([8.0, 0.0, 0.0])
    WIND_AT(TOWER_TUBE, -5.0191, 0.0, 40.0, v)
    a = 3.0 + (1.935 - 3.0) * 40.0 / 87.6
    assert_allclose(v, [8.0 * (1 - a**2 / 5.0191**2), 0.0, 0.0])
    on_face = np.array([8.0, 0.0, 0.0])
    WIND_AT(TOWER_TUBE, 0.0, 3.0 - 1.065 * 40.0 / 87.6, 40.0, on_face)
    assert_allclose(on_face, [16.0, 0.0, 0.0])  # beside a cylinder air has twice the speed


def test_the_mean_with_a_tower_is_that_of_each_strip_in_the_wind_it_meets():
    """A rotor in uniform wind, one for each place of a strip; the dam is U (1 - a^2 / Z^2)."""
    # blades pass 5.0191 m ahead of the tower's axis, its radius falls from 3 to 1.935 m in 87.6 m
    blades, V, speed, n = straight(), 8.0, tip_ratio(DESIGN_RATIO), 24
    open_wind = rotor_load(blades, V, speed, n_azimuths=1).strip[0]
    mean = np.zeros((17, 2))
    for psi in 2 * np.pi * np.arange(n) / n:
        for j, r in enumerate(blades.radius):
            y, z = -r * np.sin(psi), 87.6 + 1.96256 + r * np.cos(psi)
            row = open_wind[j]
            if z <= 87.6:
                radius = 3.0 + (1.935 - 3.0) * z / 87.6
                met = np.conj(V * (1 - radius**2 / complex(-5.0191, y) ** 2))
                turned = speed + np.cos(psi) * met.imag / r
                row = rotor_load(blades, met.real, turned, n_azimuths=1).strip[0, j]
            mean[j] += row[:2] / n
    load = rotor_load(blades, V, speed, tower=True)
    assert load.azimuth.size == n
    assert_allclose(load.thrust, 3 * mean[:, 0] @ blades.length, rtol=1e-9)
    assert_allclose(load.torque, 3 * mean[:, 1] @ (blades.radius * blades.length), rtol=1e-9)
    assert 0.97 < load.torque / rotor_load(blades, V, speed).torque < 0.995


def test_the_control_knows_of_the_tower():
    for wind, ratio in ((8.0, 0.9975), (15.0, 1.0)):
        free, dammed = (steady(wind, tower=x) for x in (False, True))
        assert_allclose(dammed.power / free.power, ratio, atol=1e-3 if wind < 11 else 1e-9)
        assert dammed.pitch < free.pitch if wind > 11 else dammed.power < free.power
    curve = power_curve([8.0, 15.0], tower=True)
    expected = [0.944 * steady(wind, tower=True).power for wind in (8.0, 15.0)]
    assert_allclose(curve["power"], expected)


def test_every_strip_meets_the_wind_of_its_place():
    tilt, cone, speed = np.radians(8.0), np.radians(4.0), 1.0
    blades = blading(tilt, cone)
    load = rotor_load(blades, 9.0, speed, tower=True, skew=False, n_azimuths=12)
    lean, back = (rotation.matrix(rotation.exp(x)) for x in ([0, tilt, 0], [0, -cone, 0]))
    hub = np.array([0.0, 0.0, 87.6 + 1.96256]) - 5.0191 * lean[:, 0]
    loads, lengths = np.zeros((12, 2)), blades.length
    for i in range(12):
        A = lean @ rotation.matrix(rotation.exp([load.azimuth[i], 0.0, 0.0])) @ back
        for j in (9, 14):
            place = hub + A @ [0.0, 0.0, blades.radius[j]]
            v = np.array([9.0, 0.0, 0.0])
            WIND_AT(TOWER_TUBE, *place, v)
            moved = np.cross(speed * lean[:, 0], place - hub)
            _, driving, through, across, _, a = load.strip[i, j]
            axial, tangential = (A[:, k] @ (v - moved) for k in (0, 1))
            assert_allclose(through / (1 - a), axial, rtol=1e-9)
            c, r = np.cos(cone), blades.radius[j] * np.cos(cone)
            F = loss(r, np.arctan2(through, across), R=63.0 * c, hub=1.5 * c)
            around = 3 * driving / (4 * np.pi * r * 1.225 * through * F)
            assert_allclose(across - around, tangential, rtol=1e-7)
        for j in range(17):  # thrust and torque by vectors
            force = lengths[j] * (A[:, :2] @ (load.strip[i, j, :2] * [1, -1]))
            arm = A @ [0.0, 0.0, blades.radius[j]]
            loads[i] += force @ lean[:, 0], np.cross(arm, force) @ lean[:, 0]
    assert_allclose(loads.T, [load.blade_thrust, load.blade_torque], rtol=1e-9)
    assert_allclose(3 * loads.mean(axis=0), [load.thrust, load.torque], rtol=1e-9)


def biot_savart(chi, place, n=400):
    """Velocity through the end of a skewed half-infinite cylinder of vortex rings at a place."""
    # rings of radius 1 along a line at chi: int (A + B s) / (square s^2 + 2 b s + q)^(3/2)
    t = 2 * np.pi * (np.arange(n) + 0.5) / n
    ring, element = (np.array(x) for x in ([np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]))
    arm = np.asarray(place)[:, None] - ring  # in the plane; behind it, less s (0, tan chi) and s
    along = np.array([0.0, np.tan(chi)])
    A = element[0] * arm[1] - element[1] * arm[0]
    B = element[1] * along[0] - element[0] * along[1]
    square, b, q = 1 + along @ along, -(along @ arm), (arm * arm).sum(axis=0)
    root, gap = np.sqrt(q), q * square - b * b
    by_one = (np.sqrt(square) - b / root) / gap
    by_s = (root - b / np.sqrt(square)) / gap
    return (A * by_one + B * by_s).sum() / (2 * n * np.cos(chi))


@pytest.mark.parametrize("chi", np.radians([5.0, 20.0, 45.0]))
def test_the_slope_of_the_induction_is_that_of_a_skewed_cylinder_of_vortices(chi):
    """By Biot and Savart: half a strength in the middle, and tan(chi / 2) of it per radius."""
    middle, h = abs(biot_savart(chi, (0.0, 0.0))), 1e-3
    assert_allclose(middle, 0.5, rtol=1e-6)
    ahead, behind, aside = (abs(biot_savart(chi, x)) for x in ((0.0, h), (0.0, -h), (h, 0.0)))
    slope = (ahead - behind) / (2 * h * middle)
    assert_allclose(slope, np.tan(chi / 2), rtol=1e-5)
    assert_allclose(aside, middle, rtol=1e-5)
    # and by the rotor, in which chi is 1 + 0.6 a times the angle of the wind
    strip, a = np.array([31.5, 1.0, 63.0, 1.5, 3.0]), 0.25
    for toward in (1.0, -0.3):
        through = SKEWED(strip, 8.0, 8.0 * (1 - a), chi / 1.15, toward)
        assert_allclose(through, 8.0 * (1 - a * (1 + 0.5 * slope * toward)), rtol=1e-6)


@pytest.mark.parametrize("lean", [1.3, 1.5, np.pi / 2])
def test_a_wake_leans_until_it_lies_in_the_disc(lean):
    edge, a = np.array([63.0, 1.0, 63.0, 1.5, 3.0]), 0.4
    before, behind = (SKEWED(edge, 8.0, 8.0 * (1 - a), lean, x) for x in (-1.0, 1.0))
    assert_allclose([before, behind], [8.0, 8.0 * (1 - 2 * a)], rtol=1e-12)


def aside_from(yaw, tilt=0.0, **more):
    return rotor_load(blading(tilt, 0.0), 8.0, tip_ratio(DESIGN_RATIO), yaw=yaw, **more)


@pytest.mark.parametrize(("yaw", "tilt"), [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.3), (0.3, -0.2)])
def test_a_wake_that_leans_slows_the_air_where_it_leans_to(yaw, tilt):
    """The mean over a turn stays, its first harmonic is along the wind in the disc."""
    plain, leaning = (aside_from(yaw, tilt, skew=x) for x in (False, True))
    axial = plain.strip[:, 12, 2] / (1 - plain.strip[:, 12, 5])
    assert_allclose(axial, 8.0 * np.cos(yaw) * np.cos(tilt), rtol=1e-12)
    change = leaning.strip[:, 12, 5] / plain.strip[:, 12, 5] - 1
    in_disc = np.array([np.cos(yaw) * np.sin(tilt), np.sin(yaw)])  # up and to the second axis
    lean = np.arctan2(np.hypot(*in_disc), np.cos(yaw) * np.cos(tilt))
    chi = (1 + 0.6 * plain.strip[:, 12, 5]) * lean
    r, psi = blading().radius[12] / 63.0, plain.azimuth
    blade = np.array([np.cos(psi), -np.sin(psi)])
    toward = in_disc @ blade / np.hypot(*in_disc)
    assert_allclose(change, np.tan(chi / 2) * r * toward, rtol=1e-9, atol=1e-12)
    assert np.abs(change).max() > 0.05


@pytest.mark.parametrize("yaw", [0.35, -0.35])
def test_a_leaning_wake_turns_the_rotor_into_the_wind(yaw):
    """More thrust on the side that the wind meets first: moments about the upright axis."""
    blades, moments = straight(), []
    for load in (aside_from(yaw, skew=x) for x in (False, True)):
        arm = blades.radius * blades.length @ load.strip[:, :, 0].T
        moments.append(3 * (arm @ np.sin(load.azimuth)) / arm.size)
    assert (moments[1] - moments[0]) * np.sign(yaw) > 1e5


def test_a_rotor_aside_loses_as_its_axial_wind_does():
    """Mirrored, a side is the other; near the best ratio power falls as the cube of the cosine."""
    one, other = aside_from(0.3), aside_from(-0.3)
    assert_allclose([one.thrust, one.torque], [other.thrust, other.torque], rtol=1e-10)
    for yaw in np.radians((6.0, 11.0, 20.0)):
        ratio = aside_from(yaw).power / aside_from(0.0).power
        assert_allclose(ratio, np.cos(yaw) ** 3, rtol=1e-3)
    for name in ("thrust", "torque"):  # the tilt of the turbine, of second order
        both = (aside_from(0.0, np.radians(5.0), skew=x) for x in (False, True))
        plain, leaning = (getattr(x, name) for x in both)
        assert_allclose(leaning, plain, rtol=2e-3)
        assert leaning != plain


def test_the_dammed_wind_has_no_source_and_no_swirl():
    rng, h = np.random.default_rng(5), 1e-5
    for _ in range(10):
        place = np.append(rng.uniform(4.0, 9.0, 2) * rng.choice([-1, 1], 2), rng.uniform(5.0, 80.0))
        far, slope, numeric = np.array([7.0, 3.0, 0.5]), np.zeros((3, 3)), np.zeros((3, 3))
        SLOPE_OF_WIND(TOWER_TUBE, tuple(place), (far[0], far[1]), slope)
        for j in range(3):
            for sign in (1, -1):
                v = far.copy()
                WIND_AT(TOWER_TUBE, *(place + sign * h * np.eye(3)[j]), v)
                numeric[:, j] += sign * v / (2 * h)
        assert_allclose(slope, numeric, atol=1e-8)
        assert_allclose([slope[0, 0] + slope[1, 1], slope[0, 1] - slope[1, 0]], 0.0, atol=1e-14)


def test_tables_of_profiles_are_whole():
    given = profiles()
    assert len(given) == 8
    for one in given.values():
        assert_allclose(one.angle[[0, -1]], [-np.pi, np.pi])
        assert (np.diff(one.angle) > 0.0).all()
        assert_allclose([one.lift[0], one.drag[0]], [one.lift[-1], one.drag[-1]])
    outer = given["NACA64"]
    at = np.radians([0.0, 5.0, 9.0])
    assert_allclose(np.interp(at, outer.angle, outer.lift), [0.442, 1.011, 1.326])


def test_a_table_is_carried_on_past_stall_as_the_published_ones_were():
    """The report has Viterna's drag up to a right angle from a blade of aspect 17."""
    whole = profiles()["NACA64"]
    near = (whole.angle >= np.radians(-9.0)) & (whole.angle <= np.radians(20.0))
    cut = profile("cut", whole.angle[near], whole.lift[near], whole.drag[near])
    at = np.radians(np.arange(21.0, 90.0))
    drag = np.interp(at, whole.angle, whole.drag)
    assert_allclose(np.interp(at, cut.angle, cut.drag), drag, atol=0.1)
    assert_allclose(np.interp(np.pi / 2, cut.angle, cut.drag), 1.11 + 0.018 * 17)
    assert_allclose([cut.angle[0], cut.angle[-1]], [-np.pi, np.pi])
    assert (np.diff(cut.angle) > 0.0).all()
    # lift goes on from its last value, and flow from behind has that of the mirrored section
    end = np.radians(20.0)
    assert_allclose(np.interp(end + 1e-3, cut.angle, cut.lift), whole.lift[near][-1], atol=0.03)
    for back in (at[20:] + np.pi / 2, -at[20:] - np.pi / 2):
        lift = np.interp(back, whole.angle, whole.lift)
        assert_allclose(np.interp(back, cut.angle, cut.lift), lift, atol=0.35)
    inside = np.isin(cut.angle, whole.angle[near])
    assert_allclose(cut.lift[inside][:5], whole.lift[near][:5])
    slow = rotor_load(replace(straight(), profile=(cut,) * 17), 8.0, tip_ratio(2.0))
    assert np.isfinite(slow.strip).all()


@pytest.mark.parametrize(("first", "last"), [(-180, 20), (-120, 15), (0, 89.9), (-9, 5)])
def test_tables_of_any_extent_are_carried_on_once_round(first, last):
    angle = np.radians(np.linspace(first, last, 9))
    one = profile("any", angle, np.sin(2 * angle), 0.1 + np.sin(angle) ** 2)
    assert_allclose(one.angle[[0, -1]], [-np.pi, np.pi])
    assert (np.diff(one.angle) > 0.0).all()
    assert one.angle.shape == one.lift.shape == one.drag.shape
    assert np.isfinite(one.table).all() and (one.drag > 0.0).all()


test_what_cannot_be_is_named = refused(
    (lambda: Profile("x", np.radians([-9.0, 20.0]), np.ones(2), np.ones(2)), "from -9 to 20 deg"),
    (lambda: Profile("x", np.array([-np.pi, 1.5]), np.ones(2), np.ones(2)), "to 85.9437 deg"),
    (lambda: Profile("x", np.array([-2.0, np.pi]), np.ones(2), np.ones(2)), "from -114.592"),
    (lambda: profile("x", [0.0, 0.2], [0.0], [0.0, 0.1]), "profile 'x' has 2 angles, 1 lifts"),
    (lambda: profile("x", [0.2, 0.0], [0.0, 1.0], [0.0, 0.1]), "do not ascend"),
    (lambda: profile("x", [-10.0, 15.0], [0.0, 1.0], [0.0, 0.1]), "within -pi to pi"),
    (lambda: profile("x", [0.0, 0.2], [0.0, 1.0], [0.0, -0.1]), "drag of -0.1"),
    (lambda: profile("x", [-1.0, -0.2], [0.0, 1.0], [0.0, 0.1]), "ends at -11"),
    error=ConfigError,
)
