"""A motion that repeats, with its multipliers."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rom.arguments import between, positive, typed, whole
from rom.components.orbits.derivatives import Derivatives, Tangent
from rom.components.orbits.flow import Flow
from rom.components.orbits.repetition import refuse_what_changes
from rom.components.orbits.search import Shooting
from rom.components.orbits.shooting import Return, energy
from rom.components.orbits.turns import turns_of
from rom.errors import ConfigError, SolverError
from rom.mbs.analysis.linearize import linearize
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State, check_state

N_STEPS, MAX_STEPS = 200, 100_000  # per period
# the method forgets what a step does not resolve within a period; motions that keep their energy
# must not lose it to the method
RHO_INF, CONSERVATIVE_RHO_INF = 0.8, 0.95
MAX_TRIALS = 3  # with one step more each time
GAP_TOL = 1e-10  # in rad or lengths of the mechanism
MAX_SETTLE = 100_000  # periods: minutes of the smallest mechanisms
STABLE_TOL = 1e-6  # of the size of a multiplier: differences and round-off


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
    return PeriodicMotion(
        shooting.solution(found), found.flow.period, tangent.multipliers, shooting.period is None,
        found.open, passes, angles, found.flow.runs[0], tangent.kept,
    )  # fmt: skip


@typed
def periodic_motion(  # noqa: PLR0913  one keyword per choice, most have defaults
    mechanism: Mechanism,
    *,
    period: float | None = None,
    start: State | PeriodicMotion | None = None,
    turns: Mapping[str, float | None] | None = None,
    steps: int = N_STEPS,
    rho_inf: float | None = None,
    guess: float | None = None,
    conservative: bool = False,
    settle: int = 0,
    t_start: float | None = None,
    tolerance: float = GAP_TOL,
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
            drives, as a limit cycle, whose period is looked for.
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

    Returns:
        The motion over one period. It begins somewhere on the cycle where nothing drives it.

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
    whole("settle", settle, 0, MAX_SETTLE)
    if conservative and period is not None:
        raise ConfigError("conservative is for motions that nothing drives; leave period out.")
    whole("steps", steps, 4, MAX_STEPS)
    positive("tolerance", tolerance)
    between("rho_inf", rho_inf, 0, 1)
    for name, time in (("period", period), ("guess", guess)):
        if time is not None:
            positive(name, time)
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
            return _near(shooting, flow, begin, known, settle, conservative)
        except SolverError:
            if not flow.failed[0] or more == MAX_TRIALS - 1:
                raise
    raise AssertionError


def _near(
    shooting: Shooting,
    flow: Flow,
    begin: State,
    known: Derivatives | None,
    settle: int,
    conservative: bool,
) -> PeriodicMotion:
    """The motion near a state."""
    turning = turns_of(shooting.mechanism, shooting.turns, begin)
    at = flow.begun(begin) if known is None else known.ready(flow.begun(begin))
    refuse_what_changes(flow, turning, at, shooting.period is not None)
    for _ in range(settle):
        at = Return.of(flow, turning, at).back
    if conservative:
        shooting = replace(shooting, energy=energy(shooting.mechanism, at))
    return recorded(shooting, *shooting.closed(flow, at, turning, known))


def _guessed(mechanism: Mechanism, state: State | None) -> float:
    """Period of the small motion about a state that grows fastest, or decays slowest [s]."""
    linear = linearize(mechanism, state)
    turning = linear.eigenvalues[linear.eigenvalues.imag > 0.0]
    if not turning.size:
        raise ConfigError(
            "no small motion about the start oscillates: its period cannot be guessed.",
            hint="Give guess= a period near the one looked for, or period= that of the drives.",
        )
    return float(2 * np.pi / turning[np.argmax(turning.real)].imag)
