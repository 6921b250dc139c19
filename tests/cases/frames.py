"""Frames of Timoshenko beams: nodes that turn, without any finite element program.

Stiffness and consistent mass of the two-node element that is exact in statics: Friedman and
Kosmatka, An improved two-node Timoshenko beam finite element, Comput. Struct. 47 (1993) 473.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, identity

import rom
from rom.model import Interface, Rotations

AXES = np.eye(3)


@dataclass(frozen=True)
class Section:
    """A rectangular bar, breadth along local y, height along local z [m]."""

    breadth: float
    height: float
    E: float = 210e9
    nu: float = 0.3
    rho: float = 7850.0
    rotary: bool = True  # whether sections have rotary inertia

    @property
    def A(self):
        return self.breadth * self.height

    @property
    def second_moments(self):
        """About local y and z [m^4]."""
        return self.breadth * self.height**3 / 12, self.height * self.breadth**3 / 12

    @property
    def G(self):
        return self.E / (2 * (1 + self.nu))

    @property
    def torsion(self):
        """Of a slender rectangle, good enough where all models share it [m^4]."""
        a, b = max(self.breadth, self.height), min(self.breadth, self.height)
        return a * b**3 * (1 / 3 - 0.21 * b / a * (1 - b**4 / (12 * a**4)))


def bending(s, L, second):
    """(4, 4) K and M of (v_1, theta_1, v_2, theta_2) with theta = dv/dx - shear."""
    phi = 12 * s.E * second / (5 / 6 * s.G * s.A * L**2)
    k = s.E * second / ((1 + phi) * L**3)
    K = k * np.array([
        [12, 6 * L, -12, 6 * L], [6 * L, (4 + phi) * L**2, -6 * L, (2 - phi) * L**2],
        [-12, -6 * L, 12, -6 * L], [6 * L, (2 - phi) * L**2, -6 * L, (4 + phi) * L**2],
    ])  # fmt: skip
    M = np.zeros((4, 4))
    for xi, w in zip(*np.polynomial.legendre.leggauss(5), strict=True):
        x = (1 + xi) / 2
        v = np.array([
            1 + phi * (1 - x) - 3 * x**2 + 2 * x**3,
            L * (x - 2 * x**2 + x**3 + phi / 2 * (x - x**2)),
            phi * x + 3 * x**2 - 2 * x**3,
            L * (-(x**2) + x**3 - phi / 2 * (x - x**2)),
        ]) / (1 + phi)  # fmt: skip
        turn = np.array([
            6 / L * (x**2 - x), 1 + phi * (1 - x) - 4 * x + 3 * x**2,
            6 / L * (x - x**2), phi * x - 2 * x + 3 * x**2,
        ]) / (1 + phi)  # fmt: skip
        M += w * L / 2 * s.rho * s.A * np.outer(v, v)
        M += w * L / 2 * s.rho * second * s.rotary * np.outer(turn, turn)
    return K, M


def element(s, L):
    """(12, 12) K and M in local axes, x along the beam; six rows for each node."""
    K, M = np.zeros((2, 12, 12))
    I_y, I_z = s.second_moments
    for a, k, m in ((0, s.E * s.A / L, s.rho * s.A * L),
                    (3, s.G * s.torsion / L, s.rho * (I_y + I_z) * L * s.rotary)):  # fmt: skip
        K[np.ix_([a, a + 6], [a, a + 6])] = k * np.array([[1, -1], [-1, 1]])
        M[np.ix_([a, a + 6], [a, a + 6])] = m / 6 * np.array([[2, 1], [1, 2]])
    for rows, sign, second in (([1, 5, 7, 11], 1.0, I_z), ([2, 4, 8, 10], -1.0, I_y)):
        turn = np.array([1.0, sign, 1.0, sign])
        for A, part in zip((K, M), bending(s, L, second), strict=True):
            A[np.ix_(rows, rows)] += turn[:, None] * part * turn
    return K, M


def frame(points, bars, section, interfaces, up=(0.1, 0.2, 1.0)):
    """FEModel of bars (b, 2) between nodes points (k, 3); interfaces {name: nodes}."""
    points = np.asarray(points, dtype=float)
    n = len(points)
    entries = []
    for one, other in np.asarray(bars):
        along = points[other] - points[one]
        L = np.linalg.norm(along)
        x = along / L
        y = np.cross(up, x) / np.linalg.norm(np.cross(up, x))
        T = np.kron(np.eye(4), np.array([x, y, np.cross(x, y)]))
        dofs = np.concatenate([3 * k + 3 * n * turn + np.arange(3) for k in (one, other)
                               for turn in (0, 1)])  # fmt: skip
        entries.append((np.repeat(dofs, 12), np.tile(dofs, 12),
                        *((T.T @ A @ T).ravel() for A in element(section, L))))  # fmt: skip
    i, j, k, m = map(np.concatenate, zip(*entries, strict=True))
    K, M = (coo_matrix((v, (i, j)), shape=(6 * n, 6 * n)).tocsr() for v in (k, m))
    nodes = np.repeat(np.arange(n), 3)
    rotations = Rotations(nodes, np.tile(AXES, (n, 1)), 3 * n + np.arange(3 * n))
    found = {name: interface(name, np.atleast_1d(own), points, rotations)
             for name, own in interfaces.items()}  # fmt: skip
    return rom.FEModel(K, 0.5 * (M + M.T), points, found, rotations=rotations)


def interface(name, nodes, points, rotations):
    nodes = nodes[np.lexsort(points[nodes].T[::-1])]
    weights = identity(nodes.size, format="csr") / nodes.size
    own = points[nodes]
    return Interface(name, nodes, own, weights, own.mean(axis=0), rotations=rotations.of(nodes))


def cantilever(n=20, length=1.0, section=None, axis=(1.0, 0.0, 0.0)):
    """A straight beam with the interfaces "root" and "tip"."""
    x = np.linspace(0.0, length, n + 1)[:, None] * np.asarray(axis) / np.linalg.norm(axis)
    bars = np.column_stack([np.arange(n), np.arange(1, n + 1)])
    return frame(x, bars, section or Section(0.03, 0.05), {"root": 0, "tip": n})
