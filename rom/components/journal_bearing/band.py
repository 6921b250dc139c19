"""Linear systems whose matrix is a band with dominant diagonals: no pivoting."""

from rom.components.compiled import inner


@inner
def factor(band):
    """Triangular factors of a band matrix in place; its columns are diagonally dominant."""
    n, w = band.shape[0], band.shape[1] // 2
    for k in range(n):
        pivot = 1.0 / band[k, w]
        for i in range(k + 1, min(n, k + w + 1)):
            l = band[i, w + k - i] * pivot
            if l != 0.0:
                band[i, w + k - i] = l
                start = w + k - i
                for m in range(1, w + 1):
                    band[i, start + m] -= l * band[k, w + m]


@inner
def back_substitute(band, X):
    """Solve with the factors for all columns of X, in place."""
    n, w = band.shape[0], band.shape[1] // 2
    for i in range(n):
        for k in range(max(0, i - w), i):
            l = band[i, w + k - i]
            if l != 0.0:
                for m in range(X.shape[1]):
                    X[i, m] -= l * X[k, m]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, min(n, i + w + 1)):
            u = band[i, w + k - i]
            if u != 0.0:
                for m in range(X.shape[1]):
                    X[i, m] -= u * X[k, m]
        for m in range(X.shape[1]):
            X[i, m] /= band[i, w]
