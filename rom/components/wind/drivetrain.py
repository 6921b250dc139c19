"""A rotor that a torque drives: one third of generator, shaft and hub, and one blade.

Without gravity the three blades move alike, so one of them with a third of everything else is the
whole rotor. All of it is one rod: the generator is the plate at its start, the shaft twists, the
hub is a corner and a link that do not bend.

Source:
    Jonkman, Butterfield, Musial, Scott, Definition of a 5-MW reference wind turbine for
    offshore system development, NREL/TP-500-38060, 2009.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rom import rotation
from rom.components.cosserat import Motion, Rod, rod
from rom.components.wind.wind_turbine import (
    GEAR_RATIO,
    GENERATOR_INERTIA,
    HUB_INERTIA,
    HUB_OVERHANG,
    N_BLADES,
    SHAFT_DAMPING,
    SHAFT_STIFFNESS,
    blade,
)
from rom.model import Array

ROTOR_INERTIA = HUB_INERTIA
SLOW_GENERATOR_INERTIA = GENERATOR_INERTIA * GEAR_RATIO**2  # kg m^2, on the slow side of the gear
RIGID_STIFFNESS = 1e12  # [N], [N m^2] of what does not bend; the root of a blade has 2e10


@dataclass(frozen=True)
class Rotor:
    """One third of a rotor.

    Attributes:
        rod: generator plate, two segments of shaft along the first axis, hub link, blade.
        free: (6 N + 9,) which dofs may move: generator and hub stay on the axis.
    """

    rod: Rod
    free: npt.NDArray[np.bool_]

    def torque(self, total: float) -> tuple[Array, Array]:
        """Loads (N + 1, 3), (N + 2, 3) of a torque of the whole rotor on the generator [N m]."""
        moment = np.zeros((len(self.rod.p), 3))
        moment[0, 0] = total / N_BLADES
        return np.zeros_like(self.rod.x), moment

    def speeds(self, motion: Motion) -> Array:
        """(k, 2) angular velocity of generator and hub about the axis [rad/s]."""
        hub = [rotation.matrix(p)[0] @ w for p, w in zip(motion.p[:, 3], motion.v[:, 18:21],
                                                        strict=True)]  # fmt: skip
        return np.column_stack([motion.v[:, 2], hub])

    def momentum(self, motion: Motion) -> Array:
        """(k,) angular momentum of the whole rotor about its axis [kg m^2/s]."""
        v = np.concatenate([motion.v, np.zeros((len(motion.t), 3))], axis=1)
        v = v.reshape(len(motion.t), -1, 6)
        x, u, mass = motion.x, v[:, :-1, 3:], self.rod.mass
        orbital = (mass * (x[:, :, 1] * u[:, :, 2] - x[:, :, 2] * u[:, :, 1])).sum(axis=1)
        own = self.rod.inertia * v[:, :, :3]
        first = [[rotation.matrix(p)[0] for p in row] for row in motion.p]
        return N_BLADES * (orbital + np.einsum("tkc,tkc->t", np.array(first), own))


def rotor(n: int = 24, *, blade_rod: Rod | None = None) -> Rotor:
    """The rotor of the NREL 5 MW turbine.

    Args:
        n: segments of the blade.
        blade_rod: another blade, upright, whose root is on the hub.

    Raises:
        ModelError: as `cosserat.rod`.
    """
    one = blade(n) if blade_rod is None else blade_rod
    n = one.h.size
    along = rotation.quaternion(np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]))  # third axis: x
    x = np.concatenate([[[-HUB_OVERHANG, 0, 0], [-HUB_OVERHANG / 2, 0, 0], [0, 0, 0]], one.x])
    p = np.concatenate([[along] * 3, one.p[:1], one.p[1:]])
    twist = (
        0.75 * HUB_OVERHANG * SHAFT_STIFFNESS / N_BLADES
    )  # of the half and the whole segment that twist
    stiff = [RIGID_STIFFNESS] * 3
    whole = rod(
        x, p, stretch=np.concatenate([[stiff] * 3, one.stretch]),
        bend=np.concatenate([[[RIGID_STIFFNESS, RIGID_STIFFNESS, twist]] * 2, [stiff], one.bend]),
        bends=[True, True, False] + [True] * n,
    )  # fmt: skip
    inertia = np.concatenate([np.zeros((4, 3)), one.inertia[1:]])
    inertia[0, 2] = SLOW_GENERATOR_INERTIA / N_BLADES
    inertia[3, :2] = ROTOR_INERTIA / N_BLADES  # both, since the sections of the root are turned
    viscous = np.concatenate([np.zeros((3, 3)), one.viscous_bend])
    viscous[:2, 2] = twist * SHAFT_DAMPING / SHAFT_STIFFNESS
    stretched = np.concatenate([np.zeros((3, 3)), one.viscous_stretch])
    whole = whole._replace(
        mass=np.concatenate([np.zeros(3), one.mass]), inertia=inertia,
        viscous_bend=viscous, viscous_stretch=stretched,
    )  # fmt: skip
    free = np.ones(6 * (n + 3) + 9, dtype=bool)
    free[[0, 1]] = free[3:6] = free[15:18] = False  # generator and hub centre
    return Rotor(whole, free)
