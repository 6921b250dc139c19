"""Vibration that the changing stiffness of teeth excites, to first order.

Films and teeth are linear about an equilibrium. What drives them is the transmission error under
load: how far the pinion has to turn for the teeth to carry the same torque in every position, times
the mean stiffness, and moments that wander with the load.

Source:
    Velex and Ajmi, J. Sound Vib. 290 (2006).
"""

from dataclasses import dataclass

import numpy as np

from rom.components.transmission.motion import linearised, whirl
from rom.components.transmission.unit import Rest
from rom.errors import ModelError
from rom.model import Array

MAX_ITERATIONS = 60


@dataclass(frozen=True)
class Response:
    """Periodic motion with the mesh.

    Attributes:
        frequency: of the mesh [Hz].
        error: (h,) amplitudes of the transmission error per harmonic, along the line of action [m].
        force: (h,) amplitudes of the force between the teeth [N].
        mean: of that force [N].
    """

    frequency: float
    error: Array
    force: Array
    mean: float

    @property
    def error_rms(self) -> float:
        """Root mean square of the error about its mean [m]."""
        return float(np.sqrt(np.sum(self.error**2) / 2))

    @property
    def load_factor(self) -> float:
        """1 and the root mean square of the changing force over its mean [1]."""
        return 1 + float(np.sqrt(np.sum(self.force**2) / 2)) / self.mean


def mesh_response(state: Rest, *, harmonics: int = 6, positions: int = 96) -> Response:
    """Periodic response to the mesh.

    Args:
        state: equilibrium at any position of the teeth.
        harmonics: of the mesh that are kept.
        positions: of the teeth in a mesh period.

    Raises:
        ModelError: if the unit whirls at that speed.
    """
    unit, W = state.unit, state.unit.wheels
    if not whirl(state).stable:
        raise ModelError(
            f"{unit.speed:.1f} rad/s are above the threshold: journals whirl, and no periodic "
            "motion with the mesh is left.",
            hint="Lower the speed, or load the bearings more.",
        )
    M, C, K = linearised(state)
    excitation, k = _excitation(state, positions)
    K += W.T @ (k - state.forces.mesh.stiffness) @ W
    C += W.T @ (unit.mesh.damping * k - state.forces.mesh.damping) @ W
    waves = 2 * np.fft.rfft(excitation, axis=0)[1 : harmonics + 1] / positions
    F, load = state.forces.mesh.force, float(state.forces.mesh.load.sum())
    rb, error, force = unit.mesh.pair.rb, [], []
    for h, wave in enumerate(waves, start=1):
        s = 2j * np.pi * h / unit.mesh_period
        x = W @ np.linalg.solve(K + s * C + s**2 * M, wave @ W)
        felt = wave - (1 + s * unit.mesh.damping) * (k @ x)
        error.append(abs(rb[0] * x[5] + rb[1] * x[11]))
        force.append(load * abs(felt[5] / F[5]))
    return Response(1 / unit.mesh_period, np.array(error), np.array(force), load)


def _excitation(state: Rest, positions: int) -> tuple[Array, Array]:
    """(positions, 12) forces on the wheels held fast, (12, 12) mean stiffness of the teeth."""
    mesh, q = state.unit.mesh, state.unit.wheels @ state.q
    wanted, turned, forces, stiffness = state.forces.mesh.force[5], [], [], []
    for t in 2 * np.pi / mesh.pair.teeth[0] * np.arange(positions) / positions:
        for _ in range(MAX_ITERATIONS):
            teeth = mesh.forces(q, state.theta + t)
            missing = (teeth.force[5] - wanted) / max(teeth.stiffness[5, 5], 1.0)
            q[5] += missing
            if abs(missing) < 1e-12:
                break
        turned.append(q[5])
        forces.append(teeth.force)
        stiffness.append(teeth.stiffness)
    k, F = np.mean(stiffness, axis=0), np.array(forces)
    x = np.array(turned) - np.mean(turned)
    return np.outer(x, k[:, 5]) + F - F.mean(axis=0), k
