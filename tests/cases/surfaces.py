"""Surfaces of nodes."""

import numpy as np
from scipy.sparse import diags

from rom.model import Interface

TURN = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]


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
