"""A planetary train of six tooth meshes in time, and its teeth by the plane model."""

from collections.abc import Iterator
from math import pi
from time import process_time
from typing import Any

import numpy as np

from rom.bench.models import planetary_train
from rom.components.gear_mesh import Hertz, Mesh
from rom.mbs.integrate.simulation import simulate

TIME_STEP = 1e-5  # [s]
MESH_VARIANTS: dict[str, dict[str, Any]] = {
    "": {},
    ", along involutes": {"conservative": False},
    ", slices coupled": {"coupling": 2e-3},
    ", contact by Hertz": {"hertz": Hertz((2e-3, 2e-3))},
}
Row = tuple[str, str, float, str, str]


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
    plane, motion = Mesh(pair, stiffness), np.zeros(12)
    motion[5] = 1e-4
    start = process_time()
    for angle in np.linspace(0, 2 * pi, 200):
        plane.forces(motion, float(angle))
    share = 6 * (process_time() - start) / 200 / whole
    yield case, "six meshes by the plane model, over a step", share, "", "above 0.5"


def _seconds_per_step(mech: Any, steps: int) -> float:
    """Processor time, the kernels compiled."""
    simulate(mech, t_end=100 * TIME_STEP, dt=TIME_STEP, save_every=100, progress=False)
    start = process_time()
    simulate(mech, t_end=TIME_STEP * steps, dt=TIME_STEP, save_every=100, progress=False)
    return (process_time() - start) / steps
