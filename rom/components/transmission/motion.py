"""Vibration of geared shafts: linearised, and step by step with films and teeth as they are.

Newmark's average acceleration; in every step Newton's method over films, their cavitated regions
and the set of teeth in contact together. It keeps the balance of work exactly, step by step.

Source:
    Newmark, A method of computation for structural dynamics, J. Eng. Mech. Div. 85 (1959) 67.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eig

from rom.components.transmission.unit import Rest, Transmission, rest
from rom.errors import ModelError, SolverError, reached
from rom.model import Array

MAX_ITERATIONS, FORCE_RTOL = 30, 1e-9


# coordinates, rates, normal force of the teeth, error of transmission, heat, work
Row = tuple[Array, Array, float, float, float, Array]


@dataclass(frozen=True)
class Whirl:
    """Eigenvalues about an equilibrium.

    Attributes:
        values: (2n,) eigenvalues, least damped first [1/s].
        shapes: (n, 2n) their displacements, columns, in units of the coordinates.
    """

    values: Array
    shapes: Array

    @property
    def stable(self) -> bool:
        """Whether all vibrations decay."""
        return bool(self.values.real.max() < 0)


def linearised(state: Rest) -> tuple[Array, Array, Array]:
    """Matrices of small motions about an equilibrium.

    Returns:
        (n, n) mass [kg], damping with gyroscopic forces [N s/m], stiffness [N/m]; of rotations
        alike.
    """
    M, K, G = state.unit.matrices
    C = state.unit.loss * K + G + state.forces.damping
    return M, C, K + state.forces.stiffness


def whirl(state: Rest) -> Whirl:
    """Natural vibrations about an equilibrium, teeth as they touch there."""
    M, C, K = linearised(state)
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    values, vectors = eig(A)
    # of a pair, whose real parts differ by round-off, the one that turns forwards comes first
    growth = (values.real / np.abs(values).max()).round(9)
    order = np.lexsort((-values.imag, -growth))
    return Whirl(values[order], vectors[:n, order])


def threshold(unit: Transmission, low: float, high: float, *, within: float = 0.01) -> float:
    """Speed of the pinion from which on the journals whirl [rad/s].

    Every speed has its own equilibrium; bisection.

    Args:
        unit: the transmission; its own speed does not matter.
        low: speed without whirl [rad/s].
        high: speed with whirl [rad/s].
        within: share of the speed that the answer may be off [1].

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
        """Work that is missing at the end over the work of the drive [1]."""
        given = sum(w[-1] for name, w in self.work.items() if name != "kinetic")
        return float(abs(given - self.work["kinetic"][-1]) / abs(self.work["drive"][-1]))


def simulate(state: Rest, *, periods: float, steps: int = 100, whirling: bool = False) -> Run:
    """Motion from an equilibrium through some mesh periods.

    Args:
        state: where it starts, without vibration.
        periods: how many mesh periods [1].
        steps: per mesh period.
        whirling: go on although the equilibrium is not stable.

    Raises:
        ModelError: if the speed is above the threshold of whirl.
        SolverError: if a step fails; ``error.solution`` is the motion before.
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
    with reached(lambda: _run(step, rows, dt)):
        for k in range(n_t):
            step.advance(dt, state.theta + unit.speed * (k + 1) * dt)
            rows.append(step.row())
    return _run(step, rows, dt)


def _run(step: "Step", rows: list[Row], dt: float) -> Run:
    q, v, teeth, error, heat, work = (np.array(column) for column in zip(*rows, strict=True))
    names = (*step.NAMES, "kinetic")
    named = {name: work[:, k] - work[0, k] for k, name in enumerate(names)}
    t = dt * np.arange(len(rows))
    return Run(step.unit, t, q, v, teeth, error, heat, named, step.iterations)


class Step:
    """The state of a run: position, rates, forces, work done so far."""

    NAMES = ("drive", "load", "films", "teeth", "shafts")

    def __init__(
        self,
        unit: Transmission,
        q: Array,
        theta: float,
        v: Array | None = None,
        *,
        enough: float = FORCE_RTOL,
        alpha: float = 0.0,
    ):
        """Start from balance; alpha from -1/3 to 0 damps what steps do not resolve.

        Source:
            Hilber, Hughes and Taylor, Earthq. Eng. Struct. Dyn. 5 (1977) 283.
        """
        self.enough, self.alpha = enough, alpha
        self.beta, self.gamma = (1 - alpha) ** 2 / 4, 0.5 - alpha
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

    def advance(self, dt: float, theta: float, guess: Array | None = None) -> None:
        """One step of average acceleration, to the drive's angle; a guess of q saves iterations."""
        unit, before, q0 = self.unit, self._parts(self.q, self.v), self.q
        self.last = self.now
        old, size, now = -self.alpha * before.sum(axis=0), np.abs(before).max(), 1 + self.alpha
        ahead = guess - q0 if guess is not None else dt * self.v + dt**2 / 4 * self.a
        q = q0 + unit.allowed(q0, ahead) * ahead
        for k in range(MAX_ITERATIONS):
            v, a = self._rates(dt, q - q0, self.v, self.a)
            self.now = unit.forces(q, v, theta, self.now.films)
            R = now * (unit.load + self.now.force - self.K @ q - self.C @ v) + old - self.M @ a
            self.iterations += 1
            if np.abs(R).max() < self.enough * size:
                break
            d = np.linalg.solve(self._jacobian(dt), R)
            # where teeth or voids come and go, whole corrections may go round in a circle
            share = 1.0 if k < MAX_ITERATIONS // 2 else 0.5
            q = q + share * unit.allowed(q, d) * d
        else:
            raise SolverError(
                f"a step to {theta:.4f} rad fails: {np.abs(R).max():.3g} N are left.",
                hint="Take more steps per mesh period.",
            )
        self.q, self.v, self.a = q, v, a
        mean = (before + self._parts(q, v)) / 2
        self.work = self.work + mean @ (q - q0 + dt * self.spin)

    def _rates(self, dt: float, moved: Array, v: Array, a: Array) -> tuple[Array, Array]:
        """Newmark's v and a after a step that moved so far, from those before it."""
        new = (moved - dt * v) / (self.beta * dt**2) - (0.5 / self.beta - 1) * a
        return v + dt * ((1 - self.gamma) * a + self.gamma * new), new

    def _jacobian(self, dt: float) -> Array:
        """(n, n) minus the derivative of what is not balanced, by q."""
        K = self.K + self.now.stiffness
        K = K + self.gamma / (self.beta * dt) * (self.C + self.now.damping)
        return self.M / (self.beta * dt**2) + (1 + self.alpha) * K

    def first_tangents(self) -> tuple[Array, Array, Array]:
        """(n, 2n) derivatives of q, v and a by q and v, where a motion starts."""
        n, C, K = self.q.size, self.C + self.now.damping, self.K + self.now.stiffness
        return np.eye(n, 2 * n), np.eye(n, 2 * n, n), -np.linalg.solve(self.M, np.hstack([K, C]))

    def carried(self, dt: float, D: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        """Derivatives of q, v and a after the last step, from those before it."""
        q, v, a = D
        still = self._rates(dt, np.zeros_like(q), v, a)
        C, K = self.C + self.now.damping, self.K + self.now.stiffness
        R = -(1 + self.alpha) * (K @ q + C @ still[0]) - self.M @ still[1]
        if self.alpha:
            C, K = self.C + self.last.damping, self.K + self.last.stiffness
            R += self.alpha * (K @ q + C @ v)
        moved = np.linalg.solve(self._jacobian(dt), R)
        return q + moved, *self._rates(dt, moved, v, a)

    def row(self) -> Row:
        """What a run remembers of this moment."""
        w, rb = self.v + self.spin, self.unit.mesh.pair.rb
        error = rb @ (self.unit.wheels @ self.q)[[5, 11]]
        heat = float(sum(f.dissipated for f in self.now.films))
        work = np.append(self.work, 0.5 * w @ self.M @ w)
        return self.q, self.v, float(self.now.mesh.load.sum()), float(error), heat, work
