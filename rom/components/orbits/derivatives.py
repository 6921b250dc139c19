"""How small motions beside a motion go on: derivatives of its end by its start.

They are central differences of whole motions, or, where there are many coordinates, come with the
tangents of the time steps. These may be approximate, and forces may depend on what is remembered:
one pair of motions beside says whether that counts.

Source:
    Seydel, Practical Bifurcation and Stability Analysis (2010), chapter 7; Broyden, Math. Comp. 19
    (1965) 577.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from rom import rotation
from rom.components.orbits.flow import Beside, Start
from rom.components.orbits.shooting import Return, energy
from rom.mbs.analysis.local_equations import MAX_DENSE, difference
from rom.mbs.kernels.system import ROLL
from rom.model import Array

# of a start, in rad or lengths of the mechanism: 1e-14 of round-off is 1e-7 of a derivative, and
# the deflection of teeth and races is still resolved; where teeth come and go in between, or films
# change, motions have to begin nearer
PROBE_RTOL, NEAR_PROBE_RTOL = 1e-7, 1e-8
GAP_PROBE_RTOL = 1e-11  # the same where films have gaps, which may be a millionth wide
SMOOTH_TOL = 2e-4  # by which a nearer motion may end elsewhere, of its start: its round-off is 4e-5
SINGULAR_RTOL = 1e-7  # differences leave this much of motions that a period does not change
MAX_VARIED = 8  # coordinates up to which differences take no longer than tangents of steps
PASSES_CARRIED = 3  # through the period, in the time of which derivatives come with the steps
# by which a motion beside may end elsewhere than they say, of its start: in films what fades at
# once does so in thousandths, and multipliers differ by a tenth of it
CARRIED_TOL = 0.02
MAX_NEAR = 4  # shapes next to growing; of more all derivatives are differences
NEAR_RTOL = 0.9  # least cosine between free motions of neighbours


@dataclass(frozen=True)
class Tangent:
    """Derivatives of the coordinates of start and end by what was varied."""

    around: Return  # the motion
    B: Array  # (f, f) of starts
    E: Array  # (f, f) of ends
    own: bool = True  # whether they are those of this motion, not of others nearby
    carried: bool = False  # whether they came with the steps

    def of(self, found: Return) -> bool:
        """Whether they are those of this motion."""
        return self.own and self.around is found

    def followed(self, one: Return, two: Return) -> "Tangent":
        """The same with what a correction from one motion to another has done, after Broyden."""
        dq = self.around.flow.apart(one.start.state, two.start.state)
        moved = self.around.chart.seen(dq, two.start.state.v - one.start.state.v)
        y = np.linalg.lstsq(self.B, moved, rcond=None)[0]
        size = float(y @ y)
        if not size > 0.0:
            return self
        missed = two.gap - one.gap - (self.E - self.B) @ y
        return replace(self, E=self.E + np.outer(missed, y) / size, own=False)

    def measured(self, Y: Array, d: float = NEAR_PROBE_RTOL) -> tuple["Tangent", float]:
        """The same with what motions at a distance do in directions (f, k); largest difference."""
        if not Y.size:
            return self, 0.0
        X = np.linalg.solve(self.B, Y)
        ends = np.array([varied(self.around, x, d)[1] for x in X.T]).T
        missed = ends - self.E @ X
        return replace(self, E=self.E + missed @ np.linalg.pinv(X)), float(np.abs(missed).max())

    @property
    def passes(self) -> int:
        """Through the period, which derivatives like these take as long as."""
        return PASSES_CARRIED if self.carried else 2 * max(len(self.B), 1)

    @property
    def kept(self) -> "Derivatives":
        """What motions nearby begin with."""
        chart, start = self.around.chart, self.around.start
        return Derivatives(chart.Zq, chart.Zv, self.B, self.E, start.ahead, start.later)

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
        step = np.full(chart.size, PROBE_RTOL)
        return difference(lambda y: energy(mechanism, chart.moved(y)), step).ravel()

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


@dataclass(frozen=True)
class Derivatives:
    """Those of a motion, with which motions nearby are looked for."""

    Zq: Array  # (n, f_q) free motions
    Zv: Array  # (n, f_v) free velocities
    B: Array  # (f, f) derivatives of starts
    E: Array  # (f, f) of ends
    ahead: Array  # (n,) as a `Start` has it
    later: Array  # (n,) likewise

    def ready(self, start: Start) -> Start:
        """A start with what the method had there."""
        return replace(start, ahead=self.ahead, later=self.later)

    def around(self, found: Return) -> Tangent | None:
        """The derivatives in the coordinates of a motion; None where it moves otherwise."""
        chart = found.chart
        if self.Zq.shape != chart.Zq.shape or self.Zv.shape != chart.Zv.shape:
            return None
        w = 1 / chart.scale[:, None] ** 2
        P = block_diag(chart.Zq.T @ (w * self.Zq), chart.Zv.T @ (w * self.Zv))
        if P.size and np.linalg.svd(P, compute_uv=False)[-1] < NEAR_RTOL:
            return None
        B, E = (np.linalg.solve(P.T, (P @ A).T).T for A in (self.B, self.E))
        return Tangent(found, B, E, own=False)


def follows(found: Return) -> bool:
    """Whether derivatives may come with the time steps, in less time than by differences."""
    packed = found.flow.packed
    many = found.chart.size > MAX_VARIED and found.chart.scale.size <= MAX_DENSE
    simple = not packed.asked and not packed.system.by_multipliers
    rolls = (packed.system.rows.kind == ROLL).any()
    return bool(many and simple and not rolls and found.turns.prescribed)


def confirmed(found: Return, known: Tangent | None = None) -> Tangent:
    """Derivatives that nearer motions beside do not contradict.

    One pair of them moves in all shapes at once. If it ends elsewhere, derivatives are differences
    of such motions: teeth come or go between others, or tangents of steps leave something out.
    With these, shapes that may be next to growing are moved through the period themselves. Known
    are derivatives of the motion found, or None.
    """
    carried = follows(found)
    if known is None or not known.of(found) or known.carried != carried:
        known = by_steps(found) if carried else by_differences(found)
    if not known.B.size:
        return known
    values, shapes = np.linalg.eig(np.linalg.solve(known.B.T, known.E.T).T)
    shapes = shapes / np.abs(shapes).max(axis=0)
    y = (shapes @ np.exp(1j * np.arange(len(shapes)))).real
    # only how far they are off: a correction in this one direction, of what fades at once, would
    # move the multipliers of what does not
    enough = CARRIED_TOL if carried else SMOOTH_TOL
    for d in (NEAR_PROBE_RTOL, GAP_PROBE_RTOL) if carried else (NEAR_PROBE_RTOL,):
        _, missed = known.measured((y / np.abs(y).max())[:, None], d)
        if missed <= enough:
            break
    near = (np.abs(values) > 1.0 - missed) & (values.imag >= 0.0)
    if missed > enough or (carried and near.sum() > MAX_NEAR):
        return by_differences(found, NEAR_PROBE_RTOL)
    if not carried:
        return known
    slow = shapes[:, near]
    return known.measured(np.hstack([slow.real, slow.imag[:, values[near].imag > 0.0]]), d)[0]


def by_differences(found: Return, d: float = PROBE_RTOL) -> Tangent:
    """Central differences in each coordinate, of motions that begin at a distance d."""
    f = found.chart.size
    both = np.array([varied(found, e, d) for e in np.eye(f)]).reshape(f, 2, f)
    return Tangent(found, both[:, 0].T, both[:, 1].T)


def varied(found: Return, y: Array, d: float) -> tuple[Array, Array]:
    """(f,) derivatives of start and end in a direction (f,), by two motions beside."""
    chart = found.chart
    pair = [Return.of(found.flow, found.turns, chart.moved(x)) for x in (d * y, -d * y)]
    ends = np.array([[chart.of_state(s) for s in (one.start.state, one.turned)] for one in pair])
    start, end = (ends[0] - ends[1]) / (2 * d)
    return start, end


def by_steps(found: Return) -> Tangent:
    """All columns at once, by the tangents of the steps."""
    chart, flow, columns, d = found.chart, found.flow, [], PROBE_RTOL
    for e in np.eye(chart.size):
        one, two = (chart.moved(x).state for x in (d * e, -d * e))
        moved = flow.apart(two, one), one.v - two.v, one.a - two.a
        columns.append(np.array(moved) / (2 * d))
    q, v, vd = np.array(columns).transpose(1, 2, 0)
    if flow.packed.room:
        vd = np.array([_accelerated(found, *move) for move in zip(q.T, v.T, strict=True)]).T
    beside = Beside(flow.now, q, v, vd, vd.copy())
    flow.end(found.start, beside)
    angles = found.turns.angles(found.start.state, found.end)
    later, rates = (found.turns.turned(x, angles) for x in (beside.q, beside.v))
    away = flow.apart(found.start.state, found.turned)
    for first in flow.packed.system.bodies.v_at + 3:
        turn = rotation.spatial_tangent(-away[first : first + 3])
        later[first : first + 3] = np.linalg.solve(turn, later[first : first + 3])
    return Tangent(found, _seen(found, q, v), _seen(found, later, rates), carried=True)


def _accelerated(found: Return, dq: Array, dv: Array) -> Array:
    """(n,) change of the accelerations of the start, so near to it that films hardly change."""
    flow, state, a = found.flow, found.start.state, []
    for d in (GAP_PROBE_RTOL, -GAP_PROBE_RTOL):
        flow.remember(state)
        q, v = flow.now.shifted(state.q, d * dq), state.v + d * dv
        a.append(flow.accelerated(q, v, state).a)
    return np.asarray(a[0] - a[1]) / (2 * GAP_PROBE_RTOL)


def _seen(found: Return, q: Array, v: Array) -> Array:
    """(f, k) coordinates of small motions and changes of velocities, (n, k) each."""
    return np.array([found.chart.seen(*pair) for pair in zip(q.T, v.T, strict=True)]).T
