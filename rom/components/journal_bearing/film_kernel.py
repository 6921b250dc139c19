"""Pressure in an oil film: finite volumes, cavitation by complementarity, exact derivatives.

Unwrapped, dimensionless: film H in clearances, pressure in mu W (R/c)^2, width Z in lengths of the
bearing, time in radians of rotation. In every cell oil that flows out equals oil that flows in,

    sum of a (P - P_next) + 6 d(fill H) + 12 fill dH/dt = 0,   P >= 0,

and a cell either carries pressure and is full, or has none. What a cell without pressure lacks is
its unknown: oil from nowhere (Reynolds) or its filling (mass-conserving).
"""

import math
from typing import NamedTuple

import numpy as np

from rom.components.compiled import inner, kernel
from rom.components.journal_bearing.band import back_substitute, factor
from rom.model import Array, Index

FULL, REYNOLDS, JFO = 0, 1, 2  # no cavitation; oil from nowhere; oil is conserved
N_MOTIONS = 4  # journal centre x, y and tilt about x, y
MAX_ITERATIONS = 100  # changes of the cavitated region


class Grid(NamedTuple):
    """Cells of an unwrapped bearing; column i is centred at angle i dtheta.

    Attributes:
        angle: (2, nt, 2) cosine and sine at the centres [0] and behind them at the faces [1].
        bore: (2, nt) film of the centred journal there, in clearances.
        Z: (nz,) centres of the cells along the width.
        Z_face: (nz + 1,) their faces.
        fixed: (nt, nz) 1 where the pressure is that of the inlet.
        inlet: (nt, nz) pressure there.
        slender: (R/L)^2.
        half: 1.0 if the cells cover half the width, the other half being its image; else 0.0.
    """

    angle: Array
    bore: Array
    Z: Array
    Z_face: Array
    fixed: Index
    inlet: Array
    slender: float
    half: float


@inner
def per_motion(grid, face, i, Z, k):
    """Film opened at column i by a unit of motion k; pressure times this is the force on it."""
    c, s = grid.angle[face, i, 0], grid.angle[face, i, 1]
    if k == 0:
        return -c
    if k == 1:
        return -s
    return Z * s if k == 2 else -Z * c


@inner
def thickness(grid, motion, face, i, Z):
    """Film at column i, or at the face behind it."""
    H = grid.bore[face, i]
    for k in range(N_MOTIONS):
        H += motion[k] * per_motion(grid, face, i, Z, k)
    return H


@inner
def along_width(grid, j):
    """Conductance of face j over that of a film of unit height: image, inside, or open end."""
    dZ, dtheta = grid.Z_face[1] - grid.Z_face[0], 2 * math.pi / grid.bore.shape[1]
    ratio = grid.slender * dtheta / dZ
    if j == 0:
        return 0.0 if grid.half > 0.0 else 2 * ratio
    return 2 * ratio if j == grid.Z.size else ratio


@inner
def order(active, fixed, law, place):
    """Order the columns; returns how far neighbours lie apart.

    The ring is cut open behind a column that hears nothing of the next one: an inlet, or both have
    no pressure. Where there is none the ring is laid flat.
    """
    nt, nz = active.shape
    cut = -1
    for i in range(nt):
        closed, after = True, (i + 1) % nt
        for j in range(nz):
            void = active[i, j] == 0 and (active[after, j] == 0 or fixed[after, j] == 1)
            if fixed[i, j] == 0 and (law == JFO or not void):
                closed = False
        if closed:
            cut = i
    for i in range(nt):
        if cut >= 0:
            place[i] = (i - cut - 1) % nt
        else:
            place[i] = 2 * i if 2 * i < nt else 2 * (nt - 1 - i) + 1
    return nz if cut >= 0 else 2 * nz


@inner
def add_flow(a, row, own, other, state, inlet, band, rhs):  # noqa: PLR0913
    """Flow a (P - P_neighbour) out of a cell; columns exist for cells that carry pressure."""
    w = band.shape[1] // 2
    if own == 1:
        band[row, w] += a
    if state == 2:
        rhs[row] += a * inlet
    elif state == 1:
        band[row, w + other - row] -= a


@inner
def assemble(grid, motion, rate, active, law, place, band, rhs):  # noqa: PLR0913
    """Balances of all cells; the unknown of a cell is its pressure, or fill - 1 <= 0."""
    nt, nz = active.shape
    w, dZ, dtheta = band.shape[1] // 2, grid.Z_face[1] - grid.Z_face[0], 2 * math.pi / nt
    for i in range(nt):
        before, after = (i - 1) % nt, (i + 1) % nt
        for j in range(nz):
            row = place[i] * nz + j
            if grid.fixed[i, j] == 1:
                band[row, w], rhs[row] = 1.0, grid.inlet[i, j]
                continue
            own = active[i, j]
            H, Z = thickness(grid, motion, 1, i, grid.Z[j]), grid.Z[j]
            H_before = thickness(grid, motion, 1, before, Z)
            squeeze = 0.0
            for k in range(N_MOTIONS):
                squeeze += 12 * dtheta * dZ * rate[k] * per_motion(grid, 0, i, Z, k)
            rhs[row] = -6 * dZ * (H - H_before) - squeeze
            for side in range(2):
                o = after if side == 0 else before
                h = H if side == 0 else H_before
                state = 2 if grid.fixed[o, j] == 1 else active[o, j]
                add_flow(h**3 * dZ / dtheta, row, own, place[o] * nz + j, state,
                         grid.inlet[o, j], band, rhs)  # fmt: skip
            for side in range(2):
                o, face = j - 1 + 2 * side, j + side
                h = thickness(grid, motion, 0, i, grid.Z_face[face])
                a, inside = along_width(grid, face) * h**3, 0 <= o < nz
                state, p = 0, 0.0
                if inside:
                    state = 2 if grid.fixed[i, o] == 1 else active[i, o]
                    p = grid.inlet[i, o]
                add_flow(a, row, own, row - 1 + 2 * side, state, p, band, rhs)
            if own == 0 and law == JFO:
                band[row, w] += 6 * dZ * H + squeeze
            elif own == 0:
                band[row, w] = 1.0
            if law == JFO and grid.fixed[before, j] == 0 and active[before, j] == 0:
                band[row, w + place[before] * nz + j - row] -= 6 * dZ * H_before


@inner
def changed(u, fixed, law, place, active):
    """Cells that lose their film or find one again; `active` is updated."""
    nt, nz = active.shape
    count = 0
    for i in range(nt):
        for j in range(nz):
            now = 1 if u[place[i] * nz + j, 0] > 0.0 else 0
            if fixed[i, j] == 0 and law != FULL and now != active[i, j]:
                active[i, j] = now
                count += 1
    return count


@inner
def opened(grid, motion, P, fill, place, X):
    """Minus the derivative of all balances per unit of each motion and each rate of motion."""
    nt, nz = P.shape
    dZ, dtheta = grid.Z_face[1] - grid.Z_face[0], 2 * math.pi / nt
    for i in range(nt):
        before, after = (i - 1) % nt, (i + 1) % nt
        for j in range(nz):
            row, Z = place[i] * nz + j, grid.Z[j]
            if grid.fixed[i, j] == 1:
                continue
            h, h_before = thickness(grid, motion, 1, i, Z), thickness(grid, motion, 1, before, Z)
            east = 3 * h**2 * dZ / dtheta * (P[i, j] - P[after, j]) + 6 * dZ * fill[i, j]
            west = 3 * h_before**2 * dZ / dtheta * (P[i, j] - P[before, j])
            west -= 6 * dZ * fill[before, j]
            for k in range(N_MOTIONS):
                X[row, k] = -east * per_motion(grid, 1, i, Z, k)
                X[row, k] -= west * per_motion(grid, 1, before, Z, k)
                g = per_motion(grid, 0, i, Z, k)
                X[row, N_MOTIONS + k] = -12 * dtheta * dZ * fill[i, j] * g
            for side in range(2):
                o, face = j - 1 + 2 * side, j + side
                drop = P[i, j] - (P[i, o] if 0 <= o < nz else 0.0)
                Z = grid.Z_face[face]
                a = 3 * thickness(grid, motion, 0, i, Z) ** 2 * along_width(grid, face) * drop
                for k in range(N_MOTIONS):
                    X[row, k] -= a * per_motion(grid, 0, i, Z, k)


@kernel
def solve_film(grid, motion, rate, law, active, P, fill):
    """Pressure, fill, force on the journal and its derivatives.

    Args:
        grid: of the bearing.
        motion: (4,) x, y in clearances, tilt about x, y times L/c.
        rate: (4,) their rates per radian of rotation.
        law: FULL, REYNOLDS or JFO.
        active: (nt, nz) 1 where cells carry pressure: a guess, and what came out.
        P: (nt, nz) is filled in.
        fill: (nt, nz) too.

    Returns:
        (4,) forces that work on the motions; (4, 8) their derivatives by motions and rates; how
        often the cavitated region was changed, -1 if it would not settle.
    """
    nt, nz = P.shape
    place = np.empty(nt, dtype=np.int64)
    count = -1
    for iteration in range(MAX_ITERATIONS):
        w = order(active, grid.fixed, law, place)
        band, u = np.zeros((nt * nz, 2 * w + 1)), np.zeros((nt * nz, 1))
        assemble(grid, motion, rate, active, law, place, band, u[:, 0])
        factor(band)
        back_substitute(band, u)
        for i in range(nt):
            for j in range(nz):
                carries = active[i, j] == 1 or grid.fixed[i, j] == 1
                P[i, j] = u[place[i] * nz + j, 0] if carries else 0.0
                fill[i, j] = 1.0
                if not carries and law == JFO:
                    fill[i, j] = 1.0 + u[place[i] * nz + j, 0]
        if changed(u, grid.fixed, law, place, active) == 0:
            count = iteration + 1
            break
    X = np.zeros((nt * nz, 2 * N_MOTIONS))
    opened(grid, motion, P, fill, place, X)
    back_substitute(band, X)
    return *resultants(grid, active, place, P, X), count


@inner
def resultants(grid, active, place, P, X):
    """Forces on the motions, and their derivatives from those of the pressures."""
    nt, nz = P.shape
    cell = (grid.Z_face[1] - grid.Z_face[0]) * 2 * math.pi / nt * (2.0 if grid.half > 0.0 else 1.0)
    F, dF = np.zeros(N_MOTIONS), np.zeros((N_MOTIONS, 2 * N_MOTIONS))
    for i in range(nt):
        for j in range(nz):
            for k in range(N_MOTIONS):
                if k >= 2 and grid.half > 0.0:
                    continue  # the image takes the moment
                g = cell * per_motion(grid, 0, i, grid.Z[j], k)
                F[k] += P[i, j] * g
                if active[i, j] == 1 and grid.fixed[i, j] == 0:
                    for m in range(2 * N_MOTIONS):
                        dF[k, m] += X[place[i] * nz + j, m] * g
    return F, dF
