"""Slices of contact lines: where they are, how deep their flanks are in each other, their rates.

Flanks of slices approach by the depths of `rom.components.gear_mesh.gears.teeth`, less the gap
between them without load. A slice that a line enters or leaves has an end that moves with the line.
"""

import math

from rom.components.gear_mesh.gears.elasticity import table_at, taken_up
from rom.components.gear_mesh.gears.flanks import flank_gap
from rom.components.gear_mesh.gears.rims import closing_of_rims, has_rims, place_on_rims
from rom.components.gear_mesh.gears.sliding import contact_point
from rom.components.gear_mesh.gears.table import (
    ALPHA,
    CONSTANT,
    CONSTANT_AT,
    CONSTANT_FIRST,
    COUPLING,
    DEPTH,
    DEPTH_AT,
    DEPTH_FIRST,
    ENTRY,
    FOLLOWS,
    HELIX,
    HERTZ,
    LEAST,
    LEAST_BACK,
    LENGTH_OF_LINE,
    RA_1,
    RA_2,
    RACK,
    RB_1,
    RB_2,
    STIFFNESS,
    STIFFNESS_AT,
    STIFFNESS_FIRST,
    THICKNESS,
    TIP,
    WEIGHT,
    WEIGHT_AT,
    WEIGHT_FIRST,
    WIDTH,
    X,
    Z,
)
from rom.mbs.kernels.compiled import inner


@inner
def path_of_contact(size, alpha, distance):
    """First and last place of contact, from T1, and the first at the datum [m]."""
    last = math.sqrt(size[RA_1] ** 2 - size[RB_1] ** 2)
    if size[RACK] > 0.0:
        datum = (size[RACK] - size[TIP] - size[RB_1] * math.cos(alpha)) / math.sin(alpha)
        return datum + (distance - size[RACK]) / math.sin(alpha), last, datum
    reach = math.copysign(math.sqrt(size[RA_2] ** 2 - size[RB_2] ** 2), size[RB_2])
    both = size[RB_1] + size[RB_2]
    return both * math.tan(alpha) - reach, last, both * math.tan(size[ALPHA]) - reach


@inner
def clear_of_each_other(meshes, k, side, state):
    """Whether no slice of a flank can touch: its depth is bounded by the arms of all."""
    size = meshes.size[k]
    if has_rims(meshes, k):
        return False
    _, _, (rolled, opened, _), (shift, tilt_c, tilt_t), (_, travel) = state
    arm = 2.0 * (abs(size[RA_2]) + size[RA_1]) + size[WIDTH] + abs(travel)
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
        place_on_rims(W, meshes, k, cell, arms[0], state[0])
        depth += closing_of_rims(s, W, meshes, (k, cell), n, meshes.rims.amplitude)
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
    alpha, (distance, travel) = state[1], state[4]
    lead, slope = math.cos(size[HELIX]), math.sin(size[HELIX])
    sine, cosine, base = math.sin(alpha), math.cos(alpha), size[RB_1]
    about_c = slope * (base * sine - x * cosine + side * travel) - side * lead * z * cosine
    about_t = lead * z * sine + side * slope * (base * cosine + x * sine - distance)
    return about_c, about_t
