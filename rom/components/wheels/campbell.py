"""Waves of a wheel followed over its speed, by their shapes and not by their order."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from rom.arguments import typed, whole
from rom.components.wheels.modes import cyclic_modes
from rom.components.wheels.sector import Complex, CyclicSector
from rom.components.wheels.travelling import Waves, travelling_modes
from rom.errors import ConfigError
from rom.model import Array

N_SPARE_WAVES = 4  # beyond those followed: waves from above may cross them
SPEEDS_AT_ONCE = 8  # whose waves are kept until they are followed


@typed
@dataclass(frozen=True)
class WheelCampbell(Waves):
    """Frequencies over the speed, each column one wave.

    Attributes:
        speeds: (s,) [rad/s].
        diameter: number of nodal diameters.
        omega: (s, n) circular frequencies seen from the wheel [rad/s]; a column may cross others.
        direction: (n,) [1] +1 for waves that run ahead with the rotation, -1 against it, 0
            standing.
        mac: (s, n) likeness [1], 0 to 1, of each shape to that at the speed before; where it is
            near one half two waves change their shapes, and the speeds are too far apart.
    """

    speeds: Array
    diameter: int
    omega: Array
    direction: Array
    mac: Array


@typed
def wheel_campbell(
    sector: CyclicSector, diameter: int, n: int, *, speeds: npt.ArrayLike
) -> WheelCampbell:
    """Follow the lowest waves of the first speed through all others by their shapes.

    From speed to speed each wave takes the one of its direction that is most like it, no two the
    same: the modal assurance criterion |a^H M b|^2 of mass-normalised shapes, summed over all, is
    the largest there is. Under mpirun the ranks share the speeds, and all must call.

    Args:
        sector: with matrices of rotation, see `rom.rotating_sector`; full or reduced.
        diameter: number of nodal diameters.
        n: number of waves, counting both directions.
        speeds: (s,) angular speeds [rad/s], not negative; the first may be zero.

    Raises:
        ConfigError: if a speed is negative, or the wheel has not so many waves.
        ModelError, ModesMissedError: see `rom.travelling_modes`.

    Source:
        Campbell, The protection of steam-turbine disk wheels from axial vibration, Trans. ASME
        46 (1924) 31; see docs/theory/rotating_solids.md.
    """
    Omega = np.atleast_1d(np.asarray(speeds, dtype=float))
    if Omega.ndim != 1 or not Omega.size or not np.isfinite(Omega).all() or Omega.min() < 0.0:
        raise ConfigError(f"speeds = {speeds!r}; give angular speeds [rad/s], none below 0.")
    omega, direction, shapes = _waves(sector, diameter, n, Omega[0])
    omega, direction, shapes = omega[:n], direction[:n], shapes[:, :n]
    found, likeness = [omega], [np.ones(n)]
    for w, sides, U in _followed(sector, diameter, n, Omega[1:]):
        mac = np.abs(shapes.conj().T @ (sector.M @ U)) ** 2
        mac[direction[:, None] != sides] = -1.0
        kept = linear_sum_assignment(-mac)[1]
        found.append(w[kept])
        likeness.append(mac[np.arange(n), kept])
        shapes = U[:, kept]
    return WheelCampbell(Omega, diameter, np.array(found), direction, np.array(likeness))


def _followed(
    sector: CyclicSector, diameter: int, n: int, speeds: Array
) -> Iterator[tuple[Array, Array, Complex]]:
    """The waves at one speed after the other; ranks share a few speeds at a time."""
    for first in range(0, speeds.size, SPEEDS_AT_ONCE):
        some = speeds[first : first + SPEEDS_AT_ONCE].tolist()
        yield from sector.workers.each(
            lambda speed: _waves(sector, diameter, n, speed), some, [1.0] * len(some)
        )


def _waves(
    sector: CyclicSector, diameter: int, n: int, speed: float
) -> tuple[Array, Array, Complex]:
    """Circular frequencies, directions and mass-normalised shapes of n waves and a few more."""
    standing, free = sector.standing(diameter), sector.free.size
    most = free if standing else 2 * free
    n = whole("n", n, 1, most)
    if speed:
        waves = travelling_modes(sector, diameter, min(n + N_SPARE_WAVES, most), speed=speed)
        return waves.omega, waves.direction, waves.shapes
    if standing:
        modes = cyclic_modes(sector, diameter, min(n + N_SPARE_WAVES, free))
        return modes.omega, np.zeros(modes.omega.size), modes.shapes
    modes = cyclic_modes(sector, diameter, min((n + 1) // 2 + N_SPARE_WAVES, free))
    both = np.tile([1.0, -1.0], modes.omega.size)  # at rest a wave runs either way
    return np.repeat(modes.omega, 2), both, np.repeat(modes.shapes, 2, axis=1)
