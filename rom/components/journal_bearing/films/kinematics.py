"""How a journal moves in its bush, and the loads of a film on both.

Axes x, y, z are those of the bush, z along it, n is the axis of the journal and D leads from the
middle of the bush to a point of the axis of the journal. That axis meets the plane z = 0 of the
bush at (x, y) and is inclined there by (a, b),

    a = n_x / n_z,  b = n_y / n_z,  (x, y) = (D_x, D_y) - D_z (a, b),

which are the motion (x, y, -b, a) of `Cells`. The forces on it belong to loads on the markers by
their power, so that momentum is kept, and power that leaves the bodies is that of the film. All
functions take real or complex numbers, for derivatives by imaginary steps as in contacts.
"""

from rom.components.journal_bearing.films.cells import N_ANSWERS, RADIUS
from rom.components.journal_bearing.films.slopes import TORQUE_ANSWER
from rom.mbs.elements.contact.points import COMPLEX_STEP, stepped
from rom.mbs.kernels.algebra import add, cross, dot, mv, row, scale, sub, turn, unit_twist
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import spread_pair

ZERO = (0.0, 0.0, 0.0)


@inner
def journal_place(W, i, j, axes):
    """Axes x, y, z of the bush and n of the journal; D and its rate, both angular velocities."""
    n, z = turn(W.E, i, row(axes, 0, 0)), turn(W.E, j, row(axes, 1, 0))
    x = turn(W.E, j, row(axes, 2, 0))
    D, slide = sub(row(W.P, i, 0), row(W.P, j, 0)), sub(row(W.V, i, 0), row(W.V, j, 0))
    return (x, cross(z, x), z, n), (D, slide, row(W.V, i, 3), row(W.V, j, 3))


@inner
def journal_motion(axes, relative):
    """Motion of the journal in the bush, its rate, and its spin."""
    x, y, z, n = axes
    D, slide, Oi, Oj = relative
    O = sub(Oi, Oj)
    dD, dn, nz = sub(slide, cross(Oj, D)), cross(O, n), dot(n, z)
    a, b = dot(n, x) / nz, dot(n, y) / nz
    da, db = (dot(dn, x) - a * dot(dn, z)) / nz, (dot(dn, y) - b * dot(dn, z)) / nz
    Dz, dDz = dot(D, z), dot(dD, z)
    motion = dot(D, x) - Dz * a, dot(D, y) - Dz * b, -b, a
    rate = dot(dD, x) - dDz * a - Dz * da, dot(dD, y) - dDz * b - Dz * db, -db, da
    return motion, rate, dot(O, z)


@inner
def journal_wrench(axes, D, F, torque):
    """Force on the journal, moments on it and on the bush about their markers.

    F are the forces that work on the motion, the torque brakes the spin.
    """
    x, y, z, n = axes
    nz, Dz = dot(n, z), dot(D, z)
    a, b = dot(n, x) / nz, dot(n, y) / nz
    A, B = F[3] - Dz * F[0], -F[2] - Dz * F[1]
    force = add(add(scale(F[0], x), scale(F[1], y)), scale(-(F[0] * a + F[1] * b), z))
    tilting = add(add(scale(A / nz, x), scale(B / nz, y)), scale(-(A * a + B * b) / nz, z))
    moment = sub(cross(n, tilting), scale(torque, z))
    return force, moment, scale(-1.0, add(moment, cross(D, force)))


@inner
def answer_unit(journals, k, m):
    """Answer m of film k over the dimensionless one [N s, N m s]."""
    R, L, c = row(journals.films.size, k, RADIUS)
    if m == TORQUE_ANSWER:
        return journals.viscosity[k] * R**3 * L / c
    unit = journals.viscosity[k] * R * L * (R / c) ** 2
    return unit if m >= N_ANSWERS else unit * c / journals.scale[k, m]


@inner
def film_forces(journals, k, answer):
    """Forces that work on the motion, and the torque that brakes the spin."""
    x, y = answer_unit(journals, k, 0) * answer[0], answer_unit(journals, k, 1) * answer[1]
    a, b = answer_unit(journals, k, 2) * answer[2], answer_unit(journals, k, 3) * answer[3]
    return (x, y, a, b), answer_unit(journals, k, TORQUE_ANSWER) * answer[TORQUE_ANSWER]


@inner
def stepped_place(p, by_position, place):
    """The place with an imaginary step along unit motion, or velocity, p of both markers.

    In motions the twists of the markers stay; `carried_stiffness` has what they change by.
    """
    (x, y, z, n), (D, slide, Oi, Oj) = place
    vi, wi, vj, wj = unit_twist(p)
    if by_position:
        x, y = stepped(x, cross(wj, x)), stepped(y, cross(wj, y))
        axes = x, y, stepped(z, cross(wj, z)), stepped(n, cross(wi, n))
        moved, sliding = stepped(D, sub(vi, vj)), stepped(slide, ZERO)
        return axes, (moved, sliding, stepped(Oi, ZERO), stepped(Oj, ZERO))
    axes = stepped(x, ZERO), stepped(y, ZERO), stepped(z, ZERO), stepped(n, ZERO)
    return axes, (stepped(D, ZERO), stepped(slide, sub(vi, vj)), stepped(Oi, wi), stepped(Oj, wj))


@inner
def carried_twist(s, W, m, q):
    """How the twist of a marker changes with coordinate q of its body while its velocities stay."""
    b, H, whole = s.markers.body[m], W.H[m], row(W.V, m, 3)
    if q < 3:
        return ZERO, ZERO
    own, slip = whole, ZERO
    for k in range(s.bodies.r[b]):
        own = sub(own, scale(W.yd[b, k], (H[3, 6 + k], H[4, 6 + k], H[5, 6 + k])))
        slip = add(slip, scale(W.yd[b, k], (H[0, 6 + k], H[1, 6 + k], H[2, 6 + k])))
    if q < 6:
        axis = H[3, q], H[4, q], H[5, q]
        arm = mv(W.A[b], row(W.u, m, 0))
        return cross(axis, add(cross(own, arm), slip)), cross(axis, whole)
    return cross(own, (H[0, q], H[1, q], H[2, q])), ZERO


@inner
def carried_stiffness(s, W, pair, c, S):
    """Add c times what W.Q makes of the twists that positions change at given velocities to S."""
    width = W.H.shape[2]
    for side in range(2):
        m = pair[side]
        b = s.markers.body[m]
        for q in range(6 + s.bodies.r[b] if b >= 0 else 0):
            move, spin = carried_twist(s, W, m, q)
            for p in range(12):
                total = 0.0
                for x in range(3):
                    total += W.Q[p, 6 * side + x] * move[x] + W.Q[p, 6 * side + 3 + x] * spin[x]
                W.QH[p, width * side + q] = c * total
    spread_pair(s, W, pair[0], pair[1], S)


@inner
def imaginary(x):
    """Derivative of a vector from its imaginary step."""
    return x[0].imag / COMPLEX_STEP, x[1].imag / COMPLEX_STEP, x[2].imag / COMPLEX_STEP
