"""Laws of compliant impact: stiffness from Hertz, damping from the coefficient of restitution."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rom.arguments import AtLeast, Between, NotNegative, Positive, between, positive, typed
from rom.errors import ConfigError
from rom.mbs.parts.bodies import Part


@typed
@dataclass(frozen=True, slots=True)
class Impact:
    """Force of penetration: stiffness depth^exponent (1 + damping d(depth)/dt), never pulling.

    With a coefficient of restitution e at the speed of impact v the factor d = damping v solves
    d (1 + e) = ln((1 + d) / (1 - d e)), whatever stiffness, exponent and mass; for little loss it
    is 3 (1 - e) / 2. Slower impacts lose less.

    Args:
        stiffness: force per depth^exponent, in SI [N/m^exponent; N m/rad^exponent on an angle].
        exponent: 1 for linear, 3/2 for Hertz [1].
        damping: factor of the closing speed [s/m]; or give the next two.
        restitution: speed after over speed before, above 0 and at most 1 [1].
        impact_speed: at which that holds [m/s].
        mu: coefficient of friction at the touching point [1].
        transition_speed: sliding speed over which friction changes its sign [m/s]; implicit steps
            that change the sliding speed by much more take many corrections. Without effect with:
        tangential_stiffness: force of friction per way before it slips [N/m]; then what sticks
            rests, and remembers where. None for friction by the sliding speed alone.
        tangential_damping: of that spring [N s/m].

    Raises:
        ConfigError: for damping beside restitution, restitution without its speed, or a tangential
            stiffness without mu.

    Source:
        Hunt, Crossley, J. Appl. Mech. 42 (1975) 440; integrated exactly in `damping_of`.
    """

    stiffness: Annotated[float, Positive()]
    exponent: Annotated[float, AtLeast(1.0)] = 1.5
    damping: Annotated[float, NotNegative("s/m")] = 0.0
    restitution: Annotated[float, Between(0.0, 1.0, "(]")] | None = None
    impact_speed: Annotated[float, Positive("m/s")] | None = None
    mu: Annotated[float, NotNegative()] = 0.0
    transition_speed: Annotated[float, Positive("m/s")] = 1e-3
    tangential_stiffness: Annotated[float, Positive()] | None = None
    tangential_damping: Annotated[float, NotNegative()] = 0.0

    def __post_init__(self) -> None:
        if fault := next(self._faults(), ""):
            raise ConfigError(fault)
        if self.restitution is not None and self.impact_speed is not None:
            object.__setattr__(self, "damping", damping_of(self.restitution, self.impact_speed))

    def _faults(self) -> Iterator[str]:
        k, e, v = self.tangential_stiffness, self.restitution, self.impact_speed
        if k is None and self.tangential_damping:
            yield f"tangential_damping = {self.tangential_damping:g} needs a tangential_stiffness."
        if k is not None and not self.mu:
            yield f"tangential_stiffness = {k:g} N/m without friction holds nothing; give mu too."
        if (e is None) != (v is None):
            yield f"restitution = {e} needs the impact speed at which it holds, got {v}; give both."
        if e is not None and self.damping:
            yield f"damping = {self.damping:g} and restitution; give only one."


def checked_law(name: str, law: object, *parts: Part) -> Impact:
    """The law, if it is one, and bodies that touch show how fast they slide."""
    if not isinstance(law, Impact):
        raise ConfigError(f"law of {name!r} is {law!r}; a rom.mbs.Impact is needed.")
    for part in parts if law.mu else ():
        part.refuse_spin(f"the friction of {name!r}", "its surface would not slide")
    return law


def damping_of(restitution: float, speed: float) -> float:
    """Damping factor [s/m] that gives a coefficient of restitution at a speed of impact [m/s]."""
    from scipy.optimize import brentq

    e = between("restitution", restitution, 0, 1, "(]")
    if e > 1.0 - 1e-9:
        return 0.0

    def missing(d: float) -> float:
        return d * (1.0 + e) - np.log1p(d) + np.log1p(-d * e)

    first = 1.5 * (1.0 - e * e) / (1.0 + e**3)  # where two terms of the series vanish
    low = first
    while missing(low) <= 0.0:
        low *= 0.5
    return float(brentq(missing, low, (1.0 - 1e-15) / e, xtol=1e-15, rtol=1e-14)) / speed


def hertz_stiffness(E1: float, nu1: float, E2: float, nu2: float, radius: float) -> float:
    """Stiffness k of F = k depth^(3/2) between spheres [N/m^1.5].

    Args:
        E1: Young's modulus of one [Pa].
        nu1: its Poisson's ratio [1].
        E2: Young's modulus of the other [Pa].
        nu2: its Poisson's ratio [1].
        radius: 1 / (1 / R1 + 1 / R2); of the sphere alone against a plane [m].

    Raises:
        ConfigError: for numbers no material has.

    Source:
        Johnson, Contact Mechanics, 1985, equation 4.23.
    """
    for name, nu in (("nu1", nu1), ("nu2", nu2)):
        between(name, nu, -1, 0.5, "(]")
    soft = (1 - nu1**2) / positive("E1", E1) + (1 - nu2**2) / positive("E2", E2)
    return 4 / 3 * np.sqrt(positive("radius", radius)) / soft
