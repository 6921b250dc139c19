"""A test bed like an aircraft: beams with the dimensions of GARTEUR SM-AG19, without its layer.

Fuselage, wing, drums at the wing tips, fin and tailplane of aluminium. Neutral axes do not meet;
the parts are joined rigidly, or by joints that give way to moments: bolted plates do, and what they
give is hardly known before a test.

Source:
    Dimensions of the test bed of Balmes and Wright, GARTEUR group on ground vibration testing,
    IMAC XV (1997).
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from rom.errors import ConfigError
from rom.model import Array, Index, Material
from rom.rotation import skew

ALUMINIUM = Material(E=72e9, nu=0.3, rho=2700.0)


@dataclass(frozen=True, slots=True)
class Part:
    """Beams of one rectangular section."""

    name: str
    path: tuple[tuple[float, float, float], ...]  # (k, 3) corners its neutral axis passes [m]
    broad: tuple[float, float, float]  # unit vector along the broad side of the section
    size: tuple[float, float]  # broad and thin side [m]


X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
THIN = (0.1, 0.01)
PARTS = (
    Part(  # hangs at two of its corners
        "fuselage",
        ((0.6, 0, 0), (0, 0, 0), (-0.29, 0, 0), (-0.85, 0, 0), (-0.9, 0, 0)),
        Z,
        (0.15, 0.05),
    ),
    Part(
        "wing",
        ((0, 1, 0.096), (0, 0.95, 0.096), (0, 0, 0.096), (0, -0.95, 0.096), (0, -1, 0.096)),
        X,
        THIN,
    ),
    Part("left drum", ((0.2, 0.95, 0.106), (0, 0.95, 0.106), (-0.2, 0.95, 0.106)), Y, THIN),
    Part("right drum", ((0.2, -0.95, 0.106), (0, -0.95, 0.106), (-0.2, -0.95, 0.106)), Y, THIN),
    Part("fin", ((-0.85, 0, 0.05), (-0.85, 0, 0.35)), X, THIN),
    Part("tailplane", ((-0.85, 0.2, 0.355), (-0.85, 0, 0.355), (-0.85, -0.2, 0.355)), X, THIN),
)
LINKS = (  # a point of each part after the first follows a point of another
    ((0, 0, 0.096), (0, 0, 0)),
    ((0, 0.95, 0.106), (0, 0.95, 0.096)),
    ((0, -0.95, 0.106), (0, -0.95, 0.096)),
    ((-0.85, 0, 0.05), (-0.85, 0, 0)),
    ((-0.85, 0, 0.355), (-0.85, 0, 0.35)),
)


@dataclass(frozen=True, slots=True)
class Airframe:
    """The free structure, taken apart into what can be wrong with it.

    Attributes:
        points: (n, 3) nodes [m].
        beams: (m, 2) nodes of each element.
        K: {(part, kind): (r, r)} stiffness [N/m, N m/rad] by part and kind of deformation; of the
            kind "joint" is what holds the part, if it gives way.
        M: {part: (r, r)} mass by part [kg, kg m^2].
        T: (6 n, r) displacements and rotations of all nodes [m, rad] by independent coordinates.
    """

    points: Array
    beams: Index
    K: dict[tuple[str, str], Array]
    M: dict[str, Array]
    T: Array

    def node(self, point: npt.ArrayLike) -> int:
        """Number of the node at a point (3,) [m].

        Raises:
            ConfigError: if none is within a tenth of a millimetre.
        """
        far = np.linalg.norm(self.points - np.asarray(point, dtype=float), axis=1)
        if far.min() > 1e-4:
            raise ConfigError(f"no node at {point!r}; there is one at {self.points[far.argmin()]}.")
        return int(far.argmin())

    def sensor(self, point: npt.ArrayLike, axis: int) -> Array:
        """(r,) row [1] of the displacement of the node at a point (3,) [m] along an axis 0, 1, 2.

        Raises:
            ConfigError: if there is no node.
        """
        return self.T[6 * self.node(point) + axis]


def airframe(
    size: float = 0.05, *, material: Material = ALUMINIUM, joints: float = np.inf
) -> Airframe:
    """The structure with beam elements no longer than ``size`` [m].

    The section of a beam is rigid: no shear, no warping; masses are consistent. Each of the five
    joints gives way to rotation about each axis by the same stiffness [N m/rad].

    Raises:
        ConfigError: for a size or a stiffness that is not positive.
    """
    if not (size > 0 and joints > 0):
        raise ConfigError(f"size = {size} m, joints = {joints} N m/rad: both must be positive.")
    points, beams = _meshed(size)
    T = _linked(points, np.isinf(joints))
    K, M = {}, {}
    if np.isfinite(joints):
        for part, link in zip(PARTS[1:], LINKS, strict=True):
            a, b = (T[6 * n + 3 : 6 * n + 6] for n in _ends(points, link))
            K[part.name, "joint"] = joints * (a - b).T @ (a - b)
    for part in PARTS:
        own = _summed(points, beams[part.name], part, material)
        M[part.name] = T.T @ own.pop("mass") @ T
        K |= {(part.name, kind): T.T @ A @ T for kind, A in own.items()}
    return Airframe(points, np.vstack(list(beams.values())), K, M, T)


def _meshed(size: float) -> tuple[Array, dict[str, Index]]:
    """Nodes (n, 3), and those (m, 2) of the elements of each part."""
    points: list[Array] = []
    beams = {}
    for part in PARTS:
        path, first = np.array(part.path, dtype=float), len(points)
        points.append(path[0])
        for a, b in pairwise(path):
            n = int(np.ceil(np.linalg.norm(b - a) / size - 1e-9))
            points += [a + (b - a) * k / n for k in range(1, n + 1)]
        beams[part.name] = first + np.array(list(pairwise(range(len(points) - first))))
    return np.array(points), beams


def _linked(points: Array, rigid: bool) -> Array:
    """T of u = T a, with the links' first points following the second ones, if rigid also turning.

    A link turns with its second point.
    """
    T = np.eye(6 * len(points))
    dependent: list[int] = []
    follow = 6 if rigid else 3
    for link in LINKS:
        a, b = _ends(points, link)
        T[6 * a : 6 * a + follow] = T[6 * b : 6 * b + follow]
        T[6 * a : 6 * a + 3] -= skew(points[a] - points[b]) @ T[6 * b + 3 : 6 * b + 6]
        dependent += range(6 * a, 6 * a + follow)
    return np.delete(T, dependent, axis=1)


def _ends(points: Array, link: npt.ArrayLike) -> tuple[int, int]:
    """Numbers of the nodes at the two points of a link."""
    first, second = (int(np.abs(points - p).sum(axis=1).argmin()) for p in np.asarray(link))
    return first, second


def _summed(points: Array, beams: Index, part: Part, material: Material) -> dict[str, Array]:
    """Matrices of a part, by kind of deformation and of its mass."""
    found: dict[str, Array] = {}
    for i, j in beams:
        along = points[j] - points[i]
        L = float(np.linalg.norm(along))
        e = along / L
        Q = block_diag(*[np.array([e, part.broad, np.cross(e, part.broad)])] * 4)
        dofs = np.r_[6 * i : 6 * i + 6, 6 * j : 6 * j + 6]
        for kind, blocks in _element(L, part, material).items():
            local = np.zeros((12, 12))
            for own, block in blocks:
                local[np.ix_(own, own)] = block
            A = found.setdefault(kind, np.zeros((6 * len(points),) * 2))
            A[np.ix_(dofs, dofs)] += Q.T @ local @ Q
    return found


# local dofs: u v w and rotations about x y z of both ends; x along the beam, y along the broad side
AXIAL_DOFS, TWIST_DOFS = [0, 6], [3, 9]
IN_Y, IN_Z = [1, 5, 7, 11], [2, 4, 8, 10]  # deflection and slope; w' is minus the rotation
TURNED = np.outer([1.0, -1.0, 1.0, -1.0], [1.0, -1.0, 1.0, -1.0])
BAR_K, BAR_M = np.array([[1.0, -1], [-1, 1]]), np.array([[2.0, 1], [1, 2]]) / 6
BEAM_K = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) / 12
BEAM_M = (
    np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420
)


def _element(L: float, part: Part, material: Material) -> dict[str, list[tuple[list[int], Array]]]:
    """Blocks of a beam and their dofs by kind of deformation, bending across the thin side."""
    (a, b), E, scale = part.size, material.E, np.array([1, L, 1, L])
    m, GJ = material.rho * a * b * L, E / (2 * (1 + material.nu)) * torsion_constant(a, b)
    k, h = (A * np.outer(scale, scale) for A in (E / L**3 * BEAM_K, m * BEAM_M))
    along, about = (AXIAL_DOFS, m * BAR_M), (TWIST_DOFS, m * (a**2 + b**2) / 12 * BAR_M)
    return {
        "axial": [(AXIAL_DOFS, E * a * b / L * BAR_K)],
        "torsion": [(TWIST_DOFS, GJ / L * BAR_K)],
        "bending": [(IN_Z, a * b**3 * k * TURNED)],
        "sideways": [(IN_Y, a**3 * b * k)],
        "mass": [along, about, (IN_Y, h), (IN_Z, h * TURNED)],
    }


def torsion_constant(a: float, b: float) -> float:
    """Of a rectangle a >= b [m^4]: Saint-Venant's series."""
    a, b = max(a, b), min(a, b)
    k = np.arange(1, 40, 2)
    series = (np.tanh(k * np.pi * a / (2 * b)) / k**5).sum()
    return float(a * b**3 / 3 * (1 - 192 / np.pi**5 * b / a * series))
