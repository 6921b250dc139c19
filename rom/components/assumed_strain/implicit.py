"""Equilibrium and implicit motion of a sheet under actions, by Newton's method.

Source:
    Steps in time: Chung and Hulbert, A time integration algorithm for structural dynamics with
    improved numerical dissipation: the generalized-alpha method, J. Appl. Mech. 60 (1993) 371.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import spsolve

from rom.arguments import Count, Share, ascending, typed
from rom.components.assumed_strain import kernels
from rom.components.assumed_strain.actions import Actions, Load, Prepared, nodal, prepared, touch
from rom.components.assumed_strain.motion import Metal, depth_of, forces, mass, tangent
from rom.components.assumed_strain.triangles import Sheet, placed
from rom.errors import ConfigError, SolverError, warn
from rom.model import Array, Index

Steps = Annotated[int, Count(1)]  # of the load
PENALTY_RATIO = 20.0  # stiffness of a face at a node, over Young's modulus times depth
RESIDUAL_RTOL = 1e-9  # of the forces that are in balance
ROUND_OFF_ULPS = 2  # of forces at rest: 0.8 to 1.1 found, times the root of the number of nodes
# a bar that bounces from a wall kept 0.96 and 0.98 of its energy at 0 and 0.5, and got 2.7 at 0.8
MAX_RHO_OF_IMPACTS = 0.5
MIN_SHARE = 1 / 64  # of a correction that is not halved any more
MAX_ITERATIONS = 25
# most plastic strain that grows in a step: blocks upset to 0.34 of their height were 1.1 % off the
# closed form with 0.10, 4 % with 0.17, 0.1 % with 0.05
MAX_STRAIN_STEP = 0.05
# ratio of the principal stretches of a triangle F1 beyond which squares that are pressed flat lean
# over: blocks had 0.1 % of error at 8.7, 1 to 4 % at 11, 9 to 18 % at 13
MAX_STRETCH_RATIO = 10.0
TRIANGLES_AT_ONCE = 100_000  # of several instants, whose stretches are found together
MIN_STEP = 1 / 256  # part of the time between two instants that is not halved any more


@dataclass(frozen=True, slots=True)
class Course:
    """What happened, instant by instant.

    Attributes:
        t: (k,) times [s]; without inertia only a measure of the way.
        x: (k, n, 2) positions [m].
        v: (k, n, 2) velocities [m/s]; without inertia means of the last step.
        plastic: (k, t, p) accumulated plastic strain [1].
        tool_forces: (k, tools, 2) forces of the tools on the sheet [N].
        reactions: (k, n, 2) forces of supports and drives on their nodes [N].
        history: (t, p, 5) of the end, as of `forces` [1].
        iterations: most of Newton's iterations in a step.
    """

    t: Array
    x: Array
    v: Array
    plastic: Array
    tool_forces: Array
    reactions: Array
    history: Array
    iterations: int


@dataclass(frozen=True, slots=True)
class _Now:
    """State at an instant: motion, history, elastic slip at tools (n, tools), balance of forces."""

    t: float
    x: Array
    v: Array
    a: Array
    history: Array
    slip: Array
    balance: Array
    tool_forces: Array
    reactions: Array


@typed
def quasi_static(body: Sheet, metal: Metal, actions: Actions, times: npt.ArrayLike) -> Course:
    """Equilibria at growing times, with steps between them halved where they do not hold.

    That is where Newton's method fails, or plastic strain grows by more than 0.05 in a step: longer
    steps may settle on another balance.

    Args:
        body: the sheet, without stress at the first time.
        metal: its material.
        actions: loads, pressure, driven nodes and tools.
        times: (k,) instants [s].

    Raises:
        ConfigError: if actions or times do not fit, or leave a rigid motion where there is no tool.
        MeshError: if a tool begins inside the sheet.
        SolverError: if no equilibrium is found, or plastic strain leaps even in the shortest steps;
            ``error.solution`` holds the instants before.
    """
    t, acts = _over(times, body, actions)
    if not actions.tools:
        _refuse_free(body, acts.driven)
    return _Way(body, metal, acts, None, 0.0).run(t, np.zeros_like(body.points))


@typed
def equilibrium(
    body: Sheet, metal: Metal, load: Array, held: npt.ArrayLike, *, steps: Steps = 1
) -> tuple[Array, Array, int]:
    """Rest under dead loads, which grow in equal steps; `quasi_static` has all other actions.

    Of dead forces load (n, 2) [N] and held numbers (k,) of dofs come positions (n, 2) [m], history
    as of `forces`, and the most Newton iterations of a step.

    Raises:
        ConfigError: if loads or held dofs do not fit.
        SolverError: if Newton's method does not find equilibrium, even in halves of a step;
            ``error.solution`` holds the steps before.
    """
    actions = Actions(held, loads=[Load(load, ((0, 1), (0, 1)))])
    course = quasi_static(body, metal, actions, np.linspace(0, 1, steps + 1))
    return course.x[-1], course.history, course.iterations


@typed
def implicit_motion(
    body: Sheet,
    metal: Metal,
    actions: Actions,
    times: npt.ArrayLike,
    *,
    v: npt.ArrayLike | None = None,
    rho_inf: Share = 0.5,
) -> Course:
    """Motion with inertia by generalized-alpha steps, from one instant to the next.

    Velocities v (n, 2) [m/s] are those at the start; None: at rest. Of the fastest vibrations a
    step leaves rho_inf [1]; with tools 0.5 at most, since impacts gain energy above. Other
    arguments are as of `quasi_static`.

    Raises:
        ConfigError: if actions, times or velocities do not fit.
        MeshError: if a tool begins inside the sheet.
        SolverError: if no motion is found, or plastic strain leaps even in the shortest steps;
            ``error.solution`` holds the instants before.
    """
    if actions.tools and rho_inf > MAX_RHO_OF_IMPACTS:
        text = f"rho_inf = {rho_inf} must be at most {MAX_RHO_OF_IMPACTS} with tools"
        raise ConfigError(f"{text}: impacts gain energy above.")
    start = np.zeros_like(body.points) if v is None else nodal("velocities", v, body)
    t, acts = _over(times, body, actions)
    return _Way(body, metal, acts, mass(body, metal), rho_inf).run(t, start)


@dataclass(frozen=True, slots=True)
class _Trial:
    """A state, its forces out of balance (2n,) with inertia, their size, stiffness of tools."""

    then: _Now
    whole: Array
    size: float
    entries: list[tuple[Index, Array]]

    def norm(self, free: Index) -> float:
        """Of the free ones [N]; infinite where something is not finite."""
        found = float(np.linalg.norm(self.whole[free]))
        return found if np.isfinite(found) else np.inf


class _Way:
    """One run: what does not change, and the steps of Newton's method."""

    def __init__(
        self, body: Sheet, metal: Metal, acts: Prepared, M: csr_matrix | None, rho: float
    ) -> None:
        self.body, self.metal, self.acts, self.M = body, metal, acts, M
        self.free = np.setdiff1d(np.arange(body.points.size), self.acts.driven)
        self.alpha_m, self.alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        self.gamma = 0.5 - self.alpha_m + self.alpha_f
        self.beta = 0.25 * (1 - self.alpha_m + self.alpha_f) ** 2
        if M is None:
            self.alpha_m = self.alpha_f = 0.0
        depth = depth_of(body)
        around = 2 * np.pi * np.maximum(body.points[:, 0], 1e-3 * body.points[:, 0].max())
        deep = np.full(len(around), depth) if depth > 0 else around
        self.stiff = PENALTY_RATIO * metal.E * deep
        extent = np.ptp(body.points, axis=0).max()
        self.round_off = ROUND_OFF_ULPS * np.finfo(float).eps * metal.E * deep.max() * extent
        self.round_off *= np.sqrt(len(body.points))
        self.most = 0

    def run(self, t: Array, v: Array) -> Course:
        """Instants (k,) one after the other."""
        kept = [self.start(t[0], v)]
        for k in range(1, len(t)):
            now, part = kept[-1], 1.0
            while now.t < t[k]:
                end = min(now.t + part * (t[k] - t[k - 1]), t[k])
                end = t[k] if t[k] - end < 1e-9 * (t[k] - t[k - 1]) else end
                found = self.step(now, end)
                grown, why = 0.0, "no balance of forces"
                if found is not None:
                    grown = (found.history - now.history)[..., 4].max()
                    why = f"plastic strain grows by {grown:.2g}, more than {MAX_STRAIN_STEP} a step"
                if found is not None and grown <= MAX_STRAIN_STEP:
                    now, part = found, min(part * (1 + (2 * grown <= MAX_STRAIN_STEP)), 1.0)
                elif part > MIN_STEP:
                    part /= 2
                else:
                    raise SolverError(
                        f"{why} between {now.t:.4g} s and {end:.4g} s, instant {k}.",
                        hint="Take more instants, or less load; the sheet may be free to move.",
                        solution=self.course(kept),
                    )
            kept.append(now)
        self.doubt(kept)
        return self.course(kept)

    def doubt(self, kept: list[_Now]) -> None:
        """Warn of triangles so flat that meshes lean over, which the balance of forces hides."""
        body = self.body
        if body.gradients.shape[1:3] != (1, 3):
            return
        many = max(1, TRIANGLES_AT_ONCE // len(body.patch))
        for some in (kept[k : k + many] for k in range(0, len(kept), many)):
            ratio = _stretch_ratio(body, np.array([now.x for now in some]))
            flat = ratio.max(axis=1) > MAX_STRETCH_RATIO
            if flat.any():
                k = int(flat.argmax())
                warn(
                    f"from {some[k].t:.4g} s on triangle {int(ratio[k].argmax())} is stretched "
                    f"{ratio[k].max():.3g} times as much along one axis as along the other: beyond "
                    f"{MAX_STRETCH_RATIO:g} meshes of F1 lean over, and forces are too low, by 1 % "
                    "at 11 and 10 % at 13. Stop before."
                )
                return

    def course(self, kept: list[_Now]) -> Course:
        """Record of the instants."""

        def rows(name: str) -> Array:
            return np.array([getattr(now, name) for now in kept])

        plastic, last = rows("history")[..., 4], kept[-1].history
        t, x, v, tools, reactions = map(rows, ("t", "x", "v", "tool_forces", "reactions"))
        return Course(t, x, v, plastic, tools, reactions, last, self.most)

    def start(self, t: float, v: Array) -> _Now:
        """The sheet as it began; with inertia, its acceleration."""
        x, n = self.body.points.copy(), self.body.points.size
        x.reshape(-1)[self.acts.driven] += self.acts.displacements(t)
        history, tools = np.zeros((*self.body.weights.shape, 5)), len(self.acts.friction)
        still, slip, pushed = np.zeros_like(x), np.zeros((len(x), tools)), np.zeros((tools, 2))
        now = _Now(t, x, still, still, history, slip, np.zeros(n), pushed, still)
        if self.M is None:
            return now
        balance, now, _ = self.balance(now, x, t, [])
        a, v = np.zeros(n), v.copy()
        v.reshape(-1)[self.acts.driven] = 0.0
        a[self.free] = spsolve(self.M[self.free][:, self.free].tocsc(), balance[self.free])
        return replace(now, a=a.reshape(-1, 2), v=v, balance=balance)

    def balance(
        self, now: _Now, x: Array, t: float, entries: list[tuple[Index, Array]]
    ) -> tuple[Array, _Now, float]:
        """Forces out of balance without inertia (2n,) [N], the state there, and their size."""
        body, acts = self.body, self.acts
        f, history = forces(body, self.metal, x, now.history)
        g = np.zeros_like(x)
        kernels.applied(x, acts.at(t), acts.forces, depth_of(body), g)
        tool_forces = np.zeros_like(now.tool_forces)
        slip, c = np.zeros_like(now.slip), np.zeros_like(x)
        for k in range(len(acts.friction)):
            place, mu = acts.places(t)[k], acts.friction[k]
            moved = x - now.x - (place - acts.places(now.t)[k])
            on = touch(x - place, moved, now.slip[:, k], acts.faces_of(k), mu, self.stiff)
            entries.append(on.entries)
            slip[:, k], tool_forces[k], c = on.slip, on.forces.sum(axis=0), c + on.forces
        size = float(np.linalg.norm(f) + np.linalg.norm(g) + np.linalg.norm(c))
        r = (g + c - f).ravel()
        then = replace(now, t=t, x=x, history=history, slip=slip, tool_forces=tool_forces)
        return r, replace(then, balance=r), size

    def step(self, now: _Now, t: float) -> _Now | None:
        """State after a step, None where Newton's method fails."""
        free, driven, trial = self.free, self.acts.driven, self.first(now, t)
        target = self.body.points.ravel()[driven] + self.acts.displacements(t)
        for i in range(MAX_ITERATIONS):
            if not np.isfinite(trial.whole).all():
                return None
            if i and trial.norm(free) <= RESIDUAL_RTOL * trial.size + self.round_off:
                self.most = max(self.most, i)
                return self.arrived(now, trial)
            K, jump = self.stiffness(now, trial), target - trial.then.x.ravel()[driven]
            rows, change = K[free], np.zeros(trial.whole.size)
            change[driven] = jump
            if free.size:
                right = trial.whole[free] - rows[:, driven] @ jump
                change[free] = spsolve(rows[:, free].tocsc(), right)
            if not np.isfinite(change).all():
                return None
            trial = self.searched(now, trial, change.reshape(-1, 2), i == 0)
        return None

    def first(self, now: _Now, t: float) -> "_Trial":
        """Where a step begins: as the motion goes on."""
        dt = t - now.t
        trial = self.trial(now, now.x + dt * now.v + 0.5 * dt * dt * now.a, t)
        return trial if trial.norm(self.free) < np.inf else self.trial(now, now.x, t)

    def searched(self, now: _Now, old: "_Trial", change: Array, full: bool) -> "_Trial":
        """The whole change, or that half, quarter, ... of it which leaves less out of balance."""
        share, best, t = 1.0, None, old.then.t
        while best is None or (share > MIN_SHARE and not full):
            new = self.trial(now, old.then.x + share * change, t)
            if full or new.norm(self.free) < (1 - 0.1 * share) * old.norm(self.free):
                return new
            best = new if best is None or new.norm(self.free) < best.norm(self.free) else best
            share /= 2
        return best

    def trial(self, now: _Now, x: Array, t: float) -> "_Trial":
        """Balance of forces at positions, with inertia."""
        entries: list[tuple[Index, Array]] = []
        with np.errstate(all="ignore"):
            r, then, size = self.balance(now, x, t, entries)
        whole = (1 - self.alpha_f) * r + self.alpha_f * now.balance
        if self.M is None:
            return _Trial(then, whole, size, entries)
        dt = t - now.t
        a = (x - now.x - dt * now.v - dt * dt * (0.5 - self.beta) * now.a) / (self.beta * dt * dt)
        inertia = self.M @ ((1 - self.alpha_m) * a + self.alpha_m * now.a).ravel()
        size += float(np.linalg.norm(inertia))
        return _Trial(replace(then, a=a), whole - inertia, size, entries)

    def arrived(self, now: _Now, trial: "_Trial") -> _Now:
        """State at the end of a step, with what supports and drives give."""
        then, dt, reactions = trial.then, trial.then.t - now.t, np.zeros(trial.whole.size)
        held = -then.balance
        if self.M is None:
            v = (then.x - now.x) / dt
        else:
            held += self.M @ then.a.ravel()
            v = now.v + dt * ((1 - self.gamma) * now.a + self.gamma * then.a)
        reactions[self.acts.driven] = held[self.acts.driven]
        return replace(then, v=v, reactions=reactions.reshape(-1, 2))

    def stiffness(self, now: _Now, trial: "_Trial") -> csr_matrix:
        """(2n, 2n) of solid, tools, sides that turn under their pressure, and inertia [N/m]."""
        x, t = trial.then.x, trial.then.t
        K = tangent(self.body, self.metal, x, now.history)
        for nodes, A in trial.entries:
            dofs = 2 * nodes[:, None] + np.arange(2)
            K = K + placed(A, dofs, dofs, x.size)
        if len(self.acts.sides):
            K = K - self.turning(x, t)
        if self.M is None:
            return K.tocsr()
        inertia = (1 - self.alpha_m) / (self.beta * (t - now.t) ** 2)
        return ((1 - self.alpha_f) * K + inertia * self.M).tocsr()

    def turning(self, x: Array, t: float) -> csr_matrix:
        """(2n, 2n) derivative of pressure and shear by the positions [N/m]."""
        acts, (i, j) = self.acts, self.acts.sides.T
        p, s = acts.stress.T
        side, factor = x[j] - x[i], 0.5 * acts.at(t)[acts.of_side]
        turn = np.moveaxis(np.array([[s, -p], [p, s]]), 2, 0)
        depth = depth_of(self.body)
        around = np.full(len(i), depth) if depth > 0 else np.pi * (x[i, 0] + x[j, 0])
        wide = (factor * around)[:, None, None] * turn
        A = np.concatenate([-wide, wide], axis=2)
        if depth < 0:
            more = np.pi * factor[:, None] * (turn @ side[..., None])[..., 0]
            A[:, :, 0] += more
            A[:, :, 2] += more
        first, second = (2 * e[:, None] + np.arange(2) for e in (i, j))
        ends = np.concatenate([first, second], axis=1)
        return placed(A, first, ends, x.size) + placed(A, second, ends, x.size)


def _refuse_free(body: Sheet, driven: Index) -> None:
    """Without tools, held and driven dofs stop every rigid motion."""
    place = body.points - body.points.mean(axis=0)
    motions = np.zeros((body.points.size, 3))
    motions[::2, 0] = motions[1::2, 1] = np.abs(place).max()
    motions[::2, 2], motions[1::2, 2] = -place[:, 1], place[:, 0]
    stopped = np.linalg.matrix_rank(motions[driven], tol=1e-9) if driven.size else 0
    if body.state == "axisymmetric":
        if not np.any(driven % 2):
            raise ConfigError("the solid can slide along its axis; hold the second dof of a node.")
    elif stopped < 3:
        text = f"{driven.size} held and driven dofs leave {3 - stopped} of three rigid motions"
        raise ConfigError(f"{text}; hold two dofs of one node and one of another, or more.")


def _over(times: npt.ArrayLike, body: Sheet, actions: Actions) -> tuple[Array, Prepared]:
    """Instants (k,) [s], and what acts from the first to the last."""
    t = ascending("times", times)
    return t, prepared(body, actions, (t[0], t[-1]))


def _stretch_ratio(body: Sheet, x: Array) -> Array:
    """(k, t) larger over smaller principal stretch [1] of triangles F1 at positions (k, n, 2)."""
    F = np.einsum("ktia,tsib->ktsab", x[:, body.patch], body.gradients[:, 0])
    C = np.einsum("ktsca,ktscb->abkt", F, F)
    largest = (C[0, 0] + C[1, 1]) / 2 + np.hypot((C[0, 0] - C[1, 1]) / 2, C[0, 1])
    ratio: Array = largest / np.sqrt(np.maximum(C[0, 0] * C[1, 1] - C[0, 1] ** 2, 1e-300))
    return ratio
