"""Forces and torques on markers: constant, or functions of time."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from rom.arguments import finite
from rom.mbs.elements.family import Family, Places, apart, from_outside, integers, never, rows_of
from rom.mbs.kernels.algebra import add, cross, dot, place, put, row, scale, turn, unit
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness
from rom.mbs.kernels.element_calls import residuals, tangents
from rom.mbs.kernels.tables import Array2, Index1, Table, table
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.whole import Whole
from rom.model import Array

Axes = Literal["world", "body"]
# kinds of loads
FORCE_WORLD, FORCE_BODY, TORQUE_WORLD, TORQUE_BODY = 0, 1, 2, 3


@dataclass(frozen=True, slots=True)
class Load:
    """Force or torque on one marker: constant, or a function of time."""

    marker: Marker
    kind: int
    vector: Array
    function: Callable[[float], Any] | None


def force(self: Whole, name: str, marker: Marker, vector: Any, *, frame: Axes = "world") -> None:
    """Force at a marker: (3,) [N], or a function of time; axes of the world or the marker.

    Raises:
        ConfigError: for a name in use, an unknown marker or frame, or a wrong vector.
    """
    _load(self, name, marker, vector, frame, FORCE_WORLD)


def torque(self: Whole, name: str, marker: Marker, vector: Any, *, frame: Axes = "world") -> None:
    """Torque at a marker: (3,) [N m], or a function of time; axes of world or marker.

    Raises:
        ConfigError: for a name in use, an unknown marker or frame, or a wrong vector.
    """
    _load(self, name, marker, vector, frame, TORQUE_WORLD)


def _load(self: Whole, name: str, marker: Marker, vector: Any, frame: str, kind: int) -> None:
    function = vector if callable(vector) else None
    constant = np.zeros(3) if function else finite(f"vector of {name}", vector, (3,))
    self.add(name, Load(marker, kind + (frame == "body"), constant, function), LOADS_FAMILY)


@table
class Loads(Table):
    """All loads.

    Attributes:
        at: (l,) markers.
        kind: (l,) FORCE_WORLD to TORQUE_BODY.
        vector: (l, 3).
        signal: (l,) function of time added to the vector, -1 for none.
    """

    at: Index1
    kind: Index1
    vector: Array2
    signal: Index1


def pack(loads: Any, places: Places) -> Loads:
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
    "loads", Load, pack, load_wrenches, load_tangents, ends=lambda load: (load.marker,),
    outside=from_outside, couples=apart, by_rate=never,
)  # fmt: skip
