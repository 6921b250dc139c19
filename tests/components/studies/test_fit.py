"""Fits: closed forms and curve_fit, a hundred draws of noise, what data cannot tell, refusals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import stats
from scipy.optimize import curve_fit

import rom
from cases.components.fitted import crank, free, oscillator, place, rubbed, weak
from cases.long import few
from cases.refusals import refused, refuses
from rom.components.studies.described import value_of
from rom.errors import ConfigError, SolverError

pytestmark = pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
T, SIGMA = np.linspace(0.031, 1.97, 40), 1e-3
RANGES = {"stiffness": (100.0, 400.0), "damping": (0.1, 5.0)}
EXACT, FINE = {"dt": 1e-2, "method": "dop853"}, {"dt": 2e-3, "rho_inf": 1.0}


def noisy(x, seed=7, sigma=SIGMA):
    return x + np.random.default_rng(seed).normal(0.0, sigma, x.shape)


def of_mass(x, sigma=SIGMA, name="mass position x", t=T):
    return {name: (t, x, sigma)}


X = noisy(place(T, 200.0, 1.0))


def failing(found):
    return [row.quantity for row in found.verdict.failures]


def test_an_oscillator_is_fitted_as_by_its_closed_form():
    """Two quantities with noise of their own; deviations are those of Cramer and Rao."""
    sigma, again = np.geomspace(5e-4, 2e-3, T.size), T[::3]

    def closed(_, k, c):
        still = np.zeros(T.size)
        vector = np.stack([place(T, k, c), still, still], axis=1)
        return np.r_[vector.ravel(), place(again, k, c) - 0.3]

    all_sigma = np.r_[np.repeat(sigma, 3), np.full(again.size, 2e-3)]
    seen = noisy(closed(T, 200.0, 1.0), 1, all_sigma)
    x, y = seen[: 3 * T.size].reshape(-1, 3), seen[3 * T.size :]
    measured = of_mass(x, sigma, "mass position") | of_mass(y, 2e-3, "guide displacement", again)
    found = rom.fit(oscillator, RANGES, measured, **EXACT)
    best, C = curve_fit(closed, T, seen, (200.0, 1.0), all_sigma, absolute_sigma=True)
    d = np.sqrt(np.diag(C))
    assert_allclose(list(found.values.values()), best, rtol=0, atol=1e-3 * d.min())
    assert_allclose(found.covariance, C, rtol=1e-4, atol=1e-4 * d[0] * d[1])
    assert_allclose(list(found.deviations.values()), d, rtol=1e-4)
    assert_allclose(found.correlations, C / np.outer(d, d), atol=1e-4)
    assert found.verdict.ok and not found.undetermined and not found.at_bound
    assert_allclose(found.predicted["mass position"][:, 0], place(T, *best), atol=1e-7)
    left = np.concatenate([r.ravel() for r in found.residuals.values()])
    assert_allclose(left, (closed(T, *best) - seen) / all_sigma, atol=1e-3)
    by_log = rom.fit(oscillator, RANGES, measured, log=("stiffness",), **EXACT)
    assert_allclose(list(by_log.values.values()), best, rtol=0, atol=2e-3 * d.min())
    assert_allclose(by_log.covariance, C, rtol=1e-3, atol=1e-3 * d[0] * d[1])
    assert f"  stiffness = {best[0]:.6g} +- {d[0]:.2g}\n" in str(found)


TRUE = {"stiffness": 300.0, "damping": 2.0, "mass": 0.4}
SOUGHT = {"stiffness": (100.0, 1000.0), "damping": (0.5, 10.0), "mass": (0.1, 2.0)}


@pytest.mark.parametrize("draws", few(1, [6, 100]))
def test_as_many_draws_of_noise_as_were_promised_lie_within_their_deviations(draws):
    """A slider-crank whose crank pin is seen; chi-square is what its distribution says."""
    motion = rom.simulate(crank(**TRUE), t_end=0.5, dt=0.02)
    t, x = motion.t[1:], value_of("crank a position", motion)[1:, :2]
    off, squares = np.zeros((draws, 3)), np.zeros(draws)
    for k in range(draws):
        seen = {f"crank a position {axis}": (t, noisy(x[:, j], (k, j), SIGMA), SIGMA)
                for j, axis in enumerate("xy")}  # fmt: skip
        found = rom.fit(crank, SOUGHT, seen, dt=0.02, log=tuple(TRUE), start=TRUE)
        off[k] = [(found.values[n] - TRUE[n]) / found.deviations[n] for n in TRUE]
        squares[k] = sum(np.sum(r**2) for r in found.residuals.values())
    within = np.count_nonzero(np.abs(off) < stats.norm.ppf(0.975), axis=0)
    least, most = (90, 98) if draws == 100 else (4, draws)
    assert ((within >= least) & (within <= most)).all(), within
    expected = stats.chi2(2 * t.size - 3)
    assert stats.kstest(squares, expected.cdf).pvalue > 0.01


def test_what_the_histories_cannot_tell_is_named():
    """A free oscillator knows the ratio of stiffness and mass alone; a third number is idle."""
    ranges = {"mass": (0.5, 4.5), "idle": (-1.0, 1.0), "stiffness": (80.0, 500.0)}
    x = noisy(place(T, 200.0, 0.0))
    found = rom.fit(free, ranges, of_mass(x), log=("mass", "stiffness"), **FINE)
    idle, ratio = sorted(found.undetermined, key=len)
    assert idle == {"idle": pytest.approx(1.0)} and set(ratio) == {"mass", "stiffness"}
    # equal changes of both logarithms, in shares of the ranges of these
    widths = np.log([4.5 / 0.5, 500.0 / 80.0])
    assert_allclose(ratio["mass"] * widths[0], ratio["stiffness"] * widths[1], rtol=1e-3)
    assert found.deviations["idle"] == pytest.approx(2 / np.sqrt(12))
    assert found.values["stiffness"] / found.values["mass"] == pytest.approx(200 / 1.5, rel=2e-3)
    assert found.verdict.ok and "not told by the data, in shares of ranges: +1.00 idle" in str(
        found
    )
    start = {"stiffness": 210.0}  # from the middle a minimum at 353 N/m is nearer
    known = rom.fit(free, ranges | {"mass": (1.49, 1.51)}, of_mass(x), start=start, **FINE)
    # what is left of the mass is its range, and the stiffness follows
    assert known.deviations["mass"] == pytest.approx(0.02 / np.sqrt(12), rel=1e-3)
    assert known.deviations["stiffness"] == pytest.approx(200 / 1.5 * 0.02 / np.sqrt(12), rel=2e-2)


def test_a_wrong_model_and_wrong_noise_are_refused():
    x = noisy(rubbed(T[:30], 200.0, 1.5))
    seen = of_mass(x, t=T[:30])
    viscous = rom.fit(oscillator, RANGES, seen, **FINE)
    assert "chi-square of the records, over its expectation" in failing(viscous)
    assert any("memory" in text for text in failing(viscous))
    dry = {"stiffness": (100.0, 400.0), "coulomb": (0.2, 3.0)}
    right = rom.fit(oscillator_without_damper, dry, seen, dt=1e-3)
    assert not any("chi-square" in text or "memory" in text for text in failing(right))
    assert abs(right.values["coulomb"] - 1.5) < 4 * right.deviations["coulomb"]
    assert failing(rom.fit(oscillator, RANGES, of_mass(X, 2 * SIGMA), **FINE)) == [
        "chi-square of the records, no less than noise leaves"
    ]
    two = of_mass(X, SIGMA / 2) | of_mass(noisy(X * 0), SIGMA, "mass velocity y")
    small = rom.fit(oscillator, RANGES, two, **FINE)
    assert "worst record, mass position x, over its expectation" in failing(small)


def oscillator_without_damper(stiffness, coulomb):
    return oscillator(stiffness, 0.0, coulomb=coulomb)


def test_the_shift_by_steps_that_are_too_long_is_told_as_large_as_it_is():
    shift = "shift of a parameter by the step of time [deviations]"
    true = rom.fit(oscillator, RANGES, of_mass(X), **FINE)
    long = rom.fit(oscillator, RANGES, of_mass(X), dt=0.01)
    off = max(abs(long.values[n] - true.values[n]) / true.deviations[n] for n in RANGES)
    assert failing(long) == [shift] and off > 2.0
    assert long.verdict.worst.value == pytest.approx(off, rel=0.05)
    assert "smaller steps" in str(long)


def test_many_starts_find_the_best_of_several_minima_on_any_number_of_workers():
    options = {"dt": 0.02, "log": ("stiffness",), "starts": 3}
    found = [
        rom.fit(oscillator, {"stiffness": (20.0, 2000.0)}, of_mass(X), workers=n,
                rng=np.random.default_rng(3), **options)
        for n in (0, 1, 2)
    ]  # fmt: skip
    squares = np.sort(found[0].searches.values["chi-square"])
    alike = np.count_nonzero(squares < squares[0] + 0.1)
    assert squares[-1] > 1e5 and 1 <= alike < 3
    assert f"{alike} of 3 searches end here, others at chi-square {squares[alike]:.4g}" in str(
        found[0]
    )
    assert found[0].values["stiffness"] == pytest.approx(200.0, rel=0.02)
    for other in found[1:]:
        assert other.values == found[0].values
        assert other.covariance.tobytes() == found[0].covariance.tobytes()
        assert str(other) == str(found[0])


def needle(stiffness):
    return weak(stiffness if stiffness == 240.0 else 300.0)


def test_motions_that_fail_are_taken_back_and_told():
    ranges = {"stiffness": (20.0, 2000.0)}
    found = rom.fit(weak, ranges, of_mass(X), start={"stiffness": 240.0}, **FINE)
    assert found.values["stiffness"] == pytest.approx(200.0, rel=5e-3)
    start = {"stiffness": 249.99}  # of which one side fails
    assert "motions failed; steps there" in str(
        rom.fit(weak, ranges, of_mass(X), start=start, **FINE)
    )
    refuses(SolverError, "fails on both sides of {'stiffness': 240.0}", rom.fit, needle, ranges,
            of_mass(X), start={"stiffness": 240.0}, **FINE)  # fmt: skip
    narrow = {"stiffness": (300.0, 400.0)}
    refuses(SolverError, "from any of 1 starts: ModelError: it breaks", rom.fit, weak, narrow,
            of_mass(X), **FINE)  # fmt: skip
    refuses(SolverError, "any of 3 starts", rom.fit, weak, narrow, of_mass(X), starts=3, workers=0,
            rng=np.random.default_rng(1), **FINE)  # fmt: skip


def test_a_value_beyond_the_range_is_told():
    found = rom.fit(oscillator, RANGES | {"stiffness": (210.0, 400.0)}, of_mass(X), **FINE)
    assert found.at_bound == ("stiffness",) and "stiffness inside its range" in failing(found)


def moved(**values):
    return rom.simulate(oscillator(**values), t_end=2.0, dt=2e-2)


def test_a_motion_may_be_made_by_the_function_itself():
    own = rom.fit(moved, RANGES, of_mass(X))
    given = rom.fit(oscillator, RANGES, of_mass(X), dt=2e-2, t_end=2.0)
    assert own.values == given.values and len(own.verdict.rows) == len(given.verdict.rows) - 1


def fits(build=oscillator, ranges=RANGES, measured=None, **options):
    return lambda: rom.fit(build, ranges, measured or of_mass(X), **{"dt": 0.02} | options)


test_it_is_refused = refused(
    (fits(ranges={}), "must be {name: value}"),
    (fits(ranges={"stiff": (1, 2)}), r"build must take the parameters \['stiff'\]"),
    (fits(crank, {"mass": (1, 2)}), "missing .* 'stiffness'"),
    (fits(ranges={"stiffness": (2, 1)}), r"the range of 'stiffness' is \(2, 1\)"),
    (fits(ranges={"stiffness": (np.nan, 1)}), "the range of 'stiffness'"),
    (fits(ranges={"stiffness": 3.0}), "the range of 'stiffness' is 3.0"),
    (fits(ranges={"damping": (-1, 1)}, log=("damping",)), "no logarithm"),
    (fits(log=("mass",)), "log= names no parameter 'mass'"),
    (fits(ranges={"stiffness": stats.uniform(1, 2)}), "'stiffness' has a distribution"),
    (fits(start={"mass": 1.0}), "start= names no parameter 'mass'"),
    (fits(start={"stiffness": 99.0}), "start of 'stiffness'"),
    (fits(measured=of_mass(X, name="mas position x")), "no 'mas position'"),
    (fits(measured=of_mass(X, name="max(mass position x)")), "of a motion of .* it is ()"),
    (fits(measured=of_mass(X, name="mass position")), r"it is \(100, 3\)"),
    (fits(measured={"mass position x": X}), "measured 'mass position x' is"),
    (fits(measured=of_mass(X, t=T[::-1])), "times of 'mass position x'"),
    (fits(measured=of_mass(X, t=np.zeros(40))), "times of 'mass position x'"),
    (fits(measured=of_mass(X, t=T - 0.1)), "the motion is from 0 s to"),
    (fits(t_end=1.5), "measured from 0.031 s to 1.97 s; the motion is from 0 s to 1.5 s"),
    (fits(measured=of_mass(X[:-1])), r"has 40 times, values \(39,\)"),
    (fits(measured=of_mass(X * np.nan)), "values of 'mass position x'.* not finite"),
    (fits(measured=of_mass(X, 0.0)), "the deviation of 'mass position x' is 0"),
    (fits(measured=of_mass(X, -SIGMA)), "must be positive"),
    (fits(measured=of_mass(X, np.ones(7))), r"deviations \(7,\)"),
    (fits(measured=of_mass(X[:2], t=T[:2])), "2 values for 2 parameters"),
    (fits(measured={"guide": ()}), "measured 'guide' is"),
    (fits(lambda **_: 3.0), "build returned 3.0; return a rom.Mechanism"),
    (fits(moved), "build moves the mechanism itself; leave out 'dt', 't_end'"),
    (fits(dt=None), "dt is missing"),
    (fits(nonsense=1), TypeError, "nonsense"),
    (fits(starts=2), "give rng="),
    (fits(lambda stiffness, damping: oscillator(stiffness, damping), starts=2, workers=1,
          rng=np.random.default_rng(1)), "cannot be sent to another process"),
    error=ConfigError,
)  # fmt: skip
