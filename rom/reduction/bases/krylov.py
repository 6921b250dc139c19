"""Moment matching: a rational Krylov space that is exact at chosen frequencies."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rom.arguments import Count, NotNegative, typed
from rom.eigen.verbs import Held, Operators, unit_motions, without_dependent
from rom.errors import ConfigError, SolverError
from rom.model import Array, Index
from rom.names import check_once
from rom.reduction.bases.fixed_interface import Columns, Constrained, numbered

RESONANCE_RTOL = 1e-8  # distance of a frequency from a mode


@typed
@dataclass(frozen=True, slots=True)
class MomentMatching(Constrained):
    """Constraint modes, and the answers to moving interfaces at chosen frequencies.

    At s = (2 pi f)^2 the interior follows the interfaces by (K_ii - s M_ii) x = -(K_ib - s M_ib);
    x and its first derivatives with respect to s join the constraint modes. By Galerkin's
    symmetry the dynamic stiffness that the interfaces feel is matched to twice as many
    derivatives. Statics stays exact because the constraint modes stay.

    Attributes:
        frequencies: (k,) where to be exact [Hz]; 0 is allowed and costs no other factor.
        order: blocks of vectors per frequency, 1 or more.

    Raises:
        ConfigError: for frequencies below zero or given twice, or an order below one.

    Source:
        Grimme, Krylov projection methods for model reduction, thesis, Urbana-Champaign (1997);
        for second-order systems Bai and Su, SIAM J. Sci. Comput. 26 (2005) 1692.
    """

    frequencies: Annotated[tuple[float, ...], NotNegative("Hz", (None,))] = (0.0,)
    order: Annotated[int, Count(1)] = 1

    def __post_init__(self) -> None:
        check_once(self.frequencies, "frequencies:")
        if not self.frequencies:
            raise ConfigError("MomentMatching needs a frequency.")

    def _completed(self, ops: Operators, held: Held, Psi_b: Array, boundary: Index) -> Columns:
        E, blocks = unit_motions(ops, boundary), []
        for f in self.frequencies:
            s = (2 * np.pi * f) ** 2
            shifted = ops.hold(boundary, s) if s else held
            X = Psi_b
            if s:
                _refuse_resonance(ops, shifted, s, f)
                X = E - shifted(ops.apply_K(E) - s * ops.apply_M(E))
                blocks.append(X - Psi_b)
            for _ in range(self.order - (s > 0)):
                X = shifted(ops.apply_M(X))
                blocks.append(X)
        inner, _ = without_dependent(ops, np.hstack(blocks))
        K = ops.gram(inner, ops.apply_K(inner))
        lam, V = np.linalg.eigh(0.5 * (K + K.T))
        return np.hstack([Psi_b, inner @ V]), np.sqrt(lam), numbered("moment", lam.size)


def _refuse_resonance(ops: Operators, held: Held, s: float, f: float) -> None:
    """Two inverse iterations find an eigenvalue that is as close as round-off."""
    X = np.sin(1.0 + np.arange(ops.first, ops.first + ops.n_local))[:, None]
    for _ in range(2):
        X = held(ops.apply_M(X))
        X = X / np.sqrt(ops.gram(X, ops.apply_M(X)).item())
    gap = ops.gram(X, ops.apply_K(X)).item() - s
    if abs(gap) < RESONANCE_RTOL * s:
        text = f"{f:g} Hz is a natural frequency of the body with its interfaces held."
        raise SolverError(text, hint="Its answer there is infinite; choose one beside it.")
