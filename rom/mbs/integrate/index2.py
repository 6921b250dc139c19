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

from rom.mbs.equations.equations import evaluate
from rom.mbs.equations.linear_solve import solve_bordered
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.system import ROLL

# corrections of the velocities at the end of a step; each gains a digit or more
MAX_CORRECTIONS = 8


@inner
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


@inner
def close_gaps(s, W, n, rank, lead):
    """Set W.delta to the positions that close the gaps when `lead` times the velocity gaps go."""
    velocity_gaps(s, W, W.part)
    for i in range(n):
        W.rhs[i] = 0.0
    for k in range(W.part.size):
        residual = lead * W.part[k] - W.value[k]
        W.part[k] = 0.0 if s.rows.kind[k] == ROLL else residual
    solve_bordered(s, W, rank, W.delta, W.dlam)


@inner
def fit_velocities(s, W, step, rank):
    """Remove the velocity gaps that the last correction left, to round-off."""
    h, _, gamma, alpha_m, alpha_f = step.method
    c = (1 - alpha_m) / ((1 - alpha_f) * gamma * h)
    n, last = step.v1.size, math.inf
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
        for i in range(n):
            W.rhs[i] = 0.0
        solve_bordered(s, W, rank, W.delta, W.dlam)
        for i in range(n):
            step.v1[i] += W.delta[i]
            step.vd1[i] += c * W.delta[i]
