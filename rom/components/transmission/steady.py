"""Motion that repeats with every tooth: films and teeth as they are, found by shooting.

The state after one mesh period is a function of the state before it. Newton's method makes both
equal; the derivatives come with the time steps. Their eigenvalues, the multipliers of Floquet, say
whether the motion is stable.

Source:
    Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995).
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rom.components.transmission.motion import Row, Step
from rom.components.transmission.unit import Rest, Transmission, rest
from rom.errors import ModelError, SolverError, reached
from rom.model import Array

MAX_PERIODS = 40
MOTION_RTOL = 1e-6  # of the motion
STEP_FORCE_RTOL = 1e-7  # of forces in a step
MAX_TRIALS = 3
ALPHA = -0.05  # films are so stiff that without damping rates alternate from step to step


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

    Where Newton's method does not come closer, time goes on for a period, as it does in a machine.
    A step that ends just when a tooth leaves may have no solution; then one step more is taken.

    Args:
        start: equilibrium, or a motion; its unit is what moves.
        steps: per mesh period.

    Raises:
        ModelError: if teeth differ, so that nothing repeats with the mesh.
        SolverError: if a step fails, or no such motion is found.
    """
    if any(len(errors) for errors in start.unit.mesh.correction.pitch):
        raise ModelError(
            "with pitch errors no motion repeats with every tooth.",
            hint="Leave out the pitch errors, or simulate.",
        )
    for more in range(MAX_TRIALS - 1):
        try:
            return _closed(start, steps + more)
        except SolverError:
            continue
    return _closed(start, steps + MAX_TRIALS - 1)


def _closed(start: Rest | Steady, steps: int) -> Steady:
    unit = start.unit
    q, v = (start.q, np.zeros(start.q.size)) if isinstance(start, Rest) else (
        start.q[0], start.v[0])  # fmt: skip
    n, last, dt, guess = q.size, np.inf, unit.mesh_period / steps, None
    for count in range(1, MAX_PERIODS + 1):
        rows, F, Q = _period(unit, q, v, start.theta, steps, guess)
        ends = np.array([rows[-1][k] - rows[0][k] for k in (0, 1)])
        gap = float(np.abs(ends * [[1.0], [unit.mesh_period]]).max() / np.abs(q).max())
        if gap < MOTION_RTOL:
            return _found(unit, start.theta, rows, F, count, gap)
        if gap > last:
            q, v, last, guess = rows[-1][0], rows[-1][1], np.inf, None
            continue
        last, change = gap, np.linalg.solve(np.eye(2 * n) - F, ends.ravel())
        change *= min(unit.allowed(q, change[:n]), unit.allowed(q, dt * change[n:]))
        q, v = q + change[:n], v + change[n:]
        guess = np.array([row[0] for row in rows]) + Q @ change
    raise SolverError(
        f"no motion repeats with the mesh at {unit.speed:.1f} rad/s: after {MAX_PERIODS} periods "
        f"{gap:.1e} of the motion are left.",
        hint="Start from a speed nearby, take more steps per period, or simulate.",
    )


def sweep(unit: Transmission, speeds: Iterable[float], *, steps: int = 60) -> list[Steady]:
    """Motion that repeats with the mesh at many speeds, each found from the one before.

    Where two motions are possible, going up and going down may find different ones.

    Args:
        unit: the transmission; its own speed does not matter.
        speeds: of the pinion, in the order in which they are run through [rad/s].
        steps: per mesh period.

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


def _period(
    unit: Transmission,
    q: Array,
    v: Array,
    theta: float,
    steps: int,
    guess: Array | None = None,
) -> tuple[list[Row], Array, Array]:
    """What happens at every step, and derivatives by the start: of the end, of q at every step.

    The derivatives are (2n, 2n) and (steps + 1, n, 2n), the guess is (steps + 1, n).
    """
    step, dt = (
        Step(unit, q, theta, v, enough=STEP_FORCE_RTOL, alpha=ALPHA),
        unit.mesh_period / steps,
    )
    rows, D = [step.row()], step.first_tangents()
    Q = [D[0]]
    for k in range(1, steps + 1):
        near = None if guess is None else guess[k]
        step.advance(dt, theta + unit.speed * k * dt, near)
        rows.append(step.row())
        D = step.carried(dt, D)
        Q.append(D[0])
    return rows, np.vstack(D[:2]), np.array(Q)


def _found(
    unit: Transmission, theta: float, rows: list[Row], F: Array, count: int, gap: float
) -> Steady:
    q, v, teeth, error, heat, _ = (np.array(column) for column in zip(*rows, strict=True))
    values = np.linalg.eigvals(F).astype(complex)
    values = values[np.argsort(-np.abs(values))]
    t = unit.mesh_period * np.linspace(0, 1, len(rows))
    return Steady(unit, theta, t, q, v, teeth, error, heat, values, count, gap)
