"""Whirl of one shaft on linear bearings: frequencies at a speed, directions, critical speeds.

In axes that do not spin, bending in both planes obeys::

    M q'' + (C + Omega G) q' + K q = 0

with bearings in C and K. Gyroscopic forces part forward from backward whirl.

Source:
    Friswell, Penny, Garvey and Lees, Dynamics of Rotating Machines (2010); see
    docs/theory/rotating_solids.md.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh

from rom.arguments import check_places, symmetric
from rom.components.transmission.shaft import ComplexArray, Shaft, vibrations
from rom.errors import ModelError
from rom.model import Array

LATERAL_DOFS = (0, 1, 3, 4)  # coordinates of a node that bend the shaft
LINE_ORBIT_RTOL = 1e-6  # smallest over largest axis of an orbit that is a line
SUPPORT_STIFFNESS_RTOL = 1e-12  # smallest over largest stiffness of a shaft that is held


@dataclass(frozen=True)
class Support:
    """A linear bearing.

    Attributes:
        stiffness: across the shaft [N/m], a number or a (2, 2) matrix.
        damping: [N s/m], a scalar or a (2, 2) matrix likewise.
    """

    stiffness: npt.ArrayLike
    damping: npt.ArrayLike = 0.0


@dataclass(frozen=True)
class ShaftWhirl:
    """Whirl of a shaft at one speed, lowest first.

    Attributes:
        values: (m,) eigenvalues with a positive imaginary part [rad/s].
        shapes: (n, m) complex coordinates of the shaft, as in `Shaft.matrices`.
        direction: (m,) [1] +1 forward, with the rotation, -1 backward, 0 along a line.
    """

    values: ComplexArray
    shapes: ComplexArray
    direction: Array

    @property
    def omega(self) -> Array:
        """(m,) circular frequencies of the damped whirl [rad/s]."""
        return self.values.imag

    @property
    def frequencies(self) -> Array:
        """(m,) its frequencies [Hz]."""
        return self.omega / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """(m,) share of critical damping [1]; negative where whirl grows."""
        return -self.values.real / np.abs(self.values)


def shaft_whirl(
    shaft: Shaft, supports: Mapping[int, Support], speed: float, *, n: int | None = None
) -> ShaftWhirl:
    """Whirl frequencies of a shaft on bearings.

    Supports are {node: bearing}, the speed of rotation is positive from X to Y [rad/s]; the n
    lowest frequencies are found, None for all.

    Raises:
        ModelError: if a bearing sits beyond the shaft, or the bearings leave a rigid motion free.
    """
    M, C, K, G, rows = _matrices(shaft, supports)
    values, vectors = vibrations(M, C + speed * G, K)
    keep = np.flatnonzero(values.imag > 0)
    keep = keep[np.argsort(values[keep].imag, kind="stable")][:n]
    shapes = np.eye(shaft.n)[:, rows] @ vectors[:, keep]
    turn = 1.0 if speed == 0 else np.sign(speed)
    return ShaftWhirl(values[keep], shapes, _direction(shapes, M) * turn)


def critical_speeds(shaft: Shaft, supports: Mapping[int, Support]) -> tuple[Array, Array]:
    """(m,) speeds [rad/s] at which a whirl is as fast as the rotation, and (m,) its directions.

    Supports are {node: bearing}, their stiffness symmetric; damping is left out. Speeds ascend,
    directions are as in `ShaftWhirl`. A thin disc may leave fewer forward speeds than backward
    ones: its own moment stiffens the shaft ever more.

    Raises:
        ModelError: as in `shaft_whirl`, or if a stiffness is not symmetric.
    """
    M, _, K, G, rows = _matrices(shaft, supports)
    symmetric("the stiffness of the bearings", K, 1e-9, error=ModelError)
    inverse, vectors = eigh(M - 1j * G, K)
    keep = np.flatnonzero(inverse > 1e-12 * inverse.max())[::-1]
    shapes = np.eye(shaft.n)[:, rows] @ vectors[:, keep]
    return 1 / np.sqrt(inverse[keep]), _direction(shapes, M)


def _matrices(
    shaft: Shaft, supports: Mapping[int, Support]
) -> tuple[Array, Array, Array, Array, npt.NDArray[np.int64]]:
    """Mass, damping, stiffness, gyroscopic matrix of bending, and its coordinates."""
    (M, K, G), z = shaft.matrices(), np.asarray(shaft.z, dtype=float)
    C, against, arms = np.zeros_like(K), np.zeros((4, 4)), (z - z.mean()) / np.ptp(z)
    for node, support in supports.items():
        check_places("the node of a bearing", node, z.size, error=ModelError)
        at, R = slice(6 * node, 6 * node + 2), np.kron([1.0, arms[node]], np.eye(2))
        k = _square(support.stiffness)
        K[at, at] += k
        C[at, at] += _square(support.damping)
        against += R.T @ k @ R  # both translations and both tilts
    size = np.linalg.svd(against, compute_uv=False)
    if not size[-1] > SUPPORT_STIFFNESS_RTOL * size[0]:
        text = f"bearings at the nodes {sorted(supports)} leave a rigid motion of the shaft free"
        raise ModelError(f"{text}; give it two that push back in both directions.")
    rows = (6 * np.arange(z.size)[:, None] + LATERAL_DOFS).ravel()
    M, C, K, G = (A[np.ix_(rows, rows)] for A in (M, C, K, G))
    return M, C, K, G, rows


def _square(value: npt.ArrayLike) -> Array:
    given = np.asarray(value, dtype=float)
    if given.shape not in ((), (2, 2)):
        raise ModelError(f"a bearing needs a number or (2, 2) matrix, not the shape {given.shape}.")
    return given * np.eye(2) if given.ndim == 0 else given


def _direction(shapes: ComplexArray, M: Array) -> Array:
    """+1 where orbits of q = Re(shape e^{i w t}) turn from X to Y, by the sense of most mass."""
    x, y = shapes[0::6], shapes[1::6]
    weight = np.diag(M)[0::4][:, None]
    area = (weight * (x.conj() * y).imag).sum(axis=0)
    size = 0.5 * (weight * (np.abs(x) ** 2 + np.abs(y) ** 2)).sum(axis=0)
    return np.where(np.abs(area) > LINE_ORBIT_RTOL * size, -np.sign(area), 0.0)
