"""Motors, friction and stops: forces along joint coordinates."""

import math

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import column_of
from rom.mbs.kernels.coordinates import coordinate_tangent, push_coordinate
from rom.mbs.kernels.stages import REAL_VECTOR, TANGENT_TYPES, stage
from rom.mbs.kernels.system import ALONG, POINT, System
from rom.mbs.kernels.work import Work


@intrinsic
def call(_context, address, time, x, rate):
    """Value of the compiled law at an address: double (double, double, double)."""
    signature = types.float64(types.int64, types.float64, types.float64, types.float64)

    def build(_context, builder, _signature, arguments):
        double = ir.DoubleType()
        kind = ir.FunctionType(double, [double, double, double])
        return builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])

    return signature, build


@inner
def motor_force(s, W, k, x, rate):
    """Force of motor k at a coordinate and its rate; a Python law was asked before."""
    A = s.actions
    if A.motor[k] == 0:
        return W.motor[k]
    return call(A.motor[k], W.signal[A.clock[0], 0], x, rate)


@inner
def motor_slopes(s, W, k, x, rate):
    """Derivatives of a motor law by coordinate and rate, from central differences."""
    dx, dv = 1e-6 * (1.0 + abs(x)), 1e-6 * (1.0 + abs(rate))
    by_x = motor_force(s, W, k, x + dx, rate) - motor_force(s, W, k, x - dx, rate)
    by_rate = motor_force(s, W, k, x, rate + dv) - motor_force(s, W, k, x, rate - dv)
    return 0.5 * by_x / dx, 0.5 * by_rate / dv


@inner
def joint_load(s, k, lam):
    """Resultant of the forces that the joint of friction k transmits [N]."""
    A, total = s.actions, 0.0
    for row in range(A.load_first[k], A.load_first[k] + A.load_count[k]):
        if s.rows.kind[row] in (POINT, ALONG):
            total += lam[row] ** 2
    return math.sqrt(total)


@inner
def friction_by_load(s):
    """Whether the friction of any joint depends on its load."""
    for k in range(s.actions.friction_at.size):
        if s.actions.friction[k, 1] != 0.0:
            return True
    return False


@inner
def friction_shape(law, rate):
    """Friction per level, with Stribeck's rise towards rest, and its derivative by the rate."""
    sign = math.tanh(rate / law[5])
    fade = law[2] * math.exp(-((rate / law[3]) ** 2))
    slope = (1.0 - sign * sign) / law[5] * (1.0 + fade)
    return sign * (1.0 + fade), slope - 2.0 * rate / law[3] ** 2 * sign * fade


@inner
def friction_force(s, W, k, lam):
    """Force of friction k and its derivative by the rate."""
    law, rate = s.actions.friction[k], W.xd[s.actions.friction_at[k]]
    level = law[0] + law[1] * joint_load(s, k, lam)
    shape, slope = friction_shape(law, rate)
    return -level * shape - law[4] * rate, -level * slope - law[4]


@inner
def stop_state(law, x, rate):
    """Force of a stop, its derivatives by coordinate and rate, elastic force and depth."""
    depth, speed = law[0] * (x - law[1]), law[0] * rate
    if depth <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    elastic = law[2] * depth ** law[3]
    grip = max(1.0 + law[4] * speed, 0.0)
    stiffness = law[3] * elastic / depth * grip
    damping = elastic * law[4] if grip > 0.0 else 0.0
    return -law[0] * elastic * grip, -stiffness, -damping, law[0] * elastic, depth


def _has_actions(system):
    A = system.actions
    return A.motor_at.size or A.friction_at.size or A.stop_at.size


@stage(types.void, System, Work, REAL_VECTOR, needed=_has_actions)
def action_wrenches(s, W, lam):
    """Add motors, friction and stops to the wrenches on the markers, and their powers."""
    A = s.actions
    W.driven[0] = 0.0
    for k in range(A.motor_at.size):
        at = A.motor_at[k]
        force = motor_force(s, W, k, W.x[at], W.xd[at])
        push_coordinate(s, W, at, force)
        W.driven[0] += force * W.xd[at]
    for k in range(A.friction_at.size):
        at = A.friction_at[k]
        force, _ = friction_force(s, W, k, lam)
        push_coordinate(s, W, at, force)
        W.power[2] -= force * W.xd[at]
    for k in range(A.stop_at.size):
        at = A.stop_at[k]
        force, _, _, elastic, _ = stop_state(A.stop[k], W.x[at], W.xd[at])
        push_coordinate(s, W, at, force)
        W.power[2] -= (force + elastic) * W.xd[at]


@stage(types.void, System, Work, REAL_VECTOR, *TANGENT_TYPES, needed=_has_actions)
def action_tangents(s, W, lam, ck, cc, K, S):
    """Add the stiffness (times ck) and damping (times cc) of all actions to K and S."""
    A = s.actions
    for k in range(A.motor_at.size):
        x, rate = W.x[A.motor_at[k]], W.xd[A.motor_at[k]]
        by_x, by_rate = motor_slopes(s, W, k, x, rate)
        law = ck * motor_force(s, W, k, x, rate), ck * by_x, cc * by_rate
        coordinate_tangent(s, W, A.motor_at[k], law, K, S)
    for k in range(A.friction_at.size):
        force, by_rate = friction_force(s, W, k, lam)
        coordinate_tangent(s, W, A.friction_at[k], (ck * force, 0.0, cc * by_rate), K, S)
    for k in range(A.stop_at.size):
        at = A.stop_at[k]
        force, by_x, by_rate, _, depth = stop_state(A.stop[k], W.x[at], W.xd[at])
        if depth > 0.0:
            coordinate_tangent(s, W, at, (ck * force, ck * by_x, cc * by_rate), K, S)


@inner
def load_columns(s, W, lam, rank):
    """Add to W.UG what friction forces change with the multipliers of their joint."""
    A = s.actions
    for k in range(A.friction_at.size):
        at, load = A.friction_at[k], joint_load(s, k, lam)
        if A.friction[k, 1] == 0.0 or load == 0.0:
            continue
        shape, _ = friction_shape(A.friction[k], W.xd[at])
        for row in range(A.load_first[k], A.load_first[k] + A.load_count[k]):
            if s.rows.kind[row] not in (POINT, ALONG):
                continue
            change = A.friction[k, 1] * shape * lam[row] / load
            for r in range(rank):
                u = W.U_lu[r, row] if rank < lam.size else (1.0 if r == row else 0.0)
                if u != 0.0:
                    add_gradient(s, W, at, change * u, r)


@inner
def add_gradient(s, W, at, c, row):
    """Add c times the gradient of joint coordinate ``at`` in the velocities to a row of W.UG."""
    bodies, C = s.bodies, s.coordinates
    for side in range(2):
        m = C.i[at] if side == 0 else C.j[at]
        b = s.markers.body[m]
        first = column_of(s.graph, row, b) if s.graph.compact else bodies.v_at[b]
        for q in range(6 + bodies.r[b] if b >= 0 else 0):
            for p in range(6):
                W.UG[row, first + q] += c * W.xg[at, 6 * side + p] * W.H[m, p, q]


@inner
def stop_energy(s, W):
    """Elastic energy in stops."""
    A, total = s.actions, 0.0
    for k in range(A.stop_at.size):
        law = A.stop[k]
        depth = law[0] * (W.x[A.stop_at[k]] - law[1])
        if depth > 0.0:
            total += law[2] * depth ** (law[3] + 1.0) / (law[3] + 1.0)
    return total
