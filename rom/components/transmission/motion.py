"""Vibration of geared shafts: linearised, and step by step with films and teeth as they are.

Newmark's average acceleration; in every step Newton's method over films, their cavitated regions
and the set of teeth in contact together. It keeps the balance of work exactly, step by step.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eig

from rom.components.transmission.unit import Rest, Transmission, rest
from rom.errors import ModelError, SolverError
from rom.model import Array

TIMES, ENOUGH = 30, 1e-9


@dataclass(frozen=True)
class Whirl:
    """Eigenvalues about an equilibrium.

    Attributes:
        values: (2n,) eigenvalues, least damped first [1/s].
        shapes: (n, 2n) their displacements, columns.
    """

    values: Array
    shapes: Array

    @property
    def stable(self) -> bool:
        """Whether all vibrations decay."""
        return bool(self.values.real.max() < 0)


def linearised(state: Rest) -> tuple[Array, Array, Array]:
    """(n, n) mass, damping with gyroscopic forces, and stiffness about an equilibrium."""
    M, K, G = state.unit.matrices
    C = state.unit.loss * K + G + state.forces.damping
    return M, C, K + state.forces.stiffness


def whirl(state: Rest) -> Whirl:
    """Natural vibrations about an equilibrium, teeth as they touch there."""
    M, C, K = linearised(state)
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    values, vectors = eig(A)
    order = np.argsort(-values.real)
    return Whirl(values[order], vectors[:n, order])


def threshold(unit: Transmission, low: float, high: float, *, within: float = 0.01) -> float:
    """Speed of the pinion from which on the journals whirl [rad/s].

    Every speed has its own equilibrium; bisection.

    Args:
        unit: the transmission; its own speed does not matter.
        low: speed without whirl [rad/s].
        high: speed with whirl [rad/s].
        within: share of the speed that the answer may be off.

    Raises:
        ModelError: if both speeds whirl, or neither.
    """
    found = [_stable(unit, speed) for speed in (low, high)]
    if found != [True, False]:
        words = ["whirls" if not s else "does not whirl" for s in found]
        raise ModelError(
            f"the unit {words[0]} at {low:.1f} rad/s and {words[1]} at {high:.1f} rad/s: the "
            "threshold is not between them."
        )
    while high - low > within * low:
        middle = (low + high) / 2
        low, high = (middle, high) if _stable(unit, middle) else (low, middle)
    return (low + high) / 2


def _stable(unit: Transmission, speed: float) -> bool:
    return whirl(rest(replace(unit, speed=speed))).stable


@dataclass(frozen=True)
class Run:
    """A motion, step by step.

    Attributes:
        unit: what moved.
        t: (n_t,) [s].
        q, v: (n_t, n) coordinates and rates [m, rad; per second].
        teeth: (n_t,) normal force between the teeth [N].
        error: (n_t,) of transmission, along the line of action [m].
        heat: (n_t,) power that becomes heat in the films [W].
        work: {what: (n_t,)} work on the shafts up to now [J]: drive, load, films, teeth, shafts,
            and kinetic, the energy gained.
        iterations: of Newton's method, all steps.
    """

    unit: Transmission
    t: Array
    q: Array
    v: Array
    teeth: Array
    error: Array
    heat: Array
    work: dict[str, Array]
    iterations: int

    @property
    def balance(self) -> float:
        """Work that is missing at the end over the work of the drive."""
        given = sum(w[-1] for name, w in self.work.items() if name != "kinetic")
        return float(abs(given - self.work["kinetic"][-1]) / abs(self.work["drive"][-1]))


def simulate(state: Rest, *, periods: float, steps: int = 100, whirling: bool = False) -> Run:
    """Motion from an equilibrium through some mesh periods.

    Args:
        state: where it starts, without vibration.
        periods: how many mesh periods.
        steps: per mesh period.
        whirling: go on although the equilibrium is not stable.

    Raises:
        ModelError: if the speed is above the threshold of whirl.
        SolverError: if a step fails.
    """
    unit = state.unit
    if not whirling and not whirl(state).stable:
        fastest = whirl(state).values[0]
        raise ModelError(
            f"the speed of {unit.speed:.1f} rad/s is above the threshold: the journals whirl with "
            f"{abs(fastest.imag):.1f} rad/s and grow by {fastest.real:.3g} per second.",
            hint="Lower the speed, load the bearings more, or let it whirl with whirling=True.",
        )
    dt, n_t = unit.mesh_period / steps, round(periods * steps)
    step = Step(unit, state.q, state.theta)
    rows = [step.row()]
    for k in range(n_t):
        step.advance(dt, state.theta + unit.speed * (k + 1) * dt)
        rows.append(step.row())
    q, v, teeth, error, heat, work = (np.array(column) for column in zip(*rows, strict=True))
    names = (*step.NAMES, "kinetic")
    named = {name: work[:, k] - work[0, k] for k, name in enumerate(names)}
    return Run(unit, dt * np.arange(n_t + 1), q, v, teeth, error, heat, named, step.iterations)


class Step:
    """The state of a run: position, rates, forces, work done so far."""

    NAMES = ("drive", "load", "films", "teeth", "shafts")

    def __init__(
        self,
        unit: Transmission,
        q: Array,
        theta: float,
        v: Array | None = None,
        enough: float = ENOUGH,
    ):
        self.enough = enough
        self.unit, self.q, self.v = unit, q, np.zeros(q.size) if v is None else v
        self.M, self.K, self.G = unit.matrices
        self.C = unit.loss * self.K + self.G
        self.spin = unit.spinning
        self.now = unit.forces(q, self.v, theta)
        self.a = np.linalg.solve(self.M, self._parts(q, self.v).sum(axis=0))
        self.work, self.iterations = np.zeros(len(self.NAMES)), 0

    def _parts(self, q: Array, v: Array) -> Array:
        """(5, n) forces of drive, load, films, teeth, shafts."""
        turned = self.unit.drive
        drive = -self.unit.motor * (turned @ q) * turned
        teeth = self.now.mesh.force @ self.unit.wheels
        shafts = -self.K @ q - self.C @ v - drive
        return np.stack([drive, self.unit.load, self.now.force - teeth, teeth, shafts])

    def advance(self, dt: float, theta: float) -> None:
        """One step of average acceleration."""
        unit, before, q0, v0, a0 = self.unit, self._parts(self.q, self.v), self.q, self.v, self.a
        ahead, size = dt * v0 + dt**2 / 4 * a0, np.abs(before).max()
        q = q0 + unit.allowed(q0, ahead) * ahead
        linear = 4 / dt**2 * self.M + 2 / dt * self.C + self.K
        for _ in range(TIMES):
            v = 2 / dt * (q - q0) - v0
            a = 2 / dt * (v - v0) - a0
            self.now = unit.forces(q, v, theta, self.now.films)
            R = unit.load + self.now.force - self.K @ q - self.C @ v - self.M @ a
            self.iterations += 1
            if np.abs(R).max() < self.enough * size:
                break
            J = linear + self.now.stiffness + 2 / dt * self.now.damping
            d = np.linalg.solve(J, R)
            q = q + unit.allowed(q, d) * d
        else:
            raise SolverError(
                f"a step to {theta:.4f} rad fails: {np.abs(R).max():.3g} N are left.",
                hint="Take more steps per mesh period.",
            )
        self.q, self.v, self.a = q, v, a
        mean = (before + self._parts(q, v)) / 2
        self.work = self.work + mean @ (q - q0 + dt * self.spin)

    def first_tangents(self) -> tuple[Array, Array, Array]:
        """(n, 2n) derivatives of q, v and a by q and v, where a motion starts."""
        n, C, K = self.q.size, self.C + self.now.damping, self.K + self.now.stiffness
        return np.eye(n, 2 * n), np.eye(n, 2 * n, n), -np.linalg.solve(self.M, np.hstack([K, C]))

    def carried(self, dt: float, D: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        """Derivatives of q, v and a after the last step, from those before it."""
        q, v, a = D
        C, K = self.C + self.now.damping, self.K + self.now.stiffness
        J = 4 / dt**2 * self.M + 2 / dt * C + K
        b = self.M @ (4 / dt**2 * q + 4 / dt * v + a) + C @ (2 / dt * q + v)
        new = np.linalg.solve(J, b)
        moved = 2 / dt * (new - q)
        return new, moved - v, 2 / dt * (moved - 2 * v) - a

    def row(self) -> tuple:
        """What a run remembers of this moment."""
        w, rb = self.v + self.spin, self.unit.mesh.pair.rb
        error = rb @ (self.unit.wheels @ self.q)[[5, 11]]
        heat = sum(f.dissipated for f in self.now.films)
        work = np.append(self.work, 0.5 * w @ self.M @ w)
        return self.q, self.v, self.now.mesh.load.sum(), error, heat, work
