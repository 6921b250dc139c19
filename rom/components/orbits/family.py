"""Motions that repeat over a parameter, as equations of a path."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.integrate import trapezoid

from rom.arguments import positive
from rom.components.orbits.derivatives import Tangent, by_differences, by_steps, follows
from rom.components.orbits.flow import Flow, Start
from rom.components.orbits.motion import GOOD_RATIO, PeriodicMotion, Shooting
from rom.components.orbits.shooting import Chart, Return, Turns, turns_of
from rom.errors import ConfigError, ModelError, SolverError
from rom.mbs.mechanism import Mechanism
from rom.model import Array

PARAMETER_STEP = 1e-6  # of differences, of the span
FRESH_RATIO = 1e-3  # gap of a motion, of its size, where its own derivatives are asked for
MAX_DIRECT = 4  # coordinates up to which derivatives are cheaper than passes that do without
N_LOOKS = 24  # instants of a motion at which its size is measured
Period = float | Callable[[float], float] | None


def period_at(period: Period, p: float) -> float | None:
    """The period at a parameter [s]; None where it is found."""
    if period is None:
        return None
    return positive("period", period(p) if callable(period) else period)


@dataclass(frozen=True)
class Member:
    """A start and its period [s]."""

    start: Start
    period: float


@dataclass
class Family:
    """Motions over a parameter, as `arc_length` asks for them.

    Steps are motions and changes of velocities, in rad or lengths of the mechanism and per radian
    of the period, and the relative change of the period. Build, period, turns, steps and rho_inf
    are as the user has them.
    """

    build: Callable[[float], Mechanism]
    period: Period
    first: PeriodicMotion  # the first motion
    turns: Mapping[str, float | None] | None
    steps: int
    rho_inf: float
    span: float  # change of the parameter that counts as one
    scale: Array  # (n,) motion of each coordinate that counts as one
    advance: Array  # (n,) by how much bodies advance in a period
    unit: float = 1.0  # size of the motion, in which steps are measured
    tangent: Tangent | None = None  # derivatives of the last differentiated motion, by coordinates
    by_p: Array = field(default_factory=lambda: np.zeros(0))  # and by the parameter
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
            T = period_at(self.period, p)
            t0 = self.first.state.t
            made = Flow(self.build(p), t0, T or period, self.steps, self.rho_inf)
            if made.packed.q.size != self.first.solution.q.shape[1]:
                raise ConfigError(f"the bodies at {p:g} must be those at the first value.")
            self.flows[p] = made
            for old in list(self.flows)[:-4]:
                del self.flows[old]
        flow = self.flows[p]
        return flow if flow.period == period or not self.free else flow.lasting(period)

    def turning(self, flow: Flow, start: Start) -> Turns:
        """What advances."""
        return turns_of(flow.mechanism, self.turns, start.state)

    def member(self, motion: PeriodicMotion, p: float) -> Member:
        """A motion that was found."""
        flow = self.flow(p, motion.period)
        return Member(flow.begun(motion.state), motion.period)

    def returned(self, at: Member, p: float, basis: Chart | None = None) -> Return:
        """What comes of a start."""
        flow = self.flow(p, at.period)
        return Return.of(flow, self.turning(flow, at.start), at.start, basis)

    def corrections(self, at: Member, p: float) -> tuple[Array, Array]:
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
        T = found.flow.period if self.free else (period_at(self.period, p + d) or 0.0)
        chart, flow, still = found.chart, self.flow(p + d, T), 0.0 * found.start.state.v
        start = flow.moved(found.start, still, self.faster(found.flow.period, T))
        later = self.returned(Member(start, T), p + d, chart)
        moved = chart.of_state(later.turned) - chart.of_state(start.state)
        moved = moved - chart.seen(still, found.start.ahead)
        self.tangent = (by_steps if follows(found) else by_differences)(found)
        self.by_p = (moved - found.gap) / d
        return found

    def _step(self, found: Return, y: Array) -> Array:
        """(2n + 1,) step of coordinates (f,) or (f + 1,)."""
        chart = found.chart
        dq, dv = chart.motion(y[: chart.size])
        dT = y[-1] / (2 * np.pi) if self.free else 0.0
        return np.concatenate([dq / self.scale, chart.time * dv / self.scale, [dT]])

    def moved(self, at: Member, step: Array, p: float) -> Member:
        """The start after a step."""
        n = at.start.state.v.size
        period = at.period * (1 + step[-1]) if self.free else (period_at(self.period, p) or 0.0)
        if not 0.5 * at.period < period < 2 * at.period:
            raise SolverError("the period changes by too much in a step.")
        flow = self.flow(p, period)
        start, scale = at.start, self.scale
        if self.last is not None:
            start = replace(start, ahead=self.last.back.ahead, later=self.last.later)
        dv = step[n : 2 * n] * scale / (at.period / (2 * np.pi))
        dv = dv + self.faster(at.period, period)
        try:
            return Member(flow.moved(start, step[:n] * scale, dv), period)
        except ModelError as error:
            raise SolverError(f"no start satisfies the joints: {error.message}") from error

    def inner(self, a: Array, b: Array) -> float:
        """Product of two steps, in sizes of the motion."""
        return float(a @ b) / self.unit**2

    def size(self, step: Array) -> float:
        """Largest part of a step, in sizes of the motion."""
        return float(np.abs(step).max(initial=0.0)) / self.unit

    def advanced(self, motion: PeriodicMotion) -> Array:
        """(n,) by how much bodies advance in a period: by as much at every parameter."""
        s, bodies = motion.solution, motion.solution.packed.system.bodies
        mean, out = trapezoid(s.v, s.t, axis=0), np.zeros_like(self.scale)
        rigid = (bodies.v_at[:, None] + np.arange(6)).ravel()
        out[rigid] = 0.0 if self.free else mean[rigid]
        return out

    def faster(self, before: float, after: float) -> Array:
        """(n,) change of velocities with which bodies advance by as much in another period."""
        return (1.0 / after - 1.0 / before) * self.advance

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
