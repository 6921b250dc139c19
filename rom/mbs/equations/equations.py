"""Equations of motion of the whole mechanism: residual, iteration matrix, accelerations."""

from numba import types

from rom.mbs.equations.linear_solve import (
    border,
    constraint_range,
    factorise_bordered,
    may_repeat_constraints,
    remove_undecided,
    solve_bordered,
)
from rom.mbs.kernels.algebra import scale, turned, vec
from rom.mbs.kernels.compiled import copy, inner, kernel
from rom.mbs.kernels.constraints import (
    constraint_gradient,
    constraint_stiffness,
    constraint_wrench,
    row_states,
)
from rom.mbs.kernels.coordinates import coordinate_states, coupling_stiffness, follow_coordinates
from rom.mbs.kernels.element_calls import energy, multiplier_columns, residuals
from rom.mbs.kernels.element_calls import tangents as element_tangents
from rom.mbs.kernels.inertia import (
    body_damping,
    body_mass,
    body_residuals,
    body_states,
    body_stiffness,
)
from rom.mbs.kernels.markers import marker_states, own_block, spread_wrench, wrench_stiffness
from rom.mbs.kernels.stages import REAL_VECTOR, THREE_FACTORS, stage
from rom.mbs.kernels.system import System
from rom.mbs.kernels.work import Work

# over the loads of joints with friction; each gains a digit when the friction angle is small
MAX_PASSES = 60


@stage(types.void, System, Work, REAL_VECTOR, REAL_VECTOR)
def evaluate(s, W, q, v):
    """All quantities that depend on coordinates, velocities and signals only."""
    body_states(s, W, q, v)
    marker_states(s, W, q, v)
    coordinate_states(s, W)
    row_states(s, W)


@inner
def body_masses(s, W):
    """Set W.S to the mass matrix of all bodies; `evaluate` first."""
    W.S[:] = 0.0
    for b in range(s.bodies.mass.size):
        body_mass(s, W, b, 1.0, own_block(s, b, W.S))


@kernel
def linearize_constraints(s, W, q, v):
    """`evaluate`, then set W.G to the constraint gradient and W.S to the mass matrix."""
    evaluate(s, W, q, v)
    constraint_gradient(s, W)
    body_masses(s, W)


@stage(types.void, System, Work, REAL_VECTOR, REAL_VECTOR, REAL_VECTOR, REAL_VECTOR)
def residual(s, W, q, v, a, lam):
    """Set W.residual = M a + h - Q + G^T lam at the state of the last `evaluate`."""
    W.residual[:] = 0.0
    W.power[:] = 0.0
    W.driven[0] = 0.0
    W.wrench[:] = 0.0
    body_residuals(s.bodies, W, q, v, a)
    for k in range(s.elements.shape[0]):
        residuals(s, k, W, q, v, lam)
    constraint_wrench(s, W, lam)
    spread_wrench(s, W, -1.0, W.residual)
    drive_power(s, W, lam)


@inner
def drive_power(s, W, lam):
    """Set the power of drives and motors."""
    W.power[0] = W.driven[0]
    for k in range(s.rows.kind.size):
        if s.rows.signal[k] >= 0:
            W.power[0] -= lam[k] * W.signal[s.rows.signal[k], 1]


@stage(types.void, System, Work, REAL_VECTOR, REAL_VECTOR, REAL_VECTOR, THREE_FACTORS)
def tangents(s, W, v, a, lam, c):
    """Set W.S = c0 M + c1 dr/dv and W.Kt = c2 dr/dq for the coefficients c; `residual` first."""
    W.S[:] = 0.0
    W.Kt[:] = 0.0
    for b in range(s.bodies.mass.size):
        body_mass(s, W, b, c[0], own_block(s, b, W.S))
        body_damping(s, W, b, v, c[1], own_block(s, b, W.S))
        body_stiffness(s, W, b, v, a, c[2], own_block(s, b, W.Kt))
    wrench_stiffness(s, W, c[2], W.Kt)
    constraint_stiffness(s, W, lam, c[2], W.Kt)
    coupling_stiffness(s, W, lam, c[2], W.Kt)
    for k in range(s.elements.shape[0]):
        element_tangents(s, k, W, lam, c[2], c[1])


@inner
def load_columns(s, W, lam, rank):
    """Add to W.UG what forces change with the multipliers of the joints they depend on."""
    if s.by_multipliers != 0:
        for k in range(s.elements.shape[0]):
            multiplier_columns(s, k, W, lam, rank)


@inner
def element_energy(s, W, q, v):
    """Energy stored in elements."""
    total = 0.0
    for k in range(s.elements.shape[0]):
        total += energy(s, k, W, q, v)
    return total


@kernel
def retract(s, q, psi, out):
    """Coordinates q o exp(psi): positions and elastic add up, rotations turn in the body frame."""
    bodies = s.bodies
    for b in range(bodies.mass.size):
        at, vt = bodies.q_at[b], bodies.v_at[b]
        for i in range(3):
            out[at + i] = q[at + i] + psi[vt + i]
        turned(q, at + 3, vec(psi, vt + 3), out)
        for k in range(bodies.r[b]):
            out[at + 7 + k] = q[at + 7 + k] + psi[vt + 6 + k]


@inner
def coordinate_rates(s, q, v, out):
    """Time derivatives of the coordinates for the velocities v."""
    bodies = s.bodies
    for b in range(bodies.mass.size):
        at, vt = bodies.q_at[b], bodies.v_at[b]
        e0, e1, e2, e3 = q[at + 3], q[at + 4], q[at + 5], q[at + 6]
        x, y, z = scale(0.5, vec(v, vt + 3))
        for i in range(3):
            out[at + i] = v[vt + i]
        out[at + 3] = -e1 * x - e2 * y - e3 * z
        out[at + 4] = e0 * x + e2 * z - e3 * y
        out[at + 5] = e0 * y + e3 * x - e1 * z
        out[at + 6] = e0 * z + e1 * y - e2 * x
        for k in range(bodies.r[b]):
            out[at + 7 + k] = v[vt + 6 + k]


@stage(types.boolean, System, Work, types.int64, types.boolean)
def factorise_motion(s, W, rank, accepted):
    """Factorise [M G^T; G 0], the equations of accelerations; `evaluate` first.

    At accepted states the range of the constraints is renewed. False when they are singular.
    """
    body_masses(s, W)
    constraint_gradient(s, W)
    if accepted and rank < W.part.size:
        constraint_range(s, W, rank, W.U_lu)
    border(W, rank)
    return factorise_bordered(s, W, rank)


@stage(types.void, System, Work, types.int64, REAL_VECTOR, needed=may_repeat_constraints)
def least_multipliers(s, W, rank, lam):
    """Replace lam by the multipliers of least norm that give the same forces.

    In blocks this takes the factors of a step.
    """
    m = lam.size
    if s.graph.shares != 0:
        if factorise_motion(s, W, rank, False):
            remove_undecided(s, W, lam)
        return
    constraint_range(s, W, rank, W.U)
    for k in range(rank):
        total = 0.0
        for p in range(m):
            total += W.U[k, p] * lam[p]
        W.part[k] = total
    for p in range(m):
        lam[p] = 0.0
        for k in range(rank):
            lam[p] += W.U[k, p] * W.part[k]


@stage(types.void, System, Work, *4 * (REAL_VECTOR,), types.int64)
def accelerate(s, W, q, v, a, lam, rank):
    """Set a and lam to accelerations and multipliers; `factorise_motion` first.

    Friction that depends on joint loads is found by passes with the loads of the pass before.
    """
    lam[:] = 0.0
    for _ in range(MAX_PASSES if s.by_multipliers != 0 else 1):
        a[:] = 0.0
        residual(s, W, q, v, a, lam)
        for i in range(a.size):
            W.rhs[i] = -W.residual[i]
        for k in range(lam.size):
            drive = W.signal[s.rows.signal[k], 2] if s.rows.signal[k] >= 0 else 0.0
            W.part[k] = drive - W.gamma[k]
        solve_bordered(s, W, rank, a, W.dlam)
        change, size = 0.0, 0.0
        for k in range(lam.size):
            lam[k] += W.dlam[k]
            change, size = change + W.dlam[k] ** 2, size + lam[k] ** 2
        if change <= 1e-30 * size:
            break
    drive_power(s, W, lam)


@kernel
def rates(s, W, y, rank, accepted, a, lam, out):  # noqa: PLR0913  compiled code has no keywords
    """Rates of coordinates, velocities and works in y; False when the equations are singular.

    Accelerations a and multipliers lam solve [M G^T; G 0]. At accepted states the range of the
    constraints is renewed, which makes the multipliers those of least norm; in between the range
    of the last one gives the same accelerations.
    """
    n = a.size
    n_q = y.size - n - 3
    q, v = y[:n_q], y[n_q : n_q + n]
    evaluate(s, W, q, v)
    if not factorise_motion(s, W, rank, accepted):
        return False
    accelerate(s, W, q, v, a, lam, rank)
    if accepted:
        follow_coordinates(W)
    coordinate_rates(s, q, v, out[:n_q])
    copy(a, out[n_q : n_q + n])
    copy(W.power, out[n_q + n :])
    return True
