"""Tendons as elements: what users describe, their arrays and kernels."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from rom.arguments import (
    Count,
    Direction,
    Length,
    NotNegative,
    Positive,
    not_both,
    not_negative,
    one_given,
    positive,
    typed,
    unit_vector,
)
from rom.components.tendons.paths import Place, path_through
from rom.components.tendons.routing import (
    bearing_angle,
    between,
    departure,
    directions,
    piece,
    pulley_axis,
    turning,
)
from rom.components.tendons.tension import (
    add_powers,
    place_tangents,
    share_tension,
    stored_energy,
    tension_slopes,
)
from rom.errors import ConfigError
from rom.mbs.elements.family import Family, Hooks, Places, integers, rows_of, starts
from rom.mbs.kernels.algebra import cross, dot, row, sub, turn
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.coordinates import followed_angle
from rom.mbs.kernels.element_calls import energy, residuals, tangents
from rom.mbs.kernels.tables import (
    Array1,
    Array2,
    Index1,
    Scratch1,
    Scratch2,
    Scratch3,
    Table,
    table,
)
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import Whole
from rom.model import Array, Index
from rom.rotation import matrix

MAX_TURNS = 1000  # of a cable about a pulley
Coefficient = Annotated[float, NotNegative()]  # of friction


@typed
@dataclass(frozen=True)
class Pulley:
    """A place of a tendon at which it runs around a circle.

    Attributes:
        marker: centre.
        radius: of the cable [m].
        axis: (3,) of the pulley, in the world at the start; the cable goes around it in the
            positive sense.
        friction: coefficient between cable and pulley [1]; without it the cable slides, or turns a
            sheave without bearing friction.
        turns: whole turns about it beyond the wrap of less than one.
    """

    marker: Marker
    radius: Length
    axis: Direction
    friction: Coefficient = 0.0
    turns: Annotated[int, Count(0, MAX_TURNS)] = 0


@dataclass(frozen=True, slots=True)
class Station:
    """A place of a tendon; numbers as in `Tendons`."""

    marker: Marker
    axes: Array
    radius: float
    friction: float
    turns: int


@dataclass(frozen=True, slots=True)
class Tendon:
    """A cable; numbers as in `Tendons`."""

    stations: tuple[Station, ...]
    numbers: tuple[float, ...]
    pulled: bool
    function: Callable[[float], Any] | None


def tendon(  # noqa: PLR0913  one keyword per property
    self: Whole,
    name: str,
    path: Sequence[Marker | Pulley],
    *,
    EA: Annotated[float, Positive("N")] | None = None,
    damping: Annotated[float, NotNegative("N s")] = 0.0,
    free_length: Any = None,
    pretension: Annotated[float, NotNegative("N")] = 0.0,
    tension: Any = None,
    friction: Coefficient = 0.0,
    transition_speed: Annotated[float, Positive("m/s")] | None = None,
) -> None:
    """Cable that pulls along a path through eyelets and over pulleys, and goes slack.

    It has no mass and is fixed at both ends. Tensions on both sides of an eyelet at which it turns
    differ by the factor exp(friction angle) while it slides (Euler, Eytelwein); what sticks creeps
    with less than the transition speed. Either it stretches, or a force pulls it at its first end,
    from beyond the path.

    Args:
        name: name of the tendon.
        path: markers in the order in which it passes them, and `rom.mbs.Pulley` between the ends.
        EA: force per strain [N].
        damping: tension per rate of strain [N s]; it is never more than the elastic tension.
        free_length: length without force [m], or a function of time: a winch before the first
            marker; None for the length at the start.
        pretension: tension at the start, in place of a free length [N].
        tension: force that pulls at the first end, or a function of time [N], in place of EA.
        friction: coefficient at all eyelets [1].
        transition_speed: of the sliding cable, over which friction turns [m/s].

    Raises:
        ConfigError: for a name in use, an unknown marker, a path that is none, pulleys that overlap
            or whose axes are not parallel, or numbers no cable has.
    """
    stations = tuple(_station(self, name, place, friction) for place in path)
    length = _design_length(self, name, stations)
    if any(one.friction for one in stations[1:-1]) and transition_speed is None:
        text = f"tendon {name!r} has friction, but no transition_speed"
        raise ConfigError(f"{text}; take a hundredth of the speed with which it slides.")
    one_given(f"tendon {name!r}", EA=EA, tension=tension)
    if EA is None and (damping or pretension or free_length is not None):
        text = f"tendon {name!r} is pulled by a given tension and does not stretch"
        raise ConfigError(f"{text}; leave damping, free_length and pretension out.")
    not_both(f"tendon {name!r}", pretension=pretension or None, free_length=free_length)
    given = free_length if EA else tension
    if callable(given):
        number = 0.0
    elif EA is None:
        number = not_negative(f"tension of tendon {name!r}", given)
    else:
        number = length / (1 + pretension / EA) if given is None else positive("free_length", given)
    numbers = (EA or 0.0, damping, number, transition_speed or 1.0)
    function = given if callable(given) else None
    self.add(name, Tendon(stations, numbers, EA is None, function), TENDONS_FAMILY)


def _station(mechanism: Whole, name: str, place: Marker | Pulley, friction: float) -> Station:
    """A place of the path in the axes of its marker."""
    if isinstance(place, Marker):
        mechanism.check_markers(name, place)
        return Station(place, np.eye(3)[:2], 0.0, friction, 0)
    mechanism.check_markers(name, place.marker)
    n = unit_vector(f"axis of a pulley of {name}", place.axis)
    e = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    e /= np.linalg.norm(e)
    axes = np.array([n, e]) @ matrix(mechanism.part(place.marker.body).p)
    return Station(place.marker, axes, place.radius, place.friction, place.turns)


def _design_length(whole: Whole, name: str, stations: Sequence[Station]) -> float:
    """Length of the path where the bodies were added."""
    if len(stations) < 2:
        raise ConfigError(f"tendon {name!r} needs at least two places, got {len(stations)}.")
    if stations[0].radius or stations[-1].radius:
        raise ConfigError(f"tendon {name!r} ends at a pulley; fix it at a marker at both ends.")
    path = path_through(name, [_placed(whole, one) for one in stations])
    wraps = zip(stations, path.wrap, strict=True)
    arcs = (one.radius * (wrap + 2 * np.pi * one.turns) for one, wrap in wraps)
    return float(path.straight.sum() + sum(arcs))


def _placed(whole: Whole, one: Station) -> Place:
    """A place where its body was added."""
    axes = one.axes @ matrix(whole.part(one.marker.body).p).T
    return Place(whole.design_point(one.marker), axes, one.radius)


@table
class Tendons(Table):
    """All tendons; the p stations of one after those of the other.

    A piece has the number of the station before it, so that that of a last station is unused.
    """

    first: Index1  # (k + 1,) first station of each tendon
    # (k, 4) EA [N], damping [N s], free length [m] or tension [N] without a function, transition
    # speed [m/s]
    law: Array2
    signal: Index1  # (k,) motion of free length, or function of time of tension; -1 for none
    pulled: Index1  # (k,) 1 if its tension is given
    rated: Index1  # (k,) 1 if its tension depends on velocities
    at: Index1  # (p,) markers
    axes: Array2  # (p, 6) axis of a pulley and a direction across it, in the axes of the marker
    radius: Array1  # (p,) of the pulley [m], 0 for an eyelet
    friction: Array1  # (p,) coefficient [1]
    remembered: Index1  # (p,) where the angle of wrap is kept, -1 for eyelets
    length: Scratch1  # (p,) of pieces, with half of the arcs at both ends [m]
    rate: Scratch1  # (p,) of these lengths [m/s]
    gradient: Scratch2  # (p, 12) of the length between points of both stations, by their motions
    pull: Scratch2  # (p, 3) gradient of the straight length by the position of its second end
    wrap: Scratch1  # (p,) angle by which it turns at a station [rad]
    wrap_gradient: Scratch2  # (p, 18) by the motions of the station before, its own, that behind
    weight: Scratch1  # (p,) of pieces [1]
    flow: Scratch1  # (p,) over the station [m/s]
    tension: Scratch1  # (p,) of pieces [N]
    rate_gradient: Scratch2  # (p, 12) of the rate of the length of a piece, by motions
    bend: Scratch2  # (p, 36) of the direction of a piece, by motions; (3, 12) row by row
    slope: Scratch3  # (3, m, m) of the tensions of one tendon by lengths, rates and angles
    change: Scratch2  # (2, 6 m) of one tension by motions and velocities of m stations
    stiffness: Scratch2  # (6 m, 6 m) of one tendon, by motions of its stations
    damping: Scratch2  # (6 m, 6 m) likewise


def pack(tendons: Mapping[str, Tendon], places: Places) -> Tendons:
    """The tendons as arrays."""
    each = ((name, k, one) for name, x in tendons.items() for k, one in enumerate(x.stations))
    named = [(f"place {k} of {name}", one) for name, k, one in each]
    stations = [one for _, one in named]
    sizes = [len(tendon.stations) for tendon in tendons.values()]
    p, m = len(stations), max(sizes)
    cables = tendons.values()
    return Tendons(
        starts(sizes),
        rows_of((cable.numbers for cable in cables), 4),
        integers(_signal(name, tendon, places) for name, tendon in tendons.items()),
        integers(cable.pulled for cable in cables),
        integers(_rated(cable) for cable in cables),
        integers(places.marker[one.marker] for one in stations),
        rows_of((one.axes.ravel() for one in stations), 6),
        np.array([one.radius for one in stations]),
        np.array([one.friction for one in stations]),
        integers(_remembered(*one, places) for one in named),
        *(np.zeros(x) for x in (p, p, (p, 12), (p, 3), p, (p, 18), p, p, p, (p, 12), (p, 36))),
        *(np.zeros(x) for x in ((3, m, m), (2, 6 * m), (6 * m, 6 * m), (6 * m, 6 * m))),
    )


def _rated(tendon: Tendon) -> bool:
    return tendon.numbers[1] > 0.0 or any(one.friction > 0.0 for one in tendon.stations[1:-1])


def _signal(name: str, tendon: Tendon, places: Places) -> int:
    function = tendon.function
    if function is None or not tendon.pulled:
        return places.motion(name, function)
    return places.signal(name, lambda t: (function(t), 0.0, 0.0))


def _remembered(name: str, one: Station, places: Places) -> int:
    """Where the angle of wrap is kept; it begins where the first angle is within the turn meant."""
    if one.radius == 0.0:
        return -1
    return places.memory(name, np.array([np.pi * (1 + 2 * one.turns)]))


@inner
def route(s, W, tendons, k):
    """Set lengths, rates, angles and their gradients of tendon k."""
    first, last = tendons.first[k], tendons.first[k + 1] - 1
    for i in range(first, last):
        D, a, b = between(W, tendons, i), tendons.at[i], tendons.at[i + 1]
        axes = pulley_axis(W, tendons, i), pulley_axis(W, tendons, i + 1)
        length, force, ma, mb = piece(D, *axes, tendons.radius[i], tendons.radius[i + 1])
        rate = dot(force, sub(row(W.V, b, 0), row(W.V, a, 0)))
        tendons.rate[i] = rate + dot(ma, row(W.V, a, 3)) + dot(mb, row(W.V, b, 3))
        tendons.length[i] = length
        for p in range(3):
            tendons.pull[i, p] = D[p] / length
            tendons.gradient[i, p], tendons.gradient[i, 6 + p] = -force[p], force[p]
            tendons.gradient[i, 3 + p], tendons.gradient[i, 9 + p] = ma[p], mb[p]
    for i in range(first + 1, last):
        if tendons.radius[i] > 0.0:
            wrap_pulley(s, W, tendons, i)
        elif tendons.friction[i] > 0.0:
            tendons.wrap[i] = turning(*directions(tendons, i))[0]


@inner
def wrap_pulley(s, W, tendons, i):
    """Set the angle of wrap of station i, followed over whole turns, and add its arc."""
    m, R, n = tendons.at[i], tendons.radius[i], pulley_axis(W, tendons, i)
    e = turn(W.E, m, row(tendons.axes, i, 3))
    D_in, D_out = between(W, tendons, i - 1), between(W, tendons, i)
    R_in, R_out = tendons.radius[i - 1], tendons.radius[i + 1]
    s_in = -1.0 if dot(n, pulley_axis(W, tendons, i - 1)) < 0.0 else 1.0
    s_out = -1.0 if dot(n, pulley_axis(W, tendons, i + 1)) < 0.0 else 1.0
    into, out = s_in * R_in - R, R - s_out * R_out
    angle = bearing_angle(D_out, n, e, out) - bearing_angle(D_in, n, e, into)
    angle = followed_angle(s, W, tendons.remembered[i], angle)
    if angle < 0.0:  # it has left the pulley
        angle = math.nan
    g_in, g_out = departure(D_in, n, into)[1], departure(D_out, n, out)[1]
    spin = sub(cross(D_in, g_in), cross(D_out, g_out))
    tendons.wrap[i] = angle
    for p in range(3):
        tendons.wrap_gradient[i, p] = g_in[p]
        tendons.wrap_gradient[i, 6 + p] = -g_in[p] - g_out[p]
        tendons.wrap_gradient[i, 9 + p] = spin[p]
        tendons.wrap_gradient[i, 12 + p] = g_out[p]
    tendons.length[i - 1] += 0.5 * R * angle
    tendons.length[i] += 0.5 * R * angle


@residuals.of(Tendons)
def tendon_wrenches(s, W, tendons, _q, _v, _lam):
    """Add the tendons to the wrenches on the markers, and to the powers."""
    for k in range(tendons.law.shape[0]):
        route(s, W, tendons, k)
        share_tension(W, tendons, k)
        add_powers(W, tendons, k)
        for i in range(tendons.first[k], tendons.first[k + 1] - 1):
            a, b = tendons.at[i], tendons.at[i + 1]
            for p in range(6):
                W.wrench[a, p] -= tendons.tension[i] * tendons.gradient[i, p]
                W.wrench[b, p] -= tendons.tension[i] * tendons.gradient[i, 6 + p]


@tangents.of(Tendons)
def tendon_tangents(s, W, tendons, _lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S."""
    for k in range(tendons.law.shape[0]):
        tension_slopes(W, tendons, k)
        place_tangents(s, W, tendons, k, ck, cc)


@energy.of(Tendons)
def tendon_energy(s, W, tendons, _q, _v):
    """Energy stored in tendons."""
    total = 0.0
    for k in range(tendons.law.shape[0]):
        route(s, W, tendons, k)
        total += stored_energy(W, tendons, k)
    return total


def coupled(tendons: Tendons, body: Index) -> Iterable[Sequence[int]]:
    """The bodies of the places of each tendon."""
    return [
        sorted(set(body[tendons.at[a:b]].tolist())) for a, b in pairwise(tendons.first.tolist())
    ]


def ends(tendon: Tendon) -> tuple[Marker, ...]:
    """Its markers, each once."""
    return tuple(dict.fromkeys(one.marker for one in tendon.stations))


def tensions(tendons: Tendons) -> list[Array]:
    """(pieces,) of each tendon at the last residual; NaN where its path is lost."""
    return [tendons.tension[a : b - 1] for a, b in pairwise(tendons.first.tolist())]


FORCES = tendon_wrenches, tendon_tangents, tendon_energy
LOST = "the path of {} is lost: it has left a pulley, its places meet, or a winch took it all"
WHERE = {"ends": ends, "couples": coupled, "hooks": Hooks(answers=tensions, lost=LOST)}
TENDONS_FAMILY = Family(
    "tendons", Tendon, pack, *FORCES, **WHERE, by_rate=lambda tendons: tendons.rated.any()
)
