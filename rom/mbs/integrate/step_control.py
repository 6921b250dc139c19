"""Control of the step length, compiled: trial, error, rejection, consistent instant, next length.

The error of a step is the difference x of its increment from the one that follows, with one order
more, from velocities and accelerations at both of its ends: sqrt(x^T M x / mass) over the size of
the mechanism. Errors of velocities have no limit of their own: what they make places drift until
the end is what errors of places per unit of time allow, and vibrations far above the steps, whose
velocities are large beside their amplitudes, would rule all steps. What is saved fits the
constraints in its velocities and accelerations too, which a method of index 3 leaves to its
truncation error: velocities are taken across the constraints to the nearest in kinetic energy.
"""

import math

from rom.mbs.equations.equations import accelerate, evaluate, factorise_motion
from rom.mbs.equations.linear_solve import gradient_times
from rom.mbs.integrate.generalized_alpha import CONVERGED, NEEDS_LAWS, advance, bdf_weights
from rom.mbs.integrate.index2 import least_motion_across, project_velocity
from rom.mbs.kernels import work as entry
from rom.mbs.kernels.algebra import cross, vec
from rom.mbs.kernels.compiled import inner, kernel
from rom.mbs.kernels.coordinates import follow_coordinates
from rom.mbs.kernels.markers import own_block
from rom.mbs.kernels.system import ROLL
from rom.mbs.kernels.tables import Array1, Array2, Array3, Index1, Table, table
from rom.mbs.kernels.work import Step

# what a run stops for, beside what `advance` says: the end of a piece, laws at the instant reached,
# signals at its time, a first step of another length; then three errors
PAUSED, NEEDS_LAWS_THERE, NEEDS_SIGNALS, NEEDS_START = 6, 7, 8, 9
TOO_SHORT, SINGULAR_MOTION, CONTRADICTED = 10, 11, 12
# entries of Control.count
STAGE, NEXT, LIMIT, TAKEN, EVERY, SAVED, REJECTED, UNEVEN, IS_BDF, ROW, KNOWN = range(11)
AT_HAND, ANSWER = 11, 12
# entries of Control.number
TIME, END, LENGTH, BEFORE, WANTED, SHORTEST, LONGEST, DURATION, RTOL, REACHED = range(10)
ERROR_BEFORE, ERROR = 10, 11
# stages of a step
BEGINS, PREPARES, RESETS, TRIES, FITS, PROJECTS, JUDGES, ACCEPTS, CHOOSES, REJECTS = range(10)
# a step is at most so much longer or shorter than the last, and aims below the tolerance
MAX_STEP_GROWTH, MIN_STEP_GROWTH, ERROR_AIM = 2.0, 0.2, 0.8
ERROR_MARGIN = 16.0  # errors of early steps grow on the way to the end
MIN_WORTHWHILE_GROWTH = 1.3  # of a step that justifies a new factorisation
# of the smallest step to the time reached, beside which shorter ones have no digits; at the start,
# where a first step may be as much too long, its square to the duration
MIN_STEP_RATIO = 1e-12
LEAST_ERROR = 1e-6  # that the next length is chosen by
MAX_INTERVAL = 1 << 62  # in steps, of what the method itself is to save: nothing

weights_of_bdf = inner(bdf_weights)  # as `bdf_coefficients` has them


@table
class Control(Table):
    """All that changes from step to step. A second one remembers the beginning of the step."""

    step: Step  # of the method, prepared for the next length
    # the last accepted one: v, a, lam and base are consistent velocities, accelerations,
    # multipliers and followed joint coordinates, parts of it
    instant: Array1
    v: Array1
    a: Array1
    lam: Array1
    base: Array1
    jerk: Array1  # (n,) rate of the accelerations over the last step
    number: Array1  # see the names of its entries
    count: Index1  # likewise
    # in reals and wholes lie all of these, and what the `Work` of the method keeps over a step, but
    # the factor of a whole matrix
    reals: Array1
    wholes: Index1
    lu: Array1  # this factor, by rows
    by_blocks: Index1  # (1,) whether it is not in use
    W_base: Array1  # of this `Work`


@table
class Trial(Table):
    """The instant at the end of the step under way, and the signals ahead."""

    instant: Array1  # this and its parts as in `Control`
    v: Array1
    a: Array1
    lam: Array1
    base: Array1
    times: Array1  # (k,) at which signals are known
    table: Array3  # (k, s, 3) there
    signal: Array3  # (1, s, 3) those of the step; the `Work` of the instant has them and base, too
    rows: Array2  # (k, 1 + n_q + 2 n + m + c + 3) time, coordinates, instants and works to be saved
    none: Array2  # (0, 0) what the method is to save


@kernel
def take_steps(s, W, E, now, back, trial, rank):
    """Take steps until something is to be done outside; says what.

    W is the memory of the method, E that of consistent instants. It goes on where it stopped.
    """
    answer = CONVERGED
    while answer == CONVERGED:
        stage = now.count[STAGE]
        if stage == BEGINS:
            answer = begin_step(now, back)
        elif stage == PREPARES:
            answer = prepare(now)
        elif stage == RESETS:
            answer = reset_across(s, E, now, rank)
        elif stage == TRIES:
            answer = try_step(s, W, now, trial, rank)
        elif stage == FITS:
            answer = fit_instant(s, E, now, back, trial, rank)
        elif stage == PROJECTS:
            answer = project(s, E, now, trial, rank)
        elif stage == JUDGES:
            answer = judge_step(s, E, now, trial, rank)
        elif stage == ACCEPTS:
            answer = accept(now, trial)
        elif stage == CHOOSES:
            answer = choose_length(now)
        else:
            answer = reject(now, back)
    return answer


@inner
def copy(x, out):
    """Write x into out; of one dimension, which compiles in a fraction of the time of any."""
    for i in range(x.size):
        out[i] = x[i]


@inner
def begin_step(now, back):
    """Remember all that a step changes; two equal last steps instead of a tiny one."""
    h, left = now.number[LENGTH], now.number[END] - now.number[TIME]
    if now.count[TAKEN] == now.count[LIMIT] or not left > 0.0:
        return PAUSED
    copy(now.reals, back.reals)
    copy(now.wholes, back.wholes)
    if now.by_blocks[0] == 0:
        copy(now.lu, back.lu)
    now.count[STAGE] = TRIES
    if 2 * h > left:
        ask_for(now, left if 1.001 * h > left else 0.5 * left, TRIES)
    return CONVERGED


@inner
def ask_for(now, h, then):
    """Let the next steps have another length; ``then`` is the stage that follows."""
    now.number[WANTED], now.count[STAGE], now.count[NEXT] = h, PREPARES, then


@inner
def try_step(s, W, now, trial, rank):
    """Take a step of the method."""
    step, number, count = now.step, now.number, now.count
    number[REACHED] = number[TIME] + number[LENGTH]
    if number[LENGTH] >= number[END] - number[TIME]:
        number[REACHED] = number[END]
    if trial.table.shape[1] > 0:
        k = count[ROW]
        if k >= count[KNOWN] or trial.times[k] != number[REACHED]:
            return NEEDS_SIGNALS
        for i in range(W.signal.shape[0]):
            copy(trial.table[k, i], trial.signal[0, i])
    step.count[entry.STEPS_BEFORE] = step.count[entry.STEPS]
    x = trial.none
    count[ANSWER] = advance(s, W, step, rank, trial.signal, MAX_INTERVAL, (x, x, x, x, x, x))
    if count[ANSWER] == NEEDS_LAWS:
        return NEEDS_LAWS
    number[ERROR] = math.inf
    count[STAGE] = FITS if count[ANSWER] == CONVERGED else REJECTS
    return CONVERGED


@inner
def fit_instant(s, E, now, back, trial, rank):
    """Velocities that fit at the end of the step."""
    step = now.step
    copy(back.W_base, E.base)
    copy(step.v, trial.v)
    now.count[AT_HAND] = 0
    evaluate(s, E, step.q, trial.v)
    if not factorise_motion(s, E, rank, True):
        return SINGULAR_MOTION
    now.count[STAGE] = PROJECTS
    return CONVERGED


@inner
def project(s, E, now, trial, rank):
    """Take the velocities to the nearest that fit."""
    if not project_velocity(s, E, rank, trial.v):
        return CONTRADICTED
    evaluate(s, E, now.step.q, trial.v)
    now.count[STAGE] = JUDGES
    return NEEDS_LAWS_THERE if now.step.count[entry.USES_LAWS] == 1 else CONVERGED


@inner
def judge_step(s, E, now, trial, rank):
    """Accelerations that fit; the error, relative to the size, over what it may be."""
    step, number, h = now.step, now.number, now.number[LENGTH]
    accelerate(s, E, step.q, trial.v, trial.a, trial.lam, rank)
    follow_coordinates(E)
    increment(s, h, now, trial, E.delta)
    for i in range(step.psi.size):
        E.delta[i] -= step.psi[i]
    missed = squared(s, E) / step.size[3]
    number[ERROR], now.count[STAGE] = math.inf, REJECTS
    if math.isfinite(missed):
        allowed = number[RTOL] * step.size[1] * h / number[DURATION]
        number[ERROR] = ERROR_MARGIN * math.sqrt(missed) / allowed
        now.count[STAGE] = ACCEPTS if number[ERROR] <= 1.0 else REJECTS
    return CONVERGED


@inner
def squared(s, E):
    """Square x^T M x of a difference in E.delta; E.S has the mass matrix."""
    total = 0.0
    for b in range(s.bodies.mass.size):
        at, own = s.bodies.v_at[b], own_block(s, b, E.S)
        for i in range(own.shape[0]):
            for j in range(own.shape[0]):
                total += own[i, j] * E.delta[at + i] * E.delta[at + j]
    return total


@inner
def increment(s, h, left, right, out):
    """Increment of a step from velocities and accelerations at its ends, to fourth order.

    The rotation vector that belongs to angular velocities has the term of Magnus besides.
    """
    for i in range(out.size):
        out[i] = h * left.v[i] + h**2 / 6 * (2 * left.a[i] + right.a[i])
    for t in s.bodies.v_at:
        magnus = cross(vec(left.v, t + 3), vec(right.v, t + 3))
        for p in range(3):
            out[t + 3 + p] += h**2 / 12 * magnus[p]


@inner
def accept(now, trial):
    """Go on from the new instant, and save it if it is its turn."""
    number, count, h = now.number, now.count, now.number[LENGTH]
    for i in range(now.jerk.size):
        now.jerk[i] = (trial.a[i] - now.a[i]) / h
    copy(trial.instant, now.instant)
    number[TIME], number[BEFORE] = number[REACHED], h
    number[SHORTEST], number[LONGEST] = min(number[SHORTEST], h), max(number[LONGEST], h)
    count[TAKEN], count[ROW], count[AT_HAND] = count[TAKEN] + 1, count[ROW] + 1, 1
    if now.step.count[entry.STEPS] % count[EVERY] == 0:
        save(now, trial.rows[count[SAVED]])
        count[SAVED] += 1
    count[STAGE] = CHOOSES
    return CONVERGED


@inner
def save(now, out):
    """Write time, coordinates, instant and work into one row."""
    out[0], n_q, k = now.number[TIME], now.step.q.size, now.instant.size
    for i in range(n_q):
        out[1 + i] = now.step.q[i]
    for i in range(k):
        out[1 + n_q + i] = now.instant[i]
    for i in range(3):
        out[1 + n_q + k + i] = now.step.work[i]


@inner
def choose_length(now):
    """Ask for the length that the error allows, if that is worth it."""
    number, count = now.number, now.count
    count[STAGE] = BEGINS
    error = max(number[ERROR], number[ERROR_BEFORE], LEAST_ERROR)
    number[ERROR_BEFORE] = number[ERROR]
    factor = min(ERROR_AIM / math.sqrt(error), MAX_STEP_GROWTH)
    if number[TIME] >= number[END]:
        return CONVERGED
    if factor > MIN_WORTHWHILE_GROWTH or factor < ERROR_AIM:
        ask_for(now, factor * number[LENGTH], BEGINS)
    elif count[IS_BDF] == 1 and count[UNEVEN] == 1:
        ask_for(now, number[LENGTH], BEGINS)
    return CONVERGED


@inner
def reject(now, back):
    """Go back to where the step began and ask for a shorter one."""
    step, number, count = now.step, now.number, now.count
    h, error = number[LENGTH], number[ERROR]
    iterations, factorisations = step.count[entry.ITERATIONS], step.count[entry.FACTORISATIONS]
    answer, row, known, rejected = count[ANSWER], count[ROW], count[KNOWN], count[REJECTED]
    copy(back.reals, now.reals)
    copy(back.wholes, now.wholes)
    step.count[entry.ITERATIONS], step.count[entry.FACTORISATIONS] = iterations, factorisations
    count[ANSWER], count[ROW], count[KNOWN], count[REJECTED] = answer, row, known, rejected + 1
    number[ERROR], number[ERROR_BEFORE], count[AT_HAND] = error, 1.0, 0  # no growth at once
    ask_for(now, h * max(MIN_STEP_GROWTH, ERROR_AIM / math.sqrt(error)), TRIES)
    least = MIN_STEP_RATIO * max(abs(number[TIME]), MIN_STEP_RATIO * number[DURATION])
    return TOO_SHORT if number[WANTED] < least else CONVERGED


@inner
def prepare(now):
    """Let the next step have the length that is asked for."""
    step, number, count = now.step, now.number, now.count
    h, lag = number[WANTED], step.method[3] - step.method[4]
    if step.count[entry.STEPS] == 0:
        return NEEDS_START
    if count[IS_BDF] == 1:
        c0, c1, c2 = weights_of_bdf(h, number[BEFORE])
        step.bdf[0], step.bdf[1], step.bdf[2] = c0, c1, c2
        step.method[0], step.method[1], step.method[2] = h, 1 / (c0 * h) ** 2, 1 / (c0 * h)
        count[UNEVEN] = 1 if h != number[BEFORE] else 0
        count[STAGE] = count[NEXT]
    else:
        for i in range(step.a.size):
            step.a[i] += lag * (h - number[LENGTH]) * now.jerk[i]
        step.method[0] = h
        count[STAGE] = RESETS
    number[LENGTH], step.count[entry.HAS_FACTOR] = h, 0
    return CONVERGED


@inner
def reset_across(s, E, now, rank):
    """Begin anew across the constraints, where another length of steps would excite them."""
    step = now.step
    if now.count[AT_HAND] == 0:
        evaluate(s, E, step.q, now.v)
        if not factorise_motion(s, E, rank, True):
            return SINGULAR_MOTION
        now.count[AT_HAND] = 1
    for level, x in enumerate((step.v, step.a, step.vd)):
        wanted(s, now, level, E.delta)
        for i in range(x.size):
            E.delta[i] -= x[i]
        gradient_times(s, E, E.delta, False, E.part)
        for k in range(E.part.size):
            if s.rows.kind[k] == ROLL:  # velocities across these are zero already
                E.part[k] = 0.0
        least_motion_across(s, E, rank, E.delta)
        for i in range(x.size):
            x[i] += E.delta[i]
    now.count[STAGE] = now.count[NEXT]
    return CONVERGED


@inner
def wanted(s, now, level, out):
    """Velocities, algorithmic and true accelerations that the method itself would come to."""
    h, beta, _, alpha_m, alpha_f = now.step.method
    lag = alpha_m - alpha_f
    if level > 0:
        for i in range(out.size):
            out[i] = now.a[i] + (lag * h * now.jerk[i] if level == 1 else 0.0)
        return
    ahead = 0.0 if now.step.count[entry.BOTH_LEVELS] == 1 else h**2
    for i in range(out.size):
        out[i] = now.v[i] + ahead * (1 / 6 - beta - 0.5 * lag) * now.jerk[i]
    for t in s.bodies.v_at:
        turn = cross(vec(now.v, t + 3), vec(now.a, t + 3))
        for p in range(3):
            out[t + 3 + p] += ahead / 12 * turn[p]
