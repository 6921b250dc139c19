"""Step memory of the implicit methods at the start of a run."""

from dataclasses import replace

import numpy as np

from rom.mbs import alpha
from rom.mbs.alpha import Step
from rom.mbs.arrays import ROLL, Work
from rom.mbs.motion import evaluate, linearise, moved
from rom.mbs.record import Record
from rom.mbs.signals import sample_all
from rom.mbs.state import State, with_accelerations
from rom.mbs.user import Law, apply_laws
from rom.model import Array


def begin(record: Record, W: Work, state: State, forces: tuple[Law, ...]) -> tuple[Step, State]:
    """Step memory at the start, accelerations consistent to second order."""
    packed, settings = record.packed, record.settings
    n, m = state.v.size, state.lam.size
    v = state.v
    if state.algorithmic is None:
        state, v = _measured(record, W, state, forces)
    else:
        W.base[:] = state.base
    zeros = [np.zeros(k) for k in (state.q.size, n, n, m, n)]
    size = np.array([0.0, packed.length, settings.tolerance, packed.mass])
    copies = (x.copy() for x in (state.q, v, state.algorithmic, state.a, state.lam))
    method = alpha.coefficients(settings.h, settings.rho_inf)
    count, work = np.zeros(9, dtype=np.int64), np.zeros(3)
    count[alpha.ASKS] = bool(forces)
    power = _power(record, W, state, forces)
    return Step(*copies, *zeros, work, power, count, size, method, np.zeros(3)), state


def _power(record: Record, W: Work, state: State, forces: tuple[Law, ...]) -> Array:
    """(3,) powers of drives, forces and dampers at a state."""
    system = record.packed.system
    signals_at(record, W, state.t)
    evaluate(system, W, state.q, state.v)
    apply_laws(forces, W, state.t)
    with_accelerations(record.packed, W, state)
    return W.power.copy()


def signals_at(record: Record, W: Work, t: float) -> None:
    """Set the prescribed functions to their values at a time."""
    span, spacing = record.settings.span, record.settings.spacing
    W.signal[:] = sample_all(record.packed.signals, np.array([t]), span, spacing)[0]


def _measured(
    record: Record, W: Work, state: State, forces: tuple[Law, ...]
) -> tuple[State, Array]:
    """Accelerations at the start, and the velocity to start the method from.

    The algorithmic acceleration belongs to the time t + (alpha_m - alpha_f) h. Together with a
    velocity shifted by a multiple of h^2 across the constraints, as the method itself would have
    it after many steps, the multipliers converge with second order from the first step on.

    Source:
        Arnold, Bruels, Cardona, Error analysis of generalized-alpha Lie group time integration
        methods for constrained mechanical systems, Numer. Math. 129 (2015) 149.
    """
    h = record.settings.h
    _, beta, _, alpha_m, alpha_f = alpha.coefficients(h, record.settings.rho_inf)
    at_rest = np.zeros_like(state.v)
    state = accelerated(record, W, state, forces, 0.0, at_rest)
    probe = 0.02 * h
    jerk = (accelerated(record, W, state, forces, probe, at_rest).a - state.a) / probe
    ahead = accelerated(record, W, state, forces, h, jerk)
    # vibrations that the step does not resolve have no Taylor series over it
    if np.linalg.norm(ahead.a - state.a - h * jerk) > np.linalg.norm(h * jerk):
        return replace(state, algorithmic=state.a.copy()), state.v
    lag = alpha_m - alpha_f
    shift = (1 / 6 - beta - 0.5 * lag) * jerk
    for t in record.packed.system.bodies.v_at:
        shift[t + 3 : t + 6] += np.cross(state.v[t + 3 : t + 6], state.a[t + 3 : t + 6]) / 12
    linearise(record.packed.system, W, state.q, state.v)
    across = W.G @ np.linalg.solve(W.S, W.G.T)
    rolling = record.packed.system.rows.kind == ROLL  # velocities across these are zero already
    y = np.linalg.lstsq(across, np.where(rolling, 0.0, W.G @ shift), rcond=1e-10)[0]
    v = state.v + h**2 * np.linalg.solve(W.S, W.G.T @ y)
    return replace(state, algorithmic=state.a + lag * h * jerk), v


def accelerated(
    record: Record, W: Work, state: State, forces: tuple[Law, ...], shift: float, jerk: Array
) -> State:
    """The state with its accelerations, some time later by its Taylor series."""
    system = record.packed.system
    signals_at(record, W, state.t + shift)
    q = np.empty_like(state.q)
    moved(system, state.q, shift * state.v + shift**2 * (state.a / 2 + shift * jerk / 6), q)
    later = replace(state, q=q, v=state.v + shift * (state.a + shift * jerk / 2))
    evaluate(system, W, later.q, later.v)
    apply_laws(forces, W, state.t + shift)
    return with_accelerations(record.packed, W, later)
