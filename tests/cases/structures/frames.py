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


def plate(size, h, cells, up=(0.0, 0.0, 1.0), E=210e9, nu=0.3, rho=7850.0):
    """FEModel of a thin plate, six rows a node, with nothing about its normals.

    Bending by Adini, Clough and Melosh's rectangle of twelve dofs, membrane by the bilinear one.
    Interfaces: "edge", "corner", "opposite"; ``up`` is the normal.
    """
    cells, (dx, dy) = np.array(cells), np.array(size) / cells
    powers = [(i, j) for i in range(4) for j in range(4) if i + j < 4] + [(3, 1), (1, 3)]
    corners = np.array([(0, 0), (dx, 0), (dx, dy), (0, dy)])

    def terms(x, y, a=0, b=0):
        """Derivatives of the monomials, a times in x and b times in y."""
        return np.array([_falling(i, a) * _falling(j, b) * x ** max(i - a, 0) * y ** max(j - b, 0)
                         for i, j in powers])  # fmt: skip

    # deflection, and turns about x and y, at the corners
    C = np.linalg.inv(np.vstack([[terms(x, y), terms(x, y, 0, 1), -terms(x, y, 1, 0)]
                                 for x, y in corners]))  # fmt: skip
    D = E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    Kb, Mb, Km, Ms = np.zeros((12, 12)), np.zeros((12, 12)), np.zeros((8, 8)), np.zeros((4, 4))
    points, weights = np.polynomial.legendre.leggauss(4)
    for p, wp in zip(points, weights, strict=True):
        for q, wq in zip(points, weights, strict=True):
            x, y, w = dx * (1 + p) / 2, dy * (1 + q) / 2, wp * wq * dx * dy / 4
            B = np.array([terms(x, y, 2, 0), terms(x, y, 0, 2), 2 * terms(x, y, 1, 1)]) @ C
            Kb += w * h**3 / 12 * B.T @ D @ B
            Mb += w * rho * h * np.outer(terms(x, y) @ C, terms(x, y) @ C)
            s, t = x / dx, y / dy
            N = np.array([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t])
            gx = np.array([-(1 - t), 1 - t, t, -t]) / dx
            gy = np.array([-(1 - s), -s, s, 1 - s]) / dy
            B = np.zeros((3, 8))
            B[0, ::2], B[1, 1::2], B[2, ::2], B[2, 1::2] = gx, gy, gy, gx
            Km += w * h * B.T @ D @ B
            Ms += w * rho * h * np.outer(N, N)
    K, M = np.zeros((2, 24, 24))  # ux uy uz rx ry rz of each corner
    bend = np.array([6 * k + a for k in range(4) for a in (2, 3, 4)])
    flat = np.array([6 * k + a for k in range(4) for a in (0, 1)])
    K[np.ix_(bend, bend)], M[np.ix_(bend, bend)] = Kb, Mb
    K[np.ix_(flat, flat)], M[np.ix_(flat, flat)] = Km, np.kron(Ms, np.eye(2))
    z = np.asarray(up) / np.linalg.norm(up)
    x = np.cross([0.0, 1.0, 0.0], z) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], z))
    Q = np.array([x, np.cross(z, x), z])
    T = np.kron(np.eye(8), Q)
    number = np.arange((cells + 1).prod()).reshape(cells + 1)
    n = number.size
    entries = []
    for i in range(cells[0]):
        for j in range(cells[1]):
            own = number[[i, i + 1, i + 1, i], [j, j, j + 1, j + 1]]
            dofs = np.concatenate([3 * k + 3 * n * t + np.arange(3) for k in own for t in (0, 1)])
            entries.append((np.repeat(dofs, 24), np.tile(dofs, 24)))
    i, j = map(np.concatenate, zip(*entries, strict=True))
    K, M = (coo_matrix((np.tile((T.T @ A @ T).ravel(), cells.prod()), (i, j)), shape=(6 * n, 6 * n))
            .tocsr() for A in (K, M))  # fmt: skip
    x, y = np.meshgrid(*(np.linspace(0, s, c + 1) for s, c in zip(size, cells, strict=True)),
                       indexing="ij")  # fmt: skip
    at = np.column_stack([x.ravel(), y.ravel(), np.zeros(n)]) @ Q
    turning = Rotations(np.repeat(np.arange(n), 3), np.tile(AXES, (n, 1)), 3 * n + np.arange(3 * n))
    edge = np.unique(np.r_[number[0], number[-1], number[:, 0], number[:, -1]])
    sides = {"edge": edge, "corner": number[:2, :2].ravel(), "opposite": number[-2:, -2:].ravel()}
    found = {name: interface(name, own, at, turning) for name, own in sides.items()}
    return rom.FEModel(0.5 * (K + K.T), 0.5 * (M + M.T), at, found, rotations=turning)


def _falling(i, a):
    """i (i - 1) ... of a factors."""
    return float(np.prod([i - k for k in range(a)]))
