"""Vibration of geared shafts: linearised, and step by step with films and teeth as they are.

To first order the changing stiffness of teeth excites by the transmission error under load: how far
the pinion has to turn for the teeth to carry the same torque in every position, times the mean
stiffness, and moments that wander with the load.

The unit moves as the mechanism it is, by generalised-alpha without damping of its own: that is
Newmark's average acceleration, which keeps the balance of work step by step.

Source:
    Newmark, A method of computation for structural dynamics, J. Eng. Mech. Div. 85 (1959) 67; Velex
    and Ajmi, J. Sound Vib. 290 (2006), for the transmission error.
"""

from dataclasses import dataclass, replace

import numpy as np

from rom.components.gear_mesh.tooth_loads import tooth_loads
from rom.components.transmission.mechanism import (
    NAMES,
    coordinates_of,
    mechanism_of,
    places_of,
    rest,
)
from rom.components.transmission.shaft import ComplexArray, vibrations
from rom.components.transmission.unit import Rest, Transmission
from rom.errors import ModelError, RomError
from rom.mbs.integrate import simulation
from rom.mbs.results.solution import Solution
from rom.model import Array

MAX_ITERATIONS = 60  # in one position of the teeth


@dataclass(frozen=True)
class Whirl:
    """Eigenvalues about an equilibrium.

    Attributes:
        values: (2n,) eigenvalues, least damped first [1/s].
        shapes: (n, 2n) their displacements, columns, in units of the coordinates.
    """

    values: ComplexArray
    shapes: ComplexArray

    @property
    def stable(self) -> bool:
        """Whether all vibrations decay."""
        return bool(self.values.real.max() < 0)


def linearised(state: Rest) -> tuple[Array, Array, Array]:
    """(n, n) mass [kg], damping with gyroscopic forces [N s/m], and stiffness [N/m].

    They are of small motions about an equilibrium; of rotations alike.
    """
    M, K, G = state.unit.matrices
    C = state.unit.loss * K + G + state.forces.damping
    return M, C, K + state.forces.stiffness


def whirl(state: Rest) -> Whirl:
    """Natural vibrations about an equilibrium, teeth as they touch there."""
    values, shapes = vibrations(*linearised(state))
    # of a pair, whose real parts differ by round-off, the one that turns forwards comes first
    growth = (values.real / np.abs(values).max()).round(9)
    order = np.lexsort((-values.imag, -growth))
    return Whirl(values[order], shapes[:, order])


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

    def stable(speed: float) -> bool:
        return whirl(rest(replace(unit, speed=speed))).stable

    found = [stable(speed) for speed in (low, high)]
    if found != [True, False]:
        words = ["whirls" if not s else "does not whirl" for s in found]
        text = f"the unit {words[0]} at {low:.1f} rad/s and {words[1]} at {high:.1f} rad/s"
        raise ModelError(f"{text}: the threshold must lie between them.")
    while high - low > within * low:
        middle = (low + high) / 2
        low, high = (middle, high) if stable(middle) else (low, middle)
    return (low + high) / 2


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
    """Motion from an equilibrium without vibration through some mesh periods [1].

    There are so many steps per mesh period; ``whirling`` goes on although the equilibrium is not
    stable.

    Raises:
        ModelError: if the speed is above the threshold of whirl.
        SolverError: if a step fails; ``error.solution`` is the motion before.
    """
    if not whirling:
        _refuse_whirl(state, "Lower the speed, load the bearings more, or give whirling=True.")
    unit = state.unit
    n_t, t = round(periods * steps), state.theta / unit.speed
    mech, dt = mechanism_of(unit, state.q, np.zeros(state.q.size)), unit.mesh_period / steps
    try:
        found = simulation.simulate(mech, t_start=t, t_end=t + n_t * dt, dt=dt, rho_inf=1.0)
    except RomError as error:
        error.solution = error.solution and _run(unit, error.solution)
        raise
    return _run(unit, found)


def _refuse_whirl(state: Rest, hint: str) -> None:
    """Refuse an equilibrium that does not last."""
    found, speed = whirl(state), state.unit.speed
    growth, omega = found.values[0].real, abs(found.values[0].imag)
    if not found.stable:
        words = f"whirl with {omega:.1f} rad/s and grow by {growth:.3g} per second."
        text = f"the speed of {speed:.1f} rad/s is above the threshold: the journals {words}"
        raise ModelError(text, hint=hint)


def _run(unit: Transmission, found: Solution) -> Run:
    q, v = coordinates_of(unit, found)
    M, K, G = unit.matrices
    drive = -unit.motor * np.outer(q @ unit.drive, unit.drive)
    films: list[Array] = [_felt(unit, found, name) for name in found.mechanism.journal_bearings]
    forces: dict[str, Array] = {
        "drive": drive,
        "load": np.tile(unit.load, (len(q), 1)),
        "films": np.sum(films, axis=0),
        "teeth": _felt(unit, found, "teeth"),
        "shafts": -q @ K.T - v @ (unit.loss * K + G).T - drive,
    }
    w, moved = v + unit.spinning, np.diff(q, axis=0) + np.diff(found.t)[:, None] * unit.spinning
    work = {
        name: np.r_[0.0, np.cumsum(np.sum((f[1:] + f[:-1]) / 2 * moved, axis=1))]
        for name, f in forces.items()
    }
    kinetic = 0.5 * np.sum(w @ M * w, axis=1)
    work["kinetic"] = kinetic - kinetic[0]
    told = *teeth_and_heat(unit, found, q), work, int(found.statistics["iterations"])
    return Run(unit, found.t - found.t[0], q, v, *told)


def teeth_and_heat(unit: Transmission, found: Solution, q: Array) -> tuple[Array, Array, Array]:
    """(n_t,) force between the teeth [N], error of transmission [m], heat in the films [W]."""
    teeth = np.array([load.force.sum() for load in tooth_loads(found, "teeth")])
    error = (q @ unit.wheels[[5, 11]].T) @ unit.mesh.pair.rb
    heat = sum(found.journal_bearing(name).power for name in found.mechanism.journal_bearings)
    return teeth, error, np.asarray(heat)


def _felt(unit: Transmission, found: Solution, name: str) -> Array:
    """(n_t, n) forces of a film or of the teeth on the coordinates."""
    record, felt = found.element(name), np.zeros((found.t.size, unit.load.size))
    places = places_of(unit)[0]
    for k, marker in enumerate(record.markers):
        if marker.body in NAMES:
            part = NAMES.index(marker.body)
            wrench = np.hstack([record.force[:, k], record.moment[:, k]])
            felt[:, unit.parts[part]] += wrench @ places[part][str(marker.place)][1]
    return felt


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

    So many harmonics of the mesh are kept, of so many positions of the teeth in a mesh period; the
    equilibrium is at any of them.

    Raises:
        ModelError: if the unit whirls at that speed.
    """
    unit, W = state.unit, state.unit.wheels
    _refuse_whirl(state, "Lower the speed, or load the bearings more.")
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
