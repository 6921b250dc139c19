"""Motions of a structure that turns: Coriolis forces between the modes it has without them.

In mass-normalised modes q of the stiffness at speed, with g = Omega Phi^T G Phi::

    q'' + g q' + omega^2 q = p,    y = [q'; omega q],    y' = S y + [p; 0],
    S = [[-g, -omega], [omega, 0]] = -S^T

so that S has the eigenvalues i w with orthonormal eigenvectors: nothing grows, and no left
eigenvectors are needed.

Source:
    Meirovitch, A new method of solution of the eigenvalue problem for gyroscopic systems, AIAA J.
    12 (1974) 1337.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from rom.components.wheels.sector import Complex
from rom.model import Array


@dataclass(frozen=True)
class GyroscopicModes:
    """Motions exp(i w t) of a conservative gyroscopic system.

    Attributes:
        w: (2n,) circular frequencies [rad/s], ascending, of both signs.
        velocities: (n, 2n) q' of each [1], where |q'|^2 + |omega q|^2 = 1.
        shapes: (n, 2n) q of each [s].
    """

    w: Array
    velocities: Complex
    shapes: Complex

    def waves(self) -> tuple[Array, Complex]:
        """The motions that turn with exp(i w t), w > 0.

        Returns:
            w (n,) [rad/s], ascending, and shapes (n, n) of length 1 [1].
        """
        n = len(self.shapes)
        q = self.shapes[:, n:]
        return self.w[n:], q / np.linalg.norm(q, axis=0)

    def response(self, p: Complex, sweep: Array, damping: float) -> Complex:
        """(w, n) answers q [kg^1/2 m] to p exp(i omega t), each motion with its share of damping.

        Args:
            p: (n,) forces on mass-normalised modes [N kg^-1/2].
            sweep: (w,) circular frequencies omega [rad/s].
            damping: a motion decays at this share zeta [1] of its w, as exp(i w sqrt(1 - zeta^2)
                t).
        """
        slower = np.sqrt(1.0 - damping**2)
        met = self.velocities.conj().T @ p
        gap = 1j * (sweep[:, None] - slower * self.w) + damping * np.abs(self.w)
        return (met / gap) @ self.shapes.T / slower


def gyroscopic_modes(omega: Array, g: Array) -> GyroscopicModes:
    """Motions of q'' + g q' + omega^2 q = 0.

    Args:
        omega: (n,) circular frequencies without g, positive [rad/s].
        g: (n, n) skew-symmetric [rad/s].

    Source:
        Meirovitch, A new method of solution of the eigenvalue problem for gyroscopic systems,
        AIAA J. 12 (1974) 1337.
    """
    n, D = omega.size, np.diag(omega)
    w, W = eigh(-1j * np.block([[-g, -D], [D, np.zeros((n, n))]]))
    return GyroscopicModes(w, W[:n], W[n:] / omega[:, None])
