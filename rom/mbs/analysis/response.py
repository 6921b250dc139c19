"""Response of a linearised mechanism to harmonic forces and to harmonic motion of a drive."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import identity

from rom.arguments import typed, vector
from rom.errors import ConfigError, ModelError, SolverError
from rom.mbs.analysis.few_modes import Pencil
from rom.mbs.analysis.linearize import (
    Linearization,
    jacobian,
    linearize,
    refuse_rolling,
    sparse_equations,
)
from rom.mbs.analysis.local_equations import Instant, consistent, instant
from rom.mbs.analysis.rotors.moving_axes import chosen
from rom.mbs.equations.sparse_solve import Constrained
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker
from rom.mbs.results.state import State
from rom.model import Array
from rom.names import check_known

# reciprocal condition number of the dynamic stiffness from which a response counts as infinite
RECIPROCAL_CONDITION_TOL = 1e-13
# what one refinement changes of a solution of sparse equations from which it counts as none
MAX_SOLUTION_ERROR_RATIO = 1e-3


@dataclass(frozen=True)
class FrequencyResponse:
    """Steady motion of one marker under a harmonic force on another.

    Attributes:
        frequencies: (f,) [Hz].
        receptance: (f, 6, 6) complex; translation [m] and rotation [rad] of the marker, world,
            per force [N] and moment [N m].
    """

    frequencies: Array
    receptance: Any

    @property
    def mobility(self) -> Any:
        """(f, 6, 6) velocities per force."""
        return 2j * np.pi * self.frequencies[:, None, None] * self.receptance

    @property
    def accelerance(self) -> Any:
        """(f, 6, 6) accelerations per force."""
        return 2j * np.pi * self.frequencies[:, None, None] * self.mobility


@typed
def frequency_response(
    mechanism: Mechanism,
    state: State | None,
    frequencies: npt.ArrayLike,
    *,
    force: Marker,
    motion: Marker,
    frame: object = "body",
    assemble: bool = False,
) -> FrequencyResponse:
    """Respond to a harmonic force, linearly around a state.

    Args:
        mechanism: bodies, joints, forces.
        state: from `equilibrium`; None for the start.
        frequencies: (f,) of the force [Hz].
        force: marker on which force and moment act, in the world.
        motion: marker whose motion is wanted.
        frame: see `linearize`.
        assemble: see `rom.simulate`.

    Raises:
        ConfigError: for an unknown marker or a wrong frequency.
        SolverError: naming the frequency at which the response is infinite.
    """
    f = _checked(frequencies)
    large = _Large.of(mechanism, state, frame, assemble)
    if large:
        load = large.motion(force).T
        return FrequencyResponse(f, large.motions(f, lambda s: load, large.motion(motion)))
    around = linearize(mechanism, state, frame=frame, assemble=assemble)
    load = (around.jacobian(force) @ around.test).T
    found = around.motion(motion) @ _solved(around, f, np.broadcast_to(load, (f.size, *load.shape)))
    return FrequencyResponse(f, found)


@typed
def transmissibility(
    mechanism: Mechanism,
    state: State | None,
    frequencies: npt.ArrayLike,
    *,
    drive: str,
    motion: Marker,
    assemble: bool = False,
) -> Array:
    """Motion of a marker while a drive shakes the mechanism around a state of rest.

    Args:
        mechanism: bodies, joints, forces, and the drive.
        state: from `equilibrium`; None for the start.
        frequencies: (f,) of the drive [Hz].
        drive: name of the drive.
        motion: marker whose motion is wanted.
        assemble: see `rom.simulate`.

    Returns:
        (f, 6) complex; translation and rotation of the marker, world, per unit of the drive.

    Raises:
        ConfigError: for an unknown drive or marker, or a wrong frequency.
        ModelError: if the mechanism moves, or the joints do not let the drive move.
        SolverError: naming the frequency at which the response is infinite.
    """
    f = _checked(frequencies)
    check_known(drive, mechanism.drives, f"no drive {drive!r}; the mechanism has")
    large = _Large.of(mechanism, state, "body", assemble)
    if large:
        _refuse_moving(large.state)
        return large.shaken(f, drive, motion)
    around = linearize(mechanism, state, assemble=assemble)
    _refuse_moving(around.state)
    now = instant(mechanism, around.state.t)
    now.W.base[:] = around.state.base
    M, C, K = now.matrices(around.state)
    G, scale = now.gradient(around.state.q, around.state.v)[1], now.probe()
    unit = np.zeros(G.shape[0])
    unit[now.packed.rows_of(drive)] = 1.0
    enforced = scale * np.linalg.lstsq(G * scale, unit, rcond=1e-9)[0]  # and no other joint
    if np.abs(G @ enforced - unit).max() > 1e-8:
        raise _blocked(drive)
    s = 2j * np.pi * f[:, None]
    load = -(s**2 * (M @ enforced) + s * (C @ enforced) + K @ enforced) @ around.test
    y = _solved(around, f, load[:, :, None])[:, :, 0]
    return (y @ around.basis.T + enforced) @ around.jacobian(motion).T


def _refuse_moving(state: State) -> None:
    if state.v.any():
        raise ModelError("transmissibility needs rest; give the state of rom.equilibrium.")


@dataclass(frozen=True)
class _Large:
    """Small motions of a large mechanism by sparse matrices."""

    now: Instant
    state: State
    pencil: Pencil  # masses, damping, stiffness and constraints
    H: Array  # (k, 6, 6 + R) motion of all markers

    @classmethod
    def of(
        cls, mechanism: Mechanism, state: State | None, frame: object, assemble: bool
    ) -> "_Large | None":
        """The equations; None where whole matrices are cheaper, or needed."""
        now = instant(mechanism, 0.0 if state is None else state.t, sparse=None)
        if now.pattern is None:
            return None
        state = consistent(now, state, assemble)
        refuse_rolling(now.packed, state)
        found = sparse_equations(now, state, chosen(frame, now.packed.names))
        now.evaluate(state.q, state.v)
        return found and cls(now, state, found.now, now.W.H.copy())

    def motion(self, marker: Marker) -> Array:
        """(6, n) of a marker per motion of the pencil."""
        return np.asarray(jacobian(self.now.packed, self.H, marker) @ self.pencil.basis)

    def motions(self, f: Array, load: Callable[[complex], Array], seen: Array) -> Array:
        """(f, k, l) motions seen (k, n) under loads (n, l), which depend on i omega."""
        return np.array([seen @ self.amplitudes(s, load(s)) for s in 2j * np.pi * f])

    def amplitudes(self, s: complex, load: Array) -> Array:
        """(n, l) motions under harmonic loads; the error of the solution says if it is one."""
        p = self.pencil
        try:
            equations = p.inverse(p.K + s * p.C + s * s * p.M)
            u, l = equations.solve(load.astype(complex))
            error = equations.error(load, u, l)
        except SolverError:
            error = np.inf
        if not error < MAX_SOLUTION_ERROR_RATIO:
            raise _infinite(abs(s) / (2 * np.pi))
        return np.asarray(u)

    def shaken(self, f: Array, drive: str, marker: Marker) -> Array:
        """(f, 6) motion of a marker per unit of a drive."""
        p, packed = self.pencil, self.now.packed
        unit = np.zeros(p.G.shape[0])
        unit[packed.rows_of(drive)] = 1.0
        unit /= p.row
        still = Constrained(identity(p.M.shape[0]), p.G, redundant=not p.independent)
        enforced = still.solve(np.zeros(p.M.shape[0]), unit)[0]
        if np.abs(p.G @ enforced - unit).max() > 1e-8 * np.abs(unit).max():
            raise _blocked(drive)
        force = np.stack([A @ enforced for A in (p.K, p.C, p.M)])
        seen = self.motion(marker)
        found = self.motions(f, lambda s: -(np.array([1, s, s * s]) @ force)[:, None], seen)
        return found[:, :, 0] + seen @ enforced


def _infinite(f: float) -> SolverError:
    return SolverError(
        f"the response at {f:.9g} Hz is infinite: a free motion, or a resonance that nothing "
        "damps.",
        hint="Leave this frequency out, add damping, or hold the mechanism.",
    )


def _blocked(drive: str) -> ModelError:
    return ModelError(
        "the other joints do not let this drive move.",
        where=drive,
        hint="Take out the joint that holds it, or drive another one.",
    )


def _checked(frequencies: npt.ArrayLike) -> Array:
    f = vector("frequencies", np.atleast_1d(frequencies))
    if (f < 0).any():
        raise ConfigError(f"frequencies = {frequencies!r} must be a list of numbers from zero on.")
    return f


def _solved(around: Linearization, f: Array, load: Array) -> Array:
    """Amplitudes of the coordinates for the loads (f, n, k)."""
    w = 2 * np.pi * f[:, None, None]
    A = around.K - w**2 * around.M + 1j * w * around.C
    size = np.sqrt(np.maximum(np.abs(np.diagonal(A, axis1=1, axis2=2)), 1e-300))
    scaled = A / size[:, :, None] / size[:, None, :]
    singular = 1 / np.linalg.cond(scaled) if A.shape[1] else np.ones(f.size)
    if singular.min() < RECIPROCAL_CONDITION_TOL:
        raise _infinite(f[int(np.argmin(singular))])
    return np.linalg.solve(A, load)
