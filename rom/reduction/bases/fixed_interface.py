"""Fixed-interface component mode synthesis."""

from typing import Any

import numpy as np
import numpy.typing as npt

from rom.arguments import typed
from rom.eigen.scipy import SciPyOperators
from rom.eigen.verbs import Operators, constraint_modes
from rom.model import Basis


@typed
def craig_bampton(K: Any, M: Any, boundary: npt.ArrayLike, n_modes: int) -> Basis:
    """Constraint modes and fixed-interface normal modes.

    With the dofs split into boundary b and interior i, the basis is::

        Psi = [ I              0     ]   K_ii Phi_i = M_ii Phi_i diag(omega^2)
              [ -K_ii^-1 K_ib  Phi_i ]   Phi_i^T M_ii Phi_i = I

    Boundary dofs are eliminated, not penalised, so no artificial frequency enters the spectrum.

    Args:
        K: (n, n) stiffness [N/m], symmetric.
        M: (n, n) mass [kg], symmetric positive definite.
        boundary: (n_b,) distinct dof numbers that together stop every rigid motion.
        n_modes: number m of normal modes, 0 <= m <= n - n_b.

    Returns:
        Basis with ``Psi`` (n, n_b + m) and ``omega`` (m,) [rad/s].

    Raises:
        ConfigError: if the dof numbers or m do not fit the matrices.
        InterfaceError: if K_ii is singular.
        ModesMissedError: if a count says that a mode was skipped.

    Source:
        Craig and Bampton, Coupling of substructures for dynamic analyses, AIAA J. 6 (1968) 1313.

    Example:
        >>> K = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])  # three masses
        >>> basis = rom.craig_bampton(K, np.eye(3), [0, 2], n_modes=1)
        >>> basis.Psi[1].round(6), basis.omega.round(6)  # half of either end, and sqrt(2)
        (array([0.5, 0.5, 1. ]), array([1.414214]))
    """
    return fixed_interface(SciPyOperators(K, M), boundary, n_modes)


def fixed_interface(ops: Operators, boundary: npt.ArrayLike, n_modes: int) -> Basis:
    """`craig_bampton` on operators; K_ii is factored once for both kinds of columns."""
    b = np.asarray(boundary, dtype=np.int64).ravel()
    held = ops.hold(b)
    Psi_b = constraint_modes(ops, held, b)
    omega, Phi = ops.modes(held, n_modes)
    labels = [f"constraint {d}" for d in b] + [f"fixed-interface {k + 1}" for k in range(n_modes)]
    return Basis(np.hstack([Psi_b, Phi]), omega, tuple(labels))
