"""Parameters of a mechanism from measured histories, with what is left uncertain of them.

Source:
    Bard, Nonlinear parameter estimation (1974), chapters 5 and 7; Seber and Wild, Nonlinear
    regression (1989), chapters 2, 3 and 5.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.stats import chi2, norm

import rom
from rom.arguments import Count, Number, Positive, ascending, between, finite, shortened, typed
from rom.components.studies.described import value_of
from rom.components.studies.samples import check_ranges, design, scaled
from rom.components.studies.study import Study, study
from rom.components.updating.models import MAX_FALSE_REFUSAL, chi_row
from rom.components.updating.verdict import UNSEEN_RTOL, unseen_directions
from rom.errors import ConfigError, InterruptedRun, RomError, RomWarning, SolverError
from rom.mbs.analysis.sensitivity import by_name
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.model import Array, Report, Row
from rom.names import check_all_known, named
from rom.rows import row

DIFFERENCE_STEP = 1e-4  # of a range: round-off of a motion below it, curvature above
MAX_TRIALS = 200  # of one search; ten are usual
SAME_MINIMUM = 0.1  # chi-square, over its expectation, within which two searches ended alike
AT_BOUND = 1e-4  # of a range, from its end
MAX_SHIFT = 0.5  # of a parameter by the step of time, in its deviations
WHOLE_ERROR = 4 / 3  # of an error of second order over what halving the step removes
HISTORIES = "Give {quantity: (times, values, deviation)}, as {'slider position x': (t, x, 1e-4)}."


@dataclass(frozen=True, eq=False)
class Record:
    """What was measured of one quantity."""

    name: str
    t: Array  # (n,) [s]
    values: Array  # (n,) or (n, c)
    deviation: Array  # likewise, of the noise

    @classmethod
    def of(cls, name: str, given: Any) -> "Record":
        """Checked; times, values, and a deviation of all, of each instant or of each value."""
        try:
            t, values, deviation = given
        except (TypeError, ValueError) as error:
            raise ConfigError(f"{name!r} is {shortened(given)}.", hint=HISTORIES) from error
        t, values = (
            ascending(f"times of {name!r}", t, 1),
            finite(f"values of {name!r}", values, None),
        )
        if values.ndim not in (1, 2) or len(values) != len(t):
            raise ConfigError(f"{name!r} has {len(t)} times for values of shape {values.shape}.")
        sigma = finite(f"deviation of {name!r}", deviation, None)
        sigma = sigma[:, None] if sigma.ndim == 1 < values.ndim else sigma
        if sigma.ndim and sigma.shape not in (values.shape, (len(t), 1)):
            text = f"{name!r} has a deviation of shape {sigma.shape} for values of {values.shape}"
            raise ConfigError(f"{text}; give a number, or one for each.")
        if not (sigma > 0).all():
            raise ConfigError(f"the deviation of {name!r} is {sigma.min():g}; it must be positive.")
        return cls(name, t, values, np.broadcast_to(sigma, values.shape))

    def misfit(self, solution: Solution) -> Array:
        """What a motion says less what was measured, over the deviation, row by row."""
        x = np.asarray(value_of(self.name, solution), dtype=float)
        if x.shape[1:] != self.values.shape[1:] or not x.ndim:
            shape = f"({', '.join(['n', *map(str, x.shape[1:])])})" if x.ndim else "one number"
            raise ConfigError(
                f"{self.name!r} is {shape} of a motion, measured {self.values.shape}."
            )
        if not solution.t[0] <= self.t[0] <= self.t[-1] <= solution.t[-1] * (1 + 1e-12):
            text = f"{self.name!r} was measured from {self.t[0]:g} s to {self.t[-1]:g} s"
            raise ConfigError(f"{text}, the motion is {solution.t[0]:g} s to {solution.t[-1]:g} s.")
        return ((CubicSpline(solution.t, x)(self.t) - self.values) / self.deviation).ravel()


@dataclass(frozen=True, eq=False)
class Search:
    """Least squares in shares of the ranges of the parameters, from one start after the other."""

    build: Callable[..., Any]
    ranges: dict[str, tuple[float, float]]
    log: tuple[str, ...]
    records: tuple[Record, ...]
    options: dict[str, Any]  # of `rom.simulate`

    @property
    def name(self) -> str:
        """By which a study knows it."""
        return str(getattr(self.build, "__qualname__", type(self.build).__name__))

    def values(self, shares: Array) -> dict[str, float]:
        """Parameters at shares (p,) of their ranges [1]."""
        found = scaled(shares[None], self.ranges, self.log)
        return {name: float(x[0]) for name, x in found.items()}

    def shares(self, values: Mapping[str, float]) -> Array:
        """The inverse of `values`."""
        scale = {name: np.log if name in self.log else float for name in self.ranges}
        rows = ((f(values[n]), *map(f, self.ranges[n])) for n, f in scale.items())
        return np.array([(x - low) / (high - low) for x, low, high in rows])

    def slopes_of_values(self, shares: Array) -> Array:
        """(p,) derivatives of the parameters by their shares."""
        return np.array(
            [
                x * np.log(high / low) if name in self.log else high - low
                for (name, (low, high)), x in zip(
                    self.ranges.items(), self.values(shares).values(), strict=True
                )
            ]
        )

    def check(self, values: dict[str, float]) -> None:
        """Refuse what is wrong wherever the search begins; what cannot be moved is met there."""
        try:
            made = self.build(**values)
            if isinstance(made, Mechanism) and not self.options:
                raise ConfigError("dt is missing: the step with which the mechanism is moved [s].")
            if isinstance(made, Solution) and self.options:
                raise ConfigError(
                    f"build moves the mechanism itself; leave out {named(self.options)}."
                )
            if not isinstance(made, Mechanism | Solution):
                text = f"build returned {shortened(made)}, no rom.Mechanism and no motion of one"
                raise ConfigError(f"{text}; return one of these.")
            self.residuals(self.shares(values))
        except ConfigError:
            raise
        except (RomError, ArithmeticError) as error:
            if isinstance(error, InterruptedRun):
                raise

    def residuals(self, shares: Array, **changed: float) -> Array:
        """(m,) what is left of all records, over their deviations [1]."""
        made = self.build(**self.values(shares))
        if isinstance(made, Mechanism):
            made = rom.simulate(made, **self.options | changed)
        return np.concatenate([record.misfit(made) for record in self.records])

    def __call__(self, **start: float) -> dict[str, Any]:
        """Where a search ends: shares, residuals there and their slopes, and what it took."""
        moved = failed = 0

        def residuals(shares: Array) -> Array:
            nonlocal moved, failed
            moved += 1
            try:
                return self.residuals(shares)
            except (RomError, ArithmeticError) as error:
                if moved == 1 or isinstance(error, InterruptedRun):
                    raise
                failed += 1
                return np.full(sum(record.values.size for record in self.records), np.nan)

        def slopes(shares: Array) -> Array:
            return np.stack([self._slope(residuals, shares, k) for k in range(shares.size)], axis=1)

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RomWarning)  # of motions on the way
            found = least_squares(
                residuals, self.shares(start), slopes, bounds=(0.0, 1.0), max_nfev=MAX_TRIALS
            )
        return {
            "shares": found.x, "residuals": found.fun, "slopes": found.jac,
            "chi-square": 2 * found.cost, "settled": found.status > 0,
            "motions": moved, "failed motions": failed,
        }  # fmt: skip

    def _slope(self, residuals: Callable[[Array], Array], shares: Array, k: int) -> Array:
        """(m,) central difference; a side on which the motion fails gives way to the middle."""
        ends = np.clip(shares[k] + DIFFERENCE_STEP * np.array([-1.0, 1.0]), 0.0, 1.0)
        at = np.where(np.arange(shares.size) == k, ends[:, None], shares)
        low, high = map(residuals, at)
        if np.isnan(low).any() and np.isnan(high).any():
            name = list(self.ranges)[k]
            raise SolverError(f"motions on both sides of {self.values(shares)} fail by {name!r}.")
        if np.isnan(low).any():
            low, ends[0] = residuals(shares), shares[k]
        elif np.isnan(high).any():
            high, ends[1] = residuals(shares), shares[k]
        return np.asarray((high - low) / (ends[1] - ends[0]))


@dataclass(frozen=True, eq=False)
class Fitted:
    """What measured histories say about parameters of a mechanism.

    Attributes:
        values: {parameter: value}.
        covariance: (p, p) of these values, in their units, as far as the histories tell them.
        undetermined: directions, {parameter: share of its range [1]}, in which parameters may
            change together and the histories do not tell.
        verdict: whether noise alone explains what is left, and where it does not.
        misfit: {record: mean squared residual over its expectation [1]}.
        predicted: {record: (n,) or (n, c) as measured}, of the mechanism fitted.
        residuals: {record: likewise}, predicted less measured, over the deviation [1].
        at_bound: names of parameters that lie at an end of their range.
        searches: starts and ends of all searches; a start that cannot be moved is a failed row.
    """

    values: dict[str, float]
    covariance: Array
    undetermined: tuple[dict[str, float], ...]
    verdict: Report
    misfit: dict[str, float]
    predicted: dict[str, Array]
    residuals: dict[str, Array]
    at_bound: tuple[str, ...]
    searches: Study

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviation of each value, in its unit; infinite where it is undetermined."""
        unseen = {name for direction in self.undetermined for name in direction}
        found = zip(self.values, np.sqrt(np.diag(self.covariance)).tolist(), strict=True)
        return {name: np.inf if name in unseen else d for name, d in found}

    @property
    def correlations(self) -> Array:
        """(p, p) correlation of the values [1]; NaN of what no history tells."""
        d = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore"):
            return self.covariance / np.outer(d, d)

    def __str__(self) -> str:
        lines = [f"  {name} = {self.values[name]:.6g}"
                 + (f" +- {d:.2g}" if np.isfinite(d) else ", not determined")
                 for name, d in self.deviations.items()]  # fmt: skip
        for one in self.undetermined:
            shares = ", ".join(f"{share:+.2f} {name}" for name, share in one.items())
            lines.append(f"  not told, in shares of ranges: {shares}")
        return "\n".join(["fitted parameters", *lines, *self._searched, str(self.verdict)])

    @property
    def _searched(self) -> list[str]:
        good, ends = self.searches.good, self.searches.values
        found, n = np.sort(ends["chi-square"][good]), len(self.searches.seconds)
        same = found <= found[0] + SAME_MINIMUM * max(1.0, found[0] / ends["residuals"].shape[1])
        moved, failed = (int(ends[name][good].sum()) for name in ("motions", "failed motions"))
        others = f", others at a chi-square from {found[~same][0]:.4g} on" if not same.all() else ""
        lines = [f"  {same.sum()} of {n} searches ended here, at {found[0]:.4g}{others}"]
        lost = f"  {failed} of {moved} motions failed, and steps there were taken back"
        return lines + [lost] * bool(failed)


@typed
def fit(  # noqa: PLR0913  what is sought, from where, and what runs
    build: Callable[..., Any],
    parameters: Mapping[str, Any],
    measured: Mapping[str, Any],
    *,
    t_end: Annotated[float, Number("s")] | None = None,
    dt: Annotated[float, Positive("s")] | None = None,
    log: Sequence[str] = (),
    start: Mapping[str, float] | None = None,
    starts: Annotated[int, Count(1)] = 1,
    rng: np.random.Generator | None = None,
    executor: Any = None,
    workers: Annotated[int, Count(0)] | None = None,
    progress: bool = True,
    **options: Any,
) -> Fitted:
    """Find the parameters of a mechanism that explain measured histories.

    Residuals over their deviations, which are independent and normal, are squared, summed, and
    made least within the ranges. Between the instants of a motion histories are cubic splines.

    Args:
        build: function of the parameters by name that returns a `rom.Mechanism`, which is then
            moved, or its motion by `rom.simulate`. With several starts it goes to other processes:
            see `rom.study`.
        parameters: {name: (lowest, highest)}.
        measured: {quantity: (times (n,) [s], values (n,) or (n, c), standard deviation of the
            noise)}; the deviation is a number, or one for each instant or value. Quantities are
            named as `rom.write_history` has them, "slider position x" or "crank pin force".
        t_end: end of the motion [s]; None for the last time measured.
        dt: step of the motion [s], so small that the verdict finds no shift by it.
        log: parameters whose logarithms are sought.
        start: {name: value} of the first search; from the middle of a range without.
        starts: number of searches; the others begin at a Latin hypercube, and the best one counts.
        rng: generator, for these.
        executor: of the searches, see `rom.study`.
        workers: processes for the searches, None for one on each core, 0 for this process itself.
        progress: show how many searches are done.
        options: of `rom.simulate`.

    Raises:
        ConfigError: for a range upside down, a quantity that the mechanism has not, histories with
            gaps or outside the motion, fewer values than parameters, a function that builds none.
        SolverError: if the mechanism cannot be moved from any start.

    Source:
        Bard, Nonlinear parameter estimation (1974); differences by `scipy.optimize.least_squares`.
    """
    ranges = {name: tuple(x) if np.ndim(x) else x for name, x in parameters.items()}
    check_ranges(by_name(ranges, "build", build), log)
    records = tuple(Record.of(*item) for item in measured.items())
    n, p = sum(record.values.size for record in records), len(ranges)
    if n <= p:
        raise ConfigError(f"{n} values measured for {p} parameters; measure more, or fit fewer.")
    if dt is not None:
        last = max(record.t[-1] for record in records)
        options |= {"dt": dt, "t_end": last if t_end is None else t_end}
    search = Search(build, ranges, tuple(log), records, options)
    first = search.values(np.full(p, 0.5)) | _inside(start or {}, ranges)
    search.check(first)
    more = design(ranges, starts - 1, log=log, rng=rng) if starts > 1 else {}
    samples = {name: np.r_[x, more.get(name, [])] for name, x in first.items()}
    where = 0 if starts == 1 and executor is None else workers
    found = study(search, samples, executor=executor, workers=where, progress=progress)
    if not found.good.size:
        text = f"the mechanism cannot be moved from any of {starts} starts; {found.failed[0]}"
        raise SolverError(text, hint="Narrow the ranges, or give a start that moves.")
    return _fitted(search, found)


def _inside(start: Mapping[str, float], ranges: Mapping[str, Any]) -> dict[str, float]:
    check_all_known(start, ranges, "start= names no parameter")
    return {name: between(f"start of {name!r}", x, *ranges[name]) for name, x in start.items()}


def _fitted(search: Search, found: Study) -> Fitted:
    """The record of the best of the searches that ended."""
    best = found.good[found.values["chi-square"][found.good].argmin()]
    shares, r, J = (found.values[name][best] for name in ("shares", "residuals", "slopes"))
    names, values = tuple(search.ranges), search.values(shares)
    lam, V = np.linalg.eigh(J.T @ J)
    seen = lam >= UNSEEN_RTOL**-2.0
    C = (V[:, seen] / lam[seen]) @ V[:, seen].T
    at_bound = tuple(np.array(names)[np.minimum(shares, 1 - shares) <= AT_BOUND].tolist())
    cuts = np.cumsum([record.values.size for record in search.records])[:-1]
    pairs = list(zip(search.records, np.split(r, cuts), strict=True))
    left = {record.name: x.reshape(record.values.shape) for record, x in pairs}
    rows = _noise_rows(left, r.size - np.count_nonzero(seen))
    if "dt" in search.options:
        rows.append(_step_row(search, shares, r, C, J))
    if not found.values["settled"][best]:
        rows.append(row("trials of the search, which has not ended", MAX_TRIALS, MAX_TRIALS - 1))
    rows += [row(f"{name} inside its range", 1.0, 0.0) for name in at_bound]
    scale = search.slopes_of_values(shares)
    return Fitted(
        values=values,
        covariance=C * np.outer(scale, scale),
        undetermined=unseen_directions(J.T @ J, np.ones(len(names)), names),
        verdict=Report("fit", tuple(rows)),
        misfit={name: float(np.mean(x**2)) for name, x in left.items()},
        predicted={one.name: one.values + left[one.name] * one.deviation for one in search.records},
        residuals=left,
        at_bound=at_bound,
        searches=found,
    )


def _noise_rows(left: dict[str, Array], freedom: int) -> list[Row]:
    """Whether what is left of each record is noise: of the size that was said, and without memory.

    Neighbours by their first serial correlation times the root of their number, which is normal.

    Source:
        Box, Jenkins and Reinsel, Time series analysis (1994), 8.2.
    """
    total, sizes = sum(float(np.sum(x**2)) for x in left.values()), "chi-square of the records"
    least = chi2.ppf(MAX_FALSE_REFUSAL, freedom) / freedom
    off = {name: (np.sum(x**2) - x.size) / np.sqrt(2 * x.size) for name, x in left.items()}
    alike = {name: _memory(x) for name, x in left.items()}
    worst, longest = max(off, key=off.__getitem__), max(alike, key=alike.__getitem__)
    square, n = float(np.sum(left[worst] ** 2)), left[worst].size
    return [
        chi_row(sizes, total, freedom, 1),
        row(f"{sizes}, no less than noise leaves", total / freedom, least, above=True),
        chi_row(f"worst record, {worst}", square, n, len(left)),
        row(f"memory of residuals, {longest} [deviations]", alike[longest],
            float(norm.isf(MAX_FALSE_REFUSAL / len(left)))),
    ]  # fmt: skip


def _memory(x: Array) -> float:
    pairs = x[1:] * x[:-1]
    return float(
        pairs.sum() / max(np.mean(x**2), np.finfo(float).tiny) / np.sqrt(max(pairs.size, 1))
    )


def _step_row(search: Search, shares: Array, r: Array, C: Array, J: Array) -> Row:
    """Largest shift of a parameter with smaller and smaller steps, in its deviations.

    Of half the step to first order; errors of steps, and of splines between them, are of the
    second order or of a higher one.
    """
    try:
        change = search.residuals(shares, dt=search.options["dt"] / 2) - r
    except RomError:
        change = np.full(r.size, np.nan)
    d = np.sqrt(np.diag(C))
    shift = np.abs(C @ (J.T @ change))[d > 0] / d[d > 0]
    text = "shift of a parameter by the step of time [deviations]"
    return row(text, WHOLE_ERROR * shift.max(initial=0.0), MAX_SHIFT)
