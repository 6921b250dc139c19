"""Step memory of the implicit methods at the start of a run."""

from dataclasses import replace

import numpy as np

from rom.errors import SolverError
from rom.mbs.elements.family import Laws, apply_laws
from rom.mbs.equations.equations import evaluate, linearize_constraints, retract
from rom.mbs.equations.linear_solve import gradient_times
from rom.mbs.integrate import generalized_alpha as alpha
from rom.mbs.integrate.bdf import multistep_coefficients
from rom.mbs.integrate.consistent_start import factorised, least_motion, with_accelerations
from rom.mbs.integrate.run import Record, Settings
from rom.mbs.kernels import work as entry
from rom.mbs.kernels.stages import link
from rom.mbs.kernels.system import ROLL
from rom.mbs.kernels.work import Step, Work
from rom.mbs.parts.signals import sample_all
from rom.mbs.results.state import Memory, State
from rom.model import Array

# what belongs to the factorised iteration matrix, by blocks or whole
FACTOR_FIELDS = (
    *("by_blocks", "pivot", "scaling", "U_lu", "weight"),
    *("pairs_lu", "approach", "response", "yielding", "has_response"),
)
# counts that say whether it goes on to be used
FACTOR_COUNTS = (entry.LAST_ITERATIONS, entry.HAS_FACTOR, entry.FACTOR_USES)
RUN_COUNTS = (entry.STEPS, entry.ITERATIONS, entry.FACTORISATIONS)  # of a whole run
# of the step itself, and what memories call its algorithmic accelerations
STEP_FIELDS = {name: name for name in ("method", "bdf", "psi", "past", "work", "lost")}
STEP_FIELDS["before"] = "a"


def begin(record: Record, W: Work, state: State, forces: Laws, h: float) -> tuple[Step, State]:
    """Step memory at the start for a first step of length h, consistent to second order.

    Generalised-alpha begins with its acceleration-like variable, BDF with a step before the start
    as the Taylor series has it.
    """
    settings, n = record.settings, state.v.size
    bdf, jerk = settings.method == "bdf" and settings.order == 2, None
    method, weights = _method(settings, h)
    if state.base is not None:
        W.base[:] = state.base
    goes_on = fits(state.memory, method, weights)
    if weights.size != 3 and not goes_on:  # further instants of the start follow
        state = accelerated(record, W, state, forces, 0.0, 0 * state.v)
        state = replace(state, algorithmic=0 * state.v)
    elif not goes_on and (bdf or state.algorithmic is None):
        state, jerk = measured(record, W, state, forces, h)
    zeros = [np.zeros(k) for k in (state.q.size, n, n, state.lam.size, n)]
    size = np.zeros(6)
    size[1:4] = record.packed.length, settings.tolerance, record.packed.mass
    v, before, rise = state.v, state.algorithmic, np.zeros(n) if jerk is None else jerk
    if goes_on:
        before = v
    elif bdf:
        ahead = h**2 * across(record, W, state, shift_ahead(record, state, method, rise))
        before, v = v - h * state.a + h**2 / 2 * rise + ahead, v + ahead
        zeros[4][:] = h * (state.v - h / 2 * state.a + h**2 / 6 * rise)
        for t in record.packed.system.bodies.v_at + 3:  # the term of Magnus
            w, wd = state.v[t : t + 3], state.a[t : t + 3]
            zeros[4][t : t + 3] += h**3 / 12 * np.cross(w, wd)
    elif before is None:
        before = state.a + (method[3] - method[4]) * h * rise
        if jerk is not None:
            v = v + h**2 * across(record, W, state, shift_ahead(record, state, method, jerk))
        state = replace(state, algorithmic=before)
    copies = (x.copy() for x in (state.q, v, before, state.a, state.lam))
    count, work = np.zeros(12, dtype=np.int64), np.zeros(3)
    count[entry.USES_LAWS], count[entry.BOTH_LEVELS] = bool(forces), settings.both
    signals_at(record, W, state.t)
    evaluate(record.packed.system, W, state.q, state.v)
    apply_laws(forces, W, state.t)
    with_accelerations(record.packed, W, state)
    power = W.power.copy()  # of drives, forces and dampers
    past = np.zeros((2, weights.size - 2, n))
    step = Step(*copies, *zeros, work, power, count, size, method, weights, past, np.zeros(n))
    link(step)
    if not goes_on:
        return step, replace(state, memory=None)
    recall(state.memory, W, step)
    if settings.begun:  # counts and works go on from those of a run that was interrupted
        W.base[:], kept = state.base, state.memory.arrays
        step.work[:], step.lost[:] = kept["work"], kept["lost"]
        step.count[list(RUN_COUNTS)] = kept["counts"]
    return step, state


def _method(settings: Settings, h: float) -> tuple[Array, Array]:
    """The five numbers of the method, and its weights if it is BDF."""
    if settings.method != "bdf":
        return alpha.coefficients(h, settings.rho_inf), np.zeros(3)
    order = settings.order
    return alpha.bdf_coefficients(h, h) if order == 2 else multistep_coefficients(h, order)


def shift_ahead(record: Record, state: State, method: Array, jerk: Array) -> Array:
    """Velocity that a method is ahead, over h^2, before it is taken across constraints.

    None if the constraints hold for the velocities too.
    """
    if record.settings.both:
        return 0 * jerk
    _, beta, _, alpha_m, alpha_f = method
    bdf = record.settings.method == "bdf"
    shift = (-1 / 3 if bdf else 1 / 6 - beta - 0.5 * (alpha_m - alpha_f)) * jerk
    for t in record.packed.system.bodies.v_at:
        shift[t + 3 : t + 6] += np.cross(state.v[t + 3 : t + 6], state.a[t + 3 : t + 6]) / 12
    return shift


def across(record: Record, W: Work, state: State, shift: Array) -> Array:
    """The part of a velocity that changes the gaps of the constraints."""
    linearize_constraints(record.packed.system, W, state.q, state.v)
    if record.packed.by_blocks:
        packed, gap = record.packed, np.zeros(W.value.size)
        if not factorised(packed, W, 0.0):
            raise SolverError("the equations of motion are singular where constraints are met.")
        gradient_times(packed.system, W, shift, False, gap)
        return least_motion(packed, W, gap)
    A = W.G @ np.linalg.solve(W.S, W.G.T)
    rolling = record.packed.system.rows.kind == ROLL  # velocities across these are zero already
    y = np.linalg.lstsq(A, np.where(rolling, 0.0, W.G @ shift), rcond=1e-10)[0]
    return np.linalg.solve(W.S, W.G.T @ y)


def remember(settings: Settings, W: Work, step: Step, steps: int) -> Memory:
    """All that the next step depends on and the state does not tell."""
    names = (*FACTOR_FIELDS, "factor" if W.by_blocks[0] else "lu")
    arrays = {name: getattr(W, name).copy() for name in names}
    arrays |= {name: getattr(step, field).copy() for name, field in STEP_FIELDS.items()}
    arrays["count"], arrays["counts"] = (step.count[list(k)] for k in (FACTOR_COUNTS, RUN_COUNTS))
    origin = settings.t_start if settings.origin is None else settings.origin
    return Memory(settings.kind, settings.h, origin, settings.taken + steps, arrays)


def state_of(record: Record, W: Work, step: Step) -> State:
    """The last state with all that the next step depends on."""
    q, v, a, lam = (x.copy() for x in (step.q, step.v, step.vd, step.lam))
    memory = remember(record.settings, W, step, int(step.count[entry.STEPS]))
    before = None if record.settings.method == "bdf" else step.a.copy()
    return State(record.t, q, v, a, lam, record.final.rank, before, W.base.copy(), memory)


def recall(memory: Memory, W: Work, step: Step) -> None:
    """Go on with the factorisation of an earlier run that `fits`."""
    step.a[:], step.psi[:] = memory.arrays["before"], memory.arrays["psi"]
    step.past[:] = memory.arrays.get("past", step.past)
    for name in (*FACTOR_FIELDS, "factor" if memory.arrays["by_blocks"][0] else "lu"):
        getattr(W, name)[:] = memory.arrays[name]
    step.count[list(FACTOR_COUNTS)] = memory.arrays["count"]


def fits(memory: Memory | None, method: Array, weights: Array) -> bool:
    """Whether what is remembered belongs to the same method and step."""
    kept = {} if memory is None else memory.arrays
    wanted = {"method": method, "bdf": weights}
    return all(np.array_equal(kept.get(name, ()), x) for name, x in wanted.items())


def signals_at(record: Record, W: Work, t: float) -> None:
    """Set the prescribed functions to their values at a time."""
    span, spacing = record.settings.span, record.settings.spacing
    W.signal[:] = sample_all(record.packed.signals, np.array([t]), span, spacing)[0]


def measured(
    record: Record, W: Work, state: State, forces: Laws, h: float
) -> tuple[State, Array | None]:
    """Accelerations at a start and their rate; None if a step does not resolve it.

    The algorithmic acceleration of generalised-alpha belongs to the time
    t + (alpha_m - alpha_f) h. Together with a velocity shifted by a multiple of h^2 across the
    constraints, as the method itself would have it after many steps, the multipliers converge
    with second order from the first step on.

    Source:
        Arnold, Bruels, Cardona, Error analysis of generalized-alpha Lie group time integration
        methods for constrained mechanical systems, Numer. Math. 129 (2015) 149.
    """
    at_rest = np.zeros_like(state.v)
    state = accelerated(record, W, state, forces, 0.0, at_rest)
    probe = 0.02 * h
    jerk = (accelerated(record, W, state, forces, probe, at_rest).a - state.a) / probe
    ahead = accelerated(record, W, state, forces, h, jerk)
    # vibrations that the step does not resolve have no Taylor series over it
    if not np.linalg.norm(ahead.a - state.a - h * jerk) <= np.linalg.norm(h * jerk):
        return state, None
    return state, jerk


def accelerated(
    record: Record, W: Work, state: State, forces: Laws, shift: float, jerk: Array
) -> State:
    """The state with its accelerations, some time later by its Taylor series.

    What is remembered stays that of the state: it does not get there.
    """
    system = record.packed.system
    signals_at(record, W, state.t + shift)
    q = np.empty_like(state.q)
    retract(system, state.q, shift * state.v + shift**2 * (state.a / 2 + shift * jerk / 6), q)
    later = replace(state, q=q, v=state.v + shift * (state.a + shift * jerk / 2))
    evaluate(system, W, later.q, later.v)
    apply_laws(forces, W, state.t + shift)
    base = W.base.copy()
    found = with_accelerations(record.packed, W, later)
    if shift:
        W.base[:] = base
    return found
