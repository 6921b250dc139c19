"""Laws of joints: friction, cohesion and tensile strength, by joint and from files.

A joint with strength is glued where stones touch at the start. It opens when a contact pulls more
than its share of the tensile strength, and slips when it is sheared more than Coulomb's law allows;
then its cohesion and its tensile strength are lost for good, and friction remains.

Source:
    After Shi, Discontinuous deformation analysis (1988): Coulomb's law with a limit of tension.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from rom.arguments import NotNegative, plain, typed
from rom.components.masonry.block_contact import Bonds, Contacts
from rom.errors import ConfigError, FileFormatError, RomError
from rom.model import Array, Index

# of the distance at which corners are watched: stones nearer than that are glued
BOND_GAP_RATIO = 0.02
Strength = Annotated[float, NotNegative("Pa")]
LAW_KEYS = {"between", "friction", "cohesion", "tension"}


@typed
@dataclass(frozen=True, slots=True)
class Joint:
    """Law of joints.

    Attributes:
        friction: tangent of the angle of friction [1].
        cohesion: shear stress borne without pressure, until it slips [Pa].
        tension: tensile strength, until it opens [Pa].
        between: pairs of stones; None for all joints.
    """

    friction: Annotated[float, NotNegative()]
    cohesion: Strength = 0.0
    tension: Strength = 0.0
    between: tuple[tuple[int, int], ...] | None = None


def read_joints(path: str | Path) -> tuple[Joint, ...]:
    """Laws of joints from a file in TOML; later ones win where both apply.

    A file is a list of laws, with numbers in SI units or text with a unit::

        [[joint]]                      # all joints
        friction = 0.6
        [[joint]]
        between = [[1, 2], [2, 3]]     # numbers of stones
        friction = 0.7
        cohesion = "0.2 MPa"
        tension = "0.1 MPa"

    Raises:
        FileFormatError: if the file is no such list; it names the law and the key.
        ConfigError: for numbers below zero.
    """
    try:
        listed = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise FileFormatError(f"{path} is no file of joints: {error}") from error
    laws = listed.get("joint")
    if set(listed) != {"joint"} or not isinstance(laws, list) or not laws:
        text = f"{path} has {sorted(listed)}"
        raise FileFormatError(f"{text}; laws of joints are tables [[joint]] and nothing else.")
    return tuple(_law(f"{path}, joint {k + 1}", law) for k, law in enumerate(laws))


def _law(where: str, law: object) -> Joint:
    if not isinstance(law, Mapping) or not {"friction"} <= set(law) <= LAW_KEYS:
        keys = sorted(law) if isinstance(law, Mapping) else law
        needed = "It needs friction, and may have between, cohesion and tension."
        raise FileFormatError(f"{where} has {keys}.", hint=needed)
    units = {"friction": "1", "cohesion": "Pa", "tension": "Pa"}
    try:
        numbers = {key: _number(law[key], unit) for key, unit in units.items() if key in law}
        between = law.get("between")
        pairs = None if between is None else tuple((_count(i), _count(j)) for i, j in between)
    except (TypeError, ValueError, RomError) as error:
        raise FileFormatError(f"{where}: {error}") from error
    try:
        return Joint(**numbers, between=pairs)
    except RomError as error:
        raise ConfigError(error.message, where=where, hint=error.hint) from error


def _number(value: object, unit: str) -> float:
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise TypeError(f"{value!r} is no number.")
    return float(plain("", value, unit))


def _count(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError(f"between = ...{value!r}: stones go by their numbers.")
    return value


def friction_of_pairs(joints: Sequence[Joint], friction: float, n: int) -> Array:
    """(n, n) coefficients of friction of pairs of stones."""
    found = np.full((n, n), float(friction))
    for joint in joints:
        found[_pairs(joint, n)] = joint.friction
    return found


def bonds(joints: Sequence[Joint], C: Contacts, corners: Array, n: int, reach: float) -> Bonds:
    """What glues n stones that touch: strengths times the length that falls to each contact.

    The last law that fits a pair counts; corners (V, 2) are places that watch within reach [m].
    """
    strength = np.zeros((n, n, 2))
    for joint in joints:
        strength[_pairs(joint, n)] = joint.tension, joint.cohesion
    pairs = np.sort(C.who[:, [0, 2]], axis=1)
    close = np.abs(C.gap) < BOND_GAP_RATIO * reach
    length = np.zeros(len(pairs))
    for pair in np.unique(pairs[close], axis=0):
        at = np.flatnonzero(close & (pairs == pair).all(axis=1))
        length[at] = _shares(corners[C.who[at, 1]])
    _check_touch(joints, pairs[length > 0])
    pull, cohesion = length * strength[C.who[:, 0], C.who[:, 2]].T
    kept = (pull > 0) | (cohesion > 0)
    return Bonds(C.who[kept], pull[kept], cohesion[kept], np.ones(int(kept.sum()), dtype=np.int64))


def _shares(x: Array) -> Array:
    """Length of a joint that falls to each of its contacts; those in one place share it."""
    line = x - x[0]
    along = line @ line[np.argmax(np.linalg.norm(line, axis=1))]
    span = np.linalg.norm(line, axis=1).max()
    if span == 0.0:
        return np.zeros(len(x))
    s = along / span
    places, which, count = np.unique(np.round(s / span, 6), return_inverse=True, return_counts=True)
    ends = np.r_[places[0], (places[1:] + places[:-1]) / 2, places[-1]]
    return np.asarray(span * (np.diff(ends) / count)[which])


def _pairs(joint: Joint, n: int) -> tuple[Index | slice, Index | slice]:
    """Where the pairs of a joint stand in a table (n, n) of stones, in both orders."""
    if joint.between is None:
        return slice(None), slice(None)
    rows = np.array(joint.between, dtype=np.int64).reshape(-1, 2)
    if rows.size and not (0 <= rows.min() and rows.max() < n and (rows[:, 0] != rows[:, 1]).all()):
        raise ConfigError(f"a joint is between {joint.between}; use stones from 0 to {n - 1}.")
    return np.append(rows[:, 0], rows[:, 1]), np.append(rows[:, 1], rows[:, 0])


def _check_touch(joints: Sequence[Joint], touching: Index) -> None:
    there = {tuple(pair) for pair in touching.tolist()}
    for joint in joints:
        for pair in (joint.between if joint.cohesion or joint.tension else None) or ():
            if tuple(sorted(pair)) not in there:
                text = f"stones {pair[0]} and {pair[1]} do not touch along an edge at the start"
                raise ConfigError(f"{text}; name pairs that touch, or lay them closer.")
