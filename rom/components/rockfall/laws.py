"""What cushion and plug answer to being pressed."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from scipy.integrate import quad
from scipy.optimize import brentq

from rom.arguments import (
    AtLeast,
    Between,
    NotNegative,
    Positive,
    not_negative,
    typed,
    typed_record,
    unit_vector,
)
from rom.components.rockfall import kernels
from rom.errors import ConfigError
from rom.model import Array

Mass = Annotated[float, Positive("kg")]
Modulus = Annotated[float, Positive("Pa")]
Density = Annotated[float, Positive("kg/m^3")]
Recovery = Annotated[float, Between(0.0, 1.0, "(]")]  # share of an energy
Capacity = Annotated[float, Positive("N", infinite=True)]
GRAVITY = 9.81  # m/s^2
ROCK = 2600.0  # its density [kg/m^3]
# share of the energy that sand gives back: a boulder returns with a sixth of its speed, as the
# pulse measured on gravel does, see the page on rockfall
SAND_RECOVERY = 0.03


class Resistance(ABC):
    """What cushions of all laws have in common: a force, and the energy it takes up."""

    __slots__ = ()
    limit: float

    @property
    @abstractmethod
    def law(self) -> tuple[float, ...]:
        """(8,) the numbers of the law, as `kernels.cushion` takes them."""

    def force(self, d: float, deepest: float = 0.0) -> float:
        """Force [N] at penetration d after it has been as deep as ``deepest`` [m]."""
        return kernels.cushion(float(d), float(max(d, deepest)), self.law)

    def penetration(self, energy: float) -> float:
        """Penetration [m] at which loading has taken up an energy [J].

        Raises:
            ConfigError: for a negative energy, or one that takes the boulder through the cushion.
        """
        law, low, left = self.law, 0.0, not_negative("energy", energy)

        def missing(d: float) -> float:
            return float(quad(lambda x: kernels.cushion(x, x, law), low, d)[0]) - left

        halves = 2.0 ** -np.arange(1, 31)  # marks that close in on the limit, or grow without one
        marks = 1e-3 / halves if self.limit == np.inf else self.limit * (1 - halves)
        for high in marks:
            if (rest := missing(high)) >= 0:
                return float(brentq(missing, low, high))
            low, left = high, -rest
        text = f"energy = {energy:.3g} J: the cushion takes up {energy - left:.3g} J before it is"
        raise ConfigError(f"{text} pressed through to {self.limit:g} m; take a stiffer one.")


@typed_record
@dataclass(frozen=True, slots=True)
class Cushion(Resistance):
    """Resistance of the cushion to penetration d; it cannot pull.

    Loading k d^n / (1 - d / limit)^m; below the deepest penetration so far it gives back a share of
    the energy taken up, F_max ((d - d_r) / (d_max - d_r))^n; without compaction d_max - d_r is the
    same share of d_max.

    Attributes:
        stiffness: k [N/m^n].
        exponent: n [1]; 3/2 for a sphere after Hertz, 1 for a spring.
        recovery: share of the energy that comes back [1], above 0; 1 is elastic.
        limit: penetration at which the compacted cushion is rigid [m].
        hardening: m of the compaction [1], 0 for none.

    Raises:
        ConfigError: for a number out of its range.
    """

    stiffness: Annotated[float, Positive("N/m^n")]
    exponent: Annotated[float, AtLeast(1.0)] = 1.5
    recovery: Recovery = SAND_RECOVERY
    limit: Annotated[float, Positive("m", infinite=True)] = np.inf
    hardening: Annotated[float, NotNegative()] = 0.0

    @classmethod
    @typed
    def of_sand(
        cls, boulder: Mass, lame: Modulus, *, rock: Density = ROCK, **more: Any
    ) -> "Cushion":
        """Hertz's half space, with equal Lame constants, under a spherical boulder.

        Its largest force is P = 2.108 (m g)^(2/3) lame^(2/5) H^(3/5) in t, m and kN, the formula
        of the Japanese handbook.

        Args:
            boulder: mass [kg].
            lame: Lame constant of the sand [Pa]; nu = 1/4, E = 2.5 lame.
            rock: density of the boulder [kg/m^3].
            more: further attributes.
        """
        return cls(4 / 3 * 2.5 * lame / (1 - 0.25**2) * np.sqrt(ball_radius(boulder, rock)), **more)

    @property
    def law(self) -> tuple[float, ...]:
        """(8,) the numbers of the law, as `kernels.cushion` takes them."""
        numbers = (self.recovery, self.exponent, self.stiffness, self.limit, self.hardening, 0, 0)
        return (kernels.POWER_LAW, *map(float, numbers))


def ball_radius(boulder: float, rock: float = ROCK) -> float:
    """Radius [m] of a ball of a mass [kg] and a density [kg/m^3]."""
    return float((3 * boulder / (4 * np.pi * rock)) ** (1 / 3))


@typed_record
@dataclass(frozen=True, slots=True)
class Shear:
    """Resistance of the plug to being pushed through the slab.

    Attributes:
        stiffness: of the uncracked concrete [N/m].
        capacity: force at which it cracks [N].
        reinforced: stiffness left to the reinforcement then [N/m].
        ultimate: deformation at which that fails, too: the slab is punched [m].
        damping: share of critical damping of the plug on the uncracked concrete alone [1].

    Raises:
        ConfigError: for a number out of its range.
    """

    stiffness: Annotated[float, Positive("N/m")]
    capacity: Capacity = np.inf
    reinforced: Annotated[float, NotNegative("N/m")] = 0.0
    ultimate: Annotated[float, Positive("m", infinite=True)] = np.inf
    damping: Annotated[float, NotNegative()] = 0.05


@typed_record
class CushionForce:
    """The cushion between two markers of a mechanism, for one run of ``mechanism.user_force``.

    Args:
        cushion: its law, a `Cushion` or a `Layer`.
        down: (3,) direction of the blow, world.
        gap: distance of the markers along it before contact [m].
        reach: how far the slab goes aside of the lower marker [m].

    Raises:
        ConfigError: for a gap or a reach that cannot be; in the run, for a boulder that touches
            beside the slab.
    """

    def __init__(
        self,
        cushion: Resistance,
        down: npt.ArrayLike,
        gap: Annotated[float, NotNegative("m")],
        reach: Annotated[float, Positive("m", infinite=True)] = np.inf,
    ):
        self.cushion, self.down = cushion, unit_vector("down", down)
        self.gap, self.reach = gap, reach
        self.t, self.trial, self.deepest = -np.inf, 0.0, 0.0

    def __call__(self, t: float, boulder: Any, below: Any) -> tuple[Array, Array]:
        """Force and moment on the boulder; only a step that has ended leaves a trace."""
        if t > self.t:
            self.t, self.deepest = t, max(self.deepest, self.trial)
        arm = below.position - boulder.position
        self.trial = self.gap - float(arm @ self.down)
        aside = float(np.linalg.norm(arm - (arm @ self.down) * self.down))
        if self.trial > 0.0 and aside > self.reach:
            where = f"{aside:.3g} m aside at t = {t:.4g} s, beyond the slab"
            raise ConfigError(f"the boulder comes down {where}; {self.reach:g} m are on it.")
        return -self.cushion.force(self.trial, self.deepest) * self.down, np.zeros(3)
