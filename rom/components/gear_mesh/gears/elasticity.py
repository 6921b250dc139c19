"""What a slice of teeth bears by itself: bending, and contact that follows its load.

Teeth of stiffness k per length of line, pressed together by d, bear F per length:

    d = F / k + c F (C - 2 ln F)

with the compliance c = (1 - nu^2) / (pi E) of Hertz's line contact and its constant C; without it
F = k d.
"""

import math

from rom.components.gear_mesh.gears.table import (
    BY_CONSTANT,
    BY_DEPTH,
    BY_STIFFNESS,
    BY_WEIGHT,
    CONSTANT,
    DEPTH,
    FORCE,
    STIFFNESS,
    STORED,
    WEIGHT,
    WORK_CONSTANT,
    WORK_STIFFNESS,
    WORK_WEIGHT,
)
from rom.mbs.kernels.compiled import inner

MAX_ITERATIONS = 30  # of a Newton method that doubles its digits
LOG_ATOL = 1e-15  # of the logarithm of a load: its last digit


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
def load_of_depth(depth, k, C, c):
    """Load per length of a slice pressed by depth, and its derivative."""
    if c == 0.0:
        return k * depth, k
    goal, y = math.log(depth), math.log(depth * min(k, 1.0 / c))
    for _ in range(MAX_ITERATIONS):
        compliance = 1.0 / k + c * (C - 2.0 * y)
        step = (goal - y - math.log(compliance)) / (1.0 - 2.0 * c / compliance)
        y += step
        if abs(step) <= LOG_ATOL * max(abs(y), 1.0):
            break
    return math.exp(y), 1.0 / (1.0 / k + c * (C - 2.0 * y) - 2.0 * c)


@inner
def energy_of_load(load, k, C, c):
    """Energy per length of a slice under a load, with contact after Hertz."""
    return load * load * (0.5 / k + c * (0.5 * C - math.log(load) - 0.5))


@inner
def bear_alone(one, c):
    """Let one slice bear for itself: its force and energy, and how they change."""
    depth, k, C, weight = one[DEPTH], one[STIFFNESS], one[CONSTANT], one[WEIGHT]
    if depth <= 0.0:
        for column in range(FORCE, WORK_CONSTANT + 1):
            one[column] = 0.0
        return
    load, slope = load_of_depth(depth, k, C, c)
    one[FORCE], one[BY_DEPTH], one[BY_WEIGHT] = weight * load, weight * slope, load
    if c == 0.0:
        stored, bent, one[BY_STIFFNESS] = 0.5 * load * depth, depth, weight * depth
    else:
        stored, bent = energy_of_load(load, k, C, c), load / k
        one[BY_STIFFNESS] = weight * bent * slope / k
    one[BY_CONSTANT] = -weight * c * load * slope
    one[STORED], one[WORK_WEIGHT] = weight * stored, stored
    one[WORK_STIFFNESS] = 0.5 * weight * bent * bent
    one[WORK_CONSTANT] = -0.5 * weight * c * load * load
