"""Slices of a line that carry each other, on a foundation after Pasternak.

The flank bends by w, and is pressed where the teeth come into each other by d; then

    1/2 int k (w^2 + l^2 w_z^2) dz,   w >= d

is least, over the face that the line covers. Between neighbours the foundation shears by the
harmonic mean of their stiffnesses. If contact gives way too, d - w is what Hertz has at the load.
"""

from rom.components.gear_mesh.gears.elasticity import bear_alone, energy_of_load, load_of_depth
from rom.components.gear_mesh.gears.table import (
    ANSWER,
    BENT,
    BY_DEPTH,
    BY_STIFFNESS,
    BY_WEIGHT,
    CONSTANT,
    COORDINATES,
    COUPLING,
    DEPTH,
    FIRST_GRADIENT,
    FORCE,
    FOUNDATION,
    HERTZ,
    LINK,
    STIFFNESS,
    STORED,
    TARGET,
    TOUCHES,
    UPPER,
    WEIGHT,
    WIDTH,
    WORK_CONSTANT,
    WORK_STIFFNESS,
    WORK_WEIGHT,
)
from rom.mbs.kernels.compiled import inner

MAX_PASSES = 60  # of a Newton method that doubles its digits
BENT_RTOL = 1e-14  # of the deepest slice: the last digit of deflections
RIGID_STIFFNESS = 1e30  # stiffness of teeth that do not bend beside their contact [N/m^2]


@inner
def bear_line(meshes, k, count):
    """Forces and energies of the slices of a line."""
    c, length, slices = meshes.law[k, HERTZ], meshes.law[k, COUPLING], meshes.line
    if length == 0.0:
        for cell in range(count):
            bear_alone(slices[cell], c)
        return
    shear = (length * meshes.cells[k] / meshes.size[k, WIDTH]) ** 2
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
        slices[cell, FOUNDATION] = slices[cell, WEIGHT] * slices[cell, STIFFNESS]
        slices[cell, LINK] = 0.0
    for cell in range(count - 1):
        one, two = slices[cell, FOUNDATION], slices[cell + 1, FOUNDATION]
        slices[cell, LINK] = shear * 2.0 * one * two / (one + two)


@inner
def bend(slices, count, target, stiff):
    """Deflections of a line whose touching slices go to the column target.

    They do so at once in stiff contact, else by springs of stiffness `TOUCHES`.
    """
    left = 0.0
    for cell in range(count):
        one = slices[cell]
        touches, right = one[TOUCHES], one[LINK]
        if stiff and touches > 0.0:
            one[UPPER], one[ANSWER] = 0.0, one[target]
        else:
            before = slices[cell - 1] if cell > 0 else one
            upper, answer = (before[UPPER], before[ANSWER]) if cell > 0 else (0.0, 0.0)
            pivot = one[FOUNDATION] + touches + left * (1.0 - upper) + right
            one[UPPER] = right / pivot
            one[ANSWER] = (touches * one[target] + left * answer) / pivot
        left = right
    after = 0.0
    for back in range(count):
        one = slices[count - 1 - back]
        after = one[ANSWER] + one[UPPER] * after
        one[BENT] = after


@inner
def pressure(slices, count, cell):
    """Force that keeps a slice where it is bent to."""
    one = slices[cell]
    force = one[FOUNDATION] * one[BENT]
    if cell > 0:
        force += slices[cell - 1, LINK] * (one[BENT] - slices[cell - 1, BENT])
    if cell < count - 1:
        force += one[LINK] * (one[BENT] - slices[cell + 1, BENT])
    return force


@inner
def press_stiff_contact(slices, count):
    """Deflections and forces; slices touch where they are pressed, and the others are clear.

    A slice that would be pulled lifts off, which lowers the forces beside it: those that touch
    become fewer until none is pulled.
    """
    for cell in range(count):
        slices[cell, TOUCHES] = 1.0 if slices[cell, DEPTH] > 0.0 else 0.0
    for _ in range(count):
        bend(slices, count, DEPTH, True)
        changed = False
        for cell in range(count):
            one = slices[cell]
            one[FORCE] = pressure(slices, count, cell) if one[TOUCHES] > 0.0 else 0.0
            if one[FORCE] < 0.0:
                one[FORCE], one[TOUCHES], changed = 0.0, 0.0, True
        if not changed:
            break


@inner
def press_soft_contact(slices, count, c):
    """Deflections and forces where contact gives way by Hertz; Newton's method."""
    deepest = 0.0
    for cell in range(count):
        one = slices[cell]
        one[BENT] = 0.0
        deepest = max(deepest, one[DEPTH])
    for _ in range(MAX_PASSES):
        change = 0.0
        for cell in range(count):
            one = slices[cell]
            one[FORCE], one[TOUCHES], one[TARGET] = 0.0, 0.0, 0.0
            into = one[DEPTH] - one[BENT]
            if into > 0.0:
                load, slope = load_of_depth(into, RIGID_STIFFNESS, one[CONSTANT], c)
                one[FORCE], one[TOUCHES] = one[WEIGHT] * load, one[WEIGHT] * slope
                one[TARGET] = one[BENT] + load / slope
            one[STORED] = one[BENT]
        bend(slices, count, TARGET, False)
        for cell in range(count):
            change = max(change, abs(slices[cell, BENT] - slices[cell, STORED]))
        if change <= BENT_RTOL * deepest:
            break


@inner
def share_energy(slices, count, c):
    """What contact stores in each slice, and how its force changes, about."""
    for cell in range(count):
        one = slices[cell]
        for column in range(BY_DEPTH, WORK_CONSTANT + 1):
            one[column] = 0.0
        if one[FORCE] > 0.0:
            one[BY_DEPTH] = one[FORCE] / one[DEPTH]
            one[BY_WEIGHT] = one[FORCE] / one[WEIGHT]
            one[BY_STIFFNESS] = one[FORCE] / one[STIFFNESS]
        if one[FORCE] > 0.0 and c > 0.0:
            load = one[FORCE] / one[WEIGHT]
            stored = energy_of_load(load, RIGID_STIFFNESS, one[CONSTANT], c)
            one[STORED], one[WORK_WEIGHT] = one[WEIGHT] * stored, stored
            one[WORK_CONSTANT] = -0.5 * c * one[WEIGHT] * load * load


@inner
def share_bending(slices, count, shear):
    """Add what the foundation stores, and how it changes with the stiffness of each slice."""
    for cell in range(count):
        one = slices[cell]
        by_own = 0.5 * one[BENT] * one[BENT]
        one[STORED] += one[FOUNDATION] * by_own
        for other in (cell - 1, cell + 1):
            if 0 <= other < count:
                next_ = slices[other]
                apart, mean = one[BENT] - next_[BENT], one[FOUNDATION] + next_[FOUNDATION]
                by_own += shear * (apart * next_[FOUNDATION] / mean) ** 2
                one[STORED] += 0.25 * slices[min(cell, other), LINK] * apart * apart
        one[WORK_WEIGHT] += one[STIFFNESS] * by_own
        one[WORK_STIFFNESS] = one[WEIGHT] * by_own


@inner
def add_line_stiffness(meshes, k, count):
    """Add to the second derivatives of the energy what the depths of coupled slices do."""
    slices, stiff = meshes.line, meshes.law[k, HERTZ] == 0.0
    for a in range(COORDINATES):
        bend(slices, count, FIRST_GRADIENT + a, stiff)
        for cell in range(count):
            one = slices[cell]
            if one[TOUCHES] > 0.0:
                change = pressure(slices, count, cell)
                for b in range(COORDINATES):
                    meshes.hessian[0, a, b] += change * one[FIRST_GRADIENT + b]
