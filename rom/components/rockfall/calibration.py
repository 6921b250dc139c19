"""Parameters of a gallery from measured histories, with what is left uncertain of them.

Source:
    Least squares by channels of different noise: Bard, Nonlinear Parameter Estimation, Academic
    Press (1974), chapters 4 and 7.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from rom.components.histories import Table
from rom.components.rockfall.impact import Gallery, Impact, scaled, strike
from rom.errors import ConfigError, ModelError, SolverError
from rom.model import Array
from rom.names import check_known, check_once

CHANNELS: dict[str, Callable[[Gallery, Impact], Array]] = {
    "acceleration of the boulder": lambda g, i: i.forces[:, 0] / g.boulder,  # as a sensor reads it
    "force in the cushion": lambda _, i: i.forces[:, 0],
    "force in shear": lambda _, i: i.forces[:, 1],
    "force in bending": lambda _, i: i.forces[:, 2],
    "penetration": lambda _, i: i.z[:, 0] - i.z[:, 1],
    "deflection": lambda _, i: i.z[:, 2],
}
OF_CUSHION = ("stiffness of the cushion", "recovery of the cushion")
FIVE_PARAMETERS = (*OF_CUSHION, "mass of the plug", "stiffness in bending", "damping of the slab")
MAX_FACTOR = 30.0  # by which a parameter may leave its first value
MAX_GAP = 5.0  # a step of time that is so many medians long is a gap
MIN_INSTANTS = 8  # of a history, so that its scatter says something
MAX_DEVIATION = 1.0  # a parameter that is only known to its own size is not determined
FAR_RATIO = 10.0  # of the largest value: how far off parameters are that stop no boulder
# steps of derivatives, in logarithms: above the jumps of the time step, below curvature
DERIVATIVE_STEP = 5e-3
KEPT_INSTANTS = 4000  # so that interpolation between them stays below the noise of any sensor


@dataclass(frozen=True, slots=True)
class History:
    """What was measured of one quantity, time counted from contact.

    Attributes:
        t: (n,) increasing times [s].
        values: (n,) of the channel [m, m/s^2 or N].
        deviation: standard deviation of a value [m, m/s^2 or N]; None if it is to be found.

    Raises:
        ConfigError: for gaps, times that do not increase, values that are not finite.
    """

    t: Array
    values: Array
    deviation: float | None = None

    def __post_init__(self) -> None:
        Table(self.t, self.values)
        t, x = np.asarray(self.t, dtype=float), np.asarray(self.values, dtype=float)
        if t.size < MIN_INSTANTS or t[0] < 0:
            got = f"{t.size} from {t[0]:g} s on"
            raise ConfigError(f"a history needs {MIN_INSTANTS} values or more, t >= 0; got {got}.")
        steps = np.diff(t)
        k = int(steps.argmax())
        if steps[k] > MAX_GAP * np.median(steps):
            gap = f"a gap from {t[k]:g} s to {t[k + 1]:g} s"
            raise ConfigError(f"the history has {gap}; take it as two, cut there.")
        if not x.any() or not (self.deviation is None or self.deviation > 0):
            raise ConfigError("a history needs values that are not zero, and a positive deviation.")


@dataclass(frozen=True, slots=True)
class Calibration:
    """Parameters that fit best, and how well.

    Attributes:
        gallery: with the parameters found.
        factors: {name: what multiplies the first value [1]}.
        deviations: {name: standard deviation of the parameter, relative [1]}.
        correlation: (p, p) of the parameters [1].
        residuals: {channel: root mean square of what is left, relative to the largest value [1]}.
        evaluations: impacts that were computed.
    """

    gallery: Gallery
    factors: dict[str, float]
    deviations: dict[str, float]
    correlation: Array
    residuals: dict[str, float]
    evaluations: int


Names = Sequence[str]
Measured = dict[str, History | Sequence[History]]


def calibrate(
    g: Gallery, measured: Measured, names: Names = FIVE_PARAMETERS, *, t_end: float | None = None
) -> Calibration:
    """Fit parameters by least squares in their logarithms.

    Every channel weighs by the scatter about its best fit, or by the deviation it comes with; the
    covariance is the inverse of J^T J at the end, so it says what noise makes uncertain, not what
    the model cannot do; the residuals say that.

    Args:
        g: the gallery with first values, within a factor of a few.
        measured: {channel: history or histories}, channels "acceleration of the boulder",
            "force in the cushion", "force in shear", "force in bending", "penetration",
            "deflection".
        names: parameters to fit, see `scaled`.
        t_end: time after which histories are left out [s]; None for all.

    Raises:
        ConfigError: for an unknown channel or parameter, nothing measured, or first values that
            stop no boulder.
        SolverError: if an impact with the first values breaks down.
        ModelError: if the histories do not determine a parameter.
    """
    pieces = _pieces(measured, t_end)
    scaled(g, dict.fromkeys(names, 1.0))
    check_once(names, "names:")
    if not names:
        raise ConfigError("names = () must be at least one parameter.")
    end = max(float(h.t[-1]) for _, h in pieces)
    count = 0

    def gallery(x: Array) -> Gallery:
        return scaled(g, dict(zip(names, np.exp(x).tolist(), strict=True)))

    def residuals(x: Array) -> list[Array]:
        nonlocal count
        count += 1
        trial = gallery(x)
        try:
            impact = strike(trial, t_end=end, keep=KEPT_INSTANTS)
        except (ConfigError, SolverError):  # such as a boulder through the cushion
            if count == 1:
                raise
            return [np.full(h.t.size, FAR_RATIO * np.abs(h.values).max()) for _, h in pieces]
        return [np.interp(h.t, impact.t, CHANNELS[c](trial, impact)) - h.values for c, h in pieces]

    def weighed(x: Array, deviations: list[float]) -> Array:
        return np.concatenate([r / d for r, d in zip(residuals(x), deviations, strict=True)])

    x, scales = np.zeros(len(names)), [float(np.abs(h.values).max()) for _, h in pieces]
    most = np.log(MAX_FACTOR)  # of a logarithm; nothing gives back more than it takes
    limits = {"recovery of the cushion": min(most, 1e-9 - np.log(g.cushion.recovery))}
    bounds = np.full(len(names), -most), np.array([limits.get(name, most) for name in names])
    for weights in (scales, None):  # by size first, by scatter then
        sizes = weights or _scatter(residuals(x), pieces, len(names))
        fit = least_squares(weighed, x, "3-point", bounds, args=(sizes,), diff_step=DERIVATIVE_STEP)
        x = fit.x
    cov = _covariance(fit.jac, x, names, bounds)
    sigma = np.sqrt(np.diag(cov))
    each = zip(pieces, residuals(x), scales, strict=True)
    left = {c: float(np.sqrt(np.mean(r**2)) / s) for (c, _), r, s in each}
    factors, wide = (dict(zip(names, y.tolist(), strict=True)) for y in (np.exp(x), sigma))
    return Calibration(gallery(x), factors, wide, cov / np.outer(sigma, sigma), left, count)


def _pieces(measured: Measured, t_end: float | None) -> list[tuple[str, History]]:
    """Channels and histories one by one, cut at the end."""
    pieces: list[tuple[str, History]] = []
    for channel, histories in measured.items():
        check_known(channel, CHANNELS, f"{channel!r} is no channel; known are")
        for h in [histories] if isinstance(histories, History) else histories:
            t, x = np.asarray(h.t, dtype=float), np.asarray(h.values, dtype=float)
            kept = t <= (np.inf if t_end is None else t_end)
            pieces.append((channel, History(t[kept], x[kept], h.deviation)))
    if not pieces:
        raise ConfigError("nothing is measured; give at least one history.")
    return pieces


def _scatter(left: list[Array], pieces: list[tuple[str, History]], n: int) -> list[float]:
    """Standard deviations of the histories: given, or of what is left of them."""
    total = sum(r.size for r in left)
    return [
        h.deviation or float(np.sqrt((r**2).mean() * total / max(total - n, 1))) + 1e-12
        for r, (_, h) in zip(left, pieces, strict=True)
    ]


def _covariance(J: Array, x: Array, names: Names, bounds: tuple[Array, Array]) -> Array:
    """Inverse of J^T J, or the name of what the histories do not determine."""
    sizes = np.linalg.norm(J, axis=0)
    blind = [n for n, s in zip(names, sizes, strict=True) if s == 0]
    cov = np.linalg.pinv(J.T @ J, rcond=1e-14) if not blind else np.zeros((x.size, x.size))
    wide = np.sqrt(np.diag(cov)) > MAX_DEVIATION
    at_bound = (np.abs(x - bounds[0]) < DERIVATIVE_STEP) | (np.abs(x - bounds[1]) < DERIVATIVE_STEP)
    lost = blind + [n for n, w, b in zip(names, wide, at_bound, strict=True) if w or b]
    if lost:
        text = f"the histories do not determine {', '.join(dict.fromkeys(lost))}"
        raise ModelError(f"{text}; fit fewer parameters, or measure where they matter.")
    return cov
