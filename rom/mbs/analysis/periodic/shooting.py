"""Shooting: the state after a period is a function of the state before it, and shall be equal.

Source:
    Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995), chapter 6; Seydel, Practical
    Bifurcation and Stability Analysis (2010), chapter 7.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.mbs.analysis.local_equations import free_motions
from rom.mbs.analysis.periodic.flow import Flow, Start
from rom.mbs.analysis.periodic.turns import Turns
from rom.mbs.analysis.snapshot import snapshot
from rom.mbs.analysis.tangent import sizes
from rom.mbs.kernels.system import ROLL
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.state import State
from rom.model import Array

# of a start, in rad or lengths of the mechanism: 1e-14 of round-off is 1e-7 of a derivative, and
# the deflection of teeth and races is still resolved
PROBE_RTOL = 1e-7
SINGULAR_RTOL = 1e-7  # differences leave this much of motions that a period does not change
RANK_RTOL = 1e-9  # singular value of constraints that repeat others, of the largest one


@dataclass(frozen=True)
class Chart:
    """Coordinates of the states around a start that the constraints allow.

    Attributes:
        at: the start.
        Zq, Zv: (n, f_q), (n, f_v) free motions and velocities.
        scale: (n,) motion of each coordinate that counts as one.
        time: that in which velocities count as motions [s].
    """

    flow: Flow
    at: Start
    Zq: Array
    Zv: Array
    scale: Array
    time: float

    @classmethod
    def of(cls, flow: Flow, start: Start) -> "Chart":
        """The chart of a start."""
        now, state = flow.now, start.state
        _, G, _ = now.gradient(state.q, state.v)
        scale = flow.probe
        rolls = now.packed.system.rows.kind == ROLL
        Zv = free_motions(G, scale, state.rank)
        Zq = free_motions(G[~rolls], scale, _rank(G[~rolls] * scale)) if rolls.any() else Zv
        return cls(flow, start, Zq, Zv, scale, flow.period / (2 * np.pi))

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.Zq.shape[1] + self.Zv.shape[1]

    def seen(self, dq: Array, dv: Array) -> Array:
        """(f,) coordinates of a small motion (n,) and a change (n,) of velocities."""
        w = 1 / self.scale**2
        return np.concatenate([self.Zq.T @ (w * dq), self.time * (self.Zv.T @ (w * dv))])

    def motion(self, y: Array) -> tuple[Array, Array]:
        """(n,) motion and (n,) change of velocities of coordinates (f,)."""
        k = self.Zq.shape[1]
        return self.Zq @ y[:k], self.Zv @ y[k:] / self.time

    def of_state(self, state: State) -> Array:
        """(f,) coordinates of a state as the method has it."""
        here = self.at.state
        return self.seen(self.flow.apart(here, state), state.v - here.v - self.at.ahead)

    def moved(self, y: Array) -> Start:
        """The start at some coordinates (f,)."""
        return self.flow.moved(self.at, *self.motion(y))


def _rank(A: Array) -> int:
    norms = np.linalg.norm(A, axis=1)
    s = np.linalg.svd(A / np.where(norms > 0, norms, 1.0)[:, None], compute_uv=False)
    return int((s > RANK_RTOL * s.max(initial=0.0)).sum())


@dataclass(frozen=True)
class Return:
    """A start and what came of it.

    Attributes:
        flow: that moved it.
        turns: what advances.
        start: the start.
        end: the state a period later.
        turned: the same, turned back.
        basis: chart whose coordinates count here too; None for one of its own.
    """

    flow: Flow
    turns: Turns
    start: Start
    end: State
    turned: State
    basis: Chart | None = None

    @classmethod
    def of(cls, flow: Flow, turns: Turns, start: Start, basis: Chart | None = None) -> "Return":
        """Move through one period.

        Raises:
            SolverError: if a step fails.
        """
        end = flow.end(start)
        turned = turns.back(end, turns.angles(start.state, end))
        return cls(flow, turns, start, end, turned, basis)

    @cached_property
    def back(self) -> Start:
        """The end as the start of the next period."""
        state = replace(self.turned, t=self.start.state.t, base=self.base)
        fitted = self.flow.at(state.q, state.v, Start(state, state.v, state.a))
        return replace(fitted, ahead=state.v - fitted.state.v, later=self.later)

    @property
    def base(self) -> Array:
        """(c,) angles as at the start, and what laws remember now."""
        start: Any = self.start.state.base
        end: Any = self.end.base
        base, laws = start.copy(), self.flow.law_memory
        base[laws] = end[laws]
        return np.asarray(base)

    @property
    def later(self) -> Array:
        """(n,) acceleration-like variable of the method minus the accelerations, at the end."""
        return np.asarray(self.turned.algorithmic) - self.turned.a

    @cached_property
    def chart(self) -> Chart:
        """Coordinates of starts nearby."""
        if self.basis is None:
            return Chart.of(self.flow, self.start)
        return replace(self.basis, flow=self.flow, at=self.start)

    @cached_property
    def gap(self) -> Array:
        """(f,) coordinates of the end."""
        return self.chart.of_state(self.turned)

    @cached_property
    def memory_gap(self) -> float:
        """Change of what laws remember, of its size."""
        at = self.flow.law_memory
        one, two = (np.asarray(state.base)[at] for state in (self.start.state, self.end))
        size = float(np.abs(two).max(initial=0.0))
        return float(np.abs(two - one).max(initial=0.0)) / size if size else 0.0

    @property
    def open(self) -> float:
        """Largest gap, in rad or lengths of the mechanism; of velocities, per rad of the period."""
        return max(float(np.abs(self.gap).max(initial=0.0)), self.memory_gap)

    @cached_property
    def rate(self) -> tuple[Array, Array]:
        """(f,) each: change of the coordinates per radian of the period, at start and end."""
        time, found = self.flow.period / (2 * np.pi), []
        for state in (self.start.state, self.turned):
            found.append(self.chart.seen(time * state.v, time * state.a))
        return found[0], found[1]

    def tangent(self) -> "Tangent":
        """How the coordinates of starts and ends change, by central differences.

        Raises:
            SolverError: if a step fails.
        """
        chart, columns = self.chart, []
        for e in np.eye(chart.size) * PROBE_RTOL:
            one, two = (Return.of(self.flow, self.turns, chart.moved(x)) for x in (e, -e))
            pairs = (one.start.state, two.start.state), (one.turned, two.turned)
            columns.append([chart.of_state(x) - chart.of_state(y) for x, y in pairs])
        both = np.array(columns).reshape(chart.size, 2, chart.size) / (2 * PROBE_RTOL)
        return Tangent(self, both[:, 0].T, both[:, 1].T)


@dataclass(frozen=True)
class Tangent:
    """Derivatives of the coordinates of start and end by what was varied.

    Attributes:
        around: the motion.
        B, E: (f, f) of starts and of ends.
    """

    around: Return
    B: Array
    E: Array

    @cached_property
    def multipliers(self) -> npt.NDArray[np.complex128]:
        """(f,) of Floquet, largest first."""
        if not self.B.size:
            return np.zeros(0, dtype=complex)
        found = np.linalg.eigvals(np.linalg.solve(self.B.T, self.E.T).T).astype(complex)
        return found[np.lexsort((-found.imag, -np.round(np.abs(found), 12)))]

    @cached_property
    def energy_slope(self) -> Array:
        """(f,) derivative of the energy by the coordinates of the start [J]."""
        chart, mechanism = self.around.chart, self.around.flow.mechanism
        return np.array(
            [
                (energy(mechanism, chart.moved(e)) - energy(mechanism, chart.moved(-e)))
                / (2 * PROBE_RTOL)
                for e in np.eye(chart.size) * PROBE_RTOL
            ]
        )

    def solved(
        self, rate: tuple[Array, Array] | None, *sides: Array, energy_gap: float | None = None
    ) -> list[Array]:
        """(f,) or (f + 1,) answers of (E - B) y + dT rate = -side; dT in radians of the period.

        Where the period is unknown the start moves across the motion, and by a gap of its energy
        if that is given. A motion that a period does not change is not touched.
        """
        A, right = self.E - self.B, -np.array(sides).T
        if rate is not None:
            A = np.vstack([np.column_stack([A, rate[1]]), np.append(rate[0], 0.0)])
            right = np.vstack([right, np.zeros((1, right.shape[1]))])
        if energy_gap is not None:
            slope = self.energy_slope / np.linalg.norm(self.energy_slope)
            miss = -energy_gap / np.linalg.norm(self.energy_slope)
            A = np.vstack([A, np.append(slope, 0.0)])
            right = np.vstack([right, np.full((1, right.shape[1]), miss)])
        return list(np.linalg.lstsq(A, right, rcond=SINGULAR_RTOL)[0].T)


def energy(mechanism: Mechanism, start: Start) -> float:
    """Mechanical energy of a start [J]."""
    return float(snapshot(mechanism, start.state).energy.total[0])


def share(flow: Flow, dq: Array, dv: Array, time: float) -> float:
    """Part of a correction that may be taken at once."""
    return min(sizes(flow.packed, dq)[1], sizes(flow.packed, time * dv)[1])


def moved_by(found: Return, y: Array) -> Start:
    """A start after a correction (f,), with what method and laws had at the end of the period."""
    chart = found.chart
    dq, dv = chart.motion(y)
    part = share(found.flow, dq, dv, chart.time)
    return found.flow.moved(ready(found), part * dq, part * dv)


def ready(found: Return) -> Start:
    """The start with what method and laws had at the end of the period."""
    state = replace(found.start.state, base=found.base)
    return Start(state, found.back.ahead, found.later)
