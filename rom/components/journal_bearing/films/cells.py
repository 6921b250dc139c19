"""Films in cells: the arrays of all films of a mechanism, or of one alone."""

import math
from collections.abc import Sequence

import numpy as np

from rom.components.journal_bearing.films.bearing import LAWS, JournalBearing
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.tables import (
    Address2,
    Array2,
    Array3,
    Index1,
    Index2,
    Scratch2,
    Scratch3,
    Table,
    table,
)
from rom.model import Array, Numbers

N_MOTIONS = 4  # journal centre x, y and tilt about x, y
N_ANSWERS = 5  # what works on them, and the friction torque
RADIUS, LENGTH, CLEARANCE, SLENDER, IMAGES, Z_FIRST = range(6)  # columns of Cells.size
# columns of Cells.circle: cosine, sine and bore at the centre of a column, and at the face behind
COS, SIN, BORE = range(3)
BEHIND_FACE = 3
# columns of Cells.state: motion, its rate, then
SPIN_COLUMN, PASSED_TIME, CONTENT_KNOWN = 2 * N_MOTIONS, 2 * N_MOTIONS + 1, 2 * N_MOTIONS + 2
# column of Cells.slope where openings begin, and behind them their rates
FIRST_OPENED = SPIN_COLUMN + 1


@table
class Cells(Table):
    """Films, each of nt columns of nz cells; cell i nz + j is the one at i along the circle.

    Unwrapped, film in clearances c, pressure in viscosity times (R/c)^2 over seconds, width in
    lengths L of the bearing. Rows are padded to those of the largest film.
    """

    shape: Index2  # (k, 2) nt, nz
    law: Index1  # (k,) FULL, REYNOLDS or JFO
    # (k, 6) R, L, c [m], (R/L)^2, 2 if the cells cover half the width and the other half is their
    # image, else 1; where the cells begin along the width
    size: Array2
    circle: Array3  # (k, nt, 6) cosine, sine, bore at centres of columns and at the faces behind
    fixed: Index2  # (k, n) 1 where a groove holds the pressure
    inlet: Array2  # (k, n) pressure there [Pa]
    n_functions: Index1  # (k,) of functions by which a bore that deforms opens the film
    functions: Array3  # (k, n, m) their values at the centres [1]
    # (k, 11) motion (4,) and its rate [1/s], spin of the journal [rad/s], time that has passed
    # since the filling was known [s], whether it is remembered
    state: Scratch2
    opening: Scratch2  # (k, n) by which the bush gives way, in clearances
    opening_rate: Scratch2  # (k, n) per second
    supply: Scratch2  # (k, n) pressure of the grooves in units of the film
    behind: Scratch2  # (k, n) film at the faces behind
    side: Scratch2  # (k, nt (nz + 1)) at the faces across
    middle: Scratch2  # (k, n) at the centres
    conducts: Scratch2  # (k, n) conductance of the faces behind
    leaks: Scratch2  # (k, nt (nz + 1)) of the faces across
    store: Scratch2  # (k, n) oil that a cell takes up when full
    gain: Scratch2  # (k, n) oil that a cell has had to give
    content: Scratch2  # (k, n) film times filling at the last accepted instant
    active: Address2  # (k, n) 1 where the film carries pressure: a guess, and what came out
    place: Address2  # (k, nt) order of the columns
    band: Scratch3  # (k, n, 4 nz + 1) factors of the balances
    unknown: Scratch2  # (k, n) unknowns of the balances
    P: Scratch2  # (k, n) pressure
    fill: Scratch2  # (k, n) filling [1]
    # (k, 5 + m) forces that work on the motions, friction torque, forces that work on the functions
    answer: Scratch2
    weight: Scratch3  # (k, n, 5 + m) of the balances in each answer
    # (k, 9 + 2 m) derivatives of the balance of one cell by motions, rates, spin, openings and
    # their rates
    change: Scratch2
    slope: Scratch3  # (k, 5 + m, 9 + 2 m) the same of the answers


def cells_of(
    bearings: Sequence[JournalBearing], functions: Sequence[Array | None] | None = None
) -> Cells:
    """The cells of some bearings.

    Functions (n, m) are those by which each bore opens the film in its cells, None of a rigid one.
    """
    k, grids = len(bearings), [one.grid for one in bearings]
    shapes = np.array([grid.fixed.shape for grid in grids], dtype=np.int64).reshape(-1, 2)
    nt, nz, n = int(shapes[:, 0].max()), int(shapes[:, 1].max()), int(shapes.prod(axis=1).max())
    sides = int((shapes[:, 0] * (shapes[:, 1] + 1)).max())
    circles = [np.concatenate([grid.angle, grid.bore[..., None]], axis=-1) for grid in grids]
    sizes = [
        [b.radius, b.length, b.clearance, b.grid.slender, 1.0 + b.grid.half, b.grid.Z_face[0]]
        for b in bearings
    ]
    given = [np.zeros((0, 0)) if one is None else one for one in functions or [None] * k]
    counts = np.array([one.shape[1] for one in given], dtype=np.int64)
    most = int(counts.max(initial=0))
    opens = np.zeros((k, n, most))
    for row, one in zip(opens, given, strict=True):
        row[: one.shape[0], : one.shape[1]] = one
    names = "opening opening_rate supply behind middle conducts store gain content unknown"
    scratch = {name: np.zeros((k, n)) for name in f"{names} P fill".split()}
    scratch |= {name: np.zeros((k, sides)) for name in ("side", "leaks")}
    return Cells(
        shape=shapes,
        law=np.array([LAWS[one.cavitation] for one in bearings], dtype=np.int64),
        size=np.array(sizes),
        circle=_padded([np.concatenate([c[0], c[1]], axis=1) for c in circles], nt),
        fixed=_padded([grid.fixed.ravel() for grid in grids], n),
        inlet=_padded([grid.inlet.ravel() for grid in grids], n),
        n_functions=counts,
        functions=opens,
        state=np.zeros((k, CONTENT_KNOWN + 1)),
        active=np.ones((k, n), dtype=np.int64),
        place=np.zeros((k, nt), dtype=np.int64),
        band=np.zeros((k, n, 4 * nz + 1)),
        answer=np.zeros((k, N_ANSWERS + most)),
        weight=np.zeros((k, n, N_ANSWERS + most)),
        change=np.zeros((k, FIRST_OPENED + 2 * most)),
        slope=np.zeros((k, N_ANSWERS + most, FIRST_OPENED + 2 * most)),
        **scratch,
    )


def _padded(rows: Sequence[Numbers], n: int) -> Numbers:
    """Rows of one length, zeros behind."""
    padded: Numbers = np.zeros((len(rows), n, *rows[0].shape[1:]), dtype=rows[0].dtype)
    for row, values in zip(padded, rows, strict=True):
        row[: len(values)] = values
    return padded


@inner
def cell_size(films, k):
    """Extent of a cell around [rad] and along the width [1]."""
    width = -2.0 * films.size[k, Z_FIRST] if films.size[k, IMAGES] == 1.0 else 0.5
    return 2 * math.pi / films.shape[k, 0], width / films.shape[k, 1]


@inner
def column_before(i, nt):
    """The column before column i of nt; quicker than a remainder."""
    return i - 1 if i > 0 else nt - 1


@inner
def column_after(i, nt):
    """The column behind column i of nt."""
    return i + 1 if i < nt - 1 else 0


@inner
def per_motion(films, k, face, i, Z, m):
    """Film opened at column i by a unit of motion m; pressure times this is the force on it."""
    c, s = films.circle[k, i, face + COS], films.circle[k, i, face + SIN]
    if m == 0:
        return -c
    if m == 1:
        return -s
    return Z * s if m == 2 else -Z * c
