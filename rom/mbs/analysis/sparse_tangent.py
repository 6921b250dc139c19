"""One correction towards equilibrium of a large mechanism, by sparse matrices.

Where the potential curves downwards some stiffness is lent, in proportion to the masses, until it
curves upwards; what is lent goes back as soon as it does so by itself.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from rom.errors import SolverError
from rom.mbs.analysis.few_modes import Pencil
from rom.mbs.analysis.local_equations import Instant
from rom.mbs.analysis.rotors.spins import Spins
from rom.mbs.analysis.tangent import (
    LOAD_STIFFNESS_RTOL,
    MAX_ROTATION,
    Weakest,
    load_stiffness,
    sizes,
)
from rom.mbs.results.state import State
from rom.model import Array

N_WEAKEST = 6  # motions of least stiffness that are looked at
MAX_LOANS = 40  # each so much larger than the last:
LOAN_RATIO = 3.0
FIRST_LOAN = 1e-2  # of the stiffness that the loads give
REPAYMENT_SHARE = 0.3  # share of a loan that the next correction begins with
# corrections, in rad or lengths of the mechanism: what a linear equation may say; from which
# signs of the stiffness are counted; below which forces are round-off
MAX_CORRECTION, COUNTED_CORRECTION, ROUND_OFF_CORRECTION = 100.0, 1e-2, 1e-9


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
    """Linear equations of one correction, as `rom.mbs.analysis.tangent.Tangent` has them.

    Attributes:
        now: the mechanism.
        pencil: masses and stiffness in motions u that turn with the bodies.
        r: (n,) forces out of balance per u.
        gap: (m,) constraints.
        pull: stiffness that the loads themselves give [1/s^2].
        loan: what was lent before.
    """

    now: Instant
    pencil: Pencil
    r: Array
    gap: Array
    pull: float
    loan: Loan

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

    def steadier(self, before: Any) -> bool:
        """Whether the potential curves downwards in less than half as many motions as before."""
        return 2 * self._downwards < before._downwards

    @cached_property
    def _downwards(self) -> int:
        """In how many motions the potential curves downwards."""
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
        return not (self.pencil.count(-lent) if lent else self._downwards)

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
