"""Contact of gear teeth in thin slices on the base plane, between bodies that move at will.

The axis of the pinion and the line of centres make the frame: c along it, z along the axis, t = z x
c. Inside an internal gear, whose radii and distance are negative, c points away from its centre.
Wheels turn by theta_1 and theta_2 about z against this line. With base radii r_b, working pressure
angle alpha(distance) and the value alpha_0 at the datum flanks approach by

    cos(beta_b) (side (r_b1 theta_1 + r_b2 theta_2) - (r_b1 + r_b2) (inv alpha - inv alpha_0)),

side 1 for working and -1 for back flanks; this is exact for involutes in one plane. Shifts along
the axis and tilts of the gear against the pinion add their first order.

The energy of a slice depends on the coordinates of the wheels through its depth and, as lines move
along the path and over the face, through its stiffness, gap and length. Forces are its gradient, so
that momentum and energy are kept whatever the wheels do. Damping and friction push both wheels at
the point of contact.
"""

import math

from rom.mbs.elements.gears.coupling import add_line_stiffness, bear_line
from rom.mbs.elements.gears.elasticity import table_at, taken_up
from rom.mbs.elements.gears.flanks import flank_gap
from rom.mbs.elements.gears.rims import (
    bend_rims,
    closing_of_rims,
    deform_rims,
    has_rims,
    place_on_rims,
)
from rom.mbs.elements.gears.sliding import contact_point, damp, rub
from rom.mbs.elements.gears.table import (
    ALPHA,
    BACKLASH,
    BY_CONSTANT,
    BY_DEPTH,
    BY_STIFFNESS,
    BY_WEIGHT,
    CONSTANT,
    CONSTANT_AT,
    CONSTANT_FIRST,
    COORDINATES,
    COUPLING,
    DAMPING,
    DEPTH,
    DEPTH_AT,
    DEPTH_FIRST,
    DISTANCE,
    ENERGY,
    ENTRY,
    FIRST_GRADIENT,
    FOLLOWS,
    FORCE,
    FORCES,
    FRICTION,
    HEIGHT,
    HELIX,
    HERTZ,
    LEAST,
    LEAST_BACK,
    LENGTH,
    LENGTH_OF_LINE,
    LOAD,
    LOSS,
    PITCH,
    PLACE,
    RA_1,
    RA_2,
    RB_1,
    RB_2,
    SHIFT,
    SIDE,
    STEEP,
    STIFFNESS,
    STIFFNESS_AT,
    STIFFNESS_FIRST,
    STORED,
    TANGENTS,
    THICKNESS,
    TILT_C,
    TILT_T,
    TURN_1,
    TURN_2,
    VISCOUS,
    WEIGHT,
    WEIGHT_AT,
    WEIGHT_FIRST,
    WIDTH,
    WORK_CONSTANT,
    WORK_STIFFNESS,
    WORK_WEIGHT,
    Meshes,
    X,
    Z,
)
from rom.mbs.elements.gears.wheels import (
    push_wheels,
    set_frame,
    set_rates,
    set_speed,
    stiffen_wheels,
    turn_forces,
)
from rom.mbs.elements.pair_motion import clear_tangent, place_tangent
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.element_calls import energy, residuals, tangents


@inner
def path_of_contact(size, alpha):
    """First and last place of contact, from T1, and the first at the datum [m]."""
    reach = math.copysign(math.sqrt(size[RA_2] ** 2 - size[RB_2] ** 2), size[RB_2])
    both = size[RB_1] + size[RB_2]
    last = math.sqrt(size[RA_1] ** 2 - size[RB_1] ** 2)
    return both * math.tan(alpha) - reach, last, both * math.tan(size[ALPHA]) - reach


@inner
def add_lines(s, W, meshes, k, what):
    """Go over the contact lines of both flanks of mesh k; what they store.

    Args:
        s: system.
        W: work.
        meshes: all of them.
        k: which.
        what: FORCES, TANGENTS or ENERGY.
    """
    state, total = set_frame(s, W, meshes, k), 0.0
    path = path_of_contact(meshes.size[k], state[1])
    if what == FORCES:  # not a number without a common tangent, which ends the motion
        meshes.load[k], meshes.n_slices[k] = 0.0 * state[1], 0.0
        W.wrench[meshes.i[k], 0] += 0.0 * state[1]
        rolled, opened, _ = state[2]
        meshes.approach[k] = max(rolled, -rolled - meshes.size[k, BACKLASH]) - opened
    if not path[0] < path[1]:  # too far apart to meet, or there is no common tangent
        return 0.0
    clear_sums(meshes)
    if what != ENERGY:
        set_rates(W, meshes, k)
        set_speed(W, meshes, k)
    for side in (1.0, -1.0):
        if not clear_of_each_other(meshes, k, side, state):
            total += add_flank(s, W, meshes, k, what, (side, state), path)
    if what == FORCES:
        push_wheels(W, meshes, k)
    elif what == TANGENTS:
        stiffen_wheels(meshes)
        if meshes.law[k, FOLLOWS] > 0.0:
            turn_forces(meshes, state[0], state[4])
    return total


@inner
def add_flank(s, W, meshes, k, what, place, path):
    """Go over the contact lines of working or back flanks; what they store."""
    (side, state), size, total = place, meshes.size[k], 0.0
    begin, end = path[0] - 0.5 * size[ENTRY], path[1] + 0.5 * size[ENTRY]
    reach = abs(math.tan(size[HELIX])) * size[WIDTH] / 2
    start = line_start(size, side, state)
    lowest = math.floor((begin - start - reach) / size[PITCH])
    lines = math.ceil((end - start + reach) / size[PITCH]) - lowest + 1
    for line in range(lowest, lowest + lines):
        at = side, line, start + line * size[PITCH]
        count = set_line(s, W, meshes, k, at, state, path)
        if count > 0:
            bear_line(meshes, k, count)
            for cell in range(count):
                total += meshes.line[cell, STORED]
            if what != ENERGY:
                push_line(s, W, meshes, k, what, count, place)
    return total


@inner
def clear_sums(meshes):
    """Empty the derivatives of the energy by the coordinates."""
    for a in range(COORDINATES):
        meshes.gradient[a] = 0.0
        for b in range(COORDINATES):
            meshes.hessian[0, a, b], meshes.hessian[1, a, b] = 0.0, 0.0


@inner
def clear_of_each_other(meshes, k, side, state):
    """Whether no slice of a flank can touch: its depth is bounded by the arms of all."""
    size = meshes.size[k]
    if has_rims(meshes, k):
        return False
    _, _, (rolled, opened, _), (shift, tilt_c, tilt_t), _ = state
    arm = 2.0 * abs(size[RA_2]) + size[WIDTH]
    most = math.cos(size[HELIX]) * (side * rolled - opened) + abs(shift)
    most += arm * (abs(tilt_c) + abs(tilt_t))
    return most < meshes.flank[k, LEAST if side > 0.0 else LEAST_BACK]


@inner
def line_start(size, side, state):
    """Where line 0 is on the path, in the middle of the face [m]."""
    alpha, forward = state[1], state[2][2]
    return forward if side > 0.0 else size[THICKNESS] + 2.0 * size[RB_1] * alpha - forward


@inner
def set_line(s, W, meshes, k, at, state, path):
    """Write the slices of a line that is within path and face; how many they are.

    Args:
        s: system.
        W: work.
        meshes: all of them.
        k: which.
        at: side of the flank, number of the line, where it is in the middle of the face [m].
        state: of the wheels.
        path: first and last place of contact, and the first at the datum [m].
    """
    size, cells, count, nearest = meshes.size[k], meshes.cells[k], 0, -1.0
    width, slant = size[WIDTH], at[0] * math.tan(size[HELIX])
    begin, end = path[0] - 0.5 * size[ENTRY], path[1] + 0.5 * size[ENTRY]
    low, high = face_of_line(at[2], slant, begin, end, width)
    for cell in range(cells):
        edges = -0.5 * width + cell * width / cells, -0.5 * width + (cell + 1) * width / cells
        if min(high, edges[1]) - max(low, edges[0]) > 1e-15:
            ends = (low, high), edges
            depth = set_slice(s, W, meshes, k, count, (at, ends, slant, path), state)
            nearest = max(nearest, depth)
            if depth > 0.0 or meshes.law[k, COUPLING] > 0.0:
                count += 1
    return count if nearest > 0.0 else 0


@inner
def face_of_line(at, slant, first, last, width):
    """Range of the face over which a contact line is within the path."""
    if slant == 0.0:
        return (-0.5 * width, 0.5 * width) if first <= at < last else (1.0, -1.0)
    one, two = (first - at) / slant, (last - at) / slant
    return max(min(one, two), -0.5 * width), min(max(one, two), 0.5 * width)


@inner
def moving_ends(ends, width, slant):
    """Ends of a slice on the face, and how they go as the line, and the path's begin, go on.

    Returns:
        Lower and upper end; their rates by the line; by the begin of the path.
    """
    (low, high), (left, right) = ends
    a, b, a_at, b_at, a_first, b_first = max(low, left), min(high, right), 0.0, 0.0, 0.0, 0.0
    if low > left and low > -0.5 * width:
        a_at, a_first = -1.0 / slant, (1.0 / slant if slant > 0.0 else 0.0)
    if high < right and high < 0.5 * width:
        b_at, b_first = -1.0 / slant, (1.0 / slant if slant < 0.0 else 0.0)
    return (a, b), (a_at, b_at), (a_first, b_first)


@inner
def set_slice(s, W, meshes, k, cell, line, state):
    """Write place, depth, weight and stiffness of a slice and their rates; its depth."""
    (side, number, at), ends, slant, path = line
    size, one = meshes.size[k], meshes.line[cell]
    (a, b), (a_at, b_at), (a_first, b_first) = moving_ends(ends, size[WIDTH], slant)
    z = 0.5 * (a + b)
    x = at + slant * z
    gap, gap_x, gap_z, gap_first = flank_gap(meshes, k, (side, number, x, z), path)
    depth, depth_x, depth_z = depth_at(size, (side, x, z), state)
    depth -= gap
    if has_rims(meshes, k):
        arms, n, _ = contact_point(W, meshes, k, (side, x, z), state)
        place_on_rims(s, W, meshes, k, arms[0], state[0])
        depth += closing_of_rims(s, W, meshes, k, n, meshes.rims.amplitude)
    one[X], one[Z], one[DEPTH] = x, z, depth
    if depth <= 0.0 and meshes.law[k, COUPLING] == 0.0:
        return depth
    follows, along = meshes.law[k, FOLLOWS], math.sqrt(1.0 + slant * slant)
    z_at, z_first = 0.5 * (a_at + b_at), 0.5 * (a_first + b_first)
    x_at, x_first = 1.0 + slant * z_at, slant * z_first
    depth_x, depth_z = depth_x - gap_x, depth_z - gap_z
    one[DEPTH_AT] = follows * (depth_x * x_at + depth_z * z_at)
    one[DEPTH_FIRST] = follows * (depth_x * x_first + depth_z * z_first - gap_first)
    share, share_x, share_first = taken_up(size[ENTRY], x, path)
    length = (b - a) * along
    one[WEIGHT], one[LENGTH_OF_LINE] = length * share, length
    one[WEIGHT_AT] = follows * (along * (b_at - a_at) * share + length * share_x * x_at)
    one[WEIGHT_FIRST] = follows * (
        along * (b_first - a_first) * share + length * (share_x * x_first + share_first)
    )
    set_stiffness(meshes, k, cell, (x, x_at, x_first), path)
    return depth


@inner
def set_stiffness(meshes, k, cell, place, path):
    """Write the stiffness of a slice and the constant of its contact, and their rates."""
    x, x_at, x_first = place
    one, follows, length = meshes.line[cell], meshes.law[k, FOLLOWS], path[1] - path[0]
    share = (x - path[0]) / length
    by_at, by_first = follows * x_at / length, follows * (x_first + share - 1.0) / length
    first, end = meshes.stiffness_at[k], meshes.stiffness_at[k + 1]
    one[STIFFNESS], slope = table_at(meshes.stiffness, first, end, share)
    one[STIFFNESS_AT], one[STIFFNESS_FIRST] = slope * by_at, slope * by_first
    one[CONSTANT], one[CONSTANT_AT], one[CONSTANT_FIRST] = 0.0, 0.0, 0.0
    if meshes.law[k, HERTZ] > 0.0:
        first, end = meshes.constant_at[k], meshes.constant_at[k + 1]
        one[CONSTANT], slope = table_at(meshes.constant, first, end, share)
        one[CONSTANT_AT], one[CONSTANT_FIRST] = slope * by_at, slope * by_first


@inner
def depth_at(size, place, state):
    """How deep flanks without gaps are in each other; its slopes along path and face."""
    side, (_, alpha, (rolled, opened, _), (shift, tilt_c, tilt_t), _) = place[0], state
    lead, slope = math.cos(size[HELIX]), math.sin(size[HELIX])
    sine, cosine = math.sin(alpha), math.cos(alpha)
    m_c, m_t = tilt_arms(size, place, state)
    depth = lead * (side * rolled - opened) + side * slope * shift - m_c * tilt_c - m_t * tilt_t
    by_x = slope * cosine * tilt_c - side * slope * sine * tilt_t
    by_z = side * lead * cosine * tilt_c - lead * sine * tilt_t
    return depth, by_x, by_z


@inner
def tilt_arms(size, place, state):
    """Moments about c and t of a unit force along the normal, about the middle of the gear."""
    side, x, z = place
    alpha, distance = state[1], state[4]
    lead, slope = math.cos(size[HELIX]), math.sin(size[HELIX])
    sine, cosine, base = math.sin(alpha), math.cos(alpha), size[RB_1]
    about_c = slope * (base * sine - x * cosine) - side * lead * z * cosine
    about_t = lead * z * sine + side * slope * (base * cosine + x * sine - distance)
    return about_c, about_t


@inner
def path_rates(size, side, state, follows):
    """How lines go with the turn of the pinion and the distance, and the path's begin with it.

    With cos alpha = (r_b1 + r_b2) / a the pressure angle goes by 1 / (a tan alpha), the fourth, and
    the depth, which falls by cos beta_b sin alpha, is curved by the last.
    """
    alpha, distance = state[1], state[4]
    by_distance = 1.0 / (distance * math.tan(alpha))
    both, base = size[RB_1] + size[RB_2], size[RB_1]
    begin, curved = both / math.cos(alpha) ** 2, -follows * math.cos(size[HELIX]) * math.cos(alpha)
    return side * base, base * by_distance, begin * by_distance, by_distance, curved * by_distance


@inner
def set_gradient(size, one, side, state, rates):
    """Write the derivatives of the depth of a slice by the coordinates of the wheels."""
    _, alpha, _, (_, tilt_c, tilt_t), _ = state
    x, z = one[X], one[Z]
    lead, slope = math.cos(size[HELIX]), math.sin(size[HELIX])
    sine, cosine, base = math.sin(alpha), math.cos(alpha), size[RB_1]
    m_c, m_t = tilt_arms(size, (side, x, z), state)
    turned_c = slope * (base * cosine + x * sine) + side * lead * z * sine
    turned_t = lead * z * cosine - side * slope * (base * sine - x * cosine)
    opened = lead * sine + (turned_c * tilt_c + turned_t * tilt_t) * rates[3]
    opened -= side * slope * tilt_t
    one[FIRST_GRADIENT + TURN_1] = lead * side * base + one[DEPTH_AT] * rates[0]
    one[FIRST_GRADIENT + TURN_2] = lead * side * size[RB_2]
    one[FIRST_GRADIENT + DISTANCE] = one[DEPTH_AT] * rates[1] + one[DEPTH_FIRST] * rates[2] - opened
    one[FIRST_GRADIENT + SHIFT] = side * slope
    one[FIRST_GRADIENT + TILT_C], one[FIRST_GRADIENT + TILT_T] = -m_c, -m_t


@inner
def push_line(s, W, meshes, k, what, count, place):
    """Add the slices of a line to the derivatives of the energy; let them damp and rub."""
    size, law, line, (side, state) = meshes.size[k], meshes.law[k], meshes.line, place
    rates, rims = path_rates(size, side, state, law[FOLLOWS]), has_rims(meshes, k)
    for cell in range(count):
        one = line[cell]
        if one[FORCE] > 0.0:
            set_gradient(size, one, side, state, rates)
            rate, loss = damp(s, W, meshes, k, one, place)
            set_loss(one, loss, law[DAMPING])
            if what == FORCES:
                W.power[2] += one[LOSS] * rate
                record_slice(meshes, k, one, side)
            else:
                add_stiffness(meshes, one, rates, rims, law[COUPLING] > 0.0)
            if rims or law[FRICTION] > 0.0:
                rub(s, W, meshes, k, what, one, place)
        add_gradient(meshes, one, rates)
    if what == TANGENTS and law[COUPLING] > 0.0 and not rims:
        add_line_stiffness(meshes, k, count)


@inner
def set_loss(one, loss, damping):
    """Write what damping adds to a slice, and how its force follows depth and its rate."""
    bound = abs(loss) >= 1.0
    one[LOSS] = loss * one[FORCE]
    one[STEEP] = one[BY_DEPTH] * (1.0 + loss)
    one[STEEP] -= 0.0 if bound else one[LOSS] / one[DEPTH]
    one[VISCOUS] = 0.0 if bound else damping * one[FORCE] / one[DEPTH]


@inner
def record_slice(meshes, k, one, side):
    """Remember a slice that bears, as far as there is room."""
    load, n = one[FORCE] + one[LOSS], int(meshes.n_slices[k])
    meshes.load[k] += load
    if n < meshes.slices.shape[1]:
        found = meshes.slices[k, n]
        found[SIDE], found[PLACE], found[HEIGHT] = side, one[X], one[Z]
        found[LENGTH], found[LOAD] = one[LENGTH_OF_LINE], load
        meshes.n_slices[k] += 1.0


@inner
def add_gradient(meshes, one, rates):
    """Add the derivatives of the energy of a slice, and of what damping takes."""
    by_at = one[WORK_WEIGHT] * one[WEIGHT_AT] + one[WORK_STIFFNESS] * one[STIFFNESS_AT]
    by_at += one[WORK_CONSTANT] * one[CONSTANT_AT]
    by_first = one[WORK_WEIGHT] * one[WEIGHT_FIRST] + one[WORK_STIFFNESS] * one[STIFFNESS_FIRST]
    by_first += one[WORK_CONSTANT] * one[CONSTANT_FIRST]
    if one[FORCE] > 0.0:
        for a in range(COORDINATES):
            meshes.gradient[a] += (one[FORCE] + one[LOSS]) * one[FIRST_GRADIENT + a]
    meshes.gradient[TURN_1] += by_at * rates[0]
    meshes.gradient[DISTANCE] += by_at * rates[1] + by_first * rates[2]


@inner
def add_stiffness(meshes, one, rates, rims, coupled):
    """Add the second derivatives of the energy of a slice but for those of its curved gap.

    Those by its depth alone are added with rims, and with slices that carry each other, elsewhere.
    """
    by_at = one[BY_WEIGHT] * one[WEIGHT_AT] + one[BY_STIFFNESS] * one[STIFFNESS_AT]
    by_at += one[BY_CONSTANT] * one[CONSTANT_AT]
    by_first = one[BY_WEIGHT] * one[WEIGHT_FIRST] + one[BY_STIFFNESS] * one[STIFFNESS_FIRST]
    by_first += one[BY_CONSTANT] * one[CONSTANT_FIRST]
    by_turn, by_distance = by_at * rates[0], by_at * rates[1] + by_first * rates[2]
    steep, viscous, stiffness = one[STEEP], one[VISCOUS], meshes.hessian
    steep -= one[BY_DEPTH] if coupled else 0.0
    stiffness[0, DISTANCE, DISTANCE] += (one[FORCE] + one[LOSS]) * rates[4]
    for a in range(COORDINATES):
        depth = one[FIRST_GRADIENT + a]
        stiffness[0, a, TURN_1] += by_turn * depth
        stiffness[0, TURN_1, a] += by_turn * depth
        stiffness[0, a, DISTANCE] += by_distance * depth
        stiffness[0, DISTANCE, a] += by_distance * depth
        if not rims:
            for b in range(COORDINATES):
                stiffness[0, a, b] += steep * depth * one[FIRST_GRADIENT + b]
                stiffness[1, a, b] += viscous * depth * one[FIRST_GRADIENT + b]


@residuals.of(Meshes)
def mesh_wrenches(s, W, meshes, q, v, _lam):
    """Add the teeth to the wrenches on the markers and forces on rims; add up the power lost."""
    for k in range(meshes.i.size):
        deform_rims(s, meshes, k, q, v)
        add_lines(s, W, meshes, k, FORCES)
        bend_rims(s, W, meshes, k)


@tangents.of(Meshes)
def mesh_tangents(s, W, meshes, _lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S.

    Left out is how gaps are curved, and how tilts turn the forces; where these do not follow their
    energy along the path, all their turning.
    """
    meshes.factor[0], meshes.factor[1] = ck, cc
    for k in range(meshes.i.size):
        clear_tangent(meshes.tangent)
        add_lines(s, W, meshes, k, TANGENTS)
        place_tangent(s, W, (meshes.i[k], meshes.j[k]), meshes.tangent, ck, cc)


@energy.of(Meshes)
def mesh_energy(s, W, meshes, q, v):
    """Energy stored in teeth."""
    total = 0.0
    for k in range(meshes.i.size):
        deform_rims(s, meshes, k, q, v)
        total += add_lines(s, W, meshes, k, ENERGY)
    return total
