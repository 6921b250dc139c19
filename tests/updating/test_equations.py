"""Families updated by equations at their sensors, beside the method on dense matrices."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import null_space

import rom
from cases.components.updating import model_of, refuse
from cases.solid import STEEL, composite
from rom.components.updating.frf_data import noisy
from rom.components.updating.methods import update_by_input
from rom.components.updating.models import AtSensors, Measurement, ParametricModel, modal
from rom.components.updating.normal_equations import in_sensors, responses_at
from rom.updating import Channels, Responses

PARAMETERS = {f"E_{name}": rom.YoungsModulus(name, 0.3, 3.0) for name in ("inner", "outer")}
PARAMETERS |= {"rho_outer": rom.Density("outer", 0.5, 2.0)}
TRUE = np.array([1.15, 0.85, 1.1])
NODES, DRIVEN = (8, 9, 10, 13, 14, 16, 19), 5
LINES = np.linspace(20, 1400, 120)
OMEGA = 2 * np.pi * LINES
AVERAGES = 100
BY_EQUATIONS = {"fixed": ("root",), "residual": "equations"}


@pytest.fixture(scope="module")
def model():
    parts = {"inner": STEEL, "outer": STEEL}
    return composite(parts, lambda c: "inner" if c[0] < 2 else "outer", cells=(4, 1, 1))


@pytest.fixture(scope="module")
def family(model):
    options = {"interfaces": {"root": "full", "tip": "full"}, "certify": False}
    method = rom.CraigBampton(36)
    return rom.reduce_parametric(model, parameters=PARAMETERS, method=method, **options)


def channels(model, sign=1.0):
    """Two directions at seven nodes; a force at one of these."""
    axes = np.tile([[0, 1, 0], [0, 0, 1]], (len(NODES), 1))
    sensors = Channels(np.repeat(model.points[list(NODES)], 2, axis=0), axes)
    force = Channels(sensors.points[DRIVEN], sign * axes[DRIVEN])
    return sensors, force


def small(family, model, sign=1.0):
    return model_of(family, channels(model, sign), ("root",))


def measured(family, model, *, level=0.0, sign=1.0, H=None, seed=0):
    sensors, force = channels(model, sign)
    if H is None:
        H = responses_at(small(family, model, sign), np.log(TRUE), np.array([0.02]), OMEGA)
    H = noisy(H, level, np.random.default_rng(seed)) if level else H
    coherence = 1 - np.random.default_rng(1).uniform(0.001, 0.2, H.shape)
    return Responses(LINES, H, sensors, force, coherence, AVERAGES)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_equations_find_what_they_find_on_dense_matrices(family, model, sign):
    """Logarithms of factors here, changes there: the same minimum; a force may point backwards."""
    test = measured(family, model, level=0.01, sign=sign)
    found = rom.update(family, test, damping=0.02, **BY_EQUATIONS)
    m = found.covariance.shape[0] - 3
    weights = 1 / test.noise.errors().own
    there = Measurement(OMEGA, sign * test.H, (DRIVEN,), weights)
    # the finite elements, clamped, with the nodes' dofs as sensors; changes of p are linear
    free = np.setdiff1d(np.arange(3 * len(model.points)), model.interfaces["root"].dofs)
    K, M = (getattr(model, name).toarray()[np.ix_(free, free)] for name in "KM")
    parts = [model.regions[name] for name in ("inner", "outer", "outer")]
    dK = np.array([part.K.toarray()[np.ix_(free, free)] for part in parts])
    dM = np.array([part.M.toarray()[np.ix_(free, free)] for part in parts])
    dK[2], dM[:2] = 0.0, 0.0
    dofs = [3 * n + axis for n in NODES for axis in (1, 2)]
    seen = np.eye(3 * len(model.points))[dofs][:, free]
    dense = AtSensors(ParametricModel(K, M, dK, dM, seen))
    same = update_by_input(dense, there, np.zeros(3), np.full(m, 0.02), rank=m)
    factors = np.array(list(found.factors.values()))
    assert_allclose(factors, 1 + same.p, rtol=1e-8)
    assert_allclose(found.zeta[:m], same.zeta, rtol=1e-7)
    assert len(found.names) == 3 + m
    scale = np.r_[factors, np.ones(m)]
    covariance = found.covariance * np.outer(scale, scale)
    assert_allclose(covariance, same.covariance, rtol=1e-5, atol=1e-12)


def test_condensed_matrices_have_the_derivatives_of_a_complex_step(family, model):
    x = np.array([0.2, -0.1, 0.15])
    here = small(family, model)
    basis = np.hstack([np.linalg.pinv(here.sensors), null_space(here.sensors)])
    found, n_s = AtSensors(in_sensors(here, x, np.ones(3, bool))).at(x), len(here.sensors)

    def condensed(x):
        k, m = (np.prod(np.exp(x) ** p, axis=1) for p in (here.k_powers, here.m_powers))
        K, M = (basis.T @ np.tensordot(c, A, 1) @ basis for c, A in ((k, here.K), (m, here.M)))
        T = np.vstack([np.eye(n_s), -np.linalg.solve(K[n_s:, n_s:], K[n_s:, :n_s])])
        return T.T @ K @ T, T.T @ M @ T

    K, M = condensed(x)
    assert_allclose(found.K, K, atol=1e-9 * np.abs(K).max())
    assert_allclose(found.M, M, atol=1e-9 * np.abs(M).max())
    for j in range(3):
        expected = condensed(x + 1e-30j * (np.arange(3) == j))
        for dA, A in zip((found.dK[j], found.dM[j]), expected, strict=True):
            assert_allclose(dA, A.imag / 1e-30, atol=1e-9 * np.abs(A).max())


def condensed(family, model, x, **made):
    """A test of the condensed model itself at logarithms x: its equations have no bias."""
    own = AtSensors(in_sensors(small(family, model), x, np.ones(3, bool))).at(x)
    modes = modal(own, np.full(4, 0.02))
    H = np.einsum("sn,fn,n->fs", modes.Phi, modes.g(OMEGA), modes.Phi[DRIVEN])
    return measured(family, model, H=H[:, :, None], **made)


def test_only_what_is_sought_moves_and_stays_in_its_range(family, model):
    """One density is right and kept; of the model's own condensed responses nothing is left."""
    x = np.log([1.15, 0.85, 1.0])
    test = condensed(family, model, x)
    found = rom.update(family, test, free=("E_inner", "E_outer"), **BY_EQUATIONS)
    assert found.factors["rho_outer"] == 1.0 and found.names[:2] == ("E_inner", "E_outer")
    assert_allclose(list(found.factors.values()), np.exp(x), rtol=1e-6)
    narrow = dict(PARAMETERS, E_inner=rom.YoungsModulus("inner", 0.9, 1.05))
    test = measured(family, model)
    found = rom.update(replace(family, parameters=narrow), test, **BY_EQUATIONS)
    assert found.at_bound == ("E_inner",) and found.factors["E_inner"] == pytest.approx(1.05)


def test_lines_are_summed_in_blocks(family, model, monkeypatch):
    test = measured(family, model, level=0.01)
    whole = rom.update(family, test, damping=0.02, **BY_EQUATIONS)
    monkeypatch.setattr("rom.components.updating.methods.BLOCK_LINES", 7)
    pieces = rom.update(family, test, damping=0.02, **BY_EQUATIONS)
    assert_allclose(list(pieces.factors.values()), list(whole.factors.values()), rtol=1e-9)
    assert_allclose(pieces.covariance, whole.covariance, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("residual", ["equations", "response-function", "responses"])
def test_a_prior_as_sure_as_the_data_halves_what_they_find(family, model, residual):
    """Mean of zero and the estimate, weighted by precision; deviation over the square root of 2."""
    if residual == "equations":
        test = condensed(family, model, np.array([2e-4, 0, 0]), level=0.01)
    else:
        x = np.array([2e-3, 0, 0])
        H = responses_at(small(family, model), x, np.array([0.02]), OMEGA)
        test = measured(family, model, H=H, level=0.05)
    options = {"fixed": ("root",), "residual": residual, "free": ("E_inner",)}
    alone = rom.update(family, test, **options)
    sure = alone.deviations["E_inner"]
    found = rom.update(family, test, prior={"E_inner": sure}, **options)
    ratio = np.log(found.factors["E_inner"]) / np.log(alone.factors["E_inner"])
    assert_allclose(ratio, 0.5, rtol=0.02)
    assert_allclose(found.deviations["E_inner"], sure / np.sqrt(2), rtol=0.02)


def test_equations_without_bias_err_as_much_as_they_say(family, model):
    """Over 20 draws of 1 % the errors over their deviations have the deviation 1 +- 0.16."""
    errors = []
    for seed in range(20):
        test = condensed(family, model, np.zeros(3), level=0.01, seed=seed)
        found = rom.update(family, test, free=("E_inner",), **BY_EQUATIONS)
        errors.append(np.log(found.factors["E_inner"]) / found.deviations["E_inner"])
    assert_allclose(np.sqrt(np.mean(np.square(errors))), 1.0, atol=0.24)


def test_the_response_function_method_finds_what_is_true(family, model):
    """No bias without noise, where equations have a per cent; 4 sensors, none at the input."""
    whole = measured(family, model)
    few = [1, 4, 7, 10]
    sensors = whole.sensors.some(few)
    test = replace(whole, H=whole.H[:, few], coherence=whole.coherence[:, few], sensors=sensors)
    found = rom.update(family, test, fixed=("root",), residual="response-function", damping=0.02)
    assert_allclose(list(found.factors.values()), TRUE, rtol=1e-8)


def by_response_functions(family, model, seed, level, step):
    """What is found by every step-th line, and its errors over deviations."""
    test = measured(family, model, level=level, seed=seed)
    c = 1 / (1 + AVERAGES * level**2)
    test = replace(test, frequencies=LINES[::step], H=test.H[::step], coherence=c)
    found = rom.update(family, test, fixed=("root",), residual="response-function")
    off = np.log(np.array(list(found.factors.values())) / TRUE)
    return found, off / [found.deviations[name] for name in PARAMETERS]


def test_the_response_function_method_has_no_bias_and_errs_as_much_as_it_says(family, model):
    """Errors over deviations of 3 factors in 8 draws of 1 %: the deviation 1 +- 0.14."""
    draws = [by_response_functions(family, model, seed, 0.01, 3) for seed in range(8)]
    assert all(found.verdict.ok for found, _ in draws)
    errors = [error for _, error in draws]
    assert_allclose(np.sqrt(np.mean(np.square(errors))), 1.0, atol=0.28)
    # twenty lines with noise of 5 % in its derivatives: the mean of 40 draws is that of chance
    errors = [by_response_functions(family, model, seed, 0.05, 6)[1] for seed in range(40)]
    assert np.abs(np.mean(errors, axis=0)).max() < 3.3 / np.sqrt(40)
    assert_allclose(np.sqrt(np.mean(np.square(errors))), 1.0, atol=0.2)


def test_the_bias_of_the_condensation_is_seen_by_the_verdict(family, model):
    test = measured(family, model, level=0.01)
    updates = rom.update(family, test, fixed=("root",)), rom.update(family, test, **BY_EQUATIONS)
    off = [np.abs(np.array(list(u.factors.values())) / TRUE - 1).max() for u in updates]
    assert off[0] < 0.01 < off[1] < 0.3
    assert not updates[1].verdict.ok


def test_what_equations_need_is_named(family, model):
    test = replace(measured(family, model), coherence=0.99)

    def updated(test=test, **options):
        return rom.update(family, test, **BY_EQUATIONS | options)

    away = replace(test, inputs=Channels([[1.0, 0.1, 0.08]], [[0, 1, 1]]))
    n, m = [*range(14), 4], [5, 4]
    twice = replace(test, H=test.H[:, n], sensors=test.sensors.some(n))
    few = replace(test, H=test.H[:, m], sensors=test.sensors.some(m))
    c = np.full(test.H.shape, 0.99)
    c[:, 3] = 0.0
    refuse(
        (lambda: updated(rank=3, residual="responses"), "rank needs"),
        (lambda: updated(rank=3, residual="response-function"), "rank needs"),
        (lambda: updated(rank=99), "rank = 99"),
        (lambda: updated(away), "input 0 has no sensor"),
        (lambda: updated(twice), "sensors (4|14) of 15 follow from others"),
        (lambda: updated(replace(test, coherence=c)), "no line counts for all"),
        (lambda: updated(few), "2 sensors for . modes"),
    )
