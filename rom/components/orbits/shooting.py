"""Shooting: the state after a period is a function of the state before it, and shall be equal.

Source:
    Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995), chapter 6; Seydel, Practical
    Bifurcation and Stability Analysis (2010), chapter 7.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rom.components.orbits.flow import Flow, Start
from rom.components.orbits.turns import Turns
from rom.mbs.analysis.local_equations import free_motions, snapshot
from rom.mbs.analysis.tangent import sizes
from rom.mbs.kernels.system import ROLL
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.state import State
from rom.model import Array

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
