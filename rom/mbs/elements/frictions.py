"""Dry and viscous friction along joint coordinates."""

import math
from dataclasses import dataclass
from typing import Annotated, Any

from rom.arguments import AtLeast, Length, NotNegative, Positive
from rom.errors import ConfigError
from rom.mbs.elements.family import Family, Places, apart, integers, on_joint, rows_of
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import column_of
from rom.mbs.kernels.coordinates import coordinate_tangent, push_coordinate
from rom.mbs.kernels.element_calls import multiplier_columns, residuals, tangents
from rom.mbs.kernels.system import ALONG, POINT
from rom.mbs.kernels.tables import Array2, Index1, Table, table
from rom.mbs.parts.joints import Coordinate, Row, coordinate_of
from rom.mbs.parts.whole import Whole


@dataclass(frozen=True, slots=True)
class Friction:
    """Dry and viscous friction along a joint coordinate; numbers as in `Frictions`."""

    joint: str
    row: Row
    numbers: tuple[float, ...]


def friction(  # noqa: PLR0913  one keyword per property
    self: Whole,
    name: str,
    joint: str,
    *,
    transition_speed: Annotated[float, Positive()],
    coulomb: Annotated[float, NotNegative()] = 0.0,
    mu: Annotated[float, NotNegative()] = 0.0,
    radius: Length | None = None,
    static: Annotated[float, AtLeast(1.0)] = 1.0,
    stribeck_speed: Annotated[float, Positive()] | None = None,
    viscous: Annotated[float, NotNegative()] = 0.0,
    coordinate: Coordinate | None = None,
) -> None:
    """Friction along a joint coordinate x: - level s(x') - viscous x'.

    s(v) = tanh(v / transition_speed) (1 + (static - 1) exp(-(v / stribeck_speed)^2)), and
    level = coulomb + mu radius |F| with the resultant force F that the joint transmits. What
    sticks creeps with less than the transition speed.

    Args:
        name: name of the friction.
        joint: joint with a coordinate.
        transition_speed: speed over which the sign changes [m/s or rad/s]; implicit steps
            that change the speed by much more take many corrections.
        coulomb: level that is always there [N or N m].
        mu: coefficient of friction [1].
        radius: at which friction acts on an angle, that of the pin [m]; none for a
            displacement.
        static: level at rest over that of fast motion, at least 1 [1].
        stribeck_speed: speed over which this fades [m/s or rad/s].
        viscous: force per speed [N s/m or N m s/rad].
        coordinate: "angle" or "displacement"; None for the only or the first one.

    Raises:
        ConfigError: for a joint without such a coordinate, or numbers no friction has.
    """
    row = coordinate_of(self.joints, joint, coordinate, "friction")
    turns = row is self.joints[joint].turn
    if mu and turns and radius is None:
        raise ConfigError(f"friction {name!r} with mu on an angle needs the radius of the pin.")
    if radius is not None and not turns:
        raise ConfigError(f"friction {name!r} acts along a displacement; leave radius out.")
    if static > 1.0 and stribeck_speed is None:
        raise ConfigError(f"static = {static:g} of friction {name!r} needs stribeck_speed.")
    level, fade = mu * (1.0 if radius is None else radius), stribeck_speed or 1.0
    numbers = (coulomb, level, static - 1.0, fade, viscous, transition_speed)
    self.add(name, Friction(joint, row, numbers), FRICTIONS_FAMILY)


@table
class Frictions(Table):
    """All frictions.

    Attributes:
        at: (f,) joint coordinates.
        law: (f, 6) constant level [N or N m], level per load of the joint [1 or m], share by which
            the level is higher at rest, speed over which that fades, viscous coefficient, speed
            over which the sign changes.
        load_first, load_count: (f,) constraint rows of the joint.
    """

    at: Index1
    law: Array2
    load_first: Index1
    load_count: Index1


def pack(frictions: Any, places: Places) -> Frictions:
    """The frictions as arrays."""
    found = frictions.values()
    return Frictions(
        integers(places.coordinate(f.joint, f.row) for f in found),
        rows_of((f.numbers for f in found), 6),
        integers(places.owners.index(f.joint) for f in found),
        integers(places.owners.count(f.joint) for f in found),
    )


@inner
def joint_load(s, frictions, k, lam):
    """Resultant of the forces that the joint of friction k transmits [N]."""
    total = 0.0
    first = frictions.load_first[k]
    for row in range(first, first + frictions.load_count[k]):
        if s.rows.kind[row] in (POINT, ALONG):
            total += lam[row] ** 2
    return math.sqrt(total)


@inner
def friction_shape(law, rate):
    """Friction per level, with Stribeck's rise towards rest, and its derivative by the rate."""
    sign = math.tanh(rate / law[5])
    fade = law[2] * math.exp(-((rate / law[3]) ** 2))
    slope = (1.0 - sign * sign) / law[5] * (1.0 + fade)
    return sign * (1.0 + fade), slope - 2.0 * rate / law[3] ** 2 * sign * fade


@inner
def friction_force(s, W, frictions, k, lam):
    """Force of friction k and its derivative by the rate."""
    law, rate = frictions.law[k], W.xd[frictions.at[k]]
    level = law[0] + law[1] * joint_load(s, frictions, k, lam)
    shape, slope = friction_shape(law, rate)
    return -level * shape - law[4] * rate, -level * slope - law[4]


@residuals.of(Frictions)
def friction_wrenches(s, W, frictions, _q, _v, lam):
    """Add the frictions to the wrenches on the markers; add up the power lost."""
    for k in range(frictions.at.size):
        at = frictions.at[k]
        force, _ = friction_force(s, W, frictions, k, lam)
        push_coordinate(s, W, at, force)
        W.power[2] -= force * W.xd[at]


@tangents.of(Frictions)
def friction_tangents(s, W, frictions, lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S."""
    for k in range(frictions.at.size):
        force, by_rate = friction_force(s, W, frictions, k, lam)
        coordinate_tangent(s, W, frictions.at[k], (ck * force, 0.0, cc * by_rate), W.Kt, W.S)


@multiplier_columns.of(Frictions)
def load_columns(s, W, frictions, lam, rank):
    """Add to W.UG what friction forces change with the multipliers of their joint."""
    for k in range(frictions.at.size):
        at, load = frictions.at[k], joint_load(s, frictions, k, lam)
        if frictions.law[k, 1] == 0.0 or load == 0.0:
            continue
        shape, _ = friction_shape(frictions.law[k], W.xd[at])
        first = frictions.load_first[k]
        for row in range(first, first + frictions.load_count[k]):
            if s.rows.kind[row] not in (POINT, ALONG):
                continue
            change = frictions.law[k, 1] * shape * lam[row] / load
            for r in range(rank):
                u = W.U_lu[r, row] if rank < lam.size else (1.0 if r == row else 0.0)
                if u != 0.0:
                    add_gradient(s, W, at, change * u, r)


@inner
def add_gradient(s, W, at, c, row):
    """Add c times the gradient of joint coordinate ``at`` in the velocities to a row of W.UG."""
    bodies, C = s.bodies, s.coordinates
    for side in range(2):
        m = C.i[at] if side == 0 else C.j[at]
        b = s.markers.body[m]
        first = column_of(s.graph, row, b) if s.graph.compact else bodies.v_at[b]
        for q in range(6 + bodies.r[b] if b >= 0 else 0):
            for p in range(6):
                W.UG[row, first + q] += c * W.xg[at, 6 * side + p] * W.H[m, p, q]


FRICTIONS_FAMILY = Family(
    "frictions", Friction, pack, friction_wrenches, friction_tangents,
    multiplier_columns=load_columns, ends=on_joint, couples=apart,
    loaded_rows=lambda frictions: frictions.load_first[frictions.law[:, 1] != 0.0],
)  # fmt: skip
