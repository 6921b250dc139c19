"""Newton's bodies, few of them, and their integration to round-off."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from rom.arguments import one_each
from rom.components.best_matching.projection import configuration, match
from rom.components.compiled import kernel
from rom.errors import ConfigError, ModelError, SolverError
from rom.model import Array


@kernel
def _pairs(x, mass, degree, a):
    """Add the accelerations to a; returns the potential."""
    V = 0.0
    for i in range(mass.size):
        for j in range(i):
            s = 0.0
            for k in range(3):
                s += (x[i, k] - x[j, k]) ** 2
            v = -mass[i] * mass[j] * s ** (0.5 * degree)
            V += v
            for k in range(3):
                pull = degree * v / s * (x[i, k] - x[j, k])  # gradient of v by x_i
                a[i, k] -= pull / mass[i]
                a[j, k] += pull / mass[j]
    return V


@kernel
def _newton(y, mass, degree):
    """Rates of positions and velocities, stored one after the other."""
    n, out = 3 * mass.size, np.zeros_like(y)
    out[:n] = y[n:]
    _pairs(y[:n].reshape(-1, 3), mass, degree, out[n:].reshape(-1, 3))
    return out


@dataclass(frozen=True, slots=True)
class Bodies:
    """Point masses that attract each other, V = -sum m_i m_j r_ij^degree; no unit but ratios: [1].

    Attributes:
        mass: (n,) masses [1].
        degree: of V [1]: -1 for Newton's law; -2 makes a world without size, which conserves D
            where E = 0.

    Raises:
        ConfigError: if a mass is not positive or the degree not negative.
    """

    mass: Array
    degree: float = -1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", np.array(self.mass, dtype=float))
        if self.mass.ndim != 1 or self.mass.size < 2 or not (self.mass > 0).all():
            raise ConfigError(f"mass = {self.mass.tolist()}: needed are two or more masses > 0.")
        if not self.degree < 0:
            raise ConfigError(f"degree = {self.degree:g}: it must be negative, to attract.")

    def potential(self, x: Array) -> float:
        """Potential energy of the configuration (n, 3) [1].

        Raises:
            ConfigError, ModelError: for other bodies than these; for two in the same place.
        """
        return _pairs(self._apart(x), self.mass, self.degree, np.zeros_like(x, dtype=float))

    def acceleration(self, x: Array) -> Array:
        """(n, 3) accelerations in the configuration (n, 3) [1].

        Raises:
            ConfigError, ModelError: for other bodies than these; for two in the same place.
        """
        a = np.zeros_like(x, dtype=float)
        _pairs(self._apart(x), self.mass, self.degree, a)
        return a

    def kinetic(self, v: Array) -> float:
        """Kinetic energy of velocities (n, 3) [1]."""
        return 0.5 * float(self.mass @ np.square(v).sum(axis=1))

    def energy(self, x: Array, v: Array) -> float:
        """Total energy [1] of a configuration (n, 3) [1] with velocities (n, 3) [1].

        Raises:
            ConfigError, ModelError: as `potential`.
        """
        return self.kinetic(v) + self.potential(x)

    def centred(self, x: Array) -> Array:
        """(n, 3) positions or velocities (n, 3) relative to those of the mass centre [1].

        Raises:
            ConfigError: for other bodies than these.
        """
        x = self._placed(x)
        return x - self.mass @ x / self.mass.sum()

    def size(self, x: Array) -> float:
        """I = sum m r^2 about the mass centre of a configuration (n, 3) [1].

        Raises:
            ConfigError: for other bodies than these.
        """
        return float(self.mass @ np.square(self.centred(x)).sum(axis=1))

    def growth(self, x: Array, v: Array) -> float:
        """D = sum m r . v about the mass centre, half the rate of I; x (n, 3) [1], v (n, 3) [1].

        With degree -1, dD/dt = 2 E - V: at energy zero D only grows, and I has one smallest value.

        Raises:
            ConfigError: for other bodies than these.
        """
        return float(self.mass @ (self.centred(x) * v).sum(axis=1))

    def complexity(self, x: Array) -> float:
        """How clustered a shape (n, 3) is, sqrt(sum m_i m_j r_ij^2) sum m_i m_j / r_ij / M^3 [1].

        Raises:
            ConfigError, ModelError: as `potential`.
        """
        near, M = -Bodies(self.mass).potential(x), self.mass.sum()
        return float(np.sqrt(self.size(x) * M) * near / M**3)

    def at_rest_as_a_whole(self, x: Array, v: Array) -> tuple[Array, Array]:
        """Configuration and velocities of a system that rests as a whole, P = L = 0, with E = 0.

        Args:
            x: (n, 3) configuration [1].
            v: (n, 3) velocities [1], which are scaled.

        Returns:
            x and v (n, 3), (n, 3) about the mass centre [1].

        Raises:
            ConfigError: for other bodies than these.
            ModelError: if the velocities are a rigid motion, or two bodies are in the same place.
        """
        x = self.centred(x)
        matched = match(self.mass, x, v)
        if matched.energy <= 1e-20 * self.kinetic(v):
            raise ModelError("the velocities are a rigid motion: they must change the shape.")
        return x, matched.rest * np.sqrt(-self.potential(x) / matched.energy)

    def move(self, x: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """The motion of the bodies.

        Args:
            x: (n, 3) configuration at t[0] [1].
            v: (n, 3) velocities there [1].
            t: (k,) times [1].

        Returns:
            Positions and velocities (k, n, 3), (k, n, 3) [1].

        Raises:
            ConfigError, ModelError: as `potential`.
            SolverError: if two bodies come too close.
        """
        y = np.concatenate([self._apart(x).ravel(), self._placed(v).ravel()])
        Y = integrated(lambda _, y: _newton(y, self.mass, self.degree), y, t)
        n = self.mass.size
        return Y[:, : 3 * n].reshape(-1, n, 3), Y[:, 3 * n :].reshape(-1, n, 3)

    def _placed(self, x: Array) -> Array:
        x = configuration(x)
        one_each("positions or velocities", len(x), "bodies", self.mass.size)
        return x

    def _apart(self, x: Array) -> Array:
        x = self._placed(x)
        i, j = np.triu_indices(len(x), 1)
        if not np.abs(x[i] - x[j]).max(axis=1).min() > 0:
            raise ModelError("two bodies are in the same place; they must be apart to attract.")
        return x


def integrated(rates: Any, y: Array, t: Array) -> Array:
    """(k, n) solution of y' = rates(t, y) at the instants t."""
    t = np.asarray(t, dtype=float)
    found = solve_ivp(rates, (t[0], t[-1]), y, t_eval=t, method="DOP853", rtol=1e-12, atol=1e-14)
    if not found.success or not np.isfinite(found.y).all():
        last = found.t[-1] if found.t.size else t[0]
        raise SolverError(
            f"two bodies come too close soon after {last:.6g}: {found.message}",
            hint="Collisions are not regularised; stop earlier.",
        )
    return found.y.T
