"""Steady rotation at large displacement: equilibrium by Newton's method along the speed.

Seen from axes that turn with the solid, it rests under centrifugal forces at its displaced points::

    T^T (f(u) - Omega^2 M (I (x) P) (x + u)) = 0,    u = T a,    P = I - e e^T

with f of the St. Venant-Kirchhoff solid and T the motions that are equal in all sectors.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from rom.components.wheels.rotation import axial_pins, rotation_matrices
from rom.components.wheels.sector import CyclicSector
from rom.model import Array
from rom.paths.load_steps import load_steps

Solid = Any  # of `rom.fe.forms.large_strain.FiniteStrain`, or whatever has its verbs
MAX_ITERATIONS = 25
INCREMENT_RTOL = 1e-9  # last increment, of the displacement; the next one is its square
NOISE_RTOL = 1e-12  # of the extent; smaller increments are noise, which an instability amplifies
MIN_LOAD_STEP = 1 / 512  # of a stretch of load, at which a path is given up


class SteadyRotation:
    """Equilibria of a sector at the square of its speed, and at a share of its heat.

    Args:
        sector: the sector; its points are those without load.
        solid: its elements in large motion, see `rom.fe.forms.large_strain.FiniteStrain`.

    Attributes:
        softening: (n, n) spin softening M (I (x) P) per (rad/s)^2 [kg].
        K_cold: (n, n) stiffness without load, by the quadrature of all the others [N/m].
        square: square of the speed [(rad/s)^2].
    """

    def __init__(self, sector: CyclicSector, solid: Solid):
        self.solid, self.square, self.workers = solid, 0.0, sector.workers
        self.T, self.kept = sector.harmonic(0), sector.free
        self.free = np.setdiff1d(np.arange(self.T.shape[1]), axial_pins(sector))
        self.softening = rotation_matrices(sector.M, sector.axis)[1]
        solid.warm(0.0)
        self.K_cold = solid.tangent(np.zeros(sector.n))
        solid.warm(1.0)
        self.pull = self.softening @ (sector.points - sector.at).ravel()
        self.noise = NOISE_RTOL * np.linalg.norm(sector.points - sector.points.mean(axis=0))

    @property
    def at_rest(self) -> Array:
        """(f,) independent dofs without displacement [m]."""
        return np.zeros(self.T.shape[1])

    def independent(self, u: Array) -> Array:
        """(f,) independent dofs of a displacement (n,) that is equal in all sectors [m]."""
        return u[self.kept]

    def load(self, square: float) -> None:
        """Turn from now on at the root of this square of a speed [(rad/s)^2]."""
        self.square = square

    def residual(self, a: Array) -> Array:
        """(f,) forces out of balance [N] at the displacement a (f,) [m]."""
        u = self.T @ a
        found: Array = self.solid.force(u) - self.square * (self.pull + self.softening @ u)
        return self.T.T @ found

    def tangent(self, a: Array) -> csr_matrix:
        """(f, f) their derivative [N/m] at the displacement a (f,) [m]."""
        K = self.solid.tangent(self.T @ a) - self.square * self.softening
        return csr_matrix(self.T.T @ K @ self.T)

    def newton(self, a: Array) -> Array | None:
        """(f,) the equilibrium near a displacement [m]; None if it is not found or not stable."""
        for _ in range(MAX_ITERATIONS):
            factor = self.workers.factor(self.tangent(a)[self.free][:, self.free])
            if factor is None:
                return None
            step = -factor.solve(self.residual(a)[self.free])
            a = a.copy()
            a[self.free] += step
            size, whole = np.linalg.norm(step), np.linalg.norm(a)
            if not np.isfinite(size):
                return None
            if size <= INCREMENT_RTOL * whole + self.noise:
                return a if factor.definite else None
        return None

    def follow(
        self, a: Array, start: float, end: float, load: Callable[[float], None]
    ) -> tuple[Array, float]:
        """Equilibrium (f,) [m] at the end of a stretch, or the last stable one, and its load.

        Args:
            a: (f,) equilibrium at the start [m].
            start: first value of the load [1 or (rad/s)^2].
            end: last value [1 or (rad/s)^2].
            load: sets the load.
        """

        def ahead(
            at: tuple[Array, Array, float], share: float
        ) -> tuple[Array, Array, float] | None:
            a, slope, before = at
            load((1 - share) * start + share * end)
            found = self.newton(a + slope * (share - before))
            return None if found is None else (found, (found - a) / (share - before), share)

        share, (a, _, _) = load_steps(ahead, (a, 0.0 * a, 0.0), least=MIN_LOAD_STEP)
        reached = (1 - share) * start + share * end
        load(reached)
        return a, reached
