"""Accelerations from the equations of motion, integrated by an explicit method of high order.

Constraints enter on acceleration level; their drift stays at the tolerance of the integrator.
"""

from time import perf_counter

import numpy as np
from scipy.integrate import DOP853

from rom.errors import SolverError
from rom.mbs.arrays import Work
from rom.mbs.motion import evaluate, rates
from rom.mbs.record import Record
from rom.mbs.signals import first_failure, sample_all
from rom.mbs.state import State
from rom.mbs.user import apply_laws, laws
from rom.model import Array


class Equations:
    """The right-hand side for one run; keeps the last accelerations and multipliers."""

    def __init__(self, record: Record, W: Work, state: State):
        self.record, self.W, self.rank = record, W, state.rank
        self.n_q, self.n = state.q.size, state.v.size
        self.a, self.lam = np.zeros(self.n), np.zeros(state.lam.size)
        self.forces = laws(record.mechanism, record.packed)

    def __call__(self, t: float, y: Array, *, accepted: bool = False) -> Array:
        """Rates at time t; ``accepted`` for a state of the motion, not a trial.

        Raises:
            SolverError: if a prescribed function or force is not finite, or the equations are
                singular.
        """
        packed, settings = self.record.packed, self.record.settings
        if packed.signals:
            times = np.array([t])
            table = sample_all(packed.signals, times, settings.span, settings.spacing)
            good, failure = first_failure(
                packed.signals, times, table, settings.span, settings.spacing
            )
            if not good:
                raise failure
            self.W.signal[:] = table[0]
        if self.forces:
            evaluate(packed.system, self.W, y[: self.n_q], y[self.n_q : self.n_q + self.n])
            apply_laws(self.forces, self.W, t)
        out = np.zeros_like(y)
        clock = perf_counter()
        solved = rates(packed.system, self.W, y, self.rank, accepted, self.a, self.lam, out)
        self.record.compiled += perf_counter() - clock
        if not solved or not np.isfinite(out).all():
            raise SolverError(f"the equations of motion are singular at t = {t:.9g} s.")
        return out


def run_explicit(record: Record, W: Work, state: State) -> None:
    """Fill the record by DOP853 of SciPy."""
    settings = record.settings
    W.base[:] = state.base
    equations = Equations(record, W, state)
    y = np.concatenate([state.q, state.v, np.zeros(3)])
    equations(state.t, y, accepted=True)
    record.start(_state_of(equations, state.t, y))
    if record.watch:
        record.watch.begin(state.q, state.v)
    record.clock, record.compiled = perf_counter(), 0.0
    solver = DOP853(equations, state.t, y, settings.t_end, rtol=settings.rtol, atol=settings.atol)
    due, steps = 1, 0
    while solver.status == "running" and not record.stopped:
        message = solver.step()
        if solver.status == "failed":
            raise SolverError(
                f"dop853 failed at t = {solver.t:.9g} s: {message}",
                hint="The motion is too stiff for it: use generalized-alpha.",
            )
        steps += 1
        stop = _first_event(record, equations, solver)
        due = _output(record, equations, solver, due)
        if stop is not None:
            _save(record, equations, stop, solver.dense_output()(stop))
        elif solver.t > record.t:
            equations(solver.t, solver.y, accepted=True)
        record.counts = {"steps": steps, "evaluations": solver.nfev}
        record.show()


def _first_event(record: Record, equations: Equations, solver: DOP853) -> float | None:
    """Time of a terminal event in the last step."""
    if record.watch is None:
        return None
    dense, n_q, n = solver.dense_output(), equations.n_q, equations.n

    def motion(t: float) -> tuple[Array, Array]:
        y = _unit(record, dense(t).copy())
        return y[:n_q], y[n_q : n_q + n]

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
    f = record.final
    record.keep(t, *(x[None].copy() for x in (f.q, f.v, f.a, f.lam, y[-3:], f.base)))


def _state_of(equations: Equations, t: float, y: Array) -> State:
    q, v = y[: equations.n_q], y[equations.n_q : equations.n_q + equations.n]
    copies = (x.copy() for x in (q, v, equations.a, equations.lam))
    return State(t, *copies, equations.rank, None, equations.W.base.copy())
