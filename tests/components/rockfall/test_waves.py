"""Waves in the sand: closed forms of pulses, and a chain of masses and springs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.refusals import refused
from rom.components.rockfall import Layer, arriving, wave_delay
from rom.errors import ConfigError

DELAY = 0.01  # s


def sampled(shape, end=0.3, n=30001):
    t = np.linspace(0.0, end, n)
    return t, shape(t)


def below_a_chain(t, force, reflection, n=300):
    """The floor's force by central differences on n masses and springs; a dashpot is the floor.

    A column of length and speed one has the impedance one; a floor of the impedance Z gives back
    the share (Z - 1) / (Z + 1).
    """
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
    return np.interp(t, times * DELAY, out)


@pytest.mark.parametrize("reflection", [0.0, 0.5, 1.0])
def test_what_arrives_is_what_a_chain_of_masses_and_springs_passes_on(reflection):
    t, force = sampled(lambda t: np.where(t < 0.05, np.sin(np.pi * t / 0.05) ** 2, 0.0), n=3001)
    found = arriving(t, force, DELAY, reflection=reflection)
    assert_allclose(found, below_a_chain(t, force, reflection), atol=0.02)


def test_a_force_that_stays_is_doubled_and_gone_in_turns():
    """A step on an undamped column: 2 from the first to the third delay, 0 to the fifth."""
    t, force = sampled(np.ones_like)
    found, turn = arriving(t, force, DELAY), np.floor((t / DELAY + 1e-9 + 1) / 2) % 2
    between = np.abs((t / DELAY) % 2 - 1) > 1e-6
    assert_allclose(found[between], 2 * turn[between], atol=1e-9)
    half = arriving(t, force, DELAY, reflection=0.5)
    assert half.max() == pytest.approx(1.5)
    assert half[-1] == pytest.approx(1.0, abs=1e-4)  # statics: what acts on top arrives


def test_a_force_that_grows_over_a_period_of_the_column_does_not_overshoot():
    """Four delays: waves of the beginning and the end of the ramp cancel for good."""
    t, force = sampled(lambda t: np.minimum(t / (4 * DELAY), 1.0))
    found = arriving(t, force, DELAY)
    assert found.max() == pytest.approx(1.0, abs=1e-9)
    assert_allclose(found[t > 3 * DELAY], 1.0, atol=1e-9)


def test_short_pulses_are_doubled_and_long_ones_arrive_as_they_are():
    """Half sines: doubled as long as the peak arrives before the first wave is back, T < 4 tau."""
    for T in (0.5 * DELAY, 2 * DELAY, 4 * DELAY):
        t, force = sampled(lambda t, T=T: np.where(t < T, np.sin(np.pi * t / T), 0.0))
        assert arriving(t, force, DELAY).max() == pytest.approx(2.0, rel=1e-4)
    t, force = sampled(lambda t: np.sin(np.pi * t / 3.0), end=3.0)
    assert arriving(t, force, DELAY).max() == pytest.approx(1.0, abs=0.02)
    # between: 4 cos(w (t - 2 tau)) sin(w tau) of one reflection, and 2 sin(2 w tau) before it
    for share, exact in ((6, np.sqrt(3)), (10, 2 * np.sin(np.pi / 5))):
        T = share * DELAY
        t, force = sampled(lambda t, T=T: np.where(t < T, np.sin(np.pi * t / T), 0.0))
        assert arriving(t, force, DELAY).max() == pytest.approx(exact, rel=1e-4)


def test_the_delay_of_a_layer_is_that_of_its_bar_wave():
    """E = 25 MPa and 1800 kg/m^3 have 117.85 m/s."""
    sand = Layer(25e6, 0.7, 0.9)
    assert wave_delay(sand) == pytest.approx(0.9 / 117.851, rel=1e-5)
    assert wave_delay(sand, 0.3) == pytest.approx(0.6 / 117.851, rel=1e-5)


test_what_cannot_arrive_is_named = refused(
    (lambda: arriving([0, 1], [1.0], 0.1), "2 instants with 1 forces"),
    (lambda: arriving([0, 0], [1.0, 1.0], 0.1), "instants that grow"),
    (lambda: arriving([0, 1], [1.0, 1.0], 0.0), "delay"),
    (lambda: arriving([0, 1], [1.0, 1.0], 1e-9), "passages of a wave of 1e-09 s in 1 s"),
    (lambda: arriving([0, 1], [1.0, 1.0], 0.1, reflection=1.5), "reflection = 1.5"),
    (lambda: wave_delay(Layer(25e6, 0.7, 0.9), 1.0), r"d \[m\] = 1 must be"),
    error=ConfigError,
)
