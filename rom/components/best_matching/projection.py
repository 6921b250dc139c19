"""The best rigid motion of a velocity field, and of two pictures of the same particles.

Source:
    Barbour and Bertotti, Proc. R. Soc. A 382 (1982) 295.
"""

from dataclasses import dataclass

import numpy as np

from rom.arguments import finite, one_each, whole
from rom.eigen.verbs import rigid_motions
from rom.errors import ConfigError, ModelError
from rom.model import Array

INERTIA_RTOL = 1e-12  # share of inertia below which a rotation is left out: points on a line
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
    """(3n, 6) rigid motions [1, m] of x (n, 3) [m]; (3n, 7) with uniform growth last.

    Raises:
        ConfigError: if x is no configuration.
    """
    R = rigid_motions(configuration(x))
    return np.hstack([R, np.reshape(x, (-1, 1))]) if scale else R


def rigid_part(mass: Array, R: Array, V: Array) -> Array:
    """Generators' amounts X in the columns of V: R^T M (V - R X) = 0.

    Args:
        mass: (n,) masses of particles, or the (3n, 3n) mass matrix of finite elements [kg].
        R: (3n, k) generators [1, m].
        V: (3n,) or (3n, m) velocities [m/s] or shapes [m].

    Returns:
        (k,) or (k, m) [m/s, rad/s], for shapes [m, rad]; the smallest where nothing moves, as when
        a line turns about itself.

    Raises:
        ConfigError: if the sizes do not fit.
    """
    V = np.asarray(V, dtype=float)
    MR = _weighted(mass, R)
    one_each("velocities", V.shape[:1], "rows of generators", R.shape[:1])
    G = R.T @ MR
    unit = 1 / np.sqrt(np.maximum(np.diag(G), 1e-300))
    G = np.linalg.pinv(G * np.outer(unit, unit), rcond=INERTIA_RTOL, hermitian=True)
    return unit[:, None] * G @ (unit[:, None] * MR.T) @ V


def match(mass: Array, x: Array, v: Array, *, scale: bool = False) -> Matched:
    """Take the best rigid motion out of velocities.

    Args:
        mass: (n,) masses, or the (3n, 3n) mass matrix of finite elements [kg].
        x: (n, 3) positions [m].
        v: (n, 3) velocities [m/s].
        scale: take uniform growth out as well.

    Raises:
        ConfigError: if the sizes do not fit, or a mass is not positive.
    """
    R, v = generators(x, scale=scale), configuration(v)
    motion = rigid_part(mass, R, v.ravel())
    residual = v.ravel() - R @ motion
    energy = 0.5 * residual @ _weighted(mass, residual[:, None])[:, 0]
    return Matched(motion, residual.reshape(-1, 3), float(energy))


def frame(mass: Array, reference: Array, x: Array, *, plane: bool = False) -> tuple[Array, Array]:
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
        ConfigError: if the numbers of particles differ.
        ModelError: if no rotation is better than all others, as for particles on a line.

    Source:
        Kabsch, Acta Cryst. A32 (1976) 922; Eckart, Phys. Rev. 47 (1935) 552.
    """
    X, x = configuration(reference), configuration(x)
    one_each("particles", len(x), "of the reference", len(X))
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
        text = f"no rotation is better than all others: singular values {sigma.round(9).tolist()}."
        raise ModelError(text, hint="Particles on a line, or mirrored ones, turn for nothing.")
    return U @ np.diag([1.0, 1.0, sign]) @ Vt


def _turn_in_plane(C: Array) -> Array:
    c, s = C[0, 0] + C[1, 1], C[1, 0] - C[0, 1]
    length = np.hypot(c, s)
    if length <= ON_ITSELF * np.abs(C).max():
        raise ModelError("no rotation in the plane is better than all others; use other shapes.")
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, length]]) / length


def stacked(mass: Array, X: Array, *, plane: bool = False) -> Array:
    """(k, n, 3) pictures of a film [m], each laid over its predecessor.

    It is the shortest motion through these shapes, whatever frames they were taken in. Masses are
    as in `frame`, configurations X (k, n, 3) each in a frame of its own [m]; in a ``plane`` they
    turn about z only.

    Raises:
        ConfigError: without a picture.
    """
    film = finite("the film", X, (None, None, 3))
    whole("pictures of the film", len(film), 1)
    for k in range(1, len(film)):
        r, A = frame(mass, film[k], film[k - 1], plane=plane)
        film[k] = r + film[k] @ A.T
    return film


def emergent_rate(mass: Array, x: Array, dx: Array, kinetic: float) -> float:
    """Time [s] that passes per unit of a parameter along a sequence of configurations.

    dt / d lambda = sqrt(T_bm(dx / d lambda) / (E - V)), however pictures were turned or numbered.

    Masses (n,) [kg] have the configuration x (n, 3) [m], its derivative dx (n, 3) by the parameter
    [m], and E - V(x), which is ``kinetic`` [J].

    Raises:
        ModelError: if nothing is left to move with.
    """
    if not kinetic > 0:
        raise ModelError(f"E - V = {kinetic:.4g} J: it must be positive, or no time passes.")
    return float(np.sqrt(match(mass, x, dx).energy / kinetic))


def _weighted(mass: Array, V: Array) -> Array:
    """M V, for particles with one or three rows of V each, or for a mass matrix."""
    if np.ndim(mass) == 1 and len(V) % len(mass) == 0:
        return np.repeat(np.asarray(mass, dtype=float), len(V) // len(mass))[:, None] * V
    if np.ndim(mass) == 2 and mass.shape == (len(V), len(V)):
        return np.asarray(mass @ V)
    raise ConfigError(f"a mass of shape {np.shape(mass)} must fit {len(V)} rows.")


def configuration(x: Array) -> Array:
    """Finite positions or velocities (n, 3)."""
    return np.ascontiguousarray(finite("a configuration", x, (None, 3)))
