"""Generalised-alpha on R^3 x SO(3) x R^r, constraints on position level (index 3).

BDF shares its steps. Stabilised, both keep the constraints of the velocities too (index 2).

Source:
    Bruels, Cardona, Arnold, Lie group generalized-alpha time integration of constrained flexible
    multibody systems, Mech. Mach. Theory 48 (2012) 121. Scaling of the multipliers: Bottasso,
    Bauchau, Cardona, SIAM J. Sci. Comput. 29 (2007) 397.
"""

import math

import numpy as np
from numba import types

from rom.mbs.equations.equations import (
    accelerate,
    drive_power,
    evaluate,
    factorise_motion,
    least_multipliers,
    load_columns,
    residual,
    retract,
    tangents,
)
from rom.mbs.equations.linear_solve import (
    border,
    constraint_range,
    factorise_bordered,
    solve_bordered,
)
from rom.mbs.equations.renewal import add_renewed, keep_pair_tangents, renew_pair_tangents
from rom.mbs.integrate.bdf import follow_increment, is_multistep, keep_past, predict_multistep
from rom.mbs.integrate.index2 import close_gaps, fit_velocities, velocity_gaps
from rom.mbs.kernels import work as entry
from rom.mbs.kernels.algebra import dot, row, scale, spatial_tangent, unit, vec
from rom.mbs.kernels.compiled import copy, inner, kernel
from rom.mbs.kernels.constraints import constraint_gradient
from rom.mbs.kernels.coordinates import follow_coordinates
from rom.mbs.kernels.markers import own_corner
from rom.mbs.kernels.stages import REAL_MATRIX, stage
from rom.mbs.kernels.system import ALONG, DISTANCE, POINT, ROLL, TOUCH, System
from rom.mbs.kernels.tables import Array3, Table, table
from rom.mbs.kernels.work import Step, Work
from rom.model import Array

# corrections in which a step ends with a fresh factorisation; where films are renewed in a large
# matrix an old one is worth some more, as a correction grows with a lower power of the size
FEW_CORRECTIONS, CORRECTION_SIZE = 4, 60
# what a corrector pass says
UNFINISHED, CONVERGED, FAILED, NOT_FINITE, SINGULAR, NEEDS_LAWS = 0, 1, 2, 3, 4, 5
NEVER = 2**62  # steps between two that are saved
MAX_PASSES = 25
# passes behind these, in which a correction is halved as long as it leaves forces and gaps more out
# of balance than before: where friction turns round, and teeth, stops or films come and go, whole
# ones go round in a circle. Share of what they promise by which they have to improve it
MAX_CAUTIOUS_PASSES, BALANCE_SHARE = 35, 1e-4
MAX_HALVINGS = 24  # of a correction, from the size of a mechanism down to an oil film
ROUND_OFF = 4e-16
# share of the round-off of positions that increments are brought to: velocities and accelerations
# feel an increment over the step and over its square, and their errors add up to momentum
INCREMENT_SHARE = 1e-3
# gap in a joint, in rad or lengths of the mechanism, that may remain: the norm of increments hardly
# sees a light body that spins fast
JOINT_GAP_TOL = 1e-11
# of `advance`: signals by step, and the arrays of instants to be saved
SIGNALS, ROWS = types.Array(types.float64, 3, "C"), types.UniTuple(REAL_MATRIX, 6)


def coefficients(h: float, rho_inf: float) -> Array:
    """(5,) h, beta, gamma, alpha_m, alpha_f of the method with spectral radius rho_inf."""
    alpha_m, alpha_f = (2 * rho_inf - 1) / (rho_inf + 1), rho_inf / (rho_inf + 1)
    gamma = 0.5 + alpha_f - alpha_m
    return np.array([h, 0.25 * (gamma + 0.5) ** 2, gamma, alpha_m, alpha_f])


def bdf_coefficients(h: float, before: float) -> tuple[Array, Array]:
    """(5,) and (3,) method and weights of BDF after a step of length ``before``.

    The order is two, or one if there was no step before (0). The five numbers make an increment
    move velocities and accelerations as the weights do.
    """
    weights = np.array(bdf_weights(h, before))
    c0h = weights[0] * h
    return np.array([h, 1 / c0h**2, 1 / c0h, 0.0, 0.0]), weights


def bdf_weights(h: float, before: float) -> tuple[float, float, float]:
    """The weights of `bdf_coefficients`; the adaptive steps compile them too."""
    r = h / before if before else 0.0
    return (1 + 2 * r) / (1 + r) / h, -(1 + r) / h, r * r / (1 + r) / h


@inner
def predict(s, step):
    """Trial state with the accelerations and multipliers of the last step."""
    h, beta, gamma, alpha_m, _ = step.method
    c0, c1, c2 = step.bdf[0], step.bdf[1], step.bdf[-1]
    for i in range(0 if is_multistep(step) else step.v.size):
        step.vd1[i] = step.vd[i]
        if c0 > 0.0:
            step.v1[i] = (step.vd[i] - c1 * step.v[i] - c2 * step.a[i]) / c0
            step.psi[i] = (step.v1[i] + c2 * step.psi[i]) / c0
        else:
            a1 = (step.vd[i] - alpha_m * step.a[i]) / (1 - alpha_m)
            step.v1[i] = step.v[i] + h * ((1 - gamma) * step.a[i] + gamma * a1)
            step.psi[i] = h * step.v[i] + h * h * ((0.5 - beta) * step.a[i] + beta * a1)
    step.drift[:] = 0.0
    if is_multistep(step):
        predict_multistep(s, step)
    copy(step.lam, step.lam1)
    step.size[0] = step.size[4] = 0.0
    few = FEW_CORRECTIONS + (step.v.size // CORRECTION_SIZE if s.renewed.shape[0] > 0 else 0)
    if step.count[entry.LAST_ITERATIONS] > few:  # it begins with a new factorisation
        step.count[entry.HAS_FACTOR] = 0
    retract(s, step.q, step.psi, step.q1)


@inner
def turn_columns(s, W, step, rank):
    """Add Kt to S and turn UGT, rotations counted in increments of the rotation vector psi."""
    bodies, graph = s.bodies, s.graph
    for b in range(bodies.mass.size):
        for e in range(graph.first[b], graph.first[b + 1]):
            first = graph.x[e]
            psi = vec(step.psi, bodies.v_at[graph.other[e]] + 3)
            turn_rows(W.Kt, first, first + 6 + bodies.r[b], graph.y[e] + 3, psi)
        if not graph.compact:
            turn_rows(W.UGT, 0, rank, bodies.v_at[b] + 3, vec(step.psi, bodies.v_at[b] + 3))
    for k in range(rank if graph.compact else 0):
        for p in range(4):
            if graph.body[k, p] >= 0:
                psi = vec(step.psi, bodies.v_at[graph.body[k, p]] + 3)
                turn_rows(W.UGT, k, k + 1, graph.at[k, p] + 3, psi)
    for i in range(W.S.shape[0]):
        for j in range(W.S.shape[1]):
            W.S[i, j] += W.Kt[i, j]


@inner
def turn_rows(A, first, last, at, psi):
    """Count three columns of some rows of A in increments of the rotation vector psi."""
    back = scale(-1.0, psi)
    x = spatial_tangent(back, unit(0))
    y = spatial_tangent(back, unit(1))
    z = spatial_tangent(back, unit(2))
    for i in range(first, last):
        k = row(A, i, at)
        A[i, at], A[i, at + 1], A[i, at + 2] = dot(k, x), dot(k, y), dot(k, z)


@inner
def factorise_step(s, W, step, rank):
    """Factorise beta h^2 (M beta' + C gamma' + K), bordered; `tangents` first."""
    for b in range(s.bodies.mass.size):
        x, y = own_corner(s, b)
        for i in range(6 + s.bodies.r[b]):
            # what grows with speed as fast as inertia, or a moment of inertia that falls within a
            # step, leaves it negative; a length has no imaginary parts
            size = abs(W.S[x + i, y + i])
            W.weight[s.bodies.v_at[b] + i] = size / (mass_factor(step) * step.size[3])
    if rank < step.lam.size:
        constraint_range(s, W, rank, W.U_lu)
    border(W, rank)
    turn_columns(s, W, step, rank)
    load_columns(s, W, step.lam1, rank)
    step.count[entry.FACTORISATIONS] += 1
    step.count[entry.HAS_FACTOR], step.count[entry.FACTOR_USES] = 1, 0
    return factorise_bordered(s, W, rank)


@inner
def has_matrix(s, W, step, rank, c):
    """Renew the matrix at hand, or factorise a new one; False when it is singular."""
    if step.count[entry.HAS_FACTOR] == 1 and s.renewed.shape[0] > 0:
        step.count[entry.HAS_FACTOR] = 1 if renew_pair_tangents(s, W, c[2], c[1], rank) else 0
    if step.count[entry.HAS_FACTOR] == 1:
        return True
    tangents(s, W, step.v1, step.vd1, step.lam1, c)
    constraint_gradient(s, W)
    found = factorise_step(s, W, step, rank)
    if s.renewed.shape[0] > 0:
        keep_pair_tangents(s, W, c[2], c[1])
    return found


@inner
def mass_factor(step):
    """Derivative of beta h^2 times the acceleration by the increment."""
    return (1 - step.method[3]) / (1 - step.method[4])


@inner
def increment_norm(W, step):
    """Mass-weighted length of the increment, relative to the size of the mechanism."""
    total = 0.0
    for i in range(W.delta.size):
        total += W.weight[i] * W.delta[i] ** 2
    return math.sqrt(total) / step.size[1]


@inner
def increment_goal(W, step):
    """Increment that no longer matters: a share of what accelerations move, and the round-off."""
    total, reach, h = 0.0, 0.0, step.method[0]
    for i in range(step.vd1.size):
        total += W.weight[i] * step.vd1[i] ** 2
    for i in range(step.q1.size):
        reach = max(reach, abs(step.q1[i]))
    floor = ROUND_OFF * (1.0 + reach / step.size[1])
    return max(
        step.size[2] * h * h * math.sqrt(total) / step.size[1], INCREMENT_SHARE * floor
    ), floor


@inner
def correct(s, W, step, rank):
    """One Newton correction for the residual at hand; says how it went."""
    h, beta, gamma, _, _ = step.method
    n, bh2, lead = step.v.size, beta * h * h, beta * h / gamma
    if step.count[entry.STEP_PASSES] >= MAX_PASSES:
        step.size[5] = imbalance(s, W, step)
    for i in range(n):
        W.rhs[i] = -bh2 * W.residual[i]
    if step.count[entry.BOTH_LEVELS] == 1:
        velocity_gaps(s, W, W.part)
    gap = 0.0
    for k in range(step.lam.size):
        gap = max(gap, row_gap(s, W, step, k))
        # a velocity moves gamma / (beta h) as fast as the increment that removes it
        if step.count[entry.BOTH_LEVELS] == 1:
            W.part[k] *= -lead
        else:
            W.part[k] = -W.value[k] * (lead if s.rows.kind[k] == ROLL else 1.0)
    solve_bordered(s, W, rank, W.delta, W.dlam)
    if s.renewed.shape[0] > 0 and step.count[entry.FACTOR_USES] > 0:
        add_renewed(s, W, W.delta, W.dlam)
    step.count[entry.FACTOR_USES] += 1
    for i in range(n):
        step.vd1[i] += mass_factor(step) / bh2 * W.delta[i]
        step.v1[i] += gamma / (beta * h) * W.delta[i]
        step.psi[i] += W.delta[i]
    for k in range(step.lam.size):
        step.lam1[k] += W.dlam[k] / bh2
    size = increment_norm(W, step)
    if step.count[entry.BOTH_LEVELS] == 1:
        close_gaps(s, W, rank, lead)
        size += increment_norm(W, step)
        for i in range(n):
            step.psi[i] += W.delta[i]
            step.drift[i] += W.delta[i]
    if is_multistep(step):
        follow_increment(s, step)
    retract(s, step.q, step.psi, step.q1)
    step.count[entry.STEP_PASSES] += 1
    step.count[entry.ITERATIONS] += 1
    return verdict(W, step, size, gap)


@inner
def may_halve(step):
    """Whether the last correction, or the prediction, is at hand and can be shortened."""
    return step.count[entry.BOTH_LEVELS] == 0 and step.count[entry.HALVINGS] < MAX_HALVINGS


@inner
def imbalance(s, W, step):
    """Increment of free masses under the forces left over, and the largest gap, both relative."""
    total, gap, bh2 = 0.0, 0.0, step.method[1] * step.method[0] ** 2
    for i in range(W.residual.size):
        if W.weight[i] > 0.0:
            total += W.residual[i] ** 2 / W.weight[i]
    for k in range(step.lam.size):
        gap = max(gap, row_gap(s, W, step, k))
    return bh2 * math.sqrt(total) / (mass_factor(step) * step.size[3] * step.size[1]) + gap


@inner
def overshoots(s, W, step):
    """Whether one correction more than usual left more out of balance than it found.

    Source:
        Armijo, Pacific J. Math. 16 (1966) 1.
    """
    if step.count[entry.STEP_PASSES] <= MAX_PASSES:
        return False
    part = 0.5 ** step.count[entry.HALVINGS]
    return imbalance(s, W, step) > (1.0 - BALANCE_SHARE * part) * step.size[5]


@inner
def all_finite(x):
    """Whether no entry is infinite or NaN."""
    for i in range(x.size):
        if not math.isfinite(x[i]):
            return False
    return True


@inner
def halve_correction(s, W, step):
    """Take half of the last correction back, or of what was predicted beyond the velocity.

    It led where forces have no value, as through an oil film, or are farther from balance.
    """
    h, beta, gamma, _, _ = step.method
    if step.count[entry.STEP_PASSES] == 0 and step.count[entry.HALVINGS] == 0:
        W.dlam[:] = 0.0
        for i in range(step.v.size):
            W.delta[i] = step.psi[i] - h * step.v[i]
    for i in range(step.v.size):
        W.delta[i] *= 0.5
        step.vd1[i] -= mass_factor(step) / (beta * h * h) * W.delta[i]
        step.v1[i] -= gamma / (beta * h) * W.delta[i]
        step.psi[i] -= W.delta[i]
    for k in range(step.lam.size):
        W.dlam[k] *= 0.5
        step.lam1[k] -= W.dlam[k] / (beta * h * h)
    step.count[entry.HALVINGS] += 1
    step.count[entry.HAS_FACTOR] = 0
    if is_multistep(step):
        follow_increment(s, step)
    retract(s, step.q, step.psi, step.q1)


@inner
def row_gap(s, W, step, k):
    """Gap of constraint k as far as increments close it, in rad or lengths of the mechanism."""
    kind = s.rows.kind[k]
    if step.count[entry.BOTH_LEVELS] == 1 or kind == ROLL:
        return 0.0
    is_length = kind in (POINT, ALONG, DISTANCE, TOUCH)
    return abs(W.value[k]) / (step.size[1] if is_length else 1.0)


@inner
def verdict(W, step, size, gap):
    """Judge the increment just applied by its size and by how fast increments and gaps shrink."""
    last, wider = step.size[0], step.size[4]
    step.size[0], step.size[4] = size, gap
    if not math.isfinite(size):
        return NOT_FINITE
    goal, floor = increment_goal(W, step)
    shrink = size / last if last > 0.0 else 1.0
    closed = gap * min(1.0, gap / wider if wider > 0.0 else 1.0) <= JOINT_GAP_TOL
    closing = shrink < 1.0 and size * shrink / (1.0 - shrink) <= goal
    if size <= INCREMENT_SHARE * floor or (closing and closed):
        return CONVERGED
    if shrink > 0.5 and size < 100 * floor and step.count[entry.STEP_PASSES] > 3:
        return CONVERGED
    most = MAX_PASSES + (MAX_CAUTIOUS_PASSES if may_halve(step) else 0)
    if step.count[entry.STEP_PASSES] >= most:
        return FAILED
    if (last > 0.0 and shrink > 0.2) or step.count[entry.STEP_PASSES] >= MAX_PASSES:
        step.count[entry.HAS_FACTOR] = 0
    return UNFINISHED


@inner
def accept(s, W, step, rank):
    """Make the trial state the present one, multipliers of least norm, and add up the work."""
    h, _, _, alpha_m, alpha_f = step.method
    if step.count[entry.BOTH_LEVELS] == 1:
        fit_velocities(s, W, step, rank)
    if is_multistep(step):
        keep_past(s, step)
    for i in range(step.v.size):
        rate = (1 - alpha_f) * step.vd1[i] + alpha_f * step.vd[i]
        step.a[i] = step.v[i] if step.bdf[0] > 0.0 else (rate - alpha_m * step.a[i]) / (1 - alpha_m)
    copy(step.q1, step.q)
    copy(step.v1, step.v)
    copy(step.vd1, step.vd)
    copy(step.lam1, step.lam)
    if rank < step.lam.size or s.graph.shares != 0:
        constraint_gradient(s, W)
        least_multipliers(s, W, rank, step.lam)
        step.count[entry.HAS_FACTOR] *= 1 - s.graph.shares
    follow_coordinates(W)
    drive_power(s, W, step.lam)  # the last correction moved the multipliers
    for k in range(3):
        step.work[k] += 0.5 * h * (W.power[k] + step.lost[k])
        step.lost[k] = W.power[k]
    step.count[entry.STEPS] += 1
    step.count[entry.LAST_ITERATIONS] = step.count[entry.STEP_PASSES]
    step.count[entry.STEP_PASSES] = 0


@stage(
    types.int64, System, Work, Step, types.int64, SIGNALS, types.int64, ROWS, needed=lambda _: False
)
def advance(s, W, step, rank, signals, every, out):
    """Take one step per row of ``signals``; save every so many. Says how the last one went.

    ``out`` holds arrays for q, v, vd, lam, work and base with one row per saved instant. When
    forces of Python functions are to be asked for, step.count[USES_LAWS] is 1: then it returns
    NEEDS_LAWS with everything evaluated, and goes on from there in the next call, which has the
    same arguments. Whoever calls it links it first.
    """
    h, beta, gamma, _, _ = step.method
    c = (mass_factor(step), gamma * h, beta * h * h)
    while step.count[entry.STEPS] - step.count[entry.STEPS_BEFORE] < signals.shape[0]:
        if step.count[entry.LAWS_ASKED] == 0:
            if step.count[entry.STEP_PASSES] + step.count[entry.HALVINGS] == 0:
                copy(signals[step.count[entry.STEPS] - step.count[entry.STEPS_BEFORE]], W.signal)
                predict(s, step)
            evaluate(s, W, step.q1, step.v1)
            if step.count[entry.USES_LAWS] == 1:
                step.count[entry.LAWS_ASKED] = 1
                return NEEDS_LAWS
        step.count[entry.LAWS_ASKED] = 0
        residual(s, W, step.q1, step.v1, step.vd1, step.lam1)
        if not all_finite(W.residual) or overshoots(s, W, step):
            if may_halve(step):
                halve_correction(s, W, step)
                continue
            if step.count[entry.STEP_PASSES] > MAX_PASSES:
                return FAILED
        step.count[entry.HALVINGS] = 0
        if not has_matrix(s, W, step, rank, c):
            return SINGULAR
        answer = correct(s, W, step, rank)
        if answer > CONVERGED:
            return answer
        if answer == CONVERGED:
            accept(s, W, step, rank)
            done, before = step.count[entry.STEPS], step.count[entry.STEPS_BEFORE]
            if done % every == 0:
                save(W, step, out, done // every - before // every - 1)
    return CONVERGED


@inner
def save(W, step, out, at):
    """Copy the present state to a row of the output arrays."""
    Q, V, A, L, X, B = out
    copy(W.base, B[at])
    copy(step.q, Q[at])
    copy(step.v, V[at])
    copy(step.vd, A[at])
    copy(step.lam, L[at])
    copy(step.work, X[at])


@table
class Moved(Table):
    """What `go_on` moves, and sees: one table, for each is a cost of a call from Python."""

    s: System
    W: Work
    step: Step
    seen: System
    S: Work  # of what is seen
    signals: Array3  # of the next steps
    rank: int  # of the constraints that are solved


@kernel
def go_on(moved, at, n, jumps):
    """Take n steps by the signals from a row on, and evaluate at their end; answers as `advance`.

    Before them, where inputs jump, to which S belongs, accelerations and multipliers do so too.
    """
    s, W, step, S, rank = moved.s, moved.W, moved.step, moved.S, moved.rank
    if step.count[entry.LAWS_ASKED] == 0:
        step.count[entry.STEPS_BEFORE] = step.count[entry.STEPS]
        if jumps:
            if not factorise_motion(s, S, rank, True):
                return SINGULAR
            accelerate(s, S, step.q, step.v, step.vd1, step.lam, rank)
            for i in range(step.a.size):
                step.a[i] += step.vd1[i] - step.vd[i]
            copy(step.vd1, step.vd)
            copy(S.power, step.lost)
    nowhere = (W.S, W.S, W.S, W.S, W.S, W.S)  # nothing is saved
    answer = advance(s, W, step, rank, moved.signals[at : at + n], NEVER, nowhere)
    if answer == CONVERGED and n > 0:
        copy(moved.signals[at + n - 1], S.signal)
        copy(W.base, S.base)
        evaluate(moved.seen, S, step.q, step.v)
    return answer
