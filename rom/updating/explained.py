"""Whether a corrected model explains what was measured: chi-square of what is left."""

from typing import Any

import numpy as np
from scipy.stats import chi2
from scipy.stats import f as f_ratio

from rom.model import Report, Row
from rom.rows import row
from rom.updating.frf_data import Complex, frac
from rom.updating.models import Measurement

MAX_FALSE_REFUSAL = 1e-3  # probability that a row refuses a right model
MIN_SCALE = 1e-8  # variance of a scale that is worth a thought
N_BANDS = 8  # of lines, in which the misfit is looked for
MAX_UNLIKE = 0.5  # one less the median FRAC: more is another body
ROUND_OFF = 1e-6  # of a relative error of responses: what is below has no pattern to be judged by


def explained(H: Complex, test: Measurement, n: int) -> Report:
    """Whether the responses of a corrected model leave noise alone, of a size that is not known.

    What is left of noise with the weights of the test has one size at all sensors and in all
    bands, and the responses are alike.

    Args:
        H: (n_f, n_s, n_e) of the corrected model [m/N].
        test: what was measured.
        n: number of unknowns.
    """
    weight = np.broadcast_to(np.asarray(test.weights, dtype=float), test.H.shape)
    used = weight > 0
    alike = frac(H * used, test.H * used)[used.any(axis=0)]
    rows = [row("one less the median FRAC", 1.0 - float(np.median(alike)), MAX_UNLIKE)]
    squares = np.abs(np.log(H / test.H) * weight) ** 2
    freedom = max(2 * int(used.sum()) - n, 1)
    variance = squares.sum() / freedom
    if variance > ROUND_OFF**2:
        blocks = np.array_split(np.arange(len(H)), min(N_BANDS, len(H)))
        f = test.omega / (2 * np.pi)
        sensors = {f"worst sensor, {k}": np.s_[:, k] for k in range(H.shape[1])}
        bands = {f"worst band, {f[b[0]]:.4g} to {f[b[-1]]:.4g} Hz": np.s_[b] for b in blocks}
        for parts in (sensors, bands):
            found = {name: (squares[at].sum() / variance, 2.0 * used[at].sum())
                     for name, at in parts.items() if used[at].any()}  # fmt: skip
            name = max(found, key=lambda x: deviation(*found[x]))
            rows.append(chi_row(name, *found[name], len(parts), scale=2 / freedom))
    return Report("updating", tuple(rows))


def deviation(value: float, freedom: float) -> float:
    """Standard deviations of chi-square above its expectation."""
    return float((value - freedom) / np.sqrt(2 * max(freedom, 1.0)))


def chi_row(
    name: str, value: float, freedom: float, trials: int, data: Any = None, scale: float = 0.0
) -> Row:
    """Chi-square over its expectation; the limit is kept by a right model but for one in 1000.

    Squares over estimated variances vary more, as if they had less freedom; what is not known of
    the scale of all makes the quotient one of F, whose denominator has the freedom 2 / variance.
    """
    freedom = max(freedom, 1.0)
    own, scale = (freedom, scale) if data is None else (data.known * freedom, data.scale)
    limit = chi2.isf(MAX_FALSE_REFUSAL / trials, own) / own
    if scale > MIN_SCALE:
        limit = f_ratio.isf(MAX_FALSE_REFUSAL / trials, own, 2 / scale)
    return row(f"{name}, over its expectation", value / freedom, float(limit))
