"""Best matching: what a motion is once rigid motion has been taken out, after Barbour and Bertotti.

Two snapshots of the same particles are laid over each other by the rigid motion that leaves the
smallest mass-weighted square of what differs. In velocities::

    2 T_bm = min over X of |v - R X|^2_M = v^T (M - M R (R^T M R)^-1 R^T M) v

with R the rigid motions of the configuration, and uniform growth where size has no meaning either.
The rest has no momentum and no angular momentum: the condition of Tisserand. A configuration laid
over a reference obeys that of Eckart; in a flexible body this is the mean-axis frame, and for small
deformations both are. The toys of N bodies, which are Newton's, show what remains of mechanics:
shapes, and a time read off them. Nothing here is about gravity as geometry.

Source:
    After Mercati's chapter on shape dynamics, a theory of gravity of which this module takes the
    toys of N bodies alone; Barbour and Bertotti, Proc. R. Soc. A 382 (1982) 295;
    Barbour, Koslowski and Mercati, Phys. Rev. Lett. 113 (2014) 181101, for the point that divides
    the two arrows of time. Equations derived here.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from rom.components.compiled import kernel
from rom.eigen import rigid_motions
from rom.errors import ConfigError, ModelError, SolverError
from rom.model import Array

UNSEEN = 1e-12  # share of inertia below which a rotation is left out: points on a line
ON_ITSELF = 1e-9  # sum of the two smaller singular values below which no rotation is best


@dataclass(frozen=True, slots=True)
class Matched:
    """A velocity field split by best matching.

    Attributes:
        motion: (6,) velocity at the origin of the coordinates and angular velocity; (7,) with the
            rate of growth behind [m/s, rad/s, 1/s].
        rest: (n, 3) what remains [m/s].
        energy: kinetic energy of the rest [J].
    """

    motion: Array
    rest: Array
    energy: float


def generators(x: Array, *, scale: bool = False) -> Array:
    """(3n, 6) rigid motions of the configuration x (n, 3), (3n, 7) with uniform growth last."""
    R = rigid_motions(_configuration(x))
    return np.hstack([R, np.reshape(x, (-1, 1))]) if scale else R


def rigid_part(mass: Any, R: Array, V: Array) -> Array:
    """Generators' amounts X in the columns of V: R^T M (V - R X) = 0.

    Args:
        mass: (n,) masses of particles, or the (3n, 3n) mass matrix of finite elements [kg].
        R: (3n, k) generators.
        V: (3n,) or (3n, m) velocities or shapes.

    Returns:
        (k,) or (k, m); the smallest where nothing moves, as when a line turns about itself.

    Raises:
        ConfigError: if the sizes do not fit.
    """
    V = np.asarray(V, dtype=float)
    MR = _weighted(mass, R)
    if V.shape[:1] != R.shape[:1]:
        raise ConfigError(f"{V.shape[0]} velocities do not fit {R.shape[0]} rows of generators.")
    G = R.T @ MR
    unit = 1 / np.sqrt(np.maximum(np.diag(G), 1e-300))
    G = np.linalg.pinv(G * np.outer(unit, unit), rcond=UNSEEN, hermitian=True)
    return unit[:, None] * G @ (unit[:, None] * MR.T) @ V


def match(mass: Any, x: Array, v: Array, *, scale: bool = False) -> Matched:
    """Take the best rigid motion out of velocities.

    Args:
        mass: (n,) masses, or the (3n, 3n) mass matrix of finite elements [kg].
        x: (n, 3) positions [m].
        v: (n, 3) velocities [m/s].
        scale: take uniform growth out as well.
    """
    R, v = generators(x, scale=scale), _configuration(v)
    motion = rigid_part(mass, R, v.ravel())
    rest = v.ravel() - R @ motion
    energy = 0.5 * rest @ _weighted(mass, rest[:, None])[:, 0]
    return Matched(motion, rest.reshape(-1, 3), float(energy))


def frame(mass: Any, reference: Array, x: Array, *, plane: bool = False) -> tuple[Array, Array]:
    """Where the reference lies best over x: x = r + A (reference + what differs).

    Args:
        mass: (n,) masses, or the (n, n) scalar mass matrix of finite elements M_s [kg].
        reference: (n, 3) configuration in the frame [m].
        x: (n, 3) the same particles in the world [m].
        plane: turn about z only. In space a triangle is the same as its mirror image.

    Returns:
        r (3,) origin of the frame [m] and A (3, 3) its axes, to the world. What differs obeys the
        conditions of Eckart: no mass moment, and no moment of ``reference x differs``.

    Raises:
        ModelError: if no rotation is better than all others, as for particles on a line.

    Source:
        Kabsch, Acta Cryst. A32 (1976) 922; Eckart, Phys. Rev. 47 (1935) 552.
    """
    X, x = _configuration(reference), _configuration(x)
    share = _weighted(mass, np.ones((len(X), 1)))
    share = share / share.sum()
    centre_X, centre_x = share.T @ X, share.T @ x
    C = (x - centre_x).T @ _weighted(mass, X - centre_X)
    A = _turn_in_plane(C) if plane else _turn(C)
    return (centre_x - centre_X @ A.T)[0], A


def _turn(C: Array) -> Array:
    """Rotation with the largest trace of A^T C."""
    U, sigma, Vt = np.linalg.svd(C)
    sign = np.sign(np.linalg.det(U @ Vt))
    if sigma[1] + sign * sigma[2] <= ON_ITSELF * sigma[0]:
        raise ModelError(
            f"no rotation is better than all others: singular values {sigma.round(9).tolist()}.",
            hint="Particles on a line, or mirrored ones, turn about it for nothing.",
        )
    return U @ np.diag([1.0, 1.0, sign]) @ Vt


def _turn_in_plane(C: Array) -> Array:
    c, s = C[0, 0] + C[1, 1], C[1, 0] - C[0, 1]
    length = np.hypot(c, s)
    if length <= ON_ITSELF * np.abs(C).max():
        raise ModelError("no rotation in the plane is better than all others.")
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, length]]) / length


def stacked(mass: Any, X: Array, *, plane: bool = False) -> Array:
    """Lay each picture of a film over its predecessor.

    Args:
        mass: masses as in `frame`.
        X: (k, n, 3) configurations, each in a frame of its own [m].
        plane: turn about z only.

    Returns:
        (k, n, 3): the shortest motion through these shapes, whatever frames they were taken in.
    """
    film = np.array(X, dtype=float)
    for k in range(1, len(film)):
        r, A = frame(mass, film[k], film[k - 1], plane=plane)
        film[k] = r + film[k] @ A.T
    return film


def emergent_rate(mass: Any, x: Array, dx: Array, kinetic: float) -> float:
    """Time that passes per unit of a parameter along a sequence of configurations.

    dt / d lambda = sqrt(T_bm(dx / d lambda) / (E - V)), however pictures were turned or numbered.

    Args:
        mass: (n,) masses [kg].
        x: (n, 3) configuration [m].
        dx: (n, 3) its derivative by the parameter.
        kinetic: E - V(x) [J].
    """
    return float(np.sqrt(match(mass, x, dx).energy / kinetic))


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
    """Point masses that attract each other, V = -sum m_i m_j r_ij^degree.

    Attributes:
        mass: (n,) masses.
        degree: -1 for Newton's law; -2 makes a world without size, which conserves D where E = 0.

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
            raise ConfigError(f"degree = {self.degree:g}: the bodies attract with degree < 0.")

    def potential(self, x: Array) -> float:
        """Potential energy of the configuration (n, 3)."""
        return _pairs(_configuration(x), self.mass, self.degree, np.zeros_like(x, dtype=float))

    def acceleration(self, x: Array) -> Array:
        """(n, 3) accelerations in the configuration (n, 3)."""
        a = np.zeros_like(x, dtype=float)
        _pairs(_configuration(x), self.mass, self.degree, a)
        return a

    def kinetic(self, v: Array) -> float:
        """Kinetic energy."""
        return 0.5 * float(self.mass @ np.square(v).sum(axis=1))

    def energy(self, x: Array, v: Array) -> float:
        """Total energy."""
        return self.kinetic(v) + self.potential(x)

    def centred(self, x: Array) -> Array:
        """Positions (or velocities) relative to those of the mass centre."""
        x = _configuration(x)
        return x - self.mass @ x / self.mass.sum()

    def size(self, x: Array) -> float:
        """I = sum m r^2 about the mass centre."""
        return float(self.mass @ np.square(self.centred(x)).sum(axis=1))

    def growth(self, x: Array, v: Array) -> float:
        """D = sum m r . v about the mass centre, half the rate of I.

        With degree -1, dD/dt = 2 E - V: at energy zero D only grows, and I has one smallest value.
        """
        return float(self.mass @ (self.centred(x) * v).sum(axis=1))

    def complexity(self, x: Array) -> float:
        """C_S = sqrt(sum m_i m_j r_ij^2) sum m_i m_j / r_ij / M^3: how clustered a shape is."""
        near, M = -Bodies(self.mass).potential(x), self.mass.sum()
        return float(np.sqrt(self.size(x) * M) * near / M**3)

    def at_rest_as_a_whole(self, x: Array, v: Array) -> tuple[Array, Array]:
        """(x, v) about the mass centre with P = L = 0, velocities scaled so that E = 0."""
        x = self.centred(x)
        rest = match(self.mass, x, v)
        if rest.energy <= 1e-20 * self.kinetic(v):
            raise ModelError("the velocities are a rigid motion: nothing is left to scale.")
        return x, rest.rest * np.sqrt(-self.potential(x) / rest.energy)

    def move(self, x: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """Positions and velocities (k, n, 3) at the times t (k,), starting at t[0].

        Raises:
            SolverError: if two bodies come too close.
        """
        y = np.concatenate([_configuration(x).ravel(), _configuration(v).ravel()])
        Y = _integrated(lambda _, y: _newton(y, self.mass, self.degree), y, t)
        n = self.mass.size
        return Y[:, : 3 * n].reshape(-1, n, 3), Y[:, 3 * n :].reshape(-1, n, 3)


@dataclass(frozen=True, slots=True)
class ShapeSphere:
    """Three bodies in the plane z = 0, of Newton's law: their shapes are the points of a sphere.

    With Jacobi vectors z_1, z_2, weighted by the roots of their masses, as complex numbers, a shape
    is n = (2 Re z_1* z_2, 2 Im z_1* z_2, |z_1|^2 - |z_2|^2) / I; mirror images have opposite n_2.
    """

    bodies: Bodies

    def __post_init__(self) -> None:
        if self.bodies.mass.size != 3 or self.bodies.degree != -1.0:
            raise ConfigError("the shape sphere is that of three bodies of degree -1.")

    def shape(self, x: Array) -> Array:
        """(3,) point on the unit sphere of the configuration (3, 3)."""
        z1, z2 = self._jacobi(x)
        w, a, b = 2 * z1.conjugate() * z2, abs(z1) ** 2, abs(z2) ** 2
        return np.array([w.real, w.imag, a - b]) / (a + b)

    def momentum(self, x: Array, v: Array) -> Array:
        """(3,) momentum of the shape, I / 4 times its velocity; tangent to the sphere."""
        (z1, z2), (w1, w2) = self._jacobi(x), self._jacobi(v)
        cross = 2 * (w1.conjugate() * z2 + z1.conjugate() * w2)
        change = 2 * (z1.conjugate() * w1 - z2.conjugate() * w2).real
        moved, n = np.array([cross.real, cross.imag, change]), self.shape(x)
        return (moved - n * (n @ moved)) / 4

    def attraction(self, n: Array) -> float:
        """-V sqrt(I) of the shape n (3,), which knows no size."""
        weight, slope, level = self._distances()
        return float(weight @ (slope @ n + level) ** -0.5)

    def size(self, n: Array, p: Array, D: float) -> float:
        """sqrt(I) of a motion with energy zero, from shape, momentum of the shape and D alone."""
        return (D**2 + 4 * float(np.square(p).sum())) / (2 * self.attraction(n))

    def move(self, n: Array, p: Array, D: Array) -> tuple[Array, Array]:
        """Shapes and their momenta (k, 3) at the values of D (k,), starting at D[0].

        E = L = P = 0. D grows with time and takes its place; no size enters::

            H = ln(D^2 + 4 p^2) - ln(-V sqrt(I)),   n' = dH/dp,   p' = -dH/dn, on the sphere

        Raises:
            SolverError: if two bodies come too close.
        """
        pairs = self._distances()
        Y = _integrated(lambda D, y: _shape_rates(D, y, *pairs), np.concatenate([n, p]), D)
        return Y[:, :3], Y[:, 3:]

    def _jacobi(self, x: Array) -> Array:
        """(2,) weighted Jacobi vectors of positions or velocities, as complex numbers."""
        return self._to_jacobi() @ (_configuration(x) @ np.array([1.0, 1.0j, 0.0]))

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


def _integrated(rates: Any, y: Array, t: Array) -> Array:
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


def _weighted(mass: Any, V: Array) -> Array:
    """M V, for particles with one or three rows of V each, or for a mass matrix."""
    if np.ndim(mass) == 1 and len(V) % len(mass) == 0:
        return np.repeat(np.asarray(mass, dtype=float), len(V) // len(mass))[:, None] * V
    if np.ndim(mass) == 2 and mass.shape == (len(V), len(V)):
        return np.asarray(mass @ V)
    raise ConfigError(f"a mass of shape {np.shape(mass)} does not fit {len(V)} rows.")


def _configuration(x: Array) -> Array:
    x = np.ascontiguousarray(x, dtype=float)
    if x.ndim != 2 or x.shape[1] != 3:
        raise ConfigError(f"a configuration has the shape (n, 3), not {x.shape}.")
    return x
