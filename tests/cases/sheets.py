"""Sheets of triangles."""

import numpy as np

from rom.components.assumed_strain import Metal, in_space, rectangle, sheet


def dofs(where, axes=(0, 1)):
    """Of nodes, by a condition (n,), along some axes."""
    return (2 * np.flatnonzero(where)[:, None] + np.array(axes)).ravel()


def distorted(n=(4, 4), amount=0.25, seed=1):
    """Unit square whose inner nodes moved at random."""
    X, T = rectangle(n, [(0, 0), (1, 0), (1, 1), (0, 1)])
    inside = np.all((X > 1e-9) & (X < 1 - 1e-9), axis=1)
    X[inside] += amount / n[0] * np.random.default_rng(seed).uniform(-1, 1, (inside.sum(), 2))
    return X, T


def strip(n=(40, 4), nu=0.3, thickness=0.002, diagonal="/"):
    """Strip of steel with two rows of nodes at each end: sheet, material, model."""
    X, T = rectangle(n, [(0, 0), (0.4, 0), (0.4, 0.04), (0, 0.04)], diagonal)
    metal = Metal(210e9, nu, 7850.0)
    body = sheet(X, T, thickness=thickness)
    ends = {"root": np.flatnonzero(X[:, 0] < 0.0101), "tip": np.flatnonzero(X[:, 0] > 0.3899)}
    return body, metal, in_space(body, metal, ends)
