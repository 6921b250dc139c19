"""Rotations: every sign convention of the project is stated here, once.

* Quaternions are (e0, e1, e2, e3), scalar first, of unit length.
* ``matrix(p)`` maps components in the body frame to components in the world frame.
* Angular velocity is in the body frame: dA/dt = A skew(omega), dp/dt = 0.5 * p o (0, omega).
* ``skew(a) @ b == cross(a, b)``.

All functions take one quaternion or vector; they are small enough to be compiled as they stand.
"""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def skew(a: npt.ArrayLike) -> Array:
    """(3, 3) matrix S of the cross product a x b = S b, in the units of a (3,)."""
    x, y, z = np.asarray(a, dtype=float)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def axial(S: npt.ArrayLike) -> Array:
    """(3,) vector of the skew part of a (3, 3) matrix, in the units of it; inverse of `skew`."""
    return 0.5 * crossed(np.asarray(S, dtype=float).T)


def skew_tensor() -> Array:
    """(3, 3, 3): skew(w)_ab = sum_c tensor[a, b, c] w_c."""
    return np.stack([skew(e) for e in np.eye(3)], axis=-1)


def crossed(S: Array) -> Array:
    """(3, ...) integral of u x v from the (3, 3, ...) integrals of u_a v_b, in their units."""
    return np.array([S[1, 2] - S[2, 1], S[2, 0] - S[0, 2], S[0, 1] - S[1, 0]])


def matrix(p: npt.ArrayLike) -> Array:
    """(3, 3) rotation matrix [1] of a unit quaternion (4,), body to world."""
    e0, e1, e2, e3 = np.asarray(p, dtype=float)
    return np.array(
        [
            [1 - 2 * (e2 * e2 + e3 * e3), 2 * (e1 * e2 - e0 * e3), 2 * (e1 * e3 + e0 * e2)],
            [2 * (e1 * e2 + e0 * e3), 1 - 2 * (e1 * e1 + e3 * e3), 2 * (e2 * e3 - e0 * e1)],
            [2 * (e1 * e3 - e0 * e2), 2 * (e2 * e3 + e0 * e1), 1 - 2 * (e1 * e1 + e2 * e2)],
        ]
    )


def quaternion(A: npt.ArrayLike) -> Array:
    """(4,) unit quaternion [1] of a rotation matrix (3, 3), scalar part not negative.

    The largest of the four components is found first, so that no division by a small number occurs.

    Source:
        Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1 (1978) 223.
    """
    A = np.asarray(A, dtype=float)
    squares = np.array([np.trace(A), A[0, 0], A[1, 1], A[2, 2]])
    k = int(np.argmax(squares))
    p = np.empty(4)
    if k == 0:
        p[0] = 1 + squares[0]
        p[1:] = crossed(A.T)
    else:
        i = k - 1
        j, m = (i + 1) % 3, (i + 2) % 3
        p[0] = A[m, j] - A[j, m]
        p[1 + i] = 1 + A[i, i] - A[j, j] - A[m, m]
        p[1 + j] = A[i, j] + A[j, i]
        p[1 + m] = A[i, m] + A[m, i]
    p /= np.linalg.norm(p)
    return p if p[0] >= 0 else -p


def multiply(p: npt.ArrayLike, q: npt.ArrayLike) -> Array:
    """(4,) product p o q [1] of quaternions (4,) [1]; matrix(p o q) = matrix(p) matrix(q)."""
    p, q = np.asarray(p, dtype=float), np.asarray(q, dtype=float)
    scalar = p[0] * q[0] - p[1:] @ q[1:]
    return np.concatenate(([scalar], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])))


def exp(theta: npt.ArrayLike) -> Array:
    """(4,) quaternion of the rotation vector theta [rad]."""
    theta = np.asarray(theta, dtype=float)
    angle = np.linalg.norm(theta)
    return np.concatenate(([np.cos(angle / 2)], 0.5 * np.sinc(angle / (2 * np.pi)) * theta))


def spatial_tangent(theta: npt.ArrayLike) -> Array:
    """(3, 3) angular velocity per rate of the rotation vector theta [1], fixed axes."""
    S, angle = skew(theta), float(np.linalg.norm(theta))
    # (angle - sin) / angle^3 without its cancellation
    cubic = (1 - np.sinc(angle / np.pi)) / angle**2 if angle > 1e-3 else 1 / 6 - angle**2 / 120
    return np.eye(3) + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * S + cubic * S @ S


def log(p: npt.ArrayLike) -> Array:
    """(3,) rotation vector of a unit quaternion, angle in [0, pi] [rad]."""
    p = np.asarray(p, dtype=float)
    p = p if p[0] >= 0 else -p
    sine = np.linalg.norm(p[1:])
    if sine == 0.0:
        return np.zeros(3)
    return 2 * np.arctan2(sine, p[0]) / sine * p[1:]


def continuous(p: npt.ArrayLike) -> Array:
    """(n, 4) quaternions with the signs that let each be near the one before."""
    p = np.asarray(p, dtype=float)
    flips = np.einsum("ti,ti->t", p[1:], p[:-1]) < 0
    return p * np.cumprod(np.r_[1.0, np.where(flips, -1.0, 1.0)])[:, None]
