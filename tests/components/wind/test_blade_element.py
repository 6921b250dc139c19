"""Wind on a rotor: a strip against angles and the rotor against the sum of its strips."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.mbs.mechanisms import residual_at, tangents_at
from cases.mbs.stiff_blades import on_driven_hub, same_strips, stiff_body
from cases.refusals import refuses
from rom import rotation
from rom.components import cosserat
from rom.components.wind.blade_element import in_wind, strips
from rom.components.wind.blading import CHORD, ELEMENT_LENGTH, blading, rotor_load
from rom.components.wind.control import steady
from rom.components.wind.profiles import profiles
from rom.components.wind.whole_turbine import N_BLADES, turbine
from rom.components.wind.wind_turbine import RATED_SPEED, blade, stations
from rom.errors import ConfigError
from rom.mbs.equations.equations import retract
from rom.mbs.equations.packing import pack
from rom.mbs.kernels.work import workspace

WIND = 11.4
BLOWN = [(False, (WIND, 2.0, 0.0)), (True, (WIND, 2.0, 0.0)), (False, (1.0, 9.0, 4.0))]


def a_blade(n=6, **options):
    return in_wind(cosserat.body(blade(n)), (WIND, 0.0, 0.0), **options)


def test_strips_cover_the_blade():
    middles, length, chord, twist = strips(a_blade(96))
    assert_allclose(length.sum(), 61.5)
    assert_allclose(middles[[0, -1]], [1.5 + length[0] / 2, 63.0 - length[-1] / 2])
    assert_allclose(length @ chord, np.array(ELEMENT_LENGTH) @ CHORD, rtol=5e-3)
    table = stations()
    assert np.abs(twist).max() < np.radians(0.5) + np.abs(np.diff(table["twist_deg"])).max() / 50


def forces(packed, W, v):
    residual_at(packed.system, W, packed.q, v, np.zeros_like(v), np.zeros(3))
    return W.residual.copy()


def prepared(body, **pose):
    """A blade without weight as its equations have it: packed, and work space."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_nonlinear("blade", body, **pose)
    packed = pack(mech, whole=True)
    return packed, workspace(packed.system, 0)


def test_a_strip_has_lift_across_and_drag_along_the_air_that_reaches_it():
    """Its force, taken back from the momentum that its ring of air loses; direction and power."""
    packed, W = prepared(a_blade())  # without stress: what is left are forces of the wind
    v = np.zeros(packed.v.size)
    b = 5
    t = packed.system.bodies.v_at[b]
    v[t : t + 3] = (0.5, -55.0, 2.0)
    found = -forces(packed, W, v)[t : t + 3]
    r, length, chord, twist = (x[b] for x in strips(a_blade()))
    R = rotation.matrix(packed.q[7 * b + 3 : 7 * b + 7])
    theta = np.arctan2(R[0, 1], R[0, 0]) + twist
    # the same strip in a rotor as large, by the angle at which its momentum balances
    c = np.cos(np.radians(2.5))
    one = profiles()["NACA64"]
    axial, across = WIND - 0.5, 55.0  # the section stands in the plane: twist turns about the blade

    def of(phi):
        lift, drag = (np.interp(phi - theta, one.angle, x) for x in (one.lift, one.drag))
        s, k = np.sin(phi), np.cos(phi)
        tip, root = np.exp(-1.5 * (63 - r) / (r * s)), np.exp(-1.5 * (r - 1.5) / (1.5 * s))
        F = (2 / np.pi) ** 2 * np.arccos(tip) * np.arccos(root)
        solid = 3 * chord / (2 * np.pi * r * c)
        normal, driving = lift * k + drag * s, lift * s - drag * k
        return solid * normal / (4 * F * s**2), solid * driving / (4 * F * s * k), normal, driving

    low, high = 1e-3, 0.6
    for _ in range(80):
        phi = 0.5 * (low + high)
        loading, swirl, normal, driving = of(phi)
        through, around = axial / (1 + loading), across / (1 - swirl)
        low, high = (phi, high) if np.tan(phi) < through / around else (low, phi)
    assert loading < 2 / 3  # no correction here
    q = 0.5 * 1.225 * chord * length * (through**2 + around**2)
    assert_allclose(found[:2], [q * normal, -q * driving], rtol=1e-5)
    assert found[0] > 0  # thrust
    assert found[1] < 0  # which drives the rotor: blades move against the second axis
    assert_allclose(W.power[2], -found @ v[t : t + 3], rtol=1e-10)


@pytest.mark.parametrize("cone", [0.0, 0.3])
@pytest.mark.parametrize(("tilt", "yaw"), [(0.0, 0.0), (0.35, 0.0), (0.0, -0.4), (-0.5, 0.7)])
def test_strips_of_a_rod_have_the_loads_of_the_rotor_whose_wake_leans(tilt, yaw, cone):
    speed, n = 1.1, 24
    wind = WIND * np.array([np.cos(yaw) * np.cos(tilt), np.sin(yaw), np.cos(yaw) * np.sin(tilt)])
    one, used = in_wind(cosserat.body(blade(n)), wind, cone=cone), np.arange(4, n - 1)
    rotor = same_strips(one, used, tilt=tilt, cone=cone)
    load = rotor_load(rotor, WIND, speed, yaw=yaw, n_azimuths=4)
    for azimuth, row in zip(load.azimuth, load.strip, strict=True):
        A = rotation.matrix(rotation.exp([azimuth, 0.0, 0.0]))
        A = A @ rotation.matrix(rotation.exp([0.0, -cone, 0.0]))
        packed, W = prepared(one, orientation=A)
        v = np.zeros(packed.v.size)
        places = rotor.radius[:, None] * A[:, 2]
        v.reshape(-1, 6)[used, :3] = np.cross([speed, 0.0, 0.0], places)
        found = -forces(packed, W, v).reshape(-1, 6)[used, :3] @ A[:, :2]
        expected = rotor.length[:, None] * row[:, :2] * [1, -1]
        assert_allclose(found, expected, rtol=1e-6)


@pytest.mark.parametrize(("tower", "wind"), BLOWN)
def test_tangents_of_the_wind_are_derivatives(tower, wind):
    """By rotations, velocities, places with a tower; the last wake lies in the rotor's plane."""
    one = blade(6)  # does not bend back, so that forces are those of the wind
    one = one._replace(stretch=1e-14 * one.stretch, bend=1e-14 * one.bend)
    one, down = in_wind(cosserat.body(one), wind, tower=tower), rotation.exp([np.pi, 0, 0])
    packed, W = prepared(one, at=(-5, 1, 90), orientation=down)
    rng = np.random.default_rng(9)
    n = packed.v.size
    q = packed.q.copy()
    retract(packed.system, packed.q, 0.2 * rng.normal(size=n), q)
    v, a, lam = 20 * rng.normal(size=n), np.zeros(n), np.zeros(3)

    def difference(d, turn):
        out = []
        for sign in (1, -1):
            there, speed = q.copy(), v + (0 if turn else sign * 1e-4) * d
            if turn:
                retract(packed.system, q, sign * 1e-6 * d, there)
            residual_at(packed.system, W, there, speed, a, lam)
            out.append(W.residual.copy())
        return (out[0] - out[1]) / (2e-6 if turn else 2e-4)

    tangents_at(packed.system, W, q, v, a, lam, (0.0, 1.0, 1.0))
    C, K = W.S.copy(), W.Kt.copy()
    for of in ((0, 1, 2), (3, 4, 5)):
        d = np.zeros(n)
        d.reshape(-1, 6)[:, of] = rng.normal(size=(n // 6, 3))
        slope = difference(d, False)
        assert_allclose(C @ d, slope, atol=1e-6 * np.abs(slope).max())
        slope = difference(d, True)
        assert_allclose(K @ d, slope, atol=1e-5 * np.abs(slope).max() + 1e-3)
        assert np.abs(slope).max() > (10.0 if tower or 3 in of else 0.0)


def stiff_blade(n, wind, pitch=0.0):
    A, mech = rotation.matrix(rotation.exp([0.0, 0.0, -pitch])), rom.Mechanism(gravity=(0, 0, 0))
    body, omega = in_wind(stiff_body(n), wind, cone=0.0), A.T @ [RATED_SPEED, 0.0, 0.0]
    part = mech.add_nonlinear("blade", body, orientation=A, omega=omega)
    on_driven_hub(mech, part, RATED_SPEED)
    return mech


@pytest.mark.parametrize(("wind", "pitch"), [(8.0, 0.0), (WIND, 0.0), (20.0, 17.47)])
def test_a_stiff_rotor_in_a_mechanism_has_the_loads_of_its_strips(wind, pitch):
    pitch = np.radians(pitch)
    sol = rom.simulate(stiff_blade(24, (wind, 0.0, 0.0), pitch), t_end=2.0, dt=0.02, rho_inf=0.3)
    late = sol.t > 1.5
    load = rotor_load(blading(0.0, 0.0), wind, RATED_SPEED, pitch)
    torque = -N_BLADES * sol.drive_load("speed")[late].mean()
    thrust = N_BLADES * np.abs(sol.reaction("shaft")[late][:, 0].mean())
    assert_allclose([torque, thrust], [load.torque, load.thrust], rtol=0.016)


def test_a_stiff_rotor_in_wind_from_aside_has_the_loads_of_each_azimuth():
    n, yaw, V = 8, 0.6, 9.0
    mech = stiff_blade(n, (V * np.cos(yaw), V * np.sin(yaw), 0.0))
    sol = rom.simulate(mech, t_end=8.0, dt=0.02, rho_inf=0.3)
    rotor = same_strips(stiff_body(n))
    load = rotor_load(rotor, V, RATED_SPEED, yaw=yaw, n_azimuths=48)
    arm = load.strip[:, :, 0] @ (rotor.radius * rotor.length)
    late = sol.t > 8.0 - 2 * np.pi / RATED_SPEED
    azimuth = RATED_SPEED * sol.t[late] % (2 * np.pi)
    turned = np.interp(azimuth, load.azimuth, load.blade_torque, period=2 * np.pi)
    bent = np.interp(azimuth, load.azimuth, arm, period=2 * np.pi)
    assert_allclose(-sol.drive_load("speed")[late], turned, atol=0.01 * np.ptp(turned))
    _, across, up = sol.reaction("shaft")[late][:, 3:].T
    found = -across * np.cos(azimuth) - up * np.sin(azimuth)
    assert_allclose(found, bent, atol=0.04 * np.ptp(bent))  # its mass follows a bending of 1 cm


@pytest.mark.parametrize("wind", [8.0, 20.0])
def test_the_whole_turbine_takes_the_steady_power_on_average(wind):
    point = steady(wind, tower=True)
    state = {"wind": wind, "pitch": point.pitch, "speed": point.speed}
    whole = turbine(12, tower_segments=0, gravity=0.0, **state)
    whole.turn_by(lambda t: point.speed * t, lambda t: point.speed)
    sol = rom.simulate(whole.mechanism, t_end=12.0, dt=0.02, rho_inf=0.5)
    late = sol.t > 12.0 - 2 * np.pi / point.speed
    assert_allclose(-sol.drive_load("speed")[late].mean(), point.torque, rtol=0.04)
    thrust = np.abs(sol.reaction("shaft")[late][:, :3] @ whole.axis).mean()
    assert_allclose(thrust, point.thrust, rtol=0.04)


@pytest.mark.long
def test_the_wind_bends_the_blades_of_the_turbine_downwind():
    """Metres, as in published runs at 11.4 m/s, where the tip goes 5 to 6 m."""
    whole = turbine(16, tower_segments=8, wind=WIND, speed=RATED_SPEED)
    whole.turn_by(lambda t: RATED_SPEED * t, lambda t: RATED_SPEED)
    sol = rom.simulate(whole.mechanism, t_end=20.0, dt=0.02, rho_inf=0.6, save_every=5)
    late = sol.t > 15.0
    assert 3.0 < whole.tip(sol, 0)[late, 0].mean() < 8.0
    assert rom.audit(sol).ok


def test_wind_that_cannot_blow_is_named():
    refuses(ConfigError, "wind has shape", lambda: in_wind(cosserat.body(blade(4)), 11.4))
    refuses(ConfigError, "comes from behind", a_blade, axis=(-1.0, 0.0, 0.0))
    refuses(ConfigError, "density = 0 must be positive", a_blade, density=0.0)
