"""What a film does to the journal, and its exact derivatives.

Answers are weighted sums of pressures, and of fillings: with the balances A u = b their weights g
give y = A^-T g, and the derivative by anything is y times that of b - A u. One solution per answer
serves all motions, rates, the spin and the openings of single cells.
"""

from rom.components.journal_bearing.films import cells as col
from rom.components.journal_bearing.films.bearing import JFO
from rom.components.journal_bearing.films.cells import (
    cell_size,
    column_after,
    column_before,
    per_motion,
)
from rom.components.journal_bearing.films.pressure import (
    at_side,
    back_substitute_transposed,
    find_pressure,
    has_memory,
    order,
    set_heights,
    set_supply,
)
from rom.mbs.kernels.compiled import inner, kernel

TORQUE_ANSWER = col.N_MOTIONS  # number of the last answer


@inner
def n_motions(films, k):
    """Motions that a film feels: no tilt where half of it is the image of the other half."""
    return 2 if films.size[k, col.IMAGES] > 1.0 else col.N_MOTIONS


@inner
def set_answers(films, k):
    """Forces on motions and functions; torque of sheared oil and of pressure on its slope."""
    nt, nz = films.shape[k]
    dtheta, dZ = cell_size(films, k)
    width = dZ * films.size[k, col.IMAGES]
    films.answer[k, :] = 0.0
    for i in range(nt):
        for j in range(nz):
            cell, Z = i * nz + j, films.size[k, col.Z_FIRST] + (j + 0.5) * dZ
            P, west = films.P[k, cell], column_before(i, nt) * nz + j
            for m in range(n_motions(films, k)):
                opened = per_motion(films, k, 0, i, Z, m)
                films.answer[k, m] += width * dtheta * P * opened
            for f in range(films.n_functions[k]):
                opened = films.functions[k, cell, f]
                films.answer[k, col.N_ANSWERS + f] += width * dtheta * P * opened
            filled = films.fill[k, cell] / films.middle[k, cell]
            shear = films.state[k, col.SPIN_COLUMN] * filled * dtheta
            rise = films.behind[k, cell] - films.behind[k, west]
            films.answer[k, TORQUE_ANSWER] += width * (shear - 0.5 * P * rise)


@inner
def set_slopes(films, k):
    """Set the derivatives of the answers; `find_pressure` first."""
    set_weights(films, k)
    w, n = order(films, k), films.shape[k, 0] * films.shape[k, 1]
    back_substitute_transposed(films.band[k], n, w, films.weight[k])
    films.slope[k, :, :] = 0.0
    nt, nz = films.shape[k]
    for i in range(nt):
        for j in range(nz):
            add_shear_slopes(films, k, i, j)
            if films.fixed[k, i * nz + j] == 0:
                add_cell_slopes(films, k, i, j)


@inner
def set_weights(films, k):
    """Set how much the unknown of each cell counts in each answer."""
    nt, nz = films.shape[k]
    dtheta, dZ = cell_size(films, k)
    width = dZ * films.size[k, col.IMAGES]
    for i in range(nt):
        for j in range(nz):
            cell, row = i * nz + j, films.place[k, i] * nz + j
            films.weight[k, row, :] = 0.0
            if films.fixed[k, cell] == 1:
                continue
            if films.active[k, cell] == 1:
                Z, west = films.size[k, col.Z_FIRST] + (j + 0.5) * dZ, column_before(i, nt) * nz + j
                for m in range(n_motions(films, k)):
                    films.weight[k, row, m] = width * dtheta * per_motion(films, k, 0, i, Z, m)
                for f in range(films.n_functions[k]):
                    opened = films.functions[k, cell, f]
                    films.weight[k, row, col.N_ANSWERS + f] = width * dtheta * opened
                rise = films.behind[k, cell] - films.behind[k, west]
                films.weight[k, row, TORQUE_ANSWER] = -0.5 * width * rise
            elif films.law[k] == JFO:
                shear = films.state[k, col.SPIN_COLUMN] * dtheta / films.middle[k, cell]
                films.weight[k, row, TORQUE_ANSWER] = width * shear


@inner
def add_shear_slopes(films, k, i, j):
    """What the torque of a cell changes while its pressure and filling stay."""
    nt, nz = films.shape[k]
    dtheta, dZ = cell_size(films, k)
    cell, Z = i * nz + j, films.size[k, col.Z_FIRST] + (j + 0.5) * dZ
    width, h = dZ * films.size[k, col.IMAGES], films.middle[k, cell]
    shear = width * dtheta * films.fill[k, cell] / h
    films.slope[k, TORQUE_ANSWER, col.SPIN_COLUMN] += shear
    thinner, slanted = shear * films.state[k, col.SPIN_COLUMN] / h, 0.5 * width * films.P[k, cell]
    for m in range(n_motions(films, k)):
        rise = per_motion(films, k, col.BEHIND_FACE, i, Z, m)
        rise -= per_motion(films, k, col.BEHIND_FACE, column_before(i, nt), Z, m)
        opened = per_motion(films, k, 0, i, Z, m)
        films.slope[k, TORQUE_ANSWER, m] -= thinner * opened + slanted * rise
    east, west = column_after(i, nt) * nz + j, column_before(i, nt) * nz + j
    for f in range(films.n_functions[k]):
        opened, g = films.functions[k, :, f], col.FIRST_OPENED + f
        rise = 0.5 * (opened[east] - opened[west])
        films.slope[k, TORQUE_ANSWER, g] -= thinner * opened[cell] + slanted * rise


@inner
def carried(films, k, west, east):
    """Filling of what the journal drags from the cell west of a face to that east of it."""
    return films.fill[k, west] if films.state[k, col.SPIN_COLUMN] > 0.0 else films.fill[k, east]


@inner
def balance_slopes(films, k, i, j):
    """Changes of the balance of a cell.

    These are by the film at the faces behind and before it, at its centre, at its two sides; by the
    rate of the film; by the spin.
    """
    nt, nz = films.shape[k]
    dtheta, dZ = cell_size(films, k)
    cell, P, spin = i * nz + j, films.P[k, i * nz + j], films.state[k, col.SPIN_COLUMN]
    east, west = column_after(i, nt) * nz + j, column_before(i, nt) * nz + j
    h, h_west = films.behind[k, cell], films.behind[k, west]
    away, into = 6 * dZ * carried(films, k, cell, east), 6 * dZ * carried(films, k, west, cell)
    by_east = 3 * films.conducts[k, cell] / h * (P - films.P[k, east]) + spin * away
    by_west = 3 * films.conducts[k, west] / h_west * (P - films.P[k, west]) - spin * into
    by_middle = films.store[k, cell] * films.fill[k, cell] / films.middle[k, cell]
    by_rate = 12 * dtheta * dZ * films.fill[k, cell]
    if has_memory(films, k):
        by_rate = 0.0
    else:
        by_middle = 0.0
    low, high = side_slope(films, k, i, j, 0), side_slope(films, k, i, j, 1)
    return (by_east, by_west, by_middle, low, high), by_rate, h * away - h_west * into


@inner
def side_slope(films, k, i, j, end):
    """Change of the flow through a side of a cell by the film there."""
    nz = films.shape[k, 1]
    cell, face, o = i * nz + j, i * (nz + 1) + j + end, j - 1 + 2 * end
    drop = films.P[k, cell] - (films.P[k, cell - 1 + 2 * end] if 0 <= o < nz else 0.0)
    return 3 * films.leaks[k, face] / films.side[k, face] * drop


@inner
def add_cell_slopes(films, k, i, j):
    """Add the weights of a cell times the change of its balance."""
    nt, nz = films.shape[k]
    dZ = cell_size(films, k)[1]
    row, cell = films.place[k, i] * nz + j, i * nz + j
    Z = films.size[k, col.Z_FIRST] + (j + 0.5) * dZ
    by_film, by_rate, by_spin = balance_slopes(films, k, i, j)
    by_east, by_west, by_middle, low, high = by_film
    for m in range(n_motions(films, k)):
        opened = per_motion(films, k, 0, i, Z, m)
        change = by_east * per_motion(films, k, col.BEHIND_FACE, i, Z, m) + by_middle * opened
        change += by_west * per_motion(films, k, col.BEHIND_FACE, column_before(i, nt), Z, m)
        change += low * per_motion(films, k, 0, i, Z - 0.5 * dZ, m)
        change += high * per_motion(films, k, 0, i, Z + 0.5 * dZ, m)
        films.change[k, m], films.change[k, col.N_MOTIONS + m] = change, by_rate * opened
    east, west = column_after(i, nt) * nz + j, column_before(i, nt) * nz + j
    column = films.functions[k, i * nz : (i + 1) * nz]
    for f in range(films.n_functions[k]):
        g, opened = films.functions[k, :, f], films.functions[k, cell, f]
        change = 0.5 * (by_east * (opened + g[east]) + by_west * (opened + g[west]))
        change += by_middle * opened
        change += low * at_side(nz, j, column[:, f]) + high * at_side(nz, j + 1, column[:, f])
        films.change[k, col.FIRST_OPENED + f] = change
        films.change[k, col.FIRST_OPENED + films.functions.shape[2] + f] = by_rate * opened
    films.change[k, col.SPIN_COLUMN] = by_spin
    add_change(films, k, row)


@inner
def add_change(films, k, row):
    """Subtract the weights of a row times the changes of its balance."""
    for m in range(col.N_ANSWERS + films.n_functions[k]):
        weight, slope, change = films.weight[k, row, m], films.slope[k, m], films.change[k]
        if weight != 0.0:
            for q in range(change.size):
                slope[q] -= weight * change[q]


@kernel
def solve_film(films, k, viscosity):
    """Pressure, answers and slopes of film k at its state.

    Returned is how often the cavitated region was solved for; -1 if it would not settle.
    """
    set_heights(films, k)
    set_supply(films, k, viscosity)
    count = find_pressure(films, k)
    if count > 0:
        set_answers(films, k)
        set_slopes(films, k)
    return count
