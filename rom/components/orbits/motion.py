"""A motion that repeats, with its multipliers, by Newton's method towards one that closes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import typed
from rom.arguments.quantities import Count, Positive, Share
from rom.components.orbits.derivatives import (
    Derivatives,
    Tangent,
    by_differences,
    by_steps,
    confirmed,
    follows,
)
from rom.components.orbits.flow import Flow, Start
from rom.components.orbits.repetition import refuse_other_forces, refuse_what_changes
from rom.components.orbits.shooting import Return, Turns, energy, moved_by, turns_of
from rom.errors import ConfigError, ModelError, SolverError
from rom.mbs.analysis.linearize import linearize
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State, check_state
from rom.process.progress import line

N_STEPS, MAX_STEPS = 200, 100_000  # per period
# the method forgets what a step does not resolve within a period; motions that keep their energy
# must not lose it to the method
RHO_INF, CONSERVATIVE_RHO_INF = 0.8, 0.95
MAX_TRIALS = 3  # with one step more each time
GAP_TOL = 1e-10  # in rad or lengths of the mechanism
MAX_SETTLE = 100_000  # periods: minutes of the smallest mechanisms
STABLE_TOL = 1e-6  # of the size of a multiplier: differences and round-off
# gap in rad or lengths of the mechanism which counts as closed where it shrinks no more, of
# round-off or of the energy that the method itself takes up
STALLED_TOL, CONSERVATIVE_STALLED_TOL = 1e-8, 1e-6
GOOD_RATIO, MANY_RATIO = 0.1, 0.5  # of gaps, up to which derivatives serve again: cheap, dear ones
MAX_PASSES = 60
MAX_WAIT = 32  # periods through which time goes on at once where Newton's method came no closer
MAX_SHORTENINGS = 6  # of a correction whose start cannot be moved
MAX_PERIOD_CHANGE = 0.2  # of an unknown period in one pass
REST_TOL = 1e-8  # rad or lengths of the mechanism that a motion moves per rad of its period
Way = Callable[[Return], Tangent]
Time = Annotated[float, Positive("s")]


@dataclass(frozen=True)
class Shooting:
    """How a motion is looked for, much of it as the user has it."""

    mechanism: Mechanism
    period: float | None  # None where it is unknown
    t0: float  # time of the start [s]
    steps: int
    rho_inf: float
    tolerance: float
    turns: Mapping[str, float | None] | None
    progress: bool = False
    energy: float | None = None  # that the motion shall have; None where it is not free [J]

    @property
    def stalled(self) -> float:
        """Gap that counts as closed where it shrinks no more."""
        return STALLED_TOL if self.energy is None else CONSERVATIVE_STALLED_TOL

    def flow(self, period: float) -> Flow:
        """What moves the mechanism through a period."""
        return Flow(self.mechanism, self.t0, period, self.steps, self.rho_inf)

    def closed(
        self, flow: Flow, start: Start, turns: Turns, known: Derivatives | None = None
    ) -> tuple[Tangent, int]:
        """The motion that closes, with its derivatives, and the passes it took.

        Where Newton's method does not come closer, time goes on from where it was for a period, as
        it does in a machine, and for twice as many the next time.
        """
        found, best, wait = Return.of(flow, turns, start), None, 1
        tangent = None if known is None else known.around(found)
        ways: list[Way] = [by_steps, by_differences] if follows(found) else [by_differences]
        for k in range(1, MAX_PASSES + 1):
            self._say(f"pass {k}: gap {found.open:.2e}")
            if self._closes(found, best):
                return self._done(min(found, best or found, key=lambda x: x.open), tangent), k
            if best is not None and found.open > best.open:
                if tangent is not None and tangent.of(best):
                    best, wait = self._elsewhere(ways, best, wait)
                found, best, tangent = best, None, None
            elif tangent is not None and best is not None and self.period is not None:
                tangent = tangent.followed(best, found)
            if tangent is None or (best and found.open > self._enough(best, tangent)):
                found = replace(found, basis=None)
                tangent = ways[0](found)
            after = self._corrected(found, tangent)
            best, found, tangent = (found, after, tangent) if after else (None, found, None)
        raise self._lost(found)

    def _closes(self, found: Return, best: Return | None) -> bool:
        """Whether the gap is closed, or shrinks no more where little of it is left."""
        if found.open < self.tolerance or best is None:
            return found.open < self.tolerance
        return found.open > 0.5 * best.open and min(found.open, best.open) < self.stalled

    def _enough(self, best: Return, tangent: Tangent) -> float:
        """Gap up to which derivatives serve again: new ones take as long as some passes."""
        ratio = (self.tolerance / max(best.open, self.tolerance)) ** (1 / tangent.passes)
        return float(np.clip(ratio, GOOD_RATIO, MANY_RATIO)) * best.open

    def _elsewhere(self, ways: list[Way], found: Return, wait: int) -> tuple[Return, int]:
        """Where to go on when derivatives led no closer: the same motion if there are better ones.

        Else what comes of it some periods later, with how many it will be the next time.
        """
        if len(ways) > 1:
            ways.pop(0)
            return found, wait
        for _ in range(wait):
            found = Return.of(found.flow, found.turns, found.back)
        return found, min(2 * wait, MAX_WAIT)

    def _say(self, text: str) -> None:
        if self.progress:
            line(text)

    def _done(self, found: Return, tangent: Tangent | None) -> Tangent:
        """Derivatives at the motion that was found."""
        self._say("")
        if self.period is None and not max(map(np.linalg.norm, found.rate)) > REST_TOL:
            hint = "Begin with start= a state that moves, or nearer to the motion."
            raise SolverError("what was found is a state of rest, not a motion.", hint=hint)
        refuse_other_forces(found)
        return confirmed(found, tangent)

    def _corrected(self, found: Return, tangent: Tangent) -> Return | None:
        """The next motion of Newton's method; shorter steps where one cannot be moved.

        None where derivatives of another motion lead to none.
        """
        free = self.period is None
        gap = None if self.energy is None else energy(self.mechanism, found.start) - self.energy
        rate = found.rate if free else None
        answer, cause = tangent.solved(rate, found.gap, energy_gap=gap)[0], None
        for _ in range(MAX_SHORTENINGS):
            try:
                flow, y = found.flow, answer
                if free:
                    most = MAX_PERIOD_CHANGE
                    change = np.clip(answer[-1] / (2 * np.pi), -most, most)
                    flow, y = flow.lasting(flow.period * (1 + float(change))), answer[:-1]
                return Return.of(flow, found.turns, moved_by(found, y), tangent.around.chart)
            except (SolverError, ModelError) as error:
                answer, cause = answer / 2, error
        if not tangent.of(found):
            return None
        raise self._lost(found) from cause

    def _lost(self, found: Return) -> SolverError:
        self._say("")
        error = SolverError(
            f"no motion repeats with the period {found.flow.period:.9g} s: "
            f"{found.open:.2g} rad, or lengths of the mechanism, are left between its end and its "
            "start.",
            hint="Begin nearer to it (start=, settle=), take more steps per period, or simulate.",
        )
        error.solution = self.solution(found)
        return error

    def solution(self, found: Return) -> Solution:
        """The motion over one period."""
        flow = found.flow
        return simulate(
            self.mechanism,
            t_start=self.t0,
            t_end=self.t0 + flow.period,
            dt=flow.settings.h,
            state=flow.given(found.start),
            rho_inf=self.rho_inf,
            tolerance=1e-12,
        )


@typed
@dataclass(frozen=True)
class PeriodicMotion:
    """A motion that ends as it began.

    Attributes:
        solution: the motion over one period, start and end included.
        period: [s].
        multipliers: (f,) of Floquet [1], largest first: small deviations grow by them in a period;
            f counts the free positions and the free velocities.
        free: whether no clock drives the motion, so that one of them belongs to a shift in time.
        gap: what is left between start and end, in rad or lengths of the mechanism.
        passes: through the period until it closed, those for derivatives not counted.
        turns: (k,) angles by which what advances was turned back [rad].
        runs: all passes through the period.
        derivatives: with which motions nearby are looked for.
    """

    solution: Solution
    period: float
    multipliers: npt.NDArray[np.complex128]
    free: bool
    gap: float
    passes: int
    turns: tuple[float, ...] = ()
    runs: int = 0
    derivatives: Derivatives | None = field(default=None, repr=False, compare=False)

    @property
    def state(self) -> State:
        """The state in which it begins; simulations and motions nearby start from it."""
        s = self.solution
        first = {"q": s.q[0], "v": s.v[0], "a": s.a[0], "lam": s.lam[0], "base": s.base[0]}
        return replace(s.final, t=float(s.t[0]), algorithmic=None, memory=None, **first)

    @cached_property
    def deviations(self) -> npt.NDArray[np.complex128]:
        """Multipliers of what is not a shift in time, largest first [1]."""
        if not self.free or not self.multipliers.size:
            return self.multipliers
        return np.delete(self.multipliers, np.argmin(np.abs(self.multipliers - 1.0)))

    @property
    def stable(self) -> bool:
        """Whether small deviations do not grow."""
        return bool(np.abs(self.deviations).max(initial=0.0) <= 1.0 + STABLE_TOL)

    def __repr__(self) -> str:
        largest = np.abs(self.deviations).max(initial=0.0)
        word = "stable" if self.stable else "unstable"
        return (
            f"PeriodicMotion(period {self.period:.9g} s, {word}, largest multiplier "
            f"{largest:.4g}, gap {self.gap:.2g} after {self.passes} passes)"
        )


def recorded(shooting: Shooting, tangent: Tangent, passes: int) -> PeriodicMotion:
    """What is handed to the user of a motion that was found."""
    found = tangent.around
    angles = found.turns.angles(found.start.state, found.end)
    free, multipliers = shooting.period is None, tangent.multipliers
    motion = shooting.solution(found), found.flow.period, multipliers, free, found.open
    return PeriodicMotion(*motion, passes, angles, found.flow.runs[0], tangent.kept)


@typed
def periodic_motion(  # noqa: PLR0913  one keyword per choice, most have defaults
    mechanism: Mechanism,
    *,
    period: Time | None = None,
    start: State | PeriodicMotion | None = None,
    turns: Mapping[str, float | None] | None = None,
    steps: Annotated[int, Count(4, MAX_STEPS)] = N_STEPS,
    rho_inf: Share | None = None,
    guess: Time | None = None,
    conservative: bool = False,
    settle: Annotated[int, Count(0, MAX_SETTLE)] = 0,
    t_start: float | None = None,
    tolerance: Annotated[float, Positive()] = GAP_TOL,
    progress: bool = False,
) -> PeriodicMotion:
    """The motion that ends after a period as it began, stable or not, and its multipliers.

    The state after one period is a function of the state before it; Newton's method makes both
    equal (shooting). Its derivatives are differences of motions that start beside it, in every
    free position and velocity. Their eigenvalues, the multipliers of Floquet, say by how much
    small deviations grow in a period.

    Args:
        mechanism: bodies, joints, forces.
        period: of drives, loads and laws, or a multiple of it [s]; None for a motion that nothing
            drives, as a limit cycle, whose period is looked for; it begins somewhere on the cycle.
        start: state, equilibrium or motion nearby from which it is looked for; None for where the
            bodies were added. A motion that nothing drives begins in a state that moves.
        turns: {joint or body: angle [rad]} by which it has advanced after the period when it looks
            the same again, as a gear by one tooth pitch, counted as the angle of the joint is, or
            along its spin for a body without one; None as the angle for a body that looks the same
            after any. Whole turns need no mention.
        steps: of generalised-alpha in a period; one or two more where one of them fails, as the one
            at whose end a tooth leaves may.
        rho_inf: its spectral radius at infinite frequency [1]; None for 0.8, or 0.95 where the
            motion is conservative.
        guess: of an unknown period [s]; None for that of the fastest growing small motion about
            the start.
        conservative: the motion that nothing drives loses no energy either, so that there is one
            for every energy; the one with that of the start is looked for.
        settle: number of periods through which the mechanism moves before.
        t_start: time at which the period begins [s]; None for 0, or that of ``start``.
        tolerance: of the gap that may remain, in rad or lengths of the mechanism, of velocities
            per rad of the period.
        progress: report on stderr.

    Raises:
        ConfigError: for a wrong argument, or a name that is neither a joint nor a body.
        ModelError: naming a drive or load that does not repeat with the period, or a body that
            looks different after the turn that is given; or if joints contradict each other.
        SolverError: if a step fails, or no such motion is found; ``error.solution`` is then the
            last attempt.

    Source:
        Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995).

    Example:
        >>> mech = rom.Mechanism(gravity=(0, 0, 0))
        >>> ball = mech.add_rigid("b", mass=1, inertia=(1, 1, 1), at=(2, 0, 0)).marker((0, 0, 0))
        >>> mech.spring_damper("s", mech.ground.marker((0, 0, 0)), ball, stiffness=4, damping=0.4)
        >>> mech.force("push", ball, lambda t: (np.cos(t), 0, 0))
        >>> q = rom.periodic_motion(mech, period=2 * np.pi).solution.q
        >>> round(float(q[:, 0].max()) - 2, 3)  # 1 / sqrt(3^2 + 0.4^2)
        0.33
    """
    if rho_inf is None:
        rho_inf = CONSERVATIVE_RHO_INF if conservative else RHO_INF
    if conservative and period is not None:
        raise ConfigError("conservative is for motions that nothing drives; leave period out.")
    known = None
    if isinstance(start, PeriodicMotion):
        known, guess = start.derivatives, guess or start.period
    state = start.state if isinstance(start, PeriodicMotion) else start
    if t_start is None:
        t_start = 0.0 if state is None else state.t
    for more in range(MAX_TRIALS):
        numbers = (float(t_start), steps + more, rho_inf, tolerance)
        shooting = Shooting(mechanism, period, *numbers, turns, progress)
        flow = shooting.flow(period or guess or _guessed(mechanism, state))
        begin = flow.initial() if state is None else state
        check_state(begin, flow.packed)
        try:
            turning = turns_of(mechanism, turns, begin)
            at = flow.begun(begin) if known is None else known.ready(flow.begun(begin))
            refuse_what_changes(flow, turning, at, period is not None)
            for _ in range(settle):
                at = Return.of(flow, turning, at).back
            if conservative:
                shooting = replace(shooting, energy=energy(mechanism, at))
            return recorded(shooting, *shooting.closed(flow, at, turning, known))
        except SolverError:
            if not flow.failed[0] or more == MAX_TRIALS - 1:
                raise
    raise AssertionError


def _guessed(mechanism: Mechanism, state: State | None) -> float:
    """Period of the small motion about a state that grows fastest, or decays slowest [s]."""
    linear = linearize(mechanism, state)
    turning = linear.eigenvalues[linear.eigenvalues.imag > 0.0]
    if not turning.size:
        text = "no small motion about the start oscillates: its period cannot be guessed."
        raise ConfigError(text, hint="Give guess= a period near it, or period= that of the drives.")
    return float(2 * np.pi / turning[np.argmax(turning.real)].imag)
