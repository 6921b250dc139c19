"""Damping and friction of a slice of teeth; these, and rims that deform, ask where it touches."""

import math

from rom.components.gear_mesh.gears import table as col
from rom.components.gear_mesh.gears.rims import add_rim_tangent, closing_of_rims, load_rims
from rom.components.gear_mesh.gears.table import has_rims
from rom.mbs.kernels.algebra import add, cross, dot, put, row, scale, sub
from rom.mbs.kernels.compiled import inner

ACROSS, CLOSING = range(2)  # rows of Meshes.lever


@inner
def contact_point(W, meshes, k, place, state):
    """Where a slice is, from both markers; the normal, and the direction in which flanks slide."""
    side, x, height = place
    (c, t, z, _, _, _), alpha, _, _, _ = state
    size = meshes.size[k]
    cosine, sine = math.cos(alpha), math.sin(alpha)
    along = add(scale(sine, c), scale(side * cosine, t))
    n = sub(scale(math.cos(size[col.HELIX]), along), scale(side * math.sin(size[col.HELIX]), z))
    foot = sub(scale(size[col.RB_1] * cosine, c), scale(side * size[col.RB_1] * sine, t))
    arm = add(add(foot, scale(x, along)), scale(height, z))  # from the middle of the pinion
    apart = sub(row(W.P, meshes.j[k], 0), row(W.P, meshes.i[k], 0))
    return (arm, sub(arm, apart)), n, cross(z, along)


@inner
def put_lever(lever, kind, e, arms):
    """Write (e, arm_1 x e, -e, -arm_2 x e): what the motions of the wheels do along e."""
    one, two = cross(arms[0], e), cross(arms[1], e)
    for p in range(3):
        lever[kind, p], lever[kind, 3 + p] = e[p], one[p]
        lever[kind, 6 + p], lever[kind, 9 + p] = -e[p], -two[p]


@inner
def add_product(tangent, factor, one, two):
    """Add factor times the outer product of two vectors."""
    for p in range(12):
        for q in range(12):
            tangent[p, q] += factor * one[p] * two[q]


@inner
def add_force(wrench, arm, force):
    """Add a force at an arm from a marker to its wrench."""
    put(wrench, 0, force)
    put(wrench, 3, cross(arm, force))


@inner
def damp(s, W, meshes, k, cell, place):
    """Rate at which the flanks of a slice close, and what damping adds over its elastic force.

    Flanks do not pull, and their force does not jump as they touch: it is at most the elastic one.
    """
    rate, damping, (side, state), one = 0.0, meshes.law[k, col.DAMPING], place, meshes.line[cell]
    if damping == 0.0:
        return 0.0, 0.0
    for a in range(col.COORDINATES):
        rate += one[col.FIRST_GRADIENT + a] * meshes.speed[a]
    if has_rims(meshes, k):
        _, n, _ = contact_point(W, meshes, k, (side, one[col.X], one[col.Z]), state)
        rate += closing_of_rims(s, W, meshes, (k, cell), n, meshes.rims.rate)
    return rate, min(max(damping * rate / one[col.DEPTH], -1.0), 1.0)


@inner
def sliding_speed(s, W, meshes, at, directions, axis):
    """Speed at which flanks slide, and the part of wheels that spin in their frames."""
    (arms, _, across), (k, _) = directions, at
    spinning = meshes.spin[k, 0] * dot(across, cross(axis, arms[0]))
    spinning -= meshes.spin[k, 1] * dot(across, cross(axis, arms[1]))
    i, j = meshes.i[k], meshes.j[k]
    slide = add(row(W.V, i, 0), cross(row(W.V, i, 3), arms[0]))
    slide = sub(slide, add(row(W.V, j, 0), cross(row(W.V, j, 3), arms[1])))
    speed = dot(across, slide) + spinning
    if has_rims(meshes, k):
        speed += closing_of_rims(s, W, meshes, at, across, meshes.rims.rate)
    return speed, spinning


@inner
def rub(s, W, meshes, k, what, cell, place):
    """Let one slice rub, and press rims that deform, or add the tangents of that."""
    law, (side, state), one, at = meshes.law[k], place, meshes.line[cell], (k, cell)
    directions = contact_point(W, meshes, k, (side, one[col.X], one[col.Z]), state)
    speed, spinning = sliding_speed(s, W, meshes, at, directions, state[0][2])
    load = one[col.FORCE] + one[col.LOSS]
    turned = math.tanh(speed / law[col.SPEED])
    grip = law[col.FRICTION] * turned
    arms, n, across = directions
    if what == col.FORCES:
        force = scale(load * grip, across)
        add_force(W.wrench[meshes.i[k]], arms[0], scale(-1.0, force))
        add_force(W.wrench[meshes.j[k]], arms[1], force)
        load_rims(s, W, meshes, at, add(scale(load, n), force))
        W.power[2] += load * grip * speed
        W.power[1] += load * grip * spinning
        return
    stick = law[col.FRICTION] * load * (1.0 - turned * turned) / law[col.SPEED]
    if has_rims(meshes, k):
        along = n, add(n, scale(grip, across)), across
        add_rim_tangent(s, W, meshes, at, (one[col.STEEP], one[col.VISCOUS], stick), along, arms)
    else:
        add_friction(meshes, one, directions, grip, stick)


@inner
def add_friction(meshes, one, directions, grip, stick):
    """Add the tangents of the friction of a slice, which follows its load and how it slides."""
    arms, _, across = directions
    lever, tangent = meshes.lever, meshes.tangent
    put_lever(lever, ACROSS, across, arms)
    for q in range(12):
        lever[CLOSING, q] = 0.0
        for a in range(col.COORDINATES):
            lever[CLOSING, q] += one[col.FIRST_GRADIENT + a] * meshes.rates[a, q]
    add_product(tangent[0], grip * one[col.STEEP], lever[ACROSS], lever[CLOSING])
    add_product(tangent[1], grip * one[col.VISCOUS], lever[ACROSS], lever[CLOSING])
    add_product(tangent[1], stick, lever[ACROSS], lever[ACROSS])
