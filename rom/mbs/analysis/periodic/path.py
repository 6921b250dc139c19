"""Motions that repeat, over a parameter: past folds, stable or not."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.integrate import trapezoid

from rom.arguments import finite, positive, typed, whole
from rom.errors import ConfigError, ModelError, SolverError, reached
from rom.mbs.analysis.continuation.arc_length import Curve, Point
from rom.mbs.analysis.periodic.flow import Flow, Start
from rom.mbs.analysis.periodic.motion import (
    N_STEPS,
    RHO_INF,
    STABLE_TOL,
    PeriodicMotion,
    Shooting,
    periodic_motion,
)
from rom.mbs.analysis.periodic.shooting import Return, Tangent
from rom.mbs.analysis.periodic.turns import Turns, turns_of
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State
from rom.model import Array
from rom.process.progress import line

PARAMETER_STEP = 1e-6  # of differences, of the span
CLOSED_TOL = 1e-7  # corrections that count as none, of the size of the motion
GOOD_RATIO = 0.1  # of gaps, up to which derivatives serve again
FRESH_RATIO = 1e-3  # gap of a motion, of its size, where its own derivatives are asked for
FOLD_RTOL = 1e-3  # of a step; the parameter of a fold then errs by its square
LOCATION_RTOL = 1e-4  # of a step: multipliers are differences
LEAST_SIZE_RATIO = 0.1  # of the largest motion so far, below which steps do not shrink with it
MAX_DIRECT = 4  # coordinates up to which derivatives are cheaper than passes that do without
N_LOOKS = 24  # instants of a motion at which its size is measured
MAX_POINTS = 100_000
CROSSING_TOL = 1e-2  # of a multiplier from the unit circle at a motion that is critical
REAL_TOL = 1e-6  # imaginary part of a multiplier that counts as none
Period = float | Callable[[float], float] | None


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

    def of(self, f: Callable[[Solution], Any]) -> Array:
        """(k, ...) a number or an array of every motion, as its amplitude.

        Args:
            f: function of a `Solution` over one period.
        """
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
    n: int = 500,
    step: float = 0.1,
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
        n: largest number of motions.
        step: longest step, in sizes of the motion and spans.
        progress: report on stderr.

    Returns:
        The path; with n motions it may end inside the span.

    Raises:
        ConfigError: for a wrong argument, or mechanisms of different size.
        ModelError, SolverError: as `periodic_motion`, for the first motion; SolverError where the
            path is lost; ``error.solution`` is the path up to there.

    Source:
        Seydel, Practical Bifurcation and Stability Analysis (2010), chapters 4 and 7.
    """
    first, last = finite("span", span, (2,))
    if first == last:
        raise ConfigError(f"span = ({first:g}, {last:g}) has no length.")
    whole("n", n, 2, MAX_POINTS)
    longest = positive("step", step)
    T = _period_at(period, first)
    begin = periodic_motion(
        build(first), period=T, start=start, turns=turns, steps=steps, rho_inf=rho_inf,
        guess=guess, settle=settle, progress=progress,
    )  # fmt: skip
    scale = Flow(begin.solution.mechanism, begin.state.t, begin.period, steps, rho_inf).probe
    family = _Family(build, period, begin, turns, steps, rho_inf, abs(last - first), scale,
                     0.0 * scale)  # fmt: skip
    march = _March(family, (first, last), progress)
    with reached(lambda: march.path):
        march.go(begin, longest, n)
    return march.path


def _period_at(period: Period, p: float) -> float | None:
    if period is None:
        return None
    return positive("period", period(p) if callable(period) else period)


@dataclass(frozen=True)
class _Member:
    """A start and its period [s]."""

    start: Start
    period: float


@dataclass
class _Family:
    """Motions over a parameter, as `arc_length` asks for them.

    Steps are motions and changes of velocities, in rad or lengths of the mechanism and per radian
    of the period, and the relative change of the period.

    Attributes:
        build, period, turns, steps, rho_inf: as the user has them.
        first: the first motion.
        span: change of the parameter that counts as one.
        scale: (n,) motion of each coordinate that counts as one.
        advance: (n,) mean velocities of the bodies in the last motion.
        unit: size of the motion, in which steps are measured.
        tangent, by_p: derivatives of the last motion that was differentiated, by its coordinates
            and by the parameter.
    """

    build: Callable[[float], Mechanism]
    period: Period
    first: PeriodicMotion
    turns: Mapping[str, float | None] | None
    steps: int
    rho_inf: float
    span: float
    scale: Array
    advance: Array
    unit: float = 1.0
    tangent: Tangent | None = None
    by_p: Array = field(default_factory=lambda: np.zeros(0))
    gap: float = np.inf
    last: Return | None = None
    flows: dict[float, Flow] = field(default_factory=dict)

    @property
    def free(self) -> bool:
        """Whether the period is found."""
        return self.period is None

    def shooting(self, flow: Flow) -> Shooting:
        """How motions of a mechanism are looked for."""
        T = None if self.free else flow.period
        numbers = (flow.t0, self.steps, self.rho_inf, 1.0)
        return Shooting(flow.mechanism, T, *numbers, self.turns)

    def flow(self, p: float, period: float) -> Flow:
        """The mechanism at a parameter; the last few are kept."""
        if p not in self.flows:
            T = _period_at(self.period, p)
            t0 = self.first.state.t
            made = Flow(self.build(p), t0, T or period, self.steps, self.rho_inf)
            self._check_size(made, p)
            self.flows[p] = made
            for old in list(self.flows)[:-4]:
                del self.flows[old]
        flow = self.flows[p]
        return flow if flow.period == period or not self.free else flow.lasting(period)

    def _check_size(self, flow: Flow, p: float) -> None:
        q = self.first.solution.q
        if flow.packed.q.size != q.shape[1]:
            raise ConfigError(f"the mechanism has other bodies at {p:g} than at the first value.")

    def turning(self, flow: Flow, start: Start) -> Turns:
        """What advances."""
        return turns_of(flow.mechanism, self.turns, start.state)

    def member(self, motion: PeriodicMotion, p: float) -> _Member:
        """A motion that was found."""
        flow = self.flow(p, motion.period)
        return _Member(flow.begun(motion.state), motion.period)

    def returned(self, at: _Member, p: float, basis: Any = None) -> Return:
        """What comes of a start."""
        flow = self.flow(p, at.period)
        return Return.of(flow, self.turning(flow, at.start), at.start, basis)

    def corrections(self, at: _Member, p: float) -> tuple[Array, Array]:
        """Newton's correction, and the change of the motion per parameter."""
        basis = None if self.tangent is None else self.tangent.around.chart
        found = self.returned(at, p, basis)
        self.last = found
        fresh = found.open < FRESH_RATIO * self.unit <= self.gap
        few = found.chart.size <= MAX_DIRECT
        if self.tangent is None or few or fresh or not found.open < GOOD_RATIO * self.gap:
            found = self.differentiate(replace(found, basis=None), p)
        self.gap = found.open
        assert self.tangent is not None
        rate = found.rate if self.free else None
        newton, slope = self.tangent.solved(rate, found.gap, self.by_p)
        return self._step(found, newton), self._step(found, slope)

    def differentiate(self, found: Return, p: float) -> Return:
        """Take the derivatives at a motion."""
        d = PARAMETER_STEP * self.span
        T = found.flow.period if self.free else (_period_at(self.period, p + d) or 0.0)
        chart, flow, still = found.chart, self.flow(p + d, T), 0.0 * found.start.state.v
        start = flow.moved(found.start, still, self.faster(found.flow.period, T))
        later = self.returned(_Member(start, T), p + d, chart)
        moved = chart.of_state(later.turned) - chart.of_state(start.state) - chart.seen(
            still, found.start.ahead)  # fmt: skip
        self.tangent, self.by_p = found.tangent(), (moved - found.gap) / d
        return found

    def _step(self, found: Return, y: Array) -> Array:
        """(2n + 1,) step of coordinates (f,) or (f + 1,)."""
        chart = found.chart
        dq, dv = chart.motion(y[: chart.size])
        dT = y[-1] / (2 * np.pi) if self.free else 0.0
        return np.concatenate([dq / self.scale, chart.time * dv / self.scale, [dT]])

    def moved(self, at: _Member, step: Array, p: float) -> _Member:
        """The start after a step.

        Raises:
            SolverError: if no state nearby satisfies the joints.
        """
        n = at.start.state.v.size
        period = at.period * (1 + step[-1]) if self.free else (_period_at(self.period, p) or 0.0)
        if not 0.5 * at.period < period < 2 * at.period:
            raise SolverError("the period changes by too much in a step.")
        flow = self.flow(p, period)
        start, scale = at.start, self.scale
        if self.last is not None:
            start = replace(start, ahead=self.last.back.ahead, later=self.last.later)
        dv = step[n : 2 * n] * scale / (at.period / (2 * np.pi))
        dv = dv + self.faster(at.period, period)
        try:
            return _Member(flow.moved(start, step[:n] * scale, dv), period)
        except ModelError as error:
            raise SolverError(f"no start satisfies the joints: {error.message}") from error

    def inner(self, a: Array, b: Array) -> float:
        """Product of two steps, in sizes of the motion."""
        return float(a @ b) / self.unit**2

    def size(self, step: Array) -> float:
        """Largest part of a step, in sizes of the motion."""
        return float(np.abs(step).max(initial=0.0)) / self.unit

    def mean_speed(self, motion: PeriodicMotion) -> Array:
        """(n,) mean velocities of bodies that advance by as much in every period."""
        s, bodies = motion.solution, motion.solution.packed.system.bodies
        mean, out = trapezoid(s.v, s.t, axis=0) / motion.period, np.zeros_like(self.scale)
        rigid = (bodies.v_at[:, None] + np.arange(6)).ravel()
        out[rigid] = 0.0 if self.free else mean[rigid]
        return out

    def faster(self, before: float, after: float) -> Array:
        """(n,) change of velocities with which bodies advance by as much in another period."""
        return (before / after - 1.0) * self.advance

    def measure(self, motion: PeriodicMotion, flow: Flow, turns: Turns) -> float:
        """How far a motion goes from its start, in rad or lengths of the mechanism."""
        s, scale, largest = motion.solution, self.scale, 0.0
        for k in np.unique(np.linspace(0, s.t.size - 1, N_LOOKS).astype(int)):
            part = (s.t[k] - s.t[0]) / motion.period
            state = replace(motion.state, q=s.q[k], v=s.v[k])
            state = turns.back(state, tuple(part * angle for angle in motion.turns))
            away = flow.apart(motion.state, state) / scale
            largest = max(largest, float(np.abs(away).max(initial=0.0)))
        return largest


class _March:
    """Motions of a path one after the other, and what happens between them."""

    def __init__(self, family: _Family, span: tuple[float, float], progress: bool):
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
        """Follow the path until the parameter leaves the span, or there are n motions.

        Raises:
            SolverError: where the path is lost.
        """
        family = self.family
        point = self.curve.start(family.member(begin, self.first), self.first, self._forwards)
        self.add(point)
        point = self.curve.start(point.at, self.first, self._forwards)  # in sizes of the motion
        low, high = sorted((self.first, self.last))
        try:
            for one, h, two in self.curve.steps(point, longest):
                bound = float(np.clip(two.p, low, high))
                if two.p != bound:
                    h, two = self.curve.located(
                        one, h, lambda x: x.p - bound, LOCATION_RTOL)  # noqa: B023  # fmt: skip
                before = self.motions[-1]
                self.add(two)
                self.between(one, h, two, before, self.motions[-1])
                if bound in (low, high) and abs(two.p - bound) < 1e-4 * family.span:
                    return
                if len(self.motions) == n:
                    return
        except SolverError as error:
            raise SolverError(
                f"the path of motions was lost behind {self.p[-1]:.6g}: {error.message}",
                hint="Take shorter steps (step=), or more of them per period (steps=).",
            ) from error
        finally:
            if self.progress:
                line("")

    @property
    def _forwards(self) -> bool:
        return self.last > self.first

    def motion(self, point: Point) -> PeriodicMotion:
        """The motion at a point of the path."""
        family = self.family
        basis = None if family.tangent is None else family.tangent.around.chart
        family.last = found = family.returned(point.at, point.p, basis)
        family.tangent = found.tangent()
        return family.shooting(found.flow).record(family.tangent, point.passes)

    def add(self, point: Point) -> None:
        """Keep a point, and measure the next steps by its motion."""
        family, motion = self.family, self.motion(point)
        self.p.append(float(point.p))
        self.motions.append(motion)
        flow = family.flow(point.p, motion.period)
        size = family.measure(motion, flow, family.turning(flow, point.at.start))
        most = LEAST_SIZE_RATIO * (family.unit if len(self.motions) > 1 else 0.0)
        family.unit, family.gap = max(size, most) or 1.0, np.inf
        family.advance = family.mean_speed(motion)
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

            def value(x: Point, test: Any = test, known: Any = known) -> float:
                return float(known[id(x)]) if id(x) in known else test(self.motion(x))

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
    return (
        float(np.prod(np.where(np.abs(beyond) < STABLE_TOL, 0.0, beyond)))
        if beyond.size
        else np.nan
    )


# what changes its sign where a multiplier crosses the circle, and distances from where it crosses
TESTS: dict[str, Callable[[PeriodicMotion], float]] = {
    "branch": lambda motion: float(np.prod(motion.deviations - 1.0).real),
    "flip": lambda motion: float(np.prod(motion.deviations + 1.0).real),
    "Neimark-Sacker": _pairs,
}
ON_CIRCLE: dict[str, Callable[[Any], Any]] = {
    "branch": lambda found: np.abs(found - 1.0),
    "flip": lambda found: np.abs(found + 1.0),
    "Neimark-Sacker": lambda found: np.abs(np.abs(found[np.abs(found.imag) > REAL_TOL]) - 1.0),
}
