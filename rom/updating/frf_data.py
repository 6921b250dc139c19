"""Frequency responses as a test gives them: noise, estimators, weights, comparison.

Source:
    Bendat and Piersol, Random Data (2010), for estimators and their errors; Heylen and Lammens,
    FRAC: a consistent way of comparing frequency response functions (1996); Pascual, Golinval and
    Razeto, A frequency domain correlation technique for model correlation and updating, IMAC XV
    (1997).
"""

import warnings

import numpy as np
import numpy.typing as npt

from rom.arguments import finite
from rom.errors import ConfigError
from rom.model import Array, Mask

Complex = npt.NDArray[np.complex128]
POOL_DEVIATIONS = 3.0  # by which lines may differ that are alike
POOL_STEPS = 4  # until the lines that are alike are those about their mean
COHERENCE_ATOL = 1e-6  # distance of the coherence from 0 and 1, which no measurement reaches


def noisy(H: Complex, level: float, rng: np.random.Generator) -> Complex:
    """H with complex Gaussian errors.

    Args:
        H: (...,) responses of any shape, in units of any kind.
        level: relative standard deviation [1].
        rng: source of random numbers.

    Returns:
        (...,) responses, in units of those given.

    Raises:
        ConfigError: for a negative level.
    """
    if not (np.asarray(level) >= 0).all():
        raise ConfigError(f"level = {level}: noise has a standard deviation of zero or more.")
    real, imaginary = rng.standard_normal((2, *H.shape))
    return H * (1 + level * (real + 1j * imaginary) / np.sqrt(2))


def estimators(
    x: Complex, f: Complex, ratio: float = 1.0
) -> tuple[Complex, Complex, Complex, Array]:
    """H1, H2, Hv and the coherence of averaged spectra.

    Noise on the force makes H1 too small by signal / (signal + noise), noise on the response makes
    H2 too large likewise. Hv is total least squares scaled by the ratio of both: with the powers
    v of the noise of forces and ratio^2 v of that of responses, each over its signal,
    (1 + v) (1 + ratio^2 v) is one over the coherence, and Hv = (1 + v) H1. It is the geometric
    mean of H1 and H2 where the ratio is one, and H2 where it is zero.

    Args:
        x: (n_a, ...) spectra of the response [m], one for each average.
        f: (n_a, ...) spectra of the force [N], the same shape.
        ratio: noise of responses over that of forces, each over its signal [1].

    Returns:
        H1, H2, Hv (...,) [m/N] and the coherence (...,) [1].

    Raises:
        ConfigError: for fewer than two averages: coherence would be one whatever the noise; or a
            negative ratio.

    Source:
        Wicks and Vold, The Hs frequency response function estimator, IMAC IV (1986).
    """
    if len(x) < 2 or np.shape(x) != np.shape(f):
        raise ConfigError(f"spectra {np.shape(x)}, {np.shape(f)}: two averages or more of both.")
    if not finite("ratio", ratio, ()) >= 0:
        raise ConfigError(f"ratio = {ratio}: noise of responses over that of forces, 0 or more.")
    S_ff, S_xx = ((np.abs(a) ** 2).mean(axis=0) for a in (f, x))
    S_fx = (f.conj() * x).mean(axis=0)
    H1, H2 = S_fx / S_ff, S_xx / S_fx.conj()
    coherence = np.real(H1 / H2)
    return H1, H2, H1 * (1 + _force_noise(coherence, ratio)), coherence


def _force_noise(coherence: Array, ratio: float) -> Array:
    """The positive root v of (1 + v) (1 + ratio^2 v) = 1 / coherence."""
    rest, r2 = (1 - coherence) / coherence, ratio**2
    return 2 * rest / (1 + r2 + np.sqrt((1 + r2) ** 2 + 4 * r2 * rest))


def random_error(coherence: npt.ArrayLike, n_averages: int) -> Array:
    """(...,) relative standard deviation of |H1| under noise on the response [1].

    Raises:
        ConfigError: without averages.

    Source:
        Bendat and Piersol, Random data: sqrt((1 - g^2) / (2 n g^2)) with the coherence g^2.
    """
    if n_averages < 1:
        raise ConfigError(f"n_averages = {n_averages}: one or more.")
    g2 = np.asarray(coherence, dtype=float)
    return np.sqrt((1 - g2) / (2 * n_averages * g2))


def pooled(ratio: Array, used: Mask, n_averages: int) -> tuple[Array, Array, Array]:
    """Noise of sensors over that of a force, better known where it is much alike at many lines.

    One line tells the ratio x up to the variance (1 + x)^2 / (n - 2) + 1 / n for n averages of
    random forces: nearly nothing where the noise of the force is the larger one. Lines of a sensor
    that differ from their mean by no more than three deviations are drawn towards it, by as much
    as they vary no more than chance lets them.

    Args:
        ratio: (n_f, n_s, n_e) estimated powers, also negative ones [1].
        used: (n_f, n_s, n_e) which count.
        n_averages: number of them.

    Returns:
        (n_f, n_s, n_e) ratios, their variances, and what lines have of these in common [1].

    Source:
        Efron and Morris, Stein's estimation rule and its competitors: an empirical Bayes approach,
        J. Am. Stat. Assoc. 68 (1973) 117.
    """

    def variance(x: Array) -> Array:
        return (1 + np.maximum(x, 0.0)) ** 2 / max(n_averages - 2, 1) + 1 / n_averages

    with np.errstate(invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of a sensor without lines
        mean = np.nan_to_num(np.nanmedian(np.where(used, ratio, np.nan), axis=0))
    for _ in range(POOL_STEPS):
        alike = used & ((ratio - mean) ** 2 <= POOL_DEVIATIONS**2 * variance(mean))
        count = np.maximum(alike.sum(axis=0), 1)
        mean = np.where(alike, ratio, 0.0).sum(axis=0) / count
    chance = variance(mean)
    spread = np.where(alike, (ratio - mean) ** 2, 0.0).sum(axis=0) / np.maximum(count - 1, 1)
    kept = np.where(count > 1, np.maximum(1 - chance / np.maximum(spread, 1e-300), 0.0), 1.0)
    found = np.where(alike, mean + kept * (ratio - mean), ratio)
    shared = np.where(alike, (1 - kept) ** 2 * chance / count, 0.0)
    return found, np.where(alike, kept * chance + shared, variance(ratio)), shared


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
    if np.shape(poles) != np.shape(zeta) or not (width * np.asarray(zeta) > 0).all():
        raise ConfigError(f"{np.size(poles)} poles, zeta = {zeta!r}, width = {width}: positive.")
    reach = width * np.asarray(zeta) * np.asarray(poles)
    far = np.abs(omega[:, None] - np.asarray(poles)) / reach
    return np.minimum(far, 1.0).prod(axis=1)[:, None, None]


def frac(H: Complex, G: Complex) -> Array:
    """(n_s, n_e) frequency response assurance over all lines, from 0 to 1 [1].

    Args:
        H: (n_f, n_s, n_e) responses [m/N].
        G: (n_f, n_s, n_e) responses to compare with [m/N].

    Raises:
        ConfigError: if the shapes differ.
    """
    if np.shape(H) != np.shape(G):
        raise ConfigError(f"responses {np.shape(H)} and {np.shape(G)} cannot be compared.")
    cross = np.abs((H.conj() * G).sum(axis=0)) ** 2
    return cross / (np.abs(H) ** 2).sum(axis=0) / (np.abs(G) ** 2).sum(axis=0)


def fdac(H: Complex, G: Complex) -> Array:
    """(n_f, n_g) frequency domain assurance, from 0 to 1 [1].

    Args:
        H: (n_f, n_s, n_e) responses [m/N].
        G: (n_g, n_s, n_e) responses, each line of which is compared with each of H [m/N].
    """
    A, B = (X.reshape(len(X), -1) / np.linalg.norm(X, axis=(1, 2))[:, None] for X in (H, G))
    return np.abs(A.conj() @ B.T) ** 2


def deviation(H: Complex, test: Complex) -> Array:
    """(n_f,) norm(H - test) / norm(test) of each line [1].

    Args:
        H: (n_f, n_s, n_e) responses of the model [m/N].
        test: (n_f, n_s, n_e) measured ones [m/N].
    """
    return np.linalg.norm(H - test, axis=(1, 2)) / np.linalg.norm(test, axis=(1, 2))
