"""Random columns with which searches begin, the same for any number of processes."""

from typing import Any

import numpy as np

from rom.model import Array

PLACE_SCALE = 2.0**40  # places that differ by less are one
COUNTER_STEP = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio: steps of the counter
MIXING_STEPS = (  # Steele, Lea and Flood, OOPSLA 2014, with the constants of Stafford
    (np.uint64(30), np.uint64(0xBF58476D1CE4E5B9)),
    (np.uint64(27), np.uint64(0x94D049BB133111EB)),
)


def gaussian_block(ops: Any, k: int, n_before: int = 0) -> Array:
    """(n_local, k) Gaussian columns with components of about one in all modes.

    The numbers depend on the place of a dof, mixed beyond recognition, and not on its rank. Blocks
    are independent when each is given how many columns were drawn before it.
    """
    key = np.round(ops.fixed * PLACE_SCALE).astype(np.int64).view(np.uint64)
    numbers = np.arange(1 + 2 * n_before, 1 + 2 * (n_before + k), dtype=np.uint64)
    counter = key[:, None] + COUNTER_STEP * numbers
    u = (_mixed(counter) >> np.uint64(11)).astype(float) * 2.0**-53 + 2.0**-54
    normal = np.sqrt(-2.0 * np.log(u[:, :k])) * np.cos(2.0 * np.pi * u[:, k:])  # Box and Muller
    return normal / np.sqrt(np.maximum(ops.mass_diagonal, np.finfo(float).tiny))[:, None]


def _mixed(x: Any) -> Any:
    """64 bits of which each depends on all those given: the finaliser of SplitMix64."""
    for shift, factor in MIXING_STEPS:
        x = (x ^ (x >> shift)) * factor
    return x ^ (x >> np.uint64(31))
