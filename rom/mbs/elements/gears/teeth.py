"""Contact of gear teeth in thin slices on the base plane, between bodies that move at will.

The axis of the pinion and the line of centres make the frame: c along it, z along the axis, t = z x
c. Inside an internal gear, whose radii and distance are negative, c points away from its centre.
Wheels turn by theta_1 and theta_2 about z against this line. With base radii r_b, working pressure
angle alpha(distance) and the value alpha_0 at the datum flanks approach by

    cos(beta_b) (side (r_b1 theta_1 + r_b2 theta_2) - (r_b1 + r_b2) (inv alpha - inv alpha_0)),

side 1 for working and -1 for back flanks; this is exact for involutes in one plane. Shifts along
the axis and tilts of the gear against the pinion add their first order. A slice pushes both wheels
at the same point, so that momentum is kept whatever they do.
"""

import math

from rom.mbs.elements.cylinders import (
    Cylinders,
    add_gradient_products,
    at_place,
    deform,
    load_surface,
    set_basis,
    set_gradient,
    spread_surface_loads,
)
from rom.mbs.elements.pair_motion import clear_tangent, followed_angle, place_tangent
from rom.mbs.kernels.algebra import add, cross, dot, put, row, scale, sub, turn
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.tables import Array1, Array2, Index1, Scratch1, Scratch3, Table, table

# columns of Meshes.size, Meshes.flank and Meshes.law
RB_1, RB_2, RA_1, RA_2, HELIX, PITCH, THICKNESS = range(7)
BACKLASH, ALPHA, WIDTH, OFFSET, PHASE, ENTRY = range(7, 13)
RELIEF_1, RELIEF_2, EXTENT_1, EXTENT_2, POWER, CROWNING, SLOPE = range(7)
DAMPING, FRICTION, SPEED = range(3)
SIDE, PLACE, HEIGHT, LENGTH, LOAD = range(5)  # columns of Meshes.slices
# what `add_slices` adds up
FORCES, TANGENTS, ENERGY = range(3)


@table
class Meshes(Table):
    """All meshes.

    Attributes:
        i, j: (k,) markers of pinion and gear.
        axes: (k, 12) axis of the pinion, a direction across it, the same of the gear, in the axes
            of their markers.
        size: (k, 13) base radii, tip radii [m], base helix [rad], base pitch, thickness of the
            pinion's teeth on the base circle, backlash [m], working pressure angle at the datum
            [rad], width, offset of the faces [m], angle of the pinion at the datum [rad], length
            of entry [m].
        flank: (k, 7) tip relief of pinion and gear, their extents [m], power, crowning, slope [m].
        law: (k, 3) damping [s], coefficient of friction, transition speed [m/s].
        cells: (k,) slices across the face.
        stiffness_at, stiffness: (k + 1,) where the tables begin [N/m^2].
        pitch_at, pitch: (2 k + 1,) where the pitch errors of wheels begin [m].
        remembered: (k,) first of two angles that are followed.
        start: (k, 2) these angles at the datum [rad].
        load: (k,) sum of the normal forces at the last residual; NaN without a common tangent [N].
        slices: (k, m, 5) of all that bear at the last residual: side, place on the path of
            contact, height over the middle of the face, length of the line [m], force [N].
        n_slices: (k,) how many.
        rims: how the rims of flexible wheels deform.
        factor: (2,) of stiffness and damping in the tangents.
        tangent: (2, 12, 12) of one mesh, by motions and velocities.
    """

    i: Index1
    j: Index1
    axes: Array2
    size: Array2
    flank: Array2
    law: Array2
    cells: Index1
    stiffness_at: Index1
    stiffness: Array1
    pitch_at: Index1
    pitch: Array1
    remembered: Index1
    start: Array2
    load: Scratch1
    slices: Scratch3
    n_slices: Scratch1
    rims: Cylinders
    factor: Scratch1
    tangent: Scratch3


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
def set_frame(s, W, meshes, k):
    """Frame and state of mesh k.

    Returns:
        Axes c, t, z, and e1, n2, e2 of `wheel_axes`; pressure angle, NaN without a common tangent;
        what rolled together, what the flanks opened, and where a working line begins [m]; shift
        along the axis [m] and tilt of the gear; distance [m].
    """
    z, e1, n2, e2 = wheel_axes(W, meshes, k)
    size = meshes.size[k]
    D = sub(row(W.P, meshes.j[k], 0), row(W.P, meshes.i[k], 0))
    offset = dot(D, z)
    flat = sub(D, scale(offset, z))
    distance = math.copysign(math.sqrt(dot(flat, flat)), size[RB_2])
    c = scale(1.0 / distance, flat)
    t = cross(z, c)
    both = size[RB_1] + size[RB_2]
    alpha = math.acos(both / distance) if both / distance < 1.0 else math.nan
    turn_1 = turned(s, W, meshes, k, 0, math.atan2(dot(e1, t), dot(e1, c)))
    turn_2 = turned(s, W, meshes, k, 1, math.atan2(dot(e2, t), dot(e2, c)))
    rolled = size[RB_1] * turn_1 + size[RB_2] * turn_2
    opened = both * (involute(alpha) - involute(size[ALPHA]))
    forward = size[RB_1] * (size[PHASE] + turn_1 + alpha - size[ALPHA])
    axes, lean = (c, t, z, e1, n2, e2), (offset - size[OFFSET], cross(z, n2))
    return axes, alpha, (rolled, opened, forward), lean, distance


@inner
def stiffness_at(meshes, k, x, path):
    """Stiffness of a pair of teeth per length of its line, at a place of its path [N/m^2]."""
    first, n = meshes.stiffness_at[k], meshes.stiffness_at[k + 1] - meshes.stiffness_at[k]
    share = min(max((x - path[0]) / (path[1] - path[0]), 0.0), 1.0) * (n - 1)
    p = min(int(share), max(n - 2, 0))
    low, high = meshes.stiffness[first + p], meshes.stiffness[first + min(p + 1, n - 1)]
    inside = min(x - path[0], path[1] - x)
    entry = meshes.size[k, ENTRY]
    taken = min(0.5 + inside / entry, 1.0) if entry > 0.0 else 1.0
    return taken * (low + (share - p) * (high - low))


@inner
def flank_gap(meshes, k, place, path):
    """Normal gap of the unloaded flanks at the datum [m]."""
    side, line, x, z = place
    size, flank = meshes.size[k], meshes.flank[k]
    if side < 0.0:
        return size[BACKLASH] * math.cos(size[HELIX])
    gap, width = 0.0, size[WIDTH]
    if flank[EXTENT_1] > 0.0:
        beyond = (x - path[1]) / flank[EXTENT_1] + 1.0
        gap += flank[RELIEF_1] * max(beyond, 0.0) ** flank[POWER]
    if flank[EXTENT_2] > 0.0:
        beyond = (path[0] - x) / flank[EXTENT_2] + 1.0
        gap += flank[RELIEF_2] * max(beyond, 0.0) ** flank[POWER]
    gap += flank[CROWNING] * (2.0 * z / width) ** 2
    gap += flank[SLOPE] * z / width + 0.5 * abs(flank[SLOPE])
    for wheel in range(2):
        first, end = meshes.pitch_at[2 * k + wheel], meshes.pitch_at[2 * k + wheel + 1]
        if end > first:
            gap += meshes.pitch[first + (-line) % (end - first)]
    return gap


@inner
def add_slices(s, W, meshes, k, what):
    """Go over the contact lines of both flanks of mesh k, cut where they leave path and face.

    Returns:
        Energy of the slices, if it is asked for.
    """
    size, total = meshes.size[k], 0.0
    axes, alpha, (rolled, opened, forward), lean, distance = set_frame(s, W, meshes, k)
    if what == FORCES:  # not a number without a common tangent, which ends the motion
        meshes.load[k], meshes.n_slices[k] = 0.0 * alpha, 0.0
        W.wrench[meshes.i[k], 0] += 0.0 * alpha
    base, slant = size[RB_1], math.tan(size[HELIX])
    reach = math.copysign(math.sqrt(size[RA_2] ** 2 - size[RB_2] ** 2), size[RB_2])
    first = (base + size[RB_2]) * math.tan(alpha) - reach
    last = math.sqrt(size[RA_1] ** 2 - base**2)
    if not first < last:  # the teeth are too far apart to meet, or there is no common tangent
        return total
    cells, width, reach = meshes.cells[k], size[WIDTH], abs(slant) * size[WIDTH] / 2
    begin, end = first - 0.5 * size[ENTRY], last + 0.5 * size[ENTRY]
    for flank in range(2):
        side = 1.0 - 2.0 * flank
        start = forward if flank == 0 else size[THICKNESS] + 2.0 * base * alpha - forward
        lowest = math.floor((begin - start - reach) / size[PITCH])
        lines = int(math.ceil((end - start + reach) / size[PITCH]) - lowest) + 1
        closing = side * rolled - opened
        for one in range(lines):
            line = int(lowest) + one
            at = start + line * size[PITCH]
            low, high = face_of_line(at, side * slant, begin, end, width)
            for cell in range(cells):
                a = max(low, -0.5 * width + cell * width / cells)
                b = min(high, -0.5 * width + (cell + 1) * width / cells)
                if b - a > 1e-15:
                    z = 0.5 * (a + b)
                    x = at + side * slant * z
                    length = (b - a) * math.sqrt(1.0 + slant * slant)
                    place = side, line, x, z
                    state = axes, alpha, closing, lean, distance, (first, last)
                    total += press(s, W, meshes, k, what, place, length, state)
    return total


@inner
def face_of_line(at, slant, first, last, width):
    """Range of the face over which a contact line is within the path."""
    if slant == 0.0:
        return (-0.5 * width, 0.5 * width) if first <= at < last else (1.0, -1.0)
    one, two = (first - at) / slant, (last - at) / slant
    return max(min(one, two), -0.5 * width), min(max(one, two), 0.5 * width)


@inner
def press(s, W, meshes, k, what, place, length, state):  # noqa: PLR0913
    """Let one slice push both wheels, or add its tangents; its energy."""
    side, _, x, height = place
    (c, t, z, e1, n2, e2), alpha, closing, (shift, tilt), distance, path = state
    size, law = meshes.size[k], meshes.law[k]
    cosine, sine, lead = math.cos(alpha), math.sin(alpha), math.cos(size[HELIX])
    along = add(scale(sine, c), scale(side * cosine, t))
    n = sub(scale(lead, along), scale(side * math.sin(size[HELIX]), z))
    foot = sub(scale(size[RB_1] * cosine, c), scale(side * size[RB_1] * sine, t))
    arm_1 = add(add(foot, scale(x, along)), scale(height, z))  # from the middle of the pinion
    arm_2 = sub(arm_1, scale(distance, c))
    depth = lead * closing - dot(n, z) * shift - dot(cross(arm_2, n), tilt)
    depth -= flank_gap(meshes, k, place, path)
    place_on_rims(s, W, meshes, k, arm_1, (z, e1, n2, e2))
    depth += closing_of_rims(s, W, meshes, k, n, meshes.rims.amplitude)
    if depth <= 0.0:
        return 0.0
    stiffness = length * stiffness_at(meshes, k, x, path)
    if what == ENERGY:
        return 0.5 * stiffness * depth * depth
    i, j = meshes.i[k], meshes.j[k]
    arm_2 = sub(arm_1, sub(row(W.P, j, 0), row(W.P, i, 0)))
    slide = add(row(W.V, i, 0), cross(row(W.V, i, 3), arm_1))
    slide = sub(slide, add(row(W.V, j, 0), cross(row(W.V, j, 3), arm_2)))
    rate, across = dot(n, slide), cross(z, along)
    rate += closing_of_rims(s, W, meshes, k, n, meshes.rims.rate)
    loss, by_depth, by_rate = law[DAMPING] * rate, 1.0, law[DAMPING]
    if abs(loss) > depth:  # flanks do not pull, and their force does not jump as they touch
        by_depth, by_rate = 1.0 + math.copysign(1.0, loss), 0.0
        loss = math.copysign(depth, loss)
    load = stiffness * (depth + loss)
    speed = dot(across, slide) + closing_of_rims(s, W, meshes, k, across, meshes.rims.rate)
    grip = law[FRICTION] * math.tanh(speed / law[SPEED])
    force = add(n, scale(grip, across))
    if what == TANGENTS and load > 0.0:
        slope = (1.0 - math.tanh(speed / law[SPEED]) ** 2) / law[SPEED]
        factors = stiffness * by_depth, stiffness * by_rate, law[FRICTION] * load * slope
        arms, directions = (arm_1, arm_2), (n, force, across)
        if meshes.rims.of[k, 0] < 0 and meshes.rims.of[k, 1] < 0:
            add_slice_tangent(meshes, factors, directions, arms)
        else:
            add_rim_tangent(s, W, meshes, k, factors, directions, arms)
    if what == TANGENTS:
        return 0.0
    meshes.load[k] += load
    record_slice(meshes, k, place, length, load)
    add_force(W.wrench[i], arm_1, scale(-load, force))
    add_force(W.wrench[j], arm_2, scale(load, force))
    load_rims(s, W, meshes, k, scale(load, force))
    W.power[2] += (load - stiffness * depth) * rate + load * grip * speed
    return 0.0


@inner
def add_slice_tangent(meshes, factors, directions, arms):
    """Add a slice between wheels that are rigid beside their markers to meshes.tangent."""
    (by_depth, by_rate, by_slip), (n, force, across), (arm_1, arm_2) = factors, directions, arms
    for p in range(12):
        gained = motion_part(force, arm_1, arm_2, p)
        rub = by_slip * motion_part(across, arm_1, arm_2, p)
        for q in range(12):
            normal = motion_part(n, arm_1, arm_2, q)
            slip = rub * motion_part(across, arm_1, arm_2, q)
            meshes.tangent[0, p, q] += gained * by_depth * normal
            meshes.tangent[1, p, q] += gained * by_rate * normal + slip


@inner
def add_rim_tangent(s, W, meshes, k, factors, directions, arms):
    """Add a slice between wheels whose rims deform to W.Kt and W.S."""
    (by_depth, by_rate, by_slip), (n, force, across) = factors, directions
    ck, cc = meshes.factor[0], meshes.factor[1]
    markers = meshes.i[k], meshes.j[k]
    set_rim_gradients(s, W, meshes, k, 0, force, arms)
    set_rim_gradients(s, W, meshes, k, 2, n, arms)
    add_gradient_products(s, meshes.rims.gradient, markers, ck * by_depth, W.Kt)
    if by_rate > 0.0:
        add_gradient_products(s, meshes.rims.gradient, markers, cc * by_rate, W.S)
    if by_slip > 0.0:
        set_rim_gradients(s, W, meshes, k, 0, across, arms)
        set_rim_gradients(s, W, meshes, k, 2, across, arms)
        add_gradient_products(s, meshes.rims.gradient, markers, cc * by_slip, W.S)


@inner
def set_rim_gradients(s, W, meshes, k, first, e, arms):
    """How a slice closes along e per velocity of the pinion, row ``first``, and of the gear."""
    rims, i, j = meshes.rims, meshes.i[k], meshes.j[k]
    back = scale(-1.0, e)
    set_gradient(s, W, rims, (first, rims.of[k, 0], 0), i, e, cross(arms[0], e))
    set_gradient(s, W, rims, (first + 1, rims.of[k, 1], 1), j, back, cross(arms[1], back))


@inner
def place_on_rims(s, W, meshes, k, arm, axes):
    """Find the place of a slice, at an arm from the middle of the pinion, on rims that deform."""
    z, e1, n2, e2 = axes
    i, j, rims = meshes.i[k], meshes.j[k], meshes.rims
    for side in range(2):
        c, axis, across = rims.of[k, side], (z if side == 0 else n2), (e1 if side == 0 else e2)
        if c < 0:
            continue
        x = arm if side == 0 else sub(arm, sub(row(W.P, j, 0), row(W.P, i, 0)))
        angle = math.atan2(dot(x, cross(axis, across)), dot(x, across))
        set_basis(rims, c, side, angle, dot(x, axis))


@inner
def closing_of_rims(s, W, meshes, k, e, amplitude):
    """How rims that deform by an amplitude close a slice along e, or how fast."""
    rims, total = meshes.rims, 0.0
    for side in range(2):
        c, b = rims.of[k, side], s.markers.body[meshes.i[k] if side == 0 else meshes.j[k]]
        if c >= 0:
            total += (1.0 - 2.0 * side) * dot(e, at_place(W, rims, c, side, b, amplitude))
    return total


@inner
def load_rims(s, W, meshes, k, force):
    """Let the force of a slice on the gear act on rims that deform."""
    rims = meshes.rims
    for side in range(2):
        c, b = rims.of[k, side], s.markers.body[meshes.i[k] if side == 0 else meshes.j[k]]
        if c >= 0:
            load_surface(W, rims, c, side, b, scale(2.0 * side - 1.0, force))


@inner
def deform_rims(s, meshes, k, q, v):
    """How the rims of mesh k deform."""
    for side in range(2):
        c, b = meshes.rims.of[k, side], s.markers.body[meshes.i[k] if side == 0 else meshes.j[k]]
        if c >= 0:
            deform(s, meshes.rims, c, b, q, v)


@inner
def record_slice(meshes, k, place, length, load):
    """Remember a slice that bears, as far as there is room."""
    n = int(meshes.n_slices[k])
    if n < meshes.slices.shape[1]:
        side, _, x, z = place
        found = meshes.slices[k, n]
        found[SIDE], found[PLACE], found[HEIGHT], found[LENGTH], found[LOAD] = (
            side, x, z, length, load)  # fmt: skip
        meshes.n_slices[k] += 1.0


@inner
def add_force(wrench, arm, force):
    """Add a force at an arm from a marker to its wrench."""
    put(wrench, 0, force)
    put(wrench, 3, cross(arm, force))


@inner
def motion_part(e, arm_1, arm_2, p):
    """Entry p of (e, arm_1 x e, -e, -arm_2 x e): what a motion of the wheels does along e."""
    if p < 3:
        return e[p]
    if p < 6:
        return cross(arm_1, e)[p - 3]
    return -e[p - 6] if p < 9 else -cross(arm_2, e)[p - 9]


@residuals.of(Meshes)
def mesh_wrenches(s, W, meshes, q, v, _lam):
    """Add the teeth to the wrenches on the markers and forces on rims; add up the power lost."""
    for k in range(meshes.i.size):
        deform_rims(s, meshes, k, q, v)
        add_slices(s, W, meshes, k, FORCES)
        for side in range(2):
            c, m = meshes.rims.of[k, side], (meshes.i[k] if side == 0 else meshes.j[k])
            if c >= 0:
                spread_surface_loads(s, W, meshes.rims, c, s.markers.body[m])


@tangents.of(Meshes)
def mesh_tangents(s, W, meshes, _lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S.

    Left out is how the direction of the forces changes, which is to the stiffness of the teeth as
    their deflection to the radii, and how flank corrections and stiffness move along the path.
    """
    meshes.factor[0], meshes.factor[1] = ck, cc
    for k in range(meshes.i.size):
        clear_tangent(meshes.tangent)
        add_slices(s, W, meshes, k, TANGENTS)
        place_tangent(s, W, (meshes.i[k], meshes.j[k]), meshes.tangent, ck, cc)


@energy.of(Meshes)
def mesh_energy(s, W, meshes, q, v):
    """Energy stored in teeth."""
    total = 0.0
    for k in range(meshes.i.size):
        deform_rims(s, meshes, k, q, v)
        total += add_slices(s, W, meshes, k, ENERGY)
    return total
