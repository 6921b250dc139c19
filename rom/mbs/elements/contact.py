"""Contact of spheres and discs with planes, spheres and cylinders, with damping and friction.

All functions of one contact take real or complex numbers: the tangents are imaginary parts after
an imaginary step, exact to round-off.

Source:
    Hunt, Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl.
    Mech. 42 (1975) 440. Complex step: Squire, Trapp, SIAM Review 40 (1998) 110.
"""

import numpy as np
from numba import types

from rom.mbs.kernels.algebra import add, cross, dot, row, scale, sub, turn, unit_twist
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness
from rom.mbs.kernels.stages import TANGENT_TYPES, stage
from rom.mbs.kernels.system import BORE, DISC, PLANE, SPHERE, System
from rom.mbs.kernels.work import Work

COMPLEX_STEP = 1e-30


@inner
def touch(kind, radius, gap, e, s):
    """Normal from i to j, depth of penetration, and vector from P_j to the touching point."""
    if kind == PLANE:
        return e, radius[0] - dot(e, gap), scale(-radius[0], e)
    if kind == DISC:
        c = dot(e, s)
        w = np.sqrt(1.0 - c * c)
        down = scale(radius[0] / w, sub(scale(c, s), e))
        return e, radius[0] * w - dot(e, gap), down
    if kind == SPHERE:
        across = gap
    else:
        across = sub(gap, scale(dot(e, gap), e))
    far = np.sqrt(dot(across, across))
    if kind == BORE:
        n = scale(-1.0 / far, across)
        return n, far + radius[0] - radius[1], scale(-radius[0], n)
    n = scale(1.0 / far, across)
    return n, radius[0] + radius[1] - far, scale(-radius[0], n)


@inner
def contact_force(law, n, depth, down, motion):
    """Force on j, elastic force, closing speed, and velocity of j over i at the touching point.

    ``motion`` is the gap of the markers, their relative velocity and both angular velocities.
    """
    gap, slide, Oi, Oj = motion
    u = add(slide, sub(cross(Oj, down), cross(Oi, add(gap, down))))
    closing = -dot(n, u)
    elastic = law[0] * depth ** law[1]
    normal = elastic * (1.0 + law[2] * closing)
    if normal.real < 0.0:
        normal = 0.0 * normal
    across = add(u, scale(closing, n))
    drag = law[3] * normal / np.sqrt(dot(across, across) + law[4] * law[4])
    return sub(scale(normal, n), scale(drag, across)), elastic, closing, u


@inner
def contact_state(s, k, W):
    """Axes of contact k in the world, and the relative motion of its markers."""
    C = s.contacts
    i, j = C.i[k], C.j[k]
    e, axle = turn(W.E, i, row(C.e, k, 0)), turn(W.E, j, row(C.s, k, 0))
    gap, slide = sub(row(W.P, j, 0), row(W.P, i, 0)), sub(row(W.V, j, 0), row(W.V, i, 0))
    return e, axle, (gap, slide, row(W.V, i, 3), row(W.V, j, 3))


@stage(types.void, System, Work, needed=lambda s: s.contacts.i.size)
def contact_wrenches(s, W):
    """Add the contacts to the wrenches on the markers; add up the power lost."""
    C = s.contacts
    for k in range(C.kind.size):
        e, axle, motion = contact_state(s, k, W)
        n, depth, down = touch(C.kind[k], C.radius[k], motion[0], e, axle)
        if not depth > 0.0:
            continue
        force, elastic, closing, u = contact_force(C.law[k], n, depth, down, motion)
        at_j, at_i = cross(down, force), cross(add(motion[0], down), force)
        for p in range(3):
            W.wrench[C.j[k], p] += force[p]
            W.wrench[C.j[k], 3 + p] += at_j[p]
            W.wrench[C.i[k], p] -= force[p]
            W.wrench[C.i[k], 3 + p] -= at_i[p]
        W.power[2] -= dot(force, u) + elastic * closing


@inner
def stepped(x, dx):
    """The vector x with an imaginary step along dx."""
    return (
        complex(x[0], COMPLEX_STEP * dx[0]),
        complex(x[1], COMPLEX_STEP * dx[1]),
        complex(x[2], COMPLEX_STEP * dx[2]),
    )


@inner
def contact_column(s, W, k, p, by_position, c):
    """Add c times the change of the wrenches in unit motion p, or unit velocity p, to W.Q."""
    C = s.contacts
    e, axle, (gap, slide, Oi, Oj) = contact_state(s, k, W)
    vi, wi, vj, wj = unit_twist(p)
    move, rush = (1.0, 0.0) if by_position else (0.0, 1.0)
    normal = stepped(e, scale(move, cross(wi, e)))
    spin = stepped(axle, scale(move, cross(wj, axle)))
    gap = stepped(gap, scale(move, sub(vj, vi)))
    slide = stepped(slide, scale(rush, sub(vj, vi)))
    motion = gap, slide, stepped(Oi, scale(rush, wi)), stepped(Oj, scale(rush, wj))
    n, depth, down = touch(C.kind[k], C.radius[k], gap, normal, spin)
    force, _, _, _ = contact_force(C.law[k], n, depth, down, motion)
    at_j, at_i = cross(down, force), cross(add(gap, down), force)
    for q in range(3):
        W.Q[q, p] -= c / COMPLEX_STEP * force[q].imag
        W.Q[3 + q, p] -= c / COMPLEX_STEP * at_i[q].imag
        W.Q[6 + q, p] += c / COMPLEX_STEP * force[q].imag
        W.Q[9 + q, p] += c / COMPLEX_STEP * at_j[q].imag


@stage(types.void, System, Work, *TANGENT_TYPES, needed=lambda s: s.contacts.i.size)
def contact_tangents(s, W, ck, cc, K, S):
    """Add the stiffness (times ck) and damping (times cc) of all contacts to K and S."""
    C = s.contacts
    for k in range(C.kind.size):
        e, axle, motion = contact_state(s, k, W)
        if not touch(C.kind[k], C.radius[k], motion[0], e, axle)[1] > 0.0:
            continue
        W.Q[:] = 0.0
        for p in range(12):
            contact_column(s, W, k, p, True, -ck)
        pair_stiffness(s, W, C.i[k], C.j[k], K)
        W.Q[:] = 0.0
        for p in range(12):
            contact_column(s, W, k, p, False, -cc)
        pair_stiffness(s, W, C.i[k], C.j[k], S)


@inner
def contact_energy(s, W):
    """Elastic energy in contacts."""
    C, total = s.contacts, 0.0
    for k in range(C.kind.size):
        e, axle, motion = contact_state(s, k, W)
        depth, law = touch(C.kind[k], C.radius[k], motion[0], e, axle)[1], C.law[k]
        if depth > 0.0:
            total += law[0] * depth ** (law[1] + 1.0) / (law[1] + 1.0)
    return total
