"""Parameters of a mechanism from measured histories, with what is left uncertain of them.

Source:
    Bard, Nonlinear parameter estimation (1974), chapters 5 and 7; Seber and Wild, Nonlinear
    regression (1989), chapters 2 and 5.
"""

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from rom.arguments import Count, Number, Positive, ascending, between, finite, shortened, typed
from rom.components.studies.described import value_of
from rom.components.studies.fitted import Fitted, noise_rows
from rom.components.studies.samples import check_ranges, design
from rom.components.studies.study import Study, study
from rom.components.updating.verdict import unseen_directions
from rom.errors import ConfigError, MaterialError, MeshError, ModelError, RomWarning, SolverError
from rom.mbs.analysis.sensitivity import by_name
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.model import Array, Mask, Report, Row
from rom.names import check_all_known, named
from rom.rows import row

UNMOVED = (MaterialError, MeshError, ModelError, SolverError, ArithmeticError)
DIFFERENCE_STEP = 1e-4  # of a range: round-off of a motion below it, curvature above
MAX_TRIALS = 200  # of one search; ten are usual
LAST_GAIN = 1e-4  # of chi-square over its expectation, with which a search ends
OF_RANGE = 12.0  # information of a uniform distribution over a range of one
BOUND_RTOL = 1e-4  # of a range, from its end
WHOLE_ERROR = 4 / 3  # of second order, over what halving the step takes away
MAX_SHIFT = 0.5  # of a parameter by the step of time, in its deviations
TIME_RTOL = 1e-9  # of a motion, beyond its end
FORM = "Write {'slider position x': (times, values, deviation), ...}."


@dataclass(frozen=True, eq=False)
class Record:
    """What was measured of one quantity."""

    name: str
    t: Array  # (n,) [s]
    values: Array  # (n,) or (n, c)
    deviation: Array  # likewise, of the noise

    @classmethod
    def of(cls, name: str, given: Any) -> "Record":
        """Of times, values and a deviation: one of all, one for each time, or for each value."""
        if not isinstance(given, tuple | list) or len(given) != 3:
            raise ConfigError(f"measured {name!r} is {shortened(given)}.", hint=FORM)
        t = ascending(f"times of {name!r}", given[0], 1)
        values = finite(f"values of {name!r}", given[1], None)
        sigma = finite(f"the deviation of {name!r}", given[2], None)
        sigma = sigma[:, None] if sigma.ndim == 1 < values.ndim else sigma
        if values.shape[:1] != t.shape or sigma.shape not in ((), values.shape, (t.size, 1)):
            text = f"{name!r} has {t.size} times, values {values.shape}, deviations {sigma.shape}"
            raise ConfigError(f"{text}; give as many of each, or one deviation.")
        if not (sigma > 0).all():
            raise ConfigError(f"the deviation of {name!r} is {sigma.min():g}; it must be positive.")
        return cls(name, t, values, np.broadcast_to(sigma, values.shape))

    def residual(self, motion: Solution) -> Array:
        """(m,) what a motion says less what was measured, over the deviation."""
        x, t = np.asarray(value_of(self.name, motion), dtype=float), motion.t
        if x.shape[:1] != t.shape or x.shape[1:] != self.values.shape[1:]:
            text = f"{self.name!r} was measured as {self.values.shape}, one row for each time"
            raise ConfigError(f"{text}; of a motion of {t.size} instants it is {x.shape}.")
        if self.t[0] < t[0] or self.t[-1] > t[-1] + TIME_RTOL * (t[-1] - t[0]):
            text = f"{self.name!r} was measured from {self.t[0]:g} s to {self.t[-1]:g} s"
            raise ConfigError(f"{text}; the motion is from {t[0]:g} s to {t[-1]:g} s.")
        return np.ravel((CubicSpline(t, x)(self.t) - self.values) / self.deviation)


@dataclass(frozen=True, eq=False)
class Search:
    """Least squares from a start; unknown are parameters, or their logarithms."""

    build: Callable[..., Any]
    names: tuple[str, ...]
    log: Mask  # (p,)
    ends: Array  # (2, p) of the unknowns
    records: tuple[Record, ...]
    options: dict[str, Any]  # of `rom.simulate`

    @property
    def name(self) -> str:
        """By which a study knows it."""
        return str(getattr(self.build, "__qualname__", type(self.build).__name__))

    def values(self, theta: Array) -> dict[str, float]:
        """Parameters at unknowns (p,)."""
        x = np.exp(theta, out=theta.copy(), where=self.log)
        return dict(zip(self.names, x.tolist(), strict=True))

    def residuals(self, theta: Array, **changed: float) -> Array:
        """(m,) of all records, at unknowns (p,), with other options."""
        made = self.build(**self.values(theta))
        if isinstance(made, Mechanism):
            if "dt" not in self.options:
                raise ConfigError("dt is missing: the step with which the mechanism moves [s].")
            made = simulate(made, **self.options | changed)
        elif not isinstance(made, Solution):
            raise ConfigError(f"build returned {shortened(made)}; return a rom.Mechanism.")
        elif self.options:
            raise ConfigError(f"build moves the mechanism itself; leave out {named(self.options)}.")
        return np.concatenate([record.residual(made) for record in self.records])

    def __call__(self, **start: float) -> dict[str, Any]:
        """Where a search ends: unknowns, residuals with their slopes, and what it took."""
        moved = failed = 0

        def residuals(theta: Array) -> Array:
            nonlocal moved, failed
            moved += 1
            try:
                return self.residuals(theta)
            except (ConfigError, *UNMOVED):
                if moved == 1:
                    raise
                failed += 1
                return np.full(n, np.nan)  # so that the step is taken back

        def slopes(theta: Array) -> Array:
            return np.stack([self._slope(residuals, theta, k) for k in range(theta.size)], axis=1)

        n = sum(record.values.size for record in self.records)
        theta, low, high = unknowns(start.values(), self.log), *self.ends
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RomWarning)  # of motions on the way
            found = least_squares(residuals, theta, slopes, (low, high), x_scale=high - low,
                                  ftol=LAST_GAIN / n, max_nfev=MAX_TRIALS)  # fmt: skip
        return {
            "unknowns": found.x, "residuals": found.fun, "slopes": found.jac,
            "chi-square": 2 * found.cost, "ended": found.status > 0,
            "motions": moved, "failed motions": failed,
        }  # fmt: skip

    def _slope(self, residuals: Callable[[Array], Array], theta: Array, k: int) -> Array:
        """(m,) central difference; a side on which the motion fails gives way to the middle."""
        low, high = self.ends[:, k]
        step = DIFFERENCE_STEP * (high - low)
        at = np.clip([theta[k] - step, theta[k] + step], low, high)
        r = [residuals(np.where(np.arange(theta.size) == k, x, theta)) for x in at]
        lost = [bool(np.isnan(x).any()) for x in r]
        if all(lost):
            text = f"the mechanism fails on both sides of {self.values(theta)}, by {self.names[k]}."
            raise SolverError(text, hint="Narrow the ranges.")
        if any(lost):
            side = lost.index(True)
            at[side], r[side] = theta[k], residuals(theta)
        return np.asarray((r[1] - r[0]) / (at[1] - at[0]))


def unknowns(values: Iterable[Any], log: Mask) -> Array:
    """(..., p) values of p parameters, or their logarithms."""
    x = np.array(list(values), dtype=float).T
    return np.asarray(np.log(x, out=x.copy(), where=log))


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
    executor: Executor | None = None,
    workers: Annotated[int, Count(0)] | None = None,
    progress: bool = True,
    **options: Any,
) -> Fitted:
    """Find the parameters of a mechanism that explain measured histories.

    Residuals over the standard deviations of the noise, which is independent, are squared, summed
    and made least within the ranges. Between its instants a motion is a cubic spline.

    Args:
        build: function of the parameters by name that returns a `rom.Mechanism`, which is then
            moved, or its motion. With several starts it goes to other processes, see `rom.study`.
        parameters: {name: (lowest, highest)}.
        measured: {quantity: (times (n,) [s], values (n,) or (n, c), standard deviation)}, the
            last one a number, or one for each time or value; quantities as `rom.write_history`
            names them, "slider position x" or "crank pin force".
        t_end: end of the motion [s]; None for the last time measured.
        dt: step of the motion [s], so short that the verdict finds no shift by it.
        log: parameters whose logarithms are sought.
        start: {name: value} for the first search; None, or without a name, for the middle.
        starts: number of searches; others begin at a Latin hypercube, and the best of all counts.
        rng: generator, for these.
        executor: of the searches, see `rom.study`.
        workers: processes for them, None for one on each core, 0 for this process itself.
        progress: show how many searches are done.
        options: of `rom.simulate`.

    Raises:
        ConfigError: for ranges upside down, unknown names, histories with wrong times or
            deviations, fewer values than parameters, or a function that builds no mechanism.
        SolverError: if the mechanism cannot be moved from any start.

    Source:
        Bard, Nonlinear parameter estimation (1974), by `scipy.optimize.least_squares`.
    """
    names = tuple(by_name(parameters, "build", build))
    check_ranges(parameters, log)
    if drawn := [name for name, x in parameters.items() if hasattr(x, "ppf")]:
        raise ConfigError(f"{drawn[0]!r} has a distribution; give (lowest, highest).")
    records = tuple(Record.of(*item) for item in measured.items())
    n, scale = sum(record.values.size for record in records), np.isin(names, log)
    if n <= len(names):
        raise ConfigError(f"{n} values for {len(names)} parameters; measure more, or fit fewer.")
    if dt is not None:
        last = max(record.t[-1] for record in records)
        options |= {"dt": dt, "t_end": last if t_end is None else t_end}
    ends = unknowns(parameters.values(), scale)
    search = Search(build, names, scale, ends, records, options)
    first = search.values(ends.mean(axis=0))
    check_all_known(start or {}, names, "start= names no parameter")
    for name, x in (start or {}).items():
        first[name] = between(f"start of {name!r}", x, *parameters[name])
    with suppress(*UNMOVED):  # another start may move
        search.residuals(unknowns(first.values(), scale))
    more = design(parameters, starts - 1, log=log, rng=rng) if starts > 1 else {}
    samples = {name: np.r_[x, more.get(name, [])] for name, x in first.items()}
    where = 0 if starts == 1 else workers
    found = study(search, samples, executor=executor, workers=where, progress=progress)
    if not found.good.size:
        text = f"the mechanism cannot be moved from any of {starts} starts: {found.failed[0]}"
        raise SolverError(text, hint="Narrow the ranges, or give a start from which it moves.")
    return _fitted(search, found)


def _fitted(search: Search, found: Study) -> Fitted:
    squares, n = found.values["chi-square"][found.good], found.values["residuals"].shape[1]
    least = squares.min() + LAST_GAIN * max(1.0, squares.min() / n)
    best = found.good[np.flatnonzero(squares <= least)[0]]  # whatever the round-off of equal ones
    theta, r, J = (found.values[name][best] for name in ("unknowns", "residuals", "slopes"))
    (low, high), values = search.ends, search.values(theta)
    width = high - low
    lam, V = np.linalg.eigh(J.T @ J * np.outer(width, width))
    root = width[:, None] * V / np.sqrt(np.maximum(lam, OF_RANGE))
    near = np.minimum(theta - low, high - theta) <= BOUND_RTOL * width
    at_bound = tuple(np.array(search.names)[near].tolist())
    cuts = np.cumsum([record.values.size for record in search.records])[:-1]
    parts = zip(search.records, np.split(r, cuts), strict=True)
    left = {record.name: x.reshape(record.values.shape) for record, x in parts}
    rows = noise_rows(left, r.size - np.count_nonzero(lam >= OF_RANGE))
    if "dt" in search.options:
        rows.append(_step_row(search, theta, r, root @ root.T, J))
    if not found.values["ended"][best]:
        rows.append(row("trials of the search, which has not ended", MAX_TRIALS, MAX_TRIALS - 1))
    rows += [row(f"{name} inside its range", 1.0, 0.0) for name in at_bound]
    root = np.where(search.log, list(values.values()), 1.0)[:, None] * root
    return Fitted(
        values=values,
        covariance=root @ root.T,
        undetermined=unseen_directions(J.T @ J, width, search.names),
        verdict=Report("fit", tuple(rows)),
        predicted={x.name: x.values + left[x.name] * x.deviation for x in search.records},
        residuals=left,
        at_bound=at_bound,
        searches=found,
    )


def _step_row(search: Search, theta: Array, r: Array, C: Array, J: Array) -> Row:
    """Largest shift of a parameter, in its deviations, as steps become short, to first order.

    Halving them takes three quarters of an error of second order, or more of a higher one.
    """
    change = np.full(r.size, np.nan)
    with suppress(*UNMOVED):
        change = search.residuals(theta, dt=search.options["dt"] / 2) - r
    shift = np.abs(C @ (J.T @ change)) / np.sqrt(np.diag(C))
    text = "shift of a parameter by the step of time [deviations]"
    return row(text, WHOLE_ERROR * float(shift.max()), MAX_SHIFT)
