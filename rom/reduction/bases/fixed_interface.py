"""Fixed-interface component mode synthesis: what methods with constraint modes share."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.arguments import Modes, check_places, finite, typed
from rom.eigen.scipy import SciPyOperators
from rom.eigen.verbs import Held, Operators, constraint_modes, quadratic
from rom.errors import ConfigError
from rom.model import Array, Basis, Index

Columns = tuple[Array, Array, Sequence[str]]


@dataclass(frozen=True, slots=True)
class Counted:
    """A method that keeps so many modes."""

    n_modes: Modes


@typed
class Constrained:
    """A method that begins with constraint modes, interfaces held for all others."""

    __slots__ = ()

    def basis(self, ops: Operators, boundary: Index, labels: tuple[str, ...]) -> Basis:
        """The basis in interface coordinates; columns of the boundary (n_b,) first.

        Raises:
            ConfigError: without any interface, or for more modes than there are dofs.
            InterfaceError: if the interfaces leave a rigid motion free.
        """
        check_interfaces(boundary, ops.n)
        held = ops.hold(boundary)
        Psi_b = constraint_modes(ops, held, boundary)
        Psi, omega, names = self._completed(ops, held, Psi_b, boundary)
        return Basis(Psi, omega, (*labels, *names), held)

    @abstractmethod
    def _completed(self, ops: Operators, held: Held, Psi_b: Array, boundary: Index) -> Columns:
        """All columns, frequencies of the last ones [rad/s], and names of those behind Psi_b."""


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
    ops, b = SciPyOperators(K, M), np.asarray(boundary, dtype=np.int64).ravel()
    held = ops.hold(b)  # factored once for both kinds of columns
    Psi_b = constraint_modes(ops, held, b)
    omega, Phi = ops.modes(held, n_modes)
    labels = [*(f"constraint {d}" for d in b), *numbered("fixed-interface", n_modes)]
    return Basis(np.hstack([Psi_b, Phi]), omega, tuple(labels))


def numbered(what: str, n: int) -> list[str]:
    """Labels "what 1" to "what n"."""
    return [f"{what} {k + 1}" for k in range(n)]


def check_interfaces(boundary: Index, n: int) -> None:
    """Refuse no interface, or dofs (n_b,) of one beyond the n of the model."""
    if boundary.size == 0:
        text = "the method needs interfaces, and none is given"
        raise ConfigError(f'{text}: interfaces={{"a": "rbe2"}}.')
    finite("boundary", boundary, (None,))
    check_places("boundary", boundary, n)


def residual_shapes(ops: Operators, held: Held, Psi_b: Array, omega: Array, Phi: Array) -> Array:
    """(n_local, n_b) T_r = F_rs M Psi_b: answer of the modes left out to moving interfaces."""
    MPsi = ops.apply_M(Psi_b)
    return held(MPsi) - Phi @ (ops.gram(Phi, MPsi) / (omega**2)[:, None])


def projected(ops: Operators, T: Array) -> tuple[Array, Array]:
    """(r, r) stiffness and mass T^T K T and T^T M T, symmetric."""
    K, M = quadratic(ops, ops.apply_K, T), quadratic(ops, ops.apply_M, T)
    return 0.5 * (K + K.T), 0.5 * (M + M.T)
