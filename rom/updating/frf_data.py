"""Frequency responses as a test gives them: noise, estimators, weights, comparison.

Source:
    Bendat and Piersol, Random Data (2010), for estimators and their errors; Heylen and Lammens,
    FRAC: a consistent way of comparing frequency response functions (1996); Pascual, Golinval and
    Razeto, A frequency domain correlation technique for model correlation and updating, IMAC XV
    (1997).
"""

import numpy as np
import numpy.typing as npt

from rom.errors import ConfigError
from rom.model import Array

Complex = npt.NDArray[np.complex128]
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


def estimators(x: Complex, f: Complex) -> tuple[Complex, Complex, Complex, Array]:
    """H1, H2, Hv and the coherence of averaged spectra.

    Noise on the force makes H1 too small by signal / (signal + noise), noise on the response makes
    H2 too large likewise; Hv is their geometric mean.

    Args:
        x: (n_a, ...) spectra of the response [m], one for each average.
        f: (n_a, ...) spectra of the force [N], the same shape.

    Returns:
        H1, H2, Hv (...,) [m/N] and the coherence (...,) [1].

    Raises:
        ConfigError: for fewer than two averages: coherence would be one whatever the noise.
    """
    if len(x) < 2 or np.shape(x) != np.shape(f):
        raise ConfigError(f"spectra {np.shape(x)}, {np.shape(f)}: two averages or more of both.")
    S_ff, S_xx = ((np.abs(a) ** 2).mean(axis=0) for a in (f, x))
    S_fx = (f.conj() * x).mean(axis=0)
    H1, H2 = S_fx / S_ff, S_xx / S_fx.conj()
    return H1, H2, np.sqrt(np.abs(H1 * H2)) * np.exp(1j * np.angle(H1)), np.real(H1 / H2)


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
