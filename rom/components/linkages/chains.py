"""Kinetic energy of chains of planar links, and of two chains that meet in a tip."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt

from rom.arguments import NotNegative, one_of, positive, typed
from rom.arguments.quantities import Positive
from rom.errors import ModelError
from rom.model import Array, Index

Elastic = Literal["held", "free"] | float  # see `Linkage.inertia`
Mass = Annotated[float, NotNegative("kg", error=ModelError)]
Inertia = Annotated[float, NotNegative("kg m^2", error=ModelError)]
MovedMass = Annotated[float, Positive("kg", error=ModelError)]  # without which nothing resists
MIN_HEIGHT = 1e-6  # of the tip over the way between the elbows: flatter, and it counts as one line
CHUNK_SIZE = 8192  # configurations at once: elastic links need (3 + r) (2 + sum r) numbers for each


@dataclass(frozen=True, slots=True)
class Link:
    """A planar link between two pins, its frame on the first pin, its axis through the second.

    Attributes:
        length: distance of the pins [m].
        M: (3 + r, 3 + r) mass for velocity of the first pin along and across the axis, angular
            velocity of that pin, rates of r elastic coordinates [kg, kg m, kg m^2].
        tip: (2, r) displacement of the second pin along and across per elastic coordinate [m].
        K: (r, r) stiffness [N/m].
    """

    length: float
    M: Array
    tip: Array
    K: Array

    @property
    def r(self) -> int:
        """Number of elastic coordinates."""
        return self.tip.shape[1]


@dataclass
class Motion:
    """Kinetic energy of a chain and velocity of its last pin, per unit of all n rates."""

    A: Array  # (N, n, n) inertia of the links added so far
    pin: Array  # (N, 2, n) velocity of the last pin

    @classmethod
    def at_rest(cls, N: int, n: int) -> "Motion":
        """No link yet, its pin on the ground."""
        return cls(np.zeros((N, n, n)), np.zeros((N, 2, n)))

    def add(self, link: Link, angle: Array, spin: Array, at: int) -> None:
        """Add a link at an angle (N,) that turns with ``spin`` (N or 1, n)."""
        N, _, n = self.pin.shape
        e = directions(angle)
        R = np.stack([e, left_of(e)], axis=1)  # rows along and across
        J = np.zeros((N, 3 + link.r, n))
        J[:, :2], J[:, 2] = R @ self.pin, spin
        J[:, 3:, at : at + link.r] = np.eye(link.r)
        self.A += gram(J, link.M @ J)
        swing = link.length * left_of(e)[:, :, None] * spin[:, None]
        self.pin = self.pin + swing + elastic_tip(link, angle, n, at)


def elastic_tip(link: Link, angle: Array, n: int, at: int) -> Array:
    """(N, 2, n) velocity of the second pin relative to the frame of the link."""
    e, out = directions(angle), np.zeros((angle.size, 2, n))
    out[:, :, at : at + link.r] = np.stack([e, left_of(e)], axis=2) @ link.tip
    return out


def directions(angle: Array) -> Array:
    """(..., 2) unit vectors at angles (...) [rad]."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def left_of(x: Array) -> Array:
    """Vectors (..., 2) turned by a quarter to the left."""
    return np.stack([-x[..., 1], x[..., 0]], axis=-1)


def gram(X: Array, Y: Array) -> Array:
    """X^T Y of stacks of matrices."""
    return np.swapaxes(X, -1, -2) @ Y


def both(q1: npt.ArrayLike, q2: npt.ArrayLike) -> tuple[Array, Array]:
    """Two coordinates (...) as arrays of one shape [rad or m]."""
    first, second = np.broadcast_arrays(np.asarray(q1, dtype=float), np.asarray(q2, dtype=float))
    return first, second


def as_elastic(links: tuple[Link, ...], elastic: Elastic) -> tuple[Link, ...]:
    """The links with their elastic coordinates, or without if these are held.

    At a frequency w elastic forces -K q = K q'' / w^2 are those of a mass -K / w^2.
    """
    if isinstance(elastic, int | float):
        positive("elastic [rad/s]", elastic)
        padded = (np.pad(link.K / elastic**2, ((3, 0), (3, 0))) for link in links)
        return tuple(replace(link, M=link.M - K) for link, K in zip(links, padded, strict=True))
    if one_of("elastic", elastic, ("held", "free")) == "free":
        return links
    tip, K = np.zeros((2, 0)), np.zeros((0, 0))
    return tuple(replace(link, M=link.M[:3, :3], tip=tip, K=K) for link in links)


@typed
class Linkage(ABC):
    """What linkages of two drives with a point mass at the tip have in common."""

    __slots__ = ()
    payload: float

    def inertia(self, q1: npt.ArrayLike, q2: npt.ArrayLike, *, elastic: Elastic = "held") -> Array:
        """(..., 2, 2) generalised inertia at coordinates of the drives [kg m^2, kg m, kg].

        Args:
            q1: (...,) first coordinate, of the left side where two meet [rad or m].
            q2: (...,) second one, of the same shape [rad or m].
            elastic: "held", what slow motors feel; the circular frequency of their torques
                [rad/s], at which elastic coordinates vibrate with them; "free", that without
                bound: it falls with every mode a link keeps, and says nothing about the machine.

        Raises:
            ConfigError: for another word, or a frequency that is not positive.
            ModelError: if couplers cannot reach each other somewhere.
        """
        links, (q1, q2) = as_elastic(self._links, elastic), both(q1, q2)
        x, y, out = q1.ravel(), q2.ravel(), np.empty((q1.size, 2, 2))
        at = 2 + np.cumsum([0, *(link.r for link in links)])
        for some in (slice(k, k + CHUNK_SIZE) for k in range(0, q1.size, CHUNK_SIZE)):
            motion = self._moved(links, (x[some], y[some]), at)
            A = motion.A + self.payload * gram(motion.pin, motion.pin)
            out[some] = A[:, :2, :2]
            if at[-1] > 2:
                out[some] -= A[:, :2, 2:] @ np.linalg.solve(A[:, 2:, 2:], A[:, 2:, :2])
        return out.reshape(*q1.shape, 2, 2)

    @property
    @abstractmethod
    def _links(self) -> tuple[Link, ...]:
        """All links, couplers last."""

    @abstractmethod
    def _moved(self, links: tuple[Link, ...], q: tuple[Array, Array], at: Index) -> Motion:
        """All links and the tip at coordinates (N,); the rates of a link begin at ``at``."""


@typed
class ClosedLinkage(Linkage):
    """Two driven sides with an elbow each, and two couplers that meet in the tip."""

    __slots__ = ()
    couplers: tuple[Link, Link]
    side: int

    def __post_init__(self) -> None:
        if self.side not in (1, -1):
            raise ModelError(f"side = {self.side}: needed is 1 or -1.")

    def tip(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> Array:
        """(..., 2) where the tool is at coordinates (...) [m]; q1 and q2 in [rad or m].

        Raises:
            ModelError: if the couplers cannot reach each other somewhere.
        """
        q1, q2 = both(q1, q2)
        left, right = self._elbows(q1, q2)
        gap, square, along, height = self._triangle(left, right)
        if not (height > 0).all():
            worst = np.argmin(np.where(np.isnan(height), -np.inf, height))
            k = np.unravel_index(worst, height.shape)
            a, b = (coupler.length for coupler in self.couplers)
            far = f"the elbows are {np.sqrt(square[k]):.4g} m apart; couplers of {a:.4g} m and"
            text = f"at q = ({q1[k]:.4g}, {q2[k]:.4g}) {far} {b:.4g} m do not meet"
            raise ModelError(f"{text}; lengthen the couplers or shorten the cranks.")
        return left + along[..., None] * gap + self.side * np.sqrt(height)[..., None] * left_of(gap)

    def assembles(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """(...) whether the couplers meet at coordinates (...) [rad or m], not in one line."""
        with np.errstate(divide="ignore", invalid="ignore"):
            height = self._triangle(*self._elbows(*both(q1, q2)))[3]
            return np.asarray(height > MIN_HEIGHT**2)

    @abstractmethod
    def _elbows(self, q1: Array, q2: Array) -> tuple[Array, Array]:
        """Both elbows (..., 2) [m]."""

    @abstractmethod
    def _side(self, k: int, link: Link, q: Array, at: Index) -> Motion:
        """The left (0) or the right side (1) without its coupler, at coordinates (N,)."""

    def _triangle(self, left: Array, right: Array) -> tuple[Array, Array, Array, Array]:
        """Way between the elbows, its square, and the tip along it and, squared, across it."""
        a, b = (coupler.length for coupler in self.couplers)
        gap = right - left
        square = (gap**2).sum(axis=-1)
        along = 0.5 * (square + a * a - b * b) / square
        return gap, square, along, a * a / square - along**2

    def _moved(self, links: tuple[Link, ...], q: tuple[Array, Array], at: Index) -> Motion:
        """Both couplers bring the same velocity to the tip: two equations for their two spins."""
        sides, tip = [self._side(k, links[k], q[k], at) for k in (0, 1)], self.tip(*q)
        arms = [tip - elbow for elbow in self._elbows(*q)]
        hung = [
            (link, np.arctan2(arm[:, 1], arm[:, 0]))
            for link, arm in zip(links[-2:], arms, strict=True)
        ]
        slip = [sides[k].pin + elastic_tip(*hung[k], int(at[-1]), at[k - 3]) for k in (0, 1)]
        closing = np.stack([left_of(arms[0]), -left_of(arms[1])], axis=-1)
        spins = np.linalg.solve(closing, slip[1] - slip[0])
        for k in (0, 1):
            sides[k].add(*hung[k], spins[:, k], at[k - 3])
        return Motion(sides[0].A + sides[1].A, sides[0].pin)
