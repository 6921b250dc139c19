"""Newton's method towards a motion that closes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rom.components.orbits.derivatives import (
    Derivatives,
    Tangent,
    by_differences,
    by_steps,
    confirmed,
    follows,
)
from rom.components.orbits.flow import Flow, Start
from rom.components.orbits.repetition import refuse_other_forces
from rom.components.orbits.shooting import Return, energy, moved_by
from rom.components.orbits.turns import Turns
from rom.errors import ModelError, SolverError
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.process.progress import line

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


@dataclass(frozen=True)
class Shooting:
    """How a motion is looked for.

    Attributes:
        mechanism, turns, steps, rho_inf, tolerance, progress: as the user has them.
        period: None where it is unknown.
        t0: time of the start [s].
        energy: that the motion shall have; None where it is not free [J].
    """

    mechanism: Mechanism
    period: float | None
    t0: float
    steps: int
    rho_inf: float
    tolerance: float
    turns: Mapping[str, float | None] | None
    progress: bool = False
    energy: float | None = None

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

        Raises:
            SolverError: if none is found; ``error.solution`` is the last attempt.
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
            raise SolverError(
                "what was found is a state of rest, not a motion.",
                hint="Begin with start= a state that moves, or nearer to the motion.",
            )
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
                    change = np.clip(answer[-1] / (2 * np.pi), *(MAX_PERIOD_CHANGE * _SIDES))
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
        flow, state = found.flow, found.flow.given(found.start)
        h = flow.settings.h
        return simulate(
            self.mechanism, t_start=self.t0, t_end=self.t0 + flow.period, dt=h, state=state,
            rho_inf=self.rho_inf, tolerance=1e-12,
        )  # fmt: skip


_SIDES = np.array([-1.0, 1.0])
