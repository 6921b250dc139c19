"""Bores that deform under the pressure of their films: elastohydrodynamic bearings.

Beyond the mean motion of its marker the surface of a bush moves outwards in the cells of the film
by

    w = Phi a,   a = A q,

q the elastic coordinates of its body. The film opens by w, and its pressure does the work of
f = int(p Phi) on a. Both follow from what the bore was reduced with: functions that were chosen
before anything was solved.
"""

import numpy as np

from rom.components.journal_bearing.films.bearing import JournalBearing
from rom.components.journal_bearing.films.cells import CLEARANCE, N_ANSWERS
from rom.components.journal_bearing.films.kinematics import (
    answer_unit,
    carried_twist,
    film_forces,
    journal_place,
    journal_wrench,
)
from rom.components.round_bodies.cylinders import cylinder_of, deformable
from rom.errors import ConfigError
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import block_of
from rom.mbs.parts.bodies import Marker, Part
from rom.model import Array

DEPENDENT_RTOL = 1e-6  # of the largest opening: functions below it open no film
BORE_RTOL = 0.02  # of the radius, by which the nodes of a meshed bore may lie beside the bearing
LENGTH_RTOL = 1e-3  # of its length, by which a bearing may reach beyond its bore


def bore_of(
    name: str, part: Part, bush: Marker, axes: Array, bearing: JournalBearing
) -> tuple[Array, Array]:
    """(n, m) functions in its cells by which a bush opens its film, and (m, r) amplitudes [m].

    Amplitudes are per elastic coordinate of the part; the axes (2, 3) are that of the bush, and the
    direction from which angles count, in the frame of the part.
    """
    where = f"the bush of bearing {name!r}, {bush.place!r} of body {bush.body!r},"
    (axis, across), found = axes, deformable(part, bush)
    if found is None:
        hint = "Reduce that interface with rom.FourierLegendre(4, 2), or leave out elastic_bush."
        raise ConfigError(f"{where} has no functions by which it could deform.", hint=hint)
    if bearing.aligned:
        text = f"{where} deforms, and the film of an aligned bearing does not"
        raise ConfigError(f"{text}; give it aligned=False.")
    surface, patch = found
    frame = np.array([across, np.cross(axis, across), axis])
    _check_bore(where, (patch.points - surface.point) @ frame.T, bearing)
    bore = cylinder_of(part, bush, axis, across)
    assert bore is not None  # it deforms
    grid = bearing.grid
    theta = np.repeat(np.arctan2(grid.angle[0, :, 1], grid.angle[0, :, 0]), grid.Z.size)
    z = np.tile(grid.Z, len(grid.angle[0])) * bearing.length
    outwards = np.cos(theta)[:, None] * bore.axes[0] + np.sin(theta)[:, None] * bore.axes[1]
    opened = np.einsum("cf,ca,far->cr", bore.functions(theta, z), outwards, bore.shapes)
    U, size, V = np.linalg.svd(opened, full_matrices=False)
    keep = size > DEPENDENT_RTOL * size.max(initial=0.0)
    return U[:, keep], size[keep, None] * V[keep]


def _check_bore(where: str, local: Array, bearing: JournalBearing) -> None:
    """Refuse a surface with nodes (n, 3) in the axes of the bearing that is not its bore."""
    radii, R = np.hypot(local[:, 0], local[:, 1]), bearing.radius
    if np.abs(radii - R).max() > BORE_RTOL * R:
        far = f"{1e3 * radii.min():.5g} to {1e3 * radii.max():.5g} mm from the axis"
        text = f"{where} is no bore of it: its nodes lie {far}, and the journal has a radius of"
        raise ConfigError(f"{text} {1e3 * R:.5g} mm; compare diameter, axis and mesh.")
    L = bearing.length
    beyond = 0.5 * L - min(local[:, 2].max(), -local[:, 2].min())
    if beyond > LENGTH_RTOL * L:
        text = f"{where} ends {1e3 * beyond:.4g} mm before the bearing does, which is"
        raise ConfigError(f"{text} {1e3 * L:.5g} mm long; mesh a longer bore.")


@inner
def open_film(s, journals, k, q, v):
    """Set how the bore of film k opens its cells, and how fast."""
    films, amplitude, body = journals.films, journals.amplitude[k], s.markers.body[journals.j[k]]
    count, half = films.n_functions[k], films.functions.shape[2]
    if count == 0:
        return
    at, vt = s.bodies.q_at[body] + 7, s.bodies.v_at[body] + 6
    for f in range(count):
        moved, rate = 0.0, 0.0
        for n in range(s.bodies.r[body]):
            moved += journals.bores[k, f, n] * q[at + n]
            rate += journals.bores[k, f, n] * v[vt + n]
        amplitude[f] = moved / films.size[k, CLEARANCE]
        amplitude[half + f] = rate / films.size[k, CLEARANCE]
    for cell in range(films.shape[k, 0] * films.shape[k, 1]):
        gap, rate = 0.0, 0.0
        for f in range(count):
            gap += films.functions[k, cell, f] * amplitude[f]
            rate += films.functions[k, cell, f] * amplitude[half + f]
        films.opening[k, cell], films.opening_rate[k, cell] = gap, rate


@inner
def bend_bore(s, W, journals, k):
    """Subtract the forces on the bore of film k, as elastic ones, from W.residual."""
    films, body = journals.films, s.markers.body[journals.j[k]]
    for f in range(films.n_functions[k]):
        force = answer_unit(journals, k, N_ANSWERS + f) * films.answer[k, N_ANSWERS + f]
        for n in range(s.bodies.r[body]):
            W.residual[s.bodies.v_at[body] + 6 + n] -= force * journals.bores[k, f, n]


@inner
def bore_power(journals, k):
    """Power that the film gives to its bore [W]."""
    films, total = journals.films, 0.0
    for f in range(films.n_functions[k]):
        force = answer_unit(journals, k, N_ANSWERS + f) * films.answer[k, N_ANSWERS + f]
        total += force * journals.amplitude[k, films.functions.shape[2] + f]
    return total * films.size[k, CLEARANCE]


@inner
def unit_motion(s, W, m, q, carried):
    """How marker m moves and turns with coordinate q of its body, or its twist changes."""
    if carried:
        return carried_twist(s, W, m, q)
    H = W.H[m]
    return (H[0, q], H[1, q], H[2, q]), (H[3, q], H[4, q], H[5, q])


@inner
def add_bore_rows(s, W, journals, k, first, c, S):
    """Add c times the changes of the forces on the bore of film k to S; `set_column` first.

    From column ``first`` on are the slopes by amplitudes, or by their rates; -1 for those by twists
    that positions change.
    """
    films, bores, body = journals.films, journals.bores[k], s.markers.body[journals.j[k]]
    r, size = s.bodies.r[body], films.size[k, CLEARANCE]
    if films.n_functions[k] == 0:
        return
    for side in range(2):
        m = journals.i[k] if side == 0 else journals.j[k]
        b = s.markers.body[m]
        if b < 0:
            continue
        e = block_of(s.graph, body, b)
        x, y = s.graph.x[e] + 6, s.graph.y[e]
        for q in range(6 + s.bodies.r[b]):
            move, spin = unit_motion(s, W, m, q, first < 0)
            for f in range(films.n_functions[k]):
                changed, on = 0.0, journals.pressed[f]
                for d in range(3):
                    changed += on[6 * side + d] * move[d] + on[6 * side + 3 + d] * spin[d]
                for g in range(films.n_functions[k] if side == 1 and q >= 6 and first > 0 else 0):
                    unit = answer_unit(journals, k, N_ANSWERS + f) / size
                    changed += unit * films.slope[k, N_ANSWERS + f, first + g] * bores[g, q - 6]
                for n in range(r):
                    S[x + n, y + q] -= c * changed * bores[f, n]


@inner
def add_bore_columns(s, W, journals, k, first, c, S):
    """Add c times the changes of both wrenches by the bore of film k, or by its rate, to S."""
    films, bores, body = journals.films, journals.bores[k], s.markers.body[journals.j[k]]
    axes, relative = journal_place(W, journals.i[k], journals.j[k], journals.axes[k])
    for f in range(films.n_functions[k]):
        F, torque = film_forces(journals, k, films.slope[k, :, first + f])
        force, on_journal, on_bush = journal_wrench(axes, relative[0], F, torque)
        for side in range(2):
            m = journals.i[k] if side == 0 else journals.j[k]
            b, sign = s.markers.body[m], 1.0 - 2.0 * side
            if b < 0:
                continue
            e, moment = block_of(s.graph, b, body), on_journal if side == 0 else on_bush
            x, y = s.graph.x[e], s.graph.y[e] + 6
            for p in range(6 + s.bodies.r[b]):
                changed = 0.0
                for d in range(3):
                    changed += W.H[m, d, p] * sign * force[d] + W.H[m, 3 + d, p] * moment[d]
                for n in range(s.bodies.r[body]):
                    S[x + p, y + n] -= c / films.size[k, CLEARANCE] * changed * bores[f, n]


@inner
def add_bore_tangents(s, W, journals, k, first, c, S):
    """Add c times what the bore of film k, or its rate, and forces on it change to S."""
    add_bore_rows(s, W, journals, k, first, c, S)
    add_bore_columns(s, W, journals, k, first, c, S)
