"""Integrals S(U, V) of rho U V^T as nine numbers in a row: what the equations do with them."""

from rom.mbs.kernels.compiled import inner


@inner
def dual(s, at):
    """Integral of rho U x V from the nine entries of S(U, V)."""
    return s[at + 5] - s[at + 7], s[at + 6] - s[at + 2], s[at + 1] - s[at + 3]


@inner
def trace(s, at):
    """Trace of nine entries."""
    return s[at] + s[at + 4] + s[at + 8]


@inner
def times(s, x):
    """Nine entries, as a matrix, times x."""
    return (
        s[0] * x[0] + s[1] * x[1] + s[2] * x[2],
        s[3] * x[0] + s[4] * x[1] + s[5] * x[2],
        s[6] * x[0] + s[7] * x[1] + s[8] * x[2],
    )


@inner
def transposed_times(s, x):
    """Nine entries, as a matrix, transposed, times x."""
    return (
        s[0] * x[0] + s[3] * x[1] + s[6] * x[2],
        s[1] * x[0] + s[4] * x[1] + s[7] * x[2],
        s[2] * x[0] + s[5] * x[1] + s[8] * x[2],
    )


@inner
def add_multiple(factor, x, n, out):
    """Add a multiple of the first n numbers of x to those of out: one loop, for vector units."""
    for j in range(n):
        out[j] += factor * x[j]


@inner
def contract(S2, x, r, line, out):
    """Add S(x, phi_k) for x = sum x_l phi_l to the rows of out; ``line`` is working memory."""
    n = 9 * r
    for j in range(n):
        line[j] = 0.0
    for l in range(r):
        add_multiple(x[l], S2[l], n, line)
    for k in range(r):
        for p in range(9):
            out[k, p] += line[9 * k + p]
