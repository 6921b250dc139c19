"""Generalised-alpha on R^3 x SO(3) x R^r, constraints on position level (index 3).

BDF shares its steps. Stabilised, both keep the constraints of the velocities too (index 2).

Source:
    Bruels, Cardona, Arnold, Lie group generalized-alpha time integration of constrained flexible
    multibody systems, Mech. Mach. Theory 48 (2012) 121. Scaling of the multipliers: Bottasso,
    Bauchau, Cardona, SIAM J. Sci. Comput. 29 (2007) 397.
"""

import math
from typing import NamedTuple

import numpy as np

from rom.mbs.actions import load_columns
from rom.mbs.algebra import dot, range_basis, row, scale, spatial_tangent, unit, vec
from rom.mbs.arrays import ALONG, DISTANCE, POINT, ROLL, TOUCH
from rom.mbs.bordered import border, factorise_bordered, solve_bordered
from rom.mbs.compiled import copy, inner, kernel
from rom.mbs.constraints import constraint_gradient
from rom.mbs.coordinates import follow_coordinates
from rom.mbs.kinematics import own_block
from rom.mbs.motion import (
    drive_power,
    evaluate,
    least_multipliers,
    moved,
    residual,
    tangents,
)
from rom.mbs.multistep import follow_increment, is_multistep, keep_past, predict_multistep
from rom.mbs.stabilised import close_gaps, fit_velocities, velocity_gaps
from rom.model import Array, Index

# what a corrector pass says
GOES_ON, CONVERGED, FAILED, NOT_FINITE, SINGULAR, ASK = 0, 1, 2, 3, 4, 5
# entries of Step.count
STEPS, ITERATIONS, FACTORISATIONS, LAST, FRESH, PASS, BEGAN, ASKS, ASKED, BOTH = range(10)
MAX_PASSES = 25
ROUND_OFF = 4e-16
# share of the round-off of positions that increments are brought to: velocities and accelerations
# feel an increment over the step and over its square, and their errors add up to momentum
FINER = 1e-3
# gap in a joint, in rad or lengths of the mechanism, that may remain: the norm of increments hardly
# sees a light body that spins fast
GAP = 1e-11


class Step(NamedTuple):
    """State, the trial state of the step under way, and the method.

    Attributes:
        q, v, a, vd, lam: coordinates, velocities, algorithmic and true accelerations,
            multipliers at the last accepted instant.
        q1, v1, vd1, lam1: the trial values; psi: (n,) increment of the step.
        work: (3,) work done since the start, by drives, by applied forces, lost in dampers.
        lost: (3,) the powers at the last accepted instant.
        count: (10,) steps, iterations, factorisations, iterations of the last step, whether a
            factorisation is at hand, pass of the present step, steps when the present chunk
            began, whether Python forces are to be asked for, whether they have been, whether
            constraints hold for positions and velocities both.
        size: (5,) norm of the last increment, length of the mechanism, tolerance, total mass,
            largest gap in a joint before the last increment.
        method: (5,) h, beta, gamma, alpha_m, alpha_f.
        bdf: (order + 1,) weights of the present, last and earlier values in the derivative of
            BDF, three zeros for generalised-alpha. With three weights ``a`` is the last but one
            velocity, and ``psi`` the last increment until the next step begins.
        past: (2, order - 1, n) for BDF of other orders: earlier positions as seen from the last
            accepted instant, see `rom.mbs.multistep`, and velocities.
        drift: (n,) part of the increment of such a step that closes gaps.
    """

    q: Array
    v: Array
    a: Array
    vd: Array
    lam: Array
    q1: Array
    v1: Array
    vd1: Array
    lam1: Array
    psi: Array
    work: Array
    lost: Array
    count: Index
    size: Array
    method: Array
    bdf: Array
    past: Array
    drift: Array


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
    r = h / before if before else 0.0
    weights = np.array([(1 + 2 * r) / (1 + r), -(1 + r), r * r / (1 + r)]) / h
    c0h = weights[0] * h
    return np.array([h, 1 / c0h**2, 1 / c0h, 0.0, 0.0]), weights


@inner
def predict(s, T):
    """Trial state with the accelerations and multipliers of the last step."""
    h, beta, gamma, alpha_m, _ = T.method
    c0, c1, c2 = T.bdf[0], T.bdf[1], T.bdf[-1]
    for i in range(0 if is_multistep(T) else T.v.size):
        T.vd1[i] = T.vd[i]
        if c0 > 0.0:
            T.v1[i] = (T.vd[i] - c1 * T.v[i] - c2 * T.a[i]) / c0
            T.psi[i] = (T.v1[i] + c2 * T.psi[i]) / c0
        else:
            a1 = (T.vd[i] - alpha_m * T.a[i]) / (1 - alpha_m)
            T.v1[i] = T.v[i] + h * ((1 - gamma) * T.a[i] + gamma * a1)
            T.psi[i] = h * T.v[i] + h * h * ((0.5 - beta) * T.a[i] + beta * a1)
    T.drift[:] = 0.0
    if is_multistep(T):
        predict_multistep(s, T)
    copy(T.lam, T.lam1)
    T.size[0] = T.size[4] = 0.0
    if T.count[LAST] > 4:
        T.count[FRESH] = 0
    moved(s, T.q, T.psi, T.q1)


@inner
def turn_columns(s, W, T, rank):
    """Add Kt to S and turn UGT, rotations counted in increments of the rotation vector psi."""
    B, Y = s.bodies, s.graph
    for b in range(B.mass.size):
        for e in range(Y.first[b], Y.first[b + 1]):
            first = Y.x[e]
            psi = vec(T.psi, B.v_at[Y.other[e]] + 3)
            turn_rows(W.Kt, first, first + 6 + B.r[b], Y.y[e] + 3, psi)
        if not Y.compact:
            turn_rows(W.UGT, 0, rank, B.v_at[b] + 3, vec(T.psi, B.v_at[b] + 3))
    for k in range(rank if Y.compact else 0):
        for p in range(4):
            if Y.body[k, p] >= 0:
                psi = vec(T.psi, B.v_at[Y.body[k, p]] + 3)
                turn_rows(W.UGT, k, k + 1, Y.at[k, p] + 3, psi)
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
def factorise_step(s, W, T, rank):
    """Factorise beta h^2 (M beta' + C gamma' + K), bordered; `tangents` first."""
    for b in range(s.bodies.mass.size):
        block = own_block(s, b, W.S)
        for i in range(block.shape[0]):
            W.weight[s.bodies.v_at[b] + i] = block[i, i] / (mass_factor(T) * T.size[3])
    if rank < T.lam.size:
        range_basis(W.G, rank, W.rest, W.U_lu)
    border(W, rank)
    turn_columns(s, W, T, rank)
    load_columns(s, W, T.lam1, rank)
    T.count[FACTORISATIONS] += 1
    T.count[FRESH] = 1
    return factorise_bordered(s, W, rank)


@inner
def mass_factor(T):
    """Derivative of beta h^2 times the acceleration by the increment."""
    return (1 - T.method[3]) / (1 - T.method[4])


@inner
def increment_norm(W, T):
    """Mass-weighted length of the increment, relative to the size of the mechanism."""
    total = 0.0
    for i in range(W.delta.size):
        total += W.weight[i] * W.delta[i] ** 2
    return math.sqrt(total) / T.size[1]


@inner
def increment_goal(W, T):
    """Increment that no longer matters: a fraction of what the acceleration moves in a step.

    And the round-off of the positions.
    """
    total, reach, h = 0.0, 0.0, T.method[0]
    for i in range(T.vd1.size):
        total += W.weight[i] * T.vd1[i] ** 2
    for i in range(T.q1.size):
        reach = max(reach, abs(T.q1[i]))
    floor = ROUND_OFF * (1.0 + reach / T.size[1])
    return max(T.size[2] * h * h * math.sqrt(total) / T.size[1], FINER * floor), floor


@inner
def correct(s, W, T, rank):
    """One Newton correction for the residual at hand; says how it went."""
    h, beta, gamma, _, _ = T.method
    n, bh2, lead = T.v.size, beta * h * h, beta * h / gamma
    for i in range(n):
        W.rhs[i] = -bh2 * W.residual[i]
    if T.count[BOTH] == 1:
        velocity_gaps(s, W, W.part)
    gap = 0.0
    for k in range(T.lam.size):
        gap = max(gap, row_gap(s, W, T, k))
        # a velocity moves gamma / (beta h) as fast as the increment that removes it
        if T.count[BOTH] == 1:
            W.part[k] *= -lead
        else:
            W.part[k] = -W.value[k] * (lead if s.rows.kind[k] == ROLL else 1.0)
    solve_bordered(s, W, rank, W.delta, W.dlam)
    for i in range(n):
        T.vd1[i] += mass_factor(T) / bh2 * W.delta[i]
        T.v1[i] += gamma / (beta * h) * W.delta[i]
        T.psi[i] += W.delta[i]
    for k in range(T.lam.size):
        T.lam1[k] += W.dlam[k] / bh2
    size = increment_norm(W, T)
    if T.count[BOTH] == 1:
        close_gaps(s, W, n, rank, lead)
        size += increment_norm(W, T)
        for i in range(n):
            T.psi[i] += W.delta[i]
            T.drift[i] += W.delta[i]
    if is_multistep(T):
        follow_increment(s, T)
    moved(s, T.q, T.psi, T.q1)
    T.count[PASS] += 1
    T.count[ITERATIONS] += 1
    return verdict(W, T, size, gap)


@inner
def row_gap(s, W, T, k):
    """Gap of constraint k as far as increments close it, in rad or lengths of the mechanism."""
    kind = s.rows.kind[k]
    if T.count[BOTH] == 1 or kind == ROLL:
        return 0.0
    is_length = kind in (POINT, ALONG, DISTANCE, TOUCH)
    return abs(W.value[k]) / (T.size[1] if is_length else 1.0)


@inner
def verdict(W, T, size, gap):
    """Judge the increment just applied by its size and by how fast increments and gaps shrink."""
    last, wider = T.size[0], T.size[4]
    T.size[0], T.size[4] = size, gap
    if not math.isfinite(size):
        return NOT_FINITE
    goal, floor = increment_goal(W, T)
    shrink = size / last if last > 0.0 else 1.0
    closed = gap * min(1.0, gap / wider if wider > 0.0 else 1.0) <= GAP
    closing = shrink < 1.0 and size * shrink / (1.0 - shrink) <= goal
    if size <= FINER * floor or (closing and closed):
        return CONVERGED
    if shrink > 0.5 and size < 100 * floor and T.count[PASS] > 3:
        return CONVERGED
    if T.count[PASS] >= MAX_PASSES:
        return FAILED
    if last > 0.0 and shrink > 0.2:
        T.count[FRESH] = 0
    return GOES_ON


@inner
def accept(s, W, T, rank):
    """Make the trial state the present one, multipliers of least norm, and add up the work."""
    h, _, _, alpha_m, alpha_f = T.method
    if T.count[BOTH] == 1:
        fit_velocities(s, W, T, rank)
    if is_multistep(T):
        keep_past(s, T)
    for i in range(T.v.size):
        rate = (1 - alpha_f) * T.vd1[i] + alpha_f * T.vd[i]
        T.a[i] = T.v[i] if T.bdf[0] > 0.0 else (rate - alpha_m * T.a[i]) / (1 - alpha_m)
    copy(T.q1, T.q)
    copy(T.v1, T.v)
    copy(T.vd1, T.vd)
    copy(T.lam1, T.lam)
    if rank < T.lam.size:
        constraint_gradient(s, W)
        least_multipliers(W, rank, T.lam)
    follow_coordinates(W)
    drive_power(s, W, T.lam)  # the last correction moved the multipliers
    for k in range(3):
        T.work[k] += 0.5 * h * (W.power[k] + T.lost[k])
        T.lost[k] = W.power[k]
    T.count[STEPS] += 1
    T.count[LAST] = T.count[PASS]
    T.count[PASS] = 0


@kernel
def advance(s, W, T, rank, signals, every, out):
    """Take one step per row of ``signals``; save every so many. Says how the last one went.

    ``out`` holds arrays for q, v, vd, lam, work and base with one row per saved instant. When
    forces of Python functions are to be asked for, T.count[ASKS] is 1: then it returns ASK with
    everything evaluated, and goes on from there in the next call, which has the same arguments.
    """
    h, beta, gamma, _, _ = T.method
    c = (mass_factor(T), gamma * h, beta * h * h)
    while T.count[STEPS] - T.count[BEGAN] < signals.shape[0]:
        if T.count[ASKED] == 0:
            if T.count[PASS] == 0:
                copy(signals[T.count[STEPS] - T.count[BEGAN]], W.signal)
                predict(s, T)
            evaluate(s, W, T.q1, T.v1)
            if T.count[ASKS] == 1:
                T.count[ASKED] = 1
                return ASK
        T.count[ASKED] = 0
        residual(s, W, T.q1, T.v1, T.vd1, T.lam1)
        if T.count[FRESH] == 0:
            tangents(s, W, T.v1, T.vd1, T.lam1, c)
            constraint_gradient(s, W)
            if not factorise_step(s, W, T, rank):
                return SINGULAR
        answer = correct(s, W, T, rank)
        if answer > CONVERGED:
            return answer
        if answer == CONVERGED:
            accept(s, W, T, rank)
            if T.count[STEPS] % every == 0:
                save(W, T, out, T.count[STEPS] // every - T.count[BEGAN] // every - 1)
    return CONVERGED


@inner
def save(W, T, out, at):
    """Copy the present state to a row of the output arrays."""
    Q, V, A, L, X, B = out
    copy(W.base, B[at])
    copy(T.q, Q[at])
    copy(T.v, V[at])
    copy(T.vd, A[at])
    copy(T.lam, L[at])
    copy(T.work, X[at])
