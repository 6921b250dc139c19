"""Applied forces: springs, loads, rotational springs, and forces of Python functions."""

import math

from numba import types

from rom.mbs.kernels.algebra import add, cross, dot, place, put, row, scale, sub, turn, unit
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness, place_relative
from rom.mbs.kernels.coordinates import coordinate_tangent, push_coordinate
from rom.mbs.kernels.stages import TANGENT_TYPES, stage
from rom.mbs.kernels.system import FORCE_BODY, FORCE_WORLD, TORQUE_BODY, System
from rom.mbs.kernels.work import Work


@inner
def spring_state(spring, k, i, j, P, V):
    """Length, direction, relative velocity, rate of length and tension of spring k."""
    gap, slide = sub(row(P, j, 0), row(P, i, 0)), sub(row(V, j, 0), row(V, i, 0))
    length = math.sqrt(dot(gap, gap))
    e = scale(1.0 / length, gap) if length > 0.0 else (0.0, 0.0, 0.0)
    rate = dot(e, slide)
    return length, e, slide, rate, spring[k, 0] * (length - spring[k, 2]) + spring[k, 1] * rate


@inner
def turn_moment(F, k, W):
    """Moment with which rotational spring k drives its joint coordinate."""
    at = F.turn_at[k]
    return -F.turn[k, 0] * (W.x[at] - F.turn[k, 2]) - F.turn[k, 1] * W.xd[at]


@inner
def load_vector(F, k, E, signal):
    """Load k in the world, its signal included."""
    x = row(F.load, k, 0)
    if F.load_signal[k] >= 0:
        x = add(x, row(signal, F.load_signal[k], 0))
    kind = F.load_kind[k]
    return turn(E, F.load_at[k], x) if kind in (FORCE_BODY, TORQUE_BODY) else x


@stage(types.void, System, Work)
def applied_wrenches(s, W):
    """Set the wrenches on all markers to the applied forces; add up their power."""
    F = s.forces
    for m in range(W.wrench.shape[0]):
        for p in range(6):
            W.wrench[m, p] = W.user[m, p]
            W.power[1] += W.user[m, p] * W.V[m, p]
    for k in range(F.spring_i.size):
        _, e, _, rate, tension = spring_state(F.spring, k, F.spring_i[k], F.spring_j[k], W.P, W.V)
        put(W.wrench[F.spring_i[k]], 0, scale(tension, e))
        put(W.wrench[F.spring_j[k]], 0, scale(-tension, e))
        W.power[2] += F.spring[k, 1] * rate * rate
    for k in range(F.turn_at.size):
        push_coordinate(s, W, F.turn_at[k], turn_moment(F, k, W))
        W.power[2] += F.turn[k, 1] * W.xd[F.turn_at[k]] ** 2
    for k in range(F.load_at.size):
        kind = F.load_kind[k]
        at = 0 if kind in (FORCE_WORLD, FORCE_BODY) else 3
        x, m = load_vector(F, k, W.E, W.signal), F.load_at[k]
        put(W.wrench[m], at, x)
        W.power[1] += dot(x, row(W.V, m, at))


@inner
def spring_tangent(s, W, k, ck, cc, K, S):
    """Add ck times the stiffness of spring k to K and cc times its damping to S."""
    F = s.forces
    length, e, slide, rate, tension = spring_state(
        F.spring, k, F.spring_i[k], F.spring_j[k], W.P, W.V
    )
    if length == 0.0:
        return
    W.Q[:] = 0.0
    across = sub(slide, scale(rate, e))
    for p in range(3):
        u = unit(p)
        radial = scale(F.spring[k, 0] * e[p] + F.spring[k, 1] * across[p] / length, e)
        lateral = scale(tension / length, sub(u, scale(e[p], e)))
        place_relative(W.Q, 0, p, ck, add(radial, lateral))
    pair_stiffness(s, W, F.spring_i[k], F.spring_j[k], K)
    if F.spring[k, 1] != 0.0:
        W.Q[:] = 0.0
        for p in range(3):
            place_relative(W.Q, 0, p, cc * F.spring[k, 1] * e[p], e)
        pair_stiffness(s, W, F.spring_i[k], F.spring_j[k], S)


def _has_forces(system):
    F = system.forces
    return F.spring_i.size or F.load_at.size or F.turn_at.size


@stage(types.void, System, Work, *TANGENT_TYPES, needed=_has_forces)
def force_tangents(s, W, ck, cc, K, S):
    """Add the stiffness (times ck) and damping (times cc) of all applied forces to K and S."""
    F = s.forces
    for k in range(F.spring_i.size):
        spring_tangent(s, W, k, ck, cc, K, S)
    for k in range(F.turn_at.size):
        moment, turn = turn_moment(F, k, W), F.turn
        law = ck * moment, -ck * turn[k, 0], -cc * turn[k, 1]
        coordinate_tangent(s, W, F.turn_at[k], law, K, S)
    for k in range(F.load_at.size):
        kind, m = F.load_kind[k], F.load_at[k]
        if kind in (FORCE_BODY, TORQUE_BODY):
            at = 0 if kind == FORCE_BODY else 3
            x = load_vector(F, k, W.E, W.signal)
            W.Q[:] = 0.0
            for p in range(3):
                place(W.Q, at, 3 + p, ck, cross(x, unit(p)))
            pair_stiffness(s, W, m, m, K)


@inner
def spring_energy(s, W):
    """Energy stored in springs and rotational springs."""
    F, total = s.forces, 0.0
    for k in range(F.spring_i.size):
        length = spring_state(F.spring, k, F.spring_i[k], F.spring_j[k], W.P, W.V)[0]
        total += 0.5 * F.spring[k, 0] * (length - F.spring[k, 2]) ** 2
    for k in range(F.turn_at.size):
        total += 0.5 * F.turn[k, 0] * (W.x[F.turn_at[k]] - F.turn[k, 2]) ** 2
    return total
