"""Blades that differ: the whole wheel, exactly; Whitehead's bound; finite elements."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import rom
from cases.refusals import refuses
from cases.wheels import bladed_model, bladed_ring, response_of, tip_of
from rom.components.wheels.blades.mistuning import whitehead
from rom.errors import ConfigError, ModelError

FORCE = np.array([0.0, 1.0, 0.0])
SWEEP = {"engine_order": 3, "omega": np.linspace(5.4e3, 6.4e3, 201), "damping": 1e-3, "at": [1]}


def spread(rng, shape, width=0.05):
    return rng.uniform(-width, width, shape)


def whole_wheel(ring, delta):
    K_j = [ring.K + d * ring.regions["blade"] for d in delta]
    _, M, K = ring.wheel(K_j)
    lam, Phi = eigh(K.toarray(), M.toarray())
    return np.sqrt(lam), Phi


@pytest.mark.parametrize("N", [2, 5, 8])
def test_all_families_give_the_whole_wheel(N):
    ring, delta = bladed_ring(N), spread(np.random.default_rng(N), N, 0.3)
    exact, _ = whole_wheel(ring, delta)
    omega, _ = rom.mistuned_wheel(ring, 2).modes(delta)
    assert_allclose(omega, exact, rtol=1e-10)


@pytest.mark.parametrize("order", [0, 2, 3, 11])
def test_the_response_is_that_of_the_whole_wheel(order):
    """Same modal damping, forces with the phase of the engine order on each blade."""
    ring, delta = bladed_ring(8), spread(np.random.default_rng(1), 8, 0.1)
    sweep = np.array([1.0e3, 5.7e3, 6.1e3, 6.3e3])
    drive = {"engine_order": order, "damping": 2e-3, "at": [1]}
    exact = response_of(ring, whole_wheel(ring, delta), FORCE, sweep, **drive)
    found = rom.mistuned_wheel(ring, 2).response(delta, FORCE, omega=sweep, **drive)
    assert_allclose(found, exact, rtol=1e-9, atol=1e-12 * abs(exact).max())


def test_equal_blades_amplify_nothing_and_the_certificate_compares_with_others():
    """All blades 5 % stiffer or softer is again one sector, which is solved without the waves."""
    wheel = rom.mistuned_wheel(bladed_ring(12), 2)
    assert wheel.certificate.ok and len(wheel.certificate.rows) == 4
    assert not replace(wheel, blade=0.5 * wheel.blade).certificate.ok
    assert_allclose(wheel.amplification(np.zeros((2, 12)), FORCE, **SWEEP), [1.0, 1.0])
    shifted = wheel.modes(np.full(12, 0.02))[0]
    exact, _ = whole_wheel(bladed_ring(12, k_blade=1.02 * 4.3e5), np.zeros(12))
    assert_allclose(shifted, exact, rtol=1e-10)


def test_random_blades_amplify_up_to_whiteheads_bound():
    N = 12
    wheel = rom.mistuned_wheel(bladed_ring(N), 2)
    factors = wheel.amplification(spread(np.random.default_rng(3), (400, N), 0.04), FORCE, **SWEEP)
    assert factors.shape == (400,)
    assert 1.3 < factors.max() < 1.02 * whitehead(N)
    assert 1.0 < np.median(factors) < factors.max()
    assert_allclose(whitehead(16), 2.5)


def test_batches_and_norms_do_not_matter(monkeypatch):
    wheel = rom.mistuned_wheel(bladed_ring(6), 2)
    deltas = spread(np.random.default_rng(2), (7, 6))
    whole = wheel.amplification(deltas, FORCE, **SWEEP)
    monkeypatch.setattr("rom.components.wheels.blades.mistuning.AT_ONCE", 1)
    assert_allclose(wheel.amplification(deltas, FORCE, **SWEEP), whole, rtol=1e-12)
    rows = np.array([[0.0, 0.6, 0.0], [0.0, 0.8, 0.0]])
    assert_allclose(wheel.amplification(deltas, FORCE, **SWEEP | {"at": rows}), whole, rtol=1e-12)


def test_wrong_arguments_are_named():
    wheel = rom.mistuned_wheel(bladed_ring(6), 1)
    refuses(ConfigError, r"6 above -1", wheel.modes, np.zeros(5))
    refuses(ConfigError, r"6 above -1", wheel.modes, np.full(6, -1.5))
    words = r"no region 'wing'; it has \['blade'\]"
    refuses(ConfigError, words, rom.mistuned_wheel, bladed_ring(6), 1, blade="wing")
    refuses(ConfigError, r"2 forces for", wheel.amplification, np.zeros(6), np.ones(2), **SWEEP)
    refuses(ConfigError, "tuned wheel at", wheel.amplification, np.zeros(6), 0 * FORCE, **SWEEP)
    weak = replace(wheel, blade=50 * wheel.blade)
    refuses(ModelError, "without stiffness", weak.modes, np.full(6, -0.9))


@pytest.mark.fenicsx
@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
@pytest.mark.filterwarnings("ignore:Number of integration points")
def test_a_mistuned_wheel_of_finite_elements():
    N = 6
    model = bladed_model(N, degree=1, cells=(4, 2, 3, 2))
    sector = rom.CyclicSector.from_model(model, fixed=("bore",), regions=("blade",))
    delta = spread(np.random.default_rng(5), N, 0.08)
    omega, Phi = whole_wheel(sector, delta)
    at = [tip_of(model) + 2]
    force, drive = np.eye(sector.n)[at[0]], {"engine_order": 2, "damping": 2e-3}
    sweep = np.linspace(0.94, 1.05, 600) * omega[N // 2]
    exact = response_of(sector, (omega, Phi), force, sweep, at=at, **drive)
    small = rom.reduce_sector(sector, n_modes=40, functions=rom.Polynomial(4))
    for one, tolerance in ((sector, 1e-3), (small, 1e-2)):
        wheel = rom.mistuned_wheel(one, 3)
        assert_allclose(wheel.modes(delta)[0][: 2 * N], omega[: 2 * N], rtol=0.02 * tolerance)
        f, rows = (small.Psi.T @ force, small.Psi[at]) if one is small else (force, at)
        found = wheel.response(delta, f, omega=sweep, at=rows, **drive)
        assert_allclose(abs(found).max(axis=0), abs(exact).max(axis=0), rtol=tolerance)
