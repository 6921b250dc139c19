"""Accelerations from the equations of motion, integrated by methods of SciPy.

Whole motions by DOP853, explicit and of high order, the first instants of a multistep method by
Radau IIA. Constraints enter on acceleration level; their drift stays at the tolerance of the
integrator. Instants of output are a given interval apart, interpolated, or else ends of steps.
"""

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np
from scipy.integrate import DOP853, solve_ivp

from rom.errors import ConfigError, SolverError
from rom.mbs.elements.family import apply_laws
from rom.mbs.equations.equations import evaluate, rates
from rom.mbs.integrate.consistent_start import assembled, fitting_velocity, prescribed
from rom.mbs.integrate.run import RUN_KEY, Record, standing_at
from rom.mbs.kernels.work import STEPS, Step, Work
from rom.mbs.results.state import Memory, State
from rom.model import Array

RADAU_RTOL, RADAU_ATOL = 1e-11, 1e-13


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

        Refuses prescribed functions that are not finite, and accepted states in which a force is
        not, or the equations are singular.
        """
        packed, settings = self.record.packed, self.record.settings
        y = np.ascontiguousarray(y)  # SciPy hands over columns
        if packed.signals:
            h = settings.spacing
            self.W.signal[:] = prescribed(packed.signals, np.array([t]), settings.span, h, h)[0]
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
    y = _coordinates(state)
    if not goes_on:
        equations(state.t, y, accepted=True)
        state = _state_of(equations, state.t, y)
    record.start(state, state.memory.arrays["y"][-3:] if goes_on else np.zeros(3))
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
        return DOP853(equations, state.t, _coordinates(state), settings.t_end, **options), 1, 0
    arrays, base = state.memory.arrays, equations.W.base.copy()
    step = float(arrays["step"][0])
    options["first_step"] = min(step, settings.t_end - state.t)
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
        text = f"dop853 failed at t = {solver.t:.9g} s: {message}"
        hint = "The motion is too stiff for it: use generalized-alpha."
        raise equations.broken or SolverError(text, hint=hint)
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


def _coordinates(state: State) -> Array:
    """What is integrated: coordinates, velocities, and the works from here on."""
    return np.concatenate([state.q, state.v, np.zeros(3)])


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


def first_steps(record: Record, W: Work, step: Step) -> tuple[Array, tuple[Array, ...]]:
    """Take the steps before a multistep formula can begin, and give T its past.

    A formula of order k needs k instants before it may step. Radau IIA finds them to far more
    digits than the steps will keep, stiff bodies included. Returns their times and rows of q, v,
    vd, lam, work and base; refuses a run that has fewer steps.
    """
    start, count = record.final, step.past.shape[1]
    if count > record.settings.steps:
        text = f"bdf of order {count + 1} needs {count} steps to begin with, the run has"
        raise ConfigError(f"{text} {record.settings.steps}; take shorter steps or a lower order.")
    t = record.settings.time(np.arange(count + 1))
    equations = Equations(record, W, start)
    W.base[:] = start.base
    past = [_instant(record, equations, t[0], _coordinates(start))]
    if count:
        options = {"method": "Radau", "rtol": RADAU_RTOL, "atol": RADAU_ATOL, "t_eval": t[1:]}
        found = solve_ivp(equations, (t[0], t[-1]), _coordinates(past[0][0]), **options)
        if not found.success:
            text = f"the first steps failed after t = {t[0]:.9g} s: {found.message}"
            raise SolverError(text, hint="Take bdf of order two, or generalized-alpha.")
        ends = zip(t[1:].tolist(), found.y.T, strict=True)
        past += [_instant(record, equations, x, y) for x, y in ends]
    states, works = zip(*past, strict=True)
    _remember(record, W, step, states, works[-1])
    rows = [[getattr(x, name) for x in states[1:]] for name in ("q", "v", "a", "lam")]
    rows += [list(works[1:]), [x.base for x in states[1:]]]
    return t[1:], tuple(np.array(x) for x in rows)


def _instant(record: Record, equations: Equations, t: float, y: Array) -> tuple[State, Array]:
    """The state that fits the constraints at a time, and the works up to there."""
    packed, n_q, n = record.packed, equations.n_q, equations.n
    equations(t, _unit(record, y))
    q = assembled(packed, equations.W, y[:n_q])
    v = fitting_velocity(packed, equations.W, q, y[n_q : n_q + n])
    y = np.concatenate([q, v, y[-3:]])
    equations(t, y, accepted=True)
    return _state_of(equations, t, y), y[-3:]


def _remember(record: Record, W: Work, step: Step, states: Sequence[State], work: Array) -> None:
    """Let T stand at the last state and know the ones before it."""
    now = states[-1]
    for name, x in (("q", now.q), ("v", now.v), ("vd", now.a), ("lam", now.lam), ("work", work)):
        getattr(step, name)[:] = x
    step.lost[:] = W.power
    step.count[STEPS] = len(states) - 1
    for j, state in enumerate(states[-2::-1]):
        step.past[0, j], step.past[1, j] = record.packed.apart(now.q, state.q), state.v
