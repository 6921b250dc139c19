"""Straight pieces of a cable between eyelets and pulleys: lengths, gradients, second derivatives.

A piece goes from station a to station b, whose centres are D = x_b - x_a apart. A cable runs over
a pulley of radius R in the positive sense about its axis n; an eyelet is one of radius zero. With
axes that are parallel or opposite (s = 1 or -1) the piece is a common tangent of two circles and

    l = sqrt(D . D - (R_a - s R_b)^2),

also where the circles are not in one plane. Where it leaves pulley a is at the angle of D in the
plane of the pulley less arccos((R_a - s R_b) / rho), rho the length of D in this plane; where it
meets b at that less arccos((s R_a - R_b) / rho). A piece is measured from a point of the one pulley
to a point of the other, so that its length changes by dl + R_a da - R_b db: pulleys that turn wind
it up. Its force follows by virtual work; as a function of D and the axes alone it keeps momentum.
"""

import math

from rom.mbs.kernels.algebra import add, cross, dot, place, row, scale, sub, turn, unit
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import place_relative

DIFFERENCE_STEP_RATIO = 1e-5  # of central differences over the length of D; their error is 1e-10


@inner
def departure(D, n, shift):
    """Where a piece leaves a circle: angle from D [rad], and gradient of its direction by D.

    The shift is R_a - s R_b where it leaves, s R_a - R_b where it arrives. NaN if the other end
    lies within the circle of axis n.
    """
    flat = sub(D, scale(dot(D, n), n))
    rho2 = dot(flat, flat)
    reach = math.sqrt(rho2 - shift * shift)
    along, across = -shift / (rho2 * reach), 1.0 / rho2
    return math.atan2(reach, shift), add(scale(across, cross(n, D)), scale(along, flat))


@inner
def piece(D, na, nb, Ra, Rb):
    """Length of a piece along D, and its gradients by the centre of b, rotations of a and of b.

    Axes are na and nb, radii Ra and Rb, 0 for an eyelet; it is between points of the pulleys.
    """
    s = -1.0 if dot(na, nb) < 0.0 else 1.0
    shift, zero = Ra - s * Rb, (0.0, 0.0, 0.0)
    length = math.sqrt(dot(D, D) - shift * shift)
    force, ma, mb = scale(1.0 / length, D), zero, zero
    if Ra > 0.0:
        _, g = departure(D, na, shift)
        force, ma = add(force, scale(Ra, g)), scale(-Ra, cross(D, g))
    if Rb > 0.0:
        _, g = departure(D, nb, s * Ra - Rb)
        force, mb = sub(force, scale(Rb, g)), scale(Rb, cross(D, g))
    return length, force, ma, mb


@inner
def bearing_angle(D, n, e, shift):
    """Angle from the axis e of a pulley to where a piece along D touches it [rad]."""
    offset, _ = departure(D, n, shift)
    return math.atan2(dot(cross(n, e), D), dot(e, D)) - offset


@inner
def place_piece_stiffness(Q, c, D, axes, radii):
    """Add c times the second derivatives of the length of a piece to Q (12, 12).

    Order: position and small rotation, in the world, of a, then of b. Pieces between eyelets have
    theirs in closed form; at pulleys the gradients are differenced.
    """
    (na, nb), (Ra, Rb) = axes, radii
    if Ra == 0.0 and Rb == 0.0:
        length = math.sqrt(dot(D, D))
        e = scale(1.0 / length, D)
        for p in range(3):
            place_relative(Q, 0, p, c / length, sub(unit(p), scale(e[p], e)))
        return
    h = DIFFERENCE_STEP_RATIO
    for p in range(3):
        d = scale(h * math.sqrt(dot(D, D)), unit(p))
        one, two = piece(add(D, d), na, nb, Ra, Rb), piece(sub(D, d), na, nb, Ra, Rb)
        by = 0.5 * c / math.sqrt(dot(d, d))
        place_change(Q, 6 + p, by, one, two)
        place_change(Q, p, -by, one, two)
        if Ra > 0.0:
            t = scale(h, cross(unit(p), na))
            one, two = piece(D, add(na, t), nb, Ra, Rb), piece(D, sub(na, t), nb, Ra, Rb)
            place_change(Q, 3 + p, 0.5 * c / h, one, two)
        if Rb > 0.0:
            t = scale(h, cross(unit(p), nb))
            one, two = piece(D, na, add(nb, t), Ra, Rb), piece(D, na, sub(nb, t), Ra, Rb)
            place_change(Q, 9 + p, 0.5 * c / h, one, two)


@inner
def place_change(Q, j, c, one, two):
    """Add c times the change of the gradients of a piece to column j of Q."""
    force = sub(one[1], two[1])
    place(Q, 0, j, -c, force)
    place(Q, 3, j, c, sub(one[2], two[2]))
    place(Q, 6, j, c, force)
    place(Q, 9, j, c, sub(one[3], two[3]))


@inner
def turning(before, after):
    """Angle between two directions, and its gradients by them; zero where they are the same."""
    sine, cosine = cross(before, after), dot(before, after)
    size = math.sqrt(dot(sine, sine))
    zero = (0.0, 0.0, 0.0)
    if size == 0.0:
        return math.atan2(size, cosine), zero, zero
    one = scale(-1.0 / size, sub(after, scale(cosine, before)))
    two = scale(-1.0 / size, sub(before, scale(cosine, after)))
    return math.atan2(size, cosine), one, two


@inner
def directions(tendons, i):
    """Directions of the pieces before and behind station i."""
    before, after = row(tendons.gradient, i - 1, 6), row(tendons.gradient, i, 6)
    before = scale(1.0 / math.sqrt(dot(before, before)), before)
    return before, scale(1.0 / math.sqrt(dot(after, after)), after)


@inner
def place_turning_gradient(tendons, i):
    """Set how the angle changes by which a cable turns at eyelet i, from the bend of its pieces."""
    tendons.wrap_gradient[i, :] = 0.0
    _, one, two = turning(*directions(tendons, i))
    for side in range(2):
        k = i - 1 + side
        force = row(tendons.gradient, k, 6)
        by = scale(1.0 / math.sqrt(dot(force, force)), one if side == 0 else two)
        for q in range(12):
            change = by[0] * tendons.bend[k, q] + by[1] * tendons.bend[k, 12 + q]
            tendons.wrap_gradient[i, 6 * side + q] += change + by[2] * tendons.bend[k, 24 + q]


@inner
def pulley_axis(W, tendons, i):
    """Axis of station i in the world; that of an eyelet is without effect."""
    return turn(W.E, tendons.at[i], row(tendons.axes, i, 0))


@inner
def between(W, tendons, i):
    """Vector from the centre of station i to that of the next [m]."""
    return sub(row(W.P, tendons.at[i + 1], 0), row(W.P, tendons.at[i], 0))
