"""Slices on rims that deform: where they are, how these close them, and forces on them."""

import math

from rom.components.gear_mesh.gears.table import FRICTION
from rom.components.round_bodies.cylinders import (
    add_gradient_products,
    at_place,
    deform,
    load_surface,
    set_basis,
    set_gradient,
    spread_surface_loads,
)
from rom.mbs.kernels.algebra import cross, dot, row, scale, sub
from rom.mbs.kernels.compiled import inner


@inner
def add_rim_tangent(s, W, meshes, at, factors, directions, arms):
    """Add a slice, by its mesh and number, between rims that deform to W.Kt and W.S."""
    (by_depth, by_rate, by_slip), (n, force, across) = factors, directions
    k, ck, cc = at[0], meshes.factor[0], meshes.factor[1]
    markers = meshes.i[k], meshes.j[k]
    rows = (2, 3) if meshes.law[k, FRICTION] == 0.0 else (0, 1)  # along which forces act
    set_rim_gradients(s, W, meshes, at, 2, n, arms)
    if rows[0] == 0:
        set_rim_gradients(s, W, meshes, at, 0, force, arms)
    add_gradient_products(s, meshes.rims.gradient, rows, markers, ck * by_depth, W.Kt)
    if by_rate > 0.0:
        add_gradient_products(s, meshes.rims.gradient, rows, markers, cc * by_rate, W.S)
    if by_slip > 0.0:
        set_rim_gradients(s, W, meshes, at, 2, across, arms)
        add_gradient_products(s, meshes.rims.gradient, (2, 3), markers, cc * by_slip, W.S)


@inner
def set_rim_gradients(s, W, meshes, at, first, e, arms):
    """How a slice closes along e per velocity of the pinion, row ``first``, and of the gear."""
    k, cell = at
    rims, i, j = meshes.rims, meshes.i[k], meshes.j[k]
    back = scale(-1.0, e)
    set_gradient(s, W, rims, (first, rims.of[k, 0], cell, 0), i, e, cross(arms[0], e))
    set_gradient(s, W, rims, (first + 1, rims.of[k, 1], cell, 1), j, back, cross(arms[1], back))


@inner
def place_on_rims(W, meshes, k, cell, arm, axes):
    """Find the place of a slice, at an arm from the middle of the pinion, on rims that deform."""
    _, _, z, e1, n2, e2 = axes
    i, j, rims = meshes.i[k], meshes.j[k], meshes.rims
    for side in range(2):
        c, axis, across = rims.of[k, side], (z if side == 0 else n2), (e1 if side == 0 else e2)
        if c < 0:
            continue
        x = arm if side == 0 else sub(arm, sub(row(W.P, j, 0), row(W.P, i, 0)))
        angle = math.atan2(dot(x, cross(axis, across)), dot(x, across))
        set_basis(rims, c, (cell, side), angle, dot(x, axis))


@inner
def closing_of_rims(s, W, meshes, at, e, amplitude):
    """How rims that deform by an amplitude close a slice along e, or how fast."""
    rims, total, (k, cell) = meshes.rims, 0.0, at
    for side in range(2):
        c, b = rims.of[k, side], s.markers.body[meshes.i[k] if side == 0 else meshes.j[k]]
        if c >= 0:
            total += (1.0 - 2.0 * side) * dot(e, at_place(W, rims, c, (cell, side), b, amplitude))
    return total


@inner
def load_rims(s, W, meshes, at, force):
    """Let the force of a slice on the gear act on rims that deform."""
    rims, (k, cell) = meshes.rims, at
    for side in range(2):
        c, b = rims.of[k, side], s.markers.body[meshes.i[k] if side == 0 else meshes.j[k]]
        if c >= 0:
            load_surface(W, rims, c, (cell, side), b, scale(2.0 * side - 1.0, force))


@inner
def deform_rims(s, meshes, k, q, v):
    """How the rims of mesh k deform."""
    for side in range(2):
        c, b = meshes.rims.of[k, side], s.markers.body[meshes.i[k] if side == 0 else meshes.j[k]]
        if c >= 0:
            deform(s, meshes.rims, c, b, q, v)


@inner
def bend_rims(s, W, meshes, k):
    """Subtract the forces on the rims of mesh k, as elastic ones, from W.residual."""
    for side in range(2):
        c, m = meshes.rims.of[k, side], (meshes.i[k] if side == 0 else meshes.j[k])
        if c >= 0:
            spread_surface_loads(s, W, meshes.rims, c, s.markers.body[m])
