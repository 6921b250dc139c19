"""Could it stand? Arches and walls of rigid stones that take no tension, by statics alone.

If any forces in the joints balance the weight, press and stay within friction, dry masonry stands
(the lower bound theorem; with friction it is exact for joints that dilate as they slip). Linear
programming looks for them.

Source:
    Heyman, The stone skeleton, Int. J. Solids Struct. 2 (1966) 249; by linear programming:
    Livesley, Limit analysis of structures formed from rigid blocks, Int. J. Numer. Meth. Eng.
    12 (1978) 1853.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, NamedTuple

import numpy as np
from scipy.optimize import OptimizeResult, brentq, linprog, minimize_scalar
from scipy.sparse import coo_matrix, hstack

from rom.arguments import Between, Count, Length, Positive, between, typed
from rom.components.masonry.actions import BaseMotion, MovingLoad, PointLoad, Wind
from rom.components.masonry.stones import Masonry, Stone, stone, touching
from rom.errors import ConfigError, SolverError
from rom.model import Array, Index

Load = PointLoad | MovingLoad | Wind | BaseMotion
MAX_RATIO = 0.4  # thickness over radius up to which closed form and linear programming agree


@dataclass(frozen=True, slots=True)
class Rock:
    """Material and joints.

    Attributes:
        E: Young's modulus [Pa].
        nu: Poisson's ratio [1].
        rho: density [kg/m^3].
        friction: tangent of the angle of friction [1].
        contact: stiffness of a contact over E times the thickness [1].
    """

    E: float = 10e9
    nu: float = 0.2
    rho: float = 2000.0
    friction: float = 0.84
    contact: float = 20.0

    def stone(self, outline: Array, solid: Array | None = None) -> Stone:
        """A stone of unit depth within an outline (k, 2), counterclockwise [m].

        Its mass comes from the polygon ``solid`` (m, 2) [m], if finer than the outline.

        Raises:
            MaterialError, ModelError: as `stone`.
        """
        return stone(outline, E=self.E, nu=self.nu, rho=self.rho, solid=solid)

    def masonry(self, stones: list[Stone], held: tuple[int, ...]) -> Masonry:
        """Stones in contact.

        Raises:
            ConfigError: as `Masonry`.
        """
        return Masonry(tuple(stones), held, self.contact * self.E, self.friction)


@typed
def arch(
    n: Annotated[int, Count(2)],
    radius: Length,
    thickness: float,
    *,
    half_angle: Annotated[float, Between(0.0, np.pi, "()", "rad")] = np.pi / 2,
    rock: Rock | None = None,
) -> Masonry:
    """Circular arch of n equal voussoirs with radial joints, between two held springers.

    The springers are the first and the last stone; they are wider than the arch.

    Args:
        n: number of voussoirs.
        radius: of the centre line [m].
        thickness: [m].
        half_angle: from the crown to the springing [rad].
        rock: material and joints; the default is hard stone.

    Raises:
        ConfigError: if this is no arch.
    """
    between("thickness", thickness, 0, 2 * radius, "()")
    rock = rock or Rock()
    joints = np.linspace(-half_angle, half_angle, n + 1)
    inner, outer = radius - thickness / 2, radius + thickness / 2
    ends = list(pairwise(joints))
    coarse, fine = ([_sector(inner, outer, np.linspace(*e, m)) for e in ends] for m in (2, 33))
    stones = map(rock.stone, coarse, fine)
    left, right = (_springer(inner, outer, half_angle * side) for side in (-1, 1))
    return rock.masonry([rock.stone(left), *stones, rock.stone(right)], (0, n + 1))


def _sector(inner: float, outer: float, angles: Array) -> Array:
    """Outline between two radii, angles from the crown to the right; counterclockwise."""
    ray = np.column_stack([np.sin(angles), np.cos(angles)])
    return np.vstack([outer * ray[::-1], inner * ray])


def _springer(inner: float, outer: float, angle: float) -> Array:
    """Held stone behind the joint at an angle, half a thickness wider on both sides."""
    t, side = outer - inner, np.sign(angle)
    ray = np.array([np.sin(angle), np.cos(angle)])
    beyond = side * t * np.array([ray[1], -ray[0]])
    a, b = (inner - t / 2) * ray, (outer + t / 2) * ray
    ring = np.array([b + beyond, b, a, a + beyond])
    return ring if side > 0 else ring[::-1]


@typed
def wall(
    length: Length,
    courses: Annotated[int, Count(1)],
    *,
    brick: Annotated[tuple[float, float], Positive("m", (2,))] = (0.5, 0.25),
    openings: Sequence[tuple[float, float, int, int]] = (),
    rock: Rock | None = None,
) -> Masonry:
    """Wall in running bond on held ground, the first stone; each opening is under one long lintel.

    Lintels bear on half a brick at either end.

    Args:
        length: a multiple of half a brick [m].
        courses: number of courses.
        brick: length and height of a brick [m].
        openings: left and right end [m], first course and the course of the lintel of each.
        rock: material and joints; the default is hard stone.

    Raises:
        ConfigError: if nothing of the wall is left, an opening is not inside it, or two meet.
    """
    rock, (b, h) = rock or Rock(), brick
    for opening in openings:
        left, right, low, top = opening
        if not (0 < left < right < length and 0 <= low <= top < courses):
            text = f"the opening {opening} is not in a wall of {length} m and {courses} courses."
            hint = "Left end, right end [m], first course, course of the lintel."
            raise ConfigError(text, hint=hint)
    stones = [rock.stone(_box(-b, length + b, -h, 0.0))]
    for r in range(courses):
        here = [(x, y, r == top) for x, y, low, top in openings if low <= r <= top]
        holes = sorted((x - b / 2 * lintel, y + b / 2 * lintel, lintel) for x, y, lintel in here)
        if any(one[1] > other[0] + 1e-9 for one, other in pairwise(holes)):
            text = f"in course {r} of the wall two of the openings {openings} meet"
            raise ConfigError(f"{text}; leave a brick between two lintels.")
        cuts = np.r_[0.0, np.arange(b / 2 if r % 2 else b, length - 1e-9, b), length]
        spans = list(pairwise(cuts))
        for x, y, _ in holes:
            spans = [s for u, v in spans for s in ((u, min(v, x)), (max(u, y), v))]
        spans += [(x, y) for x, y, is_lintel in holes if is_lintel]
        stones += [rock.stone(_box(x, y, r * h, r * h + h)) for x, y in spans if y > x + 1e-9]
    return rock.masonry(stones, (0,))


def _box(left: float, right: float, bottom: float, top: float) -> Array:
    return np.array([[left, bottom], [right, bottom], [right, top], [left, top]])


@typed
def stands(masonry: Masonry, loads: Sequence[Load] = (), *, t: float = 0.0) -> bool:
    """Whether forces in the joints can carry weight and loads of rigid stones where they lie.

    Normal forces at the corners press, or pull no more than glue bears, tangential ones stay within
    friction and cohesion, and every stone that is not held is in equilibrium.

    Loads are what acts besides weight, at a time t [s].

    Raises:
        ConfigError: if a load cannot be.
        SolverError: if linear programming fails.
    """
    system = _joint_forces(masonry)
    carried = system.weight + _applied(masonry, loads, t)
    found = _solve(system, carried, np.zeros((len(carried), 0)))
    return bool(found.status == 0)


@typed
def load_factor(
    masonry: Masonry, loads: Sequence[Load], *, dead: Sequence[Load] = (), t: float = 0.0
) -> float:
    """Largest factor [1] of loads that rigid stones bear, under their weight too; infinite if any.

    Loads are taken at a time t [s]; of a motion of the ground its inertia is multiplied. Those that
    are ``dead``, as a fill, act as they are.

    Raises:
        ConfigError: if a load cannot be; if the stones do not even bear their weight.
        SolverError: if linear programming fails.

    Source:
        Livesley (1978), as above.
    """
    system, load = _joint_forces(masonry), _applied(masonry, loads, t)
    found = _solve(system, system.weight + _applied(masonry, dead, t), load[:, None])
    if found.status == 2:
        raise ConfigError("the masonry does not stand by itself; it needs thickness or friction.")
    return float(found.x[-1]) if found.status == 0 else np.inf


class _System(NamedTuple):
    """Equilibrium of free stones: balance of joint forces, weight, and Coulomb's law."""

    balance: coo_matrix
    weight: Array
    slip: coo_matrix
    cohesion: Array
    pull: Array


def _free_rows(masonry: Masonry) -> tuple[Index, Array]:
    """First equation of each stone, -1 for held ones, and (3,) scale of the equations."""
    free = ~np.isin(np.arange(len(masonry.stones)), masonry.held)
    row = np.where(free, 3 * (np.cumsum(free) - 1), -1)
    M = masonry.stones[0].M
    return row, np.r_[1.0, 1.0, 1 / np.sqrt(M[2, 2] / M[0, 0])]


def _joint_forces(masonry: Masonry) -> _System:
    B, C, bonds = masonry.blocks(), touching(masonry), masonry.law.bonds
    row, scale = _free_rows(masonry)
    n, first = int(C.used[0]), row[C.who[:, [0, 2]]]
    k, one = np.nonzero(first >= 0)
    i = first[k, one][:, None] + np.arange(3)
    values = [scale * g[k, one, :3] for g in (C.n, C.t)]
    places = [np.ravel([i, i]), np.repeat(np.r_[k, n + k], 3)]
    shape = (3 * int((row >= 0).sum()), 2 * n)
    balance = coo_matrix((np.ravel(values), places), shape=shape)
    k, ones, mu = np.arange(n), np.ones(n), C.friction
    slip = coo_matrix(
        (np.r_[-mu, ones, -mu, -ones], (np.r_[k, k, n + k, n + k], np.r_[k, n + k, k, n + k]))
    )
    pull, cohesion = np.zeros(n), np.zeros(n)
    for bond, who in enumerate(bonds.who):
        same = (C.who == who).all(axis=1)
        pull[same], cohesion[same] = bonds.pull[bond], bonds.cohesion[bond]
    weight = (B.load[row >= 0, :3] * scale).ravel()
    return _System(balance, weight, slip, np.tile(cohesion, 2), pull)


def _applied(masonry: Masonry, loads: Sequence[Load], t: float) -> Array:
    """Forces and moments of loads on the free stones, scaled as the equations."""
    row, scale = _free_rows(masonry)
    corners, centres = np.vstack([s.outline for s in masonry.stones]), masonry.start()[:, :2]
    total = np.zeros(3 * int((row >= 0).sum()))
    for load in loads:
        if isinstance(load, BaseMotion):
            pull = -load.begin(masonry)(np.array([t]))[0]
            for b in np.flatnonzero(row >= 0):
                total[row[b] : row[b] + 2] += masonry.stones[b].M[0, 0] * pull
            continue
        found = load.begin(masonry)(np.array([t]))
        for b, corner, share, force in zip(*(x[0] for x in found[:4]), strict=True):
            if b >= 0 and row[b] >= 0:
                r = share @ corners[corner] - centres[b]
                wrench = np.r_[force, r[0] * force[1] - r[1] * force[0]]
                total[row[b] : row[b] + 3] += scale * wrench
    return total


def _solve(system: _System, carried: Array, factored: Array) -> OptimizeResult:
    """The largest sum of factors of the columns of ``factored``, which come last, if it answers.

    The status is 0, 2 where nothing balances, or 3 where factors grow without bound.
    """
    unit, n = float(np.abs(carried).max()), len(system.pull)
    n_factors = factored.shape[1]
    slip = hstack([system.slip, coo_matrix((2 * n, n_factors))])
    balance = hstack([system.balance, factored / unit])
    bounds = [(-x / unit, None) for x in system.pull] + [(None, None)] * n + [(0, None)] * n_factors
    cost, known = np.r_[np.zeros(2 * n), -np.ones(n_factors)], (balance, -carried / unit)
    found = linprog(cost, slip, system.cohesion / unit, *known, bounds, method="highs")
    if found.status not in (0, 2, 3):
        raise SolverError(f"no answer whether the masonry stands: {found.message}")
    return found


@dataclass(frozen=True, slots=True)
class Limit:
    """The thinnest arch.

    Attributes:
        ratio: thickness over radius of the centre line [1].
        hinge: angle of the intrados hinges from the crown [rad].
        thrust: horizontal thrust over weight per length and radius [1].
    """

    ratio: float
    hinge: float
    thrust: float


@typed
def minimum_thickness(*, half_angle: float = np.pi / 2, true_weight: bool = True) -> Limit:
    """Thinnest circular arch with hinges at the crown and springings outside, between them inside.

    With the radius of the centre line and the weight per length as units, Ro and Ri the radii of
    the faces, the line of thrust H at the crown has the radius::

        rho(theta) = (H Ro + c (1 - cos theta)) / (H cos theta + theta sin theta)

    It passes the springing at Ro, which gives H, and touches Ri.

    Args:
        half_angle: from the crown to the springing [rad]; large enough for inner hinges.
        true_weight: weight in the mass centre of each sector, c = 1 + ratio^2 / 12 (Milankovitch);
            otherwise on the centre line, c = 1.

    Raises:
        ConfigError: if hinges cannot open inside: thin arches as flat are stable until they slip.

    Source:
        After Milankovitch, as cited by Alexakis and Makris; derived anew.
    """

    def lowest(ratio: float) -> tuple[float, float, float]:
        Ro, c = 1 + ratio / 2, 1 + true_weight * ratio**2 / 12
        cos, sin = np.cos(half_angle), np.sin(half_angle)
        H = (Ro * half_angle * sin - c * (1 - cos)) / (Ro * (1 - cos))

        def radius(theta: float) -> float:
            thrust = H * Ro + c * (1 - np.cos(theta))
            return float(thrust / (H * np.cos(theta) + theta * np.sin(theta)))

        best = minimize_scalar(
            radius, bounds=(0.0, half_angle), method="bounded", options={"xatol": 1e-12}
        )
        return best.fun - (1 - ratio / 2), best.x, H

    if not 0 < half_angle < np.pi or lowest(1e-6)[0] >= 0 or lowest(MAX_RATIO)[0] <= 0:
        text = f"half_angle = {half_angle} rad: it must lie between 0 and pi, not too flat for"
        raise ConfigError(f"{text} hinges, nor so far round that thickness is {MAX_RATIO} radii.")
    ratio = brentq(lambda x: lowest(x)[0], 1e-6, MAX_RATIO, xtol=1e-15)
    return Limit(float(ratio), *map(float, lowest(ratio)[1:]))
