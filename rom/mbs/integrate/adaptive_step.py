"""Steps of chosen length for generalised-alpha and BDF: the errors of all steps add up to rtol.

The error of a step is its difference from the step that follows from the accelerations at both of
its ends with one order more; lengths are relative to the size of the mechanism, velocities to the
largest so far, both weighted by mass. What is saved fits the constraints in its velocities and
accelerations too, which a method of index 3 leaves to its truncation error.
"""

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from rom.errors import SolverError
from rom.mbs.equations.python_laws import apply_laws, laws
from rom.mbs.integrate import generalized_alpha as alpha
from rom.mbs.integrate.consistent_start import fitting_velocity
from rom.mbs.integrate.event_end import kept_before_the_end
from rom.mbs.integrate.fixed_step import counts, failed_step, space
from rom.mbs.integrate.run import FIRST_STEP_RATIO, RUN_KEY, Record, of, standing_at
from rom.mbs.integrate.step_memory import (
    accelerated,
    across,
    begin,
    recall,
    remember,
    shift_ahead,
    signals_at,
)
from rom.mbs.kernels.work import Work, workspace
from rom.mbs.parts.signals import sampled
from rom.mbs.results.state import Memory, State
from rom.model import Array

# a step is at most so much longer or shorter than the last, and aims below the tolerance
MAX_STEP_GROWTH, MIN_STEP_GROWTH, ERROR_AIM = 2.0, 0.2, 0.8
# errors of early steps grow on the way to the end
ERROR_MARGIN = 3.0
MIN_WORTHWHILE_GROWTH = 1.3  # of a step that justifies a new factorisation
# smallest step relative to the duration
MIN_STEP_RATIO = 1e-12
# what a step changes and a rejected one gives back
CHANGED_FIELDS = ("q", "v", "a", "vd", "lam", "psi", "work", "lost", "count")
# what a run remembers beside its step memory, whose arrays have this in front of their names
NUMBERS = ("h", "before", "fastest", "shortest", "longest", "rejected", "uneven")
STEP_PREFIX = "step."


def increment(turns: Any, h: float, left: tuple[Array, Array], right: tuple[Array, Array]) -> Array:
    """Increment of a step from (velocities, accelerations) at its ends, to fourth order.

    Angular velocities begin at ``turns``; their rotation vector has the term of Magnus besides.
    """
    (v0, a0), (v1, a1) = left, right
    out = h * v0 + h**2 / 6 * (2 * a0 + a1)
    for t in turns:
        out[t : t + 3] += h**2 / 12 * np.cross(v0[t : t + 3], v1[t : t + 3])
    return out


def run_variable(record: Record, W: Work, state: State) -> None:
    """Fill the record by generalised-alpha or BDF with steps that meet a tolerance."""
    goes_on = record.settings.begun > 0
    run = _Run(record, W, state if goes_on else replace(state, algorithmic=None, memory=None))
    while record.t < record.settings.t_end and not record.stopped:
        before = record.final if run.T.count[alpha.STEPS] else record.given
        with standing_at(record, before):
            run.step()
        record.pause()
    record.reach(replace(record.final, memory=None))
    if not record.stopped and record.blocks[-1][0][-1] < record.t:
        run.keep()


class _Run:
    """A run with its step memory; ``T`` is prepared for a next step of length ``h``."""

    def __init__(self, record: Record, W: Work, state: State):
        self.record, self.W, self.forces = record, W, laws(record.mechanism, record.packed)
        self.duration = record.settings.t_end - record.settings.t_start
        self.beside = workspace(record.packed.system, len(record.packed.signals))
        self.state, self.bdf, self.uneven = state, record.settings.method == "bdf", False
        bare = replace(state, memory=None)
        self.T, start = begin(record, W, bare, self.forces, FIRST_STEP_RATIO * self.duration)
        self.old = self.T.replace(**{name: getattr(self.T, name).copy() for name in CHANGED_FIELDS})
        self.out, self.base = space(W, self.T, 1), W.base.copy()
        self.h = self.before = FIRST_STEP_RATIO * self.duration
        self.fastest, self.rejected = record.packed.length / self.duration, 0
        self.shortest, self.longest = np.inf, 0.0
        self.jerk, self.next = np.zeros_like(state.v), start
        if record.settings.begun:
            self.recall(state)
        record.start(self.next, self.T.work)
        record.clock = perf_counter()

    def remembered(self) -> Memory:
        """All that the next step depends on and the state does not tell."""
        record, memory = self.record, remember(self.record.settings, self.W, self.T, 0)
        steps = {STEP_PREFIX + name: x.copy() for name, x in self.T.items()}
        arrays = memory.arrays | steps
        arrays["numbers"] = np.array([getattr(self, name) for name in NUMBERS], dtype=float)
        # joint coordinates are followed apart from those of the saved instants
        arrays["jerk"], arrays["base"] = self.jerk.copy(), self.W.base.copy()
        arrays[RUN_KEY] = of(record.final)
        taken = int(self.T.count[alpha.STEPS])
        return replace(memory, h=self.h, origin=record.settings.t_start, taken=taken, arrays=arrays)

    def recall(self, state: State) -> None:
        """Go on where `remembered` was asked."""
        arrays = state.memory.arrays
        recall(state.memory, self.W, self.T)
        for name, x in self.T.items():
            x[:] = arrays[STEP_PREFIX + name]
        for name, x in zip(NUMBERS, arrays["numbers"], strict=True):
            setattr(self, name, float(x))
        self.rejected, self.uneven = int(self.rejected), bool(self.uneven)
        self.W.base[:] = arrays["base"]
        self.jerk, self.next = arrays["jerk"].copy(), state

    def step(self) -> None:
        """Take one step that meets the tolerance: shorten it until it does."""
        end = self.record.settings.t_end
        left = end - self.record.t
        if 2 * self.h > left:  # two equal last steps instead of a tiny one
            self.prepare(left if 1.001 * self.h > left else 0.5 * left)
        error = np.inf
        while error > 1.0:
            t = end if self.h >= left else self.record.t + self.h
            answer = self.attempt(t)
            if answer == alpha.CONVERGED:
                self.next = self.consistent(t)
                error = self.error() * self.duration / (self.h * self.record.settings.rtol)
            if error > 1.0:
                self.reject(answer, error, t)
        self.accept(t)
        factor = min(ERROR_AIM / np.sqrt(max(error, 1e-6)), MAX_STEP_GROWTH)
        if self.record.stopped or t >= end:
            return
        if factor > MIN_WORTHWHILE_GROWTH or factor < ERROR_AIM:
            self.prepare(factor * self.h)
        elif self.bdf and self.uneven:
            self.prepare(self.h)
        self.record.reach(replace(self.record.final, memory=self.remembered()))

    def attempt(self, t: float) -> int:
        """Take the step to a time; says how it went."""
        step, W, settings, packed = self.T, self.W, self.record.settings, self.record.packed
        for name in CHANGED_FIELDS:
            getattr(self.old, name)[:] = getattr(step, name)
        self.base[:] = W.base
        times = np.array([t])
        h = settings.spacing
        table, failure = sampled(packed.signals, times, settings.span, h, h)
        if failure is not None:
            raise failure
        step.count[alpha.STEPS_BEFORE], rank = step.count[alpha.STEPS], self.record.final.rank
        answer = alpha.NEEDS_LAWS
        while answer == alpha.NEEDS_LAWS:
            clock = perf_counter()
            answer = alpha.advance(packed.system, W, step, rank, table, 1, self.out)
            self.record.compiled += perf_counter() - clock
            if answer == alpha.NEEDS_LAWS:
                apply_laws(self.forces, W, t)
        return answer

    def error(self) -> float:
        """Error of the step just taken, relative to length and speed."""
        step, last, now, h = self.T, self.record.final, self.next, self.h
        turns = self.record.packed.system.bodies.v_at + 3
        shift = step.psi - increment(turns, h, (last.v, last.a), (now.v, now.a))
        change = now.v - last.v - h / 2 * (last.a + now.a)
        self.fastest = max(self.fastest, self.length(now.v))
        return ERROR_MARGIN * max(
            self.length(shift) / step.size[1], self.length(change) / self.fastest
        )

    def length(self, x: Array) -> float:
        """Length of a change of velocities or coordinates, weighted by mass."""
        return float(np.sqrt(self.W.weight @ x**2))

    def reject(self, answer: int, error: float, t: float) -> None:
        """Go back to where the step began and prepare a shorter one.

        Raises:
            SolverError: if that would be too short.
        """
        spent = self.T.count[[alpha.ITERATIONS, alpha.FACTORISATIONS]]
        for name in CHANGED_FIELDS:
            getattr(self.T, name)[:] = getattr(self.old, name)
        self.W.base[:] = self.base
        self.T.count[[alpha.ITERATIONS, alpha.FACTORISATIONS]] = spent
        self.rejected += 1
        h = self.h * max(MIN_STEP_GROWTH, ERROR_AIM / np.sqrt(error))
        if h < MIN_STEP_RATIO * self.duration:
            why = f"its error is {error:.3g} times the tolerance"
            if answer != alpha.CONVERGED:
                why = failed_step(self.record, self.W, self.T, answer, t).message
            raise SolverError(
                f"the step became too small at t = {self.record.t:.9g} s ({self.h:.3g} s): {why}.",
                hint="A force jumps there, or the mechanism is near a singular position; or ask "
                f"for less than rtol = {self.record.settings.rtol:.3g}. The motion up to there is "
                "kept in error.solution.",
            )
        self.prepare(h)

    def prepare(self, h: float) -> None:
        """Let the next step have another length."""
        step = self.T
        if step.count[alpha.STEPS] == 0:
            spent = step.count.copy()
            fresh, _ = begin(self.record, self.W, self.state, self.forces, h)
            for name in (*CHANGED_FIELDS, "method", "bdf"):
                getattr(step, name)[:] = getattr(fresh, name)
            step.count[:] = spent
        elif self.bdf:
            step.method[:], step.bdf[:] = alpha.bdf_coefficients(h, self.before)
            self.uneven = h != self.before
        else:
            step.a[:] += (step.method[3] - step.method[4]) * (h - self.h) * self.jerk
            step.method[0] = h
            self.reset_across()
        step.count[alpha.HAS_FACTOR], self.h = 0, h

    def reset_across(self) -> None:
        """Begin anew across the constraints, where another length of steps would excite them."""
        record, W, step, now = self.record, self.beside, self.T, self.record.final
        h = step.method[0]
        lag, shift = (
            step.method[3] - step.method[4],
            shift_ahead(record, now, step.method, self.jerk),
        )
        wanted = (now.v + h**2 * shift, now.a + lag * h * self.jerk, now.a)
        present = (step.v, step.a, step.vd)
        change = across(record, W, now, (np.array(wanted) - np.array(present)).T)
        for x, y in zip(present, change.T, strict=True):
            x += y

    def consistent(self, t: float) -> State:
        """The present instant with velocities, accelerations and multipliers that fit."""
        step, rank = self.T, self.record.final.rank
        self.beside.base[:] = self.base
        signals_at(self.record, self.beside, t)
        v = fitting_velocity(self.record.packed, self.beside, step.q, step.v)
        state = State(t, step.q.copy(), v, step.vd, step.lam, rank, None, self.base)
        at_rest = np.zeros_like(step.v)
        return accelerated(self.record, self.beside, state, self.forces, 0.0, at_rest)

    def accept(self, t: float) -> None:
        """Go on from the new instant."""
        record, step, state = self.record, self.T, self.next
        self.jerk, self.before = (state.a - record.final.a) / self.h, self.h
        self.shortest, self.longest = min(self.shortest, self.h), max(self.longest, self.h)
        record.counts = counts(step) | {"rejected": self.rejected}
        record.counts |= {"shortest": self.shortest, "longest": self.longest}
        saved = np.array([step.count[alpha.STEPS] % record.settings.save_every == 0])
        row = (state.q, state.v, state.a, state.lam, step.work.copy(), state.base)
        out = tuple(x[None] for x in row)
        if record.watch and kept_before_the_end(
            record, self.beside, self.forces, np.array([t]), out, saved
        ):
            return
        record.t, record.final = t, state
        if saved[0]:
            self.keep()

    def keep(self) -> None:
        """Save the present instant."""
        self.record.keep_state(self.record.final, self.T.work)
