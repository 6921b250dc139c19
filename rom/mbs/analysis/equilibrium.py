"""Equilibrium of a mechanism, at rest or turning as one, by Newton's method with load steps."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import Count, typed
from rom.errors import ModelError, RomError, SolverError, reached, warn
from rom.mbs.analysis.local_equations import Instant, instant
from rom.mbs.analysis.rotors.spins import Spins
from rom.mbs.analysis.tangent import (
    Loan,
    SparseTangent,
    Tangent,
    best_reactions,
    faint_force,
    sizes,
)
from rom.mbs.equations.packing import Packed
from rom.mbs.integrate.consistent_start import assembled, check_velocity, initial_state
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.audit import warn_of_range
from rom.mbs.results.state import State, check_state
from rom.model import Array
from rom.paths.load_steps import load_steps

MAX_PASSES = 150
MAX_IDLE = 25  # that lead neither down nor nearer; what is found at all is found in as many
MAX_KEPT = 8  # corrections of which the largest counts
PROGRESS_RTOL = 1e-6  # round-off of both
MAX_WAY = 30.0  # of the search, in rad and sizes of the mechanism
MAX_TRIALS = 40  # of Newton's corrections where the potential curves downwards
MOST_STEPS = 100_000  # of the load; where thousands do not help, another start may
MIN_LOAD_STEP = 1 / 128  # part of a load step at which the search is given up
CORRECTION_TOL = 1e-12  # of the last correction
LEAST_BENDING = 1e-3  # of the inertia in a motion, from which a body counts as deforming
MAX_TURN = 2 * np.pi  # after which what turned meets the same forces again [rad]
STRAIGHT_SHARE = 0.99  # of the way turned, from which it was about one axis
MAX_HALVINGS = 60  # of a correction that leaves a gap no room
ROOM_LEFT = 0.5  # of a gap, after one correction
MIN_ROOM = 1e-4  # of a gap, which no film keeps open
STALLED_TOL = 1e-7  # below it, corrections that no longer shrink are round-off


@typed
def equilibrium(
    mechanism: Mechanism,
    state: State | None = None,
    *,
    t: float | None = None,
    steps: Annotated[int, Count(1, MOST_STEPS)] = 1,
    spin: npt.ArrayLike | Mapping[str, float] | None = None,
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    assemble: bool = False,
) -> State:
    """Find where forces, reactions and the inertia of a steady rotation balance.

    Gravity, loads and Python forces grow in steps, which are halved where Newton's method fails.
    Where the potential curves downwards corrections follow the force, so that the search leaves
    unstable positions unless it starts on one. Where that finds none, as where a moment that keeps
    its direction in space has no potential, an unstable one next to that of the load step before
    is taken.

    Args:
        mechanism: bodies, joints, forces; drives hold their values at time t.
        state: where the search starts; None for the position in which the bodies were added.
        t: time at which drives and loads are taken [s]; None for that of the state.
        steps: number of load steps.
        spin: (3,) angular velocity of the whole mechanism, world [rad/s]; None for rest. Or a
            speed [rad/s] for some revolute joints, {joint: speed}, about whose axes the bodies
            behind them turn while the others rest.
        about: (3,) a point on the axis of the spin [m].
        assemble: see `rom.simulate`.

    Returns:
        A state for `linearize` and for ``simulate(..., state=...)``, with the reactions.

    Raises:
        ModelError: naming the body that can still move although no force opposes, the joint that
            cannot be closed, or the joint or drive that turns at another speed than ``spin``.
        SolverError: naming the body out of balance, or the open joint, where Newton failed. Either
            of them has ``error.solution``: the state reached, at the share of the loads before.

    Warns:
        RomWarning: if the equilibrium at rest is unstable, or a body of large deflection is beyond
            the range of its certificate.

    Source:
        Newton's method on the tangent space of the constraints, with the absolute values of the
        negative curvatures: Nocedal and Wright, Numerical Optimization, chapter 3.4.

    Example:
        >>> mech = rom.Mechanism(gravity=(0, 0, -9.81))
        >>> at = {"at": (0.5, 0, 0), "markers": {"end": (-0.5, 0, 0)}}
        >>> bob = mech.add_rigid("bob", mass=2, inertia=(1e-3,) * 3, **at)
        >>> mech.revolute("hinge", mech.ground.marker((0, 0, 0)), bob.marker("end"), axis=(0, 1, 0))
        >>> round(float(rom.equilibrium(mech).q[2]), 6)  # it hangs
        -0.5
    """
    time = (0.0 if state is None else state.t) if t is None else t
    now = instant(mechanism, time, sparse=None)
    search = _Search(now, Spins.of(mechanism, now, spin, about))
    found = search.start(state, assemble or state is not None)
    with reached(lambda: found):
        nearby = search.eased(found, steps) if state is None else None
    found = search.loaded(found, steps) if nearby is None else nearby
    with reached(lambda: found):
        search.judge(found)
    if isinstance(spin, Mapping) and found.lam.size:  # else supports turn along, and drives
        now.gradient(found.q, found.v)
        check_velocity(now.packed, now.W, found.v)
    warn_of_range(mechanism, now.packed, found)
    return found


Equations = Tangent | SparseTangent


@dataclass(frozen=True)
class _Search:
    """The search at one time, for what turns steadily."""

    now: Instant
    spins: Spins
    loan: Loan = field(default_factory=Loan)

    def tangent(self, now: Instant, state: State) -> Equations:
        """The equations of one correction."""
        if now.pattern is None:
            return Tangent.of(now, state, self.spins)
        return SparseTangent.of(now, state, self.spins, self.loan)

    def start(self, state: State | None, assemble: bool = True) -> State:
        """The state to start from, its joints closed."""
        packed, W = self.now.packed, self.now.W
        first = initial_state(packed, self.now.t, assemble=assemble, placing=True)
        if first.base is not None:
            first = replace(first, base=packed.places.settled(first.base))
        if state is None:
            return self.spins.steady(self.now, replace(first, lam=0 * first.lam))
        check_state(state, packed)
        self.now.remember(state)
        base = first.base if state.base is None else packed.places.settled(state.base)
        q = assembled(packed, W, np.asarray(state.q, dtype=float))
        return self.spins.steady(self.now, replace(first, q=q, lam=state.lam.copy(), base=base))

    def eased(self, state: State, steps: int) -> State | None:
        """Equilibrium where some elements come to rest more easily in another form; None elsewhere.

        As they are at first, without smaller load steps; then from where they rest in that form.
        """
        with self.now.packed.eased() as changed:
            pass
        if not changed:
            return None
        with suppress(SolverError):
            return self.loaded(state, steps, least=0.5)
        with suppress(SolverError):
            with self.now.packed.eased():
                nearby = self.loaded(state, steps)
            return self.loaded(self.start(nearby), 1)
        return None

    def loaded(self, state: State, steps: int, *, least: float = MIN_LOAD_STEP) -> State:
        """Equilibrium under all of the loads, by steps, of which ``least`` is the smallest part.

        An error has as ``error.solution`` the equilibrium at the share before.
        """
        failed: list[SolverError] = []

        def ahead(at: State, load: float) -> State | None:
            try:
                with reached(lambda: at):
                    return self.settled(at, load, beside=at is not state)
            except SolverError as error:
                failed[:] = [error]
                return None

        share, found = load_steps(ahead, state, least=least / steps, first=1.0 / steps)
        if share < 1.0:
            raise failed[0]
        return found

    def settled(self, state: State, load: float, *, beside: bool) -> State:
        """Equilibrium at a share of the loads, a stable one if it is found.

        Beside one at another share, an unstable one next to it may be taken.
        """
        try:
            return self.settle(state, load)
        except SolverError:
            if beside:
                with suppress(SolverError):
                    return self.settle(state, load, directly=True)
            raise

    def settle(self, state: State, load: float, *, directly: bool = False) -> State:
        """Equilibrium at a share of the loads; directly: by Newton's corrections while they shrink.

        Raises ModelError if a body turns on and on, as a rotor against whose drag nothing holds.
        """
        now, last, trials = self.now.scaled(load), np.inf, MAX_TRIALS
        turned, length = np.zeros((now.packed.system.bodies.mass.size, 3)), 0.0
        progress = _Progress(now)
        state = replace(state, lam=state.lam + best_reactions(now, state)[1])
        beyond: Equations | None = None
        for _ in range(MAX_PASSES):
            equations = beyond or self.tangent(now, state)
            found, before = None, state
            # forces that go around, as those of films, have no potential that curves
            descends = now.packed.has_potential and not directly
            straight = None if descends else equations.newton
            if straight is None and trials and not equations.rises:
                found, trials = self.tried(now, state, equations), trials - 1
            if found is None:
                found = self.corrected(now, state, straight or equations.correction()), None
            (size, motion, state), beyond = found
            if not np.isfinite(size) or (directly and size > max(last, STALLED_TOL)):
                break
            if size < CORRECTION_TOL or (size < STALLED_TOL and size > 0.5 * last):
                if straight and equations.driven(faint_force(now, equations.pull)) is not None:
                    break
                return state
            last = size
            if progress.ends(size, motion, before, state):
                break
            if not equations.rises:
                turn = motion[now.packed.system.bodies.v_at[:, None] + np.arange(3, 6)]
                turned, length = turned + turn, length + np.linalg.norm(turn, axis=1)
                around = np.linalg.norm(turned, axis=1)
                if ((around > MAX_TURN) & (around > STRAIGHT_SHARE * length)).any():
                    raise _turning(now.packed, turned)
        raise _failure(now, self.tangent(now, state), state, load)

    def corrected(
        self, now: Instant, state: State, correction: tuple[Array, Array]
    ) -> tuple[float, Array, State]:
        """Size of a correction, as much of it as linear equations allow, and the state after."""
        step, dlam = correction
        size, factor = sizes(now.packed, step)
        if not np.isfinite(size):
            return size, step, state
        factor, state = self.within_room(now, state, (factor * step, factor * dlam), factor)
        if factor < 1.0:
            state = replace(state, lam=state.lam + best_reactions(now, state)[1])
        return size, factor * step, state

    def within_room(
        self, now: Instant, state: State, correction: tuple[Array, Array], factor: float
    ) -> tuple[float, State]:
        """The state after a correction, halved until no gap halves or doubles; the share taken."""
        (step, dlam), before, share = correction, self.room(now, state), 1.0
        for name, room in before.items():
            if not room > MIN_ROOM:
                text = f"nothing keeps the gap of {name!r} open: {room:.2g} of it is left."
                raise SolverError(text, hint="Lower the load, or start nearer (state=...).")
        for _ in range(MAX_HALVINGS):
            ahead = self.spins.steady(self.now, now.moved(state, share * step, share * dlam))
            left = [room / before[name] for name, room in self.room(now, ahead).items()]
            if all(ROOM_LEFT < one < 1 / ROOM_LEFT for one in left):
                break
            share /= 2
        return factor * share, ahead

    def room(self, now: Instant, state: State) -> dict[str, float]:
        """Gaps of elements that a correction may not change much."""
        if not now.packed.room:
            return {}
        with suppress(SolverError):
            now.residual(state.q, state.v, state.a, state.lam)
        return now.packed.room

    def tried(
        self, now: Instant, state: State, equations: Equations
    ) -> tuple[tuple[float, Array, State], Equations | None] | None:
        """Newton's correction although the potential curves downwards, with what is behind it.

        Only one that can be taken whole and leads to where the potential curves upwards: what is
        stiff has been strained by the square of a finite rotation, which looks like buckling.
        """
        newton = equations.newton
        if newton is None or sizes(now.packed, newton[0])[1] < 1.0:
            return None
        ahead = self.corrected(now, state, newton)
        beyond = self.tangent(now, ahead[2])
        steadier = beyond.descent < beyond.MAX_DESCENT_LEFT * equations.descent
        return (ahead, beyond) if steadier else None

    def judge(self, state: State) -> None:
        """Refuse free motions, and warn of unstable ones."""
        weakest = self.tangent(self.now.scaled(1.0), state).weakest()
        loose = [weakest.motions[:, k] for k in np.flatnonzero(weakest.loose)]
        free = [motion for motion in loose if not self.along_spin(motion, state)]
        if free:
            text = f"{_described(self.now.packed, free[0])} and no force opposes ({len(free)} free"
            hint = "Hold it by a joint or a spring, or give its place by a drive."
            raise ModelError(f"{text} motions): there is no unique equilibrium.", hint=hint)
        # stiffness alone says what is stable where nothing spins and no film pushes around
        alone = self.now.packed.has_potential and not self.spins.any
        if alone and weakest.squares.size and weakest.squares[0] < 0.0:
            motion = _described(self.now.packed, weakest.motions[:, 0])
            warn(
                f"the equilibrium is unstable: {motion} and falls away at a rate of "
                f"{np.sqrt(-weakest.squares[0]):.3g} 1/s."
            )

    def along_spin(self, motion: Array, state: State) -> bool:
        """Whether a free motion is the steady rotation itself."""
        motion, v = motion / self.now.probe(), state.v / self.now.probe()
        return bool(abs(motion @ v) > (1 - 1e-6) * np.linalg.norm(motion) * np.linalg.norm(v) > 0)


def _described(packed: Packed, motion: Array) -> str:
    """The body that moves most, and how."""
    bodies, sizes = packed.system.bodies, []
    for b, (at, r) in enumerate(zip(bodies.v_at, bodies.r, strict=True)):
        shift, turn, bent = np.split(motion[at : at + 6 + r], [3, 6])
        rigid = (shift @ shift + packed.length**2 * turn @ turn) * bodies.mass[b]
        sizes.append((rigid, bent @ bodies.M[bodies.flex[b], :r, :r] @ bent if r else 0.0))
    b = int(np.argmax(np.sum(sizes, axis=1)))
    at, (rigid, bent) = bodies.v_at[b], sizes[b]
    if not bent <= LEAST_BENDING * rigid:
        return f"body {packed.names[b]!r} deforms"
    shift, turn = motion[at : at + 3], motion[at + 3 : at + 6]
    turns = np.linalg.norm(turn) * packed.length > 1e-6 * np.linalg.norm(shift)
    direction = turn if turns else shift
    direction = direction / direction[np.argmax(np.abs(direction))]
    axis = ", ".join(f"{x:.3g}" for x in np.round(direction, 6) + 0.0)
    verb = "turns about its own axis" if turns else "slides along"
    return f"body {packed.names[b]!r} {verb} ({axis})"


@dataclass
class _Progress:
    """Whether a search still leads somewhere: to lower potential, or to smaller corrections.

    Corrections of stiff bodies come in pairs, one that strains them by the square of a finite
    rotation and one that takes it back: the largest of a few is what must fall.
    """

    now: Instant
    sizes: list[float] = field(default_factory=list)
    displacement: Array | float = 0.0
    work: float = 0.0  # of the forces against the motion
    least: Array | float = np.inf
    idle: int = 0

    def ends(self, size: float, motion: Array, before: State, after: State) -> bool:
        """Whether many corrections have led nowhere, or very far away, with one more."""
        along = [self.now.residual(x.q, x.v, x.a, x.lam) @ motion for x in (before, after)]
        self.work += 0.5 * float(along[0] + along[1])
        self.sizes = [*self.sizes[1 - MAX_KEPT :], size]
        self.displacement = self.displacement + motion
        reached, faint = np.array([self.work, max(self.sizes)]), PROGRESS_RTOL * np.abs(along).max()
        leads = (reached < self.least - np.array([faint, PROGRESS_RTOL * size])).any()
        self.least, self.idle = np.minimum(self.least, reached), 0 if leads else self.idle + 1
        return self.idle >= MAX_IDLE or sizes(self.now.packed, self.displacement)[0] > MAX_WAY


def _turning(packed: Packed, turned: Array) -> ModelError:
    """That a body has turned and turned; the potential curved upwards on no way."""
    motion, at = np.zeros(packed.v.size), packed.system.bodies.v_at[:, None] + np.arange(3, 6)
    motion[at] = turned
    return ModelError(
        f"{_described(packed, motion)}, once around in the search, driven by forces that nothing "
        "balances.",
        hint="Hold it by a joint or a spring, or give its angle by a drive.",
    )


def _failure(now: Instant, tangent: Equations, state: State, load: float) -> RomError:
    """Why Newton's method failed: an open joint, a body that nothing holds, or lack of balance."""
    packed = now.packed
    gap = np.abs(tangent.gap) / packed.row_scale
    if gap.size and gap.max() > 1e-6:
        k = int(np.argmax(gap))
        what = f"joint {packed.row_owner[k]!r} stays open by {gap[k]:.3g} of the size"
    else:
        loose = tangent.driven(faint_force(now, tangent.pull))
        if loose is not None:
            return ModelError(
                f"{_described(packed, loose)}, pushed by forces that nothing balances.",
                hint="Hold it by a joint or a spring, or give its place by a drive.",
            )
        force = np.abs(best_reactions(now, state)[0])
        starts = packed.system.bodies.v_at
        b = int(np.searchsorted(starts, int(np.argmax(force)), side="right")) - 1
        what = f"body {packed.names[b]!r} stays out of balance, by {force.max():.3g} N or N m"
        weakest = tangent.weakest()
        if weakest.squares.size and weakest.squares[0] <= np.max(weakest.none):
            what += f"; what holds least is how {_described(packed, weakest.motions[:, 0])}"
    return SolverError(
        f"no equilibrium found at {load:.3g} of the loads: {what}.",
        hint="Start nearer to it (state=...) or take more load steps.",
    )
