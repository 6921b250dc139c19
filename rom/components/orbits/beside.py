"""Small motions beside one through a period, by the tangents of its time steps.

A step of generalised-alpha moves positions, velocities and accelerations so that the equations of
motion hold at its end. Their derivatives say how a small change of all that goes on, for all
changes at once. Tangents of elements may be approximate, and forces may depend on what is
remembered: one pair of motions beside says whether nothing is missing.

Source:
    Bruels, Cardona, Arnold, Lie group generalized-alpha time integration of constrained flexible
    multibody systems, Mech. Mach. Theory 48 (2012) 121.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom import rotation
from rom.mbs.analysis.local_equations import Instant
from rom.mbs.equations.equations import tangents
from rom.mbs.kernels.work import Step
from rom.model import Array

REDUNDANT_RTOL = 1e-12  # singular value of constraints that repeat others, of the largest one


@dataclass
class Beside:
    """Changes of the state of the method, columns.

    Attributes:
        now: the equations.
        q, v, vd, a: (n, f) of positions, as motions of the bodies, of velocities, accelerations,
            and the acceleration-like variable.
    """

    now: Instant
    q: Array
    v: Array
    vd: Array
    a: Array

    def follow(self, step: Step, base: Array, signal: Array) -> None:
        """Go through a step that has been taken.

        Args:
            step: at its end.
            base: (c,) what was remembered at its begin.
            signal: (s, 3) drives and loads at its end.
        """
        h, beta, gamma, alpha_m, alpha_f = step.method
        known = (alpha_f * self.vd - alpha_m * self.a) / (1 - alpha_m)
        share = (1 - alpha_f) / (1 - alpha_m)
        still_v = self.v + h * ((1 - gamma) * self.a + gamma * known)
        psi = h * self.v + h * h * ((0.5 - beta) * self.a + beta * known)
        back, turn = self._turning(step.psi)
        still_q = back @ self.q + turn @ psi
        M, C, K, G = self._matrices(step, base, signal)
        by_v, by_q = gamma * h * share, beta * h * h * share * turn
        x = _bordered(
            M + by_v * C + K @ by_q, G, G @ by_q, -K @ still_q - C @ still_v, -G @ still_q
        )
        self.q, self.v, self.vd = still_q + by_q @ x, still_v + by_v * x, x
        self.a = known + share * x

    def _matrices(self, step: Any, base: Array, signal: Array) -> tuple[Array, Array, Array, Array]:
        """Derivatives by accelerations, velocities and positions; gradient of the constraints."""
        now, W = self.now, self.now.W
        W.base[:], W.signal[:] = base, signal
        now.residual(step.q, step.v, step.vd, step.lam)
        found = []
        for c in ((1.0, 0.0, 1.0), (0.0, 1.0, 0.0)):
            tangents(now.system, W, step.v, step.vd, step.lam, c)
            found += [W.S.copy(), W.Kt.copy()]
        return found[0], found[2], found[1], now.gradient(step.q, step.v)[1]

    def _turning(self, psi: Array) -> tuple[Array, Array]:
        """(n, n) change of the position at the end of a step by that before, and by increments."""
        back, turn = np.eye(psi.size), np.eye(psi.size)
        for first in self.now.system.bodies.v_at + 3:
            at = slice(first, first + 3)
            back[at, at] = rotation.matrix(rotation.exp(psi[at])).T
            turn[at, at] = rotation.spatial_tangent(-psi[at])
        return back, turn


def _bordered(A: Array, G: Array, by: Array, force: Array, gap: Array) -> Array:
    """(n, f) answers x of A x + G^T y = force, by x = gap; constraints may repeat others."""
    if not len(G):
        return np.linalg.solve(A, force)
    size = np.sqrt(np.abs(np.diag(A)))
    rows = np.maximum(np.linalg.norm(by / size, axis=1), 1e-300)
    columns = np.maximum(np.linalg.norm(G / size, axis=1), 1e-300)
    whole = np.block([
        [A / np.outer(size, size), (G / size / columns[:, None]).T],
        [by / size / rows[:, None], np.zeros((len(G), len(G)))],
    ])  # fmt: skip
    right = np.vstack([force / size[:, None], gap / rows[:, None]])
    found = np.linalg.lstsq(whole, right, rcond=REDUNDANT_RTOL)[0]
    return found[: size.size] / size[:, None]
