"""Stones drawn as plane surfaces, in gmsh for instance: outlines, joints and what is wrong."""

import re
from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
import numpy.typing as npt

from rom.arguments import finite, typed
from rom.components.masonry.actions import is_inside
from rom.components.masonry.limits import Rock
from rom.components.masonry.stones import Masonry, touching
from rom.errors import ConfigError, ModelError
from rom.model import Array, Index

STRAIGHT_RTOL = 1e-6  # sine of the turn below which a node is no corner: round-off of meshes
SHARED_HINT = "Draw joints once, as lines that both stones share."
OVERLAP_RTOL = 1e-6  # of the size of all stones: deeper corners were drawn wrong


@typed
def drawn(
    points: npt.ArrayLike,
    triangles: npt.ArrayLike,
    surfaces: Mapping[str, npt.ArrayLike],
    *,
    held: Sequence[str],
    rock: Rock | None = None,
) -> Masonry:
    """Masonry of which each plane surface is a stone, in the order of the surfaces.

    Outlines follow the mesh: curved sides become chords as long as its triangles, nodes on straight
    sides are no corners. Joints are where stones touch; gravity acts along -y.
    `rom.fe.mesh.read_triangles` reads points, triangles and surfaces from gmsh geometries.

    Args:
        points: (n, 2) coordinates [m].
        triangles: (t, 3) corners, counter-clockwise, numbers of points [1].
        surfaces: {name: (k,)} numbers of the triangles of each stone [1].
        held: names of those that do not move; "ground" also means "ground 1", "ground 2".
        rock: material and joints; the default is hard stone.

    Raises:
        ConfigError: if a held stone does not exist, or all are held.
        ModelError: if a surface is no stone, stones overlap, or one touches no other, by its name;
            if numbers of nodes or triangles do not exist.
    """
    x = finite("points", points, (None, 2), error=ModelError)
    T = _numbers_below("triangles", triangles, (None, 3), len(x))
    each = surfaces.items()
    rows = {name: _numbers_below(f"stone {name!r}", k, None, len(T)).ravel() for name, k in each}
    rock, names = rock or Rock(), list(rows)
    outlines = [x[_outline(name, x, T[chosen])] for name, chosen in rows.items()]
    fixed = {k for name in held for k in _numbers(name, names)}
    if len(fixed) == len(names):
        text = f"all stones are held: {', '.join(names) or 'there is none'}"
        raise ConfigError(f"{text}; leave one free to move, or draw it.")
    masonry = rock.masonry([rock.stone(o) for o in outlines], tuple(sorted(fixed)))
    _check_apart(names, outlines, x[T].mean(axis=1), list(rows.values()))
    _check_joints(names, masonry)
    return masonry


def _numbers_below(
    what: str, given: npt.ArrayLike, shape: tuple[None, int] | None, count: int
) -> Index:
    """Whole numbers that count from 0."""
    found = finite(what, given, shape, error=ModelError)
    if (wrong := (found % 1 != 0) | (found < 0) | (found >= count)).any():
        needed = f"must be a whole number, 0 to {count - 1}"
        raise ModelError(f"{what}: {found[wrong][0]:g} {needed}.")
    return found.astype(np.int64)


def _numbers(name: str, names: list[str]) -> list[int]:
    meant = re.compile(rf"{re.escape(name)}( \d+)?")
    found = [k for k, one in enumerate(names) if meant.fullmatch(one)]
    if not found:
        raise ConfigError(f"held is {name!r}, which is no stone; use one of {names}.")
    return found


def _outline(name: str, x: Array, T: Index) -> Index:
    """(k,) corners around triangles, counter-clockwise."""
    sides = {(int(a), int(b)) for t in T for a, b in zip(t, np.roll(t, -1), strict=True)}
    after = dict(side for side in sides if side[::-1] not in sides)
    outer = sum(side[::-1] not in sides for side in sides)
    loop = [next(iter(after), -1)]
    while len(loop) <= len(after) and after.get(loop[-1], loop[0]) != loop[0]:
        loop.append(after[loop[-1]])
    if not outer or len(loop) != outer:
        text = f"stone {name!r} of {len(T)} triangles is not one piece without holes"
        hint = "Draw one plane surface a stone, and cut those with holes in two."
        raise ModelError(f"{text}: around it are {len(loop)} of {outer} sides.", hint=hint)
    nodes = np.array(loop)
    u = x[nodes] - x[np.roll(nodes, 1)]
    v = np.roll(u, -1, axis=0)
    turn = (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / np.hypot(*u.T) / np.hypot(*v.T)
    return nodes[np.abs(turn) > STRAIGHT_RTOL]


def _check_apart(
    names: list[str], outlines: list[Array], centres: Array, rows: Sequence[Index]
) -> None:
    """Refuse stones of which triangles lie in others; ``centres`` (t, 2) of all triangles."""
    for (one, outline), (other, mine) in product(enumerate(outlines), enumerate(rows)):
        x, low, high = centres[mine], outline.min(axis=0), outline.max(axis=0)
        x = x[((x > low) & (x < high)).all(axis=1)]
        if one != other and any(is_inside(outline, point) for point in x):
            text = f"stones {names[one]!r} and {names[other]!r} overlap."
            raise ModelError(text, hint=SHARED_HINT)


def _check_joints(names: list[str], masonry: Masonry) -> None:
    """Refuse corners below edges of other stones, and free stones that touch nothing."""
    C = touching(masonry)
    size = np.ptp(np.vstack([s.outline for s in masonry.stones]), axis=0).max()
    if len(C.gap) and C.gap.min() < -OVERLAP_RTOL * size:
        k = int(np.argmin(C.gap))
        one, other = (names[C.who[k, side]] for side in (0, 2))
        text = f"stones {one!r} and {other!r} overlap by {-C.gap[k]:.3g} m."
        raise ModelError(text, hint=SHARED_HINT)
    close = np.abs(C.gap) < OVERLAP_RTOL * size
    joined = {*C.who[close][:, [0, 2]].ravel().tolist(), *masonry.held}
    for k, name in enumerate(names):
        if k not in joined:
            gap = C.gap[(C.who[:, [0, 2]] == k).any(axis=1)].min(initial=np.inf)
            near = f"the nearest is {gap:.3g} m away" if np.isfinite(gap) else "none is near"
            raise ModelError(f"stone {name!r} touches no other; {near}.", hint=SHARED_HINT)
