"""A tube of eight-node bricks about Z in NumPy: its rim bears teeth, its bore a film."""

import numpy as np

from cases.solid import CORNERS, GAUSS, STEEL, assembled, quads_of, shape_functions, surface_of
from rom.model import FEModel, Interface

STEPS = ((CORNERS + 1) / 2).astype(int)  # of a corner in radius, angle, height
QUAD = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def brick(x, material):
    """Stiffness and mass (24, 24) of a brick with corners x (8, 3)."""
    K, M = np.zeros((24, 24)), np.zeros((24, 24))
    for xi in np.array(np.meshgrid(GAUSS, GAUSS, GAUSS)).reshape(3, -1).T:
        N, dN = shape_functions(xi)
        J = dN.T @ x
        g, weight, B = dN @ np.linalg.inv(J).T, np.linalg.det(J), np.zeros((6, 24))
        for n, (a, b, c) in enumerate(g):
            B[:, 3 * n : 3 * n + 3] = [
                [a, 0, 0], [0, b, 0], [0, 0, c], [0, c, b], [c, 0, a], [b, a, 0],
            ]  # fmt: skip
        K += weight * B.T @ material.stiffness @ B
        M += weight * material.rho * np.kron(np.outer(N, N), np.eye(3))
    return K, M


def tube(inner=0.02, outer=0.035, length=0.08, cells=(24, 2, 6), material=STEEL, ends=1):
    """FEModel of a tube about the origin with the interfaces "rim", "bore", "low" and "high".

    Rim and bore end so many cells before the ends. Corners lie on circles whose polygons have the
    area of the tube.
    """
    n, n_r, n_z = cells
    theta = 2 * np.pi / n * np.arange(n)
    r = np.linspace(inner, outer, n_r + 1) * np.sqrt(2 * np.pi / n / np.sin(2 * np.pi / n))
    t, rr, z = np.meshgrid(theta, r, np.linspace(-length / 2, length / 2, n_z + 1), indexing="ij")
    points = np.stack([rr * np.cos(t), rr * np.sin(t), z], axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(t.shape)
    nodes = np.array([[number[(i + a) % n, j + r, k + h] for r, a, h in STEPS]
                      for i, j, k in np.ndindex(n, n_r, n_z)])  # fmt: skip
    dofs = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1)
    blocks = np.array([brick(points[corners], material) for corners in nodes])
    K, M = (assembled(dofs, blocks[:, kind], points.size) for kind in (0, 1))
    turned = np.concatenate([number, number[:1]])
    between = slice(ends, n_z + 1 - ends)
    faces = {"rim": turned[:, -1, between], "bore": turned[:, 0, between], "low": turned[:, :, 0],
             "high": turned[:, :, -1]}  # fmt: skip
    outside = turned[:, -1], turned[:, ::-1, 0], turned[:, :, -1], turned[::-1, 0]
    interfaces = {name: _interface(name, x, points) for name, x in faces.items()}
    K, M = (0.5 * (A + A.T) for A in (K, M))
    return FEModel(K, M, points, interfaces, surface=surface_of(outside))


def _interface(name, face, points):
    """The surface through a grid of nodes, with the integrals of products of its functions."""
    nodes, quads = np.unique(quads_of(face), return_inverse=True)
    quads = quads.reshape(-1, 4)
    S = np.zeros((len(quads), 4, 4))
    for xi in np.array(np.meshgrid(GAUSS, GAUSS)).reshape(2, -1).T:
        N = (1 + QUAD * xi).prod(axis=1) / 4
        dN = QUAD * (1 + QUAD * xi)[:, ::-1] / 4
        one, two = np.einsum("na,qnx->aqx", dN, points[nodes][quads])
        area = np.linalg.norm(np.cross(one, two), axis=1)
        S += area[:, None, None] * np.outer(N, N)
    S, x = assembled(quads, S, nodes.size), points[nodes]
    centre = np.zeros(3) if name in ("rim", "bore") else x.mean(axis=0)
    return Interface(name, nodes, x, 0.5 * (S + S.T), centre)
