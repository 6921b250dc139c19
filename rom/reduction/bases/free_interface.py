"""Component modes of the free body: alone, with residual flexibility, and Herting's mixture."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, qr

from rom.arguments import typed, whole
from rom.eigen.verbs import Held, Operators, orthonormal, unit_motions, without_dependent
from rom.errors import InterfaceError
from rom.model import Array, Basis, Index
from rom.reduction.bases.fixed_interface import (
    Columns,
    Constrained,
    Counted,
    check_interfaces,
    numbered,
)

RIGID_RTOL = 1e-12  # eigenvalue of a rigid motion, of a rough vector's Rayleigh quotient
FLEXIBILITY_RTOL = 1e-12  # of the whole one: residual flexibility below is round-off


@typed
@dataclass(frozen=True, slots=True)
class Rubin(Counted):
    """Free-free modes, and what they leave of the static flexibility of the interfaces.

    Statics under interface loads is exact and the mass of the residual shapes is kept, so that the
    basis is that of Rubin and of Craig and Chang. Columns are combined so that the interface
    coordinates are coordinates of the basis, as for Craig and Bampton.

    Attributes:
        n_modes: number of elastic free-free modes.

    Source:
        Rubin, Improved component-mode representation for structural dynamic analysis, AIAA J. 13
        (1975) 995; Craig and Chang, NASA CR-145123 (1977); inertia relief after MacNeal, Comput.
        Struct. 1 (1971) 581.
    """

    def basis(self, ops: Operators, boundary: Index, labels: tuple[str, ...]) -> Basis:
        """The basis: columns of the interface dofs (n_b,), then rigid motions and free-free modes.

        Raises:
            ConfigError: without an interface, or for more modes than there are dofs.
            InterfaceError: if the interfaces depend on each other or on the modes kept.
        """
        check_interfaces(boundary, ops.n)
        R, omega, Phi = free_modes(ops, self.n_modes)
        G = residual_flexibility(ops, boundary, R, omega, Phi)
        Psi_b = _attached(ops, boundary, G)
        X = np.hstack([R, Phi])
        inner = X - Psi_b @ ops.rows(X, boundary)
        inner, kept = without_dependent(ops, inner)
        names = [*numbered("rigid", R.shape[1]), *numbered("free", omega.size)]
        return Basis(np.hstack([Psi_b, inner]), omega, (*labels, *(names[k] for k in kept)))


@typed
@dataclass(frozen=True, slots=True)
class Herting(Counted, Constrained):
    """Constraint modes, free-free modes with the interfaces brought back, and inertia relief.

    Attributes:
        n_modes: number of elastic free-free modes.

    Source:
        Herting, A general purpose, multi-stage, component modal synthesis method, Finite Elem.
        Anal. Des. 1 (1985) 153.
    """

    def _completed(self, ops: Operators, held: Held, Psi_b: Array, boundary: Index) -> Columns:
        R, omega, Phi = free_modes(ops, self.n_modes)
        relief = held(ops.apply_M(R))
        inner = np.hstack([relief, Phi - Psi_b @ ops.rows(Phi, boundary)])
        inner, kept = without_dependent(ops, inner)
        names = [*numbered("inertia relief", R.shape[1]), *numbered("free", omega.size)]
        return np.hstack([Psi_b, inner]), omega, [names[k] for k in kept]


@typed
@dataclass(frozen=True, slots=True)
class FreeFree(Counted):
    """Free-free modes alone: modal truncation, for bodies that no joint clamps.

    Every one of these shapes has no force and no moment at the interfaces. A joint that transmits
    moments is approached slowly (clamped beam: 35 % with two modes, 4 % with twenty) and finds no
    stress at all, so that a mechanism refuses it.

    Attributes:
        n_modes: number of elastic free-free modes.

    Source:
        O'Shea, Jayakumar, Mechergui, Shabana and Wang, J. Comput. Nonlinear Dynam. 13 (2018)
        041007, on reference conditions and the choice of modes.
    """

    def basis(self, ops: Operators, boundary: Index, labels: tuple[str, ...]) -> Basis:
        """The basis: rigid motions, then free-free modes; no column for the interface dofs (n_b,).

        Raises:
            ConfigError: for more modes than there are dofs.
        """
        R, omega, Phi = free_modes(ops, self.n_modes)
        names = [*numbered("rigid", R.shape[1]), *numbered("free", omega.size)]
        return Basis(np.hstack([R, Phi]), omega, tuple(names))


def free_modes(ops: Operators, n_modes: int) -> tuple[Array, Array, Array]:
    """Rigid motions (n_local, 6 or fewer), elastic frequencies [rad/s] and free-free modes.

    Without geometry the rigid motions are the modes whose stiffness is round-off.
    """
    n_rigid = 0 if ops.rigid is None else ops.rigid.shape[1]
    n_asked = n_modes + (n_rigid or 6)
    whole("n_modes", n_modes, 0, ops.n - (n_rigid or 6), reason="the dofs without rigid motions")
    omega, Phi = ops.modes((), n_asked)
    if ops.rigid is None:
        i = np.arange(ops.first, ops.first + ops.n_local)
        rough = (np.sin(1.0 + i) * (-1.0) ** i)[:, None]
        K, M = ops.gram(rough, ops.apply_K(rough)), ops.gram(rough, ops.apply_M(rough))
        n_rigid = int(np.count_nonzero(omega**2 < RIGID_RTOL * K.item() / M.item()))
    R = orthonormal(ops, Phi[:, :n_rigid])
    elastic = slice(n_rigid, n_rigid + n_modes)
    return R, omega[elastic], Phi[:, elastic]


def residual_flexibility(
    ops: Operators, boundary: Index, R: Array, omega: Array, Phi: Array
) -> Array:
    """(n_local, n_b) displacements under unit loads on the boundary that the modes leave out.

    Loads are balanced by the inertia of the rigid motions, the body is held at as many dofs as it
    has rigid motions, where balanced loads cause no reaction, and rigid motion is taken out.
    """
    F = unit_motions(ops, boundary)
    MR = ops.apply_M(R)
    X = ops.hold(_determinate(ops, boundary, R))(F - MR @ ops.gram(R, F))
    X = X - R @ ops.gram(MR, X)
    return X - Phi @ (ops.gram(Phi, F) / (omega**2)[:, None])


def _determinate(ops: Operators, boundary: Index, R: Array) -> Index:
    """As many boundary dofs as there are rigid motions, chosen to stop them best."""
    if not R.shape[1]:
        return np.zeros(0, dtype=np.int64)
    rows = ops.rows(R, boundary)
    _, U, pivots = qr(rows.T, mode="economic", pivoting=True)
    size = np.abs(np.diag(U))
    if rows.shape[0] < R.shape[1] or size[-1] < 1e-9 * size[0]:
        text = f"the {boundary.size} boundary dofs leave a rigid motion free."
        hint = "Name an interface with at least three nodes that do not lie on one line."
        raise InterfaceError(text, hint=hint)
    return np.sort(boundary[pivots[: R.shape[1]]])


def _attached(ops: Operators, boundary: Index, G: Array) -> Array:
    """Shapes of the residual flexibility with unit motion of one boundary dof each."""
    G_bb = ops.rows(G, boundary)
    G_bb = 0.5 * (G_bb + G_bb.T)
    scale = 1 / np.sqrt(np.maximum(np.diag(G_bb), np.finfo(float).tiny))
    lam = np.linalg.eigvalsh(scale[:, None] * G_bb * scale)
    if lam[0] < FLEXIBILITY_RTOL * lam[-1]:
        text = f"the residual flexibility of the {boundary.size} boundary dofs is singular"
        hint = "Ask for fewer modes, or give the interface fewer coordinates."
        raise InterfaceError(f"{text} ({lam[0] / lam[-1]:.1e}).", hint=hint)
    factor = cho_factor(scale[:, None] * G_bb * scale)
    return G @ (scale[:, None] * cho_solve(factor, np.diag(scale)))
