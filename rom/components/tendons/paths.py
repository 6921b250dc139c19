"""The path of a cable at one instant, for its design and for pictures."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rom.errors import ConfigError
from rom.model import Array

PARALLEL_COSINE = 0.9  # between the axes of neighbouring pulleys: 26 degrees
ARC_POINTS = 25  # of a pulley in pictures


class Place(NamedTuple):
    """A place in the world."""

    x: Array  # (3,) centre [m]
    axes: Array  # (2, 3) axis of a pulley and a direction across it
    radius: float  # [m], 0 for an eyelet


@dataclass(frozen=True)
class Path:
    """Straight pieces and arcs."""

    straight: Array  # (m - 1,) lengths of pieces [m]
    arrival: Array  # (m,) angle of the place at which it first touches a pulley [rad]
    departure: Array  # (m,) and last [rad]
    wrap: Array  # (m,) angles between them, below one turn [rad]


def path_through(name: str, places: Sequence[Place]) -> Path:
    """Where a cable runs, see `rom.components.tendons.routing`; the name is for errors."""
    straight, touched = np.zeros(len(places) - 1), np.zeros((len(places), 2))
    for k, (a, b) in enumerate(pairwise(places)):
        D, s = b.x - a.x, _sense(name, a, b)
        shift = a.radius - s * b.radius
        _check_apart(name, k, (a, b), shift)
        straight[k] = np.sqrt(D @ D - shift**2)
        touched[k, 1] = _touched(D, a, shift)
        touched[k + 1, 0] = _touched(D, b, s * a.radius - b.radius)
    arrival, departure = touched.T
    return Path(straight, arrival, departure, np.mod(departure - arrival, 2 * np.pi))


def points_along(path: Path, places: Sequence[Place]) -> Array:
    """(n, 3) of its line, as many for the same pulleys [m]."""
    points = []
    for k, one in enumerate(places):
        if not one.radius:
            points.append(one.x[None])
            continue
        n, e = one.axes
        angle = path.arrival[k] + np.linspace(0.0, path.wrap[k], ARC_POINTS)[:, None]
        points.append(one.x + one.radius * (np.cos(angle) * e + np.sin(angle) * np.cross(n, e)))
    return np.concatenate(points)


def _touched(D: Array, one: Place, shift: float) -> float:
    """Angle at which a piece touches a pulley, from the direction across its axis [rad]."""
    if not one.radius:
        return 0.0
    n, e = one.axes
    flat = D - (D @ n) * n
    return float(np.arctan2(np.cross(n, e) @ D, e @ D) - np.arccos(shift / np.linalg.norm(flat)))


def _sense(name: str, a: Place, b: Place) -> float:
    """1 if neighbours turn in the same sense, -1 in the opposite one."""
    if not (a.radius and b.radius):
        return 1.0
    cosine = float(a.axes[0] @ b.axes[0])
    if abs(cosine) < PARALLEL_COSINE:
        apart = np.degrees(np.arccos(cosine))
        text = f"axes of neighbouring pulleys of tendon {name!r} are {apart:.3g} degrees apart"
        raise ConfigError(f"{text}; they must be nearly parallel, or have an eyelet between them.")
    return float(np.sign(cosine))


def _check_apart(name: str, k: int, ends: tuple[Place, Place], shift: float) -> None:
    """Refuse neighbours between which no cable can be straight."""
    D = ends[1].x - ends[0].x
    if np.linalg.norm(D) <= 1e-12:
        raise ConfigError(f"places {k + 1} and {k + 2} of {name!r} are at one point.")
    for one in ends:
        n = one.axes[0]
        if one.radius and np.linalg.norm(D - (D @ n) * n) <= abs(shift):
            text = f"between places {k + 1} and {k + 2} of tendon {name!r} there is no room"
            raise ConfigError(f"{text}: pulleys overlap. Take a smaller radius.")
