"""Rolling bearings as elements: forces of balls and rollers between two rings that move at will.

Axes are those of the outer ring: z along it, u_j to ball j and tau_j = z x u_j. The cage turns by a
share g of the angle theta of the inner ring about z. With D from the centre of the outer ring to
that of the inner one, whose axis is n, the groove of the inner ring moves at ball j by

    r = D . u_j,    a = D . z - R n . u_j

and the centres of both grooves, (p_r, p_a) apart in the middle of the play, come (p_r + r, p_a + a)
apart: the ball is pressed by the growth of that distance over the one at which it just touches.
Rollers are pressed by p_r + r. The forces are the gradient of the energy, the turning of the cage
included, so that momentum and energy are kept.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rom.arguments import Angle, Direction, NotNegative, unit_vector
from rom.components.rolling_bearing.races import BallBearing, RollerBearing
from rom.errors import ConfigError
from rom.mbs.elements.family import Family, Places, integers, rows_of
from rom.mbs.kernels.algebra import add, cross, dot, row, scale, sub, turn
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.coordinates import followed_angle, place_tangent
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.tables import Array2, Index1, Scratch1, Scratch2, Scratch3, Table, table
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import Whole
from rom.model import Array
from rom.rotation import matrix

# columns of Bearings.race
STIFFNESS, EXPONENT, CURVATURE, RADIAL, AXIAL, RADIUS, CAGE, DAMPING, PHASE, SPIN = range(10)


@table
class Bearings(Table):
    """All bearings."""

    i: Index1  # (k,) markers of the inner rings
    j: Index1  # (k,) of the outer rings
    # (k, 12) axis of the inner ring, a direction across it, the same of the outer one, in the axes
    # of their markers
    axes: Array2
    count: Index1  # (k,) balls or rollers
    # (k, 10) stiffness [N/m^n], exponent n, distance of the centres of the grooves [m], 0 of
    # rollers, its radial and axial part in the middle of the play [m], radius of the inner centres
    # [m], share of the cage, damping [s/m], angle of the first ball [rad], speed at which rings
    # that spin in their frames turn the cage [rad/s]
    race: Array2
    clock: Index1  # (1,) function that tells the time
    remembered: Index1  # (k,) angle that is followed
    load: Scratch1  # (k,) sum of all normal forces at the last residual [N]
    gradient: Scratch2  # (2, 12) of the depth of one ball along its normal, and across it
    tangent: Scratch3  # (2, 12, 12) of one bearing, by motions and velocities


@inner
def ring_frame(s, W, bearings, k):
    """Axes z, e, z x e of the outer ring, axis n of the inner; angle of the cage, its gradient."""
    i, j, axes = bearings.i[k], bearings.j[k], bearings.axes
    n, f = turn(W.E, i, row(axes, k, 0)), turn(W.E, i, row(axes, k, 3))
    z, e = turn(W.E, j, row(axes, k, 6)), turn(W.E, j, row(axes, k, 9))
    t = cross(z, e)
    x, y = dot(e, f), dot(t, f)
    axis = scale(1.0 / (x * x + y * y), cross(f, sub(scale(x, t), scale(y, e))))
    angle = followed_angle(s, W, bearings.remembered[k], math.atan2(y, x))
    share = bearings.race[k, CAGE]
    cage = bearings.race[k, PHASE] + share * angle
    cage += bearings.race[k, SPIN] * W.signal[bearings.clock[0], 0]
    return (z, e, t), n, cage, scale(share, axis)


@inner
def ball_depth(W, bearings, k, ball, frame):
    """Depth of a ball, the distance of the centres of its grooves, and the rate by their spin.

    Sets bearings.gradient.
    """
    (z, e, t), n, cage, axis = frame
    race = bearings.race[k]
    angle = cage + 2.0 * math.pi * ball / bearings.count[k]
    u = add(scale(math.cos(angle), e), scale(math.sin(angle), t))
    tau, R = cross(z, u), race[RADIUS]
    D = sub(row(W.P, bearings.i[k], 0), row(W.P, bearings.j[k], 0))
    r, a = race[RADIAL] + dot(D, u), race[AXIAL] + dot(D, z) - R * dot(n, u)
    if race[CURVATURE] > 0.0:
        distance = math.sqrt(r * r + a * a)
        cosine, sine = r / distance, a / distance
        depth = distance - race[CURVATURE]
    else:
        distance, cosine, sine, depth = 1.0, 1.0, 0.0, r
    passing = race[SPIN] * (cosine * dot(D, tau) - sine * R * dot(n, tau))
    for kind in range(2):
        c, q = (cosine, sine) if kind == 0 else (-sine, cosine)
        force = add(scale(c, u), scale(q, z))
        rolling = scale(c * dot(D, tau) - q * R * dot(n, tau), axis)
        lever = scale(q * R, cross(n, u))
        one = sub(rolling, lever)
        two = sub(add(add(scale(c, cross(u, D)), scale(q, cross(z, D))), lever), rolling)
        for p in range(3):
            bearings.gradient[kind, p], bearings.gradient[kind, 3 + p] = force[p], one[p]
            bearings.gradient[kind, 6 + p], bearings.gradient[kind, 9 + p] = -force[p], two[p]
    return depth, distance, passing


@inner
def ball_force(W, bearings, k, depth, passing):
    """Rate of the depth and force of a ball, its elastic part, derivatives by depth and rate."""
    race, i, j, rate = bearings.race[k], bearings.i[k], bearings.j[k], passing
    for p in range(6):
        rate += bearings.gradient[0, p] * W.V[i, p] + bearings.gradient[0, 6 + p] * W.V[j, p]
    elastic = race[STIFFNESS] * depth ** race[EXPONENT]
    grip = max(1.0 + race[DAMPING] * rate, 0.0)  # a ball does not pull
    by_rate = elastic * race[DAMPING] if grip > 0.0 else 0.0
    return rate, elastic * grip, elastic, race[EXPONENT] * elastic / depth * grip, by_rate


@residuals.of(Bearings)
def bearing_wrenches(s, W, bearings, _q, _v, _lam):
    """Add the balls to the wrenches on the markers; add up the power lost."""
    for k in range(bearings.i.size):
        bearings.load[k] = 0.0
        frame = ring_frame(s, W, bearings, k)
        for ball in range(bearings.count[k]):
            depth, _, passing = ball_depth(W, bearings, k, ball, frame)
            if not depth > 0.0:
                continue
            rate, force, elastic, _, _ = ball_force(W, bearings, k, depth, passing)
            bearings.load[k] += force
            W.power[1] += force * passing  # of what keeps the rings spinning
            W.power[2] += (force - elastic) * rate
            for p in range(6):
                W.wrench[bearings.i[k], p] -= force * bearings.gradient[0, p]
                W.wrench[bearings.j[k], p] -= force * bearings.gradient[0, 6 + p]


@tangents.of(Bearings)
def bearing_tangents(s, W, bearings, _lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S.

    The turning of the normals across the grooves counts, as it carries the thrust of radial
    bearings; that of the whole bearing is left out, as displacements are small against its radius.
    """
    for k in range(bearings.i.size):
        bearings.tangent[:] = 0.0
        frame = ring_frame(s, W, bearings, k)
        for ball in range(bearings.count[k]):
            place = ball_depth(W, bearings, k, ball, frame)
            if place[0] > 0.0:
                add_ball_tangents(W, bearings, k, place)
        place_tangent(s, W, (bearings.i[k], bearings.j[k]), bearings.tangent, ck, cc)


@inner
def add_ball_tangents(W, bearings, k, place):
    """Add those of the ball at hand to bearings.tangent."""
    depth, distance, passing = place
    _, force, _, by_depth, by_rate = ball_force(W, bearings, k, depth, passing)
    bend = force / distance if bearings.race[k, CURVATURE] > 0.0 else 0.0
    g = bearings.gradient
    for p in range(12):
        for q in range(12):
            along = g[0, p] * g[0, q]
            bearings.tangent[0, p, q] += by_depth * along + bend * g[1, p] * g[1, q]
            bearings.tangent[1, p, q] += by_rate * along


@energy.of(Bearings)
def bearing_energy(s, W, bearings, _q, _v):
    """Elastic energy of balls and races."""
    total = 0.0
    for k in range(bearings.i.size):
        frame, n = ring_frame(s, W, bearings, k), bearings.race[k, EXPONENT]
        for ball in range(bearings.count[k]):
            depth = ball_depth(W, bearings, k, ball, frame)[0]
            if depth > 0.0:
                total += bearings.race[k, STIFFNESS] * depth ** (n + 1.0) / (n + 1.0)
    return total


PLACE_RTOL = 1e-2  # of the pitch diameter: by which rings may be apart at first


@dataclass(frozen=True, slots=True)
class RollingBearing:
    """A bearing between two rings; axes (4, 3) and race (10,) as in `Bearings`."""

    i: Marker
    j: Marker
    bearing: BallBearing | RollerBearing
    axes: Array
    race: tuple[float, ...]


def rolling_bearing(  # noqa: PLR0913  one keyword per property
    self: Whole,
    name: str,
    inner: Marker,
    outer: Marker,
    *,
    axis: Direction,
    bearing: BallBearing | RollerBearing,
    damping: Annotated[float, NotNegative("s/m")] = 0.0,
    phase: Angle = 0.0,
) -> None:
    """Balls or rollers between an inner and an outer ring, by Hertz, with play or preload.

    Where the bodies were added the rings are in the middle of the play. The cage turns with the
    rings without slip; as balls pass below the load the stiffness varies. Balls have no mass, no
    friction and no gyroscopic moment.

    Args:
        name: name of the bearing.
        inner: middle of the inner ring, on its axis.
        outer: of the outer ring, at the same place.
        axis: (3,) of the bearing, in the world at the start.
        bearing: `rom.mbs.BallBearing` or `rom.mbs.RollerBearing`.
        damping: factor of the closing speed by which the force on a ball grows [s/m].
        phase: angle of the first ball about the axis, from some direction across it [rad].

    Raises:
        ConfigError: for a name in use, unknown markers, rings that are not at one place, or numbers
            no bearing has.
    """
    self.check_apart(name, inner, outer)
    z = unit_vector(f"axis of {name}", axis)
    apart = float(np.linalg.norm(self.design_point(inner) - self.design_point(outer)))
    if apart > PLACE_RTOL * bearing.pitch_diameter:
        text = f"the rings of bearing {name!r} are {apart * 1e3:.4g} mm apart"
        raise ConfigError(f"{text}; they must be at one place where the bodies are added.")
    e = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    e /= np.linalg.norm(e)
    turned = [matrix(self.part(ring.body).p) for ring in (inner, outer)]
    axes = np.array([x @ A for A in turned for x in (z, e)])
    b, parts = bearing, (self.part(inner.body), self.part(outer.body))
    spins = [part.spin_about(name, axes[2 * k]) for k, part in enumerate(parts)]
    spin = spins[1] + b.cage * (spins[0] - spins[1])
    grooves = b.stiffness, b.exponent, b.curvature_distance, *b.offset, b.radius, b.cage
    race = (*grooves, damping, phase, spin)
    self.add(name, RollingBearing(inner, outer, bearing, axes, race), ROLLING_BEARINGS_FAMILY)


def circles(_: object, __: str, row: RollingBearing) -> list[tuple[Marker, Array, float]]:
    """What is drawn: the circle of the middles of balls or rollers."""
    return [(row.j, row.axes[2], 0.5 * row.bearing.pitch_diameter)]


def pack(bearings: Mapping[str, RollingBearing], places: Places) -> Bearings:
    """The bearings as arrays."""
    found = list(bearings.values())
    return Bearings(
        integers(places.marker[one.i] for one in found),
        integers(places.marker[one.j] for one in found),
        rows_of((one.axes.ravel() for one in found), 12),
        integers(one.bearing.count for one in found),
        rows_of((one.race for one in found), 10),
        integers([places.clock()]),
        integers(places.memory(name, np.zeros(1)) for name in bearings),
        *(np.zeros(shape) for shape in (len(found), (2, 12), (2, 12, 12))),
    )


FORCES = bearing_wrenches, bearing_tangents, bearing_energy
ROLLING_BEARINGS_FAMILY = Family(
    "rolling_bearings", RollingBearing, pack, *FORCES, by_rate=lambda x: x.race[:, DAMPING].any()
)
