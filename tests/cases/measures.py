"""Areas and volumes of meshes, surfaces of nodes, and memory of this process."""

from pathlib import Path

import numpy as np
from scipy.sparse import diags

from rom.fe.mesh.cell_types import jacobians
from rom.model import Interface

TURN = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]


def areas(mesh):
    found = {}
    for name, rows in mesh.facets.items():
        a, b, c = np.moveaxis(mesh.points[rows[:, :3]], 1, 0)
        found[name] = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return found


def volume(mesh):
    """Volume by the quadrature points of the cells' own rule."""
    kind = mesh.kind
    n = kind.degree + 1
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = (x + 1) / 2, w / 2
    weights = np.array([a * b * c for a in w for b in w for c in w])
    if kind.shape == "tetrahedron":  # Jacobian of the collapsed cube
        u, v = np.repeat(x, n * n), np.tile(np.repeat(x, n), n)
        weights = weights * (1 - u) ** 2 * (1 - v)
    at = kind.gradients(kind.quadrature[0])
    return float((jacobians(mesh.points[mesh.cells], at) @ weights).sum())


def surface(name, n=400):
    """Interface of random nodes with random weights on a surface, turned and moved away."""
    rng = np.random.default_rng(2)
    u, v = rng.uniform(-1, 1, (2, n))
    x = {
        "plane": np.column_stack([u, v, 0 * u]),
        "strip": np.column_stack([u, 1e-3 * v, 0 * u]),
        "cylinder": np.column_stack([np.cos(np.pi * u), np.sin(np.pi * u), 2 * v]),
        "sphere": (lambda y: y / np.linalg.norm(y, axis=1)[:, None])(rng.normal(size=(n, 3))),
        "wave": np.column_stack([u, v, np.sin(2 * u) * np.exp(v)]),
        "line": np.column_stack([u, 0 * u, 0 * u]),
    }[name]
    turn = np.eye(3) if name == "strip" else TURN
    x = 0.05 * x @ turn.T + np.array([0.4, -0.1, 2.0])
    S = diags(rng.uniform(0.5, 1.5, n)).tocsr()
    return Interface(name, np.arange(n), x, S, x.mean(axis=0))


def memory_taken(*kinds):
    """What this process takes now or has taken at most, by the names of Linux [bytes]."""
    lines = Path("/proc/self/status").read_text().splitlines()
    fields = dict(line.split(":", 1) for line in lines)
    return np.array([1024 * int(fields[kind].split()[0]) for kind in kinds])
