"""Linear systems whose matrix is a band with dominant diagonals: no pivoting."""

from rom.mbs.kernels.compiled import inner


@inner
def factor(band, n, w):
    """Triangular factors of n rows of half width w in place; columns are diagonally dominant."""
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
def back_substitute(band, w, x):
    """Solve with the factors, in place."""
    n = x.size
    for i in range(n):
        total = x[i]
        for k in range(max(0, i - w), i):
            total -= band[i, w + k - i] * x[k]
        x[i] = total
    for i in range(n - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, min(n, i + w + 1)):
            total -= band[i, w + k - i] * x[k]
        x[i] = total / band[i, w]


@inner
def back_substitute_transposed(band, n, w, X):
    """Solve with the transposed factors for all columns of X, in place."""
    for i in range(n):
        pivot = 1.0 / band[i, w]
        for m in range(X.shape[1]):
            X[i, m] *= pivot
        for k in range(i + 1, min(n, i + w + 1)):
            u = band[i, w + k - i]
            if u != 0.0:
                for m in range(X.shape[1]):
                    X[k, m] -= u * X[i, m]
    for i in range(n - 1, -1, -1):
        for k in range(max(0, i - w), i):
            l = band[i, w + k - i]
            if l != 0.0:
                for m in range(X.shape[1]):
                    X[k, m] -= l * X[i, m]
