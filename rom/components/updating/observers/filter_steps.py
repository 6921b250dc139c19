"""The steps of a Kalman filter, compiled; nothing is allocated in them.

The model is linear about a point of the parameters, and bilinear in their distance d from it:
A + sum d_j dA_j takes the motion x a step on, C + sum d_j dC_j is what sensors see of it.

Source:
    Extended filter: Jazwinski, Stochastic processes and filtering theory (1970); one sample after
    another: Bierman, Factorization methods for discrete sequential estimation (1977).
"""

import os
from pathlib import Path

import numba

from rom.process.child import trusted

CODE_FOLDER = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(__file__).with_name("__pycache__"))
# without a count of references no array can be made
kernel = numba.njit(cache=trusted(CODE_FOLDER), _nrt=False, error_model="numpy")


@kernel
def filtered(k, samples, z, P, model, R, reach, scratch, out):  # noqa: PLR0913  arrays of a step
    """Filter samples from number k on, until a parameter is out of reach; the next number.

    Args:
        k: number of the first sample.
        samples: (n_t, n_y), NaN where one is missing.
        z: (N,) motion (n,), then parameters (n_p,); changed in place.
        P: (N, N) its covariance; changed in place.
        model: (point (n_p,), A (n, n), dA (n_p, n, n), Q (N, N), C (n_y, n), dC (n_p, n_y, n),
            W (n_v, n), dW (n_p, n_v, n)); what is wanted is W.
        R: (n_y,) variances of samples.
        reach: largest distance of a parameter from the point.
        scratch: arrays (N, N), (N, N), (N,) and (N,).
        out: values (n_t, n_v + n_p), their variances, and (n_t,) squared innovations.
    """
    point, A, _, _, C, dC, W, dW = model
    F, T, c, p = scratch
    values, variances, surprise = out
    n, n_p = A.shape[0], point.size
    while k < samples.shape[0]:
        if k > 0:
            _predict(z, P, model, F, T, c)
        for i in range(C.shape[0]):
            if samples[k, i] == samples[k, i]:
                _seen(z, point, C, dC, i, c)
                surprise[k] += _corrected(z, P, c, _motion(z, c, n), R[i], samples[k, i], p)
        for i in range(W.shape[0]):
            _seen(z, point, W, dW, i, c)
            values[k, i] = _motion(z, c, n)
            variances[k, i] = _variance(P, c)
        for j in range(n_p):
            values[k, W.shape[0] + j] = z[n + j]
            variances[k, W.shape[0] + j] = P[n + j, n + j]
        k += 1
        for j in range(n_p):
            if not abs(z[n + j] - point[j]) <= reach:
                return k
    return k


@kernel
def _predict(z, P, model, F, T, x):
    """A step of the state, and of its covariance: F P F' + Q with the derivative F."""
    point, A, dA, Q, _, _, _, _ = model
    n, N = A.shape[0], z.size
    for i in range(n):
        _seen(z, point, A, dA, i, F[i])
        x[i] = _motion(z, F[i], n)
    for i in range(n):
        z[i] = x[i]
        for b in range(N):
            T[i, b] = 0.0
        for a in range(N):
            for b in range(N):
                T[i, b] += F[i, a] * P[a, b]
    for i in range(n, N):
        for b in range(N):
            T[i, b] = P[i, b]
    for i in range(N):
        for b in range(i + 1):
            P[i, b] = Q[i, b] + (T[i, b] if b >= n else _dot(T[i], F[b]))
            P[b, i] = P[i, b]


@kernel
def _dot(a, b):
    total = 0.0
    for k in range(a.size):
        total += a[k] * b[k]
    return total


@kernel
def _seen(z, point, C, dC, i, c):
    """Row i of the derivative by the state, written into c (N,)."""
    n = C.shape[1]
    for a in range(n):
        c[a] = C[i, a]
    for j in range(point.size):
        d, slope = z[n + j] - point[j], 0.0
        for a in range(n):
            c[a] += d * dC[j, i, a]
            slope += dC[j, i, a] * z[a]
        c[n + j] = slope


@kernel
def _motion(z, c, n):
    """The value itself: the part of the row that belongs to the motion."""
    total = 0.0
    for a in range(n):
        total += c[a] * z[a]
    return total


@kernel
def _variance(P, c):
    total = 0.0
    for a in range(c.size):
        for b in range(c.size):
            total += c[a] * P[a, b] * c[b]
    return total


@kernel
def _corrected(z, P, c, expected, r, sample, p):
    """Take in a sample with the variance r; its squared innovation over its variance."""
    N, s = z.size, r
    for a in range(N):
        p[a] = 0.0
        for b in range(N):
            p[a] += P[a, b] * c[b]
        s += c[a] * p[a]
    e = sample - expected
    for a in range(N):
        z[a] += p[a] * (e / s)
        for b in range(a + 1):
            P[a, b] -= p[a] * p[b] / s
            P[b, a] = P[a, b]
    return e * e / s
