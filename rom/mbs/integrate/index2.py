"""Constraints on positions and velocities together: the stabilised equations of index 2.

Positions move with the velocities and with what closes the gaps of the constraints,
dq/dt = v - S^-1 G^T eta, where eta are multipliers of their own and S is the iteration matrix,
close to the mass. The multipliers lam then answer for the velocities.

Source:
    Gear, Leimkuhler and Gupta, Automatic integration of Euler-Lagrange equations with constraints,
    J. Comput. Appl. Math. 12 (1985) 77; for generalised-alpha: Arnold, Bruels and Cardona,
    Convergence analysis of generalized-alpha Lie group integrators for constrained systems,
    ECCOMAS Multibody Dynamics (2011).
"""

import math

from numba import types

from rom.mbs.equations.equations import evaluate
from rom.mbs.equations.linear_solve import gradient_times, solve_bordered
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.stages import REAL_VECTOR, stage
from rom.mbs.kernels.system import ROLL, System
from rom.mbs.kernels.work import BOTH_LEVELS, Step, Work

# corrections of the velocities at the end of a step; each gains a digit or more
MAX_CORRECTIONS = 8
VELOCITY_GAP_TOL = 1e-8  # of a row of the constraints, relative to its terms
SMALL_ROW_RATIO = 1e-3  # rows at rest hold nothing but round-off


def _is_stabilised(step):
    return step.count[BOTH_LEVELS] == 1


@stage(types.void, System, Work, REAL_VECTOR, asked=Step, needed=_is_stabilised)
def velocity_gaps(s, W, out):
    """Velocities with which the constraints are violated; `evaluate` first."""
    rows = s.rows
    for k in range(rows.kind.size):
        out[k] = 0.0
        for side, m in enumerate((rows.i[k], rows.j[k], rows.k[k], rows.l[k])):
            if m >= 0:
                for p in range(6):
                    out[k] += W.g[k, 6 * side + p] * W.V[m, p]
        if rows.signal[k] >= 0:
            out[k] -= W.signal[rows.signal[k], 1]


@stage(types.void, System, Work, types.int64, types.float64, asked=Step, needed=_is_stabilised)
def close_gaps(s, W, rank, lead):
    """Set W.delta to the positions that close the gaps when `lead` times the velocity gaps go."""
    velocity_gaps(s, W, W.part)
    for k in range(W.part.size):
        residual = lead * W.part[k] - W.value[k]
        W.part[k] = 0.0 if s.rows.kind[k] == ROLL else residual
    least_motion_across(s, W, rank, W.delta)


@stage(types.void, System, Work, Step, types.int64, asked=Step, needed=_is_stabilised)
def fit_velocities(s, W, step, rank):
    """Remove the velocity gaps that the last correction left, to round-off."""
    h, _, gamma, alpha_m, alpha_f = step.method
    c = (1 - alpha_m) / ((1 - alpha_f) * gamma * h)
    last = math.inf
    for _ in range(MAX_CORRECTIONS):
        evaluate(s, W, step.q1, step.v1)
        velocity_gaps(s, W, W.part)
        total = 0.0
        for k in range(W.part.size):
            total += W.part[k] ** 2
            W.part[k] *= -1.0
        if not total < 0.25 * last:
            return
        last = total
        least_motion_across(s, W, rank, W.delta)
        for i in range(step.v1.size):
            step.v1[i] += W.delta[i]
            step.vd1[i] += c * W.delta[i]


@inner
def project_velocity(s, W, rank, v):
    """Take v to the velocity nearest in kinetic energy that satisfies the constraints.

    `factorise_motion` first. False if there is none.
    """
    largest = 0.0  # of rates, and of the first gaps: where all stand still, v is their round-off
    for turn in range(3):  # the second removes the round-off of the first, the third looks
        gradient_times(s, W, v, False, W.part)
        for k in range(W.part.size):
            rate = W.signal[s.rows.signal[k], 1] if s.rows.signal[k] >= 0 else 0.0
            W.part[k] = rate - W.part[k]
            largest = max(largest, abs(W.part[k]) if turn == 0 else 0.0)
        if turn < 2:
            least_motion_across(s, W, rank, W.delta)
            for i in range(v.size):
                v[i] += W.delta[i]
    gradient_times(s, W, v, True, W.dlam)
    for k in range(W.part.size):
        rate = W.signal[s.rows.signal[k], 1] if s.rows.signal[k] >= 0 else 0.0
        W.dlam[k] = max(W.dlam[k], abs(rate))
        largest = max(largest, W.dlam[k])
    for k in range(W.part.size):
        if abs(W.part[k]) > VELOCITY_GAP_TOL * max(W.dlam[k], SMALL_ROW_RATIO * largest):
            return False
    return True


@inner
def least_motion_across(s, W, rank, out):
    """Set out to the motion of least energy that changes the gaps by W.part."""
    for i in range(out.size):
        W.rhs[i] = 0.0
    solve_bordered(s, W, rank, out, W.dlam)
