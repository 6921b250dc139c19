"""Which motions of which interfaces are held, what ``fixed=`` takes everywhere, and what is not."""

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from rom.arguments import finite, shortened
from rom.eigen.verbs import Operators, held_rows
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, Index, Interface
from rom.names import check_all_known, check_once

# names of interfaces held wholly or "name:directions"; or {name: directions}
Fixed = tuple[str, ...] | Mapping[str, str]
DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
DIRECTION_PATTERN = re.compile(r"r?[xyz]")
SIX_KINDS = ("rbe2", "rbe3")  # coordinates: three translations, three rotations
FULL_TURNING = "full:"  # and the number of nodes, behind whose displacements rotations come
BY_AXIS = ("full", "polynomial", "fourier")  # coordinates: x, y, z of each node or function
WHOLE_WORD = "wholly"
LOOSE_RTOL = 1e-10  # square of a motion of what is held, below which the motion is free
ROUND_OFF_TOL = 1e-6  # of the rotation in a motion
Supports = dict[str, tuple[str, ...]]  # {interface: directions held}; none: all its coordinates


def supports(fixed: Fixed, known: Iterable[str], owner: str = "the model") -> Supports:
    """What is held, read from the argument ``fixed``, of all interfaces known of their owner.

    Names of interfaces held wholly, or {name: directions}, e.g. {"root": "yz", "tip": "x rz"};
    "root:yz" among names says the same.
    """
    known = list(known)
    if isinstance(fixed, Mapping):
        pairs = [(str(name), str(words)) for name, words in fixed.items()]
    else:
        pairs = [_pair(name, known) for name in fixed]
    names = [name for name, _ in pairs]
    check_all_known(names, known, f"{owner} has no interface", InterfaceError)
    check_once(names, "fixed:")
    return {x: () if words is WHOLE_WORD else _directions(x, words) for x, words in pairs}


def _pair(word: str, known: list[str]) -> tuple[str, str]:
    """Interface and directions of one word; a name may have colons itself."""
    name, colon, directions = word.rpartition(":")
    return (name, directions) if colon and word not in known else (word, WHOLE_WORD)


def _directions(name: str, words: str) -> tuple[str, ...]:
    found = DIRECTION_PATTERN.findall(words)
    if not found or DIRECTION_PATTERN.sub("", words).strip(" ,") or len(set(found)) < len(found):
        text = f"fixed: {name!r} is held in {shortened(words)}; directions are some of"
        raise ConfigError(f'{text} {", ".join(DIRECTIONS)}, each once, as in {{"root": "yz"}}.')
    return tuple(found)


def held_coordinates(name: str, kind: str, n: int, directions: tuple[str, ...]) -> Index:
    """Positions, among the n coordinates of an interface of a kind, of those held by `supports`."""
    if not directions:
        return np.arange(n)
    if kind in SIX_KINDS:
        return np.array([DIRECTIONS.index(direction) for direction in directions])
    turns = [direction for direction in directions if direction not in "xyz"]
    n_displaced = 3 * int(kind.partition(":")[2]) if kind.startswith(FULL_TURNING) else n
    if (turns and n != 2 * n_displaced) or not kind.startswith(BY_AXIS):
        what = f"no rotation {turns[0]}" if turns else "coordinates without direction"
        text = f"interface {name!r} has the kind {kind!r} and {what} to hold"
        raise InterfaceError(f'{text}; give it the kind "rbe2" or "rbe3".')
    axis = np.array([DIRECTIONS.index(direction) for direction in directions])
    turning = 3 * (np.arange(n) >= n_displaced)
    return np.flatnonzero(np.isin(np.arange(n) % 3 + turning, axis))


def full_kind(interface: Interface) -> str:
    """The kind of an interface that keeps all its dofs."""
    return "full" if interface.rotations is None else f"{FULL_TURNING}{interface.nodes.size}"


Springs = Mapping[str, Any]  # {interface: (3,), (6,) or (6, 6) stiffness to the ground}


def spring_matrices(springs: Springs | None, known: Iterable[str], owner: str) -> dict[str, Array]:
    """{interface: (6, 6)} stiffness of springs to the ground, translations first [N/m, N m/rad].

    Each is (3,) translations, (6,) with rotations, or a symmetric (6, 6), at the origin of its
    interface, axes of the geometry.
    """
    supports(tuple(springs or ()), known, owner)
    found = {}
    for name, value in (springs or {}).items():
        k = finite(f"springs[{name!r}]", value, None)
        if k.shape not in ((3,), (6,), (6, 6)):
            raise ConfigError(f"springs[{name!r}] {k.shape} must be 3 or 6 numbers, or 6 x 6.")
        k = np.diag(np.pad(k, (0, 6 - k.size))) if k.ndim == 1 else k
        lam = np.linalg.eigvalsh(0.5 * (k + k.T))
        uneven = np.abs(k - k.T).max() > 1e-10 * np.abs(k).max()
        if uneven or lam[0] < -1e-10 * lam[-1] or not k.any():
            what = "be symmetric, and positive or zero" if k.any() else "not be zero"
            raise ConfigError(f"springs[{name!r}] must {what}.")
        found[name] = 0.5 * (k + k.T)
    return found


def held_dofs(interfaces: Mapping[str, Interface], fixed: Fixed) -> Index:
    """Ascending dofs of a model, node by node, that supports hold."""
    found = [np.zeros(0, dtype=np.int64)]
    for name, directions in supports(fixed, interfaces).items():
        one = interfaces[name]
        found.append(one.dofs[held_coordinates(name, full_kind(one), one.dofs.size, directions)])
    return np.unique(np.concatenate(found))


def refuse_loose(ops: Operators, held: Index) -> None:
    """Name the motion that stays free where some dofs are held, but not the body."""
    if not held.size or ops.rigid is None:
        return
    G, centred = ops.gram(ops.rigid, ops.rigid), np.eye(6)
    centred[:3, 3:] = -np.linalg.solve(G[:3, :3], G[:3, 3:])  # however far the origin is
    own = ops.rigid @ centred
    size, T = np.linalg.eigh(ops.gram(own, own))
    T = T / np.sqrt(size)  # orthonormal on all dofs
    R, T = np.where(held_rows(ops, held)[:, None], own @ T, 0.0), centred @ T
    squares, V = np.linalg.eigh(ops.gram(R, R))
    free = T @ V[:, squares < LOOSE_RTOL * squares[-1]]
    if free.shape[1]:
        text = f"supports leave {free.shape[1]} of six motions to the body as a whole; hold more"
        raise InterfaceError(f"{text}: it {_described(_simple(free, np.abs(T[3:]).max()))}.")


def _simple(free: Array, turn: float) -> Array:
    """(6,) of rigid motions (6, k), three translations first, one that turns least of a turn."""
    _, sizes, W = np.linalg.svd(free[3:])
    motion: Array = free @ W[-1]
    if free.shape[1] > 3 or sizes[-1] < ROUND_OFF_TOL * turn:
        motion[3:] = 0.0
    return motion


def _described(motion: Array) -> str:
    slide, turn = motion[:3], motion[3:]
    if not turn.any():
        return f"slides along ({_words(slide)})"
    point = np.cross(turn, slide) / (turn @ turn)
    through = ", ".join(f"{x:.4g}" for x in np.round(point, 9) + 0.0)
    return f"turns about ({_words(turn)}) through ({through}) m"


def _words(direction: Array) -> str:
    direction = direction / direction[np.argmax(np.abs(direction))]
    return ", ".join(f"{x:.3g}" for x in np.round(direction, 6) + 0.0)
