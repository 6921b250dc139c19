"""Bushings: elastic and damped in six directions, large rotations of the whole included.

The state is the position of marker j in the axes of the bushing on marker i, and the rotation
vector between both; forces are work-conjugate to it, so that a constant or tabulated stiffness
has a potential whatever the rotation.
"""

import math

from numba import types

from rom.mbs.kernels.algebra import (
    add,
    cross,
    dot,
    mtv,
    mv,
    row,
    scale,
    sub,
    turn,
    unit,
    unit_twist,
)
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness
from rom.mbs.kernels.stages import TANGENT_TYPES, stage
from rom.mbs.kernels.system import System
from rom.mbs.kernels.work import Work


@inner
def inverse_coefficient(x):
    """Coefficient c of the inverse tangent operator 1 - skew / 2 + c skew^2, and its derivative.

    x = angle^2, c = (1 - (a / 2) cot(a / 2)) / a^2; power series where the quotients cancel.
    """
    if x < 0.05:
        c = 1 / 12 + x * (1 / 720 + x * (1 / 30240 + x * (1 / 1209600 + x / 47900160)))
        return c, 1 / 720 + x * (2 / 30240 + x * (3 / 1209600 + x * 4 / 47900160))
    a = math.sqrt(x)
    s, t = math.sin(0.5 * a), math.cos(0.5 * a)
    c = (1.0 - 0.5 * a * t / s) / x
    return c, (0.125 * (1.0 / (s * s) - 2.0 * t / (a * s)) - c) / x


@inner
def inverse_tangent(theta, sign, x):
    """Inverse of the spatial tangent operator of exp(theta) times x; transposed for sign = -1."""
    c, _ = inverse_coefficient(dot(theta, theta))
    once = cross(theta, x)
    return add(x, add(scale(-0.5 * sign, once), scale(c, cross(theta, once))))


@inner
def transposed_rate(theta, d, x):
    """Change of the transposed inverse times x while theta changes by d."""
    c, dc = inverse_coefficient(dot(theta, theta))
    once = cross(theta, x)
    both = add(cross(d, once), cross(theta, cross(d, x)))
    along = scale(2.0 * dc * dot(theta, d), cross(theta, once))
    return add(add(scale(0.5, cross(d, x)), scale(c, both)), along)


@inner
def rotation_vector(s, k, W):
    """Rotation from the bushing axes on i to those on j, in those on i; less than half a turn."""
    B = s.bushings
    i, j = B.i[k], B.j[k]
    r = 0.0
    w = (0.0, 0.0, 0.0)
    for p in range(3):
        a = to_local(W, i, B.frame_i[k], turn(W.E, j, mv(B.frame_j[k], unit(p))))
        w = add(w, scale(0.5, cross(unit(p), a)))
        r += a[p]
    sine, cosine = math.sqrt(dot(w, w)), 0.5 * (r - 1.0)
    if sine < 1e-8:
        return w
    return scale(math.atan2(sine, cosine) / sine, w)


@inner
def to_local(W, i, frame, x):
    """World vector in the bushing axes on marker i."""
    y = mtv(W.E[i], x)
    return mtv(frame, y)


@inner
def to_world(W, i, frame, x):
    """Vector in the bushing axes on marker i in the world."""
    return turn(W.E, i, mv(frame, x))


@inner
def bushing_state(s, k, W):
    """Gap in the world, position and rotation vector, and their rates."""
    B = s.bushings
    i, j, frame = B.i[k], B.j[k], B.frame_i[k]
    gap, slide = sub(row(W.P, j, 0), row(W.P, i, 0)), sub(row(W.V, j, 0), row(W.V, i, 0))
    x = sub(to_local(W, i, frame, gap), row(B.zero, k, 0))
    theta = rotation_vector(s, k, W)
    xd = to_local(W, i, frame, sub(slide, cross(row(W.V, i, 3), gap)))
    spin = to_local(W, i, frame, sub(row(W.V, j, 3), row(W.V, i, 3)))
    return gap, x, theta, xd, inverse_tangent(theta, 1.0, spin)


@inner
def curve_state(B, k, p, x):
    """Force, slope and energy of direction p at the displacement x."""
    if B.curve[k, p] < 0:
        return 0.0, 0.0, 0.0
    at = B.curve[k, p] + B.pieces[k, p] - 1
    while x < B.piece[at, 0]:
        at -= 1
    c, d = B.piece[at], x - B.piece[at, 1]
    force = c[2] + d * (c[3] + d * (c[4] + d * c[5]))
    slope = c[3] + d * (2 * c[4] + 3 * d * c[5])
    return force, slope, c[6] + d * (c[2] + d * (c[3] / 2 + d * (c[4] / 3 + d * c[5] / 4)))


@inner
def six(a, b, p):
    """Entry p of the pair of vectors a, b."""
    return a[p] if p < 3 else b[p - 3]


@inner
def resisting(matrix, a, b, at):
    """Three rows of a (6, 6) matrix from ``at`` times the pair of vectors a, b."""
    y = (0.0, 0.0, 0.0)
    for q in range(6):
        z = six(a, b, q)
        y = add(y, (matrix[at, q] * z, matrix[at + 1, q] * z, matrix[at + 2, q] * z))
    return y


@inner
def along_curves(B, k, a, b, at, which):
    """Force (which = 0) or slope (1) of the curves of three directions from ``at``."""
    return (
        curve_state(B, k, at, six(a, b, at))[which],
        curve_state(B, k, at + 1, six(a, b, at + 1))[which],
        curve_state(B, k, at + 2, six(a, b, at + 2))[which],
    )


@inner
def bushing_loads(s, k, state):
    """Elastic and damping forces and moments that resist the state."""
    B = s.bushings
    _, x, theta, xd, rate = state
    K, C = B.stiffness[k], B.damping[k]
    pull = add(resisting(K, x, theta, 0), along_curves(B, k, x, theta, 0, 0))
    twist = add(resisting(K, x, theta, 3), along_curves(B, k, x, theta, 3, 0))
    return pull, twist, resisting(C, xd, rate, 0), resisting(C, xd, rate, 3)


@inner
def bushing_force(s, k, W, state):
    """Force and moment of bushing k on marker j, world, and the power lost."""
    B = s.bushings
    i, frame = B.i[k], B.frame_i[k]
    _, _, theta, xd, rate = state
    pull, twist, drag, brake = bushing_loads(s, k, state)
    force = to_world(W, i, frame, scale(-1.0, add(pull, drag)))
    moment = inverse_tangent(theta, -1.0, scale(-1.0, add(twist, brake)))
    return force, to_world(W, i, frame, moment), dot(drag, xd) + dot(brake, rate)


@stage(types.void, System, Work, needed=lambda s: s.bushings.i.size)
def bushing_wrenches(s, W):
    """Add the bushings to the wrenches on the markers; add up the power lost."""
    B = s.bushings
    for k in range(B.i.size):
        i, j = B.i[k], B.j[k]
        state = bushing_state(s, k, W)
        force, moment, lost = bushing_force(s, k, W, state)
        turned = add(moment, cross(state[0], force))
        for p in range(3):
            W.wrench[j, p] += force[p]
            W.wrench[j, 3 + p] += moment[p]
            W.wrench[i, p] -= force[p]
            W.wrench[i, 3 + p] -= turned[p]
        W.power[2] += lost


@inner
def column(Q, p, c, dforce, dmoment, lever):
    """Add c times a change of the wrenches on both markers to column p."""
    for q in range(3):
        Q[q, p] -= c * dforce[q]
        Q[3 + q, p] -= c * (dmoment[q] + lever[q])
        Q[6 + q, p] += c * dforce[q]
        Q[9 + q, p] += c * dmoment[q]


@stage(types.void, System, Work, *TANGENT_TYPES, needed=lambda s: s.bushings.i.size)
def bushing_tangents(s, W, ck, cc, K, S):
    """Add the stiffness (times ck) and damping (times cc) of all bushings to K and S.

    The change of the rates with the position is left out.
    """
    B = s.bushings
    for k in range(B.i.size):
        i, j = B.i[k], B.j[k]
        state = bushing_state(s, k, W)
        W.Q[:] = 0.0
        for p in range(12):
            stiffness_column(s, W, k, state, p, -ck)
        pair_stiffness(s, W, i, j, K)
        W.Q[:] = 0.0
        for p in range(12):
            damping_column(s, W, k, state, p, -cc)
        pair_stiffness(s, W, i, j, S)


@inner
def local_motion(s, W, k, state, p):
    """Change of position and rotation vector in unit motion p."""
    B = s.bushings
    i, frame = B.i[k], B.frame_i[k]
    vi, wi, vj, wj = unit_twist(p)
    dx = to_local(W, i, frame, sub(sub(vj, vi), cross(wi, state[0])))
    return dx, inverse_tangent(state[2], 1.0, to_local(W, i, frame, sub(wj, wi)))


@inner
def stiffness_column(s, W, k, state, p, c):
    """Add c times the change of the wrenches in unit motion p to W.Q."""
    B = s.bushings
    i, frame, x, theta = B.i[k], B.frame_i[k], state[1], state[2]
    vi, wi, vj, _ = unit_twist(p)
    force, moment, _ = bushing_force(s, k, W, state)
    _, twist, _, brake = bushing_loads(s, k, state)
    dx, dtheta = local_motion(s, W, k, state, p)
    a, b = along_curves(B, k, x, theta, 0, 1), along_curves(B, k, x, theta, 3, 1)
    pull = add(resisting(B.stiffness[k], dx, dtheta, 0), times(a, dx))
    back = add(resisting(B.stiffness[k], dx, dtheta, 3), times(b, dtheta))
    turning = transposed_rate(theta, dtheta, add(twist, brake))
    back = add(inverse_tangent(theta, -1.0, back), turning)
    dforce = sub(cross(wi, force), to_world(W, i, frame, pull))
    dmoment = sub(cross(wi, moment), to_world(W, i, frame, back))
    lever = add(cross(sub(vj, vi), force), cross(state[0], dforce))
    column(W.Q, p, c, dforce, dmoment, lever)


@inner
def damping_column(s, W, k, state, p, c):
    """Add c times the change of the wrenches with unit velocity p to W.Q."""
    B = s.bushings
    dx, dtheta = local_motion(s, W, k, state, p)
    drag, brake = resisting(B.damping[k], dx, dtheta, 0), resisting(B.damping[k], dx, dtheta, 3)
    dforce = to_world(W, B.i[k], B.frame_i[k], scale(-1.0, drag))
    moment = inverse_tangent(state[2], -1.0, scale(-1.0, brake))
    dmoment = to_world(W, B.i[k], B.frame_i[k], moment)
    column(W.Q, p, c, dforce, dmoment, cross(state[0], dforce))


@inner
def times(a, b):
    """Entries of a times those of b."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


@inner
def bushing_energy(s, W):
    """Elastic energy in bushings."""
    B, total = s.bushings, 0.0
    for k in range(B.i.size):
        _, x, theta, _, _ = bushing_state(s, k, W)
        K = B.stiffness[k]
        total += 0.5 * dot(x, resisting(K, x, theta, 0))
        total += 0.5 * dot(theta, resisting(K, x, theta, 3))
        for p in range(6):
            total += curve_state(B, k, p, six(x, theta, p))[2]
    return total
