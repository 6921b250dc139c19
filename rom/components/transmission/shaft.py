"""Spinning shafts as Timoshenko beams with discs.

Six coordinates per node, u_x, u_y, u_z, phi_x, phi_y, phi_z, in axes that do not spin; the shaft
lies along Z. Shape functions satisfy the static equations of the element (Przemieniecki, 1968).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.polynomial.polynomial import polyder, polyval
from scipy.linalg import eig

from rom.errors import ModelError
from rom.model import Array

GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(4)
ComplexArray = npt.NDArray[np.complex128]
STEEL = (206e9, 0.3, 7850.0)
MIRROR = np.array([1, -1, 1, -1])  # displacements and turns of a node seen from another side


@dataclass(frozen=True, slots=True)
class Disc:
    """A rigid disc on a shaft.

    Attributes:
        node: where.
        mass: [kg].
        diametral, polar: moments of inertia [kg m^2].
    """

    node: int
    mass: float
    diametral: float
    polar: float

    @classmethod
    def of_ring(
        cls, node: int, *, outer: float, inner: float, width: float, rho: float = 7850.0
    ) -> "Disc":
        """A ring on a shaft.

        Outer [m] and inner [m] are diameters, the width [m] lies along the shaft, rho is the
        density [kg/m^3].
        """
        m = rho * np.pi / 4 * (outer**2 - inner**2) * width
        squares = outer**2 + inner**2
        return cls(node, m, m * (squares / 16 + width**2 / 12), m * squares / 8)

    def add_to(self, M: Array, G: Array, R: Array) -> None:
        """Add its mass to M [kg, kg m^2] and its gyroscopic matrix to G [kg m^2] of a shaft.

        Its seat moves by R (6, n) [m, rad].
        """
        M += R.T @ np.diag([*[self.mass] * 3, *[self.diametral] * 2, self.polar]) @ R
        G += self.polar * (np.outer(R[3], R[4]) - np.outer(R[4], R[3]))


@dataclass(frozen=True)
class Shaft:
    """A straight shaft.

    Attributes:
        z: (n,) nodes along the axis [m].
        diameter: (n - 1,) of the pieces between them [m], or one number.
        discs: on the shaft.
        material: Young's modulus [Pa], Poisson's ratio, density [kg/m^3].
        bore: (n - 1,) diameters of a hole along the axis [m], or one number.

    Raises:
        ModelError: for pieces that no shaft has, or a disc beyond it.
    """

    z: npt.ArrayLike
    diameter: npt.ArrayLike
    discs: Sequence[Disc] = ()
    material: tuple[float, float, float] = STEEL
    bore: npt.ArrayLike = 0.0

    def __post_init__(self) -> None:
        z = np.asarray(self.z, dtype=float)
        d, hole = (np.asarray(x, dtype=float) for x in (self.diameter, self.bore))
        if z.size < 2 or np.any(np.diff(z) <= 0) or np.any(d <= 0):
            fault = f"z = {z.tolist()} must ascend, diameter = {d.tolist()} be positive."
        elif np.any(hole < 0) or np.any(hole >= d):
            fault = f"bores of {hole.tolist()} m must be smaller than {d.tolist()} m."
        elif any(not 0 <= disc.node < z.size for disc in self.discs):
            fault = f"each disc must sit at a node from 0 to {z.size - 1}."
        else:
            return
        raise ModelError(fault)

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return 6 * np.asarray(self.z).size

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return self.n // 6

    def rows(self, node: int) -> Array:
        """(6, n) motion of a node per coordinate [1]."""
        return np.eye(self.n)[6 * node : 6 * node + 6]

    def rigid(self) -> Array:
        """(n, 6) coordinates of rigid motions: along the axes, and about them at z = 0 [1, m]."""
        found = np.tile(np.eye(6), (self.nodes, 1))
        z = np.asarray(self.z, dtype=float)
        found[0::6, 4], found[1::6, 3] = z, -z
        return found

    def matrices(self) -> tuple[Array, Array, Array]:
        """(n, n) mass [kg], stiffness [N/m], gyroscopic matrix per speed of rotation [kg m^2]."""
        M, K, G = np.zeros((3, self.n, self.n))
        sizes = np.broadcast_arrays(np.diff(np.asarray(self.z, float)), self.diameter, self.bore)
        for k, (l, d, hole) in enumerate(np.transpose(sizes)):
            at = slice(6 * k, 6 * k + 12)
            for whole, part in zip((M, K, G), _beam(l, d, hole, *self.material), strict=True):
                whole[at, at] += part
        for disc in self.discs:
            disc.add_to(M, G, self.rows(disc.node))
        return M, K, G


def vibrations(M: Array, C: Array, K: Array) -> tuple[ComplexArray, ComplexArray]:
    """(2n,) eigenvalues [1/s] and (n, 2n) shapes of M q'' + C q' + K q = 0."""
    below = -np.linalg.solve(M, np.hstack([K, C]))
    values, vectors = eig(np.vstack([np.eye(len(M), 2 * len(M), len(M)), below]))
    return values.astype(complex), vectors[: len(M)]


def _beam(
    l: float, d: float, hole: float, E: float, nu: float, rho: float
) -> tuple[Array, Array, Array]:
    """(12, 12) mass, stiffness and gyroscopic matrix of a round piece.

    Share of the section that carries shear: Cowper, J. Appl. Mech. 33 (1966) 335.
    """
    area, I = np.pi * (d**2 - hole**2) / 4, np.pi * (d**4 - hole**4) / 64
    shear, m = E / (2 * (1 + nu)), (hole / d) ** 2
    kappa = 6 * (1 + nu) * (1 + m) ** 2 / ((7 + 6 * nu) * (1 + m) ** 2 + (20 + 12 * nu) * m)
    stiff = kappa * shear * area
    phi = 12 * E * I / (stiff * l**2)
    M, K, G = np.zeros((3, 12, 12))
    for x, w in zip((1 + GAUSS_POINTS) / 2, GAUSS_WEIGHTS * l / 2, strict=True):
        N, T, dN, dT = _shapes(x, l, phi)
        ux, py, uy, px = (_row(c, v) for c, v in ((0, N), (4, T), (1, N), (3, -T)))
        M += w * rho * (area * (np.outer(ux, ux) + np.outer(uy, uy)))
        M += w * rho * I * (np.outer(px, px) + np.outer(py, py))
        G += w * 2 * rho * I * (np.outer(px, py) - np.outer(py, px))
        for c, turn in ((0, 4), (1, 3)):
            bend, slide = _row(turn, dT), _row(c, dN - T)
            K += w * (E * I * np.outer(bend, bend) + stiff * np.outer(slide, slide))
        line, slope = np.array([1 - x, x]), np.array([-1, 1]) / l
        for c, inertia, spring in ((2, area, E * area), (5, 2 * I, shear * 2 * I)):
            at = np.ix_([c, 6 + c], [c, 6 + c])
            M[at] += w * rho * inertia * np.outer(line, line)
            K[at] += w * spring * np.outer(slope, slope)
    return M, K, G


def _shapes(x: float, l: float, phi: float) -> tuple[Array, Array, Array, Array]:
    """Deflection and turn of the section per (u, turn) of both ends, and their slopes."""
    h, m = phi / 2, 1 / (1 + phi)  # rows of coefficients belong to powers of x
    linear, square = [-phi, l * (1 + h), phi, -l * h], [-3, -l * (2 + h), 3, l * (h - 1)]
    N = m * np.array([[1 + phi, 0, 0, 0], linear, square, [2, l, -2, l]])
    linear, square = [-6 / l, -4 - phi, 6 / l, phi - 2], [6 / l, 3, -6 / l, 3]
    T = m * np.array([[0, 1 + phi, 0, 0], linear, square])
    return polyval(x, N), polyval(x, T), polyval(x, polyder(N)) / l, polyval(x, polyder(T)) / l


def _row(component: int, values: Array) -> Array:
    """Shape functions in the columns of a displacement and of the turn that belongs to it.

    `component` is what the row yields: 0 or 4 in the plane X-Z, 1 or 3 in the plane Y-Z, where the
    slope of u_y is -phi_x.
    """
    row, across = np.zeros(12), component in (0, 4)
    row[[0, 4, 6, 10] if across else [1, 3, 7, 9]] = values * (1 if across else MIRROR)
    return row
