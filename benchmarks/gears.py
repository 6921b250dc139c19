"""A planetary train of six tooth meshes in time, and its teeth asked for from Python."""

from collections.abc import Iterator
from math import pi
from typing import Any

import numpy as np

from benchmarks.models import planetary_train
from benchmarks.timing import Row, timed
from rom.components.gear_mesh import Hertz, Mesh
from rom.mbs.integrate.simulation import simulate

TIME_STEP = 1e-5  # [s]
MESH_VARIANTS: dict[str, dict[str, Any]] = {
    "": {},
    ", along involutes": {"conservative": False},
    ", slices coupled": {"coupling": 2e-3},
    ", contact by Hertz": {"hertz": Hertz((2e-3, 2e-3))},
}


def measured(steps: int) -> Iterator[Row]:
    """Case, quantity, value, unit and aim.

    Args:
        steps: of the plain train; a fifth of them in its variants.
    """
    case = "planetary train, 6 meshes of 21 slices"
    for name, more in MESH_VARIANTS.items():
        mech, pair, stiffness = planetary_train(**more)
        each = _seconds_per_step(mech, steps if not name else steps // 5)
        speed = 1 / each
        yield case + name, "steps per second of the processor", speed, "1/s", "above 1000"
        if not name:
            whole = each
    teeth, motion = Mesh(pair, stiffness), np.zeros(12)
    motion[5] = 1e-4
    angles = np.linspace(0, 2 * pi, 200).tolist()
    share = 6 * timed(lambda: [teeth.forces(motion, angle) for angle in angles])[0] / 200 / whole
    yield case, "six meshes asked from Python, over a step", share, "", "above 0.5"


def _seconds_per_step(mech: Any, steps: int) -> float:
    """Processor time, the kernels compiled."""
    how: dict[str, Any] = {"dt": TIME_STEP, "save_every": 100, "progress": False}
    simulate(mech, t_end=100 * TIME_STEP, **how)
    return timed(simulate, mech, t_end=TIME_STEP * steps, **how)[0] / steps
