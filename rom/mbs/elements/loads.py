"""Forces and torques on markers, loads spread over bodies: constant, or functions of time."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, number
from rom.errors import ConfigError
from rom.mbs.elements.family import OUTSIDE, Family, Hold, Places, integers, on_joint, rows_of
from rom.mbs.elements.law_calls import MarkerMotion
from rom.mbs.kernels.algebra import (
    add,
    cross,
    dot,
    dual,
    mtv,
    mv,
    place,
    place_row,
    put,
    row,
    scale,
    trace,
    turn,
    unit,
    vec,
)
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness
from rom.mbs.kernels.element_calls import residuals, tangents
from rom.mbs.kernels.markers import own_block
from rom.mbs.kernels.tables import Array1, Array2, Array3, Index1, Scratch2, Table, table
from rom.mbs.parts.bodies import Marker, Part
from rom.mbs.parts.foreign import Function
from rom.mbs.parts.joints import Whole
from rom.mbs.parts.signals import TimeFunction
from rom.model import Array
from rom.rotation import skew

Axes = Literal["world", "body"]
Given = npt.ArrayLike | TimeFunction  # constant or not
FORCE_WORLD, FORCE_BODY, TORQUE_WORLD, TORQUE_BODY = range(4)  # kinds of loads


@dataclass(frozen=True, slots=True)
class Load:
    """Force or torque on one marker: constant, or a function of time."""

    marker: Marker
    kind: int
    vector: Array
    function: TimeFunction | None


def force(
    self: Whole,
    name: str,
    marker: Marker,
    vector: Any,
    *,
    frame: Axes = "world",
    every: Hold = None,
) -> None:
    """Force at a marker: (3,) [N], or a function of time; axes of the world or the marker.

    With ``every`` a `user_force` samples the function, and holds the force in the world.
    """
    _load(self, name, marker, vector, (FORCE_WORLD + (frame == "body"), every))


def torque(
    self: Whole,
    name: str,
    marker: Marker,
    vector: Any,
    *,
    frame: Axes = "world",
    every: Hold = None,
) -> None:
    """Torque at a marker: (3,) [N m], or a function of time; all as of `force`."""
    _load(self, name, marker, vector, (TORQUE_WORLD + (frame == "body"), every))


def _load(self: Whole, name: str, marker: Marker, vector: Given, how: tuple[int, Hold]) -> None:
    function, (kind, every) = vector if callable(vector) else None, how
    if function and every:
        self.user_force(name, at_marker(function, kind), marker, every=every)
        return
    constant = np.zeros(3) if function else finite(f"vector of {name}", vector, (3,))
    self.add(name, Load(marker, kind, constant, function), LOADS_FAMILY)


def at_marker(function: TimeFunction, kind: int) -> Function:
    """A load over time as the function of a `user_force`."""

    def answer(t: float, at: MarkerMotion) -> Array:
        wrench, x = np.zeros((2, 3)), np.asarray(function(t), dtype=float)
        part = 0 if kind in (FORCE_WORLD, FORCE_BODY) else 1
        wrench[part] = at.axes @ x if kind in (FORCE_BODY, TORQUE_BODY) else x
        return wrench

    return answer


@table
class Loads(Table):
    """All loads."""

    at: Index1  # (l,) markers
    kind: Index1  # (l,) FORCE_WORLD to TORQUE_BODY
    vector: Array2  # (l, 3)
    signal: Index1  # (l,) function of time added to the vector, -1 for none


def pack(loads: Mapping[str, Load], places: Places) -> Loads:
    """The loads as arrays."""
    return Loads(
        integers(places.marker[load.marker] for load in loads.values()),
        integers(load.kind for load in loads.values()),
        rows_of((load.vector for load in loads.values()), 3),
        integers(places.signal(name, load.function) for name, load in loads.items()),
    )


@inner
def load_vector(loads, k, W):
    """Load k in the world, its function of time included."""
    x = row(loads.vector, k, 0)
    if loads.signal[k] >= 0:
        x = add(x, row(W.signal, loads.signal[k], 0))
    x = scale(W.load[0], x)
    return turn(W.E, loads.at[k], x) if loads.kind[k] in (FORCE_BODY, TORQUE_BODY) else x


@residuals.of(Loads)
def load_wrenches(_s, W, loads, _q, _v, _lam):
    """Add the loads to the wrenches on the markers; add up their power."""
    for k in range(loads.at.size):
        at = 0 if loads.kind[k] in (FORCE_WORLD, FORCE_BODY) else 3
        x, m = load_vector(loads, k, W), loads.at[k]
        put(W.wrench[m], at, x)
        W.power[1] += dot(x, row(W.V, m, at))


@tangents.of(Loads)
def load_tangents(s, W, loads, _lam, ck, _cc):
    """Add ck times the stiffness of the loads that turn with their body to W.Kt."""
    for k in range(loads.at.size):
        kind, m = loads.kind[k], loads.at[k]
        if kind in (FORCE_BODY, TORQUE_BODY):
            at = 0 if kind == FORCE_BODY else 3
            x = load_vector(loads, k, W)
            W.Q[:] = 0.0
            for p in range(3):
                place(W.Q, at, 3 + p, ck, cross(x, unit(p)))
            pair_stiffness(s, W, m, m, W.Kt)


LOADS_FAMILY = Family(
    "loads", Load, pack, load_wrenches, load_tangents, ends=lambda load: (load.marker,), **OUTSIDE
)


@dataclass(frozen=True, slots=True)
class Spread:
    """A load on all points of a body; arrays as in `rom.body.spread.SpreadLoad`."""

    body: str
    force: Array
    first: Array
    shapes: Array
    amplitude: float
    function: TimeFunction | None
    world: int


def spread_load(
    self: Whole,
    name: str,
    part: Part,
    load: Any,
    amplitude: Any = 1.0,
    *,
    frame: Literal["body", "world"] = "body",
) -> None:
    """Load on all points of a flexible body: pressure, traction, force per mass.

    In the frame "body" the forces turn with its mean axes, as a pressure does, at large deflection
    with its frame; in the "world" they keep their direction, given in the axes of the world.
    Either way they act on the points as they deform, which changes moments; the area they were
    reduced for stays the undeformed one.

    Args:
        part: what `add_flexible` returned.
        load: from `rom.surface_load` or `rom.mass_load` of the same reduced body.
        amplitude: a number, or a function of time.
        frame: "body" or "world".

    Raises:
        ConfigError: for a load of another body.
    """
    part = self.part(str(getattr(part, "name", part)))
    shapes = getattr(load, "shapes", None)
    if shapes is None or shapes.shape != (part.r, 3, 3) or part.flexible is None:
        text = f"load {name!r} is not one of body {part.name!r} with {part.r} coordinates"
        raise ConfigError(f"{text}; make it with rom.surface_load or rom.mass_load from that body.")
    function = amplitude if callable(amplitude) else None
    constant = 0.0 if function else number("amplitude", amplitude)
    arrays = (load.force, load.first, shapes + _by_the_frame(part, load))
    spread = Spread(part.name, *arrays, constant, function, int(frame == "world"))
    self.add(name, spread, SPREAD_LOADS_FAMILY)


def _by_the_frame(part: Part, load: Any) -> Array:
    """(r, 3, 3) what the sums of shapes and forces gain from the frame that is integrated."""
    if part.own_frame is None:
        return np.zeros((part.r, 3, 3))
    moves = zip(*(shape.T for shape in part.shapes(part.own_frame)), strict=True)
    return np.array([np.outer(t, load.force) + skew(w) @ load.first for t, w in moves])


@table
class SpreadLoads(Table):
    """All spread loads."""

    body: Index1  # (l,)
    world: Index1  # (l,) 1 if the forces keep their direction in the world, else 0
    force: Array2  # (l, 3) sum of the forces f [N]
    first: Array2  # (l, 9) entry 3 a + b: sum of X_a f_b [N m]
    shapes: Array3  # (l, R, 9) entry 3 a + b: sum of phi_k,a f_b
    amplitude: Array1  # (l,) factor
    signal: Index1  # (l,) function of time added to it, -1 for none
    arm: Scratch2  # (l, 9) sum of positions and forces at the last residual, body frame


def pack_spread(loads: Mapping[str, Spread], places: Places) -> SpreadLoads:
    """The spread loads as arrays."""
    found = loads.values()
    shapes = np.zeros((len(found), places.R, 9))
    for k, load in enumerate(found):
        shapes[k, : len(load.shapes)] = load.shapes.reshape(-1, 9)
    return SpreadLoads(
        integers(places.body[load.body] for load in found),
        integers(load.world for load in found),
        rows_of((load.force for load in found), 3),
        rows_of((load.first.ravel() for load in found), 9),
        shapes,
        np.array([load.amplitude for load in found], dtype=float),
        integers(places.signal(name, _first_of(load.function)) for name, load in loads.items()),
        np.zeros((len(found), 9)),
    )


def _first_of(function: TimeFunction | None) -> TimeFunction | None:
    """A vector with a number over time as its first component."""
    return function and (lambda t: (function(t), 0.0, 0.0))


@inner
def amplitude(loads, k, W):
    """Factor of load k, its signal included."""
    a = loads.amplitude[k]
    if loads.signal[k] >= 0:
        a += W.signal[loads.signal[k], 0]
    return W.load[0] * a


@inner
def seen(x, A, world):
    """A sum [a, b] of lengths and forces, nine entries, with the forces in the axes of the body."""
    if world == 0:
        return x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8]
    a = mtv(A, (x[0], x[1], x[2]))
    b = mtv(A, (x[3], x[4], x[5]))
    c = mtv(A, (x[6], x[7], x[8]))
    return a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]


@inner
def spread_arm(s, W, loads, k, q):
    """Sum [a, b] of positions and forces of load k, of the deformed body, axes of the body."""
    body, world = loads.body[k], loads.world[k]
    A, at, N = W.A[body], s.bodies.q_at[body] + 7, seen(loads.first[k], W.A[body], world)
    for j in range(s.bodies.r[body]):
        x, f = seen(loads.shapes[k, j], A, world), q[at + j]
        a, b, c = N[0] + f * x[0], N[1] + f * x[1], N[2] + f * x[2]
        d, e, g = N[3] + f * x[3], N[4] + f * x[4], N[5] + f * x[5]
        N = a, b, c, d, e, g, N[6] + f * x[6], N[7] + f * x[7], N[8] + f * x[8]
    return N


@residuals.of(SpreadLoads)
def spread_residuals(s, W, loads, q, v, _lam):
    """Subtract all spread loads from W.residual, and add their power to W.power[1]."""
    for k in range(loads.body.size):
        b, world, a = loads.body[k], loads.world[k], amplitude(loads, k, W)
        t, A = s.bodies.v_at[b], W.A[b]
        given = vec(loads.force[k], 0)
        force = scale(a, given if world == 1 else mv(A, given))
        N = spread_arm(s, W, loads, k, q)
        for p in range(9):
            loads.arm[k, p] = N[p]
        moment = scale(a, dual(N, 0))
        put(W.residual, t, scale(-1.0, force))
        put(W.residual, t + 3, scale(-1.0, moment))
        W.power[1] += dot(force, vec(v, t)) + dot(moment, vec(v, t + 3))
        for j in range(s.bodies.r[b]):
            modal_force = a * trace(seen(loads.shapes[k, j], A, world), 0)
            W.residual[t + 6 + j] -= modal_force
            W.power[1] += modal_force * v[t + 6 + j]


@tangents.of(SpreadLoads)
def spread_tangents(s, W, loads, _lam, ck, _cc):
    """Add ck times the derivative by the coordinates to W.Kt; `spread_residuals` first."""
    for k in range(loads.body.size):
        b, world = loads.body[k], loads.world[k]
        A, r, block = W.A[b], s.bodies.r[b], own_block(s, b, W.Kt)
        ca = -ck * amplitude(loads, k, W)
        for p in range(3):
            e = unit(p)
            if world == 0:
                place(block, 0, 3 + p, ca, mv(A, cross(e, vec(loads.force[k], 0))))
            else:
                turned = add(vec(loads.arm[k], 3 * p), scale(-trace(loads.arm[k], 0), e))
                place(block, 3, 3 + p, ca, turned)
        for j in range(r):
            x = seen(loads.shapes[k, j], A, world)
            place(block, 3, 6 + j, ca, dual(x, 0))
            if world == 1:
                place_row(block, 6 + j, 3, ca, dual(x, 0))


KERNELS = spread_residuals, spread_tangents
SPREAD_LOADS_FAMILY = Family(
    "spread_loads", Spread, pack_spread, *KERNELS, ends=on_joint, **OUTSIDE
)
