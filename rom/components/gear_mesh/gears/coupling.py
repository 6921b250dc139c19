"""What slices of teeth bear, each by itself or coupled by a foundation after Pasternak.

Teeth of stiffness k per length of line, pressed together by d, bear F per length:

    d = F / k + c F (C - 2 ln F)

with the compliance c = (1 - nu^2) / (pi E) of Hertz's line contact and its constant C; without it
F = k d. Where slices carry each other, the flank bends by w:

    1/2 int k (w^2 + l^2 w_z^2) dz,   w >= d

is least, over the face that the line covers. Between neighbours the foundation shears by the
harmonic mean of their stiffnesses. If contact gives way too, d - w is what Hertz has at the load.
"""

import math

from rom.components.gear_mesh.gears import table as col
from rom.mbs.kernels.compiled import inner

MAX_ITERATIONS, MAX_PASSES = 30, 60  # of Newton methods that double their digits
LOG_ATOL = 1e-15  # of the logarithm of a load: its last digit
BENT_RTOL = 1e-14  # of the deepest slice: the last digit of deflections
RIGID_STIFFNESS = 1e30  # stiffness of teeth that do not bend beside their contact [N/m^2]


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
    depth, k, C, weight = one[col.DEPTH], one[col.STIFFNESS], one[col.CONSTANT], one[col.WEIGHT]
    if depth <= 0.0:
        for column in range(col.FORCE, col.WORK_CONSTANT + 1):
            one[column] = 0.0
        return
    load, slope = load_of_depth(depth, k, C, c)
    one[col.FORCE], one[col.BY_DEPTH], one[col.BY_WEIGHT] = weight * load, weight * slope, load
    if c == 0.0:
        stored, bent, one[col.BY_STIFFNESS] = 0.5 * load * depth, depth, weight * depth
    else:
        stored, bent = energy_of_load(load, k, C, c), load / k
        one[col.BY_STIFFNESS] = weight * bent * slope / k
    one[col.BY_CONSTANT] = -weight * c * load * slope
    one[col.STORED], one[col.WORK_WEIGHT] = weight * stored, stored
    one[col.WORK_STIFFNESS] = 0.5 * weight * bent * bent
    one[col.WORK_CONSTANT] = -0.5 * weight * c * load * load


@inner
def bear_line(meshes, k, count):
    """Forces and energies of the slices of a line."""
    c, length, slices = meshes.law[k, col.HERTZ], meshes.law[k, col.COUPLING], meshes.line
    if length == 0.0:
        for cell in range(count):
            bear_alone(slices[cell], c)
        return
    shear = (length * meshes.cells[k] / meshes.size[k, col.WIDTH]) ** 2
    set_foundation(slices, count, shear)
    if c == 0.0:
        press_stiff_contact(slices, count)
    else:
        press_soft_contact(slices, count, c)
    share_energy(slices, count, c)
    share_bending(slices, count, shear)


@inner
def set_foundation(slices, count, shear):
    """Stiffness of the foundation below each slice, and from it to the next."""
    for cell in range(count):
        slices[cell, col.FOUNDATION] = slices[cell, col.WEIGHT] * slices[cell, col.STIFFNESS]
        slices[cell, col.LINK] = 0.0
    for cell in range(count - 1):
        one, two = slices[cell, col.FOUNDATION], slices[cell + 1, col.FOUNDATION]
        slices[cell, col.LINK] = shear * 2.0 * one * two / (one + two)


@inner
def bend(slices, count, target, stiff):
    """Deflections of a line whose touching slices go to the column target.

    They do so at once in stiff contact, else by springs of stiffness `TOUCHES`.
    """
    left = 0.0
    for cell in range(count):
        one = slices[cell]
        touches, right = one[col.TOUCHES], one[col.LINK]
        if stiff and touches > 0.0:
            one[col.UPPER], one[col.ANSWER] = 0.0, one[target]
        else:
            before = slices[cell - 1] if cell > 0 else one
            upper, answer = (before[col.UPPER], before[col.ANSWER]) if cell > 0 else (0.0, 0.0)
            pivot = one[col.FOUNDATION] + touches + left * (1.0 - upper) + right
            one[col.UPPER] = right / pivot
            one[col.ANSWER] = (touches * one[target] + left * answer) / pivot
        left = right
    after = 0.0
    for back in range(count):
        one = slices[count - 1 - back]
        after = one[col.ANSWER] + one[col.UPPER] * after
        one[col.BENT] = after


@inner
def pressure(slices, count, cell):
    """Force that keeps a slice where it is bent to."""
    one = slices[cell]
    force = one[col.FOUNDATION] * one[col.BENT]
    if cell > 0:
        force += slices[cell - 1, col.LINK] * (one[col.BENT] - slices[cell - 1, col.BENT])
    if cell < count - 1:
        force += one[col.LINK] * (one[col.BENT] - slices[cell + 1, col.BENT])
    return force


@inner
def press_stiff_contact(slices, count):
    """Deflections and forces; slices touch where they are pressed, and the others are clear.

    A slice that would be pulled lifts off, which lowers the forces beside it: those that touch
    become fewer until none is pulled.
    """
    for cell in range(count):
        slices[cell, col.TOUCHES] = 1.0 if slices[cell, col.DEPTH] > 0.0 else 0.0
    for _ in range(count):
        bend(slices, count, col.DEPTH, True)
        changed = False
        for cell in range(count):
            one = slices[cell]
            one[col.FORCE] = pressure(slices, count, cell) if one[col.TOUCHES] > 0.0 else 0.0
            if one[col.FORCE] < 0.0:
                one[col.FORCE], one[col.TOUCHES], changed = 0.0, 0.0, True
        if not changed:
            break


@inner
def press_soft_contact(slices, count, c):
    """Deflections and forces where contact gives way by Hertz; Newton's method."""
    deepest = 0.0
    for cell in range(count):
        one = slices[cell]
        one[col.BENT] = 0.0
        deepest = max(deepest, one[col.DEPTH])
    for _ in range(MAX_PASSES):
        change = 0.0
        for cell in range(count):
            one = slices[cell]
            one[col.FORCE], one[col.TOUCHES], one[col.TARGET] = 0.0, 0.0, 0.0
            into = one[col.DEPTH] - one[col.BENT]
            if into > 0.0:
                load, slope = load_of_depth(into, RIGID_STIFFNESS, one[col.CONSTANT], c)
                one[col.FORCE], one[col.TOUCHES] = one[col.WEIGHT] * load, one[col.WEIGHT] * slope
                one[col.TARGET] = one[col.BENT] + load / slope
            one[col.STORED] = one[col.BENT]
        bend(slices, count, col.TARGET, False)
        for cell in range(count):
            change = max(change, abs(slices[cell, col.BENT] - slices[cell, col.STORED]))
        if change <= BENT_RTOL * deepest:
            break


@inner
def share_energy(slices, count, c):
    """What contact stores in each slice, and how its force changes, about."""
    for cell in range(count):
        one = slices[cell]
        for column in range(col.BY_DEPTH, col.WORK_CONSTANT + 1):
            one[column] = 0.0
        if one[col.FORCE] > 0.0:
            one[col.BY_DEPTH] = one[col.FORCE] / one[col.DEPTH]
            one[col.BY_WEIGHT] = one[col.FORCE] / one[col.WEIGHT]
            one[col.BY_STIFFNESS] = one[col.FORCE] / one[col.STIFFNESS]
        if one[col.FORCE] > 0.0 and c > 0.0:
            load = one[col.FORCE] / one[col.WEIGHT]
            stored = energy_of_load(load, RIGID_STIFFNESS, one[col.CONSTANT], c)
            one[col.STORED], one[col.WORK_WEIGHT] = one[col.WEIGHT] * stored, stored
            one[col.WORK_CONSTANT] = -0.5 * c * one[col.WEIGHT] * load * load


@inner
def share_bending(slices, count, shear):
    """Add what the foundation stores, and how it changes with the stiffness of each slice."""
    for cell in range(count):
        one = slices[cell]
        by_own = 0.5 * one[col.BENT] * one[col.BENT]
        one[col.STORED] += one[col.FOUNDATION] * by_own
        for other in (cell - 1, cell + 1):
            if 0 <= other < count:
                next_ = slices[other]
                apart = one[col.BENT] - next_[col.BENT]
                mean = one[col.FOUNDATION] + next_[col.FOUNDATION]
                by_own += shear * (apart * next_[col.FOUNDATION] / mean) ** 2
                one[col.STORED] += 0.25 * slices[min(cell, other), col.LINK] * apart * apart
        one[col.WORK_WEIGHT] += one[col.STIFFNESS] * by_own
        one[col.WORK_STIFFNESS] = one[col.WEIGHT] * by_own


@inner
def add_line_stiffness(meshes, k, count):
    """Add to the second derivatives of the energy what the depths of coupled slices do."""
    slices, stiff = meshes.line, meshes.law[k, col.HERTZ] == 0.0
    for a in range(col.COORDINATES):
        bend(slices, count, col.FIRST_GRADIENT + a, stiff)
        for cell in range(count):
            one = slices[cell]
            if one[col.TOUCHES] > 0.0:
                change = pressure(slices, count, cell)
                for b in range(col.COORDINATES):
                    meshes.hessian[0, a, b] += change * one[col.FIRST_GRADIENT + b]
