"""Newton's law for coupled masses in a moving frame, nothing precomputed."""

import numpy as np


def particles(nodes, q, qd, qdd, a, omega, domega):
    """Force, moment and elastic rows of nodes (x, Ms, phi, K, D), all in the axes of the frame."""
    x, Ms, phi, K, D = nodes
    rho, u, v = x + np.tensordot(q, phi, 1), np.tensordot(qd, phi, 1), np.tensordot(qdd, phi, 1)
    acceleration = a + np.cross(domega, rho) + np.cross(omega, np.cross(omega, rho))
    inertia = Ms @ (acceleration + 2 * np.cross(omega, u) + v)
    elastic = np.einsum("kia,ia->k", phi, inertia) + K @ q + D @ qd
    return inertia.sum(axis=0), np.cross(rho, inertia).sum(axis=0), elastic


def motion(scale=1.0):
    """q, qd, qdd of four shapes; acceleration, angular velocity and acceleration of the frame."""
    draws = np.random.default_rng(3).normal(size=(7, 4))
    q, qd, qdd = scale * draws[:3]
    return q, qd, qdd, draws[3, :3], draws[4, :3], draws[5, :3]
