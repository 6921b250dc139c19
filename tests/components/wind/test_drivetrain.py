"""A rotor driven by a torque: balances of momentum and energy, twist of the shaft."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rom import rotation
from rom.components.cosserat import modes, reference, simulate
from rom.components.wind.drivetrain import (
    ROTOR_INERTIA,
    SHAFT_STIFFNESS,
    SLOW_GENERATOR_INERTIA,
    rotor,
)
from rom.components.wind.wind_turbine import blade

TORQUE, RISE = 2e6, 2.0  # N m, reached after so many seconds


def inertia_of_blades(one):
    """About the rotor axis, of three blades [kg m^2]; sections add a thousandth."""
    return 3 * one.mass @ (one.x[:, 2] ** 2)


def rigid_blade(n=8):
    one = blade(n)
    return one._replace(stretch=1e3 * one.stretch, bend=1e3 * one.bend)


def test_a_locked_generator_leaves_the_shaft_to_twist():
    one = rigid_blade()
    model = rotor(blade_rod=one)
    locked = model.free.copy()
    locked[2] = False
    f = modes(model.rod, reference(model.rod), 1, free=locked).frequencies[0]
    inertia = inertia_of_blades(one) + ROTOR_INERTIA
    assert_allclose(2 * np.pi * f, np.sqrt(SHAFT_STIFFNESS / inertia), rtol=5e-3)


@pytest.fixture(scope="module")
def run():
    model = rotor(16)
    motion = simulate(model.rod, 20.0, 0.02, free=model.free, rho_inf=0.9,
                      load=lambda t: model.torque(TORQUE * min(t / RISE, 1.0)))  # fmt: skip
    return model, motion


def test_momentum_is_the_impulse_of_the_torque(run):
    """Forces that keep generator and hub on the axis have no moment about it."""
    model, motion = run
    impulse = TORQUE * (20.0 - RISE / 2)
    assert_allclose(model.momentum(motion)[-1], impulse, rtol=1e-3)
    inertia = inertia_of_blades(blade(16)) + ROTOR_INERTIA + SLOW_GENERATOR_INERTIA
    assert_allclose(model.speeds(motion)[-200:, 0].mean(), TORQUE * (18.0 - RISE / 2) / inertia,
                    rtol=0.02)  # fmt: skip


def test_work_of_the_torque_is_energy_and_what_the_shaft_damps(run):
    """Power in, minus the damping of the shaft, whose twist rate is the difference of speeds."""
    model, motion = run
    speeds = model.speeds(motion)
    torque = TORQUE * np.minimum(motion.t / RISE, 1.0)
    lost = 6.215e6 * (speeds[:, 0] - speeds[:, 1]) ** 2
    power = torque * speeds[:, 0] - lost
    work = 0.02 * ((power[1:] + power[:-1]) / 2).sum()
    assert_allclose(3 * motion.energies().sum(axis=1)[-1], work, rtol=2e-3)
    assert np.abs(speeds[:, 0] - speeds[:, 1]).max() > 1e-3


def test_the_shaft_twists_as_the_rotor_needs(run):
    """Steady gain of speed: the shaft carries the share of hub and blades."""
    motion = run[1]
    turned = [rotation.log(rotation.multiply(p[0] * [1, -1, -1, -1], p[2])) for p in motion.p]
    inertia = inertia_of_blades(blade(16)) + ROTOR_INERTIA
    share = inertia / (inertia + SLOW_GENERATOR_INERTIA)
    assert_allclose(-np.array(turned)[-400:, 2].mean(), share * TORQUE / SHAFT_STIFFNESS, rtol=0.05)
