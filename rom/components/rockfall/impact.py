"""A boulder, a plug and the modes of a slab: the motion of an impact and what decides over it.

Source:
    After Schellenberg, On the design of rockfall protection galleries, ETH Zurich (2009).
"""

from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import eigh

from rom.components.rockfall import kernels
from rom.components.rockfall.laws import Cushion, Shear
from rom.errors import ConfigError, ModelError, SolverError
from rom.model import Array
from rom.rotation import skew

GRAVITY = 9.81  # m/s^2
STEP_RATIO = 0.1  # time step times the highest frequency
STATES = ("whole", "cracked", "punched")


@dataclass(frozen=True, slots=True)
class Slab:
    """Modes of the slab on its supports, mass-normalised, as the plug feels them.

    Attributes:
        phi: (r,) deflection under the plug per modal coordinate [kg^-1/2].
        omega: (r,) frequencies [rad/s].
        damping: share of critical damping of all modes [1].
        capacity: force at which a slab of one mode yields [N].

    Raises:
        ModelError: if a slab of several modes has a capacity, or its modes do not fit.
    """

    phi: Array
    omega: Array
    damping: float = 0.05
    capacity: float = np.inf

    def __post_init__(self) -> None:
        if np.size(self.phi) != np.size(self.omega) or not (np.asarray(self.omega) > 0).all():
            raise ModelError("a slab needs as many phi as omega, and supports that hold it.")
        if np.size(self.phi) > 1 and np.isfinite(self.capacity):
            raise ModelError(f"a slab of {np.size(self.phi)} modes cannot yield; take one mass.")

    @classmethod
    def of_mass(cls, mass: float, stiffness: float, **more: float) -> "Slab":
        """The last mass and spring of the three [kg, N/m].

        Raises:
            ModelError: if one is not positive.
        """
        if not (mass > 0 and stiffness > 0):
            raise ModelError(f"no slab has the mass {mass} kg and the stiffness {stiffness} N/m.")
        return cls(np.array([mass**-0.5]), np.array([np.sqrt(stiffness / mass)]), **more)

    @classmethod
    def of_body(
        cls, body: Any, patch: str, supports: tuple[str, ...], *, down: Any = (0.0, 0.0, -1.0),
        n: int | None = None, damping: float = 0.05,
    ) -> "Slab":  # fmt: skip
        """Modes of a reduced body.

        Args:
            body: a ``FlexibleBody``.
            patch: interface under the plug.
            supports: interfaces held.
            down: (3,) direction of the blow, body frame.
            n: modes kept, lowest first; None for all.
            damping: share of critical damping [1].
        """
        omega, V = body.modes(n, fixed=supports)
        m = body.marker(patch)
        reach = np.hstack([np.eye(3), -skew(m.point), m.translation])
        return cls(np.asarray(down, dtype=float) @ reach @ V, omega, damping)

    @property
    def stiffness(self) -> float:
        """Static force per deflection under the plug [N/m]."""
        return float(1 / np.square(np.divide(self.phi, self.omega)).sum())


@dataclass(frozen=True, slots=True)
class Gallery:
    """A boulder about to strike.

    Attributes:
        boulder, plug: masses m_1 and m_2 [kg].
        height: of the fall [m].
        cushion, shear, slab: the three springs; the slab has the last mass in it.
        weight: whether gravity goes on pulling at the boulder during the impact.

    Raises:
        ConfigError: for a mass or a height that is not positive.
    """

    boulder: float
    height: float
    plug: float
    cushion: Cushion
    shear: Shear
    slab: Slab
    weight: bool = True

    def __post_init__(self) -> None:
        if not (self.boulder > 0 and self.plug > 0 and self.height > 0):
            raise ConfigError(
                f"boulder = {self.boulder} kg, plug = {self.plug} kg, height = {self.height} m: "
                "all must be positive."
            )

    @property
    def speed(self) -> float:
        """Speed of the boulder at contact [m/s]."""
        return float(np.sqrt(2 * GRAVITY * self.height))

    def highest_frequency(self) -> float:
        """Of the impact [rad/s], the cushion as stiff as at its deepest."""
        c, phi = self.cushion, np.asarray(self.slab.phi)
        d = c.penetration(0.5 * self.boulder * self.speed**2)
        slope = max((c.force(d) - c.force(0.999 * d)) / 0.001, c.exponent * c.force(d) / c.recovery)
        one, two = np.zeros((2, phi.size + 2))
        one[:2], two[1], two[2:] = (1.0, -1.0), 1.0, -phi
        K = slope / d * np.outer(one, one) + self.shear.stiffness * np.outer(two, two)
        K += np.diag([0.0, 0.0, *np.square(self.slab.omega)])
        M = np.diag([self.boulder, self.plug, *np.ones(phi.size)])
        return float(np.sqrt(eigh(K, M, eigvals_only=True)[-1]))


@dataclass(frozen=True, slots=True)
class Impact:
    """What happened, at the instants kept.

    Attributes:
        t: (n,) time from contact [s].
        z, v: (n, 3) ways and speeds of boulder, plug, and slab under the plug [m, m/s].
        forces: (n, 3) in cushion, shear and bending [N], the last with damping; for several modes
            it is the static force that would deflect the slab as far.
        energy: (n, 7) kinetic, taken up by cushion and by shear, strain of the slab, lost by its
            damping, by its yielding, and work of gravity [J].
        peaks: (3,) largest forces [N].
        deepest: penetration of the cushion [m].
        deflection, plastic: largest deflection of the slab, and what stays of it [m].
        state: "whole", "cracked" or "punched".
        modal: (n, r) modal coordinates of the slab [kg^1/2 m].
    """

    t: Array
    z: Array
    v: Array
    forces: Array
    energy: Array
    peaks: Array
    deepest: float
    deflection: float
    plastic: float
    state: str
    modal: Array

    @property
    def balance(self) -> Array:
        """(n,) energy from nowhere [J]; zero for an exact motion."""
        total = self.energy[:, :6].sum(axis=1) - self.energy[:, 6]
        return total - total[0]


def strike(g: Gallery, *, t_end: float = 0.15, dt: float | None = None, keep: int = 1000) -> Impact:
    """Let the boulder strike: central differences, damping at mid-step.

    Args:
        g: what strikes what.
        t_end: duration [s].
        dt: time step [s]; None for a tenth of the reciprocal of the highest frequency.
        keep: about how many instants to keep.

    Raises:
        ConfigError: for a duration, a step or a number of instants that is not positive.
        SolverError: if the motion grows without bound because dt is too large; ``error.solution``
            is what was finite of it.
    """
    if not (0 < t_end < np.inf and keep >= 1 and (dt is None or dt > 0)):
        raise ConfigError(f"t_end = {t_end} s, dt = {dt} s, keep = {keep}: all must be positive.")
    n = int(np.ceil(t_end / (STEP_RATIO / g.highest_frequency() if dt is None else dt)))
    every = max(1, n // keep)
    numbers = (
        (g.boulder, g.plug, GRAVITY if g.weight else 0.0, g.speed),
        astuple(g.cushion),
        (*astuple(g.shear)[:4], 2 * g.shear.damping * np.sqrt(g.shear.stiffness * g.plug)),
        (g.slab.damping, g.slab.capacity, g.slab.stiffness),
    )
    laws = tuple(tuple(map(float, group)) for group in numbers)
    modes = tuple(np.array(x, dtype=float) for x in (g.slab.phi, g.slab.omega))
    out, last = np.zeros((n // every + 1, 17 + modes[0].size)), np.zeros(7)
    kernels.strike(laws, modes, t_end / n, every, out, last)
    finite = np.isfinite(out).all(axis=1)
    if not finite.all():
        raise SolverError(
            f"the impact grows without bound with a step of {t_end / n:.3g} s.",
            solution=_impact(out[: int(finite.argmin())], last),
        )
    return _impact(out, last)


def _impact(out: Array, last: Array) -> Impact:
    t, z, v, forces, energy, modal = np.split(out, [1, 4, 7, 10, 17], axis=1)
    deepest, deflection, plastic = map(float, last[3:6])
    state = STATES[int(last[6])]
    return Impact(
        t[:, 0], z, v, forces, energy, last[:3], deepest, deflection, plastic, state, modal
    )


VARIED_NUMBERS = {  # what `sensitivity` changes: where it stands, and the power of the factor there
    "mass of the boulder": ("boulder", 1.0),
    "height of the fall": ("height", 1.0),
    "stiffness of the cushion": ("cushion.stiffness", 1.0),
    "mass of the plug": ("plug", 1.0),
    "stiffness in shear": ("shear.stiffness", 1.0),
    "stiffness in bending": ("slab.omega", 0.5),
    "damping of the slab": ("slab.damping", 1.0),
}


def sensitivity(g: Gallery, answer: Any, factors: tuple[float, ...]) -> dict[str, Array]:
    """How an answer changes when one parameter is multiplied by a factor.

    Args:
        g: the gallery.
        answer: function of a `Gallery` that gives a number, e.g. a peak of `strike`.
        factors: (f,) for example 0.8 and 1.25 [1].

    Returns:
        {parameter: (f,) relative changes of the answer [1]}.
    """
    first = answer(g)
    return {
        name: np.array([answer(_scaled(g, path, s**power)) for s in factors]) / first - 1
        for name, (path, power) in VARIED_NUMBERS.items()
    }


def _scaled(record: Any, path: str, factor: float) -> Any:
    name, _, remainder = path.partition(".")
    value = getattr(record, name)
    value = _scaled(value, remainder, factor) if remainder else factor * value
    return replace(record, **{name: value})
