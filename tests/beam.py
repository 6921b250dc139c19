"""Planar Euler-Bernoulli beam of Hermite elements, L = EI = m = 1."""

import numpy as np

N = 40  # elements


def hermite_beam(n=N):
    """K and M (2 n + 2 dofs: w, theta per node) of the free beam."""
    h = 1.0 / n
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) / h**3
    m = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    lengths = np.outer([1, h, 1, h], [1, h, 1, h])
    K, M = np.zeros((2 * n + 2,) * 2), np.zeros((2 * n + 2,) * 2)
    for e in range(n):
        dofs = slice(2 * e, 2 * e + 4)
        K[dofs, dofs] += k * lengths
        M[dofs, dofs] += m * lengths * h / 420
    return K, M


ENDS = [0, 1, 2 * N, 2 * N + 1]
FREE_FREE = 22.37328
CANTILEVER = 3.516015
PINNED = 9.869604
