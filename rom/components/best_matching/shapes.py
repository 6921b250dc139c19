"""Mechanics of the shapes of three bodies: points of a sphere, without size, frame and clock."""

import math
from dataclasses import dataclass

import numpy as np

from rom.components.best_matching.bodies import Bodies, integrated
from rom.components.best_matching.projection import configuration
from rom.components.compiled import kernel
from rom.errors import ConfigError
from rom.model import Array


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
        """(3,) momentum of the shape, I / 4 times its velocity; tangent to the sphere.

        Args:
            x: (3, 3) configuration [1].
            v: (3, 3) velocities [1].

        Returns:
            (3,) momentum [1].
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

        Args:
            n: (3,) shape [1].
            p: (3,) momentum of the shape [1].
            D: half the rate of I [1].
        """
        return (D**2 + 4 * float(np.square(p).sum())) / (2 * self.attraction(n))

    def move(self, n: Array, p: Array, D: Array) -> tuple[Array, Array]:
        """Shapes and their momenta over D, which grows with time and takes its place.

        E = L = P = 0, and no size enters::

            H = ln(D^2 + 4 p^2) - ln(-V sqrt(I)),   n' = dH/dp,   p' = -dH/dn, on the sphere

        Args:
            n: (3,) shape at D[0] [1].
            p: (3,) momentum there [1].
            D: (k,) values [1].

        Returns:
            Shapes and momenta (k, 3), (k, 3) [1].

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
