"""Craig-Bampton modes corrected by the residual modes left out."""

from dataclasses import dataclass

import numpy as np

from rom.arguments import Modes, typed
from rom.eigen.verbs import Held, Operators, constraint_modes, quadratic
from rom.model import Array, Basis, Index
from rom.reduction.bases.free_interface import check_interfaces, numbered


@typed
@dataclass(frozen=True, slots=True)
class EnhancedCraigBampton:
    """Craig-Bampton of the same size, its columns corrected to first order in the eigenvalue.

    With F_rs the flexibility of the fixed-interface modes left out and T_r = F_rs M Psi_b, the
    substitution of the eigenvalue by H = M_0^-1 K_0 gives T_1 = T_0 + T_r H. Low frequencies of
    the free body gain orders of magnitude; supports and statics under interface loads lose, and the
    certificate says so. In an assembly or joints H had to be that of the whole, which a body made
    by itself cannot know: its frequencies are off by per cents there, and `rom.Assembly` warns.
    `MomentMatching` ``((0.0,), 2)`` has T_r as columns of their own, which serve everywhere.

    Attributes:
        n_modes: number of fixed-interface modes.

    Raises:
        ConfigError: if n_modes is no number of modes.

    Source:
        Kim and Lee, An enhanced Craig-Bampton method, Int. J. Numer. Meth. Eng. 103 (2015) 79.
    """

    n_modes: Modes

    def basis(self, ops: Operators, boundary: Index, labels: tuple[str, ...]) -> Basis:
        """The basis for the interface dofs (n_b,); their columns first.

        Raises:
            ConfigError: without an interface, or for too many modes.
            InterfaceError: if the interfaces leave a rigid motion free.
        """
        check_interfaces(boundary, ops.n)
        held = ops.hold(boundary)
        Psi_b = constraint_modes(ops, held, boundary)
        omega, Phi = ops.modes(held, self.n_modes)
        T0 = np.hstack([Psi_b, Phi])
        K0, M0 = projected(ops, T0)
        H = np.linalg.solve(M0, K0)
        T0 += residual_shapes(ops, held, Psi_b, omega, Phi) @ H[: boundary.size]
        return Basis(T0, omega, (*labels, *numbered("enhanced", omega.size)), held)


def residual_shapes(ops: Operators, held: Held, Psi_b: Array, omega: Array, Phi: Array) -> Array:
    """(n_local, n_b) T_r = F_rs M Psi_b: answer of the modes left out to moving interfaces."""
    MPsi = ops.apply_M(Psi_b)
    return held(MPsi) - Phi @ (ops.gram(Phi, MPsi) / (omega**2)[:, None])


def projected(ops: Operators, T: Array) -> tuple[Array, Array]:
    """(r, r) stiffness and mass T^T K T and T^T M T, symmetric."""
    K, M = quadratic(ops, ops.apply_K, T), quadratic(ops, ops.apply_M, T)
    return 0.5 * (K + K.T), 0.5 * (M + M.T)
