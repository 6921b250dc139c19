"""Sheets of triangles."""

import numpy as np

from rom.components.assumed_strain import rectangle


def distorted(n=(4, 4), amount=0.25, seed=1):
    """Unit square whose inner nodes moved at random."""
    X, T = rectangle(n, [(0, 0), (1, 0), (1, 1), (0, 1)])
    inside = np.all((X > 1e-9) & (X < 1 - 1e-9), axis=1)
    X[inside] += amount / n[0] * np.random.default_rng(seed).uniform(-1, 1, (inside.sum(), 2))
    return X, T
