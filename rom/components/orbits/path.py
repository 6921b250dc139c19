"""Motions that repeat, over a parameter: past folds, stable or not."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, typed
from rom.arguments.quantities import Count, Positive
from rom.components.orbits.derivatives import confirmed
from rom.components.orbits.family import Family, Period, period_at
from rom.components.orbits.flow import Flow
from rom.components.orbits.motion import (
    N_STEPS,
    RHO_INF,
    STABLE_TOL,
    PeriodicMotion,
    periodic_motion,
    recorded,
)
from rom.errors import ConfigError, SolverError, reached
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State
from rom.model import Array
from rom.paths.arc_length import Curve, Point
from rom.process.progress import line

CLOSED_TOL = 1e-7  # corrections that count as none, of the size of the motion
FOLD_RTOL = 1e-3  # of a step; the parameter of a fold then errs by its square
END_RTOL = 1e-9  # the same of the end of the span
END_TOL = 1e-6  # of the span
LOCATION_RTOL = 1e-4  # of a step: multipliers are differences
LEAST_SIZE_RATIO = 0.1  # of the largest motion so far, below which steps do not shrink with it
MAX_POINTS = 100_000
CROSSING_TOL = 1e-2  # of a multiplier from the unit circle at a motion that is critical
Test = Callable[[PeriodicMotion], float]
Complex = npt.NDArray[np.complex128]
REAL_TOL = 1e-6  # imaginary part of a multiplier that counts as none


@dataclass(frozen=True)
class CriticalMotion:
    """A motion at which a multiplier crosses the unit circle.

    Attributes:
        kind: "fold", where the parameter turns back; "branch", where another path crosses at the
            multiplier 1; "flip", where motions of twice the period begin, at -1;
            "Neimark-Sacker", where a second frequency comes in, at a complex pair.
        p: the parameter, in its own unit.
        motion: the motion.
    """

    kind: str
    p: float
    motion: PeriodicMotion


@typed
@dataclass(frozen=True)
class PeriodicPath:
    """Motions that repeat, in the order in which they were passed.

    Attributes:
        p: (k,) parameter, in its own unit; not ascending where the path turns back.
        motions: k of them.
        critical: where stability changes or the parameter turns, in order.
    """

    p: Array
    motions: tuple[PeriodicMotion, ...]
    critical: tuple[CriticalMotion, ...]

    @cached_property
    def stable(self) -> npt.NDArray[np.bool_]:
        """(k,) whether small deviations do not grow."""
        return np.array([motion.stable for motion in self.motions], dtype=bool)

    @cached_property
    def period(self) -> Array:
        """(k,) periods [s]."""
        return np.array([motion.period for motion in self.motions])

    def of(self, f: Callable[[Solution], npt.ArrayLike]) -> Array:
        """(k, ...) a number or an array by f of the `Solution` of each motion, as its amplitude."""
        return np.array([f(motion.solution) for motion in self.motions])


@typed
def periodic_path(  # noqa: PLR0913  one keyword per choice, most have defaults
    build: Callable[[float], Mechanism],
    span: tuple[float, float],
    *,
    period: Period = None,
    start: State | PeriodicMotion | None = None,
    turns: Mapping[str, float | None] | None = None,
    steps: int = N_STEPS,
    rho_inf: float = RHO_INF,
    guess: float | None = None,
    settle: int = 0,
    n: Annotated[int, Count(2, MAX_POINTS)] = 500,
    step: Annotated[float, Positive()] = 0.1,
    progress: bool = False,
) -> PeriodicPath:
    """Follow a motion that repeats while a parameter changes, also where it turns back.

    The path is followed by its arc length, past folds and through unstable motions. It ends where
    the parameter leaves the span, at either side.

    Args:
        build: function of the parameter that returns the mechanism, always with the same bodies
            and joints.
        span: (2,) parameter at which the path begins, and towards which it goes.
        period: [s], or function of the parameter; None for a motion that nothing drives, whose
            period is found.
        start: state or motion near the first one; None for where the bodies were added.
        turns: {joint or body: angle [rad]} by which it advances, as in `periodic_motion`.
        steps: of generalised-alpha in a period.
        rho_inf: its spectral radius at infinite frequency [1].
        guess: of the first period where it is unknown [s].
        settle: number of periods through which the first mechanism moves before.
        n: largest number of motions; with so many the path may end inside the span.
        step: longest step, in sizes of the motion and spans.
        progress: report on stderr.

    Raises:
        ConfigError: for a wrong argument, or mechanisms of different size.
        ModelError, SolverError: as `periodic_motion`, for the first motion; SolverError where the
            path is lost; ``error.solution`` is the path up to there.

    Source:
        Seydel, Practical Bifurcation and Stability Analysis (2010), chapters 4 and 7.
    """
    first, last = finite("span", span, (2,))
    if first == last:
        raise ConfigError(f"span = ({first:g}, {last:g}) needs two values that differ.")
    T = period_at(period, first)
    begin = periodic_motion(
        build(first), period=T, start=start, turns=turns, steps=steps, rho_inf=rho_inf,
        guess=guess, settle=settle, progress=progress,
    )  # fmt: skip
    scale = Flow(begin.solution.mechanism, begin.state.t, begin.period, steps, rho_inf).probe
    size, still = abs(last - first), 0.0 * scale
    family = Family(build, period, begin, turns, steps, rho_inf, size, scale, still)
    march = _March(family, (first, last), progress)
    with reached(lambda: march.path):
        march.go(begin, step, n)
    return march.path


class _March:
    """Motions of a path one after the other, and what happens between them."""

    def __init__(self, family: Family, span: tuple[float, float], progress: bool):
        self.family, self.progress = family, progress
        self.first, self.last = span
        self.curve = Curve(family, family.span, CLOSED_TOL)
        self.p: list[float] = []
        self.motions: list[PeriodicMotion] = []
        self.critical: list[CriticalMotion] = []

    @property
    def path(self) -> PeriodicPath:
        """What was found so far."""
        return PeriodicPath(np.array(self.p), tuple(self.motions), tuple(self.critical))

    def go(self, begin: PeriodicMotion, longest: float, n: int) -> None:
        """Follow the path until the parameter leaves the span, or there are n motions."""
        family, forwards = self.family, self.last > self.first
        point = self.curve.start(family.member(begin, self.first), self.first, forwards)
        self.add(point)
        point = self.curve.start(point.at, self.first, forwards)  # in sizes of the motion
        low, high = sorted((self.first, self.last))
        try:
            for one, h, two in self.curve.steps(point, longest):
                bound = float(np.clip(two.p, low, high))
                leaves = two.p != bound
                if leaves:
                    h, two = self.curve.located(one, h, lambda x: x.p - bound, END_RTOL)  # noqa: B023
                if leaves and abs(two.p - bound) > END_TOL * family.span:
                    return  # teeth that come or go between hide the way there
                self.add(two)
                self.between(one, h, two, *self.motions[-2:])
                if leaves or len(self.motions) == n:
                    return
        except SolverError as error:
            text = f"the path of motions was lost behind {self.p[-1]:.6g}: {error.message}"
            hint = "Take shorter steps (step=), or more of them per period (steps=)."
            raise SolverError(text, hint=hint) from error
        finally:
            if self.progress:
                line("")

    def motion(self, point: Point) -> PeriodicMotion:
        """The motion at a point of the path."""
        family = self.family
        basis = None if family.tangent is None else family.tangent.around.chart
        family.last = found = family.returned(point.at, point.p, basis)
        family.tangent = confirmed(found)
        return recorded(family.shooting(found.flow), family.tangent, point.passes)

    def add(self, point: Point) -> None:
        """Keep a point, and measure the next steps by its motion."""
        family, motion = self.family, self.motion(point)
        self.p.append(float(point.p))
        self.motions.append(motion)
        flow = family.flow(point.p, motion.period)
        size = family.measure(motion, flow, family.turning(flow, point.at.start))
        most = LEAST_SIZE_RATIO * (family.unit if len(self.motions) > 1 else 0.0)
        family.unit, family.gap = max(size, most) or 1.0, np.inf
        family.advance = family.advanced(motion)
        if self.progress:
            word = "stable" if motion.stable else "unstable"
            line(f"motion {len(self.p)} at {point.p:.6g}: {word}")

    def between(
        self, one: Point, h: float, two: Point, before: PeriodicMotion, after: PeriodicMotion
    ) -> None:
        """Find what happens between two neighbours."""
        turns = one.rate * two.rate < 0.0
        if turns:
            self.note("fold", self.curve.located(one, h, lambda x: x.rate, FOLD_RTOL)[1])
        for kind, test in TESTS.items():
            values = test(before), test(after)
            if not values[0] * values[1] < 0.0 or (kind == "branch" and turns):
                continue
            known = {id(one): values[0]}

            def value(x: Point, test: Test = test, known: dict[int, float] = known) -> float:
                return known[id(x)] if id(x) in known else test(self.motion(x))

            self.note(kind, self.curve.located(one, h, value, LOCATION_RTOL)[1])

    def note(self, kind: str, point: Point) -> None:
        """Keep a critical motion, unless what changed its sign was no multiplier that crosses."""
        motion = self.motion(point)
        if kind == "fold" or ON_CIRCLE[kind](motion.deviations).min(initial=np.inf) < CROSSING_TOL:
            self.critical.append(CriticalMotion(kind, float(point.p), motion))


def _pairs(motion: PeriodicMotion) -> float:
    """Product over pairs of complex multipliers of their size minus one; NaN without any."""
    found = motion.deviations
    beyond = np.abs(found[found.imag > REAL_TOL]) - 1.0
    beyond = np.where(np.abs(beyond) < STABLE_TOL, 0.0, beyond)
    return float(np.prod(beyond)) if beyond.size else np.nan


# what changes its sign where a multiplier crosses the circle, and distances from where it crosses
TESTS: dict[str, Test] = {
    "branch": lambda motion: float(np.prod(motion.deviations - 1.0).real),
    "flip": lambda motion: float(np.prod(motion.deviations + 1.0).real),
    "Neimark-Sacker": _pairs,
}
ON_CIRCLE: dict[str, Callable[[Complex], Array]] = {
    "branch": lambda found: np.abs(found - 1.0),
    "flip": lambda found: np.abs(found + 1.0),
    "Neimark-Sacker": lambda found: np.abs(np.abs(found[np.abs(found.imag) > REAL_TOL]) - 1.0),
}
