"""Slices of contact lines: where they are, how deep their flanks are in each other, their rates.

Flanks of slices approach by the depths of `rom.components.gear_mesh.gears.teeth`, less the gap
between them without load: corrections, pitch errors, run-out and measured maps. A slice that a line
enters or leaves has an end that moves with the line.
"""

import math

from rom.components.gear_mesh.gears import table as col
from rom.components.gear_mesh.gears.rims import closing_of_rims, place_on_rims
from rom.components.gear_mesh.gears.sliding import contact_point
from rom.components.gear_mesh.gears.table import has_rims
from rom.mbs.kernels.compiled import inner


@inner
def path_of_contact(size, alpha, distance):
    """First and last place of contact, from T1, and the first at the datum [m]."""
    last, rack = math.sqrt(size[col.RA_1] ** 2 - size[col.RB_1] ** 2), size[col.RACK]
    if rack > 0.0:
        datum = (rack - size[col.TIP] - size[col.RB_1] * math.cos(alpha)) / math.sin(alpha)
        return datum + (distance - rack) / math.sin(alpha), last, datum
    reach = math.copysign(math.sqrt(size[col.RA_2] ** 2 - size[col.RB_2] ** 2), size[col.RB_2])
    both = size[col.RB_1] + size[col.RB_2]
    return both * math.tan(alpha) - reach, last, both * math.tan(size[col.ALPHA]) - reach


@inner
def clear_of_each_other(meshes, k, side, state):
    """Whether no slice of a flank can touch: its depth is bounded by the arms of all."""
    size = meshes.size[k]
    if has_rims(meshes, k):
        return False
    _, _, (rolled, opened, _), (shift, tilt_c, tilt_t), (_, travel) = state
    arm = 2.0 * (abs(size[col.RA_2]) + size[col.RA_1]) + size[col.WIDTH] + abs(travel)
    most = math.cos(size[col.HELIX]) * (side * rolled - opened) + abs(shift)
    most += arm * (abs(tilt_c) + abs(tilt_t))
    return most < meshes.flank[k, col.LEAST if side > 0.0 else col.LEAST_BACK]


@inner
def line_start(size, side, state):
    """Where line 0 is on the path, in the middle of the face [m]."""
    alpha, forward = state[1], state[2][2]
    return forward if side > 0.0 else size[col.THICKNESS] + 2.0 * size[col.RB_1] * alpha - forward


@inner
def set_line(s, W, meshes, k, at, state, path):
    """Write the slices of a line that is within path and face; how many they are.

    It is at (side of the flank, its number, where it is in the middle of the face [m]); the path is
    first and last place of contact, and the first at the datum [m].
    """
    size, cells, count, nearest = meshes.size[k], meshes.cells[k], 0, -1.0
    width, slant = size[col.WIDTH], at[0] * math.tan(size[col.HELIX])
    begin, end = path[0] - 0.5 * size[col.ENTRY], path[1] + 0.5 * size[col.ENTRY]
    low, high = face_of_line(at[2], slant, begin, end, width)
    for cell in range(cells):
        edges = -0.5 * width + cell * width / cells, -0.5 * width + (cell + 1) * width / cells
        if min(high, edges[1]) - max(low, edges[0]) > 1e-15:
            ends = (low, high), edges
            depth = set_slice(s, W, meshes, k, count, (at, ends, slant, path), state)
            nearest = max(nearest, depth)
            if depth > 0.0 or meshes.law[k, col.COUPLING] > 0.0:
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
    """Lower and upper end of a slice on the face; their rates by the line, by the path's begin."""
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
    (a, b), (a_at, b_at), (a_first, b_first) = moving_ends(ends, size[col.WIDTH], slant)
    z = 0.5 * (a + b)
    x = at + slant * z
    gap, gap_x, gap_z, gap_first = flank_gap(meshes, k, (side, number, x, z), path)
    depth, depth_x, depth_z = depth_at(size, (side, x, z), state)
    depth -= gap
    if has_rims(meshes, k):
        arms, n, _ = contact_point(W, meshes, k, (side, x, z), state)
        place_on_rims(W, meshes, k, cell, arms[0], state[0])
        depth += closing_of_rims(s, W, meshes, (k, cell), n, meshes.rims.amplitude)
    one[col.X], one[col.Z], one[col.DEPTH] = x, z, depth
    if depth <= 0.0 and meshes.law[k, col.COUPLING] == 0.0:
        return depth
    follows, along = meshes.law[k, col.FOLLOWS], math.sqrt(1.0 + slant * slant)
    z_at, z_first = 0.5 * (a_at + b_at), 0.5 * (a_first + b_first)
    x_at, x_first = 1.0 + slant * z_at, slant * z_first
    depth_x, depth_z = depth_x - gap_x, depth_z - gap_z
    one[col.DEPTH_AT] = follows * (depth_x * x_at + depth_z * z_at)
    one[col.DEPTH_FIRST] = follows * (depth_x * x_first + depth_z * z_first - gap_first)
    share, share_x, share_first = taken_up(size[col.ENTRY], x, path)
    length = (b - a) * along
    one[col.WEIGHT], one[col.LENGTH_OF_LINE] = length * share, length
    one[col.WEIGHT_AT] = follows * (along * (b_at - a_at) * share + length * share_x * x_at)
    one[col.WEIGHT_FIRST] = follows * (
        along * (b_first - a_first) * share + length * (share_x * x_first + share_first)
    )
    set_stiffness(meshes, k, cell, (x, x_at, x_first), path)
    return depth


@inner
def set_stiffness(meshes, k, cell, place, path):
    """Write the stiffness of a slice and the constant of its contact, and their rates."""
    x, x_at, x_first = place
    one, follows, length = meshes.line[cell], meshes.law[k, col.FOLLOWS], path[1] - path[0]
    share = (x - path[0]) / length
    by_at, by_first = follows * x_at / length, follows * (x_first + share - 1.0) / length
    first, end = meshes.stiffness_at[k], meshes.stiffness_at[k + 1]
    one[col.STIFFNESS], slope = table_at(meshes.stiffness, first, end, share)
    one[col.STIFFNESS_AT], one[col.STIFFNESS_FIRST] = slope * by_at, slope * by_first
    one[col.CONSTANT], one[col.CONSTANT_AT], one[col.CONSTANT_FIRST] = 0.0, 0.0, 0.0
    if meshes.law[k, col.HERTZ] > 0.0:
        first, end = meshes.constant_at[k], meshes.constant_at[k + 1]
        one[col.CONSTANT], slope = table_at(meshes.constant, first, end, share)
        one[col.CONSTANT_AT], one[col.CONSTANT_FIRST] = slope * by_at, slope * by_first


@inner
def depth_at(size, place, state):
    """How deep flanks without gaps are in each other; its slopes along path and face."""
    side, (_, alpha, (rolled, opened, _), (shift, tilt_c, tilt_t), _) = place[0], state
    lead, slope = math.cos(size[col.HELIX]), math.sin(size[col.HELIX])
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
    lead, slope = math.cos(size[col.HELIX]), math.sin(size[col.HELIX])
    sine, cosine, base = math.sin(alpha), math.cos(alpha), size[col.RB_1]
    about_c = slope * (base * sine - x * cosine + side * travel) - side * lead * z * cosine
    about_t = lead * z * sine + side * slope * (base * cosine + x * sine - distance)
    return about_c, about_t


@inner
def table_at(values, first, end, share):
    """Linear interpolation of values[first:end] at a share from 0 to 1; its slope by the share."""
    n = end - first
    if n < 2 or share <= 0.0:
        return values[first], 0.0
    if share >= 1.0:
        return values[end - 1], 0.0
    at = share * (n - 1)
    p = min(int(at), n - 2)
    low, high = values[first + p], values[first + p + 1]
    return low + (at - p) * (high - low), (high - low) * (n - 1)


@inner
def taken_up(entry, x, path):
    """Share of its load that a line has taken up at x; its slopes by x and begin of the path."""
    coming = x - path[0] < path[1] - x
    inside = x - path[0] if coming else path[1] - x
    if entry <= 0.0 or inside >= 0.5 * entry:
        return 1.0, 0.0, 0.0
    slope = 1.0 / entry if coming else -1.0 / entry
    return 0.5 + inside / entry, slope, (-slope if coming else 0.0)


@inner
def relieved(depth, beyond, power, extent):
    """Relief so far beyond its begin, over its extent; its slope along the path."""
    if beyond <= 0.0:
        return 0.0, 0.0
    gap = depth * beyond**power
    return gap, gap * power / (beyond * extent)


@inner
def correction_gap(meshes, k, x, z, path):
    """Gap of the corrected working flanks; its slopes by x, z and the begin of the path."""
    flank, width = meshes.flank[k], meshes.size[k, col.WIDTH]
    gap, by_x, by_first, across, power = 0.0, 0.0, 0.0, z / width, flank[col.POWER]
    if flank[col.EXTENT_1] > 0.0:
        beyond = (x - path[1]) / flank[col.EXTENT_1] + 1.0
        gap, by_x = relieved(flank[col.RELIEF_1], beyond, power, flank[col.EXTENT_1])
    if flank[col.EXTENT_2] > 0.0:
        beyond = (path[0] - x) / flank[col.EXTENT_2] + 1.0
        more, by_first = relieved(flank[col.RELIEF_2], beyond, power, flank[col.EXTENT_2])
        gap, by_x = gap + more, by_x - by_first
    gap += flank[col.CROWNING] * (2.0 * across) ** 2
    gap += flank[col.SLOPE] * across + 0.5 * abs(flank[col.SLOPE])
    return gap, by_x, (8.0 * flank[col.CROWNING] * across + flank[col.SLOPE]) / width, by_first


@inner
def between_places(share, n):
    """The place of n below a share from 0 to 1, how far beyond it, and whether inside."""
    if n < 2:
        return 0, 0.0, 0.0
    inside = 1.0 if 0.0 < share < 1.0 else 0.0
    at = min(max(share, 0.0), 1.0) * (n - 1)
    p = min(int(at), n - 2)
    return p, at - p, inside * (n - 1)


@inner
def map_gap(meshes, m, tooth, u, v):
    """Bilinear value of map m of flanks; its slopes by the shares u of profile and v of lead."""
    teeth, n, lead = meshes.map_shape[m, 0], meshes.map_shape[m, 1], meshes.map_shape[m, 2]
    p, a, by_u = between_places(u, n)
    q, b, by_v = between_places(v, lead)
    first = meshes.map_at[m] + (tooth % teeth) * n * lead + p * lead + q
    down, right = (lead if n > 1 else 0), (1 if lead > 1 else 0)
    one, two = meshes.maps[first], meshes.maps[first + down]
    three, four = meshes.maps[first + right], meshes.maps[first + down + right]
    low, high = one + b * (three - one), two + b * (four - two)
    across = three - one + a * (four - two - three + one)
    return low + a * (high - low), by_u * (high - low), by_v * across


@inner
def measured_gap(meshes, k, wheel, place, path):
    """Gap by the map of a wheel; its slopes by x, z and the begin of the path.

    Profiles count from where flanks begin to touch at the datum to their tips, which those of the
    gear reach where the path begins.
    """
    side, line, x, z = place
    m = 4 * k + wheel + (0 if side > 0.0 else 2)
    if meshes.map_at[m + 1] == meshes.map_at[m]:
        return 0.0, 0.0, 0.0, 0.0
    width, length = meshes.size[k, col.WIDTH], path[1] - path[2]
    u = (x - path[2]) / length if wheel == 0 else 1.0 - (x - path[0]) / length
    tooth = -line if side > 0.0 else line + wheel
    gap, by_u, by_v = map_gap(meshes, m, tooth, u, z / width + 0.5)
    slope = by_u / length
    return gap, (slope if wheel == 0 else -slope), by_v / width, (0.0 if wheel == 0 else slope)


@inner
def run_out_gap(meshes, k, wheel, place, path):
    """Gap by the eccentricity of a wheel; its slopes by x, z and the begin of the path.

    An involute that is shifted in its wheel leaves a gap by the angle of its normal in the wheel,
    which follows from where it touches.
    """
    side, line, x, z = place
    size, amount = meshes.size[k], meshes.flank[k, col.RUN_OUT_1 + wheel]
    if amount == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    slant, start = side * math.tan(size[col.HELIX]), size[col.PHASE] * size[col.RB_1]
    at = x - slant * z - line * size[col.PITCH]
    base, lead = size[col.RB_1 + wheel], side * size[col.ALPHA]
    if wheel == 0:
        away = side * at - start
        lead = size[col.ALPHA]
    else:
        away = side * (path[0] - path[2] - at) + start
    if side < 0.0:
        away += size[col.THICKNESS] if wheel == 0 else -behind(size)
    angle = away / base + lead + meshes.flank[k, col.TOWARDS_1 + wheel]
    share = -side * amount * math.cos(size[col.HELIX])
    slope = share * math.cos(angle) * side / base
    by_x = slope if wheel == 0 else -slope
    return share * math.sin(angle), by_x, -slant * by_x, (0.0 if wheel == 0 else slope)


@inner
def behind(size):
    """From a working flank of the pinion to its back flanks that touch at the datum [m]."""
    return size[col.THICKNESS] + size[col.BACKLASH] + 2.0 * size[col.RB_1] * size[col.ALPHA]


@inner
def flank_gap(meshes, k, place, path):
    """Normal gap of the unloaded flanks at the datum, as (gap, by x, by z, by begin of the path).

    The place has the side of the flank, the line, and x and z along path and face [m].
    """
    side, line, x, z = place
    size = meshes.size[k]
    if side > 0.0:
        gap, by_x, by_z, by_first = correction_gap(meshes, k, x, z, path)
    else:
        gap, by_x, by_z, by_first = size[col.BACKLASH] * math.cos(size[col.HELIX]), 0.0, 0.0, 0.0
    for wheel in range(2):
        first, end = meshes.pitch_at[2 * k + wheel], meshes.pitch_at[2 * k + wheel + 1]
        if side > 0.0 and end > first:
            gap += meshes.pitch[first + (-line) % (end - first)]
        one = measured_gap(meshes, k, wheel, place, path)
        two = run_out_gap(meshes, k, wheel, place, path)
        gap += one[0] + two[0]
        by_x += one[1] + two[1]
        by_z += one[2] + two[2]
        by_first += one[3] + two[3]
    return gap, by_x, by_z, by_first
