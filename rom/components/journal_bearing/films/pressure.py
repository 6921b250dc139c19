"""Pressure in an oil film: finite volumes, cavitation by complementarity.

In the frame of the bush, unwrapped, with the units of `Cells`. In every cell oil that flows out
equals oil that flows in,

    sum of a (P - P_next) + 6 spin d(fill H) + 12 d(fill H)/dt = 0,   P >= 0,

and a cell either carries pressure and is full, or has none. What a cell without pressure lacks is
its unknown: oil from nowhere (Reynolds) or its filling (mass-conserving), which the journal drags
along from the cell upstream. Where time has passed the change of fill H is that since the last
accepted instant (backward Euler, so that no oil is lost); where none has, the filling is the one
that stays.
"""

import math

from rom.components.journal_bearing.films import cells as col
from rom.components.journal_bearing.films.bearing import FULL, JFO
from rom.components.journal_bearing.films.cells import cell_size, column_after, column_before
from rom.mbs.kernels.compiled import inner

MAX_ITERATIONS = 100  # changes of the cavitated region
LEAKAGE_RTOL = 1e-13  # of a void all around the bush, whose oil would not be decided otherwise
LEAST_FLOW = 1e-14  # of the conductance, below which no flow decides how far a cell is filled
# of what the journal drags out of a void that closes, by which the closing counts with its filling
# where no time has passed: a void does not overtake its oil
MAX_CLOSING = 0.5


@inner
def line_of(films, k, face, i, at):
    """Value at Z = 0 and slope along Z of the film that motions, or rates, open at column i."""
    c, s, x = films.circle[k, i, face + col.COS], films.circle[k, i, face + col.SIN], films.state[k]
    return -x[at] * c - x[at + 1] * s, x[at + 2] * s - x[at + 3] * c


@inner
def at_side(nz, j, values):
    """Value at side j of a column of cells: the mean of its neighbours, at the ends along them."""
    near = min(max(j - 1, 0), nz - 2)
    return values[near] + (j - near - 0.5) * (values[near + 1] - values[near])


@inner
def set_heights(films, k):
    """Set the film and the conductance of all faces; returns the thinnest film."""
    nt, nz = films.shape[k]
    dtheta, dZ = cell_size(films, k)
    ratio, low = films.size[k, col.SLENDER] * dtheta / dZ, math.inf
    for i in range(nt):
        a, b = line_of(films, k, 0, i, 0)
        c, d = line_of(films, k, col.BEHIND_FACE, i, 0)
        a, c = a + films.circle[k, i, col.BORE], c + films.circle[k, i, col.BEHIND_FACE + col.BORE]
        after = column_after(i, nt)
        for j in range(nz):
            cell, Z = i * nz + j, films.size[k, col.Z_FIRST] + (j + 0.5) * dZ
            gap = films.opening[k, cell]
            h = c + Z * d + 0.5 * (gap + films.opening[k, after * nz + j])
            films.behind[k, cell], films.middle[k, cell] = h, a + Z * b + gap
            films.conducts[k, cell] = h * h * h * dZ / dtheta
            low = min(low, min(h, films.middle[k, cell]))
        for j in range(nz + 1):
            gap = at_side(nz, j, films.opening[k, i * nz : (i + 1) * nz])
            face, h = i * (nz + 1) + j, a + (films.size[k, col.Z_FIRST] + j * dZ) * b + gap
            open_end = 2.0 if j in (0, nz) else 1.0
            if j == 0 and films.size[k, col.IMAGES] > 1.0:
                open_end = 0.0  # the image
            films.side[k, face] = h
            films.leaks[k, face] = open_end * ratio * h * h * h
            low = min(low, h)
    return low


@inner
def set_storage(films, k):
    """Set what cells take up."""
    nt, nz = films.shape[k]
    dtheta, dZ = cell_size(films, k)
    size, passed = 12 * dtheta * dZ, films.state[k, col.PASSED_TIME]
    remembers = has_memory(films, k)
    for i in range(nt):
        a, b = line_of(films, k, 0, i, col.N_MOTIONS)
        for j in range(nz):
            cell, Z = i * nz + j, films.size[k, col.Z_FIRST] + (j + 0.5) * dZ
            if remembers:
                films.store[k, cell] = size * films.middle[k, cell] / passed
                films.gain[k, cell] = size * films.content[k, cell] / passed
            else:
                films.store[k, cell] = size * (a + Z * b + films.opening_rate[k, cell])
                films.gain[k, cell] = 0.0


@inner
def has_memory(films, k):
    """Whether the filling follows from that of the last accepted instant."""
    known = films.state[k, col.CONTENT_KNOWN] == 1.0 and films.state[k, col.PASSED_TIME] > 0.0
    return known and films.law[k] == JFO


@inner
def order(films, k):
    """Order the columns; returns how far neighbours lie apart.

    The ring is cut open behind a column that hears nothing of the next one: an inlet, or both have
    no pressure. Where there is none the ring is laid flat.
    """
    nt, nz = films.shape[k]
    active, fixed, place = films.active[k], films.fixed[k], films.place[k]
    cut = -1
    for i in range(nt):
        closed, after = True, column_after(i, nt)
        for j in range(nz):
            cell, next_cell = i * nz + j, after * nz + j
            void = active[cell] == 0 and (active[next_cell] == 0 or fixed[next_cell] == 1)
            if fixed[cell] == 0 and (films.law[k] == JFO or not void):
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
def add_flow(films, k, a, places, own, other, w):
    """Flow a (P - P_other) out of a cell; ``places`` are those of both in the equations."""
    band, (row, column) = films.band[k], places
    if own == 1:
        band[row, w] += a
    if films.fixed[k, other] == 1:
        films.unknown[k, row] += a * films.supply[k, other]
    elif films.active[k, other] == 1:
        band[row, w + column - row] -= a


@inner
def assemble(films, k, w):
    """Balances of all cells; the unknown of a cell is its pressure, or fill - 1 <= 0."""
    nt, nz = films.shape[k]
    for row in range(nt * nz):
        for m in range(2 * w + 1):
            films.band[k, row, m] = 0.0
    drag = 6 * cell_size(films, k)[1] * films.state[k, col.SPIN_COLUMN]
    for i in range(nt):
        before, after = column_before(i, nt), column_after(i, nt)
        for j in range(nz):
            cell, row = i * nz + j, films.place[k, i] * nz + j
            to_west, to_east = films.place[k, before] * nz + j, films.place[k, after] * nz + j
            if films.fixed[k, cell] == 1:
                films.band[k, row, w], films.unknown[k, row] = 1.0, films.supply[k, cell]
                continue
            own, east, west = films.active[k, cell], after * nz + j, before * nz + j
            away, into = drag * films.behind[k, cell], drag * films.behind[k, west]
            films.unknown[k, row] = into - away + films.gain[k, cell] - films.store[k, cell]
            add_flow(films, k, films.conducts[k, cell], (row, to_east), own, east, w)
            add_flow(films, k, films.conducts[k, west], (row, to_west), own, west, w)
            side = i * (nz + 1) + j
            for end in range(2):
                a, o = films.leaks[k, side + end], 2 * end - 1
                if 0 <= j + o < nz:
                    add_flow(films, k, a, (row, row + o), own, cell + o, w)
                elif own == 1:
                    films.band[k, row, w] += a
            if films.law[k] == JFO:
                add_filling(films, k, (cell, west, east), (row, to_west, to_east), (into, away), w)
            elif own == 0:
                films.band[k, row, w] = 1.0


@inner
def add_filling(films, k, cells, places, drags, w):
    """Oil that leaves a cell, and that which comes, where they are not full."""
    cell, west, east = cells
    row, to_west, to_east = places
    into, away = drags
    if films.active[k, cell] == 0:
        out = max(away, -into)
        own = (1 + LEAKAGE_RTOL) * out + max(films.store[k, cell], -MAX_CLOSING * out)
        least = LEAST_FLOW * films.conducts[k, cell]
        films.band[k, row, w] += own if own > least else 1.0
    upstream, column, flow = (west, to_west, into) if into > 0.0 else (east, to_east, -away)
    if films.fixed[k, upstream] == 0 and films.active[k, upstream] == 0 and flow != 0.0:
        films.band[k, row, w + column - row] -= flow


@inner
def changed(films, k):
    """Cells that lose their film or find one again; `active` is updated."""
    nt, nz = films.shape[k]
    count = 0
    for i in range(nt):
        for j in range(nz):
            cell = i * nz + j
            now = 1 if films.unknown[k, films.place[k, i] * nz + j] > 0.0 else 0
            free = films.fixed[k, cell] == 0 and films.law[k] != FULL
            if free and now != films.active[k, cell]:
                films.active[k, cell] = now
                count += 1
    return count


@inner
def set_supply(films, k, viscosity):
    """Set the pressure of the grooves in units of the film."""
    unit = viscosity * (films.size[k, col.RADIUS] / films.size[k, col.CLEARANCE]) ** 2
    for cell in range(films.shape[k, 0] * films.shape[k, 1]):
        films.supply[k, cell] = films.inlet[k, cell] / unit


@inner
def find_pressure(films, k):
    """Set pressure and filling at films.state; returns how often the cavitated region was solved.

    The factors stay at hand. -1 if the region would not settle.
    """
    nt, nz = films.shape[k]
    set_storage(films, k)
    for iteration in range(MAX_ITERATIONS):
        w = order(films, k)
        assemble(films, k, w)
        factor(films.band[k], nt * nz, w)
        back_substitute(films.band[k], w, films.unknown[k, : nt * nz])
        if changed(films, k) == 0:
            set_pressure(films, k)
            return iteration + 1
    return -1


@inner
def set_pressure(films, k):
    """Set pressure and filling from the unknowns."""
    nt, nz = films.shape[k]
    for i in range(nt):
        for j in range(nz):
            cell, u = i * nz + j, films.unknown[k, films.place[k, i] * nz + j]
            carries = films.active[k, cell] == 1 or films.fixed[k, cell] == 1
            films.P[k, cell] = u if carries else 0.0
            films.fill[k, cell] = 1.0 if carries or films.law[k] != JFO else 1.0 + u


@inner
def outflow(films, k):
    """Oil that leaves at the ends, in units of the film."""
    nt, nz = films.shape[k]
    total = 0.0
    for i in range(nt):
        face = i * (nz + 1)
        total += films.leaks[k, face] * films.P[k, i * nz]
        total += films.leaks[k, face + nz] * films.P[k, i * nz + nz - 1]
    return total


@inner
def peak(films, k):
    """Largest pressure, in units of the film."""
    top = 0.0
    for cell in range(films.shape[k, 0] * films.shape[k, 1]):
        top = max(top, films.P[k, cell])
    return top


@inner
def factor(band, n, w):
    """Triangular factors of n rows of half width w in place; columns are diagonally dominant."""
    for k in range(n):
        pivot = 1.0 / band[k, w]
        for i in range(k + 1, min(n, k + w + 1)):
            l = band[i, w + k - i] * pivot
            if l != 0.0:
                band[i, w + k - i] = l
                start = w + k - i
                for m in range(1, w + 1):
                    band[i, start + m] -= l * band[k, w + m]


@inner
def back_substitute(band, w, x):
    """Solve with the factors, in place."""
    n = x.size
    for i in range(n):
        total = x[i]
        for k in range(max(0, i - w), i):
            total -= band[i, w + k - i] * x[k]
        x[i] = total
    for i in range(n - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, min(n, i + w + 1)):
            total -= band[i, w + k - i] * x[k]
        x[i] = total / band[i, w]


@inner
def back_substitute_transposed(band, n, w, X):
    """Solve with the transposed factors for all columns of X, in place."""
    for i in range(n):
        pivot = 1.0 / band[i, w]
        for m in range(X.shape[1]):
            X[i, m] *= pivot
        for k in range(i + 1, min(n, i + w + 1)):
            u = band[i, w + k - i]
            if u != 0.0:
                for m in range(X.shape[1]):
                    X[k, m] -= u * X[i, m]
    for i in range(n - 1, -1, -1):
        for k in range(max(0, i - w), i):
            l = band[i, w + k - i]
            if l != 0.0:
                for m in range(X.shape[1]):
                    X[k, m] -= l * X[i, m]
