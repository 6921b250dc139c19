"""One correction towards equilibrium: linear equations in motions that the joints allow.

In a large mechanism, where sparse matrices solve them and the potential curves downwards, some
stiffness is lent, in proportion to the masses, until it curves upwards; what is lent goes back as
soon as it does so by itself.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import diags, identity

from rom.errors import SolverError
from rom.mbs.analysis.few_modes import Pencil
from rom.mbs.analysis.local_equations import Instant, free_motions, of_unit_mass
from rom.mbs.analysis.rotors.spins import Spins
from rom.mbs.equations.packing import Packed
from rom.mbs.equations.sparse_solve import Constrained, unit_rows
from rom.mbs.results.state import State
from rom.model import Array, Mask

MAX_ROTATION = 0.3  # of one correction [rad]
MAX_DISPLACEMENT = 0.3  # of one correction, of the mechanism's size
# stiffness that counts as none, relative to the largest one and to that of the loads: differences
# leave 1e-11 of the latter
STIFFNESS_RTOL, LOAD_STIFFNESS_RTOL = 1e-13, 1e-9
N_WEAKEST = 6  # motions of least stiffness that are looked at
MAX_LOANS = 40  # each so much larger than the last:
LOAN_RATIO = 3.0
FIRST_LOAN = 1e-2  # of the stiffness that the loads give
REPAYMENT_SHARE = 0.3  # share of a loan that the next correction begins with
# corrections, in rad or lengths of the mechanism: what a linear equation may say; from which
# signs of the stiffness are counted; below which forces are round-off
MAX_CORRECTION, COUNTED_CORRECTION, ROUND_OFF_CORRECTION = 100.0, 1e-2, 1e-9


@dataclass(frozen=True)
class Weakest:
    """Free motions of unit mass, those of least stiffness first."""

    squares: Array  # (k,) their stiffness [1/s^2]
    motions: Array  # (n, k) variations of the coordinates
    none: Array | float  # stiffness that counts as none, for each or for all [1/s^2]
    along: Array  # (k,) forces out of balance in them

    @property
    def loose(self) -> Mask:
        """(k,) whether nothing opposes it."""
        return np.abs(self.squares) <= self.none


@dataclass(frozen=True)
class Tangent:
    """Linear equations of one correction, in motions that turn with the bodies."""

    now: Instant
    T: Array  # (n, n) variation of the coordinates per motion
    r: Array  # (n,) forces out of balance
    K: Array  # (n, n) their derivative
    G: Array  # (m, n) constraints
    gap: Array  # (m,) of the constraints
    Z: Array  # (n, f) free motions of unit mass
    pull: float  # stiffness that the loads themselves give, gravity over length [1/s^2]
    # of the descent before a correction, if finite steps alone have caused it
    MAX_DESCENT_LEFT = 0.01

    @classmethod
    def of(cls, now: Instant, state: State, spins: Spins) -> "Tangent":
        """The equations at a state that rests, or turns steadily."""
        T, T1, T3 = spins.motions(now, state)
        M, C, K = now.matrices(state)
        K = K @ T + C @ T1 + M @ T3
        r = T.T @ now.residual(state.q, state.v, state.a, state.lam)
        pull = load_stiffness(now, state)
        gap, G, _ = now.gradient(state.q, state.v)
        Z = of_unit_mass(free_motions(G @ T, now.probe(), state.rank), T.T @ M @ T)
        return cls(now, T, r, T.T @ K, G @ T, gap, Z, pull)

    @property
    def curvature(self) -> Array:
        """Symmetric part of the stiffness of the free motions [rad^2/s^2]."""
        K = self.Z.T @ self.K @ self.Z
        return 0.5 * (K + K.T)

    def none(self, squares: Array) -> float:
        """Stiffness that counts as none."""
        largest = np.abs(squares).max(initial=0.0)
        return max(STIFFNESS_RTOL * largest, LOAD_STIFFNESS_RTOL * self.pull, 1e-300)

    def weakest(self) -> Weakest:
        """All free motions."""
        squares, V = self._principal
        along = np.abs(V.T @ (self.Z.T @ self.r))
        return Weakest(squares, self.T @ self.Z @ V, self.none(squares), along)

    def correction(self) -> tuple[Array, Array]:
        """(n,) variation of the coordinates and (m,) of the multipliers, downhill."""
        if self.rises and self.newton is not None:
            return self.newton
        return self._answered(self._downhill)

    def balanced(self) -> tuple[Array, Array]:
        """(n,), (m,) variations that balance the forces and close the gaps."""
        return self._answered(self._held)

    def driven(self, faint: float) -> Array | None:
        """(n,) a motion that no force opposes, though one beyond ``faint`` drives it.

        Drag that goes around has no potential: what changes no force need not be what is driven.
        """
        U, s, V = self._singular
        along = np.where(s > self.none(s), 0.0, np.abs(U.T @ (self.Z.T @ self.r)))
        if along.max(initial=0.0) <= faint:
            return None
        return np.asarray(self.T @ self.Z @ V[int(np.argmax(along))])

    @cached_property
    def newton(self) -> tuple[Array, Array] | None:
        """Newton's correction, upwards or downhill; None where a motion has no stiffness."""
        squares = self._principal[0]
        if np.abs(squares).min(initial=np.inf) <= self.none(squares):
            return None
        return self.balanced()

    @cached_property
    def rises(self) -> bool:
        """Whether the potential curves upwards in all free motions."""
        squares = self._principal[0]
        return bool(squares.min(initial=np.inf) > self.none(squares))

    @property
    def descent(self) -> float:
        """How much the potential curves downwards: where most [rad^2/s^2]."""
        return -float(self._principal[0][0])

    @cached_property
    def _principal(self) -> tuple[Array, Array]:
        """(f,) curvatures and (f, f) their directions."""
        return np.linalg.eigh(self.curvature)

    @cached_property
    def _singular(self) -> tuple[Array, Array, Array]:
        """Singular values of the stiffness of the free motions, between forces and motions."""
        return np.linalg.svd(self.Z.T @ self.K @ self.Z)

    def _answered(self, motion: Callable[[Array], Array]) -> tuple[Array, Array]:
        """The joints closed, and the motion (f,) that answers the forces left over (f,)."""
        scale = self.now.probe()
        A = self.G * scale
        rows = np.maximum(np.linalg.norm(A, axis=1), 1e-300)
        shift = np.linalg.lstsq(A / rows[:, None], -self.gap / rows, rcond=1e-9)[0] * scale
        shift = shift + self.Z @ motion(self.Z.T @ (self.r + self.K @ shift))
        reaction = np.linalg.lstsq(A.T, -(self.r + self.K @ shift) * scale, rcond=1e-9)[0]
        return self.T @ shift, reaction

    def _held(self, force: Array) -> Array:
        """(f,) motion that balances the force, as far as stiffness does."""
        if self.rises:
            return -np.linalg.solve(self.Z.T @ self.K @ self.Z, force)
        U, s, V = self._singular
        held = s > self.none(s)
        return -V[held].T @ (U[:, held].T @ force / s[held])

    def _downhill(self, force: Array) -> Array:
        """(f,) motion along the force, by the absolute values of the curvatures."""
        squares, V = self._principal
        none, along = self.none(squares), V.T @ force
        still = (np.abs(squares) <= none) & (np.abs(along) <= faint_force(self.now, self.pull))
        return -V @ np.where(still, 0.0, along / np.maximum(np.abs(squares), none))


@dataclass
class Loan:
    """Stiffness lent to the correction before, in units of the mass matrix [1/s^2]."""

    value: float = 0.0


class _Correction(NamedTuple):
    """Variation of coordinates (n,) and multipliers (m,), and what the forces do along it."""

    step: Array
    reaction: Array
    along: float


@dataclass(frozen=True)
class SparseTangent:
    """The equations and answers of `Tangent`, by sparse matrices."""

    now: Instant
    pencil: Pencil  # masses and stiffness in motions u that turn with the bodies
    r: Array  # (n,) forces out of balance per u
    gap: Array  # (m,) of the constraints
    pull: float  # stiffness that the loads themselves give [1/s^2]
    loan: Loan  # what was lent before
    MAX_DESCENT_LEFT = 0.5

    @classmethod
    def of(cls, now: Instant, state: State, spins: Spins, loan: Loan) -> "SparseTangent":
        """The equations at a state that rests, or turns steadily."""
        T, T1, T3 = spins.motions(now, state)
        pencil = Pencil.of(now, state, (T, T1, 0 * T, T3))
        r = pencil.basis.T @ now.residual(state.q, state.v, state.a, state.lam)
        pull = load_stiffness(now, state)
        return cls(now, pencil, r, now.gradient(state.q, state.v)[0], pull, loan)

    def correction(self) -> tuple[Array, Array]:
        """(n,) variation of the coordinates and (m,) of the multipliers, downhill."""
        least = FIRST_LOAN * (self.pull or self.pencil.scale)
        lent = REPAYMENT_SHARE * self.loan.value
        lent = lent if lent >= least else 0.0
        for _ in range(MAX_LOANS):
            found = self._solved(lent) if lent else self._plain
            if found is not None and (self._downhill(found, lent) if lent else self.rises):
                self.loan.value = lent
                return found.step, found.reaction
            lent = max(LOAN_RATIO * lent, least)
        raise SolverError("the equations of equilibrium are singular, whatever stiffness is lent.")

    @property
    def newton(self) -> tuple[Array, Array] | None:
        """The correction with nothing lent, upwards or downhill; None where there is none."""
        return None if self._plain is None else (self._plain.step, self._plain.reaction)

    @cached_property
    def rises(self) -> bool:
        """Whether this correction leads downhill, as where the potential curves upwards."""
        return self._plain is not None and self._downhill(self._plain, 0.0)

    @cached_property
    def descent(self) -> int:
        """How much the potential curves downwards: in how many motions."""
        return self.pencil.count(0.0)

    @cached_property
    def _plain(self) -> _Correction | None:
        return self._solved(0.0)

    def _downhill(self, found: _Correction, lent: float) -> bool:
        """Whether a correction with some stiffness lent leads downhill."""
        size = sizes(self.now.packed, found.step)[0]
        if size > ROUND_OFF_CORRECTION and found.along > 0.0:
            return False
        if not COUNTED_CORRECTION < size <= MAX_ROTATION:
            return True
        return not (self.pencil.count(-lent) if lent else self.descent)

    def _solved(self, lent: float) -> _Correction | None:
        """The correction with some stiffness lent; None where equations do not say any."""
        p, gap = self.pencil, self.gap / self.pencil.row
        try:
            equations = p.inverse(p.K + lent * p.M)
        except SolverError:
            return None
        forces, gaps = np.zeros((self.r.size, 2)), np.zeros((gap.size, 2))
        forces[:, 0], gaps[:, 1] = -self.r, -gap
        u, l = equations.solve(forces, gaps)
        step = p.basis @ u.sum(axis=1)
        if not sizes(self.now.packed, step)[0] < MAX_CORRECTION:
            return None
        return _Correction(step, l.sum(axis=1) / p.row, float(self.r @ u[:, 0]))

    def weakest(self) -> Weakest:
        """The free motions of least stiffness."""
        p = self.pencil
        if not p.n_free:
            return Weakest(np.zeros(0), np.zeros((self.r.size, 0)), np.zeros(0), np.zeros(0))
        squares, U = p.lowest(min(N_WEAKEST, p.n_free))
        none = np.maximum(p.round_off(U), LOAD_STIFFNESS_RTOL * self.pull)
        return Weakest(squares, p.basis @ U, none, np.abs(U.T @ self.r))

    def driven(self, faint: float) -> Array | None:
        """(n,) a motion that no force opposes, though one beyond ``faint`` drives it."""
        weakest = self.weakest()
        pushed = np.where(weakest.loose, weakest.along, 0.0)
        return weakest.motions[:, int(np.argmax(pushed))] if pushed.max(initial=0) > faint else None


def best_reactions(now: Instant, state: State) -> tuple[Array, Array]:
    """(n,) what is left of the forces, by the change (m,) of the multipliers that balances best."""
    r = now.residual(state.q, state.v, state.a, state.lam)
    _, G, M = now.gradient(state.q, state.v)
    if now.pattern is None:
        scale = now.probe()
        l = -np.linalg.lstsq((G * scale).T, r * scale, rcond=1e-9)[0]
        return r + G.T @ l, l
    scale = 1 / np.sqrt(M.diagonal())
    rows, length = unit_rows(G @ diags(scale))
    left, l = Constrained(identity(r.size), rows, redundant=not now.independent).solve(r * scale)
    return left / scale, -l / length


def load_stiffness(now: Instant, state: State) -> float:
    """Gravity over length, and what other loads add; residual first [1/s^2]."""
    packed = now.packed
    force, moment = (np.abs(x).max(initial=0.0) for x in np.split(now.W.wrench, 2, axis=1))
    force += moment / packed.length + packed.mass * np.abs(state.a).max()
    force += packed.mass * np.linalg.norm(packed.system.bodies.gravity)
    return float(force / packed.mass / packed.length)


def faint_force(now: Instant, pull: float) -> float:
    """Force per root of mass, in a free motion, that counts as none."""
    return float(LOAD_STIFFNESS_RTOL * pull * now.packed.length * np.sqrt(now.packed.mass))


def sizes(packed: Packed, step: Array) -> tuple[float, float]:
    """Size of a correction, in rad or lengths of the mechanism, and the share of it to be taken."""
    bodies, x = packed.system.bodies, step / packed.unit
    at = bodies.v_at[:, None] + np.arange(3)
    flexible = ((bodies.v_at[b] + 6, bodies.r[b]) for b in np.flatnonzero(bodies.r))
    bends = [np.linalg.norm(x[first : first + r]) for first, r in flexible]
    turn, shift = (np.linalg.norm(x[some], axis=1).max() for some in (at + 3, at))
    shift = max([shift, *bends])
    share = 1 / max(1.0, turn / MAX_ROTATION, shift / MAX_DISPLACEMENT)
    return float(max(turn, shift)), float(share)
