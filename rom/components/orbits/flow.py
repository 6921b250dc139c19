"""One period of a mechanism in compiled steps, from any start, without what a run keeps.

Small motions beside go along by the tangents of its time steps: a step of generalised-alpha moves
positions, velocities and accelerations so that the equations of motion hold at its end. Their
derivatives say how a small change of all that goes on, for all changes at once.

Source:
    Bruels, Cardona, Arnold, Lie group generalized-alpha time integration of constrained flexible
    multibody systems, Mech. Mach. Theory 48 (2012) 121.
"""

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np

from rom import rotation
from rom.mbs.analysis.local_equations import DIFFERENCE_STEP, Instant
from rom.mbs.elements.family import apply_laws
from rom.mbs.equations.equations import evaluate, retract, tangents
from rom.mbs.equations.packing import Packed, pack
from rom.mbs.integrate import generalized_alpha as alpha
from rom.mbs.integrate.consistent_start import (
    assembled,
    fitting_velocity,
    initial_state,
    prescribed,
    with_accelerations,
)
from rom.mbs.integrate.fixed_step import failed_step, space
from rom.mbs.integrate.run import Record, Settings
from rom.mbs.integrate.step_memory import begin
from rom.mbs.kernels import work as entry
from rom.mbs.kernels.work import Step, Work, workspace
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.signals import padded
from rom.mbs.results.state import State
from rom.model import Array

# of Newton's method in a step, of what accelerations move: derivatives are differences of ends
STEP_TOLERANCE = 1e-13
REDUNDANT_RTOL = 1e-12  # singular value of constraints that repeat others, of the largest one
LAWS_OWNER = "laws"  # owner of the only numbers that elements remember and that are no angles


@dataclass(frozen=True)
class Start:
    """A state with what the method has beside it after many steps."""

    state: State  # coordinates, velocities and accelerations that belong together
    ahead: Array  # (n,) velocities of the method minus those that fit the constraints
    later: Array  # (n,) its acceleration-like variable minus the accelerations


class Flow:
    """A mechanism that moves through a period from t0 [s] again and again, in a number of steps."""

    def __init__(self, mechanism: Mechanism, t0: float, period: float, steps: int, rho_inf: float):
        numbers = (t0, t0 + period, period / steps, steps, rho_inf, STEP_TOLERANCE, 1e-4, 1e-12)
        self.mechanism, self.t0, self.period, self.steps = mechanism, t0, period, steps
        self.settings = Settings(*numbers, progress=False)
        self.runs, self.failed = [0], [0]
        self._take(pack(mechanism))

    def lasting(self, period: float) -> "Flow":
        """The same over another period; memory and counts are shared."""
        other, s = copy(self), self.settings
        other.period, end = period, s.t_start + period
        other.settings = replace(s, t_end=end, dt=period / self.steps)
        other._prescribe()
        return other

    def _take(self, packed: Packed) -> None:
        """Move this mechanism, in blocks or whole."""
        self.packed = packed
        self.W: Work = workspace(packed.system, len(packed.signals))
        self._prescribe()

    def _prescribe(self) -> None:
        """Ask drives and loads for all steps."""
        packed, mechanism = self.packed, self.mechanism
        self.record = Record(mechanism, packed, self.settings, perf_counter())
        self.t = self.settings.time(np.arange(self.steps + 1))
        span, spacing = self.settings.span, self.settings.spacing
        table = prescribed(packed.signals, padded(self.t), span, spacing, self.settings.h)
        self.table = np.ascontiguousarray(table[: self.t.size])
        self.step: Step | None = None

    @cached_property
    def now(self) -> Instant:
        """The equations, by whole matrices."""
        packed = self.packed.whole()
        W = workspace(packed.system, len(packed.signals))
        return Instant(packed, W, self.t0, packed.asked).at(self.t0)

    @cached_property
    def probe(self) -> Array:
        """(n,) motion of each coordinate that counts as one: a rad, a length of the mechanism."""
        return self.now.probe() / DIFFERENCE_STEP

    @property
    def law_memory(self) -> slice:
        """Where `State.base` has what laws of the user remember."""
        at = self.packed.system.coordinates.kind.size
        for owner, numbers in self.packed.places.remembered.items():
            if owner == LAWS_OWNER:
                return slice(at, at + numbers.size)
            at += numbers.size
        return slice(at, at)

    def initial(self) -> State:
        """Where the bodies were added."""
        return initial_state(self.packed, self.t0, self.settings.spacing, placing=True)

    def begun(self, state: State) -> Start:
        """A state as the start of a run would have it."""
        ready = self.packed.of_rank(state.rank)
        if ready is not self.packed:
            self._take(ready)
        state = replace(state, t=self.t0, memory=None, algorithmic=None)
        state = self._fitted(state.q, state.v, state)
        self.step, found = begin(self.record, self.W, state, self.packed.asked, self.settings.h)
        return Start(found, self.step.v - found.v, self.step.a - found.a)

    def _fitted(self, q: Array, v: Array, like: State) -> State:
        """The nearest state that satisfies the constraints, with its accelerations."""
        self.remember(like)
        q = assembled(self.packed, self.W, q)
        return self.accelerated(q, fitting_velocity(self.packed, self.W, q, v), like)

    def remember(self, like: State) -> None:
        """Count angles from those of a state, at the begin of the period."""
        self.W.signal[:] = self.table[0]
        if like.base is not None:
            self.W.base[:] = like.base

    def accelerated(self, q: Array, v: Array, like: State) -> State:
        """The state with coordinates and velocities that satisfy the constraints."""
        packed, W = self.packed, self.W
        evaluate(packed.system, W, q, v)
        apply_laws(packed.asked, W, self.t0)
        kept = W.base.copy()
        found: Any = with_accelerations(packed, W, replace(like, t=self.t0, q=q, v=v))
        joints = packed.system.coordinates.kind.size  # what laws remember is theirs alone
        base = np.concatenate([found.base[:joints], kept[joints:]])
        return replace(found, base=base, algorithmic=None, memory=None)

    def at(self, q: Array, v: Array, like: Start) -> Start:
        """A start nearby, with the same differences between method and motion."""
        return replace(like, state=self._fitted(q, v, like.state))

    def moved(self, start: Start, dq: Array, dv: Array) -> Start:
        """The start after a small motion (n,) and a change (n,) of the velocities."""
        q = np.empty_like(start.state.q)
        retract(self.packed.system, start.state.q, np.ascontiguousarray(dq), q)
        return self.at(q, start.state.v + dv, start)

    def end(self, start: Start, beside: "Beside | None" = None) -> State:
        """The state a period later; small motions beside it go along."""
        step, table = self._reset(start), self.table[1:]
        out = space(self.W, step, 1)
        for signals in (table,) if beside is None else table[:, None]:
            base = self.W.base.copy()
            self._advance(start, step, signals, out)
            if beside is not None:
                beside.follow(step, base, signals[0])
        self.runs[0] += 1
        q, v, a, lam = (x.copy() for x in (step.q, step.v, step.vd, step.lam))
        t, base = self.t0 + self.period, self.W.base.copy()
        return State(t, q, v, a, lam, start.state.rank, step.a.copy(), base)

    def _advance(self, start: Start, step: Step, signals: Array, out: Any) -> None:
        """Take a step for each row of signals (k, s, 3)."""
        rank = self.packed.rows_solved(start.state.rank)
        step.count[entry.STEPS_BEFORE] = step.count[entry.STEPS]
        answer = alpha.NEEDS_LAWS
        alpha.advance.link()
        while answer == alpha.NEEDS_LAWS:
            answer = alpha.advance(self.packed.system, self.W, step, rank, signals, self.steps, out)
            taken = int(step.count[entry.STEPS])
            if answer == alpha.NEEDS_LAWS:
                slopes, t = not step.count[entry.HAS_FACTOR], float(self.t[1 + taken])
                apply_laws(self.packed.asked, self.W, t, slopes=slopes)
        if answer != alpha.CONVERGED:
            self.failed[0] += 1
            raise failed_step(self.record, self.W, step, answer, float(self.t[1 + taken]))

    def _reset(self, start: Start) -> Step:
        """The step memory at a start."""
        state = start.state
        if self.step is None:
            like = replace(state, algorithmic=state.a)
            self.step = begin(self.record, self.W, like, self.packed.asked, self.settings.h)[0]
        step = self.step
        for memory in (step.work, step.lost, step.psi, step.drift):
            memory[:] = 0.0
        step.q[:], step.v[:] = state.q, state.v + start.ahead
        step.vd[:], step.lam[:] = state.a, state.lam
        step.a[:] = state.a + start.later
        step.size[[0, 4]] = 0.0
        step.count[:] = 0
        step.count[entry.USES_LAWS] = bool(self.packed.asked)
        self.W.base[:] = state.base
        return step

    def given(self, start: Start) -> State:
        """The start as a run takes it."""
        state = start.state
        return replace(state, v=state.v + start.ahead, algorithmic=state.a + start.later)

    def forces(self, state: State) -> Array:
        """(n,) what acts on the bodies at a state, inertia included and joints left out."""
        now = self.now.at(state.t)
        now.remember(state)
        return now.residual(state.q, state.v, state.a, 0 * state.lam)

    @property
    def pressed(self) -> float:
        """Largest force on a marker in what `forces` has looked at; they may all balance."""
        return float(np.abs(self.now.W.wrench).max(initial=0.0))

    def apart(self, one: State, two: State) -> Array:
        """(n,) small motion from one position to another."""
        return self.packed.apart(one.q, two.q)


@dataclass
class Beside:
    """Changes of the state of the method, columns."""

    now: Instant  # the equations
    q: Array  # (n, f) of positions, as motions of the bodies
    v: Array  # (n, f) of velocities
    vd: Array  # (n, f) of accelerations
    a: Array  # (n, f) of the acceleration-like variable

    def follow(self, step: Step, base: Array, signal: Array) -> None:
        """Go through a step that was taken, from what was remembered (c,) to drives at its end."""
        h, beta, gamma, alpha_m, alpha_f = step.method
        known = (alpha_f * self.vd - alpha_m * self.a) / (1 - alpha_m)
        share = (1 - alpha_f) / (1 - alpha_m)
        still_v = self.v + h * ((1 - gamma) * self.a + gamma * known)
        psi = h * self.v + h * h * ((0.5 - beta) * self.a + beta * known)
        back, turn = self._turning(step.psi)
        still_q = back @ self.q + turn @ psi
        M, C, K, G = self._matrices(step, base, signal)
        by_v, by_q = gamma * h * share, beta * h * h * share * turn
        force, gap = -K @ still_q - C @ still_v, -G @ still_q
        x = _bordered(M + by_v * C + K @ by_q, G, G @ by_q, force, gap)
        self.q, self.v, self.vd = still_q + by_q @ x, still_v + by_v * x, x
        self.a = known + share * x

    def _matrices(self, step: Step, base: Array, signal: Array) -> tuple[Array, ...]:
        """Derivatives by accelerations, velocities and positions; gradient of the constraints."""
        now, W = self.now, self.now.W
        W.base[:], W.signal[:] = base, signal
        now.residual(step.q, step.v, step.vd, step.lam)
        tangents(now.system, W, step.v, step.vd, step.lam, (1.0, 0.0, 1.0))
        M, K = W.S.copy(), W.Kt.copy()
        tangents(now.system, W, step.v, step.vd, step.lam, (0.0, 1.0, 0.0))
        return M, W.S.copy(), K, now.gradient(step.q, step.v)[1]

    def _turning(self, psi: Array) -> tuple[Array, Array]:
        """(n, n) change of the position at the end of a step by that before, and by increments."""
        back, turn = np.eye(psi.size), np.eye(psi.size)
        for first in self.now.system.bodies.v_at + 3:
            at = slice(first, first + 3)
            back[at, at] = rotation.matrix(rotation.exp(psi[at])).T
            turn[at, at] = rotation.spatial_tangent(-psi[at])
        return back, turn


def _bordered(A: Array, G: Array, by: Array, force: Array, gap: Array) -> Array:
    """(n, f) answers x of A x + G^T y = force, by x = gap; constraints may repeat others."""
    if not len(G):
        return np.linalg.solve(A, force)
    size = np.sqrt(np.abs(np.diag(A)))
    rows = np.maximum(np.linalg.norm(by / size, axis=1), 1e-300)
    columns = np.maximum(np.linalg.norm(G / size, axis=1), 1e-300)
    upper = [A / np.outer(size, size), (G / size / columns[:, None]).T]
    lower = [by / size / rows[:, None], np.zeros((len(G), len(G)))]
    right = np.vstack([force / size[:, None], gap / rows[:, None]])
    found = np.linalg.lstsq(np.block([upper, lower]), right, rcond=REDUNDANT_RTOL)[0]
    return found[: size.size] / size[:, None]
