"""Films read from tables: what Reynolds' equation gives, solved ahead for all places of a journal.

In a round bore with grooves at ambient pressure, spin and velocity of the journal act together, as
a squeeze with the velocity

    v = (X' + w Y / 2, Y' - w X / 2),   w = spin sin(dtheta/2) / (dtheta/2),

(Booker's mobility method; the sine is that of the cells), and pressure is proportional to it. So
forces F = |v| f, flow and largest pressure are functions of the place and of the direction of v
alone. Tilts phi add moments that are theirs to first order,

    M = |v| K phi + D (phi' + (w phi_y / 2, -w phi_x / 2)),

while forces feel them in second order only, as the bearing is its own image across its middle.
Nodes are even over the stretched place u = artanh(e) / e (X, Y), e = |(X, Y)|, and over the
direction; between them are cubic splines of the values times (1 - e^2)^2.

Source:
    Booker, *J. Basic Eng.* 87 (1965) 537.
"""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from rom.components.journal_bearing.films.bearing import JournalBearing
from rom.components.journal_bearing.films.cells import N_MOTIONS, SPIN_COLUMN, cells_of
from rom.components.journal_bearing.films.pressure import outflow, peak
from rom.components.journal_bearing.films.slopes import TORQUE_ANSWER, solve_film
from rom.errors import ConfigError, ModelError
from rom.mbs.kernels.compiled import inner, kernel
from rom.model import Array
from rom.process.progress import stages

N_PLACES, N_DIRECTIONS = 29, 36  # nodes along each stretched axis; around
FURTHEST_PLACE = 2.65  # stretched place of the last node: eccentricity 0.99
# of the film at its middle, by which a journal that tilts may close it at an end
MAX_TILT_SHARE = 0.3
# of a table: forces, oil that leaves, largest pressure, then moments by tilts, and by their rates
FORCE, FLOW, PEAK, STIFFNESS, DAMPING = 0, 2, 3, 4, 8
N_VALUES = 12
VALUE, BY_X, BY_Y, BY_DIRECTION = range(4)  # rows of what is read
N_READ = 4
N_BLENDED = 4  # coefficients of a cubic spline that count at a place
SMALL_ECCENTRICITY = 1e-2  # below which artanh is a series


def table_of(name: str, bearing: JournalBearing) -> Array:
    """Spline coefficients (places^2 directions, values) of a bearing, solved once for its shape."""
    reasons = {
        "conserves its oil, which it remembers": bearing.cavitation == "jfo",
        "has a bore that is not round": bool((bearing.grid.bore != 1.0).any()),
        "has grooves with pressure": bool(bearing.grid.inlet.any()),
    }
    for reason in (reason for reason, holds in reasons.items() if holds):
        text = f"bearing {name!r} {reason}: its film has no table of places and directions"
        raise ConfigError(f"{text}; leave out tabulated.")
    D, grooves = bearing.diameter / bearing.length, tuple(bearing.grooves)
    return _table(replace(bearing, diameter=D, length=1.0, clearance=1e-3 * D, grooves=grooves))


@lru_cache(maxsize=16)
def _table(bearing: JournalBearing) -> Array:
    """The same for a bearing of length one."""
    u = np.linspace(-FURTHEST_PLACE, FURTHEST_PLACE, N_PLACES)
    psi = 2 * np.pi / N_DIRECTIONS * np.arange(N_DIRECTIONS)
    ux, uy, direction = (a.ravel() for a in np.meshgrid(u, u, psi, indexing="ij"))
    far = np.hypot(ux, uy)
    e = np.tanh(far)
    closer = np.divide(e, far, out=np.ones_like(far), where=far > 0)
    states = np.zeros((far.size, SPIN_COLUMN + 1))
    states[:, 0], states[:, 1] = closer * ux, closer * uy
    states[:, N_MOTIONS], states[:, N_MOTIONS + 1] = np.cos(direction), np.sin(direction)
    values, cells, (nt, nz) = np.zeros((far.size, N_VALUES)), cells_of([bearing]), bearing.cells
    with stages(N_PLACES) as begin:
        for some in np.split(np.arange(far.size), N_PLACES):
            begin(f"table of a film of {nt} x {nz} cells")
            part = slice(some[0], some[-1] + 1)
            if not solve_nodes(cells, states[part], values[part]):
                raise ModelError("a film of this bearing finds no pressure; take more cells.")
    values *= (1 - e**2)[:, None] ** 2
    values = values.reshape(N_PLACES, N_PLACES, N_DIRECTIONS, N_VALUES)
    A, B = _natural(N_PLACES), _periodic(N_DIRECTIONS)
    made = np.einsum("ai,bj,ck,ijkm->abcm", A, A, B, values, optimize=True)
    return np.ascontiguousarray(made.reshape(-1, N_VALUES))


def _natural(n: int) -> Array:
    """(n + 2, n) coefficients of a cubic spline on even nodes, one polynomial over both ends."""
    A = np.zeros((n + 2, n + 2))
    for i in range(n):
        A[i, i : i + 3] = 1 / 6, 4 / 6, 1 / 6
    A[n, :5] = A[n + 1, -5:] = 1, -4, 6, -4, 1
    return np.linalg.inv(A)[:, :n]


def _periodic(n: int) -> Array:
    """(n + 3, n) coefficients of a spline around a circle; the last three are the first."""
    one = np.eye(n)
    B = np.linalg.inv((4 * one + np.roll(one, 1, 0) + np.roll(one, -1, 0)) / 6)
    return B[np.arange(-1, n + 2) % n]


@kernel
def solve_nodes(films, states, values):
    """Solve film 0 at states (n, 9) of unit squeeze; says whether all are found."""
    for r in range(len(states)):
        for p in range(states.shape[1]):
            films.state[0, p] = states[r, p]
        if solve_film(films, 0, 1.0) < 0:
            return False
        values[r, FORCE], values[r, FORCE + 1] = films.answer[0, 0], films.answer[0, 1]
        values[r, FLOW], values[r, PEAK] = outflow(films, 0), peak(films, 0)
        for a in range(2):
            for p in range(2):
                slope = films.slope[0, 2 + a]
                values[r, STIFFNESS + 2 * a + p] = slope[2 + p]
                values[r, DAMPING + 2 * a + p] = slope[N_MOTIONS + 2 + p]
    return True


@inner
def cubic(x):
    """Weights of the four coefficients around a place, from 0 to 1 between the middle two."""
    y = 1.0 - x
    near, far = 4.0 - 6.0 * x * x + 3.0 * x * x * x, 4.0 - 6.0 * y * y + 3.0 * y * y * y
    return y * y * y / 6.0, near / 6.0, far / 6.0, x * x * x / 6.0


@inner
def cubic_slope(x):
    """Their derivatives by the place."""
    y = 1.0 - x
    return -0.5 * y * y, x * (1.5 * x - 2.0), y * (2.0 - 1.5 * y), 0.5 * x * x


@inner
def blend(nodes, first, weights, out):
    """Set the values (12,) that three axes of four weights each make of the nodes."""
    along_x, along_y, around = weights
    for m in range(N_VALUES):
        out[m] = 0.0
    for a in range(N_BLENDED):
        for b in range(N_BLENDED):
            row = first + (a * (N_PLACES + 2) + b) * (N_DIRECTIONS + 3)
            for d in range(N_BLENDED):
                weight = along_x[a] * along_y[b] * around[d]
                for m in range(N_VALUES):
                    out[m] += weight * nodes[row + d, m]


@inner
def stretching(e2):
    """artanh(e) / e and its derivative by e, over e, for e^2."""
    if e2 < SMALL_ECCENTRICITY * SMALL_ECCENTRICITY:
        return 1.0 + e2 / 3.0 + e2 * e2 / 5.0, 2.0 / 3.0 + 0.8 * e2 + 6.0 / 7.0 * e2 * e2
    e = math.sqrt(e2)
    g = math.atanh(e) / e
    return g, (1.0 / (1.0 - e2) - g) / e2


@inner
def half_sine(films, k):
    """Half of w over the spin."""
    half = math.pi / films.shape[k, 0]
    return 0.5 * math.sin(half) / half


@inner
def squeeze(films, k):
    """Velocity v, and that of the tilts, which spin and rates make together."""
    x = films.state[k]
    turn = half_sine(films, k) * x[SPIN_COLUMN]
    v = x[N_MOTIONS] + turn * x[1], x[N_MOTIONS + 1] - turn * x[0]
    return v, (x[N_MOTIONS + 2] + turn * x[3], x[N_MOTIONS + 3] - turn * x[2])


@inner
def thinnest_of(films, k):
    """Smallest film of film k, in clearances: at an end."""
    X, Y, a, b = films.state[k, 0], films.state[k, 1], films.state[k, 2], films.state[k, 3]
    far = max(math.hypot(X + 0.5 * b, Y - 0.5 * a), math.hypot(X - 0.5 * b, Y + 0.5 * a))
    return 1.0 - far


@inner
def in_table(films, k):
    """Whether the journal is where its table says what it feels."""
    middle = 1.0 - math.hypot(films.state[k, 0], films.state[k, 1])
    thin = thinnest_of(films, k) >= (1.0 - MAX_TILT_SHARE) * middle
    return middle > 1.0 - math.tanh(FURTHEST_PLACE) and thin


@inner
def read(journals, k, with_slopes):
    """Set journals.read to the values for film k, and their derivatives by X, Y and direction."""
    films, values = journals.films, journals.read
    X, Y, nodes = films.state[k, 0], films.state[k, 1], journals.nodes[journals.number[k]]
    v, _ = squeeze(films, k)
    e2, per_place = X * X + Y * Y, (N_PLACES - 1) / (2.0 * FURTHEST_PLACE)
    g, h = stretching(e2)
    per_direction = N_DIRECTIONS / (2.0 * math.pi)
    x, y = (g * X + FURTHEST_PLACE) * per_place, (g * Y + FURTHEST_PLACE) * per_place
    z = (math.atan2(v[1], v[0]) % (2.0 * math.pi)) * per_direction
    i, j, d = min(int(x), N_PLACES - 2), min(int(y), N_PLACES - 2), min(int(z), N_DIRECTIONS - 1)
    first = (i * (N_PLACES + 2) + j) * (N_DIRECTIONS + 3) + d
    bx, by, bz = cubic(x - i), cubic(y - j), cubic(z - d)
    weight = 1.0 / ((1.0 - e2) * (1.0 - e2))
    blend(nodes, first, (bx, by, bz), values[VALUE])
    if with_slopes:
        blend(nodes, first, (cubic_slope(x - i), by, bz), values[BY_X])
        blend(nodes, first, (bx, cubic_slope(y - j), bz), values[BY_Y])
        blend(nodes, first, (bx, by, cubic_slope(z - d)), values[BY_DIRECTION])
    for m in range(N_VALUES):
        value = weight * values[VALUE, m]
        values[VALUE, m] = value
        if with_slopes:
            ux, uy = weight * per_place * values[BY_X, m], weight * per_place * values[BY_Y, m]
            along = h * (ux * X + uy * Y) + 4.0 * value / (1.0 - e2)
            values[BY_X, m], values[BY_Y, m] = g * ux + X * along, g * uy + Y * along
            values[BY_DIRECTION, m] *= weight * per_direction


@inner
def read_answers(journals, k):
    """Set forces, torque, flow and largest pressure of film k from its table."""
    read(journals, k, False)
    films, value, answer = journals.films, journals.read[VALUE], journals.films.answer[k]
    x, (v, t) = films.state[k], squeeze(films, k)
    speed = math.hypot(v[0], v[1])
    answer[0], answer[1] = speed * value[FORCE], speed * value[FORCE + 1]
    for a in range(2):
        K, D = value[STIFFNESS + 2 * a :], value[DAMPING + 2 * a :]
        answer[2 + a] = speed * (K[0] * x[2] + K[1] * x[3]) + D[0] * t[0] + D[1] * t[1]
    # pressure on the slope of the film, and what is sheared: 2 pi / sqrt(1 - e^2) all around
    slanted = x[0] * answer[1] - x[1] * answer[0] + x[2] * answer[3] - x[3] * answer[2]
    sheared = 2.0 * math.pi / math.sqrt(1.0 - x[0] * x[0] - x[1] * x[1])
    answer[TORQUE_ANSWER] = x[SPIN_COLUMN] * sheared + half_sine(films, k) * slanted
    journals.flow[k], journals.peak[k] = speed * value[FLOW], speed * value[PEAK]


@inner
def of_speed(values, row, a, x):
    """What answer a has per speed: a force, or the moment by tilts."""
    if a < 2:
        return values[row, FORCE + a]
    K = values[row, STIFFNESS + 2 * (a - 2) :]
    return K[0] * x[2] + K[1] * x[3]


@inner
def of_turning(values, row, a, t):
    """What answer a has of rates of tilts."""
    if a < 2:
        return 0.0
    D = values[row, DAMPING + 2 * (a - 2) :]
    return D[0] * t[0] + D[1] * t[1]


@inner
def read_slopes(journals, k):
    """Set the derivatives of the answers of film k from its table."""
    read(journals, k, True)
    films, values, sine = journals.films, journals.read, half_sine(journals.films, k)
    x, (v, t) = films.state[k], squeeze(films, k)
    speed, turn = math.hypot(v[0], v[1]), sine * x[SPIN_COLUMN]
    c, s = (v[0] / speed, v[1] / speed) if speed > 0.0 else (1.0, 0.0)
    films.slope[k, :, :] = 0.0
    for a in range(N_MOTIONS):
        slope, f = films.slope[k, a], of_speed(values, VALUE, a, x)
        across = of_speed(values, BY_DIRECTION, a, x)
        if speed > 0.0:
            across += of_turning(values, BY_DIRECTION, a, t) / speed
        by_v = c * f - s * across, s * f + c * across
        slope[0] = speed * of_speed(values, BY_X, a, x) + of_turning(values, BY_X, a, t)
        slope[1] = speed * of_speed(values, BY_Y, a, x) + of_turning(values, BY_Y, a, t)
        add_squeeze(slope, 0, by_v, (x[0], x[1]), turn, sine)
        if a >= 2:
            K = values[VALUE, STIFFNESS + 2 * (a - 2) :]
            D = values[VALUE, DAMPING + 2 * (a - 2) :]
            slope[2], slope[3] = speed * K[0], speed * K[1]
            add_squeeze(slope, 2, (D[0], D[1]), (x[2], x[3]), turn, sine)
    set_torque_slopes(films, k, sine)


@inner
def add_squeeze(slope, m, by_v, at, turn, sine):
    """Add changes by the velocity of motions m and m + 1, which rates, places and spin make."""
    slope[m] -= turn * by_v[1]
    slope[m + 1] += turn * by_v[0]
    slope[N_MOTIONS + m], slope[N_MOTIONS + m + 1] = by_v
    slope[SPIN_COLUMN] += sine * (at[1] * by_v[0] - at[0] * by_v[1])


@inner
def set_torque_slopes(films, k, sine):
    """Set the derivatives of the torque from those of forces and moments."""
    x, F, slope, torque = films.state[k], films.answer[k], films.slope[k], TORQUE_ANSWER
    for p in range(SPIN_COLUMN + 1):
        slanted = x[0] * slope[1, p] - x[1] * slope[0, p]
        slanted += x[2] * slope[3, p] - x[3] * slope[2, p]
        slope[torque, p] = sine * slanted
    room = 1.0 - x[0] * x[0] - x[1] * x[1]
    sheared = 2.0 * math.pi / math.sqrt(room)
    slope[torque, 0] += sine * F[1] + x[SPIN_COLUMN] * sheared * x[0] / room
    slope[torque, 1] += -sine * F[0] + x[SPIN_COLUMN] * sheared * x[1] / room
    slope[torque, 2] += sine * F[3]
    slope[torque, 3] -= sine * F[2]
    slope[torque, SPIN_COLUMN] += sheared
