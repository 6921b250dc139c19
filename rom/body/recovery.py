"""Stress of a reduced body, with the static correction for the modes left out."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rom.arguments import finite
from rom.eigen.connection import Connection
from rom.eigen.verbs import Operators, own_points
from rom.errors import ConfigError
from rom.model import Array, Basis, FEModel, SurfaceMesh

PRODUCTS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))  # of two angular velocities
AXIS_NAMES = "xyz"
CENTRIFUGAL_LOADS = tuple(
    f"omega_{AXIS_NAMES[i]}^2" if i == j else f"omega_{AXIS_NAMES[i]} omega_{AXIS_NAMES[j]}"
    for i, j in PRODUCTS
)
COUPLING_RTOL = 1e-7  # round-off of the stiffness between constraint modes and inner columns
N_FRAME_LOADS = 12  # acceleration, angular acceleration, products of angular velocities


@dataclass(frozen=True, slots=True)
class StressRecovery:
    """Stress on the outer surface as a function of the elastic coordinates.

    Rigid motion has none, so that it does not depend on the floating frame. The stress of modes
    that a reduction left out follows inertia without delay; the accelerations give it back.

    Source:
        The correction is the mode acceleration method, Craig and Kurdila, Fundamentals of
        Structural Dynamics (2006), applied to the inner dofs; Coriolis forces are left out.
    """

    points: Array  # (p, 3) undeformed positions [m]
    # (6 p, r) stress xx, yy, zz, yz, xz, xy in the body frame per unit of each elastic coordinate
    # [Pa]; row 6*node + component
    operator: Array
    # (6 p, 12 + r) stress of the modes left out per unit of what `accelerations` returns; None for
    # bases without constraint modes
    inertial: Array | None = None

    def field(self, q: Array, accelerations: Array | None = None) -> Array:
        """(p, 6) stress [Pa] for q (r,) and what `accelerations` returns; None for statics."""
        q = finite("q", q, self.operator.shape[1:])
        found: Array = self.operator @ q
        if accelerations is not None:
            if self.inertial is None:
                text = "the basis does not tell the stress of the modes it left out"
                raise ConfigError(f"{text}; reduce with CraigBampton and stress=True.")
            found = found + self.inertial @ np.asarray(accelerations, dtype=float)
        return found.reshape(-1, 6)

    def von_mises(self, q: Array, accelerations: Array | None = None) -> Array:
        """(p,) equivalent stress [Pa]; see `field`."""
        return von_mises(self.field(q, accelerations))

    def fits(self, r: int) -> bool:
        """Whether the arrays belong together, and to r coordinates."""
        n, A = len(self.points), self.inertial
        whole = self.points.shape == (n, 3) and self.operator.shape == (6 * n, r)
        return whole and (A is None or A.shape == (6 * n, N_FRAME_LOADS + r))

    @staticmethod
    def accelerations(a: Array, alpha: Array, omega: Array, qdd: Array) -> Array:
        """(12 + r,) what the stress of the modes left out depends on, axes of the body.

        Acceleration of the origin minus gravity a (3,) [m/s^2], alpha (3,), omega (3,), qdd (r,).
        """
        return np.concatenate([a, alpha, [omega[i] * omega[j] for i, j in PRODUCTS], qdd])

    def at(self, k: int) -> "StressRecovery":
        """At one point alone."""
        rows, A = slice(6 * k, 6 * k + 6), self.inertial
        found = self.points[k : k + 1], self.operator[rows], None if A is None else A[rows]
        return StressRecovery(*found)

    def moved(self, X: Array) -> "StressRecovery":
        """Seen from a frame that takes the rigid motion X (6, r) out of the shapes."""
        if self.inertial is None:
            return self
        A = self.inertial.copy()
        A[:, N_FRAME_LOADS:] -= A[:, :6] @ X
        return StressRecovery(self.points, self.operator, A)

    def recombined(self, V: Array) -> "StressRecovery":
        """For elastic coordinates q = V q_new."""
        A = self.inertial
        if A is not None:
            A = np.hstack([A[:, :N_FRAME_LOADS], A[:, N_FRAME_LOADS:] @ V])
        return StressRecovery(self.points, self.operator @ V, A)


def one_stress(parts: list[Any]) -> StressRecovery | None:
    """The stress of all parts; None unless every part has it, and so for what is left out."""
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return None
    inertial = [part.inertial for part in known if part.inertial is not None]
    return StressRecovery(
        np.vstack([part.points for part in known]),
        np.vstack([part.operator for part in known]),
        np.vstack(inertial) if len(inertial) == len(parts) else None,
    )


def with_elements(model: FEModel, what: str, otherwise: str = "") -> SurfaceMesh:
    """The surface of a model of finite elements, from which alone something follows."""
    if model.stresses is None or model.surface is None:
        text = f"the model has no finite elements, from which alone {what} follows"
        raise ConfigError(f"{text}; make it with rom.fe.model{otherwise}.")
    return model.surface


def von_mises(stress: Array) -> Array:
    """(p,) equivalent stress of (p, 6) stress xx, yy, zz, yz, xz, xy [Pa]."""
    xx, yy, zz, yz, xz, xy = stress.T
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.sqrt(0.5 * normal + 3 * (yz**2 + xz**2 + xy**2))


def centrifugal(points: Array) -> Array:
    """(3 p, 6) centrifugal acceleration of points per product of angular velocities."""
    out = np.zeros((points.shape[0], 3, 6))
    for k, (i, j) in enumerate(PRODUCTS):
        if i == j:
            out[:, :, k] = points
            out[:, i, k] = 0.0
        else:
            out[:, i, k], out[:, j, k] = -points[:, j], -points[:, i]
    return out.reshape(-1, 6)


def residual_motion(
    ops: Operators, connection: Connection, basis: Basis, holds: dict[str, Array], points: Array
) -> Array | None:
    """(n_local, 12 + r) displacement of the modes left out, in nodal dofs.

    With the interfaces held, the inner dofs answer inertia by -K_ii^-1 (M a)_i; what the inner
    columns of the basis can answer is taken out, because the elastic coordinates contain it. The
    interface coordinates of rigid and elastic motion are ``holds`` (n_c, 6 + r), points (n / 3, 3)
    are nodes [m]. None for a basis without constraint modes.
    """
    inner, n_b = connection.ops, connection.boundary.size
    Psi_b, Phi = basis.Psi[:, :n_b], basis.Psi[:, n_b:]
    if not n_b or basis.labels[:n_b] != connection.labels:
        return None
    K = inner.gram(basis.Psi, inner.apply_K(basis.Psi))
    size = np.sqrt(np.diag(K))
    if np.abs(K[:n_b, n_b:] / np.outer(size[:n_b], size[n_b:])).max(initial=0.0) > COUPLING_RTOL:
        return None
    r = next(iter(holds.values())).shape[1] - 6
    motion = np.zeros((n_b, 6 + r))
    for name, rows in connection.parts.items():
        motion[rows] = holds[name]
    F = inner.apply_M(Psi_b) @ motion
    pull = inner.restrict(ops.apply_M(centrifugal(own_points(ops, points))))
    F = np.hstack([-F[:, :6], pull, -F[:, 6:]])
    answer = inner.hold(connection.boundary)(F)
    if Phi.shape[1]:
        answer -= Phi @ np.linalg.solve(K[n_b:, n_b:], inner.gram(Phi, F))
    return inner.expand(answer)
