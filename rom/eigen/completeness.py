"""Random columns with which searches begin, and how surely such a search has missed no mode.

With the inverse B = K^-1 M of eigenvalues theta, a search spans the powers B^a W of a Gaussian
block W (n, b). An eigenvalue theta_i >= theta_m that was missed has left no trace above s, the
largest Ritz value beside those found: every polynomial p of the degree at hand then has

    (theta_i - s) p(theta_i)^2 c^2  <=  s |p(B) W|^2   beside the modes found,

with c the least length that the components of W in the space of theta_i can have beside the
modes found there. As W knows nothing of the body, so small a c is improbable: of three rows of W
the least singular value falls below c with at most 3 P(chi^2_(b-2) <= 3 c^2). Three members of one
frequency or more are left to a count. p is theta^a times Chebyshev's polynomial on [0, s]. Modes
found are known up to an angle, and no c below that is believed.

Source:
    Kuczynski and Wozniakowski, SIAM J. Matrix Anal. Appl. 13 (1992) 1094, for one vector; Saad,
    SIAM J. Numer. Anal. 17 (1980) 687, for blocks.
"""

import numpy as np
from scipy.special import gammainc

from rom.eigen.verbs import Searched
from rom.model import Array

N_TOGETHER = 3  # members of one frequency that are left to a count
CLUSTER_RTOL = 1e-4  # relative distance of eigenvalues that count as one frequency
ACCURATE_RTOL = 1e-3  # angle between a mode found and one that might be missed beside it
LEAST_SHARE = 0.05  # variance of a component of W: eigenvalues of diag(M)^-1 M are larger
MAX_MISS_PROBABILITY = 1e-9  # beyond it a search goes on, or modes are counted
SAFETY_FACTOR = 100.0  # on c^2, for Ritz vectors that are not exact
MAX_POWER = 8  # of theta in the polynomials tried
PLACE_SCALE = 2.0**40  # places that differ by less are one
COUNTER_STEP = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio: steps of the counter
MIXING_STEPS = (  # Steele, Lea and Flood, OOPSLA 2014, with the constants of Stafford
    (np.uint64(30), np.uint64(0xBF58476D1CE4E5B9)),
    (np.uint64(27), np.uint64(0x94D049BB133111EB)),
)


def gaussian_block(ops: Searched, k: int, n_before: int = 0) -> Array:
    """(n_local, k) Gaussian columns with components of about one in all modes.

    The numbers depend on the place of a dof, mixed beyond recognition, and not on its rank. Blocks
    are independent when each is given how many columns were drawn before it.
    """
    key = np.round(ops.fixed * PLACE_SCALE).astype(np.int64).view(np.uint64)
    numbers = np.arange(1 + 2 * n_before, 1 + 2 * (n_before + k), dtype=np.uint64)
    bits = key[:, None] + COUNTER_STEP * numbers
    for shift, factor in MIXING_STEPS:  # the finaliser of SplitMix64
        bits = (bits ^ (bits >> shift)) * factor
    bits ^= bits >> np.uint64(31)
    u = (bits >> np.uint64(11)).astype(float) * 2.0**-53 + 2.0**-54
    normal = np.sqrt(-2.0 * np.log(u[:, :k])) * np.cos(2.0 * np.pi * u[:, k:])  # Box and Muller
    mass = ops.mass_diagonal[:, None]
    return np.where(mass > 0.0, normal / np.sqrt(np.where(mass > 0.0, mass, 1.0)), 0.0)


def miss_probability(T: Array, start: Array, residual: Array, m: int) -> float:
    """Bound of the probability that one of the lowest m modes is not among those found.

    T (N, N) is the projection of B on the space searched, whose first b columns span W with the
    components ``start`` (b, b); the residuals (N,) of its Ritz values are relative, largest first.
    """
    k, c2 = unseen_part(T, start, residual, m)
    b = start.shape[0]
    c2 = max(SAFETY_FACTOR * c2, ACCURATE_RTOL**2) / LEAST_SHARE
    chance = N_TOGETHER * gammainc(0.5 * (b - N_TOGETHER + 1), 0.5 * N_TOGETHER * c2)
    return float(min(1.0, (k + 1) * chance))


def unseen_part(T: Array, start: Array, residual: Array, m: int) -> tuple[int, float]:
    """How many modes are found, and c^2 of the largest part that one missed had; see above.

    Arguments as in `miss_probability`; c^2 is infinite where the bound has nothing to say.
    """
    theta, S = np.linalg.eigh(T)
    theta, S = theta[::-1], S[:, ::-1]
    b, n_blocks = start.shape[0], theta.size // start.shape[0]
    # a residual over the distance of the eigenvalues bounds the angle; nearer ones are one cluster
    apart = np.maximum(theta[m - 1] - theta, CLUSTER_RTOL * theta)
    inaccurate = np.flatnonzero(residual * theta > ACCURATE_RTOL * apart)
    k = int(inaccurate[0]) if inaccurate.size else theta.size
    if not m <= k < theta.size or theta[k] <= 0.0:
        return k, np.inf
    first, last = theta[:k][: 1 - N_TOGETHER], theta[:k][N_TOGETHER - 1 :]
    if (first - last <= CLUSTER_RTOL * first).any():  # they share one frequency
        return k, np.inf
    ratio = float(theta[m - 1] / theta[k])
    if ratio <= 1.0 + CLUSTER_RTOL:
        return k, np.inf
    W = S[:b].T @ start  # in Ritz vectors
    powers = np.arange(float(min(MAX_POWER, n_blocks)))
    left = [np.linalg.norm((theta[k:] / theta[m - 1])[:, None] ** a * W[k:], 2) for a in powers]
    growth = log_chebyshev(n_blocks - 1 - powers, 2.0 * ratio - 1.0)
    log_c2 = np.min(2.0 * np.log(left) - 2.0 * growth) - np.log(ratio - 1.0)
    return k, float(np.exp(min(log_c2, 0.0)))


def log_chebyshev(degree: Array, x: float) -> Array:
    """Logarithm of Chebyshev's polynomial T_degree(x), x > 1."""
    t = degree * np.arccosh(x)
    return t + np.log1p(np.exp(-2.0 * t)) - np.log(2.0)
