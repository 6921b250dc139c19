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

from rom.mbs.arrays import ROLL
from rom.mbs.bordered import solve_bordered
from rom.mbs.compiled import inner
from rom.mbs.motion import evaluate

# corrections of the velocities at the end of a step; each gains a digit or more
PASSES = 8


@inner
def velocity_gaps(s, W, out):
    """Velocities with which the constraints are violated; `evaluate` first."""
    R = s.rows
    for k in range(R.kind.size):
        out[k] = 0.0
        for side, m in enumerate((R.i[k], R.j[k], R.k[k], R.l[k])):
            if m >= 0:
                for p in range(6):
                    out[k] += W.g[k, 6 * side + p] * W.V[m, p]
        if R.signal[k] >= 0:
            out[k] -= W.signal[R.signal[k], 1]


@inner
def close_gaps(s, W, n, rank, lead):
    """Set W.delta to the positions that close the gaps when `lead` times the velocity gaps go."""
    velocity_gaps(s, W, W.part)
    for i in range(n):
        W.rhs[i] = 0.0
    for k in range(W.part.size):
        rest = lead * W.part[k] - W.value[k]
        W.part[k] = 0.0 if s.rows.kind[k] == ROLL else rest
    solve_bordered(s, W, rank, W.delta, W.dlam)


@inner
def fit_velocities(s, W, T, rank):
    """Remove the velocity gaps that the last correction left, to round-off."""
    h, _, gamma, alpha_m, alpha_f = T.method
    c = (1 - alpha_m) / ((1 - alpha_f) * gamma * h)
    n, last = T.v1.size, math.inf
    for _ in range(PASSES):
        evaluate(s, W, T.q1, T.v1)
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
            T.v1[i] += W.delta[i]
            T.vd1[i] += c * W.delta[i]
