"""Steps of chosen length for generalised-alpha and BDF: the errors of all steps add up to rtol.

Compiled steps in pieces, see `rom.mbs.integrate.step_control`; here is what they come back for:
signals, forces in Python, events, what is kept, and errors.
"""

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from rom.errors import SolverError
from rom.mbs.elements.family import apply_laws
from rom.mbs.integrate import generalized_alpha as alpha
from rom.mbs.integrate import step_control as control
from rom.mbs.integrate.consistent_start import check_velocity
from rom.mbs.integrate.fixed_step import counts, failed_step, in_chunks, kept_before_the_end
from rom.mbs.integrate.run import FIRST_STEP_RATIO, RUN_KEY, Record, of, standing_at
from rom.mbs.integrate.step_control import Control, Trial
from rom.mbs.integrate.step_memory import FACTOR_FIELDS, begin, recall, remember
from rom.mbs.kernels import work as entry
from rom.mbs.kernels.work import Step, Work, workspace
from rom.mbs.parts.signals import padded, sampled
from rom.mbs.results.state import Memory, State
from rom.model import Array

# what a run remembers beside its step memory, whose arrays have this in front of their names
NUMBERS = (control.LENGTH, control.BEFORE, control.ERROR_BEFORE, control.SHORTEST, control.LONGEST)
COUNTS = (control.REJECTED, control.UNEVEN)
STEP_PREFIX = "step."
# what belongs to the method and its length
METHOD_FIELDS = ("q", "v", "a", "vd", "lam", "psi", "work", "lost", "method", "bdf")
INSTANT_FIELDS = ("v", "a", "lam", "base")
# instants at which signals are sampled at once while the length of the steps stays: a function
# that takes arrays is asked for four in any case
LEAST_AHEAD, MOST_AHEAD = 4, 64


def run_variable(record: Record, W: Work, state: State) -> None:
    """Fill the record by generalised-alpha or BDF with steps that meet a tolerance."""
    alpha.advance.link()
    goes_on = record.settings.begun > 0
    run = _Run(record, W, state if goes_on else replace(state, algorithmic=None, memory=None))
    in_chunks(record, run.chunk, lambda: record.t < record.settings.t_end)
    record.reach(replace(record.final, memory=None))
    if not record.stopped and record.blocks[-1][0][-1] < record.t:
        record.keep_state(record.final, run.T.work)


class _Run:
    """A run with its step memory; ``T`` is prepared for a next step."""

    def __init__(self, record: Record, W: Work, state: State):
        self.record, self.forces = record, record.packed.asked
        settings, signals = record.settings, len(record.packed.signals)
        self.state, duration = state, settings.t_end - settings.t_start
        bare, h = replace(state, memory=None), FIRST_STEP_RATIO * duration
        step, start = begin(record, W, bare, self.forces, h)
        start = state if settings.begun else start
        self.W, self.now = _control(W, step, start)
        self.T, back = self.now.step, _control(W, step, start)[1]
        self.back = back.replace(lu=np.zeros_like(self.now.lu))
        self.beside, self.trial = _trial(record, start, workspace(record.packed.system, signals))
        self.ahead, number, count = LEAST_AHEAD, self.now.number, self.now.count
        number[[control.TIME, control.END]] = start.t, settings.t_end
        number[[control.LENGTH, control.BEFORE, control.SHORTEST]] = h, h, np.inf
        number[[control.DURATION, control.RTOL]] = duration, settings.rtol
        count[control.IS_BDF] = settings.method == "bdf"
        count[control.EVERY] = 1 if record.watch else settings.save_every
        if settings.begun:
            self.recall(state)
        record.start(start, self.T.work)
        record.clock = perf_counter()

    def remembered(self) -> Memory:
        """All that the next step depends on and the state does not tell."""
        record, now = self.record, self.now
        memory = remember(record.settings, self.W, self.T, 0)
        arrays = memory.arrays | {STEP_PREFIX + name: x.copy() for name, x in self.T.items()}
        arrays["numbers"] = np.append(now.number[list(NUMBERS)], now.count[list(COUNTS)])
        # joint coordinates are followed apart from those of the saved instants
        arrays["jerk"], arrays["base"] = now.jerk.copy(), self.W.base.copy()
        arrays[RUN_KEY] = of(record.final)
        taken, h = int(self.T.count[entry.STEPS]), float(now.number[control.LENGTH])
        return replace(memory, h=h, origin=record.settings.t_start, taken=taken, arrays=arrays)

    def recall(self, state: State) -> None:
        """Go on where `remembered` was asked."""
        arrays, now = state.memory.arrays, self.now
        recall(state.memory, self.W, self.T)
        for name, x in self.T.items():
            x[:] = arrays[STEP_PREFIX + name]
        now.number[list(NUMBERS)] = arrays["numbers"][: len(NUMBERS)]
        now.count[list(COUNTS)] = arrays["numbers"][len(NUMBERS) :]
        self.W.base[:], now.jerk[:] = arrays["base"], arrays["jerk"]

    def chunk(self, limit: int) -> int:
        """Take up to so many steps and keep what is to be saved; returns how many were taken.

        Where an event function fails at one of them, they are taken again one by one, to stand
        behind the last good one with all that the next depends on.
        """
        record, now = self.record, self.now
        if not record.watch or limit == 1:
            return self.piece(limit)
        mark = now.reals.copy(), now.wholes.copy(), now.lu.copy()
        before = record.final if self.T.count[entry.STEPS] else record.given
        begun = record.t, record.final, record.noted, len(record.blocks)
        try:
            return self.piece(limit)
        except BaseException:
            taken = int(now.count[control.TAKEN])
            if record.final.t > before.t:
                raise
            now.reals[:], now.wholes[:], now.lu[:] = mark
            now.count[[control.STAGE, control.AT_HAND]] = control.BEGINS, 0
            record.t, record.final, record.noted = begun[:3]
            record.watch.recall(record.noted)
            del record.blocks[begun[3] :]
            for _ in range(taken):
                self.piece(1)
            raise

    def piece(self, limit: int) -> int:
        """Take up to so many steps as above."""
        record, count = self.record, self.now.count
        before = record.final if self.T.count[entry.STEPS] else record.given
        count[control.LIMIT], count[control.TAKEN], count[control.SAVED] = limit, 0, 0
        rows = np.zeros((limit // int(count[control.EVERY]) + 1, self.trial.rows.shape[1]))
        self.trial = self.trial.replace(rows=rows)
        try:
            self.take()
        finally:
            with standing_at(record, before):
                self.note(before)
        return int(count[control.TAKEN])

    def take(self) -> None:
        """Take steps, and do all that they come back for; what cannot be done raises RomError."""
        record, now = self.record, self.now
        rank = record.packed.rows_solved(record.final.rank)
        tables = (self.W, self.beside, now, self.back, self.trial)
        todo = {
            alpha.NEEDS_LAWS: lambda: self.apply_laws(self.W),
            control.NEEDS_LAWS_THERE: lambda: self.apply_laws(self.beside),
            control.NEEDS_SIGNALS: self.sample,
            control.NEEDS_START: self.begin_again,
        }
        while True:
            clock = perf_counter()
            answer = control.take_steps(record.packed.system, *tables, rank)
            record.compiled += perf_counter() - clock
            if answer == control.PAUSED:
                return
            if answer not in todo:
                raise self.failure(answer)
            todo[answer]()

    def apply_laws(self, W: Work) -> None:
        """Ask for the forces in Python at the time of the step."""
        slopes = W is self.W and not self.T.count[entry.HAS_FACTOR]
        apply_laws(self.forces, W, float(self.now.number[control.REACHED]), slopes=slopes)

    def sample(self) -> None:
        """Sample signals at the time of the step, and at those to come if its length stays.

        One that fails later may never be met: it raises RomError when its time has come.
        """
        settings, (t, h) = self.record.settings, self.now.number[[control.REACHED, control.LENGTH]]
        used_up = 0 < self.now.count[control.KNOWN] == self.now.count[control.ROW]
        self.ahead = min(2 * self.ahead, MOST_AHEAD) if used_up else LEAST_AHEAD
        times = [t]
        while len(times) < self.ahead and times[-1] + 2 * h <= settings.t_end:
            times.append(times[-1] + h)
        how = settings.span, settings.spacing, settings.spacing
        table, failure = sampled(self.record.packed.signals, padded(np.array(times)), *how)
        good = min(len(table), len(times))
        if failure is not None and not good:
            raise failure
        self.trial.times[:good], self.trial.table[:good] = times[:good], table[:good]
        self.now.count[control.ROW], self.now.count[control.KNOWN] = 0, good

    def begin_again(self) -> None:
        """Begin with another length of the first step."""
        h = self.now.number[control.LENGTH] = float(self.now.number[control.WANTED])
        fresh, _ = begin(self.record, self.W, self.state, self.forces, h)
        for name in METHOD_FIELDS:
            getattr(self.T, name)[:] = getattr(fresh, name)
        self.T.count[[entry.HAS_FACTOR, entry.STEP_PASSES]] = 0
        self.now.count[control.STAGE] = self.now.count[control.NEXT]

    def failure(self, answer: int) -> SolverError:
        """The error by which a run ends."""
        number, count, record = self.now.number, self.now.count, self.record
        t, h, error = (float(number[k]) for k in (control.REACHED, control.WANTED, control.ERROR))
        if answer == control.CONTRADICTED:
            check_velocity(record.packed, self.beside, self.trial.v)
        if answer != control.TOO_SHORT:
            fits = count[control.STAGE] == control.FITS
            where = f"at t = {t:.9g} s" if fits else "where constraints are met"
            broken = record.packed.broken_laws
            return SolverError(f"the equations of motion are singular {where}{broken}.")
        why = f"its error is {error:.3g} times the tolerance"
        if count[control.ANSWER] != alpha.CONVERGED:
            why = failed_step(record, self.W, self.T, int(count[control.ANSWER]), t).message
        return SolverError(
            f"the step became too small at t = {number[control.TIME]:.9g} s ({h:.3g} s): {why}.",
            hint="A force jumps there, or the mechanism is near a singular position, or bodies "
            "vibrate faster than anybody asks: take steps of one length, dt=..., that resolve what "
            f"matters, or ask for less than rtol = {record.settings.rtol:.3g}. The motion up to "
            "there is kept in error.solution.",
        )

    def note(self, before: State) -> None:
        """Keep the saved instants and stand at the last one, where the step under way began."""
        record, now = self.record, self.now
        if now.count[control.STAGE] != control.BEGINS:
            for name in ("reals", "wholes", "lu"):
                getattr(now, name)[:] = getattr(self.back, name)
        shortest, longest = now.number[[control.SHORTEST, control.LONGEST]].tolist()
        record.counts = counts(self.T) | {"rejected": int(now.count[control.REJECTED])}
        record.counts |= {"shortest": shortest, "longest": longest}
        if not now.count[control.TAKEN]:
            record.reach(before, record.noted)
            return
        every, kept = record.settings.save_every, int(now.count[control.SAVED])
        sizes = [1, self.T.q.size, now.v.size, now.v.size, now.lam.size, now.base.size]
        t, *x, base, work = np.split(self.trial.rows[:kept], np.cumsum(sizes), axis=1)
        t, out = t[:, 0], (*x, work, base)
        steps = int(self.T.count[entry.STEPS]) - np.arange(kept)[::-1]
        saved = steps % every == 0 if record.watch else np.full(kept, True)
        steps_seen = self.beside, self.forces, t, out, saved
        if record.watch and kept_before_the_end(record, *steps_seen):
            return
        if saved.any():
            record.keep(t[saved], *(x[saved] for x in out))
        record.t = float(now.number[control.TIME])
        q, v, a, lam, base = (x.copy() for x in (self.T.q, now.v, now.a, now.lam, now.base))
        record.reach(State(record.t, q, v, a, lam, record.final.rank, None, base))
        record.reach(replace(record.final, memory=self.remembered()))


def _control(W: Work, step: Step, start: State) -> tuple[Work, Control]:
    """What changes from step to step, at the start; and the memory of the method, which shares it.

    The memory keeps of a step its factor, and what belongs to it.
    """
    base = W.base if start.base is None else start.base
    own: dict[str, Array] = {"v": start.v, "a": start.a, "lam": start.lam, "base": base}
    own |= {"jerk": 0 * start.v, "number": np.zeros(control.ERROR + 1)}
    counts = {"count": np.zeros(control.ANSWER + 1, dtype=np.int64)}
    kept = {f"W {name}": getattr(W, name) for name in ("base", *FACTOR_FIELDS, "factor")}
    steps = {f"step {name}": x for name, x in step.items()}
    reals, wholes = (
        _one_piece({name: x for name, x in {**mine, **steps, **kept}.items() if x.dtype == kind})
        for mine, kind in ((own, np.float64), (counts, np.int64))
    )
    parts = reals[1] | wholes[1]
    W = W.replace(**{name: parts[f"W {name}"] for name in ("base", *FACTOR_FIELDS, "factor")})
    fields: dict[str, Any] = {name: parts[name] for name in (*own, *counts)}
    fields |= {"reals": reals[0], "wholes": wholes[0], "lu": W.lu.reshape(-1)}
    fields["instant"] = reals[0][: sum(own[name].size for name in INSTANT_FIELDS)]
    fields["step"] = Step(**{name: parts[f"step {name}"] for name, _ in step.items()})
    return W, Control(**fields, by_blocks=W.by_blocks, W_base=W.base)


def _trial(record: Record, start: State, E: Work) -> tuple[Work, Trial]:
    """Room for the instant at the end of a step, and the memory it is computed in."""
    n, m, signals = start.v.size, start.lam.size, len(record.packed.signals)
    parts = dict(zip(INSTANT_FIELDS, map(np.zeros, (n, n, m, E.base.size)), strict=True))
    instant, parts = _one_piece(parts)
    ahead = {"times": np.zeros(MOST_AHEAD), "table": np.zeros((MOST_AHEAD, signals, 3))}
    rows = np.zeros((0, 1 + start.q.size + instant.size + 3))
    none, signal = np.zeros((0, 0)), np.zeros((1, signals, 3))
    trial = Trial(instant=instant, **parts, **ahead, signal=signal, rows=rows, none=none)
    return E.replace(base=trial.base, signal=signal[0]), trial


def _one_piece(arrays: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    """An array with the content of all, and its parts by their names and in their shapes."""
    piece = np.concatenate([x.ravel() for x in arrays.values()])
    parts = np.split(piece, np.cumsum([x.size for x in arrays.values()])[:-1])
    shaped = zip(arrays.items(), parts, strict=True)
    return piece, {name: part.reshape(x.shape) for (name, x), part in shaped}
