"""Gaps of unloaded flanks: corrections, pitch errors, run-out and measured maps."""

import math

from rom.components.gear_mesh.gears.table import (
    ALPHA,
    BACKLASH,
    CROWNING,
    EXTENT_1,
    EXTENT_2,
    HELIX,
    PHASE,
    PITCH,
    POWER,
    RB_1,
    RELIEF_1,
    RELIEF_2,
    RUN_OUT_1,
    SLOPE,
    THICKNESS,
    TOWARDS_1,
    WIDTH,
)
from rom.mbs.kernels.compiled import inner


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
    flank, width = meshes.flank[k], meshes.size[k, WIDTH]
    gap, by_x, by_first, across = 0.0, 0.0, 0.0, z / width
    if flank[EXTENT_1] > 0.0:
        beyond = (x - path[1]) / flank[EXTENT_1] + 1.0
        gap, by_x = relieved(flank[RELIEF_1], beyond, flank[POWER], flank[EXTENT_1])
    if flank[EXTENT_2] > 0.0:
        beyond = (path[0] - x) / flank[EXTENT_2] + 1.0
        more, by_first = relieved(flank[RELIEF_2], beyond, flank[POWER], flank[EXTENT_2])
        gap, by_x = gap + more, by_x - by_first
    gap += flank[CROWNING] * (2.0 * across) ** 2
    gap += flank[SLOPE] * across + 0.5 * abs(flank[SLOPE])
    return gap, by_x, (8.0 * flank[CROWNING] * across + flank[SLOPE]) / width, by_first


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
    width, length = meshes.size[k, WIDTH], path[1] - path[2]
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
    size, amount = meshes.size[k], meshes.flank[k, RUN_OUT_1 + wheel]
    if amount == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    slant, start = side * math.tan(size[HELIX]), size[PHASE] * size[RB_1]
    at = x - slant * z - line * size[PITCH]
    base, lead = size[RB_1 + wheel], side * size[ALPHA]
    if wheel == 0:
        away = side * at - start
        lead = size[ALPHA]
    else:
        away = side * (path[0] - path[2] - at) + start
    if side < 0.0:
        away += size[THICKNESS] if wheel == 0 else -behind(size)
    angle = away / base + lead + meshes.flank[k, TOWARDS_1 + wheel]
    share = -side * amount * math.cos(size[HELIX])
    slope = share * math.cos(angle) * side / base
    by_x = slope if wheel == 0 else -slope
    return share * math.sin(angle), by_x, -slant * by_x, (0.0 if wheel == 0 else slope)


@inner
def behind(size):
    """From a working flank of the pinion to its back flanks that touch at the datum [m]."""
    return size[THICKNESS] + size[BACKLASH] + 2.0 * size[RB_1] * size[ALPHA]


@inner
def flank_gap(meshes, k, place, path):
    """Normal gap of the unloaded flanks at the datum, as (gap, by x, by z, by begin of the path).

    Args:
        meshes: all of them.
        k: which.
        place: side of the flank, number of the line, place along path and face [m].
        path: first and last place of contact, and the first at the datum [m].
    """
    side, line, x, z = place
    size = meshes.size[k]
    if side > 0.0:
        gap, by_x, by_z, by_first = correction_gap(meshes, k, x, z, path)
    else:
        gap, by_x, by_z, by_first = size[BACKLASH] * math.cos(size[HELIX]), 0.0, 0.0, 0.0
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
