"""Wind on the blades of a turbine: a balance of momentum on each vertex of a rod.

Each vertex stands for a strip of blade. The strip meets the wind, dammed by the tower if there is
one, less its own velocity; the rotor slows this air by what lift and drag of its profile take from
it, at each instant as in steady flow. The force follows the motion of the strip, so that it also
damps flapping: it is a law of one frame.

Source:
    Hansen, Aerodynamics of Wind Turbines, 2008, chapters 6 and 9; `momentum` and `blading` say
    whose balance and dam.
"""

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from numba import carray

from rom.arguments import finite, positive, unit_vector
from rom.components.cosserat.bodies import RodBody, law_of
from rom.components.wind.blading import (
    AIR_DENSITY,
    CHORD,
    ELEMENT_LENGTH,
    ELEMENT_PROFILE,
    ELEMENT_TWIST,
    NO_TOWER,
    RADIUS,
    ROTOR_RADIUS,
    TOWER_TUBE,
    slope_of_wind,
    strip_load,
    wind_at,
)
from rom.components.wind.momentum import STRIP_WIDTH, slowed
from rom.components.wind.profiles import profiles
from rom.components.wind.wind_turbine import (
    BLADE_LENGTH,
    CONE_ANGLE,
    HUB_RADIUS,
    N_BLADES,
    stations,
)
from rom.errors import ConfigError
from rom.mbs.elements.nonlinear import Elements
from rom.mbs.kernels.algebra import rotation, unit
from rom.mbs.kernels.compiled import inner
from rom.model import Array

# what the law knows of a strip: half density, length, wind (3), axis (3), tower (3), the strip of
# the balance (5), its twist less that of the frame, and from here on its number of angles and its
# profile
TWIST_PLACE, PROFILE_START = 16, 17
# by which angles differ whose forces make a slope [rad]: errors of the rounding and of the
# curvature are as large
SLOPE_STEP = 1e-5


@inner
def on_section(length, turned, normal, driving, out):
    """Force on a section, its axes, from those per length across the plane and in it."""
    c, s = length * math.cos(turned), length * math.sin(turned)
    out[0] = normal * c + driving * s
    out[1] = normal * s - driving * c


@inner
def section_force(g, k, speed, flow, turned, lee, out):
    """Force on a section, its axes: air of a speed from an angle, a plane of the rotor turned.

    The first axis is downwind without twist, the second towards the trailing edge; ``turned`` is
    the angle of the normal of the plane from the first axis, ``flow`` that of the air from the
    second, ``lee`` the angle of the wind from the axis and how far the blade points to where the
    wake leans.
    """
    axial, across = speed * math.sin(flow + turned), speed * math.cos(flow + turned)
    strip, profile = g[11 : 11 + STRIP_WIDTH], g[PROFILE_START + 1 :]
    theta = turned + g[TWIST_PLACE]
    met = slowed(strip, profile, k, theta, (axial, across), lee)
    normal, driving, _ = strip_load(strip, profile, k, theta, met, g[0])
    on_section(g[1], turned, normal, driving, out)


@inner
def section_slopes(g, k, u, m, lee, out):
    """(2, 4) how that force grows with the air in the section (2) and with the normal (2).

    With the square of a speed in proportion; with the two angles by differences, and likewise (2)
    with where the blade points.
    """
    ahead, behind = out[10:12], out[12:14]
    air, size = u[0] * u[0] + u[1] * u[1], m[0] * m[0] + m[1] * m[1]
    speed, flow, turned = math.sqrt(air), math.atan2(u[0], u[1]), math.atan2(m[1], m[0])
    section_force(g, k, speed, flow, turned, lee, ahead)
    for i in range(2):
        for j in range(2):
            out[4 * i + j] = 2.0 * ahead[i] * u[j] / air
            out[4 * i + 2 + j] = 0.0
    for angle in range(3):
        a, b, c = unit(angle)
        a, b, c = SLOPE_STEP * a, SLOPE_STEP * b, SLOPE_STEP * c
        section_force(g, k, speed, flow + a, turned + b, (lee[0], lee[1] + c), ahead)
        section_force(g, k, speed, flow - a, turned - b, (lee[0], lee[1] - c), behind)
        for i in range(2):
            slope = (ahead[i] - behind[i]) / (2.0 * SLOPE_STEP)
            if angle == 0:
                out[4 * i] += slope * u[1] / air
                out[4 * i + 1] -= slope * u[0] / air
            elif angle == 1:
                out[4 * i + 2] = -slope * m[1] / size
                out[4 * i + 3] = slope * m[0] / size
            else:
                out[8 + i] = slope


@inner
def turns_of_section(J, u, m, lean, force, out):
    """(3, 3) how the force in axes of the section grows with their rotation.

    Air, normal and the lean of the wake turn against the axes, the force with them.
    """
    for i in range(2):
        out[i, 0] = J[4 * i + 1] * u[2] + J[4 * i + 3] * m[2] - J[8 + i] * lean[1]
        out[i, 1] = -J[4 * i] * u[2] - J[4 * i + 2] * m[2] + J[8 + i] * lean[0]
        out[i, 2] = J[4 * i] * u[1] - J[4 * i + 1] * u[0] + J[4 * i + 2] * m[1]
        out[i, 2] -= J[4 * i + 3] * m[0]
        out[2, i] = 0.0
    out[2, 2] = 0.0
    out[0, 2] -= force[1]
    out[1, 2] += force[0]
    out[2, 0], out[2, 1] = force[1], -force[0]


@inner
def spread(R, J, L, W, out):
    """Write the derivatives of the resisting force: J by the air, L by rotations, W by places."""
    for i in range(3):
        for j in range(3):
            for m in range(3):
                out[8 + 6 * i + 3 + j] -= R[i, m] * L[m, j]
            for m in range(2):
                for n in range(2):
                    out[44 + 6 * i + j] += R[i, m] * J[4 * m + n] * R[j, n]
    for i in range(3):
        for j in range(3):
            for m in range(3):
                out[8 + 6 * i + j] -= out[44 + 6 * i + m] * W[m, j]


@inner
def lean_of_wake(g, R, m, out):
    """Angle of the wind from the shaft; fills (3,) in axes of the section: where the wake leans.

    Its last number is the cosine of the angle between this direction and the blade, seen in the
    plane of the rotor, the others what that grows by with turns about the second axis and against
    the first. All are zero if wind and shaft are parallel; ``m`` is the normal of this plane.
    """
    along, size = g[2] * g[5] + g[3] * g[6] + g[4] * g[7], m[0] * m[0] + m[1] * m[1]
    for i in range(3):
        out[i] = 0.0
        for j in range(3):
            out[i] += R[j, i] * (g[2 + j] - along * g[5 + j])
    beside = math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])
    scale = 1.0 / (beside * math.sqrt(size)) if beside * size > 0.0 else 0.0
    for i in range(3):
        out[i] *= scale
    if scale > 0.0:
        for i in range(2):
            out[i] += out[2] * m[2] * m[i] / size
    return math.atan2(beside, along)


@inner
def meet(g, wind, place, velocity, R, room):
    """Air of a multiple of a wind that a section meets, the angle of the wind from the shaft.

    Fills (12,): air there in the world, air and normal of the plane of the rotor in axes of the
    section, where the wake leans.
    """
    air, u, m, lean = room[0:3], room[3:6], room[6:9], room[9:12]
    for i in range(3):
        air[i] = wind * g[2 + i]
    wind_at((g[8], g[9], g[10]), place[0], place[1], place[2], air)
    for i in range(3):
        u[i] = m[i] = 0.0
        for j in range(3):
            u[i] += R[j, i] * (air[j] - velocity[j])
            m[i] += R[j, i] * g[5 + j]
    return lean_of_wake(g, R, m, lean)


def strip(numbers, pose, wanted, answer, space):
    """Wind on one strip, see PROFILE_START for the numbers."""
    k = int(carray(numbers, (PROFILE_START + 1,))[PROFILE_START])
    g, s = carray(numbers, (PROFILE_START + 1 + 3 * k,)), carray(pose, (13,))
    out, room = carray(answer, (2 + 6 + 72,)), carray(space, (64,))
    out[:] = 0.0
    R, L, W = room[0:9].reshape((3, 3)), room[9:18].reshape((3, 3)), room[18:27].reshape((3, 3))
    u, m, lean, force, J = room[30:33], room[33:36], room[36:39], room[39:41], room[41:55]
    rotation(s, 3, R)
    yaw = meet(g, 1.0, s[0:3], s[7:10], R, room[27:39])
    speed = math.sqrt(u[0] * u[0] + u[1] * u[1])
    if speed == 0.0 or m[0] * m[0] + m[1] * m[1] == 0.0:
        return
    lee = yaw, lean[2]
    section_force(g, k, speed, math.atan2(u[0], u[1]), math.atan2(m[1], m[0]), lee, force)
    for i in range(3):
        out[2 + i] = -(R[i, 0] * force[0] + R[i, 1] * force[1])
        out[1] += out[2 + i] * s[7 + i]
    if wanted == 0:
        return
    section_slopes(g, k, u, m, lee, J)
    turns_of_section(J, u, m, lean, force, L)
    slope_of_wind((g[8], g[9], g[10]), (s[0], s[1], s[2]), (g[2], g[3]), W)
    spread(R, J, L, W, out)


def in_wind(
    blade: RodBody,
    wind: npt.ArrayLike,
    *,
    axis: npt.ArrayLike = (1.0, 0.0, 0.0),
    cone: float = CONE_ANGLE,
    tower: bool = False,
    density: float = AIR_DENSITY,
) -> RodBody:
    """A blade of the NREL 5 MW turbine in the wind, for `rom.Mechanism.add_nonlinear`.

    Section axes are those of `rom.components.wind.wind_turbine.blade`: the first one downwind where
    the blade has no twist, the second towards the trailing edge.

    Args:
        blade: from ``cosserat.body(blade(...))``.
        wind: (3,) velocity of the wind far away, world [m/s].
        axis: (3,) of the shaft, downwind, world [1]; the plane of the rotor is normal to it.
        cone: of the blades, upwind [rad].
        tower: whether the tower on the origin of the world dams the wind.
        density: of the air [kg/m^3].

    Raises:
        ConfigError: for a wind that is no vector or comes from behind, or a density that cannot be.
    """
    far = far_away(wind, axis, tower=tower, density=density)
    rows = enumerate(strip_rows(blade, far, cone))
    groups = [Elements.of(law_of(strip), np.array([[k]]), row[None, :]) for k, row in rows]
    return replace(blade, elements=(*blade.elements, *groups))


def far_away(
    wind: npt.ArrayLike, axis: npt.ArrayLike, *, tower: bool, density: float
) -> list[float]:
    """Half the density, wind, axis and tower as strips know them; `in_wind` refuses the same."""
    wind = finite("wind", wind, (3,))
    axis = unit_vector("axis", axis)
    if wind @ axis < 0.0:
        text = f"the wind {wind.tolist()} comes from behind the rotor."
        raise ConfigError(text, hint="The axis of the shaft points downwind.")
    positive("density", density)
    return [0.5 * density, *wind, *axis, *(TOWER_TUBE if tower else NO_TOWER)]


def strip_rows(blade: RodBody, far: list[float], cone: float) -> list[Array]:
    """The numbers of the strip of each vertex, see PROFILE_START."""
    rows, c, ends = [], math.cos(cone), HUB_RADIUS + np.cumsum(ELEMENT_LENGTH)
    for radius, length, chord, twist in zip(*strips(blade), strict=True):
        at = int(np.searchsorted(ends[:-1], radius))
        profile = profiles()[ELEMENT_PROFILE[at]]
        of_strip = [c * radius, chord, c * ROTOR_RADIUS, c * HUB_RADIUS, N_BLADES]
        known = [far[0], length, *far[1:], *of_strip, twist, profile.angle.size]
        rows.append(np.concatenate([known, profile.table.ravel()]))
    return rows


def strips(blade: RodBody) -> tuple[Array, Array, Array, Array]:
    """(N + 1,) middles, lengths and chords [m] of the strips of the vertices, and twists [rad].

    The latter against those of the frames, which turn as the segment before the vertex.
    """
    eta = np.append(0.0, np.cumsum(blade.rod.h)) / blade.rod.h.sum()
    edges = np.concatenate([eta[:1], (eta[1:] + eta[:-1]) / 2, eta[-1:]])
    middles = HUB_RADIUS + BLADE_LENGTH * (edges[1:] + edges[:-1]) / 2
    table = stations()
    of_frame = np.radians(np.interp(edges[:-1], table["eta"], table["twist_deg"]))
    twist = np.radians(np.interp(middles, RADIUS, ELEMENT_TWIST))
    chord = np.interp(middles, RADIUS, CHORD)
    return middles, BLADE_LENGTH * np.diff(edges), chord, twist - of_frame
