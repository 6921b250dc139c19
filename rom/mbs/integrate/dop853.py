"""Accelerations from the equations of motion, integrated by an explicit method of high order.

Constraints enter on acceleration level; their drift stays at the tolerance of the integrator.
Instants of output are a given interval apart, interpolated, or else the ends of the steps.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np
from scipy.integrate import DOP853

from rom.errors import SolverError
from rom.mbs.elements.family import apply_laws
from rom.mbs.equations.equations import evaluate, rates
from rom.mbs.integrate.run import RUN_KEY, Record, standing_at
from rom.mbs.kernels.work import Work
from rom.mbs.parts.signals import sampled
from rom.mbs.results.state import Memory, State
from rom.model import Array


class Equations:
    """The right-hand side for one run; keeps the last accelerations and multipliers."""

    def __init__(self, record: Record, W: Work, state: State):
        self.record, self.W = record, W
        self.rank, self.rows = state.rank, record.packed.rows_solved(state.rank)
        self.n_q, self.n = state.q.size, state.v.size
        self.a, self.lam = np.zeros(self.n), np.zeros(state.lam.size)
        self.forces = record.packed.asked
        self.broken: SolverError | None = None  # what was wrong with a trial since the last step

    def __call__(self, t: float, y: Array, *, accepted: bool = False) -> Array:
        """Rates at time t; ``accepted`` for a state of the motion, not a trial.

        Raises:
            SolverError: if a prescribed function is not finite, or at an accepted state a force
                is not, or the equations are singular.
        """
        packed, settings = self.record.packed, self.record.settings
        y = np.ascontiguousarray(y)  # SciPy hands over columns
        if packed.signals:
            times = np.array([t])
            h = settings.spacing
            table, failure = sampled(packed.signals, times, settings.span, h, h)
            if failure is not None:
                raise failure
            self.W.signal[:] = table[0]
        if self.forces:
            evaluate(packed.system, self.W, y[: self.n_q], y[self.n_q : self.n_q + self.n])
            apply_laws(self.forces, self.W, t)
        out = np.zeros_like(y)
        clock = perf_counter()
        solved = rates(packed.system, self.W, y, self.rows, accepted, self.a, self.lam, out)
        self.record.compiled += perf_counter() - clock
        if not solved or not np.isfinite(out).all():
            where = f"at t = {t:.9g} s{packed.broken_laws}"
            self.broken = SolverError(f"the equations of motion are singular {where}.")
            if accepted:
                raise self.broken
            out[:] = np.nan  # a trial: a shorter step is tried
        return out


def run_explicit(record: Record, W: Work, state: State) -> None:
    """Fill the record by DOP853 of SciPy."""
    settings = record.settings
    W.base[:] = state.base
    equations, goes_on = Equations(record, W, state), settings.begun > 0
    y = np.concatenate([state.q, state.v, np.zeros(3)])
    if not goes_on:
        equations(state.t, y, accepted=True)
        state = _state_of(equations, state.t, y)
    work = state.memory.arrays["y"][-3:] if goes_on else np.zeros(3)
    record.start(state, work)
    record.clock, record.compiled = perf_counter(), 0.0
    solver, due, steps = _solver(equations, state if goes_on else replace(state, memory=None))
    while solver.status == "running" and not record.stopped:
        before = record.final if steps else record.given
        with standing_at(record, before):
            due = _step(record, equations, solver, due)
            steps += 1
            record.counts = {"steps": steps, "evaluations": solver.nfev}
            if not record.stopped:
                memory = _memory(record, equations, solver, due)
                record.reach(_state_of(equations, solver.t, _unit(record, solver.y.copy()), memory))
        record.pause()
    record.reach(replace(record.final, memory=None))


def _solver(equations: Equations, state: State) -> tuple[DOP853, int, int]:
    """The solver, the first output due, and the number of steps taken."""
    record, settings = equations.record, equations.record.settings
    options = {"rtol": settings.rtol, "atol": settings.atol}
    if state.memory is None:
        y = np.concatenate([state.q, state.v, np.zeros(3)])
        return DOP853(equations, state.t, y, settings.t_end, **options), 1, 0
    arrays, base = state.memory.arrays, equations.W.base.copy()
    step = float(arrays["step"][0])
    left = settings.t_end - state.t
    options["first_step"] = min(step, left)
    solver = DOP853(equations, state.t, arrays["y"].copy(), settings.t_end, **options)
    solver.f, solver.h_abs = arrays["f"].copy(), step
    solver.nfev, steps, due = (int(x) for x in arrays["counts"])
    equations.W.base[:] = base
    record.t = state.t
    return solver, due, steps


def _memory(record: Record, equations: Equations, solver: DOP853, due: int) -> Memory:
    """All that the next step depends on and the state does not tell."""
    settings, steps = record.settings, int(record.counts["steps"])
    arrays = {
        "y": solver.y.copy(),
        "f": solver.f.copy(),
        "step": np.array([solver.h_abs]),
        "counts": np.array([solver.nfev, steps, due]),
    }
    y = _unit(record, solver.y.copy())
    arrays[RUN_KEY] = np.concatenate([[solver.t], y[: equations.n_q + equations.n]])
    return Memory(settings.kind, settings.h, settings.t_start, steps, arrays)


def _step(record: Record, equations: Equations, solver: DOP853, due: int) -> int:
    """Take one step and save what it has passed, or its end; returns the next output due."""
    equations.broken = None
    with np.errstate(all="ignore"):  # of a trial that went too far
        message = solver.step()
    if solver.status == "failed":
        raise equations.broken or SolverError(
            f"dop853 failed at t = {solver.t:.9g} s: {message}",
            hint="The motion is too stiff for it: use generalized-alpha.",
        )
    stop = _first_event(record, equations, solver)
    due = _output(record, equations, solver, due)
    if stop is not None:
        _save(record, equations, stop, solver.dense_output()(stop))
    elif solver.t > record.t:
        equations(solver.t, solver.y, accepted=True)
    return due


def _first_event(record: Record, equations: Equations, solver: DOP853) -> float | None:
    """Time of a terminal event in the last step."""
    if record.watch is None:
        return None
    dense, n_q, n = solver.dense_output(), equations.n_q, equations.n

    def motion(t: float) -> tuple[Array, Array]:
        y = _unit(record, dense(t).copy())
        return y[:n_q], y[n_q : n_q + n]

    record.watch.instant.W.base[:] = equations.W.base
    record.watch.step(solver.t_old, solver.t, motion)
    return record.watch.stop[1] if record.watch.stop else None


def _unit(record: Record, y: Array) -> Array:
    """The same with quaternions of unit length."""
    for at in record.packed.system.bodies.q_at:
        y[at + 3 : at + 7] /= np.linalg.norm(y[at + 3 : at + 7])
    return y


def _output(record: Record, equations: Equations, solver: DOP853, due: int) -> int:
    """Save all instants that the last step has passed; returns the next one due."""
    settings, dense = record.settings, None
    if settings.dt is None:
        last = solver.t == settings.t_end
        if not record.stopped and (last or due % settings.save_every == 0):
            _save(record, equations, solver.t, solver.y.copy())
        return due + 1
    while due <= settings.steps:
        t = settings.time(due) if due < settings.steps else settings.t_end
        if t > solver.t or (record.stopped and t >= record.stopped):
            break
        if t < solver.t and dense is None:
            dense = solver.dense_output()
        y = solver.y if t == solver.t else dense(t)
        if due % settings.save_every == 0 or due == settings.steps:
            _save(record, equations, t, y.copy())
        due += 1
    return due


def _save(record: Record, equations: Equations, t: float, y: Array) -> None:
    _unit(record, y)
    equations(t, y, accepted=True)
    record.t, record.final = t, _state_of(equations, t, y)
    record.keep_state(record.final, y[-3:])


def _state_of(equations: Equations, t: float, y: Array, memory: Memory | None = None) -> State:
    n_q, n = equations.n_q, equations.n
    q, v, a, lam = (x.copy() for x in (y[:n_q], y[n_q : n_q + n], equations.a, equations.lam))
    return State(t, q, v, a, lam, equations.rank, None, equations.W.base.copy(), memory)
