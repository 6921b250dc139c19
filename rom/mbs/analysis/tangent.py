"""One correction towards equilibrium: linear equations in motions that the joints allow."""

from dataclasses import dataclass

import numpy as np

from rom.mbs.analysis.local_equations import Instant, free_motions, of_unit_mass
from rom.mbs.analysis.moving_axes import small_motions
from rom.mbs.equations.packing import Packed
from rom.mbs.results.state import State
from rom.model import Array

MAX_ROTATION = 0.3  # of one correction [rad]
MAX_DISPLACEMENT = 0.3  # of one correction, of the mechanism's size
# stiffness that counts as none, relative to the largest one and to that of the loads: differences
# leave 1e-11 of the latter
STIFFNESS_RTOL, LOAD_STIFFNESS_RTOL = 1e-13, 1e-9


@dataclass(frozen=True)
class Tangent:
    """Linear equations of one correction, in motions that turn with the bodies.

    Attributes:
        now: the mechanism.
        T: (n, n) variation of the coordinates per motion.
        r, K: (n,), (n, n) forces out of balance and their derivative.
        G, gap: (m, n), (m,) constraints.
        Z: (n, f) free motions of unit mass.
        pull: stiffness that the loads themselves give, gravity over length [1/s^2].
    """

    now: Instant
    T: Array
    r: Array
    K: Array
    G: Array
    gap: Array
    Z: Array
    pull: float

    @classmethod
    def of(cls, now: Instant, state: State) -> "Tangent":
        """The equations at a state that rests, or turns steadily as a whole."""
        T, T1, _, T3 = small_motions(now.packed.system, state, (False,) * len(now.packed.names))
        M, C, K = now.matrices(state)
        K = K @ T + C @ T1 + M @ T3
        r = T.T @ now.residual(state.q, state.v, state.a, state.lam)
        force = (
            np.abs(now.W.wrench[:, :3]).max(initial=0.0) + now.packed.mass * np.abs(state.a).max()
        )
        gap, G, _ = now.gradient(state.q, state.v)
        Z = of_unit_mass(free_motions(G @ T, now.probe(), state.rank), T.T @ M @ T)
        packed = now.packed
        force += packed.mass * np.linalg.norm(packed.system.bodies.gravity)
        return cls(now, T, r, T.T @ K, G @ T, gap, Z, force / packed.mass / packed.length)

    @property
    def curvature(self) -> Array:
        """Symmetric part of the stiffness of the free motions [rad^2/s^2]."""
        K = self.Z.T @ self.K @ self.Z
        return 0.5 * (K + K.T)

    def none(self, squares: Array) -> float:
        """Stiffness that counts as none."""
        return max(
            STIFFNESS_RTOL * np.abs(squares).max(initial=0.0),
            LOAD_STIFFNESS_RTOL * self.pull,
            1e-300,
        )

    @property
    def faint(self) -> float:
        """Force per root of mass, in a free motion, that counts as none."""
        return (
            LOAD_STIFFNESS_RTOL * self.pull * self.now.packed.length * np.sqrt(self.now.packed.mass)
        )

    def driven(self) -> Array | None:
        """(n,) free motion that forces drive and no stiffness opposes, if there is one."""
        squares, V = np.linalg.eigh(self.curvature)
        along = np.abs(V.T @ (self.Z.T @ self.r))
        loose = np.where(np.abs(squares) <= self.none(squares), along, 0.0)
        if loose.max(initial=0.0) <= self.faint:
            return None
        return self.T @ self.Z @ V[:, int(np.argmax(loose))]

    def unbalanced(self) -> Array:
        """(n,) forces that the best reactions leave over."""
        scale = self.now.probe()
        A, b = (self.G * scale).T, self.r * scale
        return (b - A @ np.linalg.lstsq(A, b, rcond=1e-9)[0]) / scale

    def correction(self) -> tuple[Array, Array]:
        """(n,) variation of the coordinates and (m,) of the multipliers."""
        scale = self.now.probe()
        A = self.G * scale
        rows = np.maximum(np.linalg.norm(A, axis=1), 1e-300)
        shift = np.linalg.lstsq(A / rows[:, None], -self.gap / rows, rcond=1e-9)[0] * scale
        shift = shift + self.Z @ self.downhill(self.Z.T @ (self.r + self.K @ shift))
        reaction = np.linalg.lstsq(A.T, -(self.r + self.K @ shift) * scale, rcond=1e-9)[0]
        return self.T @ shift, reaction

    def downhill(self, force: Array) -> Array:
        """Newton's correction where the potential curves upwards, downhill elsewhere."""
        squares, V = np.linalg.eigh(self.curvature)
        none = self.none(squares)
        if not squares.size or squares[0] > none:
            return -np.linalg.solve(self.Z.T @ self.K @ self.Z, force)
        along = V.T @ force
        still = (np.abs(squares) <= none) & (np.abs(along) <= self.faint)
        return -V @ np.where(still, 0.0, along / np.maximum(np.abs(squares), none))


def sizes(packed: Packed, step: Array) -> tuple[float, float]:
    """Size of a correction, in rad or lengths of the mechanism, and the share of it to be taken."""
    turns, shifts = [0.0], [0.0]
    for b, at in enumerate(packed.system.bodies.v_at):
        turns.append(float(np.linalg.norm(step[at + 3 : at + 6])))
        shifts.append(float(np.linalg.norm(step[at : at + 3])) / packed.length)
        r, mass = packed.system.bodies.r[b], packed.system.bodies.mass[b]
        modal = np.diag(packed.system.bodies.M[packed.system.bodies.flex[b]])[:r]
        bend = step[at + 6 : at + 6 + r] * np.sqrt(modal / mass)
        shifts.append(float(np.linalg.norm(bend)) / packed.length)
    turn, shift = max(turns), max(shifts)
    return float(max(turn, shift)), float(
        1 / max(1.0, turn / MAX_ROTATION, shift / MAX_DISPLACEMENT)
    )
