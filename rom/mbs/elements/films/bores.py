"""Bores that deform under the pressure of their films: elastohydrodynamic bearings.

Beyond the mean motion of its marker the surface of a bush moves outwards in the cells of the film by

    w = Phi a,   a = A q,

q the elastic coordinates of its body. The film opens by w, and its pressure does the work of
f = int(p Phi) on a. Both follow from what the bore was reduced with: functions that were chosen
before anything was solved.
"""

import numpy as np

from rom.mbs.elements.cylinders import Cylinder
from rom.mbs.elements.films.bearing import JournalBearing
from rom.mbs.elements.films.cells import CLEARANCE, LENGTH, N_ANSWERS, N_MOTIONS, OPENED, RADIUS
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import block_of
from rom.model import Array

DEPENDENT_RTOL = 1e-6  # of the largest opening: functions below it open no film


def bore_functions(bore: Cylinder, bearing: JournalBearing) -> tuple[Array, Array]:
    """Functions by which a bore opens the film, and their amplitudes per elastic coordinate.

    Args:
        bore: surface of the bush; its angles count as those of the bearing.
        bearing: whose cells.

    Returns:
        (n, m) values in the cells [1], (m, r) amplitudes [m].
    """
    grid = bearing.grid
    nt, nz = grid.fixed.shape
    theta = np.repeat(np.arctan2(*grid.angle[0, :, ::-1].T), nz)
    z = np.tile(grid.Z, nt) * bearing.length
    outwards = np.cos(theta)[:, None] * bore.axes[0] + np.sin(theta)[:, None] * bore.axes[1]
    opened = np.einsum("cf,ca,far->cr", bore.functions(theta, z), outwards, bore.shapes)
    U, size, V = np.linalg.svd(opened, full_matrices=False)
    keep = size > DEPENDENT_RTOL * size.max(initial=0.0)
    return U[:, keep], size[keep, None] * V[keep]


@inner
def open_film(s, journals, k, q, v):
    """Set how the bore of film k opens its cells, and how fast."""
    films, amplitude = journals.films, journals.amplitude
    b = s.markers.body[journals.j[k]]
    c, m = films.size[k, CLEARANCE], films.functions.shape[2]
    for f in range(films.n_functions[k]):
        moved, rate = 0.0, 0.0
        for l in range(s.bodies.r[b]):
            moved += journals.bores[k, f, l] * q[s.bodies.q_at[b] + 7 + l]
            rate += journals.bores[k, f, l] * v[s.bodies.v_at[b] + 6 + l]
        amplitude[k, f], amplitude[k, m + f] = moved / c, rate / c
    for cell in range(films.shape[k, 0] * films.shape[k, 1] if films.n_functions[k] else 0):
        gap, rate = 0.0, 0.0
        for f in range(films.n_functions[k]):
            gap += films.functions[k, cell, f] * amplitude[k, f]
            rate += films.functions[k, cell, f] * amplitude[k, m + f]
        films.opening[k, cell], films.opening_rate[k, cell] = gap, rate


@inner
def bore_unit(journals, k):
    """Force on an amplitude over the dimensionless one [N s]."""
    size = journals.films.size[k]
    return journals.viscosity[k] * size[RADIUS] * size[LENGTH] * (size[RADIUS] / size[CLEARANCE]) ** 2


@inner
def bend_bore(s, W, journals, k):
    """Subtract the forces on the bore of film k, as elastic ones, from W.residual."""
    films, b = journals.films, s.markers.body[journals.j[k]]
    for f in range(films.n_functions[k]):
        force = bore_unit(journals, k) * films.answer[k, N_ANSWERS + f]
        for l in range(s.bodies.r[b]):
            W.residual[s.bodies.v_at[b] + 6 + l] -= force * journals.bores[k, f, l]


@inner
def bore_power(journals, k):
    """Power that the film gives to its bore [W]."""
    films, total, m = journals.films, 0.0, journals.films.functions.shape[2]
    for f in range(films.n_functions[k]):
        total += films.answer[k, N_ANSWERS + f] * journals.amplitude[k, m + f]
    return total * bore_unit(journals, k) * films.size[k, CLEARANCE]


@inner
def set_bore_row(journals, k, p, motion, rate, spin):
    """Remember how the forces on the bore change with the imaginary step of a motion p."""
    slope = journals.films.slope[k]
    for f in range(journals.films.n_functions[k]):
        change, g = slope[N_ANSWERS + f, 2 * N_MOTIONS] * spin.imag, N_ANSWERS + f
        for m in range(N_MOTIONS):
            change += slope[g, m] * motion[m].imag / journals.scale[k, m]
            change += slope[g, N_MOTIONS + m] * rate[m].imag / journals.scale[k, m]
        journals.pushed[f, p] = bore_unit(journals, k) * change


@inner
def add_bore_stiffness(s, W, journals, k, first, c, S):
    """Add c times the changes by, and of the forces on, the bore of film k to S.

    Args:
        s, W: system and work.
        journals: all films.
        k: which.
        first: column of the slopes by amplitudes or by their rates.
        c: factor.
        S: stiffness or damping matrix.
    """
    films, bores = journals.films, journals.bores
    j, clearance = journals.j[k], films.size[k, CLEARANCE]
    body = s.markers.body[j]
    r, count = s.bodies.r[body], films.n_functions[k]
    for side in range(2):
        m = journals.i[k] if side == 0 else j
        b = s.markers.body[m]
        if b < 0:
            continue
        across, along = block_of(s.graph, b, body), block_of(s.graph, body, b)
        x, y = s.graph.x[across], s.graph.y[across]
        u, w = s.graph.x[along], s.graph.y[along]
        for f in range(count):
            for p in range(6 + s.bodies.r[b]):
                by_bore, on_bore = 0.0, 0.0
                for d in range(6):
                    by_bore += W.H[m, d, p] * journals.bent[f, 6 * side + d]
                    on_bore += W.H[m, d, p] * journals.pushed[f, 6 * side + d]
                for l in range(r):
                    S[x + p, y + 6 + l] -= c * by_bore * bores[k, f, l]
                    S[u + 6 + l, w + p] -= c * on_bore * bores[k, f, l]
    own = block_of(s.graph, body, body)
    x, y = s.graph.x[own] + 6, s.graph.y[own] + 6
    for f in range(count):
        for g in range(count):
            slope = films.slope[k, N_ANSWERS + f, first + g] * bore_unit(journals, k) / clearance
            for l in range(r):
                for n in range(r):
                    S[x + l, y + n] -= c * slope * bores[k, f, l] * bores[k, g, n]


@inner
def set_bore_columns(journals, k, place, first):
    """Remember how both wrenches change with each amplitude of the bore of film k, or its rate."""
    (axes, relative), films = place, journals.films
    for f in range(films.n_functions[k]):
        change = films.slope[k, :, first + f]
        F = (
            answer_unit(journals, k, 0) * change[0],
            answer_unit(journals, k, 1) * change[1],
            answer_unit(journals, k, 2) * change[2],
            answer_unit(journals, k, 3) * change[3],
        )
        torque = answer_unit(journals, k, TORQUE) * change[TORQUE]
        force, on_journal, on_bush = journal_wrench(axes, relative[0], F, torque)
        for d in range(3):
            journals.bent[f, d] = force[d] / films.size[k, CLEARANCE]
            journals.bent[f, 3 + d] = on_journal[d] / films.size[k, CLEARANCE]
            journals.bent[f, 6 + d] = -force[d] / films.size[k, CLEARANCE]
            journals.bent[f, 9 + d] = on_bush[d] / films.size[k, CLEARANCE]


@inner
def by_rates(films):
    """Column of the slopes from which on the rates of amplitudes count."""
    return OPENED + films.functions.shape[2]
