"""What the data say: the record of an update, channels that cannot be right, and the verdict.

Source:
    Score test: Rao, Large sample tests of statistical hypotheses, Proc. Cambridge Philos. Soc. 44
    (1948) 50.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, whole
from rom.assembly.assembly import Assembly
from rom.body.flexible import FlexibleBody
from rom.components.families.assembled import FamilyAssembly
from rom.components.updating.family_model import Family, FamilyModel, Parts
from rom.components.updating.frf_data import Complex
from rom.components.updating.measured import Channels
from rom.components.updating.models import DEAD_RATIO, chi_row, worst_rows
from rom.components.updating.normal_equations import Data, Sums, responses_at, wrapped
from rom.errors import ConfigError
from rom.model import Array, Index, Mask, Report, Row
from rom.rows import row

KNOWN_FACTORS = {
    9.80665: "acceleration in g",
    1 / 9.80665: "acceleration in m/s^2 taken for g",
    1e3: "millimetres or millivolts",
    1e-3: "metres taken for millimetres",
}
DERIVED_KINDS = {  # powers of the frequency that one quantity has more than another
    -2: "displacements taken for accelerations",
    -1: "a velocity taken for its derivative, or a displacement for a velocity",
    1: "an acceleration taken for a velocity, or a velocity for a displacement",
    2: "accelerations taken for displacements",
}
MAX_LOG_LEVEL = 1.5  # of all responses: a factor of 4.5, which no range of moduli explains
LEFT_LOG_LEVEL = 0.7  # of a sensor at the end of the search: a factor of two
FACTOR_LOG_ATOL = 0.7  # within which a known factor is named
MIN_PHASE_COSINE = -0.4  # mean over the lines: a sensor of which measures the other direction
MIN_OTHERS_COSINE = 0.2  # mean over the other sensors, without which phases say nothing
MAX_SCORE = 4.0  # standard deviations
UNSEEN_RTOL = 0.5  # of a parameter's range: a wider standard deviation says nothing new


@dataclass(frozen=True, slots=True)
class Updated:
    """What a test says about a family.

    Attributes:
        family: that was updated, or the assembly of families.
        factors: all parameters, also those that were kept [1].
        zeta: (m,) damping ratios of the lowest elastic modes, the last one of all others too [1].
        names: (n,) of the unknowns, damping ratios last.
        covariance: (n, n) of the logarithms of the unknowns [1].
        verdict: whether noise alone explains what is left, and where it does not.
        by_sensor: (n_s,) mean squared residual over its expectation [1].
        by_line: (n_f,) likewise [1]; NaN for lines that were not used.
        scores: {name: by how many standard deviations the data ask for a parameter that was not
            updated [1]}; beyond four it is missing, with the sign of its change.
        unseen: directions, {name: share [1]} in the parameters, that the data do not see.
        at_bound: names of parameters that lie at an end of their range.
        model: the family at the sensors and inputs of the test.
    """

    family: Family
    factors: dict[str, float]
    zeta: Array
    names: tuple[str, ...]
    covariance: Array
    verdict: Report
    by_sensor: Array
    by_line: Array
    scores: dict[str, float]
    unseen: tuple[dict[str, float], ...]
    at_bound: tuple[str, ...]
    model: FamilyModel

    @property
    def deviations(self) -> dict[str, float]:
        """Relative standard deviation of each unknown [1]."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def correlations(self) -> Array:
        """(n, n) correlation of the unknowns [1]."""
        d = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(d, d)

    @property
    def logarithms(self) -> Array:
        """(n_p,) of all factors; zero for parameters that are not in the model [1]."""
        return np.log(np.where(self.model.present, list(self.factors.values()), 1.0))

    @property
    def body(self) -> FlexibleBody:
        """The body at the factors found; its provenance says by which data, and how surely.

        Raises:
            ConfigError: if an assembly was updated.
        """
        if isinstance(self.family, FamilyAssembly):
            raise ConfigError("an assembly has several bodies.", hint="Take Updated.assembly.")
        return self._signed(self.family.at(extrapolate=False, **self._own))

    @property
    def assembly(self) -> Assembly:
        """The assembly at the factors found, without what is attached; bodies as `body`.

        Raises:
            ConfigError: if a body alone was updated.
        """
        if not isinstance(self.family, FamilyAssembly):
            raise ConfigError("one body was updated, no assembly.", hint="Take Updated.body.")
        found = self.family.at(**self._own)
        bodies = {name: self._signed(body) for name, body in found.bodies.items()}
        return replace(found, bodies=bodies)

    @property
    def _own(self) -> dict[str, float]:
        return {name: self.factors[name] for name in self.family.parameters}

    def _signed(self, body: FlexibleBody) -> FlexibleBody:
        data = {
            "factors": self.factors,
            "deviations": self.deviations,
            "damping": self.zeta.tolist(),
            "lines": int(np.count_nonzero(np.isfinite(self.by_line))),
            "sensors": self.by_sensor.size,
            "verdict holds": self.verdict.ok,
        }
        return replace(body, provenance=body.provenance | {"updating": data})

    def responses(self, frequencies: npt.ArrayLike) -> Complex:
        """(n_f, n_s, n_e) displacement per force of the updated model at lines [Hz] [m/N].

        Raises:
            ConfigError: for lines that are not finite.
        """
        omega = 2 * np.pi * finite("frequencies", frequencies, None)
        return responses_at(self.model, self.logarithms, self.zeta, omega)

    def drawn(
        self,
        frequencies: npt.ArrayLike,
        sensors: Channels,
        inputs: Channels,
        *,
        n: int,
        seed: int = 0,
    ) -> Complex:
        """(n, n_f, n_s, n_e) displacement per force [m/N] at factors that the test leaves possible.

        Logarithms of the unknowns are normal about what was found, with its covariance. The spread
        of the responses is what is not known of them if the model is right.

        Sensors and inputs may be anywhere on the body, also where nothing was measured, at lines
        (n_f,) [Hz]; n draws are made.

        Raises:
            ConfigError: for lines that are not finite, channels off the body, or no draw.
        """
        whole("n", n, 1, None)
        bodies, V = Parts.of(self.family).bodies, self.model.motions
        seen, driven = sensors.rows(bodies, "sensor") @ V, inputs.rows(bodies, "input") @ V
        model = replace(self.model, sensors=seen, driven=driven)
        x = self.logarithms
        unknown = [model.labels(self.zeta.size).index(name) for name in self.names]
        theta = np.tile(np.r_[x, np.log(self.zeta)], (n, 1))
        rng = np.random.default_rng(seed)
        theta[:, unknown] += rng.multivariate_normal(np.zeros(len(unknown)), self.covariance, n)
        omega = 2 * np.pi * finite("frequencies", frequencies, None)
        pairs = zip(*np.split(theta, [x.size], axis=1), strict=True)
        return np.array([responses_at(model, y, np.exp(z), omega) for y, z in pairs])

    def __str__(self) -> str:
        d = self.deviations
        known = [name for name in self.names if name in self.factors]
        lines = [f"  {name} = {self.factors[name]:.5g} +- {100 * d[name]:.2g} %" for name in known]
        return "\n".join(["updated factors", *lines, str(self.verdict)])


def check_channels(models: Iterable[Complex], data: Data) -> None:
    """Refuse responses whose scale or sign no model explains, by sensor, factor and likely reason.

    Models are responses (n_f, n_s, n_e) before updating, then with one factor after another at the
    ends of its range, which are only asked for where the first ones do not fit [m/N].
    """
    found: dict[str, tuple[str, str]] = {}
    for k, H in enumerate(models):
        here = suspects(H, data, MAX_LOG_LEVEL, unsure=k > 0)
        found = here if k == 0 else {key: found[key] for key in found if key in here}
        if not found:
            return
    for message, hint in found.values():
        raise ConfigError(message, hint=hint)


def suspects(
    H: Complex, data: Data, most: float, *, unsure: bool = False
) -> dict[str, tuple[str, str]]:
    """{"level 3", "sign of input 1": (message, hint)} of channels that differ from a model.

    By responses (n_f, n_s, n_e) of the model [m/N] and the logarithm of the largest level that is
    taken; signs that the model says little about are listed where one is unsure.
    """
    used, found = data.weight > 0, {}
    size = np.abs(H).max(axis=(0, 2))
    for s in np.flatnonzero((size < DEAD_RATIO * size.max()) & used.any(axis=(0, 2))):
        found[f"level {s}"] = (
            f"sensor {s} moves by {size[s] / size.max():.1e} of the largest response of the model: "
            "a support or symmetry keeps it still.",
            "Leave it out, or give it the coherence 0.",
        )
    log = wrapped(data.logarithm - np.log(H))
    levels = _levels(log.real, used, most, np.log(data.omega))
    return found or levels | _turned(np.cos(log.imag), used, unsure)


def _levels(log: Array, used: Mask, most: float, lines: Array) -> dict[str, tuple[str, str]]:
    """Sensors beside all of them, inputs beside the other ones, and all beside the model.

    By logarithms (n_f, n_s, n_e) of levels over those of the model, and (n_f,) of frequencies.
    """
    found = {}
    sensors, inputs = (_medians(log, used, axis) for axis in (1, 2))
    for e, level in enumerate(inputs):
        others = float(np.median(np.delete(inputs, e))) if inputs.size > 1 else level
        if abs(level - others) > most and abs(level) > abs(others):
            found[f"level of input {e}"] = (
                f"responses to input {e} are {np.exp(level):.3g} times those of the model"
                f"{_reason(level)}, to others {np.exp(others):.3g} times.",
                "Check the scale, the direction and the place of this force.",
            )
    common = float(np.median(sensors))
    if abs(common) > most and not found:
        found["level of all"] = (
            f"all responses are {np.exp(common):.3g} times those of the model"
            f"{_derived(log, used, lines) or _reason(common)}.",
            "Check units, also of the lines (Hz, not rad/s), quantity, and whether the data are of "
            "this body.",
        )
    for s in np.flatnonzero(np.abs(sensors - common) > most):
        found[f"level {s}"] = (
            f"sensor {s} gives {np.exp(sensors[s]):.3g} times the model"
            f"{_derived(log[:, [s]], used[:, [s]], lines) or _reason(sensors[s])}, the others "
            f"{np.exp(common):.3g} times.",
            "Check its scale, its direction and its place.",
        )
    return found


def _medians(log: Array, used: Mask, axis: int) -> Array:
    """(k,) median of what counts for each channel; zero without."""
    pairs = zip(np.moveaxis(log, axis, 0), np.moveaxis(used, axis, 0), strict=True)
    return np.array([np.median(own[kept]) if kept.any() else 0.0 for own, kept in pairs])


def _reason(level: float) -> str:
    for factor, what in KNOWN_FACTORS.items():
        if abs(level - np.log(factor)) < FACTOR_LOG_ATOL:
            return f" (about {factor:.4g}: {what}?)"
    return ""


def _derived(log: Array, used: Mask, lines: Array) -> str:
    """By which power of the frequency responses differ from a model, where it is one or two."""
    x = np.broadcast_to(lines[:, None, None], log.shape)[used]
    if not np.ptp(x):
        return ""
    level = np.polyfit(x - x.mean(), log[used], 1)
    order = int(np.round(level[0]))
    if order not in DERIVED_KINDS or abs(level[1] - order * x.mean()) > MAX_LOG_LEVEL:
        return ""
    return f" (about (2 pi f)^{order}: {DERIVED_KINDS[order]}?)"


def _turned(cosine: Array, used: Mask, unsure: bool) -> dict[str, tuple[str, str]]:
    """Sensors and inputs of which phases run against the model while those of others do not."""
    most, found = 0.0 if unsure else MIN_PHASE_COSINE, {}
    for what, axes in (("sensor", (0, 2)), ("input", (0, 1))):
        mean = (cosine * used).sum(axis=axes) / np.maximum(used.sum(axis=axes), 1)
        for k in range(mean.size):
            others = float(np.median(np.delete(mean, k))) if mean.size > 1 else 0.0
            if mean[k] < most if others > MIN_OTHERS_COSINE else unsure:
                found[f"sign of {what} {k}"] = (
                    f"{what} {k} moves against the model (mean cosine of the phase {mean[k]:.2f}; "
                    f"{others:.2f} of the others): it looks turned around.",
                    "Turn its direction, or see whether two cables are exchanged.",
                )
    if mean.max() < most:
        found["sign of all"] = (
            f"all responses run against the model (mean cosine of the phase {mean.max():.2f}): "
            "forces or sensors look turned around.",
            "Turn the direction of the force, or see whether it is that of the reaction.",
        )
    return found


def scores(normal: Array, gradient: Array, free: Index, names: tuple[str, ...]) -> dict[str, float]:
    """{name: score in standard deviations} of parameters not updated; positive: more of it.

    By J^T J (n, n) and J^T r (n,), of which the parameters are the first.
    """
    own = np.linalg.pinv(normal[np.ix_(free, free)], hermitian=True)
    found = {}
    for j in np.setdiff1d(np.arange(len(names)), free):
        across = normal[j, free] @ own
        information = normal[j, j] - across @ normal[free, j]
        if information > 1e-12 * normal[j, j]:
            slope = gradient[j] - across @ gradient[free]
            found[names[j]] = float(-slope / np.sqrt(information))
    return found


def unseen_directions(
    normal: Array, width: Array, names: tuple[str, ...]
) -> tuple[dict[str, float], ...]:
    """Directions whose standard deviation exceeds half the range of the parameters.

    By the information (n, n) on the logarithms of the unknowns, and their ranges (n,).
    """
    lam, V = np.linalg.eigh(normal * np.outer(width, width))
    unseen = V[:, lam < UNSEEN_RTOL**-2.0]
    return tuple(
        {names[k]: float(v[k]) for k in np.argsort(-np.abs(v)) if abs(v[k]) > 0.1} for v in unseen.T
    )


def verdict(s: Sums, data: Data, n: int, missing: dict[str, float], doubts: list[Row]) -> Report:
    """Whether noise alone explains what is left by n unknowns, with scores of what is missing."""
    freedom = data.n_values - n
    known = {"known": data.known, "scale": data.scale}
    rows = [chi_row("chi-square of all residuals", s.chi_square, freedom, 1, **known)]
    rows += worst_rows(s.squares, data.weight > 0, data.omega, **known)
    if missing:
        name, score = max(missing.items(), key=lambda item: abs(item[1]))
        rows.append(row(f"largest score, {name} [deviations]", abs(score), MAX_SCORE))
    return Report("updating", (*rows, *doubts))


def band(frequencies: Array, highest: float) -> Row:
    """The highest line over the middle one of the frequencies of the updated model.

    Of these (n,), ascending [Hz], the lower half is trusted, as of vectors that are iterated.

    Source:
        Bathe, Finite element procedures (1996), 11.6: twice as many vectors as modes.
    """
    middle = frequencies[(frequencies.size - 1) // 2]
    return row(f"highest line over {middle:.4g} Hz, the band of the basis", highest / middle, 1.0)
