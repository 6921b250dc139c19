"""Frequency responses as a test gives them: estimators, errors, weights, comparison.

Source:
    Bendat and Piersol, Random Data (2010), for estimators and their errors; Heylen and Lammens,
    FRAC: a consistent way of comparing frequency response functions (1996); Pascual, Golinval and
    Razeto, A frequency domain correlation technique for model correlation and updating, IMAC XV
    (1997).
"""

import warnings
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt
from scipy.special import digamma, erfcx, polygamma
from scipy.stats import norm

from rom.arguments import Count, NotNegative, one_each, typed
from rom.errors import ConfigError
from rom.model import Array, Mask

Complex = npt.NDArray[np.complex128]
MAX_RELATIVE_ERROR = 0.3  # of a value; beyond it the logarithm of noise is no longer normal
FREEDOM_LOST = 2  # averages, by a variance that is estimated from the same records as the response
MIN_OWN_SHARE = 0.02  # of a variance that is known, left to its sensor: coherence is rounded
MAX_EXCESS = 3.0  # standard deviations by which a model corrects the level of a response
MAX_FORCE_SHARE = 1.2  # of the incoherent power in that of forces
FORCE_DEVIATIONS = 4.0  # by which that of a sensor may exceed it by chance
POWERS = {"H1": 0.0, "Hv": 0.5, "H2": 1.0}  # of one over the coherence, by which they exceed H1
POOL_STEPS = 4  # until the lines that are alike are those about their mean
POOL_RISK = 5e-4  # that one of all lines that are alike is too far above the others, or below
COHERENCE_ATOL = 1e-6  # distance of the coherence from 0 and 1, which no measurement reaches


def noisy(H: Complex, level: float, rng: np.random.Generator) -> Complex:
    """H (...,), of any shape and in units of any kind, with complex Gaussian errors.

    The level is their standard deviation over |H| [1].

    Raises:
        ConfigError: for a negative level.
    """
    if not (np.asarray(level) >= 0).all():
        raise ConfigError(f"level = {level} must be zero or more: a standard deviation.")
    real, imaginary = rng.standard_normal((2, *H.shape))
    return H * (1 + level * (real + 1j * imaginary) / np.sqrt(2))


@typed
def estimators(
    x: Complex, f: Complex, ratio: Annotated[float, NotNegative()] = 1.0
) -> tuple[Complex, Complex, Complex, Array]:
    """H1, H2, Hv (...,) [m/N] and the coherence (...,) [1] of averaged spectra.

    Noise on the force makes H1 too small by signal / (signal + noise), noise on the response makes
    H2 too large likewise. Hv is total least squares scaled by the ratio of both: with the powers
    v of the noise of forces and ratio^2 v of that of responses, each over its signal,
    (1 + v) (1 + ratio^2 v) is one over the coherence, and Hv = (1 + v) H1. It is the geometric
    mean of H1 and H2 where the ratio is one, and H2 where it is zero.

    Args:
        x: (n_a, ...) spectra of the response [m], one for each average.
        f: (n_a, ...) spectra of the force [N], the same shape.
        ratio: noise of responses over that of forces, each over its signal [1].

    Raises:
        ConfigError: for fewer than two averages: coherence would be one whatever the noise.

    Source:
        Wicks and Vold, The Hs frequency response function estimator, IMAC IV (1986).
    """
    shapes = np.shape(x), np.shape(f)
    if len(x) < 2 or shapes[0] != shapes[1]:
        raise ConfigError(f"{shapes[0]}, {shapes[1]}: at least two averages of both are needed.")
    S_ff, S_xx = ((np.abs(a) ** 2).mean(axis=0) for a in (f, x))
    S_fx = (f.conj() * x).mean(axis=0)
    H1, H2 = S_fx / S_ff, S_xx / S_fx.conj()
    coherence = np.real(H1 / H2)
    rest, r2 = (1 - coherence) / coherence, ratio**2
    v = 2 * rest / (1 + r2 + np.sqrt((1 + r2) ** 2 + 4 * r2 * rest))  # the positive root
    return H1, H2, H1 * (1 + v), coherence


@typed
def random_error(coherence: npt.ArrayLike, n_averages: Annotated[int, Count(1)]) -> Array:
    """(...,) relative standard deviation of |H1| under noise on the response [1].

    Source:
        Bendat and Piersol, Random data: sqrt((1 - g^2) / (2 n g^2)) with the coherence g^2.
    """
    g2 = np.asarray(coherence, dtype=float)
    return np.sqrt((1 - g2) / (2 * n_averages * g2))


@dataclass(frozen=True, slots=True)
class Errors:
    """Standard deviations of real and imaginary part of ln H, and what is known of them [1]."""

    own: Array  # (n_f, n_s, n_e) of the sensors; infinite where a value is not used
    common: Array  # (n_f, 1, n_e) what the sensors have in common
    varied: Array  # (n_f, n_s, n_e) or 0: deviation of the own one squared, over it, if estimated
    known: float  # degrees of freedom of chi-square of all residuals, for each
    scale: float  # variance of the squares of all own ones together, over these squares


@dataclass(frozen=True, slots=True)
class Noise:
    """Powers of noise in a test."""

    incoherent: Array  # (n_f, n_s, n_e) incoherent over coherent power, (1 - c) / c [1]
    force: Array  # (n_f, 1, n_e) power of the noise of a force over that of the force [1]
    averages: int  # number of averages behind them
    estimated: bool  # whether the coherence is of the same records as the responses

    @property
    def relative_error(self) -> Array:
        """(n_f, n_s, n_e) standard deviation of real and imaginary part, over |H| [1].

        Squared residuals over estimated variances have the mean n / (n - 2) for n averages.

        Source:
            Bendat and Piersol, Random data, F-distribution of 2 and 2 n - 2 freedoms.
        """
        n = self.averages - FREEDOM_LOST * self.estimated
        return np.asarray(np.sqrt(self.incoherent / (2 * n)))

    @property
    def used(self) -> Mask:
        """(n_f, n_s, n_e) values whose errors are small enough to count."""
        return self.relative_error <= MAX_RELATIVE_ERROR

    def bias(self, estimator: str | None) -> Array:
        """(n_f, n_s, n_e) what ln |H| has too much by its estimator.

        Those of H1, Hv and H2 exceed it by -ln (1 + v) and by none, half and all of -ln c, with
        the coherence c and the power v of the noise of a force over that of the force.
        """
        if self.force.any():
            self._check_forces(estimator)
        if estimator is None:
            return np.zeros(self.incoherent.shape)
        return np.asarray(POWERS[estimator] * np.log1p(self.incoherent) - np.log1p(self.force))

    def _check_forces(self, estimator: str | None) -> None:
        if estimator is None:
            raise ConfigError(
                "forces are noisy, and the estimator of H is not named: H1 is too small by it, H2 "
                "too large by that of responses.",
                hint='Give estimator="H1", "H2" or "Hv"; analysers write H1 unless told otherwise.',
            )
        used = self.used & (self.force > 0)
        count = np.maximum(used.sum(axis=0), 1)
        share = np.where(used, self.incoherent / np.where(used, self.force, 1.0), 0.0)
        share = np.where(used.any(axis=0), share.sum(axis=0) / count, np.inf)
        least = np.asarray(1 / MAX_FORCE_SHARE)
        if self.estimated:
            chance = np.sqrt(2 / (max(self.averages - FREEDOM_LOST, 1) * count))
            least = 1 - FORCE_DEVIATIONS * chance
        if (share < least).any():
            s, e = np.unravel_index((share - least).argmin(), share.shape)
            raise ConfigError(
                f"force_noise alone has {1 / share[s, e]:.4g} times the power of all that is "
                f"incoherent in sensor {s} by input {e}.",
                hint=f"Give at most {np.sqrt(share[s, e]):.3g} of it: noise over force, not a "
                "percentage or power; compare the coherence.",
            )

    def errors(self, excess: Array | float = 0.0) -> Errors:
        """Of ln H, and what is known of them.

        Args:
            excess: (n_f, n_s, n_e) ln |H| of a model less that measured. An estimated variance is
                that of H itself over the measured |H|^2: errors that make H larger make it
                smaller, and H too large by twice the variance in the mean of ln H that is weighted
                by it. Over that of a model it is free of them. Beyond three deviations it is a
                wrong model.

        Powers of random forces vary too: one over them has the mean n / (n - 1) of n averages. Of
        circular errors with the variance s^2 in each part the logarithm has s^2 (1 + s^2 + ...).
        Weights are one over variances without bias: of an estimated one by the factor
        (n - 2) / (n - 1), of what is left of it when a common part is taken off by `pooled`. One
        over the mean of what a variance may be costs nothing; what lines have in common does, and
        that of a line of which nothing else is known.
        """
        error, n = self.relative_error, self.averages
        freedom = 2 * max(n - 1, 1)
        total, common = self.incoherent / freedom, self.force / freedom
        own, varied, scale = total - common, np.zeros(()), 0.0
        if self.estimated:
            total = total * np.exp(-2 * np.clip(excess, -MAX_EXCESS * error, MAX_EXCESS * error))
            varied = np.full((), 1 / (n - FREEDOM_LOST))
            own = total * (1 + varied)
        else:
            own = np.maximum(own, MIN_OWN_SHARE * total)
        if self.estimated and common.any():
            over, shared = np.where(common > 0, common, np.inf), common > 0
            share, spread, alike = pooled(total / over, self.used & shared, n)
            own = np.where(shared, common * share, own)
            varied = np.where(shared, spread / share**2, varied)
            counted = self.used & shared
            scale = float((alike / share**2)[counted].sum() / max(counted.sum(), 1))
        own = np.sqrt(np.where(self.used, own * (1 + error**2), np.inf))
        known = max(n - 3, 0.5) / (n - 1) if self.estimated else 1.0
        return Errors(own, np.sqrt(common), np.sqrt(varied), known, scale)


def pooled(total: Array, used: Mask, n_averages: int) -> tuple[Array, Array, Array]:
    """Noise of sensors over that of a force, better known where lines of a sensor are alike.

    The power of all that is incoherent, over what the noise of the force is in the mean, is
    (1 + x) p e, with x the ratio asked for, and p and e powers of random forces and errors of n
    averages. Of lines of a sensor, ln (1 + x) is taken for normal, with their mean and as much
    spread as p and e do not explain, and so are the logarithms of p and e; lines far out in that
    distribution are left to themselves. The noise of the sensor is x p of that line.

    Total are estimated (1 + x) p e (n_f, n_s, n_e) [1]. Found are, as large [1], means of x p
    by what is measured, the variances of them that cost, and what lines have of these in common.

    Source:
        Efron and Morris, Stein's estimation rule and its competitors: an empirical Bayes approach,
        J. Am. Stat. Assoc. 68 (1973) 117, for the spread; logarithms of chi-square as normal by
        digamma and trigamma functions.
    """
    n = max(n_averages, 3)
    P, E = float(polygamma(1, n)), float(polygamma(1, n - 1))  # variances of ln p and ln e
    mean_p, mean_e = np.log(n - 1) - digamma(n), digamma(n - 1) - np.log(n - 1)
    level = np.log(np.maximum(total, np.finfo(float).tiny)) - mean_p - mean_e
    mean, spread, alike = _normal_part(level, used, P + E)
    T = np.maximum(spread - P - E, 0.0)  # of ln (1 + x)
    V, count = T + P + E, np.maximum(alike.sum(axis=0), 1)
    kept, kept_p = np.where(alike, (T + P) / V, 1.0), np.where(alike, P / V, 0.0)
    beyond = level - mean
    both = mean_p + np.where(alike, np.maximum(mean, 0.0) + kept * beyond, level)
    force = mean_p + kept_p * beyond
    var_both, var_force = np.where(alike, (T + P) * (1 - kept), E), P * (1 - kept_p)
    a, b = np.exp(both + var_both / 2), np.exp(force + var_force / 2)
    cov = P * (1 - kept)
    variance = a**2 * np.expm1(var_both) - 2 * a * b * np.expm1(cov) + b**2 * np.expm1(var_force)
    shared = np.where(alike, ((1 - kept) * a + kept_p * b) ** 2 * V / count, 0.0)
    found = positive_mean(a - b, variance + shared)
    return found, np.where(alike, shared, variance), shared


def _normal_part(level: Array, used: Mask, least: float) -> tuple[Array, Array, Mask]:
    """Mean and variance (1, n_s, n_e) of lines (n_f, n_s, n_e) without those that lie far out.

    The variance is at least that which chance alone makes.
    """
    risk = norm.isf(POOL_RISK / np.maximum(used.sum(axis=0, keepdims=True), 1))
    with np.errstate(invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of a sensor without lines
        known = np.where(used, level, np.nan)
        mean = np.nan_to_num(np.nanmedian(known, axis=0, keepdims=True))
        off = np.nan_to_num(np.nanmedian(np.abs(known - mean), axis=0, keepdims=True))
    spread = np.maximum(least, (off / norm.ppf(0.75)) ** 2)
    for _ in range(POOL_STEPS):
        alike = used & ((level - mean) ** 2 <= risk**2 * spread)
        count = np.maximum(alike.sum(axis=0, keepdims=True), 1)
        mean = np.where(alike, level, 0.0).sum(axis=0, keepdims=True) / count
        square = np.where(alike, (level - mean) ** 2, 0.0).sum(axis=0, keepdims=True)
        spread = np.maximum(least, square / np.maximum(count - 1, 1))
    return mean, spread, alike


def positive_mean(mean: Array, variance: Array) -> Array:
    """(...) mean of what is normal and known to be positive: that of the truncated distribution."""
    s = np.sqrt(variance)
    hazard = np.sqrt(2 / np.pi) / erfcx(-mean / np.maximum(s, 1e-300) / np.sqrt(2))
    return np.where(s > 0, mean + s * hazard, mean)


def weights(coherence: npt.ArrayLike, n_averages: int) -> Array:
    """(...,) 1 / random error, one in the mean square [1]; the shape of the coherence.

    Raises:
        ConfigError: without averages.
    """
    w = 1.0 / random_error(np.clip(coherence, COHERENCE_ATOL, 1 - COHERENCE_ATOL), n_averages)
    return w / np.sqrt((w**2).mean())


def beside_poles(omega: Array, poles: npt.ArrayLike, zeta: npt.ArrayLike, width: float) -> Array:
    """(n_f, 1, 1) weights [1] that fall to zero at poles whose damping is hardly known.

    Args:
        omega: (n_f,) circular frequencies [rad/s].
        poles: (m,) natural frequencies [rad/s].
        zeta: (m,) their damping ratios, roughly [1].
        width: number of half bandwidths zeta omega from where on lines count fully [1].

    Raises:
        ConfigError: if poles and ratios differ in number, or a bandwidth is not positive.
    """
    one_each("damping ratios", np.shape(zeta), "poles", np.shape(poles))
    if not (width * np.asarray(zeta) > 0).all():
        raise ConfigError(f"zeta = {zeta!r} and width = {width} must be positive.")
    reach = width * np.asarray(zeta) * np.asarray(poles)
    far = np.abs(omega[:, None] - np.asarray(poles)) / reach
    return np.minimum(far, 1.0).prod(axis=1)[:, None, None]


def frac(H: Complex, G: Complex) -> Array:
    """(n_s, n_e) frequency response assurance of H and G (n_f, n_s, n_e) [m/N], from 0 to 1 [1].

    Raises:
        ConfigError: if the shapes differ.
    """
    one_each("responses", np.shape(H), "others", np.shape(G))
    cross = np.abs((H.conj() * G).sum(axis=0)) ** 2
    return cross / (np.abs(H) ** 2).sum(axis=0) / (np.abs(G) ** 2).sum(axis=0)


def fdac(H: Complex, G: Complex) -> Array:
    """(n_f, n_g) frequency domain assurance, from 0 to 1 [1].

    H (n_f, n_s, n_e) and G (n_g, n_s, n_e) are responses [m/N], compared line by line.
    """
    A, B = (X.reshape(len(X), -1) / np.linalg.norm(X, axis=(1, 2))[:, None] for X in (H, G))
    return np.abs(A.conj() @ B.T) ** 2


def deviation(H: Complex, test: Complex) -> Array:
    """(n_f,) norm(H - test) / norm(test) of each line [1], of responses (n_f, n_s, n_e) [m/N]."""
    return np.linalg.norm(H - test, axis=(1, 2)) / np.linalg.norm(test, axis=(1, 2))
