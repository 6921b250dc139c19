"""Short and long bearings: closed forms.

Short: Ocvirk's film, pressure on half the circumference. Long: Sommerfeld's film.

Source:
    Ocvirk, Short-bearing approximation for full journal bearings, NACA TN 2808 (1952); Sommerfeld,
    Z. Math. Phys. 50 (1904) 97; coefficients in the form of Friswell, Penny, Garvey and Lees,
    Dynamics of Rotating Machines (2010).
"""

import numpy as np
import numpy.typing as npt

from rom.arguments import positive
from rom.errors import ModelError
from rom.model import Array

GAUSS_X, GAUSS_W = np.polynomial.legendre.leggauss(64)


def short_sommerfeld(eccentricity: npt.ArrayLike) -> Array:
    """(...,) S (L/D)^2 of a short bearing [1] with viscosity N L D / W (R/c)^2 = S.

    Raises:
        ModelError: if an eccentricity is not between 0 and 1.
    """
    e = _inside(eccentricity)
    return (1 - e**2) ** 2 / (np.pi * e * np.sqrt(16 * e**2 + np.pi**2 * (1 - e**2)))


def short_attitude(eccentricity: npt.ArrayLike) -> Array:
    """(...,) angle from the load to the line of centres [rad] at eccentricities (...,).

    Raises:
        ModelError: if an eccentricity is not between 0 and 1.
    """
    e = _inside(eccentricity)
    return np.arctan2(np.pi * np.sqrt(1 - e**2), 4 * e)


def short_eccentricity(sommerfeld: float) -> float:
    """Eccentricity, in clearances, at which `short_sommerfeld` has that value; both [1].

    Raises:
        ModelError: if it is not positive.
    """
    positive("sommerfeld", sommerfeld, error=ModelError)
    low, high = 1e-12, 1 - 1e-12
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if short_sommerfeld(middle) > sommerfeld else (low, middle)
    return (low + high) / 2


def short_coefficients(eccentricity: float) -> tuple[Array, Array]:
    """Stiffness times c/W and damping times c speed/W of a short bearing, (2, 2) [1] each.

    X is along the load, y from it by 90 degrees in the direction of rotation; the eccentricity is
    in clearances, between 0 and 1 [1].

    Raises:
        ModelError: if the eccentricity is not between 0 and 1.
    """
    e = float(_inside(eccentricity))
    r, p = np.sqrt(1 - e**2), np.pi**2
    h = (p * (1 - e**2) + 16 * e**2) ** -1.5
    a_uu = 4 * h * (p * (2 - e**2) + 16 * e**2)
    a_uv = h * np.pi * (p * (1 - e**2) ** 2 - 16 * e**4) / (e * r)
    a_vu = -h * np.pi * (p * (1 - e**2) * (1 + 2 * e**2) + 32 * e**2 * (1 + e**2)) / (e * r)
    a_vv = 4 * h * (p * (1 + 2 * e**2) + 32 * e**2 * (1 + e**2) / (1 - e**2))
    b_uu = 2 * h * np.pi * r * (p * (1 + 2 * e**2) - 16 * e**2) / e
    b_uv = -8 * h * (p * (1 + 2 * e**2) - 16 * e**2)
    b_vv = 2 * h * np.pi * (p * (1 - e**2) ** 2 + 48 * e**2) / (e * r)
    return np.array([[a_vv, -a_vu], [-a_uv, a_uu]]), np.array([[b_vv, -b_uv], [-b_uv, b_uu]])


def short_force(position: npt.ArrayLike, rate: npt.ArrayLike) -> Array:
    """(2,) force of a short film on a journal in any motion, in units of viscosity speed R L^3/c^2.

    Pressure fills the half of the circumference where the film closes. The position (2,) is in
    clearances [1], its rate (2,) in clearances per radian of rotation [1].
    """
    (x, y), (dx, dy) = np.asarray(position, dtype=float), np.asarray(rate, dtype=float)
    end = np.arctan2(y + 2 * dx, x - 2 * dy)
    theta = end - np.pi / 2 + np.pi / 2 * GAUSS_X
    c, s = np.cos(theta), np.sin(theta)
    closing = (x - 2 * dy) * s - (y + 2 * dx) * c
    p = -0.5 * closing / (1 - x * c - y * s) ** 3 * GAUSS_W * np.pi / 2
    return -np.array([p @ c, p @ s])


def long_pressure(theta: npt.ArrayLike, eccentricity: float) -> Array:
    """(n,) pressure of a long film over viscosity speed (R/c)^2 [1], zero at its largest gap.

    Theta (n,) is the angle from the largest gap in the direction of rotation [rad], the
    eccentricity in clearances, between 0 and 1 [1].

    Raises:
        ModelError: if the eccentricity is not between 0 and 1.
    """
    e, t = float(_inside(eccentricity)), np.asarray(theta, dtype=float)
    return 6 * e * np.sin(t) * (2 + e * np.cos(t)) / ((2 + e**2) * (1 + e * np.cos(t)) ** 2)


def long_force(eccentricity: float) -> Array:
    """(2,) half of Sommerfeld's film per length: force against the eccentricity and across it.

    The force is in units of viscosity speed R (R/c)^2, the eccentricity in clearances, 0 to 1 [1].

    Raises:
        ModelError: if the eccentricity is not between 0 and 1.
    """
    e = float(_inside(eccentricity))
    radial = 12 * e**2 / ((2 + e**2) * (1 - e**2))
    return np.array([radial, 6 * np.pi * e / ((2 + e**2) * np.sqrt(1 - e**2))])


def _inside(eccentricity: npt.ArrayLike) -> Array:
    e = np.asarray(eccentricity, dtype=float)
    if not np.all((e > 0) & (e < 1)):
        raise ModelError(f"an eccentricity of {e} clearances must lie between 0 and 1.")
    return e
