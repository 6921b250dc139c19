"""Motors, friction, stops, bushings, contacts and spread loads as flat arrays."""

from typing import Any

import numpy as np

from rom.mbs.kernels.system import Actions, Bushings, Contacts, Nonlinear, Spread
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.signals import Signal, load_signal
from rom.model import Array, Index


def integers(values: Any) -> Index:
    """Whole numbers as an array, empty ones too."""
    return np.array(list(values), dtype=np.int64)


def table(values: Any, *shape: int) -> Array:
    """Numbers as an array of rows of this shape, empty ones too."""
    return np.array(list(values), dtype=float).reshape(-1, *shape)


def actions(mechanism: Mechanism, coordinates: Any, rows_of: Any, clock: int) -> Actions:
    """Motors, friction and stops.

    Args:
        mechanism: with motors, friction and stops.
        coordinates: numbers joint coordinates.
        rows_of: joint -> first constraint row and number of rows.
        clock: signal that tells the time, -1 for none.
    """
    motors, frictions = mechanism.motors.values(), mechanism.frictions.values()
    stops = mechanism.stops.values()
    numbered = [
        integers(coordinates.number(mechanism.joints[x.joint].markers, x.row) for x in group)
        for group in (motors, frictions, [s for s in stops for _ in s.limits])
    ]
    loaded = [rows_of(f.joint) for f in frictions]
    laws = [
        (side, limit, s.law.stiffness, s.law.exponent, s.law.damping)
        for s in stops
        for side, limit in s.limits
    ]
    return Actions(
        numbered[0],
        integers(m.address for m in motors),
        integers([clock]),
        numbered[1],
        table((f.numbers for f in frictions), 6),
        integers(first for first, _ in loaded),
        integers(count for _, count in loaded),
        numbered[2],
        table(laws, 5),
    )


def bushings(mechanism: Mechanism, index: dict[Marker, int]) -> Bushings:
    """Bushings with the pieces of their curves."""
    found = list(mechanism.bushings.values())
    curve, pieces = np.full((len(found), 6), -1), np.zeros((len(found), 6))
    stack, n = [np.zeros((0, 7))], 0
    for k, bushing in enumerate(found):
        for p, piece in bushing.curves:
            curve[k, p], pieces[k, p] = n, len(piece)
            stack.append(piece)
            n += len(piece)
    return Bushings(
        integers(index[b.i] for b in found),
        integers(index[b.j] for b in found),
        *(table((b.frames[side] for b in found), 3, 3) for side in (0, 1)),
        table((b.zero for b in found), 3),
        table((b.stiffness for b in found), 6, 6),
        table((b.damping for b in found), 6, 6),
        curve.astype(np.int64),
        pieces.astype(np.int64),
        np.concatenate(stack),
    )


def contacts(mechanism: Mechanism, index: dict[Marker, int]) -> Contacts:
    """Contacts."""
    found = mechanism.contacts.values()
    laws = [c.law for c in found]
    numbers = [(x.stiffness, x.exponent, x.damping, x.mu, x.transition_speed) for x in laws]
    return Contacts(
        integers(c.kind for c in found),
        integers(index[c.i] for c in found),
        integers(index[c.j] for c in found),
        table((c.e for c in found), 3),
        table((c.s for c in found), 3),
        table((c.radius for c in found), 2),
        table(numbers, 5),
    )


def spread_loads(mechanism: Mechanism, first: int, R: int) -> tuple[Spread, list[Signal]]:
    """Spread loads and their functions of time, counted from the signal ``first``."""
    found = mechanism.spread_loads
    names = list(mechanism.parts)
    shapes, signals, at = np.zeros((len(found), R, 9)), list[Signal](), []
    for k, (name, load) in enumerate(found.items()):
        shapes[k, : len(load.shapes)] = load.shapes.reshape(-1, 9)
        at.append(first + len(signals) if load.function else -1)
        if load.function:
            signals.append(load_signal(name, _as_vector(load.function)))
    spread = Spread(
        integers(names.index(load.body) for load in found.values()),
        integers(load.world for load in found.values()),
        table((load.force for load in found.values()), 3),
        table((load.first.ravel() for load in found.values()), 9),
        shapes,
        np.array([load.amplitude for load in found.values()], dtype=float),
        integers(at),
    )
    return spread, signals


def nonlinear(mechanism: Mechanism) -> Nonlinear:
    """Elements of non-linear bodies."""
    number = {name: b for b, name in enumerate(mechanism.parts)}
    groups = [
        (group, np.array([number[part.name] for part in whole.parts])[group.frames])
        for whole in mechanism.nonlinear.values()
        for group in whole.body.elements
    ]
    e = sum(len(bodies) for _, bodies in groups)
    K = max((bodies.shape[1] for _, bodies in groups), default=1)
    c = max((group.numbers.shape[1] for group, _ in groups), default=1)
    body, numbers = np.full((e, K), -1, dtype=np.int64), np.zeros((e, c))
    address, count, at = integers([0] * e), integers([0] * e), 0
    for group, bodies in groups:
        mine = slice(at, at + len(bodies))
        address[mine], count[mine] = group.address, bodies.shape[1]
        body[mine, : bodies.shape[1]] = bodies
        numbers[mine, : group.numbers.shape[1]] = group.numbers
        at += len(bodies)
    return Nonlinear(address, count, body, numbers)


def _as_vector(function: Any) -> Any:
    """The function of time as the first of three components."""
    return lambda t: (function(t), 0.0, 0.0)
