"""What is found in a hundred simulated tests: as often right as its deviations say."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import binom, chi2, kstest, norm, truncnorm

import rom
from cases.components.updating import averaged, exact_responses, family_of, gauss, model_of, refuse
from cases.long import few
from rom.components.updating.estimate import DAMPING_LOG_DEVIATION
from rom.components.updating.frf_data import estimators, pooled, positive_mean
from rom.components.updating.normal_equations import Data, sums, unsure, white
from rom.updating import Channels, Responses

PARAMETERS = {f"E_{name}": rom.YoungsModulus(name, 0.4, 2.5) for name in ("inner", "outer")}
PARAMETERS |= {"rho": rom.Density(None, 0.5, 2.0)}
TRUE = {"E_inner": 1.05, "E_outer": 0.9, "rho": 1.1}
POINTS = [[x, 0.1, 0.08] for x in (0.5, 0.75, 1.0)]
SENSORS = Channels(POINTS * 2, [[0, 1, 0]] * 3 + [[0, 0, 1]] * 3)
INPUTS = Channels([[1.0, 0.0, 0.0], [0.5, 0.1, 0.08]], [[0, 1, 1], [0, 1, -0.5]])
LINES = np.linspace(40, 160, 20)
HELD = ("root",)
AVERAGES, DRAWS = 100, 100


@pytest.fixture(scope="module")
def family():
    return family_of(PARAMETERS, (4, 2, 2), 1)


@pytest.fixture(scope="module")
def exact(family):
    return exact_responses(model_of(family, (SENSORS, INPUTS), HELD), TRUE, LINES)


def measured(exact, rng, estimator, *noise, averages=AVERAGES):
    how = {"noise": noise, "n": averages, "estimator": estimator}
    return averaged(exact, (SENSORS, INPUTS), LINES, rng, **how)


@pytest.fixture(scope="module")
def drawn(family, exact):
    """The function that gives errors over deviations (n, 3), errors, and the updates."""

    @cache
    def draw(name, on_force, on_response, n=DRAWS, seed=0, **changes):
        rng, found = np.random.default_rng(seed), []
        for _ in range(n):
            test = replace(measured(exact, rng, name, on_force, on_response), **changes)
            found.append(rom.update(family, test, fixed=HELD, damping=0.02))
        errors = np.log([[u.factors[p] / TRUE[p] for p in PARAMETERS] for u in found])
        return errors / [[u.deviations[p] for p in PARAMETERS] for u in found], errors, found

    return draw


KNOWN = {"coherence": 1 / (1 + 0.1**2)}
PLAIN = {"force_noise": 0.0, "estimator": None}  # as if no estimator had a bias
ESTIMATORS = ("H1", "H2", "Hv")
# estimator, noise of the force and of the response
NOISES = [(("H1", 0.1, 0.03), {}), (("H2", 0.03, 0.1), {}), (("Hv", 0.1, 0.1), {})]
NOISES += [(("H1", 0.0, 0.1), KNOWN), (("Hv", 0.01, 0.01), {}), (("Hv", 0.1, 0.03), {})]
# H1 is too small by 1.01, H2 too large by it; Hv by the root of their quotient
BIASED = [(("Hv", 0.2, 0.05), np.sqrt(1.04 / 1.0025)), (("H1", 0.1, 0.1), 1.01)]
BIASED += [(("H2", 0.1, 0.1), 1 / 1.01)]


@pytest.mark.parametrize(("noise", "known"), few(3, NOISES))
def test_parameters_lie_inside_two_deviations_as_often_as_they_must(drawn, noise, known):
    """Of 100 draws 95 are expected, 90 to 99 by chance; of damping ratios with their prior too."""
    scaled, _, found = drawn(*noise, **known)
    inside = np.count_nonzero(np.abs(scaled) < 2, axis=0)
    assert (inside >= 90).all() and (inside <= 99).all(), inside
    for k in (0, 1):
        ratios = [np.log(u.zeta[k] / 0.02) / u.deviations[f"zeta {k + 1}"] for u in found]
        assert np.count_nonzero(np.abs(ratios) < 2.0) >= 88
    assert np.mean([u.verdict.ok for u in found]) >= 0.95
    if noise[1] == noise[2]:  # what is left of half a variance varies as the whole one
        assert_allclose(np.mean([u.verdict.rows[0].value for u in found]), 1.0, atol=0.02)


@pytest.mark.long
@pytest.mark.parametrize("level", [0.01, 0.03, 0.1])
@pytest.mark.parametrize("name", ESTIMATORS)
@pytest.mark.parametrize("share", [(1, 1), (1, 0.3), (0.3, 1)])
def test_a_thousand_draws_lie_inside_as_often_as_they_must(drawn, name, level, share):
    """95.4 % of each factor within the band that chance leaves 999 of 1000 counts of it."""
    seed = [20261127, ESTIMATORS.index(name), round(100 * level), round(10 * share[0])]
    scaled, *_ = drawn(name, level * share[0], level * share[1], 1000, tuple(seed))
    inside = np.count_nonzero(np.abs(scaled) < 2, axis=0)
    low, high = binom.ppf([0.0005, 0.9995], 1000, 2 * norm.cdf(2) - 1)
    assert (inside >= low).all() and (inside <= high).all(), inside


@pytest.mark.parametrize(("noise", "bias"), few(1, BIASED))
def test_an_estimator_taken_for_unbiased_is_wrong_by_its_bias(drawn, noise, bias):
    """Stiffness and mass are too large by what H is too small; named, by nothing."""
    scaled, errors, _ = drawn(*noise, 15, **PLAIN)
    assert_allclose(errors.mean(axis=0)[[0, 2]], np.log(bias), rtol=0.15)
    assert np.count_nonzero(np.abs(scaled[:, [0, 2]]) < 2, axis=0).max() <= 3
    _, errors, _ = drawn(*noise, 15)
    assert np.abs(errors.mean(axis=0)[[0, 2]]).max() < 0.3 * abs(np.log(bias))


def test_total_least_squares_is_scaled_by_the_ratio_of_noise():
    """The direction of the least power of both spectra, each over its noise; no bias is left."""
    rng, n = np.random.default_rng(1), 200_000
    H, on_force, on_response = 2.0 - 1.5j, 0.5, 0.2
    f = gauss(rng, (n, 1))
    x = H * (f + on_response * gauss(rng, f.shape))
    f = f + on_force * gauss(rng, f.shape)
    _, H2, Hv, _ = estimators(x, f, on_response / on_force)
    scale = np.array([on_force, on_response * abs(H)])
    z = np.hstack([f, x]) / scale
    least = np.linalg.eigh(z.T @ z.conj())[1][:, 0]  # H f = x is normal to it
    expected = -least[0].conj() / least[1].conj() * scale[1] / scale[0]
    assert_allclose(Hv[0], expected, rtol=2e-3)
    assert_allclose(Hv[0], H, rtol=5e-3)
    assert_allclose(estimators(x, f, 0.0)[2], H2)
    H1, H2, Hv, _ = estimators(x, f)
    assert_allclose(np.abs(Hv), np.sqrt(np.abs(H1 * H2)))


def test_noise_of_a_force_that_is_taken_for_that_of_sensors_makes_deviations_too_small(drawn):
    scaled, *_ = drawn("Hv", 0.1, 0.1, 40, force_noise=0.0, estimator=None)
    assert np.count_nonzero(np.abs(scaled) < 2, axis=0).min() < 0.8 * 40


def test_chi_square_is_distributed_as_its_limits_suppose(drawn, exact):
    """Probabilities of what is left are even between 0 and 1, where coherence is known."""
    *_, found = drawn("H1", 0.0, 0.1, **KNOWN)
    freedom = 2 * exact.size - 3 - found[0].zeta.size
    value = freedom * np.array([u.verdict.rows[0].value for u in found])
    assert_allclose(value.mean() / freedom, 1.0, atol=0.02)
    assert kstest(chi2.sf(value, freedom), "uniform").pvalue > 0.02


def of_one(seed, n, lines, level):
    """H1 of as many lines of one sensor whose noise has a level, and the test."""
    rng = np.random.default_rng(seed)
    f = gauss(rng, (n, lines))
    H, _, _, c = estimators(f + level * gauss(rng, f.shape), f)
    at = Channels([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    f = np.arange(1.0, lines + 1)
    return H, Responses(f, H[:, None, None], at, at, c[:, None, None], n)


def test_estimated_coherence_has_the_expectation_of_its_averages():
    """Of few averages squared errors over estimated variances have the mean n / (n - 2)."""
    H, test = of_one(2, 12, 60_000, 0.2)
    error = test.noise.errors().own
    assert_allclose(np.mean(np.abs(np.log(H) / error[:, 0, 0]) ** 2) / 2, 1.0, atol=0.015)


def test_errors_over_the_model_leave_the_mean_of_logarithms_where_it_is():
    """Over the measured level values that are too large count more: twice the variance."""
    n = 12
    H, test = of_one(5, n, 60_000, 0.2)
    level, variance = np.log(np.abs(H))[:, None, None], 0.2**2 / (2 * (n - 1))
    for excess, bias in ((0.0, 2 * variance), (-level, 0.0)):
        weight = test.noise.errors(excess).own ** -2.0
        found = (weight * level).sum() / weight.sum()
        assert_allclose(found, bias, atol=4 * np.sqrt(variance / 60_000) + 0.1 * bias)


def test_an_update_weighs_by_the_model_it_found(family, exact):
    """Over measured levels all factors would be too small by 0.0045, which is 9 deviations."""
    rng, n = np.random.default_rng(9), 20
    lines = np.linspace(40, 160, 800)
    H = exact_responses(model_of(family, (SENSORS, INPUTS), HELD), TRUE, lines)
    f = np.broadcast_to(gauss(rng, (n, 800, 1, 2)), (n, *H.shape))
    H1, _, _, c = estimators(H * (f + 0.3 * gauss(rng, f.shape)), f)
    found = rom.update(family, Responses(lines, H1, SENSORS, INPUTS, c, n), fixed=HELD)
    for name in ("E_inner", "rho"):
        assert abs(np.log(found.factors[name] / TRUE[name])) < 3.3 * found.deviations[name]
        assert found.deviations[name] < 0.0045 / 4


def test_deviations_say_what_estimated_weights_cost(family, exact):
    """N^-1 + N^-1 Q N^-1 where the search ended; of eight averages by more than a twentieth."""
    test = measured(exact, np.random.default_rng(3), "H1", 0.0, 0.1, averages=8)
    found = rom.update(family, test, fixed=HELD, damping=0.02)
    level = np.log(np.abs(found.responses(LINES))) - test.logarithm().real
    at = sums(found.model, found.logarithms, found.zeta, Data.of(test, level))
    prior = np.diag(np.r_[np.zeros(3), np.full(found.zeta.size, DAMPING_LOG_DEVIATION**-2.0)])
    C = np.linalg.inv(at.normal + prior)
    expected = C + C @ at.varied @ C
    size = np.sqrt(np.outer(*[np.diag(expected)] * 2))
    assert_allclose(found.covariance / size, expected / size, atol=6e-3)
    assert (np.diag(found.covariance)[:3] > 1.05 * np.diag(C)[:3]).all()


def test_what_is_positive_has_the_mean_of_the_truncated_distribution():
    mean, s = np.array([-3.0, 0.0, 0.2, 4.0]), np.array([0.5, 1.0, 2.0, 0.1])
    found = positive_mean(mean, s**2)
    assert_allclose(found, truncnorm.mean(-mean / s, np.inf, loc=mean, scale=s), rtol=1e-9)
    assert positive_mean(np.array(2.0), np.array(0.0)) == 2.0


def test_noise_of_a_force_leaves_chi_square_where_it_is():
    """A fifth of the variance is left for sensors: the lines of all inputs know it to 1 %."""
    rng, n, shape = np.random.default_rng(20261127), 60, (2000, 3, 4)
    f = gauss(rng, (n, shape[0], 1, shape[2]))
    x = f + 0.05 * gauss(rng, (n, *shape))
    f = f + 0.1 * gauss(rng, f.shape)
    H, _, _, c = estimators(x, np.broadcast_to(f, x.shape))
    channels = [Channels(np.zeros((k, 3)), np.ones((k, 3))) for k in shape[1:]]
    test = Responses(np.arange(1.0, 2001), H, *channels, c, n, force_noise=0.1, estimator="H1")
    log = test.logarithm()
    e = test.noise.errors(-log.real)
    left = white(log[..., None], 1 / e.own, e.common)
    assert_allclose(np.mean(np.abs(left) ** 2) / 2, 1.0, atol=0.02)


def incoherent(x, n, rng):
    """Power of all that is incoherent over that of the force's noise, and of the sensor's own."""
    p = (n - 1) / rng.gamma(n, size=(len(x), 1, 1))
    return (1 + x) * p * rng.gamma(n - 1, size=x.shape) / (n - 1), x * p


@pytest.mark.parametrize("n", [12, 20, 100])
@pytest.mark.parametrize("spread", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("level", [0.3, 2.0, 30.0])
def test_sensors_know_their_noise_without_bias(level, spread, n):
    """Lines alike and lines that differ by a factor: own noise over what is found of it is one."""
    rng, ratios = np.random.default_rng([n, int(10 * spread), int(10 * level)]), []
    for _ in range(40):
        x = level * np.exp(spread * rng.standard_normal((100, 3, 1)))
        total, own = incoherent(x, n, rng)
        found, variance, shared = pooled(total, np.ones(x.shape, bool), n)
        assert (shared <= variance).all() and (found > 0).all()
        ratios.append((own / found).mean())
    assert_allclose(np.mean(ratios), 1.0, atol=0.2 if level < 1 else 0.02)  # a fifth of it all


def test_sensors_share_what_their_lines_tell_of_their_noise():
    """Twenty lines that are alike but for chance know it well; others stay what they are."""
    rng, n = np.random.default_rng(0), 100
    total, own = incoherent(np.full((20, 3, 1), 0.1), n, rng)
    total = np.vstack([total, np.full((4, 3, 1), 50.0)])
    used = np.ones(total.shape, bool)
    found, variance, shared = pooled(total, used, n)
    assert_allclose(found[20:], 50.0 * (n - 1) / (n - 2) - 1.0, rtol=1e-3)
    assert np.abs(found[:20] - own).max() < np.abs(total[:20] - 1 - own).max() / 2
    assert (shared[20:] == 0).all() and (shared[:20] <= variance[:20]).all()
    nothing = pooled(total, np.zeros(total.shape, bool), n)
    assert all(np.isfinite(A).all() for A in nothing)


def test_the_limit_is_kept_where_averages_are_few():
    """Chi-square of 120 numbers over variances of 12 averages: one in a hundred is beyond 1 %."""
    trials, lines = 2000, 60
    H, test = of_one(8, 12, trials * lines, 0.1)
    e = test.noise.errors()
    value = (np.abs(np.log(H) / e.own[:, 0, 0]) ** 2).reshape(trials, lines).sum(axis=1)
    own = e.known * 2 * lines
    share = np.mean(value / (2 * lines) > chi2.isf(0.01, own) / own)
    assert 0.004 < share < 0.02
    assert np.mean(value > chi2.isf(0.01, 2 * lines)) > 1.5 * share


@pytest.mark.once
def test_noise_of_forces_may_differ_between_lines(exact, tmp_path):
    test = measured(exact, np.random.default_rng(0), "Hv", 0.1, 0.1)
    same = replace(test, force_noise=np.full((LINES.size, 2), 0.1))
    assert_allclose(same.logarithm(), test.logarithm())
    assert_allclose(same.noise.errors().own, test.noise.errors().own)
    noise = np.linspace(0.05, 0.1, LINES.size)[:, None] * [1.0, 0.5]
    other = replace(test, force_noise=noise)
    gain = (other.logarithm() - test.logarithm())[:, 0]
    assert_allclose(gain, np.log1p(noise**2) - np.log1p(0.1**2), atol=1e-12)
    assert_allclose(other.noise.errors().common[:, 0], noise / np.sqrt(2 * (AVERAGES - 1)))
    pytest.importorskip("h5py", reason="h5py is not installed")
    read = rom.io.read_responses(rom.io.write_responses(other, tmp_path / "test.h5"))
    assert_allclose(read.force_noise, noise)
    assert read.estimator == "Hv"


def test_large_errors_have_the_variance_of_their_logarithm():
    rng, n, level = np.random.default_rng(3), 40, 0.35
    H = 1 + level * gauss(rng, (60_000,))
    c, at = 1 / (1 + n * level**2), Channels([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    test = Responses(np.arange(1.0, 60_001), H[:, None, None], at, at, c, n)
    error = test.noise.errors().own
    assert_allclose(np.mean(np.abs(np.log(H) / error[:, 0, 0]) ** 2) / 2, 1.0, atol=0.03)


def test_errors_that_sensors_share_and_what_estimated_weights_cost_are_those_of_dense_matrices():
    weight = np.array([30.0, 0.0, 80.0, 10.0])[None, :, None]
    A = white(np.eye(4)[None, :, None, :], weight, 0.05)[0, :, 0]
    own = np.diag(1 / np.where(weight, weight, np.inf).ravel() ** 2)
    covariance = A @ (own + 0.05**2) @ A.T
    assert_allclose(covariance, np.diag([1.0, 0.0, 1.0, 1.0]), atol=1e-12)
    rng, c = np.random.default_rng(0), 0.05
    weight, varied = np.array([30.0, 0.0, 80.0, 10.0]), np.array([0.2, 0.3, 0.4, 0.1])
    J = gauss(rng, (4, 2))
    at = weight[None, :, None]
    A = unsure(white(J[None, :, None], at, c), at, c, varied[None, :, None])[0, :, 0]
    used = weight > 0
    V = np.diag(weight[used] ** -2.0) + c**2
    N, d = np.linalg.inv(V), weight[used] ** -2.0
    Q = N @ np.diag(np.diag(N) * varied[used] ** 2 * d**2) @ N
    assert_allclose(A.conj().T @ A, J[used].conj().T @ Q @ J[used], rtol=1e-10)


def test_noise_of_forces_and_few_averages_are_checked(exact):
    test = measured(exact, np.random.default_rng(0), "H1", 0.0, 0.1)
    named, some = replace(test, force_noise=0.2), replace(test, force_noise=0.01, estimator=None)
    refuse(
        (lambda: replace(test, averages=2), "estimated from 2 averages says nothing"),
        (lambda: replace(test, force_noise=np.zeros((3, 2))), r"force_noise \(3, 2\) .* \(20, 2\)"),
        (some.logarithm, "the estimator of H is not named"),
        (named.logarithm, r"force_noise alone has .* times the power"),
    )
