"""Newton's bodies, few of them, integrated to round-off, and the mechanics of shapes of three.

These are points of a sphere, without size, frame and clock.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from rom.arguments import finite, one_each
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
        object.__setattr__(self, "mass", finite("mass", self.mass, (None,)))
        if self.mass.size < 2 or not (self.mass > 0).all():
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
        """(n, 3) positions, velocities [1] of a system that rests as a whole, P = L = 0, and E = 0.

        They are about the mass centre, from x (n, 3) [1] and velocities v (n, 3) [1], to be scaled.

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
        """(k, n, 3) positions and velocities [1] of the bodies at times t (k,) [1].

        At t[0] they are x (n, 3) [1] and v (n, 3) [1].

        Raises:
            ConfigError, ModelError: as `potential`.
            SolverError: if two bodies come too close.
        """
        y = np.concatenate([self._apart(x).ravel(), self._placed(v).ravel()])
        Y = integrated(lambda _, y: _newton(y, self.mass, self.degree), y, t)
        Y = Y.reshape(len(Y), 2, -1, 3)
        return Y[:, 0], Y[:, 1]

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


def integrated(rates: Callable[[float, Array], Array], y: Array, t: Array) -> Array:
    """(k, n) solution of y' = rates(t, y) at the instants t."""
    t = np.asarray(t, dtype=float)
    found = solve_ivp(rates, (t[0], t[-1]), y, t_eval=t, method="DOP853", rtol=1e-12, atol=1e-14)
    if not found.success or not np.isfinite(found.y).all():
        last = found.t[-1] if found.t.size else t[0]
        text = f"two bodies come too close soon after {last:.6g}: {found.message}"
        raise SolverError(text, hint="Collisions are not regularised; stop earlier.")
    return found.y.T


@dataclass(frozen=True, slots=True)
class ShapeSphere:
    """Three bodies in the plane z = 0, of Newton's law: their shapes are the points of a sphere.

    With Jacobi vectors z_1, z_2, weighted by the roots of their masses, as complex numbers, a shape
    is n = (2 Re z_1* z_2, 2 Im z_1* z_2, |z_1|^2 - |z_2|^2) / I; mirror images have opposite n_2.

    Raises:
        ConfigError: for another number of bodies or another law.
    """

    bodies: Bodies

    def __post_init__(self) -> None:
        if self.bodies.mass.size != 3 or self.bodies.degree != -1.0:
            raise ConfigError("the shape sphere needs three bodies of degree -1.")

    def shape(self, x: Array) -> Array:
        """(3,) point on the unit sphere of the configuration (3, 3) [1]."""
        z1, z2 = self._jacobi(x)
        w, a, b = 2 * z1.conjugate() * z2, abs(z1) ** 2, abs(z2) ** 2
        return np.array([w.real, w.imag, a - b]) / (a + b)

    def momentum(self, x: Array, v: Array) -> Array:
        """(3,) momentum [1] of the shape, I / 4 times its velocity; tangent to the sphere.

        By a configuration x (3, 3) [1] and velocities v (3, 3) [1].
        """
        (z1, z2), (w1, w2) = self._jacobi(x), self._jacobi(v)
        cross = 2 * (w1.conjugate() * z2 + z1.conjugate() * w2)
        change = 2 * (z1.conjugate() * w1 - z2.conjugate() * w2).real
        moved, n = np.array([cross.real, cross.imag, change]), self.shape(x)
        return (moved - n * (n @ moved)) / 4

    def attraction(self, n: Array) -> float:
        """-V sqrt(I) of the shape n (3,), which knows no size [1]."""
        weight, slope, level = self._distances()
        return float(weight @ (slope @ n + level) ** -0.5)

    def size(self, n: Array, p: Array, D: float) -> float:
        """sqrt(I) of a motion with energy zero [1].

        Of the shape n (3,) [1], its momentum p (3,) [1], and half the rate of I, D [1].
        """
        return (D**2 + 4 * float(np.square(p).sum())) / (2 * self.attraction(n))

    def move(self, n: Array, p: Array, D: Array) -> tuple[Array, Array]:
        """(k, 3) shapes and momenta [1] over D (k,) [1], which grows with time and takes its place.

        E = L = P = 0, and no size enters::

            H = ln(D^2 + 4 p^2) - ln(-V sqrt(I)),   n' = dH/dp,   p' = -dH/dn, on the sphere

        At D[0] they are n (3,) [1] and p (3,) [1].

        Raises:
            SolverError: if two bodies come too close.
        """
        pairs = self._distances()
        Y = integrated(lambda D, y: _shape_rates(D, y, *pairs), np.concatenate([n, p]), D)
        return Y[:, :3], Y[:, 3:]

    def _jacobi(self, x: Array) -> Array:
        """(2,) weighted Jacobi vectors of positions or velocities, as complex numbers."""
        return self._to_jacobi() @ (configuration(x) @ np.array([1.0, 1.0j, 0.0]))

    def _to_jacobi(self) -> Array:
        """(2, 3) map from positions to weighted Jacobi vectors."""
        m1, m2, m3 = self.bodies.mass
        first, second = m1 * m2 / (m1 + m2), m3 * (m1 + m2) / self.bodies.mass.sum()
        rows = np.array([[-1.0, 1.0, 0.0], [-m1 / (m1 + m2), -m2 / (m1 + m2), 1.0]])
        return np.sqrt([[first], [second]]) * rows

    def _distances(self) -> tuple[Array, Array, Array]:
        """Per pair m_i m_j, and slope and level of r_ij^2 / I = slope . n + level."""
        i, j, m = [0, 0, 1], [1, 2, 2], self.bodies.mass
        J = np.linalg.pinv(self._to_jacobi())
        a, b = (J[j] - J[i]).T
        slope = np.column_stack([a * b, np.zeros(3), (a**2 - b**2) / 2])
        return m[i] * m[j], slope, (a**2 + b**2) / 2


@kernel
def _shape_rates(D, y, weight, slope, level):
    n, p = y[:3], y[3:]
    K = D * D + 4 * (p[0] ** 2 + p[1] ** 2 + p[2] ** 2)
    C, gradient = 0.0, np.zeros(3)
    for k in range(3):
        s = level[k] + slope[k, 0] * n[0] + slope[k, 1] * n[1] + slope[k, 2] * n[2]
        c = weight[k] / math.sqrt(s)
        C += c
        gradient -= 0.5 * c / s * slope[k]
    rate = 8 / K * p
    gradient /= C
    return np.concatenate((rate, gradient - n * ((gradient * n).sum() + (p * rate).sum())))
