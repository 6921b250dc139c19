"""Planar linkages of two drives of which one or both are slides, and their closed forms.

`CrossSlides` is PP, `PolarArm` RP, `SlideArm` PR, `SlideFiveBar` PRRRP. Beside an angle q, a slide
has the coordinate [m]: `rom.components.linkages.isotropic_sets` takes a characteristic length.

Source:
    Kinetic energies of points and rods; the conditions of isotropy are derived in the page
    `theory/isotropy`.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rom.arguments import typed
from rom.components.linkages.chains import (
    ClosedLinkage,
    Inertia,
    Link,
    Linkage,
    Mass,
    Motion,
    MovedMass,
    both,
    directions,
)
from rom.errors import ModelError
from rom.model import Array, Index


@typed
@dataclass(frozen=True, slots=True)
class CrossSlides:
    """PP: a slide along x that carries a second slide at an angle to it.

    Attributes:
        masses: of the first and of the second slide with its tool [kg].
        angle: from the first guide to the second [rad].
        motors: what rotors add to either coordinate, J / radius^2 [kg].

    Raises:
        ModelError: for parallel guides.
    """

    masses: tuple[Mass, MovedMass]
    angle: float = np.pi / 2
    motors: tuple[Mass, Mass] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not abs(np.sin(self.angle)) > 1e-9:
            raise ModelError(f"angle = {self.angle:g} rad: guides must not be parallel.")

    def inertia(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> Array:
        """(..., 2, 2) generalised inertia [kg], the same at all displacements (...) [m]."""
        first, second = self.masses
        coupling = second * np.cos(self.angle)
        A = np.array([[first + second, coupling], [coupling, second]]) + np.diag(self.motors)
        return np.broadcast_to(A, (*np.broadcast(q1, q2).shape, 2, 2)).copy()

    def tip(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> Array:
        """(..., 2) where the tool is at displacements (...) [m]; q1 and q2 in [m]."""
        q1, q2 = (q[..., None] for q in both(q1, q2))
        return q1 * [1.0, 0.0] + q2 * directions(np.array(self.angle))


@typed
@dataclass(frozen=True, slots=True)
class PolarArm:
    """RP: a guide that turns about the origin, and a slide on it.

    Attributes:
        guide: inertia of guide and rotor about the pivot [kg m^2].
        slide: mass of the slide with its tool [kg].
        spin: inertia of the slide about its own mass centre [kg m^2].
        offset: distance of that centre from the line through the pivot along the guide [m].
        motor: what the rotor of the slide adds to its mass, if it does not turn with it [kg].
    """

    guide: Inertia
    slide: MovedMass
    spin: Inertia = 0.0
    offset: float = 0.0
    motor: Mass = 0.0

    def inertia(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> Array:
        """(..., 2, 2) generalised inertia [kg m^2, kg m, kg].

        Coordinates are the angle of the guide (...,) [rad] and the way of the slide (...,) [m].
        """
        _, s = both(q1, q2)
        A = np.empty((*s.shape, 2, 2))
        A[..., 0, 0] = self.guide + self.spin + self.slide * (s * s + self.offset**2)
        A[..., 0, 1] = A[..., 1, 0] = -self.slide * self.offset
        A[..., 1, 1] = self.slide + self.motor
        return A

    def tip(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> Array:
        """(..., 2) where the centre of the slide is [m]; q1 in [rad], q2 in [m]."""
        q1, s = both(q1, q2)
        return s[..., None] * directions(q1) + self.offset * directions(q1 + np.pi / 2)

    def isotropic_reach(self, length: float) -> float | None:
        """Displacement [m] at which the arm is isotropic for a characteristic length [m], or None.

        No offset, and s^2 = L^2 (1 + motor / slide) - (guide + spin) / slide.
        """
        square = length**2 * (1 + self.motor / self.slide) - (self.guide + self.spin) / self.slide
        return float(np.sqrt(square)) if self.offset == 0.0 and square >= 0 else None


@typed
@dataclass(frozen=True, slots=True)
class SlideArm(Linkage):
    """PR: a slide along x, and a link on it: coordinates are its displacement and the angle.

    Attributes:
        slide: mass of the slide [kg].
        link: the link.
        payload: point mass at its end [kg].
    """

    slide: Mass
    link: Link
    payload: Mass = 0.0

    @property
    def _links(self) -> tuple[Link, ...]:
        return (self.link,)

    def tip(self, q1: npt.ArrayLike, q2: npt.ArrayLike) -> Array:
        """(..., 2) where the end of the link is [m]; q1 in [m], q2 in [rad]."""
        q1, q2 = both(q1, q2)
        return q1[..., None] * [1.0, 0.0] + self.link.length * directions(q2)

    def _moved(self, links: tuple[Link, ...], q: tuple[Array, Array], at: Index) -> Motion:
        motion = Motion.at_rest(q[0].size, int(at[-1]))
        motion.pin[:, 0, 0] = 1.0
        motion.A[:, 0, 0] = self.slide
        motion.add(links[0], q[1], np.eye(int(at[-1]))[[1]], 2)
        return motion


@typed
@dataclass(frozen=True, slots=True)
class SlideFiveBar(ClosedLinkage):
    """PRRRP: two slides on straight rails, two couplers that meet in the tip.

    Coordinates are the displacements of the left and of the right slide [m].

    Attributes:
        rails: (x, y, angle) of a point of the left and of the right rail [m, m, rad]; displacements
            count from it.
        slides: masses of the slides [kg].
        couplers: links from the left and the right slide to the tip.
        payload: point mass at the tip [kg].
        side: 1 for the tip to the left of the line from the left to the right slide, -1 for right.

    Raises:
        ModelError: for an unknown side.
    """

    rails: tuple[tuple[float, float, float], tuple[float, float, float]]
    slides: tuple[Mass, Mass]
    couplers: tuple[Link, Link]
    payload: Mass = 0.0
    side: int = 1

    @property
    def _links(self) -> tuple[Link, ...]:
        return self.couplers

    def _elbows(self, q1: Array, q2: Array) -> tuple[Array, Array]:
        left, right = (
            np.array(rail[:2]) + q[..., None] * directions(np.array(rail[2]))
            for rail, q in zip(self.rails, (q1, q2), strict=True)
        )
        return left, right

    def _side(self, k: int, link: Link, q: Array, at: Index) -> Motion:
        side = Motion.at_rest(q.size, int(at[-1]))
        side.pin[:, :, k] = directions(np.array(self.rails[k][2]))
        side.A[:, k, k] = self.slides[k]
        return side
