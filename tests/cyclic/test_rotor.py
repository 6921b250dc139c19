"""Whirl of shafts with discs on bearings against published tables.

Friswell, Penny, Garvey and Lees, Dynamics of Rotating Machines (Cambridge 2010), examples 5.9.1 to
5.9.5 and 5.9.9, pages 206 to 218, as printed in the examples that the program ROSS tests itself
with: six elements, steel of 211 and 81.2 GPa and 7810 kg/m^3, a shaft of 1.5 m by 50 mm.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from cases.refusals import refused
from rom.components.transmission import Disc, Shaft, Support, critical_speeds, shaft_whirl
from rom.errors import ModelError

STEEL = (211e9, 211e9 / (2 * 81.2e9) - 1, 7810.0)
FAST = 4000 * np.pi / 30
DISCS = {2: 0.28, 4: 0.35}


def rotor(discs=DISCS, n=6):
    rings = [Disc.of_ring(n // 6 * node, outer=d, inner=0.05, width=0.07, rho=STEEL[2])
             for node, d in discs.items()]  # fmt: skip
    return Shaft(np.linspace(0, 1.5, n + 1), 0.05, rings, STEEL)


def ends(stiffness, damping=0.0):
    return dict.fromkeys((0, 6), Support(stiffness, damping))


OVERHUNG = rotor({6: 0.35}), dict.fromkeys((0, 4), Support(1e7))


@pytest.mark.parametrize(
    ("shaft", "supports", "speed", "printed"),
    [
        (rotor(), ends(1e6), 0.0, [86.66, 86.66, 274.31, 274.31, 716.78, 716.78]),
        (rotor(), ends(1e6), FAST, [85.39, 87.80, 251.78, 294.71, 600.18, 827.08]),
        (*OVERHUNG, 0.0, [90.14, 90.14, 630.73, 630.73, 830.43, 830.43]),
        (*OVERHUNG, FAST, [76.19, 103.91, 565.99, 634.23, 647.75, 1174.2]),
        (rotor(), ends(np.diag([1e6, 8e5])), FAST, [82.33, 86.86, 239.64, 287.25, 583.49, 806.89]),
    ],
)  # fmt: skip
def test_whirl_is_as_printed(shaft, supports, speed, printed):
    found = shaft_whirl(shaft, supports, speed, n=6)
    assert_allclose(found.omega, printed, rtol=8e-5)
    if speed:
        assert list(found.direction) == 3 * [-1, 1]
        assert list(shaft_whirl(shaft, supports, -speed, n=6).direction) == 3 * [-1, 1]


def test_bearings_may_be_soft_one_way():
    """In Hz at 4000 1/min: orbits are flat, and frequencies mix."""
    found = shaft_whirl(rotor(), ends(np.diag([1e6, 2e5])), FAST, n=6)
    assert_allclose(found.frequencies, [8.545, 13.77, 22.35, 44.06, 78.76, 120.4], rtol=4e-4)
    still = shaft_whirl(rotor(), ends(np.diag([1e6, 2e5])), 0.0, n=6)
    assert not still.direction.any()


DAMPED = {  # by speed: frequencies, sizes of the eigenvalues
    0.0: ([13.89, 13.89, 46.54, 46.54, 103.22, 103.22],
          [13.91, 13.91, 48.18, 48.18, 137.06, 137.06]),
    FAST: ([13.68, 14.07, 41.98, 50.65, 104.25, 105.66],
           [13.70, 14.09, 43.61, 52.18, 122.37, 149.81]),
}  # fmt: skip


@pytest.mark.parametrize("speed", DAMPED)
def test_bearings_damp(speed):
    """Frequencies in Hz with 3 kN s/m, and sizes of the eigenvalues."""
    damped, size = DAMPED[speed]
    found = shaft_whirl(rotor(), ends(1e6, 3e3), speed, n=6)
    assert_allclose(found.frequencies, damped, rtol=5e-4)
    assert_allclose(np.abs(found.values) / (2 * np.pi), size, rtol=5e-4)
    assert_allclose(found.damping_ratios, np.sqrt(1 - (found.omega / abs(found.values)) ** 2))


def test_whirl_at_a_critical_speed_is_as_fast_as_the_shaft():
    speeds, direction = critical_speeds(rotor(), ends(1e6))
    assert np.all(np.diff(speeds) > 0)
    for speed, way in zip(speeds[:6], direction[:6], strict=True):
        found = shaft_whirl(rotor(), ends(1e6), speed)
        k = np.argmin(abs(found.omega - speed))
        assert_allclose(found.omega[k], speed, rtol=1e-9)
        assert found.direction[k] == way


def test_a_thin_disc_keeps_ahead_of_its_forward_whirl():
    """diag(m, Id -+ Ip) on a cantilever, Ip > Id: no forward speed of tilting, one backward."""
    l, d = 0.3, 0.01
    clamped = Shaft([-0.1, 0.0, l], [0.1, d], [Disc(2, 1.0, 0.01, 0.02)], (211e9, 0.3, 1e-3))
    speeds, direction = critical_speeds(clamped, dict.fromkeys((0, 1), Support(1e12)))
    E_I = 211e9 * np.pi * d**4 / 64
    k = E_I * np.array([[12 / l**3, -6 / l**2], [-6 / l**2, 4 / l]])
    exact = []
    for way in (-1, 1):
        squared = eigh(np.diag([1.0, 0.01 - way * 0.02]), k, eigvals_only=True)
        exact += [(1 / np.sqrt(x), way) for x in squared if x > 0]
    exact = sorted(exact)
    assert [way for _, way in exact] == [-1, 1, -1]
    assert_allclose(speeds[:3], [w for w, _ in exact], rtol=2e-3)
    assert list(direction[:3]) == [-1, 1, -1]


@pytest.mark.parametrize("bore", [0.0, 0.05])
def test_a_hollow_shaft_has_the_frequencies_of_timoshenko(bore):
    """Free in space, hinged at its ends, from the quartic with Cowper's share of a tube."""
    E, nu, rho = STEEL
    l, d = 1.0, 0.08
    hinged = dict.fromkeys((0, 40), Support(1e13))
    found = shaft_whirl(Shaft(np.linspace(0, l, 41), d, (), STEEL, bore), hinged, 0.0, n=6)
    A, I = np.pi / 4 * (d**2 - bore**2), np.pi / 64 * (d**4 - bore**4)
    m = (bore / d) ** 2
    kappa = 6 * (1 + nu) * (1 + m) ** 2 / ((7 + 6 * nu) * (1 + m) ** 2 + (20 + 12 * nu) * m)
    a = np.arange(1, 4) * np.pi / l
    b = 1 + a**2 * I / A * (1 + E / (kappa * 81.2e9))
    c = rho * I / (kappa * 81.2e9 * A)
    squared = (b - np.sqrt(b**2 - 4 * c * E * I * a**4 / (rho * A))) / (2 * c)
    assert_allclose(found.omega[::2], np.sqrt(squared), rtol=1e-3)


test_what_cannot_whirl_is_named = refused(
    (lambda: shaft_whirl(rotor(), {7: Support(1e6)}, 0.0), "bearing 7 must be from 0 to 6"),
    (lambda: shaft_whirl(rotor(), {3: Support(1e6)}, 0.0), "leave a rigid motion"),
    (lambda: shaft_whirl(rotor(), ends([1.0, 2.0]), 0.0), "number or"),
    (lambda: critical_speeds(rotor(), ends([[1e6, 5e5], [-5e5, 1e6]])), "not symmetric"),
    (lambda: Shaft([0.0, 1.0], 0.05, bore=0.05), "bores of 0.05 m"),
    error=ModelError,
)
