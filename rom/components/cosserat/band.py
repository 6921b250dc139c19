"""Elimination along the rod: a banded system solved from one end to the other and back."""

from rom.components.compiled import inner, kernel
from rom.components.cosserat.energy import HALF_BANDWIDTH


@kernel
def hold(A, B, free):
    """Leave the increments of held dofs at zero."""
    n = A.shape[0]
    for row in range(n):
        for k in range(2 * HALF_BANDWIDTH + 1):
            column = row + k - HALF_BANDWIDTH
            if 0 <= column < n and not (free[row] and free[column]):
                A[row, k] = 1.0 if row == column else 0.0
        if not free[row]:
            B[row, :] = 0.0


@inner
def exchange(A, B, k):
    """Bring the largest entry of column k below the diagonal up to row k, and return it."""
    n, m = B.shape
    best = k
    for i in range(k + 1, min(k + HALF_BANDWIDTH, n - 1) + 1):
        if abs(A[i, k - i + HALF_BANDWIDTH]) > abs(A[best, k - best + HALF_BANDWIDTH]):
            best = i
    if best != k:
        for j in range(k, min(k + 2 * HALF_BANDWIDTH, n - 1) + 1):
            kept = A[k, j - k + HALF_BANDWIDTH]
            A[k, j - k + HALF_BANDWIDTH] = A[best, j - best + HALF_BANDWIDTH]
            A[best, j - best + HALF_BANDWIDTH] = kept
        for c in range(m):
            B[k, c], B[best, c] = B[best, c], B[k, c]
    return A[k, HALF_BANDWIDTH]


@kernel
def solve(A, B):
    """Solve A X = B in place, rows exchanged for the largest pivot; the number of products.

    Args:
        A: (n, BAND_WIDTH) rows of the band, A[i, j - i + HALF_BANDWIDTH]; destroyed.
        B: (n, m) right-hand sides; becomes the solution.

    Returns:
        Number of products, below n (k (1 + 2 k + m) + m (2 k + 1)) with k = HALF_BANDWIDTH; zero if
        the matrix is singular.
    """
    n, m = B.shape
    count = 0
    for k in range(n):
        pivot = exchange(A, B, k)
        if not abs(pivot) > 0.0:
            return 0
        end = min(k + 2 * HALF_BANDWIDTH, n - 1)
        for i in range(k + 1, min(k + HALF_BANDWIDTH, n - 1) + 1):
            share = A[i, k - i + HALF_BANDWIDTH] / pivot
            for j in range(k + 1, end + 1):
                A[i, j - i + HALF_BANDWIDTH] -= share * A[k, j - k + HALF_BANDWIDTH]
            for c in range(m):
                B[i, c] -= share * B[k, c]
            count += 1 + end - k + m
    for k in range(n - 1, -1, -1):
        end = min(k + 2 * HALF_BANDWIDTH, n - 1)
        for c in range(m):
            for j in range(k + 1, end + 1):
                B[k, c] -= A[k, j - k + HALF_BANDWIDTH] * B[j, c]
            B[k, c] /= A[k, HALF_BANDWIDTH]
        count += m * (end - k + 1)
    return count
