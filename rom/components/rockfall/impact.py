"""A boulder, a plug and the modes of a slab: the motion of an impact and what decides over it.

Source:
    After Schellenberg, On the design of rockfall protection galleries, ETH Zurich (2009).
"""

from collections.abc import Callable
from dataclasses import astuple, dataclass, replace
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh

from rom.arguments import Count, Length, NotNegative, Positive, finite, typed, typed_record
from rom.body.flexible import FlexibleBody
from rom.components.rockfall import kernels
from rom.components.rockfall.laws import GRAVITY, Cushion, Mass, Shear
from rom.components.rockfall.layer import Layer
from rom.errors import ConfigError, ModelError, SolverError
from rom.model import Array
from rom.names import check_known
from rom.rotation import skew

Time = Annotated[float, Positive("s")]
Kept = Annotated[int, Count(1)]
STEP_RATIO = 0.1  # time step times the highest frequency
STATES = ("whole", "cracked", "punched")
# with no `t_end`: the longest periods in which no peak may have grown before an impact is over,
# two for beats of slab and plug; and steps after which a motion that never ends is refused
QUIET_PERIODS, MAX_STEPS = 2, 20_000_000
NEARLY_THROUGH = 0.9  # of the limit of a cushion, where steps begin to miss it
PARTS = (1, 4, 7, 10, 17)  # where time, ways, speeds, forces and energies end in a row


@typed_record
@dataclass(frozen=True, slots=True)
class Slab:
    """Modes of the slab on its supports, mass-normalised, as the plug feels them.

    It yields where the force under the plug that would deflect it as far statically reaches its
    capacity, by the shape of that deflection: the modes go by kappa k phi / omega^2, kappa under
    the plug, and capacity times kappa is lost.

    Attributes:
        phi: (r,) deflection under the plug per modal coordinate [kg^-1/2].
        omega: (r,) frequencies [rad/s].
        damping: share of critical damping of all modes [1].
        capacity: force under the plug at which the slab yields [N].

    Raises:
        ModelError: if its modes do not fit, or a number is out of its range.
    """

    phi: Array
    omega: Array
    damping: Annotated[float, NotNegative(error=ModelError)] = 0.05
    capacity: Annotated[float, Positive("N", error=ModelError, infinite=True)] = np.inf

    def __post_init__(self) -> None:
        both = self.phi, self.omega
        phi, omega = (finite("the modes of a slab", x, (None,), error=ModelError) for x in both)
        if phi.size != omega.size or not (omega > 0).all():
            raise ModelError("a slab needs as many phi as omega, and supports that hold it.")
        if not np.any(self.phi):
            raise ModelError("no mode of the slab moves under the plug; choose another place.")

    @classmethod
    @typed
    def of_mass(
        cls,
        mass: Annotated[float, Positive("kg", error=ModelError)],
        stiffness: Annotated[float, Positive("N/m", error=ModelError)],
        **more: Any,
    ) -> "Slab":
        """The last mass and spring of the three [kg, N/m]."""
        return cls(np.array([mass**-0.5]), np.array([np.sqrt(stiffness / mass)]), **more)

    @classmethod
    def of_body(
        cls,
        body: FlexibleBody,
        patch: str,
        supports: tuple[str, ...],
        *,
        down: npt.ArrayLike = (0.0, 0.0, -1.0),
        n: int | None = None,
        damping: float = 0.05,
        capacity: float = np.inf,
    ) -> "Slab":
        """Modes of a reduced body.

        Args:
            body: on its supports.
            patch: interface under the plug.
            supports: interfaces held.
            down: (3,) direction of the blow, body frame.
            n: modes kept, lowest first; None for all.
            damping: share of critical damping [1].
            capacity: force under the plug at which it yields [N].
        """
        omega, V = body.modes(n, fixed=supports)
        m = body.marker(patch)
        reach = np.hstack([np.eye(3), -skew(m.point), m.translation])
        return cls(np.asarray(down, dtype=float) @ reach @ V, omega, damping, capacity)

    @property
    def stiffness(self) -> float:
        """Static force per deflection under the plug [N/m]."""
        return float(1 / np.square(np.divide(self.phi, self.omega)).sum())


@typed
@dataclass(frozen=True, slots=True)
class Gallery:
    """A boulder about to strike.

    Attributes:
        boulder, plug: masses m_1 and m_2 [kg].
        height: of the fall [m].
        cushion, shear, slab: the three springs; the slab has the last mass in it.
        weight: whether gravity goes on pulling at the boulder during the impact.
    """

    boulder: Mass
    height: Length
    plug: Mass
    cushion: Cushion | Layer
    shear: Shear
    slab: Slab
    weight: bool = True

    @property
    def speed(self) -> float:
        """Speed of the boulder at contact [m/s]."""
        return float(np.sqrt(2 * GRAVITY * self.height))

    @property
    def energy(self) -> float:
        """What the boulder brings [J]."""
        return 0.5 * self.boulder * self.speed**2

    @property
    def longest_period(self) -> float:
        """Of the slab, boulder and plug on it [s], from above: Dunkerley's sum of squares."""
        masses = (self.boulder + self.plug) / self.slab.stiffness
        return float(2 * np.pi * np.sqrt(masses + np.min(self.slab.omega) ** -2.0))

    def highest_frequency(self) -> float:
        """Of the impact [rad/s], the cushion as stiff as at its deepest.

        Raises:
            ConfigError: if the cushion cannot take up the energy of the fall.
        """
        c, phi = self.cushion, np.asarray(self.slab.phi)
        d = c.penetration(self.energy)
        share = c.exponent * c.force(d) * d / ((c.exponent + 1) * c.recovery * self.energy)
        slope = max((c.force(d) - c.force(0.999 * d)) / 0.001, share * c.force(d))
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

    @property
    def rebound(self) -> float:
        """Share of the boulder's energy with which it leaves, at most [1]."""
        return float((min(self.v[:, 0].min(), 0.0) / self.v[0, 0]) ** 2)

    def exceeds(self, other: "Impact") -> bool:
        """Whether one of the peaks or the deflection is larger than in another motion."""
        ours, theirs = ((*one.peaks, one.deflection) for one in (self, other))
        return any(a > (1.0 + kernels.PEAK_RTOL) * b for a, b in zip(ours, theirs, strict=True))

    def through(self, g: Gallery) -> bool:
        """Whether the last instant kept is nearly at the limit of the cushion of a gallery."""
        reach = float((self.z[:, 0] - self.z[:, 1]).max())
        return g.cushion.limit < np.inf and reach > NEARLY_THROUGH * g.cushion.limit


@typed
def strike(
    g: Gallery, *, t_end: Time | None = None, dt: Time | None = None, keep: Kept = 1000
) -> Impact:
    """Let the boulder strike: central differences, damping at mid-step.

    Args:
        g: what strikes what.
        t_end: duration [s]; None until the cushion has let go and neither a force nor the
            deflection has grown for two of the longest periods. A boulder that bounces strikes
            again as long as that lets one of them grow; blows that do not are left out.
        dt: time step [s]; None for a tenth of the reciprocal of the highest frequency.
        keep: about how many instants to keep.

    Raises:
        ConfigError: if the cushion cannot take up the energy of the fall.
        SolverError: if the motion grows without bound because dt is too large, the boulder is
            through the cushion, or the impact does not end; ``error.solution`` is what was finite.
    """
    h = STEP_RATIO / g.highest_frequency() if dt is None else dt
    if t_end is not None:
        n = int(np.ceil(t_end / h))
        every = max(1, n // keep)
        return _run(g, (t_end / n, n, every, 0, 0), n // every + 1)
    steps = h, MAX_STEPS, 1, int(np.ceil(QUIET_PERIODS * g.longest_period / h))
    first = _run(g, (*steps, 0), 2 * keep)
    if not g.weight or first.forces[-1, 0] > 0.0:  # it lies, or is gone
        return first
    again = _run(g, (*steps, 1), 2 * keep)
    return again if again.exceeds(first) else first


def _run(g: Gallery, steps: tuple[float, int, int, int, int], rows: int) -> Impact:
    """The motion in the steps of `kernels.strike`."""
    modes = tuple(np.array(x, dtype=float) for x in (g.slab.phi, g.slab.omega))
    out, last = np.zeros((rows, PARTS[-1] + modes[0].size)), np.zeros(7)
    filled, over = kernels.strike(_numbers(g), modes, steps, out, last)
    _refuse(g, out[:filled], last, steps[0], over or steps[3] == 0)
    return _impact(out[:filled], last)


def _numbers(g: Gallery) -> tuple[tuple[float, ...], ...]:
    """Masses, cushion, shear and slab, as `kernels.strike` takes them."""
    groups = (
        (g.boulder, g.plug, GRAVITY if g.weight else 0.0, g.speed),
        g.cushion.law,
        (*astuple(g.shear)[:4], 2 * g.shear.damping * np.sqrt(g.shear.stiffness * g.plug)),
        (g.slab.damping, g.slab.capacity, g.slab.stiffness),
    )
    return tuple(tuple(map(float, group)) for group in groups)


def _refuse(g: Gallery, out: Array, last: Array, step: float, over: bool) -> None:
    """A named error for a motion that broke down or did not end."""
    finite = np.isfinite(out).all(axis=1)
    if not finite.all():
        reason = f"the impact grows without bound with a step of {step:.3g} s."
        before = _impact(out[: int(finite.argmin())], last)
        if before.through(g):
            reason = f"the boulder is through the cushion of {g.cushion.limit:g} m."
        raise SolverError(reason, solution=before)
    if not over:
        text = f"the peaks of the impact still grow after {out[-1, 0]:.3g} s."
        raise SolverError(text, hint="Give t_end.", solution=_impact(out, last))


def _impact(out: Array, last: Array) -> Impact:
    t, z, v, forces, energy, modal = np.split(out, PARTS, axis=1)
    deepest, most, stays = map(float, last[3:6])
    state = STATES[int(last[6])]
    return Impact(t[:, 0], z, v, forces, energy, last[:3], deepest, most, stays, state, modal)


VARIED_NUMBERS = {  # what can be changed: where it stands, and the power of the factor there
    "mass of the boulder": ("boulder", 1.0),
    "height of the fall": ("height", 1.0),
    "stiffness of the cushion": ("cushion.{stiffness}", 1.0),
    "mass of the plug": ("plug", 1.0),
    "stiffness in shear": ("shear.stiffness", 1.0),
    "stiffness in bending": ("slab.omega", 0.5),
    "damping of the slab": ("slab.damping", 1.0),
}
STRENGTH_NAME = "strength of the cushion"
FITTED_NUMBERS = VARIED_NUMBERS | {"recovery of the cushion": ("cushion.recovery", 1.0)}
FITTED_NUMBERS[STRENGTH_NAME] = ("cushion.strength", 1.0)
Answer = Callable[[Gallery], float]


def sensitivity(g: Gallery, answer: Answer, factors: tuple[float, ...]) -> dict[str, Array]:
    """{parameter: (f,) relative changes [1] of an answer} to factors (f,) [1] of the parameter.

    The answer is a function of a `Gallery` that gives a number, e.g. a peak of `strike`.
    """
    first, names = answer(g), list(VARIED_NUMBERS)
    if isinstance(g.cushion, Layer) and g.cushion.strength < np.inf:
        names.append(STRENGTH_NAME)
    return {
        name: np.array([answer(scaled(g, {name: s})) for s in factors]) / first - 1
        for name in names
    }


def scaled(g: Gallery, factors: dict[str, float]) -> Gallery:
    """A gallery with some numbers multiplied by factors.

    Factors are {name: factor [1]}, names those of `sensitivity`, "recovery of the cushion", and
    "strength of the cushion" of a layer.

    Raises:
        ConfigError: for a name that is none of them.
    """
    for name, factor in factors.items():
        check_known(name, FITTED_NUMBERS, f"{name!r} cannot be varied; known are")
        path, power = FITTED_NUMBERS[name]
        if name == STRENGTH_NAME and not isinstance(g.cushion, Layer):
            raise ConfigError(f"{name} needs a cushion of type Layer.")
        kind = "modulus" if isinstance(g.cushion, Layer) else "stiffness"
        g = _scaled(g, path.format(stiffness=kind), factor**power)
    return g


def _scaled(record: Any, path: str, factor: float) -> Any:
    name, _, rest = path.partition(".")
    value = getattr(record, name)
    return replace(record, **{name: _scaled(value, rest, factor) if rest else factor * value})
