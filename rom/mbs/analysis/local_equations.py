"""How the equations of motion change around one state, and which motions the joints leave.

`snapshot` is such a state as a motion of one instant, which answers whatever motions answer.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from rom.arguments import typed
from rom.errors import ConfigError, ModelError, SolverError
from rom.mbs.elements.family import Laws, apply_laws
from rom.mbs.equations.equations import evaluate, linearize_constraints, residual, retract, tangents
from rom.mbs.equations.packing import Packed, pack
from rom.mbs.equations.sparse_solve import Matrix, Pattern
from rom.mbs.integrate.consistent_start import (
    fitting_velocity,
    independent,
    initial_state,
    prescribed,
    with_accelerations,
)
from rom.mbs.kernels.system import ROLL, WORK, System
from rom.mbs.kernels.work import Work, workspace
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State, check_state
from rom.model import Array

# central differences: rotations in rad, displacements in sizes of the mechanism
DIFFERENCE_STEP = 1e-5
DIFFERENCE_SPACING = 1e-6  # of drives [s]
ELASTIC_TURN = 1e-4  # rotation of a marker by deformation, up to which tangents are exact [rad]
MAX_DENSE = 200  # coordinates up to which dense matrices are quicker
GAP_RTOL = 1e-7  # of the mechanism's size
VELOCITY_RTOL = 1e-3  # a time integration leaves far less


@dataclass(frozen=True)
class Instant:
    """A mechanism at one time, ready to be asked for its equations at any coordinates."""

    packed: Packed
    W: Work
    t: float  # [s]
    laws: Laws
    load: float = 1.0  # factor of gravity, of loads and of forces of Python functions
    pattern: Pattern | None = None  # of sparse matrices, in which all are given then

    def scaled(self, load: float) -> "Instant":
        """The same with another factor of the loads; the memory is shared."""
        self.W.load[0] = load
        return replace(self, load=load)

    def at(self, t: float) -> "Instant":
        """The same at another time; the memory is shared."""
        span = -np.inf, np.inf
        table = prescribed(self.packed.signals, np.array([t]), span, DIFFERENCE_SPACING)
        self.W.signal[:] = table[0]
        return replace(self, t=t)

    @cached_property
    def system(self) -> System:
        """The arrays of the mechanism, gravity times the factor of the loads."""
        s = self.packed.system
        return s.replace(bodies=s.bodies.replace(gravity=self.load * s.bodies.gravity))

    @property
    def independent(self) -> bool:
        """Whether no constraint is known to repeat others."""
        return bool(self.packed.by_blocks and not self.packed.shares)

    def evaluate(self, q: Array, v: Array) -> None:
        """Everything that depends on coordinates and velocities, Python forces included."""
        evaluate(self.packed.system, self.W, q, v)
        apply_laws(self.laws, self.W, self.t)

    def residual(self, q: Array, v: Array, a: Array, lam: Array) -> Array:
        """(n,) equations of motion M a + h - Q + G^T lam."""
        self.evaluate(q, v)
        residual(self.system, self.W, q, v, a, lam)
        if self.packed.broken_laws:
            hint = "Begin closer; what is wrong with a law of yours rom.check_law finds."
            raise SolverError(
                f"no forces at t = {self.t:.9g} s{self.packed.broken_laws}.", hint=hint
            )
        return self.W.residual.copy()

    def gradient(self, q: Array, v: Array) -> tuple[Array, Matrix, Matrix]:
        """(m,) gaps of the constraints, their gradient (m, n), and the mass matrix (n, n)."""
        linearize_constraints(self.packed.system, self.W, q, v)
        value, G, M = self.W.value.copy(), self.W.G, self.W.S
        if self.pattern is None:
            return value, G.copy(), M.copy()
        return value, self.pattern.gradient(G), self.pattern.matrix(M)

    def difference(self, f: Callable[[Array], Array]) -> Matrix:
        """(n, n) central differences of forces f by motions or velocities."""
        if self.pattern is None:
            return difference(f, self.probe())
        return self.pattern.differences(f, self.probe())

    def exact(self, state: State) -> bool:
        """Whether the tangents of the time integration are exact enough at this state.

        They leave out how the rates that forces depend on change with the position, and what
        finite elastic rotations of markers do to moments. Differences span micrometres, and are
        worse where films are a few of them thick.
        """
        self.evaluate(state.q, state.v)
        if self.packed.room and not self.packed.has_potential:
            return True
        rests = not state.v.any() or not self.packed.by_rate
        return bool(rests and np.abs(self.W.theta).max(initial=0.0) < ELASTIC_TURN)

    def matrices(self, state: State) -> tuple[Matrix, Matrix, Matrix]:
        """(n, n) derivatives of the residual by accelerations, velocities, coordinates.

        Those by coordinates for rotations in the body frame.
        """
        q, v, a, lam = state.q, state.v, state.a, state.lam
        exact = self.exact(state)
        self.residual(q, v, a, lam)
        apply_laws(self.laws, self.W, self.t, slopes=True)
        tangents(self.system, self.W, v, a, lam, (0.0, 1.0, 1.0))
        found = self.W.S, self.W.Kt
        C, K = (A.copy() if self.pattern is None else self.pattern.matrix(A) for A in found)
        if not exact:
            K = self.difference(lambda dq: self.residual(self.shifted(q, dq), v, a, lam))
        return self.gradient(q, v)[2], C, K

    def reactions(self, state: State) -> Array:
        """(n, m) derivative of the residual by the multipliers; friction may depend on them."""
        q, v, a = state.q, state.v, state.a
        step = np.full(state.lam.size, DIFFERENCE_STEP * np.abs(state.lam).max(initial=0.0) or 1.0)
        return difference(lambda d: self.residual(q, v, a, state.lam + d), step)

    def shifted(self, q: Array, delta: Array) -> Array:
        """(n_q,) coordinates q after the small motion delta (n,)."""
        out = np.empty_like(q)
        retract(self.packed.system, q, np.ascontiguousarray(delta), out)
        return out

    def remember(self, state: State) -> None:
        """Count the joint coordinates from those of a state."""
        if state.base is None:
            return
        if np.size(state.base) != self.W.base.size:
            text = f"the state has {np.size(state.base)} joint coordinates that forces act on"
            raise ConfigError(f"{text}; this mechanism has {self.W.base.size}.")
        self.W.base[:] = state.base

    def moved(self, state: State, step: Array, dlam: Array) -> State:
        """A state at rest after a small motion (n,), and a change (m,) of the reactions."""
        q = self.shifted(state.q, step)
        self.remember(state)
        self.evaluate(q, state.v)
        self.W.base[: self.W.x.size] = self.W.x
        return replace(state, q=q, lam=state.lam + dlam, base=self.W.base.copy())

    def rate(self, state: State) -> float:
        """Speed of the mechanism in radians, or in its sizes, per second [1/s]."""
        v, a = np.abs(state.v) / self.packed.unit, np.abs(state.a) / self.packed.unit
        return float(max(v.max(initial=0.0), np.sqrt(a.max(initial=0.0))))

    def probe(self) -> Array:
        """(n,) small motion of each coordinate for differences."""
        return DIFFERENCE_STEP * self.packed.unit


def difference(f: Callable[[Array], Array | float], step: Array) -> Array:
    """Central differences of f by the entries of its argument, as columns."""
    columns = [(f(e) - f(-e)) / (2 * e[k]) for k, e in enumerate(np.diag(step))]
    return np.array(columns).reshape(step.size, -1).T


def instant(mechanism: Mechanism, t: float, *, sparse: bool | None = False) -> Instant:
    """The mechanism with its drives and loads at time t [s]; sparse: None for large ones only."""
    packed = pack(mechanism, whole=sparse is False)
    if sparse is None:
        sparse = packed.v.size > MAX_DENSE
        packed = packed if sparse else packed.whole()
    if sparse and packed.by_blocks and not independent(packed):
        packed = packed.sharing()
    W = workspace(packed.system, len(packed.signals))
    pattern = Pattern(packed) if sparse else None
    return Instant(packed, W, float(t), packed.asked, pattern=pattern).at(float(t))


def consistent(now: Instant, state: State | None, assemble: bool = False) -> State:
    """The state with velocities, accelerations and multipliers that belong together."""
    packed, W = now.packed, now.W
    if state is None:
        state = initial_state(packed, now.t, assemble=assemble)
    check_state(state, packed)
    now.remember(state)
    value, G, _ = now.gradient(state.q, state.v)
    rolls = packed.system.rows.kind == ROLL
    _check(packed, np.where(rolls, 0.0, value) / packed.row_scale, GAP_RTOL, "stays open by")
    v = fitting_velocity(packed, W, state.q, state.v)
    size = (abs(G) @ np.maximum(np.abs(v), np.abs(state.v))).max(initial=0.0)
    if size > 0.0:
        _check(packed, G @ (v - state.v) / size, VELOCITY_RTOL, "contradicts the velocities by")
    state = replace(state, v=v, t=now.t)
    now.evaluate(state.q, state.v)
    return with_accelerations(packed, W, state)


def _check(packed: Packed, miss: Array, limit: float, what: str) -> None:
    if not miss.size or np.abs(miss).max() <= limit:
        return
    k = int(np.argmax(np.abs(miss)))
    where = packed.row_owner[k]
    text = f"the state does not fit the mechanism at this time: {where!r} {what} {abs(miss[k]):.3g}"
    hint = "Take a state of the same mechanism and give its time t."
    raise ModelError(f"{text} (relative).", where=where, hint=hint)


def free_motions(G: Array, scale: Array, rank: int) -> Array:
    """(n, n - rank) motions that the constraints G allow, orthonormal when divided by ``scale``."""
    if not rank:
        return np.diag(scale)
    A = G * scale
    norms = np.linalg.norm(A, axis=1)
    V = np.linalg.svd(A / np.where(norms > 0, norms, 1.0)[:, None])[2]
    return scale[:, None] * V[rank:].T


def of_unit_mass(Z: Array, mass: Array) -> Array:
    """The same motions, combined so that Z^T mass Z is the unit matrix."""
    try:
        L = np.linalg.cholesky(Z.T @ mass @ Z)
    except np.linalg.LinAlgError as error:
        text = "the mass matrix is not positive definite: a body deforms beyond linear shapes."
        raise SolverError(text) from error
    return solve_triangular(L, Z.T, lower=True).T if Z.size else Z


def of_instant(mechanism: Mechanism, now: Instant, at: State) -> Solution:
    """A consistent state as a motion of one instant."""
    works, rank = np.zeros((1, len(WORK))), {"rank": at.rank}
    status = f"One instant, t = {at.t:g} s."
    t, q, v, a, lam, base, signals = (
        np.array([x]) for x in (at.t, at.q, at.v, at.a, at.lam, now.W.base, now.W.signal)
    )
    return Solution(mechanism, now.packed, t, q, v, a, lam, works, base, signals, rank, status, at)


@typed
def snapshot(mechanism: Mechanism, state: State) -> Solution:
    """Ask an equilibrium, ``solution.final`` or any other state for positions, loads and energies.

    Accelerations and reactions are those that belong to the position and the velocities. What
    comes is a motion of one instant: its arrays have one row.

    Raises:
        ConfigError: if the state belongs to another mechanism.
        ModelError: naming the joint that is open, or whose velocity contradicts it.
        SolverError: if a drive or load is not finite then.
    """
    now = instant(mechanism, state.t)
    return of_instant(mechanism, now, consistent(now, state))
