"""Rockfall on a gallery: boulder, cushion, plug and slab, after Schellenberg, Kishi and Kon-No.

Three masses and three springs: the boulder m_1 presses the cushion (1), the cushion a plug m_2 of
cushion and concrete, the plug shears (2) into the slab m_3, which bends (3)::

    m_1 z_1'' = m_1 g - F_1(z_1 - z_2)
    m_2 z_2'' = F_1 - F_2(z_2 - z_3)
    m_3 z_3'' = F_2 - F_3(z_3)

z points down and counts from contact; plug and slab rest in balance with their weight. The modes
of a slab, such as those of a reduced finite element body, can take the place of the last mass:
q'' + 2 zeta omega q' + omega^2 q = phi F_2, z_3 = phi . q.

The laws are simple ones chosen here; no parameter and no result of a test is reproduced.

Source:
    After Schellenberg, On the design of rockfall protection galleries, ETH Zurich (2009), and
    Schellenberg, Kishi and Kon-No on its use for a large-scale test, of which the abstract alone
    was read. Hertz: Johnson, Contact Mechanics (1985).
"""

import math
from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.linalg import eigh
from scipy.optimize import brentq

from rom.components.compiled import inner, kernel
from rom.errors import ConfigError, ModelError, SolverError
from rom.model import Array
from rom.rotation import skew

GRAVITY = 9.81  # m/s^2
ROCK = 2600.0  # kg/m^3
STEP = 0.1  # time step times the highest frequency
STATES = ("whole", "cracked", "punched")


@dataclass(frozen=True, slots=True)
class Cushion:
    """Resistance of the cushion to penetration d; it cannot pull.

    Loading k d^n / (1 - d / limit)^m; below the deepest penetration so far a share of it recovers,
    F_max ((d - d_r) / (d_max - d_r))^n with d_r = (1 - recovery) d_max.

    Attributes:
        stiffness: k [N/m^n].
        exponent: n; 3/2 for a sphere after Hertz, 1 for a spring.
        recovery: share of the penetration that comes back, in (0, 1]; 1 is elastic.
        limit: penetration at which the compacted cushion is rigid [m].
        hardening: m of the compaction, 0 for none.

    Raises:
        ConfigError: for a number out of its range.
    """

    stiffness: float
    exponent: float = 1.5
    recovery: float = 1.0
    limit: float = np.inf
    hardening: float = 0.0

    def __post_init__(self) -> None:
        good = self.stiffness > 0 and self.limit > 0 and 0 < self.recovery <= 1
        if not (good and self.exponent >= 1 and self.hardening >= 0):
            needed = "stiffness and limit > 0, 0 < recovery <= 1, exponent >= 1, hardening >= 0"
            raise ConfigError(f"{self}: needed are {needed}.")

    @classmethod
    def of_sand(cls, boulder: float, lame: float, *, rock: float = ROCK, **more: Any) -> "Cushion":
        """Hertz's half space, with equal Lame constants, under a spherical boulder.

        Its largest force is P = 2.108 (m g)^(2/3) lame^(2/5) H^(3/5) in t, m and kN, the formula
        of the Japanese handbook.

        Args:
            boulder: mass [kg].
            lame: Lame constant of the sand [Pa]; nu = 1/4, E = 2.5 lame.
            rock: density of the boulder [kg/m^3].
            more: further attributes.
        """
        radius = (3 * boulder / (4 * np.pi * rock)) ** (1 / 3)
        return cls(4 / 3 * 2.5 * lame / (1 - 0.25**2) * np.sqrt(radius), **more)

    def force(self, d: float, deepest: float = 0.0) -> float:
        """Force [N] at penetration d after it has been as deep as ``deepest`` [m]."""
        law = tuple(map(float, astuple(self)))
        return _cushion(float(d), float(max(d, deepest)), law)

    def penetration(self, energy: float) -> float:
        """Penetration [m] at which loading has taken up an energy [J]."""
        n = self.exponent + 1
        high = min((n * energy / self.stiffness) ** (1 / n), self.limit * (1 - 1e-9))
        rest = lambda d: quad(self.force, 0, d, limit=200)[0] - energy  # noqa: E731
        return float(brentq(rest, 0, high) if self.hardening > 0 < rest(high) else high)


@dataclass(frozen=True, slots=True)
class Shear:
    """Resistance of the plug to being pushed through the slab.

    Attributes:
        stiffness: of the uncracked concrete [N/m].
        capacity: force at which it cracks [N].
        reinforced: stiffness left to the reinforcement then [N/m].
        ultimate: deformation at which that fails, too: the slab is punched [m].
        damping: share of critical damping of the plug on the uncracked concrete alone.
    """

    stiffness: float
    capacity: float = np.inf
    reinforced: float = 0.0
    ultimate: float = np.inf
    damping: float = 0.05


@dataclass(frozen=True, slots=True)
class Slab:
    """Modes of the slab on its supports, mass-normalised, as the plug feels them.

    Attributes:
        phi: (r,) deflection under the plug per modal coordinate [kg^-1/2].
        omega: (r,) frequencies [rad/s].
        damping: share of critical damping of all modes.
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
        """The last mass and spring of the three [kg, N/m]."""
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
            damping: share of critical damping.
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
    """

    boulder: float
    height: float
    plug: float
    cushion: Cushion
    shear: Shear
    slab: Slab
    weight: bool = True

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
        SolverError: if the motion grows without bound because dt is too large.
    """
    n = int(np.ceil(t_end / (STEP / g.highest_frequency() if dt is None else dt)))
    every = max(1, n // keep)
    numbers = (
        (g.boulder, g.plug, GRAVITY if g.weight else 0.0, g.speed),
        astuple(g.cushion),
        (*astuple(g.shear)[:4], 2 * g.shear.damping * np.sqrt(g.shear.stiffness * g.plug)),
        (g.slab.damping, g.slab.capacity, g.slab.stiffness),
    )
    numbers = tuple(tuple(map(float, group)) for group in numbers)
    modes = tuple(np.array(x, dtype=float) for x in (g.slab.phi, g.slab.omega))
    out, last = np.zeros((n // every + 1, 17)), np.zeros(7)
    _strike(numbers, modes, t_end / n, every, out, last)
    if not np.isfinite(out).all():
        raise SolverError(f"the impact grows without bound with a step of {t_end / n:.3g} s.")
    t, *rest = np.split(out, [1, 4, 7, 10], axis=1)
    deepest, deflection, plastic = map(float, last[3:6])
    return Impact(t[:, 0], *rest, last[:3], deepest, deflection, plastic, STATES[int(last[6])])


VARIED = {  # what `sensitivity` changes: where it stands, and the power of the factor there
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
        factors: (f,) for example 0.8 and 1.25.

    Returns:
        {parameter: (f,) relative changes of the answer}.
    """
    first = answer(g)
    return {
        name: np.array([answer(_scaled(g, path, s**power)) for s in factors]) / first - 1
        for name, (path, power) in VARIED.items()
    }


def _scaled(record: Any, path: str, factor: float) -> Any:
    name, _, rest = path.partition(".")
    value = getattr(record, name)
    value = _scaled(value, rest, factor) if rest else factor * value
    return replace(record, **{name: value})


class CushionForce:
    """The cushion between two markers of a mechanism, for one run of ``mechanism.user_force``.

    Args:
        cushion: its law.
        down: (3,) direction of the blow, world.
        gap: distance of the markers along it before contact [m].
    """

    def __init__(self, cushion: Cushion, down: Any, gap: float):
        self.cushion, self.down, self.gap = cushion, np.asarray(down, dtype=float), gap
        self.t, self.trial, self.deepest = -np.inf, 0.0, 0.0

    def __call__(self, t: float, boulder: Any, below: Any) -> tuple[Array, Array]:
        """Force and moment on the boulder; only a step that has ended leaves a trace."""
        if t > self.t:
            self.t, self.deepest = t, max(self.deepest, self.trial)
        self.trial = self.gap - float((below.position - boulder.position) @ self.down)
        return -self.cushion.force(self.trial, self.deepest) * self.down, np.zeros(3)


@kernel
def _cushion(d, deepest, c):
    """Force at penetration d of a cushion that has been as deep as ``deepest`` >= d."""
    left = (1.0 - c[2]) * deepest
    if d <= left or d <= 0.0:
        return 0.0
    largest = c[0] * deepest ** c[1] / (1.0 - deepest / c[3]) ** c[4]
    return largest * ((d - left) / (deepest - left)) ** c[1]


@inner
def _shear(d, rate, s, state):
    """Force of the plug, and whether it is whole (0), cracked (1) or punched (2)."""
    if state == 0 and abs(s[0] * d) > s[1]:
        state = 1
    if state == 1 and abs(d) > s[3]:
        state = 2
    return (s[0] * d + s[4] * rate, s[2] * d, 0.0)[state], state


@kernel
def _strike(numbers, modes, h, every, out, last):
    """Rows of out: time, ways, speeds, forces, energies; last: peaks and what stays."""
    (m1, m2, g, v1), c, s, (zeta, capacity, k3) = numbers
    phi, omega = modes
    z1, z2, v2, d, e, F1, F2, deepest, yielded = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    q, w, took, state = np.zeros(phi.size), np.zeros(phi.size), np.zeros(7), 0
    for i in range(every * (out.shape[0] - 1) + 1):
        d0, e0, f1, f2 = d, e, F1, F2
        z3, v3 = (phi * q).sum(), (phi * w).sum()
        d, e, deepest = z1 - z2, z2 - z3, max(deepest, z1 - z2)
        F1 = _cushion(d, deepest, c)
        F2, state = _shear(e, v2 - v3, s, state)
        flow = k3 * abs(z3 - yielded) - capacity
        if flow > 0.0:
            yielded += math.copysign(flow / k3, z3 - yielded)
            took[5] += capacity * flow / k3
        F3 = k3 * (z3 - yielded + 2.0 * zeta * (phi / omega * w).sum())
        took[1] += 0.5 * (F1 + f1) * (d - d0)
        took[2] += 0.5 * (F2 + f2) * (e - e0)
        half = h if i else 0.5 * h
        n1, n2 = v1 + half * (g - F1 / m1), v2 + half * (F1 - F2) / m2
        u1, u2, u3 = (0.5 * (v1 + n1), 0.5 * (v2 + n2), 0.0) if i else (v1, v2, 0.0)
        took[0], took[3], took[6] = 0.5 * m1 * u1**2 + 0.5 * m2 * u2**2, 0.0, m1 * g * z1
        for k in range(phi.size):
            x = q[k] - yielded / phi[k] if yielded != 0.0 else q[k]
            b = zeta * omega[k] * half
            n = ((1.0 - b) * w[k] + half * (phi[k] * F2 - omega[k] ** 2 * x)) / (1.0 + b)
            u = 0.5 * (w[k] + n)
            u3 += phi[k] * u
            took[0] += 0.5 * u * u
            took[3] += 0.5 * (omega[k] * x) ** 2
            took[4] += 2.0 * b * u * u
            w[k] = n
            q[k] += h * n
        if i % every == 0:
            row = out[i // every]
            row[:10] = i * h, z1, z2, z3, u1, u2, u3, F1, F2, F3
            row[10:] = took
        last[0], last[1], last[2] = max(last[0], F1), max(last[1], F2), max(last[2], F3)
        last[4] = max(last[4], z3)
        v1, v2 = n1, n2
        z1, z2 = z1 + h * v1, z2 + h * v2
    last[3], last[5], last[6] = deepest, yielded, state
