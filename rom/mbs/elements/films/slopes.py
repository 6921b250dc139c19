"""What a film does to the journal, and its exact derivatives.

Answers are weighted sums of pressures, and of fillings: with the balances A u = b their weights g
give y = A^-T g, and the derivative by anything is y times that of b - A u. One solution per answer
serves all motions, rates, the spin and the openings of single cells.
"""

from rom.mbs.elements.films.band import back_substitute_transposed
from rom.mbs.elements.films.bearing import JFO
from rom.mbs.elements.films.cells import (
    BEHIND_FACE,
    IMAGES,
    N_ANSWERS,
    N_MOTIONS,
    SPIN_COLUMN,
    Z_FIRST,
)
from rom.mbs.elements.films.pressure import (
    cell_size,
    find_pressure,
    has_memory,
    order,
    per_motion,
    set_heights,
    set_supply,
)
from rom.mbs.kernels.compiled import inner, kernel

TORQUE_ANSWER = N_MOTIONS  # number of the last answer


@inner
def n_motions(films, k):
    """Motions that a film feels: no tilt where half of it is the image of the other half."""
    return 2 if films.size[k, IMAGES] > 1.0 else N_MOTIONS


@inner
def set_answers(films, k):
    """Forces on the motions; torque of sheared oil and of pressure on its slope."""
    nt, nz = films.shape[k]
    dtheta, dZ = cell_size(films, k)
    width = dZ * films.size[k, IMAGES]
    for m in range(N_ANSWERS):
        films.answer[k, m] = 0.0
    for i in range(nt):
        for j in range(nz):
            cell, Z = i * nz + j, films.size[k, Z_FIRST] + (j + 0.5) * dZ
            P, west = films.P[k, cell], (i - 1) % nt * nz + j
            for m in range(n_motions(films, k)):
                opened = per_motion(films, k, 0, i, Z, m)
                films.answer[k, m] += width * dtheta * P * opened
            shear = (
                films.state[k, SPIN_COLUMN] * films.fill[k, cell] / films.middle[k, cell] * dtheta
            )
            rise = films.behind[k, cell] - films.behind[k, west]
            films.answer[k, TORQUE_ANSWER] += width * (shear - 0.5 * P * rise)


@inner
def set_slopes(films, k):
    """Set the derivatives of the answers by motions, rates and spin; `find_pressure` first."""
    set_weights(films, k)
    w, n = order(films, k), films.shape[k, 0] * films.shape[k, 1]
    back_substitute_transposed(films.band[k], n, w, films.weight[k])
    for m in range(N_ANSWERS):
        for q in range(SPIN_COLUMN + 1):
            films.slope[k, m, q] = 0.0
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
    width = dZ * films.size[k, IMAGES]
    for i in range(nt):
        for j in range(nz):
            cell, row = i * nz + j, films.place[k, i] * nz + j
            for m in range(N_ANSWERS):
                films.weight[k, row, m] = 0.0
            if films.fixed[k, cell] == 1:
                continue
            if films.active[k, cell] == 1:
                Z, west = films.size[k, Z_FIRST] + (j + 0.5) * dZ, (i - 1) % nt * nz + j
                for m in range(n_motions(films, k)):
                    films.weight[k, row, m] = width * dtheta * per_motion(films, k, 0, i, Z, m)
                rise = films.behind[k, cell] - films.behind[k, west]
                films.weight[k, row, TORQUE_ANSWER] = -0.5 * width * rise
            elif films.law[k] == JFO:
                shear = films.state[k, SPIN_COLUMN] * dtheta / films.middle[k, cell]
                films.weight[k, row, TORQUE_ANSWER] = width * shear


@inner
def add_shear_slopes(films, k, i, j):
    """What the torque of a cell changes while its pressure and filling stay."""
    nt, nz = films.shape[k]
    dtheta, dZ = cell_size(films, k)
    cell, Z = i * nz + j, films.size[k, Z_FIRST] + (j + 0.5) * dZ
    width, h = dZ * films.size[k, IMAGES], films.middle[k, cell]
    shear = width * dtheta * films.fill[k, cell] / h
    films.slope[k, TORQUE_ANSWER, SPIN_COLUMN] += shear
    for m in range(n_motions(films, k)):
        rise = per_motion(films, k, BEHIND_FACE, i, Z, m)
        rise -= per_motion(films, k, BEHIND_FACE, (i - 1) % nt, Z, m)
        thinner = shear * films.state[k, SPIN_COLUMN] / h * per_motion(films, k, 0, i, Z, m)
        films.slope[k, TORQUE_ANSWER, m] -= thinner + 0.5 * width * films.P[k, cell] * rise


@inner
def carried(films, k, west, east):
    """Filling of what the journal drags from the cell west of a face to that east of it."""
    return films.fill[k, west] if films.state[k, SPIN_COLUMN] > 0.0 else films.fill[k, east]


@inner
def add_cell_slopes(films, k, i, j):
    """Add the weights of a cell times the change of its balance."""
    nt, nz = films.shape[k]
    dtheta, dZ = cell_size(films, k)
    row, cell, Z = films.place[k, i] * nz + j, i * nz + j, films.size[k, Z_FIRST] + (j + 0.5) * dZ
    before, P = (i - 1) % nt, films.P[k, cell]
    east, west = (i + 1) % nt * nz + j, before * nz + j
    h, h_west, spin = films.behind[k, cell], films.behind[k, west], films.state[k, SPIN_COLUMN]
    away, into = 6 * dZ * carried(films, k, cell, east), 6 * dZ * carried(films, k, west, cell)
    by_east = 3 * films.conducts[k, cell] / h * (P - films.P[k, east]) + spin * away
    by_west = 3 * films.conducts[k, west] / h_west * (P - films.P[k, west]) - spin * into
    by_middle = films.store[k, cell] * films.fill[k, cell] / films.middle[k, cell]
    by_rate = 12 * dtheta * dZ * films.fill[k, cell]
    if has_memory(films, k):
        by_rate = 0.0
    else:
        by_middle = 0.0
    for m in range(n_motions(films, k)):
        change = by_east * per_motion(films, k, BEHIND_FACE, i, Z, m)
        change += by_west * per_motion(films, k, BEHIND_FACE, before, Z, m)
        opened = per_motion(films, k, 0, i, Z, m)
        change += by_middle * opened
        for end in range(2):
            face, o = i * (nz + 1) + j + end, j - 1 + 2 * end
            drop = P - (films.P[k, cell - 1 + 2 * end] if 0 <= o < nz else 0.0)
            by_side = 3 * films.leaks[k, face] / films.side[k, face] * drop
            change += by_side * per_motion(films, k, 0, i, Z + (end - 0.5) * dZ, m)
        add_change(films, k, row, m, change)
        add_change(films, k, row, N_MOTIONS + m, by_rate * opened)
    add_change(films, k, row, SPIN_COLUMN, h * away - h_west * into)


@inner
def add_change(films, k, row, by, change):
    """Subtract the weights of a row times a change of its balance."""
    for m in range(N_ANSWERS):
        films.slope[k, m, by] -= films.weight[k, row, m] * change


@kernel
def solve_film(films, k, viscosity):
    """Pressure, answers and slopes of film k at its state.

    Returns:
        How often the cavitated region was solved for; -1 if it would not settle.
    """
    set_heights(films, k)
    set_supply(films, k, viscosity)
    count = find_pressure(films, k)
    if count > 0:
        set_answers(films, k)
        set_slopes(films, k)
    return count
