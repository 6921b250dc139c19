"""Eigenvalues of small matrices of second order, with or without damping."""

import numpy as np
from scipy.linalg import eig

from rom.model import Array

ASYMMETRY_RTOL = 1e-9


def modes(C: Array, K: Array, zero: float) -> tuple[Array, Array, Array]:
    """Eigenvalue and vector per mode of y'' + C y' + K y = 0, and all 2 f eigenvalues.

    Frequencies ascend. A pair of real eigenvalues is one mode, its larger value is given.
    Below the share ``zero`` of the highest frequency counts as a motion that nothing holds.
    """
    symmetric = np.abs(K - K.T).max(initial=0.0) <= ASYMMETRY_RTOL * np.abs(K).max(initial=0.0)
    if symmetric and not C.any():
        squares, V = np.linalg.eigh(0.5 * (K + K.T))
        roots = np.sqrt((-squares).astype(complex))
        every = np.concatenate([roots, -roots])
        limit = zero * np.abs(every).max(initial=0.0)
        roots[np.abs(roots) < limit] = 0.0
        order = np.lexsort((-roots.real, roots.imag))
        return roots[order], V[:, order], every
    n, s = len(K), max(np.sqrt(np.linalg.norm(K, 2)), np.linalg.norm(C, 2))
    A = np.block([[np.zeros((n, n)), s * np.eye(n)], [-K / s, -C]])
    every, X = eig(A)
    limit = zero * np.abs(every).max(initial=0.0)
    swing = np.flatnonzero(every.imag > limit)
    swing = swing[np.argsort(every[swing].imag)]
    real = np.flatnonzero(np.abs(every.imag) <= limit)
    real = real[np.argsort(-every[real].real)][: n - swing.size]
    roots = every.copy()
    roots[real] = roots[real].real
    roots[np.abs(roots) < limit] = 0.0
    order = np.concatenate([real, swing])
    V = X[:n, order]
    return roots[order], V / np.linalg.norm(V, axis=0), every


def phases(X: Array) -> Array:
    """(f,) factors of size one that make the largest entry of each column real and positive."""
    if not X.size:
        return np.ones(X.shape[1])
    largest = X[np.abs(X).argmax(axis=0), np.arange(X.shape[1])]
    return np.abs(largest) / largest
