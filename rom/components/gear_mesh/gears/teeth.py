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

from rom.components.gear_mesh.gears import table as col
from rom.components.gear_mesh.gears.coupling import add_line_stiffness, bear_line
from rom.components.gear_mesh.gears.rims import bend_rims, deform_rims
from rom.components.gear_mesh.gears.slices import (
    clear_of_each_other,
    line_start,
    path_of_contact,
    set_line,
    tilt_arms,
)
from rom.components.gear_mesh.gears.sliding import damp, rub
from rom.components.gear_mesh.gears.table import Meshes, has_rims
from rom.components.gear_mesh.gears.wheels import (
    push_wheels,
    set_frame,
    set_rates,
    set_speed,
    stiffen_wheels,
    turn_forces,
)
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.coordinates import place_tangent
from rom.mbs.kernels.element_calls import energy, residuals, tangents


@inner
def add_lines(s, W, meshes, k, what):
    """Go over the contact lines of both flanks for FORCES, TANGENTS or ENERGY; what they store."""
    state, total = set_frame(s, W, meshes, k), 0.0
    path = path_of_contact(meshes.size[k], state[1], state[4][0])
    if what == col.FORCES:  # not a number without a common tangent, which ends the motion
        meshes.load[k], meshes.n_slices[k] = 0.0 * state[1], 0.0
        W.wrench[meshes.i[k], 0] += 0.0 * state[1]
        rolled, opened, _ = state[2]
        meshes.approach[k] = max(rolled, -rolled - meshes.size[k, col.BACKLASH]) - opened
    if not path[0] < path[1]:  # too far apart to meet, or there is no common tangent
        return 0.0
    meshes.gradient[:], meshes.hessian[:] = 0.0, 0.0
    if what != col.ENERGY:
        set_rates(W, meshes, k)
        set_speed(W, meshes, k)
    for side in (1.0, -1.0):
        if not clear_of_each_other(meshes, k, side, state):
            total += add_flank(s, W, meshes, k, what, (side, state), path)
    if what == col.FORCES:
        push_wheels(W, meshes, k)
    elif what == col.TANGENTS:
        stiffen_wheels(meshes)
        if meshes.law[k, col.FOLLOWS] > 0.0 and meshes.size[k, col.RACK] == 0.0:
            turn_forces(meshes, state[0], state[4][0])
    return total


@inner
def add_flank(s, W, meshes, k, what, place, path):
    """Go over the contact lines of working or back flanks; what they store."""
    (side, state), size, total = place, meshes.size[k], 0.0
    begin, end = path[0] - 0.5 * size[col.ENTRY], path[1] + 0.5 * size[col.ENTRY]
    reach = abs(math.tan(size[col.HELIX])) * size[col.WIDTH] / 2
    start = line_start(size, side, state)
    lowest = math.floor((begin - start - reach) / size[col.PITCH])
    lines = math.ceil((end - start + reach) / size[col.PITCH]) - lowest + 1
    for line in range(lowest, lowest + lines):
        at = side, line, start + line * size[col.PITCH]
        count = set_line(s, W, meshes, k, at, state, path)
        if count > 0:
            bear_line(meshes, k, count)
            for cell in range(count):
                total += meshes.line[cell, col.STORED]
            if what != col.ENERGY:
                push_line(s, W, meshes, k, what, count, place)
    return total


@inner
def path_rates(size, side, state, follows):
    """How lines go with the turn of the pinion and the distance, and the path's begin with it.

    With cos alpha = (r_b1 + r_b2) / a the pressure angle goes by 1 / (a tan alpha), the fourth, and
    the depth, which falls by cos beta_b sin alpha, is curved by the last.
    """
    alpha, (distance, _) = state[1], state[4]
    if size[col.RACK] > 0.0:
        return side * size[col.RB_1], 0.0, 1.0 / math.sin(alpha), 0.0, 0.0
    by_distance = 1.0 / (distance * math.tan(alpha))
    both, base = size[col.RB_1] + size[col.RB_2], size[col.RB_1]
    begin = both / math.cos(alpha) ** 2
    curved = -follows * math.cos(size[col.HELIX]) * math.cos(alpha)
    return side * base, base * by_distance, begin * by_distance, by_distance, curved * by_distance


@inner
def set_gradient(size, one, side, state, rates):
    """Write the derivatives of the depth of a slice by the coordinates of the wheels."""
    _, alpha, _, (_, tilt_c, tilt_t), _ = state
    x, z = one[col.X], one[col.Z]
    lead, slope = math.cos(size[col.HELIX]), math.sin(size[col.HELIX])
    sine, cosine, base = math.sin(alpha), math.cos(alpha), size[col.RB_1]
    m_c, m_t = tilt_arms(size, (side, x, z), state)
    turned_c = slope * (base * cosine + x * sine) + side * lead * z * sine
    turned_t = lead * z * cosine - side * slope * (base * sine - x * cosine)
    opened = lead * sine + (turned_c * tilt_c + turned_t * tilt_t) * rates[3]
    opened -= side * slope * tilt_t
    one[col.FIRST_GRADIENT + col.TURN_1] = lead * side * base + one[col.DEPTH_AT] * rates[0]
    one[col.FIRST_GRADIENT + col.TURN_2] = lead * side * size[col.RB_2]
    if size[col.RACK] > 0.0:
        one[col.FIRST_GRADIENT + col.TURN_2] -= side * slope * tilt_c
    moved = one[col.DEPTH_AT] * rates[1] + one[col.DEPTH_FIRST] * rates[2]
    one[col.FIRST_GRADIENT + col.DISTANCE] = moved - opened
    one[col.FIRST_GRADIENT + col.SHIFT] = side * slope
    one[col.FIRST_GRADIENT + col.TILT_C], one[col.FIRST_GRADIENT + col.TILT_T] = -m_c, -m_t


@inner
def push_line(s, W, meshes, k, what, count, place):
    """Add the slices of a line to the derivatives of the energy; let them damp and rub."""
    size, law, line, (side, state) = meshes.size[k], meshes.law[k], meshes.line, place
    rates, rims = path_rates(size, side, state, law[col.FOLLOWS]), has_rims(meshes, k)
    for cell in range(count):
        one = line[cell]
        if one[col.FORCE] > 0.0:
            set_gradient(size, one, side, state, rates)
            rate, loss = damp(s, W, meshes, k, cell, place)
            set_loss(one, loss, law[col.DAMPING])
            if what == col.FORCES:
                W.power[2] += one[col.LOSS] * rate
                record_slice(meshes, k, one, side)
            else:
                add_stiffness(meshes, one, rates, rims, law[col.COUPLING] > 0.0)
            if rims or law[col.FRICTION] > 0.0:
                rub(s, W, meshes, k, what, cell, place)
        add_gradient(meshes, one, rates)
    if what == col.TANGENTS and law[col.COUPLING] > 0.0 and not rims:
        add_line_stiffness(meshes, k, count)


@inner
def set_loss(one, loss, damping):
    """Write what damping adds to a slice, and how its force follows depth and its rate."""
    bound = abs(loss) >= 1.0
    one[col.LOSS] = loss * one[col.FORCE]
    one[col.STEEP] = one[col.BY_DEPTH] * (1.0 + loss)
    one[col.STEEP] -= 0.0 if bound else one[col.LOSS] / one[col.DEPTH]
    one[col.VISCOUS] = 0.0 if bound else damping * one[col.FORCE] / one[col.DEPTH]


@inner
def record_slice(meshes, k, one, side):
    """Remember a slice that bears, as far as there is room."""
    load, n = one[col.FORCE] + one[col.LOSS], int(meshes.n_slices[k])
    meshes.load[k] += load
    if n < meshes.slices.shape[1]:
        found = meshes.slices[k, n]
        found[col.SIDE], found[col.PLACE], found[col.HEIGHT] = side, one[col.X], one[col.Z]
        found[col.LENGTH], found[col.LOAD] = one[col.LENGTH_OF_LINE], load
        meshes.n_slices[k] += 1.0


@inner
def follow_line(one, weight, stiffness, constant):
    """How what follows weight, stiffness and constant goes with the line, and the path's begin."""
    by_at = one[weight] * one[col.WEIGHT_AT] + one[stiffness] * one[col.STIFFNESS_AT]
    by_first = one[weight] * one[col.WEIGHT_FIRST] + one[stiffness] * one[col.STIFFNESS_FIRST]
    by_at += one[constant] * one[col.CONSTANT_AT]
    return by_at, by_first + one[constant] * one[col.CONSTANT_FIRST]


@inner
def add_gradient(meshes, one, rates):
    """Add the derivatives of the energy of a slice, and of what damping takes."""
    by_at, by_first = follow_line(one, col.WORK_WEIGHT, col.WORK_STIFFNESS, col.WORK_CONSTANT)
    if one[col.FORCE] > 0.0:
        for a in range(col.COORDINATES):
            meshes.gradient[a] += (one[col.FORCE] + one[col.LOSS]) * one[col.FIRST_GRADIENT + a]
    meshes.gradient[col.TURN_1] += by_at * rates[0]
    meshes.gradient[col.DISTANCE] += by_at * rates[1] + by_first * rates[2]


@inner
def add_stiffness(meshes, one, rates, rims, coupled):
    """Add the second derivatives of the energy of a slice but for those of its curved gap.

    Those by its depth alone are added with rims, and with slices that carry each other, elsewhere.
    """
    by_at, by_first = follow_line(one, col.BY_WEIGHT, col.BY_STIFFNESS, col.BY_CONSTANT)
    by_turn, by_distance = by_at * rates[0], by_at * rates[1] + by_first * rates[2]
    steep, viscous, stiffness = one[col.STEEP], one[col.VISCOUS], meshes.hessian
    steep -= one[col.BY_DEPTH] if coupled else 0.0
    stiffness[0, col.DISTANCE, col.DISTANCE] += (one[col.FORCE] + one[col.LOSS]) * rates[4]
    for a in range(col.COORDINATES):
        depth = one[col.FIRST_GRADIENT + a]
        stiffness[0, a, col.TURN_1] += by_turn * depth
        stiffness[0, col.TURN_1, a] += by_turn * depth
        stiffness[0, a, col.DISTANCE] += by_distance * depth
        stiffness[0, col.DISTANCE, a] += by_distance * depth
        if not rims:
            for b in range(col.COORDINATES):
                stiffness[0, a, b] += steep * depth * one[col.FIRST_GRADIENT + b]
                stiffness[1, a, b] += viscous * depth * one[col.FIRST_GRADIENT + b]


@residuals.of(Meshes)
def mesh_wrenches(s, W, meshes, q, v, _lam):
    """Add the teeth to the wrenches on the markers and forces on rims; add up the power lost."""
    for k in range(meshes.i.size):
        deform_rims(s, meshes, k, q, v)
        add_lines(s, W, meshes, k, col.FORCES)
        bend_rims(s, W, meshes, k)


@tangents.of(Meshes)
def mesh_tangents(s, W, meshes, _lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S.

    Left out is how gaps are curved, and how tilts turn the forces; where these do not follow their
    energy along the path, all their turning.
    """
    meshes.factor[0], meshes.factor[1] = ck, cc
    for k in range(meshes.i.size):
        meshes.tangent[:] = 0.0
        add_lines(s, W, meshes, k, col.TANGENTS)
        place_tangent(s, W, (meshes.i[k], meshes.j[k]), meshes.tangent, ck, cc)


@energy.of(Meshes)
def mesh_energy(s, W, meshes, q, v):
    """Energy stored in teeth."""
    total = 0.0
    for k in range(meshes.i.size):
        deform_rims(s, meshes, k, q, v)
        total += add_lines(s, W, meshes, k, col.ENERGY)
    return total
