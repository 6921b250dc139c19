"""What acts on masonry besides its weight: live loads, wind, supports that move, earthquakes.

Forces are those in the middle of a step, at points that move with their stones. Held stones are
moved to where they are at its end. Motion of the ground acts as inertia in the frame of the ground.

Source:
    Point loads and moved supports after Shi, Discontinuous deformation analysis (1988).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import Delaunay

from rom.arguments import typed, whole
from rom.components.histories import History, ramp, values_at
from rom.components.masonry.discontinuous_deformation import Drive
from rom.components.masonry.stones import Masonry, touching
from rom.errors import ConfigError
from rom.model import Array, Index
from rom.names import check_once

ON_EDGE_RTOL = 1e-6  # of the size of a stone: how far from its edge a point is still on it


class Forces(NamedTuple):
    """L forces at n times; as in `Drive`."""

    block: Index
    corner: Index
    share: Array
    force: Array
    turns: Index


ForceHistory = Callable[[Array], Forces]


@typed
@dataclass(frozen=True)
class PointLoad:
    """A force of fixed direction at a point of a stone.

    Attributes:
        stone: number of the stone.
        at: (2,) point in or on it, where it lies at the start [m].
        force: (2,) [N].
        history: factor of the force.
    """

    stone: int
    at: tuple[float, float]
    force: tuple[float, float]
    history: History = 1.0
    name: str = "point load"

    def begin(self, masonry: Masonry) -> ForceHistory:
        """Forces (n, 1) at times (n,).

        Raises:
            ConfigError: if there is no such stone, or the point lies outside of it.
        """
        block = _moving(self.name, self.stone, masonry)
        corner, share = _place(self.name, masonry, block, np.array(self.at))

        def at(t: Array) -> Forces:
            factor = values_at(self.name, self.history, t)[:, None, None]
            return _forces([block], corner, share, factor * np.array(self.force))

        return at


@typed
@dataclass(frozen=True)
class MovingLoad:
    """A force that rolls over the tops of the stones, on the highest one at its x.

    Attributes:
        force: (2,) [N].
        speed: along x [m/s].
        start: x at t = 0 [m].
    """

    force: tuple[float, float]
    speed: float
    start: float
    name: str = "moving load"

    def begin(self, masonry: Masonry) -> ForceHistory:
        """Forces (n, 1) at times (n,); before and behind the stones there is none.

        Raises:
            ConfigError: if it never reaches a stone.
        """
        first = masonry.first_corners()
        top, who = _tops(masonry)
        low, high = top[:, 0, 0].min(), top[:, 1, 0].max()
        if (self.speed >= 0 and self.start > high) or (self.speed <= 0 and self.start < low):
            text = f"{self.name} starts at x = {self.start} m and never comes upon the stones"
            raise ConfigError(f"{text}; give from x = {low:.6g} m to {high:.6g} m.")

        def at(t: Array) -> Forces:
            x, rows = (self.start + self.speed * t)[:, None], np.arange(len(t))
            w = (x - top[:, 0, 0]) / (top[:, 1, 0] - top[:, 0, 0])
            y = top[:, 0, 1] + w * (top[:, 1, 1] - top[:, 0, 1])
            y[(w < 0) | (w > 1)] = -np.inf
            k = np.argmax(y, axis=1)
            here = w[rows, k]
            share = np.stack([1 - here, here, 0 * here], axis=1)
            block = np.where(np.isfinite(y[rows, k]), who[k, 0], -1)
            corner = first[who[k, 0]][:, None] + who[k][:, [1, 2, 2]]
            force = np.tile(self.force, (len(t), 1, 1))
            return _forces(block[:, None], corner[:, None], share[:, None], force)

        return at


@typed
@dataclass(frozen=True)
class Wind:
    """Pressure on edges; it turns with them.

    Attributes:
        pressure: [Pa], negative for suction.
        edges: stone, and number of the edge from that corner to the next; `facing` finds them.
    """

    pressure: History
    edges: tuple[tuple[int, int], ...]
    name: str = "wind"

    def begin(self, masonry: Masonry) -> ForceHistory:
        """Forces (n, edges) at times (n,).

        Raises:
            ConfigError: if there is no such stone or edge.
        """
        first, corner, force = masonry.first_corners(), [], []
        for stone, edge in self.edges:
            outline = masonry.stones[_moving(self.name, stone, masonry)].outline
            whole(f"edge of stone {stone} for {self.name}", edge, 0, len(outline) - 1)
            o = (edge + 1) % len(outline)
            along = outline[o] - outline[edge]
            corner.append(first[stone] + np.array([edge, o, o]))
            force.append(masonry.thickness * np.array([-along[1], along[0]]))
        if not corner:
            raise ConfigError(f"{self.name} blows on no edge; give some.")
        block = [stone for stone, _ in self.edges]

        def at(t: Array) -> Forces:
            pressure = values_at(self.name, self.pressure, t)[:, None, None]
            return _forces(block, corner, [0.5, 0.5, 0.0], pressure * np.array(force), turns=1)

        return at


@typed
@dataclass(frozen=True)
class SupportMotion:
    """Settlement, spreading or turning of held stones.

    Attributes:
        stones: numbers of held stones.
        shift: (2,) in the end [m].
        turn: about their mass centres in the end [rad].
        history: share of both, which begins with 0.
    """

    stones: tuple[int, ...]
    shift: tuple[float, float]
    turn: float = 0.0
    history: History = field(default_factory=lambda: ramp(1.0))
    name: str = "motion of supports"

    def begin(self, masonry: Masonry) -> Callable[[Array], Array]:
        """Increments (n, B, 3) between times (n + 1,) [m, m, rad].

        Raises:
            ConfigError: if a stone is not held or touches nothing, or does not start where it is.
        """
        touched = touching(masonry).who[:, [0, 2]]
        for stone in self.stones:
            if stone not in masonry.held:
                text = f"{self.name} moves {stone}, which must be of the held {masonry.held}."
                raise ConfigError(text)
            if stone not in touched:
                raise ConfigError(f"{self.name} moves stone {stone}, which must support another.")
        if values_at(self.name, self.history, np.zeros(1))[0] != 0.0:
            raise ConfigError(f"{self.name} begins away from where its stones lie; be 0 at t = 0.")
        chosen = np.isin(np.arange(len(masonry.stones)), self.stones)[:, None]
        moved = chosen * np.array([*self.shift, self.turn])
        return lambda t: np.diff(values_at(self.name, self.history, t))[:, None, None] * moved


@typed
@dataclass(frozen=True)
class BaseMotion:
    """Acceleration of the ground; the motion of the stones is relative to it.

    Attributes:
        acceleration: [m/s^2], harmonic, a pulse or recorded.
        direction: (2,) that it is multiplied with [1].
    """

    acceleration: History
    direction: tuple[float, float] = (1.0, 0.0)
    name: str = "motion of the ground"

    def begin(self, masonry: Masonry) -> Callable[[Array], Array]:
        """Accelerations (n, 2) at times (n,) [m/s^2].

        Raises:
            ConfigError: if the direction is none, or no stone is held by the ground.
        """
        if not masonry.held:
            raise ConfigError(f"{self.name}: a stone must be held, to stand on the ground.")
        return lambda t: values_at(self.name, self.acceleration, t)[:, None] * self.direction


Action = PointLoad | MovingLoad | Wind | SupportMotion | BaseMotion


@typed
def facing(masonry: Masonry, direction: tuple[float, float]) -> tuple[tuple[int, int], ...]:
    """Edges of free stones that wind meets first which blows in a direction (2,) [1].

    An edge counts if it is turned against the wind and nothing lies before its middle.

    Raises:
        ConfigError: if the direction is none.
    """
    if not any(direction):
        raise ConfigError("wind needs a direction that is not zero.")
    d = np.array(direction) / np.linalg.norm(direction)
    edges = [(b, k) for b, s in enumerate(masonry.stones) for k in range(len(s.outline))]
    start = np.vstack([s.outline for s in masonry.stones])
    end = np.vstack([np.roll(s.outline, -1, axis=0) for s in masonry.stones])
    owner, middle, along = np.array([b for b, _ in edges]), (start + end) / 2, end - start
    outward = np.column_stack([along[:, 1], -along[:, 0]])
    found = []
    for n in np.flatnonzero((outward @ d < -1e-9) & ~np.isin(owner, masonry.held)):
        # middle - s d = start + w along, for all edges
        apart = middle[n] - start
        cross = d[0] * along[:, 1] - d[1] * along[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (apart[:, 0] * along[:, 1] - apart[:, 1] * along[:, 0]) / cross
            w = (apart[:, 1] * d[0] - apart[:, 0] * d[1]) / cross
        size = np.linalg.norm(along[n])
        hidden = (s > -ON_EDGE_RTOL * size) & (w >= 0) & (w <= 1) & (owner != owner[n])
        if not hidden.any():
            found.append(edges[n])
    return tuple(found)


def driver(masonry: Masonry, actions: Sequence[Action]) -> Callable[[Array], Drive]:
    """What acts in the steps between times (n + 1,); a support that jumps in one is refused."""
    moved = [s for a in actions if isinstance(a, SupportMotion) for s in a.stones]
    check_once(moved, "a support moved by an action,")
    loads = [a.begin(masonry) for a in actions if isinstance(a, PointLoad | MovingLoad | Wind)]
    supports = [a.begin(masonry) for a in actions if isinstance(a, SupportMotion)]
    grounds = [a.begin(masonry) for a in actions if isinstance(a, BaseMotion)]
    n_blocks, reach = len(masonry.stones), masonry.law.reach
    size = np.array([np.linalg.norm(s.outline - s.centre, axis=1).max() for s in masonry.stones])

    def at(t: Array) -> Drive:
        middle = (t[1:] + t[:-1]) / 2
        n = len(middle)
        parts = [_forces(-1, 0, 0.0, np.zeros((n, 0, 2))), *(load(middle) for load in loads)]
        *columns, turned = zip(*parts, strict=True)
        block, corner, share, force = (np.concatenate(x, axis=1) for x in columns)
        turns = np.concatenate(turned)
        ground = np.sum([np.zeros((n, 2)), *(g(middle) for g in grounds)], axis=0)
        shift = np.sum([np.zeros((n, n_blocks, 3)), *(s(t) for s in supports)], axis=0)
        jump = np.hypot(shift[..., 0], shift[..., 1]) + np.abs(shift[..., 2]) * size
        if jump.size and jump.max() > 0.5 * reach:
            k, stone = np.unravel_index(np.argmax(jump), jump.shape)
            how = f"moves by {jump.max():.3g} m in the step before t = {t[k + 1]:g} s"
            hint = "Let its history be smooth, the step shorter, or reach longer."
            text = f"support {stone} {how}; corners watch edges within {reach:.3g} m."
            raise ConfigError(text, hint=hint)
        return Drive(block, corner, share, force, turns, ground, shift)

    return at


def _forces(
    block: npt.ArrayLike, corner: npt.ArrayLike, share: npt.ArrayLike, force: Array, turns: int = 0
) -> Forces:
    """Forces (n, L, 2) at places that are given for each of the n times, or for all of them."""
    n, count = force.shape[:2]
    blocks = np.broadcast_to(np.asarray(block, dtype=np.int64), (n, count))
    corners = np.broadcast_to(np.asarray(corner, dtype=np.int64), (n, count, 3))
    shares = np.broadcast_to(np.asarray(share, dtype=float), (n, count, 3))
    return Forces(blocks, corners, shares, force, np.full(count, turns))


def _moving(name: str, stone: int, masonry: Masonry) -> int:
    whole(f"stone of {name}", stone, 0, len(masonry.stones) - 1)
    if stone in masonry.held:
        raise ConfigError(f"{name} acts on stone {stone}, which is held; take another one.")
    return stone


def _tops(masonry: Masonry) -> tuple[Array, Index]:
    """(n, 2, 2) ends of edges that look upwards, left to right, and (n, 3) stone and corners."""
    ends, who = [], []
    for b, s in enumerate(masonry.stones):
        k = np.arange(len(s.outline))
        o, x = (k + 1) % k.size, s.outline[:, 0]
        up = x[o] < x - ON_EDGE_RTOL * np.ptp(s.outline)
        who.append(np.column_stack([np.full(k.size, b), o, k])[up])
        ends.append(s.outline[who[-1][:, 1:]])
    return np.vstack(ends), np.vstack(who)


def _place(name: str, masonry: Masonry, stone: int, x: Array) -> tuple[Index, Array]:
    """Three corners of a stone that a point lies between, and their shares in it."""
    corners, first = masonry.stones[stone].outline, masonry.first_corners()[stone]
    after = np.roll(corners, -1, axis=0) - corners
    w = np.clip(((x - corners) * after).sum(axis=1) / (after**2).sum(axis=1), 0, 1)
    far = np.linalg.norm(corners + w[:, None] * after - x, axis=1)
    k = int(np.argmin(far))
    if far[k] < ON_EDGE_RTOL * np.ptp(corners):
        o = (k + 1) % len(corners)
        return first + np.array([k, o, o]), np.array([1 - w[k], w[k], 0.0])
    if not is_inside(corners, x):
        text = f"{name} at {x.tolist()} lies {far[k]:.4g} m outside of stone {stone}"
        raise ConfigError(f"{text}; give a point in or on it, where it lies at the start.")
    triangles = Delaunay(corners)
    simplex = triangles.simplices[triangles.find_simplex(x)]
    share = np.linalg.solve(np.vstack([corners[simplex].T, np.ones(3)]), np.r_[x, 1.0])
    return first + simplex.astype(np.int64), share


def is_inside(corners: Array, x: Array) -> bool:
    """Whether a ray to the right crosses the outline an odd number of times."""
    a, b = corners, np.roll(corners, -1, axis=0)
    spans = (a[:, 1] > x[1]) != (b[:, 1] > x[1])
    a, b = a[spans], b[spans]
    cut = a[:, 0] + (x[1] - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1])
    return bool((cut > x[0]).sum() % 2)
