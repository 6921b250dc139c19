"""Motion that repeats with every tooth: the periodic motion of the unit as a mechanism.

Source:
    Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995).
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from rom.components.orbits.motion import PeriodicMotion, periodic_motion
from rom.components.transmission.mechanism import coordinates_of, mechanism_of, rest
from rom.components.transmission.motion import teeth_and_heat
from rom.components.transmission.unit import Rest, Transmission
from rom.errors import ModelError, reached
from rom.model import Array

GAP_TOL = 1e-10  # in rad or lengths of the unit
RHO_INF = 0.9  # films are so stiff that without damping rates alternate from step to step


@dataclass(frozen=True)
class Steady:
    """A motion through one mesh period that ends as it began.

    Attributes:
        unit: what moves.
        theta: angle that the drive has turned at the start [rad].
        t: (n_t,) [s]; first and last are a period apart.
        q, v: (n_t, n) coordinates and rates [m, rad; per second].
        teeth: (n_t,) normal force between the teeth [N].
        error: (n_t,) of transmission, along the line of action [m].
        heat: (n_t,) power that becomes heat in the films [W].
        multipliers: (2n,) of Floquet [1], largest first.
        passes: through the period until it closed.
        gap: what is left of it, over the largest coordinate [1].
        motion: the same of the mechanism, from which motions nearby are found; None if unknown.
    """

    unit: Transmission
    theta: float
    t: Array
    q: Array
    v: Array
    teeth: Array
    error: Array
    heat: Array
    multipliers: npt.NDArray[np.complex128]
    passes: int
    gap: float
    motion: PeriodicMotion | None = field(default=None, repr=False, compare=False)

    @property
    def stable(self) -> bool:
        """Whether small disturbances decay."""
        return bool(np.abs(self.multipliers[0]) < 1)

    @property
    def error_rms(self) -> float:
        """Root mean square of the error of transmission about its mean [m]."""
        return float(np.std(self.error[1:]))

    @property
    def load_factor(self) -> float:
        """Largest over mean force between the teeth [1]."""
        return float(self.teeth.max() / self.teeth[1:].mean())

    @property
    def apart(self) -> float:
        """Share of the time in which no teeth touch [1]."""
        return float(np.mean(self.teeth[1:] == 0))

    @property
    def orbits(self) -> Array:
        """(bearings, n_t, 2) path of each journal in its bush; the gear's is seen mirrored [m]."""
        return np.stack([self.q @ inside[:2].T for inside, _, _ in self.unit.journals])


def steady(start: Rest | Steady, *, steps: int = 60) -> Steady:
    """The motion that repeats with the mesh, near an equilibrium or a motion nearby.

    The unit of the start is what moves, in so many steps per mesh period.

    Raises:
        ModelError: if teeth differ, or a film conserves its oil and remembers it, so that nothing
            repeats with the mesh.
        SolverError: if a step fails, or no such motion is found.
    """
    if any(len(errors) for errors in start.unit.mesh.correction.pitch):
        raise ModelError("with pitch errors no motion repeats with every tooth; simulate.")
    unit = start.unit
    q, v = (start.q, 0.0 * start.q) if isinstance(start, Rest) else (start.q[0], start.v[0])
    mech, near = mechanism_of(unit, q, v), None if isinstance(start, Rest) else start.motion
    if near is not None:
        both = ([part.moving for part in m.parts.values()] for m in (mech, near.solution.mechanism))
        if not all(np.array_equal(a.K, b.K) for a, b in zip(*both, strict=True)):
            near = None  # the coordinates of both do not mean the same
    repeated = partial(periodic_motion, rho_inf=RHO_INF, tolerance=GAP_TOL, steps=steps)
    t = start.theta / unit.speed
    found = repeated(mech, period=unit.mesh_period, start=near, t_start=t)
    moved = found.solution
    q, v = coordinates_of(unit, moved)
    ends = np.abs([q[-1] - q[0], unit.mesh_period * (v[-1] - v[0])])
    told = *teeth_and_heat(unit, moved, q), found.multipliers, found.passes
    gap = float(ends.max() / np.abs(q).max())
    return Steady(unit, start.theta, moved.t - moved.t[0], q, v, *told, gap, found)


def sweep(unit: Transmission, speeds: Iterable[float], *, steps: int = 60) -> list[Steady]:
    """Motion that repeats with the mesh at many speeds, each found from the one before.

    Where two motions are possible, going up and going down may find different ones. Speeds are
    those of the pinion, in the order in which they are run through [rad/s], in so many steps per
    mesh period; the unit's own speed does not matter.

    Raises:
        ModelError, SolverError: as `rest` and `steady`; ``error.solution`` holds the motions
            before.
    """
    found: list[Steady] = []
    with reached(lambda: found):
        for speed in speeds:
            there = replace(unit, speed=float(speed))
            start = replace(found[-1], unit=there) if found else rest(there)
            found.append(steady(start, steps=steps))
    return found
