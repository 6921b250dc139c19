"""Blade and tower of the NREL 5 MW turbine: masses, frequencies, deflections, run-up."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import trapezoid

from rom import rotation
from rom.components.cosserat import equilibrium, loads, modes, reference, simulate
from rom.components.wind import wind_turbine
from rom.components.wind.wind_turbine import HUB_INERTIA, SHAFT_STIFFNESS, blade, run_up

RPM = np.pi / 30


def frequencies(rod, m=6, speed=0.0):
    spin = (speed, 0, 0)
    shape = equilibrium(rod, loads(rod), spin=spin) if speed else reference(rod)
    return modes(rod, shape, m, spin=spin).frequencies


def test_mass_of_the_blade():
    """16 845 kg before the factor; 17 740 kg is the definition."""
    table = wind_turbine.stations()
    assert len(table["eta"]) == 49
    plain = trapezoid(table["mass"], table["eta"]) * wind_turbine.BLADE_LENGTH
    assert_allclose(plain, 16844.75, rtol=1e-6)
    assert_allclose(blade(192).mass.sum(), 17608.8, rtol=1e-4)
    assert_allclose(blade(192).mass.sum(), 17740, rtol=0.01)


def test_frequencies_of_the_blade_at_rest():
    """Flap, edge, flap, edge, flap, torsion; 0.6993 Hz is no limit, as it is of few modes."""
    f = frequencies(blade(192))
    assert_allclose(f, [0.6705, 1.0567, 1.9028, 3.6556, 4.2849, 5.5761], rtol=3e-4)
    assert_allclose(f[:2], [0.6914, 1.112056], rtol=0.055)
    rigid = frequencies(blade(192, shear=1e3))
    assert_allclose(rigid, [0.6773, 1.0854, 1.9521, 3.9958, 4.5459, 5.5761], rtol=3e-4)


def test_rotation_stiffens_the_blade():
    rod = blade(96)
    slow = [frequencies(rod, 1, n * RPM)[0] for n in (3, 6, 9)]
    assert_allclose(slow, [0.6747, 0.6845, 0.7005], rtol=3e-4)
    rated = frequencies(rod, 6, wind_turbine.RATED_SPEED)
    assert_allclose(rated, [0.7229, 1.0655, 1.9651, 3.6813, 4.3467, 5.5799], rtol=3e-4)
    assert_allclose(rated[0], 0.72365, rtol=0.002)  # assumed modes with centrifugal stiffness


def test_static_deflections():
    """Own weight edgewise and flapwise; 267 kN that grow from root to tip bend it by 7 m."""
    rod = blade(96)
    for axis, tip in ((1, 0.4557), (0, 1.1465)):
        shape = equilibrium(rod, loads(rod, weight=9.80665 * np.eye(3)[axis]))
        assert_allclose((shape.x[-1] - rod.x[-1])[axis], tip, rtol=3e-3)
    eta = np.linspace(0, 1, 97)
    share = eta * np.append(np.ones(96), 0.5)
    force = np.outer(267e3 * share / share.sum(), [1.0, 0, 0])
    u = equilibrium(rod, loads(rod, force=force)).x[-1] - rod.x[-1]
    assert_allclose(u, [7.069, -0.476, -0.729], rtol=4e-3)


def test_tower():
    """Euler-Bernoulli elements of the tube with 350 t on top, alone and with gravity."""
    rod = wind_turbine.tower(60)
    assert_allclose(rod.mass.sum(), 347460, rtol=1e-3)
    stiff = rod._replace(stretch=1e2 * rod.stretch, inertia=1e-3 * rod.inertia)
    assert_allclose(frequencies(stiff)[[0, 2, 4]], [0.89136, 4.3746, 11.392], rtol=5e-3)
    for gravity, f in ((0.0, (0.33645, 3.0754)), (9.80665, (0.33071, 3.0662))):
        loaded = wind_turbine.tower(60, top=350e3)
        loaded = loaded._replace(stretch=1e2 * loaded.stretch, inertia=1e-3 * loaded.inertia)
        load = loads(loaded, weight=(0, 0, -gravity))
        shape = equilibrium(loaded, load)
        assert_allclose(modes(loaded, shape, 3, load=load).frequencies[[0, 2]], f, rtol=2e-3)


def test_the_ramp_is_smooth():
    speed, angle = wind_turbine.ramp(2.0, 20.0)
    t = np.linspace(0.01, 30, 2000)
    slope = [(angle(s + 1e-5) - angle(s - 1e-5)) / 2e-5 for s in t]
    assert_allclose(slope, [speed(s) for s in t], atol=1e-8)
    assert_allclose([speed(20.0), angle(20.0)], [2.0, 20.0])


def test_run_up_converges_to_the_lag_of_a_fine_blade():
    coarse, fine = (run_up(blade(n), t_end=t) for n, t in ((24, 11.0), (48, 22.0)))
    lag = coarse.tip[:, 1].max(), fine.tip[:, 1].max()
    assert_allclose(lag, [0.25587, 0.25182], rtol=4e-3)
    assert_allclose(lag[1] + (lag[1] - lag[0]) / 3, 0.250, atol=0.002)
    assert_allclose(fine.t[fine.tip[:, 1].argmax()], 10.07, atol=0.2)
    assert_allclose(fine.tip[:, 0].min(), -0.0492, rtol=0.02)
    at = [round(s / 0.02) for s in (5, 10, 15, 20)]
    assert_allclose(fine.tip[at, 1], [0.12641, 0.25180, 0.12470, -0.00011], atol=1e-3)
    assert_allclose(fine.tip[-50:, 2].mean(), 14.02e-3, rtol=0.01)


def test_gravity_shakes_a_turning_blade_once_a_turn():
    """Edgewise one g times the amplification 1 / (1 - (speed / first edge)^2); its moment."""
    run = run_up(blade(24), t_end=40.0, gravity=9.80665, dt=0.04)
    edge = run.tip[run.t > 30, 1]
    assert_allclose((edge.max() - edge.min()) / 2, 0.468, rtol=0.03)
    assert_allclose(np.abs(run.tip[:, 1]).max(), 0.6515, rtol=0.03)
    late = run.t > 25
    rod = run.motion.rod
    moment = 9.80665 * (rod.mass @ rod.x[:, 2]) * np.sin(run.angle[late])
    assert np.abs(run.torque[late] + moment).max() < 0.15 * moment.max()


@pytest.mark.parametrize("azimuth", [0.0, 2 * np.pi / 3])
def test_blades_of_one_rotor_are_alike(azimuth):
    one = run_up(blade(12, azimuth=azimuth), t_end=4.0, dt=0.04)
    other = run_up(blade(12, azimuth=1.0), t_end=4.0, dt=0.04)
    assert_allclose(one.tip, other.tip, atol=1e-8)


def inertia_of_blades(one):
    """About the rotor axis, of three blades [kg m^2]; sections add a thousandth."""
    return 3 * one.mass @ (one.x[:, 2] ** 2)


def test_a_locked_generator_leaves_the_shaft_to_twist():
    one = blade(8)
    one = one._replace(stretch=1e3 * one.stretch, bend=1e3 * one.bend)  # hardly bends
    model = wind_turbine.rotor(blade_rod=one)
    locked = model.free.copy()
    locked[2] = False
    f = modes(model.rod, reference(model.rod), 1, free=locked).frequencies[0]
    inertia = inertia_of_blades(one) + HUB_INERTIA
    assert_allclose(2 * np.pi * f, np.sqrt(SHAFT_STIFFNESS / inertia), rtol=5e-3)


def test_torque_gives_momentum_and_energy_and_twists_the_shaft():
    """Forces that keep generator and hub on the axis have no moment about it."""
    torque, rise = 2e6, 2.0  # N m, reached after so many seconds
    model = wind_turbine.rotor(16)
    load = lambda t: model.torque(torque * min(t / rise, 1.0))  # noqa: E731
    motion = simulate(model.rod, 20.0, 0.02, free=model.free, rho_inf=0.9, load=load)
    assert_allclose(model.momentum(motion)[-1], torque * (20.0 - rise / 2), rtol=1e-3)
    rotor = inertia_of_blades(blade(16)) + HUB_INERTIA
    whole = rotor + wind_turbine.SLOW_GENERATOR_INERTIA
    speeds = model.speeds(motion)
    assert_allclose(speeds[-200:, 0].mean(), torque * (18.0 - rise / 2) / whole, rtol=0.02)
    # power in, minus the damping of the shaft, whose twist rate is the difference of speeds
    lost = 6.215e6 * (speeds[:, 0] - speeds[:, 1]) ** 2
    power = torque * np.minimum(motion.t / rise, 1.0) * speeds[:, 0] - lost
    work = 0.02 * ((power[1:] + power[:-1]) / 2).sum()
    assert_allclose(3 * motion.energies().sum(axis=1)[-1], work, rtol=2e-3)
    assert np.abs(speeds[:, 0] - speeds[:, 1]).max() > 1e-3
    # at a steady gain of speed the shaft carries the share of hub and blades
    turned = [rotation.log(rotation.multiply(p[0] * [1, -1, -1, -1], p[2])) for p in motion.p]
    twist = rotor / whole * torque / SHAFT_STIFFNESS
    assert_allclose(-np.array(turned)[-400:, 2].mean(), twist, rtol=0.05)
