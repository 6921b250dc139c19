"""Equilibria of a mechanism on a path: past limit points, onto branches, with their stability."""

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np
import numpy.typing as npt
from scipy.linalg import eig, eigh, null_space

from rom.arguments import finite, typed
from rom.arguments.quantities import Count, Positive
from rom.errors import ConfigError, RomWarning, SolverError, reached
from rom.mbs.analysis.equilibrium import equilibrium
from rom.mbs.analysis.few_modes import Pencil
from rom.mbs.analysis.local_equations import DIFFERENCE_STEP, MAX_DENSE, Instant, instant
from rom.mbs.analysis.rotors.moving_axes import IN_BODIES, small_motions
from rom.mbs.analysis.tangent import LOAD_STIFFNESS_RTOL, load_stiffness, sizes
from rom.mbs.integrate.consistent_start import RANK_PIVOT_RTOL
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Marker
from rom.mbs.results.state import State
from rom.model import Array
from rom.paths.arc_length import Curve, Point

TIME_STEP = 1e-6  # of differences, of the span
N_NEAREST = 6  # stiffnesses around zero that are looked at in large mechanisms
# of a step; closer to a bifurcation round-off alone moves along the other path
BIFURCATION_RTOL = 1e-7
MAX_HALVINGS = 12  # of a step in which several things happen
MAX_POINTS = 100_000


@dataclass(frozen=True)
class Critical:
    """An equilibrium at which a stiffness vanishes."""

    kind: str  # "limit", where the parameter turns back; "bifurcation", where another path crosses
    state: State  # the equilibrium, at its time
    motion: Array  # (n,) without stiffness, counted as in `State.v`; its largest part is one


@typed
@dataclass(frozen=True)
class EquilibriumPath:
    """Equilibria in the order in which they were passed.

    Attributes:
        states: k of them; each can be linearised and simulated.
        unstable: (k,) number of independent motions in which it falls away; flutter is not seen,
            see `linearize`.
        critical: limit points and bifurcations between them, in order.
        now: the mechanism.
    """

    states: tuple[State, ...]
    unstable: Array
    critical: tuple[Critical, ...]
    now: Instant

    @cached_property
    def t(self) -> Array:
        """(k,) times at which drives and loads are taken [s]; not ascending."""
        return np.array([state.t for state in self.states])

    def position(self, marker: Marker) -> Array:
        """(k, 3) places of a marker [m].

        Raises:
            ConfigError: if it is not one of the mechanism.
        """
        if marker not in self.now.packed.markers:
            raise ConfigError(f"{marker!r} must be a marker of the mechanism.")
        k, places = self.now.packed.row(marker), []
        for state in self.states:
            self.now.evaluate(state.q, state.v)
            places.append(self.now.W.P[k].copy())
        return np.array(places)


@typed
def continuation(
    mechanism: Mechanism,
    span: tuple[float, float],
    *,
    state: State | None = None,
    along: npt.ArrayLike | None = None,
    n: Annotated[int, Count(2, MAX_POINTS)] = 500,
    step: Annotated[float, Positive()] = 0.1,
) -> EquilibriumPath:
    """Follow equilibria while loads and drives change, also where no load path is left to follow.

    The parameter is the time at which loads, drives and laws are taken: "100 * t" as a force is
    one that grows. The path is followed by its arc length, so that time may turn back: past
    limit points, where a structure would snap, and through unstable equilibria. It ends where time
    comes to the end of the span, or as far behind its beginning.

    Args:
        mechanism: bodies, joints, forces; at rest.
        span: (2,) time at which the path begins, and at which it shall end [s].
        state: where the first equilibrium is searched; with ``along`` the one the branch leaves.
        along: (n,) motion in which a branch leaves a bifurcation: ``path.critical[0].motion``, or
            the opposite.
        n: largest number of points; with so many the path may end inside the span.
        step: longest step, in lengths of the mechanism, rad, and spans.

    Raises:
        ConfigError: for a wrong argument.
        ModelError: naming the body that can still move although no force opposes.
        SolverError: where the path ends, as at an impact or a singular position of the joints;
            ``error.solution`` is the path up to there.

    Source:
        Riks, Int. J. Solids Struct. 15 (1979) 529; stability by the signs of the stiffness in the
        motions that the joints leave. Of loads that turn with bodies the real parts of its
        eigenvalues count, and of large mechanisms its symmetric part.

    Example:
        >>> mech, side = rom.Mechanism(gravity=(0, 0, 0)), {"at": (1, 0, 0), "inertia": (1, 1, 1)}
        >>> ball = mech.add_rigid("ball", mass=1, markers={"m": (0, 0, 0)}, **side).marker("m")
        >>> mech.prismatic("guide", mech.ground.marker((1, 0, 0)), ball, axis=(1, 0, 0))
        >>> mech.spring_damper("spring", mech.ground.marker((0, 0.5, 0)), ball, stiffness=100.0)
        >>> mech.force("load", ball, lambda t: (-t, 0, 0))  # that of two bars which snap through
        >>> [round(x.state.t, 3) for x in rom.continuation(mech, (0.0, 40.0)).critical]
        [29.911, -29.911]
    """
    first, last = finite("span", span, (2,))
    if first == last:
        raise ConfigError(f"span = ({first:g}, {last:g}) s needs two values that differ.")
    now = instant(mechanism, first, sparse=True)
    march = _March(_Equilibria.of(now, abs(last - first)), (first, last))
    if along is None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RomWarning)  # an unstable one is said in the path
            begin = march.begin(equilibrium(mechanism, state, t=first))
    elif state is None:
        raise ConfigError("along: a branch leaves a state.", hint="Give state=critical.state, too.")
    else:
        begin = march.branch(state, finite("along", along, state.v.shape))
    with reached(lambda: march.path):
        march.go(begin, step, n)
    return march.path


@dataclass(frozen=True)
class _Equilibria:
    """Balance of a mechanism at rest over time, as `arc_length` asks for it."""

    now: Instant  # the mechanism
    weight: Array  # (n,) of coordinates, one for a mechanism that moves by its length or by a rad
    span: float  # time that counts like that [s]

    @classmethod
    def of(cls, now: Instant, span: float) -> "_Equilibria":
        bodies = now.packed.system.bodies
        weight = (DIFFERENCE_STEP / now.probe()) ** 2
        for mass, at, r in zip(bodies.mass, bodies.v_at, bodies.r, strict=True):
            weight[at : at + 6 + r] *= mass / now.packed.mass
        return cls(now, weight, span)

    def balance(self, state: State, t: float) -> tuple[Array, Array]:
        """(n,) forces out of balance and (m,) gaps."""
        now = self.now.at(t)
        force = now.residual(state.q, state.v, state.a, state.lam)
        return force, now.gradient(state.q, state.v)[0]

    def pencil(self, state: State) -> Pencil:
        """Masses and stiffness in motions that turn with the bodies."""
        now = self.now.at(state.t)
        now.W.base[:] = state.base
        return Pencil.of(now, state, small_motions(now.packed, state, IN_BODIES))

    def corrections(self, at: State, p: float) -> tuple[Array, Array]:
        """Newton's correction, and the change per time, of coordinates and multipliers."""
        self.now.W.base[:] = at.base
        here, d = self.balance(at, p), TIME_STEP * self.span
        later, before = self.balance(at, p + d), self.balance(at, p - d)
        each = zip(here, later, before, strict=True)
        force, gap = (-np.stack([x, (y - z) / (2 * d)], axis=1) for x, y, z in each)
        pencil = self.pencil(replace(at, t=p))
        u, l = pencil.inverse(pencil.K).solve(pencil.basis.T @ force, gap / pencil.row[:, None])
        step = np.concatenate([pencil.basis @ u, l / pencil.row[:, None]])
        return step[:, 0], step[:, 1]

    def moved(self, at: State, step: Array, p: float) -> State:
        """The state after a change of coordinates and multipliers."""
        n = at.v.size
        return replace(self.now.at(p).moved(at, step[:n], step[n:]), t=p)

    def inner(self, a: Array, b: Array) -> float:
        """Product of the motions in them; multipliers have no part."""
        n = self.weight.size
        return float(self.weight @ (a[:n] * b[:n]))

    def size(self, step: Array) -> float:
        """Largest motion, in rad or lengths of the mechanism."""
        return sizes(self.now.packed, step[: self.weight.size])[0]

    def curvatures(self, state: State) -> "_Curvatures":
        """Stiffness of the free motions, around zero at least; round-off is zero."""
        pencil = self.pencil(state)
        none = LOAD_STIFFNESS_RTOL * load_stiffness(self.now, state)
        if pencil.M.shape[0] <= MAX_DENSE:
            squares, U = _all(pencil)
            negative = int(np.sum(squares < -none))
        else:
            k, nothing = min(N_NEAREST, pencil.n_free), np.zeros((pencil.M.shape[0], 0))
            squares, U = pencil.near(-none, k) if k else (np.zeros(0), nothing)
            negative = pencil.count(-none)
        below = negative - int(np.sum(squares < -none))
        squares = np.where(np.abs(squares) <= none, 0.0, squares)
        return _Curvatures(negative, below, squares, pencil.basis @ U)


@dataclass(frozen=True)
class _Curvatures:
    """Stiffness of free motions."""

    negative: int  # number of motions that fall away
    below: int  # number of motions of less stiffness than those known
    squares: Array  # (f,) stiffness [1/s^2], ascending
    motions: Array  # (n, f) of unit mass

    def of(self, k: int) -> float:
        """Stiffness of the motion that has k softer ones."""
        return float(self.squares[np.clip(k - self.below, 0, self.squares.size - 1)])

    @property
    def weakest(self) -> tuple[float, Array]:
        """Stiffness nearest to zero, and its motion (n,)."""
        k = np.argmin(np.abs(self.squares))
        return float(self.squares[k]), self.motions[:, k]


def _all(pencil: Pencil) -> tuple[Array, Array]:
    """Stiffness (f,) [1/s^2] of all free motions (n, f), ascending."""
    G, K, M = (A.toarray() for A in (pencil.G, pencil.K, pencil.M))
    Z = null_space(G, RANK_PIVOT_RTOL) if G.size else np.eye(len(K))
    K, M = Z.T @ K @ Z, Z.T @ M @ Z
    if not K.size:
        return np.zeros(0), Z
    if pencil.symmetric:
        squares, V = eigh(0.5 * (K + K.T), M)
        return squares, Z @ V
    values, V = eig(K, M)
    order = np.argsort(values.real)
    V = V[:, order].real
    return values.real[order], Z @ (V / np.sqrt(np.einsum("ik,ij,jk->k", V, M, V)))


class _March:
    """Points of a path one after the other, and what happens between them."""

    def __init__(self, problem: _Equilibria, span: tuple[float, float]):
        self.problem, self.forwards = problem, span[1] > span[0]
        self.low, self.high = sorted((2 * span[0] - span[1], span[1]))
        self.curve = Curve(problem, problem.span)
        self.states: list[State] = []
        self.unstable: list[int] = []
        self.critical: list[Critical] = []

    @property
    def path(self) -> EquilibriumPath:
        """What was found so far."""
        found = tuple(self.states), np.array(self.unstable), tuple(self.critical)
        return EquilibriumPath(*found, self.problem.now)

    def begin(self, state: State) -> Point:
        """The first point, from which time runs towards the end of the span."""
        return self.curve.start(self.still(state), state.t, self.forwards)

    def branch(self, state: State, along: Array) -> Point:
        """The first point, from which only the bodies move."""
        now = self.problem.now
        now.remember(state)
        if (np.size(state.q), np.size(state.lam)) != (now.packed.q.size, now.W.value.size):
            raise ConfigError("the state must belong to this mechanism: take it from this branch.")
        step = np.concatenate([along, 0 * state.lam])
        length = self.curve.length(step, 0.0)
        if not length > 0.0:
            raise ConfigError("along needs a motion: all of it is zero.")
        if not self.low <= state.t <= self.high:
            raise ConfigError(f"the branch leaves at t = {state.t:g} s; it must be in the span.")
        return Point(self.still(state), state.t, step / length, 0.0)

    def still(self, state: State) -> State:
        """The state at rest, with the joint coordinates that belong to it."""
        state = replace(state, v=0 * state.v, a=0 * state.a, algorithmic=None)
        return self.problem.moved(state, np.zeros(state.v.size + state.lam.size), state.t)

    def go(self, point: Point, longest: float, n: int) -> None:
        """Follow the path from a point until time leaves the span, or there are n points."""
        self.add(point)
        try:
            for one, h, two in self.curve.steps(point, longest):
                bound = float(np.clip(two.p, self.low, self.high))
                leaves = two.p != bound
                if leaves:
                    h, two = self.curve.located(one, h, lambda x: x.p - bound)  # noqa: B023
                self.add(two)
                self.between(one, h, two, self.unstable[-2], self.unstable[-1])
                if leaves or len(self.states) == n:
                    return
        except SolverError as error:
            text = f"the path of equilibria was lost behind t = {self.states[-1].t:.6g} s"
            hint = "Take shorter steps, or begin behind what happens there."
            raise SolverError(f"{text}: {error.message}", hint=hint) from error

    def add(self, point: Point) -> None:
        """Keep a point."""
        found = self.problem.curvatures(point.at)
        # a branch begins at a motion without stiffness, whatever round-off says
        leaves = point.rate == 0.0 and found.weakest[0] < 0.0
        self.states.append(replace(point.at, t=float(point.p)))
        self.unstable.append(found.negative - leaves)

    def between(
        self, one: Point, h: float, two: Point, before: int, after: int, k: int = 0
    ) -> None:
        """Find what happens between two points, halving the way where it is more than one thing."""
        turns, crossed = one.rate * two.rate < 0.0, abs(after - before)
        if k < MAX_HALVINGS and (crossed > 1 or (turns and not crossed)):
            middle = self.curve.ahead(one, h / 2)
            unstable = self.problem.curvatures(middle.at).negative
            self.between(one, h / 2, middle, before, unstable, k + 1)
            self.between(middle, h / 2, self.curve.ahead(middle, h / 2), unstable, after, k + 1)
        elif turns:
            _, point = self.curve.located(one, h, lambda x: x.rate)
            self.note("limit", point, point.step[: point.at.v.size])
        elif crossed:
            softer = min(before, after)
            _, point = self.curve.located(
                one, h, lambda x: self.problem.curvatures(x.at).of(softer), BIFURCATION_RTOL
            )
            self.note("bifurcation", point, self.problem.curvatures(point.at).weakest[1])

    def note(self, kind: str, point: Point, motion: Array) -> None:
        """Keep a critical point, the largest part of its motion one."""
        largest = motion[np.argmax(np.abs(motion * np.sqrt(self.problem.weight)))]
        self.critical.append(Critical(kind, replace(point.at, t=float(point.p)), motion / largest))
