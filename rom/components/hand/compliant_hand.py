"""Fingers whose joints are compression springs, closed by cables.

A finger is one rod: joints are springs, phalanges are links that neither bend nor, nearly,
stretch. Its third axis points along, its first to the palm, where the cable runs. Coils that touch
on the inner side stop a joint.

Source:
    After the idea of Potratz, Yang, Abdel-Malek, Pena Pitarch and Grosland, A light weight
    compliant hand mechanism with high degrees of freedom, J. Biomech. Eng. 127 (2005) 934; all
    sizes are ours, lengths of fingers after Chatzioglou and others 2024.
"""

from collections.abc import Callable, Sized
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.arguments import NotNegative, between, not_both, typed
from rom.components.cosserat import Rod, Shape, clamped, linearised, loads, reference, rod
from rom.components.cosserat.helical_spring import HelicalSpring
from rom.components.cosserat.statics import newton
from rom.components.hand.cable import Hole, Tendon
from rom.errors import ConfigError, ModelError, SolverError
from rom.model import Array, Mask
from rom.paths.load_steps import load_steps

PHALANX_RIGIDITY_RATIO = 1e5  # rigidity of a phalanx over that of the springs
STOP_STIFFNESS_RATIO = 50.0  # stiffness of touching coils over that of the spring
MIN_STEP = 0.5**9  # of the way, at which it is given up
HAND_SPRING = HelicalSpring(0.7e-3, 7e-3, 5, 8e-3)
INDEX_LENGTHS = (18e-3, 12e-3, 10e-3)  # m
# m, of whole fingers
LENGTHS = dict(thumb=49.5e-3, index=64e-3, middle=70.7e-3, ring=65.5e-3, little=53.3e-3)

Extra = Callable[[Shape], tuple[Array, Array]]


@dataclass(frozen=True)
class Finger:
    """Springs and phalanges in series, with a cable.

    Attributes:
        springs: from the palm outward.
        phalanges: length of the link beyond each spring [m]; the last may be zero, a bare plate.
        offset: of the cable from the centre line, towards the palm [m].
        friction: of the cable where it turns [1].
        stiffener: factor of the rigidities of joints against bending and shear out of the plane of
            flexion, and against torsion [1].
        n: segments of a spring.

    Raises:
        ModelError: if springs and phalanges do not match.
    """

    springs: tuple[HelicalSpring, ...] = (HAND_SPRING,) * 3
    phalanges: tuple[float, ...] = INDEX_LENGTHS
    offset: float = 4.5e-3
    friction: float = 0.0
    stiffener: float = 1.0
    n: int = 16

    def __post_init__(self) -> None:
        check_pairs(self.springs, self.phalanges)
        if min(self.phalanges[:-1], default=1.0) <= 0 or self.phalanges[-1] < 0:
            raise ModelError(f"phalanges of {self.phalanges} m: they must be > 0, the last >= 0.")

    @cached_property
    def joints(self) -> tuple[tuple[int, int, int, int], ...]:
        """Vertex and frame of the plates at the base and at the top of each spring."""
        bases = (j * (self.n + 1) for j in range(len(self.springs)))
        return tuple((b, b, b + self.n, b + self.n + 1) for b in bases)

    @cached_property
    def rod(self) -> Rod:
        """The finger as a rod."""
        h, stretch, cells, bends = [], [], [], []
        for spring, link in zip(self.springs, self.phalanges, strict=True):
            own = {k: np.array(v) for k, v in spring.rigidities().items()}
            own["stretch"][1] *= self.stiffener
            own["bend"][[0, 2]] *= self.stiffener
            h += [spring.length / self.n] * self.n
            stretch += [own["stretch"]] * self.n
            cells += [own["bend"]] * (self.n + 1)
            bends += [True] * self.n
            if link > 0:
                h, bends = [*h, link], [*bends, False]
                stretch.append(np.full(3, PHALANX_RIGIDITY_RATIO * spring.axial))
        if self.phalanges[-1] > 0:
            cells.append(np.full(3, PHALANX_RIGIDITY_RATIO * self.springs[-1].bending))
        x = np.zeros((len(h) + 1, 3))
        x[1:, 2] = np.cumsum(h)
        still = np.tile([1.0, 0, 0, 0], (len(h) + 2, 1))
        return rod(x, still, stretch=np.array(stretch), bend=np.array(cells), bends=bends)

    @cached_property
    def tendon(self) -> Tendon:
        """The cable through the plates at both ends of each spring."""
        arm = (self.offset, 0.0, 0.0)
        holes = [Hole(v, f, arm) for b, g, t, k in self.joints for v, f in ((b, g), (t, k))]
        return Tendon(tuple(holes), self.friction)

    def angles(self, shape: Shape) -> Array:
        """(joints,) angle between the plates of each spring [rad]."""
        return np.array([_angle(shape, f, k)[0] for _, f, _, k in self.joints])

    def clearances(self, shape: Shape) -> Array:
        """(joints,) way left until coils touch on the inner side [m]."""
        left = []
        for spring, (b, f, t, k) in zip(self.springs, self.joints, strict=True):
            line = np.linalg.norm(np.diff(shape.x[b : t + 1], axis=0), axis=1).sum()
            left.append(spring.clearance(line, _angle(shape, f, k)[0]))
        return np.array(left)

    def stops(self, shape: Shape) -> tuple[Array, Array]:
        """Forces out of balance (n,) [N, N m] and tangent (n, n) [N/m] of coils that touch."""
        n = 6 * self.rod.h.size + 9
        r, K = np.zeros(n), np.zeros((n, n))
        gaps = self.clearances(shape)
        for spring, gap, (b, f, t, k) in zip(self.springs, gaps, self.joints, strict=True):
            if gap >= 0:
                continue
            g = np.zeros(n)
            d = np.diff(shape.x[b : t + 1], axis=0)
            d /= np.linalg.norm(d, axis=1)[:, None]
            for i, e in enumerate(d):
                g[6 * (b + i) + 3 : 6 * (b + i) + 6] -= e
                g[6 * (b + i) + 9 : 6 * (b + i) + 12] += e
            arm = (spring.diameter + spring.wire) / 2 * _angle(shape, f, k)[1]
            g[6 * f : 6 * f + 3] += arm
            g[6 * k : 6 * k + 3] -= arm
            r += STOP_STIFFNESS_RATIO * spring.stiffness * gap * g
            K += STOP_STIFFNESS_RATIO * spring.stiffness * np.outer(g, g)
        return r, K


def check_pairs(springs: Sized, phalanges: Sized) -> None:
    """Refuse a finger that is not springs with a phalanx each."""
    if len(springs) != len(phalanges) or not phalanges:
        both = f"{len(springs)} springs and {len(phalanges)} phalanges"
        raise ModelError(f"{both}: each spring carries one phalanx.")


def _angle(shape: Shape, a: int, b: int) -> tuple[float, Array]:
    """Angle from frame a to frame b, and its axis in both; zero when they agree."""
    turn = rotation.log(rotation.multiply(shape.p[a] * [1, -1, -1, -1], shape.p[b]))
    angle = float(np.linalg.norm(turn))
    return angle, turn / angle if angle > 1e-9 else np.zeros(3)


@dataclass(frozen=True)
class Posture:
    """A finger at rest.

    Attributes:
        finger: the finger.
        shape: of its rod.
        tension: of the cable at its first hole [N].
        pull: length of cable drawn out of the finger [m].
        load: force on the tip [N].
    """

    finger: Finger
    shape: Shape
    tension: float
    pull: float
    load: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def tip(self) -> Array:
        """(3,) position of the fingertip [m]."""
        return self.shape.x[-1]

    @property
    def angles(self) -> Array:
        """(joints,) bending of the joints [rad]."""
        return self.finger.angles(self.shape)

    @property
    def bound(self) -> Mask:
        """(joints,) whether coils of a joint touch."""
        return self.finger.clearances(self.shape) < 0

    def tip_compliance(self) -> Array:
        """(6, 6) motion of the tip per load on it, world axes, tension held [m/N, rad/N m]."""
        finger = self.finger
        free = clamped(finger.rod)
        K = linearised(finger.rod, self.shape, loads(finger.rod, tip=self.load))[1]
        K += self.tension * finger.tendon.forces(finger.rod, self.shape)[1]
        K += finger.stops(self.shape)[1]
        T = np.zeros((len(K), 6))
        T[-6:-3, :3], T[-3:, 3:] = np.eye(3), self.shape.frame(-1).T
        return T[free].T @ np.linalg.solve(K[np.ix_(free, free)], T[free])


def rest(finger: Finger) -> Posture:
    """The straight finger without load."""
    return Posture(finger, reference(finger.rod), 0.0, 0.0)


@typed
def close(
    finger: Finger,
    *,
    tension: Annotated[float, NotNegative("N")] | None = None,
    pull: float | None = None,
    load: npt.ArrayLike = (0.0, 0.0, 0.0),
    start: Posture | None = None,
    way: float = 1.0,
    extra: Extra | None = None,
) -> Posture:
    """Posture for a tension of the cable or a length drawn out, and a force on the tip.

    The way from ``start`` is gone in one step, or in halves where that fails.

    Args:
        finger: the finger.
        tension: of the cable at its first hole [N]; zero if neither is given.
        pull: length drawn out [m] instead.
        load: (3,) dead force on the tip [N].
        start: posture to start from, straight if not given.
        way: 1 when the cable is drawn in, -1 when it is let out: the sign of friction [1].
        extra: function of a shape that gives more forces out of balance (n,) and their tangent
            (n, n), such as those of contacts.

    Raises:
        ConfigError: for both tension and pull, a tension below zero, a pull beyond the springs.
        SolverError: if no posture was found; ``error.solution`` is the last good one.
    """
    not_both("close", tension=tension, pull=pull)
    if pull is not None:
        limit = 0.9 * sum(s.length for s in finger.springs)
        between("pull [m] of springs so long", pull, 0, limit, "[)")
    here = rest(finger) if start is None else start
    drawn = pull is not None
    goal = np.append(np.asarray(load, dtype=float), (tension or 0.0) if pull is None else pull)
    begin = np.append(here.load, here.pull if drawn else here.tension)

    def ahead(at: Posture, share: float) -> Posture | None:
        return _balance(at, begin + share * (goal - begin), drawn, way, extra)

    share, here = load_steps(ahead, here, least=MIN_STEP)
    if share < 1.0:
        text = f"no posture beyond {100 * share:.3g} % of the way."
        raise SolverError(text, hint="A joint buckles, or the load is too large.", solution=here)
    return here


def _balance(
    start: Posture, goal: Array, drawn: bool, way: float, extra: Extra | None
) -> Posture | None:
    """The posture near one; one more unknown, the tension, when pull is given."""
    finger, one, cable = start.finger, start.finger.rod, start.finger.tendon
    free = np.flatnonzero(clamped(one))
    load, length = loads(one, tip=goal[:3]), cable.length(reference(one))
    straight, own = replace(cable, friction=0.0), start.tension if drawn else goal[3]

    def correction(shape: Shape, tension: Array) -> Array | None:
        r, K = linearised(one, shape, load)
        g, H = cable.forces(one, shape, way)
        for more, stiffness in (finger.stops(shape), *((extra(shape),) if extra else ())):
            r, K = r + more, K + stiffness
        r, K = (r + tension * g)[free], (K + tension * H)[np.ix_(free, free)]
        change = 0.0
        try:
            X = np.linalg.solve(K, -np.column_stack([r, g[free]]))
        except np.linalg.LinAlgError:
            return None
        if drawn:
            row = straight.forces(one, shape)[0][free]
            missing = goal[3] - (length - cable.length(shape))
            change = (-missing - row @ X[:, 0]) / (row @ X[:, 1])
        d = np.append(np.zeros(g.size), change)
        d[free] = X[:, 0] + change * X[:, 1]
        return d

    found = newton(one, start.shape, correction, more=[own])
    if found is None:
        return None
    shape, (tension,) = found
    return Posture(finger, shape, tension, length - cable.length(shape), tuple(goal[:3]))


def hand(friction: float = 0.0, n: int = 8) -> dict[str, Finger]:
    """Five fingers of three joints each; phalanges scale with the length of the finger.

    Friction is that of the cables where they turn [1]; a spring has n segments.

    Raises:
        ModelError: for numbers that no finger has.
    """
    springs = sum(s.length for s in (HAND_SPRING,) * 3)
    shares = np.array(INDEX_LENGTHS) / sum(INDEX_LENGTHS)
    return {
        name: Finger(phalanges=tuple(shares * (length - springs)), friction=friction, n=n)
        for name, length in LENGTHS.items()
    }


ON_A_LINK = np.linspace(0, 1, 7)[1:-1]  # places on a phalanx that are watched, beside its ends


@dataclass(frozen=True)
class Bar:
    """A fixed cylinder across the finger, its axis along the second axis.

    Attributes:
        centre: (2,) in the plane of the finger, towards the palm and along [m].
        radius: of the bar [m].
        thickness: half that of the finger [m].
        stiffness: of the skin, per watched place [N/m].
    """

    centre: tuple[float, float]
    radius: float
    thickness: float = 5e-3
    stiffness: float = 3e3

    def places(self, finger: Finger) -> tuple[Array, Array, Array]:
        """Watched: (k,) vertex, (k,) share of the way to the next, (k, 2) shares of both [1]."""
        n = finger.rod.h.size
        links = [top for (_, _, top, _) in finger.joints if top < n]
        on_links = np.repeat(np.array(links, dtype=int), ON_A_LINK.size)
        vertex = np.concatenate([np.arange(n), on_links, [n - 1]])
        share = np.concatenate([np.zeros(n), np.tile(ON_A_LINK, len(links)), [1.0]])
        return vertex, share, np.column_stack([1 - share, share])

    def gaps(self, finger: Finger, shape: Shape) -> tuple[Array, Array]:
        """Gap (k,) at the watched places [m], negative in contact, and (k, 2) direction outward."""
        vertex, share, _ = self.places(finger)
        points = shape.x[vertex] + share[:, None] * (shape.x[vertex + 1] - shape.x[vertex])
        d = points[:, [0, 2]] - self.centre
        distance = np.linalg.norm(d, axis=1)
        return distance - self.radius - self.thickness, d / distance[:, None]

    def contact(self, finger: Finger) -> Callable[[Shape], tuple[Array, Array]]:
        """Forces out of balance and tangent of the contact, for `compliant_hand.close`."""
        vertex, _, halves = self.places(finger)
        n = 6 * finger.rod.h.size + 9

        def forces(shape: Shape) -> tuple[Array, Array]:
            r, K = np.zeros(n), np.zeros((n, n))
            gaps, normals = self.gaps(finger, shape)
            for k in np.flatnonzero(gaps < 0):
                e, gap = normals[k], gaps[k]
                rows = 6 * vertex[k] + np.array([3, 5, 9, 11])
                D = np.hstack([halves[k, 0] * np.eye(2), halves[k, 1] * np.eye(2)])
                distance = gap + self.radius + self.thickness
                H = np.outer(e, e) + gap / distance * (np.eye(2) - np.outer(e, e))
                r[rows] += self.stiffness * gap * D.T @ e
                K[np.ix_(rows, rows)] += self.stiffness * D.T @ H @ D
            return r, K

        return forces

    def pressure(self, posture: Posture) -> tuple[Array, Array]:
        """Force (k,) of the bar on the watched places [N], and its direction (k, 2)."""
        gaps, normals = self.gaps(posture.finger, posture.shape)
        return self.stiffness * np.maximum(-gaps, 0.0), normals


def grasp(finger: Finger, bar: Bar, tensions: npt.ArrayLike) -> list[Posture]:
    """Postures while the cable is tightened around a bar.

    Args:
        finger: the finger, straight at the start.
        bar: what it closes on.
        tensions: (n,) growing tensions of the cable [N].

    Raises:
        ConfigError: if the bar is in the way of the straight finger.
        SolverError: if no posture was found; ``error.solution`` is the last good one.

    Source:
        Contact by a penalty: Wriggers, Computational Contact Mechanics (2006).
    """
    posture = rest(finger)
    gap = bar.gaps(finger, posture.shape)[0].min()
    if gap < 0:
        raise ConfigError(f"the bar reaches {-gap:g} m into the straight finger; move it away.")
    contact, found = bar.contact(finger), []
    for tension in np.asarray(tensions, dtype=float):
        posture = close(finger, tension=float(tension), start=posture, extra=contact)
        found.append(posture)
    return found
