"""Shooting: the state after a period is a function of the state before it, and shall be equal.

What advances while the motion repeats is turned back before states are compared.

Source:
    Nayfeh and Balachandran, Applied Nonlinear Dynamics (1995), chapter 6; Seydel, Practical
    Bifurcation and Stability Analysis (2010), chapter 7.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rom import rotation
from rom.components.orbits.flow import Flow, Start
from rom.errors import ConfigError, ModelError
from rom.mbs.analysis.local_equations import free_motions, snapshot
from rom.mbs.analysis.tangent import sizes
from rom.mbs.kernels.system import ANGLE, ROLL
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import GROUND, Part
from rom.mbs.parts.joints import Joint
from rom.mbs.results.state import State
from rom.model import Array
from rom.names import check_known

RANK_RTOL = 1e-9  # singular value of constraints that repeat others, of the largest one
SYMMETRY_RTOL = 1e-8  # of inertia: by which a body may look different after its turn
WHOLE_TURN_TOL = 1e-9  # [rad]
FULL_TURN = 2 * np.pi


@dataclass(frozen=True)
class Turn:
    """A body that advances about an axis of its own."""

    name: str  # joint in which it turns, or the body where there is none
    body: int  # its number
    axis: Array  # (3,) in its frame [1]
    angle: float | None  # by which it advances in a period [rad]; None for whatever it does
    prescribed: float | None  # the same as the angle of the joint counts
    first: int  # its place in q
    first_velocity: int  # its place in v

    def advanced(self, one: State, two: State) -> float:
        """Angle about the axis from one state to another [rad], within half a turn."""
        at = slice(self.first + 3, self.first + 7)
        turn = rotation.multiply(one.q[at] * [1.0, -1.0, -1.0, -1.0], two.q[at])
        return 2 * float(np.arctan2(turn[1:] @ self.axis, turn[0]))

    def back(self, state: State, angle: float) -> State:
        """The state with the frame of the body turned back about its axis.

        What looks the same after the turn has then moved nowhere: its frame is another one, in
        which the same angular velocity has other components.
        """
        q, rows = state.q.copy(), slice(self.first_velocity + 3, self.first_velocity + 6)
        at = slice(self.first + 3, self.first + 7)
        q[at] = rotation.multiply(q[at], rotation.exp(-angle * self.axis))
        R = rotation.matrix(rotation.exp(angle * self.axis))
        rates = {}
        for name in ("v", "a", "algorithmic"):
            value = getattr(state, name)
            if value is not None:
                rates[name] = value.copy()
                rates[name][rows] = R @ value[rows]
        return replace(state, q=q, **rates)


@dataclass(frozen=True)
class Turns:
    """All that advances."""

    every: tuple[Turn, ...] = ()

    def angles(self, one: State, two: State) -> tuple[float, ...]:
        """By how much each advances from one state to another [rad]."""
        return tuple(x.advanced(one, two) if x.angle is None else x.angle for x in self.every)

    def back(self, state: State, angles: tuple[float, ...]) -> State:
        """The state with all turned back."""
        for turn, angle in zip(self.every, angles, strict=True):
            state = turn.back(state, angle)
        return state

    @property
    def prescribed(self) -> bool:
        """Whether all angles are given."""
        return all(turn.angle is not None for turn in self.every)

    def turned(self, change: Array, angles: tuple[float, ...]) -> Array:
        """(n, f) small motions or changes of velocities after all was turned back."""
        found = change.copy()
        for turn, angle in zip(self.every, angles, strict=True):
            rows = slice(turn.first_velocity + 3, turn.first_velocity + 6)
            found[rows] = rotation.matrix(rotation.exp(angle * turn.axis)) @ found[rows]
        return found

    def of(self, joint: str) -> float | None:
        """Angle by which the drive of a joint may advance; zero for others, None for any."""
        found = [turn.prescribed for turn in self.every if turn.name == joint]
        return found[0] if found else 0.0


def turns_of(mechanism: Mechanism, turns: Mapping[str, float | None] | None, state: State) -> Turns:
    """What the user says advances."""
    names, found, places = list(mechanism.parts), [], _places(mechanism)
    for given, angle in (turns or {}).items():
        name = _joint_of(mechanism, given)
        body, axis, point, sign = _hinged(mechanism, name, state, places)
        beyond = 1.0 if angle is None else np.remainder(angle + np.pi, FULL_TURN) - np.pi
        if abs(beyond) < WHOLE_TURN_TOL:
            continue  # the same place
        _refuse_unequal(name, mechanism.parts[body], axis, point, angle)
        signed = None if angle is None else sign * angle
        found.append(Turn(name, names.index(body), axis, signed, angle, *places[body]))
    return Turns(tuple(found))


def _places(mechanism: Mechanism) -> dict[str, tuple[int, int]]:
    """Places of each body in q and v."""
    found, q, v = {}, 0, 0
    for name, part in mechanism.parts.items():
        found[name] = (q, v)
        q, v = q + 7 + part.r, v + 6 + part.r
    return found


def _joint_of(mechanism: Mechanism, name: str) -> str:
    """The only joint with an angle in which a body turns; else what the user named."""
    joints = mechanism.joints.values()
    found = [x.name for x in joints if x.turn and name in [m.body for m in x.markers]]
    return found[0] if name in mechanism.parts and len(found) == 1 else name


def _hinged(
    mechanism: Mechanism, name: str, state: State, places: dict[str, tuple[int, int]]
) -> tuple[str, Array, Array, float]:
    """Body, axis and a point of it in the frame of the body, and the sign of its angle."""
    if name in mechanism.joints:
        return _of_joint(mechanism, mechanism.joints[name])
    known = [*(n for n, j in mechanism.joints.items() if j.turn), *mechanism.parts]
    check_known(name, known, f"turns: no joint or body {name!r}; there are")
    at = places[name][1]
    return name, _own_axis(mechanism.parts[name], state.v[at + 3 : at + 6]), np.zeros(3), 1.0


def _of_joint(mechanism: Mechanism, joint: Joint) -> tuple[str, Array, Array, float]:
    if joint.turn is None or joint.turn.kind != ANGLE:
        raise ConfigError(f"turns: {joint.name!r} is {joint.kind}; take a revolute joint.")
    one, two = joint.markers[:2]
    marker, sign = (one, -1.0) if two.body == GROUND else (two, 1.0)
    base, part = mechanism.part(one.body), mechanism.part(marker.body)
    axis = rotation.matrix(base.p) @ np.cross(joint.turn.a, joint.turn.c)
    return part.name, rotation.matrix(part.p).T @ axis, part.point(marker), sign


def _own_axis(part: Part, spin: Array) -> Array:
    """(3,) axis about which the inertia of a body is the same all round, along its spin."""
    values, axes = np.linalg.eigh(part.second)
    size = SYMMETRY_RTOL * values.max()
    equal = [abs(values[k - 2] - values[k - 1]) <= size for k in range(3)]
    if not any(equal) or not spin.any():
        text = f"no axis of its own is known about which {part.name!r} advances"
        cure = "name the joint it turns in, or let it spin at the start"
        raise ModelError(f"{text}; {cure}.", where=part.name)
    axis = spin / np.linalg.norm(spin) if all(equal) else axes[:, equal.index(True)]
    return axis if axis @ spin > 0.0 else -axis


def _refuse_unequal(name: str, part: Part, axis: Array, point: Array, angle: float | None) -> None:
    """Refuse a body that looks different after its turn."""
    how, what = "any angle" if angle is None else f"{angle:.6g} rad", ""
    R = rotation.matrix(rotation.exp((1.0 if angle is None else angle) * axis))
    size = SYMMETRY_RTOL * max(float(np.trace(part.second)), 1e-300)
    if part.mass * float(np.square(np.cross(axis, point)).sum()) > size:
        what = "its mass centre is beside the axis"
    if np.abs(R @ part.second @ R.T - part.second).max() > size:
        what = "its inertia is not the same about axes across the one it turns about"
    if part.r:
        what = "it is flexible, and its elastic coordinates describe other shapes"
    if what:
        text = f"turns: after {how} of {name!r} the body {part.name!r} is another one: {what}."
        hint = "Take a period of whole revolutions of this body."
        raise ModelError(text, where=part.name, hint=hint)


@dataclass(frozen=True)
class Chart:
    """Coordinates of the states around a start that the constraints allow."""

    flow: Flow
    at: Start  # the start
    Zq: Array  # (n, f_q) free motions
    Zv: Array  # (n, f_v) free velocities
    scale: Array  # (n,) motion of each coordinate that counts as one
    time: float  # that in which velocities count as motions [s]

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
    """A start and what came of it."""

    flow: Flow  # that moved it
    turns: Turns  # what advances
    start: Start
    end: State  # the state a period later
    turned: State  # the same, turned back
    basis: Chart | None = None  # chart whose coordinates count here too; None for one of its own

    @classmethod
    def of(cls, flow: Flow, turns: Turns, start: Start, basis: Chart | None = None) -> "Return":
        """Move through one period."""
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
        time, pair = self.flow.period / (2 * np.pi), (self.start.state, self.turned)
        start, end = (self.chart.seen(time * state.v, time * state.a) for state in pair)
        return start, end


def energy(mechanism: Mechanism, start: Start) -> float:
    """Mechanical energy of a start [J]."""
    return float(snapshot(mechanism, start.state).energy.total[0])


def moved_by(found: Return, y: Array) -> Start:
    """A start after as much of a correction (f,) as may be taken at once.

    It has what method and laws had at the end of the period.
    """
    flow, (dq, dv) = found.flow, found.chart.motion(y)
    part = min(sizes(flow.packed, dq)[1], sizes(flow.packed, found.chart.time * dv)[1])
    ready = Start(replace(found.start.state, base=found.base), found.back.ahead, found.later)
    return flow.moved(ready, part * dq, part * dv)
