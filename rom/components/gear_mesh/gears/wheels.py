"""Where two wheels stand: their frame, their coordinates, and what these do to both markers.

Coordinates are the turns theta_1 and theta_2 of the wheels about the axis z of the pinion, against
the line of centres c; their distance a; the shift o of the gear along z; and the tilt z x n of its
axis n, along c and t = z x c. With D from the pinion to the gear, D = a c + o z. A rack has its
travel along t, across which c is, in the place of a turn: D = a c + y t + o z.
"""

import math

from rom.components.gear_mesh.gears import table as col
from rom.mbs.kernels.algebra import add, cross, dot, row, scale, sub, turn
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.coordinates import followed_angle


@inner
def involute(angle):
    """Tan a - a of a pressure angle."""
    return math.tan(angle) - angle


@inner
def wheel_axes(W, meshes, k):
    """Axis of the pinion, a direction across it; the same of the gear, in the world."""
    i, j, axes = meshes.i[k], meshes.j[k], meshes.axes
    one = turn(W.E, i, row(axes, k, 0)), turn(W.E, i, row(axes, k, 3))
    return *one, turn(W.E, j, row(axes, k, 6)), turn(W.E, j, row(axes, k, 9))


@inner
def turned(s, W, meshes, k, side, angle):
    """The angle of a wheel against the line of centres, over whole turns, from its start."""
    return followed_angle(s, W, meshes.remembered[k] + side, angle) - meshes.start[k, side]


@inner
def line_of_centres(W, meshes, k, z):
    """Axes c, t, z; distance, below zero inside a ring, and shift along the axis."""
    D = sub(row(W.P, meshes.j[k], 0), row(W.P, meshes.i[k], 0))
    shift = dot(D, z)
    flat = sub(D, scale(shift, z))
    distance = math.copysign(math.sqrt(dot(flat, flat)), meshes.size[k, col.RB_2])
    c = scale(1.0 / distance, flat)
    return (c, cross(z, c), z), distance, shift


@inner
def rack_frame(W, meshes, k):
    """Axes c, t, z; distance and travel of a rack, and shift along the axis."""
    z, _, _, u = wheel_axes(W, meshes, k)
    flat = sub(u, scale(dot(u, z), z))
    t = scale(1.0 / math.sqrt(dot(flat, flat)), flat)
    c, D = cross(t, z), sub(row(W.P, meshes.j[k], 0), row(W.P, meshes.i[k], 0))
    return (c, t, z), dot(D, c), dot(D, t), dot(D, z)


@inner
def set_rack(s, W, meshes, k):
    """Frame and state of mesh k with a rack, as `set_frame` has them."""
    _, e1, n, u = wheel_axes(W, meshes, k)
    size = meshes.size[k]
    (c, t, z), distance, travel, shift = rack_frame(W, meshes, k)
    turn_1 = turned(s, W, meshes, k, 0, math.atan2(dot(e1, t), dot(e1, c)))
    turn_1 += meshes.spin[k, 0] * W.signal[meshes.clock[0], 0]
    W.fresh[meshes.remembered[k] + 1] = meshes.start[k, 1]
    rolled = size[col.RB_1] * turn_1 + size[col.RB_2] * travel
    opened = (distance - size[col.RACK]) * math.sin(size[col.ALPHA])
    forward = size[col.RB_1] * (size[col.PHASE] + turn_1)
    lean = shift - size[col.OFFSET], -dot(n, t), dot(n, c)
    return (c, t, z, e1, n, u), size[col.ALPHA], (rolled, opened, forward), lean, (distance, travel)


@inner
def set_frame(s, W, meshes, k):
    """Frame and state of mesh k.

    Returns:
        Axes c, t, z, and e1, n2, e2 of `wheel_axes`; pressure angle, NaN without a common tangent;
        what rolled together, what the flanks opened, and where a working line begins [m]; shift
        along the axis [m] and tilt of the gear along c and t; distance and travel [m].
    """
    if meshes.size[k, col.RACK] > 0.0:
        return set_rack(s, W, meshes, k)
    z, e1, n2, e2 = wheel_axes(W, meshes, k)
    size = meshes.size[k]
    (c, t, z), distance, shift = line_of_centres(W, meshes, k, z)
    both = size[col.RB_1] + size[col.RB_2]
    alpha = math.acos(both / distance) if both / distance < 1.0 else math.nan
    time = W.signal[meshes.clock[0], 0]
    turn_1 = turned(s, W, meshes, k, 0, math.atan2(dot(e1, t), dot(e1, c)))
    turn_2 = turned(s, W, meshes, k, 1, math.atan2(dot(e2, t), dot(e2, c)))
    turn_1, turn_2 = turn_1 + meshes.spin[k, 0] * time, turn_2 + meshes.spin[k, 1] * time
    rolled = size[col.RB_1] * turn_1 + size[col.RB_2] * turn_2
    opened = both * (involute(alpha) - involute(size[col.ALPHA]))
    forward = size[col.RB_1] * (size[col.PHASE] + turn_1 + alpha - size[col.ALPHA])
    lean = shift - size[col.OFFSET], -dot(n2, t), dot(n2, c)
    return (c, t, z, e1, n2, e2), alpha, (rolled, opened, forward), lean, (distance, 0.0)


@inner
def put_rate(rates, s, D, of_1, of_2):
    """Write the derivatives of coordinate s by the way of the gear and the turns of both wheels."""
    for p in range(3):
        rates[s, p], rates[s, 6 + p] = -D[p], D[p]
        rates[s, 3 + p], rates[s, 9 + p] = of_1[p], of_2[p]


@inner
def set_rates(W, meshes, k):
    """Write the derivatives of the coordinates by the motions of both markers.

    The line of centres turns about z by chi = (t . dD + o c . dphi_1) / a; both turns fall by it.
    """
    if meshes.size[k, col.RACK] > 0.0:
        set_rack_rates(W, meshes, k)
        return
    z, _, n, e = wheel_axes(W, meshes, k)
    (c, t, z), a, o = line_of_centres(W, meshes, k, z)
    rates, none, lag = meshes.rates, (0.0, 0.0, 0.0), o / a
    chi = scale(1.0 / a, t)
    p, q, r = dot(e, c), dot(e, t), dot(e, z)
    n_c, n_t, n_z = dot(n, c), dot(n, t), dot(n, z)
    square = p * p + q * q
    swung = scale(r / square, add(scale(p, c), scale(q, t)))
    own = scale(1.0 / square, cross(e, sub(scale(p, t), scale(q, c))))
    put_rate(rates, col.TURN_1, scale(-1.0, chi), sub(z, scale(lag, c)), none)
    put_rate(rates, col.TURN_2, scale(-1.0, chi), sub(swung, scale(lag, c)), own)
    put_rate(rates, col.DISTANCE, c, scale(-o, t), none)
    put_rate(rates, col.SHIFT, z, scale(a, t), none)
    one, two = scale(n_c * lag - n_z, c), sub(scale(n_t * lag, c), scale(n_z, t))
    put_rate(rates, col.TILT_C, scale(n_c, chi), one, scale(-1.0, cross(n, t)))
    put_rate(rates, col.TILT_T, scale(n_t, chi), two, cross(n, c))


@inner
def set_rack_rates(W, meshes, k):
    """Write the derivatives of the coordinates of a rack.

    As it turns by dphi_2, and u along it leans to z, t goes towards c by omega = (dphi_2 . (u x c)
    - (u . z) dphi_1 . t) / |u - (u . z) z|.
    """
    _, _, n, u = wheel_axes(W, meshes, k)
    (c, t, z), a, y, o = rack_frame(W, meshes, k)
    rates, none, leans = meshes.rates, (0.0, 0.0, 0.0), dot(u, z)
    flat = math.sqrt(1.0 - leans * leans)
    one, two = scale(-leans / flat, t), scale(1.0 / flat, cross(u, c))
    n_c, n_t, n_z = dot(n, c), dot(n, t), dot(n, z)
    put_rate(rates, col.TURN_1, none, add(z, one), two)
    put_rate(rates, col.TURN_2, t, add(scale(a, one), scale(o, c)), scale(a, two))
    put_rate(rates, col.DISTANCE, c, sub(scale(-y, one), scale(o, t)), scale(-y, two))
    put_rate(rates, col.SHIFT, z, sub(scale(a, t), scale(y, c)), none)
    one_c, two_c = sub(scale(-n_c, one), scale(n_z, c)), sub(scale(-n_c, two), cross(n, t))
    one_t, two_t = sub(scale(-n_t, one), scale(n_z, t)), sub(cross(n, c), scale(n_t, two))
    put_rate(rates, col.TILT_C, none, one_c, two_c)
    put_rate(rates, col.TILT_T, none, one_t, two_t)


@inner
def set_speed(W, meshes, k):
    """Write the rates of the coordinates."""
    for a in range(col.COORDINATES):
        meshes.speed[a] = 0.0
        for p in range(6):
            meshes.speed[a] += meshes.rates[a, p] * W.V[meshes.i[k], p]
            meshes.speed[a] += meshes.rates[a, 6 + p] * W.V[meshes.j[k], p]
    meshes.speed[col.TURN_1] += meshes.spin[k, 0]
    meshes.speed[col.TURN_2] += meshes.spin[k, 1]


@inner
def push_wheels(W, meshes, k):
    """Add to the wrenches on both markers what lowers the energy, and damps.

    What keeps wheels spinning in their frames works against it.
    """
    W.power[1] += meshes.gradient[col.TURN_1] * meshes.spin[k, 0]
    W.power[1] += meshes.gradient[col.TURN_2] * meshes.spin[k, 1]
    for a in range(col.COORDINATES):
        for p in range(6):
            W.wrench[meshes.i[k], p] -= meshes.gradient[a] * meshes.rates[a, p]
            W.wrench[meshes.j[k], p] -= meshes.gradient[a] * meshes.rates[a, 6 + p]


@inner
def stiffen_wheels(meshes):
    """Add how forces along the coordinates change to the tangents by the motions."""
    rates, tangent = meshes.rates, meshes.tangent
    for kind in range(2):
        for a in range(col.COORDINATES):
            for q in range(12):
                total = 0.0
                for b in range(col.COORDINATES):
                    total += meshes.hessian[kind, a, b] * rates[b, q]
                for p in range(12):
                    tangent[kind, p, q] += rates[a, p] * total


@inner
def turn_forces(meshes, axes, distance):
    """Add how forces turn with the line of centres.

    With h = dE / d(theta_1 + theta_2) the second derivatives by the way of the gear are
    h (c t + t c) / a^2 + dE/da t t / a.
    """
    (c, t), gradient, tangent = (axes[0], axes[1]), meshes.gradient, meshes.tangent
    about = (gradient[col.TURN_1] + gradient[col.TURN_2]) / (distance * distance)
    apart = gradient[col.DISTANCE] / distance
    for p in range(3):
        for q in range(3):
            turning = about * (c[p] * t[q] + t[p] * c[q]) + apart * t[p] * t[q]
            for side in range(2):
                tangent[0, 6 * side + p, 6 * side + q] += turning
                tangent[0, 6 * side + p, 6 - 6 * side + q] -= turning
