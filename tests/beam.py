"""Planar Euler-Bernoulli beam of Hermite elements, L = EI = m = 1, after which claims are tested."""

import numpy as np

N = 40  # elements


def hermite_beam(n=N):
    """K and M (2 n + 2 dofs: w, theta per node) of the free beam."""
    h = 1.0 / n
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                  [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3  # fmt: skip
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                  [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]])  # fmt: skip
    K, M = np.zeros((2 * n + 2,) * 2), np.zeros((2 * n + 2,) * 2)
    for e in range(n):
        dofs = slice(2 * e, 2 * e + 4)
        K[dofs, dofs] += k
        M[dofs, dofs] += m * h / 420
    return K, M


ENDS = [0, 1, 2 * N, 2 * N + 1]
FREE_FREE = 22.37328
CANTILEVER = 3.516015
PINNED = 9.869604
