"""Updating of a family of bodies by measured responses, with what the data can and cannot say.

Source:
    Levenberg-Marquardt with bounds, as in Nocedal and Wright, Numerical optimization (2006);
    posterior and score test: Cox and Hinkley, Theoretical statistics (1974).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import numpy as np
from scipy.linalg import block_diag

from rom.arguments import Between, Count, Positive, typed
from rom.components.updating import family_model, verdict
from rom.components.updating.family_model import Attached, Family, FamilyModel, Held, Parts
from rom.components.updating.frf_data import Complex, beside_poles
from rom.components.updating.measured import Responses
from rom.components.updating.methods import Update
from rom.components.updating.models import chi_row, likeness
from rom.components.updating.normal_equations import (
    Data,
    Sums,
    by_equations,
    by_response_functions,
    responses_at,
    sums,
)
from rom.components.updating.verdict import Updated
from rom.errors import ConfigError, ParameterError, SolverError, warn
from rom.model import Array, Mask, Row
from rom.names import check_known, named
from rom.plausible import check_damping_ratio
from rom.rows import row

MAX_STEPS = 60  # of the search; ten are usual
MAX_MISFIT = 2.0  # chi-square over its expectation: what did not settle here is a wrong model
MIN_MISFIT = 0.5  # likewise: what is less is no noise as it was said to be
MAX_LOG_STEP = 0.5  # of a factor in one step
DECREMENT_TOL = 1e-4  # expected gain of chi-square: a hundredth of a standard deviation
START_STIFFNESS = 1e-3  # of a step, over the information of each unknown
NEAR_STIFFNESS = 1e-9  # the same, close to the end
MAX_STIFFNESS = 1e10  # beyond it no shorter step lowers the residual
BOUND_ATOL = 1e-9  # distance of a logarithm from the end of its range
DAMPING_LOG_DEVIATION = 1.5  # of ratios about their start, before the test: a factor of 20 in two
DAMPING_RANGE = (1e-6, 0.9)  # ratios that are tried


@typed
def update(  # noqa: PLR0913  keywords of one call
    family: Family,
    test: Responses,
    *,
    free: tuple[str, ...] | None = None,
    fixed: Held = (),
    attached: Attached | None = None,
    candidates: Attached | None = None,
    damping: Annotated[float, Between(*DAMPING_RANGE)] = 0.01,
    prior: dict[str, Annotated[float, Positive()]] | Updated | None = None,
    tolerance: float | None = None,
    residual: Literal["responses", "equations", "response-function"] = "responses",
    rank: Annotated[int, Count(1)] | None = None,
    beside_poles: Annotated[float, Positive()] | None = None,
) -> Updated:
    """Find the factors of a family, and damping ratios, that explain measured responses.

    The logarithm of each response is compared, weighted by its standard deviation. Damping ratios
    of all modes up to one and a half times the highest line are unknowns, and one for all others.

    Args:
        family: from `rom.reduce_parametric`, with moduli and densities; or several, as a
            `rom.parametric.FamilyAssembly`, whose parameters are called "body.parameter".
        test: what was measured.
        free: names of the unknown parameters; None for all. Others stay one and are tried in the
            score test.
        fixed: what was held in the test, see `FlexibleBody.frequencies`.
        attached: {name: `GroundSpring`, `AddedMass` or `JointSpring`} with unknown factors.
        candidates: {name: likewise}, which may be missing in the model: tried in the score test.
        damping: ratio to start from, of all modes [1].
        prior: {name: relative standard deviation [1] of its factor about one, before the test}; or
            what an update by another test found, with other supports, channels or load cases:
            both tests together then say what is found, and parameters that are not free stay.
        tolerance: largest distance of a channel from a surface point [m], see `Channels.rows`.
        residual: "responses", or "equations": of motion at the sensors, linear in what is sought,
            biased by noise and by the condensation; or "response-function": H - H_test is
            H dZ H_test, linear too, and without condensation, from where few responses lead. The
            verdict is that of responses; a prior weighs against what they leave.
        rank: of the basis of equations; None for one direction per mode up to the highest line.
        beside_poles: number of half bandwidths of the poles of the model, once it is near, within
            which lines count less, where damping is hardly known or not that of modes; None to
            count all fully. Their errors are taken for larger, so that deviations are safe.

    Raises:
        ConfigError: for channels off the body, of another scale or sign, too few data, a
            damping that is none to start from, or a family in other units than SI.
        ParameterError, InterfaceError: for a name that is unknown.
        SolverError: if the search does not end though the model fits. Of a model that does not
            fit the verdict says that the search has not ended.

    Source:
        Berriet, Fillod and Bouhaddi, for weighted responses with modal damping.
    """
    check_damping_ratio(damping)
    if rank is not None and residual != "equations":
        raise ConfigError('rank needs residual="equations".')
    family_model.check_units(family)
    bodies = Parts.of(family).bodies
    attached, candidates = dict(attached or {}), dict(candidates or {})
    rows = test.rows(bodies, tolerance)
    model = family_model.family_model(family, rows, attached, candidates, fixed)
    chosen = set(model.names) - set(candidates) if free is None else {*free, *attached}
    for name in sorted(chosen):
        check_known(name, model.names, f"no parameter {name!r}; there are", ParameterError)
    unknown = np.array([name in chosen for name in model.names])
    if isinstance(prior, Updated) and residual != "responses":
        raise ConfigError('the update by another test as a prior needs residual="responses".')
    before = _before(prior or {}, model)
    search = _Search.begun(model, test, unknown, damping, before)
    verdict.check_channels(search.extremes(), search.data.roughly())
    if beside_poles is not None:
        search = search.near().beside(beside_poles)
    if residual == "responses":
        return _found(family, search.run())
    root = np.sqrt(np.diag(before[1]))
    sigma = np.divide(1.0, root, out=np.full(root.size, np.inf), where=root > 0)
    if residual == "equations":
        found = by_equations(model, search.data, search.x, unknown, damping, prior=sigma, rank=rank)
        return replace(_found(family, search.moved(found)), covariance=found.covariance)
    ratios = (damping, DAMPING_LOG_DEVIATION)
    search.near()
    for _ in range(2):  # the second time with errors by the model found
        found = by_response_functions(
            model, search.data, search.x, unknown, search.zeta, prior=sigma, prior_damping=ratios
        )
        search.moved(found).weigh()
    return replace(_found(family, search.moved(found)), covariance=found.covariance)


def _before(prior: dict[str, float] | Updated, model: FamilyModel) -> tuple[Array, Array, int]:
    """Logarithms of factors (n_p,) before a test, the inverse (n_p, n_p) of their covariance.

    From standard deviations about one, or from the update by another test; and how many that found.
    """
    names, precision = model.names, np.zeros((len(model.names),) * 2)
    if not isinstance(prior, Updated):
        family_model.check_prior(prior, names)
        sigma = np.array([prior.get(name, np.inf) for name in names])
        return np.zeros(len(names)), np.diag(sigma**-2.0), 0
    known = [name for name in prior.names if name in names]
    if not known:
        raise ConfigError(f"prior: the test before found none of {named(names)}.")
    here, there = ([those.index(n) for n in known] for those in (names, prior.names))
    precision[np.ix_(here, here)] = np.linalg.inv(prior.covariance[np.ix_(there, there)])
    x = [np.log(prior.factors.get(name, 1.0) or 1.0) for name in names]
    return np.array(x), precision, len(known)


@dataclass(slots=True)
class _Search:
    """The least squares problem and where its search has come to."""

    model: FamilyModel
    test: Responses
    data: Data
    theta: Array
    free: Mask
    precision: Array
    before: Array
    n_known: int
    sums: Sums = field(init=False)
    settled: bool = False
    count: Array | float = 1.0  # by which lines count less

    @staticmethod
    def begun(
        model: FamilyModel,
        test: Responses,
        unknown: Mask,
        damping: float,
        prior: tuple[Array, Array, int],
    ) -> "_Search":
        data, (first, known, n_known) = Data.of(test), prior
        x = np.clip(first, *model.ends)
        m = model.n_ratios(x, data.omega[-1])
        free = np.r_[unknown, np.ones(m, dtype=bool)]
        if data.n_values <= free.sum():
            text = f"{data.n_values} usable numbers for {free.sum()} unknowns."
            hint = "Measure more lines, or fix parameters; lines of low coherence do not count."
            raise ConfigError(text, hint=hint)
        precision = block_diag(known, np.eye(m) * DAMPING_LOG_DEVIATION**-2.0)
        before, theta = (np.r_[y, np.full(m, np.log(damping))] for y in (first, x))
        return _Search(model, test, data, theta, free, precision, before, n_known)

    def extremes(self) -> Iterator[Complex]:
        """Responses where the search begins, then with each factor at both ends of its range."""
        omega = self.data.roughly().omega
        yield responses_at(self.model, self.x, self.zeta, omega)
        for j in np.flatnonzero(self.free[: len(self.model.names)] & self.model.present):
            for end in self.model.ends:
                x = self.x.copy()
                x[j] = end[j]
                yield responses_at(self.model, x, self.zeta, omega)

    @property
    def x(self) -> Array:
        return self.theta[: len(self.model.names)]

    @property
    def zeta(self) -> Array:
        return np.exp(self.theta[len(self.model.names) :])

    @property
    def bounds(self) -> tuple[Array, Array]:
        m = self.theta.size - len(self.model.names)
        ends = zip(self.model.ends, np.log(DAMPING_RANGE), strict=True)
        low, high = (np.r_[p, np.full(m, z)] for p, z in ends)
        return low, high

    def at(self, theta: Array) -> tuple[Sums, float]:
        """Sums and cost at some unknowns."""
        n, off = len(self.model.names), theta - self.before
        found = sums(self.model, theta[:n], np.exp(theta[n:]), self.data)
        return found, found.chi_square + float(off @ self.precision @ off)

    def posterior(self) -> tuple[Array, Array]:
        """Information (n, n) of data and prior, and the gradient (n,) of half the cost."""
        N = self.sums.normal + self.precision
        return N, self.sums.gradient + self.precision @ (self.theta - self.before)

    def moved(self, found: Update) -> "_Search":
        """Where equations led, damping of the modes above the highest line as it was."""
        n, m = len(self.model.names), found.zeta.size
        self.theta[np.flatnonzero(self.free[:n])] = found.p
        self.theta[n : n + m], self.free[n + m :] = np.log(found.zeta), False
        self.sums, _ = self.at(self.theta)
        self.settled = True
        return self

    def near(self) -> "_Search":
        """Descend on few lines with large errors, where a start may be far away."""
        few = replace(self, data=self.data.roughly())
        few._descend(START_STIFFNESS)
        self.theta = few.theta
        return self

    def beside(self, width: float) -> "_Search":
        """Where it is, with lines that count less close to its poles."""
        poles = np.sqrt(self.model.elastic(self.x))
        self.count = beside_poles(self.data.omega, poles[: self.zeta.size], self.zeta, width)
        self.data = replace(self.data, weight=self.data.weight * self.count)
        return self

    def weigh(self) -> None:
        """Take estimated errors over the responses of the model instead of those measured."""
        H = responses_at(self.model, self.x, self.zeta, self.data.omega)
        data = Data.of(self.test, np.log(np.abs(H)) - self.data.logarithm.real)
        self.data = replace(data, weight=data.weight * self.count)

    def run(self) -> "_Search":
        """Approach, then descend on all lines, once more with errors by the model found."""
        self.near()._end()
        if np.any(self.data.varied):
            self.weigh()
            self._end()
        return self

    def _end(self) -> None:
        """Descend on all lines, which must end where the model fits."""
        cost = self._descend(NEAR_STIFFNESS)
        if not self.settled and cost <= MAX_MISFIT * self.data.n_values:
            cure = "Start from better values, or give a prior; see which parameters are correlated."
            raise SolverError(f"updating did not settle in {MAX_STEPS} steps.", hint=cure)

    def _descend(self, mu: float) -> float:
        """Levenberg-Marquardt until the expected gain vanishes; the cost there."""
        self.settled = True  # unless all steps are taken
        self.sums, cost = self.at(self.theta)
        low, high = self.bounds
        for _ in range(MAX_STEPS):
            N, g = self.posterior()
            stuck = ((self.theta <= low) & (g > 0)) | ((self.theta >= high) & (g < 0))
            a = np.flatnonzero(self.free & ~stuck)
            N, g = N[np.ix_(a, a)], g[a]
            spread = max(1.0, cost / self.data.n_values)  # of a model that does not fit
            if g @ np.linalg.lstsq(N, g, rcond=None)[0] < DECREMENT_TOL * spread:
                return cost
            scaled = np.diag(np.maximum(np.diag(N), np.finfo(float).tiny))
            while mu < MAX_STIFFNESS:
                step = -np.linalg.lstsq(N + mu * scaled, g, rcond=None)[0]
                trial = self.theta.copy()
                trial[a] += np.clip(step, -MAX_LOG_STEP, MAX_LOG_STEP)
                trial = np.where(self.free, np.clip(trial, low, high), trial)
                found, new = self.at(trial)
                if new < cost:
                    break
                mu *= 4.0
            else:
                return cost
            moved = (trial - self.theta)[a]
            gain = (cost - new) / -(moved @ (2 * g + N @ moved))
            mu *= max(1 / 3, 1 - (2 * gain - 1) ** 3) if gain > 0 else 1.0
            self.theta, self.sums, cost = trial, found, new
        self.settled = False
        return cost


def _found(family: Family, search: _Search) -> Updated:
    model, data, s = search.model, search.data, search.sums
    n, free = len(model.names), np.flatnonzero(search.free)
    labels = tuple(model.labels(search.theta.size - n)[k] for k in free)
    N, g = search.posterior()
    width = np.r_[np.log(model.high / model.low), np.ones(search.theta.size - n)][free]
    low, high = search.bounds
    ends = np.minimum(search.x - low[:n], high[:n] - search.x) <= BOUND_ATOL
    at_bound = tuple(np.array(model.names)[ends & search.free[:n]].tolist())
    missing = verdict.scores(N, g, free, model.names)
    factors = np.where(model.present, np.exp(search.x), 0.0)
    own = N[np.ix_(free, free)]
    covariance = np.linalg.pinv(own, hermitian=True)
    left = s.chi_square / data.n_values
    if left < MIN_MISFIT and not np.any(data.common) and not np.ndim(search.count):
        warn(
            f"what is left is {left:.3g} of the noise: errors are smaller than said, and a wrong "
            "model may pass. Compare coherence and number of averages."
        )
    if np.any(s.varied):
        covariance += covariance @ s.varied[np.ix_(free, free)] @ covariance
    return Updated(
        family=family,
        factors=dict(zip(model.names, factors.tolist(), strict=True)),
        zeta=search.zeta,
        names=labels,
        covariance=covariance,
        verdict=verdict.verdict(s, data, free.size, missing, _doubts(search, at_bound)),
        by_sensor=_mean(s.squares, data, (0, 2)),
        by_line=_mean(s.squares, data, (1, 2)),
        scores=missing,
        unseen=verdict.unseen_directions(own, width, labels),
        at_bound=at_bound,
        model=model,
    )


def _doubts(search: _Search, at_bound: tuple[str, ...]) -> list[Row]:
    """What makes the end of a search doubtful, whatever noise explains."""
    model, data = search.model, search.data
    H = responses_at(model, search.x, search.zeta, data.omega)
    counted = data.weight > 0
    highest = data.omega[counted.any(axis=(1, 2))][-1] / (2 * np.pi)
    alike = likeness(H, np.exp(data.logarithm), counted)
    rows = [alike, verdict.band(np.sqrt(model.elastic(search.x)) / (2 * np.pi), highest)]
    if search.n_known:
        n = len(model.names)
        off = (search.theta - search.before)[:n]
        moved = float(off @ search.precision[:n, :n] @ off)
        rows.append(chi_row("distance from the test before", moved, search.n_known, 1))
    for message, _ in verdict.suspects(H, data, verdict.LEFT_LOG_LEVEL).values():
        rows.append(row(message, 1.0, 0.0))
    if not search.settled:
        rows.append(row("steps of the search, which has not ended", MAX_STEPS, MAX_STEPS - 1))
    return rows + [row(f"{name} inside its range", 1.0, 0.0) for name in at_bound]


def _mean(squares: Array, data: Data, axes: tuple[int, int]) -> Array:
    """Mean of squared residuals over their expectation; NaN where there are none."""
    expected = 2.0 * np.count_nonzero(data.weight, axis=axes)
    return squares.sum(axis=axes) / np.where(expected > 0, expected, np.nan)
